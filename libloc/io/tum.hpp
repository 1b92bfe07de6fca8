// Trajectories as the TUM RGB-D tools and evo write them: `seconds tx ty tz qx qy qz qw`, separated by blanks, lines
// that begin with # are comments. Mind the order: the quaternion is x y z w here, w x y z everywhere else in libloc.
// Pose: T_world_body. Times are read and written exactly to the nanosecond.
#pragma once

#include <filesystem>
#include <string_view>

#include "libloc/core/named_count.hpp"
#include "libloc/geometry/trajectory.hpp"

namespace loc {

struct TumFile {
  Trajectory trajectory;
  /// {"tum.read", n}, {"tum.skipped.time_not_increasing", n}, {"tum.skipped.no_line_end", n}: the last line has no line
  /// end and may have been cut.
  NamedCounts counts;
};

/// @throws DataError naming file, line and value: missing, no pose in it, another number of columns, not a number, NaN
/// or infinity, a quaternion whose norm is farther from 1 than 1e-2 (others are normalised).
TumFile read_tum(const std::filesystem::path& path);

/// @param frame whose poses they are, for the heading: "body", "camera"
/// @throws DataError when the file cannot be written or the trajectory is not one (Trajectory::check).
void write_tum(const std::filesystem::path& path, const Trajectory& trajectory, std::string_view frame = "body");

}  // namespace loc
