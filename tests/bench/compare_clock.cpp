// Clock models beside each other on simulated clocks (libloc/sim/clock.hpp): how far the time that each gives for a
// sample, at the moment at which it arrives, is from true time + minimum delay. One hour after a warm-up of 120 s.
//   compare_clock [SEEDS]        the table, mean over so many seeds (default 5)
//   compare_clock stamps COUNT   so many stamps of a 200 Hz device with resets, host steps forward and silences:
//                                counts the steps back (none, or exit code 1)
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "bench/clock_peers.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/sensors/clock.hpp"
#include "libloc/sensors/clock_gps.hpp"
#include "libloc/sim/clock.hpp"

namespace loc {
namespace {

constexpr double kWarmUpS = 120;
constexpr double kDurationS = 3600;

struct Figures {
  double sd_us = 0;
  double p99_us = 0;
  double rms_over_sigma = std::numeric_limits<double>::quiet_NaN();
};

using Samples = std::vector<ClockSample>;
using Method = std::function<ClockStamp(const ClockSample&)>;

Figures measure(const Samples& samples, const Method& method) {
  std::vector<double> errors;
  std::vector<double> scaled;
  for (const ClockSample& s : samples) {
    const ClockStamp stamp = method(s);
    if (to_seconds(s.device_time_ns - samples[0].device_time_ns) < kWarmUpS) continue;
    errors.push_back(1e-3 * static_cast<double>(stamp.time_ns - s.earliest_host_ns));
    if (stamp.sigma_ns > 0) scaled.push_back(1e3 * errors.back() / stamp.sigma_ns);
  }
  Figures out;
  if (!scaled.empty()) out.rms_over_sigma = root_mean_square(scaled);
  const double m = mean(errors);
  std::vector<double> centred = errors;
  for (double& e : centred) e -= m;
  out.sd_us = root_mean_square(centred);
  for (double& e : errors) e = std::abs(e);
  out.p99_us = quantile(errors, 0.99);
  return out;
}

template <class Peer>
Method peer() {
  return [p = Peer{}](const ClockSample& s) mutable {
    return ClockStamp{p.update(s.device_time_ns, s.host_time_ns), 0};
  };
}

Method ours(TimeNs initial_sigma_ns) {
  ClockModelOptions options;
  options.initial_sigma_ns = initial_sigma_ns;
  return [model = ClockModel(options)](const ClockSample& s) mutable {
    model.update(s.device_time_ns, s.host_time_ns);
    // Nothing is left out of the figures: without an answer there would be the arrival.
    return model.convert(s.device_time_ns).value_or(ClockStamp{s.host_time_ns, 0});
  };
}

// Labels are all there is: their mean delay is known, the rest is in sigma.
Method ours_labels() {
  GpsClockOptions options;
  options.label_delay_ns = ClockSimulation::nmea_only().delay.minimum_ns;
  options.sigma_label_delay_ns = 30'000'000;
  return [clock = GpsClock(options)](const ClockSample& s) mutable {
    clock.update({GpsTimeEvent::Kind::kLabel, s.host_time_ns, s.device_time_ns});
    // The clock answers host -> GPS; asked for the truth's host time, its error has the opposite sign.
    const ClockStamp gps = clock.convert(s.earliest_host_ns).value_or(ClockStamp{s.device_time_ns, 0});
    const TimeNs minimum = clock.options().label_delay_ns;
    return ClockStamp{s.earliest_host_ns - (gps.time_ns - s.device_time_ns - minimum), gps.sigma_ns};
  };
}

void print_table(int seeds) {
  struct Scenario {
    const char* name;
    ClockSimulation simulation;
    TimeNs initial_sigma_ns;
    bool labels;
  };
  const std::array<Scenario, 3> scenarios = {
      Scenario{"IMU 200 Hz over USB", ClockSimulation::usb_imu(), 10'000'000, false},
      Scenario{"PPS, kernel stamped", ClockSimulation::pps(), 100'000, false},
      Scenario{"NMEA only", ClockSimulation::nmea_only(), 200'000'000, true}};
  struct Row {
    const char* name;
    std::function<Method(const Scenario&)> make;
  };
  const std::array<Row, 4> rows = {
      Row{"arrival time itself", [](const Scenario&) { return peer<bench::ArrivalTime>(); }},
      Row{"growing least squares", [](const Scenario&) { return peer<bench::GrowingLeastSquares>(); }},
      Row{"unbounded convex hull", [](const Scenario&) { return peer<bench::ConvexHull>(); }},
      Row{"libloc, 120 s window",
          [](const Scenario& s) { return s.labels ? ours_labels() : ours(s.initial_sigma_ns); }}};
  std::printf("error sd / p99 [us], and error/sigma (rms) where a method states a sigma; mean over %d seeds\n", seeds);
  std::printf("%-24s", "");
  for (const Scenario& s : scenarios) std::printf(" | %-30s", s.name);
  std::printf("\n");
  for (const Row& row : rows) {
    std::printf("%-24s", row.name);
    for (const Scenario& scenario : scenarios) {
      Figures sum{0, 0, 0};
      for (int seed = 1; seed <= seeds; ++seed) {
        const Samples samples =
            simulate_clock(scenario.simulation, kDurationS, Random(static_cast<std::uint64_t>(seed)));
        const Figures f = measure(samples, row.make(scenario));
        sum.sd_us += f.sd_us / seeds;
        sum.p99_us += f.p99_us / seeds;
        sum.rms_over_sigma += f.rms_over_sigma / seeds;
      }
      std::printf(" | %10.1f / %8.1f", sum.sd_us, sum.p99_us);
      std::isfinite(sum.rms_over_sigma) ? std::printf("  %7.2f", sum.rms_over_sigma) : std::printf("  %7s", "");
    }
    std::printf("\n");
  }
}

int count_steps_back(std::int64_t count) {
  ClockSimulation simulation = ClockSimulation::usb_imu();
  using Kind = ClockEvent::Kind;
  const double hours = static_cast<double>(count) / 200 / 3600;
  for (double hour = 0.5; hour < hours; hour += 1) {
    const double s = 3600 * hour;
    simulation.events.push_back({Kind::kDeviceReset, s, 0});
    simulation.events.push_back({Kind::kHostStep, s + 600, 2'000'000'000});
    simulation.events.push_back({Kind::kSilence, s + 1200, 300'000'000'000});
    simulation.events.push_back({Kind::kLateness, s + 1800, 2'000'000'000});
  }
  ClockSimulator simulator(simulation, Random(1));
  ClockModel model;
  TimeNs last_in = std::numeric_limits<TimeNs>::min();
  TimeNs last_out = std::numeric_limits<TimeNs>::min();
  std::int64_t answered = 0;
  std::int64_t back = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    const ClockSample s = simulator.next();
    model.update(s.device_time_ns, s.host_time_ns);
    const auto stamp = model.convert(s.device_time_ns);
    if (!stamp) continue;
    ++answered;
    if (stamp->time_ns < last_out || (stamp->time_ns == last_out && s.device_time_ns != last_in)) ++back;
    last_in = s.device_time_ns;
    last_out = stamp->time_ns;
  }
  const ClockCounts& c = model.counts();
  std::printf("stamps=%lld answered=%lld steps_back=%lld device_resets=%lld host_steps_forward=%lld gaps=%lld\n",
              static_cast<long long>(count), static_cast<long long>(answered), static_cast<long long>(back),
              static_cast<long long>(c.device_resets), static_cast<long long>(c.host_steps_forward),
              static_cast<long long>(c.gaps));
  return back == 0 ? 0 : 1;
}

}  // namespace
}  // namespace loc

int main(int argc, char** argv) {
  if (argc == 3 && std::strcmp(argv[1], "stamps") == 0 && std::atoll(argv[2]) > 0) {
    return loc::count_steps_back(std::atoll(argv[2]));
  }
  const int seeds = argc == 1 ? 5 : std::atoi(argv[1]);
  if (argc > 2 || seeds < 1) {
    std::fprintf(stderr, "usage: compare_clock [SEEDS] | compare_clock stamps COUNT\n");
    return 2;
  }
  loc::print_table(seeds);
  return 0;
}
