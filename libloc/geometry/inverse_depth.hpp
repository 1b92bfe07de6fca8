// A point by the ray on which it was first seen: anchor a (where the camera was), direction m (unit vector in world),
// inverse depth rho along it. Point = a + m / rho; rho = 0 is a point at infinity, and nothing special.
// A camera at r sees it in the direction of rho (a - r) + m, which needs no division by rho.
// Error state, six numbers: a, two of the ray, rho. The ray's errors are along the first two axes of its frame Q, whose
// third axis is m: m_true = Q Exp((-d2, d1, 0)) e3. The source has azimuth and elevation there, which are singular at
// the poles; azimuth() and elevation() give them. Source: J. Civera, A. Davison, J. Montiel, "Inverse depth
// parametrization for monocular SLAM", IEEE Transactions on Robotics 24, 2008.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace loc {

inline constexpr int kInverseDepthDim = 6;
// Where the errors stand.
inline constexpr int kAnchor = 0;
inline constexpr int kRay = 3;
inline constexpr int kInverseDepth = 5;

struct InverseDepthPoint {
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();           ///< in world [m]
  Eigen::Quaterniond frame = Eigen::Quaterniond::Identity();  ///< Q: its third axis in world is the ray
  double inverse_depth = 0;                                   ///< [1/m], of the distance, not of z

  Eigen::Vector3d ray() const { return frame * Eigen::Vector3d::UnitZ(); }
  /// As in the source, with y down: m = (cos(el) sin(az), -sin(el), cos(el) cos(az)). [rad]
  double azimuth() const;
  double elevation() const;
  /// Derivative of m by the ray's two errors: the first two axes of the frame.
  Eigen::Matrix<double, 3, 2> ray_basis() const;
  /// The point. Not finite when inverse_depth is 0.
  Eigen::Vector3d xyz() const { return anchor + ray() / inverse_depth; }
  /// Derivative of xyz() by the errors.
  Eigen::Matrix<double, 3, kInverseDepthDim> xyz_jacobian() const;
  void boxplus(const Eigen::Matrix<double, kInverseDepthDim, 1>& error);
};

/// A frame whose third axis is this direction. @param ray not zero
Eigen::Quaterniond frame_of_ray(const Eigen::Vector3d& ray);

/// How far the point is from having a Gaussian error in XYZ: 4 sigma |cos(alpha)| / (rho^2 d), with d the distance from
/// the camera and alpha the angle between the ray and the line of sight. Below 0.1 the conversion to XYZ loses nothing.
/// Source: Civera et al. 2008, equation 33. @returns infinity where rho is not positive.
double linearity_index(const InverseDepthPoint& point, double sigma_inverse_depth, const Eigen::Vector3d& camera);

}  // namespace loc
