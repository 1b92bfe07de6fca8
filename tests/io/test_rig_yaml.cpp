// The rig as a file: round trips, strictness, and the files of Kalibr and EuRoC.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "libloc/core/random.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "libloc/io/yaml_block.hpp"
#include "tests/support/comma_locale.hpp"
#include "tests/support/data.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

using test::expect_data_error;

TriadCalibration random_triad(Random& random) {
  TriadCalibration triad;
  triad.bias = random.normal3();
  for (int i = 0; i < 3; ++i) triad.matrix.row(i) = Eigen::Vector3d::Unit(i) + 0.01 * random.normal3();
  return triad;
}

TriadQuality full_quality(Random& random) {
  TriadQuality quality;
  quality.verdict = Verdict::kWarn;
  quality.method = "still-poses";
  quality.samples = 9'007'199'254'740'993;  // no double
  quality.bias_sigma = random.normal3().cwiseAbs();
  for (int i = 0; i < 3; ++i) quality.matrix_sigma.row(i) = random.normal3().cwiseAbs();
  quality.residual_rms = 1.0 / 7;
  quality.reasons = {"deviation of the centre: 1.2 % of the radius; turn more", "a \"quoted\" # word, µT", "null"};
  return quality;
}

IntrinsicsQuality full_intrinsics_quality(Random& random) {
  IntrinsicsQuality quality;
  quality.verdict = Verdict::kFair;
  quality.method = "target";
  quality.pictures = 9'007'199'254'740'993;
  quality.intrinsics_sigma_px << random.normal3().cwiseAbs(), 1.0 / 3;
  quality.distortion_sigma << random.normal3().cwiseAbs(), 0;
  quality.reprojection_rms_px = 1.0 / 7;
  quality.reasons = {"only 70 % of the image"};
  return quality;
}

MountingQuality full_mounting_quality(Random& random) {
  MountingQuality quality;
  quality.verdict = Verdict::kWarn;
  quality.method = "camera-imu";
  quality.pictures = 9'007'199'254'740'995;
  quality.rotation_sigma = random.normal3().cwiseAbs();
  quality.translation_sigma = random.normal3().cwiseAbs();
  quality.time_offset_sigma_s = 1e-5 / 3;
  quality.line_delay_s = -2e-5 / 3;
  quality.line_delay_sigma_s = 1e-7 / 3;
  quality.reasons = {"hardly any turn about z"};
  return quality;
}

Rig full_rig() {
  Random random(11);
  Rig rig;
  rig.imu.emplace();
  rig.imu->rate_hz = 200;
  rig.imu->noise.gyroscope_noise_density = 1.0 / 3;
  rig.imu->noise.accelerometer_random_walk = 1e-300;
  rig.imu->gyroscope = random_triad(random);
  rig.imu->accelerometer = random_triad(random);
  rig.imu->noise_measured = {"gyroscope_noise_density", "accelerometer_noise_density"};
  rig.imu->gyroscope.quality = TriadQuality{};
  rig.imu->gyroscope.quality->method = "rest";
  rig.imu->accelerometer.quality = full_quality(random);
  rig.magnetometer.emplace();
  rig.magnetometer->triad = random_triad(random);
  for (int i = 0; i < 2; ++i) {
    CameraCalibration camera;
    camera.name = i == 0 ? "cam0" : "left: \"wide\" # 2";
    camera.width_px = 752;
    camera.height_px = 480;
    camera.intrinsics_px = {458.654, 457.296, 367.215, 248.375};
    camera.distortion_model = i == 0 ? DistortionModel::kRadtan : DistortionModel::kEquidistant;
    camera.distortion = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
    camera.T_body_camera = {random.rotation(), random.normal3()};
    camera.time_offset_s = -1.0 / 7;
    camera.rate_hz = 20;
    camera.intrinsics_quality = full_intrinsics_quality(random);
    camera.mounting_quality = full_mounting_quality(random);
    if (i == 1) camera.intrinsics_quality.emplace().method = "target";  // the rest is not known
    if (i == 1) camera.mounting_quality.emplace().method = "camera-imu";
    rig.cameras.push_back(camera);
  }
  rig.gps = GpsCalibration{{0.1, -0.2, 1.0 / 3}};
  rig.gps->time_offset_s = -0.2;
  rig.gps->time_offset_sigma_s = 1.0 / 3;
  ClockCalibration clock{"imu", "host", -50.0 / 3};
  rig.clocks.push_back(clock);
  clock.stream = "left: \"wide\" # 2";
  clock.reference = "gps";
  clock.skew_sigma_ppm = 0.01 / 3;
  clock.offset_sigma_s = 1e-6 / 3;
  clock.jitter_rms_s = 1e-3 / 3;
  clock.jitter_p99_s = 6e-3 / 7;
  rig.clocks.push_back(clock);
  return rig;
}

// NaN, not known, is the same as NaN.
template <class A, class B>
void expect_same_or_unknown(const A& a, const B& b) {
  const Eigen::MatrixXd x = Eigen::MatrixXd(a);
  const Eigen::MatrixXd y = Eigen::MatrixXd(b);
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    EXPECT_TRUE(x(i) == y(i) || (std::isnan(x(i)) && std::isnan(y(i)))) << x(i) << " " << y(i);
  }
}

void expect_same(double a, double b) {
  EXPECT_TRUE(a == b || (std::isnan(a) && std::isnan(b))) << a << " " << b;
}

void expect_same(const TriadCalibration& a, const TriadCalibration& b) {
  EXPECT_EQ(a.bias, b.bias);
  EXPECT_EQ(a.matrix, b.matrix);
  ASSERT_EQ(a.quality.has_value(), b.quality.has_value());
  if (!a.quality) return;
  EXPECT_EQ(a.quality->verdict, b.quality->verdict);
  EXPECT_EQ(a.quality->method, b.quality->method);
  EXPECT_EQ(a.quality->samples, b.quality->samples);
  expect_same_or_unknown(a.quality->bias_sigma, b.quality->bias_sigma);
  expect_same_or_unknown(a.quality->matrix_sigma, b.quality->matrix_sigma);
  expect_same(a.quality->residual_rms, b.quality->residual_rms);
  EXPECT_EQ(a.quality->reasons, b.quality->reasons);
}

void expect_same(const std::optional<IntrinsicsQuality>& a, const std::optional<IntrinsicsQuality>& b) {
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->verdict, b->verdict);
  EXPECT_EQ(a->method, b->method);
  EXPECT_EQ(a->pictures, b->pictures);
  expect_same_or_unknown(a->intrinsics_sigma_px, b->intrinsics_sigma_px);
  expect_same_or_unknown(a->distortion_sigma, b->distortion_sigma);
  expect_same(a->reprojection_rms_px, b->reprojection_rms_px);
  EXPECT_EQ(a->reasons, b->reasons);
}

void expect_same(const std::optional<MountingQuality>& a, const std::optional<MountingQuality>& b) {
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->verdict, b->verdict);
  EXPECT_EQ(a->method, b->method);
  EXPECT_EQ(a->pictures, b->pictures);
  expect_same_or_unknown(a->rotation_sigma, b->rotation_sigma);
  expect_same_or_unknown(a->translation_sigma, b->translation_sigma);
  expect_same(a->time_offset_sigma_s, b->time_offset_sigma_s);
  expect_same(a->line_delay_s, b->line_delay_s);
  expect_same(a->line_delay_sigma_s, b->line_delay_sigma_s);
  EXPECT_EQ(a->reasons, b->reasons);
}

class RigYaml : public testing::Test {
 protected:
  std::filesystem::path file(const std::string& name) const { return folder_.path() / name; }
  std::string rig_text() {
    write_rig(file("rig.yaml"), full_rig());
    return test::read_file(file("rig.yaml"));
  }
  // Reads the rig's text with one piece replaced by another.
  void expect_error(const std::string& from, const std::string& to, const std::vector<std::string>& parts) {
    std::string text = rig_text();
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from << " is not in\n" << text;
    text.replace(at, from.size(), to);
    expect_data_error([&] { read_rig(folder_.write("changed.yaml", text)); }, parts);
  }
  test::TempFolder folder_;
};

TEST_F(RigYaml, what_is_written_is_read_to_the_last_bit) {
  const Rig rig = full_rig();
  write_rig(file("rig.yaml"), rig);
  const Rig back = read_rig(file("rig.yaml"));
  ASSERT_TRUE(back.imu && back.magnetometer && back.gps);
  EXPECT_EQ(back.imu->rate_hz, rig.imu->rate_hz);
  EXPECT_EQ(back.imu->noise.gyroscope_noise_density, rig.imu->noise.gyroscope_noise_density);
  EXPECT_EQ(back.imu->noise.gyroscope_random_walk, rig.imu->noise.gyroscope_random_walk);
  EXPECT_EQ(back.imu->noise.accelerometer_noise_density, rig.imu->noise.accelerometer_noise_density);
  EXPECT_EQ(back.imu->noise.accelerometer_random_walk, rig.imu->noise.accelerometer_random_walk);
  EXPECT_EQ(back.imu->noise.gyroscope_bias_sigma, rig.imu->noise.gyroscope_bias_sigma);
  EXPECT_EQ(back.imu->noise.accelerometer_bias_sigma, rig.imu->noise.accelerometer_bias_sigma);
  expect_same(back.imu->gyroscope, rig.imu->gyroscope);
  expect_same(back.imu->accelerometer, rig.imu->accelerometer);
  expect_same(back.magnetometer->triad, rig.magnetometer->triad);
  EXPECT_EQ(back.imu->noise_measured, rig.imu->noise_measured);
  EXPECT_EQ(back.gps->antenna_in_body, rig.gps->antenna_in_body);
  EXPECT_EQ(back.gps->time_offset_s, rig.gps->time_offset_s);
  EXPECT_EQ(back.gps->time_offset_sigma_s, rig.gps->time_offset_sigma_s);
  ASSERT_EQ(back.clocks.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const ClockCalibration& a = back.clocks[i];
    const ClockCalibration& b = rig.clocks[i];
    EXPECT_EQ(a.stream, b.stream);
    EXPECT_EQ(a.reference, b.reference);
    EXPECT_EQ(a.skew_ppm, b.skew_ppm);
    expect_same(a.skew_sigma_ppm, b.skew_sigma_ppm);
    expect_same(a.offset_sigma_s, b.offset_sigma_s);
    expect_same(a.jitter_rms_s, b.jitter_rms_s);
    expect_same(a.jitter_p99_s, b.jitter_p99_s);
  }
  ASSERT_EQ(back.cameras.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const CameraCalibration& a = back.cameras[i];
    const CameraCalibration& b = rig.cameras[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.width_px, b.width_px);
    EXPECT_EQ(a.height_px, b.height_px);
    EXPECT_EQ(a.intrinsics_px, b.intrinsics_px);
    EXPECT_EQ(a.distortion_model, b.distortion_model);
    EXPECT_EQ(a.distortion, b.distortion);
    expect_same(a.intrinsics_quality, b.intrinsics_quality);
    expect_same(a.mounting_quality, b.mounting_quality);
    EXPECT_EQ(a.T_body_camera.rotation.coeffs(), b.T_body_camera.rotation.coeffs());
    EXPECT_EQ(a.T_body_camera.translation, b.T_body_camera.translation);
    EXPECT_EQ(a.time_offset_s, b.time_offset_s);
    EXPECT_EQ(a.rate_hz, b.rate_hz);
  }
  const std::string first = test::read_file(file("rig.yaml"));
  write_rig(file("rig.yaml"), back);
  EXPECT_EQ(test::read_file(file("rig.yaml")), first);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.path()), {}), 1) << "nothing temporary is left";
}

TEST_F(RigYaml, an_empty_rig_is_a_rig) {
  write_rig(file("rig.yaml"), Rig{});
  const Rig back = read_rig(file("rig.yaml"));
  EXPECT_FALSE(back.imu || back.magnetometer || back.gps);
  EXPECT_TRUE(back.cameras.empty());
}

TEST_F(RigYaml, the_text_of_the_header_is_read) {
  const Rig rig = read_rig(folder_.write("hand.yaml",
                                         "format: libloc-rig-1   # written by hand\n"
                                         "magnetometer:\n"
                                         "  bias: [1e-6, 0, 0]\n"
                                         "  matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
                                         "gps:\n"
                                         "  antenna_in_body: [0, 0, 0.5]\n"
                                         "...\n"));
  EXPECT_EQ(rig.magnetometer->triad.bias.x(), 1e-6);
  EXPECT_EQ(rig.gps->antenna_in_body.z(), 0.5);
  // Files from before these keys came.
  EXPECT_FALSE(rig.magnetometer->triad.quality);
  EXPECT_EQ(rig.gps->time_offset_s, 0);
  EXPECT_TRUE(std::isnan(rig.gps->time_offset_sigma_s));
  EXPECT_TRUE(rig.clocks.empty());
}

TEST_F(RigYaml, optional_keys_are_as_strict_as_the_others) {
  expect_error("verdict: warn", "verdict: good", {"changed.yaml:", "imu.accelerometer.quality.verdict", "'good'"});
  expect_error("verdict: warn", "verdikt: warn", {"imu.accelerometer.quality.verdict' is missing"});
  expect_error("bias_sigma: [", "bias_sigme: [", {"imu.accelerometer.quality.bias_sigme' is not known"});
  expect_error("samples: 0", "samples: 1.5", {"imu.gyroscope.quality.samples", "'1.5'", "whole"});
  expect_error("samples: 0", "samples: -5", {"imu.gyroscope.quality.samples", "-5"});
  expect_error("reasons: []", "reasons: [[]]", {"imu.gyroscope.quality.reasons", "list of words"});
  expect_error("reasons: []", "reasons: fine", {"imu.gyroscope.quality.reasons", "list of words"});
  expect_error("measured: [gyro", "measured: [gyra", {"changed.yaml", "noise_measured", "gyra"});
  expect_error("time_offset_s: -0.2", "time_offset: -0.2", {"gps.time_offset' is not known"});
  expect_error("time_offset_s: -0.2", "time_offset_s: 1e9", {"gps.time_offset_s", "a day"});
  expect_error("-0.2\n  time_offset_sigma_s: ", "-0.2\n  time_offset_sigma_s: -", {"gps.time_offset_sigma_s"});
  expect_error("reference: \"host\"", "referense: \"host\"", {"clocks[0].reference' is missing"});
  expect_error("stream: \"imu\"", "stream: \"imu\"\n    drift: 1", {"clocks[0].drift' is not known"});
  expect_error("skew_ppm: -16", "skew_ppm: -16000000", {"clocks.imu.skew_ppm"});
  expect_error("clocks:", "clocks: 1 #", {"changed.yaml"});
  expect_error("mounting_quality:", "mounting_qualitie:", {"cameras[0].mounting_qualitie' is not known"});
  const std::string mounting = "cameras[0].mounting_quality.";
  expect_error("method: \"camera-imu\"", "methot: \"camera-imu\"", {mounting + "method' is missing"});
  expect_error("pictures: 9007199254740995", "pictures: 1.5", {mounting + "pictures", "whole"});
  expect_error("rotation_sigma: [", "rotation_sigma: [0, ", {mounting + "rotation_sigma", "3 numbers"});
  expect_error("translation_sigma: [", "translation_sigmas: [", {mounting + "translation_sigmas' is not known"});
  expect_error("line_delay_s: -6.", "line_delay_s: -60000.", {"cam0.mounting_quality.line_delay_s = -0.06"});
}

TEST_F(RigYaml, an_update_changes_its_block_and_keeps_the_rest_bit_for_bit) {
  const Rig before = full_rig();
  write_rig(file("rig.yaml"), before);
  Rig expected = before;
  expected.magnetometer->triad.bias.x() = 7;
  expected.magnetometer->triad.quality.reset();
  write_rig(file("expected.yaml"), expected);
  const Rig written = update_rig(file("rig.yaml"), [](Rig& rig) {
    rig.magnetometer->triad.bias.x() = 7;
    rig.magnetometer->triad.quality.reset();
  });
  EXPECT_EQ(test::read_file(file("rig.yaml")), test::read_file(file("expected.yaml")));
  EXPECT_EQ(written.magnetometer->triad.bias.x(), 7);

  update_rig(file("new.yaml"), [](Rig& rig) { rig.gps = GpsCalibration{}; });
  EXPECT_TRUE(read_rig(file("new.yaml")).gps);
}

TEST_F(RigYaml, an_update_that_fails_leaves_the_file_as_it_was) {
  const std::string text = rig_text();
  EXPECT_THROW(update_rig(file("rig.yaml"), [](Rig& rig) { rig.imu->rate_hz = -1; }), std::invalid_argument);
  EXPECT_THROW(update_rig(file("rig.yaml"), [](Rig&) { throw std::runtime_error("no"); }), std::runtime_error);
  EXPECT_EQ(test::read_file(file("rig.yaml")), text);
  const auto change_nothing = [](Rig&) {};
  const auto damaged = folder_.write("damaged.yaml", text.substr(0, text.size() / 2));
  expect_data_error([&] { update_rig(damaged, change_nothing); }, {"damaged.yaml"});
  EXPECT_EQ(test::read_file(damaged).size(), text.size() / 2) << "not overwritten by an empty rig";
  std::filesystem::create_symlink("nowhere.yaml", file("link.yaml"));
  expect_data_error([&] { update_rig(file("link.yaml"), change_nothing); }, {"link.yaml", "no such file"});
  expect_data_error([&] { update_rig(folder_.path(), change_nothing); }, {"not a file"});
  expect_data_error([&] { update_rig(file("absent/rig.yaml"), change_nothing); }, {"rig.yaml", "cannot be written"});
}

TEST_F(RigYaml, links_and_permissions_stay) {
  namespace fs = std::filesystem;
  fs::create_directory(file("folder"));
  fs::create_symlink("folder/real.yaml", file("link.yaml"));
  fs::create_symlink("link.yaml", file("second.yaml"));
  expect_data_error([&] { write_rig(file("second.yaml"), Rig{}); }, {"second.yaml", "leads to no file"});
  write_rig(file("folder/real.yaml"), Rig{});
  const auto owner_only = fs::perms::owner_read | fs::perms::owner_write;
  fs::permissions(file("folder/real.yaml"), owner_only);
  update_rig(file("second.yaml"), [](Rig& rig) { rig.gps = GpsCalibration{}; });
  EXPECT_TRUE(fs::is_symlink(file("second.yaml")));
  EXPECT_TRUE(fs::is_symlink(file("link.yaml")));
  EXPECT_FALSE(fs::is_symlink(file("folder/real.yaml")));
  EXPECT_TRUE(read_rig(file("folder/real.yaml")).gps);
  EXPECT_EQ(fs::status(file("folder/real.yaml")).permissions(), owner_only);
  EXPECT_EQ(std::distance(fs::directory_iterator(file("folder")), fs::directory_iterator{}), 1) << "nothing is left";
  expect_data_error([&] { write_rig(file("folder"), Rig{}); }, {"folder", "no regular file"});
}

TEST_F(RigYaml, errors_name_file_line_and_key) {
  expect_error("rate_hz: 200", "rate_hx: 200", {"changed.yaml:", "'imu.rate_hz' is missing"});
  expect_error("imu:\n", "imu:\n  weight: 3\n", {"changed.yaml:3", "'imu.weight' is not known"});
  expect_error("rate_hz: 200", "rate_hz: fast", {"changed.yaml:3", "imu.rate_hz", "'fast'"});
  expect_error("rate_hz: 200", "rate_hz: nan", {"imu.rate_hz", "finite"});
  expect_error("rate_hz: 200", "rate_hz: 200 # ok\n  rate_hz: 100", {"changed.yaml:4", "imu.rate_hz", "twice"});
  expect_error("rate_hz: 200", "rate_hz: [200]", {"imu.rate_hz", "not a scalar"});
  expect_error("verdict: fair", "verdict: great", {"cameras[0].intrinsics_quality.verdict", "great"});
  expect_error("pictures: 9007199254740993", "pictures: many", {"cameras[0].intrinsics_quality.pictures", "many"});
  expect_error("pictures: 0", "pictures: -1", {"intrinsics_quality.pictures", "-1"});
  expect_error("[752, 480]", "[752]", {"cameras[0].resolution", "2 numbers"});
  expect_error("[752, 480]", "[752.5, 480]", {"cameras[0].resolution", "whole"});
  expect_error("radtan", "fisheye", {"cameras[0].distortion_model", "fisheye"});
  expect_error("libloc-rig-1", "libloc-rig-2", {"changed.yaml:1", "format"});
  expect_error("antenna_in_body: [0.1", "antenna_in_body: [[0.1]", {"gps.antenna_in_body"});
  expect_error("rate_hz: 200", "rate_hz: -1", {"changed.yaml", "imu.rate_hz", "-1"});
  expect_error("gps:", "gsp:", {"'gsp' is not known"});
  expect_error("imu:", "imu: [", {"changed.yaml:"});
  expect_error("q_wxyz: [", "q_wxyz: [1, ", {"q_wxyz", "4 numbers"});
  expect_data_error([&] { read_rig(file("none.yaml")); }, {"none.yaml", "no such file"});
  expect_data_error([&] { read_rig(folder_.path()); }, {"not a file"});
  std::filesystem::create_symlink("loop.yaml", file("loop.yaml"));
  expect_data_error([&] { read_rig(file("loop.yaml")); }, {"loop.yaml", "symbolic links"});
  expect_data_error([&] { read_rig(folder_.write("e.yaml", "")); }, {"empty"});
  expect_data_error([&] { read_rig(folder_.write("e.yaml", "- 1\n...\n")); }, {"must hold keys"});
}

TEST_F(RigYaml, quaternions_are_normalised_or_refused) {
  Rig rig;
  rig.cameras.push_back(full_rig().cameras[0]);
  rig.cameras[0].T_body_camera.rotation = Eigen::Quaterniond(1, 0, 0, 0);
  write_rig(file("rig.yaml"), rig);
  std::string text = test::read_file(file("rig.yaml"));
  const auto at = text.find("[1, 0, 0, 0]");
  ASSERT_NE(at, std::string::npos);
  const auto with = [&](const std::string& q) {
    std::string changed = text;
    return folder_.write("q.yaml", changed.replace(at, 12, q));
  };
  EXPECT_DOUBLE_EQ(read_rig(with("[0.7071, 0.7071, 0, 0]")).cameras[0].T_body_camera.rotation.norm(), 1);
  expect_data_error([&] { read_rig(with("[0.7, 0.7, 0, 0]")); }, {"q_wxyz", "norm"});
  rig.cameras[0].T_body_camera.rotation = Eigen::Quaterniond(1, 0.1, 0, 0);
  EXPECT_THROW(write_rig(file("rig.yaml"), rig), std::invalid_argument);
  EXPECT_EQ(test::read_file(file("rig.yaml")), text) << "the old file stays";
}

TEST_F(RigYaml, cut_at_any_byte_is_refused) {
  Rig rig = full_rig();
  rig.imu.reset();
  rig.cameras.resize(1);
  write_rig(file("rig.yaml"), rig);
  const std::string text = test::read_file(file("rig.yaml"));
  for (std::size_t size = 0; size < text.size(); ++size) {
    EXPECT_THROW(read_rig(folder_.write("cut.yaml", text.substr(0, size))), DataError) << size;
  }
  EXPECT_NO_THROW(read_rig(folder_.write("cut.yaml", text)));
}

TEST_F(RigYaml, carriage_returns_are_no_matter) {
  std::string text = rig_text();
  std::string dos;
  for (const char c : text) dos += c == '\n' ? std::string("\r\n") : std::string(1, c);
  EXPECT_EQ(read_rig(folder_.write("dos.yaml", dos)).cameras.size(), 2U);
}

const std::string kCamchain =
    "cam0:\n"
    "  T_cam_imu:\n"
    "  - [0.0, -1.0, 0.0, 0.1]\n"
    "  - [1.0, 0.0, 0.0, 0.2]\n"
    "  - [0.0, 0.0, 1.0, 0.3]\n"
    "  - [0.0, 0.0, 0.0, 1.0]\n"
    "  cam_overlaps: [1]\n"
    "  camera_model: pinhole\n"
    "  distortion_coeffs: [-0.28, 0.07, 0.0002, 1.7e-05]\n"
    "  distortion_model: radtan\n"
    "  intrinsics: [458.654, 457.296, 367.215, 248.375]\n"
    "  resolution: [752, 480]\n"
    "  rostopic: /cam0/image_raw\n"
    "  timeshift_cam_imu: 0.0025\n";

TEST_F(RigYaml, kalibr_gives_the_camera_from_the_imu_and_we_the_other_way_round) {
  const auto cameras = read_kalibr_camchain(folder_.write("camchain.yaml", kCamchain));
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_EQ(cameras[0].time_offset_s, 0.0025);
  EXPECT_EQ(cameras[0].distortion_model, DistortionModel::kRadtan);
  // The IMU's origin lies at (0.1, 0.2, 0.3) in the camera; the camera's in the IMU's axes at -R^T t.
  EXPECT_LT((cameras[0].T_body_camera.translation - Eigen::Vector3d(-0.2, 0.1, -0.3)).norm(), 1e-15);
  EXPECT_LT((cameras[0].T_body_camera * Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 1e-15);
  // x of the IMU is y of the camera.
  EXPECT_LT((cameras[0].T_body_camera.rotation * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitX()).norm(), 1e-15);
}

TEST_F(RigYaml, kalibr_files_that_are_written_are_read) {
  Rig rig = full_rig();
  rig.cameras[1].distortion_model = DistortionModel::kNone;
  rig.cameras[1].distortion.setZero();
  write_kalibr_camchain(file("camchain.yaml"), rig);
  write_kalibr_imu(file("imu.yaml"), rig);
  const auto cameras = read_kalibr_camchain(file("camchain.yaml"));
  ASSERT_EQ(cameras.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LT(cameras[i].T_body_camera.boxminus(rig.cameras[i].T_body_camera).norm(), 1e-14);
    EXPECT_EQ(cameras[i].intrinsics_px, rig.cameras[i].intrinsics_px);
    EXPECT_EQ(cameras[i].distortion, rig.cameras[i].distortion);
    EXPECT_EQ(cameras[i].distortion_model, rig.cameras[i].distortion_model);
    EXPECT_EQ(cameras[i].time_offset_s, rig.cameras[i].time_offset_s);
  }
  const ImuCalibration imu = read_kalibr_imu(file("imu.yaml"));
  EXPECT_EQ(imu.noise.gyroscope_noise_density, rig.imu->noise.gyroscope_noise_density);
  EXPECT_EQ(imu.noise.accelerometer_random_walk, rig.imu->noise.accelerometer_random_walk);
  EXPECT_EQ(imu.rate_hz, 200);
  EXPECT_THROW(write_kalibr_camchain(file("x.yaml"), Rig{}), std::invalid_argument);
  EXPECT_THROW(write_kalibr_imu(file("x.yaml"), Rig{}), std::invalid_argument);
}

// Kalibr's reader is PyYAML with checks by type: a float needs its point, 1e-05 is a word there.
TEST_F(RigYaml, numbers_are_written_as_kalibr_wants_them) {
  Rig rig = full_rig();
  for (CameraCalibration& camera : rig.cameras) {
    camera.intrinsics_px = {458, 457.5, 367, 248};
    camera.distortion = {1e-5, 0, -2e-300, 3e22};
    camera.time_offset_s = 0;
  }
  rig.cameras[1].distortion_model = DistortionModel::kNone;
  rig.cameras.push_back(rig.cameras[0]);
  write_kalibr_camchain(file("camchain.yaml"), rig);
  const std::string text = test::read_file(file("camchain.yaml"));
  const auto count = [&](const std::string& part) {
    std::size_t n = 0;
    for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
    return n;
  };
  EXPECT_EQ(count("  intrinsics: [458.0, 457.5, 367.0, 248.0]\n"), 3U) << text;
  EXPECT_EQ(count("  distortion_coeffs: [1.0e-05, 0.0, -2.0e-300, 3.0e+22]\n"), 2U) << text;
  EXPECT_EQ(count("  distortion_coeffs: []\n  distortion_model: none\n"), 1U) << text;
  EXPECT_EQ(count("  timeshift_cam_imu: 0.0\n"), 3U) << text;
  EXPECT_EQ(count("  - [0.0, 0.0, 0.0, 1.0]\n"), 5U) << "T_cam_imu of each, T_cn_cnm1 of two\n" << text;
  EXPECT_EQ(count("  resolution: [752, 480]\n"), 3U) << text;
  EXPECT_LT(text.find("cam_overlaps: [1]"), text.find("cam_overlaps: [0, 2]"));
  EXPECT_EQ(count("cam_overlaps: [1]\n"), 2U) << text;
  EXPECT_EQ(read_kalibr_camchain(file("camchain.yaml"))[2].distortion, rig.cameras[2].distortion);

  rig.imu->noise.gyroscope_random_walk = 2e-5;
  write_kalibr_imu(file("imu.yaml"), rig);
  const std::string imu = test::read_file(file("imu.yaml"));
  EXPECT_NE(imu.find("gyroscope_random_walk: 2.0e-05\n"), std::string::npos) << imu;
  EXPECT_NE(imu.find("update_rate: 200.0\n"), std::string::npos) << imu;
}

TEST_F(RigYaml, a_camchain_tells_where_each_camera_is_by_the_one_before) {
  Rig rig = full_rig();
  rig.cameras[0].time_offset_s = 0.002;  // a stamp of the camera's clock plus this is the IMU's
  write_kalibr_camchain(file("camchain.yaml"), rig);
  io::YamlBlock chain = io::YamlBlock::load(file("camchain.yaml"), false);
  io::YamlBlock first = chain.block("cam0");
  io::YamlBlock second = chain.block("cam1");
  EXPECT_FALSE(first.has("T_cn_cnm1"));
  EXPECT_EQ(first.number("timeshift_cam_imu"), 0.002);
  const Eigen::Vector4d in_body(0.4, -1, 2, 1);
  const Eigen::Vector4d in_first = first.matrix("T_cam_imu", 4, 4) * in_body;
  const Eigen::Vector4d in_second = second.matrix("T_cam_imu", 4, 4) * in_body;
  EXPECT_LT((in_first.head<3>() - rig.cameras[0].T_body_camera.inverse() * in_body.head<3>()).norm(), 1e-14);
  EXPECT_LT((second.matrix("T_cn_cnm1", 4, 4) * in_first - in_second).norm(), 1e-14);
}

TEST_F(RigYaml, a_camchain_without_imu_is_chained_from_the_first_camera) {
  Rig rig = full_rig();
  rig.cameras[0].T_body_camera = Pose3{};
  write_kalibr_camchain(file("camchain.yaml"), rig);
  std::string text = test::read_file(file("camchain.yaml"));
  for (auto at = text.find("T_cam_imu:"); at != std::string::npos; at = text.find("T_cam_imu:")) {
    text.replace(at, 10, "T_unused:");
  }
  const auto cameras = read_kalibr_camchain(folder_.write("cams.yaml", text));
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_LT(cameras[1].T_body_camera.boxminus(rig.cameras[1].T_body_camera).norm(), 1e-14);
}

TEST_F(RigYaml, errors_in_foreign_files_name_file_line_and_key) {
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = kCamchain;
    text.replace(text.find(from), from.size(), to);
    return folder_.write("c.yaml", text);
  };
  expect_data_error([&] { read_kalibr_camchain(changed("pinhole", "omni")); }, {"c.yaml:8", "camera_model"});
  expect_data_error([&] { read_kalibr_camchain(changed("[1.0, 0.0, 0.0, 0.2]", "[1.0, 0.5, 0.0, 0.2]")); },
                    {"c.yaml", "cam0.T_cam_imu"});
  expect_data_error([&] { read_kalibr_camchain(changed("timeshift_cam_imu", "timeshift")); }, {"timeshift_cam_imu"});
  expect_data_error([&] { read_kalibr_camchain(changed("cam0", "camera")); }, {"no cam0"});
  expect_data_error([&] { read_kalibr_camchain(changed("0.0025\n", "0.0025")); }, {"cut"});
  for (std::size_t size = 0; size < kCamchain.size(); ++size) {
    EXPECT_THROW(read_kalibr_camchain(folder_.write("cut.yaml", kCamchain.substr(0, size))), DataError) << size;
  }
}

TEST_F(RigYaml, a_camchain_with_a_gap_is_refused) {
  const auto numbered = [&](const std::string& second) {
    std::string more = kCamchain;
    return folder_.write("c.yaml", kCamchain + more.replace(0, 4, second));
  };
  EXPECT_NO_THROW(read_kalibr_camchain(numbered("cam1")));
  for (const std::string second : {"cam2", "cam01", "cam10"}) {
    expect_data_error([&] { read_kalibr_camchain(numbered(second)); }, {"c.yaml:16", "'" + second + "'", "cam1"});
    expect_data_error([&] { read_any_rig(numbered(second)); }, {second});
  }
  EXPECT_EQ(read_kalibr_camchain(folder_.write("c.yaml", kCamchain + "camera_note: x\n")).size(), 1U);
}

TEST_F(RigYaml, a_kalibr_imu_that_needs_more_than_noise_is_refused) {
  const std::string imu =
      "imu0:\n"
      "  T_i_b:\n"
      "  - [1.0, 0.0, 0.0, 0.0]\n"
      "  - [0.0, 1.0, 0.0, 0.0]\n"
      "  - [0.0, 0.0, 1.0, 0.0]\n"
      "  - [0.0, 0.0, 0.0, 1.0]\n"
      "  accelerometer_noise_density: 0.002\n"
      "  accelerometer_random_walk: 0.003\n"
      "  gyroscope_noise_density: 0.0002\n"
      "  gyroscope_random_walk: 0.00002\n"
      "  model: calibrated\n"
      "  rostopic: /imu0\n"
      "  time_offset: 0.0\n"
      "  update_rate: 200.0\n";
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = imu;
    text.replace(text.find(from), from.size(), to);
    return folder_.write("i.yaml", text);
  };
  EXPECT_EQ(read_kalibr_imu(folder_.write("i.yaml", imu)).noise.accelerometer_random_walk, 0.003);
  expect_data_error([&] { read_kalibr_imu(changed("calibrated", "scale-misalignment")); },
                    {"i.yaml:11", "imu0.model", "scale-misalignment"});
  expect_data_error([&] { read_kalibr_imu(changed("0.0, 0.0]", "0.0, 0.1]")); }, {"i.yaml:3", "imu0.T_i_b"});
  expect_data_error([&] { read_kalibr_imu(changed("[1.0, 0.0", "[0.5, 0.0")); }, {"imu0.T_i_b"});
  expect_data_error([&] { read_kalibr_imu(changed("offset: 0.0", "offset: 0.1")); }, {"i.yaml:13", "imu0.time_offset"});
  for (const std::string key : {"accelerometers", "gyroscopes"}) {
    const std::string block = "  " + key + ":\n    M: [[1.1, 0, 0], [0, 1, 0], [0, 0, 1]]\n  model";
    expect_data_error([&] { read_kalibr_imu(changed("  model", block)); }, {"imu0." + key});
    expect_data_error([&] { read_any_rig(changed("  model", block)); }, {"imu0." + key});
  }
}

TEST_F(RigYaml, the_locale_does_not_matter) {
  const test::CommaLocale locale;
  Rig rig = full_rig();
  rig.cameras[0].width_px = 1280;
  write_rig(file("rig.yaml"), rig);
  EXPECT_EQ(read_rig(file("rig.yaml")).cameras[0].width_px, 1280);
  EXPECT_EQ(read_rig(file("rig.yaml")).cameras[0].time_offset_s, -1.0 / 7);
  write_kalibr_camchain(file("camchain.yaml"), rig);
  EXPECT_EQ(read_kalibr_camchain(file("camchain.yaml"))[0].width_px, 1280);
}

TEST_F(RigYaml, reads_the_sensor_files_of_euroc) {
  LOC_DATA_OR_SKIP(imu_file, "euroc-v101-tracks/imu0-sensor.yaml");
  LOC_DATA_OR_SKIP(camera_file, "euroc-v101-tracks/cam0-sensor.yaml");
  const ImuCalibration imu = read_euroc_imu(imu_file);
  EXPECT_EQ(imu.rate_hz, 200);
  EXPECT_EQ(imu.noise.gyroscope_noise_density, 1.6968e-04);
  EXPECT_EQ(imu.noise.accelerometer_random_walk, 3e-3);
  const CameraCalibration camera = read_euroc_camera(camera_file);
  EXPECT_EQ(camera.intrinsics_px, Eigen::Vector4d(458.654, 457.296, 367.215, 248.375));
  EXPECT_EQ(camera.distortion_model, DistortionModel::kRadtan);
  EXPECT_EQ(camera.rate_hz, 20);
  EXPECT_LT(
      (camera.T_body_camera.translation - Eigen::Vector3d(-0.0216401454975, -0.064676986768, 0.00981073058949)).norm(),
      1e-12);
  // The camera looks along +y … of the body: z of the camera in body axes is the third column of T_BS.
  EXPECT_NEAR((camera.T_body_camera.rotation * Eigen::Vector3d::UnitZ()).z(), 0.999660727178, 1e-9);
  EXPECT_EQ(read_any_rig(camera_file).cameras.size(), 1U);
  EXPECT_TRUE(read_any_rig(imu_file).imu);
}

TEST_F(RigYaml, the_kind_of_a_file_is_found_out) {
  write_rig(file("rig.yaml"), full_rig());
  EXPECT_EQ(read_any_rig(file("rig.yaml")).cameras.size(), 2U);
  EXPECT_EQ(read_any_rig(folder_.write("camchain.yaml", kCamchain)).cameras.size(), 1U);
  write_kalibr_imu(file("imu.yaml"), full_rig());
  EXPECT_TRUE(read_any_rig(file("imu.yaml")).imu);
  expect_data_error([&] { read_any_rig(folder_.write("other.yaml", "a: 1\n")); }, {"other.yaml", "neither"});
}

}  // namespace
}  // namespace loc
