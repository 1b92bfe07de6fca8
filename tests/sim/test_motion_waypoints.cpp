// Motion through way-points, and the curves that it is made of.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "libloc/core/random.hpp"
#include "libloc/sim/waypoint_motion.hpp"
#include "tests/support/data.hpp"
#include "tests/support/motion_checks.hpp"
#include "tests/support/number_table.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;
using test::near;
using test::thrown_text;
using testing::AssertionResult;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A slow second implementation: Simpson's rule.
Vector2d simpson(const Clothoid& c, double length) {
  constexpr int kSteps = 20000;
  Vector2d sum = Vector2d::Zero();
  for (int i = 0; i <= kSteps; ++i) {
    const double s = length * i / kSteps;
    const double angle = c.course + c.curvature * s + 0.5 * c.curvature_rate * s * s;
    sum += (i == 0 || i == kSteps ? 1 : (i % 2 == 1 ? 4 : 2)) * Vector2d(std::cos(angle), std::sin(angle));
  }
  return c.start + sum * length / kSteps / 3;
}

TEST(Clothoid, PositionIsTheIntegralOfItsDirection) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const Clothoid c = {{3, -2}, random.uniform(-4, 4), random.uniform(-1, 1), random.uniform(-0.2, 0.2), 10};
    for (const double s : {0.0, 0.3, 10.0, 13.0, -4.0}) {
      EXPECT_TRUE(near(c.at(s).position, simpson(c, s), 1e-12));
      EXPECT_DOUBLE_EQ(c.at(s).curvature, c.curvature + c.curvature_rate * s);
    }
  }
  // Cornu's spiral, Abramowitz and Stegun, table 7.7: C(1), S(1).
  const Clothoid cornu = {{0, 0}, 0, 0, pi, 1};
  EXPECT_TRUE(near(cornu.at(1).position, Vector2d(0.7798934003768228, 0.4382591473903548), 1e-15));
}

TEST(Clothoid, JoinsPointsWithAnyCourses) {
  const Vector2d start(100, -50);
  const Vector2d end(103, -46);
  for (int i = -172; i <= 180; i += 8) {
    for (int j = -172; j <= 180; j += 8) {
      const double course0 = i * pi / 180;
      const double course1 = j * pi / 180;
      const Clothoid c = fit_clothoid(start, course0, end, course1).clothoid;
      const ClothoidPoint reached = c.at(c.length);
      ASSERT_TRUE(near(reached.position, end, 1e-12)) << i << " " << j;
      ASSERT_NEAR(wrap_angle(reached.course - course1), 0, 1e-13) << i << " " << j;
      ASSERT_GE(c.length, 5 - 1e-12);
    }
  }
  // A straight line and an arc.
  const Clothoid line = fit_clothoid({0, 0}, 0, {7, 0}, 0).clothoid;
  EXPECT_EQ(line.length, 7);
  EXPECT_EQ(line.curvature, 0);
  const Clothoid arc = fit_clothoid({0, 0}, 0, {1, 1}, pi / 2).clothoid;
  EXPECT_NEAR(arc.length, pi / 2, 1e-14);
  EXPECT_NEAR(arc.curvature, 1, 1e-14);
  EXPECT_NEAR(arc.curvature_rate, 0, 1e-14);
}

TEST(Clothoid, JacobiansOfTheEndCurvatures) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const Vector2d courses(random.uniform(-2.5, 2.5), random.uniform(-2.5, 2.5));
    const auto curvatures = [](const Vector2d& c) {
      const ClothoidFit fit = fit_clothoid({0, 0}, c[0], {20, 0}, c[1]);
      return Vector2d(fit.clothoid.curvature, fit.end_curvature);
    };
    const ClothoidFit fit = fit_clothoid({0, 0}, courses[0], {20, 0}, courses[1]);
    Eigen::Matrix2d jacobian;
    jacobian << fit.start_curvature_jacobian.transpose(), fit.end_curvature_jacobian.transpose();
    EXPECT_TRUE(near(jacobian, test::numeric_jacobian(curvatures, courses), 1e-8));
  }
}

TEST(Clothoid, BadInput) {
  EXPECT_THROW(fit_clothoid({0, 0}, 0, {0, 0}, 0), std::invalid_argument);
  EXPECT_THROW(fit_clothoid({0, 0}, kNan, {1, 0}, 0), std::invalid_argument);
  EXPECT_THROW(fit_clothoid({0, kNan}, 0, {1, 0}, 0), std::invalid_argument);
  // Backwards at both ends, and a whole turn between: such a curve would be (nearly) without end.
  EXPECT_EQ(
      thrown_text([] {
        fit_clothoid({0, 0}, 3.14, {1, 0}, -3.14);
      }),
      "courses 3.14 and -3.14 rad from the straight line: the clothoid would be more than 100 times as long as the "
      "line");
  // Exactly backwards is the same angle with either sign.
  EXPECT_EQ(fit_clothoid({0, 0}, pi, {1, 0}, pi).clothoid.length,
            fit_clothoid({0, 0}, -pi, {1, 0}, pi).clothoid.length);
}

TEST(PiecewiseCubic, SplineIsTheCubicItself) {
  const auto cubic = [](double x) { return 2 + x * (-1 + x * (0.5 - 0.3 * x)); };
  const std::vector<double> knots = {-1, 0.2, 0.5, 2, 2.1, 4};
  std::vector<double> values(knots.size());
  std::transform(knots.begin(), knots.end(), values.begin(), cubic);
  const PiecewiseCubic spline = PiecewiseCubic::spline(knots, values);
  for (int k = 0; k < 600; ++k) {
    const double x = -1.5 + 0.01 * k;
    EXPECT_NEAR(spline.at(x).value, cubic(x), 1e-12);
    EXPECT_NEAR(spline.at(x).rate, -1 + x - 0.9 * x * x, 1e-11);
    EXPECT_NEAR(spline.at(x).acceleration, 1 - 1.8 * x, 1e-10);
  }
  const PiecewiseCubic parabola = PiecewiseCubic::spline({0, 1, 3}, {0, 1, 9});
  EXPECT_NEAR(parabola.at(2).value, 4, 1e-14);
  EXPECT_NEAR(PiecewiseCubic::spline({0, 2}, {1, 5}).at(0.5).value, 2, 1e-15);
}

TEST(PiecewiseCubic, SplineHasTwoContinuousDerivatives) {
  Random random(3);
  std::vector<double> knots = {0};
  std::vector<double> values = {0};
  for (int i = 1; i < 12; ++i) {
    knots.push_back(knots.back() + random.uniform(0.1, 2));
    values.push_back(random.normal());
  }
  const PiecewiseCubic spline = PiecewiseCubic::spline(knots, values);
  for (std::size_t i = 1; i + 1 < knots.size(); ++i) {
    const auto before = spline.at(knots[i], i - 1);
    const auto after = spline.at(knots[i]);
    EXPECT_NEAR(before.value, after.value, 1e-12);
    EXPECT_NEAR(before.rate, after.rate, 1e-10);
    EXPECT_NEAR(before.acceleration, after.acceleration, 1e-9);
  }
}

TEST(PiecewiseCubic, ShapePreservingStaysBetweenTheValues) {
  const std::vector<double> values = {0, 0, 1, 5, 5, 2, 2.1, -3};
  std::vector<double> knots;
  for (std::size_t i = 0; i < values.size(); ++i) knots.push_back(static_cast<double>(i * i) + 1);
  const PiecewiseCubic cubic = PiecewiseCubic::shape_preserving(knots, values);
  for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
    for (int k = 0; k <= 100; ++k) {
      const double y = cubic.at(knots[i] + 0.01 * k * (knots[i + 1] - knots[i]), i).value;
      EXPECT_GE(y, std::min(values[i], values[i + 1]) - 1e-14);
      EXPECT_LE(y, std::max(values[i], values[i + 1]) + 1e-14);
    }
  }
  EXPECT_THROW(PiecewiseCubic::spline({0}, {0}), std::invalid_argument);
  EXPECT_THROW(PiecewiseCubic::spline({0, 1}, {0}), std::invalid_argument);
  EXPECT_EQ(thrown_text([] {
              PiecewiseCubic::spline({0, 1, 1}, {0, 1, 2});
            }),
            "knots[2] = 1: must be greater than the one before");
  EXPECT_EQ(thrown_text([] { PiecewiseCubic::spline({0, 1, 2}, {0, kNan, 2}); }), "values[1] = nan: must be finite");
}

// One row of the golden truth: t, p, q (wxyz), v, a, w.
AssertionResult matches(const MotionState& s, const Eigen::Matrix<double, 17, 1>& row) {
  Eigen::Matrix<double, 17, 1> actual;
  Eigen::Quaterniond q = s.T_world_body.rotation;
  const Eigen::Quaterniond expected(row[4], row[5], row[6], row[7]);
  if (q.dot(expected) < 0) q.coeffs() *= -1;
  actual << s.time_s, s.T_world_body.translation, q.w(), q.vec(), s.velocity, s.acceleration, s.angular_velocity;
  return near(actual, row, 1e-12);
}

TEST(WaypointMotion, ExampleDriveIsThatOfAnIndependentImplementation) {
  const std::vector<std::array<double, 17>> golden = {
#include "golden_drive.inc"
  };
  const WaypointMotion motion(example_drive());
  for (const std::array<double, 17>& row : golden) {
    EXPECT_TRUE(matches(motion.at(row[0]), Eigen::Map<const Eigen::Matrix<double, 17, 1>>(row.data())));
  }
}

TEST(WaypointMotion, ExampleDriveIsTheWholeReferenceRecording) {
  const std::filesystem::path file = test::data_folder().parent_path() / "reference" / "vio" / "seed1" / "truth.csv";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file.string() << " is absent; LIBLOC_DATA names data beside it";
  const Eigen::MatrixXd table = test::read_number_table(file);
  ASSERT_EQ(table.cols(), 17);
  ASSERT_EQ(table.rows(), 6000);
  const WaypointMotion motion(example_drive());
  for (int i = 0; i < table.rows(); ++i) {
    ASSERT_TRUE(matches(motion.at(table(i, 0)), table.row(i).transpose())) << "row " << i;
  }
}

TEST(WaypointMotion, ExampleDriveIsConsistent) {
  const WaypointOptions options = example_drive();
  const WaypointMotion motion(options);
  EXPECT_EQ(motion.duration_s(), 90);
  test::MotionCheck check;
  check.breaks_s = options.times_s;
  test::check_derivatives(motion, test::spread_times(90, 500), check);
  test::check_derivatives(motion, test::times_around(options.times_s, 90), check);
  test::check_continuity(motion, options.times_s, false);
  test::check_time_bounds(motion);
  test::check_same(motion, WaypointMotion(example_drive()), test::spread_times(90, 50));
  for (std::size_t i = 0; i < options.times_s.size(); ++i) {
    const MotionState s = motion.at(options.times_s[i]);
    EXPECT_TRUE(near(s.T_world_body.translation, options.positions[i], 1e-12)) << i;
    EXPECT_TRUE(near(s.velocity, options.velocities[i], 1e-12)) << i;
  }
}

TEST(WaypointMotion, EstimatedCoursesFollowACircle) {
  WaypointOptions o;
  for (const double angle : {0.0, 0.5, 0.7, 1.6, 2.2, 3.0, 4.4, 6.0, 7.5}) {
    o.times_s.push_back(4 * angle);
    o.positions.emplace_back(30 * std::cos(angle), 30 * std::sin(angle), 0);
  }
  const WaypointMotion motion(o);
  EXPECT_NEAR(motion.length(), 30 * 7.5, 1e-9);
  for (const double t : test::spread_times(30, 100)) {
    const MotionState s = motion.at(t);
    EXPECT_NEAR(s.T_world_body.translation.norm(), 30, 1e-10);
    EXPECT_NEAR(s.angular_velocity.z(), 0.25, 1e-10);
    EXPECT_NEAR(s.velocity.norm(), 7.5, 1e-9);
  }
}

TEST(WaypointMotion, EstimatedCoursesMakeTheCurvatureContinuous) {
  Random random(4);
  for (int run = 0; run < 20; ++run) {
    WaypointOptions o;
    double course = random.uniform(-pi, pi);
    Vector3d place(0, 0, 0);
    for (int i = 0; i < 12; ++i) {
      o.times_s.push_back(10.0 * i);
      o.positions.push_back(place);
      course += 0.5 * random.normal();
      place += random.uniform(20, 100) * Vector3d(std::cos(course), std::sin(course), 0.02 * random.normal());
    }
    const WaypointMotion motion(o);
    test::MotionCheck check;
    check.breaks_s = o.times_s;
    test::check_derivatives(motion, test::times_around(o.times_s, 110), check);
    for (std::size_t i = 1; i + 1 < o.times_s.size(); ++i) {
      const MotionState before = motion.at(o.times_s[i] - 1e-9);
      const MotionState after = motion.at(o.times_s[i]);
      EXPECT_TRUE(near(before.angular_velocity, after.angular_velocity, 1e-8)) << run << " " << i;
      EXPECT_TRUE(near(after.T_world_body.translation, o.positions[i], 1e-10));
    }
  }
}

TEST(WaypointMotion, ZigzagsAndHairpinsHaveNoLoops) {
  Random random(5);
  for (int run = 0; run < 100; ++run) {
    WaypointOptions o;
    double straight = 0;
    for (int i = 0; i < 10; ++i) {
      o.times_s.push_back(20.0 * i);
      o.positions.emplace_back(random.uniform(0, 100), random.uniform(0, 100), 0);
      if (i > 0) straight += (o.positions[i] - o.positions[i - 1]).norm();
    }
    EXPECT_LT(WaypointMotion(o).length(), 2 * straight) << run;
  }
  WaypointOptions there_and_back;
  there_and_back.times_s = {0, 10, 20};
  there_and_back.positions = {{0, 0, 0}, {10, 0, 0}, {0, 0, 0}};
  EXPECT_NEAR(WaypointMotion(there_and_back).length(), 10 * pi, 1e-9);
}

TEST(WaypointMotion, WithoutVelocitiesTheSpeedNeverTurnsBack) {
  WaypointOptions o;
  o.times_s = {0, 1, 20, 21, 30};
  o.positions = {{0, 0, 0}, {50, 0, 3}, {51, 0, 3}, {100, 10, 8}, {101, 11, 1}};
  const WaypointMotion motion(o);
  for (const double t : test::spread_times(30, 2000)) {
    const MotionState s = motion.at(t);
    EXPECT_GE((s.T_world_body.rotation.conjugate() * s.velocity).x(), -1e-9);
    EXPECT_LE(s.T_world_body.translation.z(), 8);
    EXPECT_GE(s.T_world_body.translation.z(), 0);
  }
}

TEST(WaypointMotion, StopsAreAtRest) {
  WaypointOptions o;
  o.times_s = {0, 10, 15, 25};
  o.positions = {{0, 0, 1}, {40, 0, 1}, {40, 0, 1}, {80, 30, 5}};
  o.velocities = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {4, 3, 0}};
  const WaypointMotion motion(o);
  for (const double t : {10.0, 11.0, 14.999}) {
    const MotionState s = motion.at(t);
    EXPECT_TRUE(near(s.T_world_body.translation, o.positions[1], 1e-12));
    EXPECT_EQ(s.velocity, Vector3d::Zero());
    EXPECT_EQ(s.acceleration, Vector3d::Zero());
    EXPECT_EQ(s.angular_velocity, Vector3d::Zero());
    EXPECT_EQ(s.angular_acceleration, Vector3d::Zero());
    EXPECT_TRUE(near(s.T_world_body.rotation.coeffs(), motion.at(10).T_world_body.rotation.coeffs(), 1e-15));
  }
  test::MotionCheck check;
  check.breaks_s = o.times_s;
  test::check_derivatives(motion, test::times_around(o.times_s, 25), check);
  test::check_continuity(motion, o.times_s, false);
  // The same without velocities, which then come to rest by themselves.
  o.velocities.clear();
  EXPECT_EQ(WaypointMotion(o).at(12).velocity, Vector3d::Zero());
  // A course at the stop as given.
  o.courses_rad = {std::nullopt, 0.3, std::nullopt, std::nullopt};
  EXPECT_NEAR(WaypointMotion(o).courses()[1], 0.3, 1e-15);
  EXPECT_NEAR(WaypointMotion(o).courses()[2], 0.3, 1e-15);
}

TEST(WaypointMotion, LiftsAndUTurns) {
  WaypointOptions lift;
  lift.times_s = {0, 5};
  lift.positions = {{1, 2, 0}, {1, 2, 10}};
  EXPECT_EQ(thrown_text([&] { WaypointMotion{lift}; }),
            "positions are all the same place: courses_rad must give the course");
  lift.courses_rad = {0.5, std::nullopt};
  const WaypointMotion up(lift);
  EXPECT_TRUE(near(up.at(2.5).T_world_body.translation, Vector3d(1, 2, 5), 1e-12));
  EXPECT_TRUE(near(up.at(2.5).velocity, Vector3d(0, 0, 2), 1e-12));

  // The second velocity is opposite to the first: a turn, whose end is reached with the course asked for.
  WaypointOptions turn;
  turn.times_s = {0, 10};
  turn.positions = {{0, 0, 0}, {0, 20, 0}};
  turn.velocities = {{3, 0, 0}, {-3, 0, 1}};
  const WaypointMotion back(turn);
  EXPECT_NEAR(back.length(), 10 * pi, 1e-10);
  EXPECT_TRUE(near(back.at(10).velocity, turn.velocities[1], 1e-12));
  test::check_derivatives(back, test::spread_times(10, 50));
}

TEST(WaypointMotion, BadInputNamesIndexAndValue) {
  const auto text = [](auto change) {
    WaypointOptions o = example_drive();
    change(o);
    return thrown_text([&] { WaypointMotion{o}; });
  };
  using O = WaypointOptions;
  EXPECT_EQ(text([](O& o) { o.times_s[3] = 25; }), "times_s[3] = 25: must be greater than the one before");
  EXPECT_EQ(text([](O& o) { o.times_s[3] = kNan; }), "times_s[3] = nan: must be finite");
  EXPECT_EQ(text([](O& o) { o.times_s[1] = 1e-300; }).substr(0, 18), "knots[1] = 1e-300:");
  EXPECT_EQ(text([](O& o) { o.times_s[0] = 1; }), "times_s[0] = 1: must be 0");
  EXPECT_EQ(text([](O& o) { o.times_s.pop_back(); }), "number of times_s = 10: must be the number of positions, 11");
  EXPECT_EQ(text([](O& o) { o.velocities.pop_back(); }),
            "number of velocities = 10: must be the number of positions, 11");
  EXPECT_EQ(text([](O& o) { o.courses_rad = {0.0}; }),
            "number of courses_rad = 1: must be the number of positions, 11");
  EXPECT_EQ(text([](O& o) { o.positions[4].y() = kNan; }), "positions[4][1] = nan: must be finite");
  EXPECT_EQ(text([](O& o) { o.velocities[2].z() = HUGE_VAL; }), "velocities[2][2] = inf: must be finite");
  EXPECT_EQ(text([](O& o) {
              o.courses_rad.assign(11, std::nullopt);
              o.courses_rad[4] = 0.1;
            }),
            "courses_rad[4] = 0.1: differs from the direction of velocities[4]");
  EXPECT_EQ(text([](O& o) {
              o.courses_rad.assign(11, std::nullopt);
              o.courses_rad[4] = kNan;
            }),
            "courses_rad[4] = nan: must be finite");
  EXPECT_EQ(text([](O& o) { o.positions[1] = o.positions[0]; }),
            "horizontal speed of velocities[0] = 10: must be 0: positions 0 and 1 are the same place");
  EXPECT_EQ(text([](O& o) { o.positions[1] = Vector3d(1e-7, 0, 0); }),
            "positions[1] is from the one before = 1e-07: m; must be at least 1e-6, or exactly 0 for a stop");
  EXPECT_EQ(text([](O& o) { o.velocities[1].x() = 50; }).substr(0, 39), "way-points 0 to 1: speed at 6.666666666");
  EXPECT_EQ(text([](O& o) {
              o.times_s = {0};
              o.positions = {{0, 0, 0}};
              o.velocities.clear();
            }),
            "number of positions = 1: must be at least 2");
  EXPECT_EQ(text([](O& o) { o = {}; }), "number of positions = 0: must be at least 2");
  // Where the vehicle stands, its course cannot change.
  WaypointOptions stop;
  stop.times_s = {0, 1, 2, 3};
  stop.positions = {{0, 0, 0}, {5, 0, 0}, {5, 0, 0}, {9, 0, 0}};
  stop.courses_rad = {std::nullopt, 0.0, 0.5, std::nullopt};
  EXPECT_EQ(thrown_text([&] { WaypointMotion{stop}; }),
            "courses_rad[2] = 0.5: differs from the one before at the same place");
}

}  // namespace
}  // namespace loc
