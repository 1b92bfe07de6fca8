// A path on the Earth as files for maps: GPX 1.1 (most map programs, OSM tools), KML 2.2 (Google Earth; times as
// gx:Track, which its extension has), GeoJSON (RFC 7946: QGIS, web maps).
// Latitude and longitude are WGS 84 degrees with nine decimals (0.1 mm). Altitudes are above the ellipsoid; GPX and KML
// mean altitudes above the sea, which is what they hold when the geoid's height is given.
// The antimeridian: in GPX and KML longitudes are in [-180, 180) and go over it, which their readers draw the short
// way; in GeoJSON the line is cut there, as the RFC asks. Paths that go over a pole are not cut there.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "libloc/core/time.hpp"
#include "libloc/geometry/geodesy.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

struct GeoPathPoint {
  TimeNs utc_ns = kNoTime;  ///< since 1970-01-01, without leap seconds; kNoTime: not known, then not written
  GeodeticPoint place;
  double sigma_horizontal = kUnknown;  ///< [m], deviation in the worst horizontal direction; NaN: not written
  double sigma_vertical = kUnknown;    ///< [m]
  bool begins_segment = false;         ///< there is a gap before it: no line is drawn from the point before
};

struct GeoPath {
  std::string name = "path";
  std::string description;
  std::vector<GeoPathPoint> points;
  double geoid_height = 0;  ///< of the geoid above the ellipsoid [m], subtracted in GPX and KML

  /// @throws std::invalid_argument naming index, field and value: no point, a place that is none, a negative deviation,
  /// text that is not UTF-8 or has control characters.
  void check() const;
};

/// One track, one trkseg for each segment; deviations in extensions (namespace urn:libloc:geo:1).
/// @throws DataError when it cannot be written; std::invalid_argument as GeoPath::check.
void write_gpx(const std::filesystem::path& path, const GeoPath& track);
/// One placemark: a gx:MultiTrack when all points have a time, otherwise a MultiGeometry of lines (a segment of one
/// point is a Point). Deviations have no place in it. @throws as write_gpx
void write_kml(const std::filesystem::path& path, const GeoPath& track);
/// One feature for each segment: LineString, MultiLineString where it is cut at the antimeridian, Point. Properties:
/// name, description, segment, and for each coordinate coordTimes and sigma_horizontal_m, sigma_vertical_m (null where
/// not known, nested as the coordinates are; where the line is cut they are interpolated).
/// @throws as write_gpx
void write_geojson(const std::filesystem::path& path, const GeoPath& track);

}  // namespace loc
