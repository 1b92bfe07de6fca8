// Images: time to find a calibration target in a picture (752 x 480), and to calibrate a camera; OpenCV's own searches
// and solvers on the same input beside them. Counters: corners found, their rms error [px], rms residual [px].
#include <benchmark/benchmark.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "libloc/calib/camera_intrinsics.hpp"
#include "libloc/core/random.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/sim/calibration_target.hpp"
#include "libloc/sim/scene_renderer.hpp"
#include "libloc/vision/image_view.hpp"
#include "libloc/vision/target_detector.hpp"
#include "support/camera_models.hpp"

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
