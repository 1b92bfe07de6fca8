// Simulated IMU: each error is what its model says, and nothing else changes when it does.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/sim/imu.hpp"
#include "libloc/sim/noise.hpp"
#include "tests/support/noise_statistics.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/wobble_motion.hpp"

namespace loc {
namespace {

using test::correlation;
using test::mean;
using test::near;
using test::RestingMotion;
using test::sigma;
using test::Vectors;
using test::WobbleMotion;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDeg = std::numbers::pi / 180;

struct ImuRun {
  Vectors rate;
  Vectors force;
  std::vector<ImuTruth> truth;
};

ImuRun run_imu(const ImuModel& model, const Motion& motion, std::size_t count, std::uint64_t seed) {
  ImuSimulator simulator(model, Random(seed));
  ImuRun run;
  for (std::size_t k = 0; k < count; ++k) {
    const ImuMeasurement m = simulator.measure(motion, from_seconds(static_cast<double>(k) / model.rate_hz));
    run.rate.push_back(m.angular_velocity);
    run.force.push_back(m.specific_force);
    run.truth.push_back(simulator.truth());
  }
  return run;
}

TEST(SimulatedImu, WithoutErrorsReadsTheTruth) {
  const WobbleMotion motion;
  ImuSimulator simulator(ImuModel::perfect(), Random(1));
  for (TimeNs k = 0; k < 50; ++k) {
    const MotionState s = motion.at(to_seconds(k * 5'000'000));
    const ImuMeasurement m = simulator.measure(motion, k * 5'000'000);
    EXPECT_EQ(m.time_ns, k * 5'000'000);
    EXPECT_EQ(m.angular_velocity, s.angular_velocity);
    const Eigen::Vector3d expected =
        s.T_world_body.rotation.toRotationMatrix().transpose() * (s.acceleration + Eigen::Vector3d(0, 0, 9.80665));
    EXPECT_TRUE(near(m.specific_force, expected, 1e-14));
  }
}

TEST(SimulatedImu, SignAndGravityAreThoseAskedFor) {
  ImuModel model = ImuModel::perfect();
  EXPECT_EQ(run_imu(model, RestingMotion(), 1, 1).force[0], Eigen::Vector3d(0, 0, 9.80665));
  model.gravity = {0, 0.1, -9.81};
  EXPECT_EQ(run_imu(model, RestingMotion(), 1, 1).force[0], Eigen::Vector3d(0, -0.1, 9.81));
  model.accelerometer_sign = -1;
  EXPECT_EQ(run_imu(model, RestingMotion(), 1, 1).force[0], Eigen::Vector3d(0, 0.1, -9.81));
  // The rig's calibration gives specific force whatever the sign; the gyroscope does not change.
  const ImuModel plain = ImuModel::vio_example();
  ImuModel negative = plain;
  negative.accelerometer_sign = -1;
  EXPECT_TRUE(near(negative.calibration().accelerometer.apply({0, 0, -9.81}), Eigen::Vector3d(0, 0, 9.81), 0));
  const ImuRun a = run_imu(plain, WobbleMotion(), 100, 3);
  const ImuRun b = run_imu(negative, WobbleMotion(), 100, 3);
  EXPECT_EQ(a.rate, b.rate);
  EXPECT_NE(a.force, b.force);
}

TEST(SimulatedImu, ConstantBiasScaleAndMisalignment) {
  ImuModel model = ImuModel::perfect();
  model.gyroscope.constant_bias = {0.01, -0.02, 0.03};
  model.accelerometer.constant_bias = {0.1, 0.2, -0.3};
  model.gyroscope.matrix << 1.01, 0.002, 0, 0, 0.99, 0.003, 0.001, 0, 1.02;
  model.accelerometer.matrix << 0.98, 0.001, 0, 0.004, 1.03, 0, 0, 0, 1;
  const WobbleMotion motion;
  const ImuRun run = run_imu(model, motion, 20, 1);
  for (std::size_t k = 0; k < 20; ++k) {
    const ImuInput in = imu_point(motion.at(0.005 * static_cast<double>(k)), model.gravity);
    EXPECT_TRUE(near(run.rate[k], model.gyroscope.matrix * in.angular_velocity + model.gyroscope.constant_bias, 1e-14));
    EXPECT_TRUE(
        near(run.force[k], model.accelerometer.matrix * in.specific_force + model.accelerometer.constant_bias, 1e-14));
    EXPECT_EQ(run.truth[k].gyroscope_bias, model.gyroscope.constant_bias);
    EXPECT_EQ(run.truth[k].accelerometer_bias, model.accelerometer.constant_bias);
    // What the rig's calibration leaves is the bias alone.
    const ImuCalibration c = model.calibration();
    EXPECT_TRUE(near(c.gyroscope.apply(run.rate[k] - model.gyroscope.constant_bias), in.angular_velocity, 1e-14));
  }
}

TEST(SimulatedImu, WhiteNoiseHasItsDensity) {
  ImuModel model = ImuModel::perfect(100);
  model.gyroscope.noise_density = 2e-3;
  model.accelerometer.noise_density = 3e-2;
  const ImuRun run = run_imu(model, RestingMotion(), 40'000, 5);
  // 120,000 numbers: the deviation of a deviation is 0.2 %.
  EXPECT_NEAR(sigma(run.rate) / 2e-2, 1, 0.01);
  EXPECT_NEAR(sigma(run.force, {0, 0, 9.80665}) / 0.3, 1, 0.01);
  for (const std::size_t lag : {1, 2, 10}) EXPECT_NEAR(correlation(run.rate, lag), 0, 0.015) << lag;
  // Allan deviation of white noise: density / sqrt(tau), here over clusters of 50 samples, 0.5 s.
  Vectors clusters;
  for (std::size_t i = 0; i + 50 <= run.rate.size(); i += 50) {
    clusters.push_back(
        mean(Vectors(run.rate.begin() + static_cast<long>(i), run.rate.begin() + static_cast<long>(i) + 50)));
  }
  Vectors steps;
  for (std::size_t i = 1; i < clusters.size(); ++i) steps.push_back((clusters[i] - clusters[i - 1]) / std::sqrt(2));
  EXPECT_NEAR(sigma(steps) * std::sqrt(0.5) / 2e-3, 1, 0.06);

  EXPECT_EQ(density_from_one_sided(0.01) * std::sqrt(100.0), 0.01 / std::sqrt(2.0) * 10);
}

TEST(SimulatedImu, TheExamplesNoiseIsTheDocumentedOne) {
  const ImuModel model = ImuModel::vio_example();
  const ImuRun run = run_imu(model, RestingMotion(), 30'000, 6);
  const Eigen::Vector3d bias = Eigen::Vector3d::Constant(2 * kDeg);
  // sigma^2 = N^2 fs / 2 + LSB^2 / 12
  EXPECT_NEAR(sigma(run.force, {0, 0, 9.81}), std::sqrt(0.01 * 0.01 * 50 + 0.0024 * 0.0024 / 12), 7e-4);
  const double lsb = 0.0625 * kDeg;
  EXPECT_NEAR(sigma(run.rate, bias), std::sqrt(std::pow(0.0573 * kDeg, 2) * 50 + lsb * lsb / 12), 8e-5);
  EXPECT_TRUE(near(mean(run.rate), bias, 2e-4));
}

TEST(SimulatedImu, BiasWalksWithItsDensity) {
  ImuModel model = ImuModel::perfect(50);
  model.gyroscope.random_walk = 0.01;
  model.accelerometer.random_walk = 0.2;
  const ImuRun run = run_imu(model, RestingMotion(), 50'000, 7);
  for (const std::size_t lag : {1, 50}) {
    Vectors rate;
    Vectors force;
    for (std::size_t i = 0; i + lag < run.rate.size(); i += lag) {
      rate.push_back(run.rate[i + lag] - run.rate[i]);
      force.push_back(run.force[i + lag] - run.force[i]);
    }
    const double expected = std::sqrt(static_cast<double>(lag) / 50);
    EXPECT_NEAR(sigma(rate) / (0.01 * expected), 1, lag == 1 ? 0.01 : 0.05) << lag;
    EXPECT_NEAR(sigma(force) / (0.2 * expected), 1, lag == 1 ? 0.01 : 0.05) << lag;
  }
  EXPECT_EQ(run.truth.back().gyroscope_bias, run.rate.back());
}

TEST(SimulatedImu, InstabilityHasItsSigmaAndTimeConstant) {
  ImuModel model = ImuModel::perfect(20);
  model.gyroscope.instability_sigma = 0.5;
  model.gyroscope.instability_time_s = 2;
  const ImuRun run = run_imu(model, RestingMotion(), 60'000, 8);  // 1500 time constants
  EXPECT_NEAR(sigma(run.rate) / 0.5, 1, 0.04);
  EXPECT_NEAR(correlation(run.rate, 40), std::exp(-1), 0.05);
  EXPECT_NEAR(correlation(run.rate, 1), std::exp(-0.025), 0.003);
  EXPECT_EQ(run.truth.back().gyroscope_bias, run.rate.back());
}

TEST(SimulatedImu, TurnOnBiasIsDrawnOnceARun) {
  ImuModel model = ImuModel::perfect();
  model.gyroscope.turn_on_bias_sigma = 0.02;
  model.accelerometer.turn_on_bias_sigma = 0.3;
  Vectors rate;
  Vectors force;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    const ImuRun run = run_imu(model, RestingMotion(), 2, seed);
    EXPECT_EQ(run.rate[0], run.rate[1]);
    rate.push_back(run.rate[0]);
    force.push_back(run.force[0]);
  }
  EXPECT_NEAR(sigma(rate) / 0.02, 1, 0.04);
  EXPECT_NEAR(sigma(force, {0, 0, 9.80665}) / 0.3, 1, 0.04);
}

TEST(SimulatedImu, SaturatesAndRounds) {
  ImuModel model = ImuModel::perfect();
  model.accelerometer.range = 5;
  model.accelerometer.resolution = 0.3;
  model.gyroscope.range = 1;
  const ImuRun run = run_imu(model, WobbleMotion(), 400, 1);
  int saturated = 0;
  for (std::size_t k = 0; k < run.force.size(); ++k) {
    for (const double f : run.force[k]) {
      EXPECT_NEAR(f / 0.3, std::round(f / 0.3), 1e-9);
      EXPECT_LE(std::abs(f), 4.8 + 1e-12);  // the last step within the range
    }
    EXPECT_LE(run.rate[k].cwiseAbs().maxCoeff(), 1);
    saturated += run.rate[k].cwiseAbs().maxCoeff() == 1 ? 1 : 0;
  }
  EXPECT_GT(saturated, 100);
  EXPECT_EQ(run.truth.back().saturated, 400);  // gravity is past the range throughout

  EXPECT_EQ(round_reading({0.0035, -0.0037, 19.7}, 19.6, 0.0024).value,
            Eigen::Vector3d(0.0024, -0.0048, 0.0024 * 8166));
  EXPECT_EQ(round_reading({1, 2, 3}, 2.5, 0).value, Eigen::Vector3d(1, 2, 2.5));
  EXPECT_FALSE(round_reading({1, 2, 2.5}, 2.5, 0).saturated);
  EXPECT_EQ(round_reading({0.6, 0.7, -9}, 0.6, 0.1).value, Eigen::Vector3d(0.1 * 6, 0.1 * 6, -0.1 * 6));
}

TEST(SimulatedImu, IntervalMeanIsTheMeanOfFineSteps) {
  const WobbleMotion motion;
  const Eigen::Vector3d gravity(0, 0, -9.80665);
  for (const double t : {0.0, 0.4, 3.3}) {
    const double dt = 0.02;
    ImuInput fine;
    const int n = 4000;
    for (int i = 0; i < n; ++i) {  // midpoint rule: error of dt^2/(24 n^2) of the second derivative
      const ImuInput in = imu_point(motion.at(t + dt * (i + 0.5) / n), gravity);
      fine.angular_velocity += in.angular_velocity / n;
      fine.specific_force += in.specific_force / n;
    }
    const ImuInput got = imu_interval_mean(motion, t, t + dt, gravity);
    EXPECT_TRUE(near(got.angular_velocity, fine.angular_velocity, 1e-10));
    EXPECT_TRUE(near(got.specific_force, fine.specific_force, 1e-9));
    // It is not the point sample at either end.
    EXPECT_GT((got.angular_velocity - imu_point(motion.at(t + dt), gravity).angular_velocity).norm(), 1e-2);
  }
}

TEST(SimulatedImu, IncrementsAddUpToAttitudeAndVelocity) {
  const WobbleMotion motion;
  ImuModel model = ImuModel::perfect(50);
  for (const ImuSampleModel sampling :
       {ImuSampleModel::kPoint, ImuSampleModel::kIntervalMean, ImuSampleModel::kIncrement}) {
    model.sampling = sampling;
    ImuSimulator simulator(model, Random(1));
    simulator.measure(motion, 0);
    Eigen::Quaterniond q = motion.at(0).T_world_body.rotation;
    Eigen::Vector3d v = motion.at(0).velocity;
    const double dt = 0.02;
    for (TimeNs k = 1; k <= 500; ++k) {
      const ImuMeasurement m = simulator.measure(motion, k * 20'000'000);
      const Eigen::Quaterniond half_way = so3::boxplus(q, m.angular_velocity * dt / 2);
      v += dt * (half_way * m.specific_force + model.gravity);
      q = so3::boxplus(q, m.angular_velocity * dt);
    }
    const double turn = so3::angle_between(q, motion.at(10).T_world_body.rotation);
    const double speed = (v - motion.at(10).velocity).norm();
    if (sampling == ImuSampleModel::kIncrement) {
      EXPECT_LT(turn, 1e-12);
      EXPECT_LT(speed, 1e-11);
    } else {  // coning and sculling; with point samples the delay of half a sample as well
      EXPECT_GT(turn, 1e-6);
      EXPECT_LT(turn, sampling == ImuSampleModel::kPoint ? 0.1 : 1e-2);
      EXPECT_GT(speed, 1e-5);
    }
  }
}

TEST(SimulatedImu, FirstSampleIsAPointSample) {
  ImuModel model = ImuModel::perfect();
  model.sampling = ImuSampleModel::kIntervalMean;
  const WobbleMotion motion;
  EXPECT_EQ(run_imu(model, motion, 1, 1).rate[0], motion.at(0).angular_velocity);
}

TEST(SimulatedImu, OneErrorDoesNotChangeAnother) {
  ImuModel model = ImuModel::perfect();
  model.gyroscope.noise_density = 1e-3;
  model.accelerometer.noise_density = 1e-2;
  const ImuRun before = run_imu(model, RestingMotion(), 50, 9);
  ImuModel more = model;
  more.gyroscope.random_walk = 1e-3;
  more.gyroscope.instability_sigma = 1e-3;
  more.gyroscope.turn_on_bias_sigma = 1e-3;
  const ImuRun after = run_imu(more, RestingMotion(), 50, 9);
  EXPECT_EQ(before.force, after.force);
  for (std::size_t k = 0; k < 50; ++k) {
    EXPECT_TRUE(near(after.rate[k] - after.truth[k].gyroscope_bias, before.rate[k], 1e-15));
  }
}

TEST(SimulatedImu, RefusesWhatMakesNoSense) {
  const auto refused = [](const std::function<void(ImuModel&)>& change) {
    ImuModel model = ImuModel::consumer();
    change(model);
    EXPECT_THROW(ImuSimulator(model, Random(1)), std::invalid_argument);
  };
  refused([](ImuModel& m) { m.rate_hz = 0; });
  refused([](ImuModel& m) { m.gyroscope.noise_density = -1; });
  refused([](ImuModel& m) { m.gyroscope.noise_density = kNan; });
  refused([](ImuModel& m) { m.accelerometer.random_walk = kNan; });
  refused([](ImuModel& m) { m.accelerometer.instability_time_s = 0; });
  refused([](ImuModel& m) { m.accelerometer.constant_bias.y() = kNan; });
  refused([](ImuModel& m) { m.gyroscope.matrix.setZero(); });
  refused([](ImuModel& m) { m.gyroscope.range = 0; });
  refused([](ImuModel& m) { m.gyroscope.resolution = 2 * m.gyroscope.range; });
  refused([](ImuModel& m) { m.accelerometer_sign = 0; });
  refused([](ImuModel& m) { m.gravity.x() = kNan; });
  try {
    ImuModel model;
    model.accelerometer.range = -3;
    model.check();
    FAIL();
  } catch (const std::invalid_argument& e) {
    EXPECT_STREQ(e.what(), "imu.accelerometer.range = -3: must be positive");
  }
  ImuSimulator simulator(ImuModel::perfect(), Random(1));
  simulator.measure(ImuInput{}, 10);
  EXPECT_THROW(simulator.measure(ImuInput{}, 10), std::invalid_argument);
  EXPECT_THROW(simulator.measure(ImuInput{{kNan, 0, 0}, {0, 0, 0}}, 11), std::invalid_argument);
  EXPECT_THROW(imu_increment({}, {}, {0, 0, -9.81}), std::invalid_argument);
  EXPECT_THROW(parse_sampling("mean"), std::invalid_argument);
  for (const ImuSampleModel s : {ImuSampleModel::kPoint, ImuSampleModel::kIntervalMean, ImuSampleModel::kIncrement}) {
    EXPECT_EQ(parse_sampling(sampling_name(s)), s);
  }
}

}  // namespace
}  // namespace loc
