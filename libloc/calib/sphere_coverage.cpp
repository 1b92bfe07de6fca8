#include "libloc/calib/sphere_coverage.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libloc/core/check.hpp"

namespace loc {

int SphereCoverage::cell(const Eigen::Vector3d& direction) {
  const double length = direction.norm();
  require(std::isfinite(length) && length > 0, "length of a direction", length, "must be positive and finite");
  // Equal height in z is equal area (Archimedes).
  const double height = (direction.z() / length + 1) / 2;
  const double turn = std::atan2(direction.y(), direction.x()) / (2 * std::numbers::pi);
  const int band = std::clamp(static_cast<int>(height * kBands), 0, kBands - 1);
  const int sector = std::clamp(static_cast<int>((turn < 0 ? turn + 1 : turn) * kSectors), 0, kSectors - 1);
  return band * kSectors + sector;
}

Eigen::Vector3d SphereCoverage::direction(int cell) {
  require(cell >= 0 && cell < kCells, "cell", cell, "must be in [0, 100)");
  const double z = 2 * (cell / kSectors + 0.5) / kBands - 1;
  const double azimuth = 2 * std::numbers::pi * (cell % kSectors + 0.5) / kSectors;
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(azimuth), r * std::sin(azimuth), z};
}

int SphereCoverage::cells_hit() const {
  return static_cast<int>(std::count_if(hits.begin(), hits.end(), [](std::int32_t n) { return n > 0; }));
}

}  // namespace loc
