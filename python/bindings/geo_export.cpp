// Paths on the Earth for maps: io/geo_export.
#include "libloc/io/geo_export.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <optional>
#include <string>

#include "arrays.hpp"
#include "bindings.hpp"

namespace locpy {
namespace {

using Writer = void (*)(const std::filesystem::path&, const loc::GeoPath&);

void bind_writer(py::module_& m, const char* name, Writer writer, const char* format) {
  m.def(
      name,
      [writer](const std::filesystem::path& path, const FloatArray& latitude_longitude_altitude,
               const std::optional<TimeArray>& utc_ns, const std::optional<FloatArray>& sigma_horizontal,
               const std::optional<FloatArray>& sigma_vertical, const std::vector<std::size_t>& segments,
               const std::string& track_name, const std::string& description, double geoid_height) {
        const Rows<3> places = rows_view<3>(latitude_longitude_altitude, "latitude_longitude_altitude");
        loc::GeoPath track;
        track.name = track_name;
        track.description = description;
        track.geoid_height = geoid_height;
        track.points.resize(static_cast<std::size_t>(places.rows()));
        for (Eigen::Index i = 0; i < places.rows(); ++i) {
          track.points[static_cast<std::size_t>(i)].place = {places(i, 0), places(i, 1), places(i, 2)};
        }
        const auto fill = [&](const auto& values, const char* what, auto loc::GeoPathPoint::*field) {
          require_rows(static_cast<py::ssize_t>(values.size()), what, places.rows(), "latitude_longitude_altitude");
          for (std::size_t i = 0; i < track.points.size(); ++i) track.points[i].*field = values[i];
        };
        if (utc_ns) fill(times_view(*utc_ns, "utc_ns"), "utc_ns", &loc::GeoPathPoint::utc_ns);
        if (sigma_horizontal) {
          fill(values_view(*sigma_horizontal, "sigma_horizontal"), "sigma_horizontal",
               &loc::GeoPathPoint::sigma_horizontal);
        }
        if (sigma_vertical) {
          fill(values_view(*sigma_vertical, "sigma_vertical"), "sigma_vertical", &loc::GeoPathPoint::sigma_vertical);
        }
        for (const std::size_t begin : segments) {
          if (begin >= track.points.size()) {
            throw std::invalid_argument("segments: " + std::to_string(begin) + " is beyond the last point");
          }
          track.points[begin].begins_segment = true;
        }
        writer(path, track);
      },
      py::arg("path"), py::arg("latitude_longitude_altitude"), py::kw_only(), py::arg("utc_ns") = py::none(),
      py::arg("sigma_horizontal") = py::none(), py::arg("sigma_vertical") = py::none(),
      py::arg("segments") = std::vector<std::size_t>{}, py::arg("name") = "path", py::arg("description") = "",
      py::arg("geoid_height") = 0.0, format);
}

}  // namespace

void bind_geo_export(py::module_& m) {
  bind_writer(
      m, "write_gpx", &loc::write_gpx,
      "GPX 1.1: path (N, 3) [rad, rad, m above the ellipsoid], times int64 (N,) [ns since 1970, UTC], deviations "
      "(N,) [m]. segments: indices of points before which no line is drawn. geoid_height [m] is subtracted.");
  bind_writer(m, "write_kml", &loc::write_kml, "KML 2.2, arguments as of write_gpx; deviations have no place in it.");
  bind_writer(
      m, "write_geojson", &loc::write_geojson,
      "GeoJSON (RFC 7946), arguments as of write_gpx; lines are cut at the antimeridian, altitudes are above the "
      "ellipsoid.");
}

}  // namespace locpy
