// EuRoC / ASL recordings: a folder mav0 with, as far as they are there, imu0/data.csv,
// state_groundtruth_estimate0/data.csv (or its relative of the same columns) as reference, mag0/data.csv, and two files
// that EuRoC itself has not, gps0/data.csv and odometry0/data.csv, with the columns of io/csv.hpp. The units in the
// heading lines are checked. Pictures (cam0, cam1) are read by vision/image_source.hpp.
// Frames: body = imu0; world as the reference system has it, z up. Source: Burri et al., "The EuRoC micro aerial
// vehicle datasets", 2016.
#pragma once

#include <filesystem>
#include <memory>

#include "libloc/io/source.hpp"

namespace loc {

struct EurocOptions {
  bool read_reference = true;     ///< False: as if there were none.
  bool read_magnetometer = true;  ///< False: as if there were none.
  bool read_gps = true;           ///< False: as if there were none.
  bool read_odometry = true;      ///< False: as if there were none.
};

/// A recording: all streams merged in time order; at equal times magnetometer, GPS, odometry, reference, IMU.
/// Rows whose time is not after the row's before are skipped and counted ("imu.skipped.time_not_increasing"), and so
/// are rows whose cells are all empty ("imu.skipped.empty") and a last line without its line end, which may have been
/// cut ("imu.skipped.no_line_end"). NaN and infinity in a measurement pass and are counted ("imu.not_finite"). A
/// quaternion is normalised. That there is no imu0 is counted ("imu.absent").
/// @param folder the one that holds mav0, or mav0 itself
/// @throws DataError naming file, line and column, here for a folder without any stream or camera, an empty file and
/// wrong headings, and from next() for a row that cannot be read.
std::unique_ptr<MeasurementSource> open_euroc(const std::filesystem::path& folder, const EurocOptions& options = {});

}  // namespace loc
