// loc-simulate as a process: recordings with their truth, the same again from their own scenario file, live, and what
// happens when it is told nonsense or interrupted.
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "libloc/io/euroc.hpp"
#include "libloc/io/lcm_log.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "libloc/io/tracks.hpp"
#include "libloc/io/tum.hpp"
#include "loc/imu_t.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"
#include "msgs/lcm_log_source.hpp"
#include "program_test.hpp"
#include "tools/support/lcm_link.hpp"
#include "tools/support/program.hpp"

namespace loc::test {
namespace {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

class Simulate : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.path(name); }
  int simulate(const Arguments& arguments) {
    fs::remove(path("err"));
    return run("loc-simulate", arguments, path("err"));
  }
  std::string errors() const { return text_of(path("err")); }
  std::set<std::string> files() const {
    std::set<std::string> out;
    for (const auto& entry : fs::directory_iterator(folder_.path(""))) out.insert(entry.path().filename());
    return out;
  }

  TemporaryFolder folder_;
};

std::map<StreamKind, int> count_kinds(MeasurementSource& source) {
  std::map<StreamKind, int> out;
  while (const auto m = source.next()) ++out[kind_of(*m)];
  return out;
}

TEST_F(Simulate, FolderWithItsTruthAndTheSameAgainFromItsScenarioFile) {
  ASSERT_EQ(simulate({"--scenario", "street-car", "--seed", "7", "--duration", "3s", "--out", path("drive"), "--tracks",
                      path("tracks.txt"), "--set", "imu.rate_hz=100", "--imu", "point", "--gps-outage", "1:2",
                      "--vo-latency", "120ms"}),
            0)
      << errors();
  EXPECT_NE(errors().find("features.no_room=60"), std::string::npos) << errors();
  auto counts = count_kinds(*open_euroc(path("drive")));
  EXPECT_EQ(counts[StreamKind::kImu], 300);
  EXPECT_EQ(counts[StreamKind::kMagnetometer], 150);
  EXPECT_EQ(counts[StreamKind::kOdometry], 75);
  EXPECT_EQ(counts[StreamKind::kGps], 10);
  EXPECT_EQ(counts[StreamKind::kReference], 300);
  EXPECT_EQ(read_tum(path("drive/truth.tum")).trajectory.size(), 300U);
  EXPECT_EQ(read_tracks(path("tracks.txt")).frames.size(), 60U);
  const Rig rig = read_rig(path("drive/rig.yaml"));
  EXPECT_EQ(rig.imu->rate_hz, 100);
  EXPECT_EQ(rig.gps->antenna_in_body, Eigen::Vector3d(0.5, 0, 1.2));
  EXPECT_EQ(rig.cameras.size(), 1U);
  std::istringstream truth(text_of(path("drive/truth.csv")));
  std::string line;
  ASSERT_TRUE(std::getline(truth, line));
  const auto commas = std::count(line.begin(), line.end(), ',');
  int rows = 0;
  while (std::getline(truth, line)) {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), commas);
    ++rows;
  }
  EXPECT_EQ(rows, 300);

  ASSERT_EQ(simulate({"--config", path("drive/scenario.yaml"), "--out", path("again")}), 0) << errors();
  int compared = 0;
  for (const auto& entry : fs::recursive_directory_iterator(path("drive"))) {
    if (!entry.is_regular_file()) continue;
    const fs::path other = path("again") / fs::relative(entry.path(), path("drive"));
    EXPECT_EQ(text_of(entry.path()), text_of(other)) << other;
    ++compared;
  }
  EXPECT_EQ(compared, 11);
}

TEST_F(Simulate, LogWithAllStreamsTheSameForTheSameSeed) {
  const Arguments common = {"--scenario", "vio-example", "--duration", "2", "--streams", "imu,odometry,gps,features"};
  const auto with = [&](const std::string& out, const std::string& seed) {
    Arguments all = common;
    all.insert(all.end(), {"--seed", seed, "--out", path(out)});
    return simulate(all);
  };
  ASSERT_EQ(with("a.lcm", "3"), 0) << errors();
  ASSERT_EQ(with("b.lcm", "3"), 0) << errors();
  ASSERT_EQ(with("c.lcm", "4"), 0) << errors();
  EXPECT_EQ(text_of(path("a.lcm")), text_of(path("b.lcm")));
  EXPECT_NE(text_of(path("a.lcm")), text_of(path("c.lcm")));
  const auto source = open_lcm_log(path("a.lcm"));
  auto counts = count_kinds(*source);
  EXPECT_EQ(counts[StreamKind::kImu], 200);
  EXPECT_EQ(counts[StreamKind::kOdometry], 50);
  EXPECT_EQ(counts[StreamKind::kGps], 2);
  EXPECT_EQ(counts[StreamKind::kFeatures], 40);
  EXPECT_EQ(counts.size(), 4U);
  // Nobody asked for truth.
  EXPECT_EQ(files().count("a.lcm.truth.csv"), 0U);
  EXPECT_EQ(files().count("a.lcm.rig.yaml"), 1U);
  EXPECT_EQ(files().count("a.lcm.scenario.yaml"), 1U);
}

TEST_F(Simulate, TellsWhatThereIs) {
  ChildProcess list = start("loc-simulate", {"--list"}, path("err"), true);
  std::set<std::string> names;
  while (const auto line = list.read_line(5 * kSecond)) names.insert(line->substr(0, line->find('\t')));
  EXPECT_EQ(names.count("vio-example"), 1U);
  EXPECT_EQ(names.size(), 7U);
  ChildProcess parameters =
      start("loc-simulate", {"--scenario", "rest", "--vo-scale", "3", "--parameters"}, path("err"), true);
  bool found = false;
  while (const auto line = parameters.read_line(5 * kSecond)) found = found || *line == "odometry.scale\t3\tunit/m";
  EXPECT_TRUE(found);
}

TEST_F(Simulate, NonsenseIsRefusedBeforeAnythingIsWritten) {
  const auto refused = [&](const Arguments& more, const std::string& reason, int code = 2) {
    Arguments all = {"--out", path("never")};
    all.insert(all.end(), more.begin(), more.end());
    EXPECT_EQ(simulate(all), code) << reason;
    EXPECT_NE(errors().find(reason), std::string::npos) << errors();
    EXPECT_EQ(files().count("never"), 0U);
    EXPECT_EQ(files().count("never.incomplete"), 0U);
  };
  refused({}, "no scenario");
  refused({"--scenario", "moon"}, "scenario 'moon' is not known; there are vio-example");
  refused({"--scenario", "vio-example", "--duration", "2min"}, "is longer than the motion, 90 s");
  refused({"--scenario", "rest", "--duration", "soon"}, "--duration 'soon'");
  refused({"--scenario", "rest", "--set", "imu.rate_hz"}, "must be NAME=VALUE");
  refused({"--scenario", "rest", "--set", "imu.rate_hz=0"}, "imu.rate_hz = 0: must be positive");
  refused({"--scenario", "rest", "--set", "rate=1"}, "there is no parameter 'rate'");
  refused({"--scenario", "rest", "--imu", "mean"}, "must be point, interval-mean or increment");
  refused({"--scenario", "rest", "--gps-outage", "20"}, "must be begin:end");
  refused({"--scenario", "rest", "--streams", "imu,radar"}, "--streams: 'radar' is none of");
  refused({"--scenario", "rest", "--seed", "-1"}, "--seed");
  refused({"--scenario", "rest", "--rendered"}, "--rendered needs --video");
  std::ofstream(path("s.yaml")) << "scenario: rest\nparameters:\n  gps:\n    rate: 3\n";
  refused({"--config", path("s.yaml")}, "s.yaml:4: there is no parameter 'gps.rate'");
  EXPECT_EQ(simulate({"--scenario", "rest"}), 2);
  EXPECT_NE(errors().find("nothing to do"), std::string::npos) << errors();

  fs::create_directories(path("full/mav0"));
  EXPECT_EQ(simulate({"--scenario", "rest", "--duration", "1", "--out", path("full")}), 1);
  EXPECT_NE(errors().find("is there already"), std::string::npos) << errors();
}

TEST_F(Simulate, InterruptedItLeavesNothing) {
  for (const char* out : {"long", "long.lcm"}) {
    ChildProcess process =
        start("loc-simulate", {"--scenario", "street-car", "--duration", "5h", "--out", path(out)}, path("err"));
    ASSERT_TRUE(wait_until([&] { return fs::exists(path(std::string(out) + ".incomplete")); }, 10 * kSecond));
    ASSERT_TRUE(process.running());
    // The shell has become the program by exec.
    ::kill(process.pid(), SIGINT);
    ASSERT_TRUE(process.wait(10 * kSecond));
    EXPECT_EQ(process.describe(), "exit code 1");
    EXPECT_NE(errors().find("event=interrupted"), std::string::npos) << errors();
    EXPECT_EQ(files(), (std::set<std::string>{"err"}));
  }
}

TEST_F(Simulate, LiveWithItsLossesAndLatency) {
  const RunningHub hub(folder_);
  LcmReceiver receiver(hub.url);
  std::vector<imu_t> imu;
  int odometry = 0;
  receiver.subscribe("LOC_IMU", [&](auto, auto data) {
    imu_t m{};
    if (m.decode(data.data(), 0, static_cast<int>(data.size())) > 0) imu.push_back(m);
  });
  receiver.subscribe("LOC_ODOMETRY", [&](auto, auto) { ++odometry; });
  ChildProcess process =
      start("loc-simulate",
            {"--scenario", "vio-example", "--duration", "10", "--live", "--speed", "10", "--lcm-url", hub.url,
             "--vo-latency", "0.3", "--set", "imu.clock.loss_fraction=0.1", "--write-rig", path("rig.yaml")},
            path("err"));
  const TimeNs began = host_now();
  const TimeNs give_up = steady_now() + 20 * kSecond;
  while (process.running() && steady_now() < give_up) receiver.handle(50);
  while (receiver.handle(100)) {
  }
  EXPECT_TRUE(process.succeeded()) << process.describe() << errors();
  ASSERT_GT(imu.size(), 800U);
  EXPECT_LT(imu.size(), 980U);
  EXPECT_EQ(odometry, 250);
  EXPECT_GT(imu.back().sequence, 950);  // jumps tell of the losses
  EXPECT_NEAR(to_seconds(imu.front().time_ns - began), 0, 10);
  EXPECT_EQ(read_rig(path("rig.yaml")).imu->rate_hz, 100);
  EXPECT_NE(errors().find("pace.restarts=0"), std::string::npos) << errors();
}

TEST_F(Simulate, VideoOrTheReasonWhyNot) {
  const Arguments video = {"--scenario", "rest", "--duration", "0.3", "--video", path("v.avi"), "--rendered"};
  const int code = simulate(video);
  if (code == 2) {
    EXPECT_NE(errors().find("was built without it"), std::string::npos) << errors();
    return;
  }
  ASSERT_EQ(code, 0) << errors();
  EXPECT_GT(fs::file_size(path("v.avi")), 10'000U);
  EXPECT_EQ(simulate(video), 2) << "it is there already";
  ASSERT_EQ(simulate({"--scenario", "rest", "--duration", "0.2", "--out", path("r"), "--images"}), 0) << errors();
  const std::string list = text_of(path("r/mav0/cam0/data.csv"));
  EXPECT_EQ(std::count(list.begin(), list.end(), '\n'), 5);
  EXPECT_TRUE(fs::exists(path("r/mav0/cam0/data/1700000000150000000.png")));
  ASSERT_EQ(simulate({"--scenario", "rest", "--duration", "0.2", "--out", path("r.lcm"), "--images"}), 0) << errors();
  EXPECT_EQ(count_kinds(*open_lcm_log(path("r.lcm")))[StreamKind::kImage], 4);
  EXPECT_EQ(files().count("v.incomplete.avi"), 0U);
}

}  // namespace
}  // namespace loc::test
