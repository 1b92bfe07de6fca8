#include "tools/support/statistics.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <utility>

#include "tools/support/program.hpp"

namespace loc {
namespace {

std::array<std::pair<const char*, double>, 3> figures_ms(const LatencyHistogram& histogram) {
  return {{{".p50_ms", static_cast<double>(histogram.quantile(0.5)) * 1e-6},
           {".p99_ms", static_cast<double>(histogram.quantile(0.99)) * 1e-6},
           {".max_ms", static_cast<double>(histogram.max()) * 1e-6}}};
}

}  // namespace

// Values below 2^kBinBits have a bin each; above, the leading bits choose it.
std::size_t LatencyHistogram::bin_of(std::uint64_t value) {
  const int shift = std::max(0, static_cast<int>(std::bit_width(value)) - kBinBits - 1);
  return (static_cast<std::size_t>(shift) << kBinBits) + static_cast<std::size_t>(value >> shift);
}

std::uint64_t LatencyHistogram::upper_edge(std::size_t bin) {
  const std::size_t per_octave = std::size_t{1} << kBinBits;
  if (bin < 2 * per_octave) return bin;
  const std::size_t shift = bin / per_octave - 1;
  return ((bin - shift * per_octave + 1) << shift) - 1;
}

void LatencyHistogram::add(TimeNs duration_ns) {
  const TimeNs value = std::max<TimeNs>(duration_ns, 0);
  ++bins_[bin_of(static_cast<std::uint64_t>(value))];
  ++count_;
  max_ = std::max(max_, value);
}

TimeNs LatencyHistogram::quantile(double probability) const {
  const auto rank = static_cast<std::int64_t>(std::ceil(probability * static_cast<double>(count_)));
  std::int64_t seen = 0;
  for (std::size_t bin = 0; bin < bins_.size() && count_ > 0; ++bin) {
    seen += bins_[bin];
    if (seen >= rank && seen > 0) return std::min(static_cast<TimeNs>(upper_edge(bin)), max_);
  }
  return 0;
}

statistics_t statistics_message(const std::string& program, const NamedCounts& counts) {
  statistics_t out{};
  out.time_ns = host_now();
  out.program = program;
  out.process_id = ::getpid();
  for (const NamedCount& count : counts) {
    out.name.push_back(count.name);
    out.value.push_back(static_cast<double>(count.value));
  }
  out.size = static_cast<std::int32_t>(out.name.size());
  return out;
}

void add_latency(statistics_t& message, const std::string& name, const LatencyHistogram& histogram) {
  for (const auto& [suffix, value] : figures_ms(histogram)) {
    message.name.push_back(name + suffix);
    message.value.push_back(value);
  }
  message.size = static_cast<std::int32_t>(message.name.size());
}

std::string format_latency(const std::string& name, const LatencyHistogram& histogram) {
  std::string out;
  for (const auto& [suffix, value] : figures_ms(histogram)) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3f", value);
    if (!out.empty()) out += ' ';
    out += name + suffix + "=" + text.data();
  }
  return out;
}

}  // namespace loc
