#include "libloc/io/geo_export.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <ostream>
#include <span>
#include <string_view>

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"

namespace loc {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr int kAngleDecimals = 9;
constexpr int kMetreDecimals = 3;

std::string fixed(double value, int decimals) {
  std::array<char, 400> buffer{};
  const auto end =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::fixed, decimals);
  return {buffer.data(), end.ptr};
}

std::string latitude_text(double latitude) {
  return fixed(latitude * kDegrees, kAngleDecimals);
}

// In [-180, 180), also after rounding.
double wrapped_degrees(double longitude) {
  const double degrees = std::remainder(longitude * kDegrees, 360);
  return degrees > 180 - 0.5e-9 ? -180 : degrees;
}

std::string longitude_text(double longitude) {
  return fixed(wrapped_degrees(longitude), kAngleDecimals);
}

// To the microsecond.
std::string time_text(TimeNs utc_ns) {
  using namespace std::chrono;
  const auto time = sys_time<nanoseconds>(nanoseconds(utc_ns));
  const auto day = floor<days>(time);
  const year_month_day date(day);
  const hh_mm_ss clock(floor<microseconds>(time - day));
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%04d-%02u-%02uT%02d:%02d:%02d.%06dZ", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                static_cast<int>(clock.hours().count()), static_cast<int>(clock.minutes().count()),
                static_cast<int>(clock.seconds().count()), static_cast<int>(clock.subseconds().count()));
  return text.data();
}

std::string xml(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string json(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (c == '\n') {
      out += "\\n";
    } else if (c == '\t') {
      out += "\\t";
    } else {
      out += c;
    }
  }
  return out + '"';
}

// Bytes of the UTF-8 character that begins here; 0: it is none. Overlong forms, surrogates and what is beyond Unicode
// are none.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xc2 && first < 0xe0 ? 2 : first >= 0xe0 && first < 0xf0 ? 3 : 4;
  if (first < 0xc2 || first > 0xf4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0U) != 0x80) return 0;
  }
  const unsigned second = byte(1);
  const bool bad = (first == 0xe0 && second < 0xa0) || (first == 0xed && second > 0x9f) ||
                   (first == 0xf0 && second < 0x90) || (first == 0xf4 && second > 0x8f) ||
                   (first == 0xef && second == 0xbf && (byte(2) == 0xbe || byte(2) == 0xbf));  // not a character in XML
  return bad ? 0 : length;
}

void require_text(const char* field, std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = character_length(text.substr(i));
    require(length > 0, std::string(field) + ": byte " + std::to_string(i) + " is not UTF-8");
    const auto c = static_cast<unsigned char>(text[i]);
    require(c >= 0x20 || c == '\n' || c == '\t',
            std::string(field) + ": byte " + std::to_string(i) + " is a control character");
    i += length;
  }
}

std::vector<std::span<const GeoPathPoint>> segments_of(const GeoPath& path) {
  std::vector<std::span<const GeoPathPoint>> out;
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= path.points.size(); ++i) {
    if (i < path.points.size() && !path.points[i].begins_segment) continue;
    out.push_back(std::span(path.points).subspan(begin, i - begin));
    begin = i;
  }
  return out;
}

// Longitude, latitude, altitude.
std::string kml_coordinates(const GeoPathPoint& point, double geoid_height, char separator) {
  return longitude_text(point.place.longitude) + separator + latitude_text(point.place.latitude) + separator +
         fixed(point.place.altitude - geoid_height, kMetreDecimals);
}

void write_kml_track(std::ostream& out, std::span<const GeoPathPoint> segment, double geoid_height) {
  out << "<gx:Track>\n<altitudeMode>absolute</altitudeMode>\n";
  for (const GeoPathPoint& point : segment) out << "<when>" << time_text(point.utc_ns) << "</when>\n";
  for (const GeoPathPoint& point : segment) {
    out << "<gx:coord>" << kml_coordinates(point, geoid_height, ' ') << "</gx:coord>\n";
  }
  out << "</gx:Track>\n";
}

void write_kml_line(std::ostream& out, std::span<const GeoPathPoint> segment, double geoid_height) {
  const char* geometry = segment.size() == 1 ? "Point" : "LineString";
  out << '<' << geometry << ">\n<altitudeMode>absolute</altitudeMode>\n<coordinates>\n";
  for (const GeoPathPoint& point : segment) out << kml_coordinates(point, geoid_height, ',') << '\n';
  out << "</coordinates>\n</" << geometry << ">\n";
}

struct JsonPoint {
  double longitude_deg;
  GeoPathPoint point;
};
using JsonLine = std::vector<JsonPoint>;

double between(double a, double b, double share) {
  return a + (b - a) * share;
}

// The point where the line from a to b is at 180 degrees.
GeoPathPoint at_antimeridian(const GeoPathPoint& a, const GeoPathPoint& b, double share) {
  GeoPathPoint cut = a;
  cut.place.latitude = between(a.place.latitude, b.place.latitude, share);
  cut.place.altitude = between(a.place.altitude, b.place.altitude, share);
  cut.sigma_horizontal = between(a.sigma_horizontal, b.sigma_horizontal, share);
  cut.sigma_vertical = between(a.sigma_vertical, b.sigma_vertical, share);
  cut.utc_ns = a.utc_ns == kNoTime || b.utc_ns == kNoTime
                   ? kNoTime
                   : a.utc_ns + static_cast<TimeNs>(std::llround(static_cast<double>(b.utc_ns - a.utc_ns) * share));
  return cut;
}

std::vector<JsonLine> cut_at_antimeridian(std::span<const GeoPathPoint> segment) {
  std::vector<JsonLine> lines(1);
  for (const GeoPathPoint& point : segment) {
    const double longitude = wrapped_degrees(point.place.longitude);
    if (!lines.back().empty()) {
      const JsonPoint before = lines.back().back();
      if (std::abs(longitude - before.longitude_deg) > 180) {
        const double edge = before.longitude_deg > 0 ? 180 : -180;
        const double to_edge = std::abs(edge - before.longitude_deg);
        const double width = to_edge + std::abs(-edge - longitude);
        const GeoPathPoint cut = at_antimeridian(before.point, point, width > 0 ? to_edge / width : 0);
        lines.back().push_back({edge, cut});
        lines.push_back({{-edge, cut}});
      }
    }
    lines.back().push_back({longitude, point});
  }
  return lines;
}

std::string json_or_null(double value) {
  return std::isfinite(value) ? fixed(value, kMetreDecimals) : "null";
}

template <class Text>
void write_json_line(std::ostream& out, const JsonLine& line, Text text) {
  out << '[';
  for (std::size_t i = 0; i < line.size(); ++i) out << (i == 0 ? "" : ",") << text(line[i]);
  out << ']';
}

template <class Text>
void write_json_lines(std::ostream& out, const std::vector<JsonLine>& lines, Text text) {
  if (lines.size() > 1) out << '[';
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (i > 0) out << ',';
    write_json_line(out, lines[i], text);
  }
  if (lines.size() > 1) out << ']';
}

std::string json_position(const JsonPoint& point) {
  return '[' + fixed(point.longitude_deg, kAngleDecimals) + ',' + latitude_text(point.point.place.latitude) + ',' +
         fixed(point.point.place.altitude, kMetreDecimals) + ']';
}

void write_feature(std::ostream& out, const GeoPath& path, std::span<const GeoPathPoint> segment, std::size_t number) {
  const std::vector<JsonLine> lines = cut_at_antimeridian(segment);
  const bool single = segment.size() == 1;
  out << R"({"type":"Feature","properties":{"name":)" << json(path.name) << R"(,"description":)"
      << json(path.description) << R"(,"segment":)" << number << R"(,"coordTimes":)";
  write_json_lines(out, lines, [](const JsonPoint& p) {
    return p.point.utc_ns == kNoTime ? std::string("null") : '"' + time_text(p.point.utc_ns) + '"';
  });
  out << R"(,"sigma_horizontal_m":)";
  write_json_lines(out, lines, [](const JsonPoint& p) { return json_or_null(p.point.sigma_horizontal); });
  out << R"(,"sigma_vertical_m":)";
  write_json_lines(out, lines, [](const JsonPoint& p) { return json_or_null(p.point.sigma_vertical); });
  out << R"(},"geometry":{"type":")"
      << (single             ? "Point"
          : lines.size() > 1 ? "MultiLineString"
                             : "LineString")
      << R"(","coordinates":)";
  if (single) {
    out << json_position(lines[0][0]);
  } else {
    write_json_lines(out, lines, json_position);
  }
  out << "}}";
}

}  // namespace

void GeoPath::check() const {
  require(!points.empty(), "GeoPath.points: there are none");
  require_finite("GeoPath.geoid_height", geoid_height);
  require_text("GeoPath.name", name);
  require_text("GeoPath.description", description);
  for (std::size_t i = 0; i < points.size(); ++i) {
    try {
      points[i].place.check();
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("GeoPath.points[" + std::to_string(i) + "]: " + error.what());
    }
    require(!(points[i].sigma_horizontal < 0), "sigma_horizontal", points[i].sigma_horizontal, "must not be negative");
    require(!(points[i].sigma_vertical < 0), "sigma_vertical", points[i].sigma_vertical, "must not be negative");
  }
}

void write_gpx(const std::filesystem::path& path, const GeoPath& track) {
  track.check();
  io::AtomicFile file(path);
  std::ostream& out = file.stream();
  out << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
         "<gpx version=\"1.1\" creator=\"libloc\" xmlns=\"http://www.topografix.com/GPX/1/1\" "
         "xmlns:loc=\"urn:libloc:geo:1\">\n<trk>\n<name>"
      << xml(track.name) << "</name>\n";
  if (!track.description.empty()) out << "<desc>" << xml(track.description) << "</desc>\n";
  for (const auto segment : segments_of(track)) {
    out << "<trkseg>\n";
    for (const GeoPathPoint& point : segment) {
      out << "<trkpt lat=\"" << latitude_text(point.place.latitude) << "\" lon=\""
          << longitude_text(point.place.longitude) << "\"><ele>"
          << fixed(point.place.altitude - track.geoid_height, kMetreDecimals) << "</ele>";
      if (point.utc_ns != kNoTime) out << "<time>" << time_text(point.utc_ns) << "</time>";
      const bool horizontal = std::isfinite(point.sigma_horizontal);
      const bool vertical = std::isfinite(point.sigma_vertical);
      if (horizontal || vertical) out << "<extensions>";
      if (horizontal) {
        out << "<loc:sigma_horizontal>" << fixed(point.sigma_horizontal, kMetreDecimals) << "</loc:sigma_horizontal>";
      }
      if (vertical) {
        out << "<loc:sigma_vertical>" << fixed(point.sigma_vertical, kMetreDecimals) << "</loc:sigma_vertical>";
      }
      if (horizontal || vertical) out << "</extensions>";
      out << "</trkpt>\n";
    }
    out << "</trkseg>\n";
  }
  out << "</trk>\n</gpx>\n";
  file.commit();
}

void write_kml(const std::filesystem::path& path, const GeoPath& track) {
  track.check();
  const bool timed = std::ranges::all_of(track.points, [](const GeoPathPoint& p) { return p.utc_ns != kNoTime; });
  io::AtomicFile file(path);
  std::ostream& out = file.stream();
  out << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
         "<kml xmlns=\"http://www.opengis.net/kml/2.2\" xmlns:gx=\"http://www.google.com/kml/ext/2.2\">\n<Document>\n"
         "<name>"
      << xml(track.name) << "</name>\n<Placemark>\n<name>" << xml(track.name) << "</name>\n";
  if (!track.description.empty()) out << "<description>" << xml(track.description) << "</description>\n";
  out << "<Style><LineStyle><color>ff0000ff</color><width>3</width></LineStyle></Style>\n";
  out << (timed ? "<gx:MultiTrack>\n" : "<MultiGeometry>\n");
  for (const auto segment : segments_of(track)) {
    timed ? write_kml_track(out, segment, track.geoid_height) : write_kml_line(out, segment, track.geoid_height);
  }
  out << (timed ? "</gx:MultiTrack>\n" : "</MultiGeometry>\n") << "</Placemark>\n</Document>\n</kml>\n";
  file.commit();
}

void write_geojson(const std::filesystem::path& path, const GeoPath& track) {
  track.check();
  io::AtomicFile file(path);
  std::ostream& out = file.stream();
  out << "{\"type\":\"FeatureCollection\",\"features\":[\n";
  std::size_t number = 0;
  for (const auto segment : segments_of(track)) {
    if (number > 0) out << ",\n";
    write_feature(out, track, segment, number++);
  }
  out << "\n]}\n";
  file.commit();
}

}  // namespace loc
