// Merges the samples of several streams into one sequence in time order, with a bounded delay: a sample leaves when
// every stream that is awaited has passed its time, or when it has waited for max_delay of measurement time.
// What comes too late for that (older than what has left already) is dropped and counted, never put out of order.
// A clock that is set back shows as a run of late samples: after reset_after of them in one stream, all that waits
// leaves and the sequence starts anew from there (counted; who feeds an estimator resets it then). As long as nothing
// is later than max_delay, the result does not depend on the order of arrival: live and off line agree.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>

#include "libloc/sensors/measurements.hpp"

namespace loc {

struct StreamMergerOptions {
  TimeNs max_delay_ns = 50'000'000;  ///< Longest wait for another stream, in measurement time; 0 waits for nothing.
  std::size_t max_samples = 4096;    ///< Bound on what waits; past it the oldest leaves at once.
  int reset_after = 20;              ///< Late samples in a row, in one stream, that mean: the clock was set back.
};

struct StreamMergerCounts {
  std::array<std::int64_t, kStreamKinds> late{};  ///< dropped: older than what had left
  std::int64_t forced = 0;                        ///< left early, because max_samples waited
  std::int64_t resets = 0;                        ///< times that the sequence started anew
};

class StreamMerger {
 public:
  /// @throws std::invalid_argument when an option is out of range.
  explicit StreamMerger(StreamMergerOptions options = {});

  /// Says that samples of this kind are to be waited for. A kind is awaited from its first sample on at the latest.
  void await(StreamKind kind);
  /// Takes a sample. It must have a time; @throws std::invalid_argument when it has none.
  void push(Measurement measurement);
  /// The next sample in time order that may leave. At equal times: magnetometer, image, GPS, reference, IMU, so that an
  /// IMU step finds what belongs to its time.
  std::optional<Measurement> pop();
  /// From here on pop() gives all that waits (end of the recording).
  void finish();

  const StreamMergerCounts& counts() const { return counts_; }
  std::size_t waiting() const { return waiting_; }

 private:
  struct Queue {
    std::deque<Measurement> samples;  // in time order
    TimeNs newest = kNoTime;
    bool awaited = false;
    int late_in_a_row = 0;
  };

  void start_anew();

  StreamMergerOptions options_;
  std::deque<Measurement> before_reset_;  // in order, leaves first
  std::array<Queue, kStreamKinds> queues_;
  StreamMergerCounts counts_;
  std::size_t waiting_ = 0;
  TimeNs last_out_ = kNoTime;
  int last_out_rank_ = 0;
  TimeNs newest_ = kNoTime;
  bool finished_ = false;
};

}  // namespace loc
