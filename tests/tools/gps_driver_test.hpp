// loc-driver on a hub, with what it publishes and logs.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gps_feed.hpp"
#include "loc/gps_fix_t.hpp"
#include "loc/source_status_t.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"
#include "program_test.hpp"
#include "tools/support/gps_connection.hpp"
#include "tools/support/lcm_link.hpp"
#include "tools/support/program.hpp"

namespace loc::test {

class GpsDriverTest : public ::testing::Test {
 protected:
  GpsDriverTest() : hub_(folder_), receiver_(hub_.url) {
    receiver_.subscribe("LOC_GPS",
                        [this](auto, auto data) { fixes_.push_back(from_message(decode_message<gps_fix_t>(data))); });
    receiver_.subscribe(kSourceStatusChannel, [this](auto, auto data) {
      const auto status = decode_message<source_status_t>(data);
      if (!status.message.empty()) troubles_ += status.message + "\n";
      ++statuses_;
    });
    receiver_.handle(50);
  }
  std::string path(const std::string& name) const { return folder_.path(name); }
  std::string log() const { return text_of(path("driver.err")); }
  void start_driver(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--lcm-url", hub_.url});
    driver_.emplace(start("loc-driver", arguments, path("driver.err")));
  }
  /// Lets messages in until that many fixes have come.
  bool receive(std::size_t fixes, TimeNs patience = 15 * kSecond) {
    return wait_for([&] { return fixes_.size() >= fixes; }, patience);
  }
  bool wait_for(const std::function<bool()>& condition, TimeNs patience = 15 * kSecond) {
    const TimeNs give_up = steady_now() + patience;
    while (!condition()) {
      if (steady_now() > give_up) return false;
      receiver_.handle(10);
    }
    return true;
  }
  bool connected(int times) {
    return wait_for([&] {
      return log().find("event=gps_connected") != std::string::npos &&
             log().find("connections=" + std::to_string(times)) != std::string::npos;
    });
  }
  std::int64_t end_and_count(const std::string& name) {
    if (driver_->running()) {
      EXPECT_TRUE(driver_->stop(3 * kSecond)) << log();
      EXPECT_TRUE(driver_->succeeded()) << driver_->describe() << log();
    }
    return figure(log(), "event=ended", name);
  }
  /// Fixes of these epochs in this order, with their values.
  void expect_epochs(const std::vector<int>& epochs) {
    ASSERT_EQ(fixes_.size(), epochs.size()) << log();
    for (std::size_t k = 0; k < epochs.size(); ++k) {
      const GpsMeasurement& m = fixes_[k];
      ASSERT_EQ(m.gps_time_ns, epoch_gps_time_ns(epochs[k])) << "fix " << k;
      EXPECT_EQ(m.fix, GpsFixType::k3d);
      EXPECT_NEAR(m.latitude, epoch_latitude(epochs[k]), 1e-12);
      EXPECT_DOUBLE_EQ(m.altitude, 348);
      EXPECT_EQ(m.sequence, static_cast<std::int64_t>(k));
      EXPECT_EQ(m.time_ns, m.host_time_ns) << "its arrival";
      EXPECT_LT(std::abs(m.host_time_ns - host_now()), 60 * kSecond);
      EXPECT_GE(m.host_time_ns, fixes_[k == 0 ? 0 : k - 1].host_time_ns);
    }
  }

  TemporaryFolder folder_;
  RunningHub hub_;
  LcmReceiver receiver_;
  std::vector<GpsMeasurement> fixes_;
  std::string troubles_;
  int statuses_ = 0;
  std::optional<ChildProcess> driver_;
};

}  // namespace loc::test
