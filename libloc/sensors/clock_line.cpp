#include "libloc/sensors/clock_line.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace loc {
namespace {

constexpr TimeNs kLargest = std::numeric_limits<TimeNs>::max();
constexpr TimeNs kSmallest = std::numeric_limits<TimeNs>::min();

// Rounded; what does not fit is the largest there is.
TimeNs to_time(double ns) {
  if (ns >= 9.2e18) return kLargest;
  if (ns <= -9.2e18) return kSmallest;
  return std::llround(ns);
}

}  // namespace

TimeNs saturating_difference(TimeNs a, TimeNs b) {
  TimeNs result = 0;
  if (!__builtin_sub_overflow(a, b, &result)) return result;
  return a > b ? kLargest : kSmallest;
}

TimeNs saturating_sum(TimeNs a, TimeNs b) {
  TimeNs result = 0;
  if (!__builtin_add_overflow(a, b, &result)) return result;
  return a > 0 ? kLargest : kSmallest;
}

TimeNs ClockLine::convert(TimeNs input_ns) const {
  const TimeNs passed = saturating_difference(input_ns, input_ref_ns);
  return saturating_sum(saturating_sum(output_ref_ns, passed), to_time(skew * static_cast<double>(passed)));
}

double ClockLine::sigma_at_ns(TimeNs input_ns) const {
  const double passed_ns = std::abs(static_cast<double>(saturating_difference(input_ns, input_ref_ns)));
  const double by_skew = sigma_skew * passed_ns;
  // Integrated random walk: variance walk^2 t^3 / 3.
  const double walk_2 = skew_walk * skew_walk * passed_ns * 1e-9 / 3;
  return std::sqrt(sigma_ns * sigma_ns + by_skew * by_skew + walk_2 * passed_ns * passed_ns);
}

ClockLine ClockLine::inverse() const {
  ClockLine line = *this;
  line.input_ref_ns = output_ref_ns;
  line.output_ref_ns = input_ref_ns;
  line.skew = -skew / (1 + skew);
  line.valid_from_ns = convert(valid_from_ns);
  line.valid_to_ns = convert(valid_to_ns);
  return line;
}

TimeNs MonotoneTime::apply(TimeNs input_ns, TimeNs output_ns) {
  if (!has_output_) {
    has_output_ = true;
  } else if (!has_input_) {
    output_ns = std::max(output_ns, saturating_sum(output_ns_, 1));
  } else if (input_ns <= input_ns_) {
    const TimeNs before = saturating_difference(input_ns_, input_ns);
    if (before == 0) return output_ns_;
    return std::min(output_ns, saturating_difference(output_ns_, before / 2 + before % 2));
  } else {
    const TimeNs passed = saturating_difference(input_ns, input_ns_);
    output_ns = std::max(output_ns, saturating_sum(output_ns_, passed / 2 + passed % 2));
  }
  has_input_ = true;
  input_ns_ = input_ns;
  output_ns_ = output_ns;
  return output_ns;
}

ClockStamp MonotoneTime::apply(TimeNs input_ns, const ClockStamp& output) {
  const TimeNs held = apply(input_ns, output.time_ns);
  if (held == output.time_ns) return output;
  return {held, std::hypot(output.sigma_ns, static_cast<double>(saturating_difference(held, output.time_ns)))};
}

}  // namespace loc
