#include "tools/support/flow_control.hpp"

#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"
#include "loc/estimate_t.hpp"
#include "loc/statistics_t.hpp"
#include "msgs/decode.hpp"

namespace loc {
namespace {

// What a double holds exactly, and an int holds.
constexpr double kMostSequence = 9e15;
constexpr double kMostCamera = 1e9;

}  // namespace

std::string sequence_name(StreamKind kind) {
  return std::string(stream_name(kind)) + ".sequence";
}

std::string camera_name(StreamKind kind) {
  return std::string(stream_name(kind)) + ".camera";
}

FlowControl::FlowControl(StreamKind kind, std::int64_t window)
    : kind_(kind), sequence_name_(sequence_name(kind)), camera_name_(camera_name(kind)), window_(window) {
  require(window > 0, "window", static_cast<double>(window), "must be positive");
}

void FlowControl::sent(std::int64_t sequence, int camera) {
  on_their_way_.push_back({sequence, camera});
  ++changes_;
}

// What we did not send was sent by an earlier driver. Streams keep their order: what was sent before has arrived too.
void FlowControl::acknowledge(std::int64_t sequence, int camera) {
  const auto of_camera = [&](const Sent& one) { return one.camera == camera; };
  const auto newest = std::find_if(on_their_way_.rbegin(), on_their_way_.rend(), of_camera);
  if (newest == on_their_way_.rend() || sequence > newest->sequence) return;
  const auto taken = std::find_if(newest, on_their_way_.rend(),
                                  [&](const Sent& one) { return of_camera(one) && one.sequence <= sequence; });
  if (taken == on_their_way_.rend()) return;
  on_their_way_.erase(on_their_way_.begin(), taken.base());
  ++changes_;
}

void FlowControl::abandon() {
  abandoned_ += outstanding();
  on_their_way_.clear();
  ++changes_;
  stuck_since_ns_ = kNoTime;
}

void FlowControl::on_estimate(std::span<const std::uint8_t> data) {
  if (kind_ != StreamKind::kImu) return;
  try {
    const auto estimate = decode_message<estimate_t>(data);
    // Estimates of a camera alone carry numbers of frames.
    if (estimate.method != kFrameMethod) acknowledge(estimate.sequence, 0);
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
  taken_ = false;
  std::int64_t sequence = -1;
  int camera = 0;
  for (std::size_t i = 0; i < message.name.size(); ++i) {
    const bool is_camera = message.name[i] == camera_name_;
    if (!is_camera && message.name[i] != sequence_name_) continue;
    // False for NaN.
    if (!(std::abs(message.value[i]) <= (is_camera ? kMostCamera : kMostSequence))) {
      ++garbage_;
      continue;
    }
    if (is_camera) {
      camera = static_cast<int>(message.value[i]);
    } else {
      taken_ = true;
      sequence = static_cast<std::int64_t>(message.value[i]);
    }
  }
  if (taken_) acknowledge(sequence, camera);
  if (another) {
    abandon();
  } else if (outstanding() == 0 || stuck_since_ns_ == kNoTime || stuck_at_ != changes_) {
    stuck_at_ = changes_;
    stuck_since_ns_ = now_ns;
  } else if (now_ns - stuck_since_ns_ > kLostAfterNs) {
    abandon();
  }
}

}  // namespace loc
