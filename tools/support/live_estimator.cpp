#include "tools/support/live_estimator.hpp"

#include <algorithm>
#include <exception>
#include <thread>
#include <utility>

#include "libloc/core/check.hpp"
#include "loc/estimator_status_t.hpp"
#include "loc/source_status_t.hpp"
#include "msgs/convert.hpp"
#include "msgs/slam_messages.hpp"
#include "tools/support/flow_control.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;
constexpr TimeNs kAnswerEvery = 5'000'000;  // a flood of questions must not become a flood of answers
constexpr TimeNs kPoll = 50'000'000;
constexpr TimeNs kDrainLimit = kSecond;
constexpr TimeNs kSilence = 2 * kSecond;
constexpr int kReceivePollMs = 50;
constexpr int kRefusalsLogged = 10;

// Types of package loc take 100 bytes, those of ASPN-23 up to 2000.
constexpr std::size_t kMaxSampleBytes = 4096;
constexpr std::size_t kExpectedSampleBytes = 128;
constexpr std::size_t kMaxImageBytes = 64 << 20;
constexpr std::size_t kMaxFeaturesBytes = 256 << 10;  // 10 000 features in one frame
constexpr std::size_t kFeaturesCapacity = 1024;       // frames: a bound on memory
constexpr std::size_t kMaxStatusBytes = 64 << 10;
constexpr std::size_t kStatusCapacity = 64;

std::vector<InputQueueOptions> queue_options(const AnyEstimator& estimator, const LiveEstimatorOptions& options) {
  std::vector<InputQueueOptions> out;
  for (const StreamKind kind : estimator.inputs()) {
    if (kind == StreamKind::kImage) {
      out.push_back({stream_name(kind), options.image_capacity, kMaxImageBytes, 0, WhenFull::kDropOldest});
    } else if (kind == StreamKind::kFeatures) {
      out.push_back({stream_name(kind), std::min(options.queue_capacity, kFeaturesCapacity), kMaxFeaturesBytes, 0,
                     WhenFull::kRefuseNewest});
    } else {
      out.push_back(
          {stream_name(kind), options.queue_capacity, kMaxSampleBytes, kExpectedSampleBytes, WhenFull::kRefuseNewest});
    }
  }
  out.push_back({"source_status", kStatusCapacity, kMaxStatusBytes, 0, WhenFull::kDropOldest});
  return out;
}

DecodeOptions decode_options(const AnyEstimator& estimator, const LiveEstimatorOptions& options) {
  DecodeOptions out;
  for (const StreamKind kind : estimator.inputs()) {
    const auto i = static_cast<std::size_t>(kind);
    out.channels[i] = options.channels[i].empty() ? default_channel(kind) : options.channels[i];
  }
  return out;
}

// A channel is subscribed to as a regular expression; its name is meant literally.
std::string literally(const std::string& channel) {
  std::string out;
  for (const char c : channel) {
    if (std::string_view("\\^$.|?*+()[]{}").find(c) != std::string_view::npos) out += '\\';
    out += c;
  }
  return out;
}

}  // namespace

LiveEstimator::LiveEstimator(LiveEstimatorOptions options, AnyEstimator estimator, Rig rig)
    : options_(std::move(options)),
      inputs_(estimator.inputs()),
      queues_(queue_options(estimator, options_)),
      decoder_(decode_options(estimator, options_)),
      publisher_(options_.lcm_url),
      receiver_(options_.lcm_url),
      pipeline_(std::move(estimator), std::move(rig), options_.merger,
                [this](const Estimate& estimate) { publish_estimate(estimate); }),
      refused_(inputs_.size() + 1) {
  pipeline_.set_frame_sink([this](const SlamFrame& frame) { publish_frame(frame); });
  const DecodeOptions channels = decode_options(pipeline_.estimator(), options_);
  for (const StreamKind kind : inputs_) channels_.push_back(channels.channels[static_cast<std::size_t>(kind)]);
  // Last: who gets an answer to a status knows that the streams before it are subscribed to.
  channels_.emplace_back(kSourceStatusChannel);
  for (std::size_t input = 0; input < channels_.size(); ++input) {
    receiver_.subscribe(literally(channels_[input]), [this, input](std::string_view, auto data) {
      const bool kept = queues_.push(input, data, host_now());
      const bool lossless = input < inputs_.size() && inputs_[input] != StreamKind::kImage;
      if (!kept && lossless && queues_.dropped(input) == 1) {
        log_error("event=queue_full stream={} effect=\"samples are lost; all of them are counted\"",
                  stream_name(inputs_[input]));
      }
    });
  }
}

void LiveEstimator::run() {
  next_report_ns_ = steady_now() + kSecond;
  heard_ns_ = steady_now();
  std::thread receiving([this] { receive(); });
  // The thread must be joined whatever happens.
  try {
    RawMessage message;
    while (!stop_requested() && !(source_ended_ && options_.exit_at_end)) {
      if (queues_.pop(message, kPoll)) handle(message);
      publish_status();
      report_each_second();
    }
    stop_receiving_ = true;
    const TimeNs give_up = steady_now() + kDrainLimit;
    while (queues_.waiting() > 0 && steady_now() < give_up && queues_.pop(message, 0)) handle(message);
    if (queues_.waiting() > 0) log_error("event=left_unprocessed messages={}", queues_.waiting());
    pipeline_.end();
    publish_statistics();
  } catch (...) {
    stop_receiving_ = true;
    receiving.join();
    throw;
  }
  receiving.join();
}

void LiveEstimator::receive() {
  while (!stop_receiving_) {
    try {
      receiver_.handle(kReceivePollMs);
    } catch (const std::exception& error) {
      log_error("event=receive_failed reason=\"{}\"", error.what());
    }
  }
}

void LiveEstimator::handle(const RawMessage& message) {
  if (message.input == inputs_.size()) {
    handle_source_status(message);
  } else {
    handle_measurement(message);
  }
}

void LiveEstimator::refuse(std::size_t input, const std::string& reason) {
  if (++refused_[input] <= kRefusalsLogged) {
    log_warning("event=message_refused channel={} reason=\"{}\"", channels_[input], reason);
  }
}

void LiveEstimator::handle_measurement(const RawMessage& message) {
  try {
    auto measurement = decoder_.decode(channels_[message.input], message.bytes, message.receive_time_ns);
    if (!measurement) return;
    if (kind_of(*measurement) != inputs_[message.input]) {
      refuse(message.input, std::string("holds a sample of stream ") + stream_name(kind_of(*measurement)));
      return;
    }
    source_ended_ = false;
    heard_ns_ = steady_now();
    pipeline_.push(std::move(*measurement));
  } catch (const DataError& error) {
    refuse(message.input, error.what());
  }
}

void LiveEstimator::handle_source_status(const RawMessage& message) {
  source_status_t status{};
  try {
    status = decode_message<source_status_t>(message.bytes);
  } catch (const DataError& error) {
    refuse(message.input, error.what());
    return;
  }
  if (status.state != source_status_t::STATE_RUNNING) {
    if (!source_ended_) {
      log_info(R"(event=source_ended source="{}" failed={} message="{}")", status.source,
               status.state == source_status_t::STATE_FAILED, status.message);
    }
    pipeline_.end();
    source_ended_ = true;
  }
  const TimeNs now = steady_now();
  if (now >= next_answer_ns_ || source_ended_) {
    next_answer_ns_ = now + kAnswerEvery;
    publish_statistics();
  }
}

void LiveEstimator::publish_estimate(const Estimate& estimate) {
  estimate_t message = to_message(estimate, pipeline_.estimator().method(), pipeline_.estimator().world());
  message.publish_time_ns = host_now();
  if (publisher_.publish(options_.estimate_channel, message) && estimate.host_time_ns != kNoTime) {
    latency_.add(message.publish_time_ns - estimate.host_time_ns);
  }
  if (const auto more = to_fusion_message(estimate)) publisher_.publish(options_.fusion_channel, *more);
}

void LiveEstimator::publish_frame(const SlamFrame& frame) {
  publisher_.publish(kSlamFrameChannel, to_message(frame));
  const bool due =
      last_map_ns_ == kNoTime || frame.time_ns < last_map_ns_ || frame.time_ns - last_map_ns_ >= options_.map_period_ns;
  if (!due) return;
  last_map_ns_ = frame.time_ns;
  publisher_.publish(kMapChannel, to_message(frame, pipeline_.estimator().slam_map()));
}

void LiveEstimator::publish_statistics() {
  statistics_t message = statistics_message(kEstimatorProgram, counts());
  add_latency(message, "latency", latency_);
  publisher_.publish(kStatisticsChannel, message);
}

// When something changes, and each second.
void LiveEstimator::publish_status() {
  const TimeNs now = steady_now();
  Conditions& conditions = pipeline_.conditions();
  // After the end of a recording silence is right.
  conditions.set_silent(!source_ended_ && now - heard_ns_ > kSilence);
  if (!conditions.take_change() && now < next_status_ns_) return;
  next_status_ns_ = now + kSecond;
  estimator_status_t message{};
  message.time_ns = host_now();
  message.measurement_time_ns = conditions.now_ns();
  message.method = pipeline_.estimator().method();
  message.status = static_cast<std::int32_t>(conditions.status());
  message.georeferenced = pipeline_.estimator().georeferenced() ? 1 : 0;
  for (const Conditions::Held& held : conditions.held()) {
    message.condition.push_back(held.condition.name + (held.detail.empty() ? std::string() : ": " + held.detail));
    message.since_s.push_back(apart_s(conditions.now_ns(), held.since_ns));
  }
  if (conditions.silent()) {
    message.condition.emplace_back("no measurements");
    message.since_s.push_back(to_seconds(now - heard_ns_));
  }
  message.size = static_cast<std::int32_t>(message.condition.size());
  publisher_.publish(options_.status_channel, message);
}

void LiveEstimator::report_each_second() {
  if (!options_.statistics || steady_now() < next_report_ns_) return;
  next_report_ns_ = steady_now() + kSecond;
  log_info("event=statistics {} {}", format_counts(counts()), format_latency("latency", latency_));
  publish_statistics();
}

NamedCounts LiveEstimator::counts() const {
  NamedCounts out;
  for (const StreamKind kind : inputs_) {
    if (!is_paced(kind)) continue;
    out.push_back({sequence_name(kind), pipeline_.sequences().last(kind)});
    if (kind != StreamKind::kImu) out.push_back({camera_name(kind), pipeline_.sequences().last_camera(kind)});
  }
  for (NamedCount& count : pipeline_.counts()) out.push_back(std::move(count));
  for (NamedCount& count : queues_.counts()) out.push_back(std::move(count));
  for (NamedCount& count : decoder_.counts()) out.push_back(std::move(count));
  for (std::size_t input = 0; input < refused_.size(); ++input) {
    const char* name = input < inputs_.size() ? stream_name(inputs_[input]) : "source_status";
    out.push_back({std::string(name) + ".refused", refused_[input]});
  }
  out.push_back({"publish.failed", publisher_.failed()});
  out.push_back({"receive.disconnects", receiver_.disconnects()});
  return out;
}

std::int64_t LiveEstimator::dropped() const {
  std::int64_t sum = 0;
  for (std::size_t input = 0; input < inputs_.size(); ++input) {
    if (inputs_[input] != StreamKind::kImage) sum += queues_.dropped(input);
  }
  return sum;
}

}  // namespace loc
