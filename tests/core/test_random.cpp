// The numbers of a seed are part of the interface: simulations and their statistics rest upon them.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "libloc/core/random.hpp"

namespace loc {
namespace {

TEST(Random, EngineIsTheStandardOne) {
  // [rand.predef]: the 10000th value of a default-constructed mt19937_64 (seed 5489) is 9981545732273789042.
  Random random(5489);
  double last = 0;
  for (int i = 0; i < 10000; ++i) last = random.uniform();
  EXPECT_EQ(last, static_cast<double>(9981545732273789042ULL >> 11U) * 0x1.0p-53);
}

TEST(Random, NormalFollowsThePolarMethodOfTheSameUniforms) {
  Random uniforms(42);
  Random normals(42);
  for (int i = 0; i < 1000; ++i) {
    double u = 0;
    double v = 0;
    double s = 2;
    while (s >= 1) {
      u = 2 * uniforms.uniform() - 1;
      v = 2 * uniforms.uniform() - 1;
      s = u * u + v * v;
    }
    EXPECT_NEAR(normals.normal(), u * std::sqrt(-2 * std::log(s) / s), 1e-14);
    EXPECT_NEAR(normals.normal(), v * std::sqrt(-2 * std::log(s) / s), 1e-14);
  }
}

TEST(Random, SameSeedSameNumbersOtherSeedOthers) {
  Random a(7);
  Random b(7);
  Random c(8);
  for (int i = 0; i < 100; ++i) {
    const double x = a.normal();
    EXPECT_EQ(x, b.normal());
    EXPECT_NE(x, c.normal());
  }
}

TEST(Random, GoldenValues) {
  Random random(1);
  EXPECT_EQ(random.uniform(), 0.13387664401253263);
  EXPECT_EQ(random.uniform(-2, 2), -1.4543718545352111);
  EXPECT_NEAR(random.normal(), -0.039399956754155314, 1e-15);
  EXPECT_NEAR(random.normal(), -0.38683176162103955, 1e-15);
  EXPECT_EQ(random.fork(3).uniform(), 0.47786345804091568);
}

TEST(Random, ForksAreIndependentOfWhatTheirSiblingsDraw) {
  Random a(3);
  Random b(3);
  Random a_first = a.fork(0);
  for (int i = 0; i < 50; ++i) a_first.normal();
  b.fork(0);
  EXPECT_EQ(a.fork(1).uniform(), b.fork(1).uniform());

  // Neighbouring streams do not correlate.
  Random parent(3);
  Random x = Random(parent).fork(0);
  Random y = Random(parent).fork(1);
  double sum = 0;
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount; ++i) sum += x.normal() * y.normal();
  EXPECT_LT(std::abs(sum / kCount), 5 / std::sqrt(kCount));
}

TEST(Random, MomentsOfUniformAndNormal) {
  constexpr int kCount = 200000;
  Random random(11);
  double u1 = 0;
  double u2 = 0;
  double n1 = 0;
  double n2 = 0;
  double n3 = 0;
  double n4 = 0;
  for (int i = 0; i < kCount; ++i) {
    const double u = random.uniform();
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
    u1 += u / kCount;
    u2 += u * u / kCount;
    const double n = random.normal();
    n1 += n / kCount;
    n2 += n * n / kCount;
    n3 += n * n * n / kCount;
    n4 += n * n * n * n / kCount;
  }
  // Five deviations of each sample moment.
  const double root = 5 / std::sqrt(kCount);
  EXPECT_NEAR(u1, 0.5, root * std::sqrt(1.0 / 12));
  EXPECT_NEAR(u2, 1.0 / 3, root * std::sqrt(4.0 / 45));
  EXPECT_NEAR(n1, 0, root);
  EXPECT_NEAR(n2, 1, root * std::sqrt(2));
  EXPECT_NEAR(n3, 0, root * std::sqrt(15));
  EXPECT_NEAR(n4, 3, root * std::sqrt(96));
}

TEST(Random, DirectionsAndRotationsAreUniform) {
  constexpr int kCount = 50000;
  Random random(5);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d rotated = Eigen::Matrix3d::Zero();
  double angle = 0;
  for (int i = 0; i < kCount; ++i) {
    const Eigen::Vector3d d = random.direction();
    ASSERT_NEAR(d.norm(), 1, 1e-14);
    sum += d / kCount;
    second += d * d.transpose() / kCount;
    const Eigen::Quaterniond q = random.rotation();
    ASSERT_NEAR(q.norm(), 1, 1e-14);
    rotated += q.toRotationMatrix() / kCount;
    angle += 2 * std::acos(std::min(1.0, std::abs(q.w()))) / kCount;
  }
  const double bound = 5 / std::sqrt(kCount);
  EXPECT_LT(sum.cwiseAbs().maxCoeff(), bound);
  EXPECT_LT((second - Eigen::Matrix3d::Identity() / 3).cwiseAbs().maxCoeff(), bound);
  EXPECT_LT(rotated.cwiseAbs().maxCoeff(), bound);
  // Mean angle of the Haar measure: pi/2 + 2/pi.
  EXPECT_NEAR(angle, M_PI / 2 + 2 / M_PI, bound);
}

}  // namespace
}  // namespace loc
