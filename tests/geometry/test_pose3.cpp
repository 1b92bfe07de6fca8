#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "libloc/core/random.hpp"
#include "libloc/geometry/pose3.hpp"
#include "libloc/geometry/so3.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

using test::near;
using test::numeric_jacobian;

Pose3 random_pose(Random& random) {
  return {random.rotation(), 3 * random.normal3()};
}

Vector6d random_tangent(Random& random, double angle) {
  Vector6d xi;
  xi << 2 * random.normal3(), angle * random.direction();
  return xi;
}

// Power series of the matrix exponential, after scaling down; an independent definition of Exp.
Eigen::Matrix4d matrix_exponential(const Vector6d& xi) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m.topLeftCorner<3, 3>() = so3::hat(xi.tail<3>());
  m.topRightCorner<3, 1>() = xi.head<3>();
  m /= 1024;
  Eigen::Matrix4d sum = Eigen::Matrix4d::Identity();
  Eigen::Matrix4d term = Eigen::Matrix4d::Identity();
  for (int n = 1; n < 20; ++n) {
    term = (term * m / n).eval();
    sum += term;
  }
  for (int i = 0; i < 10; ++i) sum = (sum * sum).eval();
  return sum;
}

TEST(Pose3, GroupLaws) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Pose3 a = random_pose(random);
    const Pose3 b = random_pose(random);
    const Pose3 c = random_pose(random);
    EXPECT_TRUE(near(((a * b) * c).matrix(), (a * (b * c)).matrix(), 2e-14));
    EXPECT_TRUE(near((a * a.inverse()).matrix(), Eigen::Matrix4d::Identity(), 5e-14));
    EXPECT_TRUE(near((a * b).matrix(), a.matrix() * b.matrix(), 2e-14));
    const Eigen::Vector3d p = random.normal3();
    EXPECT_TRUE(near((a * b) * p, a * (b * p), 2e-14));
    EXPECT_TRUE(near(a.inverse() * (a * p), p, 2e-14));
  }
}

TEST(Pose3, ExpIsTheMatrixExponential) {
  Random random(2);
  for (const double angle : {0.0, 1e-12, 1e-6, 9e-3, 1.1e-2, 0.5, 2.0, 3.14}) {
    const Vector6d xi = random_tangent(random, angle);
    EXPECT_TRUE(near(Pose3::exp(xi).matrix(), matrix_exponential(xi), 1e-12)) << angle;
  }
}

TEST(Pose3, LogInvertsExp) {
  Random random(3);
  for (const double angle : {0.0, 1e-12, 1e-9, 1e-6, 9.9e-3, 1.1e-2, 0.1, 1.0, 2.0, 3.0, M_PI - 1e-6, M_PI - 1e-9}) {
    for (int i = 0; i < 20; ++i) {
      const Vector6d xi = random_tangent(random, angle);
      EXPECT_TRUE(near(Pose3::exp(xi).log(), xi, 5e-14)) << angle;
      Pose3 flipped = Pose3::exp(xi);
      flipped.rotation.coeffs() *= -1;
      EXPECT_TRUE(near(flipped.log(), xi, 5e-14)) << angle;
    }
  }
  // At pi either axis is right; what Exp makes of the log is the same pose.
  const Vector6d xi = random_tangent(random, M_PI);
  EXPECT_TRUE(near(Pose3::exp(Pose3::exp(xi).log()).matrix(), Pose3::exp(xi).matrix(), 1e-14));
}

TEST(Pose3, BoxminusInvertsBoxplus) {
  Random random(4);
  for (int i = 0; i < 100; ++i) {
    const Pose3 a = random_pose(random);
    const Pose3 b = random_pose(random);
    EXPECT_TRUE(near(a.boxplus(b.boxminus(a)).matrix(), b.matrix(), 1e-13));
    const Vector6d xi = random_tangent(random, 1.5);
    EXPECT_TRUE(near(a.boxplus(xi).boxminus(a), xi, 1e-13));
  }
}

TEST(Pose3, AdjointMovesAPerturbationToTheOtherSide) {
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    const Pose3 t = random_pose(random);
    const Vector6d xi = random_tangent(random, 0.7);
    const Vector6d moved = t.adjoint() * xi;
    EXPECT_TRUE(near((t * Pose3::exp(xi)).matrix(), (Pose3::exp(moved) * t).matrix(), 1e-13));
    // d (x^-1) under a right perturbation of x is -Ad(x).
    EXPECT_TRUE(near(numeric_jacobian([](const Pose3& x) { return x.inverse(); }, t), -t.adjoint(), 1e-8));
    // d (x * b) = Ad(b^-1).
    const Pose3 b = random_pose(random);
    EXPECT_TRUE(near(numeric_jacobian([&](const Pose3& x) { return x * b; }, t), b.inverse().adjoint(), 1e-8));
  }
}

TEST(Pose3, MatrixRoundTrip) {
  Random random(6);
  for (int i = 0; i < 100; ++i) {
    const Pose3 t = random_pose(random);
    EXPECT_TRUE(near(Pose3::from_matrix(t.matrix()).matrix(), t.matrix(), 1e-14));
  }
}

TEST(Pose3, RefusesMatricesThatAreNotRigid) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m(0, 0) = 1.01;
  EXPECT_THROW(Pose3::from_matrix(m), std::invalid_argument);
  m(0, 0) = -1;  // a reflection
  EXPECT_THROW(Pose3::from_matrix(m), std::invalid_argument);
  m = Eigen::Matrix4d::Identity();
  m(3, 0) = 0.1;
  EXPECT_THROW(Pose3::from_matrix(m), std::invalid_argument);
  m = Eigen::Matrix4d::Identity();
  m(1, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Pose3::from_matrix(m), std::invalid_argument);
  // Rounded to a few digits, as in hand-written calibration files, is still a pose, and the rotation comes out unit.
  m = Eigen::Matrix4d::Identity();
  m(0, 1) = 4e-4;
  EXPECT_NEAR(Pose3::from_matrix(m).rotation.norm(), 1, 1e-15);
}

TEST(Pose3, LongProductsStayUnit) {
  Random random(7);
  const Pose3 step = random_pose(random);
  Pose3 t;
  for (int i = 0; i < 100000; ++i) t = t * step;
  EXPECT_NEAR(t.rotation.norm(), 1, 1e-15);
}

}  // namespace
}  // namespace loc
