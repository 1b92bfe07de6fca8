// Hard cases for SLAM from pictures, rendered with truth: a box room in which a camera sways, and a street along which
// it drives. Camera alone (errors after Sim(3)) and with a simulated IMU (white noise and biases; after SE(3)).
//   compare_images [OPTIONS]
//     --small          half as many pixels each way as 752 x 480
//     --seeds=N        so many worlds and noises, a line each (default 1)
//     --only=TEXT      only lines with that in "world: case: who", such as "street", "black", "alone"
// Columns: ATE, of the pictures after which it was not lost (aligned by them); their largest error; that of the last
// second and a half; the largest error while it was lost, by what it said itself to be off (deviation of the place),
// and by how many of its deviations it was off at most until it was found again, aligned by the pictures before it got
// lost; pictures after which it was lost, and times that it found itself again; pictures in new surroundings, of which
// it says that it does not know where they are; pictures with too few features, pictures after which the filter took
// the motion for unknown or began anew; tracks found out as moving, and found again; mean time of a picture, and the
// longest.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
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
  std::string name;
  std::vector<Pause> pauses{};
  double turn = 0;  ///< in the middle of the pause, there and back [rad]
  Change change = [](double, const ImageMeasurement& image) { return std::optional(image); };
};

std::vector<Case> cases() {
  const auto between = [](double t, double begin, double end) { return t >= begin && t < end; };
  return {{.name = "plain"},
          {.name = "pure rotation, 2 s", .pauses = {{3, 5}}, .turn = 0.5},
          {.name = "stop and go", .pauses = {{2.5, 4}, {5.5, 6.5}}},
          {.name = "crowd on 40 %, 3 s",
           .change =
               [=](double t, const ImageMeasurement& i) {
                 return std::optional(between(t, 3, 6) ? test::with_crowd(t - 3, i) : i);
               }},
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
          {.name = "black for 2 s",
           .change =
               [=](double t, const ImageMeasurement& i) {
                 return std::optional(between(t, 4, 6) ? test::brightened(i, 0) : i);
               }},
          {.name = "no pictures for 2 s",
           .change = [=](double t,
                         const ImageMeasurement& i) { return between(t, 4, 6) ? std::nullopt : std::optional(i); }},
          {.name = "wall before it for 1.5 s", .change = [=](double t, const ImageMeasurement& i) {
             const auto wall = [&] {
               return test::covered(
                   i,
                   {.left = -80 * (t - 4), .top = 0, .width = 2 * i.width_px, .height = i.height_px + 8, .pattern = 5});
             };
             return std::optional(between(t, 4, 5.5) ? wall() : i);
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
  std::vector<double> sigma_m;
  double spent_s = 0;
  double longest_s = 0;
  NamedCounts counts;
};

void keep(const SlamFrame& frame, Run& run) {
  run.estimate.times_ns.push_back(frame.time_ns);
  run.estimate.poses.push_back({frame.q_world_camera, frame.camera_position});
  run.status.push_back(frame.estimate.status);
  run.sigma_m.push_back(std::sqrt(frame.estimate.covariance.block<3, 3>(kPosition, kPosition).trace()));
}

template <class Slam>
bool process(ImageSlam<Slam>& slam, const ImageMeasurement& image, Run& run) {
  const auto begin = std::chrono::steady_clock::now();
  const bool is_new = slam.process(image);
  const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  run.spent_s += spent;
  run.longest_s = std::max(run.longest_s, spent);
  return is_new;
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
    if (process(slam, image, out)) keep(slam.slam().frame(), out);
  }
  out.counts = slam.counts();
  return out;
}

Run run_inertial(const std::vector<ImageMeasurement>& images, const CameraCalibration& camera,
                 const std::function<Pose3(double)>& path, std::uint64_t seed) {
  ImageSlam<InertialSlam> slam(slam_options(camera, SlamMotion::kInertial));
  Run out;
  Random random(seed + 2);
  const DiscreteImuNoise noise = discretise(ImuNoise{}, 1 / kImuHz);
  std::size_t next = 0;
  const auto keep_frames = [&] {
    for (const SlamFrame& frame : slam.slam().frames()) keep(frame, out);
  };
  for (int i = 0; i <= kDurationS * kImuHz; ++i) {
    ImuMeasurement sample = test::imu_of(path, i / kImuHz);
    sample.sequence = i;
    sample.angular_velocity += Eigen::Vector3d(0.004, -0.006, 0.005) + noise.sigma_angular_velocity * random.normal3();
    sample.specific_force += Eigen::Vector3d(0.05, -0.04, 0.03) + noise.sigma_specific_force * random.normal3();
    while (next < images.size() && images[next].time_ns <= sample.time_ns) {
      process(slam, images[next++], out);
      keep_frames();
    }
    slam.process(sample);
    keep_frames();
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
  // By the pictures after which it was not lost.
  Trajectory found;
  for (std::size_t i = 0; i < run.status.size(); ++i) {
    if ((run.status[i] & kLost) != 0) continue;
    found.times_ns.push_back(run.estimate.times_ns[i]);
    found.poses.push_back(run.estimate.poses[i]);
  }
  AssociationOptions options;
  options.interpolate_reference = true;
  const Association pairs = associate(found, truth, options);
  const AbsoluteError error = absolute_error(pairs.estimate, pairs.reference, mode);
  double last = 0;
  for (std::size_t i = 0; i < error.times_ns.size(); ++i) {
    if (to_seconds(error.times_ns.back() - error.times_ns[i]) < kLastS) last = std::max(last, error.translation_m[i]);
  }
  const auto off_by = [&](std::size_t i, const Alignment& to_truth) {
    const auto at = std::lower_bound(truth.times_ns.begin(), truth.times_ns.end(), run.estimate.times_ns[i]);
    if (at == truth.times_ns.end()) return 0.0;
    const Pose3& true_pose = truth.poses[static_cast<std::size_t>(at - truth.times_ns.begin())];
    return (to_truth * run.estimate.poses[i].translation - true_pose.translation).norm();
  };
  double guess = 0;
  double says = 0;
  for (std::size_t i = 0; i < run.status.size(); ++i) {
    if ((run.status[i] & kLost) == 0) continue;
    const double off = off_by(i, error.alignment);
    if (off < guess) continue;
    guess = off;
    says = error.alignment.scale * run.sigma_m[i];
  }
  const auto first_lost = std::find_if(run.status.begin(), run.status.end(), [](auto s) { return (s & kLost) != 0; });
  Trajectory before;
  const auto kept = static_cast<std::size_t>(first_lost - run.status.begin());
  before.times_ns.assign(run.estimate.times_ns.begin(),
                         run.estimate.times_ns.begin() + (first_lost - run.status.begin()));
  before.poses.assign(run.estimate.poses.begin(), run.estimate.poses.begin() + (first_lost - run.status.begin()));
  double worst = 0;
  if (first_lost != run.status.end() && kept >= 10) {
    const Association old = associate(before, truth, options);
    const AbsoluteError trusted = absolute_error(old.estimate, old.reference, mode);
    for (std::size_t i = kept; i < run.status.size(); ++i) {
      if ((run.status[i] & (kLost | kMapLinkUnknown)) == 0) continue;
      worst = std::max(worst, off_by(i, trusted.alignment) / (trusted.alignment.scale * run.sigma_m[i]));
    }
  }
  const auto with = [&](std::uint32_t bit) {
    return static_cast<long>(
        std::count_if(run.status.begin(), run.status.end(), [&](std::uint32_t s) { return (s & bit) != 0; }));
  };
  const auto count = [&](const char* name) { return static_cast<long>(count_of(run.counts, name)); };
  std::printf(
      "%3zu/%zu  ATE %7.4f m  largest %7.4f  end %7.4f   lost %2ld (%6.3f m, says %6.3f, "
      "at most %4.1f)  found %ld  elsewhere %2ld   few %2ld  "
      "recovered %2ld  anew %2ld   moving %3ld  again %4ld   %4.1f, %5.1f ms\n",
      run.estimate.times_ns.size(), pictures, error.translation.rmse, error.translation.max, last, with(kLost), guess,
      says, worst, with(kRefound), with(kMapLinkUnknown), with(kFewFeatures), with(kRecovered), with(kReinitialised),
      count("tracks.moving"), count("tracks.refound"), 1e3 * run.spent_s / static_cast<double>(pictures),
      1e3 * run.longest_s);
  std::fflush(stdout);
}

struct Settings {
  bool small = false;
  std::uint64_t seeds = 1;
  std::string only;
};

/// Cases that see the same pictures share them.
class Pictures {
 public:
  Pictures(const World& world, std::uint64_t seed) : world_(world), seed_(seed) {}

  const std::vector<ImageMeasurement>& of(const Case& c) {
    const auto path = [&](double t) { return pose_of(world_, c, t); };
    Trajectory truth;
    for (int i = 0; i < kDurationS * kRateHz; ++i) {
      truth.times_ns.push_back(from_seconds(i / kRateHz));
      truth.poses.push_back(path(i / kRateHz));
    }
    const auto same = [](const Pose3& a, const Pose3& b) {
      return a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs();
    };
    if (std::equal(truth.poses.begin(), truth.poses.end(), truth_.poses.begin(), truth_.poses.end(), same))
      return images_;
    truth_ = truth;
    images_.clear();
    Random random(seed_ + 1);
    for (std::size_t i = 0; i < truth.poses.size(); ++i) {
      images_.push_back(world_.renderer->render(truth.poses[i], &random));
      images_.back().time_ns = truth.times_ns[i];
      images_.back().sequence = static_cast<std::int64_t>(i);
    }
    return images_;
  }
  const Trajectory& truth() const { return truth_; }

 private:
  const World& world_;
  std::uint64_t seed_;
  Trajectory truth_;
  std::vector<ImageMeasurement> images_;
};

void run(const World& world, const Case& c, const CameraCalibration& camera, Pictures& pictures, std::uint64_t seed,
         const std::string& only) {
  const std::string name = std::string(world.name) + ": " + c.name;
  const bool alone = (name + ": alone").find(only) != std::string::npos;
  const bool inertial = (name + ": with IMU").find(only) != std::string::npos;
  if (!alone && !inertial) return;
  std::vector<ImageMeasurement> images;
  for (const ImageMeasurement& image : pictures.of(c)) {
    if (auto changed = c.change(to_seconds(image.time_ns), image)) images.push_back(std::move(*changed));
  }
  std::printf("%s (seed %d)\n", name.c_str(), static_cast<int>(seed));
  const auto path = [&](double t) { return pose_of(world, c, t); };
  if (alone) report("alone", run_alone(images, camera), images.size(), pictures.truth(), AlignmentMode::kSim3);
  if (inertial) {
    report("with IMU", run_inertial(images, camera, path, seed), images.size(), pictures.truth(), AlignmentMode::kSe3);
  }
}

}  // namespace
}  // namespace loc

int main(int argc, char** argv) {
  using namespace loc;
  Settings settings;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--small") {
      settings.small = true;
    } else if (argument.starts_with("--seeds=")) {
      settings.seeds = std::stoul(argument.substr(8));
    } else if (argument.starts_with("--only=")) {
      settings.only = argument.substr(7);
    } else {
      std::fprintf(stderr, "compare_images [--small] [--seeds=N] [--only=TEXT], not %s\n", argument.c_str());
      return 1;
    }
  }
  const CameraCalibration camera = settings.small ? test::small_camera() : test::radtan_camera();
  const RendererOptions options{.texel_m = 0.008, .noise_sigma = 2};
  for (std::uint64_t seed = 1; seed <= settings.seeds; ++seed) {
    std::vector<World> worlds;
    worlds.push_back(
        {"room", test::swaying, std::make_unique<SceneRenderer>(box_room({}, Random(seed)), camera, options)});
    worlds.push_back({"street", driving,
                      std::make_unique<SceneRenderer>(street({{0, 0, 0}, {20, 0, 0}, {40, 0, 0}}, {}, Random(seed)),
                                                      camera, RendererOptions{.noise_sigma = 2})});
    for (const World& world : worlds) {
      Pictures pictures(world, seed);
      // Those on the same path one after the other.
      std::vector<Case> all = cases();
      std::stable_partition(all.begin(), all.end(), [](const Case& c) { return c.pauses.empty(); });
      for (const Case& c : all) run(world, c, camera, pictures, seed, settings.only);
    }
  }
  return 0;
}
