// gpsd through libgps. Its JSON: TPV (fix), SKY (satellites), TOFF and PPS (time), DEVICES.
// Error estimates: gpsd does not know whether its receivers mean 1 sigma or 95 %; they are taken as 1 sigma, which can
// only be too cautious. eph is the horizontal error as a whole: each axis gets its half of the variance where epx and
// epy are missing.
#include "tools/support/gps_source.hpp"

#ifdef LOC_HAVE_LIBGPS

#include <gps.h>
#include <sys/poll.h>

#include <array>
#include <cmath>
#include <deque>
#include <memory>
#include <numbers>

#include "libloc/core/check.hpp"
#include "tools/support/program.hpp"

#if GPSD_API_MAJOR_VERSION < 11
#error "libgps 3.22 (API 11) or later is needed"
#endif

namespace loc {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr TimeNs kSecond = 1'000'000'000;
constexpr int kPollUs = 100'000;
constexpr int kPartialMs = 20;

TimeNs to_ns(const timespec& t) {
  // gpsd's times are seconds since 1970; what does not fit is none.
  if (t.tv_sec <= 0 || t.tv_sec > 9'000'000'000 || t.tv_nsec < 0 || t.tv_nsec >= kSecond) return kNoTime;
  return static_cast<TimeNs>(t.tv_sec) * kSecond + t.tv_nsec;
}

double square(double x) {
  return x * x;
}

bool is_deviation(double sigma) {
  return std::isfinite(sigma) && sigma > 0;
}

GpsFixType fix_type(const ::gps_fix_t& fix) {
  if (fix.mode == MODE_2D) return GpsFixType::k2d;
  if (fix.status == STATUS_DGPS_FIX) return GpsFixType::kDifferential;
  if (fix.status == STATUS_RTK_FIX) return GpsFixType::kFixed;
  if (fix.status == STATUS_RTK_FLT) return GpsFixType::kFloat;
  return GpsFixType::k3d;
}

bool is_measured(const ::gps_fix_t& fix) {
  return fix.status != STATUS_DR && fix.status != STATUS_GNSSDR && fix.status != STATUS_TIME &&
         fix.status != STATUS_SIM;
}

void fill_position(const ::gps_fix_t& in, GpsMeasurement& out) {
  out.latitude = in.latitude * kRadPerDeg;
  out.longitude = in.longitude * kRadPerDeg;
  if (out.fix != GpsFixType::k2d) {
    if (std::isfinite(in.altHAE)) {
      out.altitude = in.altHAE;
    } else if (std::isfinite(in.altMSL) && std::isfinite(in.geoid_sep)) {
      out.altitude = in.altMSL + in.geoid_sep;
    }
  }
  const bool each = is_deviation(in.epx) && is_deviation(in.epy);
  const bool horizontal = each || is_deviation(in.eph);
  const bool vertical = std::isfinite(out.altitude) && is_deviation(in.epv);
  if (horizontal) {
    const double east = each ? square(in.epx) : square(in.eph) / 2;
    const double north = each ? square(in.epy) : square(in.eph) / 2;
    out.position_cov.topLeftCorner<2, 2>() << east, 0, 0, north;
  }
  if (vertical) out.position_cov(2, 2) = square(in.epv);
  if (horizontal && vertical) {
    out.position_cov.topRightCorner<2, 1>().setZero();
    out.position_cov.bottomLeftCorner<1, 2>().setZero();
  }
}

void fill_velocity(const ::gps_fix_t& in, GpsMeasurement& out) {
  const bool still = in.speed == 0;
  if (still || (std::isfinite(in.speed) && std::isfinite(in.track))) {
    const double course = still ? 0 : in.track * kRadPerDeg;
    out.velocity_enu.head<2>() << in.speed * std::sin(course), in.speed * std::cos(course);
    // Of the speed; across it the error is not larger.
    if (is_deviation(in.eps)) out.velocity_cov.topLeftCorner<2, 2>() = Eigen::Matrix2d::Identity() * square(in.eps);
  }
  if (out.fix == GpsFixType::k2d || !std::isfinite(in.climb)) return;
  out.velocity_enu.z() = in.climb;
  if (is_deviation(in.epc)) out.velocity_cov(2, 2) = square(in.epc);
  if (std::isfinite(out.velocity_cov(0, 0)) && is_deviation(in.epc)) {
    out.velocity_cov.topRightCorner<2, 1>().setZero();
    out.velocity_cov.bottomLeftCorner<1, 2>().setZero();
  }
}

class GpsdSource final : public MeasurementSource {
 public:
  GpsdSource(const std::string& address, LiveGpsOptions options)
      : options_((options.check(), std::move(options))),
        where_(parse_address(address.empty() ? "localhost" : address, DEFAULT_GPSD_PORT)),
        name_("gpsd " + where_.host + ":" + where_.port),
        reconnection_(gps_reconnection(options_)),
        fixes_(options_) {
    connect();
  }
  ~GpsdSource() override { disconnect(); }
  GpsdSource(const GpsdSource&) = delete;
  GpsdSource& operator=(const GpsdSource&) = delete;

  void stop() override { reconnection_.stop(); }

  std::optional<Measurement> next() override {
    while (!stop_requested() && !reconnection_.stopped()) {
      fixes_.look_for_fix();
      if (!connected_) {
        if (!reconnection_.wait()) break;
        try {
          connect();
        } catch (const GpsConnectionError& error) {
          reconnection_.failed(error.what());
        }
        continue;
      }
      std::optional<GpsMeasurement> fix;
      if (::gps_waiting(data_.get(), kPollUs)) {
        fix = read();
      } else if (steady_now() - last_fix_ns_ > from_seconds(options_.silence_s)) {
        reconnection_.trouble(name_ + " tells no position or state: is a receiver attached (gpsd -N DEVICE, cgps)?");
      }
      if (options_.on_idle) options_.on_idle();
      if (fix) fixes_.heard(*fix);
      if (fix) return fix;
    }
    return std::nullopt;
  }

  NamedCounts counts() const override {
    NamedCounts counts = {{"gps.read", sequence_}, {"gps.no_fix", no_fix_}};
    reconnection_.add_to(counts);
    const auto add = [&](const char* name, std::int64_t value) {
      if (value > 0) counts.push_back({name, value});
    };
    add("gps.not_measured", not_measured_);
    add("gps.refused", refused_);
    add("gps.date_past_leap_table", past_leap_table_);
    add("gps.leap_seconds_differ", leap_differ_);
    add("gps.time_labels", labels_);
    add("gps.pulses", pulses_);
    return counts;
  }

 private:
  void connect() {
    data_ = std::make_unique<gps_data_t>();  // a struct of 20 kB, which libgps wants zeroed
    if (::gps_open(where_.host.c_str(), where_.port.c_str(), data_.get()) != 0) {
      throw GpsConnectionError(name_ +
                               ": cannot be reached: is gpsd running there? (systemctl start gpsd, or gpsd -N "
                               "DEVICE; from another host it listens with -G only)");
    }
    connected_ = true;
    if (::gps_stream(data_.get(), WATCH_ENABLE | WATCH_JSON | WATCH_PPS, nullptr) != 0) {
      disconnect();
      throw GpsConnectionError(name_ + ": does not take the request to watch");
    }
    last_fix_ns_ = steady_now();
    reconnection_.connected(name_);
  }

  void disconnect() {
    if (connected_) ::gps_close(data_.get());
    connected_ = false;
  }

  std::optional<GpsMeasurement> read() {
    const TimeNs arrival = host_now();
    // They keep what an earlier message has left.
    data_->toff = {};
    data_->pps = {};
    const int size = ::gps_read(data_.get(), nullptr, 0);
    if (size < 0) {
      disconnect();
      reconnection_.lost(name_, "gpsd has closed the connection");
      return std::nullopt;
    }
    if (size == 0) {
      // Half a message; until the rest comes, gps_waiting() returns at once and the flags are those of the last one.
      pollfd event{data_->gps_fd, POLLIN, 0};
      ::poll(&event, 1, kPartialMs);
      return std::nullopt;
    }
    const gps_data_t& d = *data_;
    // libgps 3.22 leaves what TOFF says in pps.
    if ((d.set & TOFF_SET) != 0) {
      time_event(GpsTimeEvent::Kind::kLabel, to_ns(d.toff.real) == kNoTime ? d.pps : d.toff);
    } else if ((d.set & PPS_SET) != 0) {
      time_event(GpsTimeEvent::Kind::kPulse, d.pps);
    }
    if ((d.set & MODE_SET) == 0) return std::nullopt;
    last_fix_ns_ = steady_now();
    reconnection_.trouble("");
    return fix_of(d, arrival);
  }

  std::optional<GpsMeasurement> fix_of(const gps_data_t& d, TimeNs arrival) {
    GpsMeasurement out;
    out.time_ns = out.host_time_ns = arrival;
    out.sequence = sequence_++;
    const ::gps_fix_t& in = d.fix;
    const bool located = in.mode >= MODE_2D && std::isfinite(in.latitude) && std::isfinite(in.longitude);
    if (located && (std::abs(in.latitude) > 90 || std::abs(in.longitude) > 180)) {
      ++refused_;
      ++no_fix_;
      return out;
    }
    if (located && !options_.fix.accept_not_measured && !is_measured(in)) {
      ++not_measured_;
      ++no_fix_;
      return out;
    }
    if (!located) {
      ++no_fix_;
      return out;
    }
    out.fix = fix_type(in);
    if (d.satellites_used > 0) out.satellites = d.satellites_used;
    if (const auto gps = gps_time(in.time)) out.gps_time_ns = *gps;
    fill_position(in, out);
    fill_velocity(in, out);
    return out;
  }

  // gpsd tells Unix time, and the leap seconds that the receiver has heard of. Those are believed where the table ends:
  // receivers tell a factory value until they have heard the almanac.
  std::optional<TimeNs> gps_time(const timespec& time) {
    const TimeNs unix_ns = to_ns(time);
    const LeapSeconds& table = options_.fix.leap_seconds;
    const std::optional<TimeNs> gps = unix_ns == kNoTime ? std::nullopt : gps_from_unix(unix_ns, table);
    if (!gps) return std::nullopt;
    const CivilDate date = utc_from_gps(*gps, table).date;
    const int told = data_->leap_seconds;
    const bool differs = told > 0 && told <= 255 && told != table.gps_minus_utc(date);
    if (differs) ++leap_differ_;
    if (table.known_on(date)) return gps;
    if (past_leap_table_++ == 0 && !differs && options_.fix.on_remark) {
      options_.fix.on_remark(past_leap_table_remark(date, table));
    }
    return differs ? gps_from_unix(unix_ns, LeapSeconds::constant(told)) : gps;
  }

  void time_event(GpsTimeEvent::Kind kind, const timedelta_t& pair) {
    const std::optional<TimeNs> gps = gps_time(pair.real);
    const TimeNs host = to_ns(pair.clock);
    if (!gps || host == kNoTime) {
      ++refused_;
      return;
    }
    ++(kind == GpsTimeEvent::Kind::kLabel ? labels_ : pulses_);
    if (options_.on_time_event) options_.on_time_event({.kind = kind, .host_time_ns = host, .gps_time_ns = *gps});
  }

  LiveGpsOptions options_;
  HostAndPort where_;
  std::string name_;
  Reconnection reconnection_;
  FixWatch fixes_;
  std::unique_ptr<gps_data_t> data_;
  bool connected_ = false;
  TimeNs last_fix_ns_ = 0;  // steady clock
  std::int64_t sequence_ = 0;
  std::int64_t no_fix_ = 0;
  std::int64_t not_measured_ = 0;
  std::int64_t refused_ = 0;
  std::int64_t past_leap_table_ = 0;
  std::int64_t leap_differ_ = 0;
  std::int64_t labels_ = 0;
  std::int64_t pulses_ = 0;
};

}  // namespace

std::unique_ptr<MeasurementSource> open_gpsd(const std::string& address, LiveGpsOptions options) {
  return std::make_unique<GpsdSource>(address, std::move(options));
}

}  // namespace loc

#else

#include "tools/support/program.hpp"

namespace loc {

std::unique_ptr<MeasurementSource> open_gpsd(const std::string& /*address*/, LiveGpsOptions /*options*/) {
  throw UsageError(
      "gpsd: this loc-driver was built without libgps (Debian: libgps-dev; then configure and build again)");
}

}  // namespace loc

#endif
