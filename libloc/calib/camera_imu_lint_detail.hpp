// Parts of camera_imu_lint. Internal to calib.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "libloc/calib/camera_imu_lint.hpp"
#include "libloc/core/time.hpp"

namespace loc::calib {

/// What the times of a stream say. Times of the recording are seconds after the stream's first.
struct StreamTimes {
  std::vector<std::size_t> in_order;  ///< those later than all before, others left out
  std::vector<double> at_s;           ///< their times
  std::int64_t same_time = 0;         ///< as the one before
  std::int64_t steps_back = 0;
  std::int64_t behind = 0;  ///< not later than one before them, same_time not counted
  double longest_back_s = 0;
  double back_at_s = 0;
  double step_s = 0;  ///< median; 0 for fewer than two
  std::int64_t gaps = 0;
  double longest_gap_s = 0;
  double gap_at_s = 0;
  double missing = 0;  ///< share of the samples that the gaps have swallowed

  double span_s() const { return at_s.empty() ? 0 : at_s.back(); }
};
/// A gap is a step of more than three times the median.
StreamTimes look_at_times(std::span<const TimeNs> times);

/// One sensor of the IMU.
struct Triad {
  std::string name;  ///< "gyroscope", "accelerometer"
  std::string unit;
  std::vector<Eigen::Vector3d> values;  ///< of the samples that are in order
  bool constant = false;
};

/// What of the IMU's stream the other parts ask for.
struct ImuLook {
  StreamTimes times;
  TimeNs first_ns = kNoTime;
  Triad gyroscope;
  Triad accelerometer;
};
ImuLook look_at_imu(std::span<const ImuMeasurement> imu, double nominal_hz, std::vector<CameraImuFinding>& out);

struct CameraLook {
  TimeNs first_ns = kNoTime;  ///< of the pictures that show the target
  TimeNs last_ns = kNoTime;
  double turn_rate = 0;    ///< median of the sizes, from poses [rad/s]; 0: not known
  double turn_step_s = 0;  ///< time over which each is the mean
};
CameraLook look_at_camera(const CalibrationTarget& target, const CameraRecording& recording,
                          std::vector<CameraImuFinding>& out);

/// Both together: units of the gyroscope (by the camera when it has something to say), clocks, length.
void look_at_both(const ImuLook& imu, std::span<const CameraRecording> cameras, std::span<const CameraLook> looks,
                  std::vector<CameraImuFinding>& out);

/// The densities, by themselves and against the quietest parts of the recording.
void look_at_noise(const ImuNoise& noise, const ImuLook& imu, std::vector<CameraImuFinding>& out);

// Words of the messages.
std::string count_of(std::int64_t n, const std::string& what);  ///< "1 gap", "3 gaps"
std::string number(double value);                               ///< three digits, an exponent only for 10^9 and up
std::string percent(double share);
std::string at_time(double t_s);  ///< "at 12.3 s"

}  // namespace loc::calib
