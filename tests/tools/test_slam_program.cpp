// loc-estimator --method mono-slam and inertial-slam as processes: off line, live, from logs, replayed by the stock
// player, with a map saved and loaded.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

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

  /// An estimator and a logger on a hub of their own, and lcm-logplayer with the measurements of live.lcm.
  class Replay {
   public:
    Replay(const SlamProgram& test, const std::string& method, const std::string& speed)
        : test_(test),
          speed_(speed),
          log_(test.path(method + "-" + speed + ".lcm")),
          hub_(test.folder_),
          estimator_(start("loc-estimator",
                           {"--method", method, "--config", test.path("rig.yaml"), "--exit-at-end", "--lcm-url",
                            hub_.url, "--map-out", log_ + ".slam"},
                           log_ + ".err")),
          logger_(start("lcm-logger", {"--quiet", "--lcm-url=" + hub_.url, log_}, log_ + ".logger.err")),
          publisher_(hub_.url) {}

    /// Both have subscribed when the one has answered and the other has written.
    bool ready() {
      LcmReceiver receiver(hub_.url);
      bool answered = false;
      receiver.subscribe(kStatisticsChannel, [&](auto, auto) { answered = true; });
      return wait_until(
          [&] {
            publisher_.publish(kSourceStatusChannel, source_status_t{});
            receiver.handle(10);
            std::error_code error;
            return answered && std::filesystem::file_size(log_, error) > 0 && !error;
          },
          10 * kSecond);
    }
    void play() {
      player_.emplace(start("lcm-logplayer",
                            {"--speed=" + speed_, "--regexp=LOC_(IMU|TRACKS|SOURCE_STATUS)", "--lcm-url=" + hub_.url,
                             test_.path("live.lcm")},
                            log_ + ".player.err"));
    }
    /// The log, when all has come to its end and so many estimates are in it.
    std::string end(std::size_t estimates) {
      if (!player_->wait(10 * kSecond) || !player_->succeeded()) return "";
      if (!estimator_.wait(10 * kSecond) || !estimator_.succeeded()) return "";
      // The logger flushes when a message comes.
      const bool whole = wait_until(
          [&] {
            publisher_.publish("LOC_OTHER", Bytes(10));
            return estimates_in(log_).size() >= estimates && last_time_us(log_, kMapChannel) > 0;
          },
          5 * kSecond);
      logger_.stop(2 * kSecond);
      return whole ? log_ : "";
    }

   private:
    const SlamProgram& test_;
    std::string speed_;
    std::string log_;
    RunningHub hub_;
    ChildProcess estimator_;
    ChildProcess logger_;
    std::optional<ChildProcess> player_;
    LcmPublisher publisher_;
  };

  TemporaryFolder folder_;
  SlamTracks tracks_;
};

// As fast as it goes, off line, and off line from the log of that: always the same.
TEST_F(SlamProgram, LiveAndOfflineAgreeBitForBit) {
  write(2.6);
  for (const std::string method : {"mono-slam", "inertial-slam"}) {
    ASSERT_EQ(offline(method, {"--config", path("rig.yaml"), "--output", path("offline.lcm")}), 0) << errors();
    const auto estimates = estimates_in(path("offline.lcm"));
    const auto frames = frames_in(path("offline.lcm"));
    EXPECT_EQ(frames.size(), tracks_.frames.size()) << method;
    EXPECT_GE(estimates.size(), method == "mono-slam" ? frames.size() : 300U);
    EXPECT_GT(last_time_us(path("offline.lcm"), kMapChannel), 0);

    std::filesystem::remove(path("live.lcm"));
    ASSERT_EQ(live(method, "max", "live.lcm"), 0) << text_of(path("live.err"));
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
}

// Driver, LCM, estimator and logger in real time, then the measurements of that log by lcm-logplayer in real time and
// eight times as fast: the same estimates, frames and saved state, of each method.
TEST_F(SlamProgram, RealTimeAndLogplayerAtOneAndEightTimesAgree) {
  write(2.6);
  const std::string methods[] = {"inertial-slam", "mono-slam"};
  ASSERT_EQ(live("inertial-slam", "1", "live.lcm"), 0) << text_of(path("live.err"));
  for (const std::string& method : methods) {
    ASSERT_EQ(offline(method, {"--config", path("rig.yaml"), "--output", path(method + ".lcm")}), 0) << errors();
    ASSERT_EQ(
        offline(method, {"--config", path("rig.yaml"), "--output", path("e.tum"), "--map-out", path(method + ".slam")}),
        0)
        << errors();
  }
  const auto estimates = estimates_in(path("inertial-slam.lcm"));
  ASSERT_GE(estimates.size(), 300U);
  EXPECT_EQ(estimates_in(path("live.lcm")), estimates) << "in real time";
  EXPECT_EQ(frames_in(path("live.lcm")), frames_in(path("inertial-slam.lcm")));

  for (const std::string speed : {"1", "8"}) {
    // Both methods at once, each on the channels of its own hub.
    std::vector<std::unique_ptr<Replay>> replays;
    for (const std::string& method : methods) {
      replays.push_back(std::make_unique<Replay>(*this, method, speed));
      ASSERT_TRUE(replays.back()->ready()) << method;
    }
    for (const auto& replay : replays) replay->play();
    for (std::size_t i = 0; i < replays.size(); ++i) {
      const std::string& method = methods[i];
      const auto expected = estimates_in(path(method + ".lcm"));
      const std::string log = replays[i]->end(expected.size());
      ASSERT_FALSE(log.empty()) << method << " at " << speed;
      EXPECT_EQ(estimates_in(log), expected) << method << " at " << speed;
      EXPECT_EQ(frames_in(log), frames_in(path(method + ".lcm"))) << method << " at " << speed;
      // The state at the end, all of its covariance included.
      const std::string state = read_file(path(method + ".slam"));
      EXPECT_GT(state.size(), 10'000U);
      EXPECT_EQ(read_file(log + ".slam"), state) << method << " at " << speed;
    }
  }
}

TEST_F(SlamProgram, MapIsSavedAndGoneOnFrom) {
  write(4);
  // Without a rig: the recording has its camera.
  ASSERT_EQ(offline("inertial-slam", {"--output", path("e.tum"), "--map-out", path("m.slam")}), 0) << errors();
  const Trajectory trajectory = read_tum(path("e.tum")).trajectory;
  // The start is found after a second; what the frames before it say is there as well.
  ASSERT_GT(trajectory.times_ns.size(), 610U);
  EXPECT_EQ(trajectory.times_ns.front(), tracks_.frames.front().time_ns);
  EXPECT_EQ(trajectory.times_ns[1], tracks_.frames[1].time_ns);
  EXPECT_EQ(trajectory.times_ns.back(), tracks_.samples.back().time_ns);
  EXPECT_LT(trajectory.poses[10].translation.norm(), 0.01);
  // At rest for 1.5 s, then 0.5 (1 - cos 1.5 u) / 2 to the left; world is where the body began.
  const double u = to_seconds(trajectory.times_ns.back() - tracks_.samples.front().time_ns) - 1.5;
  EXPECT_NEAR(trajectory.poses.back().translation.norm(),
              std::hypot(0.25 * (1 - std::cos(1.5 * u)), 0.25 * (1 - std::cos(1.7 * 1.5 * u))), 0.1);
  ASSERT_EQ(offline("inertial-slam", {"--output", path("e.csv")}), 0) << errors();
  std::ifstream lines(path("e.csv"));
  std::string line;
  std::size_t rows = 0;
  TimeNs last = kNoTime;
  for (std::getline(lines, line); std::getline(lines, line); ++rows) {
    const TimeNs time_ns = std::stoll(line);
    EXPECT_GT(time_ns, last) << line;
    last = time_ns;
  }
  EXPECT_EQ(rows, trajectory.times_ns.size());
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
