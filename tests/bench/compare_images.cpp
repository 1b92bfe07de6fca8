// Hard cases for SLAM from pictures, rendered with truth: a box room in which a camera sways, and a street along which
// it drives. Camera alone (errors after Sim(3)) and with a simulated IMU (white noise and biases; after SE(3)).
//   compare_images [small]     pictures of 752 x 480, or half as many pixels each way
// Columns: ATE; largest error; that of the last second and a half; pictures with too few features, pictures after which
// the filter took the motion for unknown or began anew; tracks found out as moving, and found again.
// All is seeded; the figures are those of one run of each.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libloc/eval/trajectory_error.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sim/street.hpp"
#include "libloc/vision/image_slam.hpp"
#include "support/rendered_ride.hpp"

namespace loc {
namespace {

constexpr double kRateHz = 20;
constexpr double kImuHz = 200;
constexpr double kDurationS = 9;
constexpr double kLastS = 1.5;

/// Time that does not pass between begin and end, and slows down and speeds up smoothly in half a second before each.
struct Pause {
  double begin_s;
  double end_s;

  double lost(double t) const { return kEase * (ramp((t - begin_s) / kEase) - ramp((t - end_s) / kEase)); }

 private:
  static constexpr double kEase = 0.5;
  // Integral of u^3 (10 - 15 u + 6 u^2), which goes from 0 to 1.
  static double ramp(double u) {
    if (u <= 0) return 0;
    if (u >= 1) return 0.5 + (u - 1);
    return u * u * u * u * (2.5 - 3 * u + u * u);
  }
};

using Change = std::function<std::optional<ImageMeasurement>(double time_s, const ImageMeasurement& image)>;

struct Case {
  const char* name;
  std::vector<Pause> pauses{};
  double turn = 0;  ///< in the middle of the pause, there and back [rad]
  Change change = [](double, const ImageMeasurement& image) { return std::optional(image); };
};

/// Four figures of a tenth of the picture each, walking both ways.
ImageMeasurement with_crowd(double t, const ImageMeasurement& image) {
  const double w = image.width_px;
  const double h = image.height_px;
  const double speeds[] = {0.09, -0.11, 0.13, -0.07};  // of the picture's width in a second
  const double places[] = {0.1, 0.5, 0.55, 0.95};
  ImageMeasurement out = image;
  for (int i = 0; i < 4; ++i) {
    const double middle = w * (places[i] + speeds[i] * (t - 3));
    out = test::covered(out, {.left = middle - 0.065 * w,
                              .top = (0.15 + 0.02 * i) * h,
                              .width = static_cast<int>(0.13 * w),
                              .height = static_cast<int>(0.78 * h),
                              .pattern = static_cast<std::uint64_t>(i) + 11});
  }
  return out;
}

std::vector<Case> cases() {
  const auto between = [](double t, double begin, double end) { return t >= begin && t < end; };
  return {{"plain"},
          {.name = "pure rotation, 2 s", .pauses = {{3, 5}}, .turn = 0.5},
          {.name = "stop and go", .pauses = {{2.5, 4}, {5.5, 6.5}}},
          {.name = "crowd on 40 %, 3 s",
           .change = [=](double t,
                         const ImageMeasurement& i) { return std::optional(between(t, 3, 6) ? with_crowd(t, i) : i); }},
          {.name = "exposure x 1.5, x 0.6",
           .change =
               [=](double t, const ImageMeasurement& i) {
                 return std::optional(test::brightened(i, between(t, 3, 5) ? 1.5 : between(t, 5, 7) ? 0.6 : 1));
               }},
          {.name = "5 pictures dropped, twice",
           .change =
               [=](double t, const ImageMeasurement& i) {
                 return between(t, 3, 3.25) || between(t, 5, 5.25) ? std::nullopt : std::optional(i);
               }},
          {.name = "black for 0.1 s",
           .change =
               [=](double t, const ImageMeasurement& i) {
                 return std::optional(between(t, 4, 4.1) ? test::brightened(i, 0) : i);
               }},
          {.name = "black for 0.5 s",
           .change =
               [=](double t, const ImageMeasurement& i) {
                 return std::optional(between(t, 4, 4.5) ? test::brightened(i, 0) : i);
               }},
          {.name = "black for 2 s", .change = [=](double t, const ImageMeasurement& i) {
             return std::optional(between(t, 4, 6) ? test::brightened(i, 0) : i);
           }}};
}

struct World {
  const char* name;
  std::function<Pose3(double)> path;
  std::unique_ptr<SceneRenderer> renderer;
};

Pose3 driving(double t) {
  const Eigen::Vector3d p(4 * t, 0.3 * std::sin(0.5 * t), 1.5 + 0.02 * std::sin(2 * t));
  const Eigen::Vector3d r(0.01 * std::sin(1.7 * t), 0.01 * std::sin(2.1 * t), 0.15 + 0.08 * std::sin(0.5 * t));
  return {so3::exp(r) * test::along_x(), p};
}

Pose3 pose_of(const World& world, const Case& c, double t) {
  // Both begin at rest.
  double own = t - Pause{-1, 1}.lost(t) + Pause{-1, 1}.lost(0);
  double angle = 0;
  for (const Pause& pause : c.pauses) {
    own -= pause.lost(t);
    const double u = std::clamp((t - pause.begin_s) / (pause.end_s - pause.begin_s), 0.0, 1.0);
    angle += c.turn * std::pow(std::sin(M_PI * u), 4);
  }
  Pose3 out = world.path(own);
  out.rotation = so3::exp(Eigen::Vector3d(0, 0, angle)) * out.rotation;
  return out;
}

struct Run {
  Trajectory estimate;
  std::vector<std::uint32_t> status;
  NamedCounts counts;
};

void keep(const SlamFrame& frame, Run& run) {
  run.estimate.times_ns.push_back(frame.time_ns);
  run.estimate.poses.push_back({frame.q_world_camera, frame.camera_position});
  run.status.push_back(frame.estimate.status);
}

SlamOptions slam_options(const CameraCalibration& camera, SlamMotion motion) {
  SlamOptions out;
  out.camera = camera;
  out.motion = motion;
  out.imu_sampling = ImuSampling::kPoint;
  return slam_options_for_images(out);
}

Run run_alone(const std::vector<ImageMeasurement>& images, const CameraCalibration& camera) {
  ImageSlam<MonoSlam> slam(slam_options(camera, SlamMotion::kConstantVelocity));
  Run out;
  for (const ImageMeasurement& image : images) {
    if (slam.process(image)) keep(slam.slam().frame(), out);
  }
  out.counts = slam.counts();
  return out;
}

Run run_inertial(const std::vector<ImageMeasurement>& images, const CameraCalibration& camera,
                 const std::function<Pose3(double)>& path) {
  ImageSlam<InertialSlam> slam(slam_options(camera, SlamMotion::kInertial));
  Run out;
  Random random(3);
  const DiscreteImuNoise noise = discretise(ImuNoise{}, 1 / kImuHz);
  std::size_t next = 0;
  const auto process = [&](const Measurement& measurement) {
    slam.process(measurement);
    for (const SlamFrame& frame : slam.slam().frames()) keep(frame, out);
  };
  for (int i = 0; i <= kDurationS * kImuHz; ++i) {
    ImuMeasurement sample = test::imu_of(path, i / kImuHz);
    sample.sequence = i;
    sample.angular_velocity += Eigen::Vector3d(0.004, -0.006, 0.005) + noise.sigma_angular_velocity * random.normal3();
    sample.specific_force += Eigen::Vector3d(0.05, -0.04, 0.03) + noise.sigma_specific_force * random.normal3();
    while (next < images.size() && images[next].time_ns <= sample.time_ns) process(images[next++]);
    process(sample);
  }
  out.counts = slam.counts();
  return out;
}

std::int64_t count_of(const NamedCounts& counts, const std::string& name) {
  for (const NamedCount& count : counts) {
    if (count.name == name) return count.value;
  }
  return 0;
}

void report(const char* who, const Run& run, std::size_t pictures, const Trajectory& truth, AlignmentMode mode) {
  std::printf("    %-9s", who);
  if (run.estimate.times_ns.size() < 20) {
    std::printf("estimates for %zu of %zu pictures only\n", run.estimate.times_ns.size(), pictures);
    return;
  }
  AssociationOptions options;
  options.interpolate_reference = true;
  const Association pairs = associate(run.estimate, truth, options);
  const AbsoluteError error = absolute_error(pairs.estimate, pairs.reference, mode);
  double last = 0;
  for (std::size_t i = 0; i < error.times_ns.size(); ++i) {
    if (to_seconds(error.times_ns.back() - error.times_ns[i]) < kLastS) last = std::max(last, error.translation_m[i]);
  }
  const auto with = [&](std::uint32_t bit) {
    return std::count_if(run.status.begin(), run.status.end(), [&](std::uint32_t s) { return (s & bit) != 0; });
  };
  std::printf(
      "%4zu/%zu  ATE %7.4f m  largest %7.4f  at the end %7.4f   few %3ld  recovered %2ld  anew %2ld   moving %4lld  "
      "again %4lld\n",
      run.estimate.times_ns.size(), pictures, error.translation.rmse, error.translation.max, last,
      static_cast<long>(with(kFewFeatures)), static_cast<long>(with(kRecovered)),
      static_cast<long>(with(kReinitialised)), static_cast<long long>(count_of(run.counts, "tracks.moving")),
      static_cast<long long>(count_of(run.counts, "tracks.refound")));
  std::fflush(stdout);
}

void run(const World& world, const Case& c, const CameraCalibration& camera) {
  const auto path = [&](double t) { return pose_of(world, c, t); };
  std::vector<ImageMeasurement> images;
  Trajectory truth;
  Random random(2);
  for (int i = 0; i < kDurationS * kRateHz; ++i) {
    const double t = i / kRateHz;
    truth.times_ns.push_back(from_seconds(t));
    truth.poses.push_back(path(t));
    ImageMeasurement image = world.renderer->render(truth.poses.back(), &random);
    image.time_ns = from_seconds(t);
    image.sequence = i;
    if (auto changed = c.change(t, image)) images.push_back(std::move(*changed));
  }
  std::printf("%s: %s\n", world.name, c.name);
  report("alone", run_alone(images, camera), images.size(), truth, AlignmentMode::kSim3);
  report("with IMU", run_inertial(images, camera, path), images.size(), truth, AlignmentMode::kSe3);
}

}  // namespace
}  // namespace loc

int main(int argc, char** argv) {
  using namespace loc;
  const bool small = argc > 1 && std::strcmp(argv[1], "small") == 0;
  const CameraCalibration camera = small ? test::small_camera() : test::radtan_camera();
  const RendererOptions options{.texel_m = 0.008, .noise_sigma = 2};
  std::vector<World> worlds;
  worlds.push_back({"room", test::swaying, std::make_unique<SceneRenderer>(box_room({}, Random(1)), camera, options)});
  worlds.push_back({"street", driving,
                    std::make_unique<SceneRenderer>(street({{0, 0, 0}, {20, 0, 0}, {40, 0, 0}}, {}, Random(1)), camera,
                                                    RendererOptions{.noise_sigma = 2})});
  for (const World& world : worlds) {
    for (const Case& c : cases()) run(world, c, camera);
  }
  return 0;
}
