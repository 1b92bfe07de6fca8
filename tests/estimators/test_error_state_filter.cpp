// The error-state filter as its users see it: signs, order of arrival, gaps, bad input.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "libloc/core/random.hpp"
#include "libloc/estimators/error_state_filter.hpp"
#include "libloc/estimators/fusion_preset.hpp"
#include "libloc/geometry/so3.hpp"
#include "support/numeric_jacobian.hpp"

namespace loc {
namespace {

constexpr TimeNs kStep = 10'000'000;  // 100 Hz
const Eigen::Vector3d kGravity(0, 0, -9.81);
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Eigen::Matrix3d sigma3(double sigma) {
  return sigma * sigma * Eigen::Matrix3d::Identity();
}

// A body on a tilted circle that also nods: nothing is constant.
struct Truth {
  Eigen::Quaterniond q;
  Eigen::Vector3d p, v, a, w;
};
Truth truth_at(double t) {
  Truth x;
  const double r = 20;
  const double omega = 0.4;
  x.p = {r * std::sin(omega * t), r - r * std::cos(omega * t), 3 * std::sin(0.3 * t)};
  x.v = {r * omega * std::cos(omega * t), r * omega * std::sin(omega * t), 0.9 * std::cos(0.3 * t)};
  x.a = {-r * omega * omega * std::sin(omega * t), r * omega * omega * std::cos(omega * t), -0.27 * std::sin(0.3 * t)};
  const double nod = 0.2 * std::sin(0.7 * t);
  x.q = so3::exp({0, 0, omega * t}) * so3::exp({0, nod, 0});
  x.w = so3::exp({0, -nod, 0}) * Eigen::Vector3d(0, 0, omega) + Eigen::Vector3d(0, 0.14 * std::cos(0.7 * t), 0);
  return x;
}

ImuMeasurement imu_at(TimeNs time) {
  const Truth x = truth_at(to_seconds(time));
  ImuMeasurement imu;
  imu.time_ns = time;
  imu.angular_velocity = x.w;
  imu.specific_force = x.q.conjugate() * (x.a - kGravity);
  return imu;
}

ErrorStateState state_at(TimeNs time) {
  const Truth x = truth_at(to_seconds(time));
  ErrorStateState state;
  state.inertial.q_world_body = x.q;
  state.inertial.position = x.p;
  state.inertial.velocity = x.v;
  return state;
}

Eigen::MatrixXd start_cov(const ErrorStateLayout& layout) {
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(layout.size, 0.1);
  sigma.segment<3>(kTheta).setConstant(0.02);
  sigma.segment<3>(kGyroscopeBias).setConstant(0.02);
  if (layout.scale >= 0) sigma[layout.scale] = 0.5;
  return sigma.cwiseAbs2().asDiagonal();
}

ErrorStateOptions options() {
  ErrorStateOptions o;
  o.gravity = kGravity;
  return o;
}

ErrorStateFilter started(const ErrorStateOptions& o, TimeNs time = 0) {
  ErrorStateFilter filter(o);
  filter.start(time, state_at(time), start_cov(filter.layout()));
  return filter;
}

FusionResult fuse_vo(ErrorStateFilter& filter, TimeNs time, double scale = 1, double sigma = 0.05) {
  const Truth x = truth_at(to_seconds(time));
  return filter.fuse_vo(time, scale * x.p, sigma3(sigma), x.q, sigma3(0.01));
}

FusionResult fuse_gps(ErrorStateFilter& filter, TimeNs time, Random& random, double sigma = 0.5) {
  const Truth x = truth_at(to_seconds(time));
  return filter.fuse_gps(time, x.p + sigma * random.normal3(), sigma3(sigma));
}

void expect_same(const ErrorStateFilter& a, const ErrorStateFilter& b, double tolerance) {
  const InertialState& x = a.state().inertial;
  const InertialState& y = b.state().inertial;
  EXPECT_EQ(a.time_ns(), b.time_ns());
  EXPECT_LE(so3::angle_between(x.q_world_body, y.q_world_body), tolerance);
  EXPECT_TRUE(test::near(x.position, y.position, tolerance));
  EXPECT_TRUE(test::near(x.velocity, y.velocity, tolerance));
  EXPECT_TRUE(test::near(x.gyroscope_bias, y.gyroscope_bias, tolerance));
  EXPECT_TRUE(test::near(x.accelerometer_bias, y.accelerometer_bias, tolerance));
  EXPECT_NEAR(a.state().scale, b.state().scale, tolerance);
  EXPECT_TRUE(test::near(a.covariance(), b.covariance(), tolerance));
}

// ---- propagation and signs

TEST(ErrorStateFilter, AloneItFollowsTheTruth) {
  ErrorStateFilter filter = started(options());
  for (TimeNs t = 0; t <= 1000 * kStep; t += kStep) {
    EXPECT_EQ(filter.predict(imu_at(t)), t == 0 ? PredictOutcome::kFirst : PredictOutcome::kPredicted);
  }
  const Truth x = truth_at(10);
  EXPECT_LT((filter.state().inertial.position - x.p).norm(), 5e-3);
  EXPECT_LT((filter.state().inertial.velocity - x.v).norm(), 1e-3);
  EXPECT_LT(so3::angle_between(filter.state().inertial.q_world_body, x.q), 1e-5);
}

// Whoever flips one of these falls for kilometres, turns the wrong way or sees a mirrored world.
TEST(ErrorStateFilter, ARestIsARest) {
  ErrorStateFilter filter(options());
  ErrorStateState state;
  state.inertial.q_world_body = so3::exp({0.3, -0.2, 1.0});
  filter.start(0, state, start_cov(filter.layout()));
  ImuMeasurement imu;
  imu.angular_velocity.setZero();
  imu.specific_force = state.inertial.q_world_body.conjugate() * -kGravity;  // upwards
  for (imu.time_ns = 0; imu.time_ns <= 100 * kStep; imu.time_ns += kStep) filter.predict(imu);
  EXPECT_LT(filter.state().inertial.position.norm(), 1e-9);
  imu.specific_force = -imu.specific_force;  // the other sign convention of an accelerometer
  for (; imu.time_ns <= 200 * kStep; imu.time_ns += kStep) filter.predict(imu);
  EXPECT_LT(filter.state().inertial.velocity.z(), -15);
}

TEST(ErrorStateFilter, SignOfTheRate) {
  ErrorStateFilter filter(options());
  filter.start(0, {}, start_cov(filter.layout()));
  ImuMeasurement imu;
  imu.angular_velocity = {0, 0, 0.5};
  imu.specific_force = -kGravity;
  for (imu.time_ns = 0; imu.time_ns <= 100 * kStep; imu.time_ns += kStep) filter.predict(imu);
  EXPECT_NEAR(so3::heading(filter.state().inertial.q_world_body), 0.5, 1e-12);  // counter-clockwise from above
}

TEST(ErrorStateFilter, SignsOfBiasesAndScaleAreFound) {
  ErrorStateFilter filter = started(options());
  const Eigen::Vector3d gyroscope_bias(0.01, -0.015, 0.02);
  const Eigen::Vector3d accelerometer_bias(0.1, -0.08, 0.05);
  for (TimeNs t = 0; t <= 6000 * kStep; t += kStep) {
    ImuMeasurement imu = imu_at(t);
    imu.angular_velocity += gyroscope_bias;
    imu.specific_force += accelerometer_bias;
    filter.predict(imu);
    if (t % (4 * kStep) != 0) continue;
    EXPECT_TRUE(fuse_vo(filter, t, 1.6).accepted()) << t;
  }
  EXPECT_LT((filter.state().inertial.gyroscope_bias - gyroscope_bias).norm(), 1e-3);
  EXPECT_LT((filter.state().inertial.accelerometer_bias - accelerometer_bias).norm(), 2e-2);
  EXPECT_NEAR(filter.state().scale, 1.6, 0.005);
}

TEST(ErrorStateFilter, DirectionOfTheQuaternionMatters) {
  ErrorStateFilter filter = started(options());
  for (TimeNs t = 0; t <= 100 * kStep; t += kStep) filter.predict(imu_at(t));
  const Truth x = truth_at(1);
  EXPECT_TRUE(filter.fuse_vo(100 * kStep, x.p, sigma3(0.05), x.q, sigma3(0.01)).accepted());
  EXPECT_TRUE(
      filter.fuse_vo(100 * kStep, x.p, sigma3(0.05), Eigen::Quaterniond(-x.q.coeffs()), sigma3(0.01)).accepted())
      << "q and -q are one rotation";
  const FusionResult wrong = filter.fuse_vo(100 * kStep, x.p, sigma3(0.05), x.q.conjugate(), sigma3(0.01));
  EXPECT_EQ(wrong.outcome, FusionOutcome::kGated);
  EXPECT_GT(wrong.nis, 100);
}

TEST(ErrorStateFilter, MountedOdometryAndAntenna) {
  ErrorStateOptions o = options();
  o.estimate_extrinsics = true;
  ErrorStateFilter filter(o);
  const Pose3 mount{so3::exp({0.1, -0.2, 0.3}), {0.4, -0.3, 0.2}};
  ErrorStateState state = state_at(0);
  Eigen::MatrixXd p = start_cov(filter.layout());
  filter.start(0, state, p);
  const Eigen::Vector3d antenna(0.5, 0.2, 1.0);
  for (TimeNs t = 0; t <= 6000 * kStep; t += kStep) {
    filter.predict(imu_at(t));
    const Truth x = truth_at(to_seconds(t));
    const Pose3 sensor = Pose3{x.q, x.p} * mount;
    if (t == 0) continue;
    if (t % (4 * kStep) == 0) filter.fuse_vo(t, sensor.translation, sigma3(0.02), sensor.rotation, sigma3(0.005));
    if (t % (100 * kStep) == 0) {
      const FusionResult r =
          filter.fuse_gps(t, x.p + x.q * antenna, sigma3(0.05), antenna, x.v + x.q * x.w.cross(antenna), sigma3(0.05));
      EXPECT_TRUE(r.accepted() || t < 1000 * kStep) << t;
    }
  }
  const Pose3& found = filter.state().T_body_odometry;
  EXPECT_LT(so3::angle_between(found.rotation, mount.rotation), 0.01);
  EXPECT_LT((found.translation - mount.translation).norm(), 0.05);
}

// What one step adds, exactly: densities, the drift's decay and its noise, the walk of the scale.
TEST(ErrorStateFilter, NoiseOfAStep) {
  ErrorStateOptions o = options();
  o.estimate_drift = true;
  o.drift_sigma = 2;
  o.drift_time_constant_s = 0.5;
  o.scale_random_walk = 0.3;
  ErrorStateFilter filter(o);
  const ErrorStateLayout& layout = filter.layout();
  ErrorStateState state;
  state.scale = 2;
  state.drift = {1, 2, 3};
  filter.start(0, state, Eigen::MatrixXd::Zero(layout.size, layout.size));
  ImuMeasurement imu;
  imu.time_ns = kStep;
  imu.angular_velocity.setZero();
  imu.specific_force = -kGravity;
  filter.predict(imu);
  const double dt = 0.01;
  const double phi = std::exp(-dt / 0.5);
  const auto variance = [&](int at) { return filter.covariance()(at, at); };
  EXPECT_NEAR(variance(kTheta), std::pow(o.noise.gyroscope_noise_density, 2) * dt, 1e-18);
  EXPECT_NEAR(variance(kVelocity), std::pow(o.noise.accelerometer_noise_density, 2) * dt, 1e-16);
  EXPECT_NEAR(variance(kGyroscopeBias), std::pow(o.noise.gyroscope_random_walk, 2) * dt, 1e-18);
  EXPECT_NEAR(variance(kAccelerometerBias), std::pow(o.noise.accelerometer_random_walk, 2) * dt, 1e-16);
  EXPECT_NEAR(variance(layout.scale), std::pow(0.3 * 2, 2) * dt, 1e-12);
  EXPECT_NEAR(variance(layout.drift), 4 * (1 - phi * phi), 1e-12);
  EXPECT_NEAR(filter.state().drift.z(), 3 * phi, 1e-12);
}

// A rate that grows evenly: split anywhere, the step integrates the same line; with Euler's steps the same way round.
TEST(ErrorStateFilter, SplitStepsAndEulersFollowTheSameTurn) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, -2, 3).normalized();
  const auto turned = [&](ImuIntegration integration, TimeNs split) {
    ErrorStateOptions o = options();
    o.integration = integration;
    ErrorStateFilter filter(o);
    filter.start(0, {}, start_cov(filter.layout()));
    ImuMeasurement imu;
    imu.specific_force = -kGravity;
    for (imu.time_ns = 0; imu.time_ns <= 10 * kStep; imu.time_ns += kStep) {
      imu.angular_velocity = 10 * to_seconds(imu.time_ns) * axis;
      if (split > 0) filter.fuse_height(imu.time_ns + split, 0, 1e6);
      filter.predict(imu);
    }
    return Eigen::Vector3d(so3::log(filter.state().inertial.q_world_body));
  };
  const Eigen::Vector3d exact = 0.5 * 10 * 0.01 * axis;  // 0.1 s
  EXPECT_TRUE(test::near(turned(ImuIntegration::kMidpoint, 0), exact, 1e-12));
  EXPECT_TRUE(test::near(turned(ImuIntegration::kMidpoint, kStep / 4), exact, 1e-9));
  EXPECT_TRUE(test::near(turned(ImuIntegration::kEuler, 0), exact, 0.006));  // it takes the rate at the step's end
}

// ---- order of arrival

ErrorStateOptions late_options() {
  ErrorStateOptions o = options();
  o.clones = 1;
  o.estimate_drift = true;
  o.scale_random_walk = 0.01;
  return o;
}

// Odometry at 25 Hz, GPS at 5 Hz between the IMU's samples, both with delays in IMU samples.
ErrorStateFilter run(const ErrorStateOptions& o, int vo_delay, int gps_delay, int relative_delay = -1) {
  ErrorStateFilter filter = started(o);
  struct Arrival {
    int at;
    int kind;
    TimeNs time;
    Eigen::Vector3d value;
  };
  std::vector<Arrival> arrivals;
  Random random(3);
  const int samples = 400;
  for (int i = 0; i < samples - 60; ++i) {
    const TimeNs t = i * kStep;
    if (i % 4 == 0) arrivals.push_back({i + vo_delay, 0, t, truth_at(to_seconds(t)).p + 0.05 * random.normal3()});
    if (i % 20 == 7) {
      const TimeNs between = t + kStep / 3;
      arrivals.push_back({i + gps_delay, 1, between, truth_at(to_seconds(between)).p + 0.5 * random.normal3()});
    }
    if (relative_delay >= 0 && i % 10 == 5 && i > 10) {
      arrivals.push_back({i + relative_delay, 2, t, Eigen::Vector3d(0.02 * random.normal3())});
    }
  }
  for (int i = 0; i < samples; ++i) {
    filter.predict(imu_at(i * kStep));
    for (const Arrival& a : arrivals) {
      if (a.at != i) continue;
      const Truth x = truth_at(to_seconds(a.time));
      FusionResult r;
      if (a.kind == 0) {
        r = filter.fuse_vo(a.time, a.value, sigma3(0.05), x.q, sigma3(0.01));
      } else if (a.kind == 1) {
        r = filter.fuse_gps(a.time, a.value, sigma3(0.5));
      } else {
        const Truth x0 = truth_at(to_seconds(a.time - 10 * kStep));
        r = filter.fuse_vo_relative(a.time - 10 * kStep, a.time, x0.q.conjugate() * (x.p - x0.p) + a.value,
                                    sigma3(0.02), x0.q.conjugate() * x.q, sigma3(0.005));
      }
      EXPECT_TRUE(r.accepted() || r.outcome == FusionOutcome::kWaiting) << fusion_outcome_name(r.outcome);
    }
  }
  return filter;
}

TEST(ErrorStateHistory, LateIsAsGoodAsInOrder) {
  for (const ImuSampling sampling : {ImuSampling::kPoint, ImuSampling::kIntervalMean}) {
    ErrorStateOptions o = late_options();
    o.sampling = sampling;
    const ErrorStateFilter in_order = run(o, 0, 0, 0);
    expect_same(run(o, 1, 1, 1), in_order, 1e-9);
    expect_same(run(o, 10, 3, 20), in_order, 1e-9);
    expect_same(run(o, 3, 49, 0), in_order, 1e-9);
    expect_same(run(o, 49, 0, 30), in_order, 1e-9);
  }
}

TEST(ErrorStateHistory, WhatIsOlderIsRefusedAndCounted) {
  ErrorStateFilter filter = started(options());
  for (TimeNs t = 0; t <= 100 * kStep; t += kStep) filter.predict(imu_at(t));
  const ErrorStateFilter before = filter;
  EXPECT_EQ(fuse_vo(filter, 49 * kStep).outcome, FusionOutcome::kTooLate);
  expect_same(filter, before, 0);
  EXPECT_TRUE(fuse_vo(filter, 50 * kStep).accepted());
  EXPECT_EQ(fuse_vo(filter, -1).outcome, FusionOutcome::kTooLate) << "before the start";
  std::int64_t too_late = 0;
  for (const NamedCount& count : filter.counts()) {
    if (count.name == "odometry.too_late") too_late = count.value;
  }
  EXPECT_EQ(too_late, 2);
}

TEST(ErrorStateHistory, WithoutHistoryOnlyNowIsAccepted) {
  ErrorStateOptions o = options();
  o.history_ns = 0;
  ErrorStateFilter without = started(o);
  ErrorStateFilter with = started(options());
  Random random(1);
  for (TimeNs t = 0; t <= 300 * kStep; t += kStep) {
    without.predict(imu_at(t));
    with.predict(imu_at(t));
    if (t % (4 * kStep) != 0) continue;
    EXPECT_TRUE(fuse_vo(without, t).accepted());
    EXPECT_TRUE(fuse_vo(with, t).accepted());
    if (t == 0) continue;
    EXPECT_EQ(fuse_vo(without, t - kStep).outcome, FusionOutcome::kTooLate);
  }
  expect_same(without, with, 0);
}

TEST(ErrorStateHistory, NewerThanTheImuWaits) {
  ErrorStateFilter filter = started(options());
  filter.predict(imu_at(0));
  Random random(1);
  EXPECT_EQ(fuse_gps(filter, kStep / 2, random).outcome, FusionOutcome::kWaiting);
  EXPECT_EQ(fuse_gps(filter, kStep, random).outcome, FusionOutcome::kWaiting);
  EXPECT_EQ(fuse_gps(filter, 2 * kStep, random).outcome, FusionOutcome::kWaiting);
  filter.predict(imu_at(kStep));
  ASSERT_EQ(filter.finished().size(), 2U);
  EXPECT_EQ(filter.finished()[0].time_ns, kStep / 2);
  EXPECT_TRUE(filter.finished()[0].accepted());
  EXPECT_EQ(filter.finished()[0].dof, 3);
  EXPECT_EQ(filter.finished()[1].time_ns, kStep);
  filter.predict(imu_at(2 * kStep));
  EXPECT_EQ(filter.finished().size(), 1U);
  filter.predict(imu_at(3 * kStep));
  EXPECT_TRUE(filter.finished().empty());
}

TEST(ErrorStateHistory, EqualTimesDoNotDependOnTheOrderOfArrival) {
  const auto filtered = [&](bool gps_first) {
    Random random(4);
    ErrorStateFilter filter = started(options());
    for (TimeNs t = 0; t <= 100 * kStep; t += kStep) {
      filter.predict(imu_at(t));
      if (t % (10 * kStep) != 0) continue;
      if (!gps_first) fuse_vo(filter, t, 1.1);
      fuse_gps(filter, t, random);
      if (gps_first) fuse_vo(filter, t, 1.1);
    }
    return filter;
  };
  expect_same(filtered(true), filtered(false), 0);
}

// ---- clones

TEST(ErrorStateClones, RelativeOdometryFindsTheScale) {
  ErrorStateOptions o = options();
  o.clones = 1;
  ErrorStateFilter filter = started(o);
  Random random(9);
  int accepted = 0;
  for (int i = 0; i <= 3000; ++i) {
    filter.predict(imu_at(i * kStep));
    if (i % 10 != 0 || i == 0) continue;
    const Truth a = truth_at(to_seconds((i - 10) * kStep));
    const Truth b = truth_at(to_seconds(i * kStep));
    const FusionResult r = filter.fuse_vo_relative((i - 10) * kStep, i * kStep,
                                                   1.4 * (a.q.conjugate() * (b.p - a.p)) + 0.01 * random.normal3(),
                                                   sigma3(0.01), a.q.conjugate() * b.q, sigma3(0.002));
    accepted += r.accepted() ? 1 : 0;
  }
  EXPECT_EQ(accepted, 300);
  EXPECT_NEAR(filter.state().scale, 1.4, 0.02);
  // Positions are not seen by it: their deviation grows, and says so.
  EXPECT_GT(filter.covariance()(kPosition, kPosition), 0.01);
}

TEST(ErrorStateClones, APoseThatNobodyKeptIsSaidToBeMissing) {
  ErrorStateOptions o = options();
  o.clones = 1;
  o.history_ns = 100'000'000;
  ErrorStateFilter filter = started(o);
  for (TimeNs t = 0; t <= 100 * kStep; t += kStep) filter.predict(imu_at(t));
  const Truth a = truth_at(0.3);
  const Truth b = truth_at(1);
  const auto fuse = [&](TimeNs from) {
    return filter.fuse_vo_relative(from, 100 * kStep, a.q.conjugate() * (b.p - a.p), sigma3(0.02),
                                   a.q.conjugate() * b.q, sigma3(0.01));
  };
  EXPECT_EQ(fuse(30 * kStep).outcome, FusionOutcome::kNoClone);
  ErrorStateFilter none = started(options());
  EXPECT_THROW(none.keep_pose(0), std::invalid_argument);
}

// ---- gate

TEST(ErrorStateFilter, TheGateKeepsOutliersOut) {
  ErrorStateOptions gated = options();
  ErrorStateOptions open = options();
  open.gate = false;
  const auto error = [](const ErrorStateOptions& o) {
    ErrorStateFilter filter = started(o);
    Random random(2);
    double worst = 0;
    for (int i = 0; i <= 1000; ++i) {
      const TimeNs t = i * kStep;
      filter.predict(imu_at(t));
      if (i % 4 != 0) continue;
      const Truth x = truth_at(to_seconds(t));
      const bool outlier = i % 200 == 100;
      const FusionResult r =
          filter.fuse_vo(t, x.p + (outlier ? Eigen::Vector3d(30, -20, 10) : Eigen::Vector3d(0.05 * random.normal3())),
                         sigma3(0.05), x.q, sigma3(0.01));
      EXPECT_EQ(r.accepted(), !outlier || !o.gate) << i;
      worst = std::max(worst, (filter.state().inertial.position - x.p).norm());
    }
    return worst;
  };
  EXPECT_LT(error(gated), 0.3);
  EXPECT_GT(error(open), 3);
}

TEST(ErrorStateFilter, ResidualSaysWhatCorrectWouldDo) {
  ErrorStateFilter filter = started(options());
  for (TimeNs t = 0; t <= 10 * kStep; t += kStep) filter.predict(imu_at(t));
  const MeasurementModel model = [](const ErrorStateState& state, const ErrorStateLayout& layout, Linearisation& l) {
    l.residual.resize(2);
    l.residual << 3 - state.inertial.velocity.x(), 1 - state.inertial.velocity.y();
    l.jacobian.setZero(2, layout.size);
    l.jacobian(0, kVelocity) = 1;
    l.jacobian(1, kVelocity + 1) = 1;
    l.noise_cov = 25 * Eigen::Matrix2d::Identity();
  };
  const ErrorStateFilter before = filter;
  const FusionResult foreseen = filter.residual(model);
  expect_same(filter, before, 0);
  const FusionResult done = filter.correct(10 * kStep, model);
  EXPECT_EQ(foreseen.nis, done.nis);
  EXPECT_EQ(foreseen.residual, done.residual);
  EXPECT_EQ(foreseen.innovation_cov, done.innovation_cov);
  EXPECT_EQ(done.dof, 2);
  EXPECT_TRUE(done.accepted());
  EXPECT_LT(filter.state().inertial.velocity.x(), before.state().inertial.velocity.x());
  const auto with_sizes = [&](int rows, int columns) {
    return filter.correct(10 * kStep, [=](const ErrorStateState&, const ErrorStateLayout&, Linearisation& l) {
      l.residual = Eigen::VectorXd::Zero(rows);
      l.jacobian = Eigen::MatrixXd::Zero(rows, columns);
      l.noise_cov = Eigen::MatrixXd::Identity(rows, rows);
    });
  };
  EXPECT_THROW(with_sizes(3, 15), std::invalid_argument);
  expect_same(filter, filter, 0);
}

// ---- gaps and bad input

TEST(ErrorStateFilter, GapsAreBridgedOrRefused) {
  ErrorStateFilter filter = started(options());
  EXPECT_EQ(filter.predict(imu_at(0)), PredictOutcome::kFirst);
  EXPECT_EQ(filter.predict(imu_at(kStep)), PredictOutcome::kPredicted);
  EXPECT_EQ(filter.predict(imu_at(11 * kStep)), PredictOutcome::kPredicted) << "0.1 s is no gap yet";
  const double before = filter.covariance()(kVelocity, kVelocity);
  EXPECT_EQ(filter.predict(imu_at(61 * kStep)), PredictOutcome::kBridged);
  EXPECT_GT(filter.covariance()(kVelocity, kVelocity), before + 1.5);  // (3 m/s^2 for 0.5 s)^2
  // What is bridged stays inside its own covariance.
  const Truth x = truth_at(0.61);
  const Eigen::Vector3d error = filter.state().inertial.velocity - x.v;
  EXPECT_LT(error.norm(), 3 * std::sqrt(filter.covariance()(kVelocity, kVelocity)));
  const ErrorStateFilter stopped = filter;
  EXPECT_EQ(filter.predict(imu_at(162 * kStep)), PredictOutcome::kGap);
  EXPECT_EQ(filter.predict(imu_at(163 * kStep)), PredictOutcome::kGap) << "until it is started again";
  expect_same(filter, stopped, 0);
  filter.start(163 * kStep, state_at(163 * kStep), start_cov(filter.layout()));
  EXPECT_EQ(filter.predict(imu_at(164 * kStep)), PredictOutcome::kPredicted);
}

TEST(ErrorStateFilter, ASplitBridgeAddsTheSame) {
  ErrorStateFilter whole = started(options());
  ErrorStateFilter split = started(options());
  whole.predict(imu_at(0));
  split.predict(imu_at(0));
  // A measurement that says nothing splits the step.
  split.fuse_gps(20 * kStep, truth_at(0.2).p, sigma3(1e6));
  whole.predict(imu_at(50 * kStep));
  split.predict(imu_at(50 * kStep));
  // Of the rate the same; the force's comes with what the uncertain attitude does to it in the second part.
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(split.covariance()(kTheta + i, kTheta + i) / whole.covariance()(kTheta + i, kTheta + i), 1, 1e-3);
    EXPECT_NEAR(split.covariance()(kVelocity + i, kVelocity + i) / whole.covariance()(kVelocity + i, kVelocity + i),
                1.05, 0.06);
  }
}

TEST(ErrorStateFilter, BadImuSamplesAreRefused) {
  ErrorStateFilter filter(options());
  EXPECT_EQ(filter.predict(imu_at(0)), PredictOutcome::kNotStarted);
  filter.start(0, state_at(0), start_cov(filter.layout()));
  filter.predict(imu_at(0));
  filter.predict(imu_at(kStep));
  const ErrorStateFilter before = filter;
  ImuMeasurement bad = imu_at(2 * kStep);
  bad.angular_velocity.y() = kNan;
  EXPECT_EQ(filter.predict(bad), PredictOutcome::kNotFinite);
  bad = imu_at(2 * kStep);
  bad.specific_force.x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(filter.predict(bad), PredictOutcome::kNotFinite);
  bad = imu_at(2 * kStep);
  bad.time_ns = kNoTime;
  EXPECT_EQ(filter.predict(bad), PredictOutcome::kNotFinite);
  EXPECT_EQ(filter.predict(imu_at(kStep)), PredictOutcome::kTimeNotIncreasing);
  EXPECT_EQ(filter.predict(imu_at(0)), PredictOutcome::kTimeNotIncreasing) << "a clock that steps back";
  expect_same(filter, before, 0);
  EXPECT_EQ(filter.predict(imu_at(2 * kStep)), PredictOutcome::kPredicted);
}

TEST(ErrorStateFilter, BadMeasurementsChangeNothing) {
  ErrorStateOptions o = options();
  o.clones = 1;
  ErrorStateFilter not_started(o);
  EXPECT_EQ(fuse_vo(not_started, 0).outcome, FusionOutcome::kNotStarted);

  ErrorStateFilter filter = started(o);
  filter.predict(imu_at(0));
  filter.predict(imu_at(kStep));
  const ErrorStateFilter before = filter;
  const Truth x = truth_at(0.01);
  const Eigen::Vector3d not_a_number(1, kNan, 1);
  Eigen::Matrix3d singular = Eigen::Matrix3d::Ones();
  Eigen::Matrix3d skewed = Eigen::Matrix3d::Identity();
  skewed(0, 1) = 0.1;
  const auto outcome = [&](const FusionResult& r) { return r.outcome; };
  using enum FusionOutcome;
  EXPECT_EQ(outcome(filter.fuse_vo(kStep, not_a_number, sigma3(1), x.q, sigma3(1))), kNotFinite);
  EXPECT_EQ(outcome(filter.fuse_vo(kStep, x.p, sigma3(1), Eigen::Quaterniond(0, 0, 0, 0), sigma3(1))), kNotFinite);
  EXPECT_EQ(outcome(filter.fuse_vo(kStep, x.p, sigma3(0), x.q, sigma3(1))), kBadCovariance);
  EXPECT_EQ(outcome(filter.fuse_vo(kStep, x.p, sigma3(1), x.q, singular)), kBadCovariance);
  EXPECT_EQ(outcome(filter.fuse_vo(kStep, x.p, skewed, x.q, sigma3(1))), kBadCovariance);
  EXPECT_EQ(outcome(filter.fuse_vo(kStep, x.p, kNan * sigma3(1), x.q, sigma3(1))), kNotFinite);
  EXPECT_EQ(outcome(filter.fuse_gps(kStep, not_a_number, sigma3(1))), kNotFinite);
  EXPECT_EQ(outcome(filter.fuse_gps(kStep, x.p, -sigma3(1))), kBadCovariance);
  const Eigen::Vector3d absent = Eigen::Vector3d::Constant(kNan);
  EXPECT_EQ(outcome(filter.fuse_gps(kStep, absent, sigma3(1))), kNotFinite) << "neither position nor velocity";
  EXPECT_EQ(outcome(filter.fuse_velocity(kStep, absent, sigma3(1))), kNotFinite);
  EXPECT_EQ(outcome(filter.fuse_velocity(kStep, x.v, singular)), kBadCovariance);
  EXPECT_EQ(outcome(filter.fuse_zero_velocity(kStep, 0)), kBadCovariance);
  EXPECT_EQ(outcome(filter.fuse_zero_velocity(kStep, kNan)), kNotFinite);
  EXPECT_EQ(outcome(filter.fuse_height(kStep, kNan, 1)), kNotFinite);
  EXPECT_EQ(outcome(filter.fuse_height(kStep, 1, -1)), kBadCovariance);
  EXPECT_EQ(outcome(filter.fuse_heading(kStep, 1, kNan)), kNotFinite);
  EXPECT_EQ(outcome(filter.fuse_heading(kStep, 1, 0)), kBadCovariance);
  const auto model = [&](double residual, double variance) {
    return filter.correct(kStep, [=](const ErrorStateState&, const ErrorStateLayout& layout, Linearisation& l) {
      l.residual = Eigen::VectorXd::Constant(1, residual);
      l.jacobian = Eigen::MatrixXd::Ones(1, layout.size);
      l.noise_cov = Eigen::MatrixXd::Constant(1, 1, variance);
    });
  };
  EXPECT_EQ(outcome(model(kNan, 1)), kNotFinite);
  EXPECT_EQ(outcome(model(1, -1)), kBadCovariance);
  EXPECT_THROW(filter.fuse_vo_relative(kStep, kStep, x.p, sigma3(1), x.q, sigma3(1)), std::invalid_argument);
  expect_same(filter, before, 0);
}

TEST(ErrorStateFilter, BadStartsThrow) {
  ErrorStateFilter filter(options());
  const int n = filter.layout().size;
  const Eigen::MatrixXd good = Eigen::MatrixXd::Identity(n, n);
  EXPECT_THROW(filter.start(kNoTime, {}, good), std::invalid_argument);
  EXPECT_THROW(filter.start(0, {}, Eigen::MatrixXd::Identity(15, 15)), std::invalid_argument);
  Eigen::MatrixXd p = good;
  p(2, 2) = -1;
  EXPECT_THROW(filter.start(0, {}, p), std::invalid_argument);
  p = good;
  p(0, 1) = p(1, 0) = 1.1;  // a correlation beyond 1
  EXPECT_THROW(filter.start(0, {}, p), std::invalid_argument);
  p = good;
  p(0, 1) = 0.1;
  EXPECT_THROW(filter.start(0, {}, p), std::invalid_argument);
  ErrorStateState state;
  state.inertial.q_world_body = Eigen::Quaterniond(1, 1, 0, 0);
  EXPECT_THROW(filter.start(0, state, good), std::invalid_argument);
  state = {};
  state.inertial.position.x() = kNan;
  EXPECT_THROW(filter.start(0, state, good), std::invalid_argument);
  EXPECT_FALSE(filter.started());

  ErrorStateOptions o = options();
  o.clones = 7;
  EXPECT_THROW(ErrorStateFilter{o}, std::invalid_argument);
  o = options();
  o.gate_probability = 1;
  EXPECT_THROW(ErrorStateFilter{o}, std::invalid_argument);
  o = options();
  o.max_bridge_ns = o.max_step_ns - 1;
  EXPECT_THROW(ErrorStateFilter{o}, std::invalid_argument);
}

TEST(ErrorStateFilter, WidenedItListensAgain) {
  ErrorStateFilter filter = started(options());
  for (TimeNs t = 0; t <= 10 * kStep; t += kStep) filter.predict(imu_at(t));
  const Eigen::Vector3d far = truth_at(0.1).p + Eigen::Vector3d(100, 0, 0);
  EXPECT_EQ(filter.fuse_gps(10 * kStep, far, sigma3(1)).outcome, FusionOutcome::kGated);
  Eigen::VectorXd variances = Eigen::VectorXd::Zero(filter.layout().size);
  variances.segment<3>(kPosition).setConstant(1e4);
  filter.widen(variances);
  EXPECT_TRUE(filter.fuse_gps(10 * kStep, far, sigma3(1)).accepted());
  EXPECT_NEAR(filter.state().inertial.position.x(), far.x(), 3);
  EXPECT_THROW(filter.widen(-variances), std::invalid_argument);
}

// What a model throws reaches the caller, and the filter goes on without that measurement.
TEST(ErrorStateFilter, AModelThatThrowsLeavesTheFilterInOrder) {
  ErrorStateFilter filter = started(options());
  ErrorStateFilter without = started(options());
  Random random(5);
  Random again(5);
  int calls = 0;
  const MeasurementModel model = [&calls](const ErrorStateState&, const ErrorStateLayout& layout, Linearisation& l) {
    if (++calls == 2) throw std::runtime_error("no more");
    l.residual = Eigen::VectorXd::Zero(1);
    l.jacobian = Eigen::MatrixXd::Zero(1, layout.size);
    l.jacobian(0, kPosition) = 1;
    l.noise_cov = Eigen::MatrixXd::Constant(1, 1, 100);
  };
  for (int i = 0; i <= 100; ++i) {
    filter.predict(imu_at(i * kStep));
    without.predict(imu_at(i * kStep));
    if (i != 70) continue;
    EXPECT_TRUE(filter.correct(70 * kStep, model).accepted());
  }
  // A late fix computes it anew, and the model throws this time.
  EXPECT_THROW(fuse_gps(filter, 60 * kStep, random), std::runtime_error);
  EXPECT_TRUE(fuse_gps(without, 60 * kStep, again).accepted());
  EXPECT_EQ(filter.time_ns(), 100 * kStep);
  expect_same(filter, without, 1e-12);
  EXPECT_TRUE(fuse_gps(filter, 65 * kStep, random).accepted());
  EXPECT_TRUE(fuse_gps(without, 65 * kStep, again).accepted());
  expect_same(filter, without, 1e-12);
}

TEST(ErrorStateFilter, TimesAndValuesWithoutEndAreRefused) {
  ErrorStateFilter filter(options());
  constexpr TimeNs kFar = std::numeric_limits<TimeNs>::max() - 5;
  filter.start(-kFar, {}, start_cov(filter.layout()));
  ImuMeasurement imu = imu_at(0);
  imu.time_ns = kFar;
  EXPECT_EQ(filter.predict(imu), PredictOutcome::kGap);
  Random random(1);
  EXPECT_EQ(fuse_gps(filter, kFar, random).outcome, FusionOutcome::kTooEarly);
  imu.time_ns = -kFar + 1;
  imu.specific_force.x() = 1e300;
  EXPECT_EQ(filter.predict(imu), PredictOutcome::kNotFinite);
  EXPECT_TRUE(filter.state().inertial.position.allFinite());
  ErrorStateFilter moved = std::move(filter);
  filter = moved;  // a moved-from one can be assigned to
  EXPECT_EQ(filter.time_ns(), -kFar);
}

// Two that overlap need two places: the second must not take the first one's away.
TEST(ErrorStateClones, WhatOverlapsIsRefusedAndNotRevoked) {
  ErrorStateOptions o = options();
  o.clones = 1;
  ErrorStateFilter filter = started(o);
  for (int i = 0; i <= 30; ++i) filter.predict(imu_at(i * kStep));
  const auto fuse = [&](int from, int to) {
    const Truth a = truth_at(to_seconds(from * kStep));
    const Truth b = truth_at(to_seconds(to * kStep));
    return filter
        .fuse_vo_relative(from * kStep, to * kStep, a.q.conjugate() * (b.p - a.p), sigma3(0.02), a.q.conjugate() * b.q,
                          sigma3(0.01))
        .outcome;
  };
  EXPECT_EQ(fuse(0, 20), FusionOutcome::kAccepted);
  EXPECT_EQ(fuse(10, 30), FusionOutcome::kNoClone);
  for (const NamedCount& count : filter.counts()) {
    if (count.name.starts_with("relative")) {
      EXPECT_EQ(count.value, 1) << count.name;
    }
  }
}

// An hour of everything at once leaves a covariance that is still one.
TEST(ErrorStateFilter, TheCovarianceStaysPositive) {
  ErrorStateOptions o = late_options();
  o.estimate_extrinsics = true;
  ErrorStateFilter filter = started(o);
  Random random(8);
  for (int i = 0; i <= 36000; ++i) {  // ten Hz keeps it quick
    const TimeNs t = i * 10 * kStep;
    filter.predict(imu_at(t));
    if (i % 3 == 0) fuse_vo(filter, t);
    if (i % 7 == 0) fuse_gps(filter, t - 4 * kStep, random);
    if (i % 11 == 0) filter.fuse_height(t, truth_at(to_seconds(t)).p.z(), 1e-3);
    if (i % 13 == 0) filter.fuse_heading(t, so3::heading(truth_at(to_seconds(t)).q), 1e-3);
  }
  ASSERT_TRUE(filter.covariance().allFinite());
  const Eigen::MatrixXd& p = filter.covariance();
  EXPECT_TRUE(p == p.transpose()) << "not symmetric";
  const int active = filter.layout().clones;  // no pose was kept: its rows are zero
  const double smallest = p.topLeftCorner(active, active).selfadjointView<Eigen::Lower>().eigenvalues().minCoeff();
  EXPECT_GT(smallest, 0);
}

TEST(FusionPreset, NamesAndNumbers) {
  const FusionPreset drift = FusionPreset::by_name("19");
  // q_c of the method's page: sigma_A^2 (1 - phi_i^2) / (1 - phi_i^8), phi_i = (1 - 1/tau)^(1/4)
  const double tau = 232;
  const double phi_i = std::pow(1 - 1 / tau, 0.25);
  const double sigma_a2 = (2 / tau + 1 / (tau * tau)) * 1.34;
  const double expected = sigma_a2 * (1 - phi_i * phi_i) / (1 - std::pow(phi_i, 8));
  const double phi = std::exp(-0.01 / drift.options.drift_time_constant_s);
  EXPECT_NEAR(phi, phi_i, 1e-14);
  EXPECT_NEAR(drift.options.drift_sigma * drift.options.drift_sigma * (1 - phi * phi), expected, 1e-15);
  EXPECT_EQ(drift.start_cov.rows(), 19);
  EXPECT_EQ(FusionPreset::by_name("16").start_cov.rows(), 16);
  EXPECT_EQ(FusionPreset::by_name("as_published").start_cov(9, 11), 1e6);
  EXPECT_THROW(FusionPreset::by_name("17"), std::invalid_argument);
  FusionPresetSensors sensors;
  sensors.odometry_drift_tau = 0.5;
  EXPECT_THROW(FusionPreset::drift(sensors), std::invalid_argument);
}

}  // namespace
}  // namespace loc
