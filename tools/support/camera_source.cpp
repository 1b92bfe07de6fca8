#include "tools/support/camera_source.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "libloc/core/check.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr int kDamagedInARow = 30;  // pictures: the camera is of no use
constexpr auto kStep = std::chrono::milliseconds(50);
// A stamp that is older, or in the future by more than reading two clocks takes, is of another clock.
constexpr TimeNs kOldestStamp = 2'000'000'000;
constexpr TimeNs kFuture = 1'000'000;
constexpr double kLongestWaitS = 1e6;

struct GrabbedFrame {
  CameraFrame frame;
  TimeNs host_ns = 0;    // when it was grabbed
  TimeNs steady_ns = 0;  // likewise
};

/// Grabs in a thread of its own until the camera is gone.
class GrabThread {
 public:
  GrabThread(std::unique_ptr<CameraGrabber> grabber, std::size_t capacity)
      : grabber_(std::move(grabber)), capacity_(capacity), thread_([this] { run(); }) {}
  GrabThread(const GrabThread&) = delete;
  GrabThread& operator=(const GrabThread&) = delete;
  ~GrabThread() {
    stop_ = true;
    thread_.join();
  }

  /// Waits a moment. @return nullopt when there is none yet, or no more: see ended().
  std::optional<GrabbedFrame> take() {
    std::unique_lock lock(mutex_);
    filled_.wait_for(lock, kStep, [&] { return !frames_.empty() || ended_; });
    if (frames_.empty()) return std::nullopt;
    GrabbedFrame frame = std::move(frames_.front());
    frames_.pop_front();
    return frame;
  }
  /// Why it has ended; nullopt as long as it runs.
  std::optional<std::string> ended() const {
    const std::lock_guard lock(mutex_);
    if (!ended_ || !frames_.empty()) return std::nullopt;
    return why_;
  }
  std::int64_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  void run() {
    std::string why;
    try {
      while (!stop_) {
        std::optional<CameraFrame> frame = grabber_->grab();
        if (!frame) continue;
        GrabbedFrame grabbed{std::move(*frame), host_now(), steady_now()};
        const std::lock_guard lock(mutex_);
        if (frames_.size() == capacity_) {
          frames_.pop_front();
          ++dropped_;
        }
        frames_.push_back(std::move(grabbed));
        filled_.notify_one();
      }
    } catch (const std::exception& error) {
      why = error.what();
    }
    const std::lock_guard lock(mutex_);
    why_ = why;
    ended_ = true;
    filled_.notify_one();
  }

  std::unique_ptr<CameraGrabber> grabber_;
  std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<GrabbedFrame> frames_;
  std::string why_;
  bool ended_ = false;
  std::int64_t dropped_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread thread_;  // last: it uses all of the above
};

class CameraSource final : public MeasurementSource {
 public:
  CameraSource(CameraConnection connection, LiveCameraOptions options)
      : options_((options.check(), std::move(options))),
        connection_(std::move(connection)),
        reconnection_("camera", {options_.reconnect_s, options_.on_idle, options_.on_trouble}) {
    try {
      connect();
    } catch (const CameraError& error) {
      if (!options_.wait) throw;
      reconnection_.failed(error.what());
    }
  }

  void stop() override { reconnection_.stop(); }

  std::optional<Measurement> next() override {
    while (!stop_requested() && !reconnection_.stopped()) {
      if (!thread_) {
        if (!reconnection_.wait()) break;
        try {
          connect();
        } catch (const CameraError& error) {
          reconnection_.failed(error.what());
        }
        continue;
      }
      std::optional<GrabbedFrame> grabbed = thread_->take();
      if (options_.on_idle) options_.on_idle();
      if (grabbed) {
        last_frame_ns_ = steady_now();
        if (auto image = finish(std::move(*grabbed))) return Measurement(std::move(*image));
        continue;
      }
      if (const auto why = thread_->ended()) {
        disconnect(*why);
      } else if (steady_now() - last_frame_ns_ > from_seconds(options_.silence_s)) {
        reconnection_.trouble(connection_.name + " is open and sends no pictures");
      }
    }
    return std::nullopt;
  }

  NamedCounts counts() const override {
    NamedCounts out = {{"image.read", sequence_}};
    reconnection_.add_to(out);
    out.push_back({"camera.dropped", dropped_ + (thread_ ? thread_->dropped() : 0)});
    if (damaged_ > 0) out.push_back({"image.skipped.damaged", damaged_});
    if (not_increasing_ > 0) out.push_back({"image.skipped.time_not_increasing", not_increasing_});
    if (by_kernel_ > 0) out.push_back({"camera.stamped_by_kernel", by_kernel_});
    if (at_arrival_ > 0) out.push_back({"camera.stamped_at_arrival", at_arrival_});
    return out;
  }

 private:
  void connect() {
    std::unique_ptr<CameraGrabber> grabber = connection_.open();
    const std::string description = grabber->description();
    thread_ = std::make_unique<GrabThread>(std::move(grabber), options_.capacity);
    last_frame_ns_ = steady_now();
    reconnection_.connected(connection_.name);
    log_info(R"(event=camera_set name="{}" as="{}")", connection_.name, description);
  }

  void disconnect(const std::string& why) {
    dropped_ += thread_->dropped();
    thread_.reset();
    reconnection_.lost(connection_.name, why);
  }

  /// On the host's clock.
  TimeNs time_of(const GrabbedFrame& grabbed) {
    const TimeNs stamp = grabbed.frame.device_ns;
    const auto is_of = [stamp](TimeNs clock_now) {
      return stamp <= clock_now + kFuture && stamp > clock_now - kOldestStamp;
    };
    if (stamp != kNoTime && is_of(grabbed.steady_ns)) {
      ++by_kernel_;
      return grabbed.host_ns - (grabbed.steady_ns - stamp);
    }
    if (stamp != kNoTime && is_of(grabbed.host_ns)) {
      ++by_kernel_;
      return stamp;
    }
    if (at_arrival_++ == 0) {
      log_warning(
          R"(event=camera_stamps name="{}" reason="its stamps are not of the host's clocks" effect="time of arrival instead")",
          connection_.name);
    }
    return grabbed.host_ns;
  }

  std::optional<ImageMeasurement> finish(GrabbedFrame grabbed) {
    const TimeNs time_ns = time_of(grabbed);
    ImageMeasurement image = std::move(grabbed.frame.image);
    try {
      if (options_.convert) image = options_.convert(std::move(image));
    } catch (const std::exception& error) {
      if (damaged_++ == 0)
        log_warning(R"(event=picture_damaged name="{}" reason="{}")", connection_.name, error.what());
      if (++damaged_in_a_row_ == kDamagedInARow) reconnection_.trouble("sends only damaged pictures");
      return std::nullopt;
    }
    damaged_in_a_row_ = 0;
    reconnection_.trouble("");
    if (time_ns <= last_time_ns_ && last_time_ns_ - time_ns < kOldestStamp) {
      ++not_increasing_;
      return std::nullopt;
    }
    last_time_ns_ = time_ns;
    image.time_ns = image.host_time_ns = time_ns;
    image.camera = options_.camera;
    image.sequence = sequence_++;
    return image;
  }

  LiveCameraOptions options_;
  CameraConnection connection_;
  Reconnection reconnection_;
  std::unique_ptr<GrabThread> thread_;
  TimeNs last_frame_ns_ = 0;  // steady clock
  TimeNs last_time_ns_ = kNoTime;
  std::int64_t sequence_ = 0;
  std::int64_t dropped_ = 0;  // by threads that have ended
  std::int64_t damaged_ = 0;
  int damaged_in_a_row_ = 0;
  std::int64_t not_increasing_ = 0;
  std::int64_t by_kernel_ = 0;
  std::int64_t at_arrival_ = 0;
};

}  // namespace

void LiveCameraOptions::check() const {
  require(camera >= 0, "camera", camera, "must not be negative");
  require_positive("silence", silence_s);
  require_not_negative("reconnect", reconnect_s);
  require(silence_s <= kLongestWaitS, "silence", silence_s, "must be at most 1e6 s");
  require(reconnect_s <= kLongestWaitS, "reconnect", reconnect_s, "must be at most 1e6 s");
  require(capacity > 0, "capacity", 0, "must be positive");
}

std::unique_ptr<MeasurementSource> open_camera(CameraConnection connection, LiveCameraOptions options) {
  return std::make_unique<CameraSource>(std::move(connection), std::move(options));
}

}  // namespace loc
