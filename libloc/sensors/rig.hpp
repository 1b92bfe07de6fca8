// What calibration produces and every estimator reads: one plain struct, saved by io/rig_yaml.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "libloc/core/quality.hpp"
#include "libloc/core/time.hpp"
#include "libloc/geometry/pose3.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

/// How a triad's calibration was found, and how far it may be trusted. A deviation that was not estimated is NaN.
struct TriadQuality {
  Verdict verdict = Verdict::kOk;
  std::string method;        ///< "robust", "still-poses", …
  std::int64_t samples = 0;  ///< readings (of still poses: poses) that were used
  Eigen::Vector3d bias_sigma = Eigen::Vector3d::Constant(kUnknown);    ///< deviation of the bias, in its unit
  Eigen::Matrix3d matrix_sigma = Eigen::Matrix3d::Constant(kUnknown);  ///< of each entry, in the matrix's unit
  double residual_rms = kUnknown;    ///< of the corrected readings' norm, relative to the field's norm
  std::vector<std::string> reasons;  ///< of the verdict, one line each

  /// @throws std::invalid_argument naming the field. @param name goes into the message.
  void check(const std::string& name) const;
};

/// corrected = matrix * (raw - bias)
struct TriadCalibration {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();        ///< in the sensor's unit
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();  ///< scale, misalignment, soft iron, rotation to body
  std::optional<TriadQuality> quality;                   ///< none: nobody measured it, or the file does not say

  Eigen::Vector3d apply(const Eigen::Vector3d& raw) const { return matrix * (raw - bias); }
  /// @throws std::invalid_argument when not finite or the matrix is singular. @param name goes into the message.
  void check(const std::string& name) const;
};

struct ImuCalibration {
  double rate_hz = 0;  ///< nominal; 0 when unknown
  ImuNoise noise;
  std::vector<std::string> noise_measured;  ///< names of the fields of noise that were measured; the others are guesses
  TriadCalibration gyroscope;               ///< [rad/s]
  TriadCalibration accelerometer;           ///< [m/s^2]
};

struct MagnetometerCalibration {
  TriadCalibration triad;  ///< [T], hard iron and soft iron, result in body axes
};

enum class DistortionModel { kNone, kRadtan, kEquidistant };

/// How the intrinsics of a camera were found, and how far they may be trusted. A deviation that is not known is NaN.
struct IntrinsicsQuality {
  Verdict verdict = Verdict::kOk;
  std::string method;                                                         ///< "target"
  std::int64_t pictures = 0;                                                  ///< that were used
  Eigen::Vector4d intrinsics_sigma_px = Eigen::Vector4d::Constant(kUnknown);  ///< of fx, fy, cx, cy
  Eigen::Vector4d distortion_sigma = Eigen::Vector4d::Constant(kUnknown);     ///< zero where the model has no such term
  double reprojection_rms_px = kUnknown;  ///< of the distances between corners found and projected
  std::vector<std::string> reasons;       ///< of the verdict, one line each

  /// @throws std::invalid_argument naming the field. @param name goes into the message.
  void check(const std::string& name) const;
};

/// How it was found where a camera sits on the IMU and by how much their clocks differ, and how far that may be
/// trusted. A deviation that is not known is NaN.
struct MountingQuality {
  Verdict verdict = Verdict::kOk;
  std::string method;         ///< "camera-imu"
  std::int64_t pictures = 0;  ///< that were used
  /// Of T_body_camera's rotation: a small turn of the camera about the body's axes [rad].
  Eigen::Vector3d rotation_sigma = Eigen::Vector3d::Constant(kUnknown);
  /// Of T_body_camera's translation, the camera's place along the body's axes [m].
  Eigen::Vector3d translation_sigma = Eigen::Vector3d::Constant(kUnknown);
  double time_offset_sigma_s = kUnknown;
  /// A rolling shutter's time from one row to the next; negative when it begins below. NaN: nobody looked. It is kept
  /// here because the estimators take a picture as of one time. @{
  double line_delay_s = kUnknown;
  double line_delay_sigma_s = kUnknown;
  /// @}
  std::vector<std::string> reasons;  ///< of the verdict, one line each

  /// The three deviations from what a camera-IMU calibration finds, which is the inverse of what a rig holds.
  /// @param covariance of a small turn about the body's axes [rad] (R_camera_body Exp(turn)), of the translation of
  /// T_camera_body [m], and of the time offset [s]
  /// @throws std::invalid_argument when it is not finite or has a variance below zero.
  void set_deviations(const Pose3& T_body_camera, const Eigen::Matrix<double, 7, 7>& covariance);
  /// @throws std::invalid_argument naming the field. @param name goes into the message.
  void check(const std::string& name) const;
};

struct CameraCalibration {
  std::string name;  ///< "cam0"
  std::int32_t width_px = 0;
  std::int32_t height_px = 0;
  Eigen::Vector4d intrinsics_px = Eigen::Vector4d::Zero();  ///< fx, fy, cx, cy
  DistortionModel distortion_model = DistortionModel::kNone;
  Eigen::Vector4d distortion = Eigen::Vector4d::Zero();  ///< radtan: k1 k2 p1 p2; equidistant: k1..k4
  Pose3 T_body_camera;
  double time_offset_s = 0;                             ///< t_imu = t_camera + time_offset (Kalibr's timeshift_cam_imu)
  double rate_hz = 0;                                   ///< nominal; 0 when unknown
  std::optional<IntrinsicsQuality> intrinsics_quality;  ///< none: nobody measured it, or the file does not say
  std::optional<MountingQuality> mounting_quality;      ///< of T_body_camera and time_offset_s; none: likewise

  /// @throws std::invalid_argument naming the camera, the field and its value.
  void check() const;
};

struct GpsCalibration {
  Eigen::Vector3d antenna_in_body = Eigen::Vector3d::Zero();  ///< lever arm [m]
  double time_offset_s = 0;                                   ///< t_imu = t_gps + time_offset
  double time_offset_sigma_s = kUnknown;                      ///< deviation of the offset; NaN: not measured
};

/// What is known of the clock that stamps a stream: start values for the live clock model, and figures to judge it by.
struct ClockCalibration {
  std::string stream;              ///< "imu", "magnetometer", "gps", a camera's name, …
  std::string reference = "host";  ///< the clock that it was compared with: "host", "gps"
  double skew_ppm = 0;             ///< seconds of the reference per second of the stream's clock, less 1
  double skew_sigma_ppm = kUnknown;
  double offset_sigma_s = kUnknown;  ///< deviation of a time that was put on the reference clock
  double jitter_rms_s = kUnknown;    ///< of arrivals after the earliest possible (the lower envelope)
  double jitter_p99_s = kUnknown;    ///< 99 % of arrivals are at most that late

  /// @throws std::invalid_argument naming the stream and the field.
  void check() const;
};

/// The sensors of one device; the body frame is the IMU's.
struct Rig {
  std::optional<ImuCalibration> imu;
  std::optional<MagnetometerCalibration> magnetometer;
  std::vector<CameraCalibration> cameras;
  std::optional<GpsCalibration> gps;
  std::vector<ClockCalibration> clocks;  ///< at most one of a stream against a reference

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// The measurement as the rig's calibration corrects it: gyroscope, accelerometer and magnetometer, and the time of a
/// GPS fix. Other streams and sensors without calibration pass unchanged.
/// To be called before streams are merged in time order, because of the GPS's time.
Measurement calibrated(const Rig& rig, Measurement measurement);

/// What a user should hear about a rig before it is used: a sentence for each calibration that was refused (and written
/// all the same) or came with a warning.
struct RigDoubt {
  std::string block;  ///< "imu.gyroscope", "imu.accelerometer", "magnetometer", "cam0.intrinsics", "cam0.mounting"
  Verdict verdict = Verdict::kWarn;
  std::string text;
};
std::vector<RigDoubt> doubts(const Rig& rig);

}  // namespace loc
