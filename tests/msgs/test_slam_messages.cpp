// SLAM over LCM and in files: frames, maps, saved states, settings.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <functional>
#include <sstream>

#include "libloc/estimators/inertial_slam.hpp"
#include "libloc/estimators/mono_slam.hpp"
#include "libloc/io/slam_yaml.hpp"
#include "loc/slam_state_t.hpp"
#include "msgs/decode.hpp"
#include "msgs/slam_file.hpp"
#include "msgs/slam_messages.hpp"
#include "tests/support/lcm_messages.hpp"
#include "tests/support/slam_tracks.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

using test::encode;
using test::expect_data_error;

// Of the same bits, NaN included.
::testing::AssertionResult same(double a, double b) {
  if (std::memcmp(&a, &b, sizeof a) == 0) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << a << " and " << b;
}
template <class A, class B>
::testing::AssertionResult same_matrix(const A& a, const B& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols()) return ::testing::AssertionFailure() << "sizes differ";
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    if (const auto result = same(a.reshaped()[i], b.reshaped()[i]); !result) return result;
  }
  return ::testing::AssertionSuccess();
}

class SlamMessages : public testing::Test {
 protected:
  static SlamOptions options() {
    SlamOptions options;
    options.camera = test::slam_tracks(0).camera;
    options.map.max_linearity_index = 0.2;  // points of both kinds soon
    options.q_world_body.emplace(Eigen::Quaterniond::Identity());
    return options;
  }
  // After 3 s, with points of both kinds.
  static const MonoSlam& slam() {
    static const MonoSlam ready = [] {
      MonoSlam slam(options());
      for (const FeaturesMeasurement& frame : test::slam_tracks(3).frames) slam.process(frame);
      return slam;
    }();
    return ready;
  }
  std::filesystem::path path() const { return folder_.path() / "map.slam"; }
  std::string saved() const {
    save_slam(path(), slam().snapshot(), slam().options());
    return test::read_file(path());
  }
  test::TempFolder folder_;
};

TEST_F(SlamMessages, fingerprints_are_frozen) {
  EXPECT_EQ(static_cast<std::uint64_t>(slam_frame_t::getHash()), 0x494bfff77a74f59aU);
  EXPECT_EQ(static_cast<std::uint64_t>(slam_state_t::getHash()), 0x179aa043b2ba5005U);
}

TEST_F(SlamMessages, a_frame_comes_back_bit_for_bit) {
  const SlamFrame& frame = slam().frame();
  ASSERT_GT(frame.features.size(), 20U);
  ASSERT_GT(frame.counts.measured, 10);
  const Bytes bytes = encode(to_message(frame));
  const SlamFrame back = from_message(decode_message<slam_frame_t>(bytes));
  EXPECT_EQ(back.time_ns, frame.time_ns);
  EXPECT_EQ(back.host_time_ns, frame.host_time_ns);
  EXPECT_EQ(back.sequence, frame.sequence);
  EXPECT_EQ(back.estimate.status & kScaleUnknown, kScaleUnknown);
  EXPECT_EQ(back.counts.in_frame, frame.counts.in_frame);
  EXPECT_EQ(back.counts.visible, frame.counts.visible);
  EXPECT_EQ(back.counts.measured, frame.counts.measured);
  EXPECT_EQ(back.counts.map, frame.counts.map);
  EXPECT_TRUE(same(back.reprojection_before_px, frame.reprojection_before_px));
  EXPECT_TRUE(same(back.reprojection_after_px, frame.reprojection_after_px));
  EXPECT_TRUE(same(back.nis, frame.nis));
  EXPECT_EQ(back.nis_dim, frame.nis_dim);
  EXPECT_TRUE(same_matrix(back.camera_position, frame.camera_position));
  EXPECT_TRUE(same_matrix(back.q_world_camera.coeffs(), frame.q_world_camera.coeffs()));
  ASSERT_EQ(back.features.size(), frame.features.size());
  for (std::size_t i = 0; i < frame.features.size(); ++i) {
    const SlamFeature& a = back.features[i];
    const SlamFeature& b = frame.features[i];
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.state, b.state);
    EXPECT_EQ(a.converted, b.converted);
    EXPECT_TRUE(same_matrix(a.pixel_px, b.pixel_px));
    EXPECT_TRUE(same_matrix(a.predicted_px, b.predicted_px));
    EXPECT_TRUE(same_matrix(a.estimated_px, b.estimated_px));
    EXPECT_TRUE(same(a.innovation_cov(0, 0), b.innovation_cov(0, 0)));
    EXPECT_TRUE(same(a.innovation_cov(0, 1), b.innovation_cov(0, 1)));
    EXPECT_TRUE(same(a.innovation_cov(1, 1), b.innovation_cov(1, 1)));
    EXPECT_TRUE(same(a.inverse_depth, b.inverse_depth));
    EXPECT_TRUE(same(a.sigma_inverse_depth, b.sigma_inverse_depth));
  }
}

TEST_F(SlamMessages, cut_and_wrong_frames_are_refused) {
  SlamFrame frame = slam().frame();
  frame.features.resize(2);
  const Bytes bytes = encode(to_message(frame));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_THROW(decode_message<slam_frame_t>(std::span(bytes).first(size)), DataError) << size;
  }
  slam_frame_t message = to_message(frame);
  message.feature_state[1] = 5;
  expect_data_error([&] { from_message(message); }, {"feature_state", "5"});
  message = to_message(frame);
  message.u_px.pop_back();
  expect_data_error([&] { from_message(message); }, {"size = 2"});
  message = to_message(frame);
  message.time_ns = kNoTime;
  expect_data_error([&] { from_message(message); }, {"time_ns"});
}

TEST_F(SlamMessages, the_map_has_what_is_finite) {
  std::vector<SlamMapPoint> map = slam().map();
  ASSERT_GT(map.size(), 20U);
  map[1].position.setConstant(kUnknown);
  const map_points_t message = to_message(slam().frame(), map);
  EXPECT_EQ(message.time_ns, slam().frame().time_ns);
  ASSERT_EQ(message.size, static_cast<std::int32_t>(map.size()) - 1);
  EXPECT_EQ(message.point_id[1], map[2].id);
  EXPECT_EQ(message.position[1][2], map[2].position.z());
  EXPECT_EQ(message.position_cov[1][5], map[2].position_cov(1, 2));
  EXPECT_EQ(encode(decode_message<map_points_t>(encode(message))), encode(message));
}

// Saved, loaded and gone on: the same as if nothing had been.
TEST_F(SlamMessages, a_saved_state_comes_back_bit_for_bit) {
  const auto tracks = test::slam_tracks(4);
  MonoSlam straight(options());
  MonoSlam second(options());
  bool saved = false;
  for (std::size_t i = 0; i < tracks.frames.size(); ++i) {
    // As soon as there are points of both kinds.
    const auto map = straight.map();
    const auto xyz = std::count_if(map.begin(), map.end(), [](const SlamMapPoint& point) { return point.converted; });
    if (!saved && i > 20 && xyz > 0 && xyz < static_cast<std::ptrdiff_t>(map.size())) {
      saved = true;
      save_slam(path(), straight.snapshot(), straight.options());
      const SlamFile file = load_slam(path());
      EXPECT_EQ(why_not_restorable(file, second.options()), "");
      EXPECT_EQ(file.options, slam_options_text(straight.options()));
      const SlamSnapshot a = straight.snapshot();
      const SlamSnapshot& b = file.snapshot;
      EXPECT_EQ(a.time_ns, b.time_ns);
      EXPECT_TRUE(same_matrix(a.covariance, b.covariance));
      EXPECT_TRUE(same_matrix(a.state.q_world_body.coeffs(), b.state.q_world_body.coeffs()));
      EXPECT_TRUE(same_matrix(a.state.angular_velocity, b.state.angular_velocity));
      ASSERT_EQ(a.landmarks.size(), b.landmarks.size());
      int converted = 0;
      for (std::size_t k = 0; k < a.landmarks.size(); ++k) {
        EXPECT_EQ(a.landmarks[k].id, b.landmarks[k].id);
        EXPECT_EQ(a.landmarks[k].offset, b.landmarks[k].offset);
        EXPECT_EQ(a.landmarks[k].measured, b.landmarks[k].measured);
        EXPECT_EQ(a.landmarks[k].last_measured_ns, b.landmarks[k].last_measured_ns);
        EXPECT_TRUE(same(a.landmarks[k].hits, b.landmarks[k].hits));
        EXPECT_TRUE(same_matrix(a.landmarks[k].point.position, b.landmarks[k].point.position));
        EXPECT_TRUE(same_matrix(a.landmarks[k].point.inverse_depth.frame.coeffs(),
                                b.landmarks[k].point.inverse_depth.frame.coeffs()));
        EXPECT_TRUE(
            same(a.landmarks[k].first.inverse_depth.inverse_depth, b.landmarks[k].first.inverse_depth.inverse_depth));
        converted += a.landmarks[k].point.converted ? 1 : 0;
      }
      EXPECT_GT(converted, 0);
      EXPECT_LT(converted, static_cast<int>(a.landmarks.size())) << "both kinds";
      second.restore(file.snapshot);
      EXPECT_EQ(second.map().size(), straight.map().size());
    }
    straight.process(tracks.frames[i]);
    if (saved) {
      EXPECT_TRUE(second.process(tracks.frames[i]));
    }
  }
  ASSERT_TRUE(saved);
  // restore() does not know how long the pause was: wider, not elsewhere.
  EXPECT_LT((second.estimate().position - straight.estimate().position).norm(), 0.05);
}

TEST_F(SlamMessages, an_inertial_state_comes_back_too) {
  SlamOptions inertial = options();
  inertial.motion = SlamMotion::kInertial;
  inertial.estimate_extrinsics = true;
  inertial.estimate_time_offset = true;
  InertialSlam slam(inertial);
  const auto tracks = test::slam_tracks(2.5);
  std::size_t next = 0;
  for (const ImuMeasurement& imu : tracks.samples) {
    if (next < tracks.frames.size() && tracks.frames[next].time_ns <= imu.time_ns) slam.process(tracks.frames[next++]);
    slam.process(imu);
  }
  ASSERT_TRUE(slam.running());
  const SlamSnapshot a = slam.snapshot();
  save_slam(path(), a, inertial);
  const SlamFile file = load_slam(path());
  EXPECT_EQ(file.motion, SlamMotion::kInertial);
  EXPECT_TRUE(same_matrix(a.covariance, file.snapshot.covariance));
  EXPECT_TRUE(same_matrix(a.state.gyroscope_bias, file.snapshot.state.gyroscope_bias));
  EXPECT_TRUE(same_matrix(a.state.accelerometer_bias, file.snapshot.state.accelerometer_bias));
  EXPECT_TRUE(same_matrix(a.state.T_body_camera.translation, file.snapshot.state.T_body_camera.translation));
  EXPECT_TRUE(same(a.state.time_offset_s, file.snapshot.state.time_offset_s));
  EXPECT_EQ(why_not_restorable(file, options()), "it was made with an IMU");
}

TEST_F(SlamMessages, a_file_that_is_not_whole_is_refused) {
  const std::string whole = saved();
  const auto refused = [&](const std::string& bytes, const std::vector<std::string>& parts) {
    folder_.write("map.slam", bytes);
    expect_data_error([&] { load_slam(path()); }, parts);
  };
  for (const std::size_t size : {std::size_t{0}, std::size_t{5}})
    refused(whole.substr(0, size), {"map.slam", "no saved"});
  refused(whole.substr(0, 12), {"map.slam", "cut"});
  for (const std::size_t size : {std::size_t{20}, whole.size() / 2, whole.size() - 1}) {
    refused(whole.substr(0, size), {"map.slam", "it was cut"});
  }
  refused(whole + "x", {"added"});
  for (const std::size_t at : {std::size_t{17}, std::size_t{30}, whole.size() / 2, whole.size() - 1}) {
    std::string changed = whole;
    changed[at] ^= 0x10;
    refused(changed, {"checksum"});
  }
  std::string later = whole;
  later[7] = '2';
  refused(later, {"LOCSLAM2", "LOCSLAM1"});
  refused("ply\nformat ascii 1.0\n", {"no saved state"});
  expect_data_error([&] { load_slam(folder_.path() / "none"); }, {"none", "no such file"});
  expect_data_error([&] { load_slam(folder_.path()); }, {"cannot be read"});
}

// A message whose checksum is right may still be nonsense.
TEST_F(SlamMessages, a_state_that_does_not_fit_is_refused) {
  const std::string whole = saved();
  const Bytes payload(whole.begin() + 20, whole.end());
  for (std::size_t size = 0; size < payload.size(); size += size < 1000 ? 1 : 997) {
    EXPECT_THROW(decode_message<slam_state_t>(std::span(payload).first(size)), DataError) << size;
  }
  const auto refused = [&](const std::function<void(slam_state_t&)>& change, const std::string& part) {
    auto message = decode_message<slam_state_t>(payload);
    change(message);
    const Bytes bytes = encode(message);
    std::string file = "LOCSLAM1";
    for (int i = 7; i >= 0; --i) file += static_cast<char>(bytes.size() >> (8 * i) & 0xff);
    const std::uint32_t sum = static_cast<std::uint32_t>(::crc32(0, bytes.data(), static_cast<unsigned>(bytes.size())));
    for (int i = 3; i >= 0; --i) file += static_cast<char>(sum >> (8 * i) & 0xff);
    file.append(bytes.begin(), bytes.end());
    folder_.write("map.slam", file);
    if (part.empty()) {
      EXPECT_NO_THROW(load_slam(path()));
    } else {
      expect_data_error([&] { load_slam(path()); }, {"map.slam", part});
    }
  };
  refused([](slam_state_t&) {}, "");
  refused([](slam_state_t& m) { m.dim -= 1; }, "dim");
  refused([](slam_state_t& m) { m.converted[0] ^= 1; }, "dim");
  refused([](slam_state_t& m) { m.covariance[3] = kUnknown; }, "covariance");
  refused([](slam_state_t& m) { m.q_world_body_wxyz[0] = 3; }, "q_world_body_wxyz");
  refused([](slam_state_t& m) { m.point[2][3] = kUnknown; }, "point");
  refused([](slam_state_t& m) { m.distortion_model = 9; }, "distortion_model");
  refused([](slam_state_t& m) { m.width_px = 0; }, "resolution");
  refused([](slam_state_t& m) { m.time_ns = kNoTime; }, "time_ns");
}

TEST_F(SlamMessages, another_camera_is_told) {
  saved();
  const SlamFile file = load_slam(path());
  const auto why = [&](const std::function<void(CameraCalibration&)>& change) {
    SlamOptions other = options();
    change(other.camera);
    return why_not_restorable(file, other);
  };
  EXPECT_EQ(why([](CameraCalibration&) {}), "");
  EXPECT_NE(why([](CameraCalibration& c) { c.width_px = 800; }), "");
  EXPECT_NE(why([](CameraCalibration& c) { c.intrinsics_px[1] += 0.1; }), "");
  EXPECT_NE(why([](CameraCalibration& c) { c.distortion_model = DistortionModel::kRadtan; }), "");
  EXPECT_NE(why([](CameraCalibration& c) { c.T_body_camera.translation.x() += 0.01; }), "");
  EXPECT_THROW(save_slam(path(), {}, options()), std::invalid_argument) << "has no time";
}

TEST_F(SlamMessages, settings_come_back_from_their_file) {
  SlamOptions changed = options();
  changed.motion = SlamMotion::kInertial;
  changed.consistency = SlamConsistency::kFirstEstimate;
  changed.precision = SlamPrecision::kFloat;
  changed.position = {1, 2, 1.0 / 3};
  changed.q_world_body = so3::exp({0.1, 0.2, 0.3});
  changed.imu_noise.accelerometer_random_walk = 0.125;
  changed.landmarks = {{7, {1, 2, 3}, 0.01}, {9, {4, 5, 6}, 0.5}};
  changed.map.max_features = 33;
  changed.map.depth_from_neighbours = false;
  changed.association.seed = 77;
  changed.start.heading = 0.7;
  changed.stand_still.min_speed = 0.123;
  changed.lost_after_s = 0.75;
  changed.relocate_s = 2.5;
  write_slam_options(folder_.path() / "s.yaml", changed);
  const SlamOptions back = read_slam_options(folder_.path() / "s.yaml");
  EXPECT_EQ(slam_options_text(back), slam_options_text(changed));
  EXPECT_NE(slam_options_text(back), slam_options_text(options()));
  EXPECT_EQ(back.motion, SlamMotion::kInertial);
  EXPECT_EQ(back.consistency, SlamConsistency::kFirstEstimate);
  EXPECT_EQ(back.precision, SlamPrecision::kFloat);
  EXPECT_TRUE(same_matrix(back.position, changed.position));
  EXPECT_TRUE(same_matrix(back.q_world_body->coeffs(), changed.q_world_body->coeffs()));
  ASSERT_EQ(back.landmarks.size(), 2U);
  EXPECT_EQ(back.landmarks[1].id, 9);
  EXPECT_EQ(back.landmarks[1].position, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(back.map.max_features, 33);
  EXPECT_FALSE(back.map.depth_from_neighbours);
  EXPECT_EQ(back.association.seed, 77U);
  EXPECT_EQ(back.start.heading, 0.7);
  EXPECT_EQ(back.stand_still.min_speed, 0.123);
  EXPECT_EQ(back.lost_after_s, 0.75);
  EXPECT_EQ(back.relocate_s, 2.5);
}

// The name that a line of a struct declares, "  double name = 1;  ///< …": empty when it is no field.
std::string field_of(const std::string& line) {
  if (line.size() < 3 || line.compare(0, 2, "  ") != 0 || line[2] == ' ' || line[2] == '/') return {};
  if (line.compare(2, 6, "using ") == 0 || line.compare(2, 7, "static ") == 0) return {};
  const std::size_t end = std::min(line.find(" = "), std::min(line.find('{'), line.find(';')));
  if (end == std::string::npos || line.find(';') == std::string::npos || line.find('(') < end) return {};
  const std::size_t space = line.rfind(' ', end - 1);
  const std::string name = line.substr(space + 1, end - space - 1);
  const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::islower(c) != 0 || std::isdigit(c) != 0 || c == '_';
  });
  return plain ? name : std::string();
}

// No field of the settings is left out: their names are looked up in the headers.
TEST_F(SlamMessages, the_file_of_settings_has_every_field) {
  SlamOptions all = options();
  all.q_world_body.emplace(Eigen::Quaterniond::Identity());
  all.start.heading = 1;
  all.landmarks.emplace_back();
  const std::string text = slam_options_text(all);
  int found = 0;
  const auto look = [&](const std::string& header, const std::string& name) {
    const std::string source = test::read_file(std::filesystem::path(LOC_SOURCE_DIR) / "libloc" / header);
    const auto begin = source.find("struct " + name + " {");
    ASSERT_NE(begin, std::string::npos) << name;
    std::istringstream lines(source.substr(begin, source.find("\n};", begin) - begin));
    for (std::string line; std::getline(lines, line);) {
      const std::string key = field_of(line);
      if (key.empty() || key == "camera") continue;
      ++found;
      EXPECT_TRUE(text.find("\n" + key + ":") != std::string::npos || text.find(" " + key + ":") != std::string::npos)
          << name << "." << key;
    }
  };
  look("estimators/slam_options.hpp", "SlamOptions");
  look("estimators/slam_options.hpp", "SlamMapOptions");
  look("estimators/slam_options.hpp", "SlamAssociationOptions");
  look("estimators/slam_options.hpp", "KnownLandmark");
  look("estimators/slam_start.hpp", "SlamStartOptions");
  look("estimators/fusion_start.hpp", "FusionStartOptions");
  look("estimators/stand_still.hpp", "StandStillOptions");
  look("sensors/imu_noise.hpp", "ImuNoise");
  EXPECT_GT(found, 110);
}

TEST_F(SlamMessages, settings_that_are_wrong_are_named) {
  const auto refused = [&](const std::string& text, const std::vector<std::string>& parts) {
    const auto file = folder_.write("s.yaml", text);
    expect_data_error([&] { read_slam_options(file); }, parts);
  };
  const std::string head = "format: libloc-slam-1\n";
  refused("sigma_px: 1\n", {"s.yaml", "format"});
  refused(head + "sigma: 1\n", {"s.yaml:2", "sigma"});
  refused(head + "map:\n  max_feature: 1\n", {"s.yaml:3", "map.max_feature"});
  refused(head + "sigma_px: one\n", {"s.yaml:2", "sigma_px"});
  refused(head + "sigma_px: 1\nsigma_px: 2\n", {"sigma_px", "twice"});
  refused(head + "motion: walking\n", {"s.yaml:2", "walking", "inertial"});
  refused(head + "zero_velocity: 1\n", {"zero_velocity", "true"});
  refused(head + "map:\n  max_features: 4294967297\n", {"max_features", "range"});
  refused(head + "association:\n  seed: -1\n", {"seed", "range"});
  refused(head + "q_world_body: [1, 1, 0, 0]\n", {"q_world_body", "norm"});
  const SlamOptions kept = read_slam_options(folder_.write("s.yaml", head + "sigma_px: 2\n"), options());
  EXPECT_EQ(kept.sigma_px, 2);
  EXPECT_EQ(kept.camera.width_px, 640) << "what the file does not say, stays";
}

}  // namespace
}  // namespace loc
