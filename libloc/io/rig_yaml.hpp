// The rig as a file, and the files of Kalibr and EuRoC that hold the same things.
//
// rig.yaml, all blocks optional, all numbers SI and radians:
//
//   format: libloc-rig-1
//   imu:
//     rate_hz: 200                            # nominal, 0: unknown
//     noise:
//       gyroscope_noise_density: 1.7e-4       # [rad/s/sqrt(Hz)]
//       gyroscope_random_walk: 2.0e-5         # [rad/s^2/sqrt(Hz)]
//       accelerometer_noise_density: 2.0e-3   # [m/s^2/sqrt(Hz)]
//       accelerometer_random_walk: 3.0e-3     # [m/s^3/sqrt(Hz)]
//       gyroscope_bias_sigma: 1.0e-2          # [rad/s], turn-on
//       accelerometer_bias_sigma: 0.2         # [m/s^2], turn-on
//     gyroscope:                              # corrected = matrix * (raw - bias)
//       bias: [0, 0, 0]                       # [rad/s]
//       matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
//     accelerometer:                          # likewise [m/s^2]
//   magnetometer:                             # likewise [T]
//     bias: [0, 0, 0]
//     matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
//   cameras:
//     - name: cam0
//       resolution: [752, 480]                # [px] width, height
//       intrinsics: [fx, fy, cx, cy]          # [px]
//       distortion_model: radtan              # none, radtan (k1 k2 p1 p2), equidistant (k1 k2 k3 k4)
//       distortion_coeffs: [0, 0, 0, 0]
//       T_body_camera:
//         translation: [0, 0, 0]              # [m]
//         q_wxyz: [1, 0, 0, 0]
//       time_offset_s: 0                      # t_imu = t_camera + time_offset_s
//       rate_hz: 20
//   gps:
//     antenna_in_body: [0, 0, 0]              # [m]
//   ...                                       # end of the document: without it the file counts as cut
//
// In a block every key must be there, and no other: a misspelt key is an error, not a default. Quaternions are
// normalised when their norm is within 1e-2 of 1 and farther from it than 1e-9.
//
// Kalibr's T_cam_imu takes imu coordinates to the camera's: it is the inverse of T_body_camera here. EuRoC's T_BS takes
// the sensor's coordinates to the body's: for a camera it is T_body_camera.
#pragma once

#include <filesystem>

#include "libloc/sensors/rig.hpp"

namespace loc {

/// Every error of reading is a DataError that names file, line, key and value. The rig passes Rig::check().
Rig read_rig(const std::filesystem::path& path);

/// Writes beside the file and renames, so that a reader sees the old or the new one, never half. read_rig() gives back
/// the same numbers bit for bit. @throws std::invalid_argument from Rig::check(), DataError when it cannot be written.
void write_rig(const std::filesystem::path& path, const Rig& rig);

/// Kalibr's camchain (cam0, cam1, …: T_cam_imu, camera_model pinhole, intrinsics, distortion_model radtan, equidistant
/// or none, distortion_coeffs, resolution, timeshift_cam_imu). A chain without IMU has T_cn_cnm1 only: cam0 is then
/// taken as body. Cameras must be numbered without a gap. Other keys (cam_overlaps, rostopic) are passed over.
std::vector<CameraCalibration> read_kalibr_camchain(const std::filesystem::path& path);

/// Kalibr's imu.yaml: the four noise densities and update_rate, either at the top level or under imu0. Turn-on biases
/// stay at their defaults, because the file does not have them. @throws DataError also for what cannot be taken over: a
/// model other than calibrated (scale-misalignment: its matrices), a T_i_b that is not the identity, a time_offset.
ImuCalibration read_kalibr_imu(const std::filesystem::path& path);

/// For Kalibr's tools; cameras become cam0, cam1, …. @throws as write_rig; std::invalid_argument when the rig has no
/// camera (no IMU).
void write_kalibr_camchain(const std::filesystem::path& path, const Rig& rig);
void write_kalibr_imu(const std::filesystem::path& path, const Rig& rig);

/// EuRoC's sensor.yaml (first line %YAML:1.0, which is not YAML) of a camera, named as its folder.
CameraCalibration read_euroc_camera(const std::filesystem::path& path);
/// … and of the IMU. @throws DataError also when its T_BS is not the identity: body is the IMU here.
ImuCalibration read_euroc_imu(const std::filesystem::path& path);

/// Whichever of these formats the file has: rig.yaml, camchain, imu.yaml, sensor.yaml.
/// @throws DataError, also when it is none of them.
Rig read_any_rig(const std::filesystem::path& path);

}  // namespace loc
