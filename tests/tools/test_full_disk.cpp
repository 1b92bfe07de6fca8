// A disk that is full: what every program says of the file that it writes. A limit on the size of files stands for the
// disk; a program meets it where it would meet the end of the disk, as an error of write().
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tools/program_test.hpp"

namespace loc {
namespace {

using test::TemporaryFolder;
using test::text_of;

class FullDisk : public testing::Test {
 protected:
  static std::string program(const std::string& name) { return std::string(LOC_PROGRAM_DIR) + "/" + name; }

  // Runs it where no file gets longer than some kilobytes.
  int run_on_full_disk(const std::string& name, const std::vector<std::string>& arguments, int blocks = 40) {
    std::string command = "trap '' XFSZ; ulimit -f " + std::to_string(blocks) + "; exec '" + program(name) + "'";
    for (const std::string& argument : arguments) command += " '" + argument + "'";
    return test::run("sh", {"-c", command}, log_);
  }
  void simulate(const std::vector<std::string>& arguments) {
    std::vector<std::string> all = {"--scenario", "circle", "--duration", "6s", "--streams", "imu,magnetometer"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    ASSERT_EQ(test::run("loc-simulate", all, folder_.path("log of the simulator")), 0);
  }
  // It failed, and says so of that file.
  void expect_failed(int code, const std::string& file) {
    const std::string log = text_of(log_);
    EXPECT_EQ(code, 1) << log;
    EXPECT_NE(log.find("level=error"), std::string::npos) << log;
    EXPECT_NE(log.find(file), std::string::npos) << log;
    EXPECT_EQ(log.find("event=ended"), std::string::npos) << "claims to have ended well: " << log;
  }

  TemporaryFolder folder_;
  std::string log_ = folder_.path("log");
};

TEST_F(FullDisk, RecordingsOfTheSimulator) {
  for (const std::string name : {"recording", "recording.lcm"}) {
    const std::string out = folder_.path(name);
    expect_failed(run_on_full_disk("loc-simulate", {"--scenario", "circle", "--duration", "6s", "--out", out}), out);
    EXPECT_FALSE(std::filesystem::exists(out)) << "looks like a whole recording";
    EXPECT_FALSE(std::filesystem::exists(out + ".incomplete")) << "takes room that is needed";
  }
  const std::string tracks = folder_.path("tracks.csv");
  expect_failed(run_on_full_disk("loc-simulate", {"--scenario", "circle", "--duration", "6s", "--tracks", tracks}),
                tracks);
  EXPECT_FALSE(std::filesystem::exists(tracks));
}

TEST_F(FullDisk, EstimatesOffline) {
  const std::string recording = folder_.path("recording");
  simulate({"--out", recording});
  for (const std::string ending : {"csv", "tum", "lcm"}) {
    const std::string out = folder_.path("estimates." + ending);
    expect_failed(run_on_full_disk("loc-estimator", {"--input", recording, "--output", out}), out);
  }
}

TEST_F(FullDisk, WithRoomEnoughTheSameSucceeds) {
  const std::string out = folder_.path("recording");
  EXPECT_EQ(run_on_full_disk("loc-simulate", {"--scenario", "circle", "--duration", "6s", "--out", out}, 100000), 0)
      << text_of(log_);
  EXPECT_TRUE(std::filesystem::exists(out));
}

}  // namespace
}  // namespace loc
