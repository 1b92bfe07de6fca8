// From measurements in order of arrival to estimates: sequence check, calibration, merging in time order, estimator.
// What comes too late for the order goes to the estimator all the same, when that has a use for it (takes_late).
// Live and off line run through this same class, which knows no files and no sockets: what differs is only who pushes
// and who takes the estimates.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>

#include "libloc/core/named_count.hpp"
#include "libloc/sensors/rig.hpp"
#include "libloc/sensors/stream.hpp"
#include "tools/support/any_estimator.hpp"
#include "tools/support/conditions.hpp"
#include "tools/support/unit_check.hpp"

namespace loc {

/// Finds losses: a jump of the sequence number of a stream (of each camera its own).
class SequenceCheck {
 public:
  struct Counts {
    std::int64_t received = 0;
    std::int64_t lost = 0;      ///< numbers that never came
    std::int64_t repeated = 0;  ///< the same number twice in a row
    std::int64_t restarts = 0;  ///< numbers went back: the source was started anew
  };
  void see(const Measurement& measurement);
  const Counts& counts(StreamKind kind) const { return counts_[static_cast<std::size_t>(kind)]; }
  /// Sequence number of the last sample of this kind; -1 before the first.
  std::int64_t last(StreamKind kind) const { return last_of_kind_[static_cast<std::size_t>(kind)].sequence; }
  /// Its camera; 0 for other streams.
  int last_camera(StreamKind kind) const { return last_of_kind_[static_cast<std::size_t>(kind)].camera; }

 private:
  struct Last {
    std::int64_t sequence = -1;
    int camera = 0;
  };
  std::array<Counts, kStreamKinds> counts_{};
  std::array<Last, kStreamKinds> last_of_kind_;
  std::map<std::pair<StreamKind, int>, std::int64_t> last_;
};

class EstimatorPipeline {
 public:
  using Sink = std::function<void(const Estimate&)>;
  using FrameSink = std::function<void(const SlamFrame&)>;

  /// @throws std::invalid_argument when the rig or the merger's options are wrong.
  EstimatorPipeline(AnyEstimator estimator, Rig rig, const StreamMergerOptions& merger, Sink sink);

  /// Who takes what SLAM says about frames.
  void set_frame_sink(FrameSink sink) { frame_sink_ = std::move(sink); }

  /// Takes the next sample as it arrives. Streams that the estimator does not take are left aside.
  void push(Measurement measurement);
  /// End of the recording: what waits goes to the estimator. The next sample starts another recording.
  void end();

  const AnyEstimator& estimator() const { return estimator_; }
  const SequenceCheck& sequences() const { return sequences_; }
  std::int64_t estimates() const { return estimates_; }
  /// What the estimator goes on without. @{
  const Conditions& conditions() const { return conditions_; }
  Conditions& conditions() { return conditions_; }
  /// @}
  /// Received, lost, late and so on for each stream that the estimator takes, and the estimator's own counts.
  NamedCounts counts() const;
  /// What looks like a wrong unit in the calibrated measurements, for the user; empty when all is plausible.
  std::vector<std::string> unit_doubts() const { return units_.doubts(); }

 private:
  void drain();
  void process(const Measurement& measurement);
  void pass_on(bool is_new);

  AnyEstimator estimator_;
  Rig rig_;
  StreamMergerOptions merger_options_;
  StreamMerger merger_;
  StreamMergerCounts earlier_;  // of the recordings before this one
  SequenceCheck sequences_;
  UnitCheck units_;
  Conditions conditions_;
  Sink sink_;
  FrameSink frame_sink_;
  bool ended_ = false;
  std::int64_t estimates_ = 0;
  std::array<std::int64_t, kStreamKinds> passed_late_{};
};

}  // namespace loc
