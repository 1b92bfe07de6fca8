// Start values of the camera-IMU calibration. Internal to calib.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "libloc/calib/camera_imu.hpp"

namespace loc::calib {

/// Times are seconds since an origin that both share.
struct CameraPoseSample {
  double t_s = 0;
  Pose3 T_target_camera;
};
struct ImuRow {
  double t_s = 0;
  Eigen::Vector3d gyro;
  Eigen::Vector3d accel;
};

/// Usual time from one sample to the next: gaps do not make it longer. Two samples are needed.
double sample_period(std::span<const ImuRow> imu);

/// Integral of the gyroscope over time, component by component: mean rates over any interval in constant time.
class MeanRate {
 public:
  explicit MeanRate(std::span<const ImuRow> imu);
  /// Mean of the readings between two times of the recording [rad/s]; outside, the nearest reading goes on.
  Eigen::Vector3d between(double from_s, double to_s) const;
  double begin_s() const { return times_.front(); }
  double end_s() const { return times_.back(); }
  const std::vector<double>& times_s() const { return times_; }

 private:
  Eigen::Vector3d integral(double t_s) const;
  std::vector<double> times_;
  std::vector<Eigen::Vector3d> sums_;  // up to each time
  std::vector<Eigen::Vector3d> rates_;
};

/// How the gyroscope says that the body turned between any two times.
class GyroTurns {
 public:
  GyroTurns(std::span<const ImuRow> imu, Eigen::Vector3d bias);
  /// In the body's axes at the first: R(to) = R(from) turn.
  Eigen::Quaterniond between(double from_s, double to_s) const;

 private:
  Eigen::Quaterniond since_begin(double t_s) const;
  MeanRate rate_;
  Eigen::Vector3d bias_;
  std::vector<Eigen::Quaterniond> turns_;  // from the first sample to each
};

struct StartResult {
  std::optional<CameraImuStart> start;
  std::string failure;  ///< a sentence, when there is none
};

/// @param given_offset_s searched in the neighbourhood of this one only (half a second), when there is one
StartResult find_start(std::span<const CameraPoseSample> poses, std::span<const ImuRow> imu,
                       std::optional<double> given_offset_s);

}  // namespace loc::calib
