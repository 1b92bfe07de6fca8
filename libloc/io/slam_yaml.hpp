// Settings of SLAM as a file: every field of SlamOptions by its name (slam_options.hpp has meaning, unit and default),
// but for the camera, which the rig has. What is not in the file keeps its default, what is in it must be known.
//
//   format: libloc-slam-1
//   motion: inertial                 # constant-velocity
//   consistency: invariant           # plain, first-estimate
//   precision: double                # float
//   q_world_body: [1, 0, 0, 0]       # w x y z
//   sigma_px: 1
//   imu_noise:
//     gyroscope_noise_density: 1.7e-4
//   landmarks:
//     - {id: 3, position: [0, 1, 2], sigma: 0.001}
//   map:
//     max_features: 100
//   association:
//     ransac: true
//   start:
//     duration_s: 1
//   moving_start:
//     sampling: point                # interval-mean
//   stand_still:
//     window_s: 0.4
#pragma once

#include <filesystem>
#include <string>

#include "libloc/estimators/slam_options.hpp"

namespace loc {

/// @param options what the file does not say, stays
/// @throws DataError naming file, line and key: a key that is not known or comes twice, a value of another kind, no
/// such file. Ranges are SlamOptions::check()'s, which needs the camera too.
SlamOptions read_slam_options(const std::filesystem::path& path, SlamOptions options = {});

/// All fields, as the file above; numbers read back as the same doubles.
std::string slam_options_text(const SlamOptions& options);
/// @throws DataError when it cannot be written.
void write_slam_options(const std::filesystem::path& path, const SlamOptions& options);

}  // namespace loc
