#include "libloc/core/time.hpp"

#include <charconv>
#include <cmath>
#include <stdexcept>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

[[noreturn]] void reject(std::string_view text) {
  throw std::invalid_argument("not a time in seconds: '" + std::string(text) + "'");
}

}  // namespace

TimeNs from_seconds(double seconds) {
  const double ns = seconds * 1e9;
  // 2^63 is exact in a double; the comparison is false for NaN.
  if (!(std::abs(ns) < 9.2233720368547758e18)) {
    throw std::invalid_argument("not a time in seconds: " + to_text(seconds));
  }
  return static_cast<TimeNs>(std::llround(ns));
}

TimeNs parse_seconds(std::string_view text) {
  std::string_view rest = text;
  bool negative = false;
  if (!rest.empty() && (rest.front() == '-' || rest.front() == '+')) {
    negative = rest.front() == '-';
    rest.remove_prefix(1);
  }
  int exponent = 0;
  if (const auto e = rest.find_first_of("eE"); e != std::string_view::npos) {
    std::string_view digits = rest.substr(e + 1);
    if (digits.starts_with('+') && !digits.starts_with("+-")) digits.remove_prefix(1);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), exponent);
    if (error != std::errc{} || end != digits.data() + digits.size() || exponent < -40 || exponent > 40) {
      reject(text);
    }
    rest = rest.substr(0, e);
  }
  const auto point = rest.find('.');
  const std::string_view whole = rest.substr(0, point);
  const std::string_view fraction = point == std::string_view::npos ? std::string_view{} : rest.substr(point + 1);
  if (whole.empty() && fraction.empty()) reject(text);
  const std::string digits = std::string(whole) + std::string(fraction);

  // The value is digits * 10^(exponent - fraction.size()); walk over the places that count in nanoseconds.
  const int ns_digits = static_cast<int>(whole.size()) + exponent + 9;
  std::int64_t value = 0;
  for (int i = 0; i < static_cast<int>(digits.size()); ++i) {
    const char c = digits[static_cast<std::size_t>(i)];
    if (c < '0' || c > '9') reject(text);
    if (i < ns_digits) {
      if (__builtin_mul_overflow(value, 10, &value) || __builtin_add_overflow(value, c - '0', &value)) reject(text);
    } else if (i == ns_digits && c >= '5') {
      if (__builtin_add_overflow(value, 1, &value)) reject(text);
    }
  }
  for (int i = static_cast<int>(digits.size()); i < ns_digits && value != 0; ++i) {
    if (__builtin_mul_overflow(value, 10, &value)) reject(text);
  }
  return negative ? -value : value;
}

std::string format_seconds(TimeNs time_ns) {
  const bool negative = time_ns < 0;
  // Unsigned, so that the smallest value has a magnitude too.
  const auto magnitude = negative ? 0 - static_cast<std::uint64_t>(time_ns) : static_cast<std::uint64_t>(time_ns);
  std::string fraction = std::to_string(magnitude % kNsPerSecond);
  fraction.insert(0, 9 - fraction.size(), '0');
  return (negative ? "-" : "") + std::to_string(magnitude / kNsPerSecond) + "." + fraction;
}

}  // namespace loc
