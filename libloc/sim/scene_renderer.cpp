#include "libloc/sim/scene_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libloc/core/check.hpp"
#include "libloc/sim/box_texture.hpp"

namespace loc {
namespace {

constexpr int kTile = 32;  // [px] faces are sorted out for squares of this side

// Part of the image with the cone that holds its rays.
struct Tile {
  int x0, y0, x1, y1;
  Eigen::Vector3f axis;
  float half_angle;  // negative: no pixel of it has a ray
};

// A face from one place of the camera, in its axes.
struct SeenFace {
  Eigen::Vector3f right, up, normal;
  float scale;             // normal . origin: negative, the camera is in front
  Eigen::Vector2f offset;  // right . origin, up . origin
  Eigen::Vector2f size;
  Eigen::Vector3f direction;  // to the middle, unit vector
  float half_angle;           // of the cone that holds the face
  float nearest;              // distance that no point of it comes below
  const detail::BoxTexture* texture;
};

std::vector<SeenFace> seen_faces(const Scene& scene, const std::vector<detail::BoxTexture>& textures,
                                 const Pose3& T_world_camera) {
  const Eigen::Matrix3d R_camera_world = T_world_camera.rotation.conjugate().toRotationMatrix();
  std::vector<SeenFace> seen;
  for (const Face& face : scene.faces) {
    const Eigen::Vector2d& size = scene.textures[static_cast<std::size_t>(face.texture)].size;
    const Eigen::Vector3d normal = face.normal();
    const Eigen::Vector3d from_camera = face.origin - T_world_camera.translation;
    const double scale = normal.dot(from_camera);
    if (scale >= 0) continue;
    const Eigen::Vector3d middle = R_camera_world * (face.at(size / 2) - T_world_camera.translation);
    const double distance = middle.norm();
    const double radius = size.norm() / 2;
    SeenFace& s = seen.emplace_back();
    s.right = (R_camera_world * face.right).cast<float>();
    s.up = (R_camera_world * face.up).cast<float>();
    s.normal = (R_camera_world * normal).cast<float>();
    s.scale = static_cast<float>(scale);
    s.offset = Eigen::Vector2d(face.right.dot(from_camera), face.up.dot(from_camera)).cast<float>();
    s.size = size.cast<float>();
    s.direction = (middle / distance).cast<float>();
    s.half_angle = distance > radius ? static_cast<float>(std::asin(radius / distance)) : 4.0F;
    s.nearest = static_cast<float>(distance - radius);
    s.texture = &textures[static_cast<std::size_t>(face.texture)];
  }
  std::ranges::sort(seen, {}, &SeenFace::nearest);
  return seen;
}

float angle_between(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::acos(std::clamp(a.dot(b), -1.0F, 1.0F));
}

}  // namespace

void RendererOptions::check() const {
  const bool known = format == PixelFormat::kGray || format == PixelFormat::kBgr || format == PixelFormat::kRgb;
  require(known, "format: must be grey, BGR or RGB");
  require_not_negative("texel_m", texel_m);
  require(blur_px >= 0 && blur_px <= 100, "blur_px", blur_px, "must be in [0, 100]");
  require_positive("gain", gain);
  require_not_negative("noise_sigma", noise_sigma);
}

struct SceneRenderer::Parts {
  Parts(const Scene& given_scene, const CameraCalibration& calibration, const RendererOptions& given_options);
  void add(const Pose3& T_world_camera, std::vector<float>& image) const;
  void fill(const Tile& tile, const std::vector<SeenFace>& faces, const Eigen::Vector3f& up,
            std::vector<float>& image) const;
  void shade(const SeenFace& face, std::size_t pixel, float* out) const;

  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }

  Scene scene;
  RendererOptions options;
  int width, height, channels;
  std::vector<detail::BoxTexture> textures;
  std::vector<Eigen::Vector3f> rays;            // unit vectors in camera; zero where there is none
  std::vector<Eigen::Vector3f> step_x, step_y;  // to the ray of the pixel right of it, below it
  std::vector<Tile> tiles;
  std::array<float, 3> sky{}, ground{};
};

SceneRenderer::Parts::Parts(const Scene& given_scene, const CameraCalibration& calibration,
                            const RendererOptions& given_options)
    : scene((given_scene.check(), given_scene)),
      options((given_options.check(), given_options)),
      width(calibration.width_px),
      height(calibration.height_px),
      channels(options.format == PixelFormat::kGray ? 1 : 3) {
  const Camera camera(calibration);
  for (const Texture& texture : scene.textures) textures.emplace_back(texture, options.texel_m, channels);
  const auto background = [&](const Colour& colour) -> std::array<float, 3> {
    if (channels == 1) return {static_cast<float>(detail::luma(colour)), 0, 0};
    return {static_cast<float>(colour[0]), static_cast<float>(colour[1]), static_cast<float>(colour[2])};
  };
  sky = background(scene.sky);
  ground = background(scene.ground);

  const std::size_t count = at(0, height);
  rays.assign(count, Eigen::Vector3f::Zero());
  step_x = step_y = rays;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto ray = camera.unproject_with_jacobian({static_cast<double>(x), static_cast<double>(y)});
      if (!ray) continue;
      rays[at(x, y)] = ray->direction.cast<float>();
      step_x[at(x, y)] = (options.blur_px * ray->d_pixel.col(0)).cast<float>();
      step_y[at(x, y)] = (options.blur_px * ray->d_pixel.col(1)).cast<float>();
    }
  }
  for (int y = 0; y < height; y += kTile) {
    for (int x = 0; x < width; x += kTile) {
      Tile tile{x, y, std::min(x + kTile, width), std::min(y + kTile, height), Eigen::Vector3f::Zero(), -1};
      const auto for_all = [&](auto f) {
        for (int v = tile.y0; v < tile.y1; ++v) {
          for (int u = tile.x0; u < tile.x1; ++u) {
            if (rays[at(u, v)].squaredNorm() > 0) f(rays[at(u, v)]);
          }
        }
      };
      for_all([&](const Eigen::Vector3f& ray) { tile.axis += ray; });
      if (tile.axis.norm() > 0) {
        tile.axis.normalize();
        for_all([&](const Eigen::Vector3f& ray) {
          tile.half_angle = std::max(tile.half_angle, angle_between(tile.axis, ray));
        });
      }
      tiles.push_back(tile);
    }
  }
}

// Adds the picture from one place; red, green, blue or brightness.
void SceneRenderer::Parts::add(const Pose3& T_world_camera, std::vector<float>& image) const {
  const std::vector<SeenFace> faces = seen_faces(scene, textures, T_world_camera);
  const Eigen::Vector3f up = (T_world_camera.rotation.conjugate() * Eigen::Vector3d::UnitZ()).cast<float>();
  std::vector<SeenFace> near;
  for (const Tile& tile : tiles) {
    if (tile.half_angle < 0) continue;
    near.clear();
    // The sum of angles with something to spare for rounding.
    for (const SeenFace& face : faces) {
      if (angle_between(tile.axis, face.direction) <= tile.half_angle + face.half_angle + 1e-3F) near.push_back(face);
    }
    fill(tile, near, up, image);
  }
}

void SceneRenderer::Parts::fill(const Tile& tile, const std::vector<SeenFace>& faces, const Eigen::Vector3f& up,
                                std::vector<float>& image) const {
  for (int y = tile.y0; y < tile.y1; ++y) {
    for (int x = tile.x0; x < tile.x1; ++x) {
      const std::size_t pixel = at(x, y);
      const Eigen::Vector3f& ray = rays[pixel];
      if (ray.squaredNorm() == 0) continue;
      const SeenFace* hit = nullptr;
      float distance = std::numeric_limits<float>::infinity();
      for (const SeenFace& face : faces) {
        if (face.nearest > distance) break;
        const float slope = face.normal.dot(ray);
        if (slope >= 0) continue;
        const float t = face.scale / slope;
        if (t >= distance) continue;
        const float a = t * face.right.dot(ray) - face.offset.x();
        const float b = t * face.up.dot(ray) - face.offset.y();
        if (a < 0 || b < 0 || a > face.size.x() || b > face.size.y()) continue;
        distance = t;
        hit = &face;
      }
      std::array<float, 3> value = up.dot(ray) > 0 ? sky : ground;
      if (hit != nullptr) shade(*hit, pixel, value.data());
      for (int c = 0; c < channels; ++c) {
        image[pixel * static_cast<std::size_t>(channels) + static_cast<std::size_t>(c)] +=
            value.at(static_cast<std::size_t>(c));
      }
    }
  }
}

// Mean of the texture over what the pixel covers of the face: the place on the face is scale * (right, up) . ray /
// (normal . ray) - offset, and the sides are its derivatives by the pixel.
void SceneRenderer::Parts::shade(const SeenFace& face, std::size_t pixel, float* out) const {
  Eigen::Matrix3d axes;
  axes << face.right.cast<double>().transpose(), face.up.cast<double>().transpose(),
      face.normal.cast<double>().transpose();
  const Eigen::Vector3d d = axes * rays[pixel].cast<double>();
  const double t = face.scale / d.z();
  const Eigen::Vector2d place = t * d.head<2>() - face.offset.cast<double>();
  const auto move = [&](const Eigen::Vector3f& step) -> Eigen::Vector2d {
    const Eigen::Vector3d s = axes * step.cast<double>();
    return t * (s.head<2>() - (s.z() / d.z()) * d.head<2>());
  };
  const Eigen::Vector2d sides = move(step_x[pixel]).cwiseAbs() + move(step_y[pixel]).cwiseAbs();
  face.texture->mean(place, sides, out);
}

SceneRenderer::SceneRenderer(const Scene& scene, const CameraCalibration& calibration, const RendererOptions& options)
    : parts_(std::make_unique<const Parts>(scene, calibration, options)) {}
SceneRenderer::SceneRenderer(SceneRenderer&&) noexcept = default;
SceneRenderer& SceneRenderer::operator=(SceneRenderer&&) noexcept = default;
SceneRenderer::~SceneRenderer() = default;

ImageMeasurement SceneRenderer::render(const Pose3& T_world_camera, Random* random) const {
  return render(std::span(&T_world_camera, 1), random);
}

ImageMeasurement SceneRenderer::render(std::span<const Pose3> poses, Random* random) const {
  const Parts& p = *parts_;
  require(!poses.empty(), "T_world_camera: at least one pose");
  require(random != nullptr || p.options.noise_sigma == 0, "random: must be given for noise");
  const auto channels = static_cast<std::size_t>(p.channels);
  std::vector<float> sum(p.rays.size() * channels, 0.0F);
  for (const Pose3& pose : poses) {
    // The comparison is false for NaN.
    require(pose.translation.allFinite() && std::abs(pose.rotation.norm() - 1) < 1e-6,
            "T_world_camera: must be finite, with a unit quaternion");
    p.add(pose, sum);
  }
  ImageMeasurement image;
  image.width_px = p.width;
  image.height_px = p.height;
  image.row_stride_bytes = p.width * p.channels;
  image.format = p.options.format;
  auto bytes = std::make_shared<std::vector<std::uint8_t>>(sum.size());
  const double factor = p.options.gain / static_cast<double>(poses.size());
  for (std::size_t i = 0; i < sum.size(); ++i) {
    double value = factor * sum[i];
    if (p.options.noise_sigma > 0) value += p.options.noise_sigma * random->normal();
    const auto byte = static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0));
    const std::size_t channel = i % channels;
    (*bytes)[p.options.format == PixelFormat::kBgr ? i - channel + (channels - 1 - channel) : i] = byte;
  }
  image.data = std::move(bytes);
  return image;
}

}  // namespace loc
