// Where a SLAM estimator expects the features of its map in a picture that is about to come: what a front end needs for
// active search, and all that it may know of the filter. Nothing of the estimate changes by asking.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "libloc/core/time.hpp"
#include "libloc/geometry/pose3.hpp"

namespace loc {

struct SlamFeaturePrediction {
  std::int64_t id = -1;
  bool visible = false;  ///< expected in the picture; otherwise pixel_px and search_cov mean nothing
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  /// Of the pixel that will be measured less pixel_px: S = H P H^T + R [px^2].
  Eigen::Matrix2d search_cov = Eigen::Matrix2d::Zero();
  /// Where the point is, as far as is known: point / weight in world [m]. Weight 0: infinitely far in that direction.
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double weight = 0;    ///< not negative
  bool placed = false;  ///< its depth is known well enough for point / weight to be a place
};

struct SlamPrediction {
  TimeNs time_ns = kNoTime;  ///< of the picture, on the clock of the camera
  bool valid = false;        ///< false: the estimator has no state for that time; unless it is lost features is empty
  /// The last frame was not found in the map: the pose is a guess, and the map is to be looked for in all of the
  /// picture. After a pause it may be lost without being valid: T_world_camera is the last pose then, and no feature is
  /// visible.
  bool lost = false;
  Pose3 T_world_camera;                         ///< expected at time_ns
  std::vector<SlamFeaturePrediction> features;  ///< all of the map, in the map's order
};

}  // namespace loc
