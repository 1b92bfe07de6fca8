#include "libloc/sensors/clock_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"

namespace loc {
namespace {

constexpr std::int64_t kMinSamples = 20;
constexpr double kMinDurationS = 2;
constexpr double kSkewSpreadPpm = 5;

std::string fixed(double value, int digits) {
  const double scale = std::pow(10.0, digits);
  return to_text(std::round(value * scale) / scale);
}

std::string times(std::int64_t count) {
  return count == 1 ? "once" : std::to_string(count) + " times";
}

// The first samples of a line say little.
double warm_up_s(const ClockModelOptions& options, double duration_s) {
  return std::min(options.window_s, duration_s / 4);
}

// @param skew_noise_ppm what jitter leaves of the skew's error, root mean square
void judge(ClockCalibrationResult& r, const ClockModelOptions& options, double skew_noise_ppm) {
  Quality& q = r.quality;
  const ClockCounts& c = r.counts;
  if (c.used < kMinSamples || r.duration_s < kMinDurationS) {
    q.lower_to(Verdict::kRefused, std::to_string(c.used) + " samples within " + fixed(r.duration_s, 3) +
                                      " s say nothing about a clock. Record at least " + fixed(options.window_s, 0) +
                                      " s.");
    return;
  }
  if (r.duration_s < options.window_s) {
    q.lower_to(r.duration_s < options.window_s / 4 ? Verdict::kWarn : Verdict::kFair,
               "The recording lasts " + fixed(r.duration_s, 1) + " s: the skew is known to " +
                   fixed(r.skew_sigma_ppm, 4) + " ppm only. Record at least " + fixed(options.window_s, 0) + " s.");
  }
  if (r.jitter_p99_ns <= 2 && std::abs(r.skew_ppm) < 1e-3) {
    q.lower_to(Verdict::kWarn,
               "Arrivals are late by nothing and the skew is zero: the arrivals were computed from the stamps, "
               "not measured.");
  }
  const auto warn_if = [&](std::int64_t count, const char* what) {
    if (count > 0) q.lower_to(Verdict::kWarn, std::string(what) + " " + times(count) + ".");
  };
  warn_if(c.device_resets, "The device's clock started anew");
  warn_if(c.device_jumps, "The device's clock jumped");
  warn_if(c.host_steps_forward + c.host_steps_back, "The host's clock was set");
  warn_if(c.gaps, "Samples were missing for longer than the window");
  const auto share = [&](std::int64_t count) { return static_cast<double>(count) / static_cast<double>(c.samples); };
  if (share(c.invalid + c.out_of_order) > 0.01) {
    q.lower_to(Verdict::kWarn, std::to_string(c.invalid) + " samples without a time and " +
                                   std::to_string(c.out_of_order) + " out of order: is the column the right one?");
  }
  if (share(c.suspects) > 0.1) {
    q.lower_to(Verdict::kWarn, fixed(100 * share(c.suspects), 1) +
                                   " % of the samples fit no line: the arrivals may not belong to the stamps.");
  }
  // Crystals wander by a ppm or two; the jitter's own part is in the sigma of the skew.
  const double apart = r.skew_max_ppm - r.skew_min_ppm;
  if (apart > kSkewSpreadPpm + 6 * skew_noise_ppm) {
    q.lower_to(Verdict::kWarn, "The skew was between " + fixed(r.skew_min_ppm, 2) + " and " + fixed(r.skew_max_ppm, 2) +
                                   " ppm: more than jitter and a crystal explain. One of the clocks was set or slewed "
                                   "(NTP?), or the delay of the arrivals changed. Record again.");
  }
  if (std::abs(r.skew_ppm) > 500) {
    q.lower_to(Verdict::kWarn, "The skew of " + fixed(r.skew_ppm, 1) +
                                   " ppm is more than a crystal can have: is the unit of the stamps right?");
  }
  if (r.jitter_p99_ns > 50e6) {
    q.lower_to(Verdict::kFair, "One arrival of a hundred is late by more than " + fixed(r.jitter_p99_ns * 1e-6, 1) +
                                   " ms: the host or the bus is busy.");
  }
}

}  // namespace

ClockCalibrationResult calibrate_clock(std::span<const TimeNs> device_times_ns, std::span<const TimeNs> host_times_ns,
                                       const ClockModelOptions& options) {
  require(device_times_ns.size() == host_times_ns.size(), "host_times_ns: " + std::to_string(host_times_ns.size()) +
                                                              " arrivals for " +
                                                              std::to_string(device_times_ns.size()) + " stamps");
  ClockModel model(options);
  ClockCalibrationResult out;
  std::vector<double> lateness;
  std::vector<double> steps;
  TimeNs first_host = kNoTime;
  TimeNs last_host = kNoTime;
  for (const TimeNs host : host_times_ns) {
    if (host == kNoTime) continue;
    if (first_host == kNoTime) first_host = host;
    last_host = host;
  }
  if (first_host != kNoTime) out.duration_s = to_seconds(saturating_difference(last_host, first_host));
  const double warm_up = warm_up_s(options, out.duration_s);

  double skew_sum = 0;
  double skew_2 = 0;
  double skew_var = 0;
  double variance = 0;
  double counted = 0;
  TimeNs epoch_begin = kNoTime;
  std::int64_t epoch = 0;
  TimeNs before = kNoTime;
  for (std::size_t i = 0; i < device_times_ns.size(); ++i) {
    const TimeNs device = device_times_ns[i];
    const TimeNs host = host_times_ns[i];
    if (!model.update(device, host) && !model.undecided()) continue;
    const auto stamp = model.convert_once(device);
    if (!stamp) continue;
    if (epoch != model.epoch()) {
      epoch = model.epoch();
      epoch_begin = host;
      before = kNoTime;
    }
    if (before != kNoTime && device > before) steps.push_back(to_seconds(saturating_difference(device, before)));
    before = device;
    if (to_seconds(saturating_difference(host, epoch_begin)) < warm_up) continue;
    lateness.push_back(std::max(0.0, static_cast<double>(saturating_difference(host, stamp->time_ns))));
    const ClockLine& line = model.line();
    const double skew = line.skew_ppm();
    if (counted == 0) out.skew_min_ppm = out.skew_max_ppm = skew;
    out.skew_min_ppm = std::min(out.skew_min_ppm, skew);
    out.skew_max_ppm = std::max(out.skew_max_ppm, skew);
    counted += 1;
    // Welford: the squares of a large skew with a small spread would lose it.
    const double delta = skew - skew_sum;
    skew_sum += delta / counted;
    skew_2 += delta * (skew - skew_sum);
    skew_var += (line.sigma_skew * line.sigma_skew * 1e12 - skew_var) / counted;
    variance += (stamp->sigma_ns * stamp->sigma_ns - variance) / counted;
  }
  out.counts = model.counts();
  out.epochs = model.epoch();
  if (counted > 0) {
    out.skew_ppm = skew_sum;
    out.skew_sigma_ppm = std::sqrt(skew_2 / counted + skew_var);
    out.sigma_ns = std::sqrt(variance);
    out.offset_ns = saturating_difference(model.line().convert(before), before);
    out.jitter_rms_ns = root_mean_square(lateness);
    out.jitter_median_ns = quantile(lateness, 0.5);
    out.jitter_p90_ns = quantile(lateness, 0.9);
    out.jitter_p99_ns = quantile(lateness, 0.99);
    out.jitter_max_ns = *std::max_element(lateness.begin(), lateness.end());
  }
  if (!steps.empty()) out.rate_hz = 1 / quantile(steps, 0.5);
  judge(out, options, std::sqrt(skew_var));
  return out;
}

}  // namespace loc
