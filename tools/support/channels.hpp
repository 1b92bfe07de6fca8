// --channel STREAM=NAME: which LCM channel carries which stream.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "libloc/sensors/measurements.hpp"
#include "tools/support/cli_forward.hpp"

namespace loc {

void add_channel_option(CLI::App& app, std::vector<std::string>& assignments);

/// @return the channel of each StreamKind, empty where none was named.
/// @throws UsageError for what is not STREAM=NAME, an unknown stream, or a channel that is empty or longer than LCM's
/// 63 characters.
std::array<std::string, kStreamKinds> parse_channels(const std::vector<std::string>& assignments);

}  // namespace loc
