#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/geometry/so3.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

using test::near;
using test::numeric_jacobian;

// Around every place where a formula changes over, and where one could break down.
const std::vector<double>& angles() {
  static const std::vector<double> kAngles = {0,      1e-300, 1e-160,  1e-12,       1e-9,        1e-7,         1.9e-6,
                                              2.1e-6, 1e-4,   9.99e-3, 1.001e-2,    1.99e-2,     2.01e-2,      0.1,
                                              1,      2,      3,       M_PI - 1e-3, M_PI - 1e-7, M_PI - 1e-10, M_PI};
  return kAngles;
}

double distance(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return std::min((a.coeffs() - b.coeffs()).norm(), (a.coeffs() + b.coeffs()).norm());
}

TEST(So3, ExpIsTheAxisAngleFormulaInLongDouble) {
  Random random(1);
  for (const double angle : angles()) {
    const Eigen::Vector3d axis = random.direction();
    const Eigen::Vector3d theta = angle * axis;
    const Eigen::Matrix<long double, 3, 1> exact = theta.cast<long double>();
    const long double norm = exact.stableNorm();
    const Eigen::Quaterniond q = so3::exp(theta);
    EXPECT_NEAR(q.w(), static_cast<double>(std::cos(norm / 2)), 2e-16) << angle;
    for (int i = 0; i < 3; ++i) {
      const long double part = norm == 0 ? 0 : std::sin(norm / 2) / norm * exact[i];
      EXPECT_NEAR(q.vec()[i], static_cast<double>(part), 5e-16 * std::abs(static_cast<double>(part))) << angle;
    }
  }
}

TEST(So3, LogInvertsExpForEveryAngle) {
  Random random(2);
  for (const double angle : angles()) {
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d theta = angle * random.direction();
      const Eigen::Vector3d back = so3::log(so3::exp(theta));
      if (angle == M_PI) {
        // Both directions of the axis are right.
        EXPECT_LT(std::min((back - theta).norm(), (back + theta).norm()), 1e-14);
      } else {
        EXPECT_TRUE(near(back, theta, 3e-15 * angle)) << angle;
      }
    }
  }
}

TEST(So3, LogOfQAndMinusQIsOneVector) {
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Quaterniond q = random.rotation();
    const Eigen::Quaterniond minus_q(-q.coeffs());
    EXPECT_TRUE(near(so3::log(q), so3::log(minus_q), 0));
    EXPECT_LE(so3::log(q).norm(), M_PI + 1e-15);
    EXPECT_LT(distance(so3::exp(so3::log(q)), q), 1e-15);
  }
  EXPECT_NEAR(so3::log(Eigen::Quaterniond(0, 0, 1, 0)).norm(), M_PI, 1e-15);
  EXPECT_NEAR(so3::log(Eigen::Quaterniond(-1e-300, 0, 1, 0)).norm(), M_PI, 1e-15);
  EXPECT_EQ(so3::log(Eigen::Quaterniond(-1, 0, 0, 0)).norm(), 0);
}

TEST(So3, ExpTurnsCounterClockwise) {
  const Eigen::Vector3d y = so3::exp({0, 0, M_PI / 2}) * Eigen::Vector3d::UnitX();
  EXPECT_TRUE(near(y, Eigen::Vector3d::UnitY(), 1e-15));
}

TEST(So3, HatAndVee) {
  const Eigen::Vector3d v(1, -2, 3);
  const Eigen::Vector3d w(0.5, 4, -1);
  EXPECT_TRUE(near(so3::hat(v) * w, v.cross(w), 1e-15));
  EXPECT_TRUE(near(so3::vee(so3::hat(v)), v, 0));
}

TEST(So3, GroupLaws) {
  Random random(4);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Quaterniond a = random.rotation();
    const Eigen::Quaterniond b = random.rotation();
    const Eigen::Quaterniond c = random.rotation();
    EXPECT_LT(distance((a * b) * c, a * (b * c)), 1e-15);
    EXPECT_LT(distance(a * a.conjugate(), Eigen::Quaterniond::Identity()), 1e-15);
    const Eigen::Vector3d theta = random.uniform(0, 3) * random.direction();
    EXPECT_LT(distance(so3::exp(theta).conjugate(), so3::exp(-theta)), 1e-15);
    // Exp(R theta) = R Exp(theta) R^-1
    EXPECT_LT(distance(so3::exp(a * theta), a * so3::exp(theta) * a.conjugate()), 2e-15);
    EXPECT_TRUE(near(so3::boxminus(so3::boxplus(a, theta), a), theta, 1e-14));
    EXPECT_LT(distance(so3::boxplus(a, so3::boxminus(b, a)), b), 2e-15);
  }
}

TEST(So3, BoxplusPerturbsOnTheRightInBodyAxes) {
  const Eigen::Quaterniond q = so3::exp({0, 0, M_PI / 2});
  // Turning about the body's x axis leaves the body's x axis (world y) where it is.
  const Eigen::Quaterniond turned = so3::boxplus(q, {0.3, 0, 0});
  EXPECT_TRUE(near(Eigen::Vector3d(turned * Eigen::Vector3d::UnitX()), Eigen::Vector3d::UnitY(), 1e-15));
  EXPECT_TRUE(near(so3::boxminus(turned, q), Eigen::Vector3d(0.3, 0, 0), 1e-15));
}

TEST(So3, JacobiansAgreeWithCentralDifferences) {
  Random random(5);
  for (const double angle : angles()) {
    if (angle > M_PI - 1e-4) continue;  // differences would cross the cut of log
    const Eigen::Vector3d theta = angle * random.direction();
    const auto exp = [](const Eigen::Vector3d& x) { return so3::exp(x); };
    EXPECT_TRUE(near(so3::right_jacobian(theta), numeric_jacobian(exp, theta), 1e-9)) << angle;
    const auto inverse = [](const Eigen::Vector3d& x) { return so3::exp(x).conjugate(); };
    // Exp(theta + d)^-1 = Exp(theta)^-1 Exp(left_jacobian d)^-1
    EXPECT_TRUE(near(-so3::left_jacobian(theta), numeric_jacobian(inverse, theta), 1e-9)) << angle;
    const auto log = [](const Eigen::Quaterniond& q) { return so3::log(q); };
    EXPECT_TRUE(near(so3::right_jacobian_inverse(theta), numeric_jacobian(log, so3::exp(theta)), 1e-8)) << angle;
  }
}

TEST(So3, JacobianAndItsInverseMultiplyToIdentity) {
  Random random(6);
  std::vector<double> all = angles();
  all.insert(all.end(), {3.5, 5, 6});  // the inverse is defined below 2 pi
  for (const double angle : all) {
    const Eigen::Vector3d theta = angle * random.direction();
    const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
    EXPECT_TRUE(near(so3::right_jacobian(theta) * so3::right_jacobian_inverse(theta), identity, 2e-14)) << angle;
    EXPECT_TRUE(near(so3::left_jacobian(theta), so3::right_jacobian(-theta), 0));
    EXPECT_TRUE(near(so3::left_jacobian(theta), so3::exp(theta) * so3::right_jacobian(theta), 2e-15)) << angle;
  }
}

TEST(So3, AngleBetweenIsExactNearZeroAndPi) {
  Random random(7);
  for (const double angle : angles()) {
    const Eigen::Quaterniond a = random.rotation();
    const Eigen::Quaterniond b = a * so3::exp(angle * random.direction());
    EXPECT_NEAR(so3::angle_between(a, b), angle, 1e-15 + 2e-15 * angle);
    EXPECT_NEAR(so3::angle_between(a, Eigen::Quaterniond(-b.coeffs())), angle, 1e-15 + 2e-15 * angle);
  }
}

TEST(So3, HeadingIsTheTurnAboutZThatComesClosest) {
  Random random(8);
  for (int i = 0; i < 200; ++i) {
    const double psi = random.uniform(-M_PI, M_PI);
    const double tilt = random.uniform(0, 3);
    const double direction = random.uniform(-M_PI, M_PI);
    const Eigen::Quaterniond inclination =
        so3::exp(tilt * Eigen::Vector3d(std::cos(direction), std::sin(direction), 0));
    const Eigen::Quaterniond q = so3::exp({0, 0, psi}) * inclination;
    EXPECT_NEAR(so3::heading(q), psi, 1e-13);
    EXPECT_NEAR(so3::heading(Eigen::Quaterniond(-q.coeffs())), psi, 1e-13);
    const double best = so3::angle_between(q, so3::exp({0, 0, psi}));
    EXPECT_GT(so3::angle_between(q, so3::exp({0, 0, psi + 0.05})), best);
    EXPECT_GT(so3::angle_between(q, so3::exp({0, 0, psi - 0.05})), best);
  }
}

}  // namespace
}  // namespace loc
