#include "tools/support/restamp.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "libloc/core/check.hpp"
#include "msgs/convert.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;
constexpr TimeNs kReportEvery = 10 * kSecond;
constexpr std::size_t kOdometryTimes = 64;    // as far back as a relative pose may begin, in samples
constexpr TimeNs kForgetOther = 5 * kSecond;  // without news from one program another may take its place

std::string name_of(StreamKind kind, int camera) {
  return stream_name(kind) + (has_camera(kind) ? std::to_string(camera) : std::string());
}

}  // namespace

TimeBase parse_time_base(const std::string& text) {
  if (text == "device") return TimeBase::kDevice;
  if (text == "host") return TimeBase::kHost;
  if (text == "gps") return TimeBase::kGps;
  throw UsageError("--time-base '" + text + "': must be device, host or gps");
}

std::string host_identity() {
  std::string id;
  std::getline(std::ifstream("/proc/sys/kernel/random/boot_id"), id);
  if (!id.empty()) return id;
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

std::string own_name() {
  return "loc-driver " + std::to_string(::getpid());
}

void RestampOptions::check() const {
  const auto require_s = [](const char* name, double value) {
    require_not_negative(name, value);
    require(value <= 1e6, name, value, "must be at most 1e6");
  };
  require_s("warm_up_s", warm_up_s);
  require_s("pulse_wait_s", pulse_wait_s);
  require_s("wait_s", wait_s);
  require(max_waiting > 0, "max_waiting", 0, "must be positive");
  clock.check();
  gps.check();
}

RestampedSource::RestampedSource(std::unique_ptr<MeasurementSource> source, RestampOptions options)
    : source_(std::move(source)), options_((options.check(), std::move(options))), gps_(options_.gps) {}

std::optional<Measurement> RestampedSource::next() {
  if (options_.base == TimeBase::kDevice) return as_it_is();
  for (;;) {
    while (!waiting_.empty()) {
      Waiting& first = waiting_.front();
      const TimeNs device_ns = stamp_of(first.measurement).time_ns;
      const Outcome outcome = stamp(first);
      if (outcome == Outcome::kWait) {
        const TimeNs waited = saturating_difference(newest_arrival_ns_, stamp_of(first.measurement).host_time_ns);
        if (waiting_.size() <= options_.max_waiting && waited <= from_seconds(options_.wait_s)) break;
        drop_oldest();
        continue;
      }
      Measurement measurement = std::move(first.measurement);
      waiting_.pop_front();
      if (outcome == Outcome::kNever || outcome == Outcome::kDisagrees) {
        ++(outcome == Outcome::kNever ? absurd_ : time_disagrees_);
        continue;
      }
      ++stamped_;
      if (auto* odometry = std::get_if<OdometryMeasurement>(&measurement)) move_start(*odometry, device_ns);
      return measurement;
    }
    if (ended_) {
      dropped_ += static_cast<std::int64_t>(waiting_.size());
      waiting_.clear();
      const std::int64_t refused = bad_messages_ + other_sources_ + other_hosts_;
      if (refused > 0 && !std::exchange(told_refusal_, true)) {
        log_warning("event=clock_messages_refused wrong={} of_other_hosts={} of_second_program={} last=\"{}\"",
                    bad_messages_, other_hosts_, other_sources_, last_refusal_);
      }
      if (stamped_ == 0 && dropped_ > 0 && !stopped_) {
        throw DataError(
            "--time-base " + std::string(options_.base == TimeBase::kGps ? "gps" : "host") + ": none of " +
            std::to_string(dropped_) + " measurements could be stamped, because " +
            (options_.base == TimeBase::kGps
                 ? "no GPS time became known (no fix with a time, no pulse and label, nothing on LOC_CLOCK" +
                       (refused > 0
                            ? " but " + std::to_string(refused) + " refused messages, the last: " + last_refusal_ + ")"
                            : std::string(")"))
                 : std::string("their clock did not become known")));
      }
      return std::nullopt;
    }
    std::optional<Measurement> measurement = source_->next();
    if (options_.poll) options_.poll();
    if (measurement) {
      accept(std::move(*measurement));
    } else {
      ended_ = true;
    }
    report();
  }
}

std::optional<Measurement> RestampedSource::as_it_is() {
  std::optional<Measurement> measurement = source_->next();
  if (options_.poll) options_.poll();
  const auto* fix = measurement ? std::get_if<GpsMeasurement>(&*measurement) : nullptr;
  if (fix != nullptr) listen(*fix);
  report();
  return measurement;
}

// Fixes say the time, too, unless the receiver's own events say it better.
void RestampedSource::listen(const GpsMeasurement& fix) {
  newest_arrival_ns_ = std::max(newest_arrival_ns_, fix.host_time_ns);
  if (own_events_ || fix.gps_time_ns == kNoTime || fix.host_time_ns == kNoTime) return;
  follow({GpsTimeEvent::Kind::kLabel, fix.host_time_ns, fix.gps_time_ns});
}

void RestampedSource::accept(Measurement measurement) {
  const StreamKind kind = kind_of(measurement);
  const StreamId id{kind, camera_of(measurement)};
  const Stamp& s = stamp_of(measurement);
  if (s.host_time_ns == kNoTime) {
    throw DataError(name_of(id.first, id.second) + " at time_ns = " + std::to_string(s.time_ns) +
                    ": host_time_ns is unknown; without arrivals --time-base host and gps cannot work");
  }
  newest_arrival_ns_ = std::max(newest_arrival_ns_, s.host_time_ns);
  auto [entry, is_new] = streams_.try_emplace(id, Stream{ClockModel(options_.clock), {}});
  Stream& stream = entry->second;
  if (is_new) stream.first_arrival_ns = s.host_time_ns;
  Waiting waiting{std::move(measurement), id, 0, std::nullopt};
  const auto* fix = std::get_if<GpsMeasurement>(&waiting.measurement);
  if (fix != nullptr && fix->gps_time_ns != kNoTime) {
    listen(*fix);
  } else {
    stream.model.update(stamp_of(waiting.measurement).time_ns, stamp_of(waiting.measurement).host_time_ns);
    waiting.host = stream.model.convert_once(stamp_of(waiting.measurement).time_ns);
  }
  waiting.epoch = stream.model.epoch();
  waiting_.push_back(std::move(waiting));
}

// Both ends of a relative pose are on one clock. A start that is the time of an earlier sample gets that sample's time,
// so that poses which join still do; any other one keeps its distance to the end.
void RestampedSource::move_start(OdometryMeasurement& odometry, TimeNs device_ns) {
  const TimeNs start_ns = odometry.start_time_ns;
  if (start_ns != kNoTime) {
    const auto same = std::ranges::find(odometry_times_, start_ns, &std::pair<TimeNs, TimeNs>::first);
    odometry.start_time_ns =
        same != odometry_times_.end() && same->second < odometry.time_ns
            ? same->second
            : std::max(kNoTime + 1,
                       saturating_difference(odometry.time_ns, saturating_difference(device_ns, start_ns)));
  }
  odometry_times_.emplace_back(device_ns, odometry.time_ns);
  if (odometry_times_.size() > kOdometryTimes) odometry_times_.pop_front();
}

void RestampedSource::drop_oldest() {
  if (!told_waiting_) {
    log_warning("event=clock_unknown dropped=\"what has waited for it longer than {} s\" waiting={}", options_.wait_s,
                waiting_.size());
  }
  told_waiting_ = true;
  ++dropped_;
  waiting_.pop_front();
}

RestampedSource::Outcome RestampedSource::stamp(Waiting& waiting) {
  auto* fix = std::get_if<GpsMeasurement>(&waiting.measurement);
  Stream& stream = streams_.at(waiting.stream);
  Stamp& s = stamp_of(waiting.measurement);
  if (fix != nullptr && fix->gps_time_ns != kNoTime) {
    if (options_.base == TimeBase::kGps) {
      // Its own time of validity, once the other streams have one on the same clock.
      const auto line = host_to_gps(fix->host_time_ns);
      if (!line) return Outcome::kWait;
      if (disagrees(*fix, *line)) return Outcome::kDisagrees;
      s.time_ns = monotone(stream, fix->gps_time_ns, fix->gps_time_ns);
      return Outcome::kStamped;
    }
    const auto line = gps_.line();
    if (!line) return Outcome::kWait;
    if (disagrees(*fix, *line)) return Outcome::kDisagrees;
    s.time_ns = monotone(stream, fix->gps_time_ns, line->inverse().convert(fix->gps_time_ns));
    return Outcome::kStamped;
  }
  const bool warm =
      ended_ || saturating_difference(newest_arrival_ns_, stream.first_arrival_ns) >= from_seconds(options_.warm_up_s);
  if (!warm) return Outcome::kWait;
  if (!waiting.host) {
    // Set aside: either the first samples of a new line, or absurd.
    if (waiting.epoch == stream.model.epoch()) {
      return stream.model.undecided() && !ended_ ? Outcome::kWait : Outcome::kNever;
    }
    waiting.host = stream.model.convert_once(s.time_ns);
    if (!waiting.host) return Outcome::kNever;
  } else if (waiting.epoch == stream.model.epoch()) {
    // What came under an earlier line keeps the time that it had by that one.
    if (const auto now = stream.model.convert_once(s.time_ns)) waiting.host = now;
  }
  TimeNs time_ns = waiting.host->time_ns;
  if (options_.base == TimeBase::kGps) {
    const auto line = host_to_gps(time_ns);
    if (!line) return Outcome::kWait;
    time_ns = line->convert(time_ns);
  }
  s.time_ns = monotone(stream, s.time_ns, time_ns);
  return Outcome::kStamped;
}

bool RestampedSource::disagrees(const GpsMeasurement& fix, const ClockLine& line) {
  const TimeNs difference = saturating_difference(line.convert(fix.host_time_ns), fix.gps_time_ns);
  const double limit = static_cast<double>(kSecond) + 6 * line.sigma_at_ns(fix.host_time_ns);
  return std::abs(static_cast<double>(difference)) > limit;
}

TimeNs RestampedSource::monotone(Stream& stream, TimeNs device_ns, TimeNs time_ns) {
  const std::int64_t back = stream.model.counts().host_steps_back;
  const bool host_set_back = options_.base == TimeBase::kHost && back != stream.host_steps_back;
  const bool gps_changed = options_.base == TimeBase::kGps && gps_epoch() != stream.gps_epoch;
  if (host_set_back || (gps_changed && stream.gps_epoch >= 0)) {
    ++stream.steps;
    stream.monotone.forget();
  } else if (stream.device_epoch != stream.model.epoch()) {
    stream.monotone.restart_input();
  }
  stream.host_steps_back = back;
  stream.device_epoch = stream.model.epoch();
  stream.gps_epoch = gps_epoch();
  return stream.monotone.apply(device_ns, time_ns);
}

std::int64_t RestampedSource::gps_epoch() const {
  return gps_.basis() != GpsClockBasis::kNone || !other_ ? gps_.epoch() : other_epoch_;
}

std::optional<ClockLine> RestampedSource::host_to_gps(TimeNs host_ns) const {
  const GpsClockBasis basis = gps_.basis();
  if (basis != GpsClockBasis::kNone) {
    const auto waited = saturating_difference(newest_arrival_ns_, gps_since_ns_);
    const bool too_early = basis == GpsClockBasis::kLabels && !ended_ && waited < from_seconds(options_.pulse_wait_s);
    const auto line = gps_.line();
    if (too_early || !line->valid_at(host_ns)) return std::nullopt;
    return line;
  }
  if (gps_since_ns_ != kNoTime || !other_ || !other_->valid_at(host_ns)) return std::nullopt;
  const TimeNs waited = saturating_difference(newest_arrival_ns_, other_since_ns_);
  if (other_labels_ && !ended_ && waited < from_seconds(options_.pulse_wait_s)) return std::nullopt;
  return other_;
}

void RestampedSource::take(const GpsTimeEvent& event) {
  own_events_ = true;
  follow(event);
}

void RestampedSource::follow(const GpsTimeEvent& event) {
  gps_.update(event);
  if (event.gps_time_ns != kNoTime && gps_since_ns_ == kNoTime) gps_since_ns_ = event.host_time_ns;
  newest_arrival_ns_ = std::max(newest_arrival_ns_, event.host_time_ns);
  if (!options_.send || (next_send_ns_ != kNoTime && event.host_time_ns < next_send_ns_ &&
                         next_send_ns_ - event.host_time_ns <= kSecond)) {
    return;
  }
  const auto line = gps_.line();
  if (!line) return;
  next_send_ns_ = saturating_sum(event.host_time_ns, kSecond * 9 / 10);
  clock_t message = to_message(*line);
  message.time_ns = host_now();
  message.source = options_.sender;
  message.host = options_.host;
  message.input_clock = "host";
  message.output_clock = "gps";
  message.epoch = gps_.epoch();
  message.quality = gps_.basis() == GpsClockBasis::kPulses ? clock_t::QUALITY_PULSES : clock_t::QUALITY_LABELS;
  options_.send(std::move(message));
}

void RestampedSource::take(const clock_t& message) {
  if (message.input_clock != "host" || message.output_clock != "gps") return;
  if (message.host != options_.host) {
    refuse(other_hosts_, "it is about the clock of another host (" + message.source + " on " + message.host + ")");
    return;
  }
  if (message.source == options_.sender) return;
  ClockLine line;
  try {
    line = from_message(message);
  } catch (const DataError& error) {
    refuse(bad_messages_, error.what());
    return;
  }
  // One program at a time: two receivers differ by microseconds, and to and fro between them is no time.
  const TimeNs now = steady();
  const bool silent = other_ && now - other_heard_ns_ > kForgetOther;
  if (other_ && other_source_ != message.source && !silent) {
    refuse(other_sources_, message.source + " speaks while " + other_source_ + " is followed");
    return;
  }
  if (!other_ || other_source_ != message.source || other_epoch_ != message.epoch) {
    log_info("event=clock clock=host onto=gps from=\"{}\" epoch={} sigma_us={:.1f}", message.source, message.epoch,
             line.sigma_ns * 1e-3);
  }
  if (!other_ || other_source_ != message.source) other_since_ns_ = newest_arrival_ns_;
  other_ = line;
  other_labels_ = message.quality == clock_t::QUALITY_LABELS;
  // The same message once more is no news.
  if (other_source_ != message.source || other_sent_ns_ != message.time_ns) other_heard_ns_ = now;
  other_sent_ns_ = message.time_ns;
  other_source_ = message.source;
  other_epoch_ = message.epoch;
}

void RestampedSource::refuse(std::int64_t& count, const std::string& why) {
  if (count++ == 0) log_warning("event=clock_message_refused reason=\"{}\"", why);
  last_refusal_ = why;
}

TimeNs RestampedSource::steady() const {
  return options_.steady ? options_.steady() : steady_now();
}

std::vector<ClockStatus> RestampedSource::status() const {
  std::vector<ClockStatus> out;
  const auto add = [&](std::string clock, std::string onto, std::string basis, const ClockLine& line, TimeNs at) {
    out.push_back({std::move(clock), std::move(onto), std::move(basis), to_seconds(line.offset_ns()), line.skew_ppm(),
                   line.sigma_at_ns(at) * 1e-3});
  };
  for (const auto& [id, stream] : streams_) {
    if (!stream.model.ready()) continue;
    const ClockLine& line = stream.model.line();
    add(name_of(id.first, id.second), "host", "samples", line, line.inverse().convert(newest_arrival_ns_));
  }
  if (options_.base == TimeBase::kGps || gps_since_ns_ != kNoTime) {
    if (const auto line = gps_.line()) {
      add("host", "gps", basis_name(gps_.basis()), *line, newest_arrival_ns_);
    } else if (other_) {
      add("host", "gps", "other", *other_, newest_arrival_ns_);
    } else {
      out.push_back({"host", "gps", "none", kUnknown, kUnknown, kUnknown});
    }
  }
  return out;
}

void RestampedSource::report() {
  const TimeNs now = newest_arrival_ns_;
  const bool due = next_report_ns_ == kNoTime || now >= next_report_ns_ || next_report_ns_ - now > kReportEvery;
  if (now == kNoTime || !due) return;
  const bool first = next_report_ns_ == kNoTime;
  next_report_ns_ = saturating_sum(now, kReportEvery);
  if (first) return;  // there is nothing to tell yet
  for (const ClockStatus& s : status()) {
    log_info("event=clock clock={} onto={} basis={} offset={:.9f} skew_ppm={:.4f} sigma_us={:.1f} waiting={}", s.clock,
             s.onto, s.basis, s.offset_s, s.skew_ppm, s.sigma_us, waiting_.size());
  }
}

NamedCounts RestampedSource::counts() const {
  NamedCounts out = source_->counts();
  out.push_back({"clock.stamped", stamped_});
  out.push_back({"clock.waiting", static_cast<std::int64_t>(waiting_.size())});
  out.push_back({"clock.dropped_unknown", dropped_});
  out.push_back({"clock.dropped_absurd", absurd_});
  ClockCounts sum;
  std::int64_t steps = 0;
  for (const auto& [id, stream] : streams_) {
    const ClockCounts& c = stream.model.counts();
    sum.device_resets += c.device_resets;
    sum.device_jumps += c.device_jumps;
    sum.host_steps_forward += c.host_steps_forward;
    sum.host_steps_back += c.host_steps_back;
    sum.gaps += c.gaps;
    steps += stream.steps;
  }
  out.push_back({"clock.device_resets", sum.device_resets});
  out.push_back({"clock.device_jumps", sum.device_jumps});
  out.push_back({"clock.host_steps_forward", sum.host_steps_forward});
  out.push_back({"clock.host_steps_back", sum.host_steps_back});
  out.push_back({"clock.gaps", sum.gaps});
  out.push_back({"clock.steps", steps});
  out.push_back({"gps.time_disagrees", time_disagrees_});
  if (options_.base == TimeBase::kGps || gps_since_ns_ != kNoTime) {
    const GpsClockCounts& c = gps_.counts();
    out.push_back({"clock.pulses_used", c.pulses_used});
    out.push_back({"clock.pulses_spurious", c.pulses_spurious});
    out.push_back({"clock.labels", c.labels});
    out.push_back({"clock.labels_disagreeing", c.labels_disagreeing});
    out.push_back({"clock.label_jumps", c.label_jumps});
    out.push_back({"clock.bad_messages", bad_messages_});
    out.push_back({"clock.other_sources", other_sources_});
    out.push_back({"clock.other_hosts", other_hosts_});
  }
  return out;
}

}  // namespace loc
