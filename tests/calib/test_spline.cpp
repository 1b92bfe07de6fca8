// Uniform B-splines of vectors, rotations and poses: weights, derivatives, Jacobians, fits.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "libloc/calib/band_system.hpp"
#include "libloc/calib/euler_trajectory.hpp"
#include "libloc/calib/spline.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "libloc/geometry/so3.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/sources.hpp"

namespace loc {
namespace {

using Eigen::Vector3d;
using test::expect_data_error;
using test::near;
using test::numeric_jacobian;

constexpr double kDegree = std::numbers::pi / 180;

// Cox and de Boor's recursion over uniform knots: another way to the same weights.
double basis(int order, double x) {
  if (order == 1) return x >= 0 && x < 1 ? 1 : 0;
  return (x * basis(order - 1, x) + (order - x) * basis(order - 1, x - 1)) / (order - 1);
}

class SplineOrder : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(All, SplineOrder, testing::Range(kMinSplineOrder, kMaxSplineOrder + 1));

TEST_P(SplineOrder, WeightsAreThoseOfTheRecursion) {
  const int k = GetParam();
  constexpr double kSpacing = 0.02;
  for (const double u : {0.0, 0.1, 0.5, 0.77, 0.999}) {
    const SplineWeights w = weights_at(k, kSpacing, u);
    const SplineWeights cumulative = cumulative_weights_at(k, kSpacing, u);
    double value_from_here = 0;
    double first_from_here = 0;
    double second_from_here = 0;
    for (int j = k - 1; j >= 0; --j) {
      const auto at = static_cast<std::size_t>(j);
      EXPECT_NEAR(w.value[at], basis(k, u + k - 1 - j), 1e-14);
      const double step = 1e-6;
      const auto weight = [&](double v) { return weights_at(k, kSpacing, v); };
      EXPECT_NEAR(w.first[at], (weight(u + step).value[at] - weight(u - step).value[at]) / (2 * step * kSpacing), 1e-6);
      EXPECT_NEAR(w.second[at], (weight(u + step).first[at] - weight(u - step).first[at]) / (2 * step * kSpacing),
                  1e-4);
      value_from_here += w.value[at];
      first_from_here += w.first[at];
      second_from_here += w.second[at];
      EXPECT_NEAR(cumulative.value[at], value_from_here, 1e-14);
      EXPECT_NEAR(cumulative.first[at], first_from_here, 1e-11);
      EXPECT_NEAR(cumulative.second[at], second_from_here, 1e-8);
    }
    EXPECT_EQ(cumulative.value[0], 1);
    EXPECT_EQ(cumulative.first[0], 0);
  }
}

TEST_P(SplineOrder, PolynomialsAreReproduced) {
  const int k = GetParam();
  std::vector<double> times;
  Eigen::MatrixXd values(2, 200);
  const auto polynomial = [&](double t, int derivative) {
    double out = 0;  // of degree k - 1, around 1 s
    for (int n = derivative; n < k; ++n) {
      double factor = n % 2 == 0 ? 1 : -0.7;
      for (int i = 0; i < derivative; ++i) factor *= n - i;
      out += factor * std::pow(t - 1, n - derivative);
    }
    return out;
  };
  for (int i = 0; i < 200; ++i) {
    times.push_back(0.01 * i);
    values.col(i) << polynomial(times.back(), 0), 3;
  }
  const auto fit = fit_vector_spline(times, values, {.order = k, .spacing_s = 0.1, .smoothing = 1e-13});
  EXPECT_LT(fit.rms, 1e-9);
  for (const double t : {0.0, 0.333, 1.0, 1.99}) {
    EXPECT_NEAR(fit.spline.value(t)[0], polynomial(t, 0), 1e-8);
    EXPECT_NEAR(fit.spline.value(t, 1)[0], polynomial(t, 1), 1e-5);
    EXPECT_NEAR(fit.spline.value(t, 2)[0], polynomial(t, 2), 1e-3);
    EXPECT_NEAR(fit.spline.value(t)[1], 3, 1e-9);
  }
  EXPECT_NEAR(fit.spline.value(2.05)[0], polynomial(2.05, 0), 1e-6);  // extrapolated
}

std::vector<Eigen::Quaterniond> random_walk(const SplineGrid& grid, double step) {
  Random random(static_cast<std::uint64_t>(grid.order));
  std::vector<Eigen::Quaterniond> out{random.rotation()};
  while (out.size() < static_cast<std::size_t>(grid.control_points())) {
    out.push_back(so3::boxplus(out.back(), step * random.normal3()));
  }
  return out;
}

TEST_P(SplineOrder, AngularVelocityAndAccelerationAreDerivatives) {
  const SplineGrid grid{5, 0.1, 4, GetParam()};
  const RotationSpline spline(grid, random_walk(grid, 0.3));
  for (const double t : {5.03, 5.25, 5.399, 5.41, 4.98}) {  // the last two outside
    const double h = 1e-5;
    const auto rotation = [&](double at) { return spline.at(at).rotation; };
    const RotationState state = spline.at(t);
    const Vector3d velocity =
        (so3::boxminus(rotation(t + h), state.rotation) - so3::boxminus(rotation(t - h), state.rotation)) / (2 * h);
    const Vector3d acceleration = (spline.at(t + h).angular_velocity - spline.at(t - h).angular_velocity) / (2 * h);
    EXPECT_TRUE(near(state.angular_velocity, velocity, 1e-6)) << t;
    // Of order 3 the velocity has a bend at each knot; no time here is one.
    EXPECT_TRUE(near(state.angular_acceleration, acceleration, 1e-4)) << t;
  }
}

// A curve of order k has k - 2 continuous derivatives.
TEST_P(SplineOrder, SegmentsMeet) {
  const SplineGrid grid{0, 0.1, 3, GetParam()};
  const RotationSpline spline(grid, random_walk(grid, 0.3));
  const RotationState before = spline.at(0.2 - 1e-9);
  const RotationState after = spline.at(0.2 + 1e-9);
  EXPECT_LT(so3::angle_between(before.rotation, after.rotation), 1e-7);
  EXPECT_TRUE(near(before.angular_velocity, after.angular_velocity, 1e-5));
  const double bend = (before.angular_acceleration - after.angular_acceleration).norm();
  if (GetParam() > 3) {
    EXPECT_LT(bend, 1e-4);
  } else {
    EXPECT_GT(bend, 1);
  }
}

TEST_P(SplineOrder, JacobiansOfRotations) {
  const SplineGrid grid{0, 0.1, 2, GetParam()};
  const RotationSpline spline(grid, random_walk(grid, 0.4));
  for (const double t : {0.0, 0.037, 0.15, 0.1999, 0.23}) {
    RotationJacobians by;
    spline.at(t, &by);
    EXPECT_EQ(by.first, t < 0.1 ? 0 : 1);
    for (int j = 0; j < grid.order; ++j) {
      const auto changed = [&](const Eigen::Quaterniond& q) {
        RotationSpline other = spline;
        other.control_points()[static_cast<std::size_t>(by.first + j)] = q;
        return other.at(t);
      };
      const auto at = static_cast<std::size_t>(j);
      const Eigen::Quaterniond& q = spline.control_points()[static_cast<std::size_t>(by.first + j)];
      const auto rotation = [&](const Eigen::Quaterniond& x) { return changed(x).rotation; };
      const auto velocity = [&](const Eigen::Quaterniond& x) { return changed(x).angular_velocity; };
      const auto acceleration = [&](const Eigen::Quaterniond& x) { return changed(x).angular_acceleration; };
      EXPECT_TRUE(near(by.rotation[at], numeric_jacobian(rotation, q), 1e-8)) << t << " " << j;
      EXPECT_TRUE(near(by.angular_velocity[at], numeric_jacobian(velocity, q), 1e-7)) << t << " " << j;
      EXPECT_TRUE(near(by.angular_acceleration[at], numeric_jacobian(acceleration, q), 1e-5)) << t << " " << j;
    }
  }
}

TEST(RotationSpline, EvenTurningIsExact) {
  const SplineGrid grid{0, 0.1, 10, 6};
  const Vector3d turn(0.1, -0.3, 0.2);
  std::vector<Eigen::Quaterniond> points;
  for (int i = 0; i < grid.control_points(); ++i) points.push_back(so3::exp(i * turn));
  const RotationState state = RotationSpline(grid, points).at(0.456);
  EXPECT_TRUE(near(state.angular_velocity, turn / 0.1, 1e-12));
  EXPECT_TRUE(near(state.angular_acceleration, Vector3d::Zero(), 1e-10));
  EXPECT_TRUE(near(so3::log(state.rotation), Vector3d((0.456 - abscissa_of(grid, 0)) / 0.1 * turn), 1e-12));
}

// Turning the world turns the rotations and leaves what the gyroscope sees.
TEST(RotationSpline, GaugeOfTheWorld) {
  const SplineGrid grid{0, 0.1, 3, 5};
  const auto points = random_walk(grid, 0.3);
  const Eigen::Quaterniond turn = Random(4).rotation();
  auto turned = points;
  for (Eigen::Quaterniond& q : turned) q = turn * q;
  const RotationState a = RotationSpline(grid, points).at(0.17);
  const RotationState b = RotationSpline(grid, turned).at(0.17);
  EXPECT_LT(so3::angle_between(turn * a.rotation, b.rotation), 1e-14);
  EXPECT_TRUE(near(a.angular_velocity, b.angular_velocity, 1e-12));
  EXPECT_TRUE(near(a.angular_acceleration, b.angular_acceleration, 1e-10));
}

// ---- fits

Pose3 waved(double t) {
  const Vector3d angles(0.5 * std::sin(1.9 * t), 0.4 * std::sin(2.3 * t + 1), 0.6 * std::sin(1.3 * t + 2));
  const Eigen::Quaterniond mounting = so3::exp(Vector3d(0.3, 1.5, -0.2));  // near 90 degrees of pitch
  return {mounting * rotation_from_angles(angles),
          Vector3d(0.3 * std::sin(2.1 * t), 0.2 * std::cos(1.7 * t), 0.1 * std::sin(3.1 * t))};
}

struct Samples {
  std::vector<double> times;
  std::vector<Pose3> poses;
};
Samples samples_of(const std::function<Pose3(double)>& motion, double seconds = 6, double rate = 100) {
  Samples out;
  for (int i = 0; i < seconds * rate; ++i) {
    out.times.push_back(i / rate);
    out.poses.push_back(motion(i / rate));
  }
  return out;
}

TEST(SplineFit, ErrorFallsWithTheOrderOfTheSpline) {
  const Samples samples = samples_of(waved);
  for (const int order : {4, 6}) {
    const auto at = [&](double spacing) {
      return fit_pose_spline(samples.times, samples.poses, {.order = order, .spacing_s = spacing, .smoothing = 1e-13});
    };
    const PoseSplineFit coarse = at(0.2);
    const PoseSplineFit fine = at(0.1);
    EXPECT_TRUE(fine.converged);
    EXPECT_LT(fine.rms_rotation, 1e-4);
    EXPECT_GT(coarse.rms_position / fine.rms_position, 0.6 * std::pow(2, order));
    // Rotations do not commute: with the fourth power of the spacing at most.
    EXPECT_GT(coarse.rms_rotation / fine.rms_rotation, 0.6 * std::pow(2, 4));
    // Between the samples too, and in the derivatives.
    const double t = 3.1234;
    const double h = 1e-4;
    const PoseState state = fine.spline.at(t);
    const Vector3d velocity = (waved(t + h).translation - waved(t - h).translation) / (2 * h);
    const Vector3d acceleration =
        (waved(t + h).translation - 2 * waved(t).translation + waved(t - h).translation) / (h * h);
    const Vector3d rate = so3::boxminus(waved(t + h).rotation, waved(t - h).rotation) / (2 * h);
    EXPECT_TRUE(near(state.velocity, velocity, 2e-3));
    EXPECT_TRUE(near(state.acceleration, acceleration, 0.1));
    EXPECT_TRUE(near(state.angular_velocity, rate, 5e-3));
  }
}

TEST(SplineFit, AGapIsBridgedSmoothly) {
  Samples samples = samples_of(waved, 6, 50);
  Samples with_gap;
  for (std::size_t i = 0; i < samples.times.size(); ++i) {
    if (samples.times[i] > 2 && samples.times[i] < 2.3) continue;
    with_gap.times.push_back(samples.times[i]);
    with_gap.poses.push_back(samples.poses[i]);
  }
  const PoseSplineFit fit = fit_pose_spline(with_gap.times, with_gap.poses, {.spacing_s = 0.05});
  EXPECT_TRUE(fit.converged);
  EXPECT_LT(so3::angle_between(fit.spline.at(2.15).pose.rotation, waved(2.15).rotation), 0.05);
  EXPECT_LT((fit.spline.at(2.15).pose.translation - waved(2.15).translation).norm(), 0.02);
}

TEST(SplineFit, OneSampleAndFewSamplesAreFine) {
  const Samples samples = samples_of(waved, 0.03);
  ASSERT_EQ(samples.times.size(), 3U);
  for (const std::size_t count : {1U, 2U, 3U}) {
    const auto fit = fit_pose_spline(std::span(samples.times).first(count), std::span(samples.poses).first(count));
    EXPECT_LT(fit.rms_rotation, 1e-4);
    EXPECT_LT(fit.rms_position, 1e-4);
  }
}

// A fit over 10^6 s would ask for gigabytes.
TEST(SplineFit, AStampFarTooLateIsNamed) {
  Samples samples = samples_of(waved, 1);
  samples.times[60] += 0.005;  // a small gap
  const Eigen::MatrixXd values = Eigen::MatrixXd::Zero(2, 100);
  for (std::size_t i = 98; i < 100; ++i) samples.times[i] += 1e6;
  const std::vector<std::string> parts{"times_s[98] = 1000000.98", "1e+06 s after",           "from 0 s",
                                       "spacing of 0.1 s",         "10000013 control points", "100 samples"};
  expect_data_error([&] { fit_vector_spline(samples.times, values); }, parts);
  expect_data_error([&] { fit_pose_spline(samples.times, samples.poses); }, parts);
  expect_data_error([&] { fit_euler_trajectory(samples.times, samples.poses); }, parts);
  samples.times[0] = -1.7e308;
  samples.times[99] = 1.7e308;
  expect_data_error([&] { fit_vector_spline(samples.times, values); }, {"inf control points"});
}

TEST(SplineFit, ManySamplesMayTakeLong) {
  std::vector<double> times;
  for (int i = 0; i < 5100; ++i) times.push_back(2.0 * i);
  const Eigen::MatrixXd values = Eigen::MatrixXd::Ones(1, 5100);
  EXPECT_LT(fit_vector_spline(times, values).rms, 1e-6);  // 101,983 control points
}

TEST(SplineFit, BadInputIsNamed) {
  const Samples good = samples_of(waved, 1);
  const auto refused = [&](const auto& change, const std::vector<std::string>& parts) {
    Samples bad = good;
    change(bad);
    expect_data_error([&] { fit_pose_spline(bad.times, bad.poses); }, parts);
    expect_data_error([&] { fit_euler_trajectory(bad.times, bad.poses); }, parts);
  };
  refused(
      [](Samples& s) {
        s.times.clear();
        s.poses.clear();
      },
      {"no samples"});
  refused([](Samples& s) { s.poses.pop_back(); }, {"100 times but 99 values"});
  refused([](Samples& s) { s.times[7] = s.times[6]; }, {"times_s[7]", "not after"});
  refused([](Samples& s) { s.times[3] = std::nan(""); }, {"times_s[3]", "not finite"});
  refused([](Samples& s) { s.poses[5].translation.z() = std::nan(""); }, {"poses[5]"});
  refused([](Samples& s) { s.poses[5].rotation.coeffs() *= 1.1; }, {"poses[5]", "norm 1"});
  refused(
      [](Samples& s) {
        s.poses[9].rotation = s.poses[9].rotation * so3::exp({2.5, 0, 0});
      },
      {"poses[9]", "turned"});
  const Samples spinning = samples_of([](double t) { return Pose3{so3::exp({0, 0, 20 * t}), Vector3d::Zero()}; }, 2);
  expect_data_error([&] { fit_pose_spline(spinning.times, spinning.poses, {.spacing_s = 0.2}); },
                    {"within a knot spacing"});
  EXPECT_THROW(fit_pose_spline(good.times, good.poses, {.order = 2}), std::invalid_argument);
  EXPECT_THROW(fit_pose_spline(good.times, good.poses, {.spacing_s = 0}), std::invalid_argument);
  EXPECT_THROW(VectorSpline({0, 0.1, 3, 4}, Eigen::MatrixXd::Zero(3, 5)), std::invalid_argument);
  EXPECT_THROW(RotationSpline({0, 0.1, 1, 4}, std::vector<Eigen::Quaterniond>(4, {1, 1, 0, 0})), std::invalid_argument);
}

TEST(BandSystem, SolvesAsADenseOne) {
  Random random(3);
  const Eigen::Index n = 12;
  const Eigen::Index w = 3;
  calib::BandSystem system(n, w);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = std::max<Eigen::Index>(0, i - w); j <= i; ++j) {
      A(i, j) = A(j, i) = i == j ? 8 : random.normal();
      system.at(i, j) = A(i, j);
    }
  }
  Eigen::MatrixXd b = Eigen::MatrixXd::NullaryExpr(n, 2, [&] { return random.normal(); });
  const Eigen::MatrixXd expected = A.ldlt().solve(b);
  system.solve(b);
  EXPECT_TRUE(near(b, expected, 1e-13));
  calib::BandSystem empty(3, 1);
  EXPECT_THROW(empty.solve(b.topRows(3)), DataError);
}

// ---- three angles

TEST(EulerTrajectory, AnglesAndTheirRates) {
  Random random(7);
  for (int i = 0; i < 20; ++i) {
    const Vector3d phi = 0.7 * random.normal3();
    if (std::abs(phi.y()) > 1.5) continue;
    EXPECT_TRUE(near(rotation_from_angles(angles_of(rotation_from_angles(phi))).toRotationMatrix(),
                     rotation_from_angles(phi).toRotationMatrix(), 1e-14));
    const auto rotation = [](const Vector3d& x) { return rotation_from_angles(x); };
    EXPECT_TRUE(near(angle_rate_matrix(phi), numeric_jacobian(rotation, phi), 1e-9));
    const Vector3d v = random.normal3();
    const auto rate = [&](const Vector3d& x) { return Vector3d(angle_rate_matrix(x) * v); };
    EXPECT_TRUE(near(angle_rate_matrix_derivative(phi, v), numeric_jacobian(rate, phi), 1e-9));
  }
  // At the pole the rotation is still the same one.
  const Eigen::Quaterniond up = rotation_from_angles({0.3, std::numbers::pi / 2, 0.8});
  EXPECT_LT(so3::angle_between(rotation_from_angles(angles_of(up)), up), 1e-7);
}

TEST(EulerTrajectory, DerivativesAndJacobians) {
  Random random(8);
  const SplineGrid grid{0, 0.1, 2, 5};
  const Eigen::MatrixXd points =
      Eigen::MatrixXd::NullaryExpr(6, grid.control_points(), [&] { return 0.3 * random.normal(); });
  const EulerTrajectory trajectory(random.rotation(), grid, points);
  const double t = 0.137;
  const double h = 1e-5;
  const PoseState state = trajectory.at(t);
  const PoseState before = trajectory.at(t - h);
  const PoseState after = trajectory.at(t + h);
  EXPECT_TRUE(near(state.velocity, Vector3d((after.pose.translation - before.pose.translation) / (2 * h)), 1e-7));
  EXPECT_TRUE(near(state.acceleration, Vector3d((after.velocity - before.velocity) / (2 * h)), 1e-5));
  EXPECT_TRUE(
      near(state.angular_velocity, Vector3d(so3::boxminus(after.pose.rotation, before.pose.rotation) / (2 * h)), 1e-6));
  EXPECT_TRUE(
      near(state.angular_acceleration, Vector3d((after.angular_velocity - before.angular_velocity) / (2 * h)), 1e-4));
  RotationJacobians by;
  trajectory.rotation_at(t, &by);
  ASSERT_EQ(by.first, 1);
  for (int j = 0; j < grid.order; ++j) {
    const auto changed = [&](const Vector3d& angles) {
      EulerTrajectory other = trajectory;
      other.control_points().col(by.first + j).head<3>() = angles;
      return other.rotation_at(t);
    };
    const Vector3d x = points.col(by.first + j).head<3>();
    const auto at = static_cast<std::size_t>(j);
    const auto rotation = [&](const Vector3d& a) { return changed(a).rotation; };
    const auto velocity = [&](const Vector3d& a) { return changed(a).angular_velocity; };
    const auto acceleration = [&](const Vector3d& a) { return changed(a).angular_acceleration; };
    EXPECT_TRUE(near(by.rotation[at], numeric_jacobian(rotation, x), 1e-8)) << j;
    EXPECT_TRUE(near(by.angular_velocity[at], numeric_jacobian(velocity, x), 1e-7)) << j;
    EXPECT_TRUE(near(by.angular_acceleration[at], numeric_jacobian(acceleration, x), 1e-5)) << j;
  }
}

// waved() stands near the pole of its angles; without the mean the fit would not come near.
TEST(EulerTrajectory, AgreesWithTheOtherForm) {
  const Samples samples = samples_of(waved);
  const SplineFitOptions options{.order = 6, .spacing_s = 0.1};
  const EulerTrajectoryFit euler = fit_euler_trajectory(samples.times, samples.poses, options);
  const PoseSplineFit other = fit_pose_spline(samples.times, samples.poses, options);
  EXPECT_LT(euler.rms_rotation, 1e-5);
  EXPECT_LT(euler.rms_position, 1e-5);
  for (const double t : {0.5, 2.345, 5.1}) {
    const PoseState a = euler.trajectory.at(t);
    const PoseState b = other.spline.at(t);
    EXPECT_LT(so3::angle_between(a.pose.rotation, b.pose.rotation), 1e-4 * kDegree);
    EXPECT_TRUE(near(a.angular_velocity, b.angular_velocity, 1e-4));
    EXPECT_TRUE(near(a.acceleration, b.acceleration, 1e-9));
  }
  const auto wide = [](double t) { return Pose3{rotation_from_angles({0, 1.5 * std::sin(t), 0}), Vector3d::Zero()}; };
  const Samples too_wide = samples_of(wide, 7);
  expect_data_error([&] { fit_euler_trajectory(too_wide.times, too_wide.poses); }, {"second angle"});
  // Turning round and round about the vertical is no trouble.
  const Samples round = samples_of([](double t) { return Pose3{so3::exp({0, 0, 4 * t}), Vector3d::Zero()}; });
  EXPECT_LT(fit_euler_trajectory(round.times, round.poses).rms_rotation, 1e-6);
}

}  // namespace
}  // namespace loc
