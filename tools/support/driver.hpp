// Publishes what a source gives: paced by its time stamps, or as fast as the estimator takes it; a live one as it
// comes.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "libloc/io/source.hpp"
#include "loc/source_status_t.hpp"
#include "tools/support/flow_control.hpp"
#include "tools/support/lcm_link.hpp"
#include "tools/support/pacer.hpp"

namespace loc {

struct DriverOptions {
  std::string lcm_url = kDefaultLcmUrl;
  std::string source_name;                         ///< as the user named it
  std::array<std::string, kStreamKinds> channels;  ///< empty: default_channel()
  double speed = 1;                                ///< 0: as fast as the estimator takes it
  double start_s = 0;                              ///< of the recording, from its first sample
  double duration_s = 0;                           ///< 0: to the end; live by the monotonic clock
  std::int64_t window = 256;                       ///< IMU samples on their way, when speed is 0
  double answer_timeout_s = 10;                    ///< longest silence of the estimator, when speed is 0
  double reconnect_timeout_s = 10;                 ///< longest time without a hub
  std::optional<double> wait_for_estimator_s;      ///< before the first sample
  bool live = false;  ///< a sensor: not paced, host_time_ns is the source's, what cannot be sent is lost and counted
  bool keep_sequence = false;  ///< sequence numbers are the source's, losses in them stay
  bool statistics = false;

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

class Driver {
 public:
  /// @throws as DriverOptions::check and open_lcm.
  Driver(DriverOptions options, std::unique_ptr<MeasurementSource> source);

  /// Until the end of the source or until asked to stop. The last source_status_t says how it ended.
  /// @throws DataError when the source cannot be read on; std::runtime_error when no estimator answers or the
  /// connection stays lost.
  void run();
  /// What a live source calls while it waits, from its next(). Stops the source when the duration is over.
  void idle();
  /// What is wrong with a live source, for the status; empty: nothing.
  void set_trouble(const std::string& text);
  NamedCounts counts() const;

 private:
  void publish_all();
  bool duration_is_over() const;
  void wait_for_estimator();
  void wait_for_window(StreamKind kind);
  std::int64_t outstanding() const;
  void wait_until_taken();
  void poll_answers(int timeout_ms);
  void publish_measurement(Measurement& measurement);
  template <class Message>
  bool send(const std::string& channel, const Message& message);
  void publish_status(std::int8_t state, const std::string& text);
  void report_each_second();

  DriverOptions options_;
  std::unique_ptr<MeasurementSource> source_;
  LcmPublisher publisher_;
  std::optional<LcmReceiver> receiver_;  // while answers matter
  Pacer pacer_;
  std::vector<FlowControl> flows_;  // one for each kind that paces
  std::map<std::pair<StreamKind, int>, std::int64_t> next_sequence_;
  std::array<std::int64_t, kStreamKinds> published_{};
  std::int64_t left_out_ = 0;  // before start
  TimeNs next_report_ns_ = 0;
  TimeNs begin_ns_ = kNoTime;  // monotonic
  TimeNs window_wait_ns_ = 0;
  std::string trouble_;
  std::int64_t not_sent_ = 0;  // live
};

}  // namespace loc
