#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <vector>

#include "libloc/calib/accelerometer.hpp"
#include "libloc/core/random.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/eval/consistency.hpp"
#include "support/data.hpp"
#include "support/numeric_jacobian.hpp"
#include "support/xsens.hpp"

namespace loc {
namespace {

constexpr double kGravity = 9.80665;
constexpr double kMilliG = kGravity * 1e-3;

struct Truth {
  Eigen::Vector3d bias{33000, 32500, 33300};
  Eigen::Matrix3d matrix;
  Truth() { matrix << 2.40e-3, 1e-5, -2e-5, 1e-5, 2.45e-3, 1.5e-5, -2e-5, 1.5e-5, 2.37e-3; }

  std::vector<StillPose> poses(Random& random, int count, double sigma) const {
    std::vector<StillPose> out;
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d force = kGravity * random.direction() + sigma * random.normal3();
      out.push_back({.mean = bias + matrix.lu().solve(force)});
    }
    return out;
  }
  Vector9d parameters() const {
    Vector9d p;
    p << bias, matrix(0, 0), matrix(1, 1), matrix(2, 2), matrix(0, 1), matrix(0, 2), matrix(1, 2);
    return p;
  }
};

Vector9d parameters(const TriadCalibration& triad) {
  Truth t;
  t.bias = triad.bias;
  t.matrix = triad.matrix;
  return t.parameters();
}

TEST(Accelerometer, JacobianIsTheDerivative) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    Vector9d p;
    p << 0.3 * random.normal3(), Eigen::Vector3d::Ones() + 0.1 * random.normal3(), 0.1 * random.normal3();
    const Eigen::Vector3d y = random.direction();
    Eigen::Matrix<double, 1, 9> jacobian;
    gravity_residual(p, y, &jacobian);
    const auto f = [&](const Vector9d& x) { return Eigen::Matrix<double, 1, 1>(gravity_residual(x, y, nullptr)); };
    EXPECT_TRUE(test::near(jacobian, test::numeric_jacobian(f, p), 1e-8));
  }
}

TEST(Accelerometer, ExactPosesGiveTheTruthEightRadiiOff) {
  Random random(2);
  const Truth truth;
  const AccelerometerFit fit = fit_accelerometer(truth.poses(random, 30, 0));
  ASSERT_TRUE(fit.solved);
  EXPECT_TRUE(fit.converged);
  EXPECT_EQ(fit.quality.verdict, Verdict::kOk);
  EXPECT_LT((fit.triad.bias - truth.bias).norm(), 1e-3);
  EXPECT_LT((fit.triad.matrix - truth.matrix).norm(), 1e-9);
  EXPECT_LT(fit.residual_rms, 1e-6);
  EXPECT_EQ(fit.inliers, 30);
  ASSERT_TRUE(fit.triad.quality.has_value());
  EXPECT_EQ(fit.triad.quality->method, "still-poses");
  EXPECT_EQ(fit.triad.quality->samples, 30);
}

// Only the symmetric part is observable: a rotated sensor gives the symmetric factor of its matrix.
TEST(Accelerometer, ARotationIsNotSeen) {
  Random random(3);
  Truth turned;
  const Eigen::Matrix3d rotation = so3::exp({0.1, -0.2, 0.3}).toRotationMatrix();
  const Eigen::Matrix3d symmetric = turned.matrix;
  turned.matrix = rotation * turned.matrix;
  const AccelerometerFit fit = fit_accelerometer(turned.poses(random, 30, 0));
  ASSERT_TRUE(fit.solved);
  EXPECT_LT((fit.triad.matrix - symmetric).norm(), 1e-9);
}

TEST(Accelerometer, CovarianceIsThatOfTheErrors) {
  Random random(4);
  const Truth truth;
  std::vector<double> nees;
  int covered = 0;
  constexpr int kRuns = 100;
  for (int run = 0; run < kRuns; ++run) {
    const AccelerometerFit fit = fit_accelerometer(truth.poses(random, 60, 0.3 * kMilliG));
    ASSERT_TRUE(fit.solved);
    const Vector9d e = parameters(fit.triad) - truth.parameters();
    nees.push_back(e.dot(fit.cov.ldlt().solve(e)));
    covered += std::abs(fit.pose_sigma / (0.3 * kMilliG) - 1) < 0.4 ? 1 : 0;
  }
  // The noise is estimated with 51 degrees of freedom: NEES is 9 F(9, 51), of mean 9 * 51 / 49.
  EXPECT_NEAR(mean(nees), 9 * 51.0 / 49, 5 * std::sqrt(18.0 / kRuns) * 1.2);
  EXPECT_GE(covered, kRuns * 95 / 100);
}

TEST(Accelerometer, TheSamplesNoiseWeighs) {
  Random random(5);
  const Truth truth;
  double weighted = 0;
  double plain = 0;
  for (int run = 0; run < 20; ++run) {
    std::vector<StillPose> poses = truth.poses(random, 15, 0.1 * kMilliG);
    for (int i = 0; i < 15; ++i) {
      const double counts = 4;  // about 1 mg
      StillPose pose = truth.poses(random, 1, 0)[0];
      pose.mean += counts * random.normal3();
      pose.mean_cov = counts * counts * Eigen::Matrix3d::Identity();
      poses.push_back(pose);
    }
    const auto error = [&](const AccelerometerFit& fit) { return (fit.triad.bias - truth.bias).squaredNorm(); };
    weighted += error(fit_accelerometer(poses));
    for (StillPose& pose : poses) pose.mean_cov.setZero();
    plain += error(fit_accelerometer(poses));
  }
  EXPECT_LT(weighted, 0.3 * plain);
}

TEST(Accelerometer, BadPosesAreLeftOut) {
  const Truth truth;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    Random random(seed);
    std::vector<StillPose> poses = truth.poses(random, 25, 0.1 * kMilliG);
    poses[3].mean += 20 * random.direction();  // 5 % of gravity
    poses[17].mean *= 1.01;
    poses[9].mean.setConstant(std::nan(""));
    const AccelerometerFit fit = fit_accelerometer(poses);
    ASSERT_TRUE(fit.solved);
    EXPECT_FALSE(fit.poses[17].inlier) << seed;
    EXPECT_FALSE(fit.poses[9].finite);
    EXPECT_EQ(fit.quality.verdict, Verdict::kFair) << seed;
    // A push across gravity hardly changes its length and does no harm.
    if (std::abs(fit.poses[3].residual) > 3 * kMilliG) {
      EXPECT_FALSE(fit.poses[3].inlier) << seed;
    }
    EXPECT_LT((fit.triad.bias - truth.bias).norm() * 2.4e-3, 0.4 * kMilliG) << seed;
  }
}

TEST(Accelerometer, VerdictFollowsTheNumberOfDistinctPoses) {
  const Truth truth;
  Random random(7);
  std::vector<StillPose> poses;
  // Directions well apart: the first points of a spiral.
  const auto spiral = [&](int count) {
    std::vector<StillPose> out;
    for (int i = 0; i < count; ++i) {
      const double z = 1 - (2 * i + 1.0) / count;
      const double a = 2.399963 * i;
      const double r = std::sqrt(1 - z * z);
      const Eigen::Vector3d force =
          kGravity * Eigen::Vector3d(r * std::cos(a), r * std::sin(a), z) + 1e-4 * random.normal3();
      out.push_back({.mean = truth.bias + truth.matrix.lu().solve(force)});
    }
    return out;
  };
  EXPECT_EQ(fit_accelerometer(spiral(8)).quality.verdict, Verdict::kRefused);
  EXPECT_FALSE(fit_accelerometer(spiral(8)).solved);
  EXPECT_EQ(fit_accelerometer(spiral(9)).quality.verdict, Verdict::kWarn);
  EXPECT_EQ(fit_accelerometer(spiral(13)).quality.verdict, Verdict::kFair);
  EXPECT_EQ(fit_accelerometer(spiral(20)).quality.verdict, Verdict::kOk);
  // Eight directions, each three times, are eight.
  poses = spiral(8);
  for (int i = 0; i < 16; ++i) {
    poses.push_back(poses[static_cast<std::size_t>(i % 8)]);
    poses.back().mean += random.normal3();
  }
  const AccelerometerFit repeated = fit_accelerometer(poses);
  EXPECT_EQ(repeated.quality.verdict, Verdict::kRefused);
  if (repeated.solved) {
    EXPECT_EQ(repeated.distinct_poses, 8);
  }
}

TEST(Accelerometer, PredictsItsErrorOnNewPoses) {
  const Truth truth;
  for (const int count : {11, 15, 16, 25}) {
    Random random(8);
    double actual = 0;
    double predicted = 0;
    constexpr int kRuns = 60;
    int within = 0;
    for (int run = 0; run < kRuns; ++run) {
      const AccelerometerFit fit = fit_accelerometer(truth.poses(random, count, 0.1 * kMilliG));
      if (!fit.solved) continue;
      double sum = 0;
      for (int i = 0; i < 100; ++i) {
        const Eigen::Vector3d force = kGravity * random.direction();
        sum += (fit.triad.apply(truth.bias + truth.matrix.lu().solve(force)) - force).squaredNorm() / 100;
      }
      actual += sum;
      predicted += fit.predicted_error * fit.predicted_error;
      within += std::sqrt(sum) / kGravity < 2 * fit.predicted_error ? 1 : 0;
    }
    EXPECT_GE(within, kRuns * 9 / 10) << count << " poses";
  }
}

TEST(Accelerometer, HostileInput) {
  EXPECT_EQ(fit_accelerometer({}).quality.verdict, Verdict::kRefused);
  const std::vector<StillPose> same(20, {.mean = {1, 2, 3}});
  EXPECT_EQ(fit_accelerometer(same).quality.verdict, Verdict::kRefused);
  EXPECT_FALSE(fit_accelerometer(same).solved);
  EXPECT_EQ(fit_accelerometer(std::vector<StillPose>(20)).quality.verdict, Verdict::kRefused);  // all NaN
  std::vector<StillPose> plane;
  std::vector<StillPose> huge;
  Random random(9);
  for (int i = 0; i < 20; ++i) {
    plane.push_back({.mean = {std::cos(i), std::sin(i), 5}});
    huge.push_back({.mean = 1e300 * random.direction()});
  }
  EXPECT_EQ(fit_accelerometer(plane).quality.verdict, Verdict::kRefused);
  const AccelerometerFit far = fit_accelerometer(huge);
  EXPECT_TRUE(!far.solved || (far.triad.matrix * 1e300).allFinite());
  // Not on an ellipsoid at all.
  std::vector<StillPose> cloud;
  for (int i = 0; i < 30; ++i) cloud.push_back({.mean = random.normal3()});
  EXPECT_FALSE(fit_accelerometer(cloud).quality.usable());
  AccelerometerOptions options;
  options.gravity = 0;
  EXPECT_THROW(fit_accelerometer(same, options), std::invalid_argument);
  options = {};
  options.least_poses = 6;
  EXPECT_THROW(fit_accelerometer(same, options), std::invalid_argument);
  EXPECT_THROW(accelerometer_poses(std::vector<StillSegment>(1)), std::invalid_argument);
}

TEST(AccelerometerReal, XsensRawCounts) {
  LOC_DATA_OR_SKIP(folder, "imu-tk-xsens");
  const test::XsensRecording r = test::read_xsens(folder);
  const Stillness s = find_stillness(r.times_ns, r.gyroscope, r.accelerometer);
  const AccelerometerFit fit = fit_accelerometer(accelerometer_poses(s.segments));
  ASSERT_TRUE(fit.solved);
  std::printf(
      "%zu poses, %d used, %d distinct: fit %.3f mg, leave one out %.3f mg, pose sigma %.3f mg, predicted %.3f mg\n",
      fit.poses.size(), fit.inliers, fit.distinct_poses, fit.residual_rms / kMilliG, fit.leave_one_out_rms / kMilliG,
      fit.pose_sigma / kMilliG, fit.predicted_error * 1e3);
  const Eigen::Vector3d counts = fit.triad.matrix.diagonal().cwiseInverse();
  std::printf("counts per m/s^2 %.2f %.2f %.2f, bias %.1f %.1f %.1f\n", counts.x(), counts.y(), counts.z(),
              fit.triad.bias.x(), fit.triad.bias.y(), fit.triad.bias.z());
  for (const auto& reason : fit.quality.reasons) std::printf("%s\n", reason.c_str());
  EXPECT_LE(fit.residual_rms, 0.11 * kMilliG);
  EXPECT_LE(fit.leave_one_out_rms, 0.16 * kMilliG);
}

}  // namespace
}  // namespace loc
