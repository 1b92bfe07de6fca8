#include "tools/support/v4l2_camera.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <system_error>
#include <utility>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/vision/image_view.hpp"
#include "tools/support/file_descriptor.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr TimeNs kGone = 300'000'000;  // a grab that fails within that did not wait for a picture
constexpr double kManual = 1;          // V4L2_EXPOSURE_MANUAL
constexpr double kExposureUnitMs = 0.1;

int fourcc(const char* name) {
  return cv::VideoWriter::fourcc(name[0], name[1], name[2], name[3]);
}

std::string name_of(int code) {
  std::string name;
  for (unsigned shift = 0; shift < 32; shift += 8)
    name += static_cast<char>((static_cast<unsigned>(code) >> shift) & 0xffU);
  return name;
}

std::string cameras_here() {
  std::vector<std::string> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", error)) {
    if (entry.path().filename().string().starts_with("video")) found.push_back(entry.path());
  }
  std::ranges::sort(found);
  std::string out;
  for (const std::string& name : found) out += (out.empty() ? "" : " ") + name;
  return out.empty() ? "none" : out;
}

std::string advice(int number) {
  switch (number) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return ": is the camera plugged in? Cameras here: " + cameras_here();
    case EACCES:
    case EPERM:
      return ": cameras belong to the group video: sudo usermod -aG video $USER, then log in again";
    default:
      return "";
  }
}

// OpenCV says only that it could not.
void look_at(const std::string& device) {
  const FileDescriptor file(::open(device.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!file) {
    const int number = errno;
    throw CameraError(device + ": cannot be opened: " + std::generic_category().message(number) + advice(number));
  }
  struct stat status {};
  if (::fstat(file.get(), &status) == 0 && (S_ISREG(status.st_mode) || S_ISDIR(status.st_mode))) {
    throw CameraError(device + ": is no camera; files are read with loc-driver video and loc-driver images");
  }
}

class V4l2Grabber final : public CameraGrabber {
 public:
  V4l2Grabber(std::string device, CameraSettings settings)
      : device_(std::move(device)), settings_(std::move(settings)) {
    look_at(device_);
    // A select of OpenCV lasts ten seconds otherwise, and nobody could stop it.
    ::setenv("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "1", 0);
    if (!capture_.open(device_, cv::CAP_V4L2)) {
      throw CameraError(device_ + ": cannot be opened as a camera (is it in use, or an output?)");
    }
    if (settings_.pixels.empty() && settings_.prefer_jpeg) capture_.set(cv::CAP_PROP_FOURCC, fourcc("MJPG"));
    if (!settings_.pixels.empty()) capture_.set(cv::CAP_PROP_FOURCC, fourcc(settings_.pixels.c_str()));
    capture_.set(cv::CAP_PROP_FRAME_WIDTH, settings_.width_px);
    capture_.set(cv::CAP_PROP_FRAME_HEIGHT, settings_.height_px);
    capture_.set(cv::CAP_PROP_FPS, settings_.rate_hz);
    capture_.set(cv::CAP_PROP_CONVERT_RGB, 0);
    format_ = static_cast<int>(capture_.get(cv::CAP_PROP_FOURCC));
    const double width = capture_.get(cv::CAP_PROP_FRAME_WIDTH);
    const double height = capture_.get(cv::CAP_PROP_FRAME_HEIGHT);
    if (width != settings_.width_px || height != settings_.height_px) {
      throw CameraError(device_ + ": does not take " + std::to_string(settings_.width_px) + " x " +
                        std::to_string(settings_.height_px) + " pixels, it offers " + to_text(width) + " x " +
                        to_text(height));
    }
    if (!settings_.pixels.empty() && name_of(format_) != settings_.pixels) {
      throw CameraError(device_ + ": does not give " + settings_.pixels + ", but " + name_of(format_));
    }
    if (settings_.exposure_ms) set_exposure();
  }

  std::optional<CameraFrame> grab() override {
    const TimeNs begin = steady_now();
    if (!capture_.grab()) {
      if (steady_now() - begin < kGone || ::access(device_.c_str(), F_OK) != 0) {
        throw CameraError("the device gives no more pictures" + advice(ENODEV));
      }
      return std::nullopt;
    }
    CameraFrame frame;
    const double stamp_ms = capture_.get(cv::CAP_PROP_POS_MSEC);
    if (std::isfinite(stamp_ms) && stamp_ms > 0)
      frame.device_ns = static_cast<TimeNs>(std::llround(stamp_ms * 1e3)) * 1000;
    cv::Mat raw;
    if (!capture_.retrieve(raw) || raw.empty()) return std::nullopt;
    frame.image = image_from(raw);
    frame.image.exposure_ns = exposure_ns_;
    return frame;
  }

  std::string description() const override {
    return std::to_string(settings_.width_px) + "x" + std::to_string(settings_.height_px) + " " + name_of(format_) +
           " " + to_text(capture_.get(cv::CAP_PROP_FPS)) + " Hz";
  }

 private:
  void set_exposure() {
    const bool set = capture_.set(cv::CAP_PROP_AUTO_EXPOSURE, kManual) &&
                     capture_.set(cv::CAP_PROP_EXPOSURE, *settings_.exposure_ms / kExposureUnitMs);
    const double is_ms = capture_.get(cv::CAP_PROP_EXPOSURE) * kExposureUnitMs;
    if (!set || !(is_ms > 0)) throw CameraError(device_ + ": its exposure cannot be set");
    exposure_ns_ = from_seconds(is_ms * 1e-3);
  }

  ImageMeasurement image_from(const cv::Mat& raw) const {
    const bool whole = raw.rows == settings_.height_px && raw.cols == settings_.width_px;
    const bool planar =
        raw.channels() == 1 && raw.cols == settings_.width_px && raw.rows == settings_.height_px * 3 / 2;
    if (format_ == fourcc("MJPG") || format_ == fourcc("JPEG")) {
      ImageMeasurement image;
      image.width_px = settings_.width_px;
      image.height_px = settings_.height_px;
      image.format = PixelFormat::kMjpeg;
      image.data = std::make_shared<const std::vector<std::uint8_t>>(raw.datastart, raw.dataend);
      return image;
    }
    if (format_ == fourcc("GREY") && whole && raw.type() == CV_8UC1) return image_of(raw, PixelFormat::kGray);
    if ((format_ == fourcc("YUYV") || format_ == fourcc("UYVY")) && whole && raw.type() == CV_8UC2) {
      const bool y_first = format_ == fourcc("YUYV");
      return packed(raw, y_first ? cv::COLOR_YUV2BGR_YUYV : cv::COLOR_YUV2BGR_UYVY, y_first ? 0 : 1);
    }
    if (format_ == fourcc("BGR3") && whole && raw.type() == CV_8UC3) return image_of(raw, PixelFormat::kBgr);
    if (format_ == fourcc("RGB3") && whole && raw.type() == CV_8UC3) return image_of(raw, PixelFormat::kRgb);
    if (planar && format_ == fourcc("NV12")) return planes(raw, cv::COLOR_YUV2BGR_NV12);
    if (planar && format_ == fourcc("YU12")) return planes(raw, cv::COLOR_YUV2BGR_I420);
    if (planar && format_ == fourcc("YV12")) return planes(raw, cv::COLOR_YUV2BGR_YV12);
    throw CameraError(device_ + ": gives pictures as " + name_of(format_) +
                      ", which are not known here; choose others with --pixels (MJPG, YUYV, GREY, NV12)");
  }

  ImageMeasurement packed(const cv::Mat& raw, int conversion, int brightness) const {
    cv::Mat out;
    if (settings_.colour) {
      cv::cvtColor(raw, out, conversion);
      return image_of(out, PixelFormat::kBgr);
    }
    cv::extractChannel(raw, out, brightness);
    return image_of(out, PixelFormat::kGray);
  }

  ImageMeasurement planes(const cv::Mat& raw, int conversion) const {
    if (!settings_.colour) return image_of(raw.rowRange(0, settings_.height_px), PixelFormat::kGray);
    cv::Mat out;
    cv::cvtColor(raw, out, conversion);
    return image_of(out, PixelFormat::kBgr);
  }

  std::string device_;
  CameraSettings settings_;
  cv::VideoCapture capture_;
  int format_ = 0;
  TimeNs exposure_ns_ = 0;
};

}  // namespace

void CameraSettings::check() const {
  require(width_px > 0 && width_px <= 16384, "width", width_px, "must be 1 to 16384");
  require(height_px > 0 && height_px <= 16384, "height", height_px, "must be 1 to 16384");
  require_positive("rate-hz", rate_hz);
  require(pixels.empty() || pixels.size() == 4, "pixels '" + pixels + "': must be four letters, as MJPG");
  if (exposure_ms) require_positive("exposure-ms", *exposure_ms);
}

CameraConnection v4l2_camera(const std::string& device, const CameraSettings& settings) {
  settings.check();
  return {.name = device, .open = [device, settings] { return std::make_unique<V4l2Grabber>(device, settings); }};
}

}  // namespace loc
