// GPS time and UTC. GPS time is an int64 count of nanoseconds since 1980-01-06 00:00:00 UTC and knows no leap seconds;
// UTC is a date and a time of day, whose last minute of June or December may have a second 60. NMEA and gpsd tell UTC.
// The table of leap seconds is the one of IERS Bulletin C; a later step can only be known from outside: from_list()
// reads the file that operating systems update, with_offset_from() takes what a user or a receiver knows.
// Nothing here looks at a clock: what is ambiguous (10-bit weeks, two-digit years) is resolved by a reference.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "libloc/core/time.hpp"

namespace loc {

/// A day of the Gregorian calendar.
struct CivilDate {
  std::int32_t year = 0;
  std::int32_t month = 0;  ///< 1 to 12
  std::int32_t day = 0;    ///< 1 to 31

  friend bool operator==(const CivilDate&, const CivilDate&) = default;
};

/// UTC. second is 60 in a leap second.
struct UtcTime {
  CivilDate date;
  std::int32_t hour = 0;
  std::int32_t minute = 0;
  std::int32_t second = 0;
  std::int32_t nanosecond = 0;

  friend bool operator==(const UtcTime&, const UtcTime&) = default;
};

/// True for a day that exists, of the years 1980 to 2260 (what int64 nanoseconds hold).
bool is_date(const CivilDate& date);

/// Days since 1980-01-06, which is 0; negative before it. @param date must exist.
std::int64_t gps_day(const CivilDate& date);
CivilDate date_from_gps_day(std::int64_t day);
/// date + days. @throws std::invalid_argument when that leaves the years above.
CivilDate plus_days(const CivilDate& date, std::int64_t days);
/// "2024-02-29"
std::string to_text(const CivilDate& date);
/// "2016-12-31T23:59:60.500000000Z"
std::string to_text(const UtcTime& time);

/// GPS time minus UTC in whole seconds, by date.
class LeapSeconds {
 public:
  /// The table that was valid when this was written; it holds until known_until().
  LeapSeconds();
  /// Text of leap-seconds.list (Debian: /usr/share/zoneinfo/leap-seconds.list, package tzdata).
  /// @throws DataError naming the line.
  static LeapSeconds from_list(std::string_view text);
  /// The same difference for all times, whatever the date. @throws std::invalid_argument outside 0 to 255.
  static LeapSeconds constant(int gps_minus_utc);

  /// This table with one more step: gps_minus_utc holds from the beginning of that day on. Known until a year later.
  /// @throws std::invalid_argument when the day is not the first of a month after all steps so far, or the difference
  /// is not one off the last.
  LeapSeconds with_offset_from(const CivilDate& first_day, int gps_minus_utc) const;

  /// [s] on that day; before 1980-01-06 what held then.
  int gps_minus_utc(const CivilDate& date) const;
  /// 86401 with a leap second, 86399 with a removed one (there has been none), otherwise 86400.
  int seconds_of(const CivilDate& date) const;
  /// First day of which the table does not know: from here on it takes the last difference.
  const CivilDate& known_until() const { return known_until_; }
  bool known_on(const CivilDate& date) const;

 private:
  struct Step {
    std::int64_t first_day = 0;  // gps_day
    int gps_minus_utc = 0;
  };
  static constexpr std::size_t kMaxSteps = 64;

  explicit LeapSeconds(const CivilDate& known_until) : known_until_(known_until) {}
  void add(const Step& step);
  int on_day(std::int64_t day) const;

  std::array<Step, kMaxSteps> steps_{};
  std::size_t size_ = 0;
  CivilDate known_until_;
};

/// The table that comes with the library.
const LeapSeconds& default_leap_seconds();

/// @return nullopt when there is no such date or time of day (a second 60 without leap second, hour 24), or when it is
/// before GPS time.
std::optional<TimeNs> gps_from_utc(const UtcTime& utc, const LeapSeconds& leap_seconds = default_leap_seconds());
/// @throws std::invalid_argument for a negative time or one after 2260.
UtcTime utc_from_gps(TimeNs gps_time_ns, const LeapSeconds& leap_seconds = default_leap_seconds());

/// Unix time (CLOCK_REALTIME: nanoseconds since 1970-01-01 00:00 UTC without leap seconds) to GPS time and back. A leap
/// second has no Unix time of its own: it is given that of the second after it, as POSIX has it.
/// @return nullopt before 1980-01-06 and after 2260.
std::optional<TimeNs> gps_from_unix(TimeNs unix_time_ns, const LeapSeconds& leap_seconds = default_leap_seconds());
TimeNs unix_from_gps(TimeNs gps_time_ns, const LeapSeconds& leap_seconds = default_leap_seconds());

/// Week number and time of week, as GPS itself counts.
struct GpsWeekTime {
  std::int32_t week = 0;       ///< since 1980-01-06, not truncated
  TimeNs time_of_week_ns = 0;  ///< 0 to 604 800 s

  friend bool operator==(const GpsWeekTime&, const GpsWeekTime&) = default;
};
/// @throws std::invalid_argument for a negative time.
GpsWeekTime week_from_gps(TimeNs gps_time_ns);
/// @throws std::invalid_argument for a negative week, one after 2260, a time of week outside 0 … 604 800 s.
TimeNs gps_from_week(const GpsWeekTime& week_time);

/// The week that is congruent to truncated_week and nearest to the one of the reference. @param bits of the truncated
/// week: 10 (GPS L1: rolled over in 1999, 2019, next 2038) or 13. @throws std::invalid_argument when it has more bits.
std::int32_t full_week(std::int32_t truncated_week, TimeNs reference_gps_ns, int bits = 10);

/// Day of the last check of the table of leap seconds: nothing that happens now is before it, whatever the host's clock
/// says.
CivilDate library_date();

/// Receivers whose firmware has outlived its 1024 weeks tell a date that is 7168 days (or a multiple) too early.
/// @param reference a day at or after that of the data, by less than 19 years
/// @return the latest date that is a multiple of 7168 days (or none) after the one told and at most two days after the
/// reference; a date that is later than that already stays as it is. Never an earlier one.
CivilDate resolve_rollover(const CivilDate& date, const CivilDate& reference);

/// The year that ends in two_digits, from reference - 50 to reference + 49. Without reference the years of GPS so far:
/// 1980 to 2079. @throws std::invalid_argument unless two_digits is 0 to 99.
std::int32_t full_year(std::int32_t two_digits, std::int32_t reference_year = 2030);

}  // namespace loc
