// Calibration targets in rendered pictures, whose corners are known, and in real ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "libloc/calib/camera_bundle.hpp"
#include "libloc/calib/camera_intrinsics.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/sim/calibration_target.hpp"
#include "libloc/sim/scene_renderer.hpp"
#include "libloc/vision/image_file.hpp"
#include "libloc/vision/image_view.hpp"
#include "libloc/vision/target_detector.hpp"
#include "tests/support/camera_models.hpp"

namespace loc {
namespace {

using test::fisheye_camera;
using test::in_front;
using test::radtan_camera;

const Eigen::Vector3d kMiddleOfGrid(0.33, 0.33, 0);
const Eigen::Vector3d kMiddleOfBoard(0.24, 0.15, 0);

CalibrationTarget grid_target() {
  return parse_target("aprilgrid 6x6 0.088 0.3");
}
CalibrationTarget board_target() {
  return parse_target("checkerboard 9x6 0.06");
}
Scene board_scene() {
  return checkerboard({.square_m = 0.06});
}

struct Errors {
  int corners = 0;
  double sum = 0;
  double worst = 0;

  void add(const TargetDetection& seen, const CalibrationTarget& target, const Camera& camera, const Pose3& pose) {
    for (const TargetCorner& corner : seen.view.corners) {
      const auto truth = camera.project(pose.inverse() * target.corner(corner.id));
      const double error = truth ? (corner.pixel_px - *truth).norm() : 1e9;
      ++corners;
      sum += error * error;
      worst = std::max(worst, error);
    }
  }
  double rms() const { return std::sqrt(sum / std::max(corners, 1)); }
};

Pose3 pose_of(int i, const Eigen::Vector3d& middle, double distance) {
  Pose3 pose = in_front(middle, distance, {0.45 * std::sin(i * 1.3), 0.5 * std::cos(i * 2.1), 0.3 * i});
  pose.translation += Eigen::Vector3d(0.1 * std::sin(i * 2.0), 0.08 * std::cos(i * 3.0), 0);
  return pose;
}

ImageMeasurement from(const cv::Mat& picture) {
  return image_of(picture, PixelFormat::kGray);
}

TEST(TargetDetector, CornersOfACheckerboardAreWhereTheyAreProjected) {
  for (const CameraCalibration& calibration : {radtan_camera(), fisheye_camera()}) {
    const Camera camera(calibration);
    const TargetDetector detector(board_target(), {});
    const SceneRenderer renderer(board_scene(), calibration, {.noise_sigma = 2});
    Random random(3);
    Errors errors;
    for (int i = 0; i < 5; ++i) {
      const Pose3 pose = pose_of(i, kMiddleOfBoard, 0.95 * calibration.intrinsics_px[0] / 458);
      const TargetDetection seen = detector.detect(renderer.render(pose, &random));
      EXPECT_EQ(seen.view.corners.size(), 54U) << seen.reason;
      errors.add(seen, board_target(), camera, pose);
    }
    RecordProperty("rms_px", std::to_string(errors.rms()));
    EXPECT_LT(errors.rms(), 0.05);
    EXPECT_LT(errors.worst, 0.15);
  }
}

TEST(TargetDetector, CornersOfAnAprilGridAreWhereTheyAreProjected) {
  if (!finds_april_grids()) GTEST_SKIP() << "built without the library apriltag";
  for (const CameraCalibration& calibration : {radtan_camera(), fisheye_camera()}) {
    const Camera camera(calibration);
    const TargetDetector detector(grid_target(), {});
    const SceneRenderer renderer(april_grid({}), calibration, {.noise_sigma = 2});
    Random random(3);
    Errors errors;
    for (int i = 0; i < 4; ++i) {
      const Pose3 pose = pose_of(i, kMiddleOfGrid, 0.95 * calibration.intrinsics_px[0] / 458);
      errors.add(detector.detect(renderer.render(pose, &random)), grid_target(), camera, pose);
    }
    RecordProperty("rms_px", std::to_string(errors.rms()));
    EXPECT_GT(errors.corners, 500);  // of 576, some of them beyond the image's border
    EXPECT_LT(errors.rms(), 0.1);
    EXPECT_LT(errors.worst, 0.5);
  }
}

TEST(TargetDetector, PartOfAnAprilGridIsEnough) {
  if (!finds_april_grids()) GTEST_SKIP() << "built without the library apriltag";
  const Camera camera(radtan_camera());
  const TargetDetector detector(grid_target(), {});
  const SceneRenderer renderer(april_grid({}), radtan_camera(), {});
  const Pose3 pose = in_front({0.05, 0.6, 0}, 0.6, {0.2, 0.3, 0.1});  // the upper left corner of the grid
  const ImageMeasurement image = renderer.render(pose);
  TargetDetection seen = detector.detect(image);
  Errors errors;
  errors.add(seen, grid_target(), camera, pose);
  EXPECT_GT(errors.corners, 40);
  EXPECT_LT(errors.corners, 100);
  EXPECT_LT(errors.worst, 0.3);
  EXPECT_TRUE(std::ranges::is_sorted(seen.view.corners, {}, &TargetCorner::id));
  // A hand over its middle: what remains is still numbered right.
  const SceneRenderer whole(april_grid({}), radtan_camera(), {});
  const Pose3 straight = in_front(kMiddleOfGrid, 0.95, {0, 0, 0});
  cv::Mat covered = view_of(whole.render(straight)).clone();
  cv::circle(covered, {380, 240}, 90, cv::Scalar(128), cv::FILLED);
  errors = {};
  errors.add(detector.detect(from(covered)), grid_target(), camera, straight);
  EXPECT_GT(errors.corners, 60);
  EXPECT_LT(errors.worst, 1);  // at its edge; other saddles are 5 px away
}

TEST(TargetDetector, OtherTagsAreNotTakenForTheGrid) {
  if (!finds_april_grids()) GTEST_SKIP() << "built without the library apriltag";
  // A board of the same family with other numbers, a single tag with a number of the grid, and both beside the grid.
  const Scene other = april_grid({.columns = 3, .rows = 3, .first_tag = 200, .corner_squares = false});
  const Scene single = april_grid({.columns = 1, .rows = 1, .first_tag = 7, .corner_squares = false});
  const Pose3 pose = in_front({0.45, 0.25, 0}, 1.3, {0.1, 0.1, 0});
  const TargetDetector detector(grid_target(), {});
  Scene scene;
  scene.add(other, {});
  scene.add(single, {Eigen::Quaterniond::Identity(), {0.6, 0.1, 0}});
  TargetDetection seen = detector.detect(SceneRenderer(scene, radtan_camera(), {}).render(pose));
  EXPECT_TRUE(seen.view.corners.empty());
  EXPECT_FALSE(seen.reason.empty());
  EXPECT_GT(seen.foreign_tags, 5);
  scene = {};
  scene.add(april_grid({.columns = 6, .rows = 6, .tag_m = 0.04}), {});
  scene.add(single, {Eigen::Quaterniond::Identity(), {0.6, 0.1, 0}});
  const CalibrationTarget small = parse_target("aprilgrid 6x6 0.04 0.3");
  Errors errors;
  errors.add(TargetDetector(small, {}).detect(
                 SceneRenderer(scene, radtan_camera(), {}).render(in_front({0.4, 0.2, 0}, 0.8, {0.1, 0.1, 0}))),
             small, Camera(radtan_camera()), in_front({0.4, 0.2, 0}, 0.8, {0.1, 0.1, 0}));
  EXPECT_GT(errors.corners, 100);
  EXPECT_LT(errors.worst, 0.5);
}

TEST(TargetDetector, NumbersOfACheckerboardDoNotDependOnHowItIsHeld) {
  const Camera camera(radtan_camera());
  const SceneRenderer renderer(board_scene(), radtan_camera(), {});
  const TargetDetector detector(board_target(), {});
  for (const double roll : {0.0, 1.0, 2.2, 3.1, 4.4, 5.5}) {
    const Pose3 pose = in_front(kMiddleOfBoard, 1.1, {0, 0, roll});
    Errors errors;
    errors.add(detector.detect(renderer.render(pose)), board_target(), camera, pose);
    EXPECT_EQ(errors.corners, 54) << roll;
    EXPECT_LT(errors.worst, 0.2) << roll;  // half a turn would be a hundred
  }
  // A mirrored picture of it is that of a board, one of an AprilGrid is not.
  cv::Mat mirrored;
  cv::flip(view_of(renderer.render(in_front(kMiddleOfBoard, 1.1, {0.3, 0.2, 0}))), mirrored, 1);
  const TargetDetection seen = detector.detect(from(mirrored));
  ASSERT_EQ(seen.view.corners.size(), 54U);
  const auto& c = seen.view.corners;
  const Eigen::Vector2d x = c[8].pixel_px - c[0].pixel_px;
  const Eigen::Vector2d y = c[45].pixel_px - c[0].pixel_px;
  EXPECT_LT(x.x() * y.y() - x.y() * y.x(), 0);
  if (!finds_april_grids()) return;
  cv::flip(view_of(SceneRenderer(april_grid({}), radtan_camera(), {}).render(in_front(kMiddleOfGrid, 0.95, {0, 0, 0}))),
           mirrored, 1);
  EXPECT_TRUE(TargetDetector(grid_target(), {}).detect(from(mirrored)).view.corners.empty());
}

TEST(TargetDetector, BlurredPicturesGiveFewerCornersNotWrongOnes) {
  const Camera camera(radtan_camera());
  const Pose3 pose = in_front(kMiddleOfBoard, 1.1, {0.2, 0.2, 0});
  std::vector<Pose3> shaken;  // 12 px along the exposure
  for (int i = 0; i < 9; ++i) {
    shaken.push_back(pose);
    shaken.back().translation.x() += (i - 4) * 0.0036;
  }
  Errors errors;
  const TargetDetection seen =
      TargetDetector(board_target(), {}).detect(SceneRenderer(board_scene(), radtan_camera(), {}).render(shaken));
  errors.add(seen, board_target(), camera, pose);
  EXPECT_LT(errors.worst, 1.5);
  EXPECT_TRUE(!seen.view.corners.empty() || !seen.reason.empty());
}

TEST(TargetDetector, AnyPictureIsSearchedWithoutHarm) {
  std::vector<TargetDetector> detectors;
  detectors.emplace_back(board_target(), TargetDetectorOptions{.thorough = false});
  if (finds_april_grids()) detectors.emplace_back(grid_target(), TargetDetectorOptions{});
  cv::RNG noise(1);
  for (const auto& [width, height] : std::vector<std::pair<int, int>>{{1, 1}, {5, 300}, {24, 24}, {320, 240}}) {
    cv::Mat random(height, width, CV_8U);
    noise.fill(random, cv::RNG::UNIFORM, 0, 256);
    cv::Mat stripes(height, width, CV_8U);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) stripes.at<std::uint8_t>(y, x) = (x / 3 + y / 3) % 2 == 0 ? 255 : 0;
    }
    for (const cv::Mat& picture : {random, stripes, cv::Mat(height, width, CV_8U, cv::Scalar(0)),
                                   cv::Mat(height, width, CV_8U, cv::Scalar(255))}) {
      for (const TargetDetector& detector : detectors) {
        const TargetDetection seen = detector.detect(from(picture));
        EXPECT_TRUE(seen.view.corners.empty());
        EXPECT_FALSE(seen.reason.empty());
      }
    }
  }
  ImageMeasurement broken = from(cv::Mat(100, 100, CV_8U, cv::Scalar(0)));
  broken.height_px = 200;
  EXPECT_THROW(detectors[0].detect(broken), std::invalid_argument);
  EXPECT_THROW(TargetDetector(board_target(), {.min_contrast = 0}), std::invalid_argument);
  CalibrationTarget wrong = board_target();
  wrong.size_m = 0;
  EXPECT_THROW(TargetDetector(wrong, {}), std::invalid_argument);
}

TEST(TargetDetector, LargeAndColouredPictures) {
  const Pose3 pose = in_front(kMiddleOfBoard, 1.1, {0.2, 0.2, 0});
  CameraCalibration large = radtan_camera();
  large.width_px = 1504;  // more than is searched at once
  large.height_px = 960;
  large.intrinsics_px *= 2;
  Errors errors;
  const SceneRenderer renderer(board_scene(), large, {.format = PixelFormat::kBgr});
  errors.add(TargetDetector(board_target(), {}).detect(renderer.render(pose)), board_target(), Camera(large), pose);
  EXPECT_EQ(errors.corners, 54);
  EXPECT_LT(errors.rms(), 0.15);
}

// What is searched in live video is half of a picture of this size, where squares have 6 px.
TEST(TargetDetector, SmallSquaresAreFoundInLiveVideo) {
  const Camera camera(radtan_camera());
  const TargetDetector detector(board_target(), {.thorough = false});
  const SceneRenderer renderer(board_scene(), radtan_camera(), {.noise_sigma = 2});
  Random random(5);
  Errors errors;
  for (int i = 0; i < 5; ++i) {
    const Pose3 pose = pose_of(i, kMiddleOfBoard, 2.1);
    const TargetDetection seen = detector.detect(renderer.render(pose, &random));
    EXPECT_EQ(seen.view.corners.size(), 54U) << seen.reason;
    errors.add(seen, board_target(), camera, pose);
  }
  EXPECT_LT(errors.rms(), 0.15);
}

std::filesystem::path opencv_pictures() {
  if (const char* folder = std::getenv("LIBLOC_OPENCV_DOC"); folder != nullptr && *folder != 0) return folder;
  return "/usr/share/doc/opencv-doc/examples/data";
}

// 13 pictures each of a left and a right camera, from detection to the camera; the corners' own solution by OpenCV.
TEST(TargetDetector, RealCheckerboardsGiveTheCameraThatOpenCvFinds) {
  if (!std::filesystem::exists(opencv_pictures() / "left01.jpg")) {
    GTEST_SKIP() << opencv_pictures().string()
                 << " has no left01.jpg (Debian: opencv-doc); LIBLOC_OPENCV_DOC names the folder";
  }
  const CalibrationTarget target = parse_target("checkerboard 9x6 0.025");
  const TargetDetector detector(target, {});
  for (const std::string side : {"left", "right"}) {
    std::vector<TargetView> views;
    std::vector<std::vector<cv::Point3f>> points;
    std::vector<std::vector<cv::Point2f>> pixels;
    for (int i = 1; i <= 14; ++i) {
      const auto path = opencv_pictures() / (side + (i < 10 ? "0" : "") + std::to_string(i) + ".jpg");
      if (!std::filesystem::exists(path)) continue;  // there is no 10
      const TargetDetection seen = detector.detect(read_image(path));
      EXPECT_EQ(seen.view.corners.size(), 54U) << path << ": " << seen.reason;
      views.push_back(seen.view);
      points.emplace_back();
      pixels.emplace_back();
      for (const TargetCorner& corner : seen.view.corners) {
        const Eigen::Vector3d p = target.corner(corner.id);
        points.back().emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), 0.0F);
        pixels.back().emplace_back(static_cast<float>(corner.pixel_px.x()), static_cast<float>(corner.pixel_px.y()));
      }
    }
    ASSERT_EQ(views.size(), 13U);
    const CameraFit fit = calibrate_camera(target, views, 640, 480, {});
    cv::Mat K;
    cv::Mat D;
    std::vector<cv::Mat> R;
    std::vector<cv::Mat> t;
    const double rms = cv::calibrateCamera(points, pixels, {640, 480}, K, D, R, t, cv::CALIB_FIX_K3);
    EXPECT_NEAR(fit.rms_px, rms, 1e-5);
    EXPECT_LT(fit.rms_px, 0.22);
    EXPECT_NEAR(fit.camera.intrinsics_px[0], K.at<double>(0, 0), 0.01);
    EXPECT_NEAR(fit.camera.intrinsics_px[1], K.at<double>(1, 1), 0.01);
    EXPECT_NEAR(fit.camera.intrinsics_px[2], K.at<double>(0, 2), 0.01);
    EXPECT_NEAR(fit.camera.intrinsics_px[3], K.at<double>(1, 2), 0.01);
    for (int k = 0; k < 4; ++k) EXPECT_NEAR(fit.camera.distortion[k], D.at<double>(k), 1e-4);
    RecordProperty(side + "_rms_px", std::to_string(fit.rms_px));
    RecordProperty(side + "_fx_px", std::to_string(fit.camera.intrinsics_px[0]));
  }
}

// The whole way: pictures of a known camera, detection, calibration.
TEST(TargetDetector, RenderedPicturesGiveTheirCamera) {
  for (const CameraCalibration& truth : {radtan_camera(), fisheye_camera()}) {
    const bool grid = truth.distortion_model == DistortionModel::kEquidistant && finds_april_grids();
    const CalibrationTarget target = grid ? grid_target() : board_target();
    const SceneRenderer renderer(grid ? april_grid({}) : board_scene(), truth, {.noise_sigma = 2});
    const TargetDetector detector(target, {});
    Random random(11);
    std::vector<TargetView> views;
    for (int i = 0; i < 14; ++i) {
      Pose3 pose = pose_of(i, grid ? kMiddleOfGrid : kMiddleOfBoard, grid ? 0.4 : 0.8);
      pose.translation += Eigen::Vector3d(0.12 * std::sin(i * 2.6), 0.1 * std::cos(i * 1.9), 0);
      views.push_back(detector.detect(renderer.render(pose, &random)).view);
    }
    CameraFitOptions options;
    options.model = truth.distortion_model;
    const CameraFit fit = calibrate_camera(target, views, 752, 480, options);
    EXPECT_TRUE(fit.converged);
    EXPECT_GE(fit.views_used, 10);
    EXPECT_LT(fit.rms_px, 0.12);
    const Vector8d sigma = fit.covariance.diagonal().cwiseSqrt();
    const Vector8d error =
        calib::parameters_of(fit.camera) - (Vector8d() << truth.intrinsics_px, truth.distortion).finished();
    for (int i = 0; i < 8; ++i) EXPECT_LT(std::abs(error[i]), 5 * sigma[i]) << i;
    EXPECT_LT(error.head<4>().norm(), 1);
  }
}

}  // namespace
}  // namespace loc
