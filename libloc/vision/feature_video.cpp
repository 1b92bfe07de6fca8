#include "libloc/vision/feature_video.hpp"

#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/vision/image_view.hpp"
#include "libloc/vision/opencv_log.hpp"

namespace loc {
namespace {

constexpr int kShift = 4;  // lines and dots are drawn to a sixteenth of a pixel

cv::Point fixed_point(const Eigen::Vector2d& pixel) {
  return {static_cast<int>(std::lround(pixel.x() * (1 << kShift))),
          static_cast<int>(std::lround(pixel.y() * (1 << kShift)))};
}

}  // namespace

void FeatureVideoOptions::check() const {
  require(width_px > 0 && width_px <= 16384, "width_px", width_px, "must be 1 to 16384");
  require(height_px > 0 && height_px <= 16384, "height_px", height_px, "must be 1 to 16384");
  require_positive("rate_hz", rate_hz);
  require(tail_frames >= 0, "tail_frames", tail_frames, "must not be negative");
  require(dot_radius_px >= 1 && dot_radius_px <= 100, "dot_radius_px", dot_radius_px, "must be 1 to 100");
}

FeaturePainter::FeaturePainter(const FeatureVideoOptions& options) : options_((options.check(), options)) {}

ImageMeasurement FeaturePainter::draw(const FeaturesMeasurement& features, const ImageMeasurement* picture) {
  cv::Mat canvas(options_.height_px, options_.width_px, CV_8UC3, cv::Scalar(255, 255, 255));
  if (picture != nullptr) {
    require(picture->width_px == options_.width_px && picture->height_px == options_.height_px,
            "picture: must have the size of the video");
    canvas = bgr_of(*picture);
  }
  const cv::Scalar dot = picture != nullptr ? cv::Scalar(0, 255, 255) : cv::Scalar(0, 0, 0);
  const cv::Scalar tail_colour = picture != nullptr ? cv::Scalar(0, 160, 255) : cv::Scalar(150, 150, 150);

  std::map<std::int64_t, std::deque<Eigen::Vector2d>> tails;  // of those that are seen now
  for (const FeatureObservation& feature : features.features) {
    require(feature.pixel_px.allFinite() && feature.pixel_px.cwiseAbs().maxCoeff() < 1e6,
            "feature " + std::to_string(feature.id) + ": its pixel must be finite, and near the image");
    std::deque<Eigen::Vector2d>& tail = tails[feature.id];
    if (const auto old = tails_.find(feature.id); old != tails_.end()) tail = std::move(old->second);
    tail.push_back(feature.pixel_px);
    while (std::ssize(tail) > options_.tail_frames + 1) tail.pop_front();
    for (std::size_t i = 0; i + 1 < tail.size(); ++i) {
      cv::line(canvas, fixed_point(tail[i]), fixed_point(tail[i + 1]), tail_colour, 1, cv::LINE_AA, kShift);
    }
  }
  tails_ = std::move(tails);
  for (const FeatureObservation& feature : features.features) {
    cv::circle(canvas, fixed_point(feature.pixel_px), options_.dot_radius_px << kShift, dot, cv::FILLED, cv::LINE_AA,
               kShift);
    if (!options_.identities) continue;
    const cv::Point beside(static_cast<int>(feature.pixel_px.x()) + options_.dot_radius_px + 2,
                           static_cast<int>(feature.pixel_px.y()) - 2);
    cv::putText(canvas, std::to_string(feature.id), beside, cv::FONT_HERSHEY_PLAIN, 0.7, dot, 1, cv::LINE_AA);
  }
  ImageMeasurement out = image_of(canvas, PixelFormat::kBgr);
  static_cast<Stamp&>(out) = features;
  out.camera = features.camera;
  return out;
}

struct VideoFile::Writer {
  std::filesystem::path path;
  cv::Size size;
  cv::VideoWriter writer;
  std::string codec;
  std::int64_t frames = 0;
};

VideoFile::VideoFile(const std::filesystem::path& path, int width, int height, double rate_hz)
    : writer_(std::make_unique<Writer>()) {
  // Colour is kept for squares of four pixels.
  require(width > 0 && width % 2 == 0, "width_px", width, "must be positive and even");
  require(height > 0 && height % 2 == 0, "height_px", height, "must be positive and even");
  require_positive("rate_hz", rate_hz);
  const std::string ending = path.extension().string();
  std::vector<std::string> codecs;
  if (ending == ".mp4") codecs = {"avc1", "mp4v"};
  if (ending == ".avi") codecs = {"FFV1"};
  if (codecs.empty()) throw DataError(path.string() + ": a video is .mp4 or .avi");
  writer_->path = path;
  writer_->size = {width, height};
  const OpenCvSilence silence;
  for (const std::string& codec : codecs) {
    const int fourcc = cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]);
    if (!writer_->writer.open(path.string(), cv::CAP_FFMPEG, fourcc, rate_hz, writer_->size)) continue;
    writer_->codec = codec;
    return;
  }
  throw DataError(path.string() + ": cannot be written, or OpenCV has no encoder for it");
}

VideoFile::VideoFile(VideoFile&&) noexcept = default;
VideoFile& VideoFile::operator=(VideoFile&&) noexcept = default;
VideoFile::~VideoFile() = default;

void VideoFile::add(const ImageMeasurement& image) {
  require(image.width_px == writer_->size.width && image.height_px == writer_->size.height,
          "image: must have the size of the video");
  writer_->writer.write(bgr_of(image));
  ++writer_->frames;
}

void VideoFile::finish() {
  writer_->writer.release();
  const std::string name = writer_->path.string();
  if (writer_->frames == 0) return;
  // The writer says nothing of a full disk or a broken encoder: see what the file says of itself, and that it begins.
  const OpenCvSilence silence;
  cv::VideoCapture file(name, cv::CAP_FFMPEG);
  const auto frames = file.isOpened() && file.grab() ? std::llround(file.get(cv::CAP_PROP_FRAME_COUNT)) : 0;
  if (frames != writer_->frames) {
    throw DataError(name + ": " + std::to_string(frames) + " pictures can be read of " +
                    std::to_string(writer_->frames) + " that were written");
  }
}

const std::string& VideoFile::codec() const {
  return writer_->codec;
}

std::int64_t VideoFile::frames() const {
  return writer_->frames;
}

FeatureVideo::FeatureVideo(const std::filesystem::path& path, const FeatureVideoOptions& options)
    : painter_(options), file_(path, options.width_px, options.height_px, options.rate_hz) {}

}  // namespace loc
