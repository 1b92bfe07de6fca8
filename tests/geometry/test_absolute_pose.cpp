#include <gtest/gtest.h>

#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/geometry/absolute_pose.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

std::vector<SightedPoint> sights(Random& random, const Pose3& pose, int count, int wrong, double sigma) {
  std::vector<SightedPoint> out;
  const auto direction = [&] {
    return Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-0.8, 0.8), 1).normalized().eval();
  };
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d d = direction();
    const Eigen::Vector3d place = pose * (random.uniform(2, 8) * d);
    const Eigen::Vector3d seen = i < wrong ? direction() : (d + sigma * random.normal3()).normalized().eval();
    out.push_back({place, seen});
  }
  return out;
}

// From metres and half a radian away, with every seventh pair wrong: nearly always found, never found wrong.
TEST(AbsolutePose, FindsThePoseFromFarAwayAndNeverAWrongOne) {
  Random random(1);
  int found = 0;
  for (int run = 0; run < 300; ++run) {
    const Pose3 pose{random.rotation(), 2 * random.normal3()};
    const auto points = sights(random, pose, 25, 3, 0.003);
    const Pose3 start{so3::boxplus(pose.rotation, 0.5 * random.normal3()), pose.translation + 2 * random.normal3()};
    const auto result = absolute_pose(points, start);
    if (!result) continue;
    ++found;
    EXPECT_LT((result->translation - pose.translation).norm(), 0.1);
    EXPECT_LT(so3::angle_between(result->rotation, pose.rotation), 0.02);
  }
  EXPECT_GT(found, 270);
}

TEST(AbsolutePose, ExactWithoutNoise) {
  Random random(2);
  const Pose3 pose{random.rotation(), random.normal3()};
  const auto result = absolute_pose(sights(random, pose, 10, 0, 0), Pose3{pose.rotation, Eigen::Vector3d::Zero()});
  ASSERT_TRUE(result);
  EXPECT_LT((result->translation - pose.translation).norm(), 1e-8);
}

TEST(AbsolutePose, SaysWhenItCannot) {
  Random random(3);
  const Pose3 pose{random.rotation(), random.normal3()};
  EXPECT_FALSE(absolute_pose(sights(random, pose, 3, 0, 0), pose)) << "too few";
  EXPECT_FALSE(absolute_pose(sights(random, pose, 20, 20, 0), pose)) << "nothing fits";
}

}  // namespace
}  // namespace loc
