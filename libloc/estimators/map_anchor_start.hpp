// Where the map of SLAM is on the Earth, from the first fixes: the transform that puts the way gone in the map upon the
// positions of the antenna, and the velocities upon those of the receiver.
//   z_i = t + s A (p_i - c) + A l_i,   w_i = s A v_i + A m_i
// A takes map to world, s is the length of the map's unit in metres, c the mean of the p_i, l_i the lever arm to the
// antenna in axes of the map [m], m_i its velocity by the turning of the body. Found by weighted Gauss-Newton from the
// closed form in the plane (B. Horn, "Closed-form solution of absolute orientation using orthonormal matrices", 1988,
// in two dimensions), with Huber's weights against outliers.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>

#include "libloc/core/time.hpp"
#include "libloc/estimators/gps_position.hpp"

namespace loc {

/// A fix and where the body was in the map when it was made.
struct AnchorPair {
  GpsPosition fix;
  Eigen::Vector3d position;        ///< of body in map [unit]
  Eigen::Vector3d velocity;        ///< of body in map [unit/s]
  Eigen::Vector3d lever;           ///< from body to antenna, axes of the map [m]
  Eigen::Vector3d lever_velocity;  ///< its change by the turning of the body, axes of the map [m/s]
  double way = 0;                  ///< gone in the map until then [unit]
};

/// What is known before any fix.
struct AnchorPrior {
  bool scale_known = true;
  double scale_sigma = 0.03;  ///< of a scale that is known, relative
  double tilt_sigma = 0;      ///< of the map's z against the vertical [rad]
  double position_walk = 0;   ///< of the map, see MapAnchorOptions [m/sqrt(m)]
  /// Where the map's x axis points, counted from east to north, when something else than GPS says it.
  std::optional<double> heading;
  double heading_sigma = 0;  ///< of that [rad]
};

/// Error order of the covariance: position of body in world, turn of A on the left in axes of world, log of s.
inline constexpr int kAnchorPosition = 0;
inline constexpr int kAnchorTurn = 3;
inline constexpr int kAnchorScale = 6;
inline constexpr int kAnchorDim = 7;

struct AnchorState {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of body in world [m]
  Eigen::Quaterniond q_world_map = Eigen::Quaterniond::Identity();
  double scale = 1;  ///< metres a unit of the map
};

struct AnchorStart {
  AnchorState state;
  Eigen::Matrix<double, kAnchorDim, kAnchorDim> covariance;
};

/// @param pairs in the order of time
/// @param position in map where the state is wanted, after way_now
/// @returns nothing for fewer than three pairs, or without any extent
std::optional<AnchorStart> find_anchor(std::span<const AnchorPair> pairs, const AnchorPrior& prior,
                                       const Eigen::Vector3d& position, double way_now);

}  // namespace loc
