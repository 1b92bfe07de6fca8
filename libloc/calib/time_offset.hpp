// By how much the stamps of a position stream are off: its positions against another trajectory (a GPS receiver against
// a reference INS, or against an estimate). Finds the offset that fits best:
//   t_reference = t_stream + offset
// so a receiver whose positions are older than their stamps by 0.2 s has -0.2 s. Position residuals, the reference
// interpolated with its velocity, robust weights; sigma takes into account that errors of GPS
// are correlated over a minute.
//
// Not observable: at constant velocity an offset and a constant error along the track are the same; while only the
// heading changes, an antenna mounted further ahead looks the same. Speed must change. The verdict says so.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "libloc/core/quality.hpp"
#include "libloc/core/time.hpp"

namespace loc {

/// Positions over time, in a world with z up that both streams share.
struct PositionStream {
  std::vector<TimeNs> times_ns;               ///< increasing
  std::vector<Eigen::Vector3d> positions;     ///< [m]; NaN: none at this time, skipped
  std::vector<Eigen::Vector3d> velocities;    ///< [m/s], or empty: from the positions
  std::vector<Eigen::Quaterniond> rotations;  ///< q_world_body, or empty; needed for a lever arm only
};

struct TimeOffsetOptions {
  double max_offset_s = 1.0;         ///< Search from minus this to this.
  bool horizontal = true;            ///< x and y only: heights of GPS are poor, and of little motion.
  double max_reference_gap_s = 1.0;  ///< The reference is not interpolated over longer gaps.
  bool estimate_bias = false;        ///< Also a constant difference of the positions, in world.
  double bias_sigma_m = 1.5;         ///< Where it is not estimated: what it may be (one axis), for sigma.
  bool estimate_lever_arm = false;   ///< Also a constant place of the antenna, in body. Needs rotations.
  Eigen::Vector3d lever_arm = Eigen::Vector3d::Zero();  ///< of the antenna in body, if known [m]; needs rotations
  double correlation_s = 120;  ///< Errors of the stream farther apart count as independent, for sigma.

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct TimeOffsetResult {
  double offset_s = 0;  ///< t_reference = t_stream + offset
  double sigma_s = 0;
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();       ///< stream - reference [m]; zero unless estimated
  Eigen::Vector3d lever_arm = Eigen::Vector3d::Zero();  ///< as given or estimated [m]
  double rms_before_m = 0;        ///< of the stream as stamped, all samples used, lever arm as given
  double rms_after_m = 0;         ///< with offset, bias and lever arm; the same samples
  double speed_rms = 0;           ///< [m/s]
  double speed_deviation = 0;     ///< of the speed [m/s]
  double velocity_deviation = 0;  ///< of the velocity, root of the sum over its components [m/s]
  std::int64_t used = 0;
  std::int64_t down_weighted = 0;  ///< of these: farther off than the bulk
  std::int64_t outside = 0;        ///< no reference (with some offset of the search)
  std::int64_t not_finite = 0;
  int iterations = 0;
  bool converged = false;
  Quality quality;
};

/// @throws std::invalid_argument when an option is out of range or a lever arm has no rotations; DataError naming the
/// index when a stream is empty, sizes differ, times do not increase, or the reference is not finite.
TimeOffsetResult estimate_time_offset(const PositionStream& stream, const PositionStream& reference,
                                      const TimeOffsetOptions& options = {});

}  // namespace loc
