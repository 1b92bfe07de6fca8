// Where a camera sits on an IMU, and by how much their clocks differ, from one recording of a target that was waved in
// front of the rig (or the rig before the target).
// From: corners of a target in many pictures (vision/target_detector), one camera or several with known intrinsics, IMU
// samples. To: T_camera_imu and the offset t_imu = t_camera + d of each, gravity and biases, with covariance and a
// verdict.
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
// Deviations are those of the noise, or larger where pieces of the recording pull apart by more than chance (sandwich
// estimator over groups of windows; residuals that hang together do that), and what the deviations of the intrinsics
// add, which are taken as half a thousandth of the focal length where nobody measured them.
//
// Not observable: the lever arm along the axis, when the rig turns about one axis only; anything, when it does not
// turn. That is refused at the start. Gravity's size only scales with the target's, and both are taken as known unless
// estimate_gravity is set; what the recording would make of it, of drift and line delay is told all the same.
// Memory: 4 MB for each second with 200 Hz and knots of 20 ms. Seconds without pictures or samples are cut out.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "libloc/calib/camera_recording.hpp"
#include "libloc/core/named_count.hpp"
#include "libloc/core/quality.hpp"
#include "libloc/core/time.hpp"
#include "libloc/geometry/pose3.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/rig.hpp"
#include "libloc/sensors/target.hpp"

namespace loc {

/// How the IMU's attitude is written as a spline. Both give the same calibration.
enum class RotationForm : std::uint8_t {
  kCumulative,   ///< calib/spline: no attitude is special
  kThreeAngles,  ///< calib/euler_trajectory, with the mean attitude taken out: the source's, for motion about one
                 ///< attitude
};

/// Correlation of the turn rates at every offset that was tried.
struct OffsetCurve {
  std::vector<double> offset_s;
  std::vector<double> correlation;
};

/// Start values of a camera, from the recording alone.
struct CameraImuStart {
  double time_offset_s = 0;  ///< t_imu = t_camera + d
  Eigen::Quaterniond R_camera_imu = Eigen::Quaterniond::Identity();
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();  ///< [rad/s]
  double correlation = 0;                                    ///< of the turn rates, at the offset
  double second_correlation = 0;                             ///< the best elsewhere
  double rate_ratio = 1;                                 ///< size of the gyroscope's rates over that of the camera's
  Eigen::Vector3d excitation = Eigen::Vector3d::Zero();  ///< deviations of the turn rate along its main axes [rad/s]
  OffsetCurve curve;
};

/// Where the solution stands.
struct CameraImuProgress {
  int iteration = 0;
  double cost = 0;
  double time_offset_s = 0;  ///< of the first camera
  double elapsed_s = 0;
};

struct CameraImuOptions {
  int order = 6;  ///< of the pose's spline, 4 or 6 are usual
  RotationForm rotation = RotationForm::kCumulative;
  double knot_spacing_s = 0;     ///< 0: from the IMU's spectrum
  double bias_spacing_s = 1;     ///< biases run straight between knots so far apart, at most a hundred of the pose's
  double corner_sigma_px = 0.3;  ///< of a coordinate
  double loss_sigmas = 3;        ///< Cauchy's: a corner so far off counts half
  double gravity = 9.80665;      ///< [m/s^2]
  bool adapt_noise = true;       ///< noise of both IMU sensors and of each picture from the residuals, then once more
  std::optional<double> time_offset_s{};  ///< known to half a second; otherwise all offsets are tried
  /// More unknowns. @{
  bool refine_intrinsics = false;    ///< focal lengths, principal point, distortion of every camera
  bool estimate_line_delay = false;  ///< rolling shutter: time from one row to the next
  bool estimate_drift = false;       ///< the offset changes evenly over the recording
  bool estimate_gravity = false;  ///< its size too: for a target whose size is certain, an accelerometer whose scale is
  bool estimate_imu_matrices = false;  ///< scale and misalignment of gyroscope and accelerometer
  /// @}
  bool check_line_delay = true;   ///< where it is not estimated: would it be something else than 0?
  int max_iterations = 100;       ///< in all
  double time_limit_s = 0;        ///< of the start and the solution; 0: none
  double memory_limit_mb = 4000;  ///< what needs more is refused; that is about twenty minutes with 200 Hz
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

/// A corner of a picture that was used.
struct CameraImuCorner {
  std::int32_t view = 0;
  std::int32_t id = 0;  ///< as it was given
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d residual_px = Eigen::Vector2d::Zero();  ///< found less projected
  double weight = 1;                                      ///< that the loss leaves it
};

/// A quantity, estimated, or (where it was held) one step from there with everything else free. NaN: not looked at.
struct CameraImuCheck {
  double value = kUnknown;
  double sigma = kUnknown;
  bool estimated = false;
};

/// Likewise a matrix, entry by entry.
struct CameraImuMatrixCheck {
  Eigen::Matrix3d value = Eigen::Matrix3d::Constant(kUnknown);
  Eigen::Matrix3d sigma = Eigen::Matrix3d::Constant(kUnknown);
  bool estimated = false;
};

using Vector8d = Eigen::Matrix<double, 8, 1>;
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

/// Of one camera.
struct CameraImuCamera {
  Pose3 T_camera_imu;
  double time_offset_s = 0;  ///< t_imu = t_camera + d; with a drift, in the middle of the recording
  /// Of a small turn of the camera about the IMU's axes [rad] (R_camera_imu Exp(turn)), of the translation of
  /// T_camera_imu [m], of the offset [s].
  Matrix7d covariance = Matrix7d::Zero();           ///< its deviations are sigma
  Vector7d sigma = Vector7d::Zero();                ///< of all that follow
  Vector7d sigma_by_noise = Vector7d::Zero();       ///< from the noise as given or adapted
  Vector7d sigma_by_blocks = Vector7d::Zero();      ///< from how pieces of the recording pull
  Vector7d sigma_by_intrinsics = Vector7d::Zero();  ///< from the deviations of the camera's intrinsics
  /// As given, with pose, offset and mounting_quality; when refined with intrinsics and their quality.
  CameraCalibration camera;
  Vector8d intrinsics_sigma =
      Vector8d::Zero();  ///< that were taken for fx fy cx cy and the distortion; when refined: found
  Vector8d intrinsics_change = Vector8d::Zero();  ///< that the recording would make, or has made when refined
  /// How the mounting (as in covariance) moves with fx fy cx cy and the distortion that are held.
  Eigen::Matrix<double, 7, 8> by_intrinsics = Eigen::Matrix<double, 7, 8>::Zero();
  CameraImuCheck line_delay_s;  ///< from one row to the next
  CameraImuCheck offset_drift;  ///< [s/s]
  CameraImuStart start;
  std::vector<CameraImuView> views;
  std::vector<CameraImuCorner> corners;
  double corner_chi = 0;  ///< root of the mean square of the residuals over their deviation, as the loss leaves them
};

struct CameraImuFit {
  std::vector<CameraImuCamera> cameras;                      ///< one for each that was given
  Eigen::Vector3d gravity_target = Eigen::Vector3d::Zero();  ///< [m/s^2]
  double gravity_direction_sigma = 0;                        ///< [rad]
  CameraImuCheck gravity_size;                               ///< [m/s^2]
  /// The target's true size over what it was said to be, by the accelerometer. Never estimated: a ruler knows better.
  /// NaN where gravity's size and the accelerometer's scale are both estimated.
  CameraImuCheck target_scale;
  /// reading = matrix * what the sensor feels + bias; of the gyroscope all entries, of the accelerometer a lower
  /// triangle (body is the frame in which it is one). Where they were held, what one step says is for a warning, not
  /// for use. @{
  CameraImuMatrixCheck gyroscope_matrix;
  CameraImuMatrixCheck accelerometer_matrix;
  /// @}
  std::vector<TimeNs> bias_time_ns;
  Eigen::MatrixXd biases;  ///< (6, n) gyroscope [rad/s] above accelerometer [m/s^2], straight between the times
  std::vector<TimeNs> imu_time_ns;
  Eigen::MatrixXd imu_residuals;    ///< (6, n) felt less read, over their deviations
  std::vector<Pose3> T_target_imu;  ///< at imu_time_ns
  double knot_spacing_s = 0;
  double bandwidth_hz = 0;   ///< below which the IMU's spectrum holds the motion
  std::string knot_reason;   ///< why this spacing
  double gyroscope_chi = 0;  ///< root of the mean square of the residuals over their deviation: 1 is right
  double accelerometer_chi = 0;
  double gyroscope_noise_scale = 1;  ///< on the noise that was given, when it was adapted
  double accelerometer_noise_scale = 1;
  NamedCounts counts;  ///< {"imu.used", n}, {"imu.skipped.not_finite", n}, …
  double cost = 0;
  int iterations = 0;
  bool converged = false;
  std::string stopped;  ///< why, when it has not converged
  double start_cpu_s = 0;
  double solve_cpu_s = 0;
  Quality quality;
};

/// @param imu calibrated samples; those that are not finite or not later than the one before are skipped and counted
/// @param noise densities of the IMU
/// @throws std::invalid_argument for options, the target, the cameras, and noise that is not positive; DataError for
/// what cannot be calibrated, with the reason: no common motion, one axis only, too few pictures.
CameraImuFit calibrate_camera_imu(const CalibrationTarget& target, std::span<const CameraRecording> cameras,
                                  std::span<const ImuMeasurement> imu, const ImuNoise& noise,
                                  const CameraImuOptions& options = {});

}  // namespace loc
