// Chi-square against SciPy (the table is written by golden_statistics.py), quantiles against numpy.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "libloc/core/statistics.hpp"

namespace loc {
namespace {

struct ChiSquareRow {
  double dof, x, cdf, survival;
};
constexpr ChiSquareRow kChiSquare[] = {
#include "golden_chi_square.inc"
};

struct QuantileRow {
  double probability, dof, x;
};
constexpr QuantileRow kQuantile[] = {
#include "golden_chi_square_quantile.inc"
};

TEST(Statistics, ChiSquareAgreesWithScipyInBothTails) {
  for (const ChiSquareRow& row : kChiSquare) {
    EXPECT_NEAR(chi_square_cdf(row.x, row.dof), row.cdf, 1e-10 * row.cdf) << row.dof << " " << row.x;
    EXPECT_NEAR(chi_square_survival(row.x, row.dof), row.survival, 1e-10 * row.survival) << row.dof << " " << row.x;
  }
}

TEST(Statistics, ChiSquareQuantileAgreesWithScipy) {
  for (const QuantileRow& row : kQuantile) {
    EXPECT_NEAR(chi_square_quantile(row.probability, row.dof), row.x, 1e-10 * row.x)
        << row.probability << " " << row.dof;
  }
}

TEST(Statistics, ChiSquareAtTheEndsOfItsDomain) {
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(chi_square_cdf(-1, 3), 0);
  EXPECT_EQ(chi_square_survival(-1, 3), 1);
  EXPECT_EQ(chi_square_cdf(infinity, 3), 1);
  EXPECT_EQ(chi_square_survival(infinity, 3), 0);
  EXPECT_EQ(chi_square_quantile(0, 3), 0);
  for (const double dof : {0.0, -1.0, nan, infinity}) {
    EXPECT_THROW(chi_square_cdf(1, dof), std::invalid_argument);
    EXPECT_THROW(chi_square_survival(1, dof), std::invalid_argument);
    EXPECT_THROW(chi_square_quantile(0.5, dof), std::invalid_argument);
  }
  EXPECT_THROW(chi_square_cdf(nan, 3), std::invalid_argument);
  for (const double p : {-1e-9, 1.0, 1.5, nan}) EXPECT_THROW(chi_square_quantile(p, 3), std::invalid_argument);
}

TEST(Statistics, QuantileIsNumpys) {
  // numpy.quantile([3.5, -1, 8, 2.25, 2.25, 100, 0.125], p)
  const std::vector<double> values = {3.5, -1, 8, 2.25, 2.25, 100, 0.125};
  EXPECT_EQ(quantile(values, 0), -1);
  EXPECT_NEAR(quantile(values, 0.05), -0.6625, 1e-14);
  EXPECT_NEAR(quantile(values, 0.25), 1.1875, 1e-14);
  EXPECT_EQ(quantile(values, 0.5), 2.25);
  EXPECT_NEAR(quantile(values, 0.9), 44.8, 1e-12);
  EXPECT_NEAR(quantile(values, 0.99), 94.48, 1e-12);
  EXPECT_EQ(quantile(values, 1), 100);
  EXPECT_EQ(quantile(std::array{7.0}, 0.3), 7);
  EXPECT_EQ(quantile(std::array{1.0, 2.0, std::numeric_limits<double>::infinity()}, 0.5), 2);
}

TEST(Statistics, MeanAndRootMeanSquare) {
  EXPECT_DOUBLE_EQ(mean(std::array{1.0, 2.0, 6.0}), 3);
  EXPECT_DOUBLE_EQ(root_mean_square(std::array{3.0, -4.0}), std::sqrt(12.5));
}

TEST(Statistics, RefusesEmptyInputAndNan) {
  const std::vector<double> none;
  EXPECT_THROW(mean(none), std::invalid_argument);
  EXPECT_THROW(root_mean_square(none), std::invalid_argument);
  EXPECT_THROW(quantile(none, 0.5), std::invalid_argument);
  const std::array values = {1.0, std::numeric_limits<double>::quiet_NaN(), 2.0};
  EXPECT_THROW(quantile(values, 0.5), std::invalid_argument);
  EXPECT_THROW(quantile(std::array{1.0}, 1.01), std::invalid_argument);
}

}  // namespace
}  // namespace loc
