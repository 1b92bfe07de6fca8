// True motion of a body: what the simulated sensors measure, without any noise. Every quantity is analytic (no finite
// differences) and belongs to one curve: velocity is the derivative of position, angular velocity that of the attitude.
// All are continuous in time, but for motions through way-points (waypoint_motion.hpp), whose acceleration and rates
// may jump there. Frames: world is ENU (z up), body is whatever the motion says (vehicles: x forward, y left, z up).
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "libloc/geometry/pose3.hpp"

namespace loc {

/// The body at one moment.
struct MotionState {
  double time_s = 0;                                               ///< since the start of the motion
  Pose3 T_world_body;                                              ///< attitude and position [m]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();              ///< in world [m/s]
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();          ///< in world, gravity not included [m/s^2]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();      ///< of body, in body axes [rad/s]
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();  ///< of body, in body axes [rad/s^2]
};

/// @throws std::invalid_argument naming the pose, unless it is finite and its rotation of norm 1 (to 1e-6).
void require_rigid(std::string_view name, const Pose3& pose);

/// A motion is asked for its state at any time, in any order; the same time gives the same state.
class Motion {
 public:
  Motion() = default;
  Motion(const Motion&) = delete;
  Motion& operator=(const Motion&) = delete;
  virtual ~Motion() = default;

  /// Length [s]; infinity for motions that go on for ever.
  virtual double duration_s() const = 0;
  /// @param time_s within [0, duration_s()] @throws std::invalid_argument outside.
  virtual MotionState at(double time_s) const = 0;

 protected:
  /// @throws std::invalid_argument naming the time, unless it is in [0, duration_s()].
  void check_time(double time_s) const;
};

}  // namespace loc
