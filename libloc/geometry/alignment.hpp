// Transform between two sets of points that belong together in pairs, in the least-squares sense:
//   minimise sum |reference_i - (scale * R * estimate_i + t)|^2
// over SE(3) (scale 1), Sim(3), or a turn about world z and a translation (the four degrees of freedom that an
// estimator with gravity but without heading and position leaves open).
// Source: S. Umeyama, "Least-squares estimation of transformation parameters between two point patterns", IEEE PAMI
// 13(4), 1991, equations 34-43; the turn about z is the two-dimensional case with z left as it is.
#pragma once

#include <Eigen/Core>
#include <span>

#include "libloc/geometry/pose3.hpp"

namespace loc {

enum class AlignmentMode { kNone, kSe3, kSim3, kYaw };
const char* alignment_name(AlignmentMode mode);  ///< "none", "se3", "sim3", "yaw"

/// Why points do not determine a transform.
enum class AlignmentFailure {
  kNone,
  kTooFewPoints,  ///< fewer than three (yaw: two)
  kNoExtent,      ///< all points of a set are one point (yaw: one vertical line)
  kCollinear,     ///< all points of a set are on one line: the turn about it is free
  kAmbiguous,     ///< the sets are so unlike that several rotations fit equally well
};
/// A sentence for reports.
const char* alignment_failure_text(AlignmentFailure failure);

struct Alignment {
  AlignmentFailure failure = AlignmentFailure::kNone;
  Pose3 T_reference_estimate;  ///< NaN when failed
  double scale = 1;            ///< reference = T * (scale * estimate); NaN when failed
  double rms_residual = 0;     ///< [m] root mean square distance after the alignment; NaN when failed
  /// Deviations of the reference points along their principal axes, the largest first [m]: how well the set determines
  /// a rotation, where it does at all.
  Eigen::Vector3d extent = Eigen::Vector3d::Zero();

  bool ok() const { return failure == AlignmentFailure::kNone; }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return T_reference_estimate * (scale * point); }
  /// A pose of the estimate in the reference's world; its translation is scaled, its rotation turned.
  Pose3 operator*(const Pose3& pose) const {
    return T_reference_estimate * Pose3{pose.rotation, scale * pose.translation};
  }
};

/// @param estimate, reference points that belong together, in one unit
/// @returns with mode kNone identity and the residual of the points as they are
/// @throws std::invalid_argument when the sets differ in size, are empty or hold a value that is not finite.
Alignment align_points(std::span<const Eigen::Vector3d> estimate, std::span<const Eigen::Vector3d> reference,
                       AlignmentMode mode);

}  // namespace loc
