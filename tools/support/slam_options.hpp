// The options of --method mono-slam and inertial-slam, and the map as a file.
#pragma once

#include <optional>
#include <string>

#include "libloc/estimators/map_anchor.hpp"
#include "libloc/estimators/slam_filter.hpp"
#include "libloc/sensors/rig.hpp"
#include "tools/support/cli_forward.hpp"

namespace loc {

struct SlamArguments {
  std::string config;
  std::string map_in;
  std::string map_out;
  std::optional<int> camera;  ///< in place of what the settings say
  bool images = false;
  CLI::Option* config_option = nullptr;
  CLI::Option* map_in_option = nullptr;
  CLI::Option* map_out_option = nullptr;
  CLI::Option* camera_option = nullptr;
  CLI::Option* images_option = nullptr;
};

void add_slam_options(CLI::App& app, SlamArguments& arguments);
bool is_slam(const std::string& method);

/// What is usual (for --images: slam_options_for_images), then the file of settings.
/// @param method mono-slam or inertial-slam @param rig has the camera, and the noise of the IMU where it was measured,
/// which the file of settings may overrule
/// @throws UsageError for a rig without that camera, a file that says another motion; std::invalid_argument as
/// SlamOptions::check.
SlamOptions slam_options(const SlamArguments& arguments, const std::string& method, const Rig& rig);

/// What --map-in has; nullopt when it was not given. @throws UsageError when it cannot be read, or was made with
/// another camera or motion.
std::optional<SlamSnapshot> slam_start(const SlamArguments& arguments, const SlamOptions& options);

/// Writes --map-out: *.ply has the points, all others what --map-in can go on from. Logs what it did.
/// Points are as in the estimates' world; what --map-in takes is as the filter has it.
/// @param filter nullptr: it has not started; said aloud, nothing is written. @return false then
/// @param anchor of the map to the Earth; nullptr without GPS
/// @throws DataError when it cannot be written.
bool write_map(const SlamArguments& arguments, const SlamFilter* filter, const MapAnchor* anchor);

}  // namespace loc
