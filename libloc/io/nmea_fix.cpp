#include "libloc/io/nmea_fix.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;
constexpr TimeNs kHour = 3600 * kSecond;
constexpr TimeNs kDay = 24 * kHour;
// Receivers say 99.99 for a dilution of precision that they do not know.
constexpr double kUnknownDop = 50;
// RMC and GGA of one epoch tell the same position but for their decimals.
constexpr double kSamePosition = 20;  // [m]
constexpr double kEarthRadius = 6.4e6;
// So long after midnight a receiver may go on to tell the date of the day before.
constexpr TimeNs kDateMayBeLate = 10 * kSecond;
// A receiver that was silent for longer, by the host's clock, may have passed a midnight unseen.
constexpr TimeNs kLongestSilence = kHour;

TimeNs time_of_day(const NmeaSentence& sentence) {
  return std::visit(
      [](const auto& m) {
        if constexpr (requires { m.time_of_day_ns; }) {
          return m.time_of_day_ns;
        } else {
          return kNoTime;
        }
      },
      sentence.content);
}

bool is_measured(char mode) {
  return mode != 'E' && mode != 'M' && mode != 'S';
}

/// [m], horizontal
double distance(double latitude_a, double longitude_a, double latitude_b, double longitude_b) {
  const double east = std::remainder(longitude_a - longitude_b, 2 * std::acos(-1.0)) * std::cos(latitude_a);
  return kEarthRadius * std::hypot(latitude_a - latitude_b, east);
}

bool is_deviation(double sigma) {
  return sigma > 0;  // receivers say 0 for unknown; NaN is none either
}

bool is_dop(double dop) {
  return dop > 0 && dop < kUnknownDop;
}

}  // namespace

void NmeaFixOptions::check() const {
  if (reference_date) require(is_date(*reference_date), "reference_date " + to_text(*reference_date) + ": no such day");
  if (geoid_separation) {
    require(std::abs(*geoid_separation) <= 200, "geoid_separation", *geoid_separation, "must be -200 to 200 m");
  }
  require_not_negative("sigma_per_dop", sigma_per_dop);
}

std::string past_leap_table_remark(const CivilDate& date, const LeapSeconds& table) {
  return to_text(date) + " is past the table of leap seconds, which is known until " + to_text(table.known_until()) +
         ": GPS - UTC = " + std::to_string(table.gps_minus_utc(date)) +
         " s is taken, wrong by whole seconds if there was a leap second since; a newer table (package tzdata, or a "
         "leap-seconds.list) or the difference itself settles it";
}

NmeaFixAssembler::NmeaFixAssembler(const NmeaFixOptions& options, GpsTimeEventHandler on_event)
    : options_((options.check(), options)), on_event_(std::move(on_event)) {}

std::optional<GpsMeasurement> NmeaFixAssembler::process(const NmeaSentence& sentence) {
  std::optional<GpsMeasurement> fix;
  if (begins_epoch(sentence)) fix = assemble();
  const TimeNs time = time_of_day(sentence);
  if (time != kNoTime && time == finished_time_of_day_ns_) {
    ++counts_.late;
    return fix;
  }
  if (time != kNoTime) {
    finished_time_of_day_ns_ = kNoTime;
    if (epoch_.time_of_day_ns == kNoTime) {
      epoch_.time_of_day_ns = time;
      epoch_.host_time_ns = sentence.host_time_ns;
    }
  }
  if (epoch_.host_time_ns == kNoTime) epoch_.host_time_ns = sentence.host_time_ns;
  keep(sentence);
  label(sentence);
  return fix;
}

std::optional<GpsMeasurement> NmeaFixAssembler::finish() {
  // What has come without time is the beginning of the next epoch.
  if (epoch_.time_of_day_ns == kNoTime && !epoch_.rmc && !epoch_.gga) return std::nullopt;
  finished_time_of_day_ns_ = epoch_.time_of_day_ns;
  return assemble();
}

bool NmeaFixAssembler::begins_epoch(const NmeaSentence& sentence) const {
  const TimeNs time = time_of_day(sentence);
  if (time != kNoTime && epoch_.time_of_day_ns != kNoTime && time != epoch_.time_of_day_ns) return true;
  // The same time of another day, and sentences of a receiver that does not know the time yet.
  if (const auto* rmc = std::get_if<NmeaRmc>(&sentence.content); rmc != nullptr && epoch_.rmc) {
    return time == kNoTime || rmc->date != epoch_.rmc->date;
  }
  if (const auto* zda = std::get_if<NmeaZda>(&sentence.content); zda != nullptr && epoch_.zda) {
    return time != kNoTime && zda->date != epoch_.zda->date;
  }
  return std::holds_alternative<NmeaGga>(sentence.content) && epoch_.gga && time == kNoTime;
}

void NmeaFixAssembler::keep(const NmeaSentence& sentence) {
  const auto keep_first = [&](auto& place, const auto& content) {
    if (place) {
      ++counts_.repeated;
    } else {
      place = content;
    }
  };
  if (const auto* rmc = std::get_if<NmeaRmc>(&sentence.content)) keep_first(epoch_.rmc, *rmc);
  if (const auto* gga = std::get_if<NmeaGga>(&sentence.content)) keep_first(epoch_.gga, *gga);
  if (const auto* zda = std::get_if<NmeaZda>(&sentence.content)) keep_first(epoch_.zda, *zda);
  if (const auto* gst = std::get_if<NmeaGst>(&sentence.content)) keep_first(epoch_.gst, *gst);
  if (const auto* gsa = std::get_if<NmeaGsa>(&sentence.content)) {
    epoch_.gsa_fix = std::max(epoch_.gsa_fix, gsa->fix);
    if (!is_dop(epoch_.hdop)) epoch_.hdop = gsa->hdop;
    if (!is_dop(epoch_.vdop)) epoch_.vdop = gsa->vdop;
  }
  if (const auto* vtg = std::get_if<NmeaVtg>(&sentence.content)) {
    if (!epoch_.vtg) {
      epoch_.vtg = *vtg;
      epoch_.vtg_talker = sentence.talker;
    } else if (sentence.talker == epoch_.vtg_talker) {
      next_vtg_ = *vtg;
    } else {
      ++counts_.repeated;
    }
  }
}

bool NmeaFixAssembler::told_valid(const NmeaRmc& rmc) const {
  return rmc.valid && rmc.mode != 'N' && (options_.accept_not_measured || is_measured(rmc.mode));
}

bool NmeaFixAssembler::told_valid(const NmeaGga& gga) const {
  return gga.quality >= 1 && (options_.accept_not_measured || gga.quality <= 5);
}

void NmeaFixAssembler::label(const NmeaSentence& sentence) {
  if (epoch_.labelled || sentence.host_time_ns == kNoTime) return;
  std::optional<CivilDate> date;
  if (const auto* rmc = std::get_if<NmeaRmc>(&sentence.content)) {
    if (!told_valid(*rmc)) return;
    date = date_of(*rmc);
  } else if (const auto* zda = std::get_if<NmeaZda>(&sentence.content)) {
    const bool gga_valid = epoch_.gga ? told_valid(*epoch_.gga) : last_valid_;
    if (epoch_.rmc ? !told_valid(*epoch_.rmc) : !gga_valid) return;
    date = date_of(*zda);
  }
  const TimeNs time = time_of_day(sentence);
  if (!date || time == kNoTime) return;
  if (is_late(*date, time)) date = date_from_gps_day(gps_day(*date) + 1);
  const std::optional<TimeNs> gps = gps_time(*date, time);
  if (!gps) return;
  epoch_.labelled = true;
  ++counts_.labels;
  if (!on_event_) return;
  on_event_({.kind = GpsTimeEvent::Kind::kLabel, .host_time_ns = sentence.host_time_ns, .gps_time_ns = *gps});
}

std::optional<GpsMeasurement> NmeaFixAssembler::assemble() {
  const Epoch epoch = std::exchange(epoch_, Epoch{});
  if (next_vtg_) {
    epoch_.vtg = std::exchange(next_vtg_, std::nullopt);
    epoch_.vtg_talker = epoch.vtg_talker;
  }
  if (!epoch.rmc && !epoch.gga) return std::nullopt;
  ++counts_.epochs;
  GpsMeasurement fix;
  fix.host_time_ns = epoch.host_time_ns;
  const bool valid = has_fix(epoch);
  if (epoch.gga) fix.satellites = epoch.gga->satellites;
  find_time(epoch, valid, fix);
  last_valid_ = valid;
  if (!valid) {
    ++counts_.no_fix;
    return fix;
  }
  fix.fix = fix_type(epoch);
  fill_position(epoch, fix);
  fill_covariance(epoch, fix);
  fill_velocity(epoch, fix);
  return fix;
}

bool NmeaFixAssembler::has_fix(const Epoch& epoch) {
  int yes = 0;
  int no = 0;
  const auto count = [&](bool says_yes) { ++(says_yes ? yes : no); };
  if (epoch.rmc) count(told_valid(*epoch.rmc));
  if (epoch.gga) count(told_valid(*epoch.gga));
  if (epoch.gsa_fix != -1) count(epoch.gsa_fix > 1);
  const bool not_measured =
      (epoch.rmc && epoch.rmc->valid && !is_measured(epoch.rmc->mode)) || (epoch.gga && epoch.gga->quality > 5);
  if (not_measured && !options_.accept_not_measured) {
    ++counts_.not_measured;
    return false;
  }
  if (yes > 0 && no > 0) ++counts_.contradictory;
  if (yes == 0 || no > 0) return false;
  const bool in_rmc = epoch.rmc && std::isfinite(epoch.rmc->latitude);
  const bool in_gga = epoch.gga && std::isfinite(epoch.gga->latitude);
  if (in_rmc && in_gga &&
      distance(epoch.rmc->latitude, epoch.rmc->longitude, epoch.gga->latitude, epoch.gga->longitude) > kSamePosition) {
    ++counts_.contradictory;
    return false;
  }
  return in_rmc || in_gga;
}

GpsFixType NmeaFixAssembler::fix_type(const Epoch& epoch) const {
  if (epoch.gsa_fix == 2) return GpsFixType::k2d;
  const char mode = epoch.rmc ? epoch.rmc->mode : '\0';
  const std::int32_t quality = epoch.gga ? epoch.gga->quality : -1;
  if (quality == 4 || (!epoch.gga && mode == 'R')) return GpsFixType::kFixed;
  if (quality == 5 || (!epoch.gga && mode == 'F')) return GpsFixType::kFloat;
  if (quality == 2 || (!epoch.gga && mode == 'D')) return GpsFixType::kDifferential;
  if (epoch.gsa_fix == 3) return GpsFixType::k3d;
  const bool height = epoch.gga && epoch.gga->satellites >= 4 && std::isfinite(epoch.gga->altitude_msl);
  return height ? GpsFixType::k3d : GpsFixType::k2d;
}

CivilDate NmeaFixAssembler::mended(const CivilDate& date) const {
  return options_.reference_date ? resolve_rollover(date, *options_.reference_date) : date;
}

std::optional<CivilDate> NmeaFixAssembler::date_of(const NmeaRmc& rmc) const {
  if (rmc.date.month == 0) return std::nullopt;
  CivilDate date = rmc.date;
  date.year = options_.reference_date ? full_year(date.year, options_.reference_date->year) : full_year(date.year);
  // Only a reference outside of 1980 to 2079 can make it a day that does not exist.
  if (!is_date(date)) return std::nullopt;
  return mended(date);
}

std::optional<CivilDate> NmeaFixAssembler::date_of(const NmeaZda& zda) const {
  if (zda.date.month == 0) return std::nullopt;
  return mended(zda.date);
}

// Right after midnight, with the date of yesterday: the last epoch was seconds ago only if it is today.
bool NmeaFixAssembler::is_late(const CivilDate& date, TimeNs time_of_day_ns) const {
  if (!last_date_ || time_of_day_ns >= kDateMayBeLate || gps_day(date) > gps_day(*last_date_)) return false;
  const TimeNs since_last = (gps_day(date) + 1 - gps_day(*last_date_)) * kDay + time_of_day_ns - last_time_of_day_ns_;
  const CivilDate next = date_from_gps_day(gps_day(date) + 1);
  return since_last > 0 && since_last <= kDateMayBeLate && is_date(next);
}

// An epoch that tells no date is on the day of the last one, or on the next when midnight was between them.
std::optional<CivilDate> NmeaFixAssembler::carried_date(const Epoch& epoch) const {
  if (!last_date_) return std::nullopt;
  const TimeNs ahead = epoch.time_of_day_ns - last_time_of_day_ns_;
  int days = 0;
  if (ahead < -kDay / 2) days = 1;
  if (ahead > kDay / 2) days = -1;
  if (epoch.host_time_ns != kNoTime && last_host_time_ns_ != kNoTime &&
      epoch.host_time_ns - last_host_time_ns_ > kLongestSilence) {
    return std::nullopt;
  }
  const CivilDate date = date_from_gps_day(gps_day(*last_date_) + days);
  return is_date(date) ? std::optional(date) : std::nullopt;
}

std::optional<TimeNs> NmeaFixAssembler::gps_time(const CivilDate& date, TimeNs time_of_day_ns) const {
  const std::int64_t minute = std::min<std::int64_t>(time_of_day_ns / (60 * kSecond), 1439);  // 24 h is 23:59:60
  const TimeNs in_minute = time_of_day_ns - minute * 60 * kSecond;
  return gps_from_utc({.date = date,
                       .hour = static_cast<std::int32_t>(minute / 60),
                       .minute = static_cast<std::int32_t>(minute % 60),
                       .second = static_cast<std::int32_t>(in_minute / kSecond),
                       .nanosecond = static_cast<std::int32_t>(in_minute % kSecond)},
                      options_.leap_seconds);
}

void NmeaFixAssembler::find_time(const Epoch& epoch, bool valid, GpsMeasurement& fix) {
  told_gps_time_ns_ = kNoTime;
  if (epoch.time_of_day_ns == kNoTime) {
    if (valid) ++counts_.no_date;
    return;
  }
  const std::optional<CivilDate> from_rmc = epoch.rmc ? date_of(*epoch.rmc) : std::nullopt;
  const std::optional<CivilDate> from_zda = epoch.zda ? date_of(*epoch.zda) : std::nullopt;
  if (from_rmc && from_zda && *from_rmc != *from_zda) {
    ++counts_.contradictory;
    return;
  }
  std::optional<CivilDate> date = from_rmc ? from_rmc : from_zda;
  const bool late = date && is_late(*date, epoch.time_of_day_ns);
  if (late) date = date_from_gps_day(gps_day(*date) + 1);
  if (!date) date = carried_date(epoch);
  if (!date) {
    if (valid) ++counts_.no_date;
    return;
  }
  const std::optional<TimeNs> gps = gps_time(*date, epoch.time_of_day_ns);
  if (!gps) {
    ++counts_.impossible_time;
    return;
  }
  told_gps_time_ns_ = *gps;
  if (!valid) return;
  fix.gps_time_ns = *gps;
  last_date_ = date;
  last_time_of_day_ns_ = epoch.time_of_day_ns;
  last_host_time_ns_ = epoch.host_time_ns;
  if (late) ++counts_.date_late;
  // 7168 days are no whole number of years: RMC's day and month tell, too.
  const bool zda_mended = from_zda && *from_zda != epoch.zda->date;
  const bool rmc_mended =
      from_rmc && (from_rmc->month != epoch.rmc->date.month || from_rmc->day != epoch.rmc->date.day);
  remark(epoch, *date, zda_mended || rmc_mended);
}

void NmeaFixAssembler::remark(const Epoch& epoch, const CivilDate& date, bool mended) {
  if (mended && counts_.rollover_mended++ == 0 && options_.on_remark) {
    CivilDate told = epoch.rmc ? epoch.rmc->date : epoch.zda->date;
    if (told.year < 100) told.year = full_year(told.year, options_.reference_date->year);
    options_.on_remark("the receiver tells " + to_text(told) + ", which is taken for " + to_text(date) +
                       ", 1024 weeks (or a multiple) later, as its firmware seems to be past its rollover; if the data "
                       "are as old as that, a reference date of their time keeps the date");
  }
  if (options_.leap_seconds.known_on(date)) return;
  if (counts_.past_leap_table++ == 0 && options_.on_remark) {
    options_.on_remark(past_leap_table_remark(date, options_.leap_seconds));
  }
}

void NmeaFixAssembler::fill_position(const Epoch& epoch, GpsMeasurement& fix) const {
  const bool in_gga = epoch.gga && std::isfinite(epoch.gga->latitude);
  fix.latitude = in_gga ? epoch.gga->latitude : epoch.rmc->latitude;
  fix.longitude = in_gga ? epoch.gga->longitude : epoch.rmc->longitude;
  if (!epoch.gga || fix.fix == GpsFixType::k2d) return;
  double separation = epoch.gga->geoid_separation;
  if (!std::isfinite(separation)) separation = options_.geoid_separation.value_or(kUnknown);
  fix.altitude = epoch.gga->altitude_msl + separation;
}

void NmeaFixAssembler::fill_covariance(const Epoch& epoch, GpsMeasurement& fix) const {
  double east = kUnknown;  // variances
  double north = kUnknown;
  double east_north = 0;
  double up = kUnknown;
  if (epoch.gst) {
    const NmeaGst& g = *epoch.gst;
    if (is_deviation(g.sigma_longitude) && is_deviation(g.sigma_latitude)) {
      east = g.sigma_longitude * g.sigma_longitude;
      north = g.sigma_latitude * g.sigma_latitude;
    }
    if (is_deviation(g.sigma_major) && is_deviation(g.sigma_minor) && std::isfinite(g.major_axis)) {
      const double sine = std::sin(g.major_axis);
      const double cosine = std::cos(g.major_axis);
      const double major = g.sigma_major * g.sigma_major;
      const double minor = g.sigma_minor * g.sigma_minor;
      // The ellipse alone gives the whole block; beside the deviations, the correlation that belongs to them.
      const double ellipse_east = major * sine * sine + minor * cosine * cosine;
      const double ellipse_north = major * cosine * cosine + minor * sine * sine;
      const double correlation = (major - minor) * sine * cosine / std::sqrt(ellipse_east * ellipse_north);
      if (!std::isfinite(east)) {
        east = ellipse_east;
        north = ellipse_north;
      }
      east_north = correlation * std::sqrt(east * north);
    }
    if (is_deviation(g.sigma_altitude)) up = g.sigma_altitude * g.sigma_altitude;
  }
  const double unit = options_.sigma_per_dop;
  const double hdop = epoch.gga && is_dop(epoch.gga->hdop) ? epoch.gga->hdop : epoch.hdop;
  if (!std::isfinite(east) && unit > 0 && is_dop(hdop)) {
    // HDOP^2 is the sum of the two.
    east = north = unit * unit * hdop * hdop / 2;
  }
  if (!std::isfinite(up) && unit > 0 && is_dop(epoch.vdop)) up = unit * unit * epoch.vdop * epoch.vdop;
  const bool horizontal = std::isfinite(east);
  const bool vertical = std::isfinite(up) && fix.fix != GpsFixType::k2d;
  if (horizontal) fix.position_cov.topLeftCorner<2, 2>() << east, east_north, east_north, north;
  if (vertical) fix.position_cov(2, 2) = up;
  if (horizontal && vertical) {
    // Receivers do not tell it, and filters need a number.
    fix.position_cov.topRightCorner<2, 1>().setZero();
    fix.position_cov.bottomLeftCorner<1, 2>().setZero();
  }
}

void NmeaFixAssembler::fill_velocity(const Epoch& epoch, GpsMeasurement& fix) const {
  double speed = epoch.rmc ? epoch.rmc->speed : kUnknown;
  double course = epoch.rmc ? epoch.rmc->course : kUnknown;
  const auto complete = [&] { return speed == 0 || (std::isfinite(speed) && std::isfinite(course)); };
  if (!complete() && epoch.vtg && epoch.vtg->mode != 'N' &&
      (options_.accept_not_measured || is_measured(epoch.vtg->mode))) {
    speed = epoch.vtg->speed;
    course = epoch.vtg->course;
  }
  // Slow receivers tell a speed without course: the vector is not known then.
  if (!complete()) return;
  fix.velocity_enu.x() = speed == 0 ? 0 : speed * std::sin(course);
  fix.velocity_enu.y() = speed == 0 ? 0 : speed * std::cos(course);
}

void NmeaFixAssembler::add_to(NamedCounts& counts) const {
  counts.push_back({"gps.epochs", counts_.epochs});
  counts.push_back({"gps.no_fix", counts_.no_fix});
  const auto add = [&](const char* name, std::int64_t value) {
    if (value > 0) counts.push_back({name, value});
  };
  add("gps.no_date", counts_.no_date);
  add("gps.date_past_leap_table", counts_.past_leap_table);
  add("gps.contradictory", counts_.contradictory);
  add("gps.not_measured", counts_.not_measured);
  add("gps.repeated_sentence", counts_.repeated);
  add("gps.late_sentence", counts_.late);
  add("gps.impossible_time", counts_.impossible_time);
  add("gps.rollover_mended", counts_.rollover_mended);
  add("gps.date_late", counts_.date_late);
  add("gps.time_labels", counts_.labels);
}

}  // namespace loc
