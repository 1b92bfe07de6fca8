#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "libloc/calib/least_squares.hpp"
#include "libloc/core/random.hpp"
#include "support/numeric_jacobian.hpp"

namespace loc {
namespace {

// Rosenbrock's valley as residuals.
void valley(const Eigen::VectorXd& x, Eigen::VectorXd& r, Eigen::MatrixXd* jacobian) {
  r.resize(2);
  r << 10 * (x[1] - x[0] * x[0]), 1 - x[0];
  if (jacobian != nullptr) {
    jacobian->resize(2, 2);
    *jacobian << -20 * x[0], 10, -1, 0;
  }
}

TEST(LeastSquares, FindsTheBottomOfTheValley) {
  const LeastSquaresResult result = minimise(valley, Eigen::Vector2d(-1.2, 1));
  EXPECT_TRUE(result.converged);
  EXPECT_NEAR(result.x[0], 1, 1e-9);
  EXPECT_NEAR(result.x[1], 1, 1e-9);
  EXPECT_LT(result.cost, 1e-18);
}

// y = a exp(b t) with parameters of very different size.
TEST(LeastSquares, ParametersOfAnySize) {
  Random random(1);
  std::vector<double> y;
  for (int i = 0; i < 50; ++i) y.push_back(3e6 * std::exp(-2e-4 * 100 * i) + 1e3 * random.normal());
  const ResidualFunction f = [&](const Eigen::VectorXd& x, Eigen::VectorXd& r, Eigen::MatrixXd* jacobian) {
    r.resize(50);
    if (jacobian != nullptr) jacobian->resize(50, 2);
    for (int i = 0; i < 50; ++i) {
      const double e = std::exp(x[1] * 100 * i);
      r[i] = (x[0] * e - y[static_cast<std::size_t>(i)]) / 1e3;
      if (jacobian != nullptr) jacobian->row(i) << e / 1e3, x[0] * e * 100 * i / 1e3;
    }
  };
  const LeastSquaresResult result = minimise(f, Eigen::Vector2d(1e6, -1e-4));
  EXPECT_TRUE(result.converged);
  const auto cov = covariance_from(result.information);
  ASSERT_TRUE(cov.has_value());
  EXPECT_LT(std::abs(result.x[0] - 3e6) / std::sqrt((*cov)(0, 0)), 4);
  EXPECT_LT(std::abs(result.x[1] + 2e-4) / std::sqrt((*cov)(1, 1)), 4);
  const Eigen::Vector2d unit = cov->diagonal().cwiseSqrt();
  const Eigen::MatrixXd scaled = unit.cwiseInverse().asDiagonal() * (*cov * result.information) * unit.asDiagonal();
  EXPECT_TRUE(test::near(scaled, Eigen::Matrix2d::Identity(), 1e-9));
}

TEST(LeastSquares, StartAtTheBottom) {
  const LeastSquaresResult result = minimise(valley, Eigen::Vector2d(1, 1));
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.cost, 0);
}

TEST(LeastSquares, WhatIsNotDetermined) {
  EXPECT_FALSE(covariance_from(Eigen::Matrix2d::Ones()).has_value());
  EXPECT_FALSE(covariance_from(Eigen::Matrix2d::Zero()).has_value());
  EXPECT_FALSE(covariance_from(Eigen::Matrix2d::Constant(std::nan(""))).has_value());
  const Eigen::Matrix2d wide = Eigen::Vector2d(1e-30, 1e30).asDiagonal();
  EXPECT_TRUE(covariance_from(wide).has_value());
  const ResidualFunction bad = [](const Eigen::VectorXd&, Eigen::VectorXd& r, Eigen::MatrixXd* jacobian) {
    r = Eigen::VectorXd::Constant(2, std::nan(""));
    if (jacobian != nullptr) *jacobian = Eigen::MatrixXd::Zero(2, 2);
  };
  EXPECT_THROW(minimise(bad, Eigen::Vector2d::Zero()), std::invalid_argument);
  EXPECT_THROW(minimise(valley, Eigen::Vector3d::Zero()), std::invalid_argument);
}

TEST(LeastSquares, SmallSamples) {
  // scipy.stats.t.ppf(0.975, n) / scipy.stats.norm.ppf(0.975)
  EXPECT_EQ(small_sample_factor(0), std::numeric_limits<double>::infinity());
  EXPECT_NEAR(small_sample_factor(1), 6.48287, 1e-4);
  EXPECT_NEAR(small_sample_factor(3), 1.62373, 0.02);
  EXPECT_NEAR(small_sample_factor(10), 1.13683, 1e-3);
  EXPECT_NEAR(small_sample_factor(1000), 1.00121, 1e-5);
}

TEST(LeastSquares, RobustStatistics) {
  Random random(2);
  std::vector<double> values;
  for (int i = 0; i < 10000; ++i) values.push_back(i % 10 == 0 ? 1e6 : 2 * random.normal());
  EXPECT_NEAR(robust_sigma(values), 2, 0.4);
  EXPECT_EQ(tukey_weight(0), 1);
  EXPECT_EQ(tukey_weight(5), 0);
  EXPECT_EQ(tukey_weight(std::nan("")), 0);
  EXPECT_NEAR(tukey_weight(2.3425), 0.5625, 1e-12);
}

}  // namespace
}  // namespace loc
