// A minute of real time: nothing is lost at 200 Hz and at 1 kHz, and how long an estimate takes.
#include <gtest/gtest.h>

#include "program_test.hpp"

namespace loc::test {
namespace {

TEST(ProgramsSlow, AMinuteAt200HzAndAt1kHzWithoutLoss) {
  const TemporaryFolder folder;
  const auto start_live = [&](int rate) {
    const std::string name = folder.path(std::to_string(rate));
    write_recording(name + ".csv", rate, 60, rate / 50);
    return start("loc-live", {"csv", name + ".csv", "--transport", "hub", "--log", name + ".lcm"}, name + ".err");
  };
  ChildProcess slow = start_live(200);
  ChildProcess fast = start_live(1000);
  for (ChildProcess* live : {&slow, &fast}) {
    ASSERT_TRUE(live->wait(90 * kSecond));
    EXPECT_TRUE(live->succeeded()) << live->describe();
  }
  for (const int rate : {200, 1000}) {
    const std::string name = folder.path(std::to_string(rate));
    const std::string log = text_of(name + ".err");
    const std::string ended = "program=loc-estimator pid";
    EXPECT_EQ(figure(log, ended, "imu.received"), rate * 60) << log;
    for (const char* loss :
         {"imu.lost", "imu.dropped", "imu.late", "imu.refused", "magnetometer.lost", "publish.failed"}) {
      EXPECT_EQ(figure(log, ended, loss), 0) << loss;
    }
    EXPECT_EQ(estimates_in(name + ".lcm").size(), static_cast<std::size_t>(rate * 60));
    const auto latency = log.find("latency.p50_ms", log.rfind(ended));
    ASSERT_NE(latency, std::string::npos);
    std::printf("IMU %4d Hz, magnetometer 50 Hz, publish to estimate: %s", rate,
                log.substr(latency, log.find('\n', latency) + 1 - latency).c_str());
  }
}

}  // namespace
}  // namespace loc::test
