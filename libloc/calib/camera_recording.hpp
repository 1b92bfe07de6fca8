// What one camera of a rig has recorded of a calibration target: input of calib/camera_imu and camera_imu_lint.
#pragma once

#include <vector>

#include "libloc/sensors/rig.hpp"
#include "libloc/sensors/target.hpp"

namespace loc {

/// What one camera of the rig has seen.
struct CameraRecording {
  CameraCalibration camera;       ///< intrinsics, with their deviations when it has them; its pose plays no part
  std::vector<TargetView> views;  ///< pictures with their times on the camera's clock
};

}  // namespace loc
