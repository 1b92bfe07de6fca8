// A camera with an IMU that flies in a room full of points, in closed form: for tests of SLAM without the simulator.
#pragma once

#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/estimators/slam_options.hpp"
#include "libloc/estimators/slam_state.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc::test {

struct SlamRideOptions {
  double sigma_px = 1;
  double rest_s = 1.5;  ///< at the beginning
  double rate_hz = 20;  ///< of the frames
  int points = 150;
  double outlier_rate = 0;    ///< share of features that are anywhere in the image
  double drop_rate = 0;       ///< share of frames that do not come
  double blind_from_s = 1e9;  ///< no feature from here …
  double blind_to_s = 1e9;    ///< … to here
  double glide = 0;           ///< along y at that speed [m/s], in place of the sines, after two seconds of speeding up
  bool imu_noise = true;
  Eigen::Vector3d gyroscope_bias{0.01, -0.02, 0.03};
  Eigen::Vector3d accelerometer_bias{0.05, -0.04, 0.06};
  std::uint64_t seed = 1;
};

class SlamRide {
 public:
  explicit SlamRide(const SlamRideOptions& options) : options_(options), random_(options.seed), camera_(calibration()) {
    for (int i = 0; i < options.points; ++i) {
      Eigen::Vector3d p(random_.uniform(-5, 5), random_.uniform(-4, 4), random_.uniform(-2, 2));
      p[i % 3] = (i % 2 == 0 ? 1 : -1) * (i % 3 == 0 ? 5 : i % 3 == 1 ? 4 : 2);  // on the walls
      points_.push_back(p);
    }
  }

  static CameraCalibration calibration() {
    CameraCalibration out;
    out.name = "cam0";
    out.width_px = 640;
    out.height_px = 480;
    out.intrinsics_px = {320, 320, 319.5, 239.5};
    out.distortion_model = DistortionModel::kRadtan;
    out.distortion = {-0.1, 0.02, 0, 0};
    out.T_body_camera.rotation = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
    out.T_body_camera.translation = {0.05, 0.02, -0.01};
    return out;
  }
  const std::vector<Eigen::Vector3d>& points() const { return points_; }

  /// True pose of body; at rest until rest_s, then sines.
  Pose3 pose(double time_s) const {
    const double t = std::max(0.0, time_s - options_.rest_s);
    if (options_.glide != 0) {
      const double u = std::min(t / 2, 1.0);
      const double way = 2 * u * u * u * u * (2.5 - 3 * u + u * u) + std::max(0.0, t - 2);
      return {Eigen::Quaterniond::Identity(), {0, options_.glide * way, 0}};
    }
    const double s = t < 1 ? t * t * t * (10 - 15 * t + 6 * t * t) : 1;  // smooth beginning
    const Eigen::Vector3d p(1.2 * std::sin(0.9 * t), 1.0 * std::sin(1.3 * t), 0.5 * std::sin(1.7 * t));
    const Eigen::Vector3d r(0.3 * std::sin(1.1 * t), 0.25 * std::sin(0.8 * t), 0.8 * std::sin(0.5 * t));
    return {so3::exp(s * r), s * p};
  }
  Eigen::Vector3d velocity(double time_s) const {
    constexpr double kH = 1e-4;
    return (pose(time_s + kH).translation - pose(time_s - kH).translation) / (2 * kH);
  }

  ImuMeasurement imu(int sample) {
    constexpr double kH = 1e-3;
    const double t = sample / kImuHz;
    const Pose3 now = pose(t);
    const Pose3 before = pose(t - kH);
    const Pose3 after = pose(t + kH);
    const Eigen::Vector3d a = (after.translation - 2 * now.translation + before.translation) / (kH * kH);
    ImuMeasurement out;
    out.time_ns = time_ns(t);
    out.sequence = sample;
    out.angular_velocity = so3::boxminus(after.rotation, before.rotation) / (2 * kH) + options_.gyroscope_bias;
    out.specific_force = now.rotation.conjugate() * (a + Eigen::Vector3d(0, 0, 9.80665)) + options_.accelerometer_bias;
    if (options_.imu_noise) {
      const DiscreteImuNoise noise = discretise(ImuNoise{}, 1 / kImuHz);
      out.angular_velocity += noise.sigma_angular_velocity * random_.normal3();
      out.specific_force += noise.sigma_specific_force * random_.normal3();
    }
    return out;
  }

  /// nullopt: the frame does not come.
  std::optional<FeaturesMeasurement> frame(int number) {
    const double t = number / options_.rate_hz;
    const Pose3 look = (pose(t) * calibration().T_body_camera).inverse();
    FeaturesMeasurement out;
    out.time_ns = time_ns(t);
    out.sequence = number;
    out.sigma_px = std::max(options_.sigma_px, 0.1);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const auto pixel = camera_.project(look * points_[i]);
      if (!pixel || !camera_.in_image(*pixel, 3)) continue;
      Eigen::Vector2d z = *pixel + options_.sigma_px * Eigen::Vector2d(random_.normal(), random_.normal());
      if (random_.uniform() < options_.outlier_rate) z = {random_.uniform(0, 639), random_.uniform(0, 479)};
      out.features.push_back({static_cast<std::int64_t>(i), z});
    }
    if (t >= options_.blind_from_s && t < options_.blind_to_s) out.features.clear();
    if (random_.uniform() < options_.drop_rate) return std::nullopt;
    return out;
  }

  /// All up to that time, in order; frames before samples of the same time.
  template <class Function>
  void run(double until_s, Function&& take) {
    int next_frame = 0;
    for (int sample = 0; sample / kImuHz <= until_s; ++sample) {
      while (next_frame / options_.rate_hz <= sample / kImuHz + 1e-9) {
        if (const auto f = frame(next_frame)) take(Measurement(*f));
        ++next_frame;
      }
      take(Measurement(imu(sample)));
    }
  }

  static TimeNs time_ns(double t) { return kStartNs + from_seconds(t); }
  static double time_s(TimeNs time_ns) { return to_seconds(time_ns - kStartNs); }

  static constexpr double kImuHz = 200;
  static constexpr TimeNs kStartNs = 1'000'000'000'000;

 private:
  SlamRideOptions options_;
  Random random_;
  Camera camera_;
  std::vector<Eigen::Vector3d> points_;
};

inline SlamOptions ride_options(SlamMotion motion) {
  SlamOptions out;
  out.motion = motion;
  out.camera = SlamRide::calibration();
  out.map.max_features = 80;
  out.map.max_measured = 40;
  out.map.min_visible = 30;
  out.acceleration_density = 2;
  out.angular_acceleration_density = 2;
  out.imu_sampling = ImuSampling::kPoint;
  return out;
}

}  // namespace loc::test
