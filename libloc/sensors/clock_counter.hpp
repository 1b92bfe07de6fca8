// Counters of devices (microseconds, milliseconds, ticks; 8 to 64 bits) as nanoseconds that do not wrap around.
#pragma once

#include <cstdint>

#include "libloc/core/time.hpp"

namespace loc {

struct CounterUnwrapperOptions {
  int bits = 32;  ///< width of the counter, 1 to 64
  /// Length of a tick [ns] = numerator / denominator: 1000 / 1 for microseconds, 1'000'000'000 / 32768 for a watch
  /// crystal. Whole numbers, so that nothing is lost in years.
  std::int64_t tick_numerator_ns = 1000;
  std::int64_t tick_denominator = 1;

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Takes the count that is nearest to the one before, at most half the counter's range away: forwards (a wrap-around
/// among them) or backwards (a sample out of order, or a reset, which leaves the time wrong by whole turns at most and
/// is for the clock model to find). A silence of more than half the range loses turns: see unwrap(count, elapsed_ns).
class CounterUnwrapper {
 public:
  /// @throws std::invalid_argument as CounterUnwrapperOptions::check.
  explicit CounterUnwrapper(const CounterUnwrapperOptions& options = {});

  /// Time since the counter's zero in its first turn [ns]. Bits above the counter's width are cut off.
  TimeNs unwrap(std::uint64_t count);
  /// Likewise, after a silence of about this long by another clock: takes the turn that fits it best. Good for any
  /// silence that is known to half the counter's range.
  TimeNs unwrap(std::uint64_t count, TimeNs elapsed_ns);
  std::int64_t wraps() const { return wraps_; }
  void reset() { started_ = false; }

 private:
  TimeNs time() const;

  CounterUnwrapperOptions options_;
  std::uint64_t mask_ = 0;
  std::int64_t ticks_ = 0;  // not wrapped
  std::int64_t wraps_ = 0;
  bool started_ = false;
};

}  // namespace loc
