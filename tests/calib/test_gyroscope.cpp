#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "libloc/calib/gyroscope.hpp"
#include "libloc/core/random.hpp"
#include "libloc/core/statistics.hpp"
#include "support/data.hpp"
#include "support/numeric_jacobian.hpp"
#include "support/pose_sequence.hpp"
#include "support/xsens.hpp"

namespace loc {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// Counts: 4800 a rad/s, 415 a m/s^2.
test::PoseSequence device(int poses, Random& random) {
  test::PoseSequence s;
  s.gyroscope_matrix << 1 / 4780.0, 2e-6, -1e-6, -1.5e-6, 1 / 4830.0, 2.5e-6, 1e-6, -3e-6, 1 / 4750.0;
  s.gyroscope_bias = {32768, 32466, 32485};
  s.accelerometer_matrix = Eigen::Vector3d(1 / 415.0, 1 / 413.0, 1 / 416.0).asDiagonal();
  s.accelerometer_bias = {33124, 33275, 32364};
  s.sigma_gyroscope = 29;
  s.sigma_accelerometer = 3.5;
  s.run(poses, random);
  return s;
}

AccelerometerFit known_accelerometer(const test::PoseSequence& s) {
  AccelerometerFit fit;
  fit.solved = true;
  fit.triad.bias = s.accelerometer_bias;
  fit.triad.matrix = s.accelerometer_matrix;
  return fit;
}

Vector9d row_error(const GyroscopeFit& fit, const test::PoseSequence& s) {
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> d = fit.triad.matrix - s.gyroscope_matrix;
  return Eigen::Map<const Vector9d>(d.data());
}

std::vector<RateStep> some_steps(Random& random, int count, double dt) {
  std::vector<RateStep> steps;
  Eigen::Vector3d rate = random.normal3();
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d next = rate + 0.3 * random.normal3();
    steps.push_back({.dt_s = dt, .share = (i + 0.5) / count, .begin = rate, .end = next});
    rate = next;
  }
  return steps;
}

TEST(Gyroscope, TurnJacobianIsTheDerivative) {
  Random random(1);
  const std::vector<RateStep> steps = some_steps(random, 40, 0.02);
  Vector9d a;
  a << 1.02, 0.01, -0.02, 0.03, 0.98, 0.01, -0.01, 0.02, 1.01;
  const auto matrix = [](const Vector9d& x) {
    return Eigen::Matrix3d(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(x.data()));
  };
  const TurnIntegral turn = integrate_turn(steps, matrix(a), Eigen::Matrix3d::Identity());
  const auto by_matrix = [&](const Vector9d& x) {
    return integrate_turn(steps, matrix(x), Eigen::Matrix3d::Identity()).q_before_after;
  };
  EXPECT_TRUE(test::near(turn.d_matrix, test::numeric_jacobian(by_matrix, a), 1e-8));
  // The bias is subtracted where the steps are made: at their two ends, between before and after.
  const auto by_bias = [&](bool after) {
    return [&, after](const Eigen::Vector3d& b) {
      std::vector<RateStep> moved = steps;
      for (RateStep& s : moved) {
        const double share = after ? s.share : 1 - s.share;
        s.begin -= share * b;
        s.end -= share * b;
      }
      return integrate_turn(moved, matrix(a), Eigen::Matrix3d::Identity()).q_before_after;
    };
  };
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  EXPECT_TRUE(test::near(turn.d_bias_before, test::numeric_jacobian(by_bias(false), zero), 1e-7));
  EXPECT_TRUE(test::near(turn.d_bias_after, test::numeric_jacobian(by_bias(true), zero), 1e-7));
}

// Against the same motion in a thousand parts a step: the coning term has the right sign and leaves the third order.
TEST(Gyroscope, IntegralOfALinearRate) {
  Random random(2);
  for (const double dt : {0.1, 0.05}) {
    const std::vector<RateStep> steps = some_steps(random, 1, dt);
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    for (int k = 0; k < 1000; ++k) {
      const double s = (k + 0.5) / 1000;
      q = so3::boxplus(q, dt / 1000 * ((1 - s) * steps[0].begin + s * steps[0].end));
    }
    const Eigen::Quaterniond mean = so3::exp(dt / 2 * (steps[0].begin + steps[0].end));
    const double error = so3::angle_between(
        integrate_turn(steps, Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Zero()).q_before_after, q);
    EXPECT_LT(error, 0.05 * so3::angle_between(mean, q));
  }
}

TEST(Gyroscope, NoiseOfATurnIsThatOfTheErrors) {
  Random random(3);
  const std::vector<RateStep> steps = some_steps(random, 60, 0.02);
  const Eigen::Matrix3d a = Eigen::Vector3d(1, 1.1, 0.9).asDiagonal();
  const TurnIntegral exact = integrate_turn(steps, a, 1e-4 * Eigen::Matrix3d::Identity());
  Eigen::Matrix3d cov = Eigen::Matrix3d::Zero();
  constexpr int kRuns = 3000;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<RateStep> noisy = steps;
    Eigen::Vector3d e = 0.01 * random.normal3();
    for (RateStep& s : noisy) {
      s.begin += e;
      e = 0.01 * random.normal3();
      s.end += e;
    }
    const Eigen::Vector3d d = so3::boxminus(integrate_turn(noisy, a, a).q_before_after, exact.q_before_after);
    cov += d * d.transpose() / kRuns;
  }
  EXPECT_NEAR(cov.trace() / exact.noise.trace(), 1, 0.06);
}

TEST(Gyroscope, FindsScaleAndMisalignmentWithinItsOwnSigma) {
  std::vector<double> nees;
  double bias_nees = 0;
  constexpr int kRuns = 25;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    Random random(seed);
    const test::PoseSequence s = device(20, random);
    const Stillness still = find_stillness(s.times_ns, s.gyroscope, s.accelerometer);
    ASSERT_EQ(still.segments.size(), 21U);
    const GyroscopeFit fit = fit_gyroscope(s.times_ns, s.gyroscope, still.segments, known_accelerometer(s));
    ASSERT_TRUE(fit.matrix_known) << seed;
    const Vector9d e = row_error(fit, s);
    nees.push_back(e.dot(fit.cov.ldlt().solve(e)));
    const Eigen::Vector3d b = fit.triad.bias - s.gyroscope_bias;
    bias_nees += b.dot(fit.bias_cov.ldlt().solve(b)) / kRuns;
    EXPECT_LT(fit.relative_sigma, 2e-3);
    EXPECT_GE(fit.inliers, 19);
    EXPECT_NEAR(fit.chi2_ratio, 1, 0.8);
  }
  std::printf("NEES %.1f of 9, bias %.1f of 3\n", mean(nees), bias_nees);
  // 9 +- 5 sqrt(18 / 25); the covariance is never made smaller by a small chi-square, so it may be a little
  // pessimistic.
  EXPECT_GT(mean(nees), 5);
  EXPECT_LT(mean(nees), 12.5);
  EXPECT_GT(bias_nees, 0.8);
  EXPECT_LT(bias_nees, 5.5);
}

TEST(Gyroscope, WithTheAccelerometersOwnFit) {
  Random random(31);
  const test::PoseSequence s = device(30, random);
  const Stillness still = find_stillness(s.times_ns, s.gyroscope, s.accelerometer);
  const AccelerometerFit accelerometer = fit_accelerometer(accelerometer_poses(still.segments));
  ASSERT_TRUE(accelerometer.solved);
  const GyroscopeFit fit = fit_gyroscope(s.times_ns, s.gyroscope, still.segments, accelerometer);
  ASSERT_TRUE(fit.matrix_known);
  EXPECT_EQ(fit.quality.verdict, Verdict::kOk);
  EXPECT_LT((fit.triad.matrix - s.gyroscope_matrix).norm() * 4800, 5e-3);
  EXPECT_LT(fit.residual_rms, 0.01);
}

TEST(Gyroscope, SwappedAndMirroredAxes) {
  for (const bool mirrored : {false, true}) {
    Random random(32);
    test::PoseSequence s = device(20, random);
    const Eigen::MatrixXd raw = s.gyroscope;
    s.gyroscope.col(0) = raw.col(1);
    s.gyroscope.col(1) = raw.col(0);
    if (!mirrored) s.gyroscope.col(2) = 2 * 32485 - raw.col(2).array();
    const Stillness still = find_stillness(s.times_ns, s.gyroscope, s.accelerometer);
    const GyroscopeFit fit = fit_gyroscope(s.times_ns, s.gyroscope, still.segments, known_accelerometer(s));
    ASSERT_TRUE(fit.matrix_known);
    EXPECT_EQ(fit.left_handed, mirrored);
    EXPECT_EQ(fit.quality.verdict, Verdict::kWarn);
    EXPECT_NEAR(fit.triad.matrix(0, 1) * 4780, 1, 5e-3);
    EXPECT_NEAR(fit.triad.matrix(1, 0) * 4830, 1, 5e-3);
  }
}

TEST(Gyroscope, ATurnWithLostSamplesIsLeftOut) {
  Random random(33);
  test::PoseSequence s = device(20, random);
  // A second is missing in the middle of the third turn, which the clock does not show.
  const Eigen::Index turn = 3 * 300 + 2 * 200;
  s.gyroscope.middleRows(turn + 50, 100).rowwise() = s.gyroscope_bias.transpose();
  // A gap in the fifth, NaN in the seventh.
  for (std::size_t i = 5 * 300 + 4 * 200 + 100; i < s.times_ns.size(); ++i) s.times_ns[i] += 500'000'000;
  s.gyroscope(7 * 300 + 6 * 200 + 100, 1) = std::nan("");
  const Stillness still = find_stillness(s.times_ns, s.gyroscope, s.accelerometer);
  ASSERT_EQ(still.segments.size(), 21U);
  const GyroscopeFit fit = fit_gyroscope(s.times_ns, s.gyroscope, still.segments, known_accelerometer(s));
  ASSERT_TRUE(fit.matrix_known);
  EXPECT_FALSE(fit.turns[2].inlier);
  EXPECT_TRUE(fit.turns[2].usable);
  EXPECT_FALSE(fit.turns[4].usable);
  EXPECT_TRUE(fit.turns[6].inlier) << "one bad row is bridged";
  EXPECT_EQ(fit.quality.verdict, Verdict::kFair);
  EXPECT_LT((fit.triad.matrix - s.gyroscope_matrix).norm() * 4800, 1e-2);
}

TEST(Gyroscope, BiasAlone) {
  Random random(34);
  test::PoseSequence s = device(0, random);
  const Stillness still = find_stillness(s.times_ns, s.gyroscope, Rows(0, 3));
  ASSERT_EQ(still.segments.size(), 1U);
  const GyroscopeFit fit = fit_gyroscope_bias(still.segments);
  EXPECT_TRUE(fit.bias_known);
  EXPECT_FALSE(fit.matrix_known);
  EXPECT_EQ(fit.quality.verdict, Verdict::kFair);
  EXPECT_LT((fit.triad.bias - s.gyroscope_bias).norm(), 10);
  EXPECT_NEAR(std::sqrt(fit.bias_cov(0, 0)), 29 / std::sqrt(300), 0.3);
  EXPECT_EQ(fit.triad.matrix, Eigen::Matrix3d::Identity());
  const GyroscopeFit same = fit_gyroscope(s.times_ns, s.gyroscope, still.segments, known_accelerometer(s));
  EXPECT_FALSE(same.matrix_known);
  EXPECT_EQ(same.triad.bias, fit.triad.bias);
  EXPECT_EQ(same.quality.reasons.size(), 2U);
  ASSERT_TRUE(same.triad.quality.has_value());
  EXPECT_EQ(same.triad.quality->method, "rest-bias");
  EXPECT_EQ(same.triad.quality->reasons, same.quality.reasons);
  EXPECT_EQ(same.triad.quality->samples, 1);
}

TEST(Gyroscope, DriftIsReported) {
  Random random(35);
  test::PoseSequence s = device(20, random);
  for (Eigen::Index i = 0; i < s.gyroscope.rows(); ++i)
    s.gyroscope(i, 2) += 0.01 * static_cast<double>(i);  // 1 a second
  const Stillness still = find_stillness(s.times_ns, s.gyroscope, s.accelerometer);
  const GyroscopeFit fit = fit_gyroscope(s.times_ns, s.gyroscope, still.segments, known_accelerometer(s));
  EXPECT_NEAR(fit.bias_slope.z(), 1, 0.1);
  EXPECT_NEAR(fit.bias_range.z(), 100, 15);
  EXPECT_NEAR(fit.bias_slope.x(), 0, 0.1);
  ASSERT_TRUE(fit.matrix_known);
  EXPECT_EQ(fit.quality.verdict, Verdict::kFair);
  EXPECT_LT((fit.triad.matrix - s.gyroscope_matrix).norm() * 4800, 1e-2);
}

// Turns about one axis leave the others' scale open.
TEST(Gyroscope, OneAxisIsNotEnough) {
  Random random(36);
  test::PoseSequence s = device(20, random);
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
  for (Eigen::Index i = 0; i < s.gyroscope.rows(); ++i) {
    const double phase = (static_cast<double>(i % 500) - 300) / 200;
    const double rate =
        phase <= 0 ? 0 : std::pow(std::sin(std::numbers::pi * phase), 2) * (1 + static_cast<double>(i / 500 % 3));
    s.gyroscope.row(i) = s.gyroscope_matrix.inverse() * (rate * axis) + s.gyroscope_bias + 29 * random.normal3();
    s.accelerometer.row(i) = s.accelerometer_matrix.inverse() * (q.conjugate() * Eigen::Vector3d(0, 0, 9.80665)) +
                             s.accelerometer_bias + 3.5 * random.normal3();
    q = so3::boxplus(q, 0.01 * rate * axis);
  }
  const Stillness still = find_stillness(s.times_ns, s.gyroscope, s.accelerometer);
  const GyroscopeFit fit = fit_gyroscope(s.times_ns, s.gyroscope, still.segments, known_accelerometer(s));
  EXPECT_FALSE(fit.matrix_known);
  EXPECT_TRUE(fit.bias_known);
}

TEST(Gyroscope, HostileInput) {
  EXPECT_EQ(fit_gyroscope_bias({}).quality.verdict, Verdict::kRefused);
  EXPECT_EQ(fit_gyroscope({}, Rows(0, 3), {}, {}).quality.verdict, Verdict::kRefused);
  EXPECT_EQ(fit_gyroscope_bias(std::vector<StillSegment>(3)).quality.verdict, Verdict::kRefused);
  Random random(37);
  const test::PoseSequence s = device(8, random);
  Stillness still = find_stillness(s.times_ns, s.gyroscope, s.accelerometer);
  EXPECT_FALSE(fit_gyroscope(s.times_ns, s.gyroscope, still.segments, AccelerometerFit{}).matrix_known);
  EXPECT_THROW(fit_gyroscope(s.times_ns, Rows(3, 3), still.segments, {}), std::invalid_argument);
  // No turn at all: the same mean everywhere.
  std::vector<StillSegment> same = still.segments;
  for (StillSegment& segment : same) segment.accelerometer.mean = same[0].accelerometer.mean;
  EXPECT_FALSE(fit_gyroscope(s.times_ns, s.gyroscope, same, known_accelerometer(s)).matrix_known);
  Rows huge = s.gyroscope;
  huge.middleRows(310, 150).setConstant(1e200);
  EXPECT_NO_THROW(fit_gyroscope(s.times_ns, huge, still.segments, known_accelerometer(s)));
  std::swap(still.segments[0], still.segments[1]);
  EXPECT_THROW(fit_gyroscope(s.times_ns, s.gyroscope, still.segments, known_accelerometer(s)), std::invalid_argument);
  GyroscopeOptions options;
  options.gap_periods = 0;
  EXPECT_THROW(fit_gyroscope({}, Rows(0, 3), {}, {}, options), std::invalid_argument);
}

TEST(GyroscopeReal, Xsens) {
  LOC_DATA_OR_SKIP(folder, "imu-tk-xsens");
  const test::XsensRecording r = test::read_xsens(folder);
  const Stillness still = find_stillness(r.times_ns, r.gyroscope, r.accelerometer);
  const AccelerometerFit accelerometer = fit_accelerometer(accelerometer_poses(still.segments));
  const GyroscopeFit fit = fit_gyroscope(r.times_ns, r.gyroscope, still.segments, accelerometer);
  ASSERT_TRUE(fit.matrix_known) << fit.quality.reasons.back();
  const Eigen::Vector3d counts = fit.triad.matrix.diagonal().cwiseInverse();
  std::printf(
      "%zu turns, %d used, rms %.2f deg, chi2 ratio %.1f, sigma %.3f %%; counts per rad/s %.1f %.1f %.1f, bias %.1f "
      "%.1f %.1f, rotation %.2f deg\n",
      fit.turns.size(), fit.inliers, fit.residual_rms * 180 / std::numbers::pi, fit.chi2_ratio,
      100 * fit.relative_sigma, counts.x(), counts.y(), counts.z(), fit.triad.bias.x(), fit.triad.bias.y(),
      fit.triad.bias.z(), fit.rotation_angle * 180 / std::numbers::pi);
  for (const auto& reason : fit.quality.reasons) std::printf("%s\n", reason.c_str());
  EXPECT_GE(fit.inliers, 34);
  EXPECT_LT(fit.residual_rms * 180 / std::numbers::pi, 0.35);
  EXPECT_LT(fit.relative_sigma, 2e-3);
  // An independent implementation of the paper's method, on the same recording, asserts 4600 to 4950 counts a rad/s.
  for (const double c : counts) EXPECT_NEAR(c, 4772, 24);
}

}  // namespace
}  // namespace loc
