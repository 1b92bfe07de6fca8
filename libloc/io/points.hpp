// Points of a scene as text: `x y z` in metres, one point a line, separated by blanks or by commas.
// What is what: # begins a comment, anywhere in a line; blank lines, carriage returns and a byte order mark are
// ignored; the first row may be the heading x y z. A last line without line end may have been cut: it is not used, and
// counted.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "libloc/core/named_count.hpp"

namespace loc {

struct PointsFile {
  std::vector<Eigen::Vector3d> points;  ///< [m], in the order of the file
  NamedCounts counts;                   ///< {"points.read", n}, {"points.skipped.no_line_end", 1}
};

/// @throws DataError naming file, line and value: missing, no point in it, other than three columns, not a finite
/// number.
PointsFile read_points(const std::filesystem::path& path);

/// @throws DataError when the file cannot be written; std::invalid_argument for a point that is not finite.
void write_points(const std::filesystem::path& path, const std::vector<Eigen::Vector3d>& points);

}  // namespace loc
