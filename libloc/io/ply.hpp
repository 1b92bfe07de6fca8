// Point clouds as PLY files, which MeshLab, CloudCompare, Open3D and Blender read: one element `vertex` with x y z
// (double) and, of each point, what else is known. Source: Turk, "The PLY polygon file format", 1994.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace loc {

struct PlyPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< in world [m]
  std::int64_t id = -1;
  double sigma = 0;  ///< deviation in the direction in which it is largest [m]
};

enum class PlyFormat { kBinary, kAscii };  ///< binary: little endian

/// Properties: double x, y, z; int id; double sigma. A point that is not finite has no place in such a file (viewers
/// take its bounding box from all points): it is left out.
/// @param comments lines of the header, for people: where the points come from, units, frame
/// @return how many points were left out
/// @throws DataError when the file cannot be written; std::invalid_argument for an id beyond 32 bit (a PLY int has no
/// more), a sigma that is negative, or a comment of more than one line.
std::int64_t write_ply(const std::filesystem::path& path, std::span<const PlyPoint> points,
                       const std::vector<std::string>& comments = {}, PlyFormat format = PlyFormat::kBinary);

}  // namespace loc
