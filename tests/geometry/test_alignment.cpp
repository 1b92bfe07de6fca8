// Agreement with evo's numbers on a recording is tested in eval/test_trajectory_error.cpp.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/geometry/alignment.hpp"
#include "libloc/geometry/so3.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

using test::near;
using Points = std::vector<Eigen::Vector3d>;

Points random_points(Random& random, int count, const Eigen::Vector3d& size = {1, 1, 1}) {
  Points points;
  for (int i = 0; i < count; ++i) points.push_back(random.normal3().cwiseProduct(size));
  return points;
}

Points transformed(const Points& points, const Pose3& t, double scale) {
  Points out;
  for (const auto& p : points) out.push_back(t * (scale * p));
  return out;
}

double residual(const Points& estimate, const Points& reference, const Pose3& t, double scale) {
  double sum = 0;
  for (std::size_t i = 0; i < estimate.size(); ++i) sum += (reference[i] - t * (scale * estimate[i])).squaredNorm();
  return std::sqrt(sum / static_cast<double>(estimate.size()));
}

TEST(Alignment, RecoversRandomTransformsExactly) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Points estimate = random_points(random, 3 + i % 20, {5, 2, 1});
    const Pose3 t{random.rotation(), 100 * random.normal3()};
    const double scale = std::exp(random.uniform(-3, 3));

    const Alignment se3 = align_points(estimate, transformed(estimate, t, 1), AlignmentMode::kSe3);
    ASSERT_TRUE(se3.ok());
    EXPECT_TRUE(near(se3.T_reference_estimate.matrix(), t.matrix(), 1e-10));
    EXPECT_EQ(se3.scale, 1);
    EXPECT_LT(se3.rms_residual, 1e-11);

    const Alignment sim3 = align_points(estimate, transformed(estimate, t, scale), AlignmentMode::kSim3);
    ASSERT_TRUE(sim3.ok());
    EXPECT_TRUE(near(sim3.T_reference_estimate.matrix(), t.matrix(), 1e-10));
    EXPECT_NEAR(sim3.scale, scale, 1e-11 * scale);

    const Pose3 level{so3::exp({0, 0, random.uniform(-M_PI, M_PI)}), 100 * random.normal3()};
    const Alignment yaw = align_points(estimate, transformed(estimate, level, 1), AlignmentMode::kYaw);
    ASSERT_TRUE(yaw.ok());
    EXPECT_TRUE(near(yaw.T_reference_estimate.matrix(), level.matrix(), 1e-10));
    EXPECT_EQ(yaw.scale, 1);
  }
}

// With noise, no small change of the result fits better.
TEST(Alignment, IsTheMinimumOfTheSquaredDistances) {
  Random random(2);
  for (const AlignmentMode mode : {AlignmentMode::kSe3, AlignmentMode::kSim3, AlignmentMode::kYaw}) {
    for (int trial = 0; trial < 20; ++trial) {
      const Points estimate = random_points(random, 30);
      Points reference = transformed(estimate, {so3::exp({0, 0, 1.2}), {1, 2, 3}}, 1.3);
      for (auto& p : reference) p += 0.3 * random.normal3();
      const Alignment a = align_points(estimate, reference, mode);
      ASSERT_TRUE(a.ok());
      EXPECT_NEAR(a.rms_residual, residual(estimate, reference, a.T_reference_estimate, a.scale), 1e-14);
      for (int i = 0; i < 50; ++i) {
        Vector6d xi = Vector6d::Zero();
        xi.head<3>() = 1e-3 * random.normal3();
        xi.tail<3>() = 1e-3 * random.normal3();
        Pose3 other = a.T_reference_estimate;
        other.translation += xi.head<3>();
        const bool yaw = mode == AlignmentMode::kYaw;
        other.rotation = so3::exp(yaw ? Eigen::Vector3d(0, 0, xi[5]) : Eigen::Vector3d(xi.tail<3>())) * other.rotation;
        const double scale = mode == AlignmentMode::kSim3 ? a.scale * (1 + 1e-3 * random.normal()) : a.scale;
        EXPECT_GT(residual(estimate, reference, other, scale), a.rms_residual);
      }
    }
  }
}

TEST(Alignment, TheYawResultTurnsAboutVerticalOnly) {
  Random random(3);
  const Points estimate = random_points(random, 20);
  // The reference is tilted: yaw alignment must leave the tilt as an error.
  const Points reference = transformed(estimate, {so3::exp({0.2, 0.1, 0.5}), {0, 0, 0}}, 1);
  const Alignment a = align_points(estimate, reference, AlignmentMode::kYaw);
  const Eigen::Vector3d up = a.T_reference_estimate.rotation * Eigen::Vector3d::UnitZ();
  EXPECT_TRUE(near(up, Eigen::Vector3d::UnitZ(), 1e-15));
  EXPECT_GT(a.rms_residual, 0.1);
  EXPECT_LT(align_points(estimate, reference, AlignmentMode::kSe3).rms_residual, 1e-14);
}

TEST(Alignment, NeverGivesAReflection) {
  Random random(4);
  for (int i = 0; i < 100; ++i) {
    const Points estimate = random_points(random, 10, {3, 2, 1});
    Points mirrored = estimate;
    for (auto& p : mirrored) p.z() = -p.z();
    for (const AlignmentMode mode : {AlignmentMode::kSe3, AlignmentMode::kSim3}) {
      const Alignment a = align_points(estimate, mirrored, mode);
      ASSERT_TRUE(a.ok());
      EXPECT_NEAR(a.T_reference_estimate.rotation.toRotationMatrix().determinant(), 1, 1e-12);
      EXPECT_GT(a.rms_residual, 0.05);  // a mirror image does not fit
      EXPECT_GT(a.scale, 0);
    }
  }
}

TEST(Alignment, PlanarPointsDetermineARotation) {
  Random random(5);
  const Points estimate = random_points(random, 8, {2, 1, 0});
  const Pose3 t{random.rotation(), random.normal3()};
  const Alignment a = align_points(estimate, transformed(estimate, t, 2.5), AlignmentMode::kSim3);
  ASSERT_TRUE(a.ok());
  EXPECT_TRUE(near(a.T_reference_estimate.matrix(), t.matrix(), 1e-12));
  EXPECT_NEAR(a.scale, 2.5, 1e-13);
}

// Umeyama 1991, section IV.
TEST(Alignment, UmeyamasExampleOfAMirroredTriangle) {
  const Points x = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};
  const Points y = {{0, 0, 0}, {-1, 0, 0}, {0, 2, 0}};
  const Alignment a = align_points(x, y, AlignmentMode::kSim3);
  ASSERT_TRUE(a.ok());
  // In space the mirror image is reached by turning over about y; in the plane of the paper it is not.
  EXPECT_NEAR(a.rms_residual, 0, 1e-14);
  EXPECT_TRUE(near(a.T_reference_estimate.matrix(), Pose3{so3::exp({0, M_PI, 0}), {0, 0, 0}}.matrix(), 1e-14));
}

TEST(Alignment, NoneLeavesThePointsAndGivesTheirDistance) {
  const Points estimate = {{0, 0, 0}};
  const Points reference = {{3, 4, 0}};
  const Alignment a = align_points(estimate, reference, AlignmentMode::kNone);
  EXPECT_TRUE(a.ok());
  EXPECT_EQ(a.rms_residual, 5);
  EXPECT_TRUE(near(a.T_reference_estimate.matrix(), Eigen::Matrix4d::Identity(), 0));
}

TEST(Alignment, PosesFollowTheirPoints) {
  Random random(6);
  const Points estimate = random_points(random, 10);
  const Pose3 t{random.rotation(), random.normal3()};
  const Alignment a = align_points(estimate, transformed(estimate, t, 2), AlignmentMode::kSim3);
  const Pose3 pose{random.rotation(), random.normal3()};
  EXPECT_TRUE(near((a * pose).translation, a * pose.translation, 1e-14));
  EXPECT_TRUE(near((a * pose).rotation.toRotationMatrix(), (t.rotation * pose.rotation).toRotationMatrix(), 1e-13));
}

TEST(Alignment, ExtentDescribesTheReference) {
  // Deviations of +-3, +-2, +-1 along turned axes.
  Points reference;
  for (int i = 0; i < 8; ++i) {
    reference.emplace_back((i & 1) != 0 ? 3 : -3, (i & 2) != 0 ? 2 : -2, (i & 4) != 0 ? 1 : -1);
  }
  reference = transformed(reference, {so3::exp({1, 2, 0.5}), {50, 0, 7}}, 1);
  const Alignment a = align_points(reference, reference, AlignmentMode::kSe3);
  EXPECT_TRUE(near(a.extent, Eigen::Vector3d(3, 2, 1), 1e-12));
}

void expect_failure(const Points& estimate, const Points& reference, AlignmentMode mode, AlignmentFailure failure) {
  const Alignment a = align_points(estimate, reference, mode);
  EXPECT_EQ(a.failure, failure) << alignment_name(mode) << ": " << alignment_failure_text(a.failure);
  EXPECT_FALSE(a.ok());
  EXPECT_TRUE(std::isnan(a.scale));
  EXPECT_TRUE(std::isnan(a.rms_residual));
  EXPECT_TRUE(std::isnan(a.T_reference_estimate.translation.sum()));
  EXPECT_TRUE(std::isnan(a.T_reference_estimate.rotation.w()));
}

TEST(Alignment, RefusesPointsThatDetermineNothing) {
  Random random(7);
  const Points good = random_points(random, 10);
  const Points two(good.begin(), good.begin() + 2);
  const Points one(good.begin(), good.begin() + 1);
  // Far from the origin, so that rounding is not zero.
  const Eigen::Vector3d far(4.5e6, 5e5, 4e6);
  const Points place(10, far);
  Points line;
  Points vertical;
  for (int i = 0; i < 10; ++i) {
    line.push_back(far + 0.1 * i * Eigen::Vector3d(1, 2, 3));
    vertical.push_back(far + 0.1 * i * Eigen::Vector3d::UnitZ());
  }
  for (const AlignmentMode mode : {AlignmentMode::kSe3, AlignmentMode::kSim3}) {
    expect_failure(two, two, mode, AlignmentFailure::kTooFewPoints);
    expect_failure(good, place, mode, AlignmentFailure::kNoExtent);
    expect_failure(place, good, mode, AlignmentFailure::kNoExtent);
    expect_failure(good, line, mode, AlignmentFailure::kCollinear);
    expect_failure(line, good, mode, AlignmentFailure::kCollinear);
  }
  expect_failure(one, one, AlignmentMode::kYaw, AlignmentFailure::kTooFewPoints);
  expect_failure(vertical, vertical, AlignmentMode::kYaw, AlignmentFailure::kNoExtent);
  expect_failure(place, place, AlignmentMode::kYaw, AlignmentFailure::kNoExtent);
  // A line that is not vertical does determine a heading.
  EXPECT_TRUE(align_points(line, line, AlignmentMode::kYaw).ok());
}

TEST(Alignment, RefusesPointSetsThatSeveralRotationsFit) {
  // y of the estimate is +1 and -1 where the reference's is the same: no correlation but along x.
  const Points estimate = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
  const Points no_correlation = {{1, 0, 0}, {0, 0.5, 0}, {-1, 0, 0}, {0, 0.5, 0}};
  expect_failure(estimate, no_correlation, AlignmentMode::kSe3, AlignmentFailure::kAmbiguous);
  // Mirror image of a set that is alike in all directions: any axis may be the one that is turned over.
  const Points cross = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  Points mirrored = cross;
  for (auto& p : mirrored) p = -p;
  expect_failure(cross, mirrored, AlignmentMode::kSim3, AlignmentFailure::kAmbiguous);
  const Points inside_out = {{1, 0, 0}, {0, -1, 0}, {-1, 0, 0}, {0, 1, 0}};
  expect_failure(estimate, inside_out, AlignmentMode::kYaw, AlignmentFailure::kAmbiguous);
}

TEST(Alignment, RefusesBadInput) {
  const Points three = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const Points two = {{0, 0, 0}, {1, 0, 0}};
  Points with_nan = three;
  with_nan[1].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(align_points(three, two, AlignmentMode::kSe3), std::invalid_argument);
  EXPECT_THROW(align_points({}, {}, AlignmentMode::kNone), std::invalid_argument);
  EXPECT_THROW(align_points(three, with_nan, AlignmentMode::kSe3), std::invalid_argument);
  EXPECT_THROW(align_points(with_nan, three, AlignmentMode::kYaw), std::invalid_argument);
}

}  // namespace
}  // namespace loc
