#include "libloc/core/gps_time.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdio>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;
constexpr std::int64_t kSecondsPerDay = 86'400;
constexpr TimeNs kWeek = 7 * kSecondsPerDay * kSecond;
constexpr std::int32_t kFirstYear = 1980;
constexpr std::int32_t kLastYear = 2260;
constexpr std::int64_t kRolloverDays = 1024LL * 7;
constexpr std::int64_t kUnixDayOfGps = 3657;  // 1980-01-06
constexpr int kTaiMinusGps = 19;
constexpr std::int64_t kNtpDayOfGps = 29'224;  // days from 1900-01-01

constexpr std::chrono::sys_days kEpoch{std::chrono::year{1980} / 1 / 6};
static_assert(kEpoch.time_since_epoch().count() == kUnixDayOfGps);

// IERS Bulletin C: first day and GPS - UTC. The first entry stands for all days before.
constexpr struct {
  CivilDate first_day;
  int gps_minus_utc;
} kSteps[] = {
    {{1980, 1, 6}, 0},  {{1981, 7, 1}, 1},  {{1982, 7, 1}, 2},  {{1983, 7, 1}, 3},  {{1985, 7, 1}, 4},
    {{1988, 1, 1}, 5},  {{1990, 1, 1}, 6},  {{1991, 1, 1}, 7},  {{1992, 7, 1}, 8},  {{1993, 7, 1}, 9},
    {{1994, 7, 1}, 10}, {{1996, 1, 1}, 11}, {{1997, 7, 1}, 12}, {{1999, 1, 1}, 13}, {{2006, 1, 1}, 14},
    {{2009, 1, 1}, 15}, {{2012, 7, 1}, 16}, {{2015, 7, 1}, 17}, {{2017, 1, 1}, 18},
};
// Expiry of the leap-seconds.list that the table was compared with (tzdata 2025b).
constexpr CivilDate kKnownUntil{2026, 6, 28};
constexpr CivilDate kTableChecked{2026, 11, 22};
constexpr std::int64_t kReferenceDays = 2;  // Clocks of hosts are a day off when their time zone is wrong.

std::chrono::year_month_day ymd(const CivilDate& date) {
  return std::chrono::year{date.year} / std::chrono::month{static_cast<unsigned>(date.month)} /
         std::chrono::day{static_cast<unsigned>(date.day)};
}

void require_gps_time(TimeNs gps_time_ns) {
  require(gps_time_ns >= 0 && gps_time_ns / (kSecondsPerDay * kSecond) <= gps_day({kLastYear, 12, 31}),
          "GPS time " + format_seconds(gps_time_ns) + " s: must be in the years 1980 to 2260");
}

}  // namespace

bool is_date(const CivilDate& date) {
  return date.year >= kFirstYear && date.year <= kLastYear && date.month >= 1 && date.month <= 12 && date.day >= 1 &&
         date.day <= 31 && ymd(date).ok();
}

std::int64_t gps_day(const CivilDate& date) {
  return (std::chrono::sys_days{ymd(date)} - kEpoch).count();
}

CivilDate date_from_gps_day(std::int64_t day) {
  const std::chrono::year_month_day date{kEpoch + std::chrono::days{day}};
  return {static_cast<int>(date.year()), static_cast<std::int32_t>(static_cast<unsigned>(date.month())),
          static_cast<std::int32_t>(static_cast<unsigned>(date.day()))};
}

CivilDate plus_days(const CivilDate& date, std::int64_t days) {
  constexpr std::int64_t kMost = 400LL * 366;
  const bool possible = days > -kMost && days < kMost;
  const CivilDate out = possible ? date_from_gps_day(gps_day(date) + days) : CivilDate{};
  require(possible && is_date(out),
          to_text(date) + " + " + std::to_string(days) + " days: not in the years 1980 to 2260");
  return out;
}

std::string to_text(const CivilDate& date) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%04d-%02d-%02d", date.year, date.month, date.day);
  return text.data();
}

std::string to_text(const UtcTime& time) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "T%02d:%02d:%02d.%09dZ", time.hour, time.minute, time.second,
                time.nanosecond);
  return to_text(time.date) + text.data();
}

LeapSeconds::LeapSeconds() : known_until_(kKnownUntil) {
  for (const auto& step : kSteps) add({gps_day(step.first_day), step.gps_minus_utc});
}

LeapSeconds LeapSeconds::constant(int gps_minus_utc) {
  require(gps_minus_utc >= 0 && gps_minus_utc <= 255, "GPS - UTC", gps_minus_utc, "must be 0 to 255 s");
  LeapSeconds out(CivilDate{kLastYear, 12, 31});
  out.add({0, gps_minus_utc});
  return out;
}

LeapSeconds LeapSeconds::with_offset_from(const CivilDate& first_day, int gps_minus_utc) const {
  require(is_date(first_day) && first_day.day == 1,
          to_text(first_day) + ": leap seconds begin on the first of a month");
  const Step last = steps_[size_ - 1];
  require(gps_day(first_day) > last.first_day,
          to_text(first_day) + ": the table knows a step on " + to_text(date_from_gps_day(last.first_day)));
  require(gps_minus_utc == last.gps_minus_utc + 1 || gps_minus_utc == last.gps_minus_utc - 1, "GPS - UTC",
          gps_minus_utc, "must be one off the last, " + std::to_string(last.gps_minus_utc));
  require(size_ < kMaxSteps, "too many steps of leap seconds");
  LeapSeconds out = *this;
  out.add({gps_day(first_day), gps_minus_utc});
  const std::int64_t known = std::max(gps_day(known_until_), gps_day(first_day) + 365);
  out.known_until_ = date_from_gps_day(std::min(known, gps_day({kLastYear, 12, 31})));
  return out;
}

void LeapSeconds::add(const Step& step) {
  steps_[size_++] = step;
}

LeapSeconds LeapSeconds::from_list(std::string_view text) {
  std::int64_t line_number = 0;
  const auto fail = [&](const std::string& what) {
    throw DataError("leap-seconds.list, line " + std::to_string(line_number) + ": " + what);
  };
  // An integer at the front of text, which it is taken off from; days from 1900 for the first, seconds for the second.
  const auto take_integer = [&](std::string_view& rest) {
    rest.remove_prefix(std::min(rest.find_first_not_of(" \t"), rest.size()));
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
    if (error != std::errc{}) fail("a number is missing");
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    if (!rest.empty() && rest.front() != ' ' && rest.front() != '\t' && rest.front() != '\r') fail("not a number");
    return value;
  };
  const auto gps_day_of_ntp = [&](std::int64_t seconds) {
    const std::int64_t day = seconds / kSecondsPerDay - kNtpDayOfGps;
    if (seconds < 0 || seconds % kSecondsPerDay != 0 || day > gps_day({kLastYear, 12, 31})) {
      fail(std::to_string(seconds) + " is not the beginning of a day");
    }
    return day;
  };

  LeapSeconds out(CivilDate{});
  bool expiry_seen = false;
  std::optional<Step> before_gps;  // the last step before 1980
  while (!text.empty()) {
    ++line_number;
    const auto end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.starts_with("#@")) {
      line.remove_prefix(2);
      out.known_until_ = date_from_gps_day(gps_day_of_ntp(take_integer(line)));
      if (!is_date(out.known_until_)) fail("the table expires before 1980");
      expiry_seen = true;
      continue;
    }
    if (line.starts_with('#') || line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    const std::int64_t first_day = gps_day_of_ntp(take_integer(line));
    const std::int64_t tai_minus_utc = take_integer(line);
    if (tai_minus_utc < 0 || tai_minus_utc > 255) fail("TAI - UTC = " + std::to_string(tai_minus_utc));
    const Step step{first_day, static_cast<int>(tai_minus_utc) - kTaiMinusGps};
    if (first_day <= 0) {
      before_gps = step;
      continue;
    }
    if (out.size_ == 0) {
      if (!before_gps || before_gps->gps_minus_utc != 0) fail("TAI - UTC of 1980 is missing or not 19 s");
      out.add({0, 0});
    }
    const Step& last = out.steps_[out.size_ - 1];
    if (first_day <= last.first_day) fail("the days do not increase");
    if (std::abs(step.gps_minus_utc - last.gps_minus_utc) != 1) fail("the step is not one second");
    if (out.size_ == kMaxSteps) fail("more than " + std::to_string(kMaxSteps) + " steps");
    out.add(step);
  }
  if (out.size_ == 0) fail("there is no step after 1980");
  if (!expiry_seen) fail("the date of expiry (#@) is missing");
  return out;
}

int LeapSeconds::on_day(std::int64_t day) const {
  // Searched from the end: most times are recent.
  for (std::size_t i = size_; i-- > 0;) {
    if (day >= steps_[i].first_day) return steps_[i].gps_minus_utc;
  }
  return steps_[0].gps_minus_utc;
}

int LeapSeconds::gps_minus_utc(const CivilDate& date) const {
  return on_day(gps_day(date));
}

int LeapSeconds::seconds_of(const CivilDate& date) const {
  const std::int64_t day = gps_day(date);
  return static_cast<int>(kSecondsPerDay) + on_day(day + 1) - on_day(day);
}

bool LeapSeconds::known_on(const CivilDate& date) const {
  return gps_day(date) < gps_day(known_until_);
}

const LeapSeconds& default_leap_seconds() {
  static const LeapSeconds table;
  return table;
}

std::optional<TimeNs> gps_from_utc(const UtcTime& utc, const LeapSeconds& leap_seconds) {
  if (!is_date(utc.date) || utc.hour < 0 || utc.hour > 23 || utc.minute < 0 || utc.minute > 59 || utc.second < 0 ||
      utc.second > 60 || utc.nanosecond < 0 || utc.nanosecond >= kSecond) {
    return std::nullopt;
  }
  const std::int64_t second_of_day = utc.hour * 3600LL + utc.minute * 60LL + utc.second;
  if (utc.second == 60 && (utc.hour != 23 || utc.minute != 59)) return std::nullopt;
  if (second_of_day >= leap_seconds.seconds_of(utc.date)) return std::nullopt;
  const std::int64_t seconds =
      gps_day(utc.date) * kSecondsPerDay + second_of_day + leap_seconds.gps_minus_utc(utc.date);
  if (seconds < 0) return std::nullopt;
  return seconds * kSecond + utc.nanosecond;
}

UtcTime utc_from_gps(TimeNs gps_time_ns, const LeapSeconds& leap_seconds) {
  require_gps_time(gps_time_ns);
  const std::int64_t seconds = gps_time_ns / kSecond;
  // The day as if there were no leap seconds is at most one too late.
  CivilDate date = date_from_gps_day(seconds / kSecondsPerDay);
  const auto begin_of = [&](const CivilDate& d) { return gps_day(d) * kSecondsPerDay + leap_seconds.gps_minus_utc(d); };
  if (seconds < begin_of(date)) date = date_from_gps_day(gps_day(date) - 1);
  const std::int64_t second_of_day = seconds - begin_of(date);
  UtcTime utc{.date = date, .nanosecond = static_cast<std::int32_t>(gps_time_ns % kSecond)};
  // 86400 is 23:59:60.
  const std::int64_t minute_of_day = std::min<std::int64_t>(second_of_day / 60, 1439);
  utc.hour = static_cast<std::int32_t>(minute_of_day / 60);
  utc.minute = static_cast<std::int32_t>(minute_of_day % 60);
  utc.second = static_cast<std::int32_t>(second_of_day - minute_of_day * 60);
  return utc;
}

std::optional<TimeNs> gps_from_unix(TimeNs unix_time_ns, const LeapSeconds& leap_seconds) {
  constexpr TimeNs kEpoch = kUnixDayOfGps * kSecondsPerDay * kSecond;
  if (unix_time_ns < kEpoch) return std::nullopt;  // before the difference, which may overflow
  const TimeNs since_epoch = unix_time_ns - kEpoch;
  const std::int64_t day = since_epoch / (kSecondsPerDay * kSecond);
  if (day > gps_day({kLastYear, 12, 31})) return std::nullopt;
  return since_epoch + leap_seconds.gps_minus_utc(date_from_gps_day(day)) * kSecond;
}

TimeNs unix_from_gps(TimeNs gps_time_ns, const LeapSeconds& leap_seconds) {
  const UtcTime utc = utc_from_gps(gps_time_ns, leap_seconds);
  const std::int64_t second_of_day = utc.hour * 3600LL + utc.minute * 60LL + utc.second;
  return ((gps_day(utc.date) + kUnixDayOfGps) * kSecondsPerDay + second_of_day) * kSecond + utc.nanosecond;
}

GpsWeekTime week_from_gps(TimeNs gps_time_ns) {
  require_gps_time(gps_time_ns);
  return {static_cast<std::int32_t>(gps_time_ns / kWeek), gps_time_ns % kWeek};
}

TimeNs gps_from_week(const GpsWeekTime& week_time) {
  require(week_time.week >= 0 && week_time.week <= gps_day({kLastYear, 12, 31}) / 7, "GPS week", week_time.week,
          "must be in the years 1980 to 2260");
  require(week_time.time_of_week_ns >= 0 && week_time.time_of_week_ns < kWeek, "time of week",
          to_seconds(week_time.time_of_week_ns), "must be 0 to 604800 s");
  return week_time.week * kWeek + week_time.time_of_week_ns;
}

std::int32_t full_week(std::int32_t truncated_week, TimeNs reference_gps_ns, int bits) {
  require(bits >= 8 && bits <= 16, "bits of a week number", bits, "must be 8 to 16");
  const std::int32_t period = 1 << bits;
  require(truncated_week >= 0 && truncated_week < period, "truncated week", truncated_week,
          "must be 0 to " + std::to_string(period - 1));
  const std::int32_t reference = week_from_gps(reference_gps_ns).week;
  std::int32_t week = reference - reference % period + truncated_week;
  if (week - reference > period / 2) week -= period;
  if (reference - week >= period / 2) week += period;
  return week < 0 ? week + period : week;
}

CivilDate library_date() {
  return kTableChecked;
}

CivilDate resolve_rollover(const CivilDate& date, const CivilDate& reference) {
  const std::int64_t ahead = gps_day(reference) + kReferenceDays - gps_day(date);
  if (ahead < kRolloverDays) return date;
  const CivilDate out = date_from_gps_day(gps_day(date) + ahead / kRolloverDays * kRolloverDays);
  return is_date(out) ? out : date;
}

std::int32_t full_year(std::int32_t two_digits, std::int32_t reference_year) {
  require(two_digits >= 0 && two_digits <= 99, "two-digit year", two_digits, "must be 0 to 99");
  const std::int32_t first = reference_year - 50;
  const std::int32_t from_first = ((two_digits - first) % 100 + 100) % 100;
  return first + from_first;
}

}  // namespace loc
