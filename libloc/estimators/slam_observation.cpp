#include "libloc/estimators/slam_observation.hpp"

#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

// Features that are seen first together share their anchor. A hair between them keeps the covariance positive definite.
constexpr double kAnchorSigma = 1e-5;  // [m]

// What the camera looks along: direction in world, and what rho is (1 for an XYZ point).
struct Sight {
  Eigen::Vector3d world;
  double rho;
};

Sight sight_of(const SlamState& state, const SlamPoint& point) {
  const Eigen::Vector3d camera = state.position + state.q_world_body * state.T_body_camera.translation;
  if (point.converted) return {point.position - camera, 1};
  const InverseDepthPoint& p = point.inverse_depth;
  return {p.ray() + p.inverse_depth * (p.anchor - camera), p.inverse_depth};
}

}  // namespace

void SlamPoint::boxplus(const Eigen::Ref<const Eigen::VectorXd>& error) {
  if (converted) {
    position += error.head<3>();
  } else {
    inverse_depth.boxplus(error.head<kInverseDepthDim>());
  }
}

std::optional<Eigen::Vector2d> predict(const SlamState& state, const Camera& camera, const SlamPoint& point) {
  const Eigen::Vector3d body = state.q_world_body.conjugate() * sight_of(state, point).world;
  return camera.project(state.T_body_camera.rotation.conjugate() * body);
}

std::optional<SlamJacobian> jacobian_of(const SlamState& state, const SlamLayout& layout, const Camera& camera,
                                        const SlamPoint& point) {
  const Sight sight = sight_of(state, point);
  const Eigen::Matrix3d to_body = state.q_world_body.conjugate().toRotationMatrix();
  const Eigen::Matrix3d to_camera = state.T_body_camera.rotation.conjugate().toRotationMatrix();
  const Eigen::Vector3d body = to_body * sight.world;
  const Eigen::Vector3d u = to_camera * body;
  const auto projection = camera.project_with_jacobians(u);
  if (!projection) return std::nullopt;

  const Eigen::Matrix<double, 2, 3> by_body = projection->d_point * to_camera;
  const Eigen::Matrix<double, 2, 3> by_world = by_body * to_body;
  SlamJacobian out;
  out.head.setZero();
  out.block.setZero();
  out.by_way.setZero();
  out.head.middleCols<3>(kTheta) = by_body * (so3::hat(body) + sight.rho * so3::hat(state.T_body_camera.translation));
  out.head.middleCols<3>(kPosition) = -sight.rho * by_world;
  if (layout.extrinsic_rotation >= 0) {
    out.head.middleCols<3>(layout.extrinsic_rotation) = projection->d_point * so3::hat(u);
    out.head.middleCols<3>(layout.extrinsic_position) = -sight.rho * by_body;
  }
  if (layout.time_offset >= 0) {
    // A clock that is late by a moment sees from where the body is a moment later.
    out.head.col(layout.time_offset) =
        out.head.middleCols<3>(kTheta) * state.angular_velocity + out.head.middleCols<3>(kPosition) * state.velocity;
  }
  if (point.converted) {
    out.block.leftCols<3>() = by_world;
  } else {
    const InverseDepthPoint& p = point.inverse_depth;
    const Eigen::Vector3d camera_position = state.position + state.q_world_body * state.T_body_camera.translation;
    out.by_way = by_world;
    out.block.middleCols<3>(kAnchor) = sight.rho * by_world;
    out.block.middleCols<2>(kRay) = by_world * p.ray_basis();
    out.block.col(kInverseDepth) = by_world * (p.anchor - camera_position);
  }
  return out;
}

std::optional<SlamBirth> make_feature(const SlamState& state, const SlamLayout& layout, const Camera& camera,
                                      const Eigen::Vector2d& pixel_px, double sigma_px, double inverse_depth,
                                      double sigma_inverse_depth) {
  const auto ray = camera.unproject_with_jacobian(pixel_px);
  if (!ray) return std::nullopt;
  const Eigen::Matrix3d to_world = state.q_world_body.toRotationMatrix();
  const Eigen::Matrix3d to_body = state.T_body_camera.rotation.toRotationMatrix();
  const Eigen::Vector3d& lever = state.T_body_camera.translation;
  const Eigen::Vector3d body = to_body * ray->direction;

  SlamBirth out;
  out.point.anchor = state.position + to_world * lever;
  out.point.frame = frame_of_ray(to_world * body);
  out.point.inverse_depth = inverse_depth;

  const Eigen::Matrix<double, 2, 3> by_world = out.point.ray_basis().transpose();
  const Eigen::Matrix<double, 2, 3> by_body = by_world * to_world;
  auto& j = out.head_jacobian;
  j.setZero();
  j.block<3, 3>(kAnchor, kPosition).setIdentity();
  j.block<3, 3>(kAnchor, kTheta) = -to_world * so3::hat(lever);
  j.block<2, 3>(kRay, kTheta) = -by_body * so3::hat(body);
  if (layout.extrinsic_rotation >= 0) {
    j.block<3, 3>(kAnchor, layout.extrinsic_position) = to_world;
    j.block<2, 3>(kRay, layout.extrinsic_rotation) = -by_body * to_body * so3::hat(ray->direction);
  }
  if (layout.time_offset >= 0) {
    j.block<3, 1>(kAnchor, layout.time_offset) =
        state.velocity + j.block<3, 3>(kAnchor, kTheta) * state.angular_velocity;
    j.block<2, 1>(kRay, layout.time_offset) = j.block<2, 3>(kRay, kTheta) * state.angular_velocity;
  }
  const Eigen::Matrix2d by_pixel = by_body * to_body * ray->d_pixel;
  out.noise_cov.setZero();
  out.noise_cov.diagonal().segment<3>(kAnchor).setConstant(kAnchorSigma * kAnchorSigma);
  out.noise_cov.block<2, 2>(kRay, kRay) = sigma_px * sigma_px * by_pixel * by_pixel.transpose();
  out.noise_cov(kInverseDepth, kInverseDepth) = sigma_inverse_depth * sigma_inverse_depth;
  return out;
}

}  // namespace loc
