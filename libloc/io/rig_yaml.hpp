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
//       measured: [gyroscope_noise_density]   # optional: those that were measured; the others are guesses
//     gyroscope:                              # corrected = matrix * (raw - bias)
//       bias: [0, 0, 0]                       # [rad/s]
//       matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
//       quality:                              # optional, of every triad: how it was found
//         verdict: ok                         # ok, fair, warn, refused (and written all the same)
//         method: still-poses
//         samples: 1500
//         bias_sigma: [0, 0, 0]               # optional, unit of the bias: one standard deviation
//         matrix_sigma: [[0, 0, 0], …]        # optional
//         residual_rms: 0.001                 # optional, relative to the field's norm
//         reasons: ["one sentence", "another"]
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
//       intrinsics_quality:                   # optional: how they were found
//         verdict: ok
//         method: target
//         pictures: 40
//         intrinsics_sigma: [0, 0, 0, 0]      # optional [px]: one standard deviation, of fx fy cx cy
//         distortion_sigma: [0, 0, 0, 0]      # optional
//         reprojection_rms_px: 0.2            # optional
//         reasons: []
//       mounting_quality:                     # optional: how T_body_camera and time_offset_s were found
//         verdict: ok
//         method: camera-imu
//         pictures: 1200
//         rotation_sigma: [0, 0, 0]           # optional [rad]: small turns of the camera about the body's axes
//         translation_sigma: [0, 0, 0]        # optional [m]: of T_body_camera's translation, along the body's axes
//         time_offset_sigma_s: 5.0e-6         # optional
//         line_delay_s: 2.0e-5                # optional: a rolling shutter's time from one row to the next
//         line_delay_sigma_s: 1.0e-7          # optional
//         reasons: []
//   gps:
//     antenna_in_body: [0, 0, 0]              # [m]
//     time_offset_s: 0                        # optional: t_imu = t_gps + time_offset_s
//     time_offset_sigma_s: 0.01               # optional
//   clocks:                                   # of the streams that have a clock of their own
//     - stream: imu
//       reference: host                       # the clock that it was compared with: host, gps
//       skew_ppm: 50                          # seconds of the reference per second of the stream, less 1
//       skew_sigma_ppm: 0.01                  # optional, and so are all that follow
//       offset_sigma_s: 2.0e-6                # of a time that was put on the reference clock
//       jitter_rms_s: 1.0e-3                  # of arrivals after the earliest possible
//       jitter_p99_s: 6.0e-3
//   ...                                       # end of the document: without it the file counts as cut
//
// In a block every key that is not marked optional must be there, and no other: a misspelt key is an error, not a
// default. An optional number that is left out is not known. Quaternions are
// normalised when their norm is within 1e-2 of 1 and farther from it than 1e-9.
//
// Kalibr's T_cam_imu takes imu coordinates to the camera's: it is the inverse of T_body_camera here. EuRoC's T_BS takes
// the sensor's coordinates to the body's: for a camera it is T_body_camera.
#pragma once

#include <filesystem>
#include <functional>

#include "libloc/sensors/rig.hpp"

namespace loc {

/// Every error of reading is a DataError that names file, line, key and value. The rig passes Rig::check().
Rig read_rig(const std::filesystem::path& path);

/// Writes beside the file and renames, so that a reader sees the old or the new one, never half. read_rig() gives back
/// the same numbers bit for bit. @throws std::invalid_argument from Rig::check(), DataError when it cannot be written.
void write_rig(const std::filesystem::path& path, const Rig& rig);

/// Changes a part of a rig file and keeps the rest: reads it (an empty rig when there is no such file), calls change,
/// writes it with write_rig(). The numbers of what is kept stay as they were to the last bit; comments and the layout
/// of a file written by hand do not. When anything throws, the file stays as it was. @return the rig that was written
/// @throws what read_rig(), change and write_rig() throw.
Rig update_rig(const std::filesystem::path& path, const std::function<void(Rig&)>& change);

/// Kalibr's camchain (cam0, cam1, …: T_cam_imu, camera_model pinhole, intrinsics, distortion_model radtan, equidistant
/// or none, distortion_coeffs, resolution, timeshift_cam_imu). A chain without IMU has T_cn_cnm1 only: cam0 is then
/// taken as body. Cameras must be numbered without a gap. Other keys (cam_overlaps, rostopic) are passed over.
std::vector<CameraCalibration> read_kalibr_camchain(const std::filesystem::path& path);

/// Kalibr's imu.yaml: the four noise densities and update_rate, either at the top level or under imu0. Turn-on biases
/// stay at their defaults, because the file does not have them. @throws DataError also for what cannot be taken over: a
/// model other than calibrated (scale-misalignment: its matrices), a T_i_b that is not the identity, a time_offset.
ImuCalibration read_kalibr_imu(const std::filesystem::path& path);

/// For Kalibr's tools, which want a decimal point in every number that is not a count; cameras become cam0, cam1, …,
/// each with T_cam_imu, timeshift_cam_imu and, from cam1 on, T_cn_cnm1. cam_overlaps names the neighbours, because a
/// rig does not say what cameras see together. @throws as write_rig; std::invalid_argument when the rig has no camera
/// (no IMU).
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
