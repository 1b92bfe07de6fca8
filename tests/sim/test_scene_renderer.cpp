#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "libloc/geometry/so3.hpp"
#include "libloc/sim/box_texture.hpp"
#include "libloc/sim/calibration_target.hpp"
#include "libloc/sim/scene_renderer.hpp"

namespace loc {
namespace {

CameraCalibration camera_of(int width, int height, double f) {
  CameraCalibration c;
  c.name = "cam0";
  c.width_px = width;
  c.height_px = height;
  c.intrinsics_px = {f, f, (width - 1) / 2.0, (height - 1) / 2.0};
  return c;
}

/// Camera at a place, looking along world's y (x right, z up).
Pose3 looking_along_y(const Eigen::Vector3d& place) {
  Eigen::Matrix3d R;
  R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return {Eigen::Quaterniond(R), place};
}

/// A wall across the y axis, two metres wide and high, its middle at (0, y, 0), its front towards the origin.
Scene wall_at(double y, const Colour& colour) {
  Scene scene;
  Texture texture;
  texture.size = {2, 2};
  texture.background = colour;
  scene.textures.push_back(texture);
  scene.add_face({.origin = {-1, y, -1}});
  return scene;
}

int pixel(const ImageMeasurement& image, int x, int y, int channel = 0) {
  const int channels = image.format == PixelFormat::kGray ? 1 : 3;
  return image.data->at(static_cast<std::size_t>(y * image.row_stride_bytes + x * channels + channel));
}

TEST(BoxTexture, MeansAreExactForPartsOfTexels) {
  Texture texture;
  texture.size = {4, 2};
  texture.background = {0, 0, 0};
  texture.patches.push_back({{1, 0}, {2.5, 2}, {200, 200, 200}});
  const detail::BoxTexture box(texture, 1, 1);  // the edge at 2.5 is in the middle of a texel
  const auto mean = [&](double x, double y, double width, double height) {
    float value = 0;
    box.mean({x, y}, {width, height}, &value);
    return value;
  };
  EXPECT_NEAR(mean(2, 1, 4, 2), 75, 1e-4);
  EXPECT_NEAR(mean(1.5, 0.5, 0.5, 0.5), 200, 1e-4);
  EXPECT_NEAR(mean(1, 0.7, 0.5, 0.3), 100, 1e-4);
  EXPECT_NEAR(mean(2.5, 1, 1, 1), 100, 1e-4);
  EXPECT_NEAR(mean(1.25, 1, 1, 1), 150, 1e-4);
  EXPECT_NEAR(mean(0, 0, 2, 2), 0, 1e-4);  // cut at the border
  EXPECT_NEAR(mean(4, 2, 8, 4), 75, 1e-3);
  EXPECT_NEAR(mean(1.5, 1, 0, 0), 200, 0.1);

  // Patches that touch within a texel leave no seam, and a later one hides an earlier one wherever it is.
  texture.patches = {
      {{0, 0}, {1.3, 2}, {100, 100, 100}}, {{1.3, 0}, {4, 2}, {100, 100, 100}}, {{1.1, 0.2}, {1.4, 0.7}, {0, 0, 0}}};
  const detail::BoxTexture whole(texture, 1, 1);
  float value = 0;
  whole.mean({1.5, 1.5}, {1, 1}, &value);
  EXPECT_EQ(value, 100);
  whole.mean({1.5, 0.5}, {1, 1}, &value);
  EXPECT_EQ(value, 85);
}

TEST(SceneRenderer, AnEdgeStandsWhereItIsProjected) {
  // f = 100 px at 2 m: a pixel is 20 mm wide. White beyond x = 0.113 m: projected to 49.5 + 5.65.
  Scene scene = wall_at(2, {40, 40, 40});
  scene.textures[0].patches.push_back({{1.113, 0}, {2, 2}, {240, 240, 240}});
  const ImageMeasurement image =
      SceneRenderer(scene, camera_of(100, 80, 100), {.blur_px = 1}).render(looking_along_y({0, 0, 0}));
  ASSERT_EQ(image.width_px, 100);
  ASSERT_EQ(image.row_stride_bytes, 100);
  ASSERT_EQ(image.data->size(), 8000U);
  // Pixel 55 reaches from 54.5 to 55.5: 0.35 of it is beyond 55.15.
  EXPECT_EQ(pixel(image, 54, 40), 40);
  EXPECT_NEAR(pixel(image, 55, 40), 40 + 0.35 * 200, 1);
  EXPECT_EQ(pixel(image, 56, 40), 240);
}

TEST(SceneRenderer, TheNearestFrontIsSeen) {
  const Colour red{200, 0, 0};
  const Colour green{0, 150, 0};
  for (const bool swapped : {false, true}) {
    Scene scene = wall_at(swapped ? 4 : 2, swapped ? red : green);
    scene.add(wall_at(swapped ? 2 : 4, swapped ? green : red), Pose3{});
    scene.sky = {1, 2, 3};
    scene.ground = {4, 5, 6};
    const SceneRenderer renderer(scene, camera_of(160, 120, 50), {.format = PixelFormat::kBgr, .texel_m = 0.1});
    const ImageMeasurement image = renderer.render(looking_along_y({0, 0, 0}));
    EXPECT_EQ(pixel(image, 80, 60, 1), 150);
    EXPECT_EQ(pixel(image, 80, 60, 2), 0);
    // Above and below: sky and ground; blue comes first.
    EXPECT_EQ(pixel(image, 80, 5, 0), 3);
    EXPECT_EQ(pixel(image, 80, 5, 2), 1);
    EXPECT_EQ(pixel(image, 80, 115, 0), 6);
    // From between them: the red one, for green shows its back when one turns round.
    const ImageMeasurement between = renderer.render(looking_along_y({0, 3, 0}));
    EXPECT_EQ(pixel(between, 80, 60, 2), 200);
    const Pose3 back = looking_along_y({0, 3, 0}) * Pose3{so3::exp({0, M_PI, 0}), {0, 0, 0}};
    EXPECT_NE(pixel(renderer.render(back), 80, 60, 1), 150);
    const ImageMeasurement rgb =
        SceneRenderer(scene, camera_of(160, 120, 50), {.format = PixelFormat::kRgb, .texel_m = 0.1})
            .render(looking_along_y({0, 0, 0}));
    EXPECT_EQ(pixel(rgb, 80, 5, 0), 1);
    EXPECT_EQ(pixel(rgb, 80, 5, 2), 3);
  }
}

// Every pixel by itself, against the colour at the point where its ray meets the board: no tile forgets a face.
TEST(SceneRenderer, ColoursAreThoseOfTheRaysEvenInAFisheyeOf200Degrees) {
  Scene scene;
  Random random(3);
  for (int i = 0; i < 40; ++i) {
    Scene wall = wall_at(2, {static_cast<std::uint8_t>(5 * i + 20), 0, 0});
    wall.textures[0].size = {0.5, 0.5};
    scene.add(wall, Pose3{random.rotation(), 0.5 * random.normal3()});
  }
  scene.sky = scene.ground = {10, 0, 0};
  CameraCalibration c = camera_of(120, 120, 30);
  c.distortion_model = DistortionModel::kEquidistant;
  const Camera camera(c);
  const Pose3 T_world_camera{random.rotation(), {0.1, 0.2, -0.1}};
  const ImageMeasurement image =
      SceneRenderer(scene, c, {.format = PixelFormat::kRgb, .texel_m = 0.1}).render(T_world_camera);
  int checked = 0;
  int drawn = 0;
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 120; ++x) {
      const auto ray = camera.unproject({static_cast<double>(x), static_cast<double>(y)});
      if (!ray) continue;
      const Eigen::Vector3d d = T_world_camera.rotation * *ray;
      int expected = 10;
      double nearest = std::numeric_limits<double>::infinity();
      for (const Face& face : scene.faces) {
        const double slope = face.normal().dot(d);
        if (slope >= 0) continue;
        const double t = face.normal().dot(face.origin - T_world_camera.translation) / slope;
        const Eigen::Vector3d hit = T_world_camera.translation + t * d - face.origin;
        const bool inside =
            hit.dot(face.right) > 0 && hit.dot(face.right) < 0.5 && hit.dot(face.up) > 0 && hit.dot(face.up) < 0.5;
        if (t > 0 && t < nearest && inside) {
          nearest = t;
          expected = scene.textures[static_cast<std::size_t>(face.texture)].background[0];
        }
      }
      ++checked;
      drawn += expected != 10 ? 1 : 0;
      EXPECT_EQ(pixel(image, x, y), expected) << x << " " << y;
    }
  }
  EXPECT_GT(checked, 11'000);
  EXPECT_GT(drawn, 1'000);
}

TEST(SceneRenderer, PixelsOutsideTheImageCircleAreBlack) {
  CameraCalibration c = camera_of(100, 100, 30);
  c.distortion_model = DistortionModel::kRadtan;
  c.distortion = {-0.25, 0, 0, 0};  // ends at 0.77 * 30 px from the centre
  const ImageMeasurement image = SceneRenderer(wall_at(1, {99, 99, 99}), c, {}).render(looking_along_y({0, 0, 0}));
  EXPECT_EQ(pixel(image, 49, 49), 99);
  EXPECT_EQ(pixel(image, 5, 49), 0);
}

TEST(SceneRenderer, MotionBlurGainAndNoise) {
  Scene scene = wall_at(2, {0, 0, 0});
  scene.textures[0].patches.push_back({{0, 0}, {1, 2}, {100, 100, 100}});
  const CameraCalibration c = camera_of(100, 80, 100);
  const Pose3 left = looking_along_y({-0.2, 0, 0});
  const Pose3 right = looking_along_y({0.2, 0, 0});
  const std::array<Pose3, 2> both{left, right};
  const ImageMeasurement image = SceneRenderer(scene, c, {.blur_px = 1}).render(both);
  EXPECT_EQ(pixel(image, 35, 40), 100);
  EXPECT_EQ(pixel(image, 50, 40), 50);  // the edge moves over it
  EXPECT_EQ(pixel(image, 65, 40), 0);
  EXPECT_EQ(pixel(SceneRenderer(scene, c, {.texel_m = 0.01, .gain = 1.5}).render(left), 35, 40), 150);
  EXPECT_EQ(pixel(SceneRenderer(scene, c, {.texel_m = 0.01, .gain = 9}).render(left), 35, 40), 255);

  const SceneRenderer noisy(wall_at(2, {100, 100, 100}), c, {.texel_m = 0.1, .noise_sigma = 4});
  Random random(1);
  const ImageMeasurement first = noisy.render(looking_along_y({0, 1, 0}), &random);
  double sum = 0;
  double squares = 0;
  for (const std::uint8_t byte : *first.data) {
    sum += byte - 100.0;
    squares += (byte - 100.0) * (byte - 100.0);
  }
  const double n = 8000;
  EXPECT_NEAR(sum / n, 0, 4.5 * 4 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 16 + 1.0 / 12, 4.5 * 16 * std::sqrt(2 / n));
  Random again(1);
  EXPECT_EQ(*noisy.render(looking_along_y({0, 1, 0}), &again).data, *first.data);
  EXPECT_NE(*noisy.render(looking_along_y({0, 1, 0}), &again).data, *first.data);
  EXPECT_THROW(noisy.render(left), std::invalid_argument);
}

TEST(SceneRenderer, WrongInputIsNamed) {
  const Scene scene = checkerboard({});
  const CameraCalibration c = camera_of(100, 80, 100);
  const auto message = [&](const RendererOptions& options) -> std::string {
    try {
      const SceneRenderer renderer(scene, c, options);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  };
  const auto contains = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_TRUE(contains(message({.format = PixelFormat::kMjpeg}), "format"));
  EXPECT_TRUE(contains(message({.texel_m = 1e-6}), "texel_m = 1e-06"));
  EXPECT_TRUE(contains(message({.blur_px = -1}), "blur_px = -1"));
  EXPECT_TRUE(contains(message({.gain = 0}), "gain = 0"));
  EXPECT_TRUE(contains(message({.noise_sigma = std::nan("")}), "noise_sigma = nan"));
  const SceneRenderer renderer(scene, c, {});
  EXPECT_THROW(renderer.render(std::span<const Pose3>{}), std::invalid_argument);
  EXPECT_THROW(renderer.render(Pose3{Eigen::Quaterniond::Identity(), {0, std::nan(""), 0}}), std::invalid_argument);
}

}  // namespace
}  // namespace loc
