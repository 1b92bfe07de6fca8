// The rig behind --config.
#pragma once

#include <string>

#include "libloc/sensors/rig.hpp"

namespace loc {

/// @param path of rig.yaml, or of a file of Kalibr or EuRoC; empty: an empty rig, nothing is corrected
/// Logs event=rig_quality for each calibration in it that was refused or came with a warning.
/// @throws UsageError saying what is wrong in the file.
Rig load_rig(const std::string& path);

}  // namespace loc
