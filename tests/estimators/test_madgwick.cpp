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
using test::kDegree;
using test::SimulatedImu;
using test::tilt_error_deg;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

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

TEST(Madgwick, AtRestTheHeadingIsCalmSoonAfterTheStart) {
  // The field's own heading scatters by 2.9 degrees.
  MadgwickFilter filter(MadgwickOptions::robust());
  SimulatedImu sim;
  sim.sigma_magnetometer = 1e-6;
  double sum = 0;
  int n = 0;
  for (int i = 0; i < 300; ++i) {
    sim.step(Eigen::Vector3d::Zero());
    feed(filter, sim);
    if (i < 60) continue;
    sum += std::pow(error_deg(filter, sim), 2);
    ++n;
  }
  EXPECT_LT(std::sqrt(sum / n), 0.8);
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

}  // namespace
}  // namespace loc
