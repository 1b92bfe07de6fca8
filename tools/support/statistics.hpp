// Counters and latencies of a program, as they go out on LOC_STATISTICS and into the log.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "libloc/core/named_count.hpp"
#include "libloc/core/time.hpp"
#include "loc/statistics_t.hpp"

namespace loc {

/// Distribution of durations in constant memory: each power of two is cut into 32 bins, so that a quantile is at most
/// 3 % too large and never too small.
class LatencyHistogram {
 public:
  /// Durations below zero (a host clock that was set back) count as zero.
  void add(TimeNs duration_ns);
  std::int64_t count() const { return count_; }
  TimeNs max() const { return max_; }
  /// Upper edge of the bin below which the share lies, at most max(); 0 when empty. @param probability in [0, 1]
  TimeNs quantile(double probability) const;

 private:
  static constexpr int kBinBits = 5;
  static constexpr std::size_t kBins = (64 - kBinBits) << kBinBits;
  static std::size_t bin_of(std::uint64_t value);
  static std::uint64_t upper_edge(std::size_t bin);

  std::array<std::int64_t, kBins> bins_{};
  std::int64_t count_ = 0;
  TimeNs max_ = 0;
};

/// @param program as installed: "loc-driver"
statistics_t statistics_message(const std::string& program, const NamedCounts& counts);
/// Adds "latency.p50_ms" and so on.
void add_latency(statistics_t& message, const std::string& name, const LatencyHistogram& histogram);
/// "latency.p50_ms=0.123 latency.p99_ms=… latency.max_ms=…", for a log line.
std::string format_latency(const std::string& name, const LatencyHistogram& histogram);

}  // namespace loc
