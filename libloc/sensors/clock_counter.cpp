#include "libloc/sensors/clock_counter.hpp"

#include <cmath>
#include <limits>

#include "libloc/core/check.hpp"
#include "libloc/sensors/clock_line.hpp"

namespace loc {

void CounterUnwrapperOptions::check() const {
  require(bits >= 1 && bits <= 64, "bits", bits, "must be in [1, 64]");
  require(tick_numerator_ns > 0, "tick_numerator_ns", static_cast<double>(tick_numerator_ns), "must be positive");
  require(tick_denominator > 0, "tick_denominator", static_cast<double>(tick_denominator), "must be positive");
}

CounterUnwrapper::CounterUnwrapper(const CounterUnwrapperOptions& options)
    : options_((options.check(), options)),
      mask_(options.bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << static_cast<unsigned>(options.bits)) - 1) {}

TimeNs CounterUnwrapper::unwrap(std::uint64_t count) {
  count &= mask_;
  if (!started_) {
    started_ = true;
    ticks_ = static_cast<std::int64_t>(count);
    return time();
  }
  const std::uint64_t forwards = (count - static_cast<std::uint64_t>(ticks_)) & mask_;
  const bool ahead = forwards <= mask_ / 2;
  if (ahead && count < (static_cast<std::uint64_t>(ticks_) & mask_)) ++wraps_;
  if (!ahead && count > (static_cast<std::uint64_t>(ticks_) & mask_)) --wraps_;
  // Modulo 2^64, then cut to the counter's width: also right where the counter is 64 bits wide.
  ticks_ = saturating_sum(
      ticks_, ahead ? static_cast<std::int64_t>(forwards) : -static_cast<std::int64_t>((mask_ - forwards) + 1));
  return time();
}

TimeNs CounterUnwrapper::unwrap(std::uint64_t count, TimeNs elapsed_ns) {
  if (!started_ || options_.bits > 62) return unwrap(count);
  const std::int64_t before = ticks_;
  unwrap(count);
  // Whole turns between what one step gives and what the other clock says.
  const double expected = static_cast<double>(elapsed_ns) * static_cast<double>(options_.tick_denominator) /
                          static_cast<double>(options_.tick_numerator_ns);
  const double turn = static_cast<double>(mask_) + 1;
  const double turns = std::round((expected - static_cast<double>(ticks_ - before)) / turn);
  if (std::abs(turns) * turn < 9e18) {
    ticks_ = saturating_sum(ticks_, static_cast<std::int64_t>(turns * turn));
    wraps_ += static_cast<std::int64_t>(turns);
  }
  return time();
}

TimeNs CounterUnwrapper::time() const {
  __extension__ using Wide = __int128;
  const Wide ns = static_cast<Wide>(ticks_) * options_.tick_numerator_ns / options_.tick_denominator;
  if (ns > std::numeric_limits<TimeNs>::max()) return std::numeric_limits<TimeNs>::max();
  if (ns <= std::numeric_limits<TimeNs>::min()) return std::numeric_limits<TimeNs>::min() + 1;
  return static_cast<TimeNs>(ns);
}

}  // namespace loc
