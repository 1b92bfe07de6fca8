#include "tools/support/estimate_output.hpp"

#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "libloc/io/csv.hpp"
#include "libloc/io/lcm_log.hpp"
#include "libloc/io/tum.hpp"
#include "msgs/convert.hpp"
#include "msgs/slam_messages.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

// Lines of estimates in the order of their times. When SLAM has started it knows its frames from before that, too: they
// come in front of the first estimate, or of the first one after a new start.
class LinesOutput : public EstimateOutput {
 public:
  void write(const Estimate& estimate) final {
    write_first();
    first_ = estimate;
    if (any_ && (estimate.status & kReinitialised) == 0) write_first();
    any_ = true;
  }
  void write_frame(const SlamFrame& frame) final {
    const TimeNs time_ns = frame.estimate.time_ns;
    if (first_ && time_ns > last_ns_ && time_ns < first_->time_ns) {
      put(frame.estimate);
      last_ns_ = time_ns;
    }
  }

 protected:
  virtual void put(const Estimate& estimate) = 0;
  void write_first() {
    if (!first_) return;
    put(*first_);
    last_ns_ = first_->time_ns;
    first_.reset();
  }

 private:
  std::optional<Estimate> first_;  // waits for the frames before it
  TimeNs last_ns_ = kNoTime;
  bool any_ = false;
};

class CsvOutput : public LinesOutput {
 public:
  explicit CsvOutput(const std::string& path) : writer_(path) {}
  void finish() override {
    write_first();
    writer_.flush();
  }

 private:
  void put(const Estimate& estimate) override { writer_.write(estimate); }

  CsvWriter writer_;
};

class TumOutput : public LinesOutput {
 public:
  explicit TumOutput(std::string path) : path_(std::move(path)) {}
  void finish() override {
    write_first();
    if (without_position_ > 0) {
      log_warning("event=no_position file=\"{}\" poses={} effect=\"the position column holds 0\"", path_,
                  without_position_);
    }
    if (without_orientation_ > 0) {
      log_warning("event=left_out file=\"{}\" estimates_without_orientation={}", path_, without_orientation_);
    }
    if (time_set_back_ > 0) {
      // A trajectory has one time line; CSV and LCM logs hold these estimates.
      log_warning("event=left_out file=\"{}\" estimates_after_clock_was_set_back={}", path_, time_set_back_);
    }
    write_tum(path_, trajectory_);
  }

 private:
  void put(const Estimate& estimate) override {
    if ((estimate.valid & kValidOrientation) == 0) {
      ++without_orientation_;
      return;
    }
    if (!trajectory_.empty() && estimate.time_ns <= trajectory_.times_ns.back()) {
      ++time_set_back_;
      return;
    }
    const bool position = (estimate.valid & kValidPosition) != 0;
    if (!position) ++without_position_;
    trajectory_.push_back(estimate.time_ns,
                          Pose3(estimate.q_world_body, position ? estimate.position : Eigen::Vector3d::Zero().eval()));
  }

  std::string path_;
  Trajectory trajectory_;
  std::int64_t without_position_ = 0;
  std::int64_t without_orientation_ = 0;
  std::int64_t time_set_back_ = 0;
};

class LogOutput : public EstimateOutput {
 public:
  LogOutput(const std::string& path, std::string method, std::string world)
      : writer_(path), method_(std::move(method)), world_(std::move(world)) {}
  void write(const Estimate& estimate) override {
    write_message(estimate.time_ns, kEstimateChannel, to_message(estimate, method_, world_));
    if (const auto more = to_fusion_message(estimate)) write_message(estimate.time_ns, kFusionChannel, *more);
  }
  void write_frame(const SlamFrame& frame) override {
    write_message(frame.time_ns, kSlamFrameChannel, to_message(frame));
  }
  void write_map(const Stamp& stamp, std::span<const SlamMapPoint> map) override {
    write_message(stamp.time_ns, kMapChannel, to_message(stamp, map));
  }
  void finish() override { writer_.flush(); }

 private:
  template <class Message>
  void write_message(TimeNs time_ns, const char* channel, const Message& message) {
    bytes_.resize(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(bytes_.data(), 0, static_cast<int>(bytes_.size()));
    writer_.write(time_ns / 1000, channel, bytes_);
  }

  LcmLogWriter writer_;
  std::string method_;
  std::string world_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

std::unique_ptr<EstimateOutput> open_estimate_output(const std::string& path, const std::string& method,
                                                     const std::string& world, const GeoOutputOptions& geo) {
  const std::string extension = std::filesystem::path(path).extension();
  if (extension == ".csv") return std::make_unique<CsvOutput>(path);
  if (extension == ".tum" || extension == ".txt") return std::make_unique<TumOutput>(path);
  if (extension == ".lcm" || extension == ".log") return std::make_unique<LogOutput>(path, method, world);
  if (is_geo_output(path)) return open_geo_output(path, "libloc " + method, geo);
  throw UsageError(
      path + ": what to write follows from the ending: .csv, .tum (or .txt), .lcm (or .log), .gpx, .kml, .geojson");
}

}  // namespace loc
