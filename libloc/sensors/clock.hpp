// One clock in terms of another, from pairs (device time, arrival at the host): device -> host.
//   arrival = true time + minimum delay + jitter, and the jitter is never negative,
// so the line is laid under the samples, not through them. What comes out is the time at which the host would have
// heard of an event had nothing been in the way: true time + minimum delay. The minimum delay itself cannot be observed
// from these pairs; subtract it where it is known.
//
// Method: bins over a sliding window, of each the sample that was least late; slope by Theil and Sen (the median over
// all pairs of bins), curvature from the two halves of the window, then the level at which the curve lies under the
// bins. Between fits the tangent at the newest bin extrapolates. From the first sample on there is an answer, with a
// sigma that says how little is known: bins are short at first and double with the span.
//
// sigma holds for jitter that is often almost nothing, as exponential or uniform jitter is (error/sigma near 1). Where
// jitter is seldom near its minimum the least late samples are late themselves, and sigma does not know: error/sigma
// (rms) is 3.2 for gamma jitter of shape 4 and 4.3 for log-normal jitter of deviation 1, both with a mean near 1 ms.
//
// A step or slew of the host's clock shows when jitter no longer explains that all samples are late: after about 20
// jitters / step samples, 3 at least. From then on it is in sigma; a new line begins after step_s. A lasting change of
// the minimum delay looks the same and is taken for a step.
//
// Survived and counted: a device that starts anew, counters that jump, a host clock that is set, gaps, duplicates,
// samples out of order, single absurd times. See ClockCounts.
//
// Times are integers, doubles hold differences only. An update allocates nothing. Memory is bounded.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "libloc/core/time.hpp"
#include "libloc/sensors/clock_line.hpp"
#include "libloc/sensors/clock_watch.hpp"

namespace loc {

struct ClockModelOptions {
  double window_s = 120;        ///< Longer: less noise; shorter: follows a wandering oscillator better.
  double skew_sigma_ppm = 100;  ///< What the skew may be before anything is known; crystals are within this.
  /// How late a sample may be as far as is known before the first: sigma of the first answer.
  TimeNs initial_sigma_ns = 10'000'000;
  /// How fast the skew is taken to wander where there are no samples [1/sqrt(s)]: sigma of extrapolation. Crystal in
  /// a room that warms up: 1.5e-8.
  double skew_walk = 1.5e-8;
  /// Steps of either clock below this are not told from drift: they fade out within the window, and are in sigma while
  /// they do.
  TimeNs min_step_ns = 200'000;
  int step_samples = 20;                 ///< Samples in a row, all late by more than jitter, that make a step forward;
  double step_s = 5;                     ///< and they must span this, so that a jam of the bus is not taken for a step.
  int early_samples = 5;                 ///< Samples that come before they can, with few others between: a step back.
  int reset_samples = 3;                 ///< Samples in a row after a step back of the device: it has started anew.
  TimeNs reset_step_ns = 1'000'000'000;  ///< A smaller step back of device time is a sample out of order.
  double max_extrapolation_s = 60;       ///< So long after the last sample the model still answers.

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct ClockCounts {
  std::int64_t samples = 0;        ///< offered
  std::int64_t used = 0;           ///< taken as regular ones
  std::int64_t invalid = 0;        ///< without time, or too far from all others to reckon with
  std::int64_t duplicates = 0;     ///< device time as of the sample before (used all the same)
  std::int64_t out_of_order = 0;   ///< device time before that of the sample before (used all the same)
  std::int64_t suspects = 0;       ///< set aside: much too late or too early for the line
  std::int64_t gaps = 0;           ///< no sample for longer than the window: level fitted anew, skew kept
  std::int64_t device_resets = 0;  ///< device time went back
  std::int64_t device_jumps = 0;   ///< device time leapt ahead or stood still
  std::int64_t host_steps_forward = 0;
  std::int64_t host_steps_back = 0;
};

class ClockModel {
 public:
  /// @throws std::invalid_argument as ClockModelOptions::check.
  explicit ClockModel(const ClockModelOptions& options = {});

  /// One sample. Times may be anything; what cannot be used is counted.
  /// @returns false when it was not taken into the model (so far): set aside, or invalid.
  bool update(TimeNs device_time_ns, TimeNs host_time_ns);

  /// Host time of a device time. Never steps back for increasing device times, corrections and device resets included;
  /// the one exception is a host clock that was itself set back: then epoch() has changed. nullopt: no sample yet, or
  /// outside the span for which the model holds (older than the window, too long after the last sample), or the time of
  /// a sample that looks like a reset and is not confirmed yet.
  std::optional<ClockStamp> convert(TimeNs device_time_ns);
  /// As convert(), without the promise that times increase, and without changing anything.
  std::optional<ClockStamp> convert_once(TimeNs device_time_ns) const;

  bool ready() const { return bin_count_ > 0; }
  /// The last samples, three or more in a row, do not fit the line: one of the clocks may have been set.
  bool doubtful() const { return aside_count_ >= 3; }
  /// The last sample was set aside; what it was shows with the next ones.
  bool undecided() const { return aside_count_ > 0; }
  /// What is known now; meaningful when ready(). While the last samples do not fit, sigma holds by how much.
  ClockLine line() const;
  /// Mean lateness of samples above the line [ns].
  double mean_jitter_ns() const { return jitter_ns_; }
  /// Counts the lines that were started: 0 before the first sample, +1 with each reset, jump or step.
  std::int64_t epoch() const { return epoch_; }
  const ClockCounts& counts() const { return counts_; }
  const ClockModelOptions& options() const { return options_; }
  /// Forgets everything but the counts.
  void reset();

  static constexpr int kBins = 30;

 private:
  struct Sample {
    TimeNs device_ns = 0;
    TimeNs host_ns = 0;
  };
  struct Bin {
    std::int64_t index = 0;
    Sample lowest;
  };
  enum class Doubt : std::uint8_t { kNone, kDeviceBack, kEarly, kLate };

  double lateness_ns(const Sample& sample) const;
  double doubt_ns() const { return std::max(watch_.late_ns(), watch_.early_ns()); }
  void watch(const Sample& sample, double lateness);
  bool below(const Sample& a, const Sample& b) const;
  Doubt judge(const Sample& sample, double lateness) const;
  double skew_sigma_of_failed_line() const;
  bool set_aside(const Sample& sample, Doubt doubt);
  void start_anew();
  void start(const Sample& first, double skew, double sigma_skew);
  void take(const Sample& sample, double lateness);
  bool put_into_bin(const Sample& sample);
  void make_room(std::int64_t index);
  void fit();
  Bin& bin(int i) { return bins_[static_cast<std::size_t>((first_bin_ + i) % (kBins + 1))]; }
  const Bin& bin(int i) const { return bins_[static_cast<std::size_t>((first_bin_ + i) % (kBins + 1))]; }

  ClockModelOptions options_;
  ClockLine line_;
  // Bins in order of their index; the last one is still open.
  std::array<Bin, kBins + 1> bins_{};
  int first_bin_ = 0;
  int bin_count_ = 0;
  TimeNs origin_ns_ = 0;      // device time at which bin 0 begins
  TimeNs width_ns_ = 0;       // of a bin
  TimeNs full_width_ns_ = 0;  // when the window is full
  TimeNs open_from_ns_ = 0;   // of the open bin, relative to origin
  double prior_skew_ = 0;
  double prior_sigma_skew_ = 0;
  TimeNs prior_time_ns_ = 0;  // device time for which the prior holds
  double jitter_ns_ = 0;      // mean lateness
  double noise_ns_ = 0;       // of the least late samples
  LatenessWatch watch_;
  // How late samples of the run were before, to see whether that grows: a slew.
  struct Mark {
    TimeNs device_ns = 0;
    double late_ns = 0;
  };
  Mark mark_before_;
  Mark mark_;
  std::optional<double> settled_skew_;  // of the last line that had time to settle
  std::int64_t in_epoch_ = 0;
  double period_ns_ = 0;  // typical step of device time
  Sample last_;
  // Samples set aside, in a row.
  static constexpr std::size_t kKept = 64;
  std::array<Sample, kKept> aside_{};
  std::size_t kept_ = 0;
  std::int64_t aside_count_ = 0;
  int ordinary_since_aside_ = 0;
  Sample aside_first_;
  Sample aside_last_;
  Doubt doubt_ = Doubt::kNone;
  MonotoneTime monotone_;
  std::int64_t epoch_ = 0;
  ClockCounts counts_;
};

}  // namespace loc
