// A camera that is moved about in a rendered box room, with truth: for tests of the front end and of SLAM from
// pictures.
// Frames: world as sim/room (z up, origin in the middle of the floor); camera x right, y down, z forward.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sim/room.hpp"
#include "libloc/sim/scene_renderer.hpp"
#include "support/camera_models.hpp"

namespace loc::test {

/// radtan_camera() with half as many pixels each way: renders four times as fast.
inline CameraCalibration small_camera() {
  CameraCalibration c = radtan_camera();
  c.width_px = 376;
  c.height_px = 240;
  c.intrinsics_px = {229.327, 228.648, 183.3575, 123.9375};
  return c;
}

/// Along x of the world, upright.
inline Eigen::Quaterniond along_x() {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return Eigen::Quaterniond(R);
}

/// Sideways, up and down, forwards and back, with a little turning: about 0.4 m/s and 0.15 rad/s.
inline Pose3 swaying(double t) {
  const Eigen::Vector3d p(-1.5 + 0.15 * std::sin(0.9 * t), 0.45 * std::sin(0.8 * t), 1.4 + 0.2 * std::sin(1.1 * t));
  const Eigen::Vector3d r(0.02 * std::sin(1.3 * t), 0.04 * std::sin(0.7 * t), 0.12 * std::sin(0.6 * t));
  return {so3::exp(r) * along_x(), p};
}

/// What a perfect IMU in the axes of the camera reads, by central differences of a path (z up). Its time is time_s.
template <class Path>
ImuMeasurement imu_of(Path&& pose, double time_s) {
  constexpr double kH = 1e-3;
  const Pose3 now = pose(time_s);
  const Pose3 before = pose(time_s - kH);
  const Pose3 after = pose(time_s + kH);
  const Eigen::Vector3d a = (after.translation - 2 * now.translation + before.translation) / (kH * kH);
  ImuMeasurement out;
  out.time_ns = from_seconds(time_s);
  out.angular_velocity = so3::boxminus(after.rotation, before.rotation) / (2 * kH);
  out.specific_force = now.rotation.conjugate() * (a + Eigen::Vector3d(0, 0, 9.80665));
  return out;
}

/// Where a ray from inside meets the walls, floor or ceiling of box_room().
inline Eigen::Vector3d on_wall(const Pose3& T_world_camera, const Eigen::Vector3d& ray, const RoomModel& room = {}) {
  const Eigen::Vector3d direction = T_world_camera.rotation * ray;
  const Eigen::Vector3d low(-room.size_m.x() / 2, -room.size_m.y() / 2, 0);
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double wall = direction[i] > 0 ? low[i] + room.size_m[i] : low[i];
    if (direction[i] != 0) nearest = std::min(nearest, (wall - T_world_camera.translation[i]) / direction[i]);
  }
  return T_world_camera.translation + nearest * direction;
}

/// Grey, every pixel through a function of (value, x, y).
template <class Function>
ImageMeasurement changed(const ImageMeasurement& image, Function&& value) {
  ImageMeasurement out = image;
  auto bytes = std::make_shared<std::vector<std::uint8_t>>(*image.data);
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      std::uint8_t& v = (*bytes)[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.row_stride_bytes) +
                                 static_cast<std::size_t>(x)];
      v = static_cast<std::uint8_t>(std::clamp(std::lround(value(static_cast<double>(v), x, y)), 0L, 255L));
    }
  }
  out.data = std::move(bytes);
  return out;
}

inline ImageMeasurement brightened(const ImageMeasurement& image, double gain) {
  return changed(image, [&](double v, int, int) { return gain * v; });
}

/// A rectangle of another pattern, squares of 8 x 8 pixels of any brightness, covers part of the picture.
struct Cover {
  double left = 0;  ///< [px]
  double top = 0;
  int width = 0;
  int height = 0;
  std::uint64_t pattern = 1;
};
inline ImageMeasurement covered(const ImageMeasurement& image, const Cover& cover) {
  constexpr int kSquare = 8;
  const int columns = cover.width / kSquare + 1;
  Random random(cover.pattern);
  std::vector<double> squares(static_cast<std::size_t>(columns) * static_cast<std::size_t>(cover.height / kSquare + 1));
  for (double& square : squares) square = random.uniform(30, 220);
  return changed(image, [&](double v, int x, int y) {
    const int u = x - static_cast<int>(std::lround(cover.left));
    const int w = y - static_cast<int>(std::lround(cover.top));
    if (u < 0 || w < 0 || u >= cover.width || w >= cover.height) return v;
    return squares[static_cast<std::size_t>(w / kSquare) * static_cast<std::size_t>(columns) +
                   static_cast<std::size_t>(u / kSquare)];
  });
}

/// Four figures of a tenth of the picture each, walking both ways; at their places at time 0.
inline ImageMeasurement with_crowd(double time_s, const ImageMeasurement& image) {
  const double w = image.width_px;
  const double h = image.height_px;
  const double speeds[] = {0.09, -0.11, 0.13, -0.07};  // of the picture's width in a second
  const double places[] = {0.1, 0.5, 0.55, 0.95};
  ImageMeasurement out = image;
  for (int i = 0; i < 4; ++i) {
    const double middle = w * (places[i] + speeds[i] * time_s);
    out = covered(out, {.left = middle - 0.065 * w,
                        .top = (0.15 + 0.02 * i) * h,
                        .width = static_cast<int>(0.13 * w),
                        .height = static_cast<int>(0.78 * h),
                        .pattern = static_cast<std::uint64_t>(i) + 11});
  }
  return out;
}

/// Pictures of a room from given poses.
class RoomCamera {
 public:
  explicit RoomCamera(const CameraCalibration& calibration, double noise_sigma = 1, std::uint64_t seed = 1)
      : calibration_(calibration),
        camera_(calibration),
        renderer_(box_room({}, Random(seed)), calibration, {.texel_m = 0.008, .noise_sigma = noise_sigma}),
        random_(seed) {}

  ImageMeasurement at(const Pose3& T_world_camera, TimeNs time_ns) {
    ImageMeasurement out = renderer_.render(T_world_camera, &random_);
    out.time_ns = time_ns;
    out.sequence = sequence_++;
    return out;
  }
  const Camera& camera() const { return camera_; }
  const CameraCalibration& calibration() const { return calibration_; }

 private:
  CameraCalibration calibration_;
  Camera camera_;
  SceneRenderer renderer_;
  Random random_;
  std::int64_t sequence_ = 0;
};

}  // namespace loc::test
