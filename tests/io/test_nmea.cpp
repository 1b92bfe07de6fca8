// The NMEA reader: what it takes, what it refuses, and that nothing depends on how the stream is cut.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "libloc/core/random.hpp"
#include "libloc/io/nmea.hpp"
#include "support/data.hpp"
#include "support/nmea_text.hpp"

namespace loc::test {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr TimeNs kSecond = 1'000'000'000;

const std::string kRmc = "GNRMC,081411.250,A,5541.1955,N,03737.2872,W,10.0,301.29,260514,003.1,W,A,V";
const std::string kGga = "GPGGA,081412.000,5541.1956,S,03737.2877,E,1,5,4.87,66.2,M,-14.5,M,1.5,0012";

template <class T>
T only(const std::string& body) {
  NmeaReader reader;
  const std::vector<NmeaSentence> all = read_all(reader, sentence(body));
  EXPECT_EQ(all.size(), 1U) << body;
  const T* content = all.empty() ? nullptr : std::get_if<T>(&all[0].content);
  EXPECT_NE(content, nullptr) << body;
  return content == nullptr ? T{} : *content;
}

TEST(NmeaReader, Rmc) {
  const auto m = only<NmeaRmc>(kRmc);
  EXPECT_EQ(m.time_of_day_ns, (8 * 3600 + 14 * 60 + 11) * kSecond + 250'000'000);
  EXPECT_TRUE(m.valid);
  EXPECT_NEAR(m.latitude, (55 + 41.1955 / 60) * kDeg, 1e-15);
  EXPECT_NEAR(m.longitude, -(37 + 37.2872 / 60) * kDeg, 1e-15);
  EXPECT_NEAR(m.speed, 18520 / 3600.0, 1e-12);
  EXPECT_NEAR(m.course, 301.29 * kDeg, 1e-12);
  EXPECT_EQ(m.date, (CivilDate{14, 5, 26}));
  EXPECT_NEAR(m.magnetic_variation, -3.1 * kDeg, 1e-12);
  EXPECT_EQ(m.mode, 'A');
  EXPECT_EQ(m.navigation_status, 'V');
  // NMEA 2.0 and 2.3, and nothing known.
  EXPECT_TRUE(only<NmeaRmc>("GPRMC,081411,A,5541.1955,N,03737.2872,W,10.0,301.29,260514,,").valid);
  const auto empty = only<NmeaRmc>("GPRMC,,V,,,,,,,,,,N");
  EXPECT_FALSE(empty.valid);
  EXPECT_EQ(empty.time_of_day_ns, kNoTime);
  EXPECT_TRUE(std::isnan(empty.latitude) && std::isnan(empty.longitude) && std::isnan(empty.speed));
  EXPECT_EQ(empty.date.month, 0);
  EXPECT_FALSE(only<NmeaRmc>("GPRMC,,,,,,,,,,,").valid) << "no status is no validity";
}

TEST(NmeaReader, Gga) {
  const auto m = only<NmeaGga>(kGga);
  EXPECT_NEAR(m.latitude, -(55 + 41.1956 / 60) * kDeg, 1e-15);
  EXPECT_NEAR(m.longitude, (37 + 37.2877 / 60) * kDeg, 1e-15);
  EXPECT_EQ(m.quality, 1);
  EXPECT_EQ(m.satellites, 5);
  EXPECT_DOUBLE_EQ(m.hdop, 4.87);
  EXPECT_DOUBLE_EQ(m.altitude_msl, 66.2);
  EXPECT_DOUBLE_EQ(m.geoid_separation, -14.5);
  EXPECT_DOUBLE_EQ(m.differential_age_s, 1.5);
  EXPECT_EQ(m.station, 12);
  const auto empty = only<NmeaGga>("GPGGA,,,,,,0,,,,,,,,");
  EXPECT_EQ(empty.quality, 0);
  EXPECT_EQ(empty.satellites, -1);
  EXPECT_TRUE(std::isnan(empty.altitude_msl));
}

TEST(NmeaReader, ZdaGsaGstVtg) {
  const auto zda = only<NmeaZda>("GPZDA,235960.123456789,31,12,2016,-03,30");
  EXPECT_EQ(zda.time_of_day_ns, 86'400 * kSecond + 123'456'789);
  EXPECT_EQ(zda.date, (CivilDate{2016, 12, 31}));
  EXPECT_EQ(zda.zone_hours, -3);
  EXPECT_EQ(zda.zone_minutes, 30);
  EXPECT_EQ(only<NmeaZda>("GPZDA,120000,,,,,").date.month, 0);

  const auto gsa = only<NmeaGsa>("GNGSA,A,3,07,12,133,,,,,,,,,,1.05,0.64,0.83,3");
  EXPECT_EQ(gsa.selection, 'A');
  EXPECT_EQ(gsa.fix, 3);
  EXPECT_EQ(gsa.satellites, 3);
  EXPECT_EQ(gsa.satellite_ids[2], 133);
  EXPECT_DOUBLE_EQ(gsa.pdop, 1.05);
  EXPECT_DOUBLE_EQ(gsa.hdop, 0.64);
  EXPECT_DOUBLE_EQ(gsa.vdop, 0.83);
  EXPECT_EQ(gsa.system, 3);
  EXPECT_EQ(only<NmeaGsa>("GPGSA,A,1,,,,,,,,,,,,,,,").system, -1);

  const auto gst = only<NmeaGst>("GNGST,003956.00,235111,3.0,2.0,45.0,2.3,3.5,4.0");
  EXPECT_DOUBLE_EQ(gst.range_rms, 235'111);
  EXPECT_NEAR(gst.major_axis, 45 * kDeg, 1e-15);
  EXPECT_DOUBLE_EQ(gst.sigma_latitude, 2.3);
  EXPECT_DOUBLE_EQ(gst.sigma_longitude, 3.5);
  EXPECT_DOUBLE_EQ(gst.sigma_altitude, 4.0);

  const auto vtg = only<NmeaVtg>("GNVTG,90.0,T,87.0,M,2.0,N,3.7,K,A");
  EXPECT_NEAR(vtg.course, 90 * kDeg, 1e-15);
  EXPECT_NEAR(vtg.course_magnetic, 87 * kDeg, 1e-15);
  EXPECT_NEAR(vtg.speed, 2 * 1852 / 3600.0, 1e-12);
  EXPECT_EQ(vtg.mode, 'A');
  EXPECT_NEAR(only<NmeaVtg>("GNVTG,,T,,M,,N,36.0,K").speed, 10, 1e-12);
}

TEST(NmeaReader, AnyTalkerButMakersOwnSentences) {
  for (const std::string talker : {"GP", "GL", "GA", "GB", "BD", "GQ", "QZ", "GN", "GI", "IN"}) {
    NmeaReader reader;
    const std::vector<NmeaSentence> all = read_all(reader, sentence(talker + kRmc.substr(2)));
    ASSERT_EQ(all.size(), 1U) << talker;
    EXPECT_EQ(std::string(all[0].talker.data(), 2), talker);
  }
  NmeaReader reader;
  EXPECT_TRUE(read_all(reader, sentence("PG" + kRmc.substr(2)) + sentence("PSRFTXTVersion 3") +
                                   sentence("GPGLL,,,,,,V,N") + sentence("GP") + sentence("") + sentence("gprmc,") +
                                   sentence("GPRMCX,"))
                  .empty());
  EXPECT_EQ(reader.counts().unknown, 7);
  EXPECT_EQ(reader.counts().bytes_skipped, 0);
}

TEST(NmeaReader, RefusesFieldsOutOfRangeByReason) {
  const auto rmc = [](const std::string& from, const std::string& to) {
    std::string body = kRmc;
    return body.replace(body.find(from), from.size(), to);
  };
  const auto gga = [](const std::string& from, const std::string& to) {
    std::string body = kGga;
    return body.replace(body.find(from), from.size(), to);
  };
  using P = NmeaProblem;
  const std::pair<std::string, P> wrong[] = {
      {rmc("5541.1955", "11200.0000"), P::kLatitude},
      {rmc("5541.1955", "9000.0001"), P::kLatitude},
      {rmc("5541.1955", "5560.0000"), P::kLatitude},
      {rmc("5541.1955", "541.1955"), P::kLatitude},
      {rmc("5541.1955", "55411955"), P::kLatitude},
      {rmc("5541.1955", "-541.1955"), P::kLatitude},
      {rmc("5541.1955", "5541.19 5"), P::kLatitude},
      {rmc("5541.1955", "nan"), P::kLatitude},
      {rmc("5541.1955", ""), P::kLatitude},
      {rmc(",N,", ",,"), P::kLatitude},
      {rmc(",N,", ",E,"), P::kLetter},
      {rmc("03737.2872", "18000.0001"), P::kLongitude},
      {rmc("03737.2872", "3737.2872"), P::kLongitude},
      {rmc("03737.2872", "03760.2872"), P::kLongitude},
      {rmc(",W,10", ",N,10"), P::kLetter},
      {rmc("081411.250", "250000"), P::kTime},
      {rmc("081411.250", "240000"), P::kTime},
      {rmc("081411.250", "086011"), P::kTime},
      {rmc("081411.250", "081460"), P::kTime},
      {rmc("081411.250", "235961"), P::kTime},
      {rmc("081411.250", "235860"), P::kTime},
      {rmc("081411.250", "81411"), P::kTime},
      {rmc("081411.250", "0814111.25"), P::kTime},
      {rmc("081411.250", "081411.1234567890"), P::kTime},
      {rmc("081411.250", "-81411.250"), P::kTime},
      {rmc("260514", "300214"), P::kDate},
      {rmc("260514", "290213"), P::kDate},
      {rmc("260514", "001214"), P::kDate},
      {rmc("260514", "261314"), P::kDate},
      {rmc("260514", "26052014"), P::kDate},
      {rmc("10.0,", "-1.0,"), P::kNumber},
      {rmc("10.0,", "1e2,"), P::kNumber},
      {rmc("10.0,", "30000,"), P::kNumber},
      {rmc("10.0,", "1.0.0,"), P::kNumber},
      {rmc("10.0,", ".,"), P::kNumber},
      {rmc("10.0,", "+1,"), P::kNumber},
      {rmc("10.0,", "1234567890123456,"), P::kNumber},
      {rmc("301.29", "360.01"), P::kNumber},
      {rmc(",A,5", ",B,5"), P::kLetter},
      {rmc(",A,V", ",X,V"), P::kLetter},
      {rmc(",A,V", ",A,A"), P::kLetter},
      {rmc(",A,V", ",AA,V"), P::kLetter},
      {rmc(",A,V", ",A,V,"), P::kFields},
      {"GPRMC,081411.250,A,5541.1955,N,03737.2872,W,10.0,301.29,260514,", P::kFields},
      {"GPRMC," + std::string(40, ','), P::kFields},
      {gga(",1,5,", ",9,5,"), P::kNumber},
      {gga(",1,5,", ",1.0,5,"), P::kNumber},
      {gga(",1,5,", ",1,100,"), P::kNumber},
      {gga(",1,5,", ",1,-5,"), P::kNumber},
      {gga("66.2", "-10001"), P::kNumber},
      {gga("-14.5", "-214.5"), P::kNumber},
      {gga("66.2,M", "66.2,F"), P::kLetter},
      {gga("66.2,M", "66.2,"), P::kLetter},
      {gga(",0012", ",-1"), P::kNumber},
      {"GPZDA,120000,31,04,2016,00,00", P::kDate},
      {"GPZDA,120000,31,,2016,00,00", P::kDate},
      {"GPZDA,120000,01,01,1979,00,00", P::kDate},
      {"GPZDA,120000,01,01,2261,00,00", P::kDate},
      {"GPZDA,120000,1,01,2020,00,00", P::kDate},
      {"GPZDA,120000,01,01,2020,14,00", P::kNumber},
      {"GPZDA,120000,01,01,2020,00", P::kFields},
      {"GPGSA,A,4,,,,,,,,,,,,,,,", P::kNumber},
      {"GPGSA,X,3,,,,,,,,,,,,,,,", P::kLetter},
      {"GPGSA,A,3,1000,,,,,,,,,,,,,,", P::kNumber},
      {"GPGSA,A,3,,,,,,,,,,,,,-1,,", P::kNumber},
      {"GPGSA,A,3,,,,,,,,,,,,,,,,G", P::kLetter},
      {"GPGSA,A,3,,,,,,,,,,,,,,", P::kFields},
      {"GPGST,120000,-1,,,,,,", P::kNumber},
      {"GPGST,120000,,,,361,,,", P::kNumber},
      {"GPVTG,1.0,M,,M,,N,,K,A", P::kLetter},
      {"GPVTG,1.0,,,M,,N,,K,A", P::kLetter},
      {"GPVTG,1.0,2.0,3.0,4.0", P::kFields},
  };
  for (const auto& [body, problem] : wrong) {
    NmeaReader reader;
    EXPECT_TRUE(read_all(reader, sentence(body)).empty()) << body;
    EXPECT_EQ(reader.counts().malformed[static_cast<std::size_t>(problem)], 1)
        << body << " must be refused for its " << nmea_problem_name(problem);
    EXPECT_EQ(reader.counts().bytes_skipped, 0);
  }
}

TEST(NmeaReader, LimitsThemselvesAreTaken) {
  EXPECT_NEAR(only<NmeaRmc>("GPRMC,235960,A,9000.0000,S,18000.0000,W,0.0,360.0,290200,180.0,E").latitude, -90 * kDeg,
              1e-15);
  EXPECT_NEAR(only<NmeaRmc>("GPRMC,000000,A,0000.0000,N,00000.0000,E,0.0,0.0,010180,,").longitude, 0, 0);
  EXPECT_NEAR(only<NmeaGga>("GPGGA,000000,5559.999999999,N,17959.9999999,E,8,99,1000,,,,,,").latitude, 56 * kDeg,
              1e-11);
}

TEST(NmeaReader, NothingWithoutACorrectChecksum) {
  const std::string good = sentence(kRmc);
  for (std::size_t i = 1; i + 2 < good.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string bad = good;
      bad[i] = static_cast<char>(bad[i] ^ (1 << bit));
      NmeaReader reader;
      // Only the case of a hexadecimal letter may change.
      const bool same = i >= good.size() - 4 && std::tolower(bad[i]) == std::tolower(good[i]);
      EXPECT_EQ(read_all(reader, bad).size(), same ? 1U : 0U) << bad;
    }
  }
  NmeaReader reader;
  EXPECT_TRUE(read_all(reader, "$" + kRmc + "\r\n$" + kRmc + "*\r\n$" + kRmc + "*7\r\n$" + kRmc + "*XY\r\n").empty());
  EXPECT_EQ(reader.counts().malformed[static_cast<std::size_t>(NmeaProblem::kNoChecksum)], 4);
  EXPECT_EQ(reader.counts().bytes, reader.counts().bytes_skipped);
}

TEST(NmeaReader, LineEndsOfAnyKindAndNone) {
  for (const char* end : {"\r\n", "\n", "\r", "\n\r", "\r\r\n", "", "  \n"}) {
    NmeaReader reader;
    EXPECT_EQ(read_all(reader, sentence(kRmc, end) + sentence(kGga, end)).size(), 2U);
    EXPECT_EQ(reader.counts().bytes_skipped > 0, std::string(end) == "  \n");
  }
  NmeaReader reader;
  EXPECT_EQ(read_all(reader, "\r\n\r\n" + sentence(kRmc)).size(), 1U);
  EXPECT_EQ(reader.counts().bytes_skipped, 4) << "line ends of no sentence";
}

TEST(NmeaReader, ADollarBeginsAnew) {
  NmeaReader reader;
  // Cut anywhere, the sentence costs itself and not the next one.
  const std::string good = sentence(kRmc, "");
  for (std::size_t cut = 0; cut < good.size(); ++cut) {
    EXPECT_EQ(read_all(reader, good.substr(0, cut) + sentence(kGga)).size(), 1U) << cut;
  }
  EXPECT_EQ(reader.counts().valid[1], static_cast<std::int64_t>(good.size()));
  EXPECT_EQ(reader.counts().valid[0], 0);
  EXPECT_EQ(reader.counts().malformed[static_cast<std::size_t>(NmeaProblem::kCut)],
            static_cast<std::int64_t>(good.size()) - 4)
      << "fewer than three letters are no sentence";
}

TEST(NmeaReader, OverlongLinesAndBinaryInBetween) {
  NmeaReader reader;
  std::string text = "$GPTXT," + std::string(5000, 'x') + "*00\r\n" + sentence(kRmc);
  text += std::string("\xb5\x62\x01\x07\x5c\x00$$GP\x00$\xa0\xa2", 14) + sentence(kGga);
  text += sentence(kRmc).insert(20, 1, '\0') + sentence(kRmc).insert(20, 1, '\xff') + sentence(kRmc).insert(20, "\r\n");
  text += sentence("GPGSA,A,1,,,,,,,,,,,,,,,") + "$GPRMC,08";
  EXPECT_EQ(read_all(reader, text).size(), 3U);
  const auto& malformed = reader.counts().malformed;
  EXPECT_EQ(malformed[static_cast<std::size_t>(NmeaProblem::kTooLong)], 1);
  EXPECT_EQ(malformed[static_cast<std::size_t>(NmeaProblem::kNotText)], 2);
  EXPECT_EQ(malformed[static_cast<std::size_t>(NmeaProblem::kNoChecksum)], 1);
  reader.interrupt();
  EXPECT_EQ(malformed[static_cast<std::size_t>(NmeaProblem::kCut)], 1);
  EXPECT_EQ(reader.counts().bytes, static_cast<std::int64_t>(text.size()));
  // As long as the buffer, and one more.
  EXPECT_TRUE(read_all(reader, sentence("GPTXT," + std::string(kNmeaMaxLength - 6, 'x'))).empty());
  EXPECT_EQ(reader.counts().unknown, 1);
  EXPECT_TRUE(read_all(reader, sentence("GPTXT," + std::string(kNmeaMaxLength - 5, 'x'))).empty());
  EXPECT_EQ(malformed[static_cast<std::size_t>(NmeaProblem::kTooLong)], 2);
  EXPECT_EQ(read_all(reader, sentence(kRmc)).size(), 1U);
}

TEST(NmeaReader, OffsetsAndArrivalTimesAreThoseOfTheDollar) {
  NmeaReader reader;
  const std::string text = "noise" + sentence(kRmc);
  std::span<const std::uint8_t> first = bytes_of(text).first(20);
  EXPECT_EQ(reader.next(first, 111), nullptr);
  std::span<const std::uint8_t> second = bytes_of(text).subspan(20);
  const NmeaSentence* s = reader.next(second, 222);
  ASSERT_NE(s, nullptr);
  EXPECT_EQ(s->offset, 5);
  EXPECT_EQ(s->host_time_ns, 111);
}

std::string text_of_file(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

std::string as_text(const NmeaReader& reader) {
  NamedCounts counts;
  reader.counts().add_to(counts);
  std::string out;
  for (const NamedCount& c : counts) out += c.name + "=" + std::to_string(c.value) + " ";
  return out;
}

TEST(NmeaReader, TheCutOfTheStreamChangesNothing) {
  LOC_DATA_OR_SKIP(folder, "nmea");
  std::string text;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) text += text_of_file(entry.path());
  NmeaReader whole;
  const std::size_t sentences = read_all(whole, text).size();
  EXPECT_GT(sentences, 300U);
  Random random(5);
  for (const std::size_t piece : {1U, 2U, 3U, 7U, 64U, 1000U}) {
    NmeaReader reader;
    EXPECT_EQ(read_all(reader, text, piece).size(), sentences);
    EXPECT_EQ(as_text(reader), as_text(whole)) << piece;
  }
  NmeaReader reader;
  std::span<const std::uint8_t> rest = bytes_of(text);
  std::size_t found = 0;
  while (!rest.empty()) {
    const auto size = std::min(rest.size(), static_cast<std::size_t>(random.uniform(0, 300)));
    std::span<const std::uint8_t> bytes = rest.first(size);
    rest = rest.subspan(size);
    while (reader.next(bytes) != nullptr) ++found;
  }
  EXPECT_EQ(found, sentences);
  EXPECT_EQ(as_text(reader), as_text(whole));
}

}  // namespace
}  // namespace loc::test
