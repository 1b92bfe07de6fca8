#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "libloc/core/random.hpp"
#include "libloc/geometry/camera.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

using test::near;
using test::numeric_jacobian;
using Vector8d = Eigen::Matrix<double, 8, 1>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

CameraCalibration calibration_of(DistortionModel model, const Eigen::Vector4d& intrinsics, const Eigen::Vector4d& k) {
  CameraCalibration c;
  c.name = "cam0";
  c.width_px = 752;
  c.height_px = 480;
  c.intrinsics_px = intrinsics;
  c.distortion_model = model;
  c.distortion = k;
  return c;
}

// From harmless to extreme: a usual lens, strong barrel that folds back within the image, pincushion with a large
// tangential part, two fisheyes of which the second folds at 97 degrees.
std::array<CameraCalibration, 7> cameras() {
  const Eigen::Vector4d f(458.654, 457.296, 367.215, 248.375);
  const Eigen::Vector4d wide(190.978, 190.973, 370.931, 236.897);
  using enum DistortionModel;
  return {calibration_of(kNone, f, Eigen::Vector4d::Zero()),
          calibration_of(kRadtan, f, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}),
          calibration_of(kRadtan, f, {-0.35, 0.05, 0.002, -0.001}),
          calibration_of(kRadtan, f, {0.6, 0.3, 0.02, -0.015}),
          calibration_of(kEquidistant, wide, {0.0034823894, 0.0007150348, -0.0020532361, 0.00020293673}),
          calibration_of(kEquidistant, wide, {-0.1, -0.005, 0, 0}),
          calibration_of(kEquidistant, f, Eigen::Vector4d::Zero())};
}

// Points all over the domain, its border included.
Eigen::Vector3d point_within(const Camera& camera, double share, double azimuth, double range) {
  const double angle = share * std::min(camera.max_angle(), 1.55);
  return range *
         Eigen::Vector3d(std::sin(angle) * std::cos(azimuth), std::sin(angle) * std::sin(azimuth), std::cos(angle));
}

TEST(Camera, ProjectsAsOpenCvDoes) {
  constexpr std::array<std::array<double, 14>, 40> kRows{{
#include "golden_camera.inc"
  }};
  constexpr std::array kModels{DistortionModel::kNone, DistortionModel::kRadtan, DistortionModel::kEquidistant};
  for (const auto& row : kRows) {
    const Camera camera(calibration_of(kModels.at(static_cast<std::size_t>(row[0])), Eigen::Vector4d(row.data() + 1),
                                       Eigen::Vector4d(row.data() + 5)));
    const auto pixel = camera.project(Eigen::Vector3d(row.data() + 9));
    ASSERT_TRUE(pixel);
    EXPECT_TRUE(near(*pixel, Eigen::Vector2d(row.data() + 12), 1e-9)) << row[0];
  }
}

TEST(Camera, JacobiansAreTheDerivatives) {
  Random random(1);
  for (const CameraCalibration& calibration : cameras()) {
    const Camera camera(calibration);
    for (int i = 0; i < 60; ++i) {
      const double share = i < 3 ? 1e-7 * i : random.uniform(0, 0.95);
      const Eigen::Vector3d p = point_within(camera, share, random.uniform(0, 6.3), random.uniform(1, 5));
      const auto projection = camera.project_with_jacobians(p);
      if (!projection) continue;  // the tangential part may fold a little earlier
      const double scale = projection->d_point.cwiseAbs().maxCoeff();
      const auto by_point = numeric_jacobian([&](const Eigen::Vector3d& x) { return *camera.project(x); }, p, 1e-6);
      EXPECT_TRUE(near(projection->d_point / scale, by_point / scale, 2e-7)) << share;

      Vector8d parameters;
      parameters << calibration.intrinsics_px, calibration.distortion;
      const auto by_parameters = numeric_jacobian(
          [&](const Vector8d& x) {
            return *Camera(calibration_of(calibration.distortion_model, x.head<4>(), x.tail<4>())).project(p);
          },
          parameters, 1e-7);
      const double parameter_scale = std::max(1.0, projection->d_parameters.cwiseAbs().maxCoeff());
      EXPECT_TRUE(near(projection->d_parameters / parameter_scale, by_parameters / parameter_scale, 1e-5)) << share;

      const auto ray = camera.unproject_with_jacobian(projection->pixel_px);
      ASSERT_TRUE(ray);
      const auto by_pixel =
          numeric_jacobian([&](const Eigen::Vector2d& x) { return *camera.unproject(x); }, projection->pixel_px, 1e-3);
      EXPECT_TRUE(near(ray->d_pixel, by_pixel, 1e-7)) << share;
      EXPECT_TRUE(near(ray->direction.transpose() * ray->d_pixel, Eigen::RowVector2d::Zero(), 1e-15));
    }
  }
}

// Every pixel, borders and corners included, either has a ray that projects to it, or has none and says so.
TEST(Camera, EveryPixelComesBackOrHasNoRay) {
  int without = 0;
  for (const CameraCalibration& calibration : cameras()) {
    const Camera camera(calibration);
    for (double v = -0.5; v <= 479.5; v += 12) {
      for (double u = -0.5; u <= 751.5; u += 11.75) {
        const Eigen::Vector2d pixel(u, v);
        const auto ray = camera.unproject(pixel);
        if (!ray) {
          ++without;
          EXPECT_TRUE(calibration.distortion_model != DistortionModel::kNone && calibration.distortion[0] < -0.05)
              << pixel.transpose();
          continue;
        }
        EXPECT_NEAR(ray->norm(), 1, 1e-15);
        const auto back = camera.project(7 * *ray);
        ASSERT_TRUE(back) << pixel.transpose();
        EXPECT_TRUE(near(*back, pixel, 1e-8));
      }
    }
  }
  EXPECT_GT(without, 100);  // the strong barrel and the folding fisheye: their image circles are smaller than the image
}

TEST(Camera, RaysComeBackUpToTheBorderOfTheDomain) {
  Random random(2);
  for (const CameraCalibration& calibration : cameras()) {
    const Camera camera(calibration);
    for (int i = 0; i < 300; ++i) {
      // Right at the border the pixel hardly moves with the angle: the ray is lost to rounding there.
      const Eigen::Vector3d ray = point_within(camera, i < 20 ? 0.999 : random.uniform(), random.uniform(0, 6.3), 1);
      const auto pixel = camera.project(ray);
      if (!pixel) continue;
      const auto back = camera.unproject(*pixel);
      ASSERT_TRUE(back) << ray.transpose();
      EXPECT_TRUE(near(*back, ray, 1e-7));
    }
  }
}

// The fold is found where the slope of the radial part vanishes; beyond it, what the formula gives is not believed.
TEST(Camera, NothingBeyondTheFold) {
  const CameraCalibration barrel = calibration_of(DistortionModel::kRadtan, {400, 400, 375.5, 239.5}, {-0.25, 0, 0, 0});
  const Camera camera(barrel);
  const double radius = std::sqrt(1 / 0.75);
  EXPECT_NEAR(camera.max_angle(), std::atan(radius), 1e-12);
  EXPECT_TRUE(camera.project({0.9999 * radius, 0, 1}));
  EXPECT_FALSE(camera.project({1.0001 * radius, 0, 1}));
  EXPECT_FALSE(camera.project({2, 0, 1}));  // 2 (1 - 0.25 * 4) = 0: the formula says centre of the image
  EXPECT_FALSE(camera.unproject({375.5 + 400 * 0.78, 239.5}));
  EXPECT_TRUE(camera.unproject({375.5 + 400 * 0.76, 239.5}));

  // Both roots of the slope: 1 - 2 r^2 + 0.75 r^4 vanishes at r^2 = 2/3 and 2.
  const Camera twice(calibration_of(DistortionModel::kRadtan, {400, 400, 375.5, 239.5}, {-2.0 / 3, 0.15, 0, 0}));
  EXPECT_NEAR(twice.max_angle(), std::atan(std::sqrt(2.0 / 3)), 1e-12);
  // Fisheye: 1 - 3 * 0.12 theta^2 vanishes at 1.6667.
  const Camera fisheye(calibration_of(DistortionModel::kEquidistant, {200, 200, 375.5, 239.5}, {-0.12, 0, 0, 0}));
  EXPECT_NEAR(fisheye.max_angle(), std::sqrt(1 / 0.36), 1e-9);
  EXPECT_NEAR(Camera(cameras()[6]).max_angle(), std::numbers::pi, 1e-6);
  EXPECT_NEAR(Camera(cameras()[1]).max_angle(), std::numbers::pi / 2, 1e-12);
}

TEST(Camera, WhatLiesBehind) {
  for (const CameraCalibration& calibration : cameras()) {
    const Camera camera(calibration);
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0, 0, 0)})
      EXPECT_FALSE(camera.project(p));
    const bool fisheye = calibration.distortion_model == DistortionModel::kEquidistant;
    EXPECT_FALSE(!fisheye && camera.project({1, 1, 0}));
    EXPECT_FALSE(!fisheye && camera.project({0.1, 0.1, -1}));
  }
  // A fisheye of more than 180 degrees sees them: 100 degrees from the axis.
  const Camera fisheye(cameras()[6]);
  const double angle = 100 * std::numbers::pi / 180;
  const Eigen::Vector3d ray(std::sin(angle), 0, std::cos(angle));
  const auto pixel = fisheye.project(ray);
  ASSERT_TRUE(pixel);
  EXPECT_TRUE(near(*pixel, Eigen::Vector2d(367.215 + 458.654 * angle, 248.375), 1e-9));
  EXPECT_TRUE(near(*fisheye.unproject(*pixel), ray, 1e-12));
}

TEST(Camera, NumbersThatAreNoneGiveNothing) {
  for (const CameraCalibration& calibration : cameras()) {
    const Camera camera(calibration);
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
      for (int axis = 0; axis < 3; ++axis) {
        Eigen::Vector3d p(0.1, 0.2, 1);
        p[axis] = bad;
        if (axis == 2 && bad == kInfinity) continue;  // a star straight ahead: the centre
        EXPECT_FALSE(camera.project(p)) << axis << " " << bad;
        if (axis < 2) {
          Eigen::Vector2d pixel(100, 100);
          pixel[axis] = bad;
          EXPECT_FALSE(camera.unproject(pixel));
          EXPECT_FALSE(camera.unproject_with_jacobian(pixel));
          EXPECT_FALSE(camera.in_image(pixel));
        }
      }
    }
    EXPECT_FALSE(camera.project({1e300, 1e300, 1e-300}));
    EXPECT_FALSE(camera.unproject({1e300, 0}));
  }
}

TEST(Camera, TheImageReachesHalfAPixelBeyondItsPixelsCentres) {
  const Camera camera(cameras()[0]);
  EXPECT_TRUE(camera.in_image({-0.5, -0.5}));
  EXPECT_TRUE(camera.in_image({751.5, 479.5}));
  EXPECT_FALSE(camera.in_image({-0.51, 3}));
  EXPECT_FALSE(camera.in_image({751.51, 3}));
  EXPECT_FALSE(camera.in_image({3, 479.51}));
  EXPECT_TRUE(camera.in_image({10, 10}, 10.5));
  EXPECT_FALSE(camera.in_image({9.9, 10}, 10.5));
  EXPECT_FALSE(camera.in_image({742, 10}, 10));
}

TEST(Camera, WrongCalibrationsAreNamed) {
  const auto message = [](const CameraCalibration& c) -> std::string {
    try {
      const Camera camera(c);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  };
  CameraCalibration c = cameras()[1];
  EXPECT_EQ(message(c), "");
  c.intrinsics_px[0] = -400;
  EXPECT_NE(message(c).find("cam0.intrinsics"), std::string::npos);
  c = cameras()[1];
  c.distortion[2] = kNan;
  EXPECT_NE(message(c).find("cam0.distortion_coeffs"), std::string::npos);
  c = cameras()[1];
  c.width_px = 0;
  EXPECT_NE(message(c).find("cam0.resolution"), std::string::npos);
}

}  // namespace
}  // namespace loc
