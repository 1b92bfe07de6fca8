// A source whose measurements are stamped on another clock: --time-base device|host|gps.
//   device  as they are; what a receiver says is still followed and sent to others
//   host    when the host would have heard of them had nothing been in the way (sensors/clock), from the arrivals that
//           the measurements carry (host_time_ns); every stream has a clock model of its own
//   gps     that, and from host to GPS: by the time events and fixes of a receiver in the same program, or by what
//   another
//           one sends (clock_t)
// A stream is never stamped on two clocks: measurements wait, in order of arrival, until the clocks that they need are
// known. What has waited for longer than wait_s (of arrival time), or more of them than max_waiting, is dropped and
// counted. In host time the wait is warm_up_s at the beginning. In GPS time, labels (tens of milliseconds) are believed
// after pulse_wait_s without pulses; pulses that come later make the same time better, without a step back.
// A fix whose own time is farther than 1 s and six sigma from what the line from host to GPS makes of its arrival is
// dropped and counted (gps.time_disagrees): one wrong date must not leave amid the stream.
// The start of a relative odometry moves with its end. host_time_ns stays as it was. Times of a stream never step back,
// unless a clock was set or GPS labels were wrong: counted (clock.steps), and told.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "libloc/io/source.hpp"
#include "libloc/sensors/clock.hpp"
#include "libloc/sensors/clock_gps.hpp"
#include "loc/clock_t.hpp"

namespace loc {

enum class TimeBase { kDevice, kHost, kGps };
/// @throws UsageError for anything but "device", "host", "gps".
TimeBase parse_time_base(const std::string& text);

/// Which running system's clock this is: its boot id, or its name where there is none. Containers share both.
std::string host_identity();
/// "loc-driver" with the process id
std::string own_name();

struct RestampOptions {
  TimeBase base = TimeBase::kHost;
  double warm_up_s = 1;              ///< So much of a stream is heard before its first sample leaves.
  double pulse_wait_s = 5;           ///< So long labels wait for pulses.
  double wait_s = 30;                ///< The longest wait.
  std::size_t max_waiting = 20'000;  ///< Samples; 30 s of three streams at 200 Hz.
  ClockModelOptions clock;
  GpsClockOptions gps;
  std::function<void()> poll;          ///< Called with every sample: hands over what other programs say, see take().
  std::function<void(clock_t)> send;   ///< Called about once a second with host -> GPS of our own receiver.
  std::string host = host_identity();  ///< Lines of other hosts' clocks are refused.
  std::string sender = own_name();     ///< Sender of our own lines; what comes back from it is not another's.
  std::function<TimeNs()> steady;      ///< Monotonic time, by which others fall silent; empty: steady_now()

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// One clock as it is known now, for a log line.
struct ClockStatus {
  std::string clock;    ///< "imu", "image0", "host"
  std::string onto;     ///< "host", "gps"
  std::string basis;    ///< "samples", "labels", "pulses", "other" (another program), "none"
  double offset_s = 0;  ///< onto - clock
  double skew_ppm = 0;
  double sigma_us = 0;
};

class RestampedSource : public MeasurementSource {
 public:
  /// @throws std::invalid_argument as RestampOptions::check.
  RestampedSource(std::unique_ptr<MeasurementSource> source, RestampOptions options);

  /// @throws DataError when a measurement has no arrival time, and at the end when none could be stamped at all.
  std::optional<Measurement> next() override;
  void stop() override {
    stopped_ = true;
    source_->stop();
  }
  NamedCounts counts() const override;

  /// Pulses and labels of a receiver in this program. From the thread that calls next().
  void take(const GpsTimeEvent& event);
  /// What another program on this host knows; our own messages are left aside, wrong ones, those of other hosts, and
  /// those of a second program are counted. A program is silent when it has sent nothing new for 5 s by the monotonic
  /// clock; then another may take its place. From the same thread.
  void take(const clock_t& message);
  std::vector<ClockStatus> status() const;

 private:
  using StreamId = std::pair<StreamKind, int>;
  struct Stream {
    ClockModel model;
    MonotoneTime monotone;
    TimeNs first_arrival_ns = kNoTime;
    std::int64_t device_epoch = 0;
    std::int64_t gps_epoch = -1;  // of the last time put out
    std::int64_t host_steps_back = 0;
    std::int64_t steps = 0;
  };
  struct Waiting {
    Measurement measurement;
    StreamId stream;
    std::int64_t epoch = 0;          // of the stream's model when it came
    std::optional<ClockStamp> host;  // as the model had it then
  };
  enum class Outcome { kStamped, kWait, kNever, kDisagrees };

  std::optional<Measurement> as_it_is();
  void accept(Measurement measurement);
  void move_start(OdometryMeasurement& odometry, TimeNs device_ns);
  static bool disagrees(const GpsMeasurement& fix, const ClockLine& line);
  void refuse(std::int64_t& count, const std::string& why);
  TimeNs steady() const;
  void listen(const GpsMeasurement& fix);
  Outcome stamp(Waiting& waiting);
  std::optional<ClockLine> host_to_gps(TimeNs host_ns) const;
  std::int64_t gps_epoch() const;
  TimeNs monotone(Stream& stream, TimeNs device_ns, TimeNs time_ns);
  void follow(const GpsTimeEvent& event);
  void drop_oldest();
  void report();

  std::unique_ptr<MeasurementSource> source_;
  RestampOptions options_;
  std::map<StreamId, Stream> streams_;
  std::deque<Waiting> waiting_;
  GpsClock gps_;
  std::deque<std::pair<TimeNs, TimeNs>> odometry_times_;  // of the last samples: as they came, as they left
  TimeNs gps_since_ns_ = kNoTime;                         // arrival of the first label
  bool own_events_ = false;
  // What another program says.
  std::optional<ClockLine> other_;
  std::string other_source_;
  std::int64_t other_epoch_ = 0;
  TimeNs other_since_ns_ = kNoTime;
  TimeNs other_heard_ns_ = kNoTime;  // monotonic: the last news
  TimeNs other_sent_ns_ = kNoTime;   // as it says itself
  bool other_labels_ = false;
  TimeNs newest_arrival_ns_ = kNoTime;
  TimeNs next_report_ns_ = kNoTime;
  TimeNs next_send_ns_ = kNoTime;
  std::int64_t stamped_ = 0;
  std::int64_t dropped_ = 0;  // waited too long
  std::int64_t absurd_ = 0;   // a device time that belongs to no clock
  std::int64_t bad_messages_ = 0;
  std::int64_t other_sources_ = 0;
  std::int64_t other_hosts_ = 0;
  std::int64_t time_disagrees_ = 0;  // fixes
  std::string last_refusal_;         // of a message
  bool told_refusal_ = false;
  std::atomic<bool> stopped_ = false;
  bool ended_ = false;
  bool told_waiting_ = false;
};

}  // namespace loc
