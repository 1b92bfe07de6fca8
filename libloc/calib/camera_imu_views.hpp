// What the camera-IMU calibration works on: samples and pictures on one axis of time, pictures with their poses.
// Internal to calib.
#pragma once

#include <span>
#include <vector>

#include "libloc/calib/camera_imu.hpp"
#include "libloc/calib/camera_imu_problem.hpp"
#include "libloc/calib/camera_imu_start.hpp"

namespace loc::calib {

/// Clocks may be of different epochs: each has an origin of its own, so that seconds stay small and exact.
struct CameraImuRecording {
  TimeNs origin = 0;  // of the IMU's times
  std::vector<ImuRow> imu;
  struct OfCamera {
    double origin_offset_s = 0;    // the IMU's origin less the camera's: to be added to an offset between the two
    std::vector<FrameRow> frames;  // in order of time
    std::vector<CameraPoseSample> poses;  // one for each frame
  };
  std::vector<OfCamera> cameras;
  /// A gap that was closed: seconds behind it are less by what was cut out.
  struct Seam {
    double at_s = 0;
    double cut_s = 0;
  };
  std::vector<Seam> seams;  // in order

  /// Of the IMU's clock, from seconds with the gaps closed.
  TimeNs time_of(double t_s) const;
};

/// Skips samples that are not finite, pictures without a pose, and what does not belong to the recording by its time:
/// stamps that break the rising order, those farther than ten minutes from most others. Says so in fit.
/// @throws DataError for fewer than two samples, and clocks that are centuries apart.
CameraImuRecording read_recording(const CalibrationTarget& target, std::span<const CameraRecording> cameras,
                                  std::span<const ImuMeasurement> imu, double corner_sigma_px, CameraImuFit& fit);

/// Leaves what both have seen, and a little more of the IMU. Where one of them has nothing for seconds, the recording
/// is cut and what follows moves up to a second behind what was before: knots without measurements would cost time and
/// memory. Says so in fit. @throws DataError for a camera of which nothing is left.
void keep_common(CameraImuRecording& recording, CameraImuFit& fit);

/// A target that looks the same after half a turn (a quarter, when it is square) gets its corners numbered anew in each
/// picture so that it does not jump from one to the next. Across gaps the gyroscope tells, once there is a start.
/// @param gyro needed with start only
/// @returns the number of pictures that were changed
int unify_numbers(const CalibrationTarget& target, const GyroTurns* gyro, const CameraImuStart* start,
                  CameraImuRecording::OfCamera& camera);

/// All pictures of a camera get the numbers with which most of them see the target as another camera does.
/// @param expected rotation of T_target_camera in each picture
void align_numbers(const CalibrationTarget& target, std::span<const Eigen::Quaterniond> expected,
                   CameraImuRecording::OfCamera& camera);

}  // namespace loc::calib
