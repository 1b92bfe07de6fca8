#include "libloc/sensors/clock_watch.hpp"

#include <algorithm>

namespace loc {
namespace {

constexpr double kSigmas = 6;  // of the line
constexpr double kNoises = 8;  // of the least late samples
// n exponential jitters are all above J c / n in one of exp(c) cases.
constexpr double kRare = 20;
// Two may be late by any amount for reasons of their own.
constexpr double kShortestRun = 3;

}  // namespace

void LatenessWatch::add(double lateness_ns, const ClockLateness& known) {
  const double gate = kSigmas * known.sigma_ns + kNoises * known.noise_ns;
  if (++early_count_ >= kEarlySamples) {
    early_before_ = early_;
    early_ = {};
    early_count_ = 0;
  }
  if (lateness_ns < -gate) {
    early_.second_ns = std::max(early_.second_ns, std::min(early_.first_ns, -lateness_ns));
    early_.first_ns = std::max(early_.first_ns, -lateness_ns);
  }
  late_ns_ = 0;
  double n = kShortestRun / 2;
  for (Run& run : runs_) {
    n *= 2;
    const double limit = kSigmas * known.sigma_ns + std::max(kRare * known.jitter_ns / n, kNoises * known.noise_ns);
    if (lateness_ns <= limit) {
      run = {};
      continue;
    }
    run.lowest_ns = run.count == 0 ? lateness_ns : std::min(run.lowest_ns, lateness_ns);
    if (++run.count >= static_cast<std::int64_t>(n)) {
      run.floor_ns = run.lowest_ns;
      run.count = 0;
    }
    late_ns_ = std::max(late_ns_, run.floor_ns);
  }
}

double LatenessWatch::early_ns() const {
  // Two of the last 64 to 128 samples.
  const double both = std::min(early_.first_ns, early_before_.first_ns);
  return std::max({both, early_.second_ns, early_before_.second_ns});
}

void LatenessWatch::shift(double ns) {
  for (Run& run : runs_) {
    run.lowest_ns += ns;
    if (run.floor_ns > 0) run.floor_ns = std::max(0.0, run.floor_ns + ns);
  }
  if (late_ns_ > 0) late_ns_ = std::max(0.0, late_ns_ + ns);
  for (Early* early : {&early_, &early_before_}) {
    early->first_ns = std::max(0.0, early->first_ns - (early->first_ns > 0 ? ns : 0));
    early->second_ns = std::max(0.0, early->second_ns - (early->second_ns > 0 ? ns : 0));
  }
}

}  // namespace loc
