// MRPT's rawlog files, read and written through MRPT. Times are its 100 ns ticks, exactly.
//
//   CObservationIMU     angular velocity and acceleration -> IMU; magnetic field -> magnetometer. The first sensor
//   label
//                       with each of them; other labels are counted
//   CObservationImage   one camera for each label, numbered in the order in which they come; JPEG and raw, inside the
//   file
//                       or beside it (FILE_Images). Grey stays grey, colour is BGR
//   CObservationGPS     GGA (place, altitude = above the sea + geoid, kind of fix, satellites) and RMC (velocity,
//   time); a
//                       place that is none is no fix
//
// A rawlog says nothing of covariances, of the vertical velocity and of frames; where sensors sit on the robot is not
// read. Built where MRPT is (Debian: libmrpt-obs-dev), as a library of its own, loc_rawlog,
// which is not installed: it is for the programs.
#pragma once

#include <filesystem>
#include <memory>

#include "libloc/io/recording_writer.hpp"
#include "libloc/io/source.hpp"

namespace loc {

/// In the order of the file, which writers keep in time. counts(): what was read; "imu.skipped.incomplete" (not all of
/// the six values), "….skipped.other_sensor", "….skipped.time_not_increasing", "image.skipped.damaged" (its file is
/// missing or no picture), "gps.skipped.empty" (neither GGA nor RMC), "rawlog.not_used" (objects of other kinds),
/// "rawlog.cut_off" (1: the file ends within an object).
/// @throws DataError naming the file when there is none, or not one object can be read from it.
std::unique_ptr<MeasurementSource> open_rawlog(const std::filesystem::path& path);

/// Writes IMU, magnetometer, pictures (a JPEG is decoded, to grey) and fixes. A rawlog has no room for covariances, the
/// fix's vertical velocity, arrival times, reference, odometry and features: those are counted ("features.no_room").
/// finish() reads the file back and counts its objects, because MRPT does not say when a disk is full.
/// @throws DataError when path is there already or cannot be written.
std::unique_ptr<RecordingWriter> create_rawlog(const std::filesystem::path& path);

}  // namespace loc
