// What a camera's calibration is worth: coverage, uncertainty across the image, verdict. Internal to calib.
#pragma once

#include "libloc/calib/camera_intrinsics.hpp"

namespace loc::calib {

/// Fills coverage, tilt_range, uncertainty and quality from the rest of the result.
void judge(CameraFit& fit);

}  // namespace loc::calib
