// What a SLAM filter knows (map, pose, covariance) as a file, to go on from later. The file: the letters "LOCSLAM1",
// size of the message (8 bytes) and its CRC-32 (4 bytes, as zlib's), both big endian, then a slam_state_t.
#pragma once

#include <filesystem>
#include <string>

#include "libloc/estimators/slam_filter.hpp"

namespace loc {

struct SlamFile {
  SlamSnapshot snapshot;
  SlamMotion motion = SlamMotion::kConstantVelocity;
  CameraCalibration camera;  ///< that the map was made with
  std::string options;       ///< text as slam_yaml.hpp writes it: what the filter ran with
};

/// Writes beside the file and renames: a reader sees the old or the new one, never half. All numbers come back bit for
/// bit. @param options the filter's
/// @throws std::invalid_argument for a snapshot without a time or whose covariance is not square, DataError when the
/// file cannot be written.
void save_slam(const std::filesystem::path& path, const SlamSnapshot& snapshot, const SlamOptions& options);

/// @throws DataError naming the file: missing, cut, changed (checksum), another format or a later version of it,
/// numbers that do not fit together.
SlamFile load_slam(const std::filesystem::path& path);

/// What speaks against going on with these options: another motion model or another camera; empty when nothing does.
/// (That the covariance fits is SlamFilter::restore's to say.)
std::string why_not_restorable(const SlamFile& file, const SlamOptions& options);

}  // namespace loc
