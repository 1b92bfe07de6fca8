// io/nmea: bytes of a receiver as arrays of fixes, logs as recordings; core/gps_time: the conversions of time.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/io/nmea_source.hpp"
#include "recording.hpp"

namespace locpy {
namespace {

struct NmeaFixes {
  py::array_t<loc::TimeNs> gps_times_ns;
  py::array_t<std::int8_t> fix;
  py::array_t<std::int32_t> satellites;
  py::array_t<double> latitude_longitude_altitude;
  py::array_t<double> position_cov;
  py::array_t<double> velocity_enu;
  std::map<std::string, std::int64_t> counts;
};

struct NmeaColumns {
  std::vector<loc::TimeNs> gps_times_ns;
  std::vector<std::int8_t> fix;
  std::vector<std::int32_t> satellites;
  std::vector<double> position;
  std::vector<double> position_cov;
  std::vector<double> velocity_enu;

  void add(const loc::GpsMeasurement& m) {
    gps_times_ns.push_back(m.gps_time_ns);
    fix.push_back(static_cast<std::int8_t>(m.fix));
    satellites.push_back(m.satellites);
    position.insert(position.end(), {m.latitude, m.longitude, m.altitude});
    position_cov.insert(position_cov.end(), m.position_cov.data(), m.position_cov.data() + 9);  // symmetric
    velocity_enu.insert(velocity_enu.end(), m.velocity_enu.data(), m.velocity_enu.data() + 3);
  }
};

loc::NmeaFixOptions fix_options(const std::optional<py::object>& reference_date, std::optional<int> leap_seconds,
                                std::optional<double> geoid_separation, double sigma_per_dop,
                                bool accept_not_measured) {
  loc::NmeaFixOptions options;
  if (reference_date) {
    const py::object& date = *reference_date;
    options.reference_date = {date.attr("year").cast<int>(), date.attr("month").cast<int>(),
                              date.attr("day").cast<int>()};
  }
  if (leap_seconds) options.leap_seconds = loc::LeapSeconds::constant(*leap_seconds);
  options.geoid_separation = geoid_separation;
  options.sigma_per_dop = sigma_per_dop;
  options.accept_not_measured = accept_not_measured;
  options.check();
  return options;
}

NmeaFixes parse(std::string_view data, const loc::NmeaFixOptions& options) {
  NmeaColumns columns;
  loc::NamedCounts counts;
  {
    const py::gil_scoped_release no_gil;
    loc::NmeaReader reader;
    loc::NmeaFixAssembler assembler(options);
    std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(data.data()), data.size());
    std::int64_t sentences = 0;
    while (const loc::NmeaSentence* sentence = reader.next(bytes)) {
      if (const auto fix = assembler.process(*sentence)) columns.add(*fix);
      if (++sentences % kSignalInterval == 0) check_signals();
    }
    reader.interrupt();
    if (const auto fix = assembler.finish()) columns.add(*fix);
    assembler.add_to(counts);
    reader.counts().add_to(counts);
  }
  NmeaFixes out;
  const auto rows = static_cast<py::ssize_t>(columns.fix.size());
  out.gps_times_ns = hand_over(std::move(columns.gps_times_ns));
  out.fix = hand_over(std::move(columns.fix));
  out.satellites = hand_over(std::move(columns.satellites));
  out.latitude_longitude_altitude = hand_over(std::move(columns.position), 3);
  out.position_cov = hand_over(std::move(columns.position_cov)).reshape({rows, py::ssize_t{3}, py::ssize_t{3}});
  out.velocity_enu = hand_over(std::move(columns.velocity_enu), 3);
  out.counts = as_map(counts);
  return out;
}

template <class... Extra>
void def_with_options(py::module_& m, const char* name, auto function, const char* doc, const Extra&... extra) {
  m.def(name, function, extra..., py::kw_only(), py::arg("reference_date") = py::none(),
        py::arg("leap_seconds") = py::none(), py::arg("geoid_separation") = py::none(), py::arg("sigma_per_dop") = 0.0,
        py::arg("accept_not_measured") = false, doc);
}

void bind_time(py::module_& m) {
  m.def(
      "gps_from_unix",
      [](loc::TimeNs unix_time_ns, std::optional<int> leap_seconds) {
        return leap_seconds ? loc::gps_from_unix(unix_time_ns, loc::LeapSeconds::constant(*leap_seconds))
                            : loc::gps_from_unix(unix_time_ns);
      },
      py::arg("unix_time_ns"), py::kw_only(), py::arg("leap_seconds") = py::none(),
      "Nanoseconds since 1970 (UTC) to GPS time: since 1980-01-06, leap seconds counted. None before 1980 and after "
      "2260. leap_seconds: GPS minus UTC, where the library's table is not to be used.");
  m.def(
      "unix_from_gps",
      [](loc::TimeNs gps_time_ns, std::optional<int> leap_seconds) {
        return leap_seconds ? loc::unix_from_gps(gps_time_ns, loc::LeapSeconds::constant(*leap_seconds))
                            : loc::unix_from_gps(gps_time_ns);
      },
      py::arg("gps_time_ns"), py::kw_only(), py::arg("leap_seconds") = py::none(),
      "GPS time to nanoseconds since 1970 (UTC); a leap second has the number of the second after it.");
  m.def(
      "leap_seconds_known_until", [] { return loc::to_text(loc::default_leap_seconds().known_until()); },
      "First day, as YYYY-MM-DD, of which the library's table of leap seconds does not know.");
}

}  // namespace

void bind_nmea(py::module_& m) {
  bind_time(m);
  py::class_<NmeaFixes>(m, "NmeaFixes", "One row for each epoch. What the receiver did not say is NaN.")
      .def_readonly("gps_times_ns", &NmeaFixes::gps_times_ns,
                    "(N,) int64, since 1980-01-06 without leap seconds; NO_TIME when unknown")
      .def_readonly("fix", &NmeaFixes::fix, "(N,) int8, GpsFixType; 0 rows have no position")
      .def_readonly("satellites", &NmeaFixes::satellites, "(N,) int32, -1 when unknown")
      .def_readonly("latitude_longitude_altitude", &NmeaFixes::latitude_longitude_altitude,
                    "(N, 3) [rad, rad, m above the ellipsoid]")
      .def_readonly("position_cov", &NmeaFixes::position_cov, "(N, 3, 3) [m^2], east, north, up")
      .def_readonly("velocity_enu", &NmeaFixes::velocity_enu, "(N, 3) [m/s], up is NaN")
      .def_readonly("counts", &NmeaFixes::counts, "Sentences by type, refused ones by reason, epochs without fix.");
  def_with_options(
      m, "parse_nmea",
      [](const py::bytes& data, const std::optional<py::object>& reference_date, std::optional<int> leap_seconds,
         std::optional<double> geoid_separation, double sigma_per_dop, bool accept_not_measured) {
        const auto options =
            fix_options(reference_date, leap_seconds, geoid_separation, sigma_per_dop, accept_not_measured);
        return parse(std::string_view(data), options);
      },
      "Fixes in the bytes of a receiver; anything may stand between the sentences. reference_date: a datetime.date "
      "at or after the data by less than 19 years, which resolves two-digit years and mends the dates of receivers "
      "that are past "
      "their "
      "1024 weeks. leap_seconds: GPS minus UTC instead of the library's table. geoid_separation [m]: where the "
      "receiver "
      "does not say it. sigma_per_dop [m]: covariance for fixes without GST; 0: NaN. accept_not_measured: "
      "dead-reckoned, manual and simulator positions count as fixes.",
      py::arg("data"));
  def_with_options(
      m, "open_nmea",
      [](const std::filesystem::path& path, const std::optional<py::object>& reference_date,
         std::optional<int> leap_seconds, std::optional<double> geoid_separation, double sigma_per_dop,
         bool accept_not_measured) {
        return loc::open_nmea(
            path, fix_options(reference_date, leap_seconds, geoid_separation, sigma_per_dop, accept_not_measured));
      },
      "The fixes of an NMEA log as a recording, on GPS time. Options as parse_nmea.", py::arg("path"));
}

}  // namespace locpy
