// Runs a clock model over a simulation and compares what it says, at the moment it says it, with the truth.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "libloc/core/statistics.hpp"
#include "libloc/sensors/clock.hpp"
#include "libloc/sim/clock.hpp"

namespace loc::test {

struct ClockErrors {
  double sd_us = 0;  ///< after the first window, as all figures without "warm_up"
  double mean_us = 0;
  double p99_us = 0;  ///< of the absolute error
  double max_us = 0;
  double final_error_us = 0;  ///< mean absolute error of the last 5 s
  double rms_error_over_sigma = 0;
  double rms_error_over_sigma_warm_up = 0;
  std::int64_t backward_steps = 0;  ///< of the times put out
  std::int64_t epochs = 0;
  ClockCounts counts;
};

inline ClockErrors run_clock(const ClockSimulation& simulation, double duration_s, std::uint64_t seed,
                             const ClockModelOptions& options) {
  ClockSimulator simulator(simulation, Random(seed));
  ClockModel model(options);
  const auto count = static_cast<std::int64_t>(duration_s * simulation.rate_hz);
  std::vector<double> errors_us;
  std::vector<double> scaled;
  std::vector<double> scaled_warm_up;
  ClockErrors out;
  TimeNs last_in = std::numeric_limits<TimeNs>::min();
  TimeNs last_out = std::numeric_limits<TimeNs>::min();
  TimeNs begin = kNoTime;
  for (std::int64_t i = 0; i < count; ++i) {
    const ClockSample sample = simulator.next();
    model.update(sample.device_time_ns, sample.host_time_ns);
    const auto stamp = model.convert(sample.device_time_ns);
    if (!stamp) continue;
    // A device that starts anew is later all the same.
    const bool reset = sample.device_time_ns < last_in;
    if (stamp->time_ns < last_out || (stamp->time_ns == last_out && sample.device_time_ns > last_in && !reset)) {
      ++out.backward_steps;
    }
    last_in = sample.device_time_ns;
    last_out = stamp->time_ns;
    if (begin == kNoTime) begin = sample.earliest_host_ns;
    const double error = 1e-3 * static_cast<double>(stamp->time_ns - sample.earliest_host_ns);
    const bool warm_up = to_seconds(sample.earliest_host_ns - begin) < options.window_s;
    (warm_up ? scaled_warm_up : scaled).push_back(1e3 * error / stamp->sigma_ns);
    if (!warm_up) errors_us.push_back(error);
  }
  if (!errors_us.empty()) {
    out.mean_us = mean(errors_us);
    out.rms_error_over_sigma = root_mean_square(scaled);
    std::vector<double> centred = errors_us;
    for (double& e : centred) e -= out.mean_us;
    out.sd_us = root_mean_square(centred);
    for (double& e : errors_us) e = std::abs(e);
    const auto last = std::min(errors_us.size(), static_cast<std::size_t>(std::max(1.0, 5 * simulation.rate_hz)));
    out.final_error_us = mean(std::span(errors_us).last(last));
    out.p99_us = quantile(errors_us, 0.99);
    out.max_us = *std::max_element(errors_us.begin(), errors_us.end());
  }
  if (!scaled_warm_up.empty()) out.rms_error_over_sigma_warm_up = root_mean_square(scaled_warm_up);
  out.epochs = model.epoch();
  out.counts = model.counts();
  return out;
}

}  // namespace loc::test
