#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "libloc/core/random.hpp"
#include "tools/support/statistics.hpp"

namespace loc {
namespace {

TEST(LatencyHistogram, QuantilesAreAtMostThreePercentTooLargeAndNeverTooSmall) {
  Random random(21);
  LatencyHistogram histogram;
  std::vector<TimeNs> values;
  for (int i = 0; i < 20'000; ++i) {
    values.push_back(static_cast<TimeNs>(std::exp(random.uniform(0, 25))));
    histogram.add(values.back());
  }
  std::sort(values.begin(), values.end());
  EXPECT_EQ(histogram.count(), 20'000);
  EXPECT_EQ(histogram.max(), values.back());
  for (const double probability : {0.01, 0.5, 0.9, 0.99, 1.0}) {
    const auto exact = static_cast<double>(values[static_cast<std::size_t>(std::ceil(probability * 20'000)) - 1]);
    const auto estimated = static_cast<double>(histogram.quantile(probability));
    EXPECT_GE(estimated, exact) << probability;
    EXPECT_LE(estimated, exact * 1.0313 + 1) << probability;
  }
}

TEST(LatencyHistogram, TakesTheExtremes) {
  LatencyHistogram histogram;
  EXPECT_EQ(histogram.quantile(0.99), 0);
  histogram.add(-5);
  EXPECT_EQ(histogram.quantile(1), 0);
  histogram.add(std::numeric_limits<TimeNs>::max());
  EXPECT_EQ(histogram.quantile(1), std::numeric_limits<TimeNs>::max());
  EXPECT_EQ(histogram.quantile(0.5), 0);
}

TEST(Statistics, MessageHoldsCountsAndLatencies) {
  LatencyHistogram histogram;
  histogram.add(2'000'000);
  statistics_t message = statistics_message("loc-test", {{"imu.dropped", 3}});
  add_latency(message, "latency", histogram);
  ASSERT_EQ(message.size, 4);
  EXPECT_EQ(message.program, "loc-test");
  EXPECT_EQ(message.name[0], "imu.dropped");
  EXPECT_EQ(message.value[0], 3);
  EXPECT_EQ(message.name[3], "latency.max_ms");
  EXPECT_DOUBLE_EQ(message.value[3], 2.0);
}

}  // namespace
}  // namespace loc
