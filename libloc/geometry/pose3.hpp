// A rigid transform, SE(3). T_a_b takes coordinates of b to coordinates of a: p_a = T_a_b * p_b; inner names cancel:
// T_world_camera = T_world_body * T_body_camera.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace loc {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

struct Pose3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  // [m]

  static Pose3 from_matrix(const Eigen::Matrix4d& m);  ///< @throws std::invalid_argument unless rigid to 1e-3.
  Eigen::Matrix4d matrix() const;

  Pose3 inverse() const;
  Pose3 operator*(const Pose3& other) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return rotation * point + translation; }

  /// The group's exponential; xi = (rho, theta), Sola et al. 2018, equation 172. [m, rad]
  static Pose3 exp(const Vector6d& xi);
  /// Inverse of exp, |theta| <= pi.
  Vector6d log() const;

  /// T_plus = T * Exp(xi).
  Pose3 boxplus(const Vector6d& xi) const { return *this * exp(xi); }
  /// xi with other.boxplus(xi) = *this.
  Vector6d boxminus(const Pose3& other) const { return (other.inverse() * *this).log(); }

  /// T * Exp(xi) = Exp(adjoint * xi) * T, with xi = (rho, theta).
  Matrix6d adjoint() const;
};

}  // namespace loc
