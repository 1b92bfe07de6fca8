#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "libloc/estimators/madgwick.hpp"
#include "support/simulated_imu.hpp"

namespace loc {
namespace {

using test::SimulatedImu;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDegree = std::numbers::pi / 180;

double error_deg(const MadgwickFilter& filter, const SimulatedImu& sim) {
  return so3::angle_between(filter.orientation(), sim.q_world_body) / kDegree;
}

double tilt_error_deg(const MadgwickFilter& filter, const SimulatedImu& sim) {
  const Eigen::Quaterniond e = filter.orientation() * sim.q_world_body.conjugate();
  return 2 * std::atan2(std::hypot(e.x(), e.y()), std::hypot(e.w(), e.z())) / kDegree;
}

void feed(MadgwickFilter& filter, const SimulatedImu& sim) {
  filter.update(sim.magnetometer);
  filter.update(sim.imu);
}

Eigen::Vector3d hand_held_rate(double t) {
  return {1.2 * std::sin(1.1 * t), 0.9 * std::cos(0.7 * t + 1), 0.8 * std::sin(0.5 * t + 2)};
}

Eigen::Vector3d field_of(WorldFrame world) {
  switch (world) {
    case WorldFrame::kEnu:
      return {0, 20e-6, -40e-6};
    case WorldFrame::kNwu:
      return {20e-6, 0, -40e-6};
    case WorldFrame::kNed:
      return {20e-6, 0, 40e-6};
  }
  return {};
}

SimulatedImu simulated(WorldFrame world) {
  SimulatedImu sim;
  sim.field = field_of(world);
  if (world == WorldFrame::kNed) sim.gravity_reaction.z() = -9.80665;
  return sim;
}

TEST(Madgwick, StartsAtTheTrueAttitudeInEveryFrame) {
  Random random(3);
  for (const WorldFrame world : {WorldFrame::kEnu, WorldFrame::kNwu, WorldFrame::kNed}) {
    for (int i = 0; i < 100; ++i) {
      SimulatedImu sim = simulated(world);
      sim.q_world_body = random.rotation();
      MadgwickOptions options;
      options.world = world;
      MadgwickFilter filter(options);
      sim.step(Eigen::Vector3d::Zero());
      feed(filter, sim);
      EXPECT_LT(error_deg(filter, sim), 1e-5) << world_frame_name(world);
      EXPECT_EQ(filter.estimate().valid, static_cast<std::uint32_t>(kValidOrientation) | kValidHeading);
    }
  }
}

TEST(Madgwick, UpsideDownAndSidewaysStartsAreFine) {
  for (const Eigen::Vector3d& force : {Eigen::Vector3d(0, 0, -9.8), Eigen::Vector3d(9.8, 0, 0)}) {
    MadgwickFilter filter;
    ImuMeasurement imu;
    imu.time_ns = 0;
    imu.angular_velocity.setZero();
    imu.specific_force = force;
    filter.update(imu);
    EXPECT_LT((filter.orientation() * force.normalized() - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  }
}

// The step as the report writes it, with a numeric gradient: shares nothing with the filter's closed form.
Eigen::Vector4d report_step(const Eigen::Vector4d& q_wxyz, const Eigen::Vector3d& rate, const Eigen::Vector3d& force,
                            const Eigen::Vector3d& field, const Eigen::Vector3d& up, const Eigen::Vector3d& north,
                            double beta, double alpha, double dt) {
  const auto quaternion = [](const Eigen::Vector4d& v) {
    const Eigen::Vector4d u = v.normalized();
    return Eigen::Quaterniond(u[0], u[1], u[2], u[3]);
  };
  const Eigen::Vector3d a = force.normalized();
  const Eigen::Vector3d m = field.normalized();
  const Eigen::Vector3d h = quaternion(q_wxyz) * m;
  const double vertical = h.dot(up);
  const Eigen::Vector3d b = std::sqrt(1 - vertical * vertical) * north + vertical * up;
  const auto objective = [&](const Eigen::Vector4d& v) {
    const Eigen::Quaterniond inverse = quaternion(v).conjugate();
    return 0.5 * ((inverse * up - a).squaredNorm() + (inverse * b - m).squaredNorm());
  };
  // objective() normalises its argument, so the gradient lies in the tangent space.
  Eigen::Vector4d gradient;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector4d d = 1e-6 * Eigen::Vector4d::Unit(i);
    gradient[i] = (objective(q_wxyz + d) - objective(q_wxyz - d)) / 2e-6;
  }
  gradient.normalize();
  const Eigen::Quaterniond q_omega_q = quaternion(q_wxyz) * so3::exp(rate * dt);
  const Eigen::Vector4d q_omega(q_omega_q.w(), q_omega_q.x(), q_omega_q.y(), q_omega_q.z());
  if (std::isinf(alpha)) return (q_omega - beta * dt * gradient).normalized();
  const double mu = alpha * 0.5 * rate.norm() * dt;
  const double a1 = 1 - beta * dt / (beta * dt + mu);
  const double a2 = 1 - mu / (beta * dt + mu);
  return (a1 * q_omega + a2 * (q_wxyz - mu * gradient)).normalized();
}

TEST(Madgwick, ReportFormMatchesTheReportsFormulas) {
  Random random(5);
  for (const double alpha : {kInfinity, 3.0}) {
    for (const WorldFrame world : {WorldFrame::kEnu, WorldFrame::kNwu, WorldFrame::kNed}) {
      MadgwickOptions options = MadgwickOptions::report();
      options.alpha = alpha;
      options.world = world;
      options.beta = 0.5;
      const Eigen::Vector3d up(0, 0, world == WorldFrame::kNed ? -1 : 1);
      const Eigen::Vector3d north = world == WorldFrame::kEnu ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
      for (int i = 0; i < 50; ++i) {
        MadgwickFilter filter(options);
        SimulatedImu sim = simulated(world);
        // So short that terms of second order in dt vanish.
        sim.dt_ns = 10'000;
        const double dt = to_seconds(sim.dt_ns);
        sim.q_world_body = random.rotation();
        sim.step(Eigen::Vector3d::Zero());
        feed(filter, sim);
        // Anything but consistent with the attitude, so that every term of the gradient counts.
        sim.step(random.normal3());
        sim.imu.specific_force += 3 * random.normal3();
        sim.magnetometer.magnetic_field += 8e-6 * random.normal3();
        const Eigen::Quaterniond q = filter.orientation();
        const Eigen::Vector4d expected =
            report_step({q.w(), q.x(), q.y(), q.z()}, sim.imu.angular_velocity, sim.imu.specific_force,
                        sim.magnetometer.magnetic_field, up, north, options.beta, alpha, dt);
        feed(filter, sim);
        const Eigen::Quaterniond& p = filter.orientation();
        EXPECT_LT((Eigen::Vector4d(p.w(), p.x(), p.y(), p.z()) - expected).norm(), 1e-4 * options.beta * dt)
            << world_frame_name(world) << " alpha " << alpha << " case " << i;
      }
    }
  }
}

TEST(Madgwick, FiniteAlphaWeakensTheGyroscope) {
  // gamma of the step goes to the old attitude: a turn is followed with mu / (beta dt + mu) only.
  MadgwickOptions options;
  options.alpha = 2;
  MadgwickFilter weak(options);
  options.alpha = 1000;
  MadgwickFilter strong(options);
  SimulatedImu sim;
  sim.field.setZero();
  for (int i = 0; i < 200; ++i) {
    sim.step({0, 0, 0.1});
    weak.update(sim.imu);
    strong.update(sim.imu);
  }
  const double turned = 0.1 * 0.995;
  EXPECT_NEAR(so3::heading(strong.orientation()) / turned, 0.1 * 1000 / 2 / (0.1 + 0.1 * 1000 / 2), 0.01);
  EXPECT_NEAR(so3::heading(weak.orientation()) / turned, 0.1 * 2 / 2 / (0.1 + 0.1 * 2 / 2), 0.01);
}

TEST(Madgwick, AllFramesDescribeTheSameAttitude) {
  const Eigen::Quaterniond q_enu_ned(0, std::numbers::sqrt2 / 2, std::numbers::sqrt2 / 2, 0);
  const Eigen::Quaterniond q_enu_nwu(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()));
  for (MadgwickOptions options : {MadgwickOptions::report(), MadgwickOptions::robust()}) {
    SimulatedImu sim;
    sim.sigma_gyroscope = 0.01;
    sim.sigma_accelerometer = 0.5;
    sim.sigma_magnetometer = 2e-6;
    MadgwickFilter enu(options);
    options.world = WorldFrame::kNwu;
    MadgwickFilter nwu(options);
    options.world = WorldFrame::kNed;
    MadgwickFilter ned(options);
    for (int i = 0; i < 2000; ++i) {
      sim.step(hand_held_rate(i * 0.005));
      for (MadgwickFilter* filter : {&enu, &nwu, &ned}) feed(*filter, sim);
    }
    EXPECT_LT(so3::angle_between(enu.orientation(), q_enu_nwu * nwu.orientation()), 1e-9);
    EXPECT_LT(so3::angle_between(enu.orientation(), q_enu_ned * ned.orientation()), 1e-9);
  }
}

TEST(Madgwick, TracksNoisyMotion) {
  for (const char* preset : {"report", "robust"}) {
    MadgwickFilter filter(MadgwickOptions::preset(preset));
    SimulatedImu sim;
    sim.sigma_gyroscope = 0.005;
    sim.sigma_accelerometer = 0.05;
    sim.sigma_magnetometer = 0.3e-6;
    double sum = 0;
    const int n = 12000;
    for (int i = 0; i < n; ++i) {
      sim.step(hand_held_rate(i * 0.005));
      feed(filter, sim);
      sum += std::pow(error_deg(filter, sim), 2);
    }
    EXPECT_LT(std::sqrt(sum / n), 1.0) << preset;
  }
}

TEST(Madgwick, LeavesEverySaddle) {
  // Exactly opposite directions: the gradient is zero there, and only there.
  for (const char* preset : {"report", "robust"}) {
    for (const Eigen::Vector3d& axis :
         {Eigen::Vector3d(Eigen::Vector3d::UnitX()), Eigen::Vector3d(Eigen::Vector3d::UnitZ())}) {
      MadgwickOptions options = MadgwickOptions::preset(preset);
      options.beta = 0.5;
      options.magnetic_rejection = false;
      MadgwickFilter filter(options);
      SimulatedImu sim;
      sim.step(Eigen::Vector3d::Zero());
      feed(filter, sim);
      sim.q_world_body = Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, axis));
      for (int i = 0; i < 6000; ++i) {
        sim.step(Eigen::Vector3d::Zero());
        feed(filter, sim);
      }
      EXPECT_LT(error_deg(filter, sim), 1) << preset << " about " << axis.transpose();
    }
  }
}

TEST(Madgwick, PerfectInputStaysPerfect) {
  MadgwickFilter filter;
  SimulatedImu sim;
  for (int i = 0; i < 100; ++i) {
    sim.step(Eigen::Vector3d::Zero());
    feed(filter, sim);
    ASSERT_TRUE(filter.orientation().coeffs().allFinite());
    ASSERT_LT(error_deg(filter, sim), 1e-6);
  }
}

TEST(Madgwick, EstimatesTheBiasAtRestAndKeepsItInMotion) {
  MadgwickFilter filter(MadgwickOptions::robust());
  SimulatedImu sim;
  sim.gyroscope_bias = {0.01, -0.02, 0.015};
  sim.sigma_gyroscope = 0.003;
  sim.sigma_accelerometer = 0.03;
  for (int i = 0; i < 1000; ++i) {
    sim.step(Eigen::Vector3d::Zero());
    feed(filter, sim);
    if (i == 150) {
      EXPECT_EQ(filter.estimate().valid & kValidGyroscopeBias, 0U);
    }
  }
  EXPECT_TRUE(filter.status() & kAtRest);
  EXPECT_LT((filter.gyroscope_bias() - sim.gyroscope_bias).norm(), 5e-4);
  const Eigen::Vector3d at_rest = filter.gyroscope_bias();
  for (int i = 0; i < 1000; ++i) {
    sim.step(hand_held_rate(i * 0.005));
    feed(filter, sim);
  }
  EXPECT_FALSE(filter.status() & kAtRest);
  EXPECT_LT((filter.gyroscope_bias() - at_rest).norm(), 5e-3);
  EXPECT_LT((filter.estimate().angular_velocity - hand_held_rate(999 * 0.005)).norm(), 0.03);
}

TEST(Madgwick, EstimatesTheBiasInMotion) {
  // Never at rest, and turning about all axes, so that every axis of the gyroscope is horizontal at times.
  double error[2];
  for (const bool motion_bias : {false, true}) {
    MadgwickOptions options = MadgwickOptions::robust();
    options.motion_bias = motion_bias;
    MadgwickFilter filter(options);
    SimulatedImu sim;
    sim.gyroscope_bias = {0.01, -0.02, 0.015};
    sim.sigma_gyroscope = 0.003;
    sim.sigma_accelerometer = 0.3;
    for (int i = 0; i < 200 * 180; ++i) {
      sim.step(hand_held_rate(i * 0.005));
      filter.update(sim.imu);
    }
    EXPECT_FALSE(filter.status() & kAtRest);
    EXPECT_EQ((filter.estimate().valid & kValidGyroscopeBias) != 0, motion_bias);
    error[motion_bias ? 1 : 0] = (filter.gyroscope_bias() - sim.gyroscope_bias).norm();
  }
  EXPECT_GT(error[0], 0.02);
  EXPECT_LT(error[1], 0.004);
}

TEST(Madgwick, ASlowTurnIsNotABias) {
  MadgwickFilter filter(MadgwickOptions::robust());
  SimulatedImu sim;
  for (int i = 0; i < 4000; ++i) {
    sim.step({0, 0, 0.05});
    filter.update(sim.imu);
  }
  EXPECT_EQ(filter.gyroscope_bias().norm(), 0);
}

TEST(Madgwick, RejectsAMagnetThatPasses) {
  for (const bool rejection : {true, false}) {
    MadgwickOptions options = MadgwickOptions::robust();
    options.magnetic_rejection = rejection;
    MadgwickFilter filter(options);
    SimulatedImu sim;
    const Eigen::Vector3d earth = sim.field;
    for (int i = 0; i < 6000; ++i) {
      sim.step(hand_held_rate(i * 0.005));
      feed(filter, sim);
    }
    sim.field = earth + Eigen::Vector3d(30e-6, 0, 0);
    for (int i = 6000; i < 8000; ++i) {
      sim.step(hand_held_rate(i * 0.005));
      feed(filter, sim);
      EXPECT_EQ((filter.status() & kMagnetometerDisturbed) != 0, rejection);
    }
    if (rejection) {
      EXPECT_LT(error_deg(filter, sim), 1);
    } else {
      EXPECT_GT(error_deg(filter, sim), 20);
    }
    // A field that stays is the new normal before long.
    for (int i = 8000; i < 8000 + 200 * 120; ++i) {
      sim.step(hand_held_rate(i * 0.005));
      feed(filter, sim);
    }
    EXPECT_FALSE(filter.status() & kMagnetometerDisturbed);
    EXPECT_NEAR(error_deg(filter, sim), std::atan2(30, 20) / kDegree, 3);
  }
}

TEST(Madgwick, LowPassedForceAveragesAccelerationOut) {
  double tilt[2];
  int k = 0;
  for (const double tau : {0.0, 1.5}) {
    // With the soft gradient: at a constant rate of correction the lag of the low-pass would make it swing.
    MadgwickOptions options = MadgwickOptions::robust();
    options.accelerometer_time_constant_s = tau;
    MadgwickFilter filter(options);
    SimulatedImu sim;
    double sum = 0;
    const int n = 6000;
    for (int i = 0; i < n; ++i) {
      const double t = i * 0.005;
      sim.step(hand_held_rate(t), {6 * std::sin(9 * t), 6 * std::cos(7 * t), 0});
      feed(filter, sim);
      if (i >= n / 3) sum += std::pow(tilt_error_deg(filter, sim), 2);
    }
    tilt[k++] = std::sqrt(sum / (n - n / 3.0));
  }
  EXPECT_LT(tilt[1], 0.5 * tilt[0]) << tilt[0] << " -> " << tilt[1];
}

TEST(Madgwick, AStartInMotionIsMendedSoon) {
  for (const double start_time : {5.0, 0.0}) {
    MadgwickOptions options = MadgwickOptions::robust();
    options.start_time_s = start_time;
    MadgwickFilter filter(options);
    SimulatedImu sim;
    for (int i = 0; i < 1000; ++i) {
      const double t = i * 0.005;
      sim.step(hand_held_rate(t), {6 * std::sin(9 * t), 6 * std::cos(7 * t), 0});
      feed(filter, sim);
      if (i == 0) {
        EXPECT_GT(tilt_error_deg(filter, sim), 25);
      }
    }
    if (start_time > 0) {
      EXPECT_LT(tilt_error_deg(filter, sim), 3);
      EXPECT_LT(error_deg(filter, sim), 6);
    } else {
      EXPECT_GT(tilt_error_deg(filter, sim), 10);
    }
  }
}

TEST(Madgwick, MagnetometerAtItsOwnRate) {
  // A sample is carried along by the gyroscope until the next: fast turns between samples do no harm.
  MadgwickFilter filter(MadgwickOptions::robust());
  SimulatedImu sim;
  for (int i = 0; i < 6000; ++i) {
    sim.step(3 * hand_held_rate(i * 0.005));
    if (i % 20 == 7) filter.update(sim.magnetometer);
    filter.update(sim.imu);
    if (i > 200) {
      ASSERT_LT(error_deg(filter, sim), 1.5) << i;
    }
  }
  EXPECT_FALSE(filter.status() & kMagnetometerMissing);
  for (int i = 0; i < 101; ++i) {
    sim.step(Eigen::Vector3d::Zero());
    filter.update(sim.imu);
  }
  EXPECT_TRUE(filter.status() & kMagnetometerMissing);
}

TEST(Madgwick, HeadingComesWithTheFirstMagnetometerSample) {
  MadgwickFilter filter;
  SimulatedImu sim;
  sim.q_world_body = Eigen::Quaterniond(Eigen::AngleAxisd(2, Eigen::Vector3d::UnitZ()));
  sim.step(Eigen::Vector3d::Zero());
  filter.update(sim.imu);
  EXPECT_EQ(filter.estimate().valid & kValidHeading, 0U);
  EXPECT_GT(error_deg(filter, sim), 90);
  sim.step(Eigen::Vector3d::Zero());
  feed(filter, sim);
  EXPECT_NE(filter.estimate().valid & kValidHeading, 0U);
  EXPECT_LT(error_deg(filter, sim), 0.1);
}

TEST(Madgwick, FieldAlongGravityOrZeroHasNoHeading) {
  for (const Eigen::Vector3d& field : {Eigen::Vector3d(0, 0, -50e-6), Eigen::Vector3d(0, 0, 0)}) {
    for (const char* preset : {"report", "robust"}) {
      MadgwickFilter filter(MadgwickOptions::preset(preset));
      SimulatedImu sim;
      sim.field = field;
      for (int i = 0; i < 500; ++i) {
        sim.step({0, 0, 0.2});
        feed(filter, sim);
        EXPECT_TRUE(filter.status() & kMagnetometerIgnored);
      }
      EXPECT_LT(tilt_error_deg(filter, sim), 1e-3);
      EXPECT_EQ(filter.estimate().valid & kValidHeading, 0U);
    }
  }
}

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

// Each criterion of rest and of magnetic rejection by itself.
TEST(Madgwick, RestNeedsACalmGyroscopeAndACalmAccelerometer) {
  for (const bool shake_gyroscope : {true, false}) {
    MadgwickFilter filter(MadgwickOptions::robust());
    SimulatedImu sim;
    for (int i = 0; i < 2000; ++i) {
      const double sign = i / 20 % 2 == 0 ? 1 : -1;
      sim.step(Eigen::Vector3d::Zero());
      if (shake_gyroscope) {
        sim.imu.angular_velocity.x() += sign * 0.1;
      } else {
        sim.imu.specific_force.x() += sign * 1.5;
      }
      filter.update(sim.imu);
      EXPECT_FALSE(filter.status() & kAtRest);
    }
  }
}

TEST(Madgwick, RejectsByNormAloneAndByDipAlone) {
  const double dip = std::atan2(40, 20);
  const std::vector<Eigen::Vector3d> disturbed = {
      1.2 * Eigen::Vector3d(0, 20e-6, -40e-6),
      std::sqrt(2000e-12) * Eigen::Vector3d(0, std::cos(dip - 0.25), -std::sin(dip - 0.25))};
  // With a start that is shorter than the time constant of the force, and with none.
  for (const double start_time : {5.0, 1.0, 0.0}) {
    for (const Eigen::Vector3d& field : disturbed) {
      MadgwickOptions options = MadgwickOptions::robust();
      options.start_time_s = start_time;
      MadgwickFilter filter(options);
      SimulatedImu sim;
      const Eigen::Vector3d earth = sim.field;
      for (int i = 0; i < 200 * 40; ++i) {
        sim.field = i < 200 * 30 ? earth : field;
        sim.step(hand_held_rate(i * 0.005));
        feed(filter, sim);
        ASSERT_EQ((filter.status() & kMagnetometerDisturbed) != 0, i >= 200 * 30) << start_time << " " << i;
      }
    }
  }
}

TEST(Madgwick, AFieldThatIsNeverSteadyIsAcceptedInTheEnd) {
  MadgwickOptions options = MadgwickOptions::robust();
  options.magnetic_max_rejection_s = 10;
  MadgwickFilter filter(options);
  SimulatedImu sim;
  const Eigen::Vector3d earth = sim.field;
  int rejected = 0;
  for (int i = 0; i < 200 * 60; ++i) {
    // After 30 s the norm jumps too far and too often for any candidate.
    if (i >= 200 * 30) sim.field = earth * (i / 100 % 2 == 0 ? 1.3 : 1.6);
    sim.step(hand_held_rate(i * 0.005));
    feed(filter, sim);
    if (filter.status() & kMagnetometerDisturbed) ++rejected;
    if (i == 200 * 39) {
      EXPECT_GT(rejected, 200 * 8);
    }
  }
  EXPECT_GT(rejected, 200 * 9);
  EXPECT_LT(rejected, 200 * 29);
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
