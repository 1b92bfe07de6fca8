// loc-estimator --method mono-slam and inertial-slam as processes: off line, live, replayed, with a map saved and
// loaded.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "libloc/io/lcm_log.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "libloc/io/tum.hpp"
#include "loc/source_status_t.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"
#include "msgs/slam_file.hpp"
#include "msgs/slam_messages.hpp"
#include "program_test.hpp"
#include "tests/support/lcm_messages.hpp"
#include "tests/support/slam_tracks.hpp"
#include "tests/support/temp_folder.hpp"
#include "tools/support/lcm_link.hpp"

namespace loc::test {
namespace {

// As GTSAM's EqVIO example has it.
void write_eqvio(const std::string& file, const SlamTracks& tracks) {
  std::ofstream out(file);
  out.precision(17);
  out << "row_type,t_abs,t_rel,seq,frame_idx,landmark_id,gx,gy,gz,ax,ay,az,bgx,bgy,bgz,bax,bay,baz,u_norm,v_norm,key,"
         "value\n";
  const auto meta = [&](const char* key, auto value) {
    out << "meta,,,,,,,,,,,,,,,,,,,," << key << ',' << value << '\n';
  };
  meta("format_version", 1);
  meta("measurement_space", "normalized");
  const Eigen::Vector4d& k = tracks.camera.intrinsics_px;
  const Eigen::Quaterniond& q = tracks.camera.T_body_camera.rotation;
  meta("camera_fx", k[0]), meta("camera_fy", k[1]), meta("camera_cx", k[2]), meta("camera_cy", k[3]);
  meta("T_ci_tx", 0), meta("T_ci_ty", 0), meta("T_ci_tz", 0);
  meta("T_ci_qw", q.w()), meta("T_ci_qx", q.x()), meta("T_ci_qy", q.y()), meta("T_ci_qz", q.z());
  std::size_t next = 0;
  for (const ImuMeasurement& imu : tracks.samples) {
    const std::string time = format_seconds(imu.time_ns);
    for (; next < tracks.frames.size() && tracks.frames[next].time_ns <= imu.time_ns; ++next) {
      for (const FeatureObservation& f : tracks.frames[next].features) {
        const Eigen::Vector2d uv = (f.pixel_px - k.tail<2>()).cwiseQuotient(k.head<2>());
        out << "vision_feature," << time << ",0,0," << next << ',' << f.id << ",,,,,,,,,,,,," << uv.x() << ',' << uv.y()
            << ",,\n";
      }
    }
    out << "imu," << time << ",0,0,,";
    for (const double value : imu.angular_velocity) out << ',' << value;
    for (const double value : imu.specific_force) out << ',' << value;
    out << ",0,0,0,0,0,0,,,,\n";
  }
}

// Without the times at which they were made.
std::vector<Bytes> frames_in(const std::string& log) {
  std::vector<Bytes> out;
  LcmLogReader reader(log);
  while (const LcmLogEvent* event = reader.next()) {
    if (event->channel != kSlamFrameChannel) continue;
    auto frame = decode_message<slam_frame_t>(event->data);
    frame.host_time_ns = 0;
    frame.time_spent_s = 0;
    out.push_back(encode(frame));
  }
  return out;
}

class SlamProgram : public ::testing::Test {
 protected:
  void write(double seconds) {
    tracks_ = slam_tracks(seconds);
    write_eqvio(path("r.csv"), tracks_);
    Rig rig;
    rig.cameras.push_back(tracks_.camera);
    write_rig(path("rig.yaml"), rig);
  }
  std::string path(const std::string& name) const { return folder_.path(name); }
  std::string errors() const { return text_of(path("err")); }
  int offline(const std::string& method, const std::vector<std::string>& more) {
    std::vector<std::string> all = {"--method", method, "--input", path("r.csv")};
    all.insert(all.end(), more.begin(), more.end());
    return run("loc-estimator", all, path("err"));
  }
  int live(const std::string& method, const std::string& speed, const std::string& log) {
    return run("loc-live",
               {"eqvio", path("r.csv"), "--config", path("rig.yaml"), "--transport", "hub", "--speed", speed, "--log",
                path(log), "--estimator-args", "--method " + method},
               path("live.err"));
  }
  TemporaryFolder folder_;
  SlamTracks tracks_;
};

// In real time, as fast as it goes, and from the log of that by the stock player: always the same.
TEST_F(SlamProgram, LiveReplayAndOfflineAgreeBitForBit) {
  write(2.6);
  for (const std::string method : {"mono-slam", "inertial-slam"}) {
    ASSERT_EQ(offline(method, {"--config", path("rig.yaml"), "--output", path("offline.lcm")}), 0) << errors();
    const auto estimates = estimates_in(path("offline.lcm"));
    const auto frames = frames_in(path("offline.lcm"));
    EXPECT_EQ(frames.size(), tracks_.frames.size()) << method;
    EXPECT_GE(estimates.size(), method == "mono-slam" ? frames.size() : 300U);
    EXPECT_GT(last_time_us(path("offline.lcm"), kMapChannel), 0);

    const std::string speed = method == "mono-slam" ? "max" : "1";
    std::filesystem::remove(path("live.lcm"));
    ASSERT_EQ(live(method, speed, "live.lcm"), 0) << text_of(path("live.err"));
    EXPECT_EQ(estimates_in(path("live.lcm")), estimates) << method;
    EXPECT_EQ(frames_in(path("live.lcm")), frames) << method;
    EXPECT_GT(last_time_us(path("live.lcm"), kMapChannel), 0);

    // The log holds the measurements as well.
    ASSERT_EQ(run("loc-estimator",
                  {"--method", method, "--config", path("rig.yaml"), "--input", path("live.lcm"), "--output",
                   path("again.lcm")},
                  path("err")),
              0)
        << errors();
    EXPECT_EQ(estimates_in(path("again.lcm")), estimates) << method;
    EXPECT_EQ(frames_in(path("again.lcm")), frames) << method;
  }

  const RunningHub hub(folder_);
  ChildProcess estimator = start("loc-estimator",
                                 {"--method", "inertial-slam", "--config", path("rig.yaml"), "--exit-at-end",
                                  "--lcm-url", hub.url, "--map-out", path("replayed.slam")},
                                 path("replay.err"));
  LcmReceiver receiver(hub.url);
  bool ready = false;
  receiver.subscribe(kStatisticsChannel, [&](auto, auto) { ready = true; });
  LcmPublisher publisher(hub.url);
  ASSERT_TRUE(wait_until(
      [&] {
        publisher.publish(kSourceStatusChannel, source_status_t{});
        receiver.handle(10);
        return ready;
      },
      10 * kSecond));
  ASSERT_EQ(run("lcm-logplayer",
                {"--speed=10", "--regexp=LOC_(IMU|TRACKS|SOURCE_STATUS)", "--lcm-url=" + hub.url, path("live.lcm")},
                path("err")),
            0);
  ASSERT_TRUE(estimator.wait(10 * kSecond));
  EXPECT_TRUE(estimator.succeeded()) << text_of(path("replay.err"));
  // The state at the end, all of its covariance included, says that everything before it was the same.
  ASSERT_EQ(offline("inertial-slam",
                    {"--config", path("rig.yaml"), "--output", path("e.tum"), "--map-out", path("offline.slam")}),
            0);
  const std::string state = read_file(path("offline.slam"));
  EXPECT_GT(state.size(), 10'000U);
  EXPECT_EQ(read_file(path("replayed.slam")), state);
}

TEST_F(SlamProgram, MapIsSavedAndGoneOnFrom) {
  write(4);
  // Without a rig: the recording has its camera.
  ASSERT_EQ(offline("inertial-slam", {"--output", path("e.tum"), "--map-out", path("m.slam")}), 0) << errors();
  const Trajectory trajectory = read_tum(path("e.tum")).trajectory;
  // At rest for 1.5 s, then 0.5 (1 - cos 1.5 u) / 2 to the left; world is where the body began.
  const double u = to_seconds(trajectory.times_ns.back() - tracks_.samples.front().time_ns) - 1.5;
  EXPECT_NEAR(trajectory.poses.back().translation.norm(),
              std::hypot(0.25 * (1 - std::cos(1.5 * u)), 0.25 * (1 - std::cos(1.7 * 1.5 * u))), 0.1);
  const SlamFile saved = load_slam(path("m.slam"));
  EXPECT_EQ(saved.motion, SlamMotion::kInertial);
  EXPECT_GT(saved.snapshot.landmarks.size(), 20U);
  EXPECT_EQ(saved.snapshot.time_ns, tracks_.samples.back().time_ns);

  // Goes on in the map: most of the features are known in its first frame.
  ASSERT_EQ(offline("inertial-slam", {"--output", path("f.lcm"), "--map-in", path("m.slam")}), 0) << errors();
  EXPECT_EQ(figure(errors(), "event=map_read", "features"), static_cast<std::int64_t>(saved.snapshot.landmarks.size()));
  ASSERT_EQ(offline("mono-slam", {"--output", path("g.tum"), "--map-out", path("m.ply")}), 0) << errors();
  EXPECT_TRUE(read_file(path("m.ply")).starts_with("ply\nformat binary_little_endian 1.0\n"));

  // Another motion, another camera, a damaged file: refused, exit code 2.
  EXPECT_EQ(offline("mono-slam", {"--output", path("g.tum"), "--map-in", path("m.slam")}), 2);
  EXPECT_NE(errors().find("IMU"), std::string::npos) << errors();
  EXPECT_EQ(
      offline("inertial-slam", {"--output", path("g.tum"), "--map-in", path("m.slam"), "--config", path("rig.yaml")}),
      2);
  EXPECT_NE(errors().find("another size"), std::string::npos) << errors();
  std::filesystem::resize_file(path("m.slam"), 1000);
  EXPECT_EQ(offline("inertial-slam", {"--output", path("g.tum"), "--map-in", path("m.slam")}), 2);
  EXPECT_NE(errors().find("cut"), std::string::npos) << errors();
}

TEST_F(SlamProgram, SettingsAndWrongOptionsAreTold) {
  write(0.5);
  const auto settings = [&](const std::string& text) {
    std::ofstream(path("s.yaml")) << "format: libloc-slam-1\n" << text;
    return offline("mono-slam", {"--output", path("e.lcm"), "--slam-config", path("s.yaml")});
  };
  ASSERT_EQ(settings("map:\n  min_visible: 12\n"), 0) << errors();
  EXPECT_EQ(figure(errors(), "event=ended", "slam.map"), 12) << errors();
  EXPECT_EQ(settings("map:\n  min_visibel: 12\n"), 2);
  EXPECT_NE(errors().find("s.yaml:3"), std::string::npos) << errors();
  EXPECT_EQ(settings("motion: inertial\n"), 2);
  EXPECT_NE(errors().find("motion"), std::string::npos) << errors();
  EXPECT_EQ(settings("sigma_px: -1\n"), 2);
  EXPECT_NE(errors().find("sigma_px"), std::string::npos) << errors();
  EXPECT_EQ(offline("mono-slam", {"--output", path("e.tum"), "--camera", "1"}), 2);
  EXPECT_NE(errors().find("camera 1"), std::string::npos) << errors();
  EXPECT_EQ(offline("madgwick", {"--output", path("e.tum"), "--map-out", path("m.slam")}), 2);
  EXPECT_NE(errors().find("--map-out"), std::string::npos) << errors();
  EXPECT_EQ(run("loc-estimator", {"--method", "mono-slam"}, path("err")), 2) << "no camera is known";
  EXPECT_EQ(offline("inertial-slam", {"--output", path("e.tum"), "--map-out", path("r.csv")}), 2);
  EXPECT_GT(std::filesystem::file_size(path("r.csv")), 10'000U) << "the recording is still there";
}

}  // namespace
}  // namespace loc::test
