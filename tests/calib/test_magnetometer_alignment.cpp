#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "libloc/calib/magnetometer_alignment.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/io/broad.hpp"
#include "support/data.hpp"
#include "support/numeric_jacobian.hpp"
#include "support/pose_sequence.hpp"

namespace loc {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
constexpr double kDegree = std::numbers::pi / 180;
const double kDip = std::atan2(40, 20);
const Rows kAbsent(0, 3);

struct Recording {
  test::PoseSequence body;
  Rows magnetometer;
};

/// @param to_magnetometer what makes the magnetometer's axes from the body's
Recording recording(std::uint64_t seed, const Eigen::Matrix3d& to_magnetometer, double noise = 3e-7) {
  Random random(seed);
  Recording r;
  r.body.rest_s = 1;
  r.body.sigma_gyroscope = 2e-3;
  r.body.sigma_accelerometer = 2e-2;
  r.body.gyroscope_bias = {0.01, -0.004, 0.006};
  r.body.run(12, random);
  r.magnetometer = r.body.magnetometer * to_magnetometer.transpose();
  for (Eigen::Index i = 0; i < r.magnetometer.rows(); ++i) r.magnetometer.row(i) += noise * random.normal3();
  return r;
}

MagnetometerAlignment align(const Recording& r, const MagnetometerAlignmentOptions& options = {}) {
  return align_magnetometer(r.body.times_ns, r.body.gyroscope, r.body.accelerometer, r.magnetometer, options);
}

/// Rotation vector by which the result is off, on the right.
Eigen::Vector3d error_of(const MagnetometerAlignment& a, const Eigen::Matrix3d& to_magnetometer) {
  return so3::log(Eigen::Quaterniond(Eigen::Matrix3d(to_magnetometer * a.matrix)).conjugate());
}

TEST(MagnetometerAlignment, JacobianIsTheDerivative) {
  Random random(1);
  for (int i = 0; i < 10; ++i) {
    FieldInterval k;
    k.q_begin_end = so3::exp(0.5 * random.normal3());
    k.d_bias = 0.25 * Eigen::Matrix3d::Random();
    k.begin = random.direction();
    k.end = random.direction();
    k.field = random.direction();
    k.up = random.direction();
    k.rate_begin = random.normal3();
    k.rate_end = random.normal3();
    k.has_gravity = true;
    const Eigen::Quaterniond start = random.rotation();
    AlignmentVector x;
    x << 0.2 * random.normal3(), 0.2 * random.normal3(), 0.5, 0.02;
    Eigen::Matrix<double, 4, 8> jacobian;
    alignment_residual(k, start, x, &jacobian);
    const auto f = [&](const AlignmentVector& at) { return alignment_residual(k, start, at, nullptr); };
    EXPECT_TRUE(test::near(jacobian, test::numeric_jacobian(f, x), 1e-8));
  }
}

TEST(MagnetometerAlignment, AnyRotationWithinItsSigma) {
  std::vector<double> nees;
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    Random random(seed + 1000);
    const Eigen::Matrix3d turn = random.rotation().toRotationMatrix();
    const MagnetometerAlignment a =
        align(recording(seed, turn), {.expected_dip = kDip, .gyroscope_matrix_sigma = 0, .field_sigma = 0});
    ASSERT_TRUE(a.solved);
    EXPECT_FALSE(a.mirrored) << seed;
    const Eigen::Vector3d e = error_of(a, turn);
    nees.push_back(e.dot(a.cov.ldlt().solve(e)));
    EXPECT_LT(e.norm(), 0.3 * kDegree) << seed;
    EXPECT_LT(a.sigma, 0.3 * kDegree);
    EXPECT_LT(std::abs(a.delay_s), 4 * a.delay_sigma_s);
    EXPECT_NEAR(a.dip, kDip, 0.2 * kDegree);
    EXPECT_LT(a.dip_scatter, 1 * kDegree);
    EXPECT_LT((a.gyroscope_bias - Eigen::Vector3d(0.01, -0.004, 0.006)).norm(), 3e-3);
  }
  std::printf("NEES %.2f of 3\n", mean(nees));
  // Neighbouring intervals share a reading, whose error cancels: the prediction is on the safe side.
  EXPECT_GT(mean(nees), 0.3);
  EXPECT_LT(mean(nees), 4.5);
}

TEST(MagnetometerAlignment, JacobianByTheErrorsOfTheCalibrations) {
  Random random(12);
  FieldInterval k;
  k.q_begin_end = so3::exp(0.5 * random.normal3());
  k.begin = random.direction();
  k.end = random.direction();
  k.field = random.direction();
  k.up = random.direction();
  k.rate_begin = random.normal3();
  k.rate_end = random.normal3();
  k.has_gravity = true;
  for (int column = 0; column < 9; ++column) k.d_matrix.col(column) = random.normal3();
  const Eigen::Quaterniond start = random.rotation();
  AlignmentVector x;
  x << 0.2 * random.normal3(), 0.2 * random.normal3(), 0.5, 0.02;
  using Errors = Eigen::Matrix<double, kCalibrationErrors, 1>;
  const auto f = [&](const Errors& e) {
    FieldInterval other = k;
    other.q_begin_end = k.q_begin_end * so3::exp(k.d_matrix * e.head<9>());
    Eigen::Matrix3d s;
    s << e[9], e[14], e[13], e[14], e[10], e[12], e[13], e[12], e[11];
    for (Eigen::Vector3d* m : {&other.begin, &other.end, &other.field}) *m = *m + s * *m + e.tail<3>();
    return alignment_residual(other, start, x, nullptr);
  };
  EXPECT_TRUE(
      test::near(alignment_error_jacobian(k, start, x), test::numeric_jacobian(f, Errors(Errors::Zero())), 1e-8));
}

/// Errors of the calibrations drawn as the options say: the told covariance holds, and the fit removes a part.
TEST(MagnetometerAlignment, ErrorsOfTheCalibrationsAreTold) {
  struct Case {
    double gyroscope;
    double field;
  };
  for (const Case& c : {Case{.gyroscope = 0.01, .field = 0.005}, Case{.gyroscope = 0.01, .field = 0.0},
                        Case{.gyroscope = 0.001, .field = 0.02}}) {
    std::vector<double> nees;
    std::vector<double> unaware;
    std::vector<double> errors;
    std::vector<double> sigmas;
    for (std::uint64_t seed = 1; seed <= 25; ++seed) {
      Random random(seed + 3000);
      const Eigen::Matrix3d turn = random.rotation().toRotationMatrix();
      Recording r = recording(seed, turn);
      Eigen::Matrix3d g;
      for (int k = 0; k < 3; ++k) g.col(k) = c.gyroscope * random.normal3();
      const Eigen::Vector3d diagonal = c.field * random.normal3();
      const Eigen::Vector3d off = c.field / std::numbers::sqrt2 * random.normal3();
      Eigen::Matrix3d s;
      s << diagonal.x(), off.z(), off.y(), off.z(), diagonal.y(), off.x(), off.y(), off.x(), diagonal.z();
      const Eigen::RowVector3d centre = c.field * r.body.field.norm() * random.normal3().transpose();
      r.body.gyroscope = (r.body.gyroscope * (Eigen::Matrix3d::Identity() + g).inverse().transpose()).eval();
      r.magnetometer = (r.magnetometer * (Eigen::Matrix3d::Identity() + s)).eval();
      r.magnetometer.rowwise() += centre;
      const auto run = [&](double gyroscope, double field) {
        return align(r, {.expected_dip = kDip, .gyroscope_matrix_sigma = gyroscope, .field_sigma = field});
      };
      const MagnetometerAlignment a = run(c.gyroscope, c.field);
      ASSERT_TRUE(a.solved);
      const Eigen::Vector3d e = error_of(a, turn);
      nees.push_back(e.dot(a.cov.ldlt().solve(e)) / 3);
      errors.push_back(e.norm());
      sigmas.push_back(a.sigma);
      unaware.push_back(error_of(run(0, 0), turn).norm());
    }
    std::printf("gyroscope %.3f field %.3f: NEES/3 %.2f, error %.3f deg, not estimated %.3f, sigma %.3f\n", c.gyroscope,
                c.field, mean(nees), quantile(errors, 0.5) / kDegree, quantile(unaware, 0.5) / kDegree,
                quantile(sigmas, 0.5) / kDegree);
    // On the safe side, as above.
    EXPECT_GT(mean(nees), 0.3);
    EXPECT_LT(mean(nees), 2);
    EXPECT_LT(quantile(errors, 0.5), quantile(unaware, 0.5));
  }
}

/// The device never rests; gravity alone is seen in few intervals only.
TEST(MagnetometerAlignment, FewReadingsOfGravityDoNotDecide) {
  int tried = 0;
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    Random random(seed + 500);
    const Eigen::Matrix3d turn = random.rotation().toRotationMatrix();
    Recording r = recording(seed, turn);
    const Rows force = r.body.accelerometer;
    // Three intervals in the first rest show gravity, with one common error of 1.5 degrees.
    const Eigen::Matrix3d wrong = so3::exp(1.5 * kDegree * random.direction()).toRotationMatrix();
    for (Eigen::Index i = 0; i < 76; ++i) r.body.accelerometer.row(i) = (wrong * force.row(i).transpose()).transpose();
    for (Eigen::Index i = 76; i < force.rows(); ++i) {
      r.body.accelerometer.row(i) *= 1 + 0.2 * static_cast<double>(i % 3 - 1);
    }
    const MagnetometerAlignment a = align(r, {.expected_dip = kDip});
    if (a.gravity_readings < 1 || a.gravity_readings > 9) continue;
    ++tried;
    ASSERT_TRUE(a.solved);
    const Eigen::Vector3d e = error_of(a, turn);
    EXPECT_LT(e.dot(a.cov.ldlt().solve(e)), 20) << seed;
    EXPECT_LT(e.norm(), 0.7 * kDegree) << seed;
    EXPECT_GT(a.dip_sigma, 0.5 * kDegree);
  }
  EXPECT_GE(tried, 5);
}

TEST(MagnetometerAlignment, ExchangedAxesAreNamed) {
  Eigen::Matrix3d exchange;
  exchange << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  const MagnetometerAlignment a = align(recording(2, exchange), {.expected_dip = kDip});
  EXPECT_TRUE(a.permuted);
  EXPECT_EQ(a.axes, "-y x z");
  EXPECT_EQ(a.quality.verdict, Verdict::kOk);  // a way of mounting, no defect
  EXPECT_LT(error_of(a, exchange).norm(), 0.3 * kDegree);
  const MagnetometerAlignment straight = align(recording(2, Eigen::Matrix3d::Identity()), {.expected_dip = kDip});
  EXPECT_FALSE(straight.permuted);
  EXPECT_EQ(straight.axes, "x y z");
  EXPECT_EQ(straight.quality.verdict, Verdict::kOk);
}

TEST(MagnetometerAlignment, MirroredIsToldByTheSignOfTheDip) {
  const Eigen::Matrix3d mirror = Eigen::Vector3d(1, 1, -1).asDiagonal();
  const Recording r = recording(3, mirror);
  const MagnetometerAlignment told = align(r, {.expected_dip = kDip});
  EXPECT_TRUE(told.mirror_checked);
  EXPECT_TRUE(told.mirrored);
  EXPECT_EQ(told.quality.verdict, Verdict::kWarn);
  EXPECT_LT((told.matrix - mirror).norm(), 0.01);
  EXPECT_NEAR(told.dip, kDip, 0.2 * kDegree);
  EXPECT_EQ(told.axes, "x y -z");
  // Without knowing the hemisphere it is a turn by 180 degrees in a reversed field, and says that it was not checked.
  const MagnetometerAlignment untold = align(r);
  EXPECT_FALSE(untold.mirror_checked);
  EXPECT_LT((untold.matrix + mirror).norm(), 0.01);
  EXPECT_NEAR(untold.dip, -kDip, 0.2 * kDegree);
  EXPECT_EQ(untold.quality.verdict, Verdict::kWarn);
  const auto says = [](const MagnetometerAlignment& a, const std::string& text) {
    return std::any_of(a.quality.reasons.begin(), a.quality.reasons.end(),
                       [&](const std::string& reason) { return reason.find(text) != std::string::npos; });
  };
  EXPECT_TRUE(says(untold, "southern hemisphere"));
  EXPECT_TRUE(says(untold, "expected_dip"));
  EXPECT_FALSE(says(untold, "corrects"));
  // Without gravity there is no dip at all: the half turn is what is left to see.
  const MagnetometerAlignment blind = align_magnetometer(r.body.times_ns, r.body.gyroscope, kAbsent, r.magnetometer);
  EXPECT_EQ(blind.quality.verdict, Verdict::kWarn);
  EXPECT_TRUE(says(blind, "mirrored"));
  EXPECT_EQ(align(recording(3, Eigen::Matrix3d::Identity())).quality.verdict, Verdict::kFair);
}

TEST(MagnetometerAlignment, ALateMagnetometer) {
  const Eigen::Matrix3d turn = so3::exp({0.3, 0.2, -0.4}).toRotationMatrix();
  Recording r = recording(8, turn);
  const Rows now = r.magnetometer;
  for (Eigen::Index i = 2; i < now.rows(); ++i) r.magnetometer.row(i) = now.row(i - 2);  // 20 ms
  const MagnetometerAlignment a = align(r);
  EXPECT_NEAR(a.delay_s, 0.02, 1e-3);
  EXPECT_LT(error_of(a, turn).norm(), 0.4 * kDegree);
}

TEST(MagnetometerAlignment, WithoutAccelerometer) {
  const Recording r = recording(4, Eigen::Matrix3d::Identity());
  const MagnetometerAlignment a =
      align_magnetometer(r.body.times_ns, r.body.gyroscope, kAbsent, r.magnetometer, {.expected_dip = kDip});
  ASSERT_TRUE(a.solved);
  EXPECT_LT(error_of(a, Eigen::Matrix3d::Identity()).norm(), 0.4 * kDegree);
  EXPECT_TRUE(std::isnan(a.dip));
  EXPECT_FALSE(a.mirror_checked);
  EXPECT_EQ(a.quality.verdict, Verdict::kFair);
}

TEST(MagnetometerAlignment, OneAxisIsRefused) {
  Random random(5);
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 1, 0.3)}) {
    Recording r = recording(5, Eigen::Matrix3d::Identity());
    Eigen::Quaterniond q = random.rotation();
    for (Eigen::Index i = 0; i < r.magnetometer.rows(); ++i) {
      const Eigen::Vector3d rate = axis.normalized() * std::sin(0.01 * static_cast<double>(i));
      q = so3::boxplus(q, 0.01 * rate);
      r.body.gyroscope.row(i) = rate + 2e-3 * random.normal3();
      r.body.accelerometer.row(i) = q.conjugate() * Eigen::Vector3d(0, 0, 9.81) + 0.02 * random.normal3();
      r.magnetometer.row(i) = q.conjugate() * r.body.field + 3e-7 * random.normal3();
    }
    const MagnetometerAlignment a = align(r);
    EXPECT_EQ(a.quality.verdict, Verdict::kRefused);
    EXPECT_LT(a.second_axis_share, 0.1);
  }
}

TEST(MagnetometerAlignment, SlowMagnetometerAndDisturbance) {
  Recording r = recording(6, so3::exp({0.3, 0.2, -0.4}).toRotationMatrix());
  for (Eigen::Index i = 0; i < r.magnetometer.rows(); ++i) {
    // Ten times slower: repeated in one half of the recording, NaN in the other.
    if (i % 10 != 0 && i < 1500) r.magnetometer.row(i) = r.magnetometer.row(i - i % 10);
    if (i % 10 != 0 && i >= 1500) r.magnetometer.row(i).setConstant(std::nan(""));
  }
  // A magnet for two seconds, which hardly changes the length.
  for (Eigen::Index i = 2000; i < 2200; i += 10) {
    r.magnetometer.row(i) += Eigen::Vector3d(4e-6, 8e-6, 0);
  }
  r.body.gyroscope(700, 0) = std::nan("");
  r.body.times_ns[800] = r.body.times_ns[790];
  const MagnetometerAlignment a = align(r);
  ASSERT_TRUE(a.solved);
  EXPECT_LT(error_of(a, so3::exp({0.3, 0.2, -0.4}).toRotationMatrix()).norm(), 1 * kDegree);
  EXPECT_GT(a.repeated, 1300);
  EXPECT_EQ(a.not_finite, 1);
}

TEST(MagnetometerAlignment, HostileInput) {
  EXPECT_EQ(align_magnetometer({}, kAbsent, kAbsent, kAbsent).quality.verdict, Verdict::kRefused);
  Recording r = recording(7, Eigen::Matrix3d::Identity());
  const auto verdict = [&] { return align(r).quality.verdict; };
  const Rows good = r.magnetometer;
  r.magnetometer.setConstant(std::nan(""));
  EXPECT_EQ(verdict(), Verdict::kRefused);
  r.magnetometer.setZero();
  EXPECT_EQ(verdict(), Verdict::kRefused);
  r.magnetometer.setConstant(3e-5);
  EXPECT_EQ(verdict(), Verdict::kRefused);
  r.magnetometer = good * 1e200;
  EXPECT_NO_THROW(verdict());
  r.magnetometer = good;
  r.body.gyroscope.setConstant(1e200);
  EXPECT_FALSE(align(r).quality.usable());
  r.body.gyroscope.setZero();
  EXPECT_FALSE(align(r).quality.usable());
  EXPECT_THROW(align_magnetometer(r.body.times_ns, kAbsent, kAbsent, good), std::invalid_argument);
  EXPECT_THROW(align_magnetometer(r.body.times_ns, r.body.gyroscope, kAbsent, kAbsent), std::invalid_argument);
  EXPECT_THROW(align(r, {.interval_s = 0}), std::invalid_argument);
  EXPECT_THROW(align(r, {.expected_dip = 2}), std::invalid_argument);
  EXPECT_THROW(align(r, {.gyroscope_matrix_sigma = -1}), std::invalid_argument);
  EXPECT_THROW(align(r, {.field_sigma = std::nan("")}), std::invalid_argument);
  EXPECT_THROW(aligned({}, {}), DataError);
}

TEST(MagnetometerAlignment, GoesIntoTheRig) {
  TriadCalibration triad;
  triad.bias = {1, 2, 3};
  triad.matrix = 2 * Eigen::Matrix3d::Identity();
  triad.quality.emplace().matrix_sigma = Eigen::Vector3d(1, 2, 3).asDiagonal();
  MagnetometerAlignment a;
  a.solved = true;
  a.matrix = so3::exp({0, 0, std::numbers::pi / 2}).toRotationMatrix();
  a.quality.lower_to(Verdict::kWarn, "because");
  EXPECT_EQ(aligned(triad, a).quality->verdict, Verdict::kWarn);
  EXPECT_NEAR(aligned(triad, a).quality->matrix_sigma(0, 1), 2, 1e-12);
  EXPECT_TRUE(test::near(aligned(triad, a).apply({2, 2, 3}), Eigen::Vector3d(0, 2, 0), 1e-12));
}

TEST(MagnetometerAlignment, TheRigsDeviationsHoldTheRotationsOwn) {
  TriadCalibration triad;
  triad.matrix << 1, 0.2, 0.1, 0.3, 0.9, -0.1, 0, 0.2, 1.1;
  triad.quality.emplace().matrix_sigma.setZero();
  MagnetometerAlignment a;
  a.solved = true;
  a.matrix = so3::exp({0.3, -1, 2}).toRotationMatrix();
  const Eigen::Vector3d sigma(0.01, 0.02, 0.03);
  a.cov = sigma.cwiseAbs2().asDiagonal();
  Eigen::Matrix3d variance = Eigen::Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const auto turned = [&](double angle) -> Eigen::Matrix3d {
      return a.matrix * so3::exp(angle * Eigen::Vector3d::Unit(k)).toRotationMatrix() * triad.matrix;
    };
    variance += ((turned(1e-6) - turned(-1e-6)) / 2e-6 * sigma(k)).cwiseAbs2();
  }
  EXPECT_TRUE(test::near(aligned(triad, a).quality->matrix_sigma, variance.cwiseSqrt().eval(), 1e-9));
}

// The magnetometer of BROAD's device, as it is and turned by a known rotation.
TEST(MagnetometerAlignmentReal, Broad) {
  LOC_DATA_OR_SKIP(folder, "broad");
  const Eigen::Matrix3d turn = so3::exp({1, -2, 0.5}).toRotationMatrix();
  for (const char* name : {"01_undisturbed_slow_rotation_A.mat", "07_undisturbed_fast_rotation_B.mat",
                           "21_undisturbed_fast_combined.mat"}) {
    const BroadTrial trial = read_broad_trial(folder / name);
    const Rows turned = trial.magnetic_field * turn.transpose();
    const auto run = [&](const Rows& field) {
      return align_magnetometer(trial.time_ns, trial.angular_velocity, trial.specific_force, field,
                                {.expected_dip = 1.15, .gyroscope_matrix_sigma = 0.001});
    };
    const MagnetometerAlignment as_is = run(trial.magnetic_field);
    const MagnetometerAlignment known = run(turned);
    const double difference =
        so3::log(Eigen::Quaterniond(Eigen::Matrix3d(known.matrix * turn * as_is.matrix.transpose()))).norm();
    std::printf(
        "%-36s %.2f deg from the IMU, sigma %.2f, rms %.2f deg, dip %.1f scatter %.1f, delay %.1f +- %.1f ms, %lld of "
        "%lld intervals, turned "
        "again %.4f deg, %s\n",
        name, as_is.angle / kDegree, as_is.sigma / kDegree, as_is.residual_rms / kDegree, as_is.dip / kDegree,
        as_is.dip_scatter / kDegree, 1e3 * as_is.delay_s, 1e3 * as_is.delay_sigma_s,
        static_cast<long long>(as_is.inliers), static_cast<long long>(as_is.intervals), difference / kDegree,
        verdict_name(as_is.quality.verdict));
    ASSERT_TRUE(as_is.solved);
    EXPECT_TRUE(as_is.quality.usable());
    EXPECT_FALSE(as_is.mirrored);
    EXPECT_LT(as_is.angle, 1.5 * kDegree);
    // One device: the same delay in every recording.
    EXPECT_NEAR(as_is.delay_s, 13.3e-3, 1e-3);
    EXPECT_LT(difference, 0.01 * kDegree);
  }
}

}  // namespace
}  // namespace loc
