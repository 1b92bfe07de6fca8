// Recordings of tracks and IMU as GTSAM's EqVIO example reads them: one comma-separated file, columns found by name:
//   row_type        meta, imu or vision_feature; another one is an error
//   t_abs           time [s]: read as decimal text, exact to the nanosecond
//   gx gy gz        angular velocity [rad/s]          } of imu
//   ax ay az        specific force [m/s^2]            }
//   frame_idx landmark_id u_norm v_norm               of vision_feature: (x/z, y/z) of a point in camera
//   key value       of meta
// Other columns (t_rel, seq, bgx … baz) are not used. Meta rows come before all others; needed are format_version 1,
// measurement_space normalized, camera_fx camera_fy camera_cx camera_cy [px], T_ci_tx … T_ci_tz [m] and
// T_ci_qw … T_ci_qz: what takes camera coordinates to those of the IMU (body), T_body_camera here.
// Source: GTSAM 4.3, examples and Data/eqvio_processed_30s.csv.
//
// Pixels: the file's points have no distortion, and no pixels either. They are projected
//   with a camera that is given: as it would have seen them, distortion included;
//   otherwise with a pinhole of the file's focal lengths. Undistorted pictures reach beyond the sensor's, on all sides:
//   the size of the picture is such that every feature of the file lies in it, and the principal point is the file's,
//   moved by whole pixels so that (0,0) remains the corner.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "libloc/io/source.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc {

struct EqvioOptions {
  /// The user's own: used in place of what the file says, T_ci included, which then need not be there.
  std::optional<CameraCalibration> camera;
  double sigma_px = kUnknown;  ///< deviation of one coordinate of the features, which the file does not know
};

class EqvioSource : public MeasurementSource {
 public:
  /// The camera that the pixels are of, as camera 0; nothing else, for the file does not calibrate the IMU.
  virtual const Rig& rig() const = 0;
};

/// A recording in the order of the file, rows of one frame as one measurement; the frame's number is its sequence.
/// Skipped and counted: rows of an earlier time than the one before ("rows.skipped.time_not_increasing"), IMU samples
/// and frames of the same time as the one before ("imu.skipped.…", "features.skipped.…"), points that the camera does
/// not project ("features.skipped.not_projected"), rows without a cell that holds something ("rows.skipped.blank"), a
/// last line without its line end ("rows.skipped.no_line_end"; the frame before it is given, but may lack features).
/// IMU values that are not finite pass and are counted ("imu.not_finite").
/// @throws DataError naming file, line, column and value, here for heading and meta rows, from next() for other rows: a
/// cell that is no number, a feature that is not finite, farther than 87 degrees from the camera's axis or twice in its
/// frame, rows of one frame that differ in time or are not together. std::invalid_argument for options.
std::unique_ptr<EqvioSource> open_eqvio(const std::filesystem::path& path, const EqvioOptions& options = {});

/// True when the first line is the heading of such a file. False also when there is none to read.
bool is_eqvio(const std::filesystem::path& path);

}  // namespace loc
