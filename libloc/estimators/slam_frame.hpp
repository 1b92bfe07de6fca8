// What SLAM says about one frame, and about its map: for records, pictures, live display and active search.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "libloc/estimators/estimate.hpp"
#include "libloc/geometry/inverse_depth.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc {

enum class SlamFeatureState : std::uint8_t {
  kPredicted = 0,  ///< expected in view, and not measured (no such identity in the frame, or too many others)
  kMeasured = 1,   ///< used
  kRescued = 2,    ///< used, after the others had moved the camera to where it agrees
  kRejected = 3,   ///< its measurement is not believed
  kNew = 4         ///< added to the map in this frame
};

struct SlamFeature {
  std::int64_t id = -1;
  SlamFeatureState state = SlamFeatureState::kPredicted;
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Constant(kUnknown);        ///< as measured
  Eigen::Vector2d predicted_px = Eigen::Vector2d::Constant(kUnknown);    ///< before the update
  Eigen::Vector2d estimated_px = Eigen::Vector2d::Constant(kUnknown);    ///< after it
  Eigen::Matrix2d innovation_cov = Eigen::Matrix2d::Constant(kUnknown);  ///< S of measured less predicted [px^2]
  double inverse_depth = kUnknown;                                       ///< [1/m]; of an XYZ point: of its distance
  double sigma_inverse_depth = kUnknown;                                 ///< NaN for an XYZ point
  bool converted = false;                                                ///< to XYZ
};

struct SlamCounts {
  std::int64_t in_frame = 0;  ///< features that the frame has
  std::int64_t visible = 0;   ///< of the map, expected in view
  std::int64_t measured = 0;  ///< used, rescued ones included
  std::int64_t rescued = 0;
  std::int64_t rejected = 0;
  std::int64_t added = 0;
  std::int64_t converted = 0;
  std::int64_t deleted = 0;
  std::int64_t map = 0;  ///< features afterwards
};

struct SlamFrame : Stamp {
  std::int32_t camera = 0;
  Estimate estimate;                                                      ///< after the update; pose of body
  Eigen::Vector3d camera_position = Eigen::Vector3d::Constant(kUnknown);  ///< of camera in world [m]
  Eigen::Quaterniond q_world_camera{kUnknown, kUnknown, kUnknown, kUnknown};
  double reprojection_before_px = kUnknown;  ///< root of the mean square of |measured - predicted|, of those used
  double reprojection_after_px = kUnknown;   ///< the same after the update; NaN without any
  double nis = 0;                            ///< of all that was used
  int nis_dim = 0;                           ///< numbers in it
  int iterations = 1;                        ///< of the update: more than one where it was far from linear
  SlamCounts counts;
  double time_spent_s = 0;  ///< by the filter; the only thing here that differs from run to run
  std::vector<SlamFeature> features;
};

/// The frame's pose as visual odometry of unknown scale, with its covariance: what the error-state filter fuses with an
/// IMU (the loosely coupled way; poses that are far apart share errors which this does not say).
/// @throws std::invalid_argument when the estimate has no pose or no covariance.
OdometryMeasurement odometry_of(const SlamFrame& frame);

struct SlamMapPoint {
  std::int64_t id = -1;
  bool converted = false;                                              ///< XYZ; otherwise inverse depth
  Eigen::Vector3d position = Eigen::Vector3d::Constant(kUnknown);      ///< in world [m]; far away for rho <= 0: NaN
  Eigen::Matrix3d position_cov = Eigen::Matrix3d::Constant(kUnknown);  ///< [m^2]
  InverseDepthPoint inverse_depth;                                     ///< unless converted
  Eigen::Matrix<double, kInverseDepthDim, kInverseDepthDim> inverse_depth_cov =
      Eigen::Matrix<double, kInverseDepthDim, kInverseDepthDim>::Constant(kUnknown);
  std::int64_t measured = 0;  ///< frames in which it was used
  TimeNs last_measured_ns = kNoTime;
  bool landmark = false;  ///< was known beforehand
};

}  // namespace loc
