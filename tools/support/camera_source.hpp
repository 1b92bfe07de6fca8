// A camera that is connected now. What grabs its pictures is behind CameraGrabber (v4l2_camera.hpp has the one for
// V4L2), so that all else is tested without a device: a thread grabs, the newest pictures win when nobody takes them in
// time, and when the camera is unplugged it is opened anew, as often as it takes. What happened is told and counted.
//
// time_ns and host_time_ns are on the host's clock: the device's own stamp, where it is one of the host's monotonic
// clock or of its time of day (the kernel stamps a picture when its first bytes arrive), otherwise the arrival of the
// whole picture in this program. Neither is the middle of the exposure: calibration finds the difference
// (time_offset_camera_imu).
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "libloc/io/source.hpp"
#include "tools/support/reconnection.hpp"

namespace loc {

/// Why a camera cannot be opened, or that it is gone, and what to do about it. It may succeed later.
class CameraError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct CameraFrame {
  ImageMeasurement image;      ///< picture only, without stamps
  TimeNs device_ns = kNoTime;  ///< the device's stamp, on whatever clock; kNoTime: it has none
};

/// One camera while it is open.
class CameraGrabber {
 public:
  CameraGrabber() = default;
  CameraGrabber(const CameraGrabber&) = delete;
  CameraGrabber& operator=(const CameraGrabber&) = delete;
  virtual ~CameraGrabber() = default;

  /// Waits for the next picture, a second or so at most; nullopt when none came. From one thread.
  /// @throws CameraError when the camera is gone.
  virtual std::optional<CameraFrame> grab() = 0;
  /// What was set, for the log: "640x480 MJPG 30 Hz".
  virtual std::string description() const = 0;
};

/// Something that can be opened and opened again.
struct CameraConnection {
  std::string name;                                      ///< for log lines: "/dev/video0"
  std::function<std::unique_ptr<CameraGrabber>()> open;  ///< @throws CameraError
};

struct LiveCameraOptions {
  std::int32_t camera = 0;   ///< index of the camera in the rig
  double silence_s = 2;      ///< without a picture, after which it is told
  double reconnect_s = 1;    ///< between two attempts
  bool wait = false;         ///< the camera may be absent at the start
  std::size_t capacity = 4;  ///< pictures that may wait for next(); the oldest make room
  /// To the layout that is wanted; @throws DataError for a damaged picture, which is left out and counted. Called by
  /// next(). None: as they are.
  std::function<ImageMeasurement(ImageMeasurement)> convert;
  std::function<void()> on_idle;                       ///< at least five times a second while next() waits
  std::function<void(const std::string&)> on_trouble;  ///< as in ReconnectionOptions

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// @return a source whose next() waits. counts(): "image.read", "camera.dropped" (nobody took them in time),
/// "image.skipped.damaged", "image.skipped.time_not_increasing", "camera.stamped_by_kernel",
/// "camera.stamped_at_arrival", and those of the connection.
/// @throws CameraError when the camera cannot be opened, unless options.wait.
std::unique_ptr<MeasurementSource> open_camera(CameraConnection connection, LiveCameraOptions options);

}  // namespace loc
