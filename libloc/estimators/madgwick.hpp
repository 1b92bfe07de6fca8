// Orientation from gyroscope and accelerometer, with or without magnetometer (9 or 6 axes): the gradient filter of
//   S. Madgwick, "An efficient orientation filter for inertial and inertial/magnetic sensor arrays", 2010 (the report),
// with what real sensors need on top: rest-bias estimation, magnetic rejection, low-passed accelerometer.
//
// Estimates q_world_body (takes body to world) and, with rest_bias, the gyroscope's bias. Not observable: heading
// without magnetometer (then relative to the start), anything about position. No covariance: the filter carries none.
//
// One step of length dt (report, section 3, with the weights alpha_1 = 1 - gamma, alpha_2 = gamma):
//   q_omega = q * Exp(omega dt)                                  gyroscope, exact on SO(3)
//   q_grad  = q - mu grad/|grad|,  mu = alpha |omega|/2 dt       steepest descent on the direction errors
//   q       = (1 - gamma) q_omega + gamma q_grad,  gamma = beta / (mu/dt + beta)
// alpha = infinity is the report's final form, q_omega - beta dt grad/|grad|. The gradient is taken in the tangent
// space of the unit quaternions: the part of the report's gradient along q turns nothing, and how much of the step it
// takes away depends on how the rotation matrix is written down.
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

  /// Gain: the rate at which the gradient turns the quaternion, half the rate of the angle. [rad/s]
  double beta = 0.1;
  /// Step factor of the report, > 1. A finite one weakens the gyroscope by mu / (beta dt + mu); 50 and more do no harm.
  double alpha = std::numeric_limits<double>::infinity();
  /// Error below which the correction is proportional to the error instead of having the constant rate beta, so that
  /// noise around zero is not amplified. 0 is the report. [rad of the summed direction errors]
  double soft_gradient = 0;

  /// Where in the step from the last sample to this one the attitude is taken with which this one's force and field are
  /// compared: 0 is its start (the report), 1 its end. Sensors that average over the sampling interval: 0.5.
  double gradient_phase = 0;

  /// The magnetometer turns the estimate about the vertical only, so that iron cannot tilt it, by
  /// the same gain whatever the dip. The report: false.
  bool magnetometer_heading_only = false;
  /// Weight of the magnetometer's gradient against the accelerometer's. The report: 1.
  double magnetometer_weight = 1;

  /// Low-pass of the specific force in world axes, where acceleration averages out and gravity stays. 0: none. [s]
  double accelerometer_time_constant_s = 0;

  /// For this long after the start the gain is raised, because a start in motion is far off and a small beta would take
  /// long to mend it: for one time constant of the force the tilt follows the averaged force and the heading a short
  /// mean of the field, then both go on as a mean over all samples (gain 1/elapsed). No field is rejected until the end
  /// of it. 0: none (the report). [s]
  double start_time_s = 0;

  /// Estimate the gyroscope's bias while at rest.
  bool rest_bias = false;
  double rest_max_angular_velocity = 0.035;  ///< At rest the rate stays this close to its low-pass. [rad/s] (2 deg/s)
  double rest_max_force_change = 0.5;        ///< At rest the force stays this close to its low-pass. [m/s^2]
  double rest_min_duration_s = 1.5;          ///< Calm for this long is rest. [s]
  double rest_low_pass_s = 0.5;              ///< Time constant of these low-passes. [s]
  double rest_bias_cutoff_hz = 0.1;          ///< Low-pass of the rate that becomes the bias. [Hz]
  /// Estimate the bias in motion as well, from what the accelerometer keeps correcting: a Kalman filter whose
  /// measurement is the rate of the tilt correction. The axis that is vertical just then is not observed.
  bool motion_bias = false;
  double motion_bias_start_sigma = 0.0087;  ///< Deviation of the bias at the start. [rad/s] (0.5 deg/s)
  double motion_bias_walk = 1.75e-4;        ///< By which it walks. [rad/s/sqrt(s)] (0.1 deg/s in 100 s)
  double motion_bias_noise = 0.0175;        ///< White noise of that measurement. [rad/s*sqrt(s)] (1 deg/s over 1 s)
  double rest_bias_sigma = 5e-4;            ///< Deviation of the bias after a rest. [rad/s] (0.03 deg/s)
  double max_gyroscope_bias = 0.035;        ///< A larger low-passed rate is a slow turn, not a bias. [rad/s] (2 deg/s)

  /// Reject the magnetometer where norm or dip differ from a reference that is learnt while they do not. Another field
  /// becomes the reference once it has been steady for as long as the reference had been seen.
  bool magnetic_rejection = false;
  double magnetic_norm_tolerance = 0.10;   ///< Relative to the reference.
  double magnetic_dip_tolerance = 0.1745;  ///< [rad] (10 deg)
  double magnetic_reference_time_s = 20;   ///< Time constant with which the reference follows. [s]
  double magnetic_max_rejection_s = 60;  ///< After this long the field is taken for the new normal, steady or not. [s]

  double max_angular_velocity = 70;  ///< A sample with more is an error of the sensor: skipped. [rad/s] (4000 deg/s)
  double max_specific_force = 200;   ///< With more the step goes without the accelerometer. [m/s^2] (20 g)
  double max_heading_age_s = 60;     ///< So long after the last use of the field the heading still counts as valid. [s]
  double max_gap_s = 1.0;            ///< A longer time between IMU samples starts the filter anew. [s]
  double max_magnetometer_age_s = 0.5;  ///< Until then a sample is used on, carried along by the gyroscope. [s]

  /// The form of the report: beta = 0.1, all extensions off.
  static MadgwickOptions report();
  /// All extensions on: for real sensors.
  static MadgwickOptions robust();
  /// @throws std::invalid_argument for a name other than "report" and "robust".
  static MadgwickOptions preset(std::string_view name);
  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// beta that covers the rates by which the gyroscope can be wrong. [rad/s]
/// @param bias_residual bias left after calibration, per axis [rad/s]
/// @param scale_error relative scale (and cross-axis) error
/// @param max_rate angular velocity of the motion that the scale error acts on [rad/s]
/// @param dt_s time between samples [s]
/// Source: report, section 3.6 (beta = sqrt(3/4) * rate error), the rate error being the root sum of squares of the
/// parts.
double beta_from_gyro(const ImuNoise& noise, double bias_residual, double scale_error, double max_rate, double dt_s);

struct MadgwickCounts {
  std::int64_t imu = 0;           ///< samples that made a step
  std::int64_t magnetometer = 0;  ///< samples taken
  // skipped
  std::int64_t imu_not_finite = 0;
  std::int64_t imu_out_of_range = 0;
  std::int64_t imu_time_not_increasing = 0;
  std::int64_t magnetometer_not_finite = 0;
  std::int64_t magnetometer_out_of_range = 0;
  std::int64_t magnetometer_time_not_increasing = 0;
  std::int64_t gaps = 0;                    ///< new starts after a gap
  std::int64_t clock_set_back = 0;          ///< new starts after the clock was set back
  std::int64_t accelerometer_ignored = 0;   ///< steps without
  std::int64_t magnetometer_ignored = 0;    ///< steps whose field is zero or along gravity
  std::int64_t magnetometer_disturbed = 0;  ///< steps whose field was rejected
};

class MadgwickFilter {
 public:
  /// @throws std::invalid_argument as MadgwickOptions::check.
  explicit MadgwickFilter(const MadgwickOptions& options = {});

  /// One gyroscope and accelerometer sample. Input that is skipped leaves the state as it was; 20 samples in a row
  /// whose times increase among themselves, but are not after the last one used, mean that the clock was set back: the
  /// filter starts anew. @returns EstimateStatus of this sample, and of the samples skipped since the last step.
  std::uint32_t update(const ImuMeasurement& imu);
  /// Keeps the sample for the next IMU steps. @returns EstimateStatus: 0, or why it is skipped.
  std::uint32_t update(const MagnetometerMeasurement& magnetometer);

  /// Estimator concept.
  bool process(const Measurement& measurement);
  Estimate estimate() const;
  NamedCounts counts() const;
  void reset();

  bool initialised() const { return initialised_; }
  /// q_world_body, w >= 0 is not enforced. Identity before the first IMU sample.
  const Eigen::Quaterniond& orientation() const { return q_; }
  const Eigen::Vector3d& gyroscope_bias() const { return bias_; }  ///< [rad/s], zero until known
  std::uint32_t status() const { return status_; }                 ///< of the last IMU sample
  const MadgwickOptions& options() const { return options_; }

 private:
  // Norm and dip of a field, averaged, and for how long they were seen.
  struct FieldMean {
    double norm = 0;
    double sin_dip = 0;
    double cos_dip = 1;
    double seen_s = 0;
  };

  // The time line of one stream.
  struct TimeLine {
    TimeNs last = kNoTime;     // used
    TimeNs refused = kNoTime;  // the last one that was not after it
    int refused_in_a_row = 0;

    enum class Verdict { kNext, kNotIncreasing, kSetBack };
    Verdict judge(TimeNs time);
  };

  std::uint32_t skip(std::uint32_t reason);
  void forget_field();
  void start(const ImuMeasurement& imu);
  void detect_rest(const Eigen::Vector3d& rate, const Eigen::Vector3d& force, double dt);
  void update_motion_bias(const Eigen::Vector3d& tilt_rate, const Eigen::Matrix3d& R, double dt);
  bool agrees(const FieldMean& mean, const FieldMean& sample) const;
  void follow(FieldMean& mean, const FieldMean& sample, double dt) const;
  bool magnetic_field_disturbed(double sin_dip, double cos_dip, double dt);
  bool carry_field(double dt);
  void turn_to_north();
  Eigen::Vector3d gravity_gradient(const Eigen::Matrix3d& R, const Eigen::Vector3d& force, double dt);
  Eigen::Vector3d magnetic_gradient(const Eigen::Matrix3d& R, const Eigen::Vector3d& field_body);

  MadgwickOptions options_;
  // Of world: does z point up; which horizontal axis is north.
  double up_z_ = 1;
  int north_axis_ = 1;
  double cos_dip_tolerance_ = 1;
  double correction_time_s_ = 0;  // of a small error

  // What is known now.
  Eigen::Quaterniond q_{1, 0, 0, 0};
  Eigen::Vector3d bias_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_ = Eigen::Vector3d::Zero();         // last angular velocity, bias removed
  Eigen::Vector3d force_world_ = Eigen::Vector3d::Zero();  // low-passed
  double elapsed_s_ = 0;                                   // since the start
  double force_time_s_ = 0;                                // that force_world_ has averaged over
  std::uint32_t status_ = 0;
  std::uint32_t skipped_status_ = 0;  // of what was skipped since the last step
  TimeLine imu_time_;
  TimeLine field_time_line_;
  Stamp last_;
  bool initialised_ = false;
  bool heading_known_ = false;
  bool bias_known_ = false;

  // The newest magnetometer sample, unit length, carried along to the newest IMU sample.
  Eigen::Vector3d field_ = Eigen::Vector3d::Zero();
  double field_norm_ = 0;
  TimeNs field_sample_time_ = kNoTime;  // of the measurement
  TimeNs field_time_ = kNoTime;         // that field_ is carried to
  TimeNs field_judged_time_ = kNoTime;  // of the last sample that was compared with the reference
  bool field_disturbed_ = false;
  double since_field_s_ = 0;  // since the field turned the estimate last

  // Bias in motion: R behind the lags of the correction.
  Eigen::Matrix3d force_lag_R_ = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d correction_lag_R_ = Eigen::Matrix3d::Identity();

  // Rest.
  Eigen::Vector3d rest_rate_ = Eigen::Vector3d::Zero();   // low-passed
  Eigen::Vector3d rest_force_ = Eigen::Vector3d::Zero();  // low-passed
  double calm_s_ = 0;
  Eigen::Vector3d bias_variance_ = Eigen::Vector3d::Zero();  // of bias_, by axis
  double rest_total_s_ = 0;                                  // of all rest so far

  // Magnetic rejection.
  FieldMean reference_;
  FieldMean candidate_;  // of what is being rejected
  double rejected_s_ = 0;

  MadgwickCounts counts_;
};

static_assert(Estimator<MadgwickFilter>);

}  // namespace loc
