// A rig of camera and IMU that is waved before a calibration target: what both would have measured, with the truth.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "libloc/calib/euler_trajectory.hpp"
#include "libloc/core/random.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/rig.hpp"
#include "libloc/sensors/target.hpp"

namespace loc::test {

struct WavedRigOptions {
  double seconds = 60;
  double imu_hz = 200;
  double camera_hz = 20;
  double corner_sigma_px = 0.3;
  double imu_noise = 1;  ///< factor on all of the IMU's noise; 0: none
  ImuNoise noise{};
  double time_offset_s = 0;                           ///< t_imu = t_camera + d
  Eigen::Vector3d turning = Eigen::Vector3d::Ones();  ///< factor on the motion about each axis
  double moving = 1;                                  ///< factor on the motion of the place
  double speed = 1;                                   ///< factor on all frequencies
  double outliers = 0;                                ///< share of the corners that are 20 px off
  double missing = 0;                                 ///< share of the pictures without the target
  double board_shift_m = 0;                           ///< sideways, until part of it is out of view
  std::string target = "checkerboard 9x6 0.04";
  bool second_camera = false;  ///< 11 cm beside the first, with a clock of its own
  double drift = 0;            ///< of the offset [s/s]; it is time_offset_s in the middle
  double line_delay_s = 0;     ///< rolling shutter; a picture's time is that of its middle row
  Eigen::Matrix3d gyroscope_matrix = Eigen::Matrix3d::Identity();      ///< reading = matrix * truth + bias
  Eigen::Matrix3d accelerometer_matrix = Eigen::Matrix3d::Identity();  ///< likewise
  bool half_turns = false;  ///< corners are numbered from the other end in every second picture
};

constexpr double kSecondOffset = -0.0071;  ///< of the second camera's offset against the first's [s]

struct WavedRig {
  CalibrationTarget target;
  CameraCalibration camera;
  Pose3 T_camera_imu;
  Eigen::Vector3d gravity_target;
  std::vector<TargetView> views;
  CameraCalibration second;  ///< likewise of the second camera
  Pose3 T_second_imu;
  std::vector<TargetView> second_views;
  std::vector<ImuMeasurement> imu;
  double turn_rate_rms = 0;
};

/// 54 corners of 40 mm at 0.6 m, |turn rate| 0.9 rad/s rms.
inline WavedRig wave(const WavedRigOptions& options, std::uint64_t seed) {
  using Eigen::Vector3d;
  Random random(seed);
  WavedRig out;
  out.target = parse_target(options.target);
  out.camera.name = "cam0";
  out.camera.width_px = 752;
  out.camera.height_px = 480;
  out.camera.intrinsics_px = {458.654, 457.296, 367.215, 248.375};
  out.camera.distortion_model = DistortionModel::kRadtan;
  out.camera.distortion = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  IntrinsicsQuality exact;
  exact.method = "simulation";
  exact.intrinsics_sigma_px.setZero();
  exact.distortion_sigma.setZero();
  out.camera.intrinsics_quality = exact;
  out.T_camera_imu = {so3::exp(Vector3d(0.1, -1.4, 0.3)), Vector3d(0.05, -0.03, 0.02)};
  out.second = out.camera;
  out.second.name = "cam1";
  out.second.intrinsics_px = {461.2, 460.1, 372.4, 241.9};
  out.T_second_imu = Pose3{so3::exp(Vector3d(0.02, -0.03, 0.01)), Vector3d(-0.11, 0.002, 0.004)} * out.T_camera_imu;
  // The board's middle, seen from 0.6 m straight ahead when nothing turns; the board leans against the vertical.
  const Vector3d far_corner = out.target.corner(out.target.corner_count() - 1);
  const Vector3d middle = far_corner / 2 + Vector3d(options.board_shift_m, 0, 0);
  const Eigen::Quaterniond R_target_camera(0, 1, 0, 0);
  out.gravity_target = so3::exp(Vector3d(0.3, 0.2, 0)) * Vector3d(0, -9.80665, 0);

  constexpr int kWaves = 3;
  Eigen::Matrix<double, 6, kWaves> size;
  Eigen::Matrix<double, 6, kWaves> rate;
  Eigen::Matrix<double, 6, kWaves> phase;
  for (int i = 0; i < 6; ++i) {
    for (int w = 0; w < kWaves; ++w) {
      rate(i, w) = 2 * std::numbers::pi * options.speed * (0.25 + 0.45 * w + 0.15 * random.uniform());
      size(i, w) =
          (i < 3 ? 0.72 * options.turning[i] : 0.3 * options.moving) / (rate(i, w) / options.speed) / std::sqrt(kWaves);
      phase(i, w) = 2 * std::numbers::pi * random.uniform();
    }
  }
  struct Motion {
    Pose3 T_target_imu;
    Vector3d angular_velocity;
    Vector3d acceleration;
  };
  const auto at = [&](double t) {
    Eigen::Matrix<double, 6, 1> x = Eigen::Matrix<double, 6, 1>::Zero();
    Eigen::Matrix<double, 6, 1> v = x;
    Eigen::Matrix<double, 6, 1> a = x;
    for (int i = 0; i < 6; ++i) {
      for (int w = 0; w < kWaves; ++w) {
        const double angle = rate(i, w) * t + phase(i, w);
        x[i] += size(i, w) * std::sin(angle);
        v[i] += size(i, w) * rate(i, w) * std::cos(angle);
        a[i] -= size(i, w) * rate(i, w) * rate(i, w) * std::sin(angle);
      }
    }
    // The three angles are those of the camera; the IMU turns with it.
    const Vector3d phi = x.head<3>();
    const Eigen::Quaterniond R = R_target_camera * rotation_from_angles(phi);
    const Vector3d in_camera = angle_rate_matrix(phi) * v.head<3>();
    return Motion{{R * out.T_camera_imu.rotation, middle + Vector3d(0, 0, 0.6) + x.tail<3>()},
                  out.T_camera_imu.rotation.conjugate() * in_camera,
                  a.tail<3>()};
  };

  const DiscreteImuNoise noise = discretise(options.noise, 1 / options.imu_hz);
  Vector3d gyro_bias = options.imu_noise * 0.01 * random.normal3();
  Vector3d accel_bias = options.imu_noise * 0.1 * random.normal3();
  double sum = 0;
  const auto samples = static_cast<int>(options.seconds * options.imu_hz);
  for (int i = 0; i < samples; ++i) {
    const double t = i / options.imu_hz;
    const Motion m = at(t);
    ImuMeasurement imu;
    imu.time_ns = from_seconds(1000) + from_seconds(t);
    imu.angular_velocity = options.gyroscope_matrix * m.angular_velocity + gyro_bias +
                           options.imu_noise * noise.sigma_angular_velocity * random.normal3();
    const Vector3d force = m.T_target_imu.rotation.conjugate() * (m.acceleration - out.gravity_target);
    imu.specific_force = options.accelerometer_matrix * force + accel_bias +
                         options.imu_noise * noise.sigma_specific_force * random.normal3();
    gyro_bias += options.imu_noise * noise.sigma_gyroscope_bias_step * random.normal3();
    accel_bias += options.imu_noise * noise.sigma_accelerometer_bias_step * random.normal3();
    out.imu.push_back(imu);
    sum += m.angular_velocity.squaredNorm();
  }
  out.turn_rate_rms = std::sqrt(sum / samples);

  const auto look = [&](const CameraCalibration& calibration, const Pose3& T_camera_imu, double offset_s) {
    const Camera camera(calibration);
    std::vector<TargetView> views;
    const auto pictures = static_cast<int>((options.seconds - 1) * options.camera_hz);
    for (int i = 0; i < pictures; ++i) {
      const double t = 0.5 + i / options.camera_hz;
      TargetView view;
      const double from_middle = t - 0.5 - (pictures - 1) / options.camera_hz / 2;
      view.time_ns =
          from_seconds(1000) + from_seconds(t - offset_s - options.drift * from_middle / (1 + options.drift));
      const bool seen = random.uniform() >= options.missing;
      for (int id = 0; id < out.target.corner_count(); ++id) {
        const auto at_row = [&](double row) {
          const double time = t + options.line_delay_s * (row - 0.5 * calibration.height_px);
          return camera.project(T_camera_imu * (at(time).T_target_imu.inverse() * out.target.corner(id)));
        };
        auto pixel = at_row(0.5 * calibration.height_px);
        for (int round = 0; round < 4 && pixel && options.line_delay_s != 0; ++round) pixel = at_row(pixel->y());
        Eigen::Vector2d error(random.normal(), random.normal());
        error *= options.corner_sigma_px;
        if (random.uniform() < options.outliers) {
          const double angle = 2 * std::numbers::pi * random.uniform();
          error += 20 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
        }
        const int number = options.half_turns && i % 2 == 1 ? out.target.corner_count() - 1 - id : id;
        if (seen && pixel && camera.in_image(*pixel, 5)) view.corners.push_back({number, *pixel + error});
      }
      std::ranges::sort(view.corners, {}, &TargetCorner::id);
      views.push_back(view);
    }
    return views;
  };
  out.views = look(out.camera, out.T_camera_imu, options.time_offset_s);
  if (options.second_camera) {
    out.second_views = look(out.second, out.T_second_imu, options.time_offset_s + kSecondOffset);
  }
  return out;
}

}  // namespace loc::test
