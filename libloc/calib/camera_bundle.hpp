// Least squares over the intrinsics of one camera and a pose for each picture. Internal to calib.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "libloc/calib/camera_intrinsics.hpp"
#include "libloc/geometry/camera.hpp"

namespace loc::calib {

struct BundleCorner {
  std::int32_t id;
  Eigen::Vector3d point;  // in target
  Eigen::Vector2d pixel;
  bool used = true;
};

struct BundleView {
  std::vector<BundleCorner> corners;
  Pose3 T_camera_target;
};

struct BundleOptions {
  double huber_px = 0;  ///< beyond, a residual counts linearly; 0: plain squares
  int max_iterations = 60;
  bool fixed_camera = false;  ///< only the poses
};

struct BundleResult {
  double cost = 0;  ///< half the sum of squares (or Huber's)
  int iterations = 0;
  bool converged = false;
  bool valid = false;  ///< false: some corner that is used has no projection at the start
};

/// Number of parameters of a model: 4 or 8.
int parameter_count(DistortionModel model);
Vector8d parameters_of(const CameraCalibration& camera);
void set_parameters(CameraCalibration& camera, const Vector8d& parameters);

/// Improves camera and poses in place.
BundleResult adjust(CameraCalibration& camera, std::span<BundleView> views, const BundleOptions& options);

/// Residuals (found less projected) of a view; nullopt where there is no projection.
std::vector<std::optional<Eigen::Vector2d>> residuals_of(const Camera& camera, const BundleView& view);

/// Information of the intrinsics with the poses eliminated, in units of the noise's variance, and each view's pull at
/// the solution. Plain squares.
struct BundleInformation {
  Matrix8d information = Matrix8d::Zero();
  std::vector<Vector8d> pulls;
};
BundleInformation information_of(const CameraCalibration& camera, std::span<const BundleView> views);

/// Pose of a flat target from the rays of its corners: the homography between board and rays. nullopt for fewer than
/// four corners, or all in one line. Least squares without weights: corners that are wrong spoil it.
std::optional<Pose3> pose_of_plane(const Camera& camera, const BundleView& view);

/// Puts in the pose of a view and improves it; false when there is none.
bool find_pose(const CameraCalibration& camera, BundleView& view, double huber_px);

/// A first camera for a model from nothing but the corners; views get their poses. @return false when no focal length
/// explains them.
bool find_start(CameraCalibration& camera, std::vector<BundleView>& views);

}  // namespace loc::calib
