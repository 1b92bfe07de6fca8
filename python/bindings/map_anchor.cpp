// Ties the map of SLAM to the Earth: estimators/map_anchor.
#include "libloc/estimators/map_anchor.hpp"

#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "fields.hpp"
#include "recording.hpp"
#include "slam_results.hpp"

namespace locpy {
namespace {

using loc::Estimate;
using loc::GpsMeasurement;
using loc::MapAnchor;
using loc::MapAnchorOptions;

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;  // a few for each fix
using FixTypes = py::array_t<std::int8_t, py::array::c_style | py::array::forcecast>;
using Origin = std::tuple<double, double, double>;

Origin origin_of(const loc::LocalFrame& world) {
  const loc::GeodeticPoint& o = world.origin();
  return {o.latitude, o.longitude, o.altitude};
}

struct AnchoredRun {
  py::array_t<loc::TimeNs> time_ns;
  py::array_t<std::uint32_t> valid, status;
  py::array_t<double> q_world_body_wxyz, position, velocity, covariance;
  py::array_t<bool> georeferenced;
  std::optional<Origin> origin;
  double scale = 1;
  std::map<std::string, std::int64_t> counts;
};

// Row i of a run, as its estimator gave it.
Estimate estimate_of(const SlamRun& run, py::ssize_t i) {
  Estimate out;
  out.time_ns = run.time_ns.at(i);
  out.valid = run.valid.at(i);
  out.status = run.status.at(i);
  const double* q = run.q_world_body_wxyz.data(i, 0);
  out.q_world_body = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  out.position = Eigen::Map<const Eigen::Vector3d>(run.position.data(i, 0));
  out.velocity = Eigen::Map<const Eigen::Vector3d>(run.velocity.data(i, 0));
  out.angular_velocity = Eigen::Map<const Eigen::Vector3d>(run.angular_velocity.data(i, 0));
  if (run.covariance.ndim() == 3 && run.covariance.shape(0) == run.time_ns.size()) {
    const auto d = static_cast<int>(run.covariance.shape(1));
    out.covariance_dim = d;
    out.covariance.topLeftCorner(d, d) = Eigen::Map<const Eigen::MatrixXd>(run.covariance.data(i, 0, 0), d, d);
  } else {
    out.valid &= ~static_cast<std::uint32_t>(loc::kValidCovariance);
  }
  return out;
}

std::vector<GpsMeasurement> fixes_of(const TimeArray& times, const FloatArray& places,
                                     const std::optional<Numbers>& cov, const std::optional<Numbers>& velocity,
                                     const std::optional<Numbers>& velocity_cov, const std::optional<FixTypes>& fix) {
  const auto time = times_view(times, "times_ns");
  const auto n = static_cast<py::ssize_t>(time.size());
  const Rows<3> place = rows_view<3>(places, "latitude_longitude_altitude", n, "times_ns");
  const auto numbers_of = [&](const std::optional<Numbers>& array, py::ssize_t each,
                              const char* name) -> const double* {
    if (!array) return nullptr;
    if (array->size() != n * each) {
      throw py::value_error(std::string(name) + " must have " + std::to_string(n * each) + " numbers; has " +
                            std::to_string(array->size()));
    }
    return array->data();
  };
  const double* covs = numbers_of(cov, 9, "position_cov");
  const double* velocities = numbers_of(velocity, 3, "velocity_enu");
  const double* velocity_covs = numbers_of(velocity_cov, 9, "velocity_cov");
  if (fix && fix->size() != n) throw py::value_error("fix must have " + std::to_string(n) + " numbers");
  std::vector<GpsMeasurement> out(time.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    GpsMeasurement& gps = out[i];
    gps.time_ns = time[i];
    gps.sequence = static_cast<std::int64_t>(i);
    if (fix) {
      const int type = fix->data()[i];
      if (type < 0 || type > static_cast<int>(loc::GpsFixType::kFixed)) {
        throw py::value_error("fix[" + std::to_string(i) + "] = " + std::to_string(type) + ": there is no such type");
      }
      gps.fix = static_cast<loc::GpsFixType>(type);
    } else {
      gps.fix = loc::GpsFixType::k3d;
    }
    const auto row = static_cast<Eigen::Index>(i);
    gps.latitude = place(row, 0);
    gps.longitude = place(row, 1);
    gps.altitude = place(row, 2);
    if (covs != nullptr) gps.position_cov = Eigen::Map<const Eigen::Matrix3d>(covs + 9 * i);
    if (velocities != nullptr) gps.velocity_enu = Eigen::Map<const Eigen::Vector3d>(velocities + 3 * i);
    if (velocity_covs != nullptr) gps.velocity_cov = Eigen::Map<const Eigen::Matrix3d>(velocity_covs + 9 * i);
  }
  // A recording has them in the order of arrival.
  std::stable_sort(out.begin(), out.end(),
                   [](const GpsMeasurement& a, const GpsMeasurement& b) { return a.time_ns < b.time_ns; });
  return out;
}

AnchoredRun anchor_run(const SlamRun& run, const std::vector<GpsMeasurement>& fixes, const MapAnchorOptions& options) {
  MapAnchor anchor(options);
  const py::ssize_t n = run.time_ns.size();
  std::vector<Estimate> rows;
  rows.reserve(static_cast<std::size_t>(n));
  std::size_t next = 0;
  std::size_t first_of_map = 0;  // row of the map that is being tied to the Earth
  std::int64_t map = anchor.map_number();
  bool tied = false;
  for (py::ssize_t i = 0; i < n; ++i) {
    const Estimate in_map = estimate_of(run, i);
    for (; next < fixes.size() && fixes[next].time_ns <= in_map.time_ns; ++next) anchor.fuse(fixes[next]);
    anchor.move(in_map);
    rows.push_back(anchor.in_world(in_map));
    rows.back().status |= anchor.take_status();
    if (anchor.map_number() != map) {
      map = anchor.map_number();
      first_of_map = rows.size() - 1;
      tied = false;
    }
    if (!anchor.anchored() || std::exchange(tied, true)) continue;
    // What came before in the same map is on the Earth now, too.
    for (std::size_t k = first_of_map; k + 1 < rows.size(); ++k) rows[k] = anchor.in_world(rows[k]);
  }
  AnchoredRun out;
  const bool with_covariance = n > 0 && rows.front().covariance_dim > 0;
  const int d = with_covariance ? rows.front().covariance_dim : 0;
  out.time_ns = py::array_t<loc::TimeNs>(n);
  out.valid = py::array_t<std::uint32_t>(n);
  out.status = py::array_t<std::uint32_t>(n);
  out.georeferenced = py::array_t<bool>(n);
  out.q_world_body_wxyz = py::array_t<double>({n, py::ssize_t{4}});
  out.position = py::array_t<double>({n, py::ssize_t{3}});
  out.velocity = py::array_t<double>({n, py::ssize_t{3}});
  out.covariance = py::array_t<double>({with_covariance ? n : 0, py::ssize_t{d}, py::ssize_t{d}});
  for (py::ssize_t i = 0; i < n; ++i) {
    const Estimate& e = rows[static_cast<std::size_t>(i)];
    out.time_ns.mutable_at(i) = e.time_ns;
    out.valid.mutable_at(i) = e.valid;
    out.status.mutable_at(i) = e.status;
    out.georeferenced.mutable_at(i) = std::isfinite(e.origin.latitude);
    write_wxyz(e.q_world_body, out.q_world_body_wxyz.mutable_data(i, 0));
    Eigen::Map<Eigen::Vector3d>(out.position.mutable_data(i, 0)) = e.position;
    Eigen::Map<Eigen::Vector3d>(out.velocity.mutable_data(i, 0)) = e.velocity;
    if (with_covariance) {
      Eigen::Map<Eigen::MatrixXd>(out.covariance.mutable_data(i, 0, 0), d, d) = e.covariance.topLeftCorner(d, d);
    }
  }
  const bool any =
      std::any_of(rows.begin(), rows.end(), [](const Estimate& e) { return std::isfinite(e.origin.latitude); });
  if (any) out.origin = origin_of(*anchor.world());
  out.scale = anchor.anchored() ? anchor.state().scale : loc::kUnknown;
  out.counts = as_map(anchor.counts());
  return out;
}

void bind_options(py::module_& m) {
  using O = MapAnchorOptions;
  py::class_<O> c(m, "MapAnchorOptions",
                  "How GPS ties a map to the Earth. MapAnchorOptions(inertial=True) is for real receivers and a map in "
                  "metres; every field is a keyword of the constructor.");
  c.def(py::init([](bool inertial, const py::kwargs& fields) {
          O options = O::robust(inertial);
          set_fields("MapAnchorOptions", options, fields);
          options.check();
          return options;
        }),
        py::arg("inertial") = true, "TypeError for an unknown field; ValueError for a value out of range.")
      .def("__copy__", [](const O& o) { return O(o); })
      .def_readwrite("scale_known", &O::scale_known, "The map is in metres; otherwise scale and tilt are found, too.")
      .def_readwrite("scale_sigma", &O::scale_sigma, "of a scale that is known, relative")
      .def_readwrite("tilt_sigma", &O::tilt_sigma, "of the map's z against the vertical [rad]")
      .def_readwrite("use_gps_velocity", &O::use_gps_velocity)
      .def_readwrite("position_walk", &O::position_walk, "of the map [m/sqrt(m)]")
      .def_readwrite("heading_walk", &O::heading_walk, "[rad/sqrt(m)]")
      .def_readwrite("tilt_walk", &O::tilt_walk, "[rad/sqrt(m)]")
      .def_readwrite("scale_walk", &O::scale_walk, "relative [1/sqrt(m)]")
      .def_readwrite("start_heading_sigma", &O::start_heading_sigma, "[rad]")
      .def_readwrite("start_scale_sigma", &O::start_scale_sigma, "relative")
      .def_readwrite("gate_probability", &O::gate_probability)
      .def_readwrite("reject_count", &O::reject_count)
      .def_readwrite("reject_time_s", &O::reject_time_s)
      .def_readwrite("history_s", &O::history_s, "a fix may be so late [s]")
      .def_readwrite("outage_s", &O::outage_s, "[s]")
      .def_readwrite("gps_sigma", &O::gps_sigma, "of a fix that does not say, horizontal [m]")
      .def_readwrite("gps_sigma_floor", &O::gps_sigma_floor, "[m]")
      .def_readwrite("gps_velocity_sigma", &O::gps_velocity_sigma, "[m/s]")
      .def_readwrite("gps_velocity_sigma_floor", &O::gps_velocity_sigma_floor, "[m/s]")
      .def_readwrite("gps_time_sigma", &O::gps_time_sigma, "[s]")
      .def_readwrite("gps_correlation_time_s", &O::gps_correlation_time_s, "[s]; 0: white")
      .def_property(
          "origin",
          [](const O& o) -> std::optional<Origin> {
            if (!o.origin) return std::nullopt;
            return Origin(o.origin->latitude, o.origin->longitude, o.origin->altitude);
          },
          [](O& o, const std::optional<Origin>& origin) {
            o.origin.reset();
            if (origin) o.origin = loc::GeodeticPoint{std::get<0>(*origin), std::get<1>(*origin), std::get<2>(*origin)};
          },
          "of world: latitude, longitude [rad], altitude [m]; None: the first fix");
  c.def_property(
      "gps_antenna", [](const O& o) { return to_array(o.gps_antenna); },
      [](O& o, const ArrayLike& value) { o.gps_antenna = vector3(value, "gps_antenna"); },
      "(3,) lever arm in body axes [m]");
}

}  // namespace

void bind_map_anchor(py::module_& m) {
  bind_options(m);
  using R = AnchoredRun;
  py::class_<R>(m, "AnchoredRun", "A run of SLAM on the Earth; rows as those of the SlamRun.")
      .def_readonly("time_ns", &R::time_ns, "(N,) int64")
      .def_readonly("valid", &R::valid, "(N,) uint32, EstimateValid")
      .def_readonly("status", &R::status, "(N,) uint32, EstimateStatus")
      .def_readonly("q_world_body_wxyz", &R::q_world_body_wxyz, "(N, 4)")
      .def_readonly("position", &R::position, "(N, 3) east, north, up of origin [m]")
      .def_readonly("velocity", &R::velocity, "(N, 3) [m/s]")
      .def_readonly("covariance", &R::covariance, "(N, d, d), as SlamRun's; (0, 0, 0) when that has none")
      .def_readonly("georeferenced", &R::georeferenced, "(N,) bool; False: as in the map")
      .def_readonly("origin", &R::origin, "latitude, longitude [rad], altitude [m]; None when GPS never told enough")
      .def_readonly("scale", &R::scale, "metres a unit of the map, at the end")
      .def_readonly("counts", &R::counts);
  m.def(
      "anchor_run",
      [](const SlamRun& run, const TimeArray& times, const FloatArray& places, const MapAnchorOptions& options,
         const std::optional<Numbers>& cov, const std::optional<Numbers>& velocity,
         const std::optional<Numbers>& velocity_cov, const std::optional<FixTypes>& fix) {
        return anchor_run(run, fixes_of(times, places, cov, velocity, velocity_cov, fix), options);
      },
      py::arg("run"), py::arg("gps_times_ns"), py::arg("latitude_longitude_altitude"), py::arg("options"),
      py::kw_only(), py::arg("position_cov") = py::none(), py::arg("velocity_enu") = py::none(),
      py::arg("velocity_cov") = py::none(), py::arg("fix") = py::none(),
      "What loc-estimator does with GPS, for a run that is there already: fixes (K,) in the order of time, fields as "
      "those of Recording.gps. Rows from before the start are put on the Earth by what was known then.");
}

}  // namespace locpy
