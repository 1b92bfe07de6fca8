// What the camera-IMU calibration works on: samples and pictures on one axis of time, pictures with their poses.
// Internal to calib.
#pragma once

#include <span>
#include <vector>

#include "libloc/calib/camera_imu.hpp"
#include "libloc/calib/camera_imu_problem.hpp"
#include "libloc/calib/camera_imu_start.hpp"

namespace loc::calib {

struct CameraImuRecording {
  TimeNs origin = 0;
  std::vector<ImuRow> imu;
  struct OfCamera {
    std::vector<FrameRow> frames;         // in order of time
    std::vector<CameraPoseSample> poses;  // one for each frame
  };
  std::vector<OfCamera> cameras;
};

/// Skips samples that are not finite or not later than the one before, and pictures without a pose; says so in fit.
/// @throws DataError for fewer than two samples.
CameraImuRecording read_recording(const CalibrationTarget& target, std::span<const CameraRecording> cameras,
                                  std::span<const ImuMeasurement> imu, double corner_sigma_px, CameraImuFit& fit);

/// A target that looks the same after half a turn (a quarter, when it is square) gets its corners numbered anew in each
/// picture so that it does not jump from one to the next. Across gaps the gyroscope tells.
/// @returns the number of pictures that were changed
int unify_numbers(const CalibrationTarget& target, const MeanRate& gyro, const CameraImuStart* start,
                  CameraImuRecording::OfCamera& camera);

}  // namespace loc::calib
