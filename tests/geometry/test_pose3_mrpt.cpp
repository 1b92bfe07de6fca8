// A second opinion on SE(3) by a library of other authors. MRPT's convention: R = Rz(yaw) Ry(pitch) Rx(roll).
#include <gtest/gtest.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DQuat.h>
#include <mrpt/poses/Lie/SO.h>

#include "libloc/core/random.hpp"
#include "libloc/geometry/pose3.hpp"
#include "libloc/geometry/so3.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

using mrpt::poses::CPose3D;
using test::near;

Eigen::Matrix4d matrix_of(const CPose3D& pose) {
  return pose.getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>().asEigen();
}

TEST(Pose3Mrpt, EulerAnglesMakeTheSameMatrix) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const double yaw = random.uniform(-3, 3);
    const double pitch = random.uniform(-1.5, 1.5);
    const double roll = random.uniform(-3, 3);
    const Eigen::Vector3d p = random.normal3();
    const Pose3 ours{so3::exp({0, 0, yaw}) * so3::exp({0, pitch, 0}) * so3::exp({roll, 0, 0}), p};
    EXPECT_TRUE(near(ours.matrix(), matrix_of(CPose3D(p.x(), p.y(), p.z(), yaw, pitch, roll)), 1e-14));
  }
}

TEST(Pose3Mrpt, ProductInverseAndPointsAgree) {
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    const Pose3 a{random.rotation(), random.normal3()};
    const Pose3 b{random.rotation(), random.normal3()};
    const CPose3D mrpt_a(mrpt::math::CMatrixDouble44(a.matrix()));
    const CPose3D mrpt_b(mrpt::math::CMatrixDouble44(b.matrix()));
    EXPECT_TRUE(near((a * b).matrix(), matrix_of(mrpt_a + mrpt_b), 1e-14));
    EXPECT_TRUE(near((b.inverse() * a).matrix(), matrix_of(mrpt_a - mrpt_b), 1e-14));
    const Eigen::Vector3d p = random.normal3();
    const auto q = mrpt_a.composePoint(mrpt::math::TPoint3D(p.x(), p.y(), p.z()));
    EXPECT_TRUE(near(a * p, Eigen::Vector3d(q.x, q.y, q.z), 1e-14));
  }
}

TEST(Pose3Mrpt, RotationLogarithmAgrees) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d theta = random.uniform(0.01, 3) * random.direction();
    const CPose3D pose(mrpt::math::CMatrixDouble44(Pose3{so3::exp(theta), Eigen::Vector3d::Zero()}.matrix()));
    const auto log = mrpt::poses::Lie::SO<3>::log(pose.getRotationMatrix());
    EXPECT_TRUE(near(so3::log(so3::exp(theta)), Eigen::Vector3d(log[0], log[1], log[2]), 1e-12));
  }
}

}  // namespace
}  // namespace loc
