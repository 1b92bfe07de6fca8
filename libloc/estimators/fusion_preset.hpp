// Ready configurations of the error-state filter for the visual-inertial example of the source: a car with a cheap IMU
// and the odometry of one camera, whose unit is not the metre and which drifts.
//   z_p = s p + n + c,  n white, c first-order Gauss-Markov
// as_published  the filter of MATLAB's insfilterErrorState with the example's numbers: Euler steps, every entry of the
//               start's covariance filled, no gate, and the drift c taken for white noise
// inflated      16 errors; the odometry's variance raised by (1 + phi)/(1 - phi), which is what white noise would need
//               to average out as slowly as c does
// drift         19 errors: c is estimated
// Source: MathWorks, "Visual-Inertial Odometry Using Synthetic Data"; the model of c: R. Jiang, R. Klette, S. Wang,
// "Modeling of Unbounded Long-Range Drift in Visual Odometry", PSIVT 2010.
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "libloc/estimators/error_state_filter.hpp"

namespace loc {

/// What is known of the sensors; the defaults are the example's.
struct FusionPresetSensors {
  double imu_rate_hz = 100;
  double gyroscope_noise_density =
      1.0000736613927508e-3;  ///< one-sided: sigma = density sqrt(rate/2) [rad/s/sqrt(Hz)] (0.0573 deg)
  double gyroscope_resolution = 1.0908307824964558e-3;  ///< [rad/s] (0.0625 deg)
  double accelerometer_noise_density = 0.01;            ///< one-sided [m/s^2/sqrt(Hz)]
  double accelerometer_resolution = 0.0024;             ///< [m/s^2]

  double odometry_rate_hz = 25;
  double odometry_white_sigma = 0.139;               ///< [odometry's unit]
  double odometry_drift_sigma = 1.1575836902790226;  ///< sqrt(1.34); c steps by sqrt(2/tau + 1/tau^2) of it
  double odometry_drift_tau = 232;                   ///< frames
  double odometry_orientation_sigma = 1e-2;          ///< [rad]

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct FusionPreset {
  ErrorStateOptions options;
  Eigen::MatrixXd start_cov;  ///< for a start at the true attitude, position and velocity
  Eigen::Matrix3d odometry_position_cov;
  Eigen::Matrix3d odometry_orientation_cov;

  static FusionPreset as_published(const FusionPresetSensors& sensors = {});
  static FusionPreset inflated(const FusionPresetSensors& sensors = {});
  static FusionPreset drift(const FusionPresetSensors& sensors = {});
  /// "as_published", "16" (inflated), "19" (drift). @throws std::invalid_argument for another name.
  static FusionPreset by_name(std::string_view name, const FusionPresetSensors& sensors = {});
};

}  // namespace loc
