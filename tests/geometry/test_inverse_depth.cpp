#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "libloc/core/random.hpp"
#include "libloc/geometry/inverse_depth.hpp"
#include "support/numeric_jacobian.hpp"

namespace loc {

using Error6 = Eigen::Matrix<double, kInverseDepthDim, 1>;

namespace test {
inline InverseDepthPoint plus(InverseDepthPoint point, const Error6& d) {
  point.boxplus(d);
  return point;
}
}  // namespace test

namespace {

InverseDepthPoint some_point(Random& random) {
  InverseDepthPoint out;
  out.anchor = random.normal3();
  out.frame = frame_of_ray(random.direction());
  out.inverse_depth = random.uniform(0.05, 1);
  return out;
}

// numeric_jacobian() wants to know the size of an error of its argument; a point has no difference.
template <class Function>
auto by_errors(const Function& f, const InverseDepthPoint& x) {
  return test::numeric_jacobian([&](const Error6& d) { return f(test::plus(x, d)); }, Error6(Error6::Zero()));
}

TEST(InverseDepth, JacobianOfThePlace) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const InverseDepthPoint point = some_point(random);
    const auto numeric = by_errors([](const InverseDepthPoint& p) { return p.xyz(); }, point);
    EXPECT_TRUE(test::near(point.xyz_jacobian(), numeric, 1e-4 / std::pow(point.inverse_depth, 3)));
  }
}

TEST(InverseDepth, TheRaysErrorsAreAlongItsFrame) {
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    const InverseDepthPoint point = some_point(random);
    const auto numeric = by_errors([](const InverseDepthPoint& p) { return p.ray(); }, point);
    EXPECT_TRUE(test::near(Eigen::Matrix<double, 3, 2>(numeric.middleCols<2>(kRay)), point.ray_basis(), 1e-9));
    EXPECT_NEAR(point.ray().norm(), 1, 1e-12);
    EXPECT_LT((point.ray_basis().transpose() * point.ray()).norm(), 1e-12);
  }
}

TEST(InverseDepth, AnglesAreThoseOfTheSource) {
  // m = (cos(el) sin(az), -sin(el), cos(el) cos(az))
  for (const double azimuth : {-3.0, -1.0, 0.0, 0.5, 2.5}) {
    for (const double elevation : {-1.5, -0.3, 0.0, 1.2}) {
      InverseDepthPoint point;
      point.frame = frame_of_ray(
          {std::cos(elevation) * std::sin(azimuth), -std::sin(elevation), std::cos(elevation) * std::cos(azimuth)});
      EXPECT_NEAR(point.azimuth(), azimuth, 1e-12);
      EXPECT_NEAR(point.elevation(), elevation, 1e-12);
    }
  }
  // Straight up and down: the azimuth means nothing, all else works.
  InverseDepthPoint pole;
  pole.frame = frame_of_ray({0, 1, 0});
  pole.inverse_depth = 0.5;
  EXPECT_NEAR(pole.elevation(), -std::acos(0.0), 1e-7);
  EXPECT_TRUE(test::near(pole.xyz(), Eigen::Vector3d(0, 2, 0), 1e-12));
  EXPECT_TRUE(pole.xyz_jacobian().allFinite());
}

// Civera et al.: 0.1 is where the error of the depth, seen from the camera, begins to be skewed.
TEST(InverseDepth, LinearityIndex) {
  InverseDepthPoint point;
  point.frame = frame_of_ray({0, 0, 1});
  point.inverse_depth = 0.25;  // 4 m
  // From where it was first seen: no parallax, alpha = 0, d = 4 m.
  EXPECT_NEAR(linearity_index(point, 0.01, {0, 0, 0}), 4 * 0.01 / (0.0625 * 4), 1e-12);
  // From the side, at right angles to the ray, the depth is measured as a bearing.
  EXPECT_NEAR(linearity_index(point, 0.01, {3, 0, 4}), 0, 1e-12);
  // Half-way.
  EXPECT_NEAR(linearity_index(point, 0.01, {4, 0, 0}),
              4 * 0.01 * std::cos(std::acos(-1.0) / 4) / (0.0625 * 4 * std::sqrt(2.0)), 1e-12);
  point.inverse_depth = 0;
  EXPECT_EQ(linearity_index(point, 0.01, {1, 0, 0}), std::numeric_limits<double>::infinity());
  point.inverse_depth = -0.1;
  EXPECT_EQ(linearity_index(point, 0.01, {1, 0, 0}), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace loc
