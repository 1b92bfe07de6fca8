// Time is an integer count of nanoseconds. Doubles only ever hold differences: a double of seconds since 1970 has a
// resolution of 0.2 us, too coarse for calibration.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

namespace loc {

/// Nanoseconds on some clock (the IMU's unless said otherwise), or a difference of two such times.
using TimeNs = std::int64_t;

/// A time that is not known.
inline constexpr TimeNs kNoTime = std::numeric_limits<TimeNs>::min();

/// Duration in seconds.
constexpr double to_seconds(TimeNs duration_ns) {
  return static_cast<double>(duration_ns) * 1e-9;
}

/// a - b [s] of any two times, also such whose difference is no TimeNs; exact to a microsecond.
constexpr double apart_s(TimeNs a, TimeNs b) {
  return 1e-9 * (static_cast<double>(a) - static_cast<double>(b));
}

/// Duration in nanoseconds, rounded to the nearest.
/// @throws std::invalid_argument when not finite or beyond +-292 years.
TimeNs from_seconds(double seconds);

/// Reads decimal seconds ("1403715274.302143", "-0.5", "1.2e3") without going through a double, exact to the
/// nanosecond; further digits are rounded.
/// @throws std::invalid_argument when the text is anything else or out of range.
TimeNs parse_seconds(std::string_view text);

/// Writes seconds with nine decimals, exactly.
std::string format_seconds(TimeNs time_ns);

}  // namespace loc
