// Whether samples still lie on a clock's line. Jitter is never negative and, now and then, almost nothing: where n
// samples in a row are all late by more than jitter explains, a clock was set or is being slewed; where samples come
// before they can, likewise. The more samples, the smaller the step that shows: so runs of 3, 6, ... 1536 are watched.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace loc {

/// What is known about lateness above the line beforehand [ns].
struct ClockLateness {
  double sigma_ns = 0;   ///< of the line at the sample
  double jitter_ns = 0;  ///< mean lateness of a sample
  double noise_ns = 0;   ///< mean lateness of the least late one of many, as the fit saw it
};

class LatenessWatch {
 public:
  void add(double lateness_ns, const ClockLateness& known);
  /// By so much the last samples are all late, at least; 0 as long as jitter explains it.
  double late_ns() const { return late_ns_; }
  /// By so much samples came too early of late, all but one of them left out of account; 0 when there are no two.
  double early_ns() const;
  /// The line has moved: later (negative) or earlier by so much against the samples.
  void shift(double ns);
  void reset() { *this = {}; }

 private:
  static constexpr std::size_t kRuns = 10;
  static constexpr std::int64_t kEarlySamples = 64;
  struct Run {
    std::int64_t count = 0;  // in the block that is being filled
    double lowest_ns = 0;    // of that block
    double floor_ns = 0;     // of the last full block without a break since; 0 if there is none
  };
  // Of samples that came early: the earliest, and the one after it.
  struct Early {
    double first_ns = 0;
    double second_ns = 0;
  };

  std::array<Run, kRuns> runs_{};
  double late_ns_ = 0;
  Early early_;
  Early early_before_;
  std::int64_t early_count_ = 0;
};

}  // namespace loc
