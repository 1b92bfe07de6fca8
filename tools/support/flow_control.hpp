// How a driver that sends as fast as it can learns what the estimator has taken. Estimates carry the sequence number of
// their IMU sample; besides, an estimator answers each source_status_t with a statistics_t that holds "imu.sequence",
// its last IMU sample. The second way also covers samples that give no estimate (NaN, waiting for another stream).
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "libloc/core/time.hpp"

namespace loc {

inline constexpr const char* kImuSequence = "imu.sequence";
inline constexpr const char* kFrameMethod = "mono-slam";
inline constexpr const char* kEstimatorProgram = "loc-estimator";

class FlowControl {
 public:
  /// @param window IMU samples that may be on their way
  explicit FlowControl(std::int64_t window);

  void sent(std::int64_t imu_sequence) { sent_ = imu_sequence; }
  /// Messages of LOC_ESTIMATE and LOC_STATISTICS. Garbage is counted and left aside.
  void on_estimate(std::span<const std::uint8_t> data);
  void on_statistics(std::span<const std::uint8_t> data, TimeNs now_ns);

  bool may_send() const { return outstanding() < window_; }
  std::int64_t outstanding() const { return sent_ - acknowledged_; }
  /// An estimator has answered.
  bool answered() const { return answers_ > 0; }

  /// Samples that were given up: the estimator was started anew, or it answers but has not got on for kLostAfterNs
  /// although nothing else is on its way to it.
  std::int64_t abandoned() const { return abandoned_; }
  std::int64_t garbage() const { return garbage_; }

  static constexpr TimeNs kLostAfterNs = 1'000'000'000;

 private:
  void acknowledge(std::int64_t sequence);
  void abandon();

  std::int64_t window_;
  std::int64_t sent_ = -1;
  std::int64_t acknowledged_ = -1;
  std::int64_t answers_ = 0;
  std::int32_t process_id_ = 0;
  std::int64_t stuck_at_ = -1;    // acknowledged, when the estimator first answered without having got on
  std::int64_t stuck_sent_ = -1;  // sent, at that time
  TimeNs stuck_since_ns_ = kNoTime;
  std::int64_t abandoned_ = 0;
  std::int64_t garbage_ = 0;
};

}  // namespace loc
