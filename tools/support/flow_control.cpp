#include "tools/support/flow_control.hpp"

#include <algorithm>

#include "libloc/core/check.hpp"
#include "loc/estimate_t.hpp"
#include "loc/statistics_t.hpp"
#include "msgs/decode.hpp"

namespace loc {

FlowControl::FlowControl(std::int64_t window) : window_(window) {
  require(window > 0, "window", static_cast<double>(window), "must be positive");
}

void FlowControl::acknowledge(std::int64_t sequence) {
  // What we did not send was sent by an earlier driver.
  if (sequence <= sent_) acknowledged_ = std::max(acknowledged_, sequence);
}

void FlowControl::abandon() {
  abandoned_ += outstanding();
  acknowledged_ = sent_;
  stuck_since_ns_ = kNoTime;
}

void FlowControl::on_estimate(std::span<const std::uint8_t> data) {
  try {
    const auto estimate = decode_message<estimate_t>(data);
    // Estimates of a camera alone carry numbers of frames.
    if (estimate.method != kFrameMethod) acknowledge(estimate.sequence);
  } catch (const DataError&) {
    ++garbage_;
  }
}

void FlowControl::on_statistics(std::span<const std::uint8_t> data, TimeNs now_ns) {
  statistics_t message{};
  try {
    message = decode_message<statistics_t>(data);
  } catch (const DataError&) {
    ++garbage_;
    return;
  }
  if (message.program != kEstimatorProgram) return;
  const bool another = answers_++ > 0 && message.process_id != process_id_;
  process_id_ = message.process_id;
  for (std::size_t i = 0; i < message.name.size(); ++i) {
    if (message.name[i] == kImuSequence) acknowledge(static_cast<std::int64_t>(message.value[i]));
  }
  if (another) {
    abandon();
  } else if (outstanding() == 0 || stuck_since_ns_ == kNoTime || stuck_at_ != acknowledged_ || stuck_sent_ != sent_) {
    stuck_at_ = acknowledged_;
    stuck_sent_ = sent_;
    stuck_since_ns_ = now_ns;
  } else if (now_ns - stuck_since_ns_ > kLostAfterNs) {
    abandon();
  }
}

}  // namespace loc
