// A camera with an IMU that looks at points on two walls and moves to and fro before them: exact tracks and samples.
#pragma once

#include <cmath>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc::test {

struct SlamTracks {
  CameraCalibration camera;
  std::vector<FeaturesMeasurement> frames;  ///< 20 Hz
  std::vector<ImuMeasurement> samples;      ///< 200 Hz, at rest for the first 1.5 s
};

inline SlamTracks slam_tracks(double seconds, std::uint64_t seed = 1) {
  SlamTracks out;
  out.camera.name = "cam0";
  out.camera.width_px = 640;
  out.camera.height_px = 480;
  out.camera.intrinsics_px = {400, 400, 319.5, 239.5};
  out.camera.T_body_camera.rotation = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);  // looks along x of body
  const Camera camera(out.camera);
  Random random(seed);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 120; ++i) {
    points.emplace_back(i % 2 == 0 ? 4 : 7, random.uniform(-3, 3), random.uniform(-2, 2));
  }
  constexpr double kRest = 1.5;
  constexpr double kAmplitude = 0.5;
  constexpr double kRate = 1.5;
  // y(t) = A (1 - cos w(t - rest)) / 2 along the wall, z likewise at another rate: smooth at its beginning.
  const auto place = [&](double t, int derivative) {
    if (t < kRest) return Eigen::Vector3d(0, 0, 0);
    const double u = t - kRest;
    const auto part = [&](double w) {
      return derivative == 0 ? kAmplitude * (1 - std::cos(w * u)) / 2 : kAmplitude * w * w * std::cos(w * u) / 2;
    };
    return Eigen::Vector3d(0, part(kRate), part(1.7 * kRate));
  };
  constexpr TimeNs kStart = 1'700'000'000'000'000'000;
  constexpr TimeNs kStep = 5'000'000;
  const int steps = static_cast<int>(seconds * 200);
  for (int i = 0; i <= steps; ++i) {
    const double t = i * 0.005;
    ImuMeasurement imu;
    imu.time_ns = kStart + i * kStep;
    imu.host_time_ns = imu.time_ns + 1'000'000;
    imu.sequence = i;
    imu.angular_velocity = 1e-3 * random.normal3();
    imu.specific_force = place(t, 2) + Eigen::Vector3d(0, 0, 9.80665) + 2e-2 * random.normal3();
    out.samples.push_back(imu);
    if (i % 10 != 0) continue;
    FeaturesMeasurement frame;
    frame.time_ns = imu.time_ns;
    frame.host_time_ns = imu.host_time_ns;
    frame.sequence = i / 10;
    frame.sigma_px = 0.5;
    const Pose3 T_world_camera = Pose3{Eigen::Quaterniond::Identity(), place(t, 0)} * out.camera.T_body_camera;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto pixel = camera.project(T_world_camera.inverse() * points[k]);
      if (!pixel || !camera.in_image(*pixel, 5)) continue;
      const Eigen::Vector2d noisy = *pixel + 0.5 * Eigen::Vector2d(random.normal(), random.normal());
      frame.features.push_back({static_cast<std::int64_t>(k), noisy});
    }
    out.frames.push_back(frame);
  }
  return out;
}

}  // namespace loc::test
