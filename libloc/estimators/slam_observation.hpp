// How a camera that moves with a body sees a feature, with the derivatives that the filter needs, and how a pixel
// becomes a new feature. World, body and camera as everywhere; R = R_world_body, C = R_body_camera, l the camera's
// place in body, r = p + R l the camera's in world.
//   g = m + rho (a - r)   (XYZ point X: g = X - r),  u = C^T R^T g,  pixel = project(u)
// The length of g does not matter, so that a point at infinity (rho = 0) is seen like any other.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libloc/estimators/slam_state.hpp"
#include "libloc/filter/large_covariance.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/geometry/inverse_depth.hpp"

namespace loc {

/// A feature's estimate: by its first ray, or by its place once that is known well.
struct SlamPoint {
  bool converted = false;
  InverseDepthPoint inverse_depth;                     ///< unless converted
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< when converted; in world [m]

  int dim() const { return converted ? 3 : kInverseDepthDim; }
  /// x = x [+] error of dim() numbers.
  void boxplus(const Eigen::Ref<const Eigen::VectorXd>& error);
};

/// @returns nullopt for a point that the camera cannot see (behind it; outside the lens's domain).
std::optional<Eigen::Vector2d> predict(const SlamState& state, const Camera& camera, const SlamPoint& point);

/// Derivatives of the pixel at this state and point.
struct SlamJacobian {
  Eigen::Matrix<double, 2, kMaxHeadDim> head;  ///< the first layout.dim columns
  Eigen::Matrix<double, 2, kMaxBlockDim> block;
  /// Second derivative by the inverse depth and the way from the camera to the anchor, whose product it is: pixel
  /// += by_way * d(rho) * d(a - r). 0 of an XYZ point. [px]
  Eigen::Matrix<double, 2, 3> by_way;
};
std::optional<SlamJacobian> jacobian_of(const SlamState& state, const SlamLayout& layout, const Camera& camera,
                                        const SlamPoint& point);

/// A new feature and how its errors depend on those of the head.
struct SlamBirth {
  InverseDepthPoint point;
  Eigen::Matrix<double, kInverseDepthDim, kMaxHeadDim> head_jacobian;  ///< the first layout.dim columns
  Eigen::Matrix<double, kInverseDepthDim, kInverseDepthDim> noise_cov;
};
/// @returns nullopt for a pixel without a ray.
std::optional<SlamBirth> make_feature(const SlamState& state, const SlamLayout& layout, const Camera& camera,
                                      const Eigen::Vector2d& pixel_px, double sigma_px, double inverse_depth,
                                      double sigma_inverse_depth);

}  // namespace loc
