// What calibration produces and every estimator reads: one plain struct, saved by io/rig_yaml.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "libloc/core/time.hpp"
#include "libloc/geometry/pose3.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

/// corrected = matrix * (raw - bias)
struct TriadCalibration {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();        ///< in the sensor's unit
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();  ///< scale, misalignment, soft iron, rotation to body

  Eigen::Vector3d apply(const Eigen::Vector3d& raw) const { return matrix * (raw - bias); }
  /// @throws std::invalid_argument when not finite or the matrix is singular. @param name goes into the message.
  void check(const std::string& name) const;
};

struct ImuCalibration {
  double rate_hz = 0;  ///< nominal; 0 when unknown
  ImuNoise noise;
  TriadCalibration gyroscope;      ///< [rad/s]
  TriadCalibration accelerometer;  ///< [m/s^2]
};

struct MagnetometerCalibration {
  TriadCalibration triad;  ///< [T], hard iron and soft iron, result in body axes
};

enum class DistortionModel { kNone, kRadtan, kEquidistant };

struct CameraCalibration {
  std::string name;  ///< "cam0"
  std::int32_t width_px = 0;
  std::int32_t height_px = 0;
  Eigen::Vector4d intrinsics_px = Eigen::Vector4d::Zero();  ///< fx, fy, cx, cy
  DistortionModel distortion_model = DistortionModel::kNone;
  Eigen::Vector4d distortion = Eigen::Vector4d::Zero();  ///< radtan: k1 k2 p1 p2; equidistant: k1..k4
  Pose3 T_body_camera;
  double time_offset_s = 0;  ///< t_imu = t_camera + time_offset (Kalibr's timeshift_cam_imu)
  double rate_hz = 0;        ///< nominal; 0 when unknown
};

struct GpsCalibration {
  Eigen::Vector3d antenna_in_body = Eigen::Vector3d::Zero();  ///< lever arm [m]
};

/// The sensors of one device; the body frame is the IMU's.
struct Rig {
  std::optional<ImuCalibration> imu;
  std::optional<MagnetometerCalibration> magnetometer;
  std::vector<CameraCalibration> cameras;
  std::optional<GpsCalibration> gps;

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// The measurement as the rig's calibration corrects it: gyroscope, accelerometer and magnetometer; other streams and
/// sensors without calibration pass unchanged.
Measurement calibrated(const Rig& rig, Measurement measurement);

}  // namespace loc
