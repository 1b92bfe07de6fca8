// The head of the SLAM filter's state: how the body moves, and, where they are estimated, the camera's place in it and
// its clock. Propagation by one of two models; the features do not care which.
//
// Errors: theta (0), position (3), velocity (6), then
//   camera alone   angular velocity (9): 12
//   with an IMU    gyroscope bias (9), accelerometer bias (12): 15, as in filter/imu_propagation.hpp
// and after them, where estimated, rotation and place of the camera in body (6), clock of the camera (1).
//   constant velocity   q = q Exp(w dt), p = p + v dt, white acceleration (world) and angular acceleration (body) of
//                       continuous densities: the result does not depend on how often frames come
// Transition F and noise Q are gathered over many IMU samples, and applied to the map once per frame.
#pragma once

#include <Eigen/Core>

#include "libloc/estimators/slam_options.hpp"
#include "libloc/filter/imu_propagation.hpp"
#include "libloc/geometry/pose3.hpp"

namespace loc {

inline constexpr int kAngularVelocity = 9;  ///< error of the camera's constant-velocity model

struct SlamState : InertialState {
  /// Camera alone: state. With an IMU: the last rate, bias removed. In body [rad/s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
  Pose3 T_body_camera;
  double time_offset_s = 0;  ///< t_imu = t_camera + time_offset

  Pose3 T_world_camera() const { return Pose3{q_world_body, position} * T_body_camera; }
};

/// Where the errors of the head stand; -1: not estimated.
struct SlamLayout {
  explicit SlamLayout(const SlamOptions& options);

  bool inertial;
  int motion_dim;
  int extrinsic_rotation = -1;
  int extrinsic_position = -1;
  int time_offset = -1;
  int dim;
};

/// x = x [+] error. @param error its first layout.dim entries
void boxplus(SlamState& state, const SlamLayout& layout, const Eigen::VectorXd& error);
/// error with b [+] error = a, for the head.
Eigen::VectorXd boxminus(const SlamState& a, const SlamState& b, const SlamLayout& layout);

/// F and Q from the last frame on.
class SlamTransition {
 public:
  explicit SlamTransition(const SlamLayout& layout);

  void reset();
  bool empty() const { return empty_; }
  const Eigen::MatrixXd& f() const { return f_; }
  const Eigen::MatrixXd& q() const { return q_; }

  /// Moves the state by dt_s without an IMU.
  void move(SlamState& state, double dt_s, double acceleration_density, double angular_acceleration_density);
  /// Moves the state by one step of the IMU.
  void move(SlamState& state, const InertialStep& step, const InertialStepNoise& noise, const Eigen::Vector3d& gravity);

 private:
  bool empty_ = true;
  Eigen::MatrixXd f_;
  Eigen::MatrixXd q_;
};

}  // namespace loc
