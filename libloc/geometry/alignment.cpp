#include "libloc/geometry/alignment.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <limits>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

using Points = std::span<const Eigen::Vector3d>;
using Svd = Eigen::JacobiSVD<Eigen::Matrix3d>;

// Extents below these are rounding: relative to the largest coordinate, and to the largest extent.
constexpr double kNoExtentRelative = 1e-11;
constexpr double kCollinearRelative = 1e-6;
// Relative to the product of both sets' extents.
constexpr double kAmbiguousRelative = 1e-12;

struct PointSet {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();  // 1/n sum (p - mean)(p - mean)^T
  Eigen::Vector3d extent = Eigen::Vector3d::Zero();   // roots of its eigenvalues, the largest first
  double largest_coordinate = 0;
};

PointSet describe(Points points) {
  PointSet set;
  const auto n = static_cast<double>(points.size());
  for (const Eigen::Vector3d& p : points) {
    set.mean += p / n;
    set.largest_coordinate = std::max(set.largest_coordinate, p.cwiseAbs().maxCoeff());
  }
  for (const Eigen::Vector3d& p : points) set.scatter += (p - set.mean) * (p - set.mean).transpose() / n;
  // Of a symmetric positive matrix, singular values are eigenvalues.
  set.extent = Svd(set.scatter).singularValues().cwiseSqrt();
  return set;
}

void check_points(std::string_view name, Points points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    require(points[i].allFinite(),
            "align_points: " + std::string(name) + " point " + std::to_string(i) + ": must be finite");
  }
}

AlignmentFailure failure_of(const PointSet& set, AlignmentMode mode) {
  const double rounding = kNoExtentRelative * set.largest_coordinate;
  if (mode == AlignmentMode::kYaw) {
    const double horizontal = std::sqrt(set.scatter(0, 0) + set.scatter(1, 1));
    return horizontal > rounding ? AlignmentFailure::kNone : AlignmentFailure::kNoExtent;
  }
  if (!(set.extent[0] > rounding)) return AlignmentFailure::kNoExtent;
  if (!(set.extent[1] > std::max(rounding, kCollinearRelative * set.extent[0]))) return AlignmentFailure::kCollinear;
  return AlignmentFailure::kNone;
}

double rms_residual(const Alignment& alignment, Points estimate, Points reference) {
  double sum = 0;
  for (std::size_t i = 0; i < estimate.size(); ++i) sum += (reference[i] - alignment * estimate[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(estimate.size()));
}

// Rotation about z that maximises sum r . (R e) over the horizontal parts.
AlignmentFailure solve_yaw(const Eigen::Matrix3d& covariance, double size, Alignment& result) {
  const double cosine = covariance(0, 0) + covariance(1, 1);
  const double sine = covariance(1, 0) - covariance(0, 1);
  if (!(std::hypot(cosine, sine) > kAmbiguousRelative * size)) return AlignmentFailure::kAmbiguous;
  result.T_reference_estimate.rotation = so3::exp({0, 0, std::atan2(sine, cosine)});
  return AlignmentFailure::kNone;
}

AlignmentFailure solve_umeyama(const Eigen::Matrix3d& covariance, const PointSet& estimate, double size,
                               bool with_scale, Alignment& result) {
  const Svd svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);  // equation 38
  const Eigen::Vector3d& d = svd.singularValues();
  // Equation 43: the smallest axis is turned over where U V^T would be a reflection.
  const double sign = svd.matrixU().determinant() * svd.matrixV().determinant() < 0 ? -1 : 1;
  // The rotation is unique when turning over two more axes costs something.
  if (!(d[1] + sign * d[2] > kAmbiguousRelative * size)) return AlignmentFailure::kAmbiguous;
  const Eigen::Vector3d s(1, 1, sign);
  const Eigen::Matrix3d r = svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose();  // equation 40
  result.T_reference_estimate.rotation = Eigen::Quaterniond(r).normalized();
  if (with_scale) result.scale = d.dot(s) / estimate.scatter.trace();  // equation 42
  return AlignmentFailure::kNone;
}

Alignment failed(AlignmentFailure failure, const Eigen::Vector3d& extent) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  return {failure, {{kNan, kNan, kNan, kNan}, Eigen::Vector3d::Constant(kNan)}, kNan, kNan, extent};
}

}  // namespace

const char* alignment_name(AlignmentMode mode) {
  switch (mode) {
    case AlignmentMode::kNone:
      return "none";
    case AlignmentMode::kSe3:
      return "se3";
    case AlignmentMode::kSim3:
      return "sim3";
    case AlignmentMode::kYaw:
      return "yaw";
  }
  return "unknown";
}

const char* alignment_failure_text(AlignmentFailure failure) {
  switch (failure) {
    case AlignmentFailure::kNone:
      return "no failure";
    case AlignmentFailure::kTooFewPoints:
      return "too few points (three are needed, two for a turn about z)";
    case AlignmentFailure::kNoExtent:
      return "all points are in one place (for a turn about z: on one vertical line)";
    case AlignmentFailure::kCollinear:
      return "all points are on one line, the turn about it cannot be determined";
    case AlignmentFailure::kAmbiguous:
      return "the point sets are so unlike that several rotations fit equally well";
  }
  return "unknown";
}

Alignment align_points(Points estimate, Points reference, AlignmentMode mode) {
  require(estimate.size() == reference.size(), "align_points: " + std::to_string(estimate.size()) +
                                                   " points of the estimate, but " + std::to_string(reference.size()) +
                                                   " of the reference");
  require(!estimate.empty(), "align_points: no points");
  check_points("estimate", estimate);
  check_points("reference", reference);

  const PointSet from = describe(estimate);
  const PointSet to = describe(reference);
  Alignment result;
  result.extent = to.extent;
  if (mode != AlignmentMode::kNone) {
    if (estimate.size() < (mode == AlignmentMode::kYaw ? 2U : 3U)) {
      return failed(AlignmentFailure::kTooFewPoints, to.extent);
    }
    for (const PointSet* set : {&from, &to}) {
      const AlignmentFailure failure = failure_of(*set, mode);
      if (failure != AlignmentFailure::kNone) return failed(failure, to.extent);
    }
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < estimate.size(); ++i) {
      covariance += (reference[i] - to.mean) * (estimate[i] - from.mean).transpose();
    }
    covariance /= static_cast<double>(estimate.size());
    const double size = std::sqrt(from.scatter.trace() * to.scatter.trace());
    const AlignmentFailure failure = mode == AlignmentMode::kYaw
                                         ? solve_yaw(covariance, size, result)
                                         : solve_umeyama(covariance, from, size, mode == AlignmentMode::kSim3, result);
    if (failure != AlignmentFailure::kNone) return failed(failure, to.extent);
    // Equation 41.
    result.T_reference_estimate.translation =
        to.mean - result.T_reference_estimate.rotation * (result.scale * from.mean);
  }
  result.rms_residual = rms_residual(result, estimate, reference);
  return result;
}

}  // namespace loc
