// How far an estimated trajectory is from a reference: absolute trajectory error (after an alignment) and relative pose
// error (drift). Both trajectories are poses of the same body (T_world_body); an offset between two bodies must be
// taken out before, an alignment does not find it.
// Source: Sturm, Engelhard, Endres, Burgard, Cremers, "A benchmark for the evaluation of RGB-D SLAM systems", IROS
// 2012; Kuemmerle et al., "On measuring the accuracy of SLAM algorithms", 2009. Numbers agree with evo's.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "libloc/core/time.hpp"
#include "libloc/geometry/alignment.hpp"
#include "libloc/geometry/trajectory.hpp"

namespace loc {

/// Statistics of errors, in the unit of the errors (sse: its square).
struct ErrorStatistics {
  std::int64_t count = 0;
  double rmse = 0;
  double mean = 0;
  double median = 0;
  double std = 0;  ///< of the population: divided by count
  double min = 0;
  double max = 0;
  double sse = 0;  ///< sum of squares
};
/// @throws std::invalid_argument when empty or a value is not finite.
ErrorStatistics error_statistics(std::span<const double> errors);

struct AssociationOptions {
  TimeNs max_difference_ns = 10'000'000;  ///< largest difference of time within a pair
  TimeNs estimate_time_offset_ns = 0;     ///< added to the estimate's times
  /// Take the reference's pose at the estimate's time (linear, slerp) instead of the nearest sample. The nearest one
  /// must still be within max_difference; nothing is extrapolated.
  bool interpolate_reference = false;
  /// Use each sample once at most: of several that are nearest to the same one, the nearest stays. Without it the
  /// same sample may be in several pairs, as in evo.
  bool one_to_one = true;

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Pairs of poses; both trajectories have the same length.
struct Association {
  Trajectory estimate;                       ///< at its own times
  Trajectory reference;                      ///< at its own times, or at the estimate's when interpolated
  std::vector<std::size_t> estimate_index;   ///< into what was given
  std::vector<std::size_t> reference_index;  ///< into what was given; the nearest sample when interpolated
  std::int64_t without_partner = 0;          ///< samples of the shorter (interpolated: the estimate) left out
  std::int64_t shared_partner = 0;           ///< left out because the same partner had a nearer one
};

/// Pairs by time. As in evo, each pose of the shorter trajectory (the estimate when equally long) gets the nearest pose
/// of the longer one.
/// @throws DataError when a trajectory is not valid (Trajectory::check), empty, or nothing pairs.
Association associate(const Trajectory& estimate, const Trajectory& reference, const AssociationOptions& options = {});

struct AbsoluteError {
  Alignment alignment;                ///< that was applied to the estimate
  std::vector<TimeNs> times_ns;       ///< of the estimate
  std::vector<double> translation_m;  ///< |p_estimate - p_reference| [m]
  std::vector<double> rotation_rad;   ///< angle of R_estimate^-1 R_reference [rad], in [0, pi]
  ErrorStatistics translation;        ///< [m]; its rmse is "the ATE"
  ErrorStatistics rotation;           ///< [rad]
};

/// Absolute trajectory error of paired trajectories.
/// @throws std::invalid_argument when the lengths differ, DataError when a trajectory is not valid or empty, or the
/// poses do not determine the alignment (Alignment::failure in words).
AbsoluteError absolute_error(const Trajectory& estimate, const Trajectory& reference,
                             AlignmentMode mode = AlignmentMode::kSe3);

enum class DeltaUnit { kFrames, kSeconds, kMetres };

struct RelativeErrorOptions {
  double delta = 1;  ///< length of a piece, in the unit; whole for frames
  DeltaUnit unit = DeltaUnit::kFrames;
  /// False: pieces end to end, each as long as it takes to reach delta. True: a piece from every pose; for seconds and
  /// metres the end that comes nearest to delta, if within the tolerance.
  bool all_pairs = false;
  double relative_tolerance = 0.1;  ///< of delta, for all_pairs in seconds and metres
  /// Measure seconds and metres along the reference instead of the estimate (metres along an estimate with an unknown
  /// scale are not metres).
  bool pairs_from_reference = false;

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct RelativeError {
  std::vector<std::size_t> first;     ///< index of the pose where the piece begins
  std::vector<std::size_t> last;      ///< and where it ends
  std::vector<double> translation_m;  ///< [m], of (reference piece)^-1 * (estimate piece)
  std::vector<double> rotation_rad;   ///< [rad], in [0, pi]
  ErrorStatistics translation;        ///< [m]
  ErrorStatistics rotation;           ///< [rad]
};

/// Relative pose error of paired trajectories. An alignment by a rigid transform does not change it.
/// @throws std::invalid_argument when the lengths differ or an option is out of range, DataError when a trajectory is
/// not valid or too short for one piece of length delta.
RelativeError relative_error(const Trajectory& estimate, const Trajectory& reference,
                             const RelativeErrorOptions& options = {});

}  // namespace loc
