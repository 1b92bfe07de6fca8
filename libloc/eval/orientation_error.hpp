// Error of estimated orientations, split into heading and inclination, as the BROAD data set defines it:
//   q_err = q_estimate * conj(q_reference), in world axes (w, x, y, z)
//   total = 2 acos |w|,  heading = 2 atan |z / w|,  inclination = 2 acos sqrt(w^2 + z^2)
// World's z axis must be vertical (up or down). Inclination does not depend on any turn about it; heading is the turn
// about z that is left when the inclination is removed.
// Source: Laidig, Caruso, Cereatti, Seel, "BROAD - A benchmark for robust inertial orientation estimation", Data 6(7),
// 2021.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

namespace loc {

struct OrientationErrorOptions {
  /// Remove the constant turn about z that the scored samples have in common (their circular mean) first: for
  /// estimates without magnetometer, whose heading is relative to the start.
  bool align_heading = false;
};

struct OrientationError {
  // One value for each sample given [rad], in [0, pi]; NaN where an orientation is not finite. Samples outside the mask
  // have values too, but are not in the RMSE.
  std::vector<double> total;
  std::vector<double> heading;
  std::vector<double> inclination;

  double total_rmse = 0;        ///< [rad]
  double heading_rmse = 0;      ///< [rad]
  double inclination_rmse = 0;  ///< [rad]
  double heading_offset = 0;    ///< [rad] that was removed from the estimate; 0 without align_heading

  std::int64_t scored = 0;                ///< samples in the RMSE
  std::int64_t masked = 0;                ///< left out: outside the mask
  std::int64_t estimate_not_finite = 0;   ///< left out, inside the mask
  std::int64_t reference_not_finite = 0;  ///< left out, inside the mask, the estimate being finite
};

/// @param estimate, reference q_world_body of the same times; NaN where unknown
/// @param mask not zero where to score (BROAD: movement); empty scores everywhere
/// @throws std::invalid_argument when sizes differ, DataError when a finite quaternion does not have norm 1 (to 1e-3)
/// or no sample is left to score.
OrientationError orientation_error(std::span<const Eigen::Quaterniond> estimate,
                                   std::span<const Eigen::Quaterniond> reference,
                                   std::span<const std::uint8_t> mask = {},
                                   const OrientationErrorOptions& options = {});

}  // namespace loc
