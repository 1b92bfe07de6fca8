// The options of --method error-state, and of GPS for SLAM.
#pragma once

#include <string>

#include "libloc/estimators/inertial_fusion.hpp"
#include "libloc/estimators/map_anchor.hpp"
#include "libloc/io/source.hpp"
#include "libloc/sensors/rig.hpp"
#include "tools/support/cli_forward.hpp"

namespace loc {

struct FusionArguments {
  bool no_gps = false;
  bool no_odometry = false;
  bool no_zero_velocity = false;
  std::string odometry = "auto";
  double heading_deg = 0;
  double heading_sigma_deg = 3;
  double declination_deg = 0;
  double gps_sigma = 0;
  std::string origin;
  CLI::Option* heading_option = nullptr;
  CLI::Option* gps_sigma_option = nullptr;
  CLI::Option* odometry_option = nullptr;
};

void add_fusion_options(CLI::App& app, FusionArguments& arguments);

/// @param preset as InertialFusionOptions::preset
/// @param rig gives the lever arm of the antenna, the deviation of the time offset of GPS where it was measured and,
/// for the preset robust, the noise of the IMU where it was measured
/// @throws UsageError, std::invalid_argument naming the option.
InertialFusionOptions fusion_options(const FusionArguments& arguments, const std::string& preset, const Rig& rig);

/// How GPS ties the map of SLAM to the Earth. @throws as fusion_options.
MapAnchorOptions anchor_options(const FusionArguments& arguments, bool inertial, const Rig& rig);

/// Start where the reference of a recording says: for evaluation of what comes after the start. The reference nearest
/// to the first IMU sample is used; its deviations are the preset's (robust: those of the preset 19).
/// @throws DataError when there is none within 10 ms that knows pose and velocity.
GivenStart start_from_reference(MeasurementSource& source, const InertialFusionOptions& options,
                                const std::string& preset);

}  // namespace loc
