// Checks at the boundary. The caller's mistake throws std::invalid_argument, bad data throws DataError; both name the
// value.
#pragma once

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

/// @throws std::invalid_argument saying what, unless ok.
inline void require(bool ok, std::string_view what) {
  if (!ok) throw std::invalid_argument(std::string(what));
}

/// @throws std::invalid_argument "name = value: rule", unless ok.
inline void require(bool ok, std::string_view name, double value, std::string_view rule) {
  if (!ok) {
    throw std::invalid_argument(std::string(name) + " = " + std::to_string(value) + ": " + std::string(rule));
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
