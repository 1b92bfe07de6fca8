// Recordings written: one measurement after the other, complete or not at all. While it is written a recording has a
// name of its own (NAME.incomplete); it takes its place in finish(). What was not finished is removed.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>

#include "libloc/core/named_count.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc {

/// What a reference may know beside its pose.
struct ReferenceBiases {
  Eigen::Vector3d gyroscope = Eigen::Vector3d::Constant(kUnknown);      ///< [rad/s]
  Eigen::Vector3d accelerometer = Eigen::Vector3d::Constant(kUnknown);  ///< [m/s^2]
};

class RecordingWriter {
 public:
  RecordingWriter() = default;
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;
  virtual ~RecordingWriter() = default;

  /// @throws DataError when it cannot be written (disk full).
  virtual void write(const Measurement& measurement) = 0;
  /// A reference with its biases, where the format has room for them.
  virtual void write(const ReferenceMeasurement& reference, const ReferenceBiases& biases) = 0;
  /// Everything is on its way to the disk and has its name. Nothing is written after that.
  /// @throws DataError when not everything could be written.
  virtual void finish() = 0;
  /// {"imu.written", 6000}; what the format has no room for: {"features.no_room", 1200}.
  virtual NamedCounts counts() const = 0;
  /// Where it is until finish(): for files that belong to it.
  virtual std::filesystem::path unfinished() const = 0;
};

/// A folder in the form of EuRoC / ASL: mav0 with imu0, mag0, gps0, odometry0, state_groundtruth_estimate0 (each with
/// data.csv, as far as there are measurements) and sensor.yaml of IMU and cameras, as open_euroc reads it. Times and
/// values read back the same, covariances their diagonals. A folder has no room for features and pictures, times of
/// arrival, sequence numbers and GPS time: an LCM log has (msgs/lcm_log_writer.hpp).
/// @param folder must not exist, or be empty
/// @throws DataError for a folder that is there already or cannot be made.
std::unique_ptr<RecordingWriter> create_euroc(const std::filesystem::path& folder, const Rig& rig);

/// Removed when it goes, unless it was kept: the unfinished form of a file or folder. For writers.
class Unfinished {
 public:
  /// Gives target the name target.incomplete as long as it is written.
  /// @throws DataError when target is there already (a folder: and not empty), or something of that name is.
  explicit Unfinished(std::filesystem::path target);
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;
  ~Unfinished();

  const std::filesystem::path& path() const { return path_; }
  /// Gives it its name. @throws DataError when that fails.
  void keep();

 private:
  std::filesystem::path target_;
  std::filesystem::path path_;
  bool kept_ = false;
};

}  // namespace loc
