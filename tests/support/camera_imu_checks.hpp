// Calibrations of simulated rigs, against their truth.
#pragma once

#include <array>
#include <vector>

#include "libloc/calib/camera_imu.hpp"
#include "libloc/geometry/so3.hpp"
#include "tests/support/waved_rig.hpp"

namespace loc::test {

inline CameraImuFit calibrate(const WavedRig& rig, const CameraImuOptions& options = {}, const ImuNoise& noise = {}) {
  std::vector<CameraRecording> cameras{{rig.camera, rig.views}};
  if (!rig.second_views.empty()) cameras.push_back({rig.second, rig.second_views});
  return calibrate_camera_imu(rig.target, cameras, rig.imu, noise, options);
}

/// True less found: turn of the camera about the IMU's axes, translation of T_camera_imu, offset.
inline Vector7d error_of(const CameraImuCamera& camera, const Pose3& T_camera_imu, double offset_s) {
  Vector7d out;
  out << so3::boxminus(T_camera_imu.rotation, camera.T_camera_imu.rotation),
      T_camera_imu.translation - camera.T_camera_imu.translation, offset_s - camera.time_offset_s;
  return out;
}

/// Of the first camera.
inline Vector7d error_of(const CameraImuFit& fit, const WavedRig& rig, double offset_s) {
  return error_of(fit.cameras[0], rig.T_camera_imu, offset_s);
}

/// By deviations: each error over what was said of it.
inline Vector7d in_sigmas(const Vector7d& error, const CameraImuCamera& camera) {
  return error.cwiseQuotient(camera.sigma);
}

}  // namespace loc::test
