// SLAM from the pictures of EuRoC MH_01 (the part that is at hand: 600 pictures, of which the first 300 move) against
// its ground truth: camera alone, and with an IMU that is simulated from the ground truth, because its readings are not
// at hand.
//   compare_images_euroc [SEEDS]     so many draws of the IMU's noise (default 1)
//   compare_images_euroc doubts      what ResidualWatch and StampWatch say of right and wrong intrinsics and stamps
// Pictures: euroc-mh01-images in $LIBLOC_DATA, or in shared/data beside the project's folder; without them it says so
// and ends with 0. Exit code 1: a figure is beyond its bar.
// Simulated IMU: 200 Hz, splines with two continuous derivatives through means of ten poses (50 ms) of the ground
// truth, so it feels nothing of the vibration that the real one felt; noise and bias walk of imu0-sensor.yaml.
// Errors are those of the camera's centre.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "libloc/core/statistics.hpp"
#include "libloc/eval/trajectory_error.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "libloc/io/tum.hpp"
#include "libloc/sim/imu.hpp"
#include "libloc/sim/piecewise_cubic.hpp"
#include "libloc/vision/image_file.hpp"
#include "libloc/vision/image_slam.hpp"
#include "support/data.hpp"

namespace loc {
namespace {

constexpr std::size_t kMoving = 300;  // pictures
constexpr int kMean = 10;             // poses of the ground truth in one knot
constexpr double kAloneBarM = 0.025;
constexpr double kStillBarM = 0.005;
constexpr double kInertialBarM = 0.02;
constexpr double kScaleBar = 0.01;

struct Recording {
  CameraCalibration camera;
  ImuCalibration imu;
  std::vector<ImageMeasurement> images;
  Trajectory body;
  Trajectory eye;  // the camera
};

Recording read(const std::filesystem::path& folder) {
  Recording out;
  out.camera = read_euroc_camera(folder / "mav0" / "cam0" / "sensor.yaml");
  out.imu = read_euroc_imu(folder / "imu0-sensor.yaml");
  out.body = read_tum(folder / "groundtruth.tum").trajectory;
  out.eye = out.body;
  for (Pose3& pose : out.eye.poses) pose = pose * out.camera.T_body_camera;
  std::ifstream list(folder / "mav0" / "cam0" / "data.csv");
  std::string line;
  while (std::getline(list, line)) {
    if (line.empty() || line[0] == '#') continue;
    const std::size_t comma = line.find(',');
    std::string name = line.substr(comma + 1);
    name.erase(std::remove_if(name.begin(), name.end(), [](char c) { return c == '\r' || c == ' '; }), name.end());
    out.images.push_back(read_image(folder / "mav0" / "cam0" / "data" / name));
    out.images.back().time_ns = std::stoll(line.substr(0, comma));
    out.images.back().sequence = static_cast<std::int64_t>(out.images.size()) - 1;
  }
  return out;
}

/// The ground truth as a motion. Time 0 is its first knot.
class TruthMotion : public Motion {
 public:
  explicit TruthMotion(const Trajectory& body) {
    std::vector<double> knots;
    std::array<std::vector<double>, 7> values;
    Eigen::Vector4d before = Eigen::Vector4d::Zero();
    for (std::size_t i = 0; i + kMean <= body.times_ns.size(); i += kMean) {
      double time = 0;
      Eigen::Matrix<double, 7, 1> sum = Eigen::Matrix<double, 7, 1>::Zero();
      for (std::size_t k = i; k < i + kMean; ++k) {
        time += to_seconds(body.times_ns[k] - body.times_ns[0]) / kMean;
        Eigen::Vector4d q = body.poses[k].rotation.coeffs();
        if (q.dot(before) < 0) q = -q;  // the same rotation, on the side of the one before
        before = q;
        sum.head<3>() += body.poses[k].translation / kMean;
        sum.tail<4>() += q / kMean;
      }
      if (knots.empty()) start_ns_ = body.times_ns[0] + from_seconds(time);
      knots.push_back(time - to_seconds(start_ns_ - body.times_ns[0]));
      for (int j = 0; j < 7; ++j) values[static_cast<std::size_t>(j)].push_back(sum[j]);
    }
    for (const auto& one : values) splines_.push_back(PiecewiseCubic::spline(knots, one));
    duration_s_ = knots.back();
  }

  TimeNs start_ns() const { return start_ns_; }
  double duration_s() const override { return duration_s_; }
  MotionState at(double time_s) const override {
    Eigen::Matrix<double, 7, 3> v;
    for (int j = 0; j < 7; ++j) {
      const PiecewiseCubic::Value one = splines_[static_cast<std::size_t>(j)].at(time_s);
      v.row(j) << one.value, one.rate, one.acceleration;
    }
    MotionState out;
    out.time_s = time_s;
    out.T_world_body.translation = v.block<3, 1>(0, 0);
    out.velocity = v.block<3, 1>(0, 1);
    out.acceleration = v.block<3, 1>(0, 2);
    // u / |u| turns with twice the vector part of conj(u) u' / |u|^2, whatever the length does.
    const Eigen::Quaterniond u(Eigen::Vector4d(v.block<4, 1>(3, 0)));
    const Eigen::Quaterniond rate(Eigen::Vector4d(v.block<4, 1>(3, 1)));
    out.T_world_body.rotation = u.normalized();
    out.angular_velocity = 2 * (u.conjugate() * rate).vec() / u.squaredNorm();
    return out;
  }

 private:
  std::vector<PiecewiseCubic> splines_;
  TimeNs start_ns_ = 0;
  double duration_s_ = 0;
};

struct Run {
  Trajectory eye;
  std::vector<double> front_ms;
  std::vector<double> filter_ms;
  std::vector<double> whole_ms;  ///< with the IMU samples since the picture before
  NamedCounts counts;
  std::uint32_t status = 0;
  ResidualWatchVerdict verdict;  ///< the last one
  double first_doubt_s = kUnknown;
  double offset_s = kUnknown;  ///< by StampWatch
  double sigma_s = kUnknown;
};

// What is told to SLAM in place of what is right.
struct Fault {
  const char* name;
  CameraCalibration camera;
  double late_s = 0;  ///< stamps of the pictures
};

double ms_since(std::chrono::steady_clock::time_point begin) {
  return 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void keep(const SlamFrame& frame, Run& run) {
  run.eye.times_ns.push_back(frame.time_ns);
  run.eye.poses.push_back({frame.q_world_camera, frame.camera_position});
  run.filter_ms.push_back(1e3 * frame.time_spent_s);
  run.status |= frame.estimate.status;
  if ((frame.estimate.status & kCalibrationDoubtful) != 0 && std::isnan(run.first_doubt_s)) {
    run.first_doubt_s = to_seconds(frame.time_ns - run.eye.times_ns.front());
  }
}

Run run_alone(const Recording& recording, const CameraCalibration& camera) {
  SlamOptions options;
  options.camera = camera;
  // The camera is the body: what moves smoothly is its own path then, in the unit of the map.
  options.camera.T_body_camera = Pose3{};
  ImageSlam<MonoSlam> slam(slam_options_for_images(options));
  Run out;
  for (const ImageMeasurement& image : recording.images) {
    const auto begin = std::chrono::steady_clock::now();
    if (!slam.process(image)) continue;
    out.whole_ms.push_back(ms_since(begin));
    out.front_ms.push_back(1e3 * slam.tracker().times().total_s);
    keep(slam.slam().frame(), out);
  }
  out.counts = slam.counts();
  out.verdict = slam.slam().filter().residual_watch().verdict();
  return out;
}

Run run_inertial(const Recording& recording, const TruthMotion& motion, std::uint64_t seed, const Fault& fault) {
  ImuModel model = ImuModel::perfect(200);
  model.gyroscope.noise_density = recording.imu.noise.gyroscope_noise_density;
  model.gyroscope.random_walk = recording.imu.noise.gyroscope_random_walk;
  model.gyroscope.constant_bias = {-0.002, 0.02, 0.07};
  model.accelerometer.noise_density = recording.imu.noise.accelerometer_noise_density;
  model.accelerometer.random_walk = recording.imu.noise.accelerometer_random_walk;
  model.accelerometer.constant_bias = {-0.02, 0.12, 0.06};
  ImuSimulator simulator(model, Random(seed));

  SlamOptions options;
  options.motion = SlamMotion::kInertial;
  options.camera = fault.camera;
  options.imu_noise = recording.imu.noise;
  options.imu_sampling = ImuSampling::kPoint;
  ImageSlam<InertialSlam> slam(slam_options_for_images(options));
  Run out;
  std::size_t next = 0;
  double spent = 0;
  const auto kept = [&] {
    for (const SlamFrame& frame : slam.slam().frames()) keep(frame, out);
  };
  // Whole multiples of the period from a picture's time on: the recording's sensors are triggered together.
  const TimeNs period = from_seconds(1 / model.rate_hz);
  TimeNs now = recording.images.front().time_ns;
  while (now - period >= motion.start_ns()) now -= period;
  const TimeNs end = motion.start_ns() + from_seconds(motion.duration_s());
  for (std::int64_t sequence = 0; now <= end; now += period, ++sequence) {
    const TimeNs late = from_seconds(fault.late_s);
    while (next < recording.images.size() && recording.images[next].time_ns + late <= now) {
      ImageMeasurement image = recording.images[next++];
      image.time_ns += late;
      const auto begin = std::chrono::steady_clock::now();
      slam.process(image);
      out.whole_ms.push_back(spent + ms_since(begin));
      spent = 0;
      out.front_ms.push_back(1e3 * slam.tracker().times().total_s);
      kept();
    }
    ImuMeasurement sample = simulator.measure(motion, now - motion.start_ns());
    sample.time_ns = now;
    sample.sequence = sequence;
    const auto begin = std::chrono::steady_clock::now();
    slam.process(sample);
    spent += ms_since(begin);
    kept();
    out.status |= slam.estimate().status & kStampsDoubtful;
  }
  out.counts = slam.counts();
  out.verdict = slam.slam().filter().residual_watch().verdict();
  out.offset_s = slam.slam().stamp_watch().offset_s();
  out.sigma_s = slam.slam().stamp_watch().sigma_s();
  return out;
}

Trajectory part(const Trajectory& all, TimeNs from_ns, TimeNs until_ns) {
  Trajectory out;
  for (std::size_t i = 0; i < all.times_ns.size(); ++i) {
    if (all.times_ns[i] < from_ns || all.times_ns[i] >= until_ns) continue;
    out.times_ns.push_back(all.times_ns[i]);
    out.poses.push_back(all.poses[i]);
  }
  return out;
}

AbsoluteError compare(const Trajectory& estimate, const Trajectory& truth, AlignmentMode mode) {
  AssociationOptions options;
  options.interpolate_reference = true;
  const Association pairs = associate(estimate, truth, options);
  return absolute_error(pairs.estimate, pairs.reference, mode);
}

double largest_from_mean(const Trajectory& path) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Pose3& pose : path.poses) middle += pose.translation / static_cast<double>(path.poses.size());
  double out = 0;
  for (const Pose3& pose : path.poses) out = std::max(out, (pose.translation - middle).norm());
  return out;
}

bool within(const char* what, double value, double bar) {
  std::printf("  %-52s %8.4f   bar %g%s\n", what, value, bar, value <= bar ? "" : "   MISSED");
  return value <= bar;
}

void print_times(const Run& run) {
  const auto line = [](const char* what, const std::vector<double>& ms) {
    std::printf("  %-10s median %6.2f ms   p99 %6.2f ms\n", what, quantile(ms, 0.5), quantile(ms, 0.99));
  };
  line("front end", run.front_ms);
  line("filter", run.filter_ms);
  line("whole", run.whole_ms);
}

void print_counts(const Run& run) {
  std::printf("  status of all frames 0x%x;", run.status);
  for (const NamedCount& count : run.counts) {
    if (count.value != 0) std::printf(" %s %lld", count.name.c_str(), static_cast<long long>(count.value));
  }
  std::printf("\n");
}

bool report_alone(const Recording& recording) {
  const Run run = run_alone(recording, recording.camera);
  const TimeNs begin = recording.images.front().time_ns;
  const TimeNs middle = recording.images[kMoving].time_ns;
  const TimeNs end = recording.images.back().time_ns + 1;
  std::printf("camera alone (Sim(3), %zu of %zu pictures with an estimate)\n", run.eye.times_ns.size(),
              recording.images.size());
  const AbsoluteError moving = compare(part(run.eye, begin, middle), recording.eye, AlignmentMode::kSim3);
  bool ok = within("moving half: ATE [m]", moving.translation.rmse, kAloneBarM);
  std::printf("    largest %.4f m; a constant place scores %.4f m\n", moving.translation.max,
              moving.alignment.extent.norm());
  std::printf("  whole: ATE %.4f m\n", compare(run.eye, recording.eye, AlignmentMode::kSim3).translation.rmse);
  // The first quarter of a second is coming to rest.
  const double still = largest_from_mean(part(run.eye, middle + from_seconds(0.25), end)) * moving.alignment.scale;
  ok = within("still half: largest from its mean [m]", still, kStillBarM) && ok;
  std::printf("    ground truth there: %.4f m\n",
              largest_from_mean(part(recording.eye, middle + from_seconds(0.25), end)));
  for (int third = 0; third < 3; ++third) {
    const AbsoluteError one =
        compare(part(run.eye, begin + third * (middle - begin) / 3, begin + (third + 1) * (middle - begin) / 3),
                recording.eye, AlignmentMode::kSim3);
    std::printf("  third %d of the moving half: scale %.4f (%+.1f %% of that of the half), ATE %.4f m\n", third + 1,
                one.alignment.scale, 100 * (one.alignment.scale / moving.alignment.scale - 1), one.translation.rmse);
  }
  print_times(run);
  print_counts(run);
  return ok;
}

bool report_inertial(const Recording& recording, std::uint64_t seed) {
  const TruthMotion motion(recording.body);
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < recording.body.times_ns.size(); ++i) {
    const double t = to_seconds(recording.body.times_ns[i] - motion.start_ns());
    if (t < 0 || t > motion.duration_s()) continue;
    squares += (motion.at(t).T_world_body.translation - recording.body.poses[i].translation).squaredNorm();
    ++count;
  }
  const Run run = run_inertial(recording, motion, seed, {"none", recording.camera});
  std::printf("with an IMU SIMULATED from the ground truth, seed %llu (splines %.2f mm rms from it; SE(3))\n",
              static_cast<unsigned long long>(seed), 1e3 * std::sqrt(squares / static_cast<double>(count)));
  std::printf("  %zu of %zu pictures with an estimate\n", run.eye.times_ns.size(), recording.images.size());
  if (run.eye.times_ns.size() < kMoving) {
    print_counts(run);
    return within("pictures without an estimate",
                  static_cast<double>(recording.images.size() - run.eye.times_ns.size()), kMoving);
  }
  const TimeNs begin = recording.images.front().time_ns;
  const TimeNs middle = recording.images[kMoving].time_ns;
  const AbsoluteError all = compare(run.eye, recording.eye, AlignmentMode::kSe3);
  const Trajectory half = part(run.eye, begin, middle);
  const AbsoluteError moving = compare(half, recording.eye, AlignmentMode::kSe3);
  const double scale = compare(half, recording.eye, AlignmentMode::kSim3).alignment.scale;
  bool ok = within("moving half: ATE [m]", moving.translation.rmse, kInertialBarM);
  std::printf("    largest %.4f m; turned by up to %.2f degrees\n", moving.translation.max, moving.rotation.max * 57.3);
  ok = within("whole: ATE [m]", all.translation.rmse, kInertialBarM) && ok;
  ok = within("moving half: |1 - scale|", std::abs(1 - scale), kScaleBar) && ok;
  std::printf("    whole: scale %.4f\n", compare(run.eye, recording.eye, AlignmentMode::kSim3).alignment.scale);
  ok = within("still half: largest from its mean [m]",
              largest_from_mean(part(run.eye, middle + from_seconds(0.25), recording.images.back().time_ns + 1)),
              kStillBarM) &&
       ok;
  print_times(run);
  print_counts(run);
  return ok;
}

void report_doubts(const Recording& recording) {
  const auto with = [&](const char* name, double late_s, const std::function<void(CameraCalibration&)>& change) {
    Fault out{name, recording.camera, late_s};
    change(out.camera);
    return out;
  };
  const auto nothing = [](CameraCalibration&) {};
  const std::vector<Fault> faults = {with("none", 0, nothing),
                                     with("f x 0.9", 0, [](CameraCalibration& c) { c.intrinsics_px.head<2>() *= 0.9; }),
                                     with("f x 1.1", 0, [](CameraCalibration& c) { c.intrinsics_px.head<2>() *= 1.1; }),
                                     with("cx + 20 px", 0, [](CameraCalibration& c) { c.intrinsics_px[2] += 20; }),
                                     with("cy + 20 px", 0, [](CameraCalibration& c) { c.intrinsics_px[3] += 20; }),
                                     with("k1 + 0.05", 0, [](CameraCalibration& c) { c.distortion[0] += 0.05; }),
                                     with("pictures 20 ms late", 0.02, nothing),
                                     with("pictures 50 ms early", -0.05, nothing),
                                     with("pictures 300 ms late", 0.3, nothing)};
  const TruthMotion motion(recording.body);
  const auto line = [](const char* who, const Run& run) {
    const auto says = [&](std::uint32_t bit) { return (run.status & bit) != 0 ? "doubtful" : "-"; };
    std::printf(
        "  %-9s intrinsics %-8s from %5.1f s; ln f %6.3f +- %.3f, cx %6.1f +- %.1f, cy %6.1f +- %.1f, k1 %6.3f +- "
        "%.3f;  stamps %-8s add %.1f +- %.1f ms\n",
        who, says(kCalibrationDoubtful), run.first_doubt_s, run.verdict.db[0], run.verdict.sigma[0], run.verdict.db[1],
        run.verdict.sigma[1], run.verdict.db[2], run.verdict.sigma[2], run.verdict.db[3], run.verdict.sigma[3],
        says(kStampsDoubtful), 1e3 * run.offset_s, 1e3 * run.sigma_s);
    std::fflush(stdout);
  };
  for (const Fault& fault : faults) {
    std::printf("%s\n", fault.name);
    if (fault.late_s == 0) line("alone", run_alone(recording, fault.camera));
    line("with IMU", run_inertial(recording, motion, 1, fault));
  }
}

int run(const std::string& what) {
  const std::filesystem::path folder = test::data_folder() / "euroc-mh01-images";
  if (!std::filesystem::exists(folder)) {
    std::printf("skipped: %s is absent; LIBLOC_DATA names the folder of the recordings\n", folder.c_str());
    return 0;
  }
  const Recording recording = read(folder);
  if (what == "doubts") {
    report_doubts(recording);
    return 0;
  }
  const int seeds = std::stoi(what);
  bool ok = report_alone(recording);
  for (int seed = 1; seed <= seeds; ++seed) ok = report_inertial(recording, static_cast<std::uint64_t>(seed)) && ok;
  return ok ? 0 : 1;
}

}  // namespace
}  // namespace loc

int main(int argc, char** argv) {
  try {
    return loc::run(argc > 1 ? argv[1] : "1");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "compare_images_euroc: %s\n", error.what());
    return 2;
  }
}
