#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/geometry/trajectory.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

using test::near;

TEST(Trajectory, InterpolationIsExactOnAScrewOfConstantRate) {
  Random random(1);
  const Eigen::Quaterniond start = random.rotation();
  const Eigen::Vector3d rate(0.3, -0.8, 0.5);
  const Eigen::Vector3d velocity(1, 2, -3);
  const auto pose_at = [&](double t) { return Pose3{so3::boxplus(start, t * rate), t * velocity}; };
  constexpr TimeNs kStart = 1'700'000'000'000'000'000;
  Trajectory trajectory;
  for (int i = 0; i <= 10; ++i) {
    Pose3 pose = pose_at(0.5 * i);
    if (i % 2 == 1) pose.rotation.coeffs() *= -1;  // q and -q are one rotation
    trajectory.push_back(kStart + i * 500'000'000LL, pose);
  }
  trajectory.check("screw");
  for (int i = 0; i <= 500; ++i) {
    const auto pose = interpolate(trajectory, kStart + i * 10'000'000LL);
    ASSERT_TRUE(pose);
    EXPECT_TRUE(near(pose->matrix(), pose_at(0.01 * i).matrix(), 1e-13));
  }
  EXPECT_FALSE(interpolate(trajectory, kStart - 1));
  EXPECT_FALSE(interpolate(trajectory, kStart + 5'000'000'001));
  EXPECT_FALSE(interpolate(Trajectory{}, kStart));
}

TEST(Trajectory, NearestIndexTakesTheEarlierOfTwo) {
  const std::vector<TimeNs> times = {10, 20, 40};
  EXPECT_EQ(nearest_index(times, -5), 0U);
  EXPECT_EQ(nearest_index(times, 15), 0U);
  EXPECT_EQ(nearest_index(times, 16), 1U);
  EXPECT_EQ(nearest_index(times, 20), 1U);
  EXPECT_EQ(nearest_index(times, 31), 2U);
  EXPECT_EQ(nearest_index(times, std::numeric_limits<TimeNs>::max()), 2U);
  EXPECT_EQ(nearest_index({std::numeric_limits<TimeNs>::max()}, std::numeric_limits<TimeNs>::min()), 0U);
  EXPECT_THROW(nearest_index({}, 0), std::invalid_argument);
}

TEST(Trajectory, CheckNamesWhatIsWrong) {
  const auto message = [](const Trajectory& trajectory) -> std::string {
    try {
      trajectory.check("estimate");
    } catch (const DataError& error) {
      return error.what();
    }
    return "";
  };
  Trajectory good;
  for (int i = 0; i < 3; ++i) good.push_back(i * 1'000'000'000LL, Pose3{});
  EXPECT_EQ(message(good), "");
  Trajectory t = good;
  t.poses.pop_back();
  EXPECT_EQ(message(t), "estimate: 3 times, but 2 poses");
  t = good;
  t.times_ns[2] = t.times_ns[1];
  EXPECT_EQ(message(t), "estimate: pose 2: its time 1.000000000 is not after the one before, 1.000000000");
  t = good;
  t.times_ns[0] = kNoTime;
  EXPECT_EQ(message(t), "estimate: pose 0: has no time");
  t = good;
  t.poses[1].translation.x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(message(t), "estimate: pose 1: its translation is not finite");
  t = good;
  t.poses[1].rotation.w() = 2;
  EXPECT_EQ(message(t), "estimate: pose 1: its quaternion has norm 2: must be 1");
  t.poses[1].rotation.w() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(message(t), "");
}

}  // namespace
}  // namespace loc
