// Host time to GPS time, and the chain from a device to GPS time: against simulated receivers whose truth is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "libloc/core/statistics.hpp"
#include "libloc/sensors/clock_gps.hpp"
#include "libloc/sim/clock.hpp"

namespace loc {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;
constexpr TimeNs kMinute = 60 * kSecond;
constexpr TimeNs kWeek = 7 * 86'400 * kSecond;
using Kind = GpsTimeEvent::Kind;

struct GpsRun {
  std::vector<double> errors_us;  // second by second, where there was an answer, after 120 s
  std::vector<double> scaled;     // error / sigma, likewise
  std::vector<double> sigmas_us;
  std::int64_t backward_steps = 0;
  std::int64_t unanswered = 0;  // after 120 s
  double worst_us = 0;          // of all answers from the first on
  double worst_scaled = 0;
  double sd_us() const {
    std::vector<double> e = errors_us;
    const double m = mean(e);
    for (double& x : e) x -= m;
    return root_mean_square(e);
  }
  double p99_us() const {
    std::vector<double> e = errors_us;
    for (double& x : e) x = std::abs(x);
    return quantile(e, 0.99);
  }
};

// Feeds the events; half a second after each whole second asks for the time of that moment.
GpsRun run(GpsClock& clock, const SimulatedGpsTime& time, const std::function<void(GpsTimeEvent&)>& change = {}) {
  GpsRun out;
  std::size_t next = 0;
  TimeNs last = std::numeric_limits<TimeNs>::min();
  std::int64_t epoch = 0;
  for (std::size_t i = 0; i + 1 < time.gps_time_ns.size(); ++i) {
    const TimeNs host = time.host_time_ns[i] + (time.host_time_ns[i + 1] - time.host_time_ns[i]) / 2;
    while (next < time.events.size() && time.events[next].host_time_ns <= host) {
      GpsTimeEvent event = time.events[next++];
      if (change) change(event);
      clock.update(event);
    }
    const auto stamp = clock.convert(host);
    if (!stamp) {
      out.unanswered += i >= 120 ? 1 : 0;
      continue;
    }
    if (stamp->time_ns <= last && epoch == clock.epoch()) ++out.backward_steps;
    last = stamp->time_ns;
    epoch = clock.epoch();
    const double error = 1e-3 * static_cast<double>(stamp->time_ns - time.gps_time_ns[i] - kSecond / 2);
    out.worst_us = std::max(out.worst_us, std::abs(error));
    out.worst_scaled = std::max(out.worst_scaled, 1e3 * std::abs(error) / stamp->sigma_ns);
    if (i < 120) continue;
    out.errors_us.push_back(error);
    out.scaled.push_back(1e3 * error / stamp->sigma_ns);
    out.sigmas_us.push_back(1e-3 * stamp->sigma_ns);
  }
  return out;
}

GpsTimeSimulation receiver() {
  return {};
}

TEST(GpsClock, pulses_and_labels_within_microseconds) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    GpsClock clock;
    const GpsRun r = run(clock, simulate_gps_time(receiver(), 3600, Random(seed)));
    EXPECT_EQ(clock.basis(), GpsClockBasis::kPulses);
    // As of the pulses alone; the delay of their stamps, 2 us at least, remains.
    EXPECT_LE(r.sd_us(), 1.5);
    EXPECT_NEAR(mean(r.errors_us), -2, 0.5);
    EXPECT_EQ(r.unanswered, 0);
    EXPECT_EQ(r.backward_steps, 0);
    EXPECT_LT(r.worst_scaled, 6) << "honest from the first answer on, labels only";
    EXPECT_EQ(clock.counts().pulses_used, 3599) << "all but the one after the last answer";
    EXPECT_EQ(clock.counts().labels_disagreeing, 0);
  }
}

TEST(GpsClock, known_delay_of_the_pulses_stamps_is_taken_off) {
  GpsClock clock({.pulse_delay_ns = 2'000, .sigma_pulse_delay_ns = 0});
  const GpsRun r = run(clock, simulate_gps_time(receiver(), 1200, Random(1)));
  EXPECT_NEAR(mean(r.errors_us), 0, 0.6);
  EXPECT_NEAR(root_mean_square(r.scaled), 1, 0.4);
}

TEST(GpsClock, label_names_the_next_pulse) {
  GpsTimeSimulation simulation = receiver();
  simulation.label_next = true;
  GpsClock right({.label = PulseLabel::kNext});
  EXPECT_LT(run(right, simulate_gps_time(simulation, 300, Random(1))).p99_us(), 10);
  GpsClock wrong;
  EXPECT_NEAR(mean(run(wrong, simulate_gps_time(simulation, 300, Random(1))).errors_us), 1e6, 10);
}

TEST(GpsClock, labels_of_any_delay_pair_with_their_pulse) {
  for (const TimeNs delay : {10'000'000, 110'000'000, 400'000'000, 700'000'000}) {
    GpsTimeSimulation simulation = receiver();
    simulation.labels.minimum_ns = delay;
    simulation.labels.wobble_ns = 0;
    GpsClock clock;
    const GpsRun r = run(clock, simulate_gps_time(simulation, 300, Random(1)));
    EXPECT_LT(r.p99_us(), 10) << delay;
    EXPECT_EQ(clock.counts().labels_disagreeing, 0) << delay;
  }
}

// The delay of labels cannot be seen: whoever says microseconds here pretends.
TEST(GpsClock, labels_only_say_how_little_they_know) {
  GpsTimeSimulation simulation = receiver();
  simulation.with_pulses = false;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    GpsClock clock;
    const GpsRun r = run(clock, simulate_gps_time(simulation, 3600, Random(seed)));
    EXPECT_EQ(clock.basis(), GpsClockBasis::kLabels);
    EXPECT_EQ(r.unanswered, 0);
    EXPECT_EQ(r.backward_steps, 0);
    for (const double sigma : r.sigmas_us) EXPECT_GE(sigma, 30'000);
    EXPECT_LT(r.worst_scaled, 3);
    // 350 ms are taken off, this one has 110 +- 30 ms.
    EXPECT_LT(r.worst_us, 350'000);

    // A delay that was measured makes it as good as the delay is constant: 30 ms in this receiver.
    GpsClock measured({.label_delay_ns = 110'000'000, .sigma_label_delay_ns = 25'000'000});
    const GpsRun m = run(measured, simulate_gps_time(simulation, 3600, Random(seed)));
    EXPECT_GT(root_mean_square(m.scaled), 0.5);
    EXPECT_LT(root_mean_square(m.scaled), 1.5);
    EXPECT_LT(root_mean_square(m.errors_us), 30'000);
  }
}

TEST(GpsClock, labels_only_are_honest_for_all_receivers) {
  std::vector<double> z;
  for (int i = 0; i <= 23; ++i) {
    GpsTimeSimulation simulation = receiver();
    simulation.with_pulses = false;
    simulation.labels.minimum_ns = 10'000'000 + TimeNs{30'000'000} * i;
    simulation.labels.wobble_ns = 0;
    GpsClock clock;
    const GpsRun r = run(clock, simulate_gps_time(simulation, 400, Random(static_cast<std::uint64_t>(i + 1))));
    EXPECT_LT(r.worst_scaled, 2.5) << simulation.labels.minimum_ns;
    z.insert(z.end(), r.scaled.begin(), r.scaled.end());
  }
  EXPECT_LT(root_mean_square(z), 1.2);
  EXPECT_GT(root_mean_square(z), 0.7);
}

// Lateness of nearly a second looks as if labels came before their pulse: no answer is better than one second off.
TEST(GpsClock, labels_late_by_up_to_a_second_never_pair_with_a_wrong_pulse) {
  for (const double jitter_s : {0.02, 0.05, 0.1}) {
    for (int hundredth = 0; hundredth <= 99; hundredth += hundredth < 80 ? 5 : 1) {
      const double delay_s = 0.01 * hundredth;
      for (const std::uint64_t seed : {1U, 2U, 3U}) {
        Random random(seed);
        std::vector<GpsTimeEvent> events;
        std::vector<std::int64_t> seconds;
        const TimeNs host = 1'700'000'000 * kSecond;
        const TimeNs gps = 1'400'000'000 * kSecond;
        for (std::int64_t k = 0; k < 600; ++k) {
          events.push_back({Kind::kPulse, host + k * kSecond + 2000 + from_seconds(5e-6 * random.uniform()), kNoTime});
          const double late_s = delay_s + jitter_s * random.normal();
          events.push_back({Kind::kLabel, host + k * kSecond + from_seconds(late_s), gps + k * kSecond});
        }
        std::stable_sort(events.begin(), events.end(),
                         [](const GpsTimeEvent& a, const GpsTimeEvent& b) { return a.host_time_ns < b.host_time_ns; });
        GpsClock clock;
        int wrong = 0;
        int by_pulses = 0;
        for (const GpsTimeEvent& e : events) {
          clock.update(e);
          const auto stamp = clock.convert_once(e.host_time_ns);
          if (!stamp || clock.basis() != GpsClockBasis::kPulses) continue;
          ++by_pulses;
          if (std::abs(stamp->time_ns - gps - (e.host_time_ns - host)) > kSecond / 2) ++wrong;
        }
        EXPECT_EQ(wrong, 0) << delay_s << " s +- " << jitter_s << " s, seed " << seed << ", of " << by_pulses;
        if (delay_s >= 0.1 && delay_s + 4 * jitter_s <= 0.85 && delay_s > 1.2 * jitter_s) {
          EXPECT_GT(by_pulses, 1100) << delay_s << " s +- " << jitter_s << " s";
          EXPECT_LT(clock.counts().labels_ambiguous, 20) << delay_s << " s +- " << jitter_s << " s";
        }
        if (delay_s >= 0.9) {
          EXPECT_GT(clock.counts().labels_ambiguous, 500) << delay_s << " s +- " << jitter_s << " s";
        }
      }
    }
  }
}

TEST(GpsClock, missing_and_spurious_pulses) {
  GpsTimeSimulation simulation = receiver();
  simulation.pulse_loss = 0.3;
  simulation.label_loss = 0.3;
  for (int i = 0; i < 60; ++i) {
    // At 0.2 to 0.8 s after the second: none is near a whole one.
    simulation.pulses.events.push_back(
        {ClockEvent::Kind::kSpurious, 20.0 + 15 * i, 200'000'000 + (i % 7) * 100'000'000});
  }
  GpsClock clock;
  const GpsRun r = run(clock, simulate_gps_time(simulation, 1000, Random(2)));
  EXPECT_LT(r.p99_us(), 12);
  EXPECT_EQ(r.unanswered, 0);
  EXPECT_EQ(clock.counts().pulses_spurious, 60);
  EXPECT_NEAR(static_cast<double>(clock.counts().pulses_missing), 300, 60);
  EXPECT_EQ(clock.counts().pulse_locks, 1);
}

TEST(GpsClock, pulses_inside_the_gate_twice_in_a_second) {
  SimulatedGpsTime time = simulate_gps_time(receiver(), 600, Random(2));
  std::vector<GpsTimeEvent> events;
  for (const GpsTimeEvent& e : time.events) {
    events.push_back(e);
    // The falling edge.
    if (e.kind == Kind::kPulse) events.push_back({Kind::kPulse, e.host_time_ns + 50'000'000, kNoTime});
  }
  time.events = events;
  GpsClock clock;
  const GpsRun r = run(clock, time);
  EXPECT_LT(r.p99_us(), 12);
  EXPECT_GE(clock.counts().pulses_spurious, 590);
}

TEST(GpsClock, pulses_that_are_paired_already) {
  GpsClock clock;
  const SimulatedGpsTime time = simulate_gps_time(receiver(), 300, Random(2));
  std::size_t second = 0;
  for (const GpsTimeEvent& e : time.events) {
    if (e.kind != Kind::kPulse) continue;
    clock.update({Kind::kPulse, e.host_time_ns, time.gps_time_ns[second++]});
  }
  const auto stamp = clock.convert(time.host_time_ns.back());
  ASSERT_TRUE(stamp);
  EXPECT_NEAR(static_cast<double>(stamp->time_ns - time.gps_time_ns.back()), 0, 10'000);
  // A label that is no whole second does not belong to a pulse.
  clock.update({Kind::kPulse, time.host_time_ns.back() + kSecond, time.gps_time_ns.back() + kSecond / 3});
  EXPECT_EQ(clock.counts().invalid, 1);
}

TEST(GpsClock, receiver_learns_the_leap_seconds_late) {
  // Until the almanac is there it takes 18 s for granted; then labels are another second for good.
  for (const TimeNs jump : {kSecond, -kSecond, -18 * kSecond}) {
    GpsClock clock;
    const SimulatedGpsTime time = simulate_gps_time(receiver(), 600, Random(3));
    const GpsRun r = run(clock, time, [&](GpsTimeEvent& e) {
      const bool early = e.host_time_ns < time.host_time_ns[300];
      if (e.kind == Kind::kLabel && early) e.gps_time_ns -= jump;
    });
    EXPECT_EQ(clock.counts().label_jumps, 1) << jump;
    EXPECT_EQ(r.backward_steps, 0);
    EXPECT_GE(r.unanswered, 5) << "no answer while it is not clear which labels are right";
    EXPECT_LE(r.unanswered, 15);
    EXPECT_NEAR(r.errors_us.back(), 0, 10) << jump;
  }
}

TEST(GpsClock, a_few_wrong_labels_change_nothing) {
  // Midnight: the time of day is new, the date is still that of yesterday.
  GpsClock clock;
  const SimulatedGpsTime time = simulate_gps_time(receiver(), 600, Random(3));
  const GpsRun r = run(clock, time, [&](GpsTimeEvent& e) {
    const bool wrong = e.host_time_ns > time.host_time_ns[300] && e.host_time_ns < time.host_time_ns[302];
    if (e.kind == Kind::kLabel && wrong) e.gps_time_ns -= 86'400 * kSecond;
  });
  EXPECT_EQ(clock.counts().labels_disagreeing, 2);
  EXPECT_EQ(clock.counts().label_jumps, 0);
  EXPECT_EQ(r.unanswered, 0);
  EXPECT_LT(r.p99_us(), 10);
}

TEST(GpsClock, week_rollover_in_the_middle_is_mended) {
  for (const bool with_pulses : {true, false}) {
    GpsTimeSimulation simulation = receiver();
    simulation.with_pulses = with_pulses;
    GpsClock clock;
    const SimulatedGpsTime time = simulate_gps_time(simulation, 600, Random(3));
    const GpsRun r = run(clock, time, [&](GpsTimeEvent& e) {
      const bool late = e.host_time_ns >= time.host_time_ns[300];
      if (e.kind == Kind::kLabel && late) e.gps_time_ns -= 1024 * kWeek;
    });
    EXPECT_EQ(clock.counts().week_rollovers, 299);
    EXPECT_EQ(clock.counts().label_jumps, 0);
    EXPECT_EQ(r.unanswered, 0);
    EXPECT_LT(r.worst_scaled, 6);
  }
}

TEST(GpsClock, host_clock_that_is_set) {
  for (const TimeNs step :
       {3600 * kSecond, -3600 * kSecond, 123'456'789 * kSecond + kSecond / 3, -kSecond / 2, 7 * kSecond + 30'000'000}) {
    for (const bool with_pulses : {true, false}) {
      GpsTimeSimulation simulation = receiver();
      simulation.with_pulses = with_pulses;
      simulation.pulses.host_start_ns = 1'700'000'000 * kSecond;
      simulation.pulses.events = {{ClockEvent::Kind::kHostStep, 300, step}};
      GpsClock clock;
      const SimulatedGpsTime time = simulate_gps_time(simulation, 700, Random(3));
      // In the order in which they come, whatever the clock says.
      double worst = 0;
      double last = 0;
      for (std::size_t i = 0; i < time.events.size(); ++i) {
        clock.update(time.events[i]);
        if (time.events[i].kind != Kind::kLabel || i < 100) continue;
        const std::size_t second = with_pulses ? i / 2 : i;
        const auto stamp = clock.convert(time.events[i].host_time_ns);
        if (!stamp) continue;
        const double error = static_cast<double>(stamp->time_ns - time.gps_time_ns[second]) -
                             static_cast<double>(time.events[i].host_time_ns - time.host_time_ns[second]);
        last = std::abs(error) / stamp->sigma_ns;
        // The first few samples after the step cannot know of it.
        const bool at_once = second >= 300 && second < 304;
        if (!at_once) worst = std::max(worst, last);
      }
      EXPECT_LT(worst, 6) << step << (with_pulses ? " pulses" : " labels");
      EXPECT_LT(last, 6) << step << (with_pulses ? " pulses" : " labels");
      EXPECT_EQ(clock.basis(), with_pulses ? GpsClockBasis::kPulses : GpsClockBasis::kLabels) << step;
    }
  }
}

TEST(GpsClock, pulses_that_end_leave_the_labels) {
  GpsClock clock({.max_pulse_extrapolation_s = 200});
  const SimulatedGpsTime time = simulate_gps_time(receiver(), 900, Random(3));
  GpsRun r;
  for (const GpsTimeEvent& e : time.events) {
    if (e.kind == Kind::kPulse && e.host_time_ns > time.host_time_ns[300]) continue;
    clock.update(e);
    if (e.host_time_ns < time.host_time_ns[490]) continue;
    if (e.host_time_ns < time.host_time_ns[498]) {
      EXPECT_EQ(clock.basis(), GpsClockBasis::kPulses);
      EXPECT_GT(clock.convert(e.host_time_ns)->sigma_ns, 5'000) << "nobody has corrected it for minutes";
    }
  }
  EXPECT_EQ(clock.basis(), GpsClockBasis::kLabels);
  EXPECT_GE(clock.convert(time.host_time_ns.back())->sigma_ns, 30e6);
}

TEST(GpsClock, pulses_alone_say_no_time) {
  GpsClock clock;
  for (const GpsTimeEvent& e : simulate_gps_time(receiver(), 100, Random(3)).events) {
    if (e.kind == Kind::kPulse) clock.update(e);
  }
  EXPECT_EQ(clock.basis(), GpsClockBasis::kNone);
  EXPECT_FALSE(clock.line());
  EXPECT_FALSE(clock.convert(1'000'050 * kSecond));
}

TEST(GpsClock, anything_may_be_offered) {
  const TimeNs extremes[] = {kNoTime,
                             kNoTime + 1,
                             -5'000'000'000'000'000'000,
                             -kSecond,
                             -1,
                             0,
                             1,
                             kSecond,
                             2 * kSecond,
                             3 * kSecond,
                             4'700'000'000'000'000'000,
                             std::numeric_limits<TimeNs>::max()};
  Random random(1);
  for (int i = 0; i < 300; ++i) {
    ClockChain chain;
    for (int j = 0; j < 100; ++j) {
      const auto pick = [&] { return extremes[static_cast<std::size_t>(random.uniform(0, 12))]; };
      GpsTimeEvent event{random.uniform() < 0.5 ? Kind::kPulse : Kind::kLabel, pick(), pick()};
      if (random.uniform() < 0.5) {
        // A train, so that there is something to be confused.
        event = {j % 2 == 0 ? Kind::kPulse : Kind::kLabel, j / 2 * kSecond, j % 2 == 0 ? kNoTime : pick()};
      }
      chain.update(event);
      chain.update(pick(), pick());
      const auto stamp = chain.convert(pick());
      EXPECT_TRUE(!stamp || std::isfinite(stamp->sigma_ns));
    }
  }
}

TEST(GpsClock, options_are_checked) {
  EXPECT_THROW(GpsClock({.pulse_gate_ns = 0}), std::invalid_argument);
  EXPECT_THROW(GpsClock({.pulse_gate_ns = kSecond / 2}), std::invalid_argument);
  EXPECT_THROW(GpsClock({.pulse_delay_ns = kSecond}), std::invalid_argument);
  EXPECT_THROW(GpsClock({.pairing_delay_ns = -kMinute}), std::invalid_argument);
  EXPECT_THROW(GpsClock({.label_delay_ns = kMinute}), std::invalid_argument);
  EXPECT_THROW(GpsClock({.sigma_label_delay_ns = 0}), std::invalid_argument);
  EXPECT_THROW(GpsClock({.max_pulse_extrapolation_s = -1}), std::invalid_argument);
  EXPECT_THROW(GpsClock({.max_label_extrapolation_s = std::nan("")}), std::invalid_argument);
}

// IMU over USB and a receiver on one host; truth is where both simulations share the host's clock.
TEST(ClockChain, device_to_gps) {
  const ClockSimulation imu = ClockSimulation::usb_imu();
  GpsTimeSimulation simulation = receiver();
  simulation.pulses.host_start_ns = imu.host_start_ns;
  const SimulatedGpsTime gps = simulate_gps_time(simulation, 700, Random(5));
  ClockSimulator device(imu, Random(6));
  ClockChain chain({}, {.pulse_delay_ns = 2'000, .sigma_pulse_delay_ns = 0});
  std::size_t next = 0;
  std::size_t second = 0;
  std::vector<double> scaled;
  std::vector<double> errors_us;
  TimeNs last = std::numeric_limits<TimeNs>::min();
  std::int64_t backward = 0;
  std::int64_t epoch = 0;
  for (int i = 0; i < 600 * 200; ++i) {
    const ClockSample s = device.next();
    for (; next < gps.events.size() && gps.events[next].host_time_ns < s.host_time_ns; ++next) {
      chain.update(gps.events[next]);
    }
    chain.update(s.device_time_ns, s.host_time_ns);
    const auto stamp = chain.convert(s.device_time_ns);
    if (!stamp) continue;
    if (epoch == chain.gps().epoch() && stamp->time_ns <= last) ++backward;
    epoch = chain.gps().epoch();
    last = stamp->time_ns;
    while (gps.host_time_ns[second + 1] < s.earliest_host_ns) ++second;
    if (i < 200 * 120) continue;
    const double part = static_cast<double>(s.earliest_host_ns - gps.host_time_ns[second]) /
                        static_cast<double>(gps.host_time_ns[second + 1] - gps.host_time_ns[second]);
    const double truth_ns = part * 1e9;
    const double error = static_cast<double>(stamp->time_ns - gps.gps_time_ns[second]) - truth_ns;
    errors_us.push_back(1e-3 * error);
    scaled.push_back(error / stamp->sigma_ns);
  }
  EXPECT_EQ(backward, 0);
  EXPECT_LT(root_mean_square(errors_us), 2.5);
  EXPECT_NEAR(root_mean_square(scaled), 1, 0.5);
  EXPECT_GT(scaled.size(), 90'000U);
}

}  // namespace
}  // namespace loc
