// A camera that moves past given positions and looks at given points: both are splines through the knots with two
// continuous derivatives (PiecewiseCubic::spline), so that velocity, acceleration, angular velocity and angular
// acceleration are continuous. The attitude: z from the camera to the point looked at, x to the right at right angles
// to it and to up, y down. Frames: world as the positions are; body = camera (x right, y down, z forward). Source: K.
// Popov, "Monocular simultaneous location and mapping based on recursive filtering", St Petersburg State University,
// 2015, section 3.1, which gives camera and look-at points; the splines are ours.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "libloc/sim/motion.hpp"
#include "libloc/sim/piecewise_cubic.hpp"

namespace loc {

struct LookAtOptions {
  std::vector<double> times_s;             ///< increasing, at least two; the first is 0
  std::vector<Eigen::Vector3d> positions;  ///< of the camera in world [m], as many
  std::vector<Eigen::Vector3d> look_at;    ///< in world [m], as many
  Eigen::Vector3d up{0, 0, 1};             ///< in world, of any length but zero; the image's y points against it
  double smallest_distance_m = 1e-2;       ///< from the camera to the point looked at, at all times
  double smallest_angle_rad = 1e-2;        ///< between the look direction and up or down, at all times

  void check() const;  ///< @throws std::invalid_argument naming index and value.
};

class LookAtMotion : public Motion {
 public:
  /// @throws std::invalid_argument as check(); and naming the first time, at or between knots, at which the camera
  /// comes too close to the point that it looks at or looks too steeply up or down.
  explicit LookAtMotion(const LookAtOptions& options);

  double duration_s() const override { return position_.front().knots().back(); }
  /// T_world_body is T_world_camera.
  MotionState at(double time_s) const override;

 private:
  void check_directions(const LookAtOptions& options) const;

  std::vector<PiecewiseCubic> position_;  // x, y, z
  std::vector<PiecewiseCubic> look_at_;
  Eigen::Vector3d up_;  // unit
};

}  // namespace loc
