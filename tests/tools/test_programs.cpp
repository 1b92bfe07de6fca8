// The real programs as processes: what they do together, and what happens when one dies, lies or is told nonsense.
#include <gtest/gtest.h>
#include <sys/poll.h>
#include <sys/socket.h>

#include <array>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <limits>
#include <thread>

#include "loc/imu_t.hpp"
#include "loc/source_status_t.hpp"
#include "loc/statistics_t.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"
#include "program_test.hpp"
#include "tools/support/lcm_link.hpp"
#include "tools/support/program.hpp"
#include "tools/support/tcpq_protocol.hpp"

namespace loc::test {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Arguments = std::vector<std::string>;

class Programs : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.path(name); }
  std::string errors(const std::string& program) const { return text_of(path(program + ".err")); }
  ChildProcess start_program(const std::string& program, const Arguments& arguments) {
    return start(program, arguments, path(program + ".err"));
  }
  int run_program(const std::string& program, const Arguments& arguments) {
    return run(program, arguments, path(program + ".err"));
  }
  /// Estimates of the program's off-line form: what the live one must give, too.
  std::vector<Bytes> offline(const std::string& recording) {
    EXPECT_EQ(run_program("loc-estimator", {"--input", recording, "--output", path("offline.lcm")}), 0)
        << errors("loc-estimator");
    return estimates_in(path("offline.lcm"));
  }

  TemporaryFolder folder_;
};

// Recording → driver → LCM → estimator → logger → lcm-logplayer → estimator → logger, and off line from both.
TEST_F(Programs, LiveReplayAndOfflineAgreeBitForBit) {
  write_recording(path("r.csv"), 200, 20);
  ASSERT_EQ(run_program("loc-live",
                        {"csv", path("r.csv"), "--transport", "hub", "--speed", "max", "--log", path("live.lcm")}),
            0)
      << errors("loc-live");
  const std::vector<Bytes> from_recording = offline(path("r.csv"));
  ASSERT_EQ(from_recording.size(), 4000U);
  EXPECT_EQ(estimates_in(path("live.lcm")), from_recording);
  EXPECT_EQ(offline(path("live.lcm")), from_recording);

  const RunningHub hub(folder_);
  ChildProcess estimator = start_program("loc-estimator", {"--exit-at-end", "--lcm-url", hub.url});
  ChildProcess logger = start_program("lcm-logger", {"--quiet", "--lcm-url=" + hub.url, path("replay.lcm")});
  LcmReceiver receiver(hub.url);
  bool ready = false;
  receiver.subscribe(kStatisticsChannel, [&](auto, auto) { ready = true; });
  LcmPublisher publisher(hub.url);
  // Both have subscribed when the one has answered and the other has written.
  ASSERT_TRUE(wait_until(
      [&] {
        publisher.publish(kSourceStatusChannel, source_status_t{});
        receiver.handle(10);
        std::error_code error;
        return ready && std::filesystem::file_size(path("replay.lcm"), error) > 0 && !error;
      },
      10 * kSecond));
  ASSERT_EQ(run_program("lcm-logplayer", {"--speed=20", "--regexp=LOC_(IMU|MAGNETOMETER|SOURCE_STATUS)",
                                          "--lcm-url=" + hub.url, path("live.lcm")}),
            0);
  ASSERT_TRUE(estimator.wait(10 * kSecond));
  EXPECT_TRUE(estimator.succeeded()) << estimator.describe() << errors("loc-estimator");
  // The logger flushes when a message comes.
  EXPECT_TRUE(wait_until(
      [&] {
        publisher.publish("LOC_OTHER", Bytes(10));
        return estimates_in(path("replay.lcm")).size() >= 4000;
      },
      5 * kSecond));
  logger.stop(2 * kSecond);
  EXPECT_EQ(estimates_in(path("replay.lcm")), from_recording);
}

TEST_F(Programs, GarbageAndWrongTypesOnEveryChannelChangeNothing) {
  write_recording(path("r.csv"), 200, 20);
  const RunningHub hub(folder_);
  ChildProcess estimator = start_program("loc-estimator", {"--exit-at-end", "--lcm-url", hub.url});
  ChildProcess logger = start_program("lcm-logger", {"--quiet", "--lcm-url=" + hub.url, path("live.lcm")});
  ChildProcess driver = start_program(
      "loc-driver", {"csv", path("r.csv"), "--speed", "10", "--wait-for-estimator", "10", "--lcm-url", hub.url});
  LcmPublisher publisher(hub.url);
  magnetometer_t wrong_type{};
  wrong_type.time_ns = 5;
  imu_t no_time{};
  no_time.time_ns = kNoTime;
  Bytes cut(50);
  no_time.encode(cut.data(), 0, 8);
  int sent = 0;
  while (driver.running()) {
    for (const char* channel :
         {"LOC_IMU", "LOC_MAGNETOMETER", "LOC_SOURCE_STATUS", "LOC_STATISTICS", "LOC_OTHER", "LOC_IMU_2"}) {
      publisher.publish(channel, Bytes(static_cast<std::size_t>(sent % 200), 0xff));
      publisher.publish(channel, cut);
      publisher.publish(channel, std::string(channel) == "LOC_MAGNETOMETER" ? Bytes(5000) : Bytes(0));
    }
    publisher.publish("LOC_IMU", wrong_type);
    publisher.publish("LOC_MAGNETOMETER", no_time);
    publisher.publish("LOC_SOURCE_STATUS", wrong_type);
    publisher.publish("LOC_IMU", no_time);
    ++sent;
    ::poll(nullptr, 0, 5);
  }
  EXPECT_TRUE(driver.succeeded()) << driver.describe() << errors("loc-driver");
  ASSERT_TRUE(estimator.wait(10 * kSecond));
  EXPECT_TRUE(estimator.succeeded()) << estimator.describe();
  const std::string log = errors("loc-estimator");
  // Some went out before the estimator listened.
  EXPECT_GT(sent, 50);
  EXPECT_GT(figure(log, "event=ended", "imu.refused"), 2 * sent) << log;
  EXPECT_GT(figure(log, "event=ended", "magnetometer.refused"), sent) << log;
  EXPECT_GT(figure(log, "event=ended", "magnetometer.oversized"), sent / 2) << log;
  EXPECT_GT(figure(log, "event=ended", "source_status.refused"), 2 * sent) << log;
  const std::vector<Bytes> expected = offline(path("r.csv"));
  EXPECT_TRUE(wait_until(
      [&] {
        publisher.publish("LOC_OTHER", Bytes(10));
        return estimates_in(path("live.lcm")).size() >= expected.size();
      },
      5 * kSecond));
  logger.stop(2 * kSecond);
  EXPECT_EQ(estimates_in(path("live.lcm")), expected);
}

TEST_F(Programs, NotANumberAndClockSetBackAreSurvived) {
  const RunningHub hub(folder_);
  ChildProcess estimator = start_program("loc-estimator", {"--exit-at-end", "--lcm-url", hub.url});
  LcmPublisher publisher(hub.url);
  LcmReceiver receiver(hub.url);
  bool ready = false;
  std::int64_t estimates = 0;
  bool finite = true;
  TimeNs last_time = 0;
  receiver.subscribe(kStatisticsChannel, [&](auto, auto) { ready = true; });
  receiver.subscribe(kEstimateChannel, [&](auto, auto data) {
    const auto estimate = decode_message<estimate_t>(data);
    ++estimates;
    last_time = estimate.time_ns;
    for (const double x : estimate.q_world_body_wxyz) finite = finite && std::isfinite(x);
  });
  source_status_t status{};
  ASSERT_TRUE(wait_until(
      [&] {
        publisher.publish(kSourceStatusChannel, status);
        return receiver.handle(20) && ready;
      },
      10 * kSecond));
  imu_t imu{};
  imu.specific_force[2] = 9.80665;
  for (int i = 0; i < 400; ++i) {
    imu.sequence = i;
    imu.time_ns = (i < 200 ? 1000 * kSecond : 100 * kSecond) + i * 5 * kMs;
    imu.angular_velocity[0] = i % 10 == 3 ? std::numeric_limits<double>::quiet_NaN() : 0.1;
    publisher.publish("LOC_IMU", imu);
  }
  status.state = source_status_t::STATE_ENDED;
  publisher.publish(kSourceStatusChannel, status);
  ASSERT_TRUE(estimator.wait(10 * kSecond));
  EXPECT_TRUE(estimator.succeeded()) << estimator.describe();
  while (receiver.handle(200)) {
  }
  const std::string log = errors("loc-estimator");
  EXPECT_EQ(figure(log, "event=ended", "imu.received"), 400) << log;
  EXPECT_EQ(figure(log, "event=ended", "clock.resets"), 1) << log;
  EXPECT_EQ(figure(log, "event=ended", "imu.skipped.time_not_increasing"), 0) << log;
  EXPECT_EQ(figure(log, "event=ended", "imu.skipped.not_finite") + figure(log, "event=ended", "imu.late") + estimates,
            400)
      << log;
  EXPECT_GE(figure(log, "event=ended", "imu.skipped.not_finite"), 36);
  EXPECT_GT(estimates, 330);
  EXPECT_TRUE(finite);
  EXPECT_EQ(last_time, imu.time_ns) << "the last sample is not a NaN";
}

TEST_F(Programs, DriverAsFastAsTakenNeedsNoAnswerForSamplesThatGiveNoEstimate) {
  write_recording(path("r.csv"), 200, 2);
  // More samples without estimate in a row than the window holds.
  std::string text = text_of(path("r.csv"));
  std::string out;
  int line_number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    std::string line = text.substr(at, end - at);
    if (++line_number > 100 && line_number <= 200) {
      const auto first = line.find(',');
      line.replace(first + 1, line.find(',', first + 1) - first - 1, "nan");
    }
    out += line + "\n";
    at = end + 1;
  }
  std::FILE* file = std::fopen(path("nan.csv").c_str(), "w");
  std::fwrite(out.data(), 1, out.size(), file);
  std::fclose(file);
  ASSERT_EQ(run_program("loc-live", {"csv", path("nan.csv"), "--transport", "hub", "--speed", "max", "--driver-args",
                                     "--window 16 --answer-timeout 2"}),
            0)
      << errors("loc-live");
  EXPECT_EQ(figure(errors("loc-live"), "program=loc-estimator pid", "imu.skipped.not_finite"), 100)
      << errors("loc-live");
}

TEST_F(Programs, DriverSaysThatNobodyAnswers) {
  write_recording(path("r.csv"), 200, 5);
  const RunningHub hub(folder_);
  EXPECT_EQ(run_program("loc-driver", {"csv", path("r.csv"), "--speed", "max", "--window", "10", "--answer-timeout",
                                       "0.3", "--lcm-url", hub.url}),
            1);
  EXPECT_NE(errors("loc-driver").find("no estimator takes the samples: 10 of stream imu"), std::string::npos)
      << errors("loc-driver");
  EXPECT_EQ(run_program("loc-driver", {"csv", path("r.csv"), "--wait-for-estimator", "0.3", "--lcm-url", hub.url}), 1);
  EXPECT_NE(errors("loc-driver").find("no estimator has answered"), std::string::npos) << errors("loc-driver");
}

TEST_F(Programs, StartAndDurationSelect) {
  write_recording(path("r.csv"), 200, 10);
  ASSERT_EQ(run_program("loc-live", {"csv", path("r.csv"), "--transport", "hub", "--speed", "max", "--log",
                                     path("live.lcm"), "--driver-args", "--start 2 --duration 3"}),
            0)
      << errors("loc-live");
  EXPECT_EQ(estimates_in(path("live.lcm")).size(), 600U);
  EXPECT_EQ(figure(errors("loc-live"), "program=loc-driver pid", "imu.published"), 600) << errors("loc-live");
}

TEST_F(Programs, SlowClientOfTheHubHarmsNobody) {
  write_recording(path("r.csv"), 200, 60);
  RunningHub hub(folder_, {"--max-queue-bytes", "20000"});
  LcmReceiver never_reads(hub.url);
  never_reads.subscribe(".*", [](auto, auto) {});
  ChildProcess estimator = start_program("loc-estimator", {"--exit-at-end", "--lcm-url", hub.url});
  // The window keeps what is on its way to the others below the small queues.
  EXPECT_EQ(run_program("loc-driver", {"csv", path("r.csv"), "--speed", "max", "--window", "20", "--wait-for-estimator",
                                       "10", "--lcm-url", hub.url}),
            0)
      << errors("loc-driver");
  ASSERT_TRUE(estimator.wait(10 * kSecond));
  EXPECT_EQ(figure(errors("loc-estimator"), "event=ended", "imu.received"), 12'000);
  EXPECT_EQ(figure(errors("loc-estimator"), "event=ended", "imu.lost"), 0);
  EXPECT_TRUE(hub.process.stop(2 * kSecond));
  EXPECT_TRUE(hub.process.succeeded());
  EXPECT_GT(figure(errors("hub"), "event=ended", "dropped"), 0) << errors("hub");
}

TEST_F(Programs, DriverThatHasWaitedForTheEstimatorLeavesNoAnswersInTheHub) {
  write_recording(path("r.csv"), 200, 60);
  RunningHub hub(folder_, {"--max-queue-bytes", "1000000"});
  ChildProcess estimator = start_program("loc-estimator", {"--exit-at-end", "--lcm-url", hub.url});
  ChildProcess driver = start_program(
      "loc-driver", {"csv", path("r.csv"), "--speed", "30", "--wait-for-estimator", "10", "--lcm-url", hub.url});
  // More than a queue and the sockets' buffers hold, on a channel that the driver listens to while it waits.
  LcmPublisher publisher(hub.url);
  int sent = 0;
  while (driver.running()) {
    publisher.publish(kStatisticsChannel, Bytes(500'000));
    ++sent;
    ::poll(nullptr, 0, 5);
  }
  EXPECT_TRUE(driver.succeeded()) << driver.describe() << errors("loc-driver");
  EXPECT_GT(sent, 30);
  ASSERT_TRUE(estimator.wait(10 * kSecond));
  EXPECT_TRUE(hub.process.stop(2 * kSecond));
  EXPECT_EQ(figure(errors("hub"), "event=ended", "dropped"), 0) << errors("hub");
}

TEST_F(Programs, KilledEstimatorAndLoggerAreStartedAnewAndTheLogIsReadable) {
  write_recording(path("r.csv"), 200, 5);
  ChildProcess live =
      start_program("loc-live", {"csv", path("r.csv"), "--transport", "hub", "--log", path("live.lcm"), "--restart"});
  ASSERT_TRUE(wait_until([&] { return child_of(live.pid(), "loc-driver") > 0; }, 10 * kSecond));
  ::poll(nullptr, 0, 1500);
  const pid_t logger = child_of(live.pid(), "lcm-logger");
  const pid_t estimator = child_of(live.pid(), "loc-estimator");
  ASSERT_GT(logger, 0);
  ASSERT_GT(estimator, 0);
  ASSERT_EQ(::kill(logger, SIGKILL), 0);
  const std::int64_t killed_us = host_now() / 1000;
  ::poll(nullptr, 0, 700);
  ASSERT_EQ(::kill(estimator, SIGKILL), 0);
  ASSERT_TRUE(live.wait(20 * kSecond));
  EXPECT_TRUE(live.succeeded()) << live.describe() << errors("loc-live");
  const std::string log = errors("loc-live");
  EXPECT_NE(log.find("process_restarted program=lcm-logger restarts=1"), std::string::npos) << log;
  EXPECT_NE(log.find("process_restarted program=loc-estimator restarts=1"), std::string::npos) << log;
  EXPECT_GT(last_time_us(path("live.lcm"), "LOC_IMU"), killed_us - 1'000'000) << "more than a second is missing";
  // The driver went on, and both successors did their work until the end.
  EXPECT_EQ(figure(log, "program=loc-driver pid", "imu.published"), 1000);
  std::vector<Bytes> after = estimates_in(path("live.lcm.1"));
  ASSERT_FALSE(after.empty());
  EXPECT_EQ(decode_message<estimate_t>(after.back()).sequence, 999);
}

TEST_F(Programs, DeadEstimatorIsReportedAndTheOthersGoOn) {
  write_recording(path("r.csv"), 200, 3);
  ChildProcess live =
      start_program("loc-live", {"csv", path("r.csv"), "--transport", "hub", "--log", path("live.lcm")});
  ASSERT_TRUE(wait_until([&] { return child_of(live.pid(), "loc-driver") > 0; }, 10 * kSecond));
  ::poll(nullptr, 0, 500);
  ASSERT_EQ(::kill(child_of(live.pid(), "loc-estimator"), SIGKILL), 0);
  ASSERT_TRUE(live.wait(20 * kSecond));
  EXPECT_EQ(live.describe(), "exit code 1");
  EXPECT_NE(errors("loc-live").find("process_died program=loc-estimator how=\"signal 9"), std::string::npos);
  EXPECT_EQ(figure(errors("loc-live"), "program=loc-driver pid", "imu.published"), 600) << errors("loc-live");
}

// A shell starts the programs: it catches signals, too, until the program takes its place.
bool catches(pid_t process, int number) {
  if (text_of("/proc/" + std::to_string(process) + "/comm").rfind("loc-", 0) != 0) return false;
  const std::string status = text_of("/proc/" + std::to_string(process) + "/status");
  const auto at = status.find("SigCgt:");
  if (at == std::string::npos) return false;
  return ((std::stoull(status.substr(at + 7), nullptr, 16) >> static_cast<unsigned>(number - 1)) & 1U) != 0;
}

TEST_F(Programs, CtrlCEndsEverythingAtAnyMoment) {
  write_recording(path("r.csv"), 200, 60);
  for (const int delay_ms : {0, 5, 20, 60, 120, 250, 900}) {
    ChildProcess live =
        start_program("loc-live", {"csv", path("r.csv"), "--transport", "hub", "--log", path("live.lcm")});
    ASSERT_TRUE(wait_until([&] { return catches(live.pid(), SIGINT); }, 10 * kSecond));
    ::poll(nullptr, 0, delay_ms);
    const std::vector<pid_t> children = children_of(live.pid());
    ASSERT_EQ(::kill(live.pid(), SIGINT), 0);
    ASSERT_TRUE(live.wait(2 * kSecond)) << "after " << delay_ms << " ms\n" << errors("loc-live");
    EXPECT_TRUE(live.succeeded()) << "after " << delay_ms << " ms: " << live.describe() << "\n" << errors("loc-live");
    for (const pid_t child : children) EXPECT_FALSE(alive(child)) << "after " << delay_ms << " ms";
  }
}

TEST_F(Programs, EachProgramEndsCleanlyOnASignal) {
  write_recording(path("r.csv"), 200, 60);
  RunningHub hub(folder_);
  ChildProcess estimator = start_program("loc-estimator", {"--lcm-url", hub.url});
  ChildProcess driver = start_program("loc-driver", {"csv", path("r.csv"), "--lcm-url", hub.url});
  for (ChildProcess* process : {&estimator, &driver, &hub.process}) {
    ASSERT_TRUE(wait_until([&] { return catches(process->pid(), SIGTERM); }, 10 * kSecond));
  }
  ::poll(nullptr, 0, 100);
  for (ChildProcess* process : {&driver, &estimator, &hub.process}) {
    EXPECT_TRUE(process->stop(2 * kSecond)) << process->name();
    EXPECT_TRUE(process->succeeded()) << process->name() << ": " << process->describe();
  }
}

TEST_F(Programs, KilledLiveLeavesNobodyBehind) {
  write_recording(path("r.csv"), 200, 60);
  ChildProcess live =
      start_program("loc-live", {"csv", path("r.csv"), "--transport", "hub", "--log", path("live.lcm")});
  ASSERT_TRUE(wait_until([&] { return child_of(live.pid(), "loc-driver") > 0; }, 10 * kSecond));
  ::poll(nullptr, 0, 300);
  const std::vector<pid_t> children = children_of(live.pid());
  EXPECT_EQ(children.size(), 4U);
  ASSERT_EQ(::kill(live.pid(), SIGKILL), 0);
  for (const pid_t child : children) EXPECT_TRUE(wait_until([&] { return !alive(child); }, 2 * kSecond));
}

TEST_F(Programs, DriverFindsAHubThatWasStartedAnew) {
  write_recording(path("r.csv"), 200, 4);
  ChildProcess live = start_program("loc-live", {"csv", path("r.csv"), "--transport", "hub", "--restart"});
  ASSERT_TRUE(wait_until([&] { return child_of(live.pid(), "loc-driver") > 0; }, 10 * kSecond));
  ::poll(nullptr, 0, 1000);
  ASSERT_EQ(::kill(child_of(live.pid(), "loc-hub"), SIGKILL), 0);
  ASSERT_TRUE(live.wait(20 * kSecond)) << errors("loc-live");
  const std::string log = errors("loc-live");
  EXPECT_TRUE(live.succeeded()) << log;
  EXPECT_EQ(figure(log, "program=loc-driver pid", "imu.published"), 800) << log;
  const std::int64_t received = figure(log, "program=loc-estimator pid", "imu.received");
  EXPECT_GT(received, 600) << log;
  EXPECT_EQ(received + figure(log, "program=loc-estimator pid", "imu.lost"), 800) << "every loss is counted\n" << log;
}

TEST_F(Programs, UsageErrorsGiveExitCodeTwo) {
  write_recording(path("r.csv"), 200, 1);
  std::FILE* file = std::fopen(path("broken.yaml").c_str(), "w");
  std::fputs("format: libloc-rig-1\nimu:\n  rate: 3\n...\n", file);
  std::fclose(file);
  const std::string csv = path("r.csv");
  const auto size = std::filesystem::file_size(csv);
  const std::vector<std::pair<std::string, Arguments>> wrong = {
      {"loc-hub", {"--port", "70000"}},
      {"loc-hub", {"--bind", "somewhere"}},
      {"loc-hub", {"--max-clients", "0"}},
      {"loc-hub", {"surplus"}},
      {"loc-driver", {}},
      {"loc-driver", {"sonar", csv}},
      {"loc-driver", {"csv", path("missing.csv")}},
      {"loc-driver", {"csv", csv, "--speed", "fast"}},
      {"loc-driver", {"csv", csv, "--speed", "-1"}},
      {"loc-driver", {"csv", csv, "--window", "0"}},
      {"loc-driver", {"csv", csv, "--channel", "imu"}},
      {"loc-driver", {"csv", csv, "--lcm-url", "tcpq://localhost:7700"}},
      {"loc-driver", {"csv", csv, "--config", path("missing.yaml")}},
      {"loc-driver", {"csv", csv, "--config", path("broken.yaml")}},
      {"loc-estimator", {"--method", "magic"}},
      {"loc-estimator", {"--preset", "gentle"}},
      {"loc-estimator", {"--beta", "-1"}},
      {"loc-estimator", {"--world", "UP"}},
      {"loc-estimator", {"--input", csv}},
      {"loc-estimator", {"--config", path("broken.yaml"), "--input", csv, "--output", path("x.csv")}},
      {"loc-estimator", {"--log-level", "loud"}},
      {"loc-estimator", {"--input", csv, "--output", path("x.json")}},
      {"loc-estimator", {"--input", csv, "--output", csv}},
      {"loc-live", {"csv", csv, "--log", csv}},
      {"loc-live", {}},
      {"loc-live", {"csv", path("missing.csv")}},
      {"loc-live", {"csv", csv, "--transport", "pigeon"}},
  };
  for (const auto& [program, arguments] : wrong) {
    std::string line = program;
    for (const std::string& argument : arguments) line += " " + argument;
    EXPECT_EQ(run_program(program, arguments), 2) << line << "\n" << errors(program);
  }
  EXPECT_EQ(std::filesystem::file_size(csv), size) << "a recording is never written over";
  for (const char* program : {"loc-hub", "loc-driver", "loc-estimator", "loc-live"}) {
    EXPECT_EQ(run_program(program, {"--help"}), 0);
    EXPECT_EQ(run_program(program, {"--version"}), 0);
  }
}

TEST_F(Programs, ARigThatWasForcedIsUsedAndWarnedOf) {
  write_recording(path("r.csv"), 200, 1);
  std::ofstream(path("rig.yaml")) << "format: libloc-rig-1\n"
                                     "magnetometer:\n"
                                     "  bias: [0, 0, 0]\n"
                                     "  matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
                                     "  quality:\n"
                                     "    verdict: refused\n"
                                     "    method: robust\n"
                                     "    samples: 20\n"
                                     "    reasons: [\"it was not turned\"]\n"
                                     "...\n";
  const Arguments arguments = {"--config", path("rig.yaml"), "--input", path("r.csv"), "--output", path("x.csv")};
  EXPECT_EQ(run_program("loc-estimator", arguments), 0);
  const std::string log = errors("loc-estimator");
  EXPECT_NE(log.find("event=rig_quality"), std::string::npos) << log;
  EXPECT_NE(log.find("block=magnetometer verdict=refused"), std::string::npos) << log;
  EXPECT_NE(log.find("it was not turned"), std::string::npos) << log;
}

TEST_F(Programs, RunTimeFailuresGiveExitCodeOne) {
  write_recording(path("r.csv"), 200, 1);
  EXPECT_EQ(run_program("loc-estimator", {"--lcm-url", "tcpq://127.0.0.1:1"}), 1);
  EXPECT_NE(errors("loc-estimator").find("start loc-hub"), std::string::npos) << errors("loc-estimator");
  EXPECT_EQ(run_program("loc-driver", {"csv", path("r.csv"), "--lcm-url", "tcpq://127.0.0.1:1"}), 1);
  EXPECT_EQ(run_program("loc-estimator", {"--input", path("r.csv"), "--output", path("no/such/folder/x.csv")}), 1);
  std::ofstream(path("field.csv")) << "time [s],mx [uT],my [uT],mz [uT]\n0,1,2,3\n1,1,2,3\n";
  EXPECT_EQ(run_program("loc-estimator", {"--input", path("field.csv"), "--output", path("x.csv")}), 1);
  EXPECT_NE(errors("loc-estimator").find("event=no_estimate"), std::string::npos) << errors("loc-estimator");
  const RunningHub hub(folder_);
  EXPECT_EQ(run_program("loc-hub", {"--port", hub.url.substr(hub.url.rfind(':') + 1)}), 1);
  EXPECT_NE(errors("loc-hub").find("cannot listen"), std::string::npos) << errors("loc-hub");
}

// In a network of its own, with and without the route that multicast needs.
class Multicast : public Programs {
 protected:
  void SetUp() override {
    if (run("unshare", {"-rn", "ip", "link", "set", "lo", "up"}, path("unshare.err")) != 0) {
      GTEST_SKIP() << "unshare -rn is not allowed here: " << text_of(path("unshare.err"));
    }
  }
  int run_alone(const std::string& setup, const std::string& command) {
    return run("unshare", {"-rn", "sh", "-c", "ip link set lo up; " + setup + "exec " LOC_PROGRAM_DIR "/" + command},
               path("alone.err"));
  }
};

TEST_F(Multicast, LiveEqualsOffline) {
  write_recording(path("r.csv"), 200, 5);
  ASSERT_EQ(run_alone("ip route add 224.0.0.0/4 dev lo; ",
                      "loc-live csv " + path("r.csv") + " --speed 4 --log " + path("live.lcm")),
            0)
      << errors("alone");
  EXPECT_NE(errors("alone").find("event=transport kind=udpm"), std::string::npos) << errors("alone");
  EXPECT_EQ(estimates_in(path("live.lcm")), offline(path("r.csv")));

  ASSERT_EQ(run_alone("ip route add 224.0.0.0/4 dev lo; ",
                      "loc-live csv " + path("r.csv") + " --speed max --log " + path("max.lcm")),
            0)
      << errors("alone");
  EXPECT_EQ(estimates_in(path("max.lcm")), offline(path("r.csv"))) << "the stock logger would lose them on udpm";
}

TEST_F(Multicast, WithoutARouteTheMendIsNamedAndLiveTakesAHub) {
  write_recording(path("r.csv"), 200, 2);
  EXPECT_EQ(run_alone("", "loc-driver csv " + path("r.csv")), 1);
  EXPECT_NE(errors("alone").find("ip route add 224.0.0.0/4 dev lo"), std::string::npos) << errors("alone");
  EXPECT_EQ(run_alone("", "loc-live csv " + path("r.csv") + " --speed max"), 0) << errors("alone");
  EXPECT_NE(errors("alone").find("event=transport kind=hub"), std::string::npos) << errors("alone");
}

}  // namespace
}  // namespace loc::test
