#include "tools/support/pipeline.hpp"

#include <string>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

// A sequence number that only a broken sender can have made must not overflow the count of losses.
std::int64_t saturating_gap(std::int64_t from, std::int64_t to) {
  std::int64_t gap = 0;
  return __builtin_sub_overflow(to, from, &gap) ? std::numeric_limits<std::int64_t>::max() / 2 : gap - 1;
}

void add_saturating(std::int64_t& sum, std::int64_t value) {
  if (__builtin_add_overflow(sum, value, &sum)) sum = std::numeric_limits<std::int64_t>::max();
}

void add_counts(StreamMergerCounts& sum, const StreamMergerCounts& more) {
  for (std::size_t i = 0; i < kStreamKinds; ++i) {
    sum.late[i] += more.late[i];
    sum.absurd[i] += more.absurd[i];
  }
  sum.forced += more.forced;
  sum.resets += more.resets;
}

}  // namespace

void SequenceCheck::see(const Measurement& measurement) {
  const StreamKind kind = kind_of(measurement);
  const std::int64_t sequence = stamp_of(measurement).sequence;
  Counts& counts = counts_[static_cast<std::size_t>(kind)];
  ++counts.received;
  if (sequence < 0) return;
  last_of_kind_[static_cast<std::size_t>(kind)] = {sequence, camera_of(measurement)};
  const auto [place, first] = last_.try_emplace({kind, camera_of(measurement)}, sequence);
  if (first) return;
  std::int64_t& last = place->second;
  if (sequence > last) {
    add_saturating(counts.lost, saturating_gap(last, sequence));
  } else {
    ++(sequence == last ? counts.repeated : counts.restarts);
  }
  last = sequence;
}

EstimatorPipeline::EstimatorPipeline(AnyEstimator estimator, Rig rig, const StreamMergerOptions& merger, Sink sink)
    : estimator_(std::move(estimator)),
      rig_(std::move(rig)),
      merger_options_(merger),
      merger_(merger),
      sink_(std::move(sink)) {
  rig_.check();
  require(static_cast<bool>(sink_), "sink: must take the estimates");
}

void EstimatorPipeline::push(Measurement measurement) {
  if (!estimator_.takes(kind_of(measurement))) return;
  if (ended_) {
    add_counts(earlier_, merger_.counts());
    merger_ = StreamMerger(merger_options_);
    estimator_.reset();
    ended_ = false;
  }
  sequences_.see(measurement);
  const std::int64_t resets = merger_.counts().resets;
  measurement = calibrated(rig_, std::move(measurement));
  units_.see(measurement);
  if (estimator_.takes_at_once(kind_of(measurement))) {
    process(measurement);
    return;
  }
  if (estimator_.takes_late(kind_of(measurement)) && merger_.has_passed(stamp_of(measurement).time_ns)) {
    ++passed_late_[measurement.index()];
    process(measurement);
    return;
  }
  merger_.push(std::move(measurement));
  if (merger_.counts().resets != resets) {
    // All that had waited leaves first; the clock was set back between it and this sample.
    for (std::size_t before = merger_.waiting() - 1; before > 0; --before) process(*merger_.pop());
    estimator_.reset();
  }
  drain();
}

void EstimatorPipeline::end() {
  merger_.finish();
  drain();
  pass_on(estimator_.finish());
  ended_ = true;
}

void EstimatorPipeline::drain() {
  while (const auto measurement = merger_.pop()) process(*measurement);
}

void EstimatorPipeline::process(const Measurement& measurement) {
  pass_on(estimator_.process(measurement));
  conditions_.update(estimator_.newest_measurement_ns(), estimator_.status(),
                     [this](std::uint32_t bit) { return estimator_.detail_of(bit); });
}

void EstimatorPipeline::pass_on(bool is_new) {
  if (is_new) {
    ++estimates_;
    sink_(estimator_.estimate());
  }
  if (!frame_sink_) return;
  for (const SlamFrame& frame : estimator_.slam_frames()) frame_sink_(frame);
}

NamedCounts EstimatorPipeline::counts() const {
  NamedCounts out;
  StreamMergerCounts merger = earlier_;
  add_counts(merger, merger_.counts());
  for (const StreamKind kind : estimator_.inputs()) {
    const std::string name = stream_name(kind);
    const SequenceCheck::Counts& sequence = sequences_.counts(kind);
    const auto index = static_cast<std::size_t>(kind);
    out.push_back({name + ".received", sequence.received});
    out.push_back({name + ".lost", sequence.lost});
    out.push_back({name + ".repeated", sequence.repeated});
    out.push_back({name + ".restarts", sequence.restarts});
    out.push_back({name + ".late", merger.late[index]});
    out.push_back({name + ".absurd_time", merger.absurd[index]});
    if (estimator_.takes_late(kind)) out.push_back({name + ".passed_late", passed_late_[index]});
  }
  out.push_back({"clock.resets", merger.resets});
  out.push_back({"merger.forced", merger.forced});
  for (NamedCount& count : estimator_.counts()) out.push_back(std::move(count));
  for (NamedCount& count : conditions_.counts()) out.push_back(std::move(count));
  out.push_back({"estimates", estimates_});
  return out;
}

}  // namespace loc
