#include "libloc/sensors/stream.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

// Place among samples of one time, by StreamKind.
constexpr std::array<int, kStreamKinds> kRank = {6, 0, 1, 3, 5, 4, 2};

constexpr TimeNs kQuietPart = 4;  // tenths of an interval

// a - b; far apart times give the largest difference there is instead of an overflow.
TimeNs difference(TimeNs a, TimeNs b) {
  TimeNs result = 0;
  if (!__builtin_sub_overflow(a, b, &result)) return result;
  return a > b ? std::numeric_limits<TimeNs>::max() : std::numeric_limits<TimeNs>::min();
}

TimeNs time_of(const Measurement& measurement) {
  return stamp_of(measurement).time_ns;
}

}  // namespace

StreamMerger::StreamMerger(StreamMergerOptions options) : options_(options) {
  require(options_.max_delay_ns >= 0, "max_delay_ns", static_cast<double>(options_.max_delay_ns),
          "must not be negative");
  require(options_.max_jump_ns > 0, "max_jump_ns", static_cast<double>(options_.max_jump_ns), "must be positive");
  require(options_.max_samples > 0, "max_samples", 0, "must be positive");
  require(options_.reset_after > 0, "reset_after", options_.reset_after, "must be positive");
  options_.max_jump_ns = std::max(options_.max_jump_ns, options_.max_delay_ns);
}

std::size_t StreamMerger::queue_of(StreamKind kind, int camera) {
  if (!has_camera(kind) || camera <= 0) return static_cast<std::size_t>(kind);
  const std::size_t further = std::min(static_cast<std::size_t>(camera), kCameraQueues - 1) - 1;
  return kStreamKinds + (kind == StreamKind::kImage ? 0 : kCameraQueues - 1) + further;
}

std::size_t StreamMerger::queue_of(const Measurement& measurement) {
  return queue_of(kind_of(measurement), camera_of(measurement));
}

void StreamMerger::await(StreamKind kind, int camera) {
  queues_[queue_of(kind, camera)].awaited = true;
}

void StreamMerger::push(Measurement measurement) {
  const TimeNs time = time_of(measurement);
  require(time != kNoTime, "stream: a measurement without time");
  Queue& queue = queues_[queue_of(measurement)];
  queue.awaited = true;
  if (queue.last_pushed != kNoTime && time < queue.last_pushed) queue.stepped_back = true;
  queue.last_pushed = time;
  const bool started = newest_ != kNoTime;
  if (started && !finished_ && difference(time, newest_) > options_.max_jump_ns) {
    // Time went on unless it comes back: what was set aside is believed as soon as another sample is there too.
    accept_suspects_until(time);
    if (difference(time, newest_) > options_.max_jump_ns) {
      if (suspects_.size() == static_cast<std::size_t>(options_.reset_after)) drop_suspect(0);
      suspects_.push_back({std::move(measurement)});
      return;
    }
  } else if (started && (time < last_out_ || difference(newest_, time) > options_.max_jump_ns)) {
    doubt_suspects();
    if (!queue.stepped_back || ++queue.late_in_a_row < options_.reset_after) {
      ++counts_.late[measurement.index()];
      return;
    }
    start_anew();
  } else {
    doubt_suspects();
  }
  queue.late_in_a_row = 0;
  queue.stepped_back = false;
  accept(std::move(measurement));
}

void StreamMerger::accept(Measurement measurement) {
  const TimeNs time = time_of(measurement);
  Queue& queue = queues_[queue_of(measurement)];
  if (has_camera(kind_of(measurement)) && queue.newest != kNoTime && time > queue.newest) {
    queue.see_interval(difference(time, queue.newest));
  }
  queue.newest = std::max(queue.newest, time);
  newest_ = std::max(newest_, time);
  // Nearly always at the end; equal times keep their order of arrival.
  std::size_t place = queue.samples.size();
  while (place > 0 && time_of(queue.samples[place - 1]) > time) --place;
  queue.samples.insert(place, std::move(measurement));
  ++waiting_;
}

// A camera that is regular but for dropped pictures; of another one nothing can be expected.
void StreamMerger::Queue::see_interval(TimeNs interval) {
  intervals[intervals_seen++ % intervals.size()] = interval;
  quiet = 0;
  if (intervals_seen < intervals.size()) return;
  auto sorted = intervals;
  std::sort(sorted.begin(), sorted.end());
  const TimeNs shortest = sorted.front();
  if (sorted[sorted.size() / 2] - shortest <= shortest / 4) quiet = kQuietPart * (shortest / 10);
}

void StreamMerger::accept_suspects_until(TimeNs time) {
  for (std::size_t i = 0; i < suspects_.size();) {
    if (difference(time_of(suspects_[i].measurement), time) > options_.max_jump_ns) {
      ++i;
      continue;
    }
    accept(std::move(suspects_[i].measurement));
    suspects_.erase(suspects_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

void StreamMerger::doubt_suspects() {
  for (Suspect& suspect : suspects_) ++suspect.others;
  while (!suspects_.empty() && suspects_.front().others >= options_.reset_after) drop_suspect(0);
}

void StreamMerger::drop_suspect(std::size_t index) {
  ++counts_.absurd[suspects_[index].measurement.index()];
  suspects_.erase(suspects_.begin() + static_cast<std::ptrdiff_t>(index));
}

void StreamMerger::start_anew() {
  const bool was_finished = finished_;
  finish();
  // Through pop(), so that what was waiting keeps its order.
  std::deque<Measurement> rest;
  while (auto measurement = pop()) rest.push_back(std::move(*measurement));
  before_reset_ = std::move(rest);
  waiting_ = before_reset_.size();
  finished_ = was_finished;
  for (Queue& queue : queues_) {
    queue.newest = kNoTime;
    queue.intervals_seen = 0;
    queue.quiet = 0;
    queue.late_in_a_row = 0;
    queue.stepped_back = false;
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
  for (Queue& queue : queues_) {
    if (queue.samples.empty()) continue;
    const Measurement& front = queue.samples.front();
    const std::pair key(time_of(front), kRank[front.index()]);
    if (first == nullptr || key < first_key) {
      first = &queue;
      first_key = key;
    }
  }
  if (first == nullptr) return std::nullopt;

  const TimeNs time = first_key.first;
  const bool waited_out = options_.max_delay_ns == 0 || difference(newest_, time) > options_.max_delay_ns;
  const auto passed = [time](const Queue& queue) {
    return !queue.awaited || (queue.newest != kNoTime && difference(time, queue.newest) <= queue.quiet);
  };
  if (!finished_ && !waited_out && !std::all_of(queues_.begin(), queues_.end(), passed)) {
    if (waiting() <= options_.max_samples) return std::nullopt;
    ++counts_.forced;
  }
  --waiting_;
  last_out_ = time;
  return first->samples.pop_front();
}

void StreamMerger::finish() {
  finished_ = true;
  // What others have already passed over is dropped; what came last of all may be right.
  while (!suspects_.empty() && suspects_.front().others > 0) drop_suspect(0);
  accept_suspects_until(std::numeric_limits<TimeNs>::max());
}

}  // namespace loc
