// The clock model against simulated clocks whose truth is known, and against what happens to clocks in the field.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "libloc/core/statistics.hpp"
#include "libloc/sensors/clock.hpp"
#include "libloc/sensors/clock_counter.hpp"
#include "libloc/sim/clock.hpp"
#include "support/clock_checks.hpp"

namespace loc {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;
constexpr TimeNs kMax = std::numeric_limits<TimeNs>::max();
constexpr TimeNs kMin = std::numeric_limits<TimeNs>::min();
using Kind = ClockEvent::Kind;

ClockModelOptions for_pps() {
  ClockModelOptions options;
  options.initial_sigma_ns = 100'000;
  return options;
}

// The figures that the method is chosen by, on an hour of a wandering oscillator.
TEST(Clock, usb_imu_within_2_us) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const test::ClockErrors errors = test::run_clock(ClockSimulation::usb_imu(), 3600, seed, {});
    EXPECT_LE(errors.sd_us, 2.0) << "seed " << seed;
    EXPECT_LE(errors.p99_us, 6.0) << "seed " << seed;
    EXPECT_NEAR(errors.rms_error_over_sigma, 1, 0.35) << "seed " << seed;
    EXPECT_NEAR(errors.rms_error_over_sigma_warm_up, 1, 0.7) << "seed " << seed;
    EXPECT_EQ(errors.backward_steps, 0);
    EXPECT_EQ(errors.epochs, 1);
  }
}

TEST(Clock, pulses_within_1_5_us) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U, 6U}) {
    const test::ClockErrors errors = test::run_clock(ClockSimulation::pps(), 3600, seed, for_pps());
    EXPECT_LE(errors.sd_us, 1.5) << "seed " << seed;
    EXPECT_LE(errors.p99_us, 3.5) << "seed " << seed;
    EXPECT_NEAR(errors.rms_error_over_sigma, 1, 0.35) << "seed " << seed;
    EXPECT_EQ(errors.backward_steps, 0);
    EXPECT_EQ(errors.epochs, 1);
  }
}

// The very first answers: many runs, so that the sigma of the first, tenth, hundredth sample can be judged.
TEST(Clock, sigma_is_honest_from_the_first_sample) {
  for (const int after : {1, 3, 10, 30, 100, 1000, 10'000}) {
    std::vector<double> z;
    for (std::uint64_t seed = 100; seed < 160; ++seed) {
      ClockSimulator simulator(ClockSimulation::usb_imu(), Random(seed));
      ClockModelOptions options;
      options.initial_sigma_ns = 2'000'000;
      ClockModel model(options);
      ClockSample sample;
      for (int i = 0; i < after; ++i) {
        sample = simulator.next();
        model.update(sample.device_time_ns, sample.host_time_ns);
      }
      const auto stamp = model.convert(sample.device_time_ns);
      ASSERT_TRUE(stamp);
      z.push_back(static_cast<double>(stamp->time_ns - sample.earliest_host_ns) / stamp->sigma_ns);
    }
    EXPECT_GT(root_mean_square(z), 0.3) << "pessimistic after " << after;
    EXPECT_LT(root_mean_square(z), 1.6) << "too sure after " << after;
  }
}

// Nobody measures while the device is silent: sigma must grow as the error does.
TEST(Clock, sigma_is_honest_when_extrapolating) {
  ClockModelOptions options;
  options.max_extrapolation_s = 400;
  std::vector<double> z;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const auto samples = simulate_clock(ClockSimulation::usb_imu(), 600, Random(seed));
    ClockModel model(options);
    const std::size_t known = 40'000 + 1000 * static_cast<std::size_t>(seed);
    for (std::size_t i = 0; i < known; ++i) model.update(samples[i].device_time_ns, samples[i].host_time_ns);
    const ClockSample& later = samples[std::min(samples.size() - 1, known + 60 * 200)];
    const auto stamp = model.convert_once(later.device_time_ns);
    ASSERT_TRUE(stamp);
    z.push_back(static_cast<double>(stamp->time_ns - later.earliest_host_ns) / stamp->sigma_ns);
  }
  EXPECT_GT(root_mean_square(z), 0.3);
  EXPECT_LT(root_mean_square(z), 1.5);
}

TEST(Clock, recovers_offset_and_skew) {
  ClockSimulation simulation = ClockSimulation::usb_imu();
  simulation.oscillator = {.constant_ppm = -80, .wave_ppm = 0, .wave_period_s = 1, .skew_walk = 0};
  simulation.device_start_ns = -7 * kSecond;
  ClockModel model;
  for (const ClockSample& s : simulate_clock(simulation, 200, Random(1)))
    model.update(s.device_time_ns, s.host_time_ns);
  EXPECT_NEAR(model.line().skew_ppm(), -80, 5 * model.line().sigma_skew * 1e6);
  EXPECT_LT(model.line().sigma_skew, 0.1e-6);
  EXPECT_NEAR(model.mean_jitter_ns(), 1.0e6, 0.2e6);
  // Extrapolated to the device time at which both began.
  EXPECT_NEAR(static_cast<double>(model.line().convert(-7 * kSecond) - simulation.host_start_ns - 500'000), 0, 30'000);
}

TEST(Clock, epoch_scale_times_keep_their_nanoseconds) {
  // As doubles of seconds these would be off by 0.1 us.
  for (const TimeNs shift : {TimeNs{0}, TimeNs{1'763'000'000'123'456'789}, -TimeNs{1'763'000'000'123'456'789}}) {
    ClockModel model;
    for (TimeNs t = 0; t < 200 * kSecond; t += kSecond / 10) model.update(shift + t, 3 * shift / 2 + t + 1000);
    const auto stamp = model.convert(shift + 200 * kSecond);
    ASSERT_TRUE(stamp);
    EXPECT_NEAR(static_cast<double>(stamp->time_ns - (3 * shift / 2 + 200 * kSecond + 1000)), 0, 3);
    EXPECT_NEAR(model.line().skew, 0, 1e-10);
  }
}

TEST(Clock, times_do_not_step_back_through_resets_gaps_and_forward_steps) {
  ClockSimulation simulation = ClockSimulation::usb_imu();
  simulation.events = {
      {Kind::kDeviceReset, 100, 0},           {Kind::kSilence, 200, 30 * kSecond}, {Kind::kHostStep, 300, 5 * kSecond},
      {Kind::kSilence, 400, 400 * kSecond},   {Kind::kDuplicate, 900, 0},          {Kind::kLateness, 1000, kSecond},
      {Kind::kDeviceReset, 1100, 1 * kSecond}};
  const test::ClockErrors errors = test::run_clock(simulation, 1200, 4, {});
  EXPECT_EQ(errors.backward_steps, 0);
  EXPECT_EQ(errors.counts.device_resets, 2);
  EXPECT_EQ(errors.counts.host_steps_forward, 1);
  EXPECT_EQ(errors.counts.host_steps_back, 0);
  EXPECT_EQ(errors.counts.device_jumps, 0);
  EXPECT_EQ(errors.counts.gaps, 1);
  EXPECT_EQ(errors.counts.duplicates, 1);
  EXPECT_EQ(errors.counts.invalid, 0);
  EXPECT_EQ(errors.epochs, 4);
}

TEST(Clock, error_is_small_again_soon_after_a_reset) {
  ClockSimulation simulation = ClockSimulation::usb_imu();
  simulation.events = {{Kind::kDeviceReset, 300, 0}};
  ClockSimulator simulator(simulation, Random(6));
  ClockModel model;
  double worst = 0;
  int unanswered = 0;
  for (int i = 0; i < 400 * 200; ++i) {
    const ClockSample s = simulator.next();
    model.update(s.device_time_ns, s.host_time_ns);
    const auto stamp = model.convert(s.device_time_ns);
    if (!stamp) ++unanswered;
    // The skew is kept, so 5 s are enough.
    if (stamp && i > 305 * 200)
      worst = std::max(worst, std::abs(static_cast<double>(stamp->time_ns - s.earliest_host_ns)));
  }
  EXPECT_EQ(unanswered, 2) << "until the reset is believed";
  EXPECT_LT(worst, 30'000);
}

TEST(Clock, host_clock_set_back) {
  ClockSimulation simulation = ClockSimulation::usb_imu();
  simulation.events = {{Kind::kHostStep, 200, -3600 * kSecond}};
  const test::ClockErrors errors = test::run_clock(simulation, 400, 4, {});
  EXPECT_EQ(errors.counts.host_steps_back, 1);
  EXPECT_EQ(errors.counts.device_resets, 0);
  EXPECT_EQ(errors.epochs, 2);
  EXPECT_EQ(errors.backward_steps, 1) << "the host's own step, and no other";
  EXPECT_LT(errors.final_error_us, 6);
}

TEST(Clock, small_host_steps_are_found) {
  for (const TimeNs step : {-5'000'000, 30'000'000}) {
    ClockSimulation simulation = ClockSimulation::usb_imu();
    simulation.events = {{Kind::kHostStep, 200, step}};
    const test::ClockErrors errors = test::run_clock(simulation, 330, 4, {});
    EXPECT_EQ(errors.counts.host_steps_back, step < 0 ? 1 : 0) << step;
    EXPECT_EQ(errors.counts.host_steps_forward, step > 0 ? 1 : 0) << step;
    EXPECT_LT(errors.final_error_us, 6) << step;
  }
}

struct ShiftRun {
  double unaware_s = 0;       // answers that are off by more than 5 sigma
  double rms_over_sigma = 0;  // of all others; and of all but the first second of the event and that after its end
  double rms_after_1_s = 0;
  double final_error_us = 0;
  std::int64_t backward_steps = 0;
  ClockCounts counts;
};

// The host's clock is set by so much after 300 s, at once or by so many ppm; 450 s in all.
ShiftRun run_shift(double amount_ms, double rate_ppm, std::uint64_t seed) {
  std::vector<double> scaled;
  std::vector<double> scaled_after;
  std::vector<double> last_us;
  ShiftRun out;
  ClockModel model;
  TimeNs last = kMin;
  const double duration_s = rate_ppm > 0 ? 1e3 * std::abs(amount_ms) / rate_ppm : 1e-9;
  const auto samples = simulate_clock(ClockSimulation::usb_imu(), 450, Random(seed));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double s = static_cast<double>(i) / 200;
    const auto shift = static_cast<TimeNs>(1e6 * amount_ms * std::clamp((s - 300) / duration_s, 0.0, 1.0));
    model.update(samples[i].device_time_ns, samples[i].host_time_ns + shift);
    const auto stamp = model.convert(samples[i].device_time_ns);
    if (!stamp) continue;
    if (stamp->time_ns <= last) ++out.backward_steps;
    last = stamp->time_ns;
    if (s < 120) continue;
    const auto error = static_cast<double>(stamp->time_ns - samples[i].earliest_host_ns - shift);
    const double z = error / stamp->sigma_ns;
    if (std::abs(z) > 5) {
      out.unaware_s += 1.0 / 200;
    } else {
      scaled.push_back(z);
    }
    const bool begins = s >= 300 && s <= 301;
    const bool ends = s >= 300 + duration_s && s <= 301 + duration_s;
    if (!begins && !ends) scaled_after.push_back(z);
    if (s > 445) last_us.push_back(1e-3 * std::abs(error));
  }
  out.rms_over_sigma = root_mean_square(scaled);
  out.rms_after_1_s = root_mean_square(scaled_after);
  out.final_error_us = mean(last_us);
  out.counts = model.counts();
  return out;
}

// Jitter of 1 ms hides a late step until about 20 ms / step samples have come; no one can know before that.
TEST(Clock, host_steps_down_to_a_millisecond_are_in_sigma_at_once) {
  for (const double step_ms : {0.8, -0.8, 3.0, -3.0, 10.0, -10.0, 30.0, -30.0, 3000.0}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const ShiftRun r = run_shift(step_ms, 0, seed);
      const double unaware = step_ms == 0.8 ? 0.4 : step_ms == 3 ? 0.12 : 0.06;
      EXPECT_LE(r.unaware_s, unaware) << step_ms << " ms, seed " << seed;
      EXPECT_NEAR(r.rms_over_sigma, 1, 0.35) << step_ms << " ms, seed " << seed;
      EXPECT_NEAR(r.rms_after_1_s, 1, 0.35) << step_ms << " ms, seed " << seed;
      EXPECT_EQ(r.counts.host_steps_forward, step_ms > 0 ? 1 : 0) << step_ms << " ms, seed " << seed;
      EXPECT_EQ(r.counts.host_steps_back, step_ms < 0 ? 1 : 0) << step_ms << " ms, seed " << seed;
      EXPECT_EQ(r.counts.device_jumps, 0);
      EXPECT_EQ(r.backward_steps, 0) << step_ms;
      EXPECT_LT(r.final_error_us, 6) << step_ms;
    }
  }
}

TEST(Clock, slews_of_the_host_are_in_sigma_soon) {
  struct Slew {
    double amount_ms;
    double rate_ppm;
    double unaware_s;
    double rms;
  };
  // adjtime slews by 500 ppm, chrony by up to 83333 ppm. A slew shows when jitter no longer explains its beginning.
  for (const Slew& slew : {Slew{5, 500, 4, 3}, Slew{20, 500, 4, 3}, Slew{10, 83333, 0.1, 1.4}, Slew{-5, 500, 8, 3},
                           Slew{-20, 500, 8, 3}, Slew{-10, 83333, 0.1, 1.4}, Slew{5, 1000, 1, 2}}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const ShiftRun r = run_shift(slew.amount_ms, slew.rate_ppm, seed);
      EXPECT_LE(r.unaware_s, slew.unaware_s) << slew.amount_ms << " ms, " << slew.rate_ppm << " ppm, seed " << seed;
      EXPECT_LT(r.rms_over_sigma, 1.5) << slew.amount_ms << " ms, " << slew.rate_ppm << " ppm, seed " << seed;
      EXPECT_LT(r.rms_after_1_s, slew.rms) << slew.amount_ms << " ms, " << slew.rate_ppm << " ppm, seed " << seed;
      EXPECT_GE(r.counts.host_steps_forward + r.counts.host_steps_back, 1);
      EXPECT_LE(r.counts.host_steps_forward + r.counts.host_steps_back, 5) << slew.amount_ms;
      EXPECT_EQ(r.backward_steps, 0);
      EXPECT_LT(r.final_error_us, 6) << slew.amount_ms << " ms, " << slew.rate_ppm << " ppm, seed " << seed;
    }
  }
}

TEST(Clock, device_that_jumps_ahead) {
  ClockSimulation simulation = ClockSimulation::usb_imu();
  simulation.events = {{Kind::kDeviceReset, 200, 5000 * kSecond}};
  const test::ClockErrors errors = test::run_clock(simulation, 330, 4, {});
  EXPECT_EQ(errors.counts.device_jumps, 1);
  EXPECT_EQ(errors.counts.host_steps_back, 0);
  EXPECT_EQ(errors.backward_steps, 0);
  EXPECT_LT(errors.final_error_us, 6);
}

TEST(Clock, a_jam_of_the_bus_is_no_step) {
  ClockSimulation simulation = ClockSimulation::usb_imu();
  simulation.events = {{Kind::kLateness, 200, 3 * kSecond}};
  const test::ClockErrors errors = test::run_clock(simulation, 330, 5, {});
  EXPECT_EQ(errors.epochs, 1);
  EXPECT_LT(errors.max_us, 20);
  EXPECT_GE(errors.counts.suspects, 600);
}

TEST(Clock, single_absurd_times_change_nothing) {
  const auto samples = simulate_clock(ClockSimulation::usb_imu(), 300, Random(3));
  ClockModel clean;
  ClockModel disturbed;
  const TimeNs absurd[] = {0, 1, -1, kMax, kMin, kMin + 1, 400'000 * kSecond, -400'000 * kSecond};
  std::size_t next = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const ClockSample& s = samples[i];
    const bool taken = clean.update(s.device_time_ns, s.host_time_ns);
    disturbed.update(s.device_time_ns, s.host_time_ns);
    if (i > 2000 && i % 50 == 0) {
      disturbed.update(absurd[next % 8], s.host_time_ns);
      disturbed.update(s.device_time_ns, absurd[(next + 1) % 8]);
      ++next;
    }
    if (taken && i % 100 == 0) {
      const auto a = clean.convert(s.device_time_ns);
      const auto b = disturbed.convert(s.device_time_ns);
      ASSERT_TRUE(a && b);
      ASSERT_LT(std::abs(a->time_ns - b->time_ns), 1000) << i;
    }
  }
  EXPECT_EQ(disturbed.epoch(), 1);
}

TEST(Clock, anything_may_be_offered) {
  // Extremes in all orders: no overflow (the sanitizers would see it), never out of order for what increases.
  const TimeNs extremes[] = {kMin,     kMin + 1, -4'700'000'000'000'000'000, -1, 0, 1, 4'700'000'000'000'000'000,
                             kMax - 1, kMax};
  Random random(1);
  for (int run = 0; run < 200; ++run) {
    ClockModel model;
    TimeNs last_in = kMin;
    TimeNs last_out = kMin;
    std::int64_t epoch = 0;
    for (int i = 0; i < 200; ++i) {
      const auto pick = [&] { return extremes[static_cast<std::size_t>(random.uniform(0, 9))]; };
      model.update(pick(), pick());
      const TimeNs in = pick();
      if (const auto stamp = model.convert(in)) {
        EXPECT_TRUE(std::isfinite(stamp->sigma_ns));
        if (epoch == model.epoch() && in > last_in) {
          EXPECT_GE(stamp->time_ns, last_out);
        }
        if (epoch != model.epoch() || in > last_in) {
          last_in = in;
          last_out = stamp->time_ns;
        }
        epoch = model.epoch();
      }
    }
  }
}

TEST(Clock, identical_times) {
  ClockModel model;
  for (int i = 0; i < 1000; ++i) model.update(5, 1005 + i);
  const auto stamp = model.convert(5);
  ASSERT_TRUE(stamp);
  EXPECT_LE(stamp->time_ns, 1005);
  EXPECT_EQ(model.counts().duplicates, 999);
  EXPECT_GT(model.line().sigma_skew, 50e-6) << "nothing is known about the skew";
}

TEST(Clock, all_late_by_the_same) {
  // A delay that is always there cannot be told from an offset; the answer is the arrival.
  ClockModel model;
  for (TimeNs t = 0; t < 300 * kSecond; t += kSecond / 100) model.update(t, t + kSecond);
  EXPECT_EQ(model.epoch(), 1);
  EXPECT_NEAR(static_cast<double>(model.convert(300 * kSecond)->time_ns - 301 * kSecond), 0, 10);
}

TEST(Clock, samples_out_of_order_count_for_their_own_time) {
  auto samples = simulate_clock(ClockSimulation::usb_imu(), 300, Random(3));
  for (std::size_t i = 0; i + 3 < samples.size(); i += 7) std::swap(samples[i], samples[i + 3]);
  ClockModel model;
  std::vector<double> errors;
  for (const ClockSample& s : samples) {
    model.update(s.device_time_ns, s.host_time_ns);
    if (s.device_time_ns < 120 * kSecond) continue;
    errors.push_back(1e-3 * static_cast<double>(model.convert(s.device_time_ns)->time_ns - s.earliest_host_ns));
  }
  EXPECT_LT(root_mean_square(errors), 2.0);
  EXPECT_GT(model.counts().out_of_order, 8000);
}

TEST(Clock, rates_from_one_in_a_minute_to_ten_thousand_in_a_second) {
  for (const double rate : {1.0 / 60, 0.1, 5.0, 1000.0, 10'000.0}) {
    ClockSimulation simulation = ClockSimulation::usb_imu();
    simulation.rate_hz = rate;
    const test::ClockErrors errors = test::run_clock(simulation, rate < 1 ? 7200 : 200, 5, {});
    EXPECT_EQ(errors.epochs, 1) << rate;
    EXPECT_EQ(errors.backward_steps, 0) << rate;
    EXPECT_GT(errors.rms_error_over_sigma, 0.2) << rate;
    EXPECT_LT(errors.rms_error_over_sigma, 2) << rate;
  }
}

TEST(Clock, answers_only_where_it_holds) {
  ClockModel model;
  EXPECT_FALSE(model.ready());
  EXPECT_FALSE(model.convert(0));
  model.update(0, 100);
  EXPECT_TRUE(model.convert(0));
  EXPECT_TRUE(model.convert(59 * kSecond));
  EXPECT_FALSE(model.convert(61 * kSecond));
  EXPECT_FALSE(model.convert_once(kMin));
  EXPECT_FALSE(model.convert_once(-1000 * kSecond));
  model.reset();
  EXPECT_FALSE(model.ready());
  EXPECT_EQ(model.counts().samples, 1);
}

TEST(Clock, options_are_checked) {
  const auto refused = [](auto change) {
    ClockModelOptions options;
    change(options);
    EXPECT_THROW(ClockModel{options}, std::invalid_argument);
  };
  refused([](auto& o) { o.window_s = 0; });
  refused([](auto& o) { o.window_s = std::nan(""); });
  refused([](auto& o) { o.skew_sigma_ppm = -1; });
  refused([](auto& o) { o.initial_sigma_ns = 0; });
  refused([](auto& o) { o.skew_walk = 0; });
  refused([](auto& o) { o.min_step_ns = 0; });
  refused([](auto& o) { o.step_samples = 1; });
  refused([](auto& o) { o.step_s = -1; });
  refused([](auto& o) { o.early_samples = 0; });
  refused([](auto& o) { o.reset_samples = 1; });
  refused([](auto& o) { o.reset_step_ns = -1; });
  refused([](auto& o) { o.max_extrapolation_s = 1e300; });
}

TEST(ClockLine, inverse_goes_back) {
  const ClockLine line{1000 * kSecond, -5 * kSecond, 80e-6, 1000, 1e-8, 1e-8, 0, 2000 * kSecond};
  for (const TimeNs t : {TimeNs{0}, 1000 * kSecond, 1999 * kSecond + 123}) {
    EXPECT_NEAR(static_cast<double>(line.inverse().convert(line.convert(t)) - t), 0, 1.5);
  }
  EXPECT_NEAR(line.inverse().skew_ppm(), -79.9936, 1e-3);
  EXPECT_GT(line.sigma_at_ns(2000 * kSecond), line.sigma_at_ns(1000 * kSecond));
}

TEST(MonotoneTime, catches_up_at_half_rate) {
  MonotoneTime time;
  EXPECT_EQ(time.apply(0, 1000), 1000);
  EXPECT_EQ(time.apply(100, 900), 1050);
  EXPECT_EQ(time.apply(100, 100), 1050) << "same input, same output";
  EXPECT_EQ(time.apply(50, 2000), 1025) << "before the latest input";
  EXPECT_EQ(time.apply(400, 1200), 1200) << "caught up";
  time.restart_input();
  EXPECT_EQ(time.apply(0, 10), 1201);
  time.forget();
  EXPECT_EQ(time.apply(0, 10), 10);
}

TEST(CounterUnwrapper, microseconds_of_32_bits) {
  CounterUnwrapper counter;
  const std::uint64_t start = 4'294'967'290;
  EXPECT_EQ(counter.unwrap(start), static_cast<TimeNs>(start) * 1000);
  EXPECT_EQ(counter.unwrap(4), (static_cast<TimeNs>(start) + 10) * 1000);
  EXPECT_EQ(counter.wraps(), 1);
  EXPECT_EQ(counter.unwrap(4'294'967'295), (static_cast<TimeNs>(start) + 5) * 1000) << "out of order";
  EXPECT_EQ(counter.wraps(), 0);
  EXPECT_EQ(counter.unwrap(5), (static_cast<TimeNs>(start) + 11) * 1000);
}

TEST(CounterUnwrapper, every_width_through_many_turns) {
  Random random(2);
  for (int bits = 4; bits <= 64; ++bits) {
    CounterUnwrapper counter({.bits = bits, .tick_numerator_ns = 1, .tick_denominator = 1});
    const std::uint64_t mask = bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << static_cast<unsigned>(bits)) - 1;
    const double largest_step = std::ldexp(0.49, std::min(bits, 40));
    std::int64_t truth = 0;
    ASSERT_EQ(counter.unwrap(0), 0);
    for (int i = 0; i < 200; ++i) {
      truth += static_cast<std::int64_t>(random.uniform(0, largest_step));
      ASSERT_EQ(counter.unwrap(static_cast<std::uint64_t>(truth) & mask), truth) << bits << " bits";
    }
  }
}

TEST(CounterUnwrapper, fractions_of_a_nanosecond_do_not_add_up) {
  CounterUnwrapper counter({.bits = 24, .tick_numerator_ns = kSecond, .tick_denominator = 32768});
  std::uint64_t ticks = 0;
  TimeNs time = counter.unwrap(0);
  for (int day = 0; day < 365 * 24; ++day) {
    for (int i = 0; i < 15; ++i) time = counter.unwrap((ticks += 32768 * 240) & 0xffffff);
  }
  EXPECT_EQ(time, TimeNs{365} * 24 * 3600 * kSecond);
}

TEST(CounterUnwrapper, long_silence_with_another_clock) {
  CounterUnwrapper counter({.bits = 16, .tick_numerator_ns = 1'000'000, .tick_denominator = 1});
  counter.unwrap(100);
  // 65.536 s a turn; 10 turns and 5 ms later.
  EXPECT_EQ(counter.unwrap(105, 656 * kSecond), (100 + 10 * 65536 + 5) * TimeNs{1'000'000});
  EXPECT_EQ(counter.wraps(), 10);
  EXPECT_NO_THROW(counter.unwrap(105, kMax));
  EXPECT_NO_THROW(counter.unwrap(105, kMin));
  EXPECT_THROW(CounterUnwrapper({.bits = 0}), std::invalid_argument);
  EXPECT_THROW(CounterUnwrapper({.bits = 65}), std::invalid_argument);
  EXPECT_THROW(CounterUnwrapper({.bits = 32, .tick_numerator_ns = 0}), std::invalid_argument);
  EXPECT_THROW(CounterUnwrapper({.bits = 32, .tick_numerator_ns = 1, .tick_denominator = 0}), std::invalid_argument);
}

TEST(SimulatedClock, same_seed_same_clock) {
  const auto a = simulate_clock(ClockSimulation::pps(), 100, Random(1));
  const auto b = simulate_clock(ClockSimulation::pps(), 100, Random(1));
  const auto c = simulate_clock(ClockSimulation::pps(), 100, Random(2));
  ASSERT_EQ(a.size(), 100U);
  int same = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].host_time_ns, b[i].host_time_ns);
    EXPECT_GE(a[i].host_time_ns, a[i].earliest_host_ns);
    same += a[i].host_time_ns == c[i].host_time_ns ? 1 : 0;
  }
  EXPECT_EQ(same, 0);
  ClockSimulation bad;
  bad.rate_hz = 0;
  EXPECT_THROW(ClockSimulator(bad, Random(1)), std::invalid_argument);
  EXPECT_THROW(simulate_clock(ClockSimulation::pps(), -1, Random(1)), std::invalid_argument);
}

}  // namespace
}  // namespace loc
