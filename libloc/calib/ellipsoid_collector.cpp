#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "libloc/calib/ellipsoid.hpp"
#include "libloc/calib/ellipsoid_detail.hpp"
#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr int kEnoughCells = 50;

Eigen::Vector3d middle(const std::vector<Eigen::Vector3d>& readings) {
  Eigen::Vector3d low = readings.front();
  Eigen::Vector3d high = low;
  for (const Eigen::Vector3d& r : readings) {
    low = low.cwiseMin(r);
    high = high.cwiseMax(r);
  }
  return low / 2 + high / 2;
}

// "+x" … "-z", whichever is nearest.
std::string axis_name(const Eigen::Vector3d& direction) {
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return std::string(direction[axis] < 0 ? "-" : "+") + "xyz"[axis];
}

}  // namespace

EllipsoidCollector::EllipsoidCollector(EllipsoidOptions options, int readings_per_cell)
    : options_(options), readings_per_cell_(readings_per_cell) {
  options_.check();
  require(readings_per_cell > 0, "readings_per_cell", readings_per_cell, "must be positive");
  buffer_.reserve(capacity());
}

std::size_t EllipsoidCollector::capacity() const {
  return 2 * static_cast<std::size_t>(readings_per_cell_) * SphereCoverage::kCells;
}

bool EllipsoidCollector::add(const Eigen::Vector3d& reading) {
  ++received_;
  if (!reading.allFinite()) {
    ++not_finite_;
    return false;
  }
  if (buffer_.size() == capacity()) buffer_ = kept();
  buffer_.push_back(reading);
  return true;
}

// The latest of each cell, seen from the middle of all; in the order in which they came.
std::vector<Eigen::Vector3d> EllipsoidCollector::kept() const {
  std::vector<Eigen::Vector3d> out;
  out.reserve(capacity());
  if (buffer_.empty()) return out;
  const Eigen::Vector3d centre = middle(buffer_);
  std::array<int, SphereCoverage::kCells> count{};
  for (auto reading = buffer_.rbegin(); reading != buffer_.rend(); ++reading) {
    const Eigen::Vector3d direction = *reading - centre;
    if (!(direction.norm() > 0)) continue;
    if (++count[static_cast<std::size_t>(SphereCoverage::cell(direction))] <= readings_per_cell_)
      out.push_back(*reading);
  }
  std::reverse(out.begin(), out.end());
  return out;
}

EllipsoidFit EllipsoidCollector::fit() const {
  const std::vector<Eigen::Vector3d> readings = kept();
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> rows(static_cast<Eigen::Index>(readings.size()), 3);
  for (std::size_t i = 0; i < readings.size(); ++i) rows.row(static_cast<Eigen::Index>(i)) = readings[i].transpose();
  EllipsoidFit fit = fit_ellipsoid(rows, options_);
  fit.not_finite = not_finite_;
  return fit;
}

EllipsoidAdvice EllipsoidCollector::advice(const EllipsoidFit& fit) const {
  EllipsoidAdvice advice;
  if (buffer_.empty()) {
    advice.text = "No readings yet.";
    return advice;
  }
  if (!fit.is_ellipsoid || !fit.cov.allFinite()) {
    advice.text = "Turn the device slowly about one axis after the other.";
    return advice;
  }
  const int cells = fit.coverage.cells_hit();
  if (fit.quality.verdict == Verdict::kOk && cells >= kEnoughCells) {
    advice.enough = true;
    advice.text = "Enough.";
    return advice;
  }
  // Where a reading would tell most: the point of the ellipsoid that the fit knows least, of those not seen yet.
  const detail::Ellipsoid e{.centre = fit.centre, .matrix = fit.matrix / fit.reference_norm};
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(e.matrix);
  detail::Matrix9 cov = fit.cov;
  cov.bottomRows<6>() /= fit.reference_norm;
  cov.rightCols<6>() /= fit.reference_norm;
  double most = -1;
  for (int cell = 0; cell < SphereCoverage::kCells; ++cell) {
    if (fit.coverage.hits[static_cast<std::size_t>(cell)] > 0) continue;
    const Eigen::Vector3d direction = SphereCoverage::direction(cell);
    double distance = 0;
    detail::Vector9 jacobian;
    detail::sampson_distance(e, e.centre + ldlt.solve(direction), distance, &jacobian);
    const double variance = jacobian.dot(cov * jacobian);
    if (variance > most) {
      most = variance;
      advice.missing_direction = direction;
    }
  }
  if (most < 0) {
    advice.text = "Every direction was seen: keep turning slowly, away from iron and currents.";
    return advice;
  }
  const Eigen::Vector3d now = (fit.matrix * (buffer_.back() - fit.centre)).normalized();
  // The field stands still and the device turns: to bring the missing direction where the field is now, it turns about
  // this axis.
  const Eigen::Vector3d axis = advice.missing_direction.cross(now);
  const Eigen::Vector3d other = advice.missing_direction.unitOrthogonal();
  advice.turn_axis = axis.norm() > 1e-3 ? Eigen::Vector3d(axis.normalized()) : other;
  const double angle = std::atan2(axis.norm(), advice.missing_direction.dot(now));
  advice.text = "Turn about the sensor's " + axis_name(advice.turn_axis) + " axis by about " +
                std::to_string(static_cast<int>(std::round(angle * 18 / M_PI)) * 10) + " deg, until its " +
                axis_name(advice.missing_direction) + " axis points along the field (" + std::to_string(cells) +
                " of " + std::to_string(SphereCoverage::kCells) + " cells seen).";
  return advice;
}

}  // namespace loc
