// What the checks at the boundary say about a value.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

template <class Action>
std::string message_of(Action action) {
  try {
    action();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Check, the_value_is_told_as_it_is) {
  EXPECT_EQ(message_of([] { require_positive("rate_hz", -1e-9); }), "rate_hz = -1e-09: must be positive and finite");
  EXPECT_EQ(message_of([] { require_not_negative("x", -0.1); }), "x = -0.1: must not be negative, and finite");
  EXPECT_EQ(message_of([] { require_positive("x", 0); }), "x = 0: must be positive and finite");
  EXPECT_EQ(message_of([] { require_finite("x", std::numeric_limits<double>::quiet_NaN()); }),
            "x = nan: must be finite");
  EXPECT_EQ(message_of([] { require_finite("x", -std::numeric_limits<double>::infinity()); }),
            "x = -inf: must be finite");
  EXPECT_EQ(message_of([] { require(false, "bytes", 2147483648.0, "too many"); }), "bytes = 2147483648: too many");
  EXPECT_EQ(message_of([] { require_finite("x", 1); }), "accepted");
}

TEST(Check, the_shortest_text_reads_back_as_the_same_number) {
  for (const double value : {1.0 / 3, 1.0000000000000002, -1e-9, 5e-324, 1.7976931348623157e308}) {
    EXPECT_EQ(std::strtod(to_text(value).c_str(), nullptr), value) << to_text(value);
  }
  EXPECT_EQ(to_text(1.0000000000000002), "1.0000000000000002");
}

TEST(Check, TextForAPersonHasSoManyDigits) {
  EXPECT_EQ(to_text(0.0001370104354166664, 3), "0.000137");
  EXPECT_EQ(to_text(-2.0, 3), "-2");
  EXPECT_EQ(to_text(1.23456e-9, 3), "1.23e-09");
  EXPECT_EQ(to_text(std::nan(""), 3), "nan");
}

}  // namespace
}  // namespace loc
