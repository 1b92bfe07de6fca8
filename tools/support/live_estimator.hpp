// The estimator as a process on LCM: one thread receives and only copies into bounded queues, the other decodes,
// estimates and publishes. Wrong messages are counted and reported; they never end it.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "libloc/core/named_count.hpp"
#include "msgs/decode.hpp"
#include "tools/support/input_queues.hpp"
#include "tools/support/lcm_link.hpp"
#include "tools/support/pipeline.hpp"
#include "tools/support/statistics.hpp"

namespace loc {

struct LiveEstimatorOptions {
  std::string lcm_url = kDefaultLcmUrl;
  std::array<std::string, kStreamKinds> channels;  ///< empty: default_channel()
  std::string estimate_channel = "LOC_ESTIMATE";
  std::string fusion_channel = "LOC_FUSION";
  std::string status_channel = "LOC_ESTIMATOR_STATUS";
  TimeNs map_period_ns = 1'000'000'000;  ///< of SLAM's map on LOC_MAP, in measurement time
  StreamMergerOptions merger;
  std::size_t queue_capacity = 16384;  ///< messages of each stream but images
  std::size_t image_capacity = 4;
  bool exit_at_end = false;  ///< when the source says that it has ended
  bool statistics = false;
};

class LiveEstimator {
 public:
  /// @throws as open_lcm and EstimatorPipeline.
  LiveEstimator(LiveEstimatorOptions options, AnyEstimator estimator, Rig rig);

  /// Until asked to stop, or until the source has ended. What has been received by then is still processed.
  void run();
  /// Everything that was counted, for statistics and the last line.
  NamedCounts counts() const;
  std::vector<std::string> unit_doubts() const { return pipeline_.unit_doubts(); }
  /// From publishing a sample (its host_time_ns) to publishing its estimate.
  const LatencyHistogram& latency() const { return latency_; }
  const AnyEstimator& estimator() const { return pipeline_.estimator(); }
  /// Samples of a stream that may not lose any were lost before the estimator: dropped by a full queue.
  std::int64_t dropped() const;

 private:
  void receive();
  void handle(const RawMessage& message);
  void handle_measurement(const RawMessage& message);
  void handle_source_status(const RawMessage& message);
  void publish_estimate(const Estimate& estimate);
  void publish_frame(const SlamFrame& frame);
  void publish_statistics();
  void publish_status();
  void report_each_second();
  void refuse(std::size_t input, const std::string& reason);

  LiveEstimatorOptions options_;
  std::vector<StreamKind> inputs_;     // input i is inputs_[i]; the last input is the state of the source
  std::vector<std::string> channels_;  // of each input
  InputQueues queues_;
  MeasurementDecoder decoder_;
  LcmPublisher publisher_;
  LcmReceiver receiver_;
  EstimatorPipeline pipeline_;
  LatencyHistogram latency_;
  std::vector<std::int64_t> refused_;
  std::atomic<bool> stop_receiving_ = false;
  bool source_ended_ = false;
  TimeNs last_map_ns_ = kNoTime;
  TimeNs next_report_ns_ = 0;
  TimeNs next_answer_ns_ = 0;
  TimeNs next_status_ns_ = 0;
  TimeNs heard_ns_ = 0;  // the last measurement
};

}  // namespace loc
