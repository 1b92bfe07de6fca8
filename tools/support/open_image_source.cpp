#include "tools/support/open_image_source.hpp"

#include <filesystem>
#include <utility>

#include "libloc/vision/image_codec.hpp"
#include "libloc/vision/image_source.hpp"
#include "libloc/vision/video_source.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"
#include "tools/support/v4l2_camera.hpp"

namespace loc {
namespace {

constexpr int kSkipsLogged = 10;
constexpr double kCameraRateHz = 30;
constexpr const char* kFirstCamera = "/dev/video0";

PixelFormat pixels_of(const ImageSpec& spec) {
  return spec.colour ? PixelFormat::kBgr : PixelFormat::kGray;
}

/// In the layout that is published.
ImageMeasurement published(ImageMeasurement image, const ImageSpec& spec) {
  const bool as_it_is = spec.format == "jpeg" && image.format == PixelFormat::kMjpeg;
  if (!as_it_is) image = decode_image(image, pixels_of(spec));
  return spec.format == "jpeg" ? encode_jpeg(image, spec.jpeg_quality) : image;
}

class JpegSource final : public MeasurementSource {
 public:
  JpegSource(std::unique_ptr<MeasurementSource> source, ImageSpec spec)
      : source_(std::move(source)), spec_(std::move(spec)) {}
  std::optional<Measurement> next() override {
    std::optional<Measurement> measurement = source_->next();
    auto* image = measurement ? std::get_if<ImageMeasurement>(&*measurement) : nullptr;
    if (image != nullptr) *image = published(std::move(*image), spec_);
    return measurement;
  }
  void stop() override { source_->stop(); }
  NamedCounts counts() const override { return source_->counts(); }

 private:
  std::unique_ptr<MeasurementSource> source_;
  ImageSpec spec_;
};

ImageReadOptions read_options(const ImageSpec& spec) {
  return {.format = spec.format == "jpeg" ? PixelFormat::kMjpeg : pixels_of(spec),
          .on_skip = [told = 0](const std::string& why) mutable {
            if (++told <= kSkipsLogged) log_warning("event=picture_left_out reason=\"{}\"", why);
          }};
}

std::unique_ptr<MeasurementSource> open_folder(const SourceSpec& spec) {
  const ImageSpec& images = spec.images;
  return open_image_folder(spec.path, {.read = read_options(images),
                                       .camera = images.camera,
                                       .rate_hz = images.rate_hz,
                                       .name_unit = images.names,
                                       .times_file = images.times_file,
                                       .first_time_ns = 0,
                                       .time_unit = images.time_unit});
}

std::unique_ptr<MeasurementSource> open_video_of(const SourceSpec& spec) {
  const ImageSpec& images = spec.images;
  VideoOptions options{
      .format = pixels_of(images), .camera = images.camera, .start_time_ns = 0, .rate_hz = images.rate_hz};
  if (images.start == "imu") {
    const auto first = open_csv(images.imu_file, spec.csv)->next();
    if (!first) throw UsageError(images.imu_file + ": not one sample in it");
    options.start_time_ns = stamp_of(*first).time_ns;
  } else {
    options.start_time_ns = parse_seconds(images.start);
  }
  if (images.imu_file.empty()) return open_video(spec.path, options);
  return open_video_with(spec.path, options, open_csv(images.imu_file, spec.csv), images.imu_file);
}

std::unique_ptr<MeasurementSource> open_camera_of(const SourceSpec& spec) {
  const ImageSpec& images = spec.images;
  CameraSettings settings;
  settings.width_px = images.width_px;
  settings.height_px = images.height_px;
  settings.rate_hz = images.rate_hz > 0 ? images.rate_hz : kCameraRateHz;
  settings.pixels = images.pixels;
  settings.exposure_ms = images.exposure_ms;
  settings.colour = images.colour;
  settings.prefer_jpeg = images.format == "jpeg";
  LiveCameraOptions options;
  options.camera = images.camera;
  options.silence_s = images.silence_s;
  options.reconnect_s = images.reconnect_s;
  options.wait = images.wait;
  options.on_idle = spec.gps.on_idle;
  options.on_trouble = spec.gps.on_trouble;
  options.convert = [images](ImageMeasurement image) {
    if (image.format == PixelFormat::kMjpeg && images.format == "jpeg") {
      ImageMeasurement checked = jpeg_image(image.data);
      checked.exposure_ns = image.exposure_ns;
      return checked;
    }
    return published(std::move(image), images);
  };
  return open_camera(v4l2_camera(spec.path.empty() ? kFirstCamera : spec.path, settings), std::move(options));
}

}  // namespace

std::unique_ptr<MeasurementSource> open_source_with_images(const SourceSpec& spec) {
  if (!needs_vision(spec)) return open_source(spec);
  spec.images.check();
  if (spec.kind == "camera") return open_camera_of(spec);
  std::error_code error;
  if (!std::filesystem::exists(spec.path, error)) throw UsageError("'" + spec.path + "' does not exist");
  std::unique_ptr<MeasurementSource> source;
  if (spec.kind == "video") source = open_video_of(spec);
  if (spec.kind == "images") source = open_folder(spec);
  if (spec.kind == "euroc")
    source = open_euroc_images(spec.path, {.read = read_options(spec.images), .other = {}, .cameras = {}});
  if (spec.images.format != "jpeg") return source;
  return std::make_unique<JpegSource>(std::move(source), spec.images);
}

}  // namespace loc
