#include "libloc/geometry/pose3.hpp"

#include <Eigen/LU>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {

Pose3 Pose3::from_matrix(const Eigen::Matrix4d& m) {
  require(m.allFinite(), "pose matrix: not finite");
  const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
  const double orthogonality = (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  require(orthogonality < 1e-3, "pose matrix: departure from orthogonality", orthogonality, "must be below 1e-3");
  require(r.determinant() > 0, "pose matrix: determinant", r.determinant(), "must be +1");
  const double bottom = (m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff();
  require(bottom < 1e-9, "pose matrix: departure of the last row from 0 0 0 1", bottom, "must be 0");
  return {Eigen::Quaterniond(r).normalized(), m.topRightCorner<3, 1>()};
}

Eigen::Matrix4d Pose3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

Pose3 Pose3::inverse() const {
  const Eigen::Quaterniond r = rotation.conjugate();
  return {r, -(r * translation)};
}

Pose3 Pose3::operator*(const Pose3& other) const {
  return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
}

Pose3 Pose3::exp(const Vector6d& xi) {
  const Eigen::Vector3d theta = xi.tail<3>();
  return {so3::exp(theta), so3::left_jacobian(theta) * xi.head<3>()};
}

Vector6d Pose3::log() const {
  const Eigen::Vector3d theta = so3::log(rotation);
  Vector6d xi;
  // left_jacobian(theta) = right_jacobian(-theta)
  xi << so3::right_jacobian_inverse(-theta) * translation, theta;
  return xi;
}

Matrix6d Pose3::adjoint() const {
  const Eigen::Matrix3d r = rotation.toRotationMatrix();
  Matrix6d a = Matrix6d::Zero();
  a.topLeftCorner<3, 3>() = r;
  a.topRightCorner<3, 3>() = so3::hat(translation) * r;
  a.bottomRightCorner<3, 3>() = r;
  return a;
}

}  // namespace loc
