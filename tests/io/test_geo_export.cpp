// Paths on the Earth as GPX, KML and GeoJSON. That the files are well-formed is looked at by other people's parsers in
// tests/python/test_geo_export.py.
#include <gtest/gtest.h>

#include <numbers>
#include <stdexcept>

#include "libloc/core/check.hpp"
#include "libloc/io/geo_export.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr TimeNs kTime = 1'790'000'000'123'456'789;  // 2026-09-21 14:13:20.123456789 UTC

GeoPathPoint point(double latitude_deg, double longitude_deg, double altitude, TimeNs time = kNoTime) {
  GeoPathPoint out;
  out.place = {latitude_deg * kDegree, longitude_deg * kDegree, altitude};
  out.utc_ns = time;
  return out;
}

class GeoExport : public ::testing::Test {
 protected:
  template <class Writer>
  std::string written(Writer writer, const char* name = "path") {
    writer(folder_.path() / name, path_);
    return test::read_file(folder_.path() / name);
  }
  void expect_refused(const std::string& part) {
    try {
      write_gpx(folder_.path() / "refused", path_);
      ADD_FAILURE() << "accepted";
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
    EXPECT_FALSE(std::filesystem::exists(folder_.path() / "refused"));
  }

  test::TempFolder folder_;
  GeoPath path_;
};

void expect_has(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' not in\n" << text;
}

TEST_F(GeoExport, GpxHoldsPlacesTimesAndDeviations) {
  path_.name = R"(Tom & "Anna" <3>)";
  path_.points = {point(45.123456789, -7.5, 300.25, kTime), point(45.2, -7.6, 301)};
  path_.points[0].sigma_horizontal = 1.25;
  path_.points[0].sigma_vertical = 2.5;
  path_.points[1].begins_segment = true;
  const std::string gpx = written(write_gpx);
  expect_has(gpx, "<name>Tom &amp; &quot;Anna&quot; &lt;3&gt;</name>");
  expect_has(gpx,
             "<trkpt lat=\"45.123456789\" lon=\"-7.500000000\"><ele>300.250</ele>"
             "<time>2026-09-21T14:13:20.123456Z</time><extensions><loc:sigma_horizontal>1.250</loc:sigma_horizontal>"
             "<loc:sigma_vertical>2.500</loc:sigma_vertical></extensions></trkpt>\n</trkseg>\n<trkseg>\n"
             "<trkpt lat=\"45.200000000\" lon=\"-7.600000000\"><ele>301.000</ele></trkpt>");
  path_.geoid_height = 48;
  expect_has(written(write_gpx), "<ele>252.250</ele>");
  expect_has(written(write_geojson), "300.250");  // above the ellipsoid, by its RFC
}

TEST_F(GeoExport, LongitudesAreWrappedAlsoByRounding) {
  path_.points = {point(1, 180, 0), point(1, 179.9999999999, 0), point(1, 190, 0), point(1, -180, 0)};
  const std::string gpx = written(write_gpx);
  EXPECT_EQ(gpx.find("lon=\"180"), std::string::npos) << gpx;
  expect_has(gpx, "lon=\"-170.000000000\"");
  expect_has(gpx, "lon=\"-180.000000000\"");
}

TEST_F(GeoExport, KmlIsATrackWhenAllTimesAreKnownAndLinesOtherwise) {
  path_.points = {point(45, 7, 300, kTime), point(45.1, 7.1, 300, kTime + 1'000'000'000), point(46, 8, 10, -1)};
  path_.points[2].begins_segment = true;
  const std::string track = written(write_kml);
  expect_has(track, "<when>2026-09-21T14:13:21.123456Z</when>\n<gx:coord>7.000000000 45.000000000 300.000</gx:coord>");
  expect_has(track, "<when>1969-12-31T23:59:59.999999Z</when>\n<gx:coord>8.000");
  EXPECT_EQ(track.find("LineString>"), std::string::npos);
  path_.points[1].utc_ns = kNoTime;
  const std::string lines = written(write_kml);
  EXPECT_EQ(lines.find("<when>"), std::string::npos);
  expect_has(lines,
             "<LineString>\n<altitudeMode>absolute</altitudeMode>\n<coordinates>\n7.000000000,45.000000000,300.000\n");
  expect_has(lines, "<Point>\n<altitudeMode>absolute</altitudeMode>\n<coordinates>\n8.000000000,46.000000000,10.000\n");
}

TEST_F(GeoExport, GeoJsonIsCutAtTheAntimeridian) {
  path_.points = {point(10, 179, 100, kTime), point(14, -177, 300, kTime + 4'000'000'000), point(20, -176, 0)};
  path_.points[0].sigma_horizontal = 1;
  path_.points[1].sigma_horizontal = 5;
  const std::string json = written(write_geojson);
  expect_has(
      json,
      R"("type":"MultiLineString","coordinates":[[[179.000000000,10.000000000,100.000],[180.000000000,11.000000000,150.000]],[[-180.000000000,11.000000000,150.000],[-177.000000000,14.000000000,300.000],[-176.000000000,20.000000000,0.000]]])");
  expect_has(
      json,
      R"("coordTimes":[["2026-09-21T14:13:20.123456Z","2026-09-21T14:13:21.123456Z"],["2026-09-21T14:13:21.123456Z","2026-09-21T14:13:24.123456Z",null]])");
  expect_has(json, R"("sigma_horizontal_m":[[1.000,2.000],[2.000,5.000,null]])");
  // And back.
  path_.points = {point(0, -179, 0), point(0, 179, 0), point(1, 178, 0)};
  expect_has(written(write_geojson),
             "[[[-179.000000000,0.000000000,0.000],[-180.000000000,0.000000000,0.000]],"
             "[[180.000000000,0.000000000,0.000],[179.000000000,0.000000000,0.000],[178.0");
  path_.points = {point(0, 1, 0), point(0, 2, 0), point(5, 6, 7)};
  path_.points[2].begins_segment = true;
  const std::string two = written(write_geojson);
  expect_has(two, R"("type":"LineString","coordinates":[[1.000000000,)");
  expect_has(two, R"("type":"Point","coordinates":[6.000000000,5.000000000,7.000])");
}

TEST_F(GeoExport, WhatIsNoPathIsRefused) {
  expect_refused("there are none");
  path_.points = {point(45, 7, 0), point(91, 7, 0)};
  expect_refused("points[1]");
  path_.points = {point(45, 7, kUnknown)};
  expect_refused("altitude");
  path_.points = {point(45, 7, 0)};
  path_.points[0].sigma_vertical = -1;
  expect_refused("sigma_vertical = -1");
  path_.points[0].sigma_vertical = 1;
  for (const char* text : {"a\x01", "\xff", "\xc3", "\xed\xa0\x80", "\xc0\xaf", "\xf5\x80\x80\x80", "a\x7f\xe2\x82"}) {
    path_.name = text;
    expect_refused("GeoPath.name");
  }
  path_.name = "Zürich – 東京 \xf0\x9f\x9a\x97 \\ \n";
  expect_has(written(write_geojson), "Zürich – 東京 \xf0\x9f\x9a\x97 \\\\ \\n\"");
  test::expect_data_error([&] { write_gpx(folder_.path() / "none" / "x.gpx", path_); }, {"x.gpx"});
}

}  // namespace
}  // namespace loc
