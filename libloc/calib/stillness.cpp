#include "libloc/calib/stillness.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"

namespace loc {
namespace {

constexpr int kMinWindow = 20;
constexpr double kUniformVariance = 1.0 / 12;  // of an error of +-half a step

/// Rows that can be used, and where they are cut by gaps.
struct Usable {
  std::vector<std::int64_t> rows;
  std::vector<std::size_t> cuts;  ///< positions in rows where a block begins, and the end
};

Usable usable_rows(std::span<const TimeNs> times, const TriadRows& gyroscope, const TriadRows& accelerometer,
                   double gap_periods, Stillness& out) {
  Usable usable;
  TimeNs last = kNoTime;
  std::vector<double> periods;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const bool finite = (gyroscope.rows() == 0 || gyroscope.row(row).allFinite()) &&
                        (accelerometer.rows() == 0 || accelerometer.row(row).allFinite());
    if (!finite || times[i] == kNoTime) {
      ++out.not_finite;
    } else if (last != kNoTime && times[i] <= last) {
      ++out.out_of_order;
    } else {
      if (last != kNoTime) periods.push_back(elapsed_s(last, times[i]));
      usable.rows.push_back(static_cast<std::int64_t>(i));
      last = times[i];
    }
  }
  out.samples = static_cast<std::int64_t>(usable.rows.size());
  if (periods.empty()) return usable;
  const double period = quantile(periods, 0.5);
  out.rate_hz = 1 / period;
  usable.cuts.push_back(0);
  for (std::size_t k = 0; k < periods.size(); ++k) {
    if (periods[k] > gap_periods * period) {
      usable.cuts.push_back(k + 1);
      ++out.gaps;
    }
  }
  usable.cuts.push_back(usable.rows.size());
  return usable;
}

Eigen::Vector3d smallest_steps(const TriadRows& values, const std::vector<std::int64_t>& rows) {
  Eigen::Vector3d step = Eigen::Vector3d::Zero();
  for (std::size_t k = 1; k < rows.size(); ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const double d = std::abs(values(rows[k], axis) - values(rows[k - 1], axis));
      if (d > 0 && (step[axis] == 0 || d < step[axis])) step[axis] = d;
    }
  }
  return step;
}

/// Of one window of consecutive rows, per axis.
struct WindowVariance {
  Eigen::Vector3d variance;
  Eigen::Vector3d
      successive;  ///< half the mean squared difference of neighbours: the variance, if they are independent
};

std::vector<WindowVariance> window_variances(const TriadRows& values, const Usable& usable, int window) {
  std::vector<WindowVariance> out;
  const auto size = static_cast<std::size_t>(window);
  for (std::size_t block = 0; block + 1 < usable.cuts.size(); ++block) {
    for (std::size_t begin = usable.cuts[block]; begin + size <= usable.cuts[block + 1]; begin += size) {
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (std::size_t k = begin; k < begin + size; ++k) mean += values.row(usable.rows[k]).transpose() / window;
      WindowVariance w{.variance = Eigen::Vector3d::Zero(), .successive = Eigen::Vector3d::Zero()};
      for (std::size_t k = begin; k < begin + size; ++k) {
        const Eigen::RowVector3d row = values.row(usable.rows[k]);
        w.variance += (row.transpose() - mean).cwiseAbs2() / (window - 1);
        if (k > begin) {
          w.successive += (row - values.row(usable.rows[k - 1])).cwiseAbs2().transpose() / (2.0 * (window - 1));
        }
      }
      if (w.variance.allFinite() && w.successive.allFinite()) out.push_back(w);
    }
  }
  return out;
}

/// Logarithm of the lowest mode: the lowest place where more values lie within +-0.5 than around any place up to 1
/// away, and not just a few.
double lowest_mode(std::vector<double> logs, std::size_t least) {
  constexpr double kHalfWidth = 0.5;
  constexpr double kStep = 0.05;
  constexpr int kReach = 20;            // steps: 1 to either side
  constexpr double kLeastShare = 0.15;  // of the highest mode: smaller ones are chance
  std::sort(logs.begin(), logs.end());
  const auto bins = static_cast<std::size_t>((logs.back() - logs.front()) / kStep) + 1;
  std::vector<std::size_t> counts(bins);
  std::size_t low = 0;
  std::size_t high = 0;
  for (std::size_t b = 0; b < bins; ++b) {
    const double centre = logs.front() + static_cast<double>(b) * kStep;
    while (low < logs.size() && logs[low] < centre - kHalfWidth) ++low;
    while (high < logs.size() && logs[high] <= centre + kHalfWidth) ++high;
    counts[b] = high - low;
  }
  const std::size_t highest = *std::max_element(counts.begin(), counts.end());
  const std::size_t need =
      std::min(highest, std::max(least, static_cast<std::size_t>(kLeastShare * static_cast<double>(highest))));
  for (std::size_t b = 0; b < bins; ++b) {
    if (counts[b] < need) continue;
    const std::size_t first = b < kReach ? 0 : b - kReach;
    const std::size_t last = std::min(bins, b + kReach + 1);
    if (counts[b] == *std::max_element(counts.begin() + static_cast<std::ptrdiff_t>(first),
                                       counts.begin() + static_cast<std::ptrdiff_t>(last))) {
      const double centre = logs.front() + static_cast<double>(b) * kStep;
      const auto from = std::lower_bound(logs.begin(), logs.end(), centre - kHalfWidth);
      const auto to = std::upper_bound(logs.begin(), logs.end(), centre + kHalfWidth);
      return *(from + (to - from) / 2);
    }
  }
  return logs.front();
}

/// Noise at rest of one sensor; nullopt when it has no window.
std::optional<RestNoise> rest_noise(const TriadRows& values, const Usable& usable, int window, std::size_t least) {
  const std::vector<WindowVariance> windows = window_variances(values, usable, window);
  if (windows.empty()) return std::nullopt;
  RestNoise noise;
  noise.quantum = smallest_steps(values, usable.rows);
  const Eigen::Vector3d rounding = kUniformVariance * noise.quantum.cwiseAbs2();
  // Axes are brought to one scale by a low quantile of each, so that none of them decides alone.
  Eigen::Vector3d scale = Eigen::Vector3d::Constant(kUnknown);
  for (int axis = 0; axis < 3; ++axis) {
    if (noise.quantum[axis] == 0) continue;  // never changes
    std::vector<double> variances;
    variances.reserve(windows.size());
    for (const WindowVariance& w : windows) variances.push_back(w.variance[axis] + rounding[axis]);
    scale[axis] = quantile(variances, 0.05);
  }
  noise.variance = scale;
  if (!noise.known()) return noise;
  std::vector<double> logs;
  logs.reserve(windows.size());
  for (const WindowVariance& w : windows) logs.push_back(std::log(noise.activity(w.variance)));
  const double mode = lowest_mode(logs, least);
  std::vector<double> whiteness;
  for (std::size_t k = 0; k < windows.size(); ++k) {
    if (std::abs(logs[k] - mode) > 0.7) continue;
    whiteness.push_back(noise.activity(windows[k].successive) / noise.activity(windows[k].variance));
  }
  noise.whiteness = quantile(whiteness, 0.5);
  noise.variance *= std::exp(mode);
  return noise;
}

/// What is looked at for each usable row; of the sensors the larger value counts.
struct Motion {
  /// Of the window around the row, the nearest whole one at the ends of a block; infinite in blocks shorter than a
  /// window.
  std::vector<double> activity;
  std::vector<double> wander;  ///< between the windows before and after the row; 0 where one of them is not whole
};

void raise_activity(const TriadRows& values, const RestNoise& noise, const Usable& usable, int window, Motion& motion) {
  SlidingMoments moments(window);
  std::vector<Eigen::Vector3d> means;  // of the windows that end at each row
  const auto size = static_cast<std::size_t>(window);
  for (std::size_t block = 0; block + 1 < usable.cuts.size(); ++block) {
    const std::size_t begin = usable.cuts[block];
    const std::size_t end = usable.cuts[block + 1];
    const auto raise = [&](std::size_t k, double value) { motion.activity[k] = std::max(motion.activity[k], value); };
    if (end - begin < size) {
      for (std::size_t k = begin; k < end; ++k) raise(k, std::numeric_limits<double>::infinity());
      continue;
    }
    moments.reset();
    means.clear();
    for (std::size_t k = begin; k < end; ++k) {
      moments.push(values.row(usable.rows[k]));
      if (k + 1 < begin + size) continue;
      means.push_back(moments.mean());
      if (means.size() > size) {
        const double step = noise.wander(means.back() - means[means.size() - 1 - size], window);
        double& at = motion.wander[k + 1 - size];
        at = std::max(at, std::isnan(step) ? HUGE_VAL : step);
      }
      const double value = noise.activity(moments.variance());
      const std::size_t centre = k + 1 - size + size / 2;
      const std::size_t from = k + 1 == begin + size ? begin : centre;
      const std::size_t to = k + 1 == end ? end : centre + 1;
      for (std::size_t at = from; at < to; ++at) raise(at, std::isnan(value) ? HUGE_VAL : value);
    }
  }
}

/// Cuts what is quiet, rows [from, to) of usable, where its mean wanders, and keeps what is long and calm enough.
void cut_where_it_wanders(std::size_t from, std::size_t to, const Motion& motion, std::size_t window, double limit,
                          std::vector<std::pair<std::size_t, std::size_t>>& kept, std::int64_t& left_out) {
  if (limit == 0 || to - from < 2 * window) {
    kept.emplace_back(from, to);
    return;
  }
  constexpr double kSingle = 5;  // times the limit of the mean: one step alone
  // Only windows that are inside: at the ends they see the motion before and after.
  const std::size_t last = to - window;
  std::size_t start = from;
  const auto close = [&](std::size_t end) {
    double sum = 0;
    double count = 0;
    for (std::size_t k = start + window; k + window <= end; ++k, ++count) sum += motion.wander[k];
    if (count > 0 && sum > limit * count) {
      ++left_out;
    } else if (end > start) {
      kept.emplace_back(start, end);
    }
  };
  for (std::size_t k = from + window; k <= last; ++k) {
    if (motion.wander[k] <= kSingle * limit) continue;
    close(k);
    ++left_out;
    while (k <= last && motion.wander[k] > kSingle * limit) ++k;
    start = k;
  }
  close(to);
}

StillStatistics statistics(const TriadRows& values, const std::vector<std::int64_t>& rows, std::size_t from,
                           std::size_t to) {
  StillStatistics s;
  if (values.rows() == 0) return s;
  const auto n = static_cast<double>(to - from);
  const Eigen::Vector3d origin = values.row(rows[from]);  // differences keep their digits whatever the offset
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = from; k < to; ++k) sum += values.row(rows[k]).transpose() - origin;
  s.mean = origin + sum / n;
  s.cov.setZero();
  for (std::size_t k = from; k < to; ++k) {
    const Eigen::Vector3d d = values.row(rows[k]).transpose() - s.mean;
    s.cov += d * d.transpose() / (n - 1);
  }
  return s;
}

/// Middle of the segments' mean rates, each axis for itself, every segment with the weight of its length.
Eigen::Vector3d median_rate(const std::vector<StillSegment>& segments) {
  Eigen::Vector3d median;
  std::vector<std::size_t> order(segments.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  double total = 0;
  for (const StillSegment& s : segments) total += static_cast<double>(s.samples);
  for (int axis = 0; axis < 3; ++axis) {
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return segments[a].gyroscope.mean[axis] < segments[b].gyroscope.mean[axis];
    });
    double sum = 0;
    for (const std::size_t k : order) {
      sum += static_cast<double>(segments[k].samples);
      median[axis] = segments[k].gyroscope.mean[axis];
      if (2 * sum >= total) break;
    }
  }
  return median;
}

bool turns(const Eigen::Vector3d& mean, const Eigen::Vector3d& bias, const RestNoise& noise, double sigmas) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(mean[axis] - bias[axis]) > sigmas * std::sqrt(noise.variance[axis])) return true;
  }
  return false;
}

void note_stuck_axes(const char* name, const RestNoise& noise, Quality& quality) {
  for (int axis = 0; axis < 3; ++axis) {
    if (noise.quantum[axis] == 0) {
      quality.lower_to(Verdict::kWarn, std::string("The ") + name + "'s axis " + "xyz"[axis] +
                                           " has the same value in every sample: it gives no information.");
    }
  }
}

bool is_noise(const char* name, const RestNoise& noise, const StillnessOptions& options, Quality& quality) {
  if (!(noise.whiteness < options.min_whiteness)) return true;
  quality.lower_to(
      Verdict::kRefused,
      std::string("The quietest part of the ") + name + " is smooth (whiteness " +
          to_text(std::round(noise.whiteness * 1000) / 1000) + ", least " + to_text(options.min_whiteness) +
          "): it looks like gentle motion, not like noise at rest. Lay the device down; for a sensor behind "
          "a strong low-pass filter lower min_whiteness.");
  return false;
}

}  // namespace

void StillnessOptions::check() const {
  require_positive("min_duration_s", min_duration_s);
  require_positive("window_s", window_s);
  require_positive("enter_ratio", enter_ratio);
  require(std::isfinite(leave_ratio) && leave_ratio >= enter_ratio, "leave_ratio", leave_ratio,
          "must not be below enter_ratio");
  require_not_negative("min_whiteness", min_whiteness);
  require_not_negative("turning_sigmas", turning_sigmas);
  require_not_negative("max_wander", max_wander);
  require(std::isfinite(gap_periods) && gap_periods > 1, "gap_periods", gap_periods, "must be above 1");
}

double RestNoise::activity(const Eigen::Vector3d& window_variance) const {
  double sum = 0;
  int axes = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::isnan(variance[axis])) continue;
    sum += (window_variance[axis] + kUniformVariance * quantum[axis] * quantum[axis]) / variance[axis];
    ++axes;
  }
  return axes == 0 ? 0 : sum / axes;
}

double RestNoise::wander(const Eigen::Vector3d& mean_difference, int window) const {
  // Noise that is not white leaves more in a mean: by (1 + r) / (1 - r) for neighbours correlated by r, and whiteness
  // is 1 - r.
  const double white = std::clamp(std::isnan(whiteness) ? 1.0 : whiteness, 0.01, 1.0);
  const double factor = 2 * (2 - white) / white / window;
  double sum = 0;
  int axes = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::isnan(variance[axis])) continue;
    sum += mean_difference[axis] * mean_difference[axis] / (factor * variance[axis]);
    ++axes;
  }
  return axes == 0 ? 0 : sum / axes;
}

Stillness find_stillness(std::span<const TimeNs> times_ns, const TriadRows& gyroscope, const TriadRows& accelerometer,
                         const StillnessOptions& options) {
  options.check();
  const auto n = static_cast<Eigen::Index>(times_ns.size());
  require(gyroscope.rows() == 0 || gyroscope.rows() == n, "rows of gyroscope", static_cast<double>(gyroscope.rows()),
          "must be as many as times, or none");
  require(accelerometer.rows() == 0 || accelerometer.rows() == n, "rows of accelerometer",
          static_cast<double>(accelerometer.rows()), "must be as many as times, or none");
  require(n == 0 || gyroscope.rows() + accelerometer.rows() > 0, "gyroscope and accelerometer are both absent");

  Stillness out;
  const Usable usable = usable_rows(times_ns, gyroscope, accelerometer, options.gap_periods, out);
  if (usable.cuts.empty()) {
    out.quality.lower_to(Verdict::kRefused, "There are " + std::to_string(out.samples) +
                                                " samples that can be used: too few to look for stillness.");
    return out;
  }
  const double window = std::clamp(std::round(options.window_s * out.rate_hz), double{kMinWindow}, 1e9);
  out.window_samples = static_cast<int>(window);
  const auto least = static_cast<std::size_t>(std::ceil(options.min_duration_s * out.rate_hz / window));

  Motion motion{.activity = std::vector<double>(usable.rows.size(), 0.0),
                .wander = std::vector<double>(usable.rows.size(), 0.0)};
  bool noise_found = true;
  const auto look_at = [&](const char* name, const TriadRows& values, RestNoise& noise) {
    if (values.rows() == 0) return;
    const std::optional<RestNoise> found = rest_noise(values, usable, out.window_samples, least);
    if (!found) {
      out.quality.lower_to(Verdict::kRefused, std::string("The ") + name + " has no " +
                                                  std::to_string(out.window_samples) +
                                                  " samples in a row without a gap: too few to look for stillness.");
      noise_found = false;
      return;
    }
    noise = *found;
    note_stuck_axes(name, noise, out.quality);
    noise_found = is_noise(name, noise, options, out.quality) && noise_found;
    raise_activity(values, noise, usable, out.window_samples, motion);
  };
  look_at("gyroscope", gyroscope, out.gyroscope);
  look_at("accelerometer", accelerometer, out.accelerometer);
  if (!noise_found) return out;

  std::vector<std::pair<std::size_t, std::size_t>> parts;
  for (std::size_t block = 0; block + 1 < usable.cuts.size(); ++block) {
    const std::size_t end = usable.cuts[block + 1];
    for (std::size_t k = usable.cuts[block]; k < end; ++k) {
      if (!(motion.activity[k] < options.enter_ratio)) continue;
      const std::size_t from = k;
      while (k < end && motion.activity[k] <= options.leave_ratio) ++k;
      cut_where_it_wanders(from, k, motion, static_cast<std::size_t>(out.window_samples), options.max_wander, parts,
                           out.wandering_segments);
    }
  }
  for (const auto& [from, to] : parts) {
    StillSegment segment;
    segment.begin = usable.rows[from];
    segment.end = usable.rows[to - 1] + 1;
    segment.start_ns = times_ns[static_cast<std::size_t>(segment.begin)];
    segment.end_ns = times_ns[static_cast<std::size_t>(segment.end - 1)];
    segment.samples = static_cast<std::int64_t>(to - from);
    if (segment.samples < 2 || segment.duration_s() < options.min_duration_s) continue;
    segment.gyroscope = statistics(gyroscope, usable.rows, from, to);
    segment.accelerometer = statistics(accelerometer, usable.rows, from, to);
    out.segments.push_back(segment);
  }
  if (gyroscope.rows() > 0 && options.turning_sigmas > 0 && out.segments.size() > 1) {
    const Eigen::Vector3d bias = median_rate(out.segments);
    out.turning_segments = static_cast<std::int64_t>(std::erase_if(out.segments, [&](const StillSegment& s) {
      return turns(s.gyroscope.mean, bias, out.gyroscope, options.turning_sigmas);
    }));
  }
  std::int64_t still = 0;
  for (const StillSegment& s : out.segments) still += s.samples;
  out.still_share = static_cast<double>(still) / static_cast<double>(out.samples);
  if (out.segments.empty()) {
    out.quality.lower_to(Verdict::kRefused,
                         "The device was nowhere still for " + to_text(options.min_duration_s) + " s in a row.");
  }
  return out;
}

StillnessDetector::StillnessDetector(RestNoise gyroscope, RestNoise accelerometer, double rate_hz, int window_samples,
                                     const StillnessOptions& options, Eigen::Vector3d gyroscope_bias)
    : options_(options),
      gyroscope_(std::move(gyroscope)),
      accelerometer_(std::move(accelerometer)),
      gyroscope_bias_(std::move(gyroscope_bias)),
      gap_s_(options.gap_periods / rate_hz),
      gyroscope_window_(window_samples),
      accelerometer_window_(window_samples) {
  options.check();
  require_positive("rate_hz", rate_hz);
  require(gyroscope_.known() || accelerometer_.known(), "the noise at rest of neither sensor is known");
  for (const RestNoise* noise : {&gyroscope_, &accelerometer_}) {
    for (const double v : noise->variance) require(std::isnan(v) || v > 0, "variance", v, "must be positive, or NaN");
  }
}

bool StillnessDetector::update(TimeNs time_ns, const Eigen::Vector3d& gyroscope, const Eigen::Vector3d& accelerometer) {
  const bool finite = (!gyroscope_.known() || gyroscope.allFinite()) &&
                      (!accelerometer_.known() || accelerometer.allFinite()) && time_ns != kNoTime;
  if (!finite || (last_ns_ != kNoTime && time_ns <= last_ns_)) {
    ++rejected_;
    return still();
  }
  if (last_ns_ != kNoTime && elapsed_s(last_ns_, time_ns) > gap_s_) {
    gyroscope_window_.reset();
    accelerometer_window_.reset();
    still_since_ns_ = kNoTime;
  }
  last_ns_ = time_ns;
  double activity = 0;
  const auto look_at = [&](const RestNoise& noise, SlidingMoments& window, const Eigen::Vector3d& value) {
    if (!noise.known()) return;
    window.push(value);
    const double a = window.full() ? noise.activity(window.variance()) : HUGE_VAL;
    activity = std::max(activity, std::isnan(a) ? HUGE_VAL : a);
  };
  look_at(gyroscope_, gyroscope_window_, gyroscope);
  look_at(accelerometer_, accelerometer_window_, accelerometer);
  if (gyroscope_.known() && gyroscope_window_.full() && options_.turning_sigmas > 0 &&
      turns(gyroscope_window_.mean(), gyroscope_bias_, gyroscope_, options_.turning_sigmas)) {
    activity = HUGE_VAL;
  }
  if (activity > options_.leave_ratio) {
    still_since_ns_ = kNoTime;
  } else if (activity < options_.enter_ratio && !still()) {
    still_since_ns_ = time_ns;
  }
  return still();
}

}  // namespace loc
