#include "libloc/sensors/clock.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libloc/core/check.hpp"
#include "libloc/sensors/clock_fit.hpp"

namespace loc {
namespace {

// Differences beyond this (146 years) are no samples.
constexpr TimeNs kTooFar = std::numeric_limits<TimeNs>::max() / 2;
constexpr double kLargestSkew = 0.1;             // no two clocks differ by more; keeps nonsense finite
constexpr int kDoublings = 5;                    // of the bins' width, until the window is full
constexpr double kSigmas = 6;                    // around the line; beyond, and beyond a step, a sample is set aside
constexpr double kJitters = 10;                  // above the line, likewise
constexpr std::int64_t kAverage = 500;           // samples over which the mean jitter and the period are averaged
constexpr TimeNs kDoubtfulSpread = 500'000'000;  // between samples set aside that belong together

constexpr int kBetweenEarly = 16;        // ordinary samples between two early ones that belong together
constexpr TimeNs kSlewed = 100'000'000;  // smaller steps may be the beginning of a slew, or its end

bool too_far(TimeNs difference) {
  return difference > kTooFar || difference < -kTooFar;
}

}  // namespace

void ClockModelOptions::check() const {
  require_positive("window_s", window_s);
  require(window_s >= 1e-3 && window_s <= 1e6, "window_s", window_s, "must be in [1e-3, 1e6]");
  require_positive("skew_sigma_ppm", skew_sigma_ppm);
  require(initial_sigma_ns > 0, "initial_sigma_ns", static_cast<double>(initial_sigma_ns), "must be positive");
  require_positive("skew_walk", skew_walk);
  require(min_step_ns > 0, "min_step_ns", static_cast<double>(min_step_ns), "must be positive");
  require(step_samples >= 2, "step_samples", step_samples, "must be at least 2");
  require_not_negative("step_s", step_s);
  require(early_samples >= 2, "early_samples", early_samples, "must be at least 2");
  require(reset_samples >= 2, "reset_samples", reset_samples, "must be at least 2");
  require(reset_step_ns > 0, "reset_step_ns", static_cast<double>(reset_step_ns), "must be positive");
  require_positive("max_extrapolation_s", max_extrapolation_s);
  require(max_extrapolation_s <= 1e6, "max_extrapolation_s", max_extrapolation_s, "must be at most 1e6");
}

ClockModel::ClockModel(const ClockModelOptions& options) : options_((options.check(), options)) {
  // The narrowest bin is at least 1 ns wide; doubling it gives the others.
  const TimeNs narrow = std::max<TimeNs>(1, from_seconds(options_.window_s / kBins) >> kDoublings);
  full_width_ns_ = narrow << kDoublings;
}

void ClockModel::reset() {
  const ClockCounts counts = counts_;
  const std::int64_t epoch = epoch_;
  *this = ClockModel(options_);
  counts_ = counts;
  epoch_ = epoch;
}

// Above the line [ns].
double ClockModel::lateness_ns(const Sample& sample) const {
  const auto passed = static_cast<double>(saturating_difference(sample.device_ns, line_.input_ref_ns));
  const TimeNs host = saturating_difference(sample.host_ns, line_.output_ref_ns);
  const TimeNs device = saturating_difference(sample.device_ns, line_.input_ref_ns);
  return static_cast<double>(saturating_difference(host, device)) - line_.skew * passed;
}

// Whether a is less late than b, by the present skew.
bool ClockModel::below(const Sample& a, const Sample& b) const {
  const TimeNs device = saturating_difference(a.device_ns, b.device_ns);
  const TimeNs host = saturating_difference(a.host_ns, b.host_ns);
  return static_cast<double>(saturating_difference(host, device)) < line_.skew * static_cast<double>(device);
}

bool ClockModel::update(TimeNs device_time_ns, TimeNs host_time_ns) {
  ++counts_.samples;
  const Sample sample{device_time_ns, host_time_ns};
  if (device_time_ns == kNoTime || host_time_ns == kNoTime) {
    ++counts_.invalid;
    return false;
  }
  if (!ready()) {
    start(sample, 0, options_.skew_sigma_ppm * 1e-6);
    take(sample, 0);
    return true;
  }
  const double lateness = lateness_ns(sample);
  watch(sample, lateness);
  const Doubt doubt = judge(sample, lateness);
  if (doubt != Doubt::kNone) return set_aside(sample, doubt);
  // After a small step back of the host many samples are late enough to look ordinary.
  if (doubt_ != Doubt::kEarly || ++ordinary_since_aside_ > kBetweenEarly) {
    doubt_ = Doubt::kNone;
    aside_count_ = 0;
  }
  take(sample, lateness);
  return true;
}

// A single absurd time, or a device that started anew, says nothing about the line.
void ClockModel::watch(const Sample& sample, double lateness) {
  const TimeNs step = saturating_difference(sample.device_ns, last_.device_ns);
  if (step < -options_.reset_step_ns || too_far(step)) return;
  if (too_far(saturating_difference(sample.host_ns, last_.host_ns))) return;
  watch_.add(lateness, {line_.sigma_at_ns(sample.device_ns), jitter_ns_, noise_ns_});
}

ClockLine ClockModel::line() const {
  ClockLine line = line_;
  line.sigma_ns = std::hypot(line.sigma_ns, doubt_ns());
  return line;
}

ClockModel::Doubt ClockModel::judge(const Sample& sample, double lateness) const {
  const TimeNs step = saturating_difference(sample.device_ns, last_.device_ns);
  if (step < -options_.reset_step_ns) return Doubt::kDeviceBack;
  // Nothing to reckon with, even if both clocks agree on it.
  if (too_far(step) || too_far(saturating_difference(sample.host_ns, last_.host_ns))) return Doubt::kEarly;
  const double gate = static_cast<double>(options_.min_step_ns) + kSigmas * line_.sigma_at_ns(sample.device_ns);
  if (lateness < -gate) return Doubt::kEarly;
  if (lateness > gate + kJitters * jitter_ns_) return Doubt::kLate;
  // Late by less than that, but without exception.
  if (watch_.late_ns() > static_cast<double>(options_.min_step_ns)) return Doubt::kLate;
  return Doubt::kNone;
}

// A run of such samples is a reset or a step; fewer are accidents. @returns whether the run is believed now.
bool ClockModel::set_aside(const Sample& sample, Doubt doubt) {
  ++counts_.suspects;
  // The samples of a run agree among themselves, and the device's time goes on.
  const TimeNs device = saturating_difference(sample.device_ns, aside_last_.device_ns);
  const TimeNs host = saturating_difference(sample.host_ns, aside_last_.host_ns);
  const TimeNs apart = saturating_difference(host, device);
  const bool goes_on = aside_count_ > 0 && !too_far(device) && !too_far(host) && device >= 0 &&
                       apart < kDoubtfulSpread && apart > -kDoubtfulSpread;
  // After a step back of the device the next samples look late or early, as the line has it.
  if (!goes_on || (doubt != doubt_ && doubt_ != Doubt::kDeviceBack)) {
    doubt_ = doubt;
    aside_count_ = 0;
    aside_first_ = sample;
    mark_ = mark_before_ = {sample.device_ns, watch_.late_ns()};
  }
  ordinary_since_aside_ = 0;
  if (saturating_difference(sample.device_ns, mark_.device_ns) > full_width_ns_) {
    mark_before_ = mark_;
    mark_ = {sample.device_ns, watch_.late_ns()};
  }
  aside_[static_cast<std::size_t>(aside_count_) % kKept] = sample;
  kept_ = std::min(kKept, static_cast<std::size_t>(aside_count_) + 1);
  aside_last_ = sample;
  ++aside_count_;
  bool believed = false;
  if (doubt_ == Doubt::kDeviceBack) {
    believed = aside_count_ >= options_.reset_samples;
  } else if (doubt_ == Doubt::kEarly) {
    believed = aside_count_ >= options_.early_samples;
  } else {
    believed = aside_count_ >= options_.step_samples &&
               to_seconds(saturating_difference(sample.host_ns, aside_first_.host_ns)) >= options_.step_s;
  }
  if (believed) start_anew();
  return believed;
}

// What the run was is told by its first sample: which of the two clocks did not go on as it used to.
void ClockModel::start_anew() {
  const auto device = static_cast<double>(saturating_difference(aside_first_.device_ns, last_.device_ns));
  const auto host = static_cast<double>(saturating_difference(aside_first_.host_ns, last_.host_ns));
  bool host_back = false;
  if (doubt_ == Doubt::kDeviceBack) {
    ++counts_.device_resets;
    monotone_.restart_input();
  } else if (std::abs(device - period_ns_) <= std::abs(host - period_ns_)) {
    host_back = doubt_ == Doubt::kEarly;
    ++(host_back ? counts_.host_steps_back : counts_.host_steps_forward);
  } else {
    ++counts_.device_jumps;
    monotone_.restart_input();
  }
  // After a small step back time slows down until the step is made up for.
  if (host_back && lateness_ns(aside_last_) < -static_cast<double>(kSlewed)) monotone_.forget();
  const double sigma = skew_sigma_of_failed_line();
  const std::size_t kept = kept_;
  const std::size_t begin =
      aside_count_ > static_cast<std::int64_t>(kKept) ? static_cast<std::size_t>(aside_count_) % kKept : 0;
  const double jitter = jitter_ns_;
  start(aside_[begin], line_.skew, sigma);
  jitter_ns_ = jitter;
  for (std::size_t i = 0; i < kept; ++i) {
    const Sample& sample = aside_[(begin + i) % kKept];
    take(sample, lateness_ns(sample));
  }
  doubt_ = Doubt::kNone;
  aside_count_ = 0;
}

// How well the skew is known after a step. The crystal is the same as before; but where a small step may be part of a
// slew, the line's skew is that of the slew, or the next line's will be.
double ClockModel::skew_sigma_of_failed_line() const {
  const double crystal = std::min(std::hypot(line_.sigma_skew, options_.skew_walk * std::sqrt(options_.window_s)),
                                  options_.skew_sigma_ppm * 1e-6);
  const double off = std::abs(lateness_ns(aside_last_));
  if (doubt_ == Doubt::kDeviceBack || off > static_cast<double>(kSlewed)) return crystal;
  double sigma = crystal;
  const auto age = static_cast<double>(saturating_difference(aside_last_.device_ns, origin_ns_));
  if (age > 0 && age < options_.window_s * 1e9) {
    // Too young to have settled: it may have been wrong from the beginning.
    sigma = std::hypot(sigma, off / age, settled_skew_ ? line_.skew - *settled_skew_ : 0);
  }
  const auto grown = static_cast<double>(saturating_difference(aside_last_.device_ns, mark_before_.device_ns));
  if (doubt_ == Doubt::kLate && grown > 0) {
    sigma = std::hypot(sigma, (watch_.late_ns() - mark_before_.late_ns) / grown);
  }
  return std::min(sigma, kLargestSkew);
}

void ClockModel::start(const Sample& first, double skew, double sigma_skew) {
  ++epoch_;
  first_bin_ = 0;
  bin_count_ = 0;
  in_epoch_ = 0;
  origin_ns_ = first.device_ns;
  width_ns_ = full_width_ns_ >> kDoublings;
  prior_skew_ = skew;
  prior_sigma_skew_ = sigma_skew;
  prior_time_ns_ = first.device_ns;
  jitter_ns_ = static_cast<double>(options_.initial_sigma_ns);
  line_ = {first.device_ns, first.host_ns, skew, jitter_ns_, sigma_skew, options_.skew_walk, 0, 0};
  noise_ns_ = jitter_ns_;
  watch_.reset();
  last_ = first;
}

void ClockModel::take(const Sample& sample, double lateness) {
  ++counts_.used;
  const TimeNs step = in_epoch_ == 0 ? 0 : sample.device_ns - last_.device_ns;
  if (in_epoch_ > 0 && step == 0) ++counts_.duplicates;
  if (step < 0) ++counts_.out_of_order;
  if (step > from_seconds(options_.window_s)) {
    // Nothing in the window any more: what is left is the skew, which has wandered since.
    ++counts_.gaps;
    const double sigma = std::hypot(line_.sigma_skew, options_.skew_walk * std::sqrt(to_seconds(step)));
    const double jitter = jitter_ns_;
    start(sample, line_.skew, std::min(sigma, options_.skew_sigma_ppm * 1e-6));
    --epoch_;
    jitter_ns_ = std::max(jitter, 1.0);
    lateness = 0;
  }
  ++in_epoch_;
  const auto average = static_cast<double>(std::min(in_epoch_, kAverage));
  if (step > 0) period_ns_ += (static_cast<double>(step) - period_ns_) / average;
  if (in_epoch_ > 1) jitter_ns_ += (std::max(0.0, lateness) - jitter_ns_) / average;
  if (step >= 0) last_ = sample;
  line_.valid_to_ns = saturating_sum(last_.device_ns, from_seconds(options_.max_extrapolation_s));
  if (put_into_bin(sample) || in_epoch_ < kBins) fit();
}

// @returns whether a bin was finished by it.
bool ClockModel::put_into_bin(const Sample& sample) {
  const TimeNs since = saturating_difference(sample.device_ns, origin_ns_);
  if (bin_count_ > 0 && since >= open_from_ns_ && since < open_from_ns_ + width_ns_) {
    Bin& open = bin(bin_count_ - 1);
    if (below(sample, open.lowest)) open.lowest = sample;
    return false;
  }
  std::int64_t index = since / width_ns_ - (since % width_ns_ < 0 ? 1 : 0);
  if (bin_count_ > 0 && index < bin(bin_count_ - 1).index) {
    // Out of order: into the bin of its time, if there is one.
    for (int i = bin_count_ - 1; i >= 0; --i) {
      if (bin(i).index == index && below(sample, bin(i).lowest)) bin(i).lowest = sample;
    }
    return false;
  }
  make_room(index);
  index = since / width_ns_;
  open_from_ns_ = index * width_ns_;
  if (bin_count_ > 0 && bin(bin_count_ - 1).index == index) {  // the bins have become wider
    Bin& open = bin(bin_count_ - 1);
    if (below(sample, open.lowest)) open.lowest = sample;
  } else {
    bin(bin_count_++) = {index, sample};
  }
  return true;
}

// Widens the bins as long as the window is not full, then lets the oldest go.
void ClockModel::make_room(std::int64_t index) {
  while (bin_count_ > 0 && width_ns_ < full_width_ns_ && index - bin(0).index >= kBins) {
    width_ns_ *= 2;
    index >>= 1;
    int kept = 0;
    for (int i = 0; i < bin_count_; ++i) {
      Bin wide = bin(i);
      wide.index >>= 1;
      if (kept > 0 && bin(kept - 1).index == wide.index) {
        if (below(wide.lowest, bin(kept - 1).lowest)) bin(kept - 1).lowest = wide.lowest;
      } else {
        bin(kept++) = wide;
      }
    }
    bin_count_ = kept;
  }
  while (bin_count_ > 0 && index - bin(0).index >= kBins) {
    first_bin_ = (first_bin_ + 1) % (kBins + 1);
    --bin_count_;
  }
}

void ClockModel::fit() {
  // The least late of k samples is late by the k-th part of the mean. The open bin, with fewer of them, has to wait.
  const double per_bin = std::max(1.0, static_cast<double>(width_ns_) / std::max(period_ns_, 1.0));
  const bool wait = in_epoch_ >= kBins && per_bin >= 2 && bin_count_ > 1;
  const auto count = static_cast<std::size_t>(wait ? bin_count_ - 1 : bin_count_);
  // Relative to the newest bin: small numbers.
  const Sample newest = bin(static_cast<int>(count) - 1).lowest;
  std::array<EnvelopePoint, kBins + 1> points;
  for (std::size_t i = 0; i < count; ++i) {
    const Sample& s = bin(static_cast<int>(i)).lowest;
    const TimeNs device = saturating_difference(s.device_ns, newest.device_ns);
    points[i] = {to_seconds(device),
                 static_cast<double>(saturating_difference(saturating_difference(s.host_ns, newest.host_ns), device))};
  }
  const double span = -points[0].x_s;
  EnvelopePrior prior;
  const double age = std::max(0.0, to_seconds(newest.device_ns - prior_time_ns_));
  prior.slope = prior_skew_ * 1e9;
  prior.sigma_slope = 1e9 * std::hypot(prior_sigma_skew_, options_.skew_walk * std::sqrt(age));
  prior.sigma_bend = 1e9 * options_.skew_walk / std::sqrt(std::max(span / 2, 1e-3));
  prior.noise_ns = jitter_ns_ / std::min(per_bin, static_cast<double>(in_epoch_));
  const Envelope envelope = fit_envelope({points.data(), count}, prior);

  const double before = lateness_ns(newest);
  line_.input_ref_ns = newest.device_ns;
  line_.output_ref_ns = saturating_sum(newest.host_ns, std::llround(envelope.value_ns));
  line_.skew = std::clamp(envelope.slope * 1e-9, -kLargestSkew, kLargestSkew);
  line_.sigma_ns = envelope.sigma_value_ns;
  line_.sigma_skew = envelope.sigma_slope * 1e-9;
  noise_ns_ = envelope.noise_ns;
  watch_.shift(lateness_ns(newest) - before);
  if (span >= options_.window_s / 2) settled_skew_ = line_.skew;
  line_.valid_from_ns = saturating_difference(bin(0).lowest.device_ns, full_width_ns_);
  // The mean lateness is above a line that has just moved.
  if (in_epoch_ < kBins) jitter_ns_ = std::max(0.0, jitter_ns_ + lateness_ns(newest) - before);
}

std::optional<ClockStamp> ClockModel::convert_once(TimeNs device_time_ns) const {
  if (!ready() || !line_.valid_at(device_time_ns)) return std::nullopt;
  // Times of samples that look as if the device had started anew or leapt ahead: the line may not be theirs.
  const bool ahead = doubt_ == Doubt::kEarly && device_time_ns > last_.device_ns;
  if ((ahead || doubt_ == Doubt::kDeviceBack) && device_time_ns >= aside_first_.device_ns &&
      device_time_ns <= aside_last_.device_ns) {
    return std::nullopt;
  }
  return ClockStamp{line_.convert(device_time_ns), std::hypot(line_.sigma_at_ns(device_time_ns), doubt_ns())};
}

std::optional<ClockStamp> ClockModel::convert(TimeNs device_time_ns) {
  const std::optional<ClockStamp> stamp = convert_once(device_time_ns);
  if (!stamp) return std::nullopt;
  return monotone_.apply(device_time_ns, *stamp);
}

}  // namespace loc
