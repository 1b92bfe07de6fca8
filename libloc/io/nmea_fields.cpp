#include "libloc/io/nmea_fields.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace loc::io {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr double kKnot = 1852.0 / 3600;  // [m/s]
constexpr double kKmPerHour = 1 / 3.6;
constexpr TimeNs kSecond = 1'000'000'000;
constexpr std::size_t kMaxFields = 32;
// Wide enough for receivers in orbit.
constexpr double kMaxKnots = 25'000;
constexpr double kMinAltitude = -10'000;
constexpr double kMaxAltitude = 1e8;
constexpr double kMaxSeparation = 200;  // of geoid and ellipsoid: -107 to 86 m on earth
constexpr double kMaxDop = 1000;
constexpr double kMaxSigma = 1e9;
constexpr std::string_view kModes = "ADEFMNPRS";

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

bool all_digits(std::string_view text) {
  return std::all_of(text.begin(), text.end(), is_digit);
}

/// Value of digits only. @param text at most 18 of them
std::int64_t value_of(std::string_view text) {
  std::int64_t value = 0;
  for (const char c : text) value = value * 10 + (c - '0');
  return value;
}

double power_of_ten(std::size_t exponent) {
  static constexpr double kPowers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8, 1e9,
                                       1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18};
  return kPowers[exponent];
}

/// "-12.34": sign, digits, decimals; no exponent, no blank. Both parts are exact in a double up to 15 digits, so that
/// one division rounds once. @return false when it is not a number of at most 15 digits.
bool parse_decimal(std::string_view text, double& value) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  std::int64_t digits = 0;
  std::size_t count = 0;
  std::size_t decimals = 0;
  bool point = false;
  for (const char c : text) {
    if (is_digit(c)) {
      digits = digits * 10 + (c - '0');
      if (++count > 15) return false;
      if (point) ++decimals;
    } else if (c == '.' && !point) {
      point = true;
    } else {
      return false;
    }
  }
  if (count == 0) return false;
  value = static_cast<double>(digits) / power_of_ten(decimals);
  if (negative) value = -value;
  return true;
}

/// The fields of one sentence; the first problem is kept.
class Fields {
 public:
  explicit Fields(std::string_view text) {
    for (;;) {
      const auto comma = text.find(',');
      if (size_ == kMaxFields) {
        problem_ = NmeaProblem::kFields;
        return;
      }
      fields_[size_++] = text.substr(0, comma);
      if (comma == std::string_view::npos) return;
      text.remove_prefix(comma + 1);
    }
  }

  NmeaProblem problem() const { return problem_; }
  std::size_t size() const { return size_; }
  /// Number of fields without the address. @return false, and a problem, when there are others.
  bool expect(std::size_t least, std::size_t most) {
    if (size_ < least + 1 || size_ > most + 1) fail(NmeaProblem::kFields);
    return problem_ == NmeaProblem::kNone;
  }
  bool empty(std::size_t i) const { return fields_[i].empty(); }

  double number(std::size_t i, double least, double most) {
    if (fields_[i].empty()) return kUnknown;
    double value = 0;
    if (!parse_decimal(fields_[i], value) || value < least || value > most) {
      fail(NmeaProblem::kNumber);
      return kUnknown;
    }
    return value;
  }
  double scaled(std::size_t i, double least, double most, double unit) { return number(i, least, most) * unit; }

  std::int32_t integer(std::size_t i, std::int32_t least, std::int32_t most, std::int32_t unknown = -1) {
    std::string_view text = fields_[i];
    if (text.empty()) return unknown;
    const bool negative = text.starts_with('-');
    if (negative) text.remove_prefix(1);
    if (text.empty() || text.size() > 9 || !all_digits(text)) {
      fail(NmeaProblem::kNumber);
      return unknown;
    }
    const auto value = static_cast<std::int32_t>(negative ? -value_of(text) : value_of(text));
    if (value < least || value > most) {
      fail(NmeaProblem::kNumber);
      return unknown;
    }
    return value;
  }

  /// @param allowed its letters; 0 for an empty field
  char letter(std::size_t i, std::string_view allowed) {
    const std::string_view text = fields_[i];
    if (text.empty()) return 0;
    if (text.size() != 1 || allowed.find(text.front()) == std::string_view::npos) {
      fail(NmeaProblem::kLetter);
      return 0;
    }
    return text.front();
  }

  /// The unit after a value: must be there when the value is.
  void unit(std::size_t i, char unit) {
    if (letter(i, {&unit, 1}) == 0 && !empty(i - 1)) fail(NmeaProblem::kLetter);
  }

  /// hhmmss or hhmmss.s…; 23:59:60 is the only second 60.
  TimeNs time_of_day(std::size_t i) {
    const std::string_view text = fields_[i];
    if (text.empty()) return kNoTime;
    const bool whole = text.size() == 6;
    const bool shaped = whole || (text.size() >= 7 && text.size() <= 16 && text[6] == '.');
    const std::string_view decimals = shaped && !whole ? text.substr(7) : std::string_view{};
    if (!shaped || !all_digits(text.substr(0, 6)) || !all_digits(decimals)) {
      fail(NmeaProblem::kTime);
      return kNoTime;
    }
    const std::int64_t hour = value_of(text.substr(0, 2));
    const std::int64_t minute = value_of(text.substr(2, 2));
    const std::int64_t second = value_of(text.substr(4, 2));
    const bool leap = hour == 23 && minute == 59 && second == 60;
    if (hour > 23 || minute > 59 || (second > 59 && !leap)) {
      fail(NmeaProblem::kTime);
      return kNoTime;
    }
    std::int64_t ns = value_of(decimals);
    for (std::size_t k = decimals.size(); k < 9; ++k) ns *= 10;
    return (hour * 3600 + minute * 60 + second) * kSecond + ns;
  }

  /// ddmm.mmm and its hemisphere in the field after it. @param degree_digits 2 or 3
  double angle(std::size_t i, std::size_t degree_digits, std::string_view hemispheres, double most_deg,
               NmeaProblem problem) {
    const std::string_view text = fields_[i];
    const char hemisphere = letter(i + 1, hemispheres);
    // Receivers without a fix may leave the hemisphere of the last one.
    if (text.empty()) return kUnknown;
    double minutes = 0;
    const bool shaped = text.size() >= degree_digits + 2 && all_digits(text.substr(0, degree_digits + 2)) &&
                        (text.size() == degree_digits + 2 || text[degree_digits + 2] == '.') &&
                        parse_decimal(text.substr(degree_digits), minutes);
    const double degrees = shaped ? static_cast<double>(value_of(text.substr(0, degree_digits))) : 0;
    if (!shaped || hemisphere == 0 || minutes >= 60 || degrees + minutes / 60 > most_deg) {
      fail(problem);
      return kUnknown;
    }
    const double value = (degrees + minutes / 60) * kRadPerDeg;
    return hemisphere == hemispheres.front() ? value : -value;
  }
  double latitude(std::size_t i) { return angle(i, 2, "NS", 90, NmeaProblem::kLatitude); }
  double longitude(std::size_t i) { return angle(i, 3, "EW", 180, NmeaProblem::kLongitude); }
  /// Half a position is none.
  void both_or_none(double latitude, double longitude) {
    if (std::isnan(latitude) != std::isnan(longitude)) {
      fail(std::isnan(latitude) ? NmeaProblem::kLatitude : NmeaProblem::kLongitude);
    }
  }

  /// ddmmyy; the year keeps its two digits.
  CivilDate short_date(std::size_t i) {
    const std::string_view text = fields_[i];
    if (text.empty()) return {};
    if (text.size() != 6 || !all_digits(text)) {
      fail(NmeaProblem::kDate);
      return {};
    }
    const CivilDate date = {static_cast<std::int32_t>(value_of(text.substr(4))),
                            static_cast<std::int32_t>(value_of(text.substr(2, 2))),
                            static_cast<std::int32_t>(value_of(text.substr(0, 2)))};
    if (!is_date({full_year(date.year), date.month, date.day})) {
      fail(NmeaProblem::kDate);
      return {};
    }
    return date;
  }

  /// Day, month and year in three fields.
  CivilDate long_date(std::size_t i) {
    if (empty(i) && empty(i + 1) && empty(i + 2)) return {};
    const std::string_view day = fields_[i];
    const std::string_view month = fields_[i + 1];
    const std::string_view year = fields_[i + 2];
    const bool shaped = day.size() == 2 && month.size() == 2 && year.size() == 4 && all_digits(day) &&
                        all_digits(month) && all_digits(year);
    const CivilDate date =
        shaped ? CivilDate{static_cast<std::int32_t>(value_of(year)), static_cast<std::int32_t>(value_of(month)),
                           static_cast<std::int32_t>(value_of(day))}
               : CivilDate{};
    if (!is_date(date)) {
      fail(NmeaProblem::kDate);
      return {};
    }
    return date;
  }

  std::string_view text(std::size_t i) const { return fields_[i]; }
  void fail(NmeaProblem problem) {
    if (problem_ == NmeaProblem::kNone) problem_ = problem;
  }

 private:
  std::array<std::string_view, kMaxFields> fields_;
  std::size_t size_ = 0;
  NmeaProblem problem_ = NmeaProblem::kNone;
};

// Mode since NMEA 2.3, navigation status since 4.1.
NmeaRmc decode_rmc(Fields& f) {
  NmeaRmc m;
  if (!f.expect(11, 13)) return m;
  m.time_of_day_ns = f.time_of_day(1);
  m.valid = f.letter(2, "AV") == 'A';
  m.latitude = f.latitude(3);
  m.longitude = f.longitude(5);
  f.both_or_none(m.latitude, m.longitude);
  m.speed = f.scaled(7, 0, kMaxKnots, kKnot);
  m.course = f.scaled(8, 0, 360, kRadPerDeg);
  m.date = f.short_date(9);
  m.magnetic_variation = f.scaled(10, 0, 180, kRadPerDeg);
  const char direction = f.letter(11, "EW");
  if (direction == 0 && !f.empty(10)) f.fail(NmeaProblem::kLetter);
  if (direction == 'W') m.magnetic_variation = -m.magnetic_variation;
  if (f.size() > 12) m.mode = f.letter(12, kModes);
  if (f.size() > 13) m.navigation_status = f.letter(13, "SCUV");
  return m;
}

NmeaGga decode_gga(Fields& f) {
  NmeaGga m;
  if (!f.expect(14, 14)) return m;
  m.time_of_day_ns = f.time_of_day(1);
  m.latitude = f.latitude(2);
  m.longitude = f.longitude(4);
  f.both_or_none(m.latitude, m.longitude);
  m.quality = f.integer(6, 0, 8);
  m.satellites = f.integer(7, 0, 99);
  m.hdop = f.number(8, 0, kMaxDop);
  m.altitude_msl = f.number(9, kMinAltitude, kMaxAltitude);
  f.unit(10, 'M');
  m.geoid_separation = f.number(11, -kMaxSeparation, kMaxSeparation);
  f.unit(12, 'M');
  m.differential_age_s = f.number(13, 0, 1e6);
  m.station = f.integer(14, 0, 9999);
  return m;
}

NmeaZda decode_zda(Fields& f) {
  NmeaZda m;
  if (!f.expect(6, 6)) return m;
  m.time_of_day_ns = f.time_of_day(1);
  m.date = f.long_date(2);
  m.zone_hours = f.integer(5, -13, 13, 0);
  m.zone_minutes = f.integer(6, -59, 59, 0);
  return m;
}

// The system since NMEA 4.11, one hexadecimal digit.
NmeaGsa decode_gsa(Fields& f) {
  NmeaGsa m;
  if (!f.expect(17, 18)) return m;
  m.selection = f.letter(1, "AM");
  m.fix = f.integer(2, 1, 3);
  for (std::size_t i = 3; i < 15; ++i) {
    const std::int32_t id = f.integer(i, 1, 999, 0);
    if (id > 0) m.satellite_ids[static_cast<std::size_t>(m.satellites++)] = static_cast<std::int16_t>(id);
  }
  m.pdop = f.number(15, 0, kMaxDop);
  m.hdop = f.number(16, 0, kMaxDop);
  m.vdop = f.number(17, 0, kMaxDop);
  if (f.size() > 18) {
    const char digit = f.letter(18, "123456789ABCDEF");
    if (digit != 0) m.system = digit <= '9' ? digit - '0' : digit - 'A' + 10;
  }
  return m;
}

NmeaGst decode_gst(Fields& f) {
  NmeaGst m;
  if (!f.expect(8, 8)) return m;
  m.time_of_day_ns = f.time_of_day(1);
  m.range_rms = f.number(2, 0, kMaxSigma);
  m.sigma_major = f.number(3, 0, kMaxSigma);
  m.sigma_minor = f.number(4, 0, kMaxSigma);
  m.major_axis = f.scaled(5, 0, 360, kRadPerDeg);
  m.sigma_latitude = f.number(6, 0, kMaxSigma);
  m.sigma_longitude = f.number(7, 0, kMaxSigma);
  m.sigma_altitude = f.number(8, 0, kMaxSigma);
  return m;
}

NmeaVtg decode_vtg(Fields& f) {
  NmeaVtg m;
  if (!f.expect(8, 9)) return m;
  m.course = f.scaled(1, 0, 360, kRadPerDeg);
  f.unit(2, 'T');
  m.course_magnetic = f.scaled(3, 0, 360, kRadPerDeg);
  f.unit(4, 'M');
  const double from_knots = f.scaled(5, 0, kMaxKnots, kKnot);
  f.unit(6, 'N');
  const double from_km = f.scaled(7, 0, 2 * kMaxKnots, kKmPerHour);
  f.unit(8, 'K');
  m.speed = std::isnan(from_knots) ? from_km : from_knots;
  if (f.size() > 9) m.mode = f.letter(9, kModes);
  return m;
}

}  // namespace

NmeaDecoded decode_nmea(std::string_view text, NmeaSentence& sentence, NmeaProblem& problem) {
  // Addresses that begin with P are makers' own: Garmin's PGRMC is no RMC.
  if (text.size() < 6 || text[5] != ',' || text[0] == 'P') return NmeaDecoded::kUnknownType;
  for (std::size_t i = 0; i < 2; ++i) {
    if (text[i] < 'A' || text[i] > 'Z') return NmeaDecoded::kUnknownType;
  }
  const std::string_view type = text.substr(2, 3);
  const auto decode = [&](auto decode_type) {
    Fields fields(text);
    sentence.content = decode_type(fields);
    problem = fields.problem();
    return problem == NmeaProblem::kNone ? NmeaDecoded::kValid : NmeaDecoded::kMalformed;
  };
  sentence.talker = {text[0], text[1]};
  if (type == "RMC") return decode(decode_rmc);
  if (type == "GGA") return decode(decode_gga);
  if (type == "ZDA") return decode(decode_zda);
  if (type == "GSA") return decode(decode_gsa);
  if (type == "GST") return decode(decode_gst);
  if (type == "VTG") return decode(decode_vtg);
  return NmeaDecoded::kUnknownType;
}

}  // namespace loc::io
