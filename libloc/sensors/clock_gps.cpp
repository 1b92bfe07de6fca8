#include "libloc/sensors/clock_gps.hpp"

#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;
constexpr TimeNs kRollover = 1024 * 7 * 86'400 * kSecond;
constexpr TimeNs kTrainGate = 10'000'000;  // pulses of a train, before its rate is known
constexpr TimeNs kTrainSpan = 30 * kSecond;
constexpr int kTrainPulses = 3;     // that make a train
constexpr int kNewTrainPulses = 5;  // that make another one while there is one
constexpr int kVotesToBegin = 3;
constexpr int kVotesToChange = 10;
constexpr int kDoubt = 3;  // labels or pulses in a row that disagree: no answer until it is clear
constexpr std::int64_t kLargestSecond = 9'000'000'000;  // in int64 nanoseconds
// Labels from whose lateness the pairing is judged, and how far from the cut they must be: in deviations of one, and of
// the mean.
constexpr std::size_t kPhasesToPair = 3;
constexpr std::size_t kPhasesToTrust = 8;  // their spread; before, it is taken to be this at least:
constexpr double kSpreadOfFewS = 0.035;
constexpr double kSigmasToPair = 3;
constexpr double kSigmasToStay = 2.5;
constexpr double kSigmasOfMean = 5;
constexpr double kLatestS = 0.5;     // against the expected delay: beyond, it is the next pulse's
constexpr double kEarliestS = -0.4;  // mean; before, labels may be late by nearly a second just as well
constexpr double kLeastSpreadS = 1e-3;
// A label is never in error by less than a second, and by tenths it is only late.
constexpr TimeNs kLabelStep = 400'000'000;

ClockModelOptions pulse_options(double max_extrapolation_s) {
  ClockModelOptions options;
  options.initial_sigma_ns = 100'000;
  options.step_samples = 8;
  options.early_samples = 3;
  options.max_extrapolation_s = max_extrapolation_s;
  return options;
}

ClockModelOptions label_options(double max_extrapolation_s) {
  ClockModelOptions options;
  options.initial_sigma_ns = 200'000'000;
  options.min_step_ns = kLabelStep;
  options.step_samples = 10;
  options.max_extrapolation_s = max_extrapolation_s;
  return options;
}

// To the nearest whole second; as many as int64 nanoseconds hold.
std::int64_t seconds_of(TimeNs time_ns) {
  const TimeNs shifted = saturating_sum(time_ns, kSecond / 2);
  return std::clamp(shifted / kSecond - (shifted % kSecond < 0 ? 1 : 0), -kLargestSecond, kLargestSecond);
}

TimeNs absolute(TimeNs time_ns) {
  return time_ns < 0 ? saturating_difference(0, time_ns) : time_ns;
}

}  // namespace

const char* basis_name(GpsClockBasis basis) {
  switch (basis) {
    case GpsClockBasis::kNone:
      return "none";
    case GpsClockBasis::kLabels:
      return "labels";
    case GpsClockBasis::kPulses:
      return "pulses";
  }
  return "?";
}

void GpsClockOptions::check() const {
  const auto require_time = [](const char* name, TimeNs value, TimeNs low, TimeNs high, const char* rule) {
    require(value >= low && value <= high, name, static_cast<double>(value), rule);
  };
  require_time("pulse_gate_ns", pulse_gate_ns, 1, kSecond / 2 - 1, "must be positive and below 0.5 s");
  require_time("pulse_delay_ns", pulse_delay_ns, -kSecond / 2, kSecond / 2, "must be within 0.5 s");
  require_time("sigma_pulse_delay_ns", sigma_pulse_delay_ns, 0, kSecond, "must be in [0, 1 s]");
  require_time("pairing_delay_ns", pairing_delay_ns, -kSecond, 2 * kSecond, "must be in [-1 s, 2 s]");
  require_time("label_delay_ns", label_delay_ns, -10 * kSecond, 10 * kSecond, "must be within 10 s");
  require_time("sigma_label_delay_ns", sigma_label_delay_ns, 1, 10 * kSecond, "must be positive, at most 10 s");
  require_positive("max_pulse_extrapolation_s", max_pulse_extrapolation_s);
  require_positive("max_label_extrapolation_s", max_label_extrapolation_s);
}

GpsClock::GpsClock(const GpsClockOptions& options)
    : options_((options.check(), options)),
      pulse_model_(pulse_options(options.max_pulse_extrapolation_s)),
      label_model_(label_options(options.max_label_extrapolation_s)) {}

void GpsClock::update(const GpsTimeEvent& event) {
  const bool pulse = event.kind == GpsTimeEvent::Kind::kPulse;
  ++(pulse ? counts_.pulses : counts_.labels);
  if (event.host_time_ns == kNoTime || (!pulse && event.gps_time_ns == kNoTime)) {
    ++counts_.invalid;
    return;
  }
  if (!pulse) {
    take_label(mend_rollover(event.gps_time_ns, event.host_time_ns), event.host_time_ns);
    count_epochs();
    return;
  }
  const std::optional<std::int64_t> index = take_pulse(event.host_time_ns);
  count_epochs();
  if (!index || event.gps_time_ns == kNoTime) return;
  // Paired already: the label comes with the pulse and must be a whole second.
  const TimeNs gps = mend_rollover(event.gps_time_ns, event.host_time_ns);
  if (absolute(saturating_difference(gps, seconds_of(gps) * kSecond)) > options_.pulse_gate_ns) {
    ++counts_.invalid;
    return;
  }
  labelled_ = paired_ = true;
  vote(seconds_of(gps) - *index);
}

// Another line, not the first one, and one that answers are made of: the host's clock was set.
void GpsClock::count_epochs() {
  const bool pulses = pulse_epoch_ > 0 && pulse_model_.epoch() != pulse_epoch_;
  const bool labels = label_epoch_ > 0 && label_model_.epoch() != label_epoch_ && !(second_ && paired_);
  if (pulses || labels) ++epoch_;
  pulse_epoch_ = pulse_model_.epoch();
  label_epoch_ = label_model_.epoch();
}

// @returns the index of the pulse in its train.
std::optional<std::int64_t> GpsClock::take_pulse(TimeNs host_ns) {
  if (locked_) {
    const TimeNs since = pulse_model_.line().inverse().convert(host_ns);
    const std::int64_t index = seconds_of(since);
    const bool whole = absolute(saturating_difference(since, index * kSecond)) <= options_.pulse_gate_ns;
    if (whole && index > last_pulse_) {
      counts_.pulses_missing += index - last_pulse_ - 1;
      ++counts_.pulses_used;
      last_pulse_ = index;
      rejected_in_a_row_ = 0;
      candidate_count_ = 0;
      pulse_model_.update(index * kSecond, host_ns);
      return index;
    }
    ++counts_.pulses_spurious;
    ++rejected_in_a_row_;
  }
  return look_for_train(host_ns);
}

// Pulses that are whole seconds apart, and enough of them, are a train.
std::optional<std::int64_t> GpsClock::look_for_train(TimeNs host_ns) {
  std::array<TimeNs, kCandidates> train{};
  std::size_t count = 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < candidate_count_; ++i) {
    const TimeNs apart = saturating_difference(host_ns, candidates_[i]);
    if (apart <= 0 || apart > kTrainSpan) continue;  // the host's clock was set, or too long ago
    candidates_[kept++] = candidates_[i];
    const std::int64_t seconds = seconds_of(apart);
    const bool later = count == 0 || candidates_[i] - train[count - 1] > kSecond / 2;
    if (seconds > 0 && later && absolute(apart - seconds * kSecond) <= kTrainGate) train[count++] = candidates_[i];
  }
  candidate_count_ = kept;
  const auto needed = static_cast<std::size_t>(locked_ ? kNewTrainPulses : kTrainPulses) - 1;
  if (count < needed || (locked_ && rejected_in_a_row_ < kNewTrainPulses)) {
    if (candidate_count_ == kCandidates) {
      std::rotate(candidates_.begin(), candidates_.begin() + 1, candidates_.end());
      --candidate_count_;
    }
    candidates_[candidate_count_++] = host_ns;
    return std::nullopt;
  }
  locked_ = true;
  ++counts_.pulse_locks;
  pulse_model_.reset();
  second_.reset();
  vote_count_ = 0;
  forget_pairing();
  disagreeing_in_a_row_ = 0;
  rejected_in_a_row_ = 0;
  candidate_count_ = 0;
  for (std::size_t i = 0; i < count; ++i) {
    pulse_model_.update(seconds_of(train[i] - train[0]) * kSecond, train[i]);
  }
  last_pulse_ = seconds_of(host_ns - train[0]);
  pulse_model_.update(last_pulse_ * kSecond, host_ns);
  counts_.pulses_used += static_cast<std::int64_t>(count) + 1;
  return last_pulse_;
}

void GpsClock::take_label(TimeNs gps_ns, TimeNs host_ns) {
  label_model_.update(gps_ns, host_ns);
  if (!locked_) return;
  if (host_ns > pulse_model_.line().inverse().valid_to_ns) {
    // The pulses have ended: labels are all there is.
    locked_ = false;
    second_.reset();
    vote_count_ = 0;
    forget_pairing();
    return;
  }
  const TimeNs since = pulse_model_.line().inverse().convert(host_ns);
  const TimeNs early = saturating_sum(saturating_difference(gps_ns, since), options_.pairing_delay_ns);
  judge_pairing(saturating_difference(seconds_of(early) * kSecond, early));
  vote(seconds_of(early) - (options_.label == PulseLabel::kNext ? 1 : 0));
}

// @param off_ns how much later than expected the label came, modulo 1 s
void GpsClock::judge_pairing(TimeNs off_ns) {
  if (labelled_) return;
  phases_[phase_count_++ % kPhases] = to_seconds(off_ns);
  const std::size_t count = std::min(phase_count_, kPhases);
  const auto n = static_cast<double>(count);
  double mean = 0;
  for (std::size_t i = 0; i < count; ++i) mean += phases_[i] / n;
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += (phases_[i] - mean) * (phases_[i] - mean);
  const double spread =
      std::max(count < kPhasesToTrust ? kSpreadOfFewS : kLeastSpreadS, std::sqrt(sum / std::max(1.0, n - 1)));
  const double reach = spread * (paired_ ? kSigmasToStay : kSigmasToPair);
  const double reach_of_mean = kSigmasOfMean * spread / std::sqrt(n);
  // Jitter makes late, not early: what reaches across the early end are single labels, which are outvoted.
  paired_ = count >= kPhasesToPair && mean + reach < kLatestS && mean - reach / 2 > -kLatestS &&
            mean - reach_of_mean > kEarliestS;
  if (!paired_ && count >= kPhasesToPair) ++counts_.labels_ambiguous;
}

void GpsClock::forget_pairing() {
  phase_count_ = 0;
  labelled_ = paired_ = false;
}

// A time that is whole multiples of 1024 weeks off comes from a receiver that counts weeks with ten bits.
TimeNs GpsClock::mend_rollover(TimeNs gps_ns, TimeNs host_ns) {
  const std::optional<ClockStamp> known = convert_once(host_ns);
  if (!known) return gps_ns;
  const TimeNs off = saturating_difference(gps_ns, known->time_ns);
  const TimeNs turns = saturating_sum(off, off < 0 ? -kRollover / 2 : kRollover / 2) / kRollover;
  if (turns == 0 || absolute(off - turns * kRollover) > 86'400 * kSecond) return gps_ns;
  ++counts_.week_rollovers;
  return gps_ns - turns * kRollover;
}

// @param second GPS second of pulse 0, as a label has it
void GpsClock::vote(std::int64_t second) {
  if (second > kLargestSecond || second < -kLargestSecond) {
    ++counts_.invalid;
    return;
  }
  votes_[vote_count_++ % kVotes] = second;
  if (second_ && second == *second_) {
    disagreeing_in_a_row_ = 0;
    return;
  }
  if (second_) {
    ++counts_.labels_disagreeing;
    ++disagreeing_in_a_row_;
  }
  const std::size_t count = std::min(vote_count_, kVotes);
  const auto same = std::count(votes_.begin(), votes_.begin() + static_cast<std::ptrdiff_t>(count), second);
  const bool majority = 2 * static_cast<std::size_t>(same) > count;
  if (!second_ && majority && same >= kVotesToBegin) {
    second_ = second;
  } else if (second_ && majority && same >= kVotesToChange) {
    second_ = second;
    disagreeing_in_a_row_ = 0;
    ++counts_.label_jumps;
    ++epoch_;
  }
}

bool GpsClock::pulses_answer() const {
  return locked_ && second_ && paired_ && disagreeing_in_a_row_ < kDoubt && rejected_in_a_row_ < kDoubt;
}

GpsClockBasis GpsClock::basis() const {
  if (pulses_answer()) return GpsClockBasis::kPulses;
  // Labels that disagree with pulses are no better alone; nor are they after the host's clock was set.
  // With a train of pulses it takes a few more labels to know what they are worth.
  if (locked_ && !paired_ && phase_count_ < kPhasesToPair) return GpsClockBasis::kNone;
  if ((second_ && paired_) || (locked_ && counts_.pulse_locks > 1)) return GpsClockBasis::kNone;
  if (!label_model_.ready() || label_model_.doubtful()) return GpsClockBasis::kNone;
  return GpsClockBasis::kLabels;
}

std::optional<ClockLine> GpsClock::line() const {
  const GpsClockBasis basis = this->basis();
  if (basis == GpsClockBasis::kNone) return std::nullopt;
  if (basis == GpsClockBasis::kPulses) {
    ClockLine line = pulse_model_.line().inverse();
    line.output_ref_ns = saturating_sum(line.output_ref_ns, *second_ * kSecond + options_.pulse_delay_ns);
    line.sigma_ns = std::hypot(line.sigma_ns, static_cast<double>(options_.sigma_pulse_delay_ns));
    return line;
  }
  ClockLine line = label_model_.line().inverse();
  const TimeNs ahead = options_.label == PulseLabel::kNext ? kSecond : 0;
  line.output_ref_ns = saturating_sum(line.output_ref_ns, options_.label_delay_ns - ahead);
  line.sigma_ns = std::hypot(line.sigma_ns, static_cast<double>(options_.sigma_label_delay_ns));
  return line;
}

std::optional<ClockStamp> GpsClock::convert_once(TimeNs host_time_ns) const {
  const std::optional<ClockLine> now = line();
  if (!now || !now->valid_at(host_time_ns)) return std::nullopt;
  return ClockStamp{now->convert(host_time_ns), now->sigma_at_ns(host_time_ns)};
}

std::optional<ClockStamp> GpsClock::convert(TimeNs host_time_ns) {
  std::optional<ClockStamp> stamp = convert_once(host_time_ns);
  if (!stamp) return std::nullopt;
  if (monotone_epoch_ != epoch()) monotone_.forget();
  monotone_epoch_ = epoch();
  return monotone_.apply(host_time_ns, *stamp);
}

ClockChain::ClockChain(const ClockModelOptions& device, const GpsClockOptions& gps) : device_(device), gps_(gps) {}

std::optional<ClockStamp> ClockChain::convert(TimeNs device_time_ns) {
  const std::optional<ClockStamp> host = device_.convert_once(device_time_ns);
  if (!host) return std::nullopt;
  std::optional<ClockStamp> stamp = gps_.convert_once(host->time_ns);
  if (!stamp) return std::nullopt;
  stamp->sigma_ns = std::hypot(stamp->sigma_ns, host->sigma_ns);
  if (gps_epoch_ != gps_.epoch()) monotone_.forget();
  if (device_epoch_ != device_.epoch()) monotone_.restart_input();
  gps_epoch_ = gps_.epoch();
  device_epoch_ = device_.epoch();
  return monotone_.apply(device_time_ns, *stamp);
}

}  // namespace loc
