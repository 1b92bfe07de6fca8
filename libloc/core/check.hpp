// Checks at the boundary. The caller's mistake throws std::invalid_argument, bad data throws DataError; both name the
// value.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <string>
#include <string_view>

namespace loc {

/// What is wrong in a file or message: where (file, line or byte), which field, which value.
class DataError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Shortest text that reads back as the same double: std::to_string() gives -1e-9 as -0.000000.
inline std::string to_text(double value) {
  std::array<char, 32> buffer{};
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), result.ptr};
}

/// Text for a person, with so many significant digits (at most 17).
inline std::string to_text(double value, int digits) {
  std::array<char, 32> buffer{};
  const auto result =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::general, digits);
  return {buffer.data(), result.ptr};
}

/// @throws std::invalid_argument saying what, unless ok.
inline void require(bool ok, std::string_view what) {
  if (!ok) throw std::invalid_argument(std::string(what));
}

/// @throws std::invalid_argument "name = value: rule", unless ok.
inline void require(bool ok, std::string_view name, double value, std::string_view rule) {
  if (!ok) {
    throw std::invalid_argument(std::string(name) + " = " + to_text(value) + ": " + std::string(rule));
  }
}

inline void require_finite(std::string_view name, double value) {
  require(std::isfinite(value), name, value, "must be finite");
}

inline void require_positive(std::string_view name, double value) {
  require(std::isfinite(value) && value > 0, name, value, "must be positive and finite");
}

inline void require_not_negative(std::string_view name, double value) {
  require(std::isfinite(value) && value >= 0, name, value, "must not be negative, and finite");
}

}  // namespace loc
