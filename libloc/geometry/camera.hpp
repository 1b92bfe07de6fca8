// Projection of a calibrated camera: pinhole with or without radial-tangential distortion, or equidistant (fisheye).
// From: intrinsics and distortion of CameraCalibration; the pose and the clock in it play no part here.
// Frames: camera is x right, y down, z forward [m]; pixel (0,0) is the centre of the top-left pixel, so the image
// reaches from -0.5 to width - 0.5.
//   pinhole      m = (x, y) / z,  pixel = f .* distort(m) + c
//   radtan       distort(m) = m (1 + k1 r^2 + k2 r^4) + (2 p1 mx my + p2 (r^2 + 2 mx^2), p1 (r^2 + 2 my^2) + 2 p2 mx
//   my) equidistant  theta = angle to the z axis, pixel = f .* theta (1 + k1 theta^2 + ... + k4 theta^8) (x, y) / |(x,
//   y)| + c
// Domain of validity: pinhole and radtan see what is in front (z > 0), equidistant also what is behind, up to just
// below 180 degrees. Outside the radius at which the distortion stops growing (strong barrel: k1 < 0) a model folds
// back, and points far off the image would be projected into it: there is no projection there. Within, each pixel has
// one ray. Source: Brown 1971 (radtan); Kannala and Brandt 2006 (equidistant); the parameters are those of OpenCV and
// Kalibr.
//
//   const Camera camera(rig.cameras.at(0));
//   if (const auto pixel = camera.project(T_world_camera.inverse() * point); pixel && camera.in_image(*pixel)) ...
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libloc/sensors/rig.hpp"

namespace loc {

/// A projected point with the derivatives of its pixel.
struct Projection {
  Eigen::Vector2d pixel_px;
  Eigen::Matrix<double, 2, 3> d_point;       ///< by the point in camera [px/m]
  Eigen::Matrix<double, 2, 8> d_parameters;  ///< by fx, fy, cx, cy and the four of the distortion (0 without one)
};

/// The ray of a pixel with its derivative.
struct Ray {
  Eigen::Vector3d direction;            ///< unit vector in camera
  Eigen::Matrix<double, 3, 2> d_pixel;  ///< by the pixel [1/px]; orthogonal to direction
};

/// Allocates nothing once it is made.
class Camera {
 public:
  /// @throws std::invalid_argument as CameraCalibration::check.
  explicit Camera(const CameraCalibration& calibration);

  /// Pixel of a point in camera; it may lie beside the image. nullopt outside the domain of validity or for a point
  /// that is not finite.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point) const;
  std::optional<Projection> project_with_jacobians(const Eigen::Vector3d& point) const;

  /// Unit vector in camera that project() takes to this pixel, to 1e-9 px or so. nullopt when there is none, or when it
  /// is so near the border of the domain that the search does not converge.
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel_px) const;
  std::optional<Ray> unproject_with_jacobian(const Eigen::Vector2d& pixel_px) const;

  /// True for a pixel of the image that is at least so far from its border. False for NaN.
  bool in_image(const Eigen::Vector2d& pixel_px, double border_px = 0) const;

  /// Angle between the z axis and the farthest ray of the domain [rad], the tangential part left aside.
  double max_angle() const;

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  /// fx, fy, cx, cy [px]
  const Eigen::Vector4d& intrinsics_px() const { return intrinsics_; }

 private:
  bool distort(const Eigen::Vector2d& m, Eigen::Vector2d& distorted, Eigen::Matrix2d& jacobian) const;
  double radial(double radius) const;
  double radial_slope(double radius) const;
  std::optional<Projection> project_in_front(const Eigen::Vector3d& point) const;
  std::optional<Projection> project_equidistant(const Eigen::Vector3d& point) const;
  std::optional<double> radial_inverse(double distorted) const;
  std::optional<Eigen::Vector2d> undistort(const Eigen::Vector2d& distorted) const;

  DistortionModel model_;
  int width_px_;
  int height_px_;
  Eigen::Vector4d intrinsics_;
  Eigen::Vector4d distortion_;
  Eigen::Vector4d series_;  // of the radial part: r (1 + s0 r^2 + s1 r^4 + ...)
  double max_radius_;       // tangent of the angle (radtan), angle (equidistant): the radial part grows up to here
};

}  // namespace loc
