// Images: time to find a calibration target in a picture (752 x 480), and to calibrate a camera; OpenCV's own searches
// and solvers on the same input beside them. Counters: corners found, their rms error [px], rms residual [px].
// Front end and SLAM from pictures of a rendered room (752 x 480, 100 tracks, 20 Hz): one iteration is one picture.
// Counters: median and 99th percentile of a picture's parts [ms], tracks in a picture, and the rms distance of the
// tracks from the projection of the point where they began [px]. OpenCV's chain beside it: goodFeaturesToTrack and
// pyramidal Lucas-Kanade there and back with the same number of points.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "libloc/calib/camera_intrinsics.hpp"
#include "libloc/core/random.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/sim/calibration_target.hpp"
#include "libloc/sim/scene_renderer.hpp"
#include "libloc/vision/image_slam.hpp"
#include "libloc/vision/image_view.hpp"
#include "libloc/vision/target_detector.hpp"
#include "support/camera_models.hpp"
#include "support/rendered_ride.hpp"

namespace {

using loc::CalibrationTarget;
using loc::ImageMeasurement;
using loc::Pose3;

const CalibrationTarget kBoard = loc::parse_target("checkerboard 9x6 0.06");
const CalibrationTarget kGrid = loc::parse_target("aprilgrid 6x6 0.088 0.3");

struct Pictures {
  std::vector<ImageMeasurement> images;
  std::vector<Pose3> poses;
};

Pictures render(const CalibrationTarget& target, double distance) {
  const bool grid = target.kind == loc::TargetKind::kAprilGrid;
  const loc::Scene scene = grid ? loc::april_grid({}) : loc::checkerboard({.square_m = 0.06});
  const loc::SceneRenderer renderer(scene, loc::test::radtan_camera(), {.noise_sigma = 2});
  const Eigen::Vector3d middle = target.corner(target.corner_count() - 1) / 2;
  loc::Random random(1);
  Pictures out;
  for (int i = 0; i < 4; ++i) {
    out.poses.push_back(
        loc::test::in_front(middle, distance, {0.45 * std::sin(i * 1.3), 0.5 * std::cos(i * 2.1), 0.3 * i}));
    out.images.push_back(renderer.render(out.poses.back(), &random));
  }
  return out;
}

void detect(benchmark::State& state, const CalibrationTarget& target, double distance) {
  cv::setNumThreads(1);
  const Pictures pictures = render(target, distance);
  const loc::TargetDetector detector(target, {});
  const loc::Camera camera(loc::test::radtan_camera());
  double corners = 0;
  double squares = 0;
  for (std::size_t i = 0; i < pictures.images.size(); ++i) {
    for (const loc::TargetCorner& corner : detector.detect(pictures.images[i]).view.corners) {
      const auto truth = camera.project(pictures.poses[i].inverse() * target.corner(corner.id));
      squares += (corner.pixel_px - *truth).squaredNorm();
      ++corners;
    }
  }
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(detector.detect(pictures.images[next++ % pictures.images.size()]));
  }
  state.counters["corners"] = corners / static_cast<double>(pictures.images.size());
  state.counters["error_px"] = std::sqrt(squares / std::max(corners, 1.0));
}

void find_checkerboard(benchmark::State& state) {
  detect(state, kBoard, 0.95);
}
void find_far_checkerboard(benchmark::State& state) {
  detect(state, kBoard, 2);
}
void find_april_grid(benchmark::State& state) {
  detect(state, kGrid, 0.95);
}
void find_near_april_grid(benchmark::State& state) {
  detect(state, kGrid, 0.6);
}
void find_far_april_grid(benchmark::State& state) {
  detect(state, kGrid, 1.6);
}

void search_other_picture(benchmark::State& state) {
  cv::setNumThreads(1);
  const Pictures pictures = render(state.range(0) == 0 ? kGrid : kBoard, 0.95);
  const loc::TargetDetector detector(state.range(0) == 0 ? kBoard : kGrid, {});
  for (auto _ : state) benchmark::DoNotOptimize(detector.detect(pictures.images[0]));
}

/// OpenCV's searches with the refinement that its tutorials recommend.
void opencv_checkerboard(benchmark::State& state) {
  cv::setNumThreads(1);
  const Pictures pictures = render(kBoard, 0.95);
  const bool sectors = state.range(0) == 1;
  const loc::Camera camera(loc::test::radtan_camera());
  std::size_t next = 0;
  double squares = 0;
  double corners = 0;
  for (auto _ : state) {
    const std::size_t i = next++ % pictures.images.size();
    const cv::Mat gray = loc::view_of(pictures.images[i]);
    std::vector<cv::Point2f> found;
    if (sectors) {
      cv::findChessboardCornersSB(gray, {9, 6}, found, cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_ACCURACY);
    } else {
      cv::findChessboardCorners(gray, {9, 6}, found);
      cv::cornerSubPix(gray, found, {5, 5}, {-1, -1},
                       cv::TermCriteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 30, 0.001));
    }
    state.PauseTiming();
    for (const cv::Point2f& p : found) {  // numbered in its own way: the nearest corner
      double nearest = 1e9;
      for (int id = 0; id < kBoard.corner_count(); ++id) {
        const auto truth = camera.project(pictures.poses[i].inverse() * kBoard.corner(id));
        nearest = std::min(nearest, (Eigen::Vector2d(p.x, p.y) - *truth).squaredNorm());
      }
      squares += nearest;
      ++corners;
    }
    state.ResumeTiming();
  }
  state.counters["error_px"] = std::sqrt(squares / std::max(corners, 1.0));
}

std::vector<loc::TargetView> fifty_views(const loc::CameraCalibration& calibration) {
  const loc::Camera camera(calibration);
  loc::Random random(5);
  std::vector<loc::TargetView> views(50);
  for (loc::TargetView& view : views) {
    const Eigen::Vector3d turned(random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6));
    Pose3 pose = loc::test::in_front({0.24, 0.15, 0}, 0.7, turned);
    pose.translation += Eigen::Vector3d(random.uniform(-0.1, 0.1), random.uniform(-0.06, 0.06), 0);
    for (int id = 0; id < kBoard.corner_count(); ++id) {
      const auto pixel = camera.project(pose.inverse() * kBoard.corner(id));
      if (!pixel || !camera.in_image(*pixel)) continue;
      view.corners.push_back({id, *pixel + 0.1 * Eigen::Vector2d(random.normal(), random.normal())});
    }
  }
  return views;
}

loc::CameraCalibration lens(std::int64_t fisheye) {
  return fisheye != 0 ? loc::test::fisheye_camera() : loc::test::radtan_camera();
}

/// Argument: 0 radtan, 1 equidistant. With outlier search, covariance and verdict.
void calibrate(benchmark::State& state) {
  const loc::CameraCalibration truth = lens(state.range(0));
  const auto views = fifty_views(truth);
  loc::CameraFitOptions options;
  options.model = truth.distortion_model;
  options.compare_models = false;
  loc::CameraFit fit;
  for (auto _ : state) fit = loc::calibrate_camera(kBoard, views, 752, 480, options);
  state.counters["rms_px"] = fit.rms_px;
}

void opencv_calibrate(benchmark::State& state) {
  cv::setNumThreads(1);
  const loc::CameraCalibration truth = lens(state.range(0));
  std::vector<std::vector<cv::Point3f>> points;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const loc::TargetView& view : fifty_views(truth)) {
    points.emplace_back();
    pixels.emplace_back();
    for (const loc::TargetCorner& corner : view.corners) {
      const Eigen::Vector3f p = kBoard.corner(corner.id).cast<float>();
      points.back().emplace_back(p.x(), p.y(), p.z());
      pixels.back().emplace_back(static_cast<float>(corner.pixel_px.x()), static_cast<float>(corner.pixel_px.y()));
    }
  }
  double rms = 0;
  for (auto _ : state) {
    cv::Mat K;
    cv::Mat D;
    std::vector<cv::Mat> R;
    std::vector<cv::Mat> t;
    if (state.range(0) == 0) {
      rms = cv::calibrateCamera(points, pixels, {752, 480}, K, D, R, t, cv::CALIB_FIX_K3);
    } else {
      rms = cv::fisheye::calibrate(points, pixels, {752, 480}, K, D, R, t,
                                   cv::fisheye::CALIB_RECOMPUTE_EXTRINSIC | cv::fisheye::CALIB_FIX_SKEW);
    }
  }
  state.counters["rms_px"] = rms;
}

// Front end

constexpr int kRide = 200;  // pictures; the first ones are not measured
constexpr int kWarmUp = 20;
constexpr int kTracks = 100;

struct RoomPicture {
  ImageMeasurement image;
  Pose3 pose;
};
const std::vector<RoomPicture>& room_ride() {
  static const std::vector<RoomPicture> kPictures = [] {
    std::vector<RoomPicture> out;
    loc::test::RoomCamera room(loc::test::radtan_camera(), 2);
    for (int i = 0; i < kRide; ++i) {
      const Pose3 pose = loc::test::swaying(0.05 * i);
      out.push_back({room.at(pose, i * loc::TimeNs{50'000'000}), pose});
    }
    return out;
  }();
  return kPictures;
}

/// Distances of tracks from the projections of the points where they began.
class TrackErrors {
 public:
  void add(std::int64_t id, const Eigen::Vector2d& pixel_px, const Pose3& pose) {
    if (const auto found = began_.find(id); found != began_.end()) {
      const auto truth = camera_.project(pose.inverse() * found->second);
      if (!truth) return;
      squares_ += (pixel_px - *truth).squaredNorm();
      ++count_;
    } else if (const auto ray = camera_.unproject(pixel_px)) {
      began_[id] = loc::test::on_wall(pose, *ray);
    }
  }
  double rms() const { return std::sqrt(squares_ / std::max(count_, 1.0)); }

 private:
  loc::Camera camera_{loc::test::radtan_camera()};
  std::map<std::int64_t, Eigen::Vector3d> began_;
  double squares_ = 0;
  double count_ = 0;
};

void put_quantiles(benchmark::State& state, const std::string& name, const std::vector<double>& seconds) {
  if (seconds.empty()) return;
  state.counters[name + "_median"] = 1e3 * loc::quantile(seconds, 0.5);
  state.counters[name + "_p99"] = 1e3 * loc::quantile(seconds, 0.99);
}

struct Parts {
  std::vector<double> pyramid, search, klt, detect, front, filter, whole;

  void add(const loc::FeatureTrackerTimes& times) {
    pyramid.push_back(times.pyramid_s);
    search.push_back(times.search_s);
    klt.push_back(times.klt_s);
    detect.push_back(times.detect_s);
    front.push_back(times.total_s);
  }
  void put(benchmark::State& state) const {
    put_quantiles(state, "pyramid", pyramid);
    put_quantiles(state, "search", search);
    put_quantiles(state, "klt", klt);
    put_quantiles(state, "detect", detect);
    put_quantiles(state, "front", front);
    put_quantiles(state, "filter", filter);
    put_quantiles(state, "whole", whole);
  }
};

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// The tracker alone, without expectations.
void track_features(benchmark::State& state) {
  cv::setNumThreads(1);
  const auto& pictures = room_ride();
  loc::FeatureTracker tracker(loc::test::radtan_camera(), {.max_tracks = kTracks});
  Parts parts;
  TrackErrors errors;
  double tracks = 0;
  std::size_t next = 0;
  for (auto _ : state) {
    const RoomPicture& one = pictures[next % pictures.size()];
    const auto& features = tracker.track(one.image);
    state.PauseTiming();
    if (next < pictures.size()) {  // then the ride jumps back to its beginning
      for (const auto& f : features.features) errors.add(f.id, f.pixel_px, one.pose);
    }
    if (next++ >= kWarmUp) parts.add(tracker.times());
    tracks += static_cast<double>(features.features.size());
    if (next % pictures.size() == 0) tracker.reset();
    state.ResumeTiming();
  }
  parts.put(state);
  state.counters["tracks"] = tracks / static_cast<double>(next);
  state.counters["error_px"] = errors.rms();
}

/// With the filter, which tells where to look.
template <class Slam>
void slam_from_pictures(benchmark::State& state) {
  cv::setNumThreads(1);
  const auto& pictures = room_ride();
  loc::SlamOptions options;
  options.camera = loc::test::radtan_camera();
  if (std::is_same_v<Slam, loc::InertialSlam>) {
    options.motion = loc::SlamMotion::kInertial;
    options.imu_sampling = loc::ImuSampling::kPoint;
  }
  loc::ImageSlam<Slam> slam(loc::slam_options_for_images(options), {.max_tracks = kTracks});
  Parts parts;
  double tracks = 0;
  std::size_t next = 0;
  // A frame is done with the sample after it.
  const auto keep_filter_times = [&] {
    if constexpr (std::is_same_v<Slam, loc::MonoSlam>) {
      parts.filter.push_back(slam.slam().frame().time_spent_s);
    } else {
      for (const loc::SlamFrame& frame : slam.slam().frames()) parts.filter.push_back(frame.time_spent_s);
    }
  };
  for (auto _ : state) {
    const std::size_t i = next % pictures.size();
    double seconds = 0;
    if (std::is_same_v<Slam, loc::InertialSlam>) {
      // Samples of the 50 ms before, by central differences of the ride.
      for (int k = 9; k >= 0; --k) {
        state.PauseTiming();
        const loc::ImuMeasurement sample =
            loc::test::imu_of(loc::test::swaying, 0.05 * static_cast<double>(i) - 0.005 * k);
        state.ResumeTiming();
        const auto begin = std::chrono::steady_clock::now();
        slam.process(sample);
        seconds += seconds_since(begin);
        keep_filter_times();
      }
    }
    const auto begin = std::chrono::steady_clock::now();
    slam.process(pictures[i].image);
    seconds += seconds_since(begin);
    state.PauseTiming();
    tracks += static_cast<double>(slam.features().features.size());
    if (next++ >= kWarmUp) {
      parts.add(slam.tracker().times());
      parts.whole.push_back(seconds);
      keep_filter_times();
    }
    if (next % pictures.size() == 0) slam.reset();
    state.ResumeTiming();
  }
  parts.put(state);
  state.counters["tracks"] = tracks / static_cast<double>(next);
}

/// As OpenCV's own example tracks: corners when there are fewer than there should be, Lucas-Kanade there and back.
void opencv_track_features(benchmark::State& state) {
  cv::setNumThreads(1);
  const auto& pictures = room_ride();
  const cv::Size window(21, 21);
  const cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 20, 0.03);
  std::vector<cv::Point2f> points;
  std::vector<std::int64_t> ids;
  std::int64_t next_id = 0;
  std::vector<double> seconds;
  TrackErrors errors;
  double tracks = 0;
  std::size_t next = 0;
  cv::Mat before;
  for (auto _ : state) {
    const RoomPicture& one = pictures[next % pictures.size()];
    const auto begin = std::chrono::steady_clock::now();
    const cv::Mat now = loc::view_of(one.image);
    if (!points.empty()) {
      std::vector<cv::Point2f> there;
      std::vector<cv::Point2f> back;
      std::vector<std::uint8_t> found;
      std::vector<std::uint8_t> found_back;
      std::vector<float> error;
      cv::calcOpticalFlowPyrLK(before, now, points, there, found, error, window, 3, until);
      cv::calcOpticalFlowPyrLK(now, before, there, back, found_back, error, window, 3, until);
      std::size_t kept = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (found[i] == 0 || found_back[i] == 0 || cv::norm(back[i] - points[i]) > 0.5) continue;
        points[kept] = there[i];
        ids[kept++] = ids[i];
      }
      points.resize(kept);
      ids.resize(kept);
    }
    if (points.size() < kTracks) {
      cv::Mat free(now.size(), CV_8U, cv::Scalar(255));
      for (const cv::Point2f& p : points) cv::circle(free, p, 14, cv::Scalar(0), cv::FILLED);
      std::vector<cv::Point2f> fresh;
      cv::goodFeaturesToTrack(now, fresh, kTracks - static_cast<int>(points.size()), 0.01, 14, free);
      for (const cv::Point2f& p : fresh) {
        points.push_back(p);
        ids.push_back(next_id++);
      }
    }
    before = now;
    if (next >= kWarmUp) seconds.push_back(seconds_since(begin));
    state.PauseTiming();
    if (next < pictures.size()) {
      for (std::size_t i = 0; i < points.size(); ++i) errors.add(ids[i], {points[i].x, points[i].y}, one.pose);
    }
    tracks += static_cast<double>(points.size());
    if (++next % pictures.size() == 0) {
      points.clear();
      ids.clear();
    }
    state.ResumeTiming();
  }
  put_quantiles(state, "front", seconds);
  state.counters["tracks"] = tracks / static_cast<double>(next);
  state.counters["error_px"] = errors.rms();
}

BENCHMARK(track_features)->Iterations(kRide)->Unit(benchmark::kMillisecond);
BENCHMARK(opencv_track_features)->Iterations(kRide)->Unit(benchmark::kMillisecond);
BENCHMARK(slam_from_pictures<loc::MonoSlam>)->Iterations(kRide)->Unit(benchmark::kMillisecond);
BENCHMARK(slam_from_pictures<loc::InertialSlam>)->Iterations(kRide)->Unit(benchmark::kMillisecond);
BENCHMARK(find_checkerboard)->Unit(benchmark::kMillisecond);
BENCHMARK(find_far_checkerboard)->Unit(benchmark::kMillisecond);
BENCHMARK(opencv_checkerboard)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(find_near_april_grid)->Unit(benchmark::kMillisecond);
BENCHMARK(find_april_grid)->Unit(benchmark::kMillisecond);
BENCHMARK(find_far_april_grid)->Unit(benchmark::kMillisecond);
BENCHMARK(search_other_picture)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(calibrate)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(opencv_calibrate)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
