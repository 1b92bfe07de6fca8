// loc-driver --time-base as a process: stamps on LCM, what it says, exit codes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "libloc/io/lcm_log.hpp"
#include "libloc/sim/clock.hpp"
#include "loc/source_status_t.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"
#include "program_test.hpp"
#include "support/lcm_messages.hpp"
#include "tools/support/lcm_link.hpp"

namespace loc::test {
namespace {

constexpr double kDurationS = 20;

// 20 s of an IMU whose clock counts from 0, and fixes that tell GPS time 0.11 s late.
std::vector<ClockSample> write_log(const std::string& path) {
  const auto imu = simulate_clock(ClockSimulation::usb_imu(), kDurationS, Random(1));
  GpsTimeSimulation receiver;
  receiver.with_pulses = false;
  receiver.pulses.host_start_ns = ClockSimulation::usb_imu().host_start_ns;
  const auto gps = simulate_gps_time(receiver, kDurationS, Random(2));
  LcmLogWriter writer(path);
  std::size_t next = 0;
  for (std::size_t i = 0; i < imu.size(); ++i) {
    for (; next < gps.events.size() && gps.events[next].host_time_ns < imu[i].host_time_ns; ++next) {
      GpsMeasurement fix = gps_sample();
      fix.time_ns = fix.host_time_ns = gps.events[next].host_time_ns;
      fix.gps_time_ns = gps.events[next].gps_time_ns;
      writer.write(fix.host_time_ns / 1000, "LOC_GPS", encode(to_message(fix)));
    }
    ImuMeasurement m = imu_sample(imu[i].device_time_ns, static_cast<std::int64_t>(i));
    m.host_time_ns = imu[i].host_time_ns;
    writer.write(m.host_time_ns / 1000, "LOC_IMU", encode(to_message(m)));
  }
  writer.flush();
  return imu;
}

class TimeBase : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.path(name); }
  TemporaryFolder folder_;
};

TEST_F(TimeBase, a_recording_comes_out_in_gps_time) {
  const std::vector<ClockSample> truth = write_log(path("r.lcm"));
  const RunningHub hub(folder_);
  std::vector<ImuMeasurement> out;
  bool ended = false;
  LcmReceiver receiver(hub.url);
  receiver.subscribe("LOC_IMU", [&](auto, auto data) { out.push_back(from_message(decode_message<imu_t>(data))); });
  receiver.subscribe("LOC_SOURCE_STATUS", [&](auto, auto data) {
    ended = ended || decode_message<source_status_t>(data).state == source_status_t::STATE_ENDED;
  });
  ChildProcess driver =
      start("loc-driver", {"lcm-log", path("r.lcm"), "--time-base", "gps", "--speed", "20", "--lcm-url", hub.url},
            path("driver.err"));
  wait_until(
      [&] {
        while (receiver.handle(20)) {
        }
        return ended;
      },
      30 * kSecond);
  ASSERT_TRUE(driver.wait(10 * kSecond));
  EXPECT_TRUE(driver.succeeded()) << text_of(path("driver.err"));
  ASSERT_EQ(out.size(), truth.size()) << text_of(path("driver.err"));
  const TimeNs first_gps = GpsTimeSimulation{}.first_gps_time_ns;
  const TimeNs first_host = ClockSimulation::usb_imu().host_start_ns;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto k = static_cast<std::size_t>(out[i].sequence);
    const double error_s = to_seconds(out[i].time_ns - first_gps - (truth[k].earliest_host_ns - first_host));
    ASSERT_LT(std::abs(error_s), 0.5) << i << ": labels are good for tenths of a second";
    if (i > 0) {
      ASSERT_GT(out[i].time_ns, out[i - 1].time_ns) << i;
    }
  }
  const std::string lines = text_of(path("driver.err"));
  EXPECT_NE(lines.find("event=clock clock=host onto=gps basis=labels"), std::string::npos) << lines;
  EXPECT_EQ(figure(lines, "event=ended", "clock.stamped"), 4000 + figure(lines, "event=ended", "gps.published"));
}

TEST_F(TimeBase, what_cannot_work_is_said) {
  write_recording(path("r.csv"), 100, 2);
  const RunningHub hub(folder_);
  EXPECT_EQ(run("loc-driver", {"csv", path("r.csv"), "--time-base", "host", "--lcm-url", hub.url}, path("a.err")), 1);
  EXPECT_NE(text_of(path("a.err")).find("host_time_ns is unknown"), std::string::npos) << text_of(path("a.err"));
  for (const auto& wrong : std::vector<std::vector<std::string>>{{"--time-base", "utc"},
                                                                 {"--time-base", "gps", "--gps-pulse-label", "last"},
                                                                 {"--time-base", "gps", "--gps-label-delay", "nan"},
                                                                 {"--time-base", "gps", "--time-base-wait", "-1"}}) {
    std::vector<std::string> arguments = {"csv", path("r.csv"), "--lcm-url", hub.url};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    EXPECT_EQ(run("loc-driver", arguments, path("b.err")), 2) << wrong.back() << text_of(path("b.err"));
  }
}

}  // namespace
}  // namespace loc::test
