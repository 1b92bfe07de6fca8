#include "tools/support/gps_source.hpp"

#include <sys/poll.h>

#include <array>
#include <cerrno>
#include <deque>
#include <system_error>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/io/nmea.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr int kPollMs = 50;
// The pause between two bursts, which a burst does not have: at 4800 baud a byte takes 2 ms.
constexpr TimeNs kPause = 100'000'000;
constexpr double kLongestWaitS = 1e6;

const char* name_of(GpsFixType type) {
  switch (type) {
    case GpsFixType::kNone:
      return "none";
    case GpsFixType::kTime:
      return "time";
    case GpsFixType::k2d:
      return "2d";
    case GpsFixType::k3d:
      return "3d";
    case GpsFixType::kDifferential:
      return "differential";
    case GpsFixType::kFloat:
      return "rtk_float";
    case GpsFixType::kFixed:
      return "rtk_fixed";
  }
  return "unknown";
}

class NmeaStreamSource final : public MeasurementSource {
 public:
  NmeaStreamSource(GpsConnection connection, LiveGpsOptions options)
      : options_((options.check(), std::move(options))),
        connection_(std::move(connection)),
        reconnection_(gps_reconnection(options_)),
        fixes_(options_),
        assembler_(options_.fix, options_.on_time_event) {
    connect();
  }

  void stop() override { reconnection_.stop(); }

  std::optional<Measurement> next() override {
    while (!stop_requested() && !reconnection_.stopped()) {
      if (!waiting_.empty()) {
        GpsMeasurement fix = waiting_.front();
        waiting_.pop_front();
        return fix;
      }
      fixes_.look_for_fix();
      if (!port_) {
        if (!reconnection_.wait()) break;
        try {
          connect();
        } catch (const GpsConnectionError& error) {
          reconnection_.failed(error.what());
        }
        continue;
      }
      read_once();
      if (options_.on_idle) options_.on_idle();
    }
    return std::nullopt;
  }

  NamedCounts counts() const override {
    NamedCounts counts = {{"gps.read", sequence_}};
    reconnection_.add_to(counts);
    assembler_.add_to(counts);
    reader_.counts().add_to(counts);
    return counts;
  }

 private:
  void connect() {
    port_ = connection_.open();
    last_byte_ns_ = last_sentence_ns_ = steady_now();
    bytes_at_sentence_ = reader_.counts().bytes;
    reconnection_.connected(connection_.name);
  }

  void read_once() {
    pollfd event{port_.get(), POLLIN, 0};
    const int ready = ::poll(&event, 1, kPollMs);
    const TimeNs now = steady_now();
    if (ready <= 0) {
      if (now - last_byte_ns_ >= kPause) keep(assembler_.finish());
      look_for_silence(now);
      return;
    }
    std::array<std::uint8_t, 4096> buffer{};
    const TimeNs arrival = host_now();
    const ssize_t size = ::read(port_.get(), buffer.data(), buffer.size());
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (size <= 0) {
      disconnect(size == 0 ? "the other end has closed it" : std::generic_category().message(errno));
      return;
    }
    // A pause may have gone unseen between two reads.
    if (now - last_byte_ns_ >= kPause) keep(assembler_.finish());
    last_byte_ns_ = now;
    std::span<const std::uint8_t> bytes(buffer.data(), static_cast<std::size_t>(size));
    while (const NmeaSentence* sentence = reader_.next(bytes, arrival)) {
      last_sentence_ns_ = now;
      bytes_at_sentence_ = reader_.counts().bytes;
      reconnection_.trouble("");
      keep(assembler_.process(*sentence));
    }
    look_for_silence(now);
  }

  void disconnect(const std::string& why) {
    port_.close();
    reader_.interrupt();
    keep(assembler_.finish());
    reconnection_.lost(connection_.name, why);
  }

  void look_for_silence(TimeNs now) {
    const TimeNs limit = from_seconds(options_.silence_s);
    if (now - last_byte_ns_ > limit) {
      reconnection_.trouble(connection_.name + " is connected and silent");
    } else if (now - last_sentence_ns_ > limit && reader_.counts().bytes - bytes_at_sentence_ > 200) {
      reconnection_.trouble(connection_.name + " sends bytes, but no correct NMEA sentence: " + connection_.hint);
    }
  }

  void keep(std::optional<GpsMeasurement> fix) {
    if (!fix) return;
    fix->time_ns = fix->host_time_ns;
    fix->sequence = sequence_++;
    fixes_.heard(*fix);
    waiting_.push_back(*fix);
  }

  LiveGpsOptions options_;
  GpsConnection connection_;
  Reconnection reconnection_;
  FixWatch fixes_;
  NmeaReader reader_;
  NmeaFixAssembler assembler_;
  FileDescriptor port_;
  std::deque<GpsMeasurement> waiting_;
  TimeNs last_byte_ns_ = 0;      // steady clock
  TimeNs last_sentence_ns_ = 0;  // steady clock
  std::int64_t bytes_at_sentence_ = 0;
  std::int64_t sequence_ = 0;
};

}  // namespace

void LiveGpsOptions::check() const {
  fix.check();
  require_positive("silence", silence_s);
  require_not_negative("reconnect", reconnect_s);
  require(silence_s <= kLongestWaitS, "silence", silence_s, "must be at most 1e6 s");
  require(reconnect_s <= kLongestWaitS, "reconnect", reconnect_s, "must be at most 1e6 s");
}

Reconnection gps_reconnection(const LiveGpsOptions& options) {
  return Reconnection("gps", {options.reconnect_s, options.on_idle, options.on_trouble});
}

void FixWatch::heard(const GpsMeasurement& fix) {
  if (fix.fix == GpsFixType::kNone) return;
  last_fix_ns_ = steady_now();
  if (fix_state_ == FixState::kFix) return;
  fix_state_ = FixState::kFix;
  const std::string time =
      fix.gps_time_ns == kNoTime ? "unknown" : to_text(utc_from_gps(fix.gps_time_ns, options_.fix.leap_seconds));
  const std::string satellites = fix.satellites < 0 ? "unknown" : std::to_string(fix.satellites);
  log_info("event=gps_fix time={} satellites={} fix={}", time, satellites, name_of(fix.fix));
}

void FixWatch::look_for_fix() {
  const TimeNs now = steady_now();
  if (last_fix_ns_ == kNoTime) last_fix_ns_ = now;
  if (fix_state_ == FixState::kNoFix || now - last_fix_ns_ < from_seconds(options_.silence_s)) return;
  const char* what = fix_state_ == FixState::kFix ? "lost" : "none so far";
  fix_state_ = FixState::kNoFix;
  log_warning("event=gps_no_fix state=\"{}\" for_s={:.1f}", what, to_seconds(now - last_fix_ns_));
}

namespace {

LiveGpsOptions with_date_of_host(LiveGpsOptions options) {
  if (options.fix.reference_date) return options;
  // Boards without a battery begin in 1970 or when their system was made.
  options.fix.reference_date = library_date();
  if (const auto gps = gps_from_unix(host_now(), options.fix.leap_seconds)) {
    const CivilDate host = utc_from_gps(*gps, options.fix.leap_seconds).date;
    if (gps_day(host) > gps_day(library_date())) options.fix.reference_date = host;
  }
  return options;
}

}  // namespace

std::unique_ptr<MeasurementSource> open_nmea_stream(GpsConnection connection, LiveGpsOptions options) {
  return std::make_unique<NmeaStreamSource>(std::move(connection), with_date_of_host(std::move(options)));
}

}  // namespace loc
