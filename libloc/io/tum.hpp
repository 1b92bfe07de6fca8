// Trajectories as the TUM RGB-D tools and evo write them: `seconds tx ty tz qx qy qz qw`, separated by blanks, lines
// that begin with # are comments. Mind the order: the quaternion is x y z w here, w x y z everywhere else in libloc.
// Pose: T_world_body. Times are read and written exactly to the nanosecond.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "libloc/core/named_count.hpp"
#include "libloc/core/time.hpp"
#include "libloc/geometry/pose3.hpp"

namespace loc {

struct StampedPose {
  TimeNs time_ns = kNoTime;
  Pose3 T_world_body;
};

struct TumTrajectory {
  std::vector<StampedPose> poses;  ///< in time order
  /// {"tum.read", n}, {"tum.skipped.time_not_increasing", n}, {"tum.skipped.no_line_end", n}: the last line has no line
  /// end and may have been cut.
  NamedCounts counts;
};

/// @throws DataError naming file, line and value: missing, no pose in it, another number of columns, not a number, NaN
/// or infinity, a quaternion whose norm is farther from 1 than 1e-2 (others are normalised).
TumTrajectory read_tum(const std::filesystem::path& path);

/// @throws DataError when the file cannot be written; std::invalid_argument for a pose that is not finite.
void write_tum(const std::filesystem::path& path, const std::vector<StampedPose>& poses);

}  // namespace loc
