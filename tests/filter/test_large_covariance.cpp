#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <stdexcept>

#include "libloc/core/random.hpp"
#include "libloc/filter/blas.hpp"
#include "libloc/filter/large_covariance.hpp"
#include "libloc/sensors/measurements.hpp"
#include "support/numeric_jacobian.hpp"

namespace loc {
namespace {

constexpr int kHead = 12;

Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd out(rows, columns);
  for (Eigen::Index i = 0; i < out.size(); ++i) out.data()[i] = random.normal();
  return out;
}

Eigen::MatrixXd some_covariance(Random& random, Eigen::Index n) {
  const Eigen::MatrixXd root = random_matrix(random, n, n);
  return root * root.transpose() / static_cast<double>(n) + 0.1 * Eigen::MatrixXd::Identity(n, n);
}

BlockMeasurement some_measurement(Random& random, int rows, int block, int block_dim) {
  BlockMeasurement m;
  m.rows = rows;
  m.block = block;
  m.block_dim = block_dim;
  m.head.setConstant(kUnknown);  // what does not count must not matter
  m.block_jacobian.setConstant(kUnknown);
  m.noise_cov.setConstant(kUnknown);
  m.head.topLeftCorner(rows, kHead) = random_matrix(random, rows, kHead);
  if (block >= 0) m.block_jacobian.topLeftCorner(rows, block_dim) = random_matrix(random, rows, block_dim);
  m.noise_cov.topLeftCorner(rows, rows) = some_covariance(random, rows);
  m.residual = random_matrix(random, kMaxRows, 1);
  return m;
}

Eigen::MatrixXd dense_rows(const BlockMeasurement& m, Eigen::Index n) {
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(m.rows, n);
  h.leftCols(kHead) = m.head.topLeftCorner(m.rows, kHead);
  if (m.block >= 0) h.middleCols(m.block, m.block_dim) += m.block_jacobian.topLeftCorner(m.rows, m.block_dim);
  return h;
}

// The same as the textbook, for head, blocks of 6 and 3, and a measurement of the head alone; some rows are left out.
template <class Scalar>
void update_is_the_textbooks(double tolerance) {
  Random random(1);
  constexpr int kDim = kHead + 6 + 3 + 6;
  const Eigen::MatrixXd p = some_covariance(random, kDim);
  LargeCovariance<Scalar> covariance(kHead, kDim + 7, 12);
  covariance.set_dense(p);
  const std::vector<BlockMeasurement> all = {some_measurement(random, 2, kHead + 9, 6),
                                             some_measurement(random, 2, kHead + 6, 3),
                                             some_measurement(random, 3, -1, 0), some_measurement(random, 2, kHead, 6)};
  const std::vector<int> which = {0, 2, 3};
  covariance.innovate(all, which);
  ASSERT_EQ(covariance.rows(), 7);

  Eigen::MatrixXd h(7, kDim);
  Eigen::MatrixXd r = Eigen::MatrixXd::Zero(7, 7);
  Eigen::VectorXd residual(7);
  int row = 0;
  for (const int i : which) {
    const BlockMeasurement& m = all[static_cast<std::size_t>(i)];
    h.middleRows(row, m.rows) = dense_rows(m, kDim);
    r.block(row, row, m.rows, m.rows) = m.noise_cov.topLeftCorner(m.rows, m.rows);
    residual.segment(row, m.rows) = m.residual.head(m.rows);
    const Eigen::MatrixXd alone =
        dense_rows(m, kDim) * p * dense_rows(m, kDim).transpose() + m.noise_cov.topLeftCorner(m.rows, m.rows);
    EXPECT_TRUE(
        test::near(Eigen::MatrixXd(covariance.innovation_cov(m).topLeftCorner(m.rows, m.rows)), alone, tolerance));
    row += m.rows;
  }
  const Eigen::MatrixXd s = h * p * h.transpose() + r;
  const Eigen::MatrixXd pht = p * h.transpose();
  for (int i = 0; i < 7; ++i) {
    for (int j = 0; j < 7; ++j) EXPECT_NEAR(covariance.s(i, j), s(i, j), tolerance) << i << " " << j;
    for (int j = 0; j < kDim; ++j) EXPECT_NEAR(covariance.pht(j, i), pht(j, i), tolerance);
  }

  const std::vector<int> accepted = {0, 1, 3, 5, 6};
  Eigen::MatrixXd h_in(5, kDim);
  Eigen::MatrixXd r_in(5, 5);
  Eigen::VectorXd residual_in(5);
  for (int i = 0; i < 5; ++i) {
    h_in.row(i) = h.row(accepted[static_cast<std::size_t>(i)]);
    residual_in[i] = residual[accepted[static_cast<std::size_t>(i)]];
    for (int j = 0; j < 5; ++j)
      r_in(i, j) = r(accepted[static_cast<std::size_t>(i)], accepted[static_cast<std::size_t>(j)]);
  }
  const Eigen::MatrixXd s_in = h_in * p * h_in.transpose() + r_in;
  const Eigen::MatrixXd gain = p * h_in.transpose() * s_in.inverse();
  const Eigen::MatrixXd after = (Eigen::MatrixXd::Identity(kDim, kDim) - gain * h_in) * p;
  const std::vector<double> given(residual_in.data(), residual_in.data() + 5);
  Eigen::VectorXd dx;
  double nis = 0;
  ASSERT_TRUE(covariance.correction(accepted, given, dx));
  EXPECT_TRUE(test::near(dx, Eigen::VectorXd(gain * residual_in), tolerance));
  EXPECT_TRUE(test::near(covariance.dense(), p, tolerance)) << "a correction alone leaves P";
  // With the head and the first block left as they are: any gain, here one with rows of zero, by Joseph.
  constexpr int kFrom = kHead + 6;
  LargeCovariance<Scalar> considering = covariance;
  Eigen::MatrixXd some_gain = gain;
  some_gain.topRows(kFrom).setZero();
  const Eigen::MatrixXd left = Eigen::MatrixXd::Identity(kDim, kDim) - some_gain * h_in;
  ASSERT_TRUE(considering.update(accepted, given, dx, nis, kFrom));
  EXPECT_TRUE(test::near(dx, Eigen::VectorXd(some_gain * residual_in), tolerance));
  EXPECT_TRUE(test::near(considering.dense(),
                         Eigen::MatrixXd(left * p * left.transpose() + some_gain * r_in * some_gain.transpose()),
                         tolerance));
  ASSERT_TRUE(covariance.update(accepted, given, dx, nis));
  EXPECT_TRUE(test::near(dx, Eigen::VectorXd(gain * residual_in), tolerance));
  EXPECT_NEAR(nis, residual_in.dot(s_in.ldlt().solve(residual_in)), 10 * tolerance);
  EXPECT_TRUE(test::near(covariance.dense(), after, tolerance));
}

TEST(LargeCovariance, UpdateIsTheTextbooks) {
  update_is_the_textbooks<double>(1e-10);
  update_is_the_textbooks<float>(2e-4);
}

TEST(LargeCovariance, PropagationMovesHeadAndItsCorrelations) {
  Random random(2);
  constexpr int kDim = kHead + 9;
  const Eigen::MatrixXd p = some_covariance(random, kDim);
  const Eigen::MatrixXd f = random_matrix(random, kHead, kHead);
  const Eigen::MatrixXd q = some_covariance(random, kHead);
  LargeCovariance<double> covariance(kHead, kDim, 6);
  covariance.set_dense(p);
  covariance.propagate(f, q);
  Eigen::MatrixXd all = Eigen::MatrixXd::Identity(kDim, kDim);
  all.topLeftCorner(kHead, kHead) = f;
  Eigen::MatrixXd expected = all * p * all.transpose();
  expected.topLeftCorner(kHead, kHead) += q;
  EXPECT_TRUE(test::near(covariance.dense(), expected, 1e-11));
}

TEST(LargeCovariance, AppendReplaceRemoveShear) {
  Random random(3);
  Eigen::MatrixXd p = some_covariance(random, kHead);
  LargeCovariance<double> covariance(kHead, kHead + 18, 6);
  covariance.reset(p);
  // Three blocks of six, each a function of the head.
  for (int k = 0; k < 3; ++k) {
    const Eigen::MatrixXd j = random_matrix(random, 6, kHead);
    const Eigen::MatrixXd noise = some_covariance(random, 6);
    EXPECT_EQ(covariance.append(j, noise), kHead + 6 * k);
    Eigen::MatrixXd grow = Eigen::MatrixXd::Zero(p.rows() + 6, p.rows());
    grow.topRows(p.rows()).setIdentity();
    grow.bottomLeftCorner(6, kHead) = j;
    p = (grow * p * grow.transpose()).eval();
    p.bottomRightCorner(6, 6) += noise;
    ASSERT_TRUE(test::near(covariance.dense(), p, 1e-11));
  }
  EXPECT_THROW(covariance.append(random_matrix(random, 6, kHead), some_covariance(random, 6)), std::length_error);

  // The middle one becomes three errors; then the first goes, and what is left of the middle one's tail.
  const Eigen::MatrixXd j = random_matrix(random, 3, 6);
  covariance.replace(kHead + 6, j);
  const std::vector<CovarianceRange> gone = {{kHead, 6}, {kHead + 9, 3}};
  covariance.remove(gone);
  Eigen::MatrixXd pick = Eigen::MatrixXd::Zero(kHead + 9, kHead + 18);
  pick.topLeftCorner(kHead, kHead).setIdentity();
  pick.block(kHead, kHead + 6, 3, 6) = j;
  pick.bottomRightCorner(6, 6).setIdentity();
  p = (pick * p * pick.transpose()).eval();
  ASSERT_TRUE(test::near(covariance.dense(), p, 1e-11));

  const Eigen::MatrixX3d u = random_matrix(random, p.rows(), 3);
  covariance.shear(0, u);
  Eigen::MatrixXd t = Eigen::MatrixXd::Identity(p.rows(), p.rows());
  t.leftCols<3>() += u;
  p = (t * p * t.transpose()).eval();
  EXPECT_TRUE(test::near(covariance.dense(), p, 1e-10));

  covariance.inflate(2, 2, 0.5);
  p(2, 2) += 0.5;
  p(3, 3) += 0.5;
  EXPECT_TRUE(test::near(covariance.dense(), p, 1e-10));
  // Nothing at all, and everything but the head.
  covariance.remove({});
  EXPECT_EQ(covariance.dim(), kHead + 9);
  const std::vector<CovarianceRange> blocks = {{kHead, 9}};
  covariance.remove(blocks);
  EXPECT_TRUE(test::near(covariance.dense(), Eigen::MatrixXd(p.topLeftCorner(kHead, kHead)), 1e-10));
}

TEST(LargeCovariance, RefusesAnInnovationThatIsNone) {
  Random random(4);
  const Eigen::MatrixXd p = some_covariance(random, kHead);
  LargeCovariance<double> covariance(kHead, kHead, 6);
  covariance.reset(p);
  BlockMeasurement m = some_measurement(random, 2, -1, 0);
  m.noise_cov.topLeftCorner<2, 2>() = -1e3 * Eigen::Matrix2d::Identity();
  const std::vector<BlockMeasurement> all = {m};
  const std::vector<int> which = {0};
  covariance.innovate(all, which);
  const std::vector<int> accepted = {0, 1};
  const std::vector<double> residual = {1, 1};
  Eigen::VectorXd dx;
  double nis = 0;
  EXPECT_FALSE(covariance.update(accepted, residual, dx, nis));
  EXPECT_FALSE(covariance.correction(accepted, residual, dx));
  EXPECT_TRUE(test::near(covariance.dense(), p, 0));
  EXPECT_THROW(covariance.innovate(std::vector<BlockMeasurement>(4, m), std::vector<int>{0, 1, 2, 3}),
               std::length_error);
}

TEST(LargeCovariance, ChecksItsSizes) {
  EXPECT_THROW(LargeCovariance<double>(0, 10, 6), std::invalid_argument);
  EXPECT_THROW(LargeCovariance<double>(kMaxHeadDim + 1, 100, 6), std::invalid_argument);
  EXPECT_THROW(LargeCovariance<double>(12, 11, 6), std::invalid_argument);
  EXPECT_THROW(LargeCovariance<double>(12, 20, 5), std::invalid_argument);
  LargeCovariance<double> covariance(12, 20, 6);
  EXPECT_THROW(covariance.reset(Eigen::MatrixXd::Identity(13, 13)), std::invalid_argument);
  EXPECT_THROW(covariance.set_dense(Eigen::MatrixXd::Identity(21, 21)), std::invalid_argument);
  EXPECT_FALSE(blas::kernel_name().empty());
}

}  // namespace
}  // namespace loc
