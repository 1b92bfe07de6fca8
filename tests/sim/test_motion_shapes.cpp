// Analytic motions, those on the ground, and motions made of others.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "libloc/sim/composed_motion.hpp"
#include "libloc/sim/ground_motion.hpp"
#include "libloc/sim/shape_motion.hpp"
#include "libloc/sim/waypoint_motion.hpp"
#include "tests/support/motion_checks.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using std::numbers::pi;
using test::near;
using test::thrown_text;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Pose3 some_pose() {
  return {so3::exp({0.3, -0.5, 1.2}), {3, -2, 1}};
}

std::vector<double> phase_times(const GroundCourseOptions& o) {
  std::vector<double> times = {0};
  for (int cycle = 0; cycle < o.cycles; ++cycle) {
    for (const GroundPhase& phase : o.phases) times.push_back(times.back() + phase.duration_s);
  }
  return times;
}

TEST(ShapeMotion, DerivativesAreConsistent) {
  const auto check = [](const Motion& motion) {
    test::check_derivatives(motion, test::spread_times(100, 200));
    test::check_time_bounds(motion);
  };
  check(RestMotion({some_pose()}));
  check(CircleMotion({{1, 2, 3}, 4, 3, 0.7}));
  check(CircleMotion({{1, 2, 3}, 4, -3, 0.7}));
  check(FigureEightMotion({{1, 2, 3}, 20, 12, 2, 15}));
  HandHeldOptions hand;
  hand.T_world_mean = some_pose();
  check(HandHeldMotion(hand, Random(1)));
  hand.scale = 5;
  check(HandHeldMotion(hand, Random(2)));
}

TEST(ShapeMotion, RestIsAtRest) {
  const MotionState s = RestMotion({some_pose()}).at(1e6);
  EXPECT_TRUE(near(s.T_world_body.matrix(), some_pose().matrix(), 0));
  EXPECT_EQ(s.velocity, Vector3d::Zero());
  EXPECT_EQ(s.angular_velocity, Vector3d::Zero());
}

TEST(ShapeMotion, CircleInClosedForm) {
  const CircleMotion circle({{1, 2, 3}, 4, 2, 0});
  const MotionState s = circle.at(pi);  // a quarter of the round of 4 pi seconds
  EXPECT_TRUE(near(s.T_world_body.translation, Vector3d(1, 6, 3), 1e-12));
  EXPECT_TRUE(near(s.velocity, Vector3d(-2, 0, 0), 1e-12));
  EXPECT_TRUE(near(s.acceleration, Vector3d(0, -1, 0), 1e-12));
  EXPECT_TRUE(near(s.angular_velocity, Vector3d(0, 0, 0.5), 1e-12));
  EXPECT_NEAR(std::abs(so3::heading(s.T_world_body.rotation)), pi, 1e-12);
  // Clockwise: the body still looks where it goes.
  const MotionState other = CircleMotion({{1, 2, 3}, 4, -2, 0}).at(1);
  EXPECT_TRUE(near(other.T_world_body.rotation.conjugate() * other.velocity, Vector3d(2, 0, 0), 1e-12));
  EXPECT_LT(other.angular_velocity.z(), 0);
}

TEST(ShapeMotion, FigureEightCrossesItsCentreAndLooksAhead) {
  const FigureEightMotion eight({{1, 2, 3}, 20, 12, 2, 16});
  for (const double t : {0.0, 8.0, 16.0}) {
    EXPECT_TRUE(near(eight.at(t).T_world_body.translation, Vector3d(1, 2, 3), 1e-12));
  }
  EXPECT_TRUE(near(eight.at(4).T_world_body.translation, Vector3d(11, 2, 4), 1e-12));
  EXPECT_TRUE(
      near(eight.at(2).T_world_body.translation, Vector3d(1 + 10 * std::sqrt(0.5), 8, 3 + std::sqrt(0.5)), 1e-12));
  for (const double t : test::spread_times(16, 50)) {
    const MotionState s = eight.at(t);
    const Vector3d in_body = s.T_world_body.rotation.conjugate() * s.velocity;
    EXPECT_GT(in_body.x(), 0);
    EXPECT_NEAR(in_body.y(), 0, 1e-12);
  }
}

TEST(HandHeldMotion, HasTheStrengthAskedForInAllAxes) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const HandHeldMotion motion(HandHeldOptions{}, Random(seed));
    Vector3d rate2 = Vector3d::Zero();
    Vector3d acceleration2 = Vector3d::Zero();
    constexpr int kCount = 6000;
    for (int i = 0; i < kCount; ++i) {
      const MotionState s = motion.at(0.01 * i);
      rate2 += s.angular_velocity.cwiseAbs2() / kCount;
      acceleration2 += s.acceleration.cwiseAbs2() / kCount;
    }
    EXPECT_NEAR(std::sqrt(rate2.sum()), 0.9, 0.09) << seed;
    EXPECT_NEAR(std::sqrt(acceleration2.sum()), 1.5, 0.15) << seed;
    EXPECT_GT(rate2.minCoeff(), 0.15 * rate2.sum()) << seed;
    EXPECT_GT(acceleration2.minCoeff(), 0.25 * acceleration2.sum()) << seed;
  }
}

TEST(HandHeldMotion, SeedScaleAndSwitches) {
  HandHeldOptions o;
  const HandHeldMotion all(o, Random(7));
  test::check_same(all, HandHeldMotion(o, Random(7)), test::spread_times(60, 30));
  EXPECT_GT((all.at(5).T_world_body.translation - HandHeldMotion(o, Random(8)).at(5).T_world_body.translation).norm(),
            1e-3);
  o.scale = 0.1;
  const MotionState small = HandHeldMotion(o, Random(7)).at(5);
  EXPECT_TRUE(near(small.T_world_body.translation, 0.1 * all.at(5).T_world_body.translation, 1e-15));
  EXPECT_TRUE(near(small.acceleration, 0.1 * all.at(5).acceleration, 1e-13));

  // One axis of rotation only: degenerate on purpose; the axes that are left are as they were.
  o = {};
  o.rotates = {false, false, true};
  o.moves = {true, false, true};
  const HandHeldMotion some(o, Random(7));
  for (const double t : test::spread_times(60, 30)) {
    const MotionState s = some.at(t);
    EXPECT_EQ(s.angular_velocity.x(), 0);
    EXPECT_EQ(s.angular_velocity.y(), 0);
    EXPECT_NE(s.angular_velocity.z(), 0);
    EXPECT_EQ(s.T_world_body.translation.y(), 0);
    EXPECT_EQ(s.T_world_body.translation.x(), all.at(t).T_world_body.translation.x());
    EXPECT_EQ(s.acceleration.z(), all.at(t).acceleration.z());
  }
  // None at all: rest.
  o.rotates = o.moves = {false, false, false};
  EXPECT_EQ(HandHeldMotion(o, Random(7)).at(3).velocity, Vector3d::Zero());
}

TEST(GroundMotion, DerivativesAreConsistentAndContinuous) {
  const auto check = [](const Motion& motion, const std::vector<double>& times) {
    test::check_derivatives(motion, test::spread_times(motion.duration_s(), 300));
    // The jerk jumps between phases, which differences across feel.
    test::MotionCheck beside;
    beside.breaks_s = times;
    test::check_derivatives(motion, test::times_around(times, motion.duration_s()), beside);
    test::check_continuity(motion, times, true);
    test::check_time_bounds(motion);
  };
  check(CarMotion(), phase_times(CarOptions().course));
  check(PedestrianMotion(), phase_times(PedestrianOptions().course));
  PedestrianOptions no_glances;
  no_glances.head_turn_rad = 0;
  check(PedestrianMotion(no_glances), {});
  CarOptions other;
  other.course = {};
  other.course.start = {10, 20, 30};
  other.course.course_rad = 2;
  other.course.speed_mps = 3;
  other.course.phases = {{4, 8, 1}, {2, 8, -3}, {3, 0, 0.5}};
  check(CarMotion(other), phase_times(other.course));
}

TEST(GroundMotion, PositionIsTheIntegralOfVelocity) {
  CarOptions o;
  o.course = {};
  o.course.start = {10, 20, 30};
  o.course.course_rad = 2;
  o.course.speed_mps = 3;
  o.course.phases = {{4, 8, 1}, {2, 8, -4.5}, {3, 0, 0.5}};
  const CarMotion car(o);
  for (const double end : {3.0, 5.0, 6.0, 8.5, 9.0}) {
    // Simpson's rule, phase by phase.
    Vector3d sum = o.course.start;
    const std::vector<double> times = phase_times(o.course);
    for (std::size_t i = 0; i + 1 < times.size() && times[i] < end; ++i) {
      constexpr int kSteps = 2000;
      const double length = std::min(times[i + 1], end) - times[i];
      for (int k = 0; k <= kSteps; ++k) {
        const double weight = k == 0 || k == kSteps ? 1 : (k % 2 == 1 ? 4 : 2);
        sum += weight * length / kSteps / 3 * car.at(times[i] + length * k / kSteps).velocity;
      }
    }
    EXPECT_TRUE(near(car.at(end).T_world_body.translation, sum, 1e-11)) << end;
  }
}

TEST(GroundMotion, CarAtRestIsExactlyAtRest) {
  const CarMotion car;
  EXPECT_DOUBLE_EQ(car.duration_s(), 91);
  const Vector3d place = car.at(0).T_world_body.translation;
  for (const double t : {0.0, 1.0, 2.0, 3.0}) {
    const MotionState s = car.at(t);
    EXPECT_EQ(s.T_world_body.translation, place);
    EXPECT_EQ(s.velocity, Vector3d::Zero());
    EXPECT_EQ(s.acceleration, Vector3d::Zero());
    EXPECT_EQ(s.angular_velocity, Vector3d::Zero());
    EXPECT_EQ(s.angular_acceleration, Vector3d::Zero());
  }
  const MotionState cruise = car.at(10);
  EXPECT_EQ(cruise.velocity, Vector3d(10, 0, 0));
  EXPECT_EQ(cruise.acceleration, Vector3d::Zero());
  // Round the block, four left turns, back where it was.
  const MotionState end = car.at(car.duration_s());
  EXPECT_TRUE(near(end.T_world_body.translation, place, 1e-10));
  EXPECT_LT(so3::angle_between(end.T_world_body.rotation, car.at(0).T_world_body.rotation), 1e-12);
  EXPECT_GT((car.at(45).T_world_body.translation - place).norm(), 100);
}

TEST(GroundMotion, PedestrianBobsWithItsStepsAndStandsStill) {
  PedestrianOptions o;
  o.head_turn_rad = 0;
  const PedestrianMotion walker(o);
  for (const double t : {0.0, 1.5, 3.0, 28.5, 30.9}) {
    const MotionState s = walker.at(t);
    EXPECT_EQ(s.velocity, Vector3d::Zero()) << t;
    EXPECT_EQ(s.acceleration, Vector3d::Zero()) << t;
    EXPECT_EQ(s.angular_velocity, Vector3d::Zero()) << t;
  }
  // Steps: maxima of the height while it walks with 1.4 m/s for 8 s: 8 * 1.4 / 0.74 = 15.1.
  int steps = 0;
  for (int i = 0; i < 800; ++i) {
    const double t = 4.5 + 0.01 * i;
    const auto climb = [&](double time) { return walker.at(time).velocity.z(); };
    if (climb(t) > 0 && climb(t + 0.01) <= 0) ++steps;
    EXPECT_NEAR(walker.at(t).T_world_body.translation.z(), 1.6, 0.02 + 1e-12);
  }
  EXPECT_NEAR(steps, 15, 1);
  // Glances: also while standing, alternately to both sides.
  const PedestrianMotion looking;
  EXPECT_EQ(looking.at(2.9).angular_velocity, Vector3d::Zero());
  EXPECT_NEAR(so3::heading(looking.at(3.5 + 1.25).T_world_body.rotation), 0.6, 0.02);
  EXPECT_NEAR(so3::heading(looking.at(10.5 + 1.25).T_world_body.rotation), -0.6, 0.02);
}

TEST(MountedMotion, LeverArmIsInVelocityAndAcceleration) {
  HandHeldOptions o;
  o.T_world_mean = some_pose();
  const auto body = std::make_shared<const HandHeldMotion>(o, Random(3));
  const Pose3 T_body_sensor = {so3::exp({1, -2, 0.5}), {0.3, -0.2, 0.5}};
  const MountedMotion sensor(body, T_body_sensor);
  test::check_derivatives(sensor, test::spread_times(60, 100));
  test::check_time_bounds(sensor);
  const MotionState s = sensor.at(3);
  EXPECT_TRUE(near(s.T_world_body.matrix(), (body->at(3).T_world_body * T_body_sensor).matrix(), 1e-15));
  // On a circle: an arm of one metre to the outside is one metre further out.
  const auto circle = std::make_shared<const CircleMotion>(CircleOptions{{0, 0, 0}, 4, 2, 0});
  const MountedMotion outside(circle, {Quaterniond::Identity(), {0, -1, 0}});
  EXPECT_NEAR(outside.at(1).velocity.norm(), 2.5, 1e-12);
  EXPECT_NEAR(outside.at(1).acceleration.norm(), 1.25, 1e-12);
}

TEST(RestFirstMotion, RestsThenEasesIntoTheMotion) {
  const auto drive = std::make_shared<const WaypointMotion>(example_drive());
  const RestFirstMotion motion(drive, {2, 3});
  EXPECT_DOUBLE_EQ(motion.duration_s(), 93.5);
  for (const double t : {0.0, 1.0, 2.0}) {
    EXPECT_EQ(motion.at(t).velocity, Vector3d::Zero());
    EXPECT_EQ(motion.at(t).acceleration, Vector3d::Zero());
    EXPECT_EQ(motion.at(t).T_world_body.translation, Vector3d::Zero());
  }
  EXPECT_TRUE(near(motion.at(5).velocity, Vector3d(10, 0, 0), 1e-12));
  EXPECT_TRUE(near(motion.at(5).T_world_body.translation, Vector3d(15, 0, 0), 1e-12));
  EXPECT_TRUE(near(motion.at(63.5).T_world_body.matrix(), drive->at(60).T_world_body.matrix(), 1e-11));
  EXPECT_NEAR(motion.motion_time_s(63.5), 60, 1e-12);
  EXPECT_EQ(motion.motion_time_s(93.5), 90);
  test::check_continuity(motion, {2, 5}, true);
  test::check_time_bounds(motion);

  const auto hand = std::make_shared<const HandHeldMotion>(HandHeldOptions{}, Random(3));
  const RestFirstMotion eased(hand, {1, 1.5});
  test::check_derivatives(eased, test::spread_times(10, 200));
  test::MotionCheck beside;
  beside.breaks_s = {1, 2.5};
  test::check_derivatives(eased, test::times_around(beside.breaks_s, 10), beside);
  test::check_continuity(eased, {1, 2.5}, true);
  test::check_time_bounds(eased);

  // A car that stands anyway needs no easing.
  const RestFirstMotion car(std::make_shared<const CarMotion>(), {5, 0});
  EXPECT_TRUE(near(car.at(15).velocity, Vector3d(10, 0, 0), 1e-12));
}

TEST(ShapeMotion, BadInputNamesFieldAndValue) {
  Pose3 scaled;
  scaled.rotation.coeffs() *= 2;
  EXPECT_EQ(thrown_text([&] { RestMotion{{scaled}}; }), "T_world_body: norm of the rotation = 2: must be 1");
  EXPECT_EQ(thrown_text([] { CircleMotion{{{0, 0, 0}, 0, 1, 0}}; }), "radius_m = 0: must be positive and finite");
  EXPECT_EQ(thrown_text([] { CircleMotion{{{0, kNan, 0}, 1, 1, 0}}; }), "center[1] = nan: must be finite");
  EXPECT_EQ(thrown_text([] { CircleMotion{{{0, 0, 0}, 1, HUGE_VAL, 0}}; }), "speed_mps = inf: must be finite");
  EXPECT_EQ(thrown_text([] {
              FigureEightMotion{{{0, 0, 0}, 1, -1, 0, 5}};
            }),
            "width_m = -1: must be positive and finite");
  EXPECT_EQ(thrown_text([] {
              FigureEightMotion{{{0, 0, 0}, 1, 1, 0, 0}};
            }),
            "period_s = 0: must be finite, at least 1e-3");
  const auto hand = [](auto change) {
    HandHeldOptions o;
    change(o);
    return thrown_text([&] { HandHeldMotion(o, Random(1)); });
  };
  EXPECT_EQ(hand([](auto& o) { o.scale = -1; }), "scale = -1: must not be negative, and finite");
  EXPECT_EQ(hand([](auto& o) { o.lowest_hz = 0; }), "lowest_hz = 0: must be at least 1e-6");
  EXPECT_EQ(hand([](auto& o) { o.highest_hz = 0.2; }), "highest_hz = 0.2: must be finite and greater than lowest_hz");
  EXPECT_EQ(hand([](auto& o) { o.angular_rate_rms = kNan; }),
            "angular_rate_rms = nan: must not be negative, and finite");
  EXPECT_EQ(hand([](auto& o) { o.T_world_mean.translation.x() = kNan; }),
            "T_world_mean: the translation must be finite");
}

TEST(GroundMotion, BadInputNamesFieldAndValue) {
  const auto car = [](auto change) {
    CarOptions o;
    change(o.course);
    return thrown_text([&] { CarMotion{o}; });
  };
  EXPECT_EQ(car([](auto& c) { c.phases.clear(); }), "phases: there must be at least one");
  EXPECT_EQ(car([](auto& c) { c.phases[2].duration_s = 0; }),
            "phases[2].duration_s = 0: must be finite and at least 1e-3");
  EXPECT_EQ(car([](auto& c) { c.phases[2].speed_mps = -1; }),
            "phases[2].speed_mps = -1: must not be negative, and finite");
  EXPECT_EQ(car([](auto& c) { c.phases[0].turn_rad = 1; }), "phases[0].turn_rad = 1: a car cannot turn on the spot");
  EXPECT_EQ(car([](auto& c) { c.cycles = 0; }), "cycles = 0: must be in [1, 100000]");
  EXPECT_EQ(car([](auto& c) { c.speed_mps = 3; }),
            "speed_mps of the last phase = 0: must be that of the start, 3, when there are more cycles than one");
  EXPECT_EQ(car([](auto& c) { c.start.y() = kNan; }), "start[1] = nan: must be finite");
  const auto walker = [](auto change) {
    PedestrianOptions o;
    change(o);
    return thrown_text([&] { PedestrianMotion{o}; });
  };
  EXPECT_EQ(walker([](auto& o) { o.step_length_m = 0; }), "step_length_m = 0: must be positive and finite");
  EXPECT_EQ(walker([](auto& o) { o.head_turn_period_s = 1; }),
            "head_turn_period_s = 1: must be finite and not less than head_turn_s");
}

TEST(ComposedMotion, BadInputNamesFieldAndValue) {
  const auto circle = std::make_shared<const CircleMotion>();
  EXPECT_EQ(thrown_text([&] { MountedMotion(nullptr, {}); }), "body must not be null");
  EXPECT_EQ(thrown_text([&] {
              MountedMotion(circle, {Quaterniond::Identity(), {0, kNan, 0}});
            }),
            "T_body_sensor: the translation must be finite");
  EXPECT_EQ(thrown_text([&] { RestFirstMotion(nullptr); }), "motion must not be null");
  EXPECT_EQ(thrown_text([&] { RestFirstMotion(circle, {-1, 1}); }), "rest_s = -1: must not be negative, and finite");
  EXPECT_EQ(thrown_text([&] {
              RestFirstMotion(circle, {1, 0});
            }),
            "ease_s = 0: must be positive: the motion does not begin at rest");
  EXPECT_EQ(thrown_text([&] {
              RestFirstMotion(circle, RestFirstOptions{1, kNan});
            }),
            "ease_s = nan: must be 0, or finite and at least 1e-3");
  EXPECT_EQ(thrown_text([&] {
              RestFirstMotion(std::make_shared<const CarMotion>(), {1, 200});
            }),
            "ease_s = 200: must not be more than twice the duration of the motion, 91");
}

}  // namespace
}  // namespace loc
