#include "tools/support/input_queues.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "libloc/core/check.hpp"

namespace loc {

InputQueues::InputQueues(std::vector<InputQueueOptions> options) {
  for (InputQueueOptions& one : options) {
    require(one.capacity > 0, one.name + ".capacity", 0, "must be positive");
    require(one.max_message_bytes > 0, one.name + ".max_message_bytes", 0, "must be positive");
    Queue queue;
    queue.ring.resize(one.capacity);
    for (RawMessage& slot : queue.ring) slot.bytes.reserve(one.expected_message_bytes);
    queue.options = std::move(one);
    queues_.push_back(std::move(queue));
  }
}

bool InputQueues::push(std::size_t input, std::span<const std::uint8_t> bytes, TimeNs receive_time_ns) {
  bool lost = false;
  {
    const std::lock_guard lock(mutex_);
    Queue& queue = queues_.at(input);
    if (bytes.size() > queue.options.max_message_bytes) {
      ++queue.oversized;
      return false;
    }
    if (queue.size == queue.ring.size()) {
      ++queue.dropped;
      if (queue.options.when_full == WhenFull::kRefuseNewest) return false;
      lost = true;
      queue.first = (queue.first + 1) % queue.ring.size();
      --queue.size;
      --waiting_;
    }
    RawMessage& slot = queue.ring[(queue.first + queue.size) % queue.ring.size()];
    slot.input = input;
    slot.arrival = next_arrival_++;
    slot.receive_time_ns = receive_time_ns;
    slot.bytes.assign(bytes.begin(), bytes.end());
    ++queue.size;
    queue.most = std::max(queue.most, queue.size);
    ++waiting_;
  }
  filled_.notify_one();
  return !lost;
}

bool InputQueues::pop(RawMessage& out, TimeNs timeout_ns) {
  std::unique_lock lock(mutex_);
  if (!filled_.wait_for(lock, std::chrono::nanoseconds(timeout_ns), [&] { return waiting_ > 0; })) return false;
  Queue* oldest = nullptr;
  for (Queue& queue : queues_) {
    if (queue.size == 0) continue;
    if (oldest == nullptr || queue.ring[queue.first].arrival < oldest->ring[oldest->first].arrival) oldest = &queue;
  }
  // The buffer in out goes back to the queue that it came from: a queue of thousands of short messages would hold
  // thousands of pictures' buffers otherwise.
  if (out.input < queues_.size()) queues_[out.input].spare.swap(out.bytes);
  std::vector<std::uint8_t> buffer = std::move(oldest->spare);
  std::swap(out, oldest->ring[oldest->first]);
  oldest->ring[oldest->first].bytes = std::move(buffer);
  oldest->first = (oldest->first + 1) % oldest->ring.size();
  --oldest->size;
  --waiting_;
  return true;
}

std::int64_t InputQueues::dropped(std::size_t input) const {
  const std::lock_guard lock(mutex_);
  return queues_.at(input).dropped;
}

std::size_t InputQueues::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_;
}

NamedCounts InputQueues::counts() const {
  const std::lock_guard lock(mutex_);
  NamedCounts out;
  for (const Queue& queue : queues_) {
    out.push_back({queue.options.name + ".dropped", queue.dropped});
    out.push_back({queue.options.name + ".oversized", queue.oversized});
    out.push_back({queue.options.name + ".waiting_max", static_cast<std::int64_t>(queue.most)});
  }
  return out;
}

}  // namespace loc
