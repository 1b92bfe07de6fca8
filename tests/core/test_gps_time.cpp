// GPS time against astropy (the table is written by golden_gps_time.py), the system's list of leap seconds, and what
// is known of the week rollovers.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <sstream>

#include "libloc/core/check.hpp"
#include "libloc/core/gps_time.hpp"
#include "libloc/core/random.hpp"

namespace loc {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;
constexpr TimeNs kDay = 86'400 * kSecond;

struct Golden {
  UtcTime utc;
  TimeNs gps_time_ns;
};
const Golden kGolden[] = {
#include "golden_gps_time.inc"
};

TEST(GpsTime, AgreesWithAstropyBothWays) {
  ASSERT_GT(std::size(kGolden), 300U);
  for (const Golden& g : kGolden) {
    ASSERT_TRUE(gps_from_utc(g.utc)) << to_text(g.utc);
    EXPECT_EQ(*gps_from_utc(g.utc), g.gps_time_ns) << to_text(g.utc);
    EXPECT_EQ(to_text(utc_from_gps(g.gps_time_ns)), to_text(g.utc));
  }
}

TEST(GpsTime, EverySecondAroundEveryLeapSecondIsOneSecondApart) {
  const LeapSeconds& table = default_leap_seconds();
  int found = 0;
  for (std::int64_t day = 0; day < gps_day({2030, 1, 1}); ++day) {
    const CivilDate date = date_from_gps_day(day);
    EXPECT_TRUE(is_date(date));
    if (table.seconds_of(date) == 86'400) continue;
    ++found;
    ASSERT_EQ(table.seconds_of(date), 86'401);
    const TimeNs leap = *gps_from_utc({.date = date, .hour = 23, .minute = 59, .second = 60});
    EXPECT_EQ(*gps_from_utc({.date = date, .hour = 23, .minute = 59, .second = 59}), leap - kSecond);
    EXPECT_EQ(*gps_from_utc({.date = plus_days(date, 1)}), leap + kSecond);
    EXPECT_EQ(utc_from_gps(leap).second, 60);
    EXPECT_EQ(utc_from_gps(leap + kSecond).second, 0);
    // Unix time gives the leap second the number of the second after it.
    EXPECT_EQ(unix_from_gps(leap), unix_from_gps(leap + kSecond));
    EXPECT_EQ(unix_from_gps(leap - kSecond), unix_from_gps(leap) - kSecond);
  }
  EXPECT_EQ(found, 18);
}

TEST(GpsTime, RefusesWhatIsNoTime) {
  const CivilDate good{2016, 12, 31};
  EXPECT_TRUE(gps_from_utc({good, 23, 59, 60, 0}));
  const UtcTime wrong[] = {{{2017, 12, 31}, 23, 59, 60, 0},
                           {good, 23, 58, 60, 0},
                           {good, 22, 59, 60, 0},
                           {good, 23, 59, 61, 0},
                           {good, 24, 0, 0, 0},
                           {good, 25, 0, 0, 0},
                           {good, 12, 60, 0, 0},
                           {good, -1, 0, 0, 0},
                           {good, 0, -1, 0, 0},
                           {good, 0, 0, -1, 0},
                           {good, 0, 0, 0, 1000000000},
                           {good, 0, 0, 0, -1},
                           {{2017, 2, 29}, 0, 0, 0, 0},
                           {{2000, 2, 30}, 0, 0, 0, 0},
                           {{2017, 13, 1}, 0, 0, 0, 0},
                           {{2017, 0, 1}, 0, 0, 0, 0},
                           {{2017, 1, 0}, 0, 0, 0, 0},
                           {{2017, 4, 31}, 0, 0, 0, 0},
                           {{2100, 2, 29}, 0, 0, 0, 0},
                           {{1980, 1, 5}, 23, 59, 59, 0},
                           {{1979, 12, 31}, 0, 0, 0, 0},
                           {{2261, 1, 1}, 0, 0, 0, 0},
                           {{0, 0, 0}, 0, 0, 0, 0}};
  for (const UtcTime& utc : wrong) EXPECT_FALSE(gps_from_utc(utc)) << to_text(utc);
  EXPECT_EQ(gps_from_utc({.date = {1980, 1, 6}}), 0);
  EXPECT_THROW(utc_from_gps(-1), std::invalid_argument);
  EXPECT_THROW(utc_from_gps(kNoTime), std::invalid_argument);
  EXPECT_THROW(utc_from_gps(std::numeric_limits<TimeNs>::max()), std::invalid_argument);
  EXPECT_FALSE(gps_from_unix(kNoTime));
  EXPECT_FALSE(gps_from_unix(0));
  EXPECT_FALSE(gps_from_unix(std::numeric_limits<TimeNs>::max()));
  EXPECT_THROW(plus_days({2260, 12, 31}, 1), std::invalid_argument);
  EXPECT_THROW(plus_days({2020, 1, 1}, std::numeric_limits<std::int64_t>::max()), std::invalid_argument);
}

TEST(GpsTime, RandomTimesSurviveTheRoundTrip) {
  Random random(3);
  for (int i = 0; i < 20'000; ++i) {
    const auto gps = static_cast<TimeNs>(random.uniform(0, 280.0 * 365.25 * 86'400e9));
    EXPECT_EQ(gps_from_utc(utc_from_gps(gps)), gps);
    EXPECT_EQ(gps_from_unix(unix_from_gps(gps)), gps);
    EXPECT_EQ(gps_from_week(week_from_gps(gps)), gps);
  }
}

TEST(GpsTime, UnixTimeIsThatOfTheHostClock) {
  EXPECT_EQ(gps_from_unix(315'964'800 * kSecond), 0);
  EXPECT_EQ(gps_from_unix(1'000'000'000 * kSecond), (1'000'000'000 - 315'964'800 + 13) * kSecond);
  EXPECT_EQ(gps_from_unix(1'700'000'000 * kSecond + 1), (1'700'000'000 - 315'964'800 + 18) * kSecond + 1);
}

TEST(LeapSeconds, ATableThatIsTooOldSaysSo) {
  const LeapSeconds& table = default_leap_seconds();
  EXPECT_TRUE(table.known_on({2026, 6, 27}));
  EXPECT_FALSE(table.known_on({2026, 6, 28}));
  EXPECT_EQ(table.gps_minus_utc({2050, 1, 1}), 18);
}

TEST(LeapSeconds, LaterStepsComeFromOutside) {
  const LeapSeconds more = default_leap_seconds().with_offset_from({2028, 1, 1}, 19);
  EXPECT_EQ(more.gps_minus_utc({2027, 12, 31}), 18);
  EXPECT_EQ(more.gps_minus_utc({2028, 1, 1}), 19);
  EXPECT_TRUE(more.known_on({2028, 6, 1}));
  EXPECT_TRUE(gps_from_utc({{2027, 12, 31}, 23, 59, 60, 0}, more));
  EXPECT_FALSE(gps_from_utc({{2027, 12, 31}, 23, 59, 60, 0}));
  // A removed second: 23:59:59 does not exist.
  const LeapSeconds less = default_leap_seconds().with_offset_from({2028, 1, 1}, 17);
  EXPECT_EQ(less.seconds_of({2027, 12, 31}), 86'399);
  EXPECT_FALSE(gps_from_utc({{2027, 12, 31}, 23, 59, 59, 0}, less));
  const TimeNs last = *gps_from_utc({{2027, 12, 31}, 23, 59, 58, 0}, less);
  EXPECT_EQ(to_text(utc_from_gps(last + kSecond, less)), "2028-01-01T00:00:00.000000000Z");
  EXPECT_THROW((void)more.with_offset_from({2028, 1, 1}, 20), std::invalid_argument);
  EXPECT_THROW((void)more.with_offset_from({2029, 1, 2}, 20), std::invalid_argument);
  EXPECT_THROW((void)more.with_offset_from({2029, 1, 1}, 21), std::invalid_argument);
  EXPECT_THROW((void)more.with_offset_from({2029, 13, 1}, 20), std::invalid_argument);

  const LeapSeconds fixed = LeapSeconds::constant(15);
  EXPECT_EQ(gps_from_utc({.date = {2020, 1, 1}}, fixed), *gps_from_utc({.date = {2020, 1, 1}}) - 3 * kSecond);
  EXPECT_EQ(gps_from_utc(utc_from_gps(5, fixed), fixed), 5);
  EXPECT_THROW((void)LeapSeconds::constant(-1), std::invalid_argument);
}

constexpr char kList[] =
    "#$ 3960835200\n#@\t3991593600\n#\n2272060800\t10 # 1 Jan 1972\n2524521600 19 # 1 Jan 1980\n"
    "2571782400 20 # 1 Jul 1981\r\n\n2603318400 21";

TEST(LeapSeconds, ReadsTheListOfTheOperatingSystem) {
  const LeapSeconds small = LeapSeconds::from_list(kList);
  EXPECT_EQ(small.gps_minus_utc({1981, 6, 30}), 0);
  EXPECT_EQ(small.gps_minus_utc({1981, 7, 1}), 1);
  EXPECT_EQ(small.gps_minus_utc({2020, 1, 1}), 2);
  EXPECT_EQ(small.known_until(), (CivilDate{2026, 6, 28}));

  std::ifstream file("/usr/share/zoneinfo/leap-seconds.list");
  if (!file) GTEST_SKIP() << "no leap-seconds.list on this system";
  std::ostringstream text;
  text << file.rdbuf();
  const LeapSeconds system = LeapSeconds::from_list(text.str());
  const LeapSeconds& own = default_leap_seconds();
  for (std::int64_t day = 0; day < gps_day(own.known_until()); ++day) {
    const CivilDate date = date_from_gps_day(day);
    ASSERT_EQ(system.gps_minus_utc(date), own.gps_minus_utc(date)) << to_text(date);
  }
}

TEST(LeapSeconds, ABrokenListIsRefused) {
  const auto changed = [](const char* from, const char* to) {
    std::string text = kList;
    text.replace(text.find(from), std::string(from).size(), to);
    return text;
  };
  for (const std::string& text :
       {std::string(), std::string("<html>"), changed("#@", "# "), changed("19 #", "18 #"), changed("2524521600", "#"),
        changed("2571782400", "2571782401"), changed("2603318400", "2571782400"), changed(" 20 #", " 22 #"),
        changed(" 20 #", " x20 #"), changed(" 20 #", " #"), changed("2603318400 21", "99999999999999999999 21"),
        changed("3991593600", "-5"), changed("2603318400 21", "-86400 21"), changed(" 20 #", "20 #")}) {
    EXPECT_THROW((void)LeapSeconds::from_list(text), DataError) << text;
  }
}

TEST(GpsWeek, RolloversFellWhereGpsSaysTheyDo) {
  EXPECT_EQ(week_from_gps(*gps_from_utc({{1999, 8, 21}, 23, 59, 47, 0})), (GpsWeekTime{1024, 0}));
  EXPECT_EQ(week_from_gps(*gps_from_utc({{2019, 4, 6}, 23, 59, 42, 0})), (GpsWeekTime{2048, 0}));
  EXPECT_EQ(week_from_gps(*gps_from_utc({{2038, 11, 20}, 23, 59, 42, 0})), (GpsWeekTime{3072, 0}));
  EXPECT_EQ(week_from_gps(*gps_from_utc({{2019, 4, 6}, 23, 59, 41, 5})).time_of_week_ns, 604'799 * kSecond + 5);
  EXPECT_THROW(week_from_gps(-1), std::invalid_argument);
  EXPECT_THROW(gps_from_week({-1, 0}), std::invalid_argument);
  EXPECT_THROW(gps_from_week({100'000'000, 0}), std::invalid_argument);
  EXPECT_THROW(gps_from_week({0, 7 * kDay}), std::invalid_argument);
}

TEST(GpsWeek, TheTruncatedWeekIsResolvedByTheReference) {
  for (const std::int32_t reference : {0, 100, 700, 1023, 1024, 1025, 1500, 2047, 2048, 2200, 3071, 3072, 4000}) {
    const TimeNs reference_ns = gps_from_week({reference, 12'345 * kSecond});
    for (std::int32_t week = std::max(0, reference - 511); week <= reference + 511; ++week) {
      EXPECT_EQ(full_week(week % 1024, reference_ns), week) << "reference " << reference;
    }
  }
  EXPECT_EQ(full_week(2356, gps_from_week({2400, 0}), 13), 2356);
  EXPECT_EQ(full_week(1, gps_from_week({8190, 0}), 13), 8193);
  EXPECT_EQ(full_week(1020, gps_from_week({3, 0})), 1020) << "there is no negative week";
  EXPECT_THROW(full_week(1024, 0), std::invalid_argument);
  EXPECT_THROW(full_week(-1, 0), std::invalid_argument);
  EXPECT_THROW(full_week(0, 0, 32), std::invalid_argument);
}

TEST(GpsWeek, DatesOfAgedReceiversAreBroughtBack) {
  // A receiver that fell back by 1024 weeks in April 2019 told August 1999.
  EXPECT_EQ(resolve_rollover({1999, 8, 23}, {2019, 4, 20}), (CivilDate{2019, 4, 8}));
  EXPECT_EQ(resolve_rollover({2007, 4, 10}, {2026, 11, 22}), (CivilDate{2026, 11, 24}));
  EXPECT_EQ(resolve_rollover({1987, 8, 25}, {2026, 11, 22}), (CivilDate{2026, 11, 24})) << "two rollovers";
  EXPECT_EQ(resolve_rollover({2026, 11, 22}, {2026, 1, 1}), (CivilDate{2026, 11, 22}));
  EXPECT_EQ(resolve_rollover({2007, 4, 11}, {2026, 11, 22}), (CivilDate{2007, 4, 11})) << "never three days ahead";
  EXPECT_EQ(resolve_rollover({2014, 5, 26}, {2026, 11, 22}), (CivilDate{2014, 5, 26})) << "not into the future";
  EXPECT_EQ(resolve_rollover({2026, 11, 22}, {2000, 1, 1}), (CivilDate{2026, 11, 22})) << "not into the past";
  EXPECT_EQ(resolve_rollover({2045, 1, 1}, {2026, 1, 1}), (CivilDate{2045, 1, 1}));
  EXPECT_FALSE(library_date() == CivilDate{});
  EXPECT_GE(gps_day(library_date()), gps_day({2026, 11, 22}));
  for (const std::int64_t day : {0, 1, 5000, 100'000}) {
    for (const std::int64_t reference : {0, 3000, 50'000, 102'000}) {
      EXPECT_TRUE(is_date(resolve_rollover(date_from_gps_day(day), date_from_gps_day(reference))));
    }
  }
}

TEST(GpsTime, TwoDigitYears) {
  EXPECT_EQ(full_year(80), 1980);
  EXPECT_EQ(full_year(99), 1999);
  EXPECT_EQ(full_year(0), 2000);
  EXPECT_EQ(full_year(79), 2079);
  EXPECT_EQ(full_year(94, 2026), 1994);
  EXPECT_EQ(full_year(75, 2026), 2075);
  EXPECT_EQ(full_year(76, 2026), 1976);
  EXPECT_EQ(full_year(5, 2099), 2105);
  EXPECT_THROW(full_year(100), std::invalid_argument);
  EXPECT_THROW(full_year(-1), std::invalid_argument);
}

}  // namespace
}  // namespace loc
