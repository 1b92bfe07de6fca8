#include "tools/support/image_options.hpp"

#include <CLI/CLI.hpp>
#include <string_view>

#include "libloc/core/check.hpp"
#include "tools/support/open_source.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

void add_format(CLI::App& source, ImageSpec& images) {
  source
      .add_option("--format", images.format,
                  "How pictures are published: raw (grey), or jpeg (a JPEG of the source goes on as it is)")
      ->check(CLI::IsMember({"raw", "jpeg"}))
      ->capture_default_str();
  source.add_option("--jpeg-quality", images.jpeg_quality, "Of pictures that are made JPEG here")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  source.add_flag("--colour", images.colour, "Colour instead of grey, where there is one");
}

CLI::App* add(CLI::App& app, SourceSpec& spec, const char* kind, const char* argument, const char* text) {
  CLI::App* source = app.add_subcommand(kind, text);
  source->fallthrough();
  source->callback([&spec, kind] { spec.kind = kind; });
  source->add_option(argument, spec.path)->required(std::string_view(kind) != "camera");
  add_format(*source, spec.images);
  source->add_option("--camera", spec.images.camera, "Index of the camera in the rig")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  return source;
}

}  // namespace

void ImageSpec::check() const {
  require_not_negative("rate-hz", rate_hz);
  if (start == "imu") {
    if (imu_file.empty()) throw UsageError("--start-time imu: needs --imu");
    return;
  }
  try {
    parse_seconds(start);
  } catch (const std::invalid_argument&) {
    throw UsageError("--start-time '" + start + "': must be seconds, or imu");
  }
}

void add_image_sources(CLI::App& app, SourceSpec& spec) {
  ImageSpec& images = spec.images;
  CLI::App* folder =
      add(app, spec, "images", "FOLDER", "Folder of pictures: numbered, named by their times, or listed");
  CLI::Option* rate = folder->add_option("--rate-hz", images.rate_hz, "Numbered pictures: so many per second");
  CLI::Option* names = folder->add_option("--names", images.names, "Names are times, in ns, us, ms or s");
  CLI::Option* times = folder->add_option(
      "--times", images.times_file, "List of times and names, or of times alone (rgb.txt, times.txt in it are found)");
  folder->add_option("--times-unit", images.time_unit, "Of that list: ns, us, ms, s; otherwise by its heading, or s");
  rate->excludes(names)->excludes(times);
  names->excludes(times);

  CLI::App* video = add(app, spec, "video", "FILE", "Video file, with the IMU of a CSV file if there is one");
  video->add_option("--rate-hz", images.rate_hz, "Frames per second, instead of the times in the file");
  CLI::Option* imu = video->add_option("--imu", images.imu_file, "CSV file of its IMU, as of source csv");
  video
      ->add_option("--start-time", images.start,
                   "Time of the video's beginning on the IMU's clock [s]; imu: that of the first IMU sample")
      ->capture_default_str();
  video->add_option("--imu-time-unit", spec.csv.time_unit, "ns, us, ms, s; where the heading has none")->needs(imu);

  CLI::App* camera = add(app, spec, "camera", "DEVICE",
                         "Camera, now: /dev/videoN (/dev/video0 unless given), or a name that stays the same after "
                         "replugging: /dev/v4l/by-id/…");
  camera->add_option("--width", images.width_px, "[px]")->capture_default_str();
  camera->add_option("--height", images.height_px, "[px]")->capture_default_str();
  camera->add_option("--rate-hz", images.rate_hz, "Pictures per second; 30 unless given");
  camera->add_option("--pixels", images.pixels,
                     "What the camera is to send: MJPG, YUYV, GREY, …; otherwise MJPG for --format jpeg where it can, "
                     "or as its driver likes");
  camera->add_option("--exposure-ms", images.exposure_ms, "Fixed exposure; otherwise automatic");
  camera->add_option("--silence", images.silence_s, "Seconds without a picture after which it is reported")
      ->capture_default_str();
  camera->add_option("--reconnect", images.reconnect_s, "Seconds between two attempts to open it again")
      ->capture_default_str();
  camera->add_flag("--wait", images.wait, "The camera may be absent at the start: wait for it");
}

void add_image_options(CLI::App& euroc, SourceSpec& spec) {
  euroc.add_flag("--images", spec.images.wanted, "With the pictures of its cameras");
  add_format(euroc, spec.images);
}

}  // namespace loc
