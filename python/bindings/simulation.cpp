// sim/: sensors, scenarios and their runs as arrays.
#include "libloc/sim/simulation.hpp"

#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include <functional>
#include <map>
#include <string>
#include <variant>

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/io/simulation_source.hpp"
#include "libloc/sim/scenario_parameters.hpp"
#include "properties.hpp"
#include "recording.hpp"

namespace locpy {
namespace {

using loc::GpsModel;
using loc::ImuModel;
using loc::ImuSampleModel;
using loc::InertialTriadModel;
using loc::MagnetometerModel;
using loc::Scenario;
using loc::ScenarioCamera;
using loc::ScenarioStreams;
using loc::Simulation;
using loc::SimulationSource;
using loc::SimulationTruth;
using loc::StreamClockModel;
using loc::TimeInterval;
using loc::VisualOdometryModel;
using Intervals = std::vector<std::pair<double, double>>;

/// Intervals are a list of (begin, end) [s] in Python.
template <class Class, class T>
void intervals_property(Class& c, const char* name, std::vector<TimeInterval> T::*member, const char* doc) {
  c.def_property(
      name,
      [member](const T& self) {
        Intervals out;
        for (const TimeInterval& i : self.*member) out.emplace_back(i.begin_s, i.end_s);
        return out;
      },
      [member](T& self, const Intervals& value) {
        (self.*member).clear();
        for (const auto& [begin, end] : value) (self.*member).push_back({begin, end});
      },
      doc);
}

/// The text of a parameter's value: numbers and switches as Python has them, arrays and lists flattened.
std::string parameter_text(const py::handle& value) {
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>() ? "true" : "false";
  if (py::isinstance<py::int_>(value)) return py::str(value);
  std::string out;
  const auto values = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
  if (!values) {
    PyErr_Clear();
    throw py::type_error("a parameter is a number, a switch, a text, or an array of numbers");
  }
  for (py::ssize_t i = 0; i < values.size(); ++i) {
    out += (i == 0 ? "" : ", ") + py::repr(py::float_(values.data()[i])).cast<std::string>();
  }
  return out;
}

void set_parameters(Scenario& scenario, const py::dict& values) {
  for (const auto& [name, value] : values) {
    loc::set_parameter(scenario, name.cast<std::string>(), parameter_text(value));
  }
}

void bind_models(py::module_& m) {
  py::native_enum<ImuSampleModel>(m, "ImuSampleModel", "enum.Enum",
                                  "Which true value a reading of a simulated IMU stands for.")
      .value("POINT", ImuSampleModel::kPoint, "the value at the time of the sample")
      .value("INTERVAL_MEAN", ImuSampleModel::kIntervalMean, "mean since the last sample")
      .value("INCREMENT", ImuSampleModel::kIncrement,
             "change of attitude and velocity since the last sample over its length, without coning and sculling")
      .finalize();

  py::class_<InertialTriadModel> triad(m, "InertialTriadModel",
                                       "A simulated gyroscope [u = rad/s] or accelerometer [u = m/s^2].");
  triad.def(py::init<>())
      .def_readwrite("noise_density", &InertialTriadModel::noise_density, "[u/sqrt(Hz)], white")
      .def_readwrite("random_walk", &InertialTriadModel::random_walk, "[u/s/sqrt(Hz)], of the bias")
      .def_readwrite("instability_sigma", &InertialTriadModel::instability_sigma, "[u], Gauss-Markov part of the bias")
      .def_readwrite("instability_time_s", &InertialTriadModel::instability_time_s, "its time constant [s]")
      .def_readwrite("turn_on_bias_sigma", &InertialTriadModel::turn_on_bias_sigma, "[u], drawn once a run")
      .def_readwrite("range", &InertialTriadModel::range, "[u], saturates beyond")
      .def_readwrite("resolution", &InertialTriadModel::resolution, "[u], step of a reading; 0: not rounded");
  vector_property(triad, "constant_bias", &InertialTriadModel::constant_bias, "(3,) [u]");
  matrix_property(triad, "matrix", &InertialTriadModel::matrix, "(3, 3) scale and misalignment");

  py::class_<ImuModel> imu(m, "ImuModel", "A simulated IMU: reading = round(matrix * truth + bias + white noise).");
  imu.def(py::init<>())
      .def_readwrite("rate_hz", &ImuModel::rate_hz, "[Hz]")
      .def_readwrite("gyroscope", &ImuModel::gyroscope)
      .def_readwrite("accelerometer", &ImuModel::accelerometer)
      .def_readwrite("sampling", &ImuModel::sampling)
      .def_readwrite("accelerometer_sign", &ImuModel::accelerometer_sign,
                     "1: specific force, +9.81 upwards at rest; -1: its negative")
      .def_static("consumer", &ImuModel::consumer, "MEMS of a phone, 200 Hz.")
      .def_static(
          "vio_example", &ImuModel::vio_example,
          "That of the example \"Visual-Inertial Odometry Using Synthetic Data\", with the sign of specific force.")
      .def_static("perfect", &ImuModel::perfect, py::arg("rate_hz") = 200.0, "No error at all.")
      .def("check", &ImuModel::check, "Raises ValueError naming the field and its value.")
      .def("calibration", &ImuModel::calibration, "What calibration would tell of it.");
  vector_property(imu, "gravity", &ImuModel::gravity, "(3,) [m/s^2], in world");

  py::class_<MagnetometerModel> magnetometer(
      m, "MagnetometerModel", "A simulated magnetometer: reading = soft_iron * field + hard_iron + noise.");
  magnetometer.def(py::init<>())
      .def_readwrite("rate_hz", &MagnetometerModel::rate_hz, "[Hz]")
      .def_readwrite("sigma", &MagnetometerModel::sigma, "[T], white, of a sample")
      .def_readwrite("range", &MagnetometerModel::range, "[T], saturates beyond")
      .def_readwrite("resolution", &MagnetometerModel::resolution, "[T]; 0: not rounded")
      .def(
          "add_disturbance",
          [](MagnetometerModel& self, double begin_s, double end_s, const ArrayLike& field) {
            self.disturbances.push_back({{begin_s, end_s}, vector3(field, "field")});
          },
          py::arg("begin_s"), py::arg("end_s"), py::arg("field"), "A field in world [T] that is there for a while.")
      .def(
          "add_dipole",
          [](MagnetometerModel& self, const ArrayLike& position, const ArrayLike& moment, double radius) {
            self.dipoles.push_back({vector3(position, "position"), vector3(moment, "moment"), radius});
          },
          py::arg("position"), py::arg("moment"), py::arg("radius") = 0.5,
          "A magnet at a place in world [m], moment [A m^2]; within radius [m] its field grows no more.")
      .def("check", &MagnetometerModel::check, "Raises ValueError naming the field and its value.");
  vector_property(magnetometer, "field", &MagnetometerModel::field, "(3,) [T], of the world");
  vector_property(magnetometer, "hard_iron", &MagnetometerModel::hard_iron, "(3,) [T]");
  matrix_property(magnetometer, "soft_iron", &MagnetometerModel::soft_iron, "(3, 3)");

  py::class_<VisualOdometryModel> odometry(
      m, "VisualOdometryModel",
      "A simulated visual odometry: scale, white noise, drift; the defaults are the example's.");
  odometry.def(py::init<>())
      .def_readwrite("rate_hz", &VisualOdometryModel::rate_hz, "[Hz]")
      .def_readwrite("scale", &VisualOdometryModel::scale, "[unit/m]")
      .def_readwrite("scale_walk", &VisualOdometryModel::scale_walk,
                     "[1/sqrt(s)], random walk of the scale's logarithm")
      .def_readwrite("sigma_position", &VisualOdometryModel::sigma_position, "[unit], white")
      .def_readwrite("sigma_orientation", &VisualOdometryModel::sigma_orientation, "[rad], white")
      .def_readwrite("drift_sigma", &VisualOdometryModel::drift_sigma, "[unit]")
      .def_readwrite("drift_frames", &VisualOdometryModel::drift_frames, "time constant of the drift in frames")
      .def_readwrite("outlier_fraction", &VisualOdometryModel::outlier_fraction, "share of frames")
      .def_readwrite("outlier_position", &VisualOdometryModel::outlier_position, "[unit]")
      .def_readwrite("outlier_orientation", &VisualOdometryModel::outlier_orientation, "[rad]")
      .def_readwrite("latency_s", &VisualOdometryModel::latency_s, "arrival after the frame [s]")
      .def_readwrite("stamp_delay_s", &VisualOdometryModel::stamp_delay_s,
                     "stamps are later than the frame by this [s]")
      .def_readwrite("relative", &VisualOdometryModel::relative, "True: pose since the frame before")
      .def_readwrite("T_body_odometry", &VisualOdometryModel::T_body_odometry, "where the odometry's own axes are")
      .def_readwrite("told_sigma_position", &VisualOdometryModel::told_sigma_position, "[unit]; NaN: sigma_position")
      .def_readwrite("told_sigma_orientation", &VisualOdometryModel::told_sigma_orientation, "[rad]; NaN: 0.01")
      .def_property_readonly("drift_step_sigma", &VisualOdometryModel::drift_step_sigma,
                             "[unit], of one step of the drift")
      .def_static("perfect", &VisualOdometryModel::perfect, py::arg("rate_hz") = 25.0, "Metres, no error.")
      .def("check", &VisualOdometryModel::check, "Raises ValueError naming the field and its value.");
  vector_property(odometry, "drift_start", &VisualOdometryModel::drift_start, "(3,) [unit], before the first frame");
  intervals_property(odometry, "outages", &VisualOdometryModel::outages, "[(begin, end), ...] [s]: no measurement");

  py::class_<GpsModel> gps(m, "GpsModel", "A simulated GPS receiver: white and Gauss-Markov errors.");
  gps.def(py::init<>())
      .def_readwrite("rate_hz", &GpsModel::rate_hz, "[Hz]")
      .def_readwrite("sigma_horizontal", &GpsModel::sigma_horizontal, "[m], white")
      .def_readwrite("sigma_vertical", &GpsModel::sigma_vertical, "[m], white")
      .def_readwrite("coloured_sigma_horizontal", &GpsModel::coloured_sigma_horizontal, "[m], Gauss-Markov")
      .def_readwrite("coloured_sigma_vertical", &GpsModel::coloured_sigma_vertical, "[m], Gauss-Markov")
      .def_readwrite("coloured_time_s", &GpsModel::coloured_time_s, "its time constant [s]")
      .def_readwrite("with_velocity", &GpsModel::with_velocity)
      .def_readwrite("sigma_velocity_horizontal", &GpsModel::sigma_velocity_horizontal, "[m/s]")
      .def_readwrite("sigma_velocity_vertical", &GpsModel::sigma_velocity_vertical, "[m/s]")
      .def_readwrite("latency_s", &GpsModel::latency_s, "arrival after the time of validity [s]")
      .def_readwrite("stamp_delay_s", &GpsModel::stamp_delay_s, "stamps are later than validity by this [s]")
      .def_readwrite("fix", &GpsModel::fix)
      .def_readwrite("satellites", &GpsModel::satellites)
      .def_property(
          "origin",
          [](const GpsModel& self) {
            return std::tuple(self.origin.latitude, self.origin.longitude, self.origin.altitude);
          },
          [](GpsModel& self, const std::tuple<double, double, double>& value) {
            self.origin = {std::get<0>(value), std::get<1>(value), std::get<2>(value)};
          },
          "latitude, longitude [rad], altitude [m] of the world's origin")
      .def_static("single", &GpsModel::single, "A consumer's receiver: 0.5 m white, 1.5 m coloured, 1 Hz.")
      .def_static("rtk", &GpsModel::rtk, "Fixed ambiguities: 1 cm and 2 cm, 5 Hz.")
      .def("check", &GpsModel::check, "Raises ValueError naming the field and its value.");
  vector_property(gps, "antenna_in_body", &GpsModel::antenna_in_body, "(3,) lever arm [m]");
  intervals_property(gps, "outages", &GpsModel::outages, "[(begin, end), ...] [s]: no fix");

  py::class_<StreamClockModel>(m, "StreamClockModel",
                               "The clock of a simulated sensor; perfect unless changed. More of it by "
                               "Scenario.set: imu.clock.delay_exponential_ns, ...")
      .def(py::init<>())
      .def_readwrite("offset_s", &StreamClockModel::offset_s, "of the stamps, at the start [s]")
      .def_readwrite("loss_fraction", &StreamClockModel::loss_fraction, "share of samples that never arrive")
      .def_static("usb", &StreamClockModel::usb, "Own oscillator, 50 ppm off; delays of a USB device.");
}

void bind_scenario(py::module_& m) {
  py::class_<ScenarioStreams>(m, "ScenarioStreams", "Which streams a scenario has.")
      .def_readwrite("imu", &ScenarioStreams::imu)
      .def_readwrite("magnetometer", &ScenarioStreams::magnetometer)
      .def_readwrite("odometry", &ScenarioStreams::odometry)
      .def_readwrite("gps", &ScenarioStreams::gps)
      .def_readwrite("features", &ScenarioStreams::features)
      .def_readwrite("reference", &ScenarioStreams::reference);
  py::class_<Scenario>(m, "Scenario",
                       "A motion, the sensors that ride on it and the world around them. Change the models, then "
                       "simulate() it.")
      .def(py::init([](const std::string& name, std::optional<double> duration_s, const py::dict& values) {
             Scenario s = loc::make_scenario(name, duration_s.value_or(loc::kUnknown));
             set_parameters(s, values);
             return s;
           }),
           py::arg("name"), py::kw_only(), py::arg("duration_s") = py::none(), py::arg("parameters") = py::dict(),
           "A named one (scenario_names()). duration_s [s]: None: 60. parameters: {name: value}, as set() takes them.")
      .def_readwrite("name", &Scenario::name)
      .def_readonly("description", &Scenario::description)
      .def_property(
          "motion", [](const Scenario& self) { return std::const_pointer_cast<loc::Motion>(self.motion); },
          [](Scenario& self, std::shared_ptr<loc::Motion> motion) { self.motion = std::move(motion); }, "True motion.")
      .def_readwrite("duration_s", &Scenario::duration_s, "[s], at most that of the motion")
      .def_readwrite("start_time_ns", &Scenario::start_time_ns, "of time 0 of the motion, since 1970")
      .def_readwrite("streams", &Scenario::streams)
      .def_readwrite("imu", &Scenario::imu)
      .def_readwrite("imu_clock", &Scenario::imu_clock)
      .def_readwrite("magnetometer", &Scenario::magnetometer)
      .def_readwrite("magnetometer_clock", &Scenario::magnetometer_clock)
      .def_readwrite("odometry", &Scenario::odometry)
      .def_readwrite("odometry_clock", &Scenario::odometry_clock)
      .def_readwrite("gps", &Scenario::gps)
      .def_readwrite("gps_clock", &Scenario::gps_clock)
      .def_readwrite("reference_rate_hz", &Scenario::reference_rate_hz, "[Hz] of the truth")
      .def(
          "set",
          [](Scenario& self, const std::string& name, const py::object& value) {
            loc::set_parameter(self, name, parameter_text(value));
          },
          py::arg("name"), py::arg("value"),
          "Sets a parameter by name: \"imu.sampling\", \"odometry.latency_s\", \"gps.outages\", \"camera.sigma_px\"; "
          "see parameters(). Raises ValueError naming it.")
      .def(
          "parameters",
          [](const Scenario& self) {
            std::map<std::string, std::string> out;
            for (const loc::ScenarioParameter& p : loc::parameters(self)) out[p.name] = p.value;
            return out;
          },
          "All parameters and their values as text.")
      .def("rig", &Scenario::rig, "What a careful calibration of the sensors would give.")
      .def("check", &Scenario::check, "Raises ValueError naming the field and its value.");
  m.def(
      "scenario_names",
      [] {
        std::map<std::string, std::string> out;
        for (const loc::ScenarioInfo& info : loc::scenario_list()) out[info.name] = info.description;
        return out;
      },
      "The named scenarios and what they are.");
}

/// Truth of a run: columns of all its reference measurements.
struct TruthArrays {
  py::array_t<loc::TimeNs> times_ns;
  py::array_t<double> q_world_body_wxyz, position, velocity, acceleration, angular_velocity;
  py::array_t<double> gyroscope_bias, accelerometer_bias, odometry_scale, odometry_drift, gps_error;
};

TruthArrays truth_arrays(const std::vector<SimulationTruth>& truth) {
  std::vector<loc::TimeNs> times;
  std::vector<double> scale;
  std::vector<double> q;
  for (const SimulationTruth& t : truth) {
    times.push_back(t.time_ns);
    scale.push_back(t.odometry_scale);
    q.resize(q.size() + 4);
    write_wxyz(t.state.T_world_body.rotation, q.data() + q.size() - 4);
  }
  const auto column = [&](const std::function<Eigen::Vector3d(const SimulationTruth&)>& part) {
    std::vector<double> values;
    values.reserve(3 * truth.size());
    for (const SimulationTruth& t : truth) {
      const Eigen::Vector3d v = part(t);
      values.insert(values.end(), v.begin(), v.end());
    }
    return hand_over(std::move(values), 3);
  };
  TruthArrays out;
  out.times_ns = hand_over(std::move(times));
  out.q_world_body_wxyz = hand_over(std::move(q), 4);
  out.position = column([](const SimulationTruth& t) { return t.state.T_world_body.translation; });
  out.velocity = column([](const SimulationTruth& t) { return t.state.velocity; });
  out.acceleration = column([](const SimulationTruth& t) { return t.state.acceleration; });
  out.angular_velocity = column([](const SimulationTruth& t) { return t.state.angular_velocity; });
  out.gyroscope_bias = column([](const SimulationTruth& t) { return t.gyroscope_bias; });
  out.accelerometer_bias = column([](const SimulationTruth& t) { return t.accelerometer_bias; });
  out.odometry_scale = hand_over(std::move(scale));
  out.odometry_drift = column([](const SimulationTruth& t) { return t.odometry_drift; });
  out.gps_error = column([](const SimulationTruth& t) { return t.gps_error; });
  return out;
}

struct SimulatedRun {
  py::object recording;
  TruthArrays truth;
};

loc::SimulationOptions options(const std::string& order) {
  if (order == "time") return {loc::SimulationOptions::Order::kTime};
  if (order == "arrival") return {loc::SimulationOptions::Order::kArrival};
  throw py::value_error("order = '" + order + "': must be time or arrival");
}

void bind_runs(py::module_& m) {
  py::class_<TruthArrays>(
      m, "TruthArrays",
      "What was true, at the times of the reference measurements; NaN for sensors that the scenario has not.")
      .def_readonly("times_ns", &TruthArrays::times_ns, "(N,) int64")
      .def_readonly("q_world_body_wxyz", &TruthArrays::q_world_body_wxyz, "(N, 4)")
      .def_readonly("position", &TruthArrays::position, "(N, 3) [m], in world")
      .def_readonly("velocity", &TruthArrays::velocity, "(N, 3) [m/s], in world")
      .def_readonly("acceleration", &TruthArrays::acceleration, "(N, 3) [m/s^2], in world, without gravity")
      .def_readonly("angular_velocity", &TruthArrays::angular_velocity, "(N, 3) [rad/s], body axes")
      .def_readonly("gyroscope_bias", &TruthArrays::gyroscope_bias,
                    "(N, 3) [rad/s], of readings corrected with the rig")
      .def_readonly("accelerometer_bias", &TruthArrays::accelerometer_bias, "(N, 3) [m/s^2], likewise")
      .def_readonly("odometry_scale", &TruthArrays::odometry_scale, "(N,) [unit/m]")
      .def_readonly("odometry_drift", &TruthArrays::odometry_drift, "(N, 3) [unit]")
      .def_readonly("gps_error", &TruthArrays::gps_error, "(N, 3) [m], coloured part, east north up");
  py::class_<SimulatedRun>(m, "SimulatedRun", "A whole simulated recording with its truth.")
      .def_readonly("recording", &SimulatedRun::recording, "Recording, as read_recording() gives one.")
      .def_readonly("truth", &SimulatedRun::truth);
  py::class_<SimulationSource, loc::MeasurementSource>(
      m, "Simulation", "Runs a scenario and gives one measurement after the other; the same seed gives the same ones.")
      .def(py::init([](const Scenario& scenario, std::uint64_t seed, const std::string& order) {
             return std::make_unique<SimulationSource>(Simulation(scenario, seed, options(order)));
           }),
           py::arg("scenario"), py::arg("seed"), py::kw_only(), py::arg("order") = "time",
           "order: \"time\" (of the stamps), or \"arrival\" (late ones come late).")
      .def(
          "truth", [](const SimulationSource& self) { return truth_arrays(self.truth()); },
          "Of the reference measurements so far.");
  m.def(
      "simulate",
      [](const std::variant<Scenario, std::string>& scenario, std::uint64_t seed, std::optional<double> duration_s,
         const py::dict& values, const std::string& order) {
        Scenario s;
        if (const auto* name = std::get_if<std::string>(&scenario)) {
          s = loc::make_scenario(*name, duration_s.value_or(loc::kUnknown));
        } else {
          s = std::get<Scenario>(scenario);
          if (duration_s) s.duration_s = *duration_s;
        }
        set_parameters(s, values);
        auto source = std::make_unique<SimulationSource>(Simulation(s, seed, options(order)));
        const SimulationSource& view = *source;
        const py::object held = py::cast(std::move(source));
        SimulatedRun run;
        run.recording = held.attr("read_all")();
        run.truth = truth_arrays(view.truth());
        return run;
      },
      py::arg("scenario"), py::arg("seed"), py::kw_only(), py::arg("duration_s") = py::none(),
      py::arg("parameters") = py::dict(), py::arg("order") = "time",
      "A whole run as arrays, with its truth. scenario: a Scenario or the name of one; parameters: {name: value}, as "
      "Scenario.set takes them. The same seed gives the same numbers.");
}

}  // namespace

void bind_simulated_sensors(py::module_& m) {
  bind_models(m);
  bind_scenario(m);
  bind_runs(m);
}

}  // namespace locpy
