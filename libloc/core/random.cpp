#include "libloc/core/random.hpp"

#include <cmath>

namespace loc {

Random Random::fork(std::uint64_t stream) {
  // splitmix64 finaliser: neighbouring stream numbers give unrelated seeds.
  std::uint64_t z = engine_() + 0x9e3779b97f4a7c15ULL * (stream + 1);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return Random(z ^ (z >> 31));
}

double Random::uniform() {
  return static_cast<double>(engine_() >> 11) * 0x1.0p-53;
}

double Random::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  double u = 0;
  double v = 0;
  double s = 0;
  do {
    u = uniform(-1, 1);
    v = uniform(-1, 1);
    s = u * u + v * v;
  } while (s >= 1 || s == 0);
  const double factor = std::sqrt(-2 * std::log(s) / s);
  spare_ = v * factor;
  has_spare_ = true;
  return u * factor;
}

Eigen::Vector3d Random::normal3() {
  // One statement each: the order in which a constructor's arguments are evaluated is not specified.
  const double x = normal();
  const double y = normal();
  const double z = normal();
  return {x, y, z};
}

Eigen::Vector3d Random::direction() {
  return normal3().normalized();
}

Eigen::Quaterniond Random::rotation() {
  const double w = normal();
  const Eigen::Vector3d v = normal3();
  return Eigen::Quaterniond(w, v.x(), v.y(), v.z()).normalized();
}

}  // namespace loc
