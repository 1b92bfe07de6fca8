// Merges the samples of several streams into one sequence in time order, with a bounded delay: a sample leaves when
// every stream that is awaited has passed its time, or when it has waited for more than max_delay of measurement time.
// What comes too late for that (older than what has left already) is dropped and counted, never put out of order.
// Cameras are slow, and what follows a picture need not wait for the next one: a regular stream of pictures counts as
// passed for a part of the shortest of its last intervals after each of them. (One that comes much earlier than all
// before it is late then.) As long as each stream is in order, none is later than max_delay and all are awaited before
// their first sample, the result does not depend on the order of arrival: live and off line agree.
//
// Clocks that jump. Set back: the times of a stream step back and what follows is late; after reset_after such samples
// in a row, all that waits leaves and the sequence starts anew from there (counted; who feeds an estimator resets it
// then). A stream that is only slow is never taken for that: its late samples are counted, however many. Set forward, a
// pause, or one absurd time: a sample further ahead than max_jump is set aside until another one shows that time really
// went on (nothing is lost then); it is dropped and counted when reset_after samples arrive that know nothing of it.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>

#include "libloc/core/fifo.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

struct StreamMergerOptions {
  TimeNs max_delay_ns = 50'000'000;  ///< Longest wait for another stream, in measurement time; 0 waits for nothing.
  /// A step of time beyond this needs a second sample to be believed; a longer max_delay takes its place.
  TimeNs max_jump_ns = 10'000'000'000;
  std::size_t max_samples = 4096;  ///< Bound on what waits; past it the oldest leaves at once.
  int reset_after = 20;            ///< Late samples in a row after a step back, in one stream: the clock was set back.
};

struct StreamMergerCounts {
  std::array<std::int64_t, kStreamKinds> late{};    ///< dropped: older than what had left
  std::array<std::int64_t, kStreamKinds> absurd{};  ///< dropped: alone with a time far ahead of all others
  std::int64_t forced = 0;                          ///< left early, because max_samples waited
  std::int64_t resets = 0;                          ///< times that the sequence started anew
};

class StreamMerger {
 public:
  /// @throws std::invalid_argument when an option is out of range.
  explicit StreamMerger(StreamMergerOptions options = {});

  /// Says that samples of this kind (of this camera) are to be waited for. A stream is awaited from its first sample on
  /// at the latest.
  void await(StreamKind kind, int camera = 0);
  /// Takes a sample. It must have a time; @throws std::invalid_argument when it has none.
  void push(Measurement measurement);
  /// The next sample in time order that may leave. Of samples that wait with equal times: magnetometer, image (by
  /// camera), features (by camera), GPS, odometry, reference, IMU, so that an IMU step finds what belongs to its time.
  std::optional<Measurement> pop();
  /// A sample of this time would come too late.
  bool has_passed(TimeNs time_ns) const { return last_out_ != kNoTime && time_ns < last_out_; }
  /// From here on pop() gives all that waits (end of the recording).
  void finish();

  const StreamMergerCounts& counts() const { return counts_; }
  std::size_t waiting() const { return waiting_ + suspects_.size(); }

 private:
  struct Queue {
    Fifo<Measurement> samples;  // in time order
    TimeNs newest = kNoTime;
    TimeNs last_pushed = kNoTime;
    bool awaited = false;
    bool stepped_back = false;  // its time did, and what came since was late
    int late_in_a_row = 0;      // since then
    // Of a camera: its last intervals, and for how long after a picture the next one is not expected.
    std::array<TimeNs, 16> intervals{};
    std::size_t intervals_seen = 0;
    TimeNs quiet = 0;

    void see_interval(TimeNs interval);
  };
  // Cameras share times, so each has queues of its own for images and features; those past the last share it.
  static constexpr std::size_t kCameraQueues = 8;
  static constexpr std::size_t kQueues = kStreamKinds + 2 * (kCameraQueues - 1);
  struct Suspect {
    Measurement measurement;
    int others = 0;  // samples since that know nothing of its time
  };

  static std::size_t queue_of(StreamKind kind, int camera);
  static std::size_t queue_of(const Measurement& measurement);
  void accept(Measurement measurement);
  void accept_suspects_until(TimeNs time);
  void doubt_suspects();
  void drop_suspect(std::size_t index);
  void start_anew();

  StreamMergerOptions options_;
  std::deque<Measurement> before_reset_;  // in order, leaves first
  std::array<Queue, kQueues> queues_;
  std::deque<Suspect> suspects_;  // far ahead, in order of arrival
  StreamMergerCounts counts_;
  std::size_t waiting_ = 0;
  TimeNs last_out_ = kNoTime;
  TimeNs newest_ = kNoTime;
  bool finished_ = false;
};

}  // namespace loc
