// The 3-D viewer: from where it looks, what it makes of messages, that things are drawn where they belong (pixels of
// pictures drawn without a display), and the program itself.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <numbers>

#include "libloc/core/check.hpp"
#include "libloc/io/lcm_log.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "libloc/vision/image_codec.hpp"
#include "libloc/vision/image_file.hpp"
#include "loc/estimator_status_t.hpp"
#include "msgs/slam_messages.hpp"
#include "program_test.hpp"
#include "support/camera_models.hpp"
#include "support/lcm_messages.hpp"
#include "tools/support/lcm_link.hpp"
#include "tools/support/scene3d_drawing.hpp"
#include "tools/support/scene3d_recorder.hpp"

namespace loc::test {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr TimeNs kStart = 1000 * kSecond;
const Eigen::Vector3i kBlue(31, 90, 200);
const Eigen::Vector3i kRed(220, 30, 30);
const Eigen::Vector3i kGreen(30, 150, 60);
const Eigen::Vector3i kOrange(240, 140, 0);
const Eigen::Vector3i kMagenta(170, 30, 150);

// Red, green, blue.
Eigen::Vector3i colour_at(const ImageMeasurement& image, int x, int y) {
  const std::uint8_t* p = image.data->data() + static_cast<std::ptrdiff_t>(y) * image.row_stride_bytes + 3 * x;
  return {p[2], p[1], p[0]};
}

// Of the nine pixels around.
bool has_colour(const ImageMeasurement& image, const Eigen::Vector2d& at, const Eigen::Vector3i& colour) {
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      const Eigen::Vector3i found =
          colour_at(image, static_cast<int>(std::lround(at.x())) + x, static_cast<int>(std::lround(at.y())) + y);
      if ((found - colour).cwiseAbs().maxCoeff() <= 3) return true;
    }
  }
  return false;
}

SceneEye from_above(double distance) {
  return {.target = {0, 0, 0}, .distance = distance, .azimuth_deg = -90, .elevation_deg = 90};
}

ImageMeasurement drawn(const Scene3d& scene, const SceneEye& eye) {
  SceneDrawing drawing;
  drawing.show(scene, eye, kWidth, kHeight);
  return SceneCamera3d(kWidth, kHeight).take(drawing);
}

// How far a colour reaches in the axes of world, seen from above, below the text.
struct Extent {
  double least = 1e9;
  double most = -1e9;
};
Extent reach(const ImageMeasurement& image, const SceneEye& eye, int axis, const auto& is_colour) {
  const double per_px = 2 * eye.distance * std::tan(kEyeFieldOfViewDeg / 2 * std::numbers::pi / 180) / kHeight;
  Extent out;
  constexpr int kText = 160;
  for (int y = kText; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (!is_colour(colour_at(image, x, y))) continue;
      const double at = axis == 0 ? (x - (kWidth - 1) / 2.0) * per_px : ((kHeight - 1) / 2.0 - y) * per_px;
      out.least = std::min(out.least, at);
      out.most = std::max(out.most, at);
    }
  }
  return out;
}
bool is_magenta(const Eigen::Vector3i& c) {
  return c.y() < c.x() - 15 && c.y() < c.z() - 15;
}

TEST(Scene3d, FramesWhatThereIs) {
  Scene3d scene;
  for (int i = 0; i <= 20; ++i) scene.trajectory.push_back({i, {100 + 3.0 * i, -40.0 + i % 7, 0.1 * i}});
  scene.gps.emplace_back(150, -60, 2);
  scene.points.push_back({1, {130, -20, 3}, 0.01 * Eigen::Matrix3d::Identity(), false, {}});
  scene.points.push_back({2, {900, 900, 3}, 1e6 * Eigen::Matrix3d::Identity(), false, {}});  // nobody knows where
  scene.picture.emplace();
  scene.picture->width_px = 752;
  scene.picture->height_px = 480;
  for (const ViewMode mode : {ViewMode::kFree, ViewMode::kTop}) {
    SceneView view;
    view.mode = mode;
    const SceneEye eye = place_eye(scene, view, 1.6);
    double widest = 0;
    for (const Eigen::Vector3d& p : {scene.trajectory.front().position, scene.trajectory.back().position,
                                     scene.gps.front(), scene.points.front().position}) {
      const auto pixel = project(eye, p, 1280, 800);
      ASSERT_TRUE(pixel);
      EXPECT_TRUE(pixel->x() > 0 && pixel->x() < 1280 && pixel->y() > 0 && pixel->y() < 800) << pixel->transpose();
      // Not behind the picture.
      EXPECT_TRUE(pixel->x() < 1280 * (1 - kPictureShare) || pixel->y() < 800 - 1280 * kPictureShare * 480 / 752);
      widest = std::max(widest, std::abs(pixel->x() - 640) / 640);
    }
    EXPECT_GT(widest, 0.5);
    const auto far_one = project(eye, scene.points.back().position, 1280, 800);
    EXPECT_TRUE(!far_one || far_one->x() > 1280 || far_one->y() < 0) << "it need not be in the picture";
  }
  SceneView wrong;
  wrong.zoom = 0;
  EXPECT_THROW(place_eye(scene, wrong, 1.6), std::invalid_argument);
}

TEST(Scene3d, LooksFromBehindTheCamera) {
  Scene3d scene;
  Eigen::Matrix3d R;  // looks along y
  R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  scene.camera = SceneCamera{{Eigen::Quaterniond(R), {5, 6, 7}}};
  SceneView view;
  view.mode = ViewMode::kFollow;
  const SceneEye eye = place_eye(scene, view, 1.6);
  EXPECT_LT(eye.position().y(), 6);
  EXPECT_GT(eye.position().z(), 7);
  const auto camera = project(eye, {5, 6, 7}, 1280, 800);
  const auto ahead = project(eye, {5, 8, 7}, 1280, 800);
  ASSERT_TRUE(camera && ahead);
  EXPECT_NEAR(camera->x(), ahead->x(), 1e-6);
  EXPECT_LT(ahead->y(), camera->y());
}

TEST(Scene3d, DrawsThingsWhereTheyAre) {
  Scene3d scene;
  for (int i = 0; i <= 10; ++i) scene.trajectory.push_back({i, {0.4 * i, 0, 1}, i == 8, i >= 8});
  scene.reference = {{0, {-3, 1, 0}}, {1, {-3, 2, 0}}};
  scene.gps = {{-2, -1.5, 0.5}};
  scene.points.push_back({1, {2, 2, 2}, 1e-4 * Eigen::Matrix3d::Identity(), true, {}});
  scene.metric = false;
  const SceneEye eye{.target = {0.5, 0, 0.5}, .distance = 14, .azimuth_deg = -50, .elevation_deg = 35};
  const ImageMeasurement image = drawn(scene, eye);
  ASSERT_EQ(image.width_px, kWidth);
  ASSERT_EQ(image.height_px, kHeight);
  const auto pixel = [&](double x, double y, double z) { return *project(eye, {x, y, z}, kWidth, kHeight); };
  EXPECT_TRUE(has_colour(image, pixel(0.2, 0, 1), kBlue)) << "the way from point to point is drawn";
  EXPECT_TRUE(has_colour(image, pixel(2.4, 0, 1), kBlue));
  EXPECT_FALSE(has_colour(image, pixel(3.0, 0, 1), kRed)) << "a new start is not joined";
  EXPECT_TRUE(has_colour(image, pixel(3.6, 0, 1), kRed)) << "lost";
  EXPECT_TRUE(has_colour(image, pixel(-3, 1.5, 0), kGreen));
  EXPECT_TRUE(has_colour(image, pixel(-2, -1.5, 0.5), kOrange));
  EXPECT_TRUE(has_colour(image, pixel(2, 2, 2), kMagenta));
  EXPECT_FALSE(has_colour(image, pixel(2, 2, 0.5), kMagenta));
}

TEST(Scene3d, DrawsThreeSigmasOfAPoint) {
  for (const double unit : {1.0, 1e-4}) {  // MRPT by itself would not draw the small one
    Scene3d scene;
    Eigen::Matrix3d covariance = Eigen::Vector3d(0.36, 0.04, 0.01).asDiagonal();
    scene.points.push_back({1, {0, 0, 0}, unit * unit * covariance, true, {}});
    const SceneEye eye = from_above(10 * unit);
    const ImageMeasurement image = drawn(scene, eye);
    const Extent x = reach(image, eye, 0, is_magenta);
    const Extent y = reach(image, eye, 1, is_magenta);
    EXPECT_NEAR(x.most, 1.8 * unit, 0.1 * unit);
    EXPECT_NEAR(x.least, -1.8 * unit, 0.1 * unit);
    EXPECT_NEAR(y.most, 0.6 * unit, 0.06 * unit);
  }
}

TEST(Scene3d, DrawsTheShapeOfAnInverseDepth) {
  // At 10 m from the anchor, inverse depth 0.1 +- 0.02: from 1/0.16 to 1/0.04 m along the ray, not 10 +- 6.
  Scene3d scene;
  Eigen::Matrix3d covariance = Eigen::Vector3d(4.0, 0.01, 0.01).asDiagonal();
  scene.points.push_back({1, {0, 0, 0}, covariance, true, SceneRay{{-10, 0, 0}, 0.1, 0.02}});
  const SceneEye eye = from_above(60);
  const Extent x = reach(drawn(scene, eye), eye, 0, is_magenta);
  EXPECT_NEAR(x.least, 1 / 0.16 - 10, 0.3);
  EXPECT_NEAR(x.most, 1 / 0.04 - 10, 0.6);
}

TEST(Scene3d, DrawsThePictureInTheCorner) {
  Scene3d scene;
  ImageMeasurement picture = image_sample();
  picture.width_px = 40;
  picture.height_px = 20;
  picture.row_stride_bytes = 120;
  picture.format = PixelFormat::kBgr;
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 800; ++i) bytes.insert(bytes.end(), {10, i % 40 < 20 ? std::uint8_t{200} : std::uint8_t{0}, 90});
  picture.data = std::make_shared<const std::vector<std::uint8_t>>(bytes);
  scene.picture = picture;
  const ImageMeasurement image = drawn(scene, from_above(10));
  const double width = kPictureShare * kWidth;
  const int row = static_cast<int>(kHeight - 10 - width / 4);
  EXPECT_EQ(colour_at(image, static_cast<int>(kWidth - 10 - 0.75 * width), row), Eigen::Vector3i(90, 200, 10));
  EXPECT_EQ(colour_at(image, static_cast<int>(kWidth - 10 - 0.25 * width), row), Eigen::Vector3i(90, 0, 10));
}

TEST(Scene3d, IsSavedForSceneViewer) {
  const TemporaryFolder folder;
  SceneDrawing drawing;
  Scene3d scene;
  scene.trajectory = {{0, {0, 0, 0}}, {1, {1, 0, 0}}};
  drawing.show(scene, from_above(10), kWidth, kHeight);
  drawing.save(folder.path("a.3Dscene"));
  EXPECT_GT(std::filesystem::file_size(folder.path("a.3Dscene")), 500U);
  EXPECT_THROW(drawing.save(folder.path("none/a.3Dscene")), DataError);
  EXPECT_THROW(SceneCamera3d(10, 480), std::invalid_argument);
}

// A ride in a quarter of a circle of 20 m, with all that a session sends.
struct Ride {
  static Eigen::Vector3d place(double t) { return {20 * std::sin(0.1 * t), 20 - 20 * std::cos(0.1 * t), 0.02 * t}; }
  static estimate_t estimate(double t) {
    Estimate e;
    e.time_ns = kStart + from_seconds(t);
    e.host_time_ns = e.time_ns;
    e.sequence = std::lround(20 * t);
    e.valid = kValidOrientation | kValidPosition | kValidCovariance;
    e.q_world_body = Eigen::Quaterniond::Identity();
    e.position = place(t);
    e.covariance_dim = 15;
    e.covariance.setIdentity();
    e.covariance *= 0.01;
    return to_message(e, "inertial-slam", "ENU");
  }
  static slam_frame_t frame(double t, SlamFeatureState state, bool converted) {
    SlamFrame f;
    f.time_ns = kStart + from_seconds(t);
    f.host_time_ns = f.time_ns;
    f.sequence = std::lround(20 * t);
    f.estimate.time_ns = f.time_ns;
    f.camera_position = place(t);
    f.q_world_camera = Eigen::Quaterniond::Identity();
    SlamFeature feature;
    feature.id = 5;
    feature.state = state;
    feature.converted = converted;
    feature.pixel_px = {100, 100};
    f.features.push_back(feature);
    return to_message(f);
  }
  static map_points_t map(double t) {
    map_points_t m{};
    m.time_ns = kStart + from_seconds(t);
    m.host_time_ns = m.time_ns;
    m.size = 2;
    m.point_id = {5, 6};
    m.position = {{20, 0, 0}, {0, 30, 1}};
    m.position_cov = {{4, 0, 0, 0, 0.01, 0, 0, 0, 0.01}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    return m;
  }
  static gps_fix_t fix(double t, double heading) {
    const LocalFrame local(0.7, 0.1, 100);
    GpsMeasurement m = gps_sample();
    m.time_ns = kStart + from_seconds(t);
    const Eigen::Vector3d p =
        Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()) * place(t) + Eigen::Vector3d(300, -50, 4);
    const GeodeticPoint g = local.to_geodetic(p);
    m.latitude = g.latitude;
    m.longitude = g.longitude;
    m.altitude = g.altitude;
    return to_message(m);
  }
  static image_t picture(double t) {
    ImageMeasurement m;
    m.time_ns = kStart + from_seconds(t);
    m.host_time_ns = m.time_ns;
    m.sequence = std::lround(20 * t);
    m.width_px = 64;
    m.height_px = 48;
    m.row_stride_bytes = 64;
    m.data = std::make_shared<const std::vector<std::uint8_t>>(64 * 48, static_cast<std::uint8_t>(m.sequence));
    return to_message(m);
  }
};

SceneRecorder recorder_of_ride(double gps_heading = 0.4) {
  SceneRecorder recorder({});
  recorder.take("LOC_SLAM_FRAME", encode(Ride::frame(0, SlamFeatureState::kNew, false)));
  for (int i = 0; i <= 200; ++i) {
    const double t = i / 20.0;
    if (i % 10 == 0) recorder.take("LOC_GPS", encode(Ride::fix(t, gps_heading)));
    recorder.take("LOC_IMAGE", encode(Ride::picture(t)));
    recorder.take("LOC_ESTIMATE", encode(Ride::estimate(t)));
    ReferenceMeasurement reference;
    reference.time_ns = kStart + from_seconds(t);
    reference.position = Ride::place(t) + Eigen::Vector3d(7, 8, 9);
    reference.q_world_body = Eigen::Quaterniond::Identity();
    recorder.take("LOC_REFERENCE", encode(to_message(reference)));
  }
  recorder.take("LOC_SLAM_FRAME", encode(Ride::frame(9.9, SlamFeatureState::kMeasured, false)));
  recorder.take("LOC_MAP", encode(Ride::map(10)));
  return recorder;
}

std::int64_t find_count(const SceneRecorder& recorder, const std::string& name) {
  for (const NamedCount& count : recorder.counts()) {
    if (count.name == name) return count.value;
  }
  return 0;
}

TEST(SceneRecorder, HoldsWhatTheMessagesSay) {
  const SceneRecorder recorder = recorder_of_ride();
  EXPECT_EQ(recorder.time_ns(), kStart + 10 * kSecond);
  const Scene3d scene = recorder.scene();
  EXPECT_EQ(scene.trajectory.size(), 201U);
  ASSERT_TRUE(scene.body && scene.camera && scene.picture);
  EXPECT_NEAR((scene.body->translation - Ride::place(10)).norm(), 0, 1e-12);
  EXPECT_NEAR((scene.camera->T_world_camera.translation - Ride::place(9.9)).norm(), 0, 1e-12);
  EXPECT_NEAR(scene.position_cov(1, 1), 0.01, 1e-12);
  // The picture of the frame, not the newest one.
  EXPECT_EQ(scene.picture->data->front(), 198);
  EXPECT_EQ(scene.features.size(), 1U);
  ASSERT_EQ(scene.points.size(), 2U);
  EXPECT_TRUE(scene.points[0].in_use);
  ASSERT_TRUE(scene.points[0].ray);
  EXPECT_NEAR(scene.points[0].ray->anchor.norm(), 0, 1e-12);
  EXPECT_NEAR(scene.points[0].ray->inverse_depth, 0.05, 1e-12);
  EXPECT_NEAR(scene.points[0].ray->sigma_inverse_depth, 2 * 0.05 * 0.05, 1e-12);
  EXPECT_FALSE(scene.points[1].in_use);
  EXPECT_FALSE(scene.points[1].ray) << "nobody saw where it began";
  EXPECT_EQ(recorder.undecodable(), 0);
}

TEST(SceneRecorder, LaysGpsAndReferenceOverTheTrajectory) {
  const Scene3d scene = recorder_of_ride(0.4).scene();
  ASSERT_FALSE(scene.gps.empty());
  EXPECT_NEAR((scene.gps.back() - Ride::place(10)).norm(), 0, 0.02);
  ASSERT_FALSE(scene.reference.empty());
  EXPECT_NEAR((scene.reference.back().position - Ride::place(10)).norm(), 0, 1e-6);
}

TEST(SceneRecorder, GpsIsWhereItIsOnceTheWorldIsTiedToTheEarth) {
  SceneRecorder recorder = recorder_of_ride(0);
  fusion_t fusion{};
  fusion.time_ns = kStart + 10 * kSecond;
  fusion.scale = fusion.scale_sigma = kUnknown;
  fusion.origin_latitude = 0.7;
  fusion.origin_longitude = 0.1;
  fusion.origin_altitude = 100;
  recorder.take("LOC_FUSION", encode(fusion));
  const Scene3d scene = recorder.scene();
  EXPECT_NEAR((scene.gps.back() - Ride::place(10) - Eigen::Vector3d(300, -50, 4)).norm(), 0, 1e-3);
  fusion.origin_latitude = 7;
  recorder.take("LOC_FUSION", encode(fusion));
  EXPECT_EQ(recorder.undecodable(), 1);
}

TEST(SceneRecorder, WhatIsOlderComesIntoTheWorldThatGpsGives) {
  const Pose3 T_world_map{Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ())), {300, -50, 4}};
  SceneRecorder recorder = recorder_of_ride(0.4);
  Estimate e = from_message(Ride::estimate(10.005));
  e.q_world_body = T_world_map.rotation * e.q_world_body;
  e.position = T_world_map * Ride::place(10);
  e.origin = {0.7, 0.1, 100};
  recorder.take("LOC_ESTIMATE", encode(to_message(e, "inertial-slam", "ENU")));
  recorder.take("LOC_FUSION", encode(*to_fusion_message(e)));
  const Scene3d scene = recorder.scene();
  EXPECT_NEAR((scene.trajectory.front().position - T_world_map.translation).norm(), 0, 1e-9);
  EXPECT_NEAR((scene.gps.front() - T_world_map.translation).norm(), 0, 1e-3);
  ASSERT_TRUE(scene.points[0].ray);
  EXPECT_NEAR((scene.points[0].ray->anchor - T_world_map.translation).norm(), 0, 1e-9);
  recorder.take("LOC_MAP", encode(Ride::map(10.005)));
  EXPECT_NEAR(recorder.scene().points[1].position_cov(0, 0), 1 - 0.01, 1e-12) << "less what it shares with the pose";
}

TEST(SceneRecorder, AConvertedFeatureIsAPoint) {
  SceneRecorder recorder = recorder_of_ride();
  recorder.take("LOC_SLAM_FRAME", encode(Ride::frame(10, SlamFeatureState::kMeasured, true)));
  EXPECT_FALSE(recorder.scene().points[0].ray);
}

TEST(SceneRecorder, WordsOfTheStatusAreShown) {
  SceneRecorder recorder = recorder_of_ride();
  EXPECT_TRUE(recorder.scene().warnings.empty());
  estimator_status_t status = estimator_status_message();
  status.measurement_time_ns = kStart + 10 * kSecond;
  recorder.take("LOC_ESTIMATOR_STATUS", encode(status));
  EXPECT_EQ(recorder.scene().warnings, status.condition);
}

TEST(SceneRecorder, RubbishIsCountedAndMemoryBounded) {
  SceneRecorderOptions options;
  options.max_track_points = 100;
  SceneRecorder recorder(options);
  EXPECT_EQ(recorder.scene().lines, std::vector<std::string>{"no estimate yet"});
  for (int i = 0; i < 2000; ++i) recorder.take("LOC_ESTIMATE", encode(Ride::estimate(i / 20.0)));
  const Scene3d scene = recorder.scene();
  EXPECT_LE(scene.trajectory.size(), 101U);
  EXPECT_GE(scene.trajectory.size(), 50U);
  EXPECT_EQ(scene.trajectory.front().time_ns, kStart);
  const std::vector<std::uint8_t> rubbish(40, 7);
  for (const char* channel :
       {"LOC_ESTIMATE", "LOC_SLAM_FRAME", "LOC_MAP", "LOC_FUSION", "LOC_ESTIMATOR_STATUS", "LOC_IMAGE"}) {
    recorder.take(channel, rubbish);
  }
  EXPECT_EQ(recorder.undecodable(), 6);
  image_t damaged = to_message(encode_jpeg(from_message(Ride::picture(1))));
  damaged.data[static_cast<std::size_t>(damaged.size) / 2] ^= 0xff;
  damaged.data.erase(damaged.data.begin() + damaged.size / 2, damaged.data.begin() + damaged.size / 2 + 20);
  damaged.size = static_cast<std::int32_t>(damaged.data.size());
  recorder.take("LOC_IMAGE", encode(damaged));
  EXPECT_FALSE(recorder.scene().picture);
  EXPECT_FALSE(recorder.scene().warnings.empty());
}

TEST(SceneRecorder, FixesWithoutAltitudeAreDrawnAtTheHeightOfTheOthers) {
  const auto flat_fix = [](double t) {
    gps_fix_t fix = Ride::fix(t, 0);
    fix.fix_type = gps_fix_t::FIX_2D;
    fix.altitude = kUnknown;
    return fix;
  };
  const LocalFrame local(0.7, 0.1, 100);
  SceneRecorder recorder({});
  for (int i = 0; i <= 100; ++i) {
    recorder.take("LOC_ESTIMATE", encode(Ride::estimate(i / 10.0)));
    if (i % 10 == 0) recorder.take("LOC_GPS", encode(i < 80 ? flat_fix(i / 10.0) : Ride::fix(i / 10.0, 0)));
  }
  EXPECT_EQ(recorder.undecodable(), 0);
  // Laid over the trajectory.
  Scene3d scene = recorder.scene();
  ASSERT_EQ(scene.gps.size(), 11U) << scene.gps_note;
  EXPECT_NEAR((scene.gps[3] - Ride::place(3)).head<2>().norm(), 0, 0.05);
  EXPECT_NEAR(scene.gps[3].z(), Ride::place(3).z(), 1);
  EXPECT_EQ(find_count(recorder, "gps.without_altitude"), 8);
  // Where the world is tied to the Earth: at the height of its origin.
  fusion_t fusion{};
  fusion.time_ns = kStart + 10 * kSecond;
  fusion.scale = fusion.scale_sigma = kUnknown;
  fusion.origin_latitude = 0.7;
  fusion.origin_longitude = 0.1;
  fusion.origin_altitude = 90;
  recorder.take("LOC_FUSION", encode(fusion));
  scene = recorder.scene();
  EXPECT_NEAR((scene.gps[3] - Ride::place(3) - Eigen::Vector3d(300, -50, 0)).head<2>().norm(), 0, 0.01);
  EXPECT_NEAR(scene.gps[3].z(), 0, 0.1) << "less than the Earth bends away";
  EXPECT_NEAR(scene.gps[9].z(), Ride::place(9).z() + 4 + 10, 0.01) << "as measured";
}

TEST(SceneRecorder, AStampThatIsFarOffIsCountedAndNotFollowed) {
  const auto late = [](double t, TimeNs by) {
    estimate_t m = Ride::estimate(t);
    m.time_ns += by;
    return m;
  };
  constexpr TimeNs kYear = 365LL * 86'400 * kSecond;
  SceneRecorder recorder({});
  recorder.take("LOC_ESTIMATE", encode(late(0, 20 * kYear)));  // even the first one
  for (int i = 1; i <= 40; ++i) {
    recorder.take("LOC_ESTIMATE", encode(Ride::estimate(i / 20.0)));
    if (i % 10 == 0) {
      recorder.take("LOC_ESTIMATE", encode(late(i / 20.0, i == 10 ? 3 * kYear : -kYear)));
      slam_frame_t frame = Ride::frame(i / 20.0, SlamFeatureState::kMeasured, false);
      frame.time_ns += kYear;
      recorder.take("LOC_SLAM_FRAME", encode(frame));
      recorder.take("LOC_ESTIMATE", encode(late(i / 20.0, std::numeric_limits<TimeNs>::max() - kStart - 2 * kSecond)));
    }
  }
  EXPECT_EQ(recorder.first_time_ns(), kStart + kSecond / 20);
  EXPECT_EQ(recorder.time_ns(), kStart + 2 * kSecond);
  EXPECT_EQ(recorder.scene().trajectory.size(), 40U);
  EXPECT_EQ(find_count(recorder, "time.skipped.far_off"), 1 + 4 * 3);
  // Two that agree: the clock has been set.
  for (int i = 0; i < 10; ++i) recorder.take("LOC_ESTIMATE", encode(late(3 + i / 20.0, kYear)));
  EXPECT_EQ(recorder.time_ns(), kStart + kYear + from_seconds(3.45));
  EXPECT_EQ(find_count(recorder, "time.jumped"), 1);
}

TEST(SceneRecorder, TwoClocksOnOneChannelStayWithinTheMemory) {
  SceneRecorderOptions options;
  options.max_track_points = 100;
  SceneRecorder recorder(options);
  for (int i = 0; i < 5000; ++i) {
    for (const double clock : {0.0, 30.0}) {
      const double t = i / 20.0 + clock;
      recorder.take("LOC_ESTIMATE", encode(Ride::estimate(t)));
      recorder.take("LOC_GPS", encode(Ride::fix(t, 0)));
      ReferenceMeasurement reference;
      reference.time_ns = kStart + from_seconds(t);
      reference.position = Ride::place(t);
      reference.q_world_body = Eigen::Quaterniond::Identity();
      recorder.take("LOC_REFERENCE", encode(to_message(reference)));
    }
  }
  const Scene3d scene = recorder.scene();
  EXPECT_LE(scene.trajectory.size(), 101U);
  EXPECT_GE(scene.trajectory.size(), 50U);
  EXPECT_LE(scene.gps.size(), 101U);
  EXPECT_LE(scene.reference.size(), 101U);
  EXPECT_EQ(find_count(recorder, "time.stepped_back"), 4999);
}

class View3d : public ::testing::Test {
 protected:
  void SetUp() override {
    ::unsetenv("DISPLAY");
    LcmLogWriter log(path("ride.lcm"));
    LcmLogWriter pictures(path("pictures.lcm"));
    for (int i = 0; i <= 200; ++i) {
      const double t = i / 20.0;
      const std::int64_t us = (kStart + from_seconds(t)) / 1000;
      log.write(us, "LOC_ESTIMATE", encode(Ride::estimate(t)));
      pictures.write(us, "LOC_IMAGE", encode(Ride::picture(t)));
    }
    log.flush();
    pictures.flush();
  }
  std::string path(const std::string& name) const { return folder_.path(name); }
  int view(const std::vector<std::string>& arguments) {
    std::filesystem::remove(path("err"));
    return run("loc-view3d", arguments, path("err"));
  }
  std::string errors() const { return text_of(path("err")); }

  TemporaryFolder folder_;
};

TEST_F(View3d, DrawsLogsWithoutADisplay) {
  ASSERT_EQ(view({path("ride.lcm"), path("pictures.lcm"), "--png", path("a.png"), "--size", "640x480", "--scene",
                  path("a.3Dscene"), "--view", "top"}),
            0)
      << errors();
  const ImageMeasurement image = read_image(path("a.png"), PixelFormat::kBgr);
  ASSERT_EQ(image.width_px, 640);
  ASSERT_EQ(image.height_px, 480);
  int blue = 0;
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x) blue += (colour_at(image, x, y) - kBlue).cwiseAbs().maxCoeff() <= 3 ? 1 : 0;
  }
  // The quarter of the circle is some 300 px long and 4 wide; the word in the legend is blue as well.
  EXPECT_GT(blue, 1000);
  EXPECT_EQ(colour_at(image, 560, 400), Eigen::Vector3i(200, 200, 200)) << "the picture of the last frame, 200";
  EXPECT_TRUE(std::filesystem::exists(path("a.3Dscene")));

  ASSERT_EQ(view({path("ride.lcm"), "--png-every", "4", "--png-folder", path("many"), "--size", "320x240"}), 0);
  EXPECT_TRUE(std::filesystem::exists(path("many/scene-000000.000.png")));
  EXPECT_TRUE(std::filesystem::exists(path("many/scene-000008.000.png")));
  EXPECT_FALSE(std::filesystem::exists(path("many/scene-000012.000.png")));

  ASSERT_EQ(view({path("ride.lcm"), "--at", "3", "--png", path("b.png")}), 0);
  EXPECT_NE(errors().find("time_s=3.000"), std::string::npos) << errors();
}

TEST_F(View3d, OneEstimateYearsAheadDoesNotStopThePictures) {
  {
    LcmLogWriter log(path("ahead.lcm"));
    for (int i = 0; i <= 200; ++i) {
      estimate_t m = Ride::estimate(i / 20.0);
      if (i == 50) m.time_ns += 100'000'000 * kSecond;
      if (i == 120) m.time_ns += 60 * kSecond;  // as it may well be
      log.write((kStart + from_seconds(i / 20.0)) / 1000, "LOC_ESTIMATE", encode(m));
    }
    log.flush();
  }
  ASSERT_EQ(view({path("ahead.lcm"), "--png-every", "4", "--png-folder", path("many"), "--size", "64x64"}), 0);
  EXPECT_NE(errors().find("time.skipped.far_off=1"), std::string::npos) << errors();
  for (const char* name : {"scene-000000.000.png", "scene-000004.000.png", "scene-000008.000.png"}) {
    EXPECT_TRUE(std::filesystem::exists(path("many") + "/" + name)) << name;
  }
}

TEST_F(View3d, LogsAreReadInTheOrderOfMeasurement) {
  // The pictures were logged an hour later, when the recording was replayed; the first stamp in their log is damaged.
  {
    LcmLogWriter pictures(path("later.lcm"));
    for (int i = 0; i <= 200; ++i) {
      image_t m = Ride::picture(i / 20.0);
      if (i == 0) m.time_ns += 100'000'000 * kSecond;
      pictures.write((kStart + from_seconds(i / 20.0 + 3600)) / 1000, "LOC_IMAGE", encode(m));
    }
    pictures.flush();
  }
  for (const auto& [first, second] : {std::pair{"later.lcm", "ride.lcm"}, std::pair{"ride.lcm", "later.lcm"}}) {
    ASSERT_EQ(view({path(first), path(second), "--at", "3", "--png", path("a.png"), "--size", "640x480"}), 0)
        << errors();
    const Eigen::Vector3i shade = colour_at(read_image(path("a.png"), PixelFormat::kBgr), 560, 400);
    EXPECT_NEAR(shade.x(), 60, 2) << "the picture of that moment, 60";
  }
}

TEST_F(View3d, SaysWhatIsWrong) {
  const auto fails = [&](int code, const std::string& words, const std::vector<std::string>& arguments) {
    EXPECT_EQ(view(arguments), code) << errors();
    EXPECT_NE(errors().find(words), std::string::npos) << errors();
  };
  fails(1, "no display", {path("ride.lcm")});
  fails(1, "none.lcm", {path("none.lcm"), "--png", path("a.png")});
  fails(1, "no estimate", {path("pictures.lcm"), "--png", path("a.png")});
  EXPECT_FALSE(std::filesystem::exists(path("a.png")));
  fails(1, "ends at 10.000 s", {path("ride.lcm"), "--at", "11", "--png", path("a.png")});
  fails(2, "must end in .png", {path("ride.lcm"), "--png", path("a.jpg")});
  fails(2, "there is no folder", {path("ride.lcm"), "--png", path("none/a.png")});
  fails(2, "WIDTHxHEIGHT", {path("ride.lcm"), "--png", path("a.png"), "--size", "640"});
  fails(2, "zoom", {path("ride.lcm"), "--png", path("a.png"), "--zoom", "0"});
  fails(2, "for logs only", {"--at", "3", "--png", path("a.png")});
  Rig rig;
  rig.cameras.push_back(radtan_camera());
  write_rig(path("rig.yaml"), rig);
  fails(2, "the rig has 1 cameras",
        {path("ride.lcm"), "--png", path("a.png"), "--config", path("rig.yaml"), "--camera", "1"});
  // Cut off in the middle: what there is is shown, and the loss is said.
  std::filesystem::resize_file(path("ride.lcm"), std::filesystem::file_size(path("ride.lcm")) / 2);
  EXPECT_EQ(view({path("ride.lcm"), "--png", path("a.png")}), 0);
  EXPECT_NE(errors().find("event=damaged"), std::string::npos) << errors();
}

TEST_F(View3d, DrawsALiveSession) {
  const RunningHub hub(folder_);
  ChildProcess viewer = start("loc-view3d", {"--lcm-url", hub.url, "--png", path("live.png")}, path("err"));
  ASSERT_TRUE(wait_until([&] { return errors().find("event=started") != std::string::npos; }, 20 * kSecond));
  LcmPublisher publisher(hub.url);
  for (int i = 0; i < 40; ++i) {
    publisher.publish("LOC_ESTIMATE", Ride::estimate(i / 20.0));
    publisher.publish("LOC_IMAGE", Ride::picture(i / 20.0));
    wait_until([] { return false; }, 10 * kMs);
  }
  EXPECT_TRUE(viewer.stop(20 * kSecond));
  EXPECT_TRUE(viewer.succeeded()) << errors();
  EXPECT_EQ(read_image(path("live.png"), PixelFormat::kBgr).width_px, 1280);
  EXPECT_GT(figure(errors(), "event=ended", "estimates"), 20) << errors();
}

}  // namespace
}  // namespace loc::test
