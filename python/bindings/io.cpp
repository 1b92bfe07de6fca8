// io/: sources of measurements, whole recordings as arrays, TUM trajectories, rig files.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <filesystem>
#include <memory>
#include <numbers>
#include <tuple>
#include <utility>

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/core/check.hpp"
#include "libloc/geometry/trajectory.hpp"
#include "libloc/io/broad.hpp"
#include "libloc/io/csv.hpp"
#include "libloc/io/eqvio.hpp"
#include "libloc/io/euroc.hpp"
#include "libloc/io/lcm_log.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "libloc/io/tum.hpp"
#include "msgs/decode.hpp"
#include "msgs/lcm_log_source.hpp"
#include "recording.hpp"

namespace locpy {
namespace {

namespace fs = std::filesystem;
using loc::MeasurementSource;

/// What Python keeps of a recording; the arrays own the vectors that were filled.
struct ImuArrays {
  py::array_t<loc::TimeNs> times_ns;
  py::array_t<double> angular_velocity;
  py::array_t<double> specific_force;
};
struct MagnetometerArrays {
  py::array_t<loc::TimeNs> times_ns;
  py::array_t<double> magnetic_field;
};
struct ReferenceArrays {
  py::array_t<loc::TimeNs> times_ns;
  py::array_t<double> q_world_body_wxyz;
  py::array_t<double> position;
  py::array_t<double> velocity;
  py::array_t<bool> score;
};
struct GpsArrays {
  py::array_t<loc::TimeNs> times_ns;
  py::array_t<double> latitude_longitude_altitude;
  py::array_t<double> position_cov;
  py::array_t<double> velocity_enu;
  py::array_t<double> velocity_cov;
  py::array_t<std::int8_t> fix;
};
struct OdometryArrays {
  py::array_t<loc::TimeNs> times_ns;
  py::array_t<loc::TimeNs> start_times_ns;
  py::array_t<double> position;
  py::array_t<double> q_wxyz;
  py::array_t<double> position_cov;
  py::array_t<double> orientation_cov;
};
struct FeaturesArrays {
  py::array_t<loc::TimeNs> times_ns;
  py::array_t<std::int32_t> camera;
  py::array_t<double> sigma_px;
  py::array_t<std::int64_t> first;
  py::array_t<std::int64_t> id;
  py::array_t<double> pixel_px;
};
struct Recording {
  ImuArrays imu;
  MagnetometerArrays magnetometer;
  ReferenceArrays reference;
  GpsArrays gps;
  OdometryArrays odometry;
  FeaturesArrays features;
  std::int64_t images = 0;
  std::map<std::string, std::int64_t> counts;
};

/// (N, 3, 3) of the rows of N matrices.
py::array_t<double> matrices(std::vector<double>&& values) {
  const auto n = static_cast<py::ssize_t>(values.size()) / 9;
  return hand_over(std::move(values)).reshape({n, py::ssize_t{3}, py::ssize_t{3}});
}

Recording read_all(MeasurementSource& source) {
  Columns columns;
  loc::NamedCounts counts;
  {
    const py::gil_scoped_release no_gil;
    py::ssize_t n = 0;
    while (const auto measurement = source.next()) {
      columns.add(*measurement);
      if (++n % kSignalInterval == 0) check_signals();
    }
    counts = source.counts();
  }
  Recording out;
  out.imu = {hand_over(std::move(columns.imu.times_ns)), hand_over(std::move(columns.imu.angular_velocity), 3),
             hand_over(std::move(columns.imu.specific_force), 3)};
  out.magnetometer = {hand_over(std::move(columns.magnetometer.times_ns)),
                      hand_over(std::move(columns.magnetometer.magnetic_field), 3)};
  auto& r = columns.reference;
  out.reference = {hand_over(std::move(r.times_ns)), hand_over(std::move(r.q_world_body_wxyz), 4),
                   hand_over(std::move(r.position), 3), hand_over(std::move(r.velocity), 3),
                   py::array_t<bool>(hand_over(std::move(r.score)).attr("view")("bool"))};
  auto& g = columns.gps;
  out.gps = {hand_over(std::move(g.times_ns)),    hand_over(std::move(g.latitude_longitude_altitude), 3),
             matrices(std::move(g.position_cov)), hand_over(std::move(g.velocity_enu), 3),
             matrices(std::move(g.velocity_cov)), hand_over(std::move(g.fix))};
  auto& o = columns.odometry;
  out.odometry = {hand_over(std::move(o.times_ns)),    hand_over(std::move(o.start_times_ns)),
                  hand_over(std::move(o.position), 3), hand_over(std::move(o.q_wxyz), 4),
                  matrices(std::move(o.position_cov)), matrices(std::move(o.orientation_cov))};
  auto& f = columns.features;
  out.features = {hand_over(std::move(f.times_ns)), hand_over(std::move(f.camera)),
                  hand_over(std::move(f.sigma_px)), hand_over(std::move(f.first)),
                  hand_over(std::move(f.id)),       hand_over(std::move(f.pixel_px), 2)};
  out.images = columns.images;
  out.counts = as_map(counts);
  return out;
}

void bind_recording(py::module_& m) {
  py::class_<ImuArrays>(m, "ImuArrays", "IMU samples of a recording; empty when there are none.")
      .def_readonly("times_ns", &ImuArrays::times_ns, "(N,) int64")
      .def_readonly("angular_velocity", &ImuArrays::angular_velocity, "(N, 3) [rad/s]")
      .def_readonly("specific_force", &ImuArrays::specific_force, "(N, 3) [m/s^2], at rest +9.81 upwards");
  py::class_<MagnetometerArrays>(m, "MagnetometerArrays", "Magnetometer samples, empty when there are none.")
      .def_readonly("times_ns", &MagnetometerArrays::times_ns, "(N,) int64")
      .def_readonly("magnetic_field", &MagnetometerArrays::magnetic_field, "(N, 3) [T]");
  py::class_<ReferenceArrays>(m, "ReferenceArrays", "Truth, empty when there is none; NaN where it does not know.")
      .def_readonly("times_ns", &ReferenceArrays::times_ns, "(N,) int64")
      .def_readonly("q_world_body_wxyz", &ReferenceArrays::q_world_body_wxyz, "(N, 4)")
      .def_readonly("position", &ReferenceArrays::position, "(N, 3) [m], of body in world")
      .def_readonly("velocity", &ReferenceArrays::velocity, "(N, 3) [m/s], in world")
      .def_readonly("score", &ReferenceArrays::score, "(N,) bool; False: do not score here");
  py::class_<GpsArrays>(m, "GpsArrays", "GPS fixes, empty when there are none; NaN where the receiver did not say.")
      .def_readonly("times_ns", &GpsArrays::times_ns, "(N,) int64")
      .def_readonly("latitude_longitude_altitude", &GpsArrays::latitude_longitude_altitude, "(N, 3) [rad, rad, m]")
      .def_readonly("position_cov", &GpsArrays::position_cov, "(N, 3, 3) [m^2], east, north, up")
      .def_readonly("velocity_enu", &GpsArrays::velocity_enu, "(N, 3) [m/s]")
      .def_readonly("velocity_cov", &GpsArrays::velocity_cov, "(N, 3, 3) [m^2/s^2]")
      .def_readonly("fix", &GpsArrays::fix, "(N,) int8, GpsFixType");
  py::class_<OdometryArrays>(m, "OdometryArrays", "Odometry, empty when there is none; lengths in its own unit.")
      .def_readonly("times_ns", &OdometryArrays::times_ns, "(N,) int64")
      .def_readonly("start_times_ns", &OdometryArrays::start_times_ns,
                    "(N,) int64, from when a relative pose counts; the smallest int64 (NO_TIME): absolute")
      .def_readonly("position", &OdometryArrays::position, "(N, 3) [odometry's unit]")
      .def_readonly("q_wxyz", &OdometryArrays::q_wxyz, "(N, 4), takes body to world, or to body at the start")
      .def_readonly("position_cov", &OdometryArrays::position_cov, "(N, 3, 3) [unit^2]")
      .def_readonly("orientation_cov", &OdometryArrays::orientation_cov, "(N, 3, 3) [rad^2], axes of body");
  py::class_<FeaturesArrays>(m, "FeaturesArrays",
                             "Features of N frames, empty when there are none. Those of frame i are rows "
                             "first[i]:first[i + 1] of id and pixel_px.")
      .def_readonly("times_ns", &FeaturesArrays::times_ns, "(N,) int64")
      .def_readonly("camera", &FeaturesArrays::camera, "(N,) int32, index of the camera in the rig")
      .def_readonly("sigma_px", &FeaturesArrays::sigma_px, "(N,), deviation of one coordinate; NaN when unknown")
      .def_readonly("first", &FeaturesArrays::first, "(N + 1,) int64")
      .def_readonly("id", &FeaturesArrays::id, "(M,) int64, the same for the same point of the scene")
      .def_readonly("pixel_px", &FeaturesArrays::pixel_px, "(M, 2), u and v in the distorted image");
  py::class_<Recording>(m, "Recording", "A whole recording as arrays.")
      .def_readonly("imu", &Recording::imu)
      .def_readonly("magnetometer", &Recording::magnetometer)
      .def_readonly("reference", &Recording::reference)
      .def_readonly("gps", &Recording::gps)
      .def_readonly("odometry", &Recording::odometry)
      .def_readonly("features", &Recording::features)
      .def_readonly("images", &Recording::images, "How many pictures there were; iterate over a source to get them.")
      .def_readonly("counts", &Recording::counts, "What was read and what was skipped, and why.");
}

void bind_sources(py::module_& m) {
  py::class_<MeasurementSource>(m, "MeasurementSource",
                                "Iterates over the measurements of a recording in time order, in constant memory. "
                                "DataError names file, line or byte, field and value when it cannot be read on.")
      .def("__iter__", [](const py::object& self) { return self; })
      .def("__next__",
           [](MeasurementSource& self) {
             std::optional<loc::Measurement> measurement;
             {
               const py::gil_scoped_release no_gil;
               measurement = self.next();
             }
             if (!measurement) throw py::stop_iteration();
             return std::move(*measurement);
           })
      .def("read_all", &read_all, "The rest of the recording as arrays.")
      .def_property_readonly(
          "origin",
          [](const MeasurementSource& self) {
            std::optional<std::tuple<double, double, double>> out;
            const auto* log = dynamic_cast<const loc::LcmLogSource*>(&self);
            const std::optional<loc::GeodeticPoint> origin = log != nullptr ? log->origin() : std::nullopt;
            if (origin) out.emplace(origin->latitude, origin->longitude, origin->altitude);
            return out;
          },
          "Latitude, longitude [rad] and altitude [m] of the world's origin of a reference that is given in degrees "
          "(ASPN-23); None before its first position, and for other recordings.")
      .def(
          "counts", [](const MeasurementSource& self) { return as_map(self.counts()); },
          "What was read and what was skipped, and why: {name: number}.");
  m.def(
      "open_euroc",
      [](const fs::path& folder, bool reference, bool magnetometer, bool gps, bool odometry) {
        return loc::open_euroc(folder, {.read_reference = reference,
                                        .read_magnetometer = magnetometer,
                                        .read_gps = gps,
                                        .read_odometry = odometry});
      },
      py::arg("folder"), py::kw_only(), py::arg("reference") = true, py::arg("magnetometer") = true,
      py::arg("gps") = true, py::arg("odometry") = true, "A EuRoC / ASL recording: the folder that holds mav0.");
  m.def(
      "open_csv",
      [](const fs::path& path, const std::string& time_unit, const std::string& angular_velocity_unit,
         const std::string& specific_force_unit, const std::string& magnetic_field_unit, double tesla_per_unit) {
        return loc::open_csv(path, {.time_unit = time_unit,
                                    .angular_velocity_unit = angular_velocity_unit,
                                    .specific_force_unit = specific_force_unit,
                                    .magnetic_field_unit = magnetic_field_unit,
                                    .tesla_per_unit = tesla_per_unit});
      },
      py::arg("path"), py::kw_only(), py::arg("time_unit") = "", py::arg("angular_velocity_unit") = "",
      py::arg("specific_force_unit") = "", py::arg("magnetic_field_unit") = "", py::arg("tesla_per_unit") = 0.0,
      "A CSV file whose first line names columns and units: time_ns or \"t [s]\", wx wy wz, ax ay az, mx my mz, "
      "qw qx qy qz, px py pz, latitude longitude altitude, odo_px odo_py odo_pz ... The units given here are for "
      "headings that have none.");
  py::class_<loc::EqvioSource, MeasurementSource>(m, "EqvioSource",
                                                  "Tracks and IMU of a file of GTSAM's EqVIO example.")
      .def_property_readonly(
          "rig", [](const loc::EqvioSource& self) { return self.rig(); }, "Has the camera that the pixels are of.");
  m.def(
      "open_eqvio",
      [](const fs::path& path, const std::optional<loc::CameraCalibration>& camera, double sigma_px) {
        return loc::open_eqvio(path, {.camera = camera, .sigma_px = sigma_px});
      },
      py::arg("path"), py::kw_only(), py::arg("camera") = py::none(), py::arg("sigma_px") = loc::kUnknown,
      "Tracks and IMU of a file of GTSAM's EqVIO example, whose points are without pixels: as the camera would have "
      "seen "
      "them, by default a pinhole of the file's focal lengths.");
  m.def("is_eqvio", &loc::is_eqvio, py::arg("path"), "Whether the first line is the heading of such a file.");
  m.def(
      "open_broad",
      [](const fs::path& path, bool reference) {
        return loc::open_broad(path, {.start_ns = 0, .read_reference = reference});
      },
      py::arg("path"), py::kw_only(), py::arg("reference") = true, "A trial of the BROAD data set (.mat).");
  m.def(
      "open_lcm_log",
      [](const fs::path& path) -> std::unique_ptr<MeasurementSource> { return loc::open_lcm_log(path); },
      py::arg("path"),
      "The measurements in an LCM log, in the order of the log: package loc's types and ASPN-23's. What cannot be "
      "decoded is counted.");
}

void bind_lcm_log(py::module_& m) {
  py::class_<loc::LcmLogReader>(m, "LcmLogReader",
                                "Iterates over the events of an LCM log: (event number, log time [us since 1970], "
                                "channel, data). Damage is skipped to the next event and reported by damage().")
      .def(py::init([](const fs::path& path) { return std::make_unique<loc::LcmLogReader>(path); }), py::arg("path"),
           "DataError when the file is missing, not a regular file, or empty.")
      .def("__iter__", [](const py::object& self) { return self; })
      .def("__next__",
           [](loc::LcmLogReader& self) {
             const loc::LcmLogEvent* event = self.next();
             if (event == nullptr) throw py::stop_iteration();
             PyObject* channel = PyUnicode_DecodeUTF8(
                 event->channel.data(), static_cast<Py_ssize_t>(event->channel.size()), "backslashreplace");
             if (channel == nullptr) throw py::error_already_set();
             return std::tuple(event->number, event->log_time_us, py::reinterpret_steal<py::str>(channel),
                               py::bytes(reinterpret_cast<const char*>(event->data.data()), event->data.size()));
           })
      .def(
          "damage",
          [](const loc::LcmLogReader& self) {
            const loc::LcmLogDamage& d = self.damage();
            std::map<std::string, std::int64_t> out;
            if (d.first_gap_offset) {
              out["gaps"] = d.gaps;
              out["skipped_bytes"] = d.skipped_bytes;
              out["first_gap_at_byte"] = static_cast<std::int64_t>(*d.first_gap_offset);
            }
            if (d.truncated_at) {
              out["truncated_at_byte"] = static_cast<std::int64_t>(*d.truncated_at);
              out["truncated_bytes"] = d.truncated_bytes;
            }
            return out;
          },
          "What was not readable so far; empty when all was.");
}

void bind_geodesy(py::module_& m) {
  m.def(
      "local_positions",
      [](const FloatArray& geodetic, const ArrayLike& origin) {
        const Rows<3> rows = rows_view<3>(geodetic, "latitude_longitude_altitude");
        constexpr double kDegrees = 180 / std::numbers::pi;
        const Eigen::Vector3d at = vector3(origin, "origin");
        if (!at.allFinite() || std::abs(at.x()) * kDegrees > 90) {
          throw py::value_error("origin: must be finite, with a latitude between -pi/2 and pi/2");
        }
        const GeographicLib::LocalCartesian plane(at.x() * kDegrees, at.y() * kDegrees, at.z());
        py::array_t<double> out({rows.rows(), Eigen::Index{3}});
        double* p = out.mutable_data();
        for (Eigen::Index i = 0; i < rows.rows(); ++i, p += 3) {
          plane.Forward(rows(i, 0) * kDegrees, rows(i, 1) * kDegrees, rows(i, 2), p[0], p[1], p[2]);
        }
        return out;
      },
      py::arg("latitude_longitude_altitude"), py::arg("origin"),
      "East, north, up (N, 3) [m] of positions on the WGS 84 ellipsoid, [rad, rad, m], in the plane that touches it at "
      "the origin. NaN stays NaN.");
}

void bind_tum(py::module_& m) {
  m.def(
      "read_tum",
      [](const fs::path& path) {
        loc::TumFile file = loc::read_tum(path);
        return std::pair(std::move(file.trajectory), as_map(file.counts));
      },
      py::arg("path"),
      "A trajectory in TUM's format, and what was read and skipped. DataError names file, line and value.");
  m.def("write_tum", &loc::write_tum, py::arg("path"), py::arg("trajectory"), py::arg("frame") = "body",
        "Writes a trajectory in TUM's format; frame: whose poses they are, for the heading.");
}

}  // namespace

void bind_io(py::module_& m) {
  bind_recording(m);
  bind_sources(m);
  bind_lcm_log(m);
  bind_tum(m);
  bind_geodesy(m);
  m.def("read_rig", &loc::read_rig, py::arg("path"), "rig.yaml. DataError names file, line, key and value.");
  m.def("read_any_rig", &loc::read_any_rig, py::arg("path"),
        "rig.yaml, Kalibr's camchain or imu.yaml, EuRoC's sensor.yaml: whichever it is.");
  m.def("write_rig", &loc::write_rig, py::arg("path"), py::arg("rig"),
        "Writes rig.yaml; read_rig gives the same numbers back.");
  m.def("write_kalibr_camchain", &loc::write_kalibr_camchain, py::arg("path"), py::arg("rig"),
        "The rig's cameras as Kalibr's camchain: cam0, cam1, ... with T_cam_imu, T_cn_cnm1 and timeshift_cam_imu "
        "(t_imu = t_cam + shift). ValueError without a camera.");
  m.def("write_kalibr_imu", &loc::write_kalibr_imu, py::arg("path"), py::arg("rig"),
        "The IMU's noise and rate as Kalibr's imu.yaml. ValueError without an IMU.");
  m.def(
      "update_rig",
      [](const fs::path& path, const py::typing::Callable<void(py::object)>& change) {
        return loc::update_rig(path, [&](loc::Rig& rig) {
          // Python gets its own copy: it may keep it.
          const py::object own = py::cast(rig);
          change(own);
          rig = own.cast<loc::Rig>();
        });
      },
      py::arg("path"), py::arg("change"),
      "Reads rig.yaml (an empty rig when there is none), calls change(rig), which alters it, and writes it. What is "
      "not "
      "changed stays as it was to the last bit, but comments are lost. When anything raises, the file stays as it "
      "was.");
}

}  // namespace locpy
