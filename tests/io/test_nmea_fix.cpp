// From sentences to fixes: what is believed, when, and where an epoch ends. Then whole logs.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>

#include "libloc/core/check.hpp"
#include "libloc/io/nmea_fix.hpp"
#include "libloc/io/nmea_source.hpp"
#include "support/data.hpp"
#include "support/nmea_text.hpp"
#include "support/temp_folder.hpp"

namespace loc::test {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr TimeNs kSecond = 1'000'000'000;

std::int64_t count_of(const NamedCounts& counts, const std::string& name) {
  for (const NamedCount& c : counts) {
    if (c.name == name) return c.value;
  }
  return 0;
}

// Sentences in, fixes and labels out.
class Assembly {
 public:
  explicit Assembly(const NmeaFixOptions& options = {})
      : assembler_(options, [this](const GpsTimeEvent& e) { labels.push_back(e); }) {}

  Assembly& add(const std::string& body, TimeNs host_time_ns = kNoTime) {
    const std::string text = sentence(body);
    std::span<const std::uint8_t> bytes = bytes_of(text);
    const NmeaSentence* s = reader_.next(bytes, host_time_ns);
    EXPECT_NE(s, nullptr) << body;
    if (s != nullptr) keep(assembler_.process(*s));
    return *this;
  }
  Assembly& finish() {
    keep(assembler_.finish());
    return *this;
  }
  /// The only fix so far.
  const GpsMeasurement& only() {
    finish();
    EXPECT_EQ(fixes.size(), 1U);
    return fixes.at(0);
  }
  std::int64_t count(const std::string& name) const {
    NamedCounts counts;
    assembler_.add_to(counts);
    return count_of(counts, name);
  }
  std::vector<GpsMeasurement> fixes;
  std::vector<GpsTimeEvent> labels;

 private:
  void keep(const std::optional<GpsMeasurement>& fix) {
    if (fix) fixes.push_back(*fix);
  }
  NmeaReader reader_;
  NmeaFixAssembler assembler_;
};

const std::string kPosition = "4552.65403,S,17030.00668,E";
std::string rmc(const std::string& time, const std::string& date, const std::string& rest = "A,V",
                const std::string& status = "A", const std::string& motion = "10.0,30.0") {
  return "GNRMC," + time + "," + status + "," + kPosition + "," + motion + "," + date + ",,," + rest;
}
std::string gga(const std::string& time, int quality = 1, const std::string& height = "14.2,M,1.8,M",
                const std::string& satellites = "12") {
  return "GNGGA," + time + "," + kPosition + "," + std::to_string(quality) + "," + satellites + ",0.64," + height +
         ",,";
}
std::string gsa(int fix, const std::string& dops = "1.05,0.64,0.83", const std::string& system = "1") {
  return "GNGSA,A," + std::to_string(fix) + ",,,,,,,,,,,,," + dops + "," + system;
}
bool is_no_fix(const GpsMeasurement& m) {
  return m.fix == GpsFixType::kNone && std::isnan(m.latitude) && std::isnan(m.longitude) && std::isnan(m.altitude) &&
         m.velocity_enu.array().isNaN().all() && m.position_cov.array().isNaN().all() && m.gps_time_ns == kNoTime;
}

TEST(NmeaFix, OneEpochOfManySentencesIsOneFix) {
  Assembly a;
  a.add(rmc("003956.00", "120419")).add("GNVTG,99.0,T,,M,99.0,N,,K,A").add(gga("003956.00"));
  a.add(gsa(3)).add(gsa(3, "1.05,0.64,0.83", "2")).add("GNGST,003956.00,23,,,,2.3,3.5,4.0");
  a.add("GNZDA,003956.00,12,04,2019,00,00");
  const GpsMeasurement& m = a.only();
  EXPECT_EQ(m.fix, GpsFixType::k3d);
  EXPECT_EQ(m.satellites, 12);
  EXPECT_NEAR(m.latitude, -(45 + 52.65403 / 60) * kDeg, 1e-15);
  EXPECT_NEAR(m.longitude, (170 + 30.00668 / 60) * kDeg, 1e-15);
  EXPECT_DOUBLE_EQ(m.altitude, 16.0);
  EXPECT_EQ(m.gps_time_ns, *gps_from_utc({{2019, 4, 12}, 0, 39, 56, 0}));
  Eigen::Matrix3d expected = Eigen::Vector3d(3.5 * 3.5, 2.3 * 2.3, 16).asDiagonal();
  EXPECT_TRUE(m.position_cov.isApprox(expected)) << m.position_cov;
  const double speed = 18520 / 3600.0;
  EXPECT_NEAR(m.velocity_enu.x(), speed * 0.5, 1e-12) << "RMC's course, 30 deg east of north, not VTG's";
  EXPECT_NEAR(m.velocity_enu.y(), speed * std::cos(30 * kDeg), 1e-12);
  EXPECT_TRUE(std::isnan(m.velocity_enu.z()));
  EXPECT_TRUE(m.velocity_cov.array().isNaN().all());
  EXPECT_EQ(a.count("gps.epochs"), 1);
}

TEST(NmeaFix, NothingOfAnInvalidEpochIsUsed) {
  const std::string t = "142818.899";
  EXPECT_TRUE(is_no_fix(Assembly().add(rmc(t, "180708", "A", "V")).only()));
  EXPECT_TRUE(is_no_fix(Assembly().add(rmc(t, "180708", "N")).only()));
  EXPECT_TRUE(is_no_fix(Assembly().add(gga(t, 0)).only()));
  EXPECT_TRUE(is_no_fix(Assembly().add("GPGGA," + t + "," + kPosition + ",,04,,14,M,,M,,").only())) << "no quality";
  EXPECT_TRUE(is_no_fix(Assembly().add("GPGGA," + t + ",,,,,1,04,,14,M,,M,,").only())) << "no position";
  EXPECT_TRUE(is_no_fix(Assembly().add("GPRMC,,V,,,,,,,,,,N").only()));
  // One that says no is enough, whatever the others say.
  for (const auto& bodies : {std::vector{rmc(t, "180708", "A", "V"), gga(t)},
                             {rmc(t, "180708"), gga(t, 0)},
                             {rmc(t, "180708"), gga(t), gsa(1)},
                             {gga(t), rmc(t, "180708", "N")}}) {
    Assembly a;
    for (const std::string& body : bodies) a.add(body);
    EXPECT_TRUE(is_no_fix(a.only()));
    EXPECT_EQ(a.count("gps.contradictory"), 1);
    EXPECT_EQ(a.count("gps.no_fix"), 1);
  }
  Assembly far;
  far.add(gga(t)).add("GPRMC," + t + ",A,4552.67,S,17030.00668,E,,,180708,,,A");
  EXPECT_TRUE(is_no_fix(far.only())) << "RMC and GGA 30 m apart";
  EXPECT_EQ(far.count("gps.contradictory"), 1);
}

TEST(NmeaFix, PositionsThatNoSatelliteMeasuredAreNotTakenUnlessAsked) {
  for (const auto& bodies : {std::vector{rmc("120000", "180708", "E")},
                             {rmc("120000", "180708", "S")},
                             {gga("120000", 6)},
                             {gga("120000", 7)},
                             {gga("120000", 8)}}) {
    Assembly a;
    a.add(bodies[0]);
    EXPECT_TRUE(is_no_fix(a.only())) << bodies[0];
    EXPECT_EQ(a.count("gps.not_measured"), 1);
    Assembly asked({.accept_not_measured = true});
    EXPECT_NE(asked.add(bodies[0]).only().fix, GpsFixType::kNone);
  }
}

TEST(NmeaFix, TypesOfFix) {
  const auto type = [](const std::vector<std::string>& bodies) {
    Assembly a;
    for (const std::string& body : bodies) a.add(body);
    return a.only().fix;
  };
  const std::string t = "120000";
  EXPECT_EQ(type({rmc(t, "180708")}), GpsFixType::k2d) << "RMC alone tells no height";
  EXPECT_EQ(type({rmc(t, "180708"), gsa(3)}), GpsFixType::k3d);
  EXPECT_EQ(type({rmc(t, "180708", "D")}), GpsFixType::kDifferential);
  EXPECT_EQ(type({rmc(t, "180708", "F")}), GpsFixType::kFloat);
  EXPECT_EQ(type({rmc(t, "180708", "R")}), GpsFixType::kFixed);
  EXPECT_EQ(type({gga(t)}), GpsFixType::k3d);
  EXPECT_EQ(type({gga(t, 1, "14.2,M,1.8,M", "3")}), GpsFixType::k2d);
  EXPECT_EQ(type({gga(t, 1, ",M,1.8,M")}), GpsFixType::k2d);
  EXPECT_EQ(type({gga(t, 2)}), GpsFixType::kDifferential);
  EXPECT_EQ(type({gga(t, 3)}), GpsFixType::k3d);
  EXPECT_EQ(type({gga(t, 4)}), GpsFixType::kFixed);
  EXPECT_EQ(type({gga(t, 5)}), GpsFixType::kFloat);
  EXPECT_EQ(type({gga(t, 2), gsa(2)}), GpsFixType::k2d);
  EXPECT_EQ(type({gga(t), gsa(2), gsa(3), gsa(2)}), GpsFixType::k3d) << "the best constellation";
}

TEST(NmeaFix, AltitudeNeedsTheSeparationOfTheGeoid) {
  const std::string bare = gga("120000", 1, "14.2,M,,M");
  EXPECT_TRUE(std::isnan(Assembly().add(bare).only().altitude));
  EXPECT_DOUBLE_EQ(Assembly({.geoid_separation = 40.0}).add(bare).only().altitude, 54.2);
  EXPECT_DOUBLE_EQ(Assembly({.geoid_separation = 40.0}).add(gga("120000")).only().altitude, 16.0) << "the receiver's";
  EXPECT_TRUE(std::isnan(Assembly().add(gga("120000")).add(gsa(2)).only().altitude)) << "2-D: an assumption";
}

TEST(NmeaFix, CovarianceIsNeverInvented) {
  EXPECT_TRUE(Assembly().add(gga("120000")).add(gsa(3)).only().position_cov.array().isNaN().all());
  const auto with_gst = [](const std::string& fields, const NmeaFixOptions& options = {}) {
    return Assembly(options).add(gga("120000")).add(gsa(3)).add("GNGST,120000,," + fields).only().position_cov;
  };
  // An ellipse of 4 m x 2 m, the major axis 30 deg east of north; turned by hand.
  const Eigen::Matrix3d ellipse = with_gst("4.0,2.0,30.0,,,5.0");
  EXPECT_NEAR(ellipse(0, 0), 16 * 0.25 + 4 * 0.75, 1e-12);
  EXPECT_NEAR(ellipse(1, 1), 16 * 0.75 + 4 * 0.25, 1e-12);
  EXPECT_NEAR(ellipse(0, 1), 12 * 0.5 * std::cos(30 * kDeg), 1e-12) << "north-east grows with north-east";
  EXPECT_EQ(ellipse(1, 0), ellipse(0, 1));
  EXPECT_DOUBLE_EQ(ellipse(2, 2), 25);
  EXPECT_EQ(ellipse(0, 2), 0);
  const Eigen::Matrix3d horizontal = with_gst(",,,2.0,3.0,");
  EXPECT_DOUBLE_EQ(horizontal(0, 0), 9);
  EXPECT_DOUBLE_EQ(horizontal(1, 1), 4);
  EXPECT_TRUE(std::isnan(horizontal(2, 2)));
  EXPECT_TRUE(with_gst("0.0,0.0,0.0,0.0,0.0,0.0").array().isNaN().all()) << "0 is not a deviation";

  const NmeaFixOptions by_dop = {.sigma_per_dop = 5};
  const Eigen::Matrix3d dop = Assembly(by_dop).add(gga("120000")).add(gsa(3)).only().position_cov;
  EXPECT_NEAR(dop(0, 0) + dop(1, 1), 25 * 0.64 * 0.64, 1e-12);
  EXPECT_NEAR(dop(2, 2), 25 * 0.83 * 0.83, 1e-12);
  EXPECT_DOUBLE_EQ(with_gst(",,,2.0,3.0,4.0", by_dop)(0, 0), 9) << "GST goes first";
  EXPECT_TRUE(Assembly(by_dop)
                  .add("GNGGA,120000," + kPosition + ",1,12,99.99,1.0,M,1.8,M,,")
                  .add(gsa(3, "99.99,99.99,99.99"))
                  .only()
                  .position_cov.array()
                  .isNaN()
                  .all());
}

TEST(NmeaFix, VelocityOnlyWhereSpeedAndCourseAreKnown) {
  const auto velocity = [](const std::string& motion, const std::string& vtg = "") {
    Assembly a;
    a.add(rmc("120000", "180708", "A", "A", motion));
    if (!vtg.empty()) a.add(vtg);
    return a.only().velocity_enu;
  };
  EXPECT_TRUE(std::isnan(velocity("0.025,").x())) << "a speed without direction";
  EXPECT_EQ(velocity("0.0,").head<2>(), Eigen::Vector2d(0, 0));
  EXPECT_NEAR(velocity("10.0,180.0").y(), -18520 / 3600.0, 1e-12);
  EXPECT_NEAR(velocity("10.0,270.0").x(), -18520 / 3600.0, 1e-12);
  EXPECT_NEAR(velocity(",", "GNVTG,90.0,T,,M,,N,36.0,K,A").x(), 10, 1e-12);
  EXPECT_TRUE(std::isnan(velocity(",", "GNVTG,90.0,T,,M,,N,36.0,K,N").x()));
  EXPECT_TRUE(std::isnan(velocity(",", "GNVTG,90.0,T,,M,,N,36.0,K,E").x()));
}

TEST(NmeaFix, VtgInFrontOfItsEpochStaysWithIt) {
  Assembly a;
  for (int i = 0; i < 5; ++i) {
    const std::string n = std::to_string(i);
    a.add("GNVTG,90.0,T,,M,,N,3" + n + ".0,K,A").add(gga("12000" + n)).add("GNZDA,12000" + n + ",12,04,2019,00,00");
  }
  a.finish();
  ASSERT_EQ(a.fixes.size(), 5U);
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(a.fixes[static_cast<std::size_t>(i)].velocity_enu.x(), (30 + i) / 3.6, 1e-12);
}

TEST(NmeaFix, EpochsOverMidnightAndTheYearsEnd) {
  Assembly a;
  a.add(gga("235959.90")).add(rmc("235959.90", "311219"));
  a.add(gga("000000.00")).add(rmc("000000.00", "010120"));
  a.add(gga("000000.10"));  // no date of its own
  a.finish();
  ASSERT_EQ(a.fixes.size(), 3U);
  const TimeNs midnight = *gps_from_utc({.date = {2020, 1, 1}});
  EXPECT_EQ(a.fixes[0].gps_time_ns, midnight - kSecond / 10);
  EXPECT_EQ(a.fixes[1].gps_time_ns, midnight);
  EXPECT_EQ(a.fixes[2].gps_time_ns, midnight + kSecond / 10);

  Assembly carried;
  carried.add(rmc("235958.00", "280224")).add(gga("235959.00")).add(gga("000000.00")).add(gga("235959.50")).finish();
  ASSERT_EQ(carried.fixes.size(), 4U);
  EXPECT_EQ(carried.fixes[2].gps_time_ns, *gps_from_utc({.date = {2024, 2, 29}}));
  EXPECT_EQ(carried.fixes[3].gps_time_ns, *gps_from_utc({{2024, 2, 28}, 23, 59, 59, 500'000'000})) << "back again";
}

TEST(NmeaFix, ADateThatChangesAfterMidnightIsMended) {
  Assembly a;
  a.add(rmc("235959.00", "010126")).add(rmc("000000.00", "010126")).add(rmc("000001.00", "010126"));
  a.add(rmc("000002.00", "020126")).finish();
  ASSERT_EQ(a.fixes.size(), 4U);
  const TimeNs midnight = *gps_from_utc({.date = {2026, 1, 2}});
  for (int i = 0; i < 4; ++i) EXPECT_EQ(a.fixes[static_cast<std::size_t>(i)].gps_time_ns, midnight + (i - 1) * kSecond);
  EXPECT_EQ(a.count("gps.date_late"), 2);
  // A wrong date that is set right by a day is none of this, nor is a log that begins again.
  Assembly set_right;
  set_right.add(rmc("000030.00", "020126")).add(rmc("000031.00", "010126")).finish();
  EXPECT_EQ(set_right.fixes[1].gps_time_ns, midnight - 86'400 * kSecond + 31 * kSecond);
  Assembly again;
  again.add(rmc("235900.00", "010126")).add(rmc("000000.00", "010126")).finish();
  EXPECT_EQ(again.fixes[1].gps_time_ns, midnight - 86'400 * kSecond);
  EXPECT_EQ(again.count("gps.date_late") + set_right.count("gps.date_late"), 0);
}

TEST(NmeaFix, TheLeapSecondIsASecondOfItsOwn) {
  Assembly a;
  for (const char* t : {"235959.00", "235960.00", "235960.50"}) a.add(rmc(t, "311216"));
  a.add(rmc("000000.00", "010117")).finish();
  ASSERT_EQ(a.fixes.size(), 4U);
  EXPECT_EQ(a.fixes[1].gps_time_ns - a.fixes[0].gps_time_ns, kSecond);
  EXPECT_EQ(a.fixes[2].gps_time_ns - a.fixes[0].gps_time_ns, kSecond * 3 / 2);
  EXPECT_EQ(a.fixes[3].gps_time_ns - a.fixes[0].gps_time_ns, 2 * kSecond);
  Assembly wrong;
  wrong.add(rmc("235960.00", "311217"));
  EXPECT_EQ(wrong.only().gps_time_ns, kNoTime) << "there was none";
  EXPECT_EQ(wrong.only().fix, GpsFixType::k2d);
  EXPECT_EQ(wrong.count("gps.impossible_time"), 1);
}

TEST(NmeaFix, WithoutDateNoTime) {
  Assembly a;
  a.add(gga("120000")).add(gga("120001")).add(rmc("120002", "")).add(rmc("120003", "120419")).finish();
  ASSERT_EQ(a.fixes.size(), 4U);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(a.fixes[static_cast<std::size_t>(i)].gps_time_ns, kNoTime);
    EXPECT_TRUE(std::isfinite(a.fixes[static_cast<std::size_t>(i)].latitude));
  }
  EXPECT_NE(a.fixes[3].gps_time_ns, kNoTime);
  EXPECT_EQ(a.count("gps.no_date"), 3);

  // A host that saw more than an hour go by does not know the day any more.
  Assembly silent;
  silent.add(rmc("120000", "120419"), kSecond)
      .add(gga("120001"), 2 * kSecond)
      .add(gga("120002"), 90'000 * kSecond)
      .finish();
  EXPECT_NE(silent.fixes[1].gps_time_ns, kNoTime);
  EXPECT_EQ(silent.fixes[2].gps_time_ns, kNoTime);

  Assembly contradictory;
  contradictory.add(rmc("120000", "120419")).add("GNZDA,120000,13,04,2019,00,00");
  EXPECT_EQ(contradictory.only().gps_time_ns, kNoTime);
  EXPECT_EQ(contradictory.count("gps.contradictory"), 1);
}

TEST(NmeaFix, DatesOfAgedReceiversNeedAReference) {
  const NmeaFixOptions today = {.reference_date = CivilDate{2026, 11, 22}};
  Assembly a(today);
  a.add(rmc("120000", "100407")).add("GNZDA,120000,10,04,2007,00,00");
  EXPECT_EQ(a.only().gps_time_ns, *gps_from_utc({{2026, 11, 24}, 12, 0, 0, 0}));
  EXPECT_EQ(a.count("gps.rollover_mended"), 1);
  EXPECT_EQ(a.count("gps.date_past_leap_table"), 1);
  // What was changed or assumed is said once.
  std::vector<std::string> remarks;
  NmeaFixOptions telling = today;
  telling.on_remark = [&](const std::string& text) { remarks.push_back(text); };
  Assembly(telling).add(rmc("120000", "100407")).add(rmc("120001", "100407")).add(rmc("120002", "100407")).finish();
  ASSERT_EQ(remarks.size(), 2U);
  EXPECT_NE(remarks[0].find("tells 2007-04-10, which is taken for 2026-11-24"), std::string::npos) << remarks[0];
  EXPECT_NE(remarks[1].find("known until 2026-06-28: GPS - UTC = 18 s"), std::string::npos) << remarks[1];
  remarks.clear();
  EXPECT_EQ(Assembly(telling).add(rmc("120000", "260514")).only().gps_time_ns,
            *gps_from_utc({{2014, 5, 26}, 12, 0, 0, 0}));
  EXPECT_EQ(remarks.size(), 0U);
  Assembly untouched;
  EXPECT_EQ(untouched.add(rmc("120000", "100407")).only().gps_time_ns, *gps_from_utc({{2007, 4, 10}, 12, 0, 0, 0}));
  EXPECT_EQ(Assembly(today).add(rmc("120000", "221126")).only().gps_time_ns,
            *gps_from_utc({{2026, 11, 22}, 12, 0, 0, 0}));
  // Years beyond 2079 with a reference of their time.
  EXPECT_EQ(Assembly({.reference_date = CivilDate{2085, 1, 1}}).add(rmc("120000", "221184")).only().gps_time_ns,
            *gps_from_utc({{2084, 11, 22}, 12, 0, 0, 0}));
}

TEST(NmeaFix, LabelsComeFromValidTimeOnly) {
  Assembly a;
  a.add("GNZDA,115958,12,04,2019,00,00", 1).add(rmc("115959", "120419", "N", "V"), 2);
  a.add("GNZDA,115959,12,04,2019,00,00", 3).add(gga("115959", 0), 4);
  EXPECT_TRUE(a.labels.empty()) << "no fix yet";
  a.add(gga("120000"), 10).add(rmc("120000", "120419"), 11).add("GNZDA,120000,12,04,2019,00,00", 12);
  ASSERT_EQ(a.labels.size(), 1U) << "one for an epoch";
  EXPECT_EQ(a.labels[0].kind, GpsTimeEvent::Kind::kLabel);
  EXPECT_EQ(a.labels[0].host_time_ns, 11);
  EXPECT_EQ(a.labels[0].gps_time_ns, *gps_from_utc({{2019, 4, 12}, 12, 0, 0, 0}));
  a.add("GNZDA,120001,12,04,2019,00,00", 20);
  ASSERT_EQ(a.labels.size(), 2U) << "ZDA after an epoch with a fix";
  EXPECT_EQ(a.labels[1].host_time_ns, 20);
  a.add(rmc("120001", "120419", "N", "V"), 21).add("GNZDA,120002,12,04,2019,00,00", 30);
  EXPECT_EQ(a.labels.size(), 2U) << "the fix was lost";
  a.add(rmc("120003", "120419"));
  EXPECT_EQ(a.labels.size(), 2U) << "the arrival is not known";
  EXPECT_EQ(a.count("gps.time_labels"), 2);
}

TEST(NmeaFix, RepeatedAndLateSentencesMakeNoSecondFix) {
  Assembly a;
  a.add(gga("120000")).add("GP" + gga("120000").substr(2)).add(rmc("120000", "120419")).add(rmc("120000", "120419"));
  a.finish();
  a.add("GNGST,120000,,,,,2.0,3.0,4.0").add(gga("120000"));
  a.add(gga("120001")).finish();
  EXPECT_EQ(a.fixes.size(), 2U);
  EXPECT_EQ(a.count("gps.repeated_sentence"), 2);
  EXPECT_EQ(a.count("gps.late_sentence"), 2);
  // The same time of two days are two epochs.
  Assembly days;
  days.add(rmc("120000", "120419")).add(rmc("120000", "130419")).finish();
  ASSERT_EQ(days.fixes.size(), 2U);
  EXPECT_EQ(days.fixes[1].gps_time_ns - days.fixes[0].gps_time_ns, 86'400 * kSecond);
  // Nor does a receiver without time make one epoch of all.
  Assembly cold;
  for (int i = 0; i < 3; ++i) cold.add("GPGGA,,,,,,0,,,,,,,,").add("GPRMC,,V,,,,,,,,,,N").add(gsa(1));
  cold.finish();
  EXPECT_EQ(cold.fixes.size(), 3U);
}

TEST(NmeaFix, OptionsAreChecked) {
  EXPECT_THROW(NmeaFixAssembler({.reference_date = CivilDate{2026, 2, 30}}), std::invalid_argument);
  EXPECT_THROW(NmeaFixAssembler({.geoid_separation = 500}), std::invalid_argument);
  EXPECT_THROW(NmeaFixAssembler({.geoid_separation = std::nan("")}), std::invalid_argument);
  EXPECT_THROW(NmeaFixAssembler({.sigma_per_dop = -1}), std::invalid_argument);
}

class NmeaLog : public ::testing::Test {
 protected:
  std::string write(const std::string& text) {
    const std::string path = (folder_.path() / "log.nmea").string();
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  std::vector<GpsMeasurement> read(const std::filesystem::path& path) {
    const auto source = open_nmea(path);
    std::vector<GpsMeasurement> out;
    while (auto m = source->next()) out.push_back(std::get<GpsMeasurement>(*m));
    counts_ = source->counts();
    return out;
  }
  TempFolder folder_;
  NamedCounts counts_;
};

TEST_F(NmeaLog, TimesIncreaseAndEveryEpochIsAccountedFor) {
  std::string text = "# a comment\n";
  text += sentence(rmc("115958", "120419", "N", "V"));  // before the first fix: no time to believe
  text += sentence(rmc("120000", "120419")) + sentence(rmc("120001", "120419"));
  text += sentence(rmc("120000", "120419"));            // back
  text += sentence(rmc("120002", "120419", "N", "V"));  // no fix, the clock goes on
  text += sentence(rmc("140000", "120419", "N", "V"));  // too long without fix
  text += sentence(rmc("120003", "120419")) + sentence(gga("120004")) + "$GNRMC,1200";
  const std::vector<GpsMeasurement> fixes = read(write(text));
  ASSERT_EQ(fixes.size(), 5U);
  const TimeNs begin = *gps_from_utc({{2019, 4, 12}, 12, 0, 0, 0});
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    EXPECT_EQ(fixes[i].time_ns, begin + static_cast<TimeNs>(i) * kSecond);
    EXPECT_EQ(fixes[i].sequence, static_cast<std::int64_t>(i));
    EXPECT_EQ(fixes[i].host_time_ns, kNoTime);
  }
  EXPECT_TRUE(is_no_fix(fixes[2]));
  EXPECT_EQ(count_of(counts_, "gps.read"), 5);
  EXPECT_EQ(count_of(counts_, "gps.skipped.no_time"), 2);
  EXPECT_EQ(count_of(counts_, "gps.skipped.time_not_increasing"), 1);
  EXPECT_EQ(count_of(counts_, "gps.epochs"), 8);
  EXPECT_EQ(count_of(counts_, "nmea.malformed.cut"), 1);
}

TEST_F(NmeaLog, WrongDatesDoNotTakeTheGoodOnesAlong) {
  const auto good = [](int from, int to) {
    std::string text;
    for (int s = from; s < to; ++s) {
      char time[16];
      std::snprintf(time, sizeof time, "12%02d%02d", s / 60, s % 60);
      text += sentence(rmc(time, "120419"));
    }
    return text;
  };
  const TimeNs begin = *gps_from_utc({{2019, 4, 12}, 12, 0, 0, 0});
  const auto expect_good = [&](const std::string& text, std::int64_t skipped, const std::string& what) {
    const std::vector<GpsMeasurement> fixes = read(write(text));
    ASSERT_EQ(fixes.size(), 180U) << what;
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      ASSERT_EQ(fixes[i].time_ns, begin + static_cast<TimeNs>(i) * kSecond) << what;
      ASSERT_EQ(fixes[i].sequence, static_cast<std::int64_t>(i)) << what;
    }
    EXPECT_EQ(count_of(counts_, "gps.skipped.time_not_increasing"), skipped) << what;
    EXPECT_EQ(count_of(counts_, "gps.epochs"), 180 + skipped) << what;
  };
  const std::string future = sentence(rmc("110000", "050127"));
  const std::string later = sentence(rmc("110001", "050127"));
  const std::string past = sentence(rmc("110000", "050101"));
  expect_good(good(0, 180), 0, "all good");
  expect_good(future + later + good(0, 180), 2, "two at the beginning");
  for (const int at : {1, 10, 63, 64, 65, 100, 170, 178}) {
    expect_good(good(0, at) + future + good(at, 180), 1, "one after " + std::to_string(at));
    expect_good(good(0, at) + past + good(at, 180), 1, "the past after " + std::to_string(at));
  }
  expect_good(good(0, 90) + future + later + good(90, 120) + future + good(120, 180), 3, "more than once");

  // Leaps that are true: one fix a day, and a log of two days.
  std::string days;
  for (int day = 10; day < 30; ++day) days += sentence(rmc("120000", std::to_string(day) + "0419"));
  EXPECT_EQ(read(write(days)).size(), 20U);
  EXPECT_EQ(read(write(good(0, 100) + sentence(rmc("120000", "140419")) + sentence(rmc("120001", "140419")))).size(),
            102U);
  // A log that steps back for good says so.
  std::vector<std::string> remarks;
  NmeaFixOptions options;
  options.on_remark = [&](const std::string& text) { remarks.push_back(text); };
  const auto source = open_nmea(write(good(100, 180) + good(0, 50)), options);
  int given = 0;
  while (source->next()) ++given;
  EXPECT_EQ(given, 80);
  EXPECT_EQ(count_of(source->counts(), "gps.skipped.time_not_increasing"), 50);
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_NE(remarks[0].find("steps back"), std::string::npos);
}

TEST_F(NmeaLog, WhatIsNoLogSaysSo) {
  const auto message = [&](const std::filesystem::path& path) -> std::string {
    try {
      read(path);
    } catch (const DataError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message(folder_.path() / "absent").find("no such file"), std::string::npos);
  EXPECT_NE(message(folder_.path()).find("folder"), std::string::npos);
  EXPECT_NE(message(write("")).find("empty"), std::string::npos);
  EXPECT_NE(message(write(std::string(1000, '\0'))).find("not one correct NMEA sentence in 1000 bytes"),
            std::string::npos);
  EXPECT_NE(message(write("\xb5\x62 x \xb5\x62 x \xb5\x62")).find("UBX"), std::string::npos);
  EXPECT_NE(message(write("\xa0\xa2 x \xa0\xa2 x \xa0\xa2")).find("SiRF"), std::string::npos);
  EXPECT_NE(message(write("$GPRMC,x*00\n$GPGGA,x*01\n")).find("begin like one"), std::string::npos);
}

TEST_F(NmeaLog, RealReceivers) {
  LOC_DATA_OR_SKIP(folder, "nmea");
  // Cold start: three epochs without position, one with a position that is not valid, then fixes.
  std::vector<GpsMeasurement> fixes = read(folder / "blumax-gps009.log");
  EXPECT_EQ(count_of(counts_, "gps.epochs"), 8);
  EXPECT_EQ(count_of(counts_, "gps.no_fix"), 4);
  ASSERT_EQ(fixes.size(), 4U);
  EXPECT_EQ(to_text(utc_from_gps(fixes[0].gps_time_ns)), "2008-07-18T14:28:19.299000000Z");
  EXPECT_NEAR(fixes[0].latitude, (52 + 1.0809 / 60) * kDeg, 1e-15);
  EXPECT_NEAR(fixes[0].altitude, 32.1 + 47.2, 1e-9);

  fixes = read(folder / "bu353-glonass.log");
  EXPECT_EQ(count_of(counts_, "gps.epochs"), 19);
  for (const GpsMeasurement& m : fixes) EXPECT_EQ(std::isnan(m.latitude), m.fix == GpsFixType::kNone);

  fixes = read(folder / "ublox-zed-f9p-nmea.log");
  ASSERT_EQ(fixes.size(), 29U);
  for (const GpsMeasurement& m : fixes) {
    EXPECT_EQ(m.fix, GpsFixType::k3d);
    EXPECT_NEAR(m.latitude, -45.8775915 * kDeg, 1e-6) << "where the log's heading says";
    EXPECT_NEAR(m.longitude, 170.500124833 * kDeg, 1e-6);
    EXPECT_GT(m.position_cov(0, 0), 1);
    EXPECT_FALSE(m.position_cov.array().isNaN().any());
  }
  // Binary only: one of them without fix.
  for (const char* name : {"bu303-moving.log", "bu303-nofix.log", "ublox-neo-m8n.log"}) {
    const auto source = open_nmea(folder / name);
    EXPECT_THROW((void)source->next(), DataError) << name;
    EXPECT_FALSE(source->next()) << "the end after the error";
    EXPECT_EQ(count_of(source->counts(), "gps.epochs"), 0);
  }
}

}  // namespace
}  // namespace loc::test
