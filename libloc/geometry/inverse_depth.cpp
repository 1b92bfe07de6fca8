#include "libloc/geometry/inverse_depth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libloc/geometry/so3.hpp"

namespace loc {

double InverseDepthPoint::azimuth() const {
  const Eigen::Vector3d m = ray();
  return std::atan2(m.x(), m.z());
}

double InverseDepthPoint::elevation() const {
  return std::asin(std::clamp(-ray().y(), -1.0, 1.0));
}

Eigen::Matrix<double, 3, 2> InverseDepthPoint::ray_basis() const {
  return frame.toRotationMatrix().leftCols<2>();
}

Eigen::Matrix<double, 3, kInverseDepthDim> InverseDepthPoint::xyz_jacobian() const {
  const Eigen::Matrix3d axes = frame.toRotationMatrix();
  const double depth = 1 / inverse_depth;
  Eigen::Matrix<double, 3, kInverseDepthDim> out;
  out.middleCols<3>(kAnchor).setIdentity();
  out.middleCols<2>(kRay) = depth * axes.leftCols<2>();
  out.col(kInverseDepth) = -depth * depth * axes.col(2);
  return out;
}

void InverseDepthPoint::boxplus(const Eigen::Matrix<double, kInverseDepthDim, 1>& error) {
  anchor += error.segment<3>(kAnchor);
  frame = so3::boxplus(frame, {-error[kRay + 1], error[kRay], 0});
  inverse_depth += error[kInverseDepth];
}

Eigen::Quaterniond frame_of_ray(const Eigen::Vector3d& ray) {
  return Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), ray);
}

double linearity_index(const InverseDepthPoint& point, double sigma_inverse_depth, const Eigen::Vector3d& camera) {
  const double rho = point.inverse_depth;
  if (!(rho > 0)) return std::numeric_limits<double>::infinity();
  const Eigen::Vector3d m = point.ray();
  const Eigen::Vector3d sight = point.anchor + m / rho - camera;
  const double distance = sight.norm();
  const double cosine = std::abs(m.dot(sight)) / distance;
  return 4 * sigma_inverse_depth * cosine / (rho * rho * distance);
}

}  // namespace loc
