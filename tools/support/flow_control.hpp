// How a driver that sends as fast as it can learns what the estimator has taken of one stream. An estimator answers
// each source_status_t with a statistics_t that holds the sequence number of the last measurement that it got of each
// stream it follows: "imu.sequence", "image.sequence", "features.sequence". Besides, estimates carry the number of
// their IMU sample. The first way also covers samples that give no estimate (NaN, waiting for another stream).
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <string>

#include "libloc/core/time.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

/// Names of the counts in statistics_t: "imu.sequence", "image.camera". @{
std::string sequence_name(StreamKind kind);
std::string camera_name(StreamKind kind);
/// @}
/// The streams that drive an estimator; what else there is comes between them.
constexpr bool is_paced(StreamKind kind) {
  return kind == StreamKind::kImu || kind == StreamKind::kImage || kind == StreamKind::kFeatures;
}
inline constexpr const char* kFrameMethod = "mono-slam";
inline constexpr const char* kEstimatorProgram = "loc-estimator";

class FlowControl {
 public:
  /// @param window measurements of the stream that may be on their way
  FlowControl(StreamKind kind, std::int64_t window);

  StreamKind kind() const { return kind_; }
  /// @param camera 0 where there is none
  void sent(std::int64_t sequence, int camera = 0);
  /// Messages of LOC_ESTIMATE and LOC_STATISTICS. Garbage is counted and left aside.
  void on_estimate(std::span<const std::uint8_t> data);
  void on_statistics(std::span<const std::uint8_t> data, TimeNs now_ns);

  /// Always, when the estimator does not take this stream.
  bool may_send() const { return outstanding() < window_ || (answered() && !taken_); }
  std::int64_t outstanding() const { return static_cast<std::int64_t>(on_their_way_.size()); }
  /// Some are on their way to an estimator that takes them, or that has not yet said so.
  bool waits() const { return outstanding() > 0 && (taken_ || !answered()); }
  /// An estimator has answered.
  bool answered() const { return answers_ > 0; }

  /// Samples that were given up: the estimator was started anew, or it answers but has not got on for kLostAfterNs
  /// although nothing else is on its way to it.
  std::int64_t abandoned() const { return abandoned_; }
  std::int64_t garbage() const { return garbage_; }

  static constexpr TimeNs kLostAfterNs = 1'000'000'000;

 private:
  struct Sent {
    std::int64_t sequence;
    int camera;
  };

  void acknowledge(std::int64_t sequence, int camera);
  void abandon();

  StreamKind kind_;
  std::string sequence_name_;
  std::string camera_name_;
  std::int64_t window_;
  bool taken_ = false;  // the last answer had a number of this stream
  std::deque<Sent> on_their_way_;
  std::int64_t changes_ = 0;  // of on_their_way_
  std::int64_t answers_ = 0;
  std::int32_t process_id_ = 0;
  std::int64_t stuck_at_ = -1;  // changes_, when the estimator first answered without having got on
  TimeNs stuck_since_ns_ = kNoTime;
  std::int64_t abandoned_ = 0;
  std::int64_t garbage_ = 0;
};

}  // namespace loc
