#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "libloc/core/random.hpp"
#include "libloc/core/time.hpp"

namespace loc {
namespace {

TEST(Time, ParsesSecondsExactlyWhereADoubleCannot) {
  EXPECT_EQ(parse_seconds("1403715274.302143001"), 1403715274302143001);
  EXPECT_EQ(parse_seconds("-0.5"), -500'000'000);
  EXPECT_EQ(parse_seconds(".25"), 250'000'000);
  EXPECT_EQ(parse_seconds("7"), 7'000'000'000);
  EXPECT_EQ(parse_seconds("1.403715274302143e+09"), 1403715274302143000);
  EXPECT_EQ(parse_seconds("15e-10"), 2);
  EXPECT_EQ(parse_seconds("0.0000000004"), 0);
}

TEST(Time, RefusesWhatIsNoTime) {
  for (const char* text : {"", ".", "-", "nan", "1.2.3", "1e", "1e99", "1e+-5", "1e-+5", "1e++5", "+-1", "12 ",
                           "1e-2147483648", "0x10", "99999999999999"}) {
    EXPECT_THROW(parse_seconds(text), std::invalid_argument) << text;
  }
  EXPECT_THROW(from_seconds(std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
  EXPECT_THROW(from_seconds(1e10), std::invalid_argument);
}

TEST(Time, ApartIsOfAnyTwoTimes) {
  EXPECT_NEAR(apart_s(1'700'000'001'500'000'000, 1'700'000'000'000'000'000), 1.5, 1e-6);
  constexpr TimeNs kLast = std::numeric_limits<TimeNs>::max();
  EXPECT_NEAR(apart_s(kLast, kNoTime), 1.8446744e10, 1e4);
  EXPECT_NEAR(apart_s(kNoTime, kLast), -1.8446744e10, 1e4);
}

TEST(Time, FormatAndParseAreInverse) {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const auto t = static_cast<TimeNs>(random.uniform(-4e18, 4e18));
    EXPECT_EQ(parse_seconds(format_seconds(t)), t);
  }
  EXPECT_EQ(format_seconds(-1), "-0.000000001");
}

}  // namespace
}  // namespace loc
