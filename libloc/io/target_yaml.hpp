// Kalibr's files of calibration targets (target.yaml):
//   target_type: aprilgrid      tagCols, tagRows, tagSize [m], tagSpacing (share of tagSize), optional codeOffset
//   target_type: checkerboard   targetCols, targetRows (inner corners), rowSpacingMeters, colSpacingMeters
// Kalibr's circle grids, and checkerboards whose squares are no squares, cannot be taken over.
#pragma once

#include <filesystem>

#include "libloc/sensors/target.hpp"

namespace loc {

/// @throws DataError naming file, line, key and value.
CalibrationTarget read_kalibr_target(const std::filesystem::path& path);

/// @throws std::invalid_argument from CalibrationTarget::check(), DataError when it cannot be written.
void write_kalibr_target(const std::filesystem::path& path, const CalibrationTarget& target);

}  // namespace loc
