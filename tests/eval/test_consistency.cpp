#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <limits>
#include <stdexcept>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/eval/consistency.hpp"

namespace loc {
namespace {

Eigen::MatrixXd random_covariance(Random& random, int n) {
  Eigen::MatrixXd a(n, n);
  for (int i = 0; i < a.size(); ++i) a.data()[i] = random.normal();
  return a * a.transpose() + 0.1 * Eigen::MatrixXd::Identity(n, n);
}

Eigen::VectorXd random_vector(Random& random, int n) {
  Eigen::VectorXd v(n);
  for (int i = 0; i < n; ++i) v[i] = random.normal();
  return v;
}

TEST(Consistency, ValueIsTheQuadraticForm) {
  Random random(1);
  for (const int n : {1, 2, 6, 15}) {
    const Eigen::MatrixXd p = random_covariance(random, n);
    const Eigen::VectorXd e = random_vector(random, n);
    const double expected = e.dot(p.fullPivLu().solve(e));
    EXPECT_NEAR(normalised_error_squared(e, p), expected, 1e-9 * expected);
  }
}

// Errors that are drawn from the covariance are inside the bounds as often as promised, and values are chi-square.
TEST(Consistency, MonteCarloOfAConsistentEstimator) {
  Random random(2);
  constexpr int kDof = 6;
  constexpr int kRuns = 50;
  constexpr int kTrials = 400;
  const Eigen::MatrixXd p = random_covariance(random, kDof);
  const Eigen::MatrixXd root = p.llt().matrixL();
  int inside = 0;
  std::vector<double> all;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<double> values;
    for (int run = 0; run < kRuns; ++run) {
      values.push_back(normalised_error_squared(root * random_vector(random, kDof), p));
    }
    inside += average_consistency(values, kDof, 0.95).consistent() ? 1 : 0;
    all.insert(all.end(), values.begin(), values.end());
  }
  // 95 % of 400, five deviations of a binomial count (4.4).
  EXPECT_NEAR(inside, 380, 22);
  for (const double probability : {0.05, 0.5, 0.95, 0.99}) {
    EXPECT_NEAR(quantile(all, probability) / chi_square_quantile(probability, kDof), 1, 0.05);
  }
}

TEST(Consistency, TellsOptimisticFromPessimistic) {
  Random random(3);
  const Eigen::MatrixXd p = random_covariance(random, 3);
  const Eigen::MatrixXd root = p.llt().matrixL();
  std::vector<double> too_small;
  std::vector<double> too_large;
  std::vector<double> biased;
  for (int i = 0; i < 200; ++i) {
    const Eigen::VectorXd e = root * random_vector(random, 3);
    too_small.push_back(normalised_error_squared(e, p / 1.5));
    too_large.push_back(normalised_error_squared(e, p * 1.5));
    biased.push_back(normalised_error_squared(e + root * Eigen::Vector3d(0.7, 0.7, 0), p));
  }
  EXPECT_TRUE(average_consistency(too_small, 3).optimistic());
  EXPECT_TRUE(average_consistency(too_large, 3).pessimistic());
  EXPECT_TRUE(average_consistency(biased, 3).optimistic());
}

TEST(Consistency, BoundsAreThoseOfTheBook) {
  // Bar-Shalom et al. 2001, section 5.4.2: 50 runs, 2 degrees of freedom, 95 %: [1.5, 2.6].
  const Consistency c = average_consistency(std::vector<double>(50, 2.0), 2, 0.95);
  EXPECT_NEAR(c.lower, 1.5, 0.05);
  EXPECT_NEAR(c.upper, 2.6, 0.05);
  EXPECT_NEAR(c.lower, chi_square_quantile(0.025, 100) / 50, 1e-14);
  EXPECT_EQ(c.average, 2);
  EXPECT_EQ(c.samples, 50);
  EXPECT_EQ(c.dof, 2);
  EXPECT_TRUE(c.consistent());
}

TEST(Consistency, RefusesBadInput) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Eigen::MatrixXd identity = Eigen::Matrix3d::Identity();
  const Eigen::VectorXd e = Eigen::Vector3d(1, 2, 3);
  EXPECT_THROW(normalised_error_squared(e, Eigen::Matrix2d::Identity()), std::invalid_argument);
  EXPECT_THROW(normalised_error_squared(Eigen::VectorXd(), Eigen::MatrixXd()), std::invalid_argument);
  EXPECT_THROW(normalised_error_squared(Eigen::Vector3d(1, nan, 3), identity), std::invalid_argument);
  Eigen::MatrixXd p = identity;
  p(0, 0) = -1;
  EXPECT_THROW(normalised_error_squared(e, p), std::invalid_argument);
  p(0, 0) = 0;
  EXPECT_THROW(normalised_error_squared(e, p), std::invalid_argument);
  p(0, 0) = nan;
  EXPECT_THROW(normalised_error_squared(e, p), std::invalid_argument);
  p = identity;
  p(0, 1) = 0.1;
  EXPECT_THROW(normalised_error_squared(e, p), std::invalid_argument);
  EXPECT_THROW(average_consistency({}, 3), std::invalid_argument);
  EXPECT_THROW(average_consistency(std::vector<double>{1, nan}, 3), std::invalid_argument);
  EXPECT_THROW(average_consistency(std::vector<double>{1}, 0), std::invalid_argument);
  EXPECT_THROW(average_consistency(std::vector<double>{1}, 1, 1), std::invalid_argument);
}

}  // namespace
}  // namespace loc
