// Trials of BROAD, the benchmark of inertial orientation estimation by Laidig, Caruso, Cereatti and Seel, 2021 (MATLAB
// v5 files): IMU and magnetometer at 286 Hz, optical orientation and position, and a flag where to score.
// Frames: body = IMU; world is east-north-up, as the optical reference is aligned. The magnetometer repeats a value
// until it has a new one.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <vector>

#include "libloc/core/time.hpp"
#include "libloc/io/source.hpp"

namespace loc {

struct BroadOptions {
  TimeNs start_ns = 0;               ///< Time of the first sample.
  bool read_reference = true;        ///< False: as if there were none.
  bool drop_repeated_field = false;  ///< True: leave out magnetometer samples that are equal to the one before.
};

/// All of one trial; row k belongs to time_ns[k].
struct BroadTrial {
  double rate_hz = 0;
  std::vector<TimeNs> time_ns;                  ///< round(k / rate)
  Eigen::MatrixX3d angular_velocity;            ///< [rad/s]
  Eigen::MatrixX3d specific_force;              ///< [m/s^2]
  Eigen::MatrixX3d magnetic_field;              ///< [T]
  Eigen::MatrixX4d q_world_body_wxyz;           ///< optical; NaN where the cameras lost it
  Eigen::MatrixX3d position;                    ///< of body in world [m], NaN likewise
  Eigen::Array<bool, Eigen::Dynamic, 1> score;  ///< the flag `movement`
};

/// @throws DataError naming file and variable: missing, not a MATLAB file, cut, a variable that is absent or has
/// another type or size, a rate that is not positive.
BroadTrial read_broad_trial(const std::filesystem::path& path);

/// The same as a stream: for every row magnetometer, reference, IMU. NaN passes and is counted ("imu.not_finite",
/// "reference.not_finite"). The file is read as a whole (4 MB a trial).
/// @throws DataError as read_broad_trial.
std::unique_ptr<MeasurementSource> open_broad(const std::filesystem::path& path, const BroadOptions& options = {});

}  // namespace loc
