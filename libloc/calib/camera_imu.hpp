// Where a camera sits on an IMU, and by how much their clocks differ, from one recording of a target that was waved in
// front of the rig (or the rig before the target).
// From: corners of a target in many pictures (vision/target_detector), a camera with known intrinsics, IMU samples. To:
// T_camera_imu, the offset t_imu = t_camera + d, gravity and biases, with covariance and a verdict.
//
// Unknown functions of time: the IMU's pose in target as a B-spline (spline.hpp), gyroscope and accelerometer bias
// straight between knots. Minimised by Levenberg and Marquardt:
//   gyroscope       w(t) + b_g(t) - w_m                                   over its noise
//   accelerometer   R(t)^T (p''(t) - g) + b_a(t) - a_m                    over its noise
//   corner          project(T_camera_imu T_target_imu(t + d)^-1 P) - z    over corner_sigma_px, Cauchy's loss
//   biases          their walk between two knots                          over what the densities allow
// Source: Furgale, Rehder, Siegwart, "Unified temporal and spatial calibration for multi-sensor systems", IROS 2013.
// The corners of a picture act through its pose only and are summed up to that; the pose's time moves with d through
// the whole spline, so there is no window that an offset could leave. Start values come from the recording alone: the
// offset by correlating turn rates, the rotation from them by Wahba's problem, gravity from the mean specific force.
//
// Not observable: the lever arm along the axis, when the rig turns about one axis only; anything, when it does not
// turn. That is refused at the start. Gravity's size only scales with the target's, and both are taken as known.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "libloc/core/quality.hpp"
#include "libloc/core/time.hpp"
#include "libloc/geometry/pose3.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/rig.hpp"
#include "libloc/sensors/target.hpp"

namespace loc {

/// Start values, from the recording alone.
struct CameraImuStart {
  double time_offset_s = 0;  ///< t_imu = t_camera + d
  Eigen::Quaterniond R_camera_imu = Eigen::Quaterniond::Identity();
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();  ///< [rad/s]
  Eigen::Vector3d gravity_target = Eigen::Vector3d::Zero();  ///< in target [m/s^2]
  double correlation = 0;                                    ///< of the turn rates, at the offset
  double second_correlation = 0;                             ///< the best elsewhere
  Eigen::Vector3d excitation = Eigen::Vector3d::Zero();  ///< deviations of the turn rate along its main axes [rad/s]
};

/// Where the solution stands.
struct CameraImuProgress {
  int iteration = 0;
  double cost = 0;
  double time_offset_s = 0;
  double elapsed_s = 0;
};

struct CameraImuOptions {
  int order = 6;              ///< of the pose's spline, 4 or 6 are usual
  double knot_spacing_s = 0;  ///< 0: from the IMU's rate, four samples
  double bias_spacing_s = 1;  ///< biases run straight between knots so far apart
  double corner_sigma_px = 0.3;
  double loss_sigmas = 3;    ///< Cauchy's: a corner so far off counts half
  double gravity = 9.80665;  ///< [m/s^2]
  bool adapt_noise = true;   ///< noise of both IMU sensors and of each picture from the residuals, then once more
  std::optional<double> time_offset_s{};  ///< known to half a second; otherwise all offsets are tried
  int max_iterations = 50;
  double time_limit_s = 0;  ///< 0: none
  std::function<bool(const CameraImuProgress&)>
      progress{};  ///< after each iteration; false: stop, the best so far counts

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// What became of a picture.
struct CameraImuView {
  bool used = false;
  std::string reason;          ///< why it was not used
  double rms_px = kUnknown;    ///< of its corners
  double sigma_px = kUnknown;  ///< that its corners were given
};

struct CameraImuFit {
  Pose3 T_camera_imu;
  double time_offset_s = 0;                                  ///< t_imu = t_camera + d
  Eigen::Vector3d gravity_target = Eigen::Vector3d::Zero();  ///< [m/s^2]
  /// Of a small turn of the camera about the IMU's axes [rad] (R_camera_imu Exp(turn)), of the translation of
  /// T_camera_imu [m], of the offset [s].
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();
  Eigen::Matrix<double, 7, 1> sigma = Eigen::Matrix<double, 7, 1>::Zero();            ///< the larger of both
  Eigen::Matrix<double, 7, 1> sigma_by_noise = Eigen::Matrix<double, 7, 1>::Zero();   ///< from the noise as given
  Eigen::Matrix<double, 7, 1> sigma_by_blocks = Eigen::Matrix<double, 7, 1>::Zero();  ///< from how pieces pull
  CameraImuStart start;
  std::vector<CameraImuView> views;
  double knot_spacing_s = 0;
  double gyroscope_chi = 0;  ///< root of the mean square of the residuals over their deviation: 1 is right
  double accelerometer_chi = 0;
  double corner_chi = 0;
  double gyroscope_noise_scale = 1;  ///< on the noise that was given, when it was adapted
  double accelerometer_noise_scale = 1;
  double cost = 0;
  int iterations = 0;
  bool converged = false;
  std::string stopped;  ///< why, when it has not converged
  double start_cpu_s = 0;
  double solve_cpu_s = 0;
  Quality quality;
};

/// @param views pictures with their times on the camera's clock  @param camera intrinsics; its pose plays no part
/// @param imu calibrated samples, in order of time  @param noise densities of the IMU
/// @throws std::invalid_argument for options, the target and the camera; DataError for what cannot be calibrated, with
/// the reason: no common motion, one axis only, too few pictures.
CameraImuFit calibrate_camera_imu(const CalibrationTarget& target, std::span<const TargetView> views,
                                  const CameraCalibration& camera, std::span<const ImuMeasurement> imu,
                                  const ImuNoise& noise, const CameraImuOptions& options = {});

}  // namespace loc
