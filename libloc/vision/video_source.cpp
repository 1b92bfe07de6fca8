#include "libloc/vision/video_source.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/io/merged_source.hpp"
#include "libloc/vision/image_view.hpp"
#include "libloc/vision/opencv_log.hpp"

namespace loc {
namespace {

namespace fs = std::filesystem;

constexpr double kVaries = 0.1;          // of the mean interval
constexpr double kVariesAtLeast = 1e-3;  // [s]: containers round to a millisecond
constexpr double kLongestVideoMs = 1e12;

class VideoSource final : public MeasurementSource {
 public:
  VideoSource(fs::path path, const VideoOptions& options)
      : options_((options.check(), options)), path_(std::move(path)) {
    std::error_code error;
    if (!fs::is_regular_file(path_, error)) throw DataError(path_.string() + ": no such file");
    const OpenCvSilence silence;
    if (!video_.open(path_.string(), cv::CAP_FFMPEG))
      throw DataError(path_.string() + ": is no video that can be read");
    video_.set(cv::CAP_PROP_ORIENTATION_AUTO, 0);
    rotated_deg_ = std::llround(video_.get(cv::CAP_PROP_ORIENTATION_META));
    file_rate_hz_ = video_.get(cv::CAP_PROP_FPS);
    const bool rate_known = std::isfinite(file_rate_hz_) && file_rate_hz_ > 0;
    if (!rate_known) file_rate_hz_ = 0;
    const double frames = video_.get(cv::CAP_PROP_FRAME_COUNT);
    if (rate_known && frames > 0) announced_s_ = frames / file_rate_hz_;
    // A file without a frame is found out here, not by whoever waits for one.
    grabbed_ = grab();
    if (!grabbed_) throw DataError(path_.string() + ": not one frame can be read from it");
  }

  std::optional<Measurement> next() override {
    if (!std::exchange(grabbed_, false) && !grab()) return std::nullopt;
    cv::Mat picture;
    if (!video_.retrieve(picture) || picture.empty()) {
      throw DataError(path_.string() + ": frame " + std::to_string(frame_) + " cannot be decoded");
    }
    if (options_.format == PixelFormat::kGray && picture.channels() == 3) {
      cv::Mat grey;
      cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
      picture = grey;
    }
    ImageMeasurement image = image_of(picture, options_.format);
    image.time_ns = time_of_frame();
    image.sequence = frame_++;
    image.camera = options_.camera;
    return Measurement(std::move(image));
  }

  NamedCounts counts() const override {
    NamedCounts out = {{"image.read", frame_}};
    if (rotated_deg_ != 0) out.push_back({"video.rotated_deg", rotated_deg_});
    if (varies_) out.push_back({"video.rate_varies", 1});
    if (from_rate_ > 0) out.push_back({"video.times_from_rate", from_rate_});
    if (ended_ && announced_s_ > 0 && frame_ > 1 && options_.rate_hz == 0) {
      const double interval = last_s_ / static_cast<double>(frame_ - 1);
      const double missing = announced_s_ - last_s_ - interval;
      if (missing > interval / 2) out.push_back({"video.missing_at_end_ms", std::llround(missing * 1e3)});
    }
    return out;
  }

 private:
  bool grab() {
    const OpenCvSilence silence;
    if (ended_ || !video_.grab()) {
      ended_ = true;
      return false;
    }
    container_ms_ = video_.get(cv::CAP_PROP_POS_MSEC);
    return true;
  }

  // Since the beginning of the file.
  TimeNs time_of_frame() {
    const double given_rate = options_.rate_hz;
    const auto n = static_cast<double>(frame_);
    double time_s = n / given_rate;
    if (given_rate != 0 && !(time_s * 1e3 < kLongestVideoMs)) {
      throw DataError(path_.string() + ": frame " + std::to_string(frame_) + " at " + std::to_string(given_rate) +
                      " Hz is years after the first: another rate was meant");
    }
    if (given_rate == 0) {
      const double container_s = container_ms_ * 1e-3;
      const bool usable = std::isfinite(container_s) && container_ms_ >= 0 && container_ms_ < kLongestVideoMs &&
                          (frame_ == 0 || container_s > last_s_);
      if (!usable && file_rate_hz_ == 0) {
        throw DataError(path_.string() + ": frame " + std::to_string(frame_) +
                        " has no time after the one before it, and the file has no frame rate: name one");
      }
      time_s = usable ? container_s : last_s_ + 1 / file_rate_hz_;
      if (!usable) ++from_rate_;
      if (frame_ > 1) {
        const double mean = last_s_ / (n - 1);
        varies_ = varies_ || std::abs(time_s - last_s_ - mean) > std::max(kVaries * mean, kVariesAtLeast);
      }
    }
    last_s_ = time_s;
    return options_.start_time_ns + static_cast<TimeNs>(std::llround(time_s * 1e9));
  }

  VideoOptions options_;
  fs::path path_;
  cv::VideoCapture video_;
  double file_rate_hz_ = 0;
  double announced_s_ = 0;  // length of the video as the file says
  double container_ms_ = 0;
  double last_s_ = 0;
  bool grabbed_ = false;
  bool ended_ = false;
  bool varies_ = false;
  std::int64_t frame_ = 0;
  std::int64_t rotated_deg_ = 0;
  std::int64_t from_rate_ = 0;
};

}  // namespace

void VideoOptions::check() const {
  require(format == PixelFormat::kGray || format == PixelFormat::kBgr, "format: must be grey or BGR");
  require(camera >= 0, "camera", camera, "must not be negative");
  require_not_negative("rate_hz", rate_hz);
  require(start_time_ns != kNoTime, "start_time_ns: must be a time");
}

std::unique_ptr<MeasurementSource> open_video(const fs::path& path, const VideoOptions& options) {
  return std::make_unique<VideoSource>(path, options);
}

std::unique_ptr<MeasurementSource> open_video_with(const fs::path& path, const VideoOptions& options,
                                                   std::unique_ptr<MeasurementSource> other,
                                                   const std::string& other_name) {
  std::vector<MergeInput> inputs;
  inputs.push_back({path.string(), open_video(path, options)});
  inputs.push_back({other_name, std::move(other)});
  return merge_sources(std::move(inputs), true);
}

}  // namespace loc
