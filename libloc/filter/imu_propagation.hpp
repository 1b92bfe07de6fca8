// Strapdown propagation of attitude, position and velocity by an IMU, and of the covariance of their errors. Filters
// that an IMU drives share it: the error-state filter, inertial SLAM.
//
// State q p v bg ba (q Hamilton, body to world), errors theta p v bg ba in this order, theta on the right:
// q_true = q * Exp(theta). From one sample to the next, with w and f the rate and the specific force over the step,
// bias removed, and Rm the attitude in the middle of it:
//   Rm = R(q * Exp(w dt/2)),  a = Rm f + g,  p += v dt + a dt^2/2,  v += a dt,  q = q * Exp(w dt)
//   F: theta theta = Exp(w dt)^T, theta bg = -I dt, p v = I dt, v theta = -Rm [f]x dt, v ba = -Rm dt,
//      p theta = v theta dt/2, p ba = v ba dt/2
// Not exact: w and f are held over the step (error of second order in dt), Rm in F is that of the estimate.
// Source: J. Sola, "Quaternion kinematics for the error-state Kalman filter", arXiv:1711.02508, chapter 5.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "libloc/core/time.hpp"

namespace loc {

// Where the errors of a state that an IMU drives stand.
inline constexpr int kTheta = 0;
inline constexpr int kPosition = 3;
inline constexpr int kVelocity = 6;
inline constexpr int kGyroscopeBias = 9;
inline constexpr int kAccelerometerBias = 12;
inline constexpr int kInertialDim = 15;

struct InertialState {
  Eigen::Quaterniond q_world_body = Eigen::Quaterniond::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();            ///< of body in world [m]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();            ///< in world [m/s]
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();      ///< [rad/s]
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();  ///< [m/s^2]
};

/// How the step from one sample to the next is integrated.
enum class ImuIntegration {
  kMidpoint,  ///< as above
  kEuler  ///< attitude of the start of the step: p += v dt, v += a dt, q = norm(q + dt/2 q*(0, w)); F without p theta,
          ///< p ba
};

/// What a sample of the IMU says.
enum class ImuSampling {
  kPoint,        ///< the value at its time: a step uses the mean of the samples at both of its ends
  kIntervalMean  ///< the mean since the sample before: a step uses the sample at its end
};

/// One step: rate and specific force over it, bias removed.
struct InertialStep {
  Eigen::Vector3d angular_velocity;  ///< [rad/s]
  Eigen::Vector3d specific_force;    ///< [m/s^2]
  double dt_s;
};

/// Blocks of F that are not zero or the identity.
struct InertialJacobian {
  Eigen::Matrix3d theta_theta;
  Eigen::Matrix3d velocity_theta;
  Eigen::Matrix3d velocity_accelerometer_bias;
  double dt_s;
  bool position_from_attitude;  ///< p theta and p ba are the rows of v times dt/2; otherwise zero
};

/// Variances that a step adds to the errors. All of them are of one component.
struct InertialStepNoise {
  double theta = 0;               ///< [rad^2]
  double velocity = 0;            ///< [m^2/s^2]
  double position = 0;            ///< [m^2]
  double gyroscope_bias = 0;      ///< [rad^2/s^2]
  double accelerometer_bias = 0;  ///< [m^2/s^4]
};

/// Moves the state by one step and gives the Jacobian of that.
/// @param gravity in world [m/s^2], (0, 0, -9.80665) with z up
InertialJacobian propagate(InertialState& state, const InertialStep& step, const Eigen::Vector3d& gravity,
                           ImuIntegration integration);

/// P = F P F^T + Q for a covariance whose first 15 rows and columns are those of an inertial state and whose others
/// stay as they are (their correlations with the first do not). Only the lower triangle is read; both are written.
void propagate_covariance(Eigen::MatrixXd& covariance, const InertialJacobian& jacobian,
                          const InertialStepNoise& noise);

/// F in full, 15 x 15: for tests and for whoever wants it.
Eigen::Matrix<double, kInertialDim, kInertialDim> dense(const InertialJacobian& jacobian);

}  // namespace loc
