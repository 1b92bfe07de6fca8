#include "libloc/sensors/stream.hpp"

#include <algorithm>
#include <utility>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

// Place among samples of one time.
constexpr std::array<int, kStreamKinds> kRank = {4, 0, 1, 2, 3};

int rank_of(StreamKind kind) {
  return kRank[static_cast<std::size_t>(kind)];
}

}  // namespace

StreamMerger::StreamMerger(StreamMergerOptions options) : options_(options) {
  require(options_.max_delay_ns >= 0, "max_delay_ns", static_cast<double>(options_.max_delay_ns),
          "must not be negative");
  require(options_.max_samples > 0, "max_samples", 0, "must be positive");
  require(options_.reset_after > 0, "reset_after", options_.reset_after, "must be positive");
}

void StreamMerger::await(StreamKind kind) {
  queues_[static_cast<std::size_t>(kind)].awaited = true;
}

void StreamMerger::push(Measurement measurement) {
  const TimeNs time = stamp_of(measurement).time_ns;
  require(time != kNoTime, "stream: a measurement without time");
  const StreamKind kind = kind_of(measurement);
  Queue& queue = queues_[static_cast<std::size_t>(kind)];
  queue.awaited = true;
  if (last_out_ != kNoTime && std::pair(time, rank_of(kind)) < std::pair(last_out_, last_out_rank_)) {
    if (++queue.late_in_a_row < options_.reset_after) {
      ++counts_.late[static_cast<std::size_t>(kind)];
      return;
    }
    start_anew();
  }
  queue.late_in_a_row = 0;
  queue.newest = std::max(queue.newest, time);
  newest_ = std::max(newest_, time);
  // Nearly always at the end; equal times keep their order of arrival.
  auto place = queue.samples.end();
  while (place != queue.samples.begin() && stamp_of(*std::prev(place)).time_ns > time) --place;
  queue.samples.insert(place, std::move(measurement));
  ++waiting_;
}

void StreamMerger::start_anew() {
  const bool was_finished = std::exchange(finished_, true);
  // Through pop(), so that what was waiting keeps its order.
  std::deque<Measurement> rest;
  while (auto measurement = pop()) rest.push_back(std::move(*measurement));
  before_reset_ = std::move(rest);
  waiting_ = before_reset_.size();
  finished_ = was_finished;
  for (Queue& queue : queues_) {
    queue.newest = kNoTime;
    queue.late_in_a_row = 0;
  }
  last_out_ = kNoTime;
  newest_ = kNoTime;
  ++counts_.resets;
}

std::optional<Measurement> StreamMerger::pop() {
  if (!before_reset_.empty()) {
    Measurement out = std::move(before_reset_.front());
    before_reset_.pop_front();
    --waiting_;
    return out;
  }
  Queue* first = nullptr;
  std::pair<TimeNs, int> first_key;
  for (std::size_t i = 0; i < queues_.size(); ++i) {
    if (queues_[i].samples.empty()) continue;
    const std::pair key(stamp_of(queues_[i].samples.front()).time_ns, kRank[i]);
    if (first == nullptr || key < first_key) {
      first = &queues_[i];
      first_key = key;
    }
  }
  if (first == nullptr) return std::nullopt;

  const bool forced = waiting_ > options_.max_samples;
  // Differences of far apart times could overflow; a clock that jumped that far has waited long enough.
  TimeNs age = 0;
  const bool waited_out = __builtin_sub_overflow(newest_, first_key.first, &age) || age >= options_.max_delay_ns;
  if (!finished_ && !forced && !waited_out) {
    for (const Queue& queue : queues_) {
      if (queue.awaited && (queue.newest == kNoTime || queue.newest < first_key.first)) return std::nullopt;
    }
  }
  if (forced) ++counts_.forced;
  Measurement out = std::move(first->samples.front());
  first->samples.pop_front();
  --waiting_;
  last_out_ = first_key.first;
  last_out_rank_ = first_key.second;
  return out;
}

void StreamMerger::finish() {
  finished_ = true;
}

}  // namespace loc
