// The sources of pictures on a command line: camera, video, images, and --images of euroc.
#pragma once

#include <optional>
#include <string>

#include "tools/support/cli_forward.hpp"

namespace loc {

struct SourceSpec;

/// What the user asked for; as in libloc/vision and v4l2_camera.hpp, without OpenCV.
struct ImageSpec {
  bool wanted = false;         ///< euroc: pictures, too
  std::string format = "raw";  ///< "jpeg" or "raw"
  int jpeg_quality = 90;
  bool colour = false;
  int camera = 0;  ///< index in the rig
  // images, video
  double rate_hz = 0;  ///< 0: not given
  std::string names;   ///< unit of names that are times
  std::string times_file;
  std::string time_unit;    ///< of times_file
  std::string imu_file;     ///< video: CSV beside it
  std::string start = "0";  ///< video: on the IMU's clock [s], or "imu"
  // camera
  int width_px = 640;
  int height_px = 480;
  std::string pixels;
  std::optional<double> exposure_ms;
  double silence_s = 2;
  double reconnect_s = 1;
  bool wait = false;

  /// @throws std::invalid_argument, UsageError
  void check() const;
};

/// Adds camera, video and images; the one that is called sets kind, path and what else it has.
void add_image_sources(CLI::App& app, SourceSpec& spec);
/// Adds --images and what belongs to it to euroc.
void add_image_options(CLI::App& euroc, SourceSpec& spec);

}  // namespace loc
