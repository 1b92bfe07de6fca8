// Orientation from gyroscope and accelerometer, with or without magnetometer (9 or 6 axes): the gradient filter of
//   S. Madgwick, "An efficient orientation filter for inertial and inertial/magnetic sensor arrays", 2010 (the report),
// with what real sensors need on top: rest-bias estimation, magnetic rejection, low-passed accelerometer.
//
// Estimates q_world_body (takes body to world) and, with rest_bias, the gyroscope's bias. Not observable: heading
// without magnetometer (then relative to the start), anything about position. No covariance: the filter carries none.
//
// One step of length dt (report, equations 42-44, with the slides' alpha_1, alpha_2):
//   q_omega = q * Exp(omega dt)                                  gyroscope, exact on SO(3)
//   q_grad  = q - mu grad/|grad|,  mu = alpha |omega|/2 dt       steepest descent on the direction errors
//   q       = (1 - gamma) q_omega + gamma q_grad,  gamma = beta / (mu/dt + beta)
// alpha = infinity is the report's final form, q_omega - beta dt grad/|grad|. The gradient is taken in the tangent
// space of the unit sphere: the part of the report's 4-vector along q only changes the norm of q, and how large it is
// depends on how the rotation matrix is written down.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <string_view>

#include "libloc/estimators/estimate.hpp"
#include "libloc/estimators/estimator.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

/// Axes of world. ENU and NWU have z up, NED has z down; the accelerometer reads specific force in all of them.
enum class WorldFrame { kEnu, kNwu, kNed };
const char* world_frame_name(WorldFrame frame);
/// @throws std::invalid_argument unless "ENU", "NWU" or "NED" (upper or lower case).
WorldFrame parse_world_frame(std::string_view name);

struct MadgwickOptions {
  WorldFrame world = WorldFrame::kEnu;

  /// Gain [rad/s]: the rate at which the gradient turns the quaternion, in quaternion units (half the angle's rate).
  double beta = 0.1;
  /// Step factor of the report, > 1. Finite values weaken the gyroscope by mu / (beta dt + mu): 50 and more do little
  /// harm.
  double alpha = std::numeric_limits<double>::infinity();
  /// The gradient is divided by max(|grad|, soft_gradient), in radians of direction error: 0 is the report (constant
  /// rate), more makes the correction proportional to the error below it, so that noise near zero is not amplified.
  double soft_gradient = 0;

  /// Estimate the gyroscope's bias while at rest.
  bool rest_bias = false;
  double rest_max_angular_velocity = 0.0349;  ///< [rad/s] (2 deg/s) low-passed rate that counts as rest
  double rest_max_force_change = 0.5;         ///< [m/s^2] distance of the force from its own mean at rest
  double rest_min_duration_s = 1.5;           ///< [s] calm that it takes
  double rest_bias_cutoff_hz = 0.1;           ///< [Hz] low-pass of the bias at rest
  double max_gyroscope_bias = 0.0349;         ///< [rad/s] bound of the estimate, per axis

  /// Reject the magnetometer where norm or dip differ from the reference that is learnt while it is calm.
  bool magnetic_rejection = false;
  double magnetic_norm_tolerance = 0.10;   ///< relative
  double magnetic_dip_tolerance = 0.1745;  ///< [rad] (10 deg)
  double magnetic_max_rejection_s = 60;    ///< [s] after which a steady new field is accepted

  /// Time constant of the low-pass on the specific force in world axes [s]; 0 uses each sample as it is.
  double accelerometer_time_constant_s = 0;

  double max_gap_s = 1.0;  ///< [s] a longer time between IMU samples starts the filter anew
  double max_magnetometer_age_s =
      0.5;                   ///< [s] an older sample is not used any more; until then the gyroscope carries it along
  double gravity = 9.80665;  ///< [m/s^2]

  /// The form of the report: beta = 0.1, nothing else.
  static MadgwickOptions report();
  /// Everything on: for real sensors.
  static MadgwickOptions robust();
  /// @throws std::invalid_argument for a name other than "report", "robust".
  static MadgwickOptions preset(std::string_view name);
  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// beta that covers the rates by which the gyroscope can be wrong. [rad/s]
/// @param bias_residual bias left after calibration, per axis [rad/s]
/// @param scale_error relative scale (and cross-axis) error
/// @param max_rate angular velocity of the motion that the scale error acts on [rad/s]
/// @param dt_s time between samples [s]
/// Source: report, equation 51 (beta = sqrt(3/4) * rate error), the rate error being the root sum of squares of the
/// parts.
double beta_from_gyro(const ImuNoise& noise, double bias_residual, double scale_error, double max_rate, double dt_s);

class MadgwickFilter {
 public:
  /// @throws std::invalid_argument as MadgwickOptions::check.
  explicit MadgwickFilter(const MadgwickOptions& options = {});

  /// One gyroscope and accelerometer sample. @returns EstimateStatus of this step; skipped input leaves the state as it
  /// was.
  std::uint32_t update(const ImuMeasurement& imu);
  /// Keeps the sample for the next IMU steps. @returns EstimateStatus: kNotFinite, kTimeNotIncreasing or 0.
  std::uint32_t update(const MagnetometerMeasurement& magnetometer);

  /// Estimator concept.
  bool process(const Measurement& measurement);
  Estimate estimate() const;
  NamedCounts counts() const;
  void reset();

  bool initialised() const;
  /// q_world_body, w >= 0 is not enforced. Identity before the first IMU sample.
  const Eigen::Quaterniond& orientation() const;
  const Eigen::Vector3d& gyroscope_bias() const;  ///< [rad/s]
  std::uint32_t status() const;                   ///< of the last IMU step
  const MadgwickOptions& options() const { return options_; }

 private:
  MadgwickOptions options_;
};

}  // namespace loc
