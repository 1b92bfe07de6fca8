#include "libloc/calib/gyroscope_start.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "libloc/core/statistics.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr double kSmallestTurn = 0.2;  // [rad]
constexpr double kGoodStart = 0.15;    // [rad], median residual with which the search for other axes is left out

/// Integrals of the raw rate over short times: a start does not need every sample.
std::vector<Eigen::Vector3d> coarse(const std::vector<RateStep>& steps) {
  constexpr double kLength = 0.04;  // [s]
  std::vector<Eigen::Vector3d> out;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double time = 0;
  for (const RateStep& step : steps) {
    sum += step.dt_s / 2 * (step.begin + step.end);
    time += step.dt_s;
    if (time < kLength) continue;
    out.push_back(sum);
    sum.setZero();
    time = 0;
  }
  out.push_back(sum);
  return out;
}

struct Turn {
  std::vector<Eigen::Vector3d> parts;
  Eigen::Vector3d before;
  Eigen::Vector3d after;
};

double median_residual(const std::vector<Turn>& turns, const Eigen::Matrix3d& matrix) {
  std::vector<double> angles;
  for (const Turn& turn : turns) {
    Eigen::Vector3d u = turn.before;
    for (const Eigen::Vector3d& part : turn.parts) u = so3::exp(-(matrix * part)) * u;
    angles.push_back(std::atan2(u.cross(turn.after).norm(), u.dot(turn.after)));
  }
  return quantile(angles, 0.5);
}

}  // namespace

std::optional<Eigen::Matrix3d> gyroscope_start(const std::vector<std::vector<RateStep>>& steps,
                                               const std::vector<std::size_t>& turns,
                                               const std::vector<Eigen::Vector3d>& up) {
  std::vector<Turn> list;
  std::vector<double> ratios;
  for (std::size_t k = 0; k < turns.size(); ++k) {
    list.push_back({.parts = coarse(steps[k]), .before = up[turns[k]], .after = up[turns[k] + 1]});
    const Turn& turn = list.back();
    const double angle = std::atan2(turn.before.cross(turn.after).norm(), turn.before.dot(turn.after));
    double path = 0;
    for (const Eigen::Vector3d& part : turn.parts) path += part.norm();
    if (angle > kSmallestTurn && std::isfinite(path) && path > 0) ratios.push_back(angle / path);
  }
  if (ratios.size() < 3) return std::nullopt;
  // The way is never shorter than the angle by which gravity turned, and mostly not many times longer.
  const double shortest = quantile(ratios, 0.5);
  Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
  double least = std::numeric_limits<double>::infinity();
  const auto try_axes = [&](const Eigen::Matrix3d& axes) {
    for (double scale = 0.8 * shortest; scale < 4 * shortest; scale *= 1.04) {
      const double residual = median_residual(list, scale * axes);
      if (residual < least) {
        least = residual;
        best = scale * axes;
      }
    }
  };
  try_axes(Eigen::Matrix3d::Identity());
  if (least < kGoodStart) return best;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) {
        axes(row, order[static_cast<std::size_t>(row)]) = ((signs >> row) & 1) != 0 ? -1 : 1;
      }
      try_axes(axes);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return best;
}

}  // namespace loc
