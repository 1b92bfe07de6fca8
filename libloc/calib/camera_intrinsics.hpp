// Intrinsic calibration of one camera from pictures of a calibration target.
// From: corners of a flat target with their numbers in several pictures (vision/target_detector, or any other
// detector). To: focal lengths, principal point and distortion of geometry/camera with covariance, the pose of each
// picture, what was left out and why, and a verdict.
//   minimise sum |project(T_camera_target X_id) - pixel|^2 over intrinsics and poses
// by Levenberg and Marquardt; poses are eliminated (Schur), so the cost grows with the number of corners only. The
// start needs no knowledge of the camera: poses from the plane's homography (Zhang 2000, with rays instead of pixels,
// so that a fisheye is no special case) for a range of focal lengths. Corners count less the farther they are off
// (Huber) until the noise is known; then corners beyond corner_limit sigmas and pictures far noisier than the others
// are dropped and the rest is solved again without weights. Not observable: focal lengths from pictures that all look
// at the target from one direction (told by tilt and covariance); the size of a checkerboard's squares, which only
// scales the distances. Distortion where no corner was seen is extrapolated: see uncertainty. Source: Zhang, "A
// flexible new technique for camera calibration", 2000; uncertainty of projection: Kojima et al. in the documentation
// of mrcal, 2021 (a rotation of the camera is taken out).
//
//   const CameraFit fit = calibrate_camera(target, views, 752, 480, {});
//   if (fit.quality.usable()) rig.cameras.push_back(fit.camera);
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "libloc/core/quality.hpp"
#include "libloc/geometry/pose3.hpp"
#include "libloc/sensors/rig.hpp"
#include "libloc/sensors/target.hpp"

namespace loc {

using Vector8d = Eigen::Matrix<double, 8, 1>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;

struct CameraFitOptions {
  DistortionModel model = DistortionModel::kRadtan;
  int min_corners = 8;      ///< pictures with fewer are not used
  double corner_limit = 5;  ///< corners farther off are dropped [deviations of the noise]
  double view_limit = 3;    ///< pictures with a larger rms are dropped [medians of all pictures]
  int max_iterations = 60;
  bool compare_models = true;  ///< also fits the other distortion model, to say so where it is better

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// One picture in the result.
struct CameraFitView {
  bool used = false;
  std::string reason;     ///< why it is not used; empty when it is
  Pose3 T_camera_target;  ///< meaningless when there was no pose: rms_px is NaN then
  int corners = 0;
  int corners_dropped = 0;
  double rms_px = kUnknown;    ///< of the corners' distances from where they are projected, those that were kept
  double worst_px = kUnknown;  ///< likewise
  double tilt = kUnknown;      ///< between the target's normal and the optical axis [rad], 0: seen from straight ahead
};

struct CameraFitCorner {
  std::int32_t view = 0;  ///< index of the picture
  std::int32_t id = 0;
  bool used = false;
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d residual_px = Eigen::Vector2d::Constant(kUnknown);  ///< found less projected
};

/// What the calibration knows of the projection across the image: deviation of the pixel of a given ray, in cells from
/// the upper left one, row by row. A common rotation of all rays is taken out, because it is a matter of the pose.
/// NaN: no ray there (outside the circle of a fisheye).
struct ProjectionUncertainty {
  int columns = 0;
  int rows = 0;
  std::vector<double> sigma_px;  ///< root of the sum of both axes' variances
  double median_px = kUnknown;
  double worst_px = kUnknown;
};

struct CameraFit {
  CameraCalibration camera;                ///< name and pose are left as they come: "" and identity
  Matrix8d covariance = Matrix8d::Zero();  ///< of fx fy cx cy and the distortion, from the size of the residuals; zero
                                           ///< for what the model has not
  /// The same deviations from how differently the pictures pull (sandwich estimator); from 16 runs of pictures
  /// that follow each other, where those pull apart by more than chance. Larger where residuals of one picture or of
  /// neighbours hang together, as with blur or a lens that the model does not describe. NaN for fewer than 16 pictures.
  Vector8d sigma_by_views = Vector8d::Constant(kUnknown);
  double noise_px = kUnknown;            ///< of one coordinate of a corner
  double rms_px = kUnknown;              ///< of the distances of all corners that were used
  std::vector<CameraFitView> views;      ///< one for each picture that was given
  std::vector<CameraFitCorner> corners;  ///< all of pictures that have a pose
  int views_used = 0;
  int corners_used = 0;
  int corners_dropped = 0;   ///< in pictures that were used
  double covered_share = 0;  ///< of 12 x 9 cells of the image: those with a corner
  double radius_share = 0;   ///< farthest corner from the image's centre, as a share of half the diagonal
  double tilt_range = 0;     ///< largest angle between two of the target's normals in camera [rad]
  ProjectionUncertainty uncertainty;
  double other_model_rms_px = kUnknown;  ///< of the other distortion model with the same corners
  double other_model_noise_px = kUnknown;
  Quality quality;
  int iterations = 0;
  bool converged = false;

  /// The larger of both deviations of each parameter.
  Vector8d sigma() const;
};

/// @param views one for each picture, in any order; those without corners are passed over
/// @throws std::invalid_argument for options, a target or an image size that cannot be, and corners that
/// TargetView::check refuses. DataError when there is nothing to be solved: fewer than three pictures with min_corners,
/// or no start from which a camera can be found.
CameraFit calibrate_camera(const CalibrationTarget& target, std::span<const TargetView> views, int width_px,
                           int height_px, const CameraFitOptions& options = {});

/// At most so many pictures, as different as can be: the one whose place, size or slant in the image is farthest from
/// those that were taken is next (Gonzalez 1985). @return indices, ascending; only pictures with min_corners.
std::vector<std::size_t> choose_views(const CalibrationTarget& target, std::span<const TargetView> views, int width_px,
                                      int height_px, std::size_t count, int min_corners = 8);

}  // namespace loc
