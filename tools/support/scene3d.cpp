#include "tools/support/scene3d.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kMargin = 1.15;
constexpr double kKnownPlace = 0.2;  // deviation of a point over its distance

// What the picture is framed around.
std::vector<Eigen::Vector3d> framed_points(const Scene3d& scene) {
  std::vector<Eigen::Vector3d> out;
  for (const TrackPoint& p : scene.trajectory) out.push_back(p.position);
  for (const TrackPoint& p : scene.reference) out.push_back(p.position);
  out.insert(out.end(), scene.gps.begin(), scene.gps.end());
  if (scene.body) out.push_back(scene.body->translation);
  if (scene.camera) out.push_back(scene.camera->T_world_camera.translation);
  if (out.empty()) return out;
  const Eigen::Vector3d here = scene.camera ? scene.camera->T_world_camera.translation : out.back();
  for (const ScenePoint& p : scene.points) {
    const double sigma = std::sqrt(std::max(0.0, p.position_cov.trace()));
    if (sigma < kKnownPlace * (p.position - here).norm()) out.push_back(p.position);
  }
  return out;
}

double median_distance(const Scene3d& scene, const Eigen::Vector3d& from) {
  std::vector<double> distances;
  for (const ScenePoint& p : scene.points) {
    if (p.in_use) distances.push_back((p.position - from).norm());
  }
  if (distances.empty()) return 0;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

struct Framing {
  Eigen::Vector2d centre;  // what the eye's axis goes through, in the plane z = 0
  double distance = 0;     // of the eye from that plane
};

// From as near as all points allow: least <= (p - centre) / (distance + p.z) <= most for x and y, which are linear in
// distance and centre. least, most: tangents of the angles from the axis.
Framing frame_points(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector2d& least,
                     const Eigen::Vector2d& most) {
  const Eigen::Vector2d middle = (least + most) / 2;
  const Eigen::Vector2d low = middle + (least - middle) / kMargin;
  const Eigen::Vector2d high = middle + (most - middle) / kMargin;
  Eigen::Vector2d from = Eigen::Vector2d::Constant(-std::numeric_limits<double>::max());
  Eigen::Vector2d to = -from;
  for (const Eigen::Vector3d& p : points) {
    from = from.cwiseMax(p.head<2>() - p.z() * high);
    to = to.cwiseMin(p.head<2>() - p.z() * low);
  }
  Framing out;
  out.distance = std::max(0.0, ((from - to).array() / (high - low).array()).maxCoeff());
  out.centre = ((from - out.distance * high) + (to - out.distance * low)) / 2;
  return out;
}

// From behind the camera, so that what it sees lies before both.
SceneEye behind_camera(const Scene3d& scene, const SceneView& view) {
  SceneEye eye;
  const Pose3 pose = scene.camera ? scene.camera->T_world_camera : scene.body.value_or(Pose3{});
  const Eigen::Vector3d forward = pose.rotation * (scene.camera ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX());
  const double depth = median_distance(scene, pose.translation);
  eye.distance = (depth > 0 ? 2.5 * depth : 10) / view.zoom;
  eye.target = pose.translation + 0.3 * eye.distance * forward;
  eye.azimuth_deg = std::atan2(-forward.y(), -forward.x()) / kDegree;
  eye.elevation_deg = std::min(view.elevation_deg, 30.0);
  return eye;
}

}  // namespace

void SceneView::check() const {
  require(std::isfinite(azimuth_deg) && std::abs(azimuth_deg) <= 360, "azimuth_deg", azimuth_deg,
          "must be -360 to 360");
  require(elevation_deg >= -90 && elevation_deg <= 90, "elevation_deg", elevation_deg, "must be -90 to 90");
  require(zoom >= 1e-3 && zoom <= 1e3, "zoom", zoom, "must be 0.001 to 1000");
}

Eigen::Vector3d SceneEye::position() const {
  const double azimuth = azimuth_deg * kDegree;
  const double elevation = elevation_deg * kDegree;
  return target + distance * Eigen::Vector3d(std::cos(azimuth) * std::cos(elevation),
                                             std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
}

Pose3 SceneEye::T_world_eye() const {
  const double azimuth = azimuth_deg * kDegree;
  Eigen::Matrix3d R;
  R.col(0) << -std::sin(azimuth), std::cos(azimuth), 0;
  R.col(2) = (target - position()).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  return {Eigen::Quaterniond(R), position()};
}

SceneEye place_eye(const Scene3d& scene, const SceneView& view, double aspect) {
  view.check();
  require_positive("aspect", aspect);
  if (view.mode == ViewMode::kFollow) return behind_camera(scene, view);
  SceneEye eye;
  eye.azimuth_deg = view.mode == ViewMode::kTop ? -90 : view.azimuth_deg;
  eye.elevation_deg = view.mode == ViewMode::kTop ? 90 : view.elevation_deg;
  const std::vector<Eigen::Vector3d> points = framed_points(scene);
  if (points.empty()) return eye;

  const Eigen::Matrix3d R_eye_world = eye.T_world_eye().rotation.conjugate().toRotationMatrix();
  std::vector<Eigen::Vector3d> turned;
  double depth = 0;
  for (const Eigen::Vector3d& p : points) {
    turned.emplace_back(R_eye_world * p);
    depth += turned.back().z() / static_cast<double>(points.size());
  }
  for (Eigen::Vector3d& p : turned) p.z() -= depth;
  const double vertical = std::tan(kEyeFieldOfViewDeg * kDegree / 2);
  const Eigen::Vector2d half(vertical * aspect, vertical);
  Framing framing = frame_points(turned, -half, half);
  if (scene.picture) {
    const double width = kPictureShare * 2 * half.x();
    const double height = width * scene.picture->height_px / scene.picture->width_px;
    framing = frame_points(turned, -half, half - Eigen::Vector2d(width, 0));
    const Framing above = frame_points(turned, -half, half - Eigen::Vector2d(0, height));
    if (above.distance < framing.distance) framing = above;
  }
  eye.target = R_eye_world.transpose() * Eigen::Vector3d(framing.centre.x(), framing.centre.y(), depth);
  const double distance = framing.distance;
  // A camera that has not moved yet: some of what is around it.
  const double least_distance = scene.metric ? 2.0 : 1e-3;
  eye.distance = std::max(distance, least_distance) / view.zoom;
  return eye;
}

std::optional<Eigen::Vector2d> project(const SceneEye& eye, const Eigen::Vector3d& point, int width_px, int height_px) {
  const Eigen::Vector3d p = eye.T_world_eye().inverse() * point;
  if (!(p.z() > 0)) return std::nullopt;
  const double focal_px = height_px / 2.0 / std::tan(kEyeFieldOfViewDeg * kDegree / 2);
  return Eigen::Vector2d(focal_px * p.x() / p.z() + (width_px - 1) / 2.0,
                         focal_px * p.y() / p.z() + (height_px - 1) / 2.0);
}

double round_length(double length) {
  const double power = std::pow(10, std::floor(std::log10(length)));
  const double digit = length / power;
  return power * (digit < 1.5 ? 1 : digit < 3.5 ? 2 : digit < 7.5 ? 5 : 10);
}

}  // namespace loc
