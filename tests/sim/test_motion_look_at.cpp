// A camera that looks at given points.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "libloc/core/random.hpp"
#include "libloc/sim/look_at_motion.hpp"
#include "tests/support/motion_checks.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

using Eigen::Vector3d;
using test::near;
using test::thrown_text;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Round a table, looking at things on it, up and down.
LookAtOptions round_the_table() {
  LookAtOptions o;
  for (int i = 0; i <= 8; ++i) {
    const double angle = 0.8 * i;
    o.times_s.push_back(1.3 * i + 0.1 * (i % 2));
    o.positions.emplace_back(3 * std::cos(angle), 2 * std::sin(angle), 1.5 + 0.2 * (i % 3));
    o.look_at.emplace_back(0.3 * (i % 2), -0.2 * (i % 3), 0.8);
  }
  return o;
}

TEST(LookAtMotion, AxesOfTheCamera) {
  LookAtOptions o;
  o.times_s = {0, 10};
  o.positions = {{0, 0, 1}, {0, 0, 1}};
  o.look_at = {{5, 0, 1}, {5, 0, 1}};
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;  // looking east: right is south, down is down
  const MotionState s = LookAtMotion(o).at(4);
  EXPECT_TRUE(near(s.T_world_body.rotation.toRotationMatrix(), R, 1e-15));
  EXPECT_EQ(s.velocity, Vector3d::Zero());
  EXPECT_EQ(s.angular_velocity, Vector3d::Zero());
  EXPECT_EQ(s.angular_acceleration, Vector3d::Zero());
  // Another up: that of a camera on its side. Its length does not matter.
  o.up = {0, 3, 0};
  R << 0, 0, 1, 0, -1, 0, 1, 0, 0;
  EXPECT_TRUE(near(LookAtMotion(o).at(4).T_world_body.rotation.toRotationMatrix(), R, 1e-15));
}

TEST(LookAtMotion, RateOfACameraThatPassesByInClosedForm) {
  // Along a line at distance 2 with 1 m/s, eyes on one point: angle atan(t / 2).
  LookAtOptions o;
  o.times_s = {0, 10};
  o.positions = {{-5, 2, 0}, {5, 2, 0}};
  o.look_at = {{0, 0, 0}, {0, 0, 0}};
  const LookAtMotion motion(o);
  for (const double t : test::spread_times(10, 20)) {
    const double x = t - 5;
    // Clockwise seen from above, that is about the camera's y, which points down.
    EXPECT_TRUE(near(motion.at(t).angular_velocity, Vector3d(0, 2 / (4 + x * x), 0), 1e-13));
  }
}

TEST(LookAtMotion, IsConsistentAndSmooth) {
  const LookAtOptions o = round_the_table();
  const LookAtMotion motion(o);
  EXPECT_EQ(motion.duration_s(), o.times_s.back());
  test::check_derivatives(motion, test::spread_times(motion.duration_s(), 300));
  test::MotionCheck beside;
  beside.breaks_s = o.times_s;  // the jerk jumps there
  beside.step_s = 3e-4;
  test::check_derivatives(motion, test::times_around(o.times_s, motion.duration_s()), beside);
  test::check_continuity(motion, o.times_s, true);
  test::check_time_bounds(motion);
  test::check_same(motion, LookAtMotion(o), test::spread_times(motion.duration_s(), 30));
  for (std::size_t i = 0; i < o.times_s.size(); ++i) {
    const MotionState s = motion.at(o.times_s[i]);
    EXPECT_TRUE(near(s.T_world_body.translation, o.positions[i], 1e-12));
    const Vector3d target = s.T_world_body.inverse() * o.look_at[i];
    EXPECT_TRUE(near(Vector3d(target / target.z()), Vector3d(0, 0, 1), 1e-12));
    EXPECT_GT(target.z(), 0);
    EXPECT_NEAR((s.T_world_body.rotation * Vector3d::UnitX()).z(), 0, 1e-12);  // the horizon is level
    EXPECT_LT((s.T_world_body.rotation * Vector3d::UnitY()).z(), 0);           // and the right way up
  }
}

TEST(LookAtMotion, ForbiddenDirectionsBetweenKnotsAreFound) {
  LookAtOptions o;
  o.times_s = {0, 10};
  const auto text = [&] { return thrown_text([&] { LookAtMotion{o}; }); };
  // The point goes by overhead, 5 m up, at 5 s; within 0.01 rad from 5 m * tan 0.01 before.
  o.positions = {{0, 0, 0}, {0, 0, 0}};
  o.look_at = {{-1, 0, 5}, {1, 0, 5}};
  EXPECT_EQ(text().substr(0, 61), "at 4.74999167 s: angle between the look direction and up or d");
  o.look_at = {{-1, 0, -5}, {1, 0, -5}};
  EXPECT_EQ(text().substr(0, 15), "at 4.74999167 s");
  // Allowed with an up that is level.
  o.up = {0, 1, 0};
  EXPECT_EQ(text(), "nothing thrown");
  o.up = {0, 0, 1};
  // Past it at 0.06 m: 0.012 rad.
  o.look_at = {{-1, 0.06, 5}, {1, 0.06, 5}};
  EXPECT_EQ(text(), "nothing thrown");
  o.look_at = {{-1, 0.0499, 5}, {1, 0.0499, 5}};
  EXPECT_EQ(text().substr(0, 7), "at 4.98");
  // The camera goes through the point at 5 s with 0.2 m/s.
  o.positions = {{0, -1, 0}, {0, 1, 0}};
  o.look_at = {{0, 0, 0}, {0, 0, 0}};
  EXPECT_EQ(text().substr(0, 38), "at 4.95 s: distance from the camera = ");
  // At a knot, and at the very end.
  o.look_at = {{0, -1, 0}, {0, 0, 0}};
  EXPECT_EQ(text(), "at 0 s: distance from the camera = 0: m to the point it looks at, less than 0.01");
  o.look_at = {{3, 0, 0}, {0, 1, 3}};
  EXPECT_EQ(text().substr(0, 7), "at 9.90");
}

TEST(LookAtMotion, ForbiddenExactlyWhereSamplesSaySo) {
  Random random(1);
  int forbidden = 0;
  for (int run = 0; run < 60; ++run) {
    LookAtOptions o;
    for (int i = 0; i < 6; ++i) {
      o.times_s.push_back(i);
      o.positions.emplace_back(random.normal3());
      o.look_at.emplace_back(2 * random.normal3());
    }
    o.smallest_angle_rad = 0.15;
    o.smallest_distance_m = 0.3;
    std::vector<PiecewiseCubic> difference;
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (std::size_t i = 0; i < 6; ++i) values.push_back(o.look_at[i][axis] - o.positions[i][axis]);
      difference.push_back(PiecewiseCubic::spline(o.times_s, values));
    }
    double first = kNan;
    for (int k = 0; k <= 50'000 && std::isnan(first); ++k) {
      const double t = 1e-4 * k;
      const Vector3d d(difference[0].at(t).value, difference[1].at(t).value, difference[2].at(t).value);
      if (d.norm() < 0.3 || d.head<2>().norm() < std::sin(0.15) * d.norm()) first = t;
    }
    const std::string text = thrown_text([&] { LookAtMotion{o}; });
    if (std::isnan(first)) {
      EXPECT_EQ(text, "nothing thrown") << run;
    } else {
      ++forbidden;
      ASSERT_EQ(text.substr(0, 3), "at ") << run;
      EXPECT_NEAR(std::stod(text.substr(3)), first, 1.1e-4) << run << " " << text;
    }
  }
  EXPECT_GT(forbidden, 10);
  EXPECT_LT(forbidden, 50);
}

TEST(LookAtMotion, BadInputNamesIndexAndValue) {
  const auto text = [](auto change) {
    LookAtOptions o = round_the_table();
    change(o);
    return thrown_text([&] { LookAtMotion{o}; });
  };
  EXPECT_EQ(text([](auto& o) { o.times_s[2] = 0.1; }), "times_s[2] = 0.1: must be greater than the one before");
  EXPECT_EQ(text([](auto& o) { o.times_s[0] = 0.1; }), "times_s[0] = 0.1: must be 0");
  EXPECT_EQ(text([](auto& o) { o.times_s = {0}; }), "number of times_s = 1: must be at least 2");
  EXPECT_EQ(text([](auto& o) { o.positions.pop_back(); }), "number of positions = 8: must be the number of times_s, 9");
  EXPECT_EQ(text([](auto& o) { o.look_at.clear(); }), "number of look_at = 0: must be the number of times_s, 9");
  EXPECT_EQ(text([](auto& o) { o.positions[3].z() = kNan; }), "positions[3][2] = nan: must be finite");
  EXPECT_EQ(text([](auto& o) { o.look_at[3].x() = HUGE_VAL; }), "look_at[3][0] = inf: must be finite");
  EXPECT_EQ(text([](auto& o) { o.up.setZero(); }), "length of up = 0: must be positive and finite");
  EXPECT_EQ(text([](auto& o) { o.smallest_angle_rad = 0; }), "smallest_angle_rad = 0: must be in (0, 1.5)");
  EXPECT_EQ(text([](auto& o) { o.smallest_distance_m = kNan; }),
            "smallest_distance_m = nan: must be positive and finite");
}

}  // namespace
}  // namespace loc
