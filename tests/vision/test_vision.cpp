// Pictures of the simulator as programs for images see them: corners and tags are found where they are projected.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <stdexcept>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/sim/calibration_target.hpp"
#include "libloc/sim/room.hpp"
#include "libloc/sim/scene_renderer.hpp"
#include "libloc/vision/feature_video.hpp"
#include "libloc/vision/image_file.hpp"
#include "libloc/vision/image_view.hpp"
#include "tests/support/camera_models.hpp"
#include "tests/support/temp_folder.hpp"
#ifdef LOC_APRILTAG
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#endif

namespace loc {
namespace {

using test::TempFolder;

/// The camera in front of a target, its image upright: target is x right, y up, z towards the camera.
Pose3 in_front(const Eigen::Vector3d& middle, double distance, const Eigen::Vector3d& turned) {
  const Eigen::Quaterniond upside(0, 1, 0, 0);  // x stays, y and z turn
  const Pose3 straight{upside, middle + Eigen::Vector3d(0, 0, distance)};
  return Pose3{so3::exp(turned), middle} * Pose3{Eigen::Quaterniond::Identity(), -middle} * straight;
}

/// Refines a corner from a start a pixel off: where it ends, less the truth [px]; nullopt when it is not in the image.
std::optional<Eigen::Vector2d> corner_error(const cv::Mat& image, const Camera& camera, const Pose3& T_world_camera,
                                            const ScenePoint& point, int window) {
  const auto truth = camera.project(T_world_camera.inverse() * point.position);
  if (!truth || !camera.in_image(*truth, window + 4)) return std::nullopt;
  std::vector<cv::Point2f> found{{static_cast<float>(truth->x() + 0.7), static_cast<float>(truth->y() - 0.7)}};
  const cv::TermCriteria end(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 50, 1e-4);
  cv::cornerSubPix(image, found, {window, window}, {-1, -1}, end);
  return Eigen::Vector2d(found[0].x, found[0].y) - *truth;
}

TEST(Renderer, CheckerboardCornersAreFoundWhereTheyAreProjected) {
  const Scene board = checkerboard({});
  const Eigen::Vector3d middle(0.16, 0.1, 0);
  for (const CameraCalibration& calibration : {test::radtan_camera(), test::fisheye_camera()}) {
    const Camera camera(calibration);
    const SceneRenderer renderer(board, calibration, {});
    int corners = 0;
    double worst = 0;
    double squares = 0;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (const Eigen::Vector3d& turned :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.5, 0.1, 0.2), Eigen::Vector3d(-0.3, -0.5, 0.8)}) {
      // Also towards the corners of the image, where distortion is strong.
      for (const Eigen::Vector3d& aside :
           {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.12, 0.08, 0), Eigen::Vector3d(-0.15, 0.1, 0)}) {
        Pose3 pose = in_front(middle, 0.42 * calibration.intrinsics_px[0] / 458.654, turned);
        pose.translation += aside;
        const ImageMeasurement image = renderer.render(pose);
        for (const ScenePoint& point : board.points) {
          const auto error = corner_error(view_of(image), camera, pose, point, 4);
          if (!error) continue;
          ++corners;
          worst = std::max(worst, error->norm());
          squares += error->squaredNorm();
          sum += *error;
        }
      }
    }
    EXPECT_GT(corners, 350);
    EXPECT_LT(worst, 0.1);
    EXPECT_LT(std::sqrt(squares / corners), 0.035);
    EXPECT_LT((sum / corners).norm(), 0.005);
  }
}

TEST(Renderer, FeaturesOfARoomAreCornersOfItsPictures) {
  const Scene room = box_room({}, Random(1));
  const Camera camera(test::radtan_camera());
  Eigen::Matrix3d R;  // along x, upright
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Pose3 pose{Eigen::Quaterniond(R), {-1, 0.3, 1.2}};
  const ImageMeasurement image = SceneRenderer(room, test::radtan_camera(), {}).render(pose);
  std::vector<double> errors;
  for (const ScenePoint& point : room.points) {
    const auto error = corner_error(view_of(image), camera, pose, point, 3);
    if (error) errors.push_back(error->norm());
  }
  ASSERT_GT(errors.size(), 60U);
  std::ranges::sort(errors);
  // A corner with one field of its own colour draws the search inwards; a shifted picture would be far worse.
  EXPECT_LT(errors[errors.size() / 2], 0.3);
}

#ifdef LOC_APRILTAG
TEST(Renderer, AprilTagsAreDetectedWithTheirNumbersAndCorners) {
  const Scene grid = april_grid({.first_tag = 100, .corner_squares = false});
  const Camera camera(test::radtan_camera());
  const Pose3 pose = in_front({0.33, 0.33, 0}, 0.95, {0.25, -0.2, 0.1});
  const ImageMeasurement image = SceneRenderer(grid, test::radtan_camera(), {}).render(pose);

  apriltag_family_t* family = tag36h11_create();
  apriltag_detector_t* detector = apriltag_detector_create();
  apriltag_detector_add_family(detector, family);
  detector->quad_decimate = 1;
  std::vector<std::uint8_t> bytes = *image.data;
  image_u8_t view{
      .width = image.width_px, .height = image.height_px, .stride = image.row_stride_bytes, .buf = bytes.data()};
  zarray_t* detections = apriltag_detector_detect(detector, &view);
  std::vector<int> found;
  for (int i = 0; i < zarray_size(detections); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(detections, i, static_cast<void*>(&detection));
    found.push_back(detection->id);
    EXPECT_EQ(detection->hamming, 0);
    ASSERT_TRUE(detection->id >= 100 && detection->id < 136);
    // Both count the corners from the lower left one, against the clock as one sees them.
    for (int k = 0; k < 4; ++k) {
      const std::size_t point = static_cast<std::size_t>(4 * (detection->id - 100) + k);
      const auto truth = camera.project(pose.inverse() * grid.points[point].position);
      // Its pixels begin at their corners, and its corners are those of straight lines.
      EXPECT_LT((Eigen::Vector2d(detection->p[k][0] - 0.5, detection->p[k][1] - 0.5) - *truth).norm(), 0.5);
    }
  }
  apriltag_detections_destroy(detections);
  apriltag_detector_destroy(detector);
  tag36h11_destroy(family);
  std::ranges::sort(found);
  ASSERT_EQ(found.size(), 36U);
  EXPECT_EQ(found.front(), 100);
  EXPECT_EQ(found.back(), 135);
}
#endif

ImageMeasurement sample_image(PixelFormat format) {
  const SceneRenderer renderer(april_grid({}), test::radtan_camera(), {.format = format});
  return renderer.render(in_front({0.33, 0.33, 0}, 0.8, {0.1, 0.2, 0}));
}

TEST(ImageFile, PngComesBackExactly) {
  const TempFolder folder;
  for (const PixelFormat format : {PixelFormat::kGray, PixelFormat::kBgr}) {
    const ImageMeasurement image = sample_image(format);
    write_image(folder.path() / "image.png", image);
    const ImageMeasurement back = read_image(folder.path() / "image.png", format);
    EXPECT_EQ(back.width_px, 752);
    EXPECT_EQ(back.height_px, 480);
    EXPECT_EQ(back.format, format);
    EXPECT_EQ(*back.data, *image.data);
  }
  // RGB is turned, not taken for BGR.
  ImageMeasurement red = sample_image(PixelFormat::kRgb);
  red.data = std::make_shared<std::vector<std::uint8_t>>([&] {
    std::vector<std::uint8_t> bytes(red.data->size());
    for (std::size_t i = 0; i < bytes.size(); i += 3) bytes[i] = 200;
    return bytes;
  }());
  write_image(folder.path() / "red.png", red);
  EXPECT_EQ(read_image(folder.path() / "red.png", PixelFormat::kBgr).data->at(2), 200);
}

TEST(ImageFile, ErrorsNameTheFile) {
  const TempFolder folder;
  const ImageMeasurement image = sample_image(PixelFormat::kGray);
  EXPECT_THROW(write_image(folder.path() / "nowhere" / "image.png", image), DataError);
  EXPECT_THROW(write_image(folder.path() / "image.xyz", image), DataError);
  EXPECT_THROW(read_image(folder.path() / "image.png"), DataError);
  EXPECT_THROW(read_image(folder.write("text.png", "no picture")), DataError);
  EXPECT_THROW(read_image(folder.path()), DataError);
  ImageMeasurement broken = image;
  broken.height_px += 1;
  EXPECT_THROW(write_image(folder.path() / "image.png", broken), std::invalid_argument);
  broken.data = nullptr;
  EXPECT_THROW(write_image(folder.path() / "image.png", broken), std::invalid_argument);
}

FeaturesMeasurement features_at(double step) {
  FeaturesMeasurement m;
  m.time_ns = 5;
  m.features = {{3, {100 + 10 * step, 200}}, {8, {400.25, 100 + 5 * step}}};
  return m;
}

TEST(FeatureVideo, DotsAreWhereTheFeaturesAreAndTailsWhereTheyWere) {
  FeaturePainter painter({.width_px = 752, .height_px = 480, .identities = false});
  painter.draw(features_at(0));
  ImageMeasurement frame = painter.draw(features_at(4));
  EXPECT_EQ(frame.time_ns, 5);
  const auto at = [&](int x, int y) { return view_of(frame).at<cv::Vec3b>(y, x); };
  EXPECT_EQ(at(140, 200), cv::Vec3b(0, 0, 0));
  EXPECT_EQ(at(400, 120), cv::Vec3b(0, 0, 0));
  EXPECT_LT(at(120, 200)[0], 200);
  EXPECT_LT(at(100, 200)[0], 200);
  EXPECT_EQ(at(120, 220), cv::Vec3b(255, 255, 255));
  // The middle of all that is dark is the pixel itself: nothing is shifted by half a pixel.
  cv::Mat gray;
  cv::cvtColor(view_of(frame)(cv::Rect(380, 112, 40, 20)), gray, cv::COLOR_BGR2GRAY);
  cv::Mat dark = gray < 100;
  const cv::Moments moments = cv::moments(dark, true);
  EXPECT_NEAR(380 + moments.m10 / moments.m00, 400.25, 0.3);
  EXPECT_NEAR(112 + moments.m01 / moments.m00, 120, 0.3);
  // Out of view, the way is forgotten.
  FeaturesMeasurement one = features_at(5);
  one.features.pop_back();
  painter.draw(one);
  frame = painter.draw(features_at(6));
  EXPECT_EQ(at(400, 115), cv::Vec3b(255, 255, 255));
  EXPECT_LT(at(120, 200)[0], 200);

  const ImageMeasurement picture = sample_image(PixelFormat::kGray);
  frame = painter.draw(features_at(6), &picture);
  EXPECT_EQ(at(700, 400)[0], view_of(picture).at<std::uint8_t>(400, 700));
  ImageMeasurement small = picture;
  small.height_px = 100;
  EXPECT_THROW(painter.draw(features_at(0), &small), std::invalid_argument);
  one.features[0].pixel_px.x() = std::nan("");
  EXPECT_THROW(painter.draw(one), std::invalid_argument);
}

TEST(FeatureVideo, FilesHoldEveryPicture) {
  const TempFolder folder;
  for (const char* name : {"out.avi", "out.mp4"}) {
    const auto path = folder.path() / name;
    FeatureVideo video(path, {.width_px = 320, .height_px = 240, .rate_hz = 20});
    FeaturePainter same({.width_px = 320, .height_px = 240, .rate_hz = 20});
    std::vector<ImageMeasurement> frames;
    for (int i = 0; i < 12; ++i) {
      FeaturesMeasurement m = features_at(i);
      m.features[1].pixel_px.x() -= 200;
      video.add(m);
      frames.push_back(same.draw(m));
    }
    video.finish();
    EXPECT_EQ(video.file().frames(), 12);
    cv::VideoCapture file(path.string());
    EXPECT_NEAR(file.get(cv::CAP_PROP_FPS), 20, 1e-6);
    // What was drawn; without loss in .avi.
    const double tolerance = std::string(name) == "out.avi" ? 0 : 6;
    for (const ImageMeasurement& frame : frames) {
      cv::Mat read;
      ASSERT_TRUE(file.read(read)) << name;
      EXPECT_LE(cv::norm(read, view_of(frame), cv::NORM_L1) / static_cast<double>(3 * read.total()), tolerance) << name;
    }
  }
}

TEST(FeatureVideo, ErrorsNameFileAndValue) {
  const TempFolder folder;
  EXPECT_THROW(VideoFile(folder.path() / "nowhere" / "out.mp4", 320, 240, 20), DataError);
  EXPECT_THROW(VideoFile(folder.path() / "out.webp", 320, 240, 20), DataError);
  EXPECT_THROW(VideoFile(folder.path() / "out.mp4", 321, 240, 20), std::invalid_argument);
  EXPECT_THROW(VideoFile(folder.path() / "out.mp4", 320, 240, 0), std::invalid_argument);
  EXPECT_THROW(FeatureVideo(folder.path() / "out.mp4", {.width_px = 320}), std::invalid_argument);
  // What was written goes missing before the end.
  VideoFile video(folder.path() / "out.mp4", 752, 480, 20);
  video.add(FeaturePainter({.width_px = 752, .height_px = 480}).draw(features_at(0)));
  EXPECT_THROW(video.add(FeaturePainter({.width_px = 750, .height_px = 480}).draw(features_at(0))),
               std::invalid_argument);
  std::filesystem::remove(folder.path() / "out.mp4");
  EXPECT_THROW(video.finish(), DataError);
}

}  // namespace
}  // namespace loc
