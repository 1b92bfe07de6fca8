#include "tools/support/driver.hpp"

#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"
#include "msgs/convert.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"
#include "tools/support/statistics.hpp"

namespace loc {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;
constexpr TimeNs kAskEvery = 20'000'000;  // while waiting for the estimator
constexpr int kPollMs = 5;
constexpr std::int64_t kPicturesOnTheirWay = 4;  // an estimator drops the oldest of more
constexpr std::int64_t kFeatureFramesOnTheirWay = 64;
constexpr double kLongestS = 1e9;  // 30 years
constexpr double kLongestWaitS = 1e6;

}  // namespace

void DriverOptions::check() const {
  const auto at_most = [](const char* name, double value, double most) {
    require(value <= most, name, value, "must be at most " + std::to_string(static_cast<std::int64_t>(most)) + " s");
  };
  require_not_negative("speed", speed);
  require_not_negative("start", start_s);
  require_not_negative("duration", duration_s);
  require(window > 0, "window", static_cast<double>(window), "must be positive");
  require_positive("answer-timeout", answer_timeout_s);
  require_not_negative("reconnect-timeout", reconnect_timeout_s);
  if (wait_for_estimator_s) require_positive("wait-for-estimator", *wait_for_estimator_s);
  at_most("start", start_s, kLongestS);
  at_most("duration", duration_s, kLongestS);
  at_most("answer-timeout", answer_timeout_s, kLongestWaitS);
  at_most("reconnect-timeout", reconnect_timeout_s, kLongestWaitS);
  at_most("wait-for-estimator", wait_for_estimator_s.value_or(0), kLongestWaitS);
  require(!live || (speed == 1 && start_s == 0), "--speed and --start are for recordings, not for live sources");
}

Driver::Driver(DriverOptions options, std::unique_ptr<MeasurementSource> source)
    : options_((options.check(), std::move(options))),
      source_(std::move(source)),
      publisher_(options_.lcm_url),
      pacer_(options_.speed),
      flows_{{StreamKind::kImu, options_.window},
             {StreamKind::kImage, kPicturesOnTheirWay},
             {StreamKind::kFeatures, kFeatureFramesOnTheirWay}} {
  for (std::size_t i = 0; i < kStreamKinds; ++i) {
    if (options_.channels[i].empty()) options_.channels[i] = default_channel(static_cast<StreamKind>(i));
  }
  if (options_.speed > 0 && !options_.wait_for_estimator_s) return;
  receiver_.emplace(options_.lcm_url);
  receiver_->subscribe(kEstimateChannel, [this](auto, auto data) {
    for (FlowControl& flow : flows_) flow.on_estimate(data);
  });
  receiver_->subscribe(kStatisticsChannel, [this](auto, auto data) {
    for (FlowControl& flow : flows_) flow.on_statistics(data, steady_now());
  });
}

void Driver::run() {
  try {
    if (options_.wait_for_estimator_s) wait_for_estimator();
    // Answers that nobody reads would pile up in the hub, or over udpm in this process.
    if (options_.speed > 0) receiver_.reset();
    publish_all();
  } catch (const std::exception& error) {
    publish_status(source_status_t::STATE_FAILED, error.what());
    throw;
  }
  publish_status(source_status_t::STATE_ENDED, stop_requested() ? "interrupted" : "");
  if (options_.speed == 0) wait_until_taken();
}

void Driver::publish_all() {
  const TimeNs start_ns = from_seconds(options_.start_s);
  const TimeNs duration_ns = from_seconds(options_.duration_s);
  std::optional<TimeNs> begin;
  bool started = false;
  next_report_ns_ = begin_ns_ = steady_now();
  while (!stop_requested()) {
    std::optional<Measurement> measurement = source_->next();
    if (!measurement) return;
    const TimeNs time = stamp_of(*measurement).time_ns;
    if (options_.live) {
      if (duration_is_over()) return;
      publish_measurement(*measurement);
      report_each_second();
      continue;
    }
    if (!begin) begin = time + start_ns;
    started = started || time >= *begin;
    if (!started) {
      ++left_out_;
      continue;
    }
    if (duration_ns > 0 && time - *begin >= duration_ns) return;
    if (!sleep_for(pacer_.wait_ns(time, steady_now()))) return;
    if (options_.speed == 0) wait_for_window(kind_of(*measurement));
    if (stop_requested()) return;
    publish_measurement(*measurement);
    report_each_second();
  }
}

void Driver::poll_answers(int timeout_ms) {
  if (!receiver_->handle(timeout_ms)) return;
  while (receiver_->handle(0)) {
  }
}

void Driver::wait_for_estimator() {
  const TimeNs give_up = steady_now() + from_seconds(*options_.wait_for_estimator_s);
  while (!flows_.front().answered() && !stop_requested()) {
    if (steady_now() > give_up) {
      throw std::runtime_error("no estimator has answered on " + options_.lcm_url + " within " +
                               std::to_string(*options_.wait_for_estimator_s) + " s: is loc-estimator running there?");
    }
    publish_status(source_status_t::STATE_RUNNING, "");
    poll_answers(100);
  }
}

std::int64_t Driver::outstanding() const {
  std::int64_t sum = 0;
  for (const FlowControl& flow : flows_) {
    if (flow.waits()) sum += flow.outstanding();
  }
  return sum;
}

void Driver::wait_for_window(StreamKind kind) {
  poll_answers(0);
  const auto paced = std::ranges::find(flows_, kind, &FlowControl::kind);
  if (paced == flows_.end() || paced->may_send()) return;
  const FlowControl& flow = *paced;
  const TimeNs begin = steady_now();
  TimeNs heard = begin;  // last time that something was taken
  // IMU samples are acknowledged by estimates; of frames only an answer tells.
  TimeNs ask = kind == StreamKind::kImu ? begin + kAskEvery : begin;
  std::int64_t outstanding = flow.outstanding();
  while (!flow.may_send() && !stop_requested()) {
    TimeNs now = steady_now();
    if (now >= ask) {
      publish_status(source_status_t::STATE_RUNNING, "");
      ask = now + kAskEvery;
    }
    poll_answers(kPollMs);
    now = steady_now();
    if (flow.outstanding() != outstanding) {
      outstanding = flow.outstanding();
      heard = now;
    }
    if (now - heard > from_seconds(options_.answer_timeout_s)) {
      throw std::runtime_error("no estimator takes the samples: " + std::to_string(outstanding) + " of stream " +
                               stream_name(kind) + " are on their way on " + options_.lcm_url +
                               " and nothing was answered for " + std::to_string(options_.answer_timeout_s) +
                               " s (without an estimator, use --speed N)");
    }
  }
  window_wait_ns_ += steady_now() - begin;
}

// The end of the recording is not lost in a queue: the driver ends when the estimator has got its last sample.
void Driver::wait_until_taken() {
  TimeNs heard = steady_now();  // last time that something was taken
  TimeNs ask = heard + kAskEvery;
  std::int64_t left = outstanding();
  while (left > 0 && !stop_requested()) {
    poll_answers(kPollMs);
    const TimeNs now = steady_now();
    if (outstanding() != left) {
      left = outstanding();
      heard = now;
      continue;
    }
    if (now - heard > from_seconds(options_.answer_timeout_s)) {
      throw std::runtime_error("the estimator has not answered for the last " + std::to_string(outstanding()) +
                               " samples");
    }
    if (now >= ask) {
      publish_status(source_status_t::STATE_ENDED, "");
      ask = now + kAskEvery;
    }
  }
}

template <class Message>
bool Driver::send(const std::string& channel, const Message& message) {
  if (publisher_.publish(channel, message)) return true;
  if (options_.live) {
    // A sensor does not wait; the estimator sees the jump of the sequence.
    if (not_sent_++ == 0) log_warning("event=connection_lost url={}", options_.lcm_url);
    return false;
  }
  // A recording can wait: nothing is lost while the hub is away.
  log_warning("event=connection_lost url={}", options_.lcm_url);
  const TimeNs give_up = steady_now() + from_seconds(options_.reconnect_timeout_s);
  while (!publisher_.publish(channel, message)) {
    if (!sleep_for(kSecond / 20)) return false;
    if (steady_now() > give_up) {
      throw std::runtime_error("the connection to " + options_.lcm_url + " is lost and does not come back");
    }
  }
  return true;
}

void Driver::publish_measurement(Measurement& measurement) {
  const StreamKind kind = kind_of(measurement);
  Stamp& stamp = stamp_of(measurement);
  std::int64_t& next = next_sequence_[{kind, camera_of(measurement)}];
  if (options_.keep_sequence && stamp.sequence >= 0) next = stamp.sequence;
  stamp.sequence = next++;
  if (!options_.live) stamp.host_time_ns = host_now();
  const std::string& channel = options_.channels[static_cast<std::size_t>(kind)];
  if (!std::visit([&](const auto& m) { return send(channel, to_message(m)); }, measurement)) return;
  ++published_[static_cast<std::size_t>(kind)];
  if (options_.speed > 0) return;
  const auto paced = std::ranges::find(flows_, kind, &FlowControl::kind);
  if (paced != flows_.end()) paced->sent(stamp.sequence, camera_of(measurement));
}

void Driver::publish_status(std::int8_t state, const std::string& text) {
  source_status_t message{};
  message.time_ns = host_now();
  message.source = options_.source_name;
  message.state = state;
  message.message = text;
  for (std::size_t i = 0; i < kStreamKinds; ++i) {
    if (published_[i] == 0) continue;
    message.stream_name.emplace_back(stream_name(static_cast<StreamKind>(i)));
    message.published.push_back(published_[i]);
  }
  message.streams = static_cast<std::int32_t>(message.published.size());
  // A status may be lost together with the connection; measurements may not, see send().
  if (!publisher_.publish(kSourceStatusChannel, message)) log_warning("event=status_not_sent state={}", state);
}

bool Driver::duration_is_over() const {
  return options_.duration_s > 0 && begin_ns_ != kNoTime &&
         steady_now() - begin_ns_ >= from_seconds(options_.duration_s);
}

void Driver::idle() {
  report_each_second();
  if (duration_is_over()) source_->stop();
}

void Driver::set_trouble(const std::string& text) {
  trouble_ = text;
  publish_status(source_status_t::STATE_RUNNING, trouble_);
}

void Driver::report_each_second() {
  const TimeNs now = steady_now();
  if (now < next_report_ns_) return;
  next_report_ns_ = now + kSecond;
  publish_status(source_status_t::STATE_RUNNING, trouble_);
  if (!options_.statistics) return;
  const NamedCounts figures = counts();
  log_info("event=statistics {}", format_counts(figures));
  publisher_.publish(kStatisticsChannel, statistics_message("loc-driver", figures));
}

NamedCounts Driver::counts() const {
  NamedCounts out;
  for (std::size_t i = 0; i < kStreamKinds; ++i) {
    if (published_[i] > 0) {
      out.push_back({std::string(stream_name(static_cast<StreamKind>(i))) + ".published", published_[i]});
    }
  }
  for (NamedCount& count : source_->counts()) out.push_back(std::move(count));
  out.push_back({"left_out_before_start", left_out_});
  out.push_back({"publish.failed", publisher_.failed()});
  if (options_.live) {
    out.push_back({"live.not_sent", not_sent_});
  } else if (options_.speed > 0) {
    out.push_back({"pace.restarts", pacer_.restarts()});
    out.push_back({"pace.max_lag_us", pacer_.max_lag_ns() / 1000});
  } else {
    std::int64_t abandoned = 0;
    for (const FlowControl& flow : flows_) abandoned += flow.abandoned();
    out.push_back({"window.outstanding", outstanding()});
    out.push_back({"window.abandoned", abandoned});
    out.push_back({"window.waited_ms", window_wait_ns_ / 1'000'000});
  }
  return out;
}

}  // namespace loc
