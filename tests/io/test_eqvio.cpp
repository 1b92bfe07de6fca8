// The file of GTSAM's EqVIO example: tracks and IMU, made pixels; and maps as PLY files.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <set>

#include "libloc/geometry/camera.hpp"
#include "libloc/io/eqvio.hpp"
#include "libloc/io/ply.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "tests/support/data.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

using test::count;
using test::expect_data_error;
using test::only;
using test::read_all;

const std::string kHeading =
    "row_type,t_abs,t_rel,seq,frame_idx,landmark_id,gx,gy,gz,ax,ay,az,bgx,bgy,bgz,bax,bay,baz,u_norm,v_norm,key,"
    "value\n";
std::string meta(const std::string& key, const std::string& value) {
  return "meta,,,,,,,,,,,,,,,,,,,," + key + "," + value + "\n";
}
const std::string kMeta = meta("format_version", "1") + meta("measurement_space", "normalized") +
                          meta("dataset_path", "a,b") + meta("camera_fx", "400") + meta("camera_fy", "410") +
                          meta("camera_cx", "300.5") + meta("camera_cy", "200.25") + meta("T_ci_tx", "0.1") +
                          meta("T_ci_ty", "0.2") + meta("T_ci_tz", "0.3") + meta("T_ci_qw", "0.5") +
                          meta("T_ci_qx", "-0.5") + meta("T_ci_qy", "0.5") + meta("T_ci_qz", "-0.5");
std::string feature(const std::string& time, int frame, const std::string& id, const std::string& uv) {
  return "vision_feature," + time + ",0,0," + std::to_string(frame) + "," + id + ",,,,,,,,,,,,," + uv + ",,\n";
}
std::string imu(const std::string& time, const std::string& values = "1,2,3,4,5,6") {
  return "imu," + time + ",0,0,,," + values + ",0,0,0,0,0,0,,,,\n";
}
const std::string kRows = feature("1403715273.2621431", 0, "7", "0.25,-0.5") +
                          feature("1403715273.2621431", 0, "3", "-1,0.5") + imu("1403715273.2621431") +
                          imu("1403715273.267143") + feature("1403715273.3121431", 2, "7", "0.5,0");

class Eqvio : public testing::Test {
 protected:
  std::filesystem::path file(const std::string& text) const { return folder_.write("r.csv", text); }
  void expect_refused(const std::string& text, const std::vector<std::string>& parts) const {
    expect_data_error([&] { read_all(*open_eqvio(file(text))); }, parts);
  }
  test::TempFolder folder_;
};

TEST_F(Eqvio, gives_frames_and_samples_in_order_with_exact_times) {
  const auto source = open_eqvio(file(kHeading + kMeta + kRows), {.camera = {}, .sigma_px = 0.7});
  const auto all = read_all(*source);
  ASSERT_EQ(all.size(), 4U);
  const auto& first = std::get<FeaturesMeasurement>(all[0]);
  EXPECT_EQ(first.time_ns, 1403715273262143100);
  EXPECT_EQ(first.sequence, 0);
  EXPECT_EQ(first.camera, 0);
  EXPECT_EQ(first.sigma_px, 0.7);
  ASSERT_EQ(first.features.size(), 2U);
  EXPECT_EQ(first.features[1].id, 3);
  const auto& sample = std::get<ImuMeasurement>(all[2]);
  EXPECT_EQ(sample.time_ns, 1403715273267143000);
  EXPECT_EQ(sample.sequence, 1);
  EXPECT_EQ(sample.angular_velocity, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(sample.specific_force, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(stamp_of(all[3]).sequence, 2) << "the frame's own number";
  EXPECT_EQ(count(source->counts(), "features.read"), 2);
  EXPECT_EQ(count(source->counts(), "features.points"), 3);
  EXPECT_EQ(count(source->counts(), "imu.read"), 2);
}

// The camera of the rig takes every pixel back to the file's point, and all of them lie in its picture.
TEST_F(Eqvio, pixels_and_rig_belong_together) {
  const auto source = open_eqvio(file(kHeading + kMeta + kRows));
  const auto all = only<FeaturesMeasurement>(read_all(*source));
  ASSERT_EQ(source->rig().cameras.size(), 1U);
  const CameraCalibration& calibration = source->rig().cameras[0];
  EXPECT_EQ(calibration.intrinsics_px.head<2>(), Eigen::Vector2d(400, 410));
  // -1 * 400 + 300.5 = -99.5 lies beside the file's own picture: moved by whole pixels.
  const double moved = calibration.intrinsics_px[2] - 300.5;
  EXPECT_EQ(moved, std::round(moved));
  EXPECT_GE(moved, 99.5);
  EXPECT_LT(moved, 120);
  EXPECT_EQ(calibration.T_body_camera.translation, Eigen::Vector3d(0.1, 0.2, 0.3));
  // T_ci takes camera to IMU: with this one the camera's z axis is the body's x axis.
  EXPECT_TRUE((calibration.T_body_camera.rotation * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitX()));
  const Camera camera(calibration);
  for (const FeaturesMeasurement& frame : all) {
    for (const FeatureObservation& f : frame.features) EXPECT_TRUE(camera.in_image(f.pixel_px, 5)) << f.id;
  }
  const Eigen::Vector3d ray = *camera.unproject(all[0].features[0].pixel_px);
  EXPECT_NEAR(ray.x() / ray.z(), 0.25, 1e-14);
  EXPECT_NEAR(ray.y() / ray.z(), -0.5, 1e-14);
  EXPECT_TRUE(std::isnan(all[0].sigma_px)) << "the file does not say";
}

TEST_F(Eqvio, a_camera_that_is_given_wins_over_the_file) {
  EqvioOptions options;
  // Its lens folds back beyond a tangent of 1.05.
  options.camera.emplace();
  options.camera->name = "own";
  options.camera->width_px = 752;
  options.camera->height_px = 480;
  options.camera->intrinsics_px = {458.654, 457.296, 367.215, 248.375};
  options.camera->distortion_model = DistortionModel::kRadtan;
  options.camera->distortion = {-0.3, 0, 0.0002, 0};
  const std::string without_camera = meta("format_version", "1") + meta("measurement_space", "normalized");
  const std::string rows = kRows + feature("1403715273.4", 3, "9", "3,0");
  const auto source = open_eqvio(file(kHeading + without_camera + rows), options);
  const auto all = only<FeaturesMeasurement>(read_all(*source));
  EXPECT_EQ(source->rig().cameras[0].name, "own");
  EXPECT_EQ(all[0].features[0].pixel_px, *Camera(*options.camera).project({0.25, -0.5, 1}));
  EXPECT_TRUE(all[2].features.empty());
  EXPECT_EQ(count(source->counts(), "features.skipped.not_projected"), 2) << "this one and (-1, 0.5)";
}

TEST_F(Eqvio, skips_are_counted) {
  const std::string text = kHeading + kMeta + kRows + imu("1403715273.30") + imu("1403715273.4", "nan,2,3,4,5,6") +
                           imu("1403715273.4") + ",,,,,,,,,,,,,,,,,,,,,\n" + feature("1403715273.5", 4, "1", "0,0") +
                           feature("1403715273.5", 5, "1", "0,0") + "imu,1403715273.6,0,0,,,1,2,3";
  const auto source = open_eqvio(file(text));
  const auto all = read_all(*source);
  EXPECT_EQ(only<ImuMeasurement>(all).size(), 3U);
  EXPECT_EQ(only<FeaturesMeasurement>(all).size(), 3U);
  const NamedCounts counts = source->counts();
  EXPECT_EQ(count(counts, "rows.skipped.time_not_increasing"), 1);
  EXPECT_EQ(count(counts, "imu.skipped.time_not_increasing"), 1);
  EXPECT_EQ(count(counts, "imu.not_finite"), 1);
  EXPECT_EQ(count(counts, "features.skipped.time_not_increasing"), 1);
  EXPECT_EQ(count(counts, "rows.skipped.blank"), 1);
  EXPECT_EQ(count(counts, "rows.skipped.no_line_end"), 1);
}

TEST_F(Eqvio, what_is_wrong_is_named) {
  const auto without = [](std::string text, const std::string& part) {
    return text.erase(text.find(part), part.size());
  };
  expect_refused("", {"r.csv", "empty"});
  expect_refused(without(kHeading, "u_norm,"), {"r.csv:1", "u_norm"});
  expect_refused(kHeading + kRows, {"format_version"});
  expect_refused(kHeading + without(kMeta, meta("T_ci_qz", "-0.5")) + kRows, {"T_ci_qz"});
  expect_refused(kHeading + kMeta + meta("camera_fx", "1") + kRows, {"r.csv:16", "camera_fx", "second time"});
  expect_refused(kHeading + meta("format_version", "2") + kRows, {"r.csv:2", "'2'"});
  const std::string good = kHeading + kMeta + kRows;  // 20 lines
  expect_refused(good + imu("173.x"), {"r.csv:21", "t_abs", "173.x"});
  expect_refused(good + imu("1403715274", "1,2,3,4,,6"), {"r.csv:21", "ay = ''"});
  expect_refused(good + "imu,1403715274,0\n", {"r.csv:21", "3 cells", "22"});
  expect_refused(good + "wheel,1403715274,0,0,,,,,,,,,,,,,,,,,,\n", {"r.csv:21", "row_type = 'wheel'"});
  expect_refused(good + meta("camera_fx", "1"), {"r.csv:21", "after other rows"});
  expect_refused(good + feature("1403715274", 3, "-1", "0,0"), {"r.csv:21", "landmark_id = '-1'"});
  expect_refused(good + feature("1403715274", 3, "1", "nan,0"), {"r.csv:21", "u_norm", "nan"});
  expect_refused(good + feature("1403715274", 3, "1", "1e9,0"), {"r.csv:21", "u_norm", "1e9"});
  expect_refused(good + feature("1403715273.3121431", 2, "7", "0,0"), {"r.csv:21", "landmark_id", "second time"});
  expect_refused(good + feature("1403715273.3121432", 2, "8", "0,0"), {"r.csv:21", "t_abs", "frame 2"});
  expect_refused(good + imu("1403715274") + feature("1403715274", 2, "8", "0,0"), {"r.csv:22", "frame_idx = '2'"});
  EXPECT_THROW(open_eqvio(file(good), {.camera = {}, .sigma_px = -1}), std::invalid_argument);
  EXPECT_TRUE(is_eqvio(file(good)));
  EXPECT_FALSE(is_eqvio(file("time_ns,wx_rad_s\n")));
  EXPECT_FALSE(is_eqvio(folder_.path() / "none"));
}

// The good rows before a bad one are given.
TEST_F(Eqvio, a_bad_row_takes_nothing_along) {
  const auto source = open_eqvio(file(kHeading + kMeta + kRows + imu("x")));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(source->next());
  EXPECT_THROW(source->next(), DataError);
}

TEST_F(Eqvio, reads_the_real_recording) {
  LOC_DATA_OR_SKIP(folder, "euroc-v101-tracks");
  const auto source = open_eqvio(folder / "tracks_and_imu.csv");
  const auto all = read_all(*source);
  const auto frames = only<FeaturesMeasurement>(all);
  EXPECT_EQ(only<ImuMeasurement>(all).size(), 6001U);
  EXPECT_EQ(frames.size(), 601U);
  std::set<std::int64_t> ids;
  std::size_t points = 0;
  const Camera camera(source->rig().cameras.at(0));
  for (const FeaturesMeasurement& frame : frames) {
    for (const FeatureObservation& f : frame.features) {
      ids.insert(f.id);
      EXPECT_TRUE(camera.in_image(f.pixel_px, 5));
    }
    points += frame.features.size();
  }
  EXPECT_EQ(ids.size(), 307U);
  EXPECT_EQ(points, 13316U);
  for (std::size_t i = 1; i < all.size(); ++i) ASSERT_LE(stamp_of(all[i - 1]).time_ns, stamp_of(all[i]).time_ns);
  EXPECT_EQ(source->counts().size(), 3U) << "nothing was skipped";
  // T_ci is EuRoC's T_BS, not its inverse.
  const CameraCalibration euroc = read_euroc_camera(folder / "cam0-sensor.yaml");
  const Pose3& pose = source->rig().cameras[0].T_body_camera;
  EXPECT_LT((pose.translation - euroc.T_body_camera.translation).norm(), 1e-12);
  EXPECT_LT(pose.rotation.angularDistance(euroc.T_body_camera.rotation), 1e-9);
}

std::string vertices(const std::string& ply) {
  return ply.substr(ply.find("end_header\n") + 11);
}

TEST(Ply, text_and_binary_say_the_same) {
  const test::TempFolder folder;
  std::vector<PlyPoint> points = {{{1.5, -2, 1e-3}, 42, 0.25}, {{0.1, 1e10, 0}, -1, 0}};
  points.push_back({{kUnknown, 0, 0}, 3, 0.1});
  points.push_back({{0, 0, 0}, 4, kUnknown});
  EXPECT_EQ(write_ply(folder.path() / "a.ply", points, {"in world [m]"}, PlyFormat::kAscii), 2);
  EXPECT_EQ(write_ply(folder.path() / "b.ply", points), 2);
  const std::string text = test::read_file(folder.path() / "a.ply");
  EXPECT_EQ(text.substr(0, 58), "ply\nformat ascii 1.0\ncomment in world [m]\nelement vertex 2");
  EXPECT_EQ(vertices(text), "1.5 -2 0.001 42 0.25\n0.1 1e+10 0 -1 0\n");
  const std::string binary = test::read_file(folder.path() / "b.ply");
  EXPECT_NE(binary.find("format binary_little_endian 1.0\nelement vertex 2\nproperty double x\n"), std::string::npos);
  const std::string body = vertices(binary);
  ASSERT_EQ(body.size(), 2U * (4 * 8 + 4));
  EXPECT_EQ(body.substr(0, 8), std::string("\0\0\0\0\0\0\xf8\x3f", 8)) << "1.5";
  EXPECT_EQ(body.substr(24, 4), std::string("\x2a\0\0\0", 4));
  EXPECT_EQ(body.substr(60, 4), "\xff\xff\xff\xff");
  EXPECT_EQ(body.substr(28, 8), std::string("\0\0\0\0\0\0\xd0\x3f", 8)) << "0.25";
}

TEST(Ply, refuses_what_it_cannot_hold) {
  const test::TempFolder folder;
  const auto write = [&](const PlyPoint& point, const std::vector<std::string>& comments) {
    return write_ply(folder.path() / "a.ply", std::vector{point}, comments);
  };
  EXPECT_THROW(write({{0, 0, 0}, std::int64_t{1} << 31, 0}, {}), std::invalid_argument);
  EXPECT_THROW(write({{0, 0, 0}, 0, -1}, {}), std::invalid_argument);
  EXPECT_THROW(write({{0, 0, 0}, 0, 0}, {"two\nlines"}), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.ply"));
  EXPECT_THROW(write_ply(folder.path() / "no/a.ply", {}), DataError);
}

}  // namespace
}  // namespace loc
