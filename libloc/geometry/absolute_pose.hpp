// Pose of a camera from points at known places and the directions in which it sees them, from any start and with wrong
// pairs among them: orthogonal iteration, with weights that narrow down to those that fit.
//   minimise sum w_j |(I - b_j b_j^T) R^T (X_j - r)|^2 / depth_j^2,   w = 1 / (1 + e^2 / width^2)^2
// Given R the best r follows from three linear equations; given r, the best R turns the directions b_j into those
// towards the points (Wahba's problem). Source: C.-P. Lu, G. Hager, E. Mjolsness, "Fast and globally convergent pose
// estimation from video images", IEEE PAMI 22, 2000; the weights are Geman and McClure's.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "libloc/geometry/pose3.hpp"

namespace loc {

struct SightedPoint {
  Eigen::Vector3d position;   ///< in world [m]
  Eigen::Vector3d direction;  ///< unit vector in camera
};

struct AbsolutePoseOptions {
  int max_rounds = 60;
  double first_width = 1;    ///< of the weights: angle of a pair that counts a quarter [rad]
  double last_width = 0.01;  ///< the same in the end [rad]
  double min_fitting = 0.5;  ///< share of the pairs that must be within two last widths
};

/// T_world_camera. nullopt: fewer than four points, all in one line, or too few that fit. Allocates nothing.
/// @param start where to begin; far off does no harm
std::optional<Pose3> absolute_pose(std::span<const SightedPoint> points, const Pose3& start,
                                   const AbsolutePoseOptions& options = {});

}  // namespace loc
