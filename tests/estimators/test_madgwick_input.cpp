// What the filter does with input that is bad, missing or odd in time, and with wrong options.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "libloc/estimators/madgwick.hpp"
#include "support/madgwick_checks.hpp"

namespace loc {
namespace {

using test::error_deg;
using test::feed;
using test::hand_held_rate;
using test::SimulatedImu;
using test::tilt_error_deg;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Fails when there is no such count.
std::int64_t count_of(const MadgwickFilter& filter, const std::string& name) {
  for (const NamedCount& count : filter.counts()) {
    if (count.name == name) return count.value;
  }
  ADD_FAILURE() << "no count named " << name;
  return -1;
}

TEST(Madgwick, SkipsAndCountsBadSamplesAndKeepsItsState) {
  MadgwickFilter filter;
  SimulatedImu sim;
  sim.step({0.1, 0.2, 0.3});
  feed(filter, sim);
  sim.step({0.1, 0.2, 0.3});
  const Eigen::Vector4d before = filter.orientation().coeffs();
  for (const double value : {kNaN, kInfinity, -kInfinity}) {
    for (int i = 0; i < 3; ++i) {
      ImuMeasurement imu = sim.imu;
      imu.angular_velocity[i] = value;
      EXPECT_EQ(filter.update(imu), static_cast<std::uint32_t>(kNotFinite));
      imu = sim.imu;
      imu.specific_force[i] = value;
      EXPECT_FALSE(filter.process(imu));
      MagnetometerMeasurement magnetometer = sim.magnetometer;
      magnetometer.magnetic_field[i] = value;
      EXPECT_EQ(filter.update(magnetometer), static_cast<std::uint32_t>(kNotFinite));
    }
  }
  for (const double value : {71.0, -1e7, 1e300}) {
    ImuMeasurement imu = sim.imu;
    imu.angular_velocity[1] = value;
    EXPECT_EQ(filter.update(imu), static_cast<std::uint32_t>(kOutOfRange));
  }
  MagnetometerMeasurement magnetometer = sim.magnetometer;
  magnetometer.magnetic_field[1] = 1e7;
  EXPECT_EQ(filter.update(magnetometer), static_cast<std::uint32_t>(kOutOfRange));
  ImuMeasurement old = sim.imu;
  old.time_ns -= sim.dt_ns;
  EXPECT_EQ(filter.update(old), static_cast<std::uint32_t>(kTimeNotIncreasing));
  old.time_ns = kNoTime;
  EXPECT_EQ(filter.update(old), static_cast<std::uint32_t>(kTimeNotIncreasing));
  EXPECT_EQ(filter.orientation().coeffs(), before);
  EXPECT_EQ(count_of(filter, "imu.skipped.not_finite"), 18);
  EXPECT_EQ(count_of(filter, "imu.skipped.out_of_range"), 3);
  EXPECT_EQ(count_of(filter, "imu.skipped.time_not_increasing"), 2);
  EXPECT_EQ(count_of(filter, "magnetometer.skipped.not_finite"), 9);
  EXPECT_EQ(count_of(filter, "magnetometer.skipped.out_of_range"), 1);
  EXPECT_EQ(count_of(filter, "imu.used"), 1);
  // The next estimate says what was skipped before it, the one after that is clean again.
  filter.update(sim.imu);
  EXPECT_EQ(filter.estimate().status, static_cast<std::uint32_t>(kNotFinite) | kOutOfRange | kTimeNotIncreasing);
  sim.step({0.1, 0.2, 0.3});
  feed(filter, sim);
  EXPECT_EQ(filter.estimate().status, 0U);
}

TEST(Madgwick, ASpikeOfTheAccelerometerDoesNotTilt) {
  for (const char* preset : {"report", "robust"}) {
    MadgwickFilter filter(MadgwickOptions::preset(preset));
    SimulatedImu sim;
    for (int i = 0; i < 2000; ++i) {
      sim.step(hand_held_rate(i * 0.005));
      if (i == 1500) sim.imu.specific_force = {9e5, 0, 0};
      feed(filter, sim);
      EXPECT_EQ((filter.status() & kAccelerometerIgnored) != 0, i == 1500);
    }
    EXPECT_LT(error_deg(filter, sim), 0.5) << preset;
    EXPECT_EQ(count_of(filter, "imu.accelerometer_ignored"), 1);
  }
}

TEST(Madgwick, FindsTheNewTimeLineWhenTheClockIsSetBack) {
  MadgwickFilter filter;
  SimulatedImu sim;
  for (int i = 0; i < 100; ++i) {
    sim.step(hand_held_rate(i * 0.005));
    feed(filter, sim);
  }
  sim.time_ns -= 3'600'000'000'000;
  int skipped = 0;
  for (int i = 100; i < 200; ++i) {
    sim.step(hand_held_rate(i * 0.005));
    feed(filter, sim);
    if (filter.status() & kTimeNotIncreasing && !(filter.status() & kReinitialised)) ++skipped;
  }
  EXPECT_EQ(skipped, 19);
  EXPECT_EQ(count_of(filter, "imu.clock_set_back"), 1);
  EXPECT_LT(error_deg(filter, sim), 1);
  EXPECT_NE(filter.estimate().valid & kValidHeading, 0U);
  // One absurd time is no time line: the filter comes back by the same way.
  ImuMeasurement ahead = sim.imu;
  ahead.time_ns += 3'600'000'000'000;
  filter.update(ahead);
  for (int i = 200; i < 300; ++i) {
    sim.step(hand_held_rate(i * 0.005));
    feed(filter, sim);
  }
  EXPECT_LT(error_deg(filter, sim), 1);
}

TEST(Madgwick, FreeFallIsNoDirection) {
  MadgwickFilter filter;
  SimulatedImu sim;
  sim.imu.time_ns = 1;
  sim.imu.angular_velocity.setZero();
  sim.imu.specific_force.setZero();
  EXPECT_EQ(filter.update(sim.imu), static_cast<std::uint32_t>(kAccelerometerIgnored) | kInitialising);
  EXPECT_FALSE(filter.initialised());
  sim.step(Eigen::Vector3d::Zero());
  filter.update(sim.imu);
  sim.step(Eigen::Vector3d::Zero(), {0, 0, -9.80665});
  EXPECT_TRUE(filter.update(sim.imu) & kAccelerometerIgnored);
}

TEST(Madgwick, StartsAnewAfterAGapButKeepsTheBias) {
  for (const char* preset : {"report", "robust"}) {
    MadgwickOptions options = MadgwickOptions::preset(preset);
    options.rest_bias = true;
    MadgwickFilter filter(options);
    SimulatedImu sim;
    sim.gyroscope_bias = {0.01, 0, 0};
    for (int i = 0; i < 1000; ++i) {
      sim.step(Eigen::Vector3d::Zero());
      feed(filter, sim);
    }
    sim.time_ns += 5'000'000'000;
    sim.q_world_body = Eigen::Quaterniond(Eigen::AngleAxisd(2, Eigen::Vector3d(1, 2, 3).normalized()));
    // Turning, so that nothing may be integrated over the gap.
    sim.step({0.5, 0.1, -0.3});
    feed(filter, sim);
    EXPECT_EQ(filter.status(), static_cast<std::uint32_t>(kGap) | kReinitialised) << preset;
    EXPECT_LT(error_deg(filter, sim), 1e-3) << preset;
    EXPECT_NEAR(filter.gyroscope_bias().x(), 0.01, 1e-6);
    EXPECT_EQ(count_of(filter, "imu.gaps"), 1);
  }
}

TEST(Madgwick, AGapIsNotARest) {
  MadgwickFilter filter(MadgwickOptions::robust());
  SimulatedImu sim;
  for (int i = 0; i < 200; ++i) {
    sim.step(hand_held_rate(i * 0.005));
    feed(filter, sim);
  }
  const Eigen::Vector3d bias = filter.gyroscope_bias();
  sim.time_ns += 2'000'000'000;
  sim.step({0.03, 0, 0});
  feed(filter, sim);
  EXPECT_FALSE(filter.status() & kAtRest);
  EXPECT_EQ(filter.gyroscope_bias(), bias);
}

TEST(Madgwick, HeadingIsNotValidForEverWithoutTheField) {
  MadgwickFilter filter;
  SimulatedImu sim;
  for (int i = 0; i < 200 * 80; ++i) {
    sim.step(hand_held_rate(i * 0.005));
    if (i < 200) filter.update(sim.magnetometer);
    filter.update(sim.imu);
    if (i == 200 * 30) {
      EXPECT_NE(filter.estimate().valid & kValidHeading, 0U);
    }
  }
  EXPECT_EQ(filter.estimate().valid, static_cast<std::uint32_t>(kValidOrientation));
}

TEST(Madgwick, NothingIsKnownBeforeTheFirstSample) {
  const Estimate estimate = MadgwickFilter().estimate();
  EXPECT_EQ(estimate.valid, 0U);
  EXPECT_TRUE(estimate.q_world_body.coeffs().array().isNaN().all());
  EXPECT_TRUE(estimate.angular_velocity.array().isNaN().all());
}

TEST(Madgwick, ADeadAccelerometerSaysNothingAboutTheBias) {
  MadgwickFilter filter(MadgwickOptions::robust());
  SimulatedImu sim;
  sim.gyroscope_bias.setConstant(0.02);
  for (int i = 0; i < 200 * 60; ++i) {
    sim.step(hand_held_rate(i * 0.005));
    if (i > 0) sim.imu.specific_force.setZero();
    filter.update(sim.imu);
  }
  EXPECT_EQ(filter.estimate().valid & kValidGyroscopeBias, 0U);
  EXPECT_EQ(filter.gyroscope_bias().norm(), 0);
}

TEST(Madgwick, ExtremeTimesDoNotOverflow) {
  MadgwickFilter filter;
  SimulatedImu sim;
  sim.step(Eigen::Vector3d::Zero());
  for (const TimeNs time : {std::numeric_limits<TimeNs>::min() + 1, TimeNs{0}, std::numeric_limits<TimeNs>::max()}) {
    sim.imu.time_ns = sim.magnetometer.time_ns = time;
    feed(filter, sim);
    EXPECT_TRUE(filter.orientation().coeffs().allFinite());
  }
}

TEST(Madgwick, NoInputMakesTheStateNotFinite) {
  Random random(11);
  const std::vector<double> values = {0,   -0.0, 1e-300, 1e-12, 1e-6, 1,         -9.8,      50,
                                      1e5, 1e6,  1e154,  1e300, kNaN, kInfinity, -kInfinity};
  const auto any = [&] {
    return values[static_cast<std::size_t>(random.uniform() * static_cast<double>(values.size()))];
  };
  const auto any3 = [&] {
    Eigen::Vector3d v = random.normal3();
    if (random.uniform() < 0.4) {
      for (double& x : v) x = any();
    }
    return v;
  };
  for (MadgwickOptions options : {MadgwickOptions::report(), MadgwickOptions::robust()}) {
    for (const double alpha : {kInfinity, 1.5}) {
      options.alpha = alpha;
      MadgwickFilter filter(options);
      TimeNs time = 0;
      for (int i = 0; i < 100000; ++i) {
        time += static_cast<TimeNs>(random.uniform(-1e6, random.uniform() < 0.01 ? 2e9 : 2e7));
        ImuMeasurement imu;
        MagnetometerMeasurement magnetometer;
        imu.time_ns = magnetometer.time_ns = time;
        imu.angular_velocity = any3();
        imu.specific_force = any3();
        magnetometer.magnetic_field = any3();
        if (random.uniform() < 0.5) filter.update(magnetometer);
        filter.update(imu);
        ASSERT_NEAR(filter.orientation().norm(), 1, 1e-12) << i;
        ASSERT_TRUE(filter.gyroscope_bias().allFinite()) << i;
      }
    }
  }
}

TEST(Madgwick, ResetForgetsThePastButNotTheCounts) {
  MadgwickFilter filter(MadgwickOptions::robust());
  MadgwickFilter fresh(MadgwickOptions::robust());
  SimulatedImu sim;
  for (int i = 0; i < 500; ++i) {
    sim.step(hand_held_rate(i * 0.005));
    feed(filter, sim);
  }
  filter.reset();
  EXPECT_FALSE(filter.initialised());
  EXPECT_EQ(filter.counts().front().value, 500);
  sim.time_ns = 0;
  for (int i = 0; i < 500; ++i) {
    sim.step(hand_held_rate(i * 0.005));
    feed(filter, sim);
    feed(fresh, sim);
    ASSERT_EQ(filter.orientation().coeffs(), fresh.orientation().coeffs());
  }
}

TEST(Madgwick, RefusesOptionsOutOfRangeByName) {
  const auto message = [](auto change) -> std::string {
    MadgwickOptions options;
    change(options);
    try {
      MadgwickFilter filter(options);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(message([](MadgwickOptions& o) { o.beta = -1; }).find("beta = -1"), std::string::npos);
  EXPECT_NE(message([](MadgwickOptions& o) { o.beta = kNaN; }).find("beta"), std::string::npos);
  EXPECT_NE(message([](MadgwickOptions& o) { o.alpha = 1; }).find("alpha = 1"), std::string::npos);
  EXPECT_NE(message([](MadgwickOptions& o) { o.gradient_phase = 2; }).find("gradient_phase"), std::string::npos);
  EXPECT_NE(message([](MadgwickOptions& o) { o.max_gap_s = 0; }).find("max_gap_s"), std::string::npos);
  EXPECT_THROW(MadgwickOptions::preset("best"), std::invalid_argument);
  EXPECT_THROW(parse_world_frame("EUN"), std::invalid_argument);
  EXPECT_EQ(parse_world_frame("ned"), WorldFrame::kNed);
}

TEST(Madgwick, BetaFromGyro) {
  ImuNoise noise;
  noise.gyroscope_noise_density = 1e-3;
  // 0.01 rad/s of noise a sample at 100 Hz
  EXPECT_NEAR(beta_from_gyro(noise, 0, 0, 0, 0.01), std::sqrt(0.75) * 0.01, 1e-15);
  EXPECT_NEAR(beta_from_gyro(noise, 0.03, 0.01, 4, 0.01), std::sqrt(0.75 * (1e-4 + 9e-4 + 16e-4)), 1e-15);
  EXPECT_THROW(beta_from_gyro(noise, -1, 0, 0, 0.01), std::invalid_argument);
  EXPECT_THROW(beta_from_gyro(noise, 0, 0, 0, 0), std::invalid_argument);
}

}  // namespace
}  // namespace loc
