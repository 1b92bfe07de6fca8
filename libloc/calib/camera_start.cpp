// Where the adjustment of camera_bundle begins: a pose for each picture, a focal length for the camera.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "libloc/calib/camera_bundle.hpp"

namespace loc::calib {
namespace {

constexpr std::size_t kStartViews = 16;
// Focal lengths that are tried, in widths of the image: from 150 degrees across to a telephoto lens.
constexpr std::array kFocalLengths{0.2, 0.28, 0.4, 0.55, 0.75, 1.0, 1.4, 2.0, 2.8, 4.0};
constexpr double kStartHuber = 5;  // [px]
constexpr double kGoodStart = 2;   // [px] rms: no other focal length needs to be tried

std::vector<BundleView> some_of(const std::vector<BundleView>& views) {
  std::vector<BundleView> out;
  const std::size_t count = std::min(kStartViews, views.size());
  for (std::size_t i = 0; i < count; ++i) out.push_back(views[i * views.size() / count]);
  return out;
}

std::size_t corner_count(const std::vector<BundleView>& views) {
  std::size_t count = 0;
  for (const BundleView& view : views) count += view.corners.size();
  return count;
}

// Finds poses; those without one are taken out. @return mean cost of a corner.
double find_poses(const CameraCalibration& camera, std::vector<BundleView>& views, double huber) {
  std::vector<BundleView> posed;
  double cost = 0;
  const std::size_t corners = corner_count(views);
  const Camera lens(camera);
  for (BundleView& view : views) {
    if (!find_pose(camera, view, huber)) {
      cost += 100 * huber * static_cast<double>(view.corners.size());
      continue;
    }
    for (const auto& r : residuals_of(lens, view)) cost += r ? std::min(r->norm(), 100.0) * huber : 100 * huber;
    posed.push_back(std::move(view));
  }
  views = std::move(posed);
  return cost / static_cast<double>(std::max<std::size_t>(corners, 1));
}

}  // namespace

std::optional<Pose3> pose_of_plane(const Camera& camera, const BundleView& view) {
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector3d>> pairs;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const BundleCorner& corner : view.corners) {
    if (!corner.used) continue;
    const auto ray = camera.unproject(corner.pixel);
    if (!ray) continue;
    pairs.emplace_back(corner.point.head<2>(), *ray);
    mean += pairs.back().first;
  }
  if (pairs.size() < 4) return std::nullopt;
  mean /= static_cast<double>(pairs.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const auto& [point, ray] : pairs) spread += (point - mean) * (point - mean).transpose();
  const double trace = spread.trace();
  if (!(spread.determinant() > 1e-4 * trace * trace)) return std::nullopt;  // a line
  const double scale = std::sqrt(2 * static_cast<double>(pairs.size()) / trace);

  // ray x (H X) = 0 for all corners: H is the eigenvector to the smallest eigenvalue, found by inverse iteration.
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(9, 9);
  for (const auto& [point, ray] : pairs) {
    const Eigen::Vector3d X((point.x() - mean.x()) * scale, (point.y() - mean.y()) * scale, 1);
    const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) normal.block<3, 3>(3 * i, 3 * j) += X[i] * X[j] * P;
    }
  }
  normal.diagonal().array() += 1e-12 * normal.trace();
  const Eigen::LDLT<Eigen::MatrixXd> factor(normal);
  Eigen::VectorXd h(9);
  h << 1, 0.1, 0, 0, 1, 0.1, 0.1, 0, 1;
  for (int i = 0; i < 12; ++i) {
    h = factor.solve(h).eval();
    h.normalize();
  }
  if (!h.allFinite()) return std::nullopt;
  Eigen::Matrix3d H = Eigen::Map<const Eigen::Matrix3d>(h.data());
  double forward = 0;
  for (const auto& [point, ray] : pairs) {
    forward += ray.dot(H * Eigen::Vector3d((point.x() - mean.x()) * scale, (point.y() - mean.y()) * scale, 1));
  }
  if (forward < 0) H = -H;
  H.col(2) -= scale * (mean.x() * H.col(0) + mean.y() * H.col(1));
  H.leftCols<2>() *= scale;

  const double length = (H.col(0).norm() + H.col(1).norm()) / 2;
  if (!(length > 0)) return std::nullopt;
  // The two right-angled unit vectors that are nearest to both columns.
  const Eigen::Vector3d a = H.col(0).normalized();
  const Eigen::Vector3d b = H.col(1).normalized();
  const Eigen::Vector3d sum = (a + b).normalized();
  const Eigen::Vector3d difference = (a - b).normalized();
  Eigen::Matrix3d R;
  R.col(0) = (sum + difference).normalized();
  R.col(1) = (sum - difference).normalized();
  R.col(2) = R.col(0).cross(R.col(1));
  Pose3 pose{Eigen::Quaterniond(R).normalized(), H.col(2) / length};
  if (!pose.translation.allFinite() || !pose.rotation.coeffs().allFinite()) return std::nullopt;
  return pose;
}

bool find_pose(const CameraCalibration& camera, BundleView& view, double huber_px) {
  const auto pose = pose_of_plane(Camera(camera), view);
  if (!pose) return false;
  view.T_camera_target = *pose;
  CameraCalibration same = camera;
  const BundleResult result =
      adjust(same, std::span(&view, 1), {.huber_px = huber_px, .max_iterations = 20, .fixed_camera = true});
  return result.valid;
}

bool find_start(CameraCalibration& camera, std::vector<BundleView>& views) {
  struct Candidate {
    double cost;
    CameraCalibration camera;
  };
  std::vector<Candidate> candidates;
  for (const double focal : kFocalLengths) {
    CameraCalibration c = camera;
    const double f = focal * camera.width_px;
    c.intrinsics_px = {f, f, (camera.width_px - 1) / 2.0, (camera.height_px - 1) / 2.0};
    c.distortion.setZero();
    std::vector<BundleView> few = some_of(views);
    candidates.push_back({find_poses(c, few, kStartHuber), c});
  }
  std::ranges::sort(candidates, {}, &Candidate::cost);
  double best = 1e300;
  std::optional<CameraCalibration> found;
  for (Candidate& candidate : candidates) {
    std::vector<BundleView> few = some_of(views);
    find_poses(candidate.camera, few, kStartHuber);
    if (few.size() < std::min<std::size_t>(3, views.size())) continue;
    const BundleResult result =
        adjust(candidate.camera, few, {.huber_px = kStartHuber, .max_iterations = 40, .fixed_camera = false});
    if (!result.valid) continue;
    const double cost = result.cost / static_cast<double>(corner_count(few));
    if (cost < best) {
      best = cost;
      found = candidate.camera;
    }
    if (best < kGoodStart * kGoodStart / 2) break;
  }
  if (!found) return false;
  camera = *found;
  return true;
}

}  // namespace loc::calib
