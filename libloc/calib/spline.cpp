#include "libloc/calib/spline.hpp"

#include <cmath>
#include <string>
#include <utility>

#include "libloc/calib/spline_detail.hpp"
#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace calib {

RotationStep step_between(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  RotationStep out;
  out.difference = so3::boxminus(to, from);
  out.right_inverse = so3::right_jacobian_inverse(out.difference);
  return out;
}

RotationState rotation_at(const Eigen::Quaterniond& first, std::span<const RotationStep> steps,
                          const SplineWeights& weights, RotationJacobians* jacobians) {
  using Eigen::Matrix3d;
  using Eigen::Vector3d;
  const std::size_t n = steps.size();
  std::array<Matrix3d, kMaxSplineOrder> A_transposed;
  // Of the result of step j by its own difference.
  std::array<Matrix3d, kMaxSplineOrder> rotation_by;
  std::array<Matrix3d, kMaxSplineOrder> velocity_by;
  std::array<Matrix3d, kMaxSplineOrder> acceleration_by;
  RotationState out;
  out.rotation = first;
  for (std::size_t j = 1; j <= n; ++j) {
    const Vector3d& d = steps[j - 1].difference;
    const double l = weights.value[j];
    const double l1 = weights.first[j];
    const double l2 = weights.second[j];
    const Eigen::Quaterniond A = so3::exp(l * d);
    out.rotation = out.rotation * A;
    const Matrix3d At = A.conjugate().toRotationMatrix();
    const Vector3d turned_velocity = At * out.angular_velocity;
    const Vector3d turned_acceleration = At * out.angular_acceleration;
    out.angular_velocity = turned_velocity + l1 * d;
    out.angular_acceleration = turned_acceleration + l2 * d + l1 * turned_velocity.cross(d);
    if (jacobians == nullptr) continue;
    // A changes to A Exp(l J_r dd), so that A^T x changes by [A^T x]x l J_r dd.
    const Matrix3d turn = l * so3::right_jacobian(l * d);
    const Matrix3d hat_velocity = so3::hat(turned_velocity);
    const Matrix3d by_turned = hat_velocity * turn;
    A_transposed[j] = At;
    rotation_by[j] = turn;
    velocity_by[j] = by_turned + l1 * Matrix3d::Identity();
    acceleration_by[j] = so3::hat(turned_acceleration) * turn + l2 * Matrix3d::Identity() +
                         l1 * (hat_velocity - so3::hat(d) * by_turned);
  }
  out.rotation.normalize();
  if (jacobians == nullptr) return out;

  // Backwards: later steps turn what earlier ones did (P^T), and their cross product takes the angular velocity into
  // the acceleration (S).
  Matrix3d P_transposed = Matrix3d::Identity();
  Matrix3d S = Matrix3d::Zero();
  jacobians->rotation[n].setZero();
  jacobians->angular_velocity[n].setZero();
  jacobians->angular_acceleration[n].setZero();
  for (std::size_t j = n; j >= 1; --j) {
    const Matrix3d rotation = P_transposed * rotation_by[j];
    const Matrix3d velocity = P_transposed * velocity_by[j];
    const Matrix3d acceleration = P_transposed * acceleration_by[j] + S * velocity_by[j];
    const Matrix3d& right = steps[j - 1].right_inverse;
    jacobians->rotation[j] += rotation * right;
    jacobians->angular_velocity[j] += velocity * right;
    jacobians->angular_acceleration[j] += acceleration * right;
    jacobians->rotation[j - 1] = -rotation * right.transpose();
    jacobians->angular_velocity[j - 1] = -velocity * right.transpose();
    jacobians->angular_acceleration[j - 1] = -acceleration * right.transpose();
    S = (S - weights.first[j] * P_transposed * so3::hat(steps[j - 1].difference)) * A_transposed[j];
    P_transposed = P_transposed * A_transposed[j];
  }
  jacobians->rotation[0] += P_transposed;
  return out;
}

}  // namespace calib

VectorSpline::VectorSpline(const SplineGrid& grid, Eigen::MatrixXd control_points)
    : grid_(grid), control_points_(std::move(control_points)) {
  grid_.check();
  require(control_points_.cols() == grid_.control_points(), "columns of control_points",
          static_cast<double>(control_points_.cols()), "must be " + std::to_string(grid_.control_points()));
  require(control_points_.rows() > 0, "control_points: must have rows");
  require(control_points_.allFinite(), "control_points: must be finite");
}

Eigen::VectorXd VectorSpline::value(double t_s, int derivative) const {
  require(derivative >= 0 && derivative <= 2, "derivative", derivative, "must be 0, 1 or 2");
  require_finite("t_s", t_s);
  const auto [segment, u] = place_of(grid_, t_s);
  const SplineWeights weights = weights_at(grid_.order, grid_.spacing_s, u);
  const auto& w = derivative == 0 ? weights.value : derivative == 1 ? weights.first : weights.second;
  return control_points_.middleCols(segment, grid_.order) * Eigen::Map<const Eigen::VectorXd>(w.data(), grid_.order);
}

RotationSpline::RotationSpline(const SplineGrid& grid, std::vector<Eigen::Quaterniond> control_points)
    : grid_(grid), control_points_(std::move(control_points)) {
  grid_.check();
  require(control_points_.size() == static_cast<std::size_t>(grid_.control_points()), "number of control_points",
          static_cast<double>(control_points_.size()), "must be " + std::to_string(grid_.control_points()));
  for (std::size_t i = 0; i < control_points_.size(); ++i) {
    const double norm = control_points_[i].norm();
    // False for NaN.
    require(std::abs(norm - 1) < 1e-6, "norm of control_points[" + std::to_string(i) + "]", norm, "must be 1");
    control_points_[i].normalize();
  }
}

RotationState RotationSpline::at(double t_s, RotationJacobians* jacobians) const {
  require_finite("t_s", t_s);
  const auto [segment, u] = place_of(grid_, t_s);
  const auto first = static_cast<std::size_t>(segment);
  const auto steps = static_cast<std::size_t>(grid_.order) - 1;
  std::array<calib::RotationStep, kMaxSplineOrder> between;
  for (std::size_t j = 0; j < steps; ++j) {
    between[j] = calib::step_between(control_points_[first + j], control_points_[first + j + 1]);
  }
  if (jacobians != nullptr) jacobians->first = segment;
  return calib::rotation_at(control_points_[first], std::span(between).first(steps),
                            cumulative_weights_at(grid_.order, grid_.spacing_s, u), jacobians);
}

PoseSpline::PoseSpline(RotationSpline rotation, VectorSpline position)
    : rotation_(std::move(rotation)), position_(std::move(position)) {
  const SplineGrid& a = rotation_.grid();
  const SplineGrid& b = position_.grid();
  require(a.start_s == b.start_s && a.spacing_s == b.spacing_s && a.segments == b.segments && a.order == b.order,
          "rotation and position: must have the same grid");
  require(position_.control_points().rows() == 3, "rows of the position's control points",
          static_cast<double>(position_.control_points().rows()), "must be 3");
}

PoseState PoseSpline::at(double t_s) const {
  const RotationState rotation = rotation_.at(t_s);
  const auto [segment, u] = place_of(grid(), t_s);
  const SplineWeights w = weights_at(grid().order, grid().spacing_s, u);
  const auto points = position_.control_points().middleCols(segment, grid().order);
  const auto sum = [&](const auto& weights) {
    return Eigen::Vector3d(points * Eigen::Map<const Eigen::VectorXd>(weights.data(), grid().order));
  };
  return {Pose3{rotation.rotation, sum(w.value)}, sum(w.first), sum(w.second), rotation.angular_velocity,
          rotation.angular_acceleration};
}

}  // namespace loc
