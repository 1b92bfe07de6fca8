// Where the camera-IMU calibration begins: the way of the IMU by the pictures alone, gyroscope between them. Internal
// to calib.
#pragma once

#include <span>
#include <vector>

#include "libloc/calib/camera_imu.hpp"
#include "libloc/calib/camera_imu_problem.hpp"
#include "libloc/calib/camera_imu_views.hpp"

namespace loc::calib {

/// Poses of the IMU in target from pictures of all cameras; another camera's where those before it saw nothing.
struct RoughTrack {
  std::vector<double> times_s;  // of the IMU's clock, rising
  std::vector<Eigen::Quaterniond> rotations;
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Vector3d> t_camera_imu;  // of each camera; zero for those that nothing is known of
};

/// The first camera stands where the IMU is, the others where they saw themselves from there. A target that looks the
/// same after half a turn gets the first camera's numbers in the others.
/// @param starts of each camera
RoughTrack rough_track(const CalibrationTarget& target, std::span<const CameraImuStart> starts, const GyroTurns& gyro,
                       CameraImuRecording& recording);

/// @param gravity its size [m/s^2]
/// @throws DataError where three angles are too narrow for the motion, and for an accelerometer that does not feel
/// gravity.
CameraImuState first_state(const CameraImuRecording& recording, const RoughTrack& track, const GyroTurns& gyro,
                           const ChainPlan& plan, std::span<const CameraRecording> cameras,
                           std::span<const CameraImuStart> starts, RotationForm form, double gravity);

}  // namespace loc::calib
