#include "libloc/geometry/absolute_pose.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr std::size_t kFewest = 4;
constexpr double kNarrower = 0.85;  // from round to round
constexpr double kFlatness = 1e-6;  // smallest part of an equation that still determines something
constexpr double kFittingWidths = 2;
constexpr int kPolishRounds = 20;
constexpr double kSmallStep = 1e-9;

double angle_of(const SightedPoint& point, const Pose3& pose) {
  const Eigen::Vector3d seen = pose.rotation.conjugate() * (point.position - pose.translation);
  return std::atan2(point.direction.cross(seen).norm(), point.direction.dot(seen));
}

double weight_of(const SightedPoint& point, const Pose3& pose, double width) {
  const double e = angle_of(point, pose) / width;
  return 1 / ((1 + e * e) * (1 + e * e));
}

}  // namespace

std::optional<Pose3> absolute_pose(std::span<const SightedPoint> points, const Pose3& start,
                                   const AbsolutePoseOptions& options) {
  if (points.size() < kFewest) return std::nullopt;
  Pose3 pose = start;
  double width = options.first_width;
  for (int round = 0; round < options.max_rounds; ++round) {
    // Directions towards the points, as seen from where the camera is thought to be.
    Eigen::Matrix3d pairs = Eigen::Matrix3d::Zero();
    for (const SightedPoint& point : points) {
      const Eigen::Vector3d to = point.position - pose.translation;
      const double distance = to.norm();
      if (!(distance > 0)) continue;
      pairs.noalias() += weight_of(point, pose, width) / distance * to * point.direction.transpose();
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(pairs, Eigen::ComputeFullU | Eigen::ComputeFullV);
    if (!(svd.singularValues()[1] > kFlatness * svd.singularValues()[0])) return std::nullopt;
    Eigen::Matrix3d sign = Eigen::Matrix3d::Identity();
    sign(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    pose.rotation = Eigen::Quaterniond(svd.matrixU() * sign * svd.matrixV().transpose()).normalized();

    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const SightedPoint& point : points) {
      const Eigen::Vector3d b = pose.rotation * point.direction;
      const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - b * b.transpose();
      const double depth = std::max(1e-3, (point.position - pose.translation).norm());
      const double weight = weight_of(point, pose, width) / (depth * depth);
      normal += weight * across;
      right += weight * across * point.position;
    }
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
    if (solver.info() != Eigen::Success || !(solver.rcond() > kFlatness)) return std::nullopt;
    const Eigen::Vector3d before = pose.translation;
    pose.translation = solver.solve(right);
    if (!pose.translation.allFinite()) return std::nullopt;
    const bool narrow = width <= options.last_width;
    if (narrow && (pose.translation - before).norm() < 1e-6 * (1 + before.norm())) break;
    width = std::max(options.last_width, kNarrower * width);
  }
  // The iteration creeps towards its end; Gauss-Newton of b x u, with u the direction as it should be seen, gets there.
  for (int round = 0; round < kPolishRounds; ++round) {
    Matrix6d information = Matrix6d::Zero();
    Vector6d gradient = Vector6d::Zero();  // position, turn
    const Eigen::Matrix3d to_camera = pose.rotation.conjugate().toRotationMatrix();
    for (const SightedPoint& point : points) {
      const Eigen::Vector3d p = to_camera * (point.position - pose.translation);
      const double distance = p.norm();
      if (!(distance > 0)) continue;
      const Eigen::Vector3d u = p / distance;
      const Eigen::Matrix3d turn =
          so3::hat(point.direction) * (Eigen::Matrix3d::Identity() - u * u.transpose()) / distance;
      Eigen::Matrix<double, 3, 6> h;
      h.leftCols<3>() = -turn * to_camera;
      h.rightCols<3>() = turn * so3::hat(p);
      const double weight = weight_of(point, pose, options.last_width);
      information += weight * h.transpose() * h;
      gradient -= weight * h.transpose() * point.direction.cross(u);
    }
    const Eigen::LDLT<Matrix6d> solver(information);
    if (solver.info() != Eigen::Success || !(solver.rcond() > kFlatness * kFlatness)) return std::nullopt;
    const Vector6d step = solver.solve(gradient);
    if (!step.allFinite()) return std::nullopt;
    pose.translation += step.head<3>();
    pose.rotation = so3::boxplus(pose.rotation, step.tail<3>());
    if (step.norm() < kSmallStep) break;
  }
  const auto fitting = std::count_if(points.begin(), points.end(), [&](const SightedPoint& point) {
    return angle_of(point, pose) < kFittingWidths * options.last_width;
  });
  if (static_cast<double>(fitting) < options.min_fitting * static_cast<double>(points.size())) return std::nullopt;
  return pose;
}

}  // namespace loc
