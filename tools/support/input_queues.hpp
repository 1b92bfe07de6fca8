// Between the thread that receives and the one that estimates: a bounded queue for each input, taken from in order of
// arrival over all of them. push() only copies; once warm it allocates nothing.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "libloc/core/named_count.hpp"
#include "libloc/core/time.hpp"

namespace loc {

/// What a full queue does with one message more.
enum class WhenFull : std::uint8_t {
  kRefuseNewest,  ///< a stream whose order and completeness matter: what was taken is kept
  kDropOldest,    ///< images: the newest wins
};

struct InputQueueOptions {
  std::string name;                        ///< for counts: "imu"
  std::size_t capacity = 0;                ///< messages
  std::size_t max_message_bytes = 0;       ///< longer ones are refused
  std::size_t expected_message_bytes = 0;  ///< reserved beforehand
  WhenFull when_full = WhenFull::kRefuseNewest;
};

struct RawMessage {
  std::size_t input = 0;  ///< index of its queue
  std::uint64_t arrival = 0;
  TimeNs receive_time_ns = kNoTime;
  std::vector<std::uint8_t> bytes;
};

class InputQueues {
 public:
  /// @throws std::invalid_argument when a capacity or a size is 0.
  explicit InputQueues(std::vector<InputQueueOptions> options);

  /// @return false when a message was lost by it (this one, or the oldest): counted.
  bool push(std::size_t input, std::span<const std::uint8_t> bytes, TimeNs receive_time_ns);
  /// The message that arrived first of all that wait. Its buffer is lent to out and taken back when out is passed
  /// again: do so. @return false when none came in time.
  bool pop(RawMessage& out, TimeNs timeout_ns);

  std::int64_t dropped(std::size_t input) const;
  std::size_t waiting() const;
  /// {"imu.dropped", 0}, {"imu.oversized", 0}, {"imu.waiting_max", 12} for each input
  NamedCounts counts() const;

 private:
  struct Queue {
    InputQueueOptions options;
    std::vector<RawMessage> ring;
    std::vector<std::uint8_t> spare;  // buffer of the last message that was taken out and given back
    std::size_t first = 0;
    std::size_t size = 0;
    std::size_t most = 0;
    std::int64_t dropped = 0;
    std::int64_t oversized = 0;
  };

  mutable std::mutex mutex_;
  std::condition_variable filled_;
  std::vector<Queue> queues_;
  std::uint64_t next_arrival_ = 0;
  std::size_t waiting_ = 0;
};

}  // namespace loc
