// Cameras of Linux (V4L2: USB, MIPI, loopback) through OpenCV, without its conversion to BGR: a JPEG stays as the
// camera made it, of YUV the brightness is taken as it is.
#pragma once

#include <optional>
#include <string>

#include "tools/support/camera_source.hpp"

namespace loc {

struct CameraSettings {
  int width_px = 640;
  int height_px = 480;
  double rate_hz = 30;
  std::string pixels;                 ///< fourcc as V4L2 names it: MJPG, YUYV, GREY, …; empty: as the driver likes
  bool prefer_jpeg = false;           ///< MJPG where the camera has it, unless pixels is set
  std::optional<double> exposure_ms;  ///< fixed; none: automatic, as the camera was left
  bool colour = false;                ///< BGR instead of grey, where the camera has it

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// @param device /dev/videoN, or a name that is the same after replugging: /dev/v4l/by-id/…
/// Its open() @throws CameraError when the device is not there, is in use, or does not take the settings: a size that
/// was not asked for would not fit the calibration.
CameraConnection v4l2_camera(const std::string& device, const CameraSettings& settings);

}  // namespace loc
