// Looks at a recording for camera-IMU calibration before anything is solved, and says in plain words what is wrong with
// it: units, rates, gaps, times, saturation, clocks, the target in the pictures, the noise that is assumed.
// From: what calibrate_camera_imu() takes; IMU samples may be raw or calibrated (but saturation shows in raw ones
// only). To: findings, each with a code that stays, and a sentence with the figures and what to do about it.
//
// It does not judge the motion (that is the calibration's part) and needs no common clock. Nothing is skipped here: a
// sample that the calibration would skip is counted once, under its reason. The size of the turn rates is compared with
// that of the camera's own, from the poses of a few hundred pictures.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "libloc/calib/camera_recording.hpp"
#include "libloc/core/quality.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/target.hpp"

namespace loc {

/// kOk: to be known, nothing is wrong. kFair: a better recording would help. kWarn: the result is in doubt. kRefused:
/// the calibration would fail or be wrong.
struct CameraImuFinding {
  Verdict severity = Verdict::kWarn;
  /// imu.no_samples, imu.not_finite, imu.no_time, imu.time_back, imu.same_time, imu.duplicated, imu.rate_low,
  /// imu.rate_not_nominal, imu.gaps, imu.constant, imu.held, imu.saturated, imu.accelerometer_unit,
  /// imu.gravity_removed, imu.gyroscope_unit; camera.no_target, camera.few_pictures, camera.few_corners,
  /// camera.no_time, camera.time_back, camera.same_time, camera.rate_low, camera.rate_not_nominal, camera.gaps,
  /// camera.target_lost, camera.small_part, camera.outside_image, camera.lens, target.size; recording.short,
  /// clocks.apart, clocks.little_overlap; noise.zero, noise.unit, noise.default, noise.too_large, noise.too_small
  std::string code;
  std::string text;  ///< one sentence or two; of a camera's: begins with its name
};

/// The worst come first. Empty: nothing to be said.
/// @param imu_rate_hz nominal; 0 when unknown
/// @throws std::invalid_argument for what no recording can have: a target, camera or noise that check() refuses, a
/// corner that the target has not, a rate below zero.
std::vector<CameraImuFinding> lint_camera_imu(const CalibrationTarget& target, std::span<const CameraRecording> cameras,
                                              std::span<const ImuMeasurement> imu, const ImuNoise& noise,
                                              double imu_rate_hz);

}  // namespace loc
