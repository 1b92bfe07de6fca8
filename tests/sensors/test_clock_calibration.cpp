// What a recording of stamps and arrivals says about its clock.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "libloc/sensors/clock_calibration.hpp"
#include "libloc/sim/clock.hpp"

namespace loc {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;

struct Times {
  std::vector<TimeNs> device;
  std::vector<TimeNs> host;
};

Times times_of(const ClockSimulation& simulation, double duration_s) {
  Times t;
  for (const ClockSample& s : simulate_clock(simulation, duration_s, Random(1))) {
    t.device.push_back(s.device_time_ns);
    t.host.push_back(s.host_time_ns);
  }
  return t;
}

bool any_reason_has(const Quality& quality, const std::string& text) {
  for (const std::string& reason : quality.reasons) {
    if (reason.find(text) != std::string::npos) return true;
  }
  return false;
}

TEST(CalibrateClock, finds_what_was_simulated) {
  const Times t = times_of(ClockSimulation::usb_imu(), 1200);
  const ClockCalibrationResult r = calibrate_clock(t.device, t.host);
  EXPECT_EQ(r.quality.verdict, Verdict::kOk);
  EXPECT_NEAR(r.skew_ppm, 50, 3 * r.skew_sigma_ppm);
  EXPECT_GT(r.skew_sigma_ppm, 0.2) << "it wanders by half a ppm";
  EXPECT_LT(r.skew_sigma_ppm, 0.6);
  EXPECT_LT(r.skew_min_ppm, 49.8);
  EXPECT_GT(r.skew_max_ppm, 50.2);
  EXPECT_LT(r.sigma_ns, 2000);
  // Exponential, mean 1 ms, and 1 % up to 20 ms more.
  EXPECT_NEAR(r.jitter_median_ns, 0.69e6, 0.05e6);
  EXPECT_NEAR(r.jitter_p90_ns, 2.3e6, 0.2e6);
  EXPECT_GT(r.jitter_p99_ns, 4.4e6);
  EXPECT_GT(r.jitter_max_ns, 15e6);
  EXPECT_NEAR(r.jitter_rms_ns, 1.8e6, 0.2e6);
  EXPECT_NEAR(r.rate_hz, 200, 1e-6);
  EXPECT_NEAR(r.duration_s, 1200, 0.1);
  EXPECT_NEAR(static_cast<double>(r.offset_ns), 1e12 + 1200e9 * 50e-6 + 0.5e6, 0.5e6);
  EXPECT_EQ(r.epochs, 1);
}

TEST(CalibrateClock, a_short_recording_is_not_enough) {
  const Times t = times_of(ClockSimulation::usb_imu(), 60);
  EXPECT_EQ(calibrate_clock(t.device, t.host).quality.verdict, Verdict::kFair);
  const Times shorter = times_of(ClockSimulation::usb_imu(), 20);
  const ClockCalibrationResult r = calibrate_clock(shorter.device, shorter.host);
  EXPECT_EQ(r.quality.verdict, Verdict::kWarn);
  EXPECT_NEAR(r.skew_ppm, 50, 4 * r.skew_sigma_ppm);
  EXPECT_EQ(calibrate_clock({}, {}).quality.verdict, Verdict::kRefused);
  const std::vector<TimeNs> one{5};
  EXPECT_EQ(calibrate_clock(one, one).quality.verdict, Verdict::kRefused);
}

TEST(CalibrateClock, what_happened_is_told) {
  ClockSimulation simulation = ClockSimulation::usb_imu();
  simulation.events = {{ClockEvent::Kind::kDeviceReset, 300, 0}, {ClockEvent::Kind::kHostStep, 600, -5 * kSecond}};
  const Times t = times_of(simulation, 900);
  const ClockCalibrationResult r = calibrate_clock(t.device, t.host);
  EXPECT_EQ(r.quality.verdict, Verdict::kWarn);
  EXPECT_TRUE(any_reason_has(r.quality, "The device's clock started anew once"));
  EXPECT_TRUE(any_reason_has(r.quality, "The host's clock was set once"));
  EXPECT_EQ(r.epochs, 3);
  EXPECT_NEAR(r.skew_ppm, 50, 1);
}

TEST(CalibrateClock, a_small_step_or_a_slew_of_the_host_is_not_good_enough) {
  struct Shift {
    double ms;
    double duration_s;
  };
  // At half of 300 s. The slews by 500, 100 and 10 ppm.
  for (const Shift& shift : {Shift{10, 0}, Shift{-10, 0}, Shift{1, 0}, Shift{-1, 0}, Shift{5, 10}, Shift{-5, 10},
                             Shift{3, 30}, Shift{1, 100}, Shift{-1, 100}}) {
    Times t = times_of(ClockSimulation::usb_imu(), 300);
    for (std::size_t i = 0; i < t.host.size(); ++i) {
      const double s = static_cast<double>(i) / 200 - 150;
      const double part = s < 0 ? 0 : shift.duration_s > 0 ? std::min(1.0, s / shift.duration_s) : 1;
      t.host[i] += static_cast<TimeNs>(1e6 * shift.ms * part);
    }
    const ClockCalibrationResult r = calibrate_clock(t.device, t.host);
    EXPECT_EQ(r.quality.verdict, Verdict::kWarn)
        << shift.ms << " ms within " << shift.duration_s << " s, skew " << r.skew_min_ppm << " to " << r.skew_max_ppm;
    EXPECT_TRUE(any_reason_has(r.quality, "The host's clock was set") || any_reason_has(r.quality, "slewed"));
  }
  const Times clean = times_of(ClockSimulation::usb_imu(), 300);
  EXPECT_EQ(calibrate_clock(clean.device, clean.host).quality.verdict, Verdict::kOk);
}

TEST(CalibrateClock, arrivals_that_are_copies_are_found_out) {
  Times t;
  for (int i = 0; i < 40'000; ++i) t.device.push_back(TimeNs{i} * 5'000'000);
  const ClockCalibrationResult r = calibrate_clock(t.device, t.device);
  EXPECT_EQ(r.quality.verdict, Verdict::kWarn);
  EXPECT_TRUE(any_reason_has(r.quality, "computed from the stamps"));
}

TEST(CalibrateClock, wrong_unit_and_unrelated_columns) {
  Times t = times_of(ClockSimulation::usb_imu(), 200);
  for (TimeNs& x : t.device) x = x * 999 / 1000;
  EXPECT_TRUE(any_reason_has(calibrate_clock(t.device, t.host).quality, "crystal"));
  Random random(3);
  for (TimeNs& x : t.device) x = static_cast<TimeNs>(random.uniform(-4e18, 4e18));
  EXPECT_NE(calibrate_clock(t.device, t.host).quality.verdict, Verdict::kOk);
  for (TimeNs& x : t.device) x = kNoTime;
  EXPECT_EQ(calibrate_clock(t.device, t.host).quality.verdict, Verdict::kRefused);
  t.device.pop_back();
  EXPECT_THROW(calibrate_clock(t.device, t.host), std::invalid_argument);
}

}  // namespace
}  // namespace loc
