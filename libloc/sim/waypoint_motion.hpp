// A ground vehicle that passes way-points at given times. Piecewise, between neighbours:
//   horizontal path  the clothoid that joins the points with their courses (clothoid.hpp)
//   distance         along the path, a cubic in time with the speeds at both ends
//   height           a cubic in time: with the vertical velocities when velocities are given, else shape-preserving
//   attitude         x along the horizontal path (yaw = course), y left, z up: no pitch and no bank
// Without velocities the speeds are those of the shape-preserving cubic through distances and times. A course comes
// from the horizontal velocity, where that is zero from courses_rad, else it is estimated so that the curvature of the
// path is continuous where it does not zigzag (clothoid_path.hpp).
// The same place twice, one after the other, is a stop: the vehicle waits there with zero velocity.
// Not smooth at way-points, as with every cubic of distance over time: the acceleration along the path jumps; where
// the course was given, the curvature too, and with it lateral acceleration and yaw rate. At such a time the state is
// that of the piece which begins.
// Frames: world ENU; body x forward, y left, z up.
#pragma once

#include <optional>
#include <vector>

#include "libloc/sim/clothoid_path.hpp"
#include "libloc/sim/motion.hpp"
#include "libloc/sim/piecewise_cubic.hpp"

namespace loc {

struct WaypointOptions {
  std::vector<double> times_s;              ///< of arrival, increasing; the first is 0
  std::vector<Eigen::Vector3d> positions;   ///< in world [m], as many, at least two
  std::vector<Eigen::Vector3d> velocities;  ///< in world [m/s], as many, or none: estimated
  /// From x (east) towards y (north) [rad], as many, or none. Where the horizontal velocity is not zero it must agree.
  std::vector<std::optional<double>> courses_rad;

  /// @throws std::invalid_argument naming index and value.
  void check() const;
};

/// The drive of the example "Visual-Inertial Odometry Using Synthetic Data": 11 way-points, 90 s, about 10 m/s.
WaypointOptions example_drive();

class WaypointMotion : public Motion {
 public:
  /// @throws std::invalid_argument naming index and value: as check(); where speeds and times would make the vehicle
  /// go backwards between way-points; where no course is found.
  explicit WaypointMotion(const WaypointOptions& options);

  double duration_s() const override { return distance_->knots().back(); }
  MotionState at(double time_s) const override;

  /// Courses at the way-points as used, without steps of two pi [rad].
  const std::vector<double>& courses() const { return courses_; }
  /// Length of the horizontal path [m].
  double length() const;

 private:
  std::vector<double> courses_;
  std::vector<Clothoid> pieces_;  // one for each interval of time; where the vehicle waits, of no length
  std::vector<double> starts_;    // distance at their beginnings [m]
  std::optional<PiecewiseCubic> distance_;
  std::optional<PiecewiseCubic> height_;
};

}  // namespace loc
