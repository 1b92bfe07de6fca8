// A minute of real time: nothing is lost at 200 Hz and at 1 kHz, and how long an estimate takes.
#include <gtest/gtest.h>

#include "program_test.hpp"

namespace loc::test {
namespace {

struct Case {
  int rate_hz;
  const char* reorder_delay_ms;
};

TEST(ProgramsSlow, AMinuteAt200HzAndAt1kHzWithoutLoss) {
  const TemporaryFolder folder;
  // An IMU sample waits for the magnetometer to pass its time, 20 ms here; with a delay of 0 it does not wait.
  const std::vector<Case> cases = {{200, "50"}, {1000, "50"}, {1000, "0"}};
  const auto name_of = [&](const Case& one) {
    return folder.path(std::to_string(one.rate_hz) + "-" + one.reorder_delay_ms);
  };
  std::vector<ChildProcess> sessions;
  for (const Case& one : cases) {
    const std::string name = name_of(one);
    write_recording(name + ".csv", one.rate_hz, 60, one.rate_hz / 50);
    sessions.push_back(start("loc-live",
                             {"csv", name + ".csv", "--transport", "hub", "--log", name + ".lcm", "--estimator-args",
                              std::string("--reorder-delay-ms ") + one.reorder_delay_ms},
                             name + ".err"));
  }
  for (ChildProcess& live : sessions) {
    ASSERT_TRUE(live.wait(90 * kSecond));
    EXPECT_TRUE(live.succeeded()) << live.describe();
  }
  for (const Case& one : cases) {
    const std::string name = name_of(one);
    const std::string log = text_of(name + ".err");
    const std::string ended = "program=loc-estimator pid";
    EXPECT_EQ(figure(log, ended, "imu.received"), one.rate_hz * 60) << log;
    for (const char* loss : {"imu.lost", "imu.dropped", "imu.late", "imu.refused", "magnetometer.lost",
                             "magnetometer.late", "publish.failed"}) {
      EXPECT_EQ(figure(log, ended, loss), 0) << loss;
    }
    EXPECT_EQ(estimates_in(name + ".lcm").size(), static_cast<std::size_t>(one.rate_hz * 60));
    const auto latency = log.find("latency.p50_ms", log.rfind(ended));
    ASSERT_NE(latency, std::string::npos);
    std::printf("IMU %4d Hz, magnetometer 50 Hz, reorder delay %2s ms, publish to estimate: %s", one.rate_hz,
                one.reorder_delay_ms, log.substr(latency, log.find('\n', latency) + 1 - latency).c_str());
  }
}

}  // namespace
}  // namespace loc::test
