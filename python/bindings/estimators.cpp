// estimators/: the Madgwick filter, step by step and over whole arrays.
#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <string_view>
#include <tuple>
#include <utility>
#include <variant>

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/estimators/madgwick.hpp"
#include "recording.hpp"

namespace locpy {
namespace {

using loc::ImuMeasurement;
using loc::MadgwickFilter;
using loc::MadgwickOptions;
using loc::MagnetometerMeasurement;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Results of a whole array.
struct MadgwickResult {
  py::array_t<double> q_world_body_wxyz;
  py::array_t<double> gyroscope_bias;
  py::array_t<std::uint32_t> status;
  py::ssize_t magnetometer_used = 0;
};

/// The filter, and a flag that is set while a call works without the GIL: two threads must not step one filter.
class PyMadgwick {
 public:
  explicit PyMadgwick(const MadgwickOptions& options) : filter_(options) {}

  std::uint32_t update(loc::TimeNs time_ns, const ArrayLike& gyro, const ArrayLike& force) {
    ImuMeasurement imu;
    imu.time_ns = time_ns;
    imu.angular_velocity = vector3(gyro, "gyro");
    imu.specific_force = vector3(force, "force");
    return idle().update(imu);
  }

  std::uint32_t update_magnetometer(loc::TimeNs time_ns, const ArrayLike& field) {
    MagnetometerMeasurement magnetometer;
    magnetometer.time_ns = time_ns;
    magnetometer.magnetic_field = vector3(field, "field");
    return idle().update(magnetometer);
  }

  MadgwickResult run(const TimeArray& times, const FloatArray& gyro, const FloatArray& force,
                     const std::optional<FloatArray>& field, const std::optional<TimeArray>& field_times);

  /// @throws std::runtime_error while run() is at work in another thread.
  MadgwickFilter& idle() {
    if (busy_) throw std::runtime_error("this MadgwickFilter is running in another thread");
    return filter_;
  }

 private:
  MadgwickFilter filter_;
  std::atomic<bool> busy_ = false;
};

/// The magnetometer's samples in time order, given to the filter before the first IMU sample that is not earlier.
class FieldSamples {
 public:
  FieldSamples(std::span<const loc::TimeNs> times, const double* field, bool own_times)
      : times_(times), field_(field), own_times_(own_times) {}

  void feed_until(loc::TimeNs time_ns, MadgwickFilter& filter) {
    for (; next_ < times_.size() && times_[next_] <= time_ns; ++next_) feed(next_, filter);
  }
  /// With the IMU's own times row i belongs to IMU sample i, whatever its time says.
  void feed_row(std::size_t row, MadgwickFilter& filter) {
    feed(row, filter);
    next_ = row + 1;
  }
  bool own_times() const { return own_times_; }
  std::size_t used() const { return next_; }

 private:
  void feed(std::size_t i, MadgwickFilter& filter) {
    const Eigen::Map<const Eigen::Vector3d> value(field_ + 3 * i);
    if (!own_times_ && value.array().isNaN().all()) return;  // no sample at this time
    MagnetometerMeasurement m;
    m.time_ns = times_[i];
    m.magnetic_field = value;
    filter.update(m);
  }

  std::span<const loc::TimeNs> times_;
  const double* field_;
  bool own_times_;
  std::size_t next_ = 0;
};

MadgwickResult PyMadgwick::run(const TimeArray& times_array, const FloatArray& gyro_array,
                               const FloatArray& force_array, const std::optional<FloatArray>& field_array,
                               const std::optional<TimeArray>& field_times_array) {
  const auto times = times_view(times_array, "times_ns");
  const auto n = static_cast<py::ssize_t>(times.size());
  const auto gyro = rows_view<3>(gyro_array, "gyro", n, "times_ns");
  const auto force = rows_view<3>(force_array, "force", n, "times_ns");
  std::optional<FieldSamples> field;
  if (field_array) {
    auto field_times = times;
    if (field_times_array) {
      field_times = times_view(*field_times_array, "magnetometer_times_ns");
      for (std::size_t i = 1; i < field_times.size(); ++i) {
        if (field_times[i] <= field_times[i - 1]) {
          throw py::value_error("magnetometer_times_ns[" + std::to_string(i) + "] = " + std::to_string(field_times[i]) +
                                ": must be after the one before it, " + std::to_string(field_times[i - 1]));
        }
      }
    }
    const auto view = rows_view<3>(*field_array, "magnetometer", static_cast<py::ssize_t>(field_times.size()),
                                   field_times_array ? "magnetometer_times_ns" : "times_ns");
    field.emplace(field_times, view.data(), field_times_array.has_value());
  } else if (field_times_array) {
    throw py::value_error("magnetometer_times_ns is given without magnetometer");
  }

  MadgwickFilter& filter = idle();
  MadgwickResult result{.q_world_body_wxyz = py::array_t<double>({n, py::ssize_t{4}}),
                        .gyroscope_bias = py::array_t<double>({n, py::ssize_t{3}}),
                        .status = py::array_t<std::uint32_t>(n)};
  double* q = result.q_world_body_wxyz.mutable_data();
  double* bias = result.gyroscope_bias.mutable_data();
  std::uint32_t* status = result.status.mutable_data();
  struct Busy {
    explicit Busy(std::atomic<bool>& f) : flag(f) { flag = true; }
    Busy(const Busy&) = delete;
    Busy& operator=(const Busy&) = delete;
    ~Busy() { flag = false; }
    std::atomic<bool>& flag;
  } const busy(busy_);
  {
    const py::gil_scoped_release no_gil;
    ImuMeasurement imu;
    for (py::ssize_t i = 0; i < n; ++i) {
      imu.time_ns = times[static_cast<std::size_t>(i)];
      if (field && field->own_times()) field->feed_until(imu.time_ns, filter);
      if (field && !field->own_times()) field->feed_row(static_cast<std::size_t>(i), filter);
      imu.angular_velocity = gyro.row(i);
      imu.specific_force = force.row(i);
      status[i] = filter.update(imu);
      if (filter.initialised()) {
        write_wxyz(filter.orientation(), q + 4 * i);
        Eigen::Map<Eigen::Vector3d>{bias + 3 * i} = filter.gyroscope_bias();
      } else {
        std::fill_n(q + 4 * i, 4, kNaN);
        std::fill_n(bias + 3 * i, 3, kNaN);
      }
      if (i % kSignalInterval == kSignalInterval - 1) check_signals();
    }
  }
  result.magnetometer_used = field ? static_cast<py::ssize_t>(field->used()) : 0;
  return result;
}

/// The options that Python may name, in the order of the struct.
using Field = std::variant<double MadgwickOptions::*, bool MadgwickOptions::*>;
struct OptionField {
  const char* name;
  Field member;
  const char* doc;
};
constexpr OptionField kOptionFields[] = {
    {"beta", &MadgwickOptions::beta, "Gain: the rate at which the gradient turns the quaternion. [rad/s]"},
    {"alpha", &MadgwickOptions::alpha, "Step factor of the report, > 1; infinity is its final form."},
    {"soft_gradient", &MadgwickOptions::soft_gradient,
     "Error below which the correction is proportional to the error; 0 is the report. [rad]"},
    {"gradient_phase", &MadgwickOptions::gradient_phase,
     "Where in the step force and field are compared with the attitude: 0 start (the report), 1 end."},
    {"magnetometer_heading_only", &MadgwickOptions::magnetometer_heading_only,
     "The magnetometer turns the estimate about the vertical only."},
    {"magnetometer_weight", &MadgwickOptions::magnetometer_weight,
     "Weight of the magnetometer's gradient against the accelerometer's."},
    {"accelerometer_time_constant_s", &MadgwickOptions::accelerometer_time_constant_s,
     "Low-pass of the specific force in world axes; 0: none. [s]"},
    {"start_time_s", &MadgwickOptions::start_time_s,
     "For this long after the start the gain is at least 1/elapsed; 0: none (the report). [s]"},
    {"rest_bias", &MadgwickOptions::rest_bias, "Estimate the gyroscope's bias while at rest."},
    {"rest_max_angular_velocity", &MadgwickOptions::rest_max_angular_velocity,
     "At rest the rate stays this close to its low-pass. [rad/s]"},
    {"rest_max_force_change", &MadgwickOptions::rest_max_force_change,
     "At rest the force stays this close to its low-pass. [m/s^2]"},
    {"rest_min_duration_s", &MadgwickOptions::rest_min_duration_s, "Calm for this long is rest. [s]"},
    {"rest_low_pass_s", &MadgwickOptions::rest_low_pass_s, "Time constant of these low-passes. [s]"},
    {"rest_bias_cutoff_hz", &MadgwickOptions::rest_bias_cutoff_hz, "Low-pass of the rate that becomes the bias. [Hz]"},
    {"motion_bias", &MadgwickOptions::motion_bias,
     "Estimate the bias in motion as well, from what the accelerometer keeps correcting."},
    {"motion_bias_start_sigma", &MadgwickOptions::motion_bias_start_sigma,
     "Deviation of the bias at the start. [rad/s]"},
    {"motion_bias_walk", &MadgwickOptions::motion_bias_walk, "By which it walks. [rad/s/sqrt(s)]"},
    {"motion_bias_noise", &MadgwickOptions::motion_bias_noise,
     "White noise of the rate of the tilt correction. [rad/s*sqrt(s)]"},
    {"rest_bias_sigma", &MadgwickOptions::rest_bias_sigma, "Deviation of the bias after a rest. [rad/s]"},
    {"max_gyroscope_bias", &MadgwickOptions::max_gyroscope_bias,
     "A larger low-passed rate is a slow turn, not a bias. [rad/s]"},
    {"magnetic_rejection", &MadgwickOptions::magnetic_rejection,
     "Reject the magnetometer where norm or dip differ from the learnt reference."},
    {"magnetic_norm_tolerance", &MadgwickOptions::magnetic_norm_tolerance, "Relative to the reference."},
    {"magnetic_dip_tolerance", &MadgwickOptions::magnetic_dip_tolerance, "[rad]"},
    {"magnetic_reference_time_s", &MadgwickOptions::magnetic_reference_time_s,
     "Time constant with which the reference follows. [s]"},
    {"magnetic_max_rejection_s", &MadgwickOptions::magnetic_max_rejection_s,
     "After this long the field is taken for the new normal. [s]"},
    {"max_angular_velocity", &MadgwickOptions::max_angular_velocity, "A sample with more is skipped. [rad/s]"},
    {"max_specific_force", &MadgwickOptions::max_specific_force,
     "With more the step goes without the accelerometer. [m/s^2]"},
    {"max_heading_age_s", &MadgwickOptions::max_heading_age_s,
     "So long after the last use of the field the heading still counts as valid. [s]"},
    {"max_gap_s", &MadgwickOptions::max_gap_s, "A longer time between IMU samples starts the filter anew. [s]"},
    {"max_magnetometer_age_s", &MadgwickOptions::max_magnetometer_age_s,
     "Until then a magnetometer sample is used on. [s]"},
};

void set_option(MadgwickOptions& options, const std::string& name, const py::handle& value) {
  if (name == "world") {
    options.world = loc::parse_world_frame(value.cast<std::string>());
    return;
  }
  for (const OptionField& field : kOptionFields) {
    if (name != field.name) continue;
    std::visit(
        [&]<class T>(T MadgwickOptions::*member) {
          try {
            options.*member = value.cast<T>();
          } catch (const py::cast_error&) {
            throw py::type_error(name + " must be a " + (std::is_same_v<T, bool> ? "bool" : "float") + ", not " +
                                 py::repr(value).cast<std::string>());
          }
        },
        field.member);
    return;
  }
  std::string known = "world";
  for (const OptionField& field : kOptionFields) known += std::string(", ") + field.name;
  throw py::type_error("MadgwickOptions has no field " + name + "; it has: " + known);
}

MadgwickOptions with_fields(MadgwickOptions options, const py::kwargs& fields) {
  for (const auto& [name, value] : fields) set_option(options, name.cast<std::string>(), value);
  options.check();
  return options;
}

void bind_options(py::module_& m) {
  py::class_<MadgwickOptions> c(m, "MadgwickOptions",
                                "Options of MadgwickFilter; every field is a keyword of the constructor: "
                                "MadgwickOptions(beta=0.041, rest_bias=True), MadgwickOptions.robust(world=\"NED\").");
  c.def(
      py::init([](const py::kwargs& fields) { return with_fields({}, fields); }),
      "The form of the report, with the fields that are named. TypeError for an unknown field, ValueError for a value "
      "out of range.");
  c.def_static(
      "report", [](const py::kwargs& fields) { return with_fields(MadgwickOptions::report(), fields); },
      "The form of Madgwick's report, beta = 0.1, nothing else.");
  c.def_static(
      "robust", [](const py::kwargs& fields) { return with_fields(MadgwickOptions::robust(), fields); },
      "Everything on: for real sensors.");
  c.def_static(
      "preset",
      [](const std::string& name, const py::kwargs& fields) {
        return with_fields(MadgwickOptions::preset(name), fields);
      },
      py::arg("name"), "\"report\" or \"robust\". ValueError for another name.");
  c.def_property(
      "world", [](const MadgwickOptions& self) { return std::string(loc::world_frame_name(self.world)); },
      [](MadgwickOptions& self, const std::string& name) { self.world = loc::parse_world_frame(name); },
      "Axes of world: \"ENU\", \"NWU\" or \"NED\".");
  for (const OptionField& field : kOptionFields) {
    std::visit([&](auto member) { c.def_readwrite(field.name, member, field.doc); }, field.member);
  }
  c.def("check", &MadgwickOptions::check, "ValueError names a field that is out of range.");
  c.def("__repr__", [](const py::object& self) {
    std::string text = "MadgwickOptions(world='" + self.attr("world").cast<std::string>() + "'";
    for (const OptionField& field : kOptionFields) {
      text += std::string(", ") + field.name + "=" + py::repr(self.attr(field.name)).cast<std::string>();
    }
    return text + ")";
  });
  m.def("beta_from_gyro", &loc::beta_from_gyro, py::arg("noise"), py::arg("bias_residual"), py::arg("scale_error"),
        py::arg("max_rate"), py::arg("dt_s"),
        "beta [rad/s] that covers the rates by which the gyroscope can be wrong: bias_residual [rad/s], scale_error "
        "(relative) at max_rate [rad/s], and noise at samples dt_s [s] apart.");
}

void bind_estimate(py::module_& m) {
  py::native_enum<loc::EstimateValid>(m, "EstimateValid", "enum.IntFlag",
                                      "Which parts of an estimate hold something; the others are NaN.")
      .value("ORIENTATION", loc::kValidOrientation)
      .value("HEADING", loc::kValidHeading)
      .value("POSITION", loc::kValidPosition)
      .value("VELOCITY", loc::kValidVelocity)
      .value("GYROSCOPE_BIAS", loc::kValidGyroscopeBias)
      .value("ACCELEROMETER_BIAS", loc::kValidAccelerometerBias)
      .value("COVARIANCE", loc::kValidCovariance)
      .value("SCALE", loc::kValidScale)
      .finalize();
  py::native_enum<loc::EstimateStatus>(
      m, "EstimateStatus", "enum.IntFlag",
      "What an estimator did with the input since its last estimate, and why; 0 is normal.")
      .value("INITIALISING", loc::kInitialising)
      .value("REINITIALISED", loc::kReinitialised)
      .value("AT_REST", loc::kAtRest)
      .value("ACCELEROMETER_IGNORED", loc::kAccelerometerIgnored)
      .value("MAGNETOMETER_IGNORED", loc::kMagnetometerIgnored)
      .value("MAGNETOMETER_DISTURBED", loc::kMagnetometerDisturbed)
      .value("MAGNETOMETER_MISSING", loc::kMagnetometerMissing)
      .value("NOT_FINITE", loc::kNotFinite)
      .value("TIME_NOT_INCREASING", loc::kTimeNotIncreasing)
      .value("GAP", loc::kGap)
      .value("OUT_OF_RANGE", loc::kOutOfRange)
      .value("BRIDGED", loc::kBridged)
      .value("GPS_REJECTED", loc::kGpsRejected)
      .value("ODOMETRY_REJECTED", loc::kOdometryRejected)
      .value("RECOVERED", loc::kRecovered)
      .value("TOO_LATE", loc::kTooLate)
      .value("BAD_COVARIANCE", loc::kBadCovariance)
      .value("FEW_FEATURES", loc::kFewFeatures)
      .value("FEATURES_REJECTED", loc::kFeaturesRejected)
      .value("SCALE_UNKNOWN", loc::kScaleUnknown)
      .value("NO_IMAGES", loc::kNoImages)
      .value("NO_IMU", loc::kNoImu)
      .value("NO_GPS", loc::kNoGps)
      .value("LOST", loc::kLost)
      .value("REFOUND", loc::kRefound)
      .value("CALIBRATION_DOUBTFUL", loc::kCalibrationDoubtful)
      .value("TILT_DOUBTFUL", loc::kTiltDoubtful)
      .value("STAMPS_DOUBTFUL", loc::kStampsDoubtful)
      .value("MAP_LINK_UNKNOWN", loc::kMapLinkUnknown)
      .value("GPS_STAMPS_DOUBTFUL", loc::kGpsStampsDoubtful)
      .finalize();
  using loc::Estimate;
  py::class_<Estimate>(m, "Estimate", "What an estimator says after one measurement.")
      .def_property_readonly("time_ns", [](const Estimate& e) { return optional_time(e.time_ns); })
      .def_readonly("sequence", &Estimate::sequence)
      .def_property_readonly("valid", [](const Estimate& e) { return static_cast<loc::EstimateValid>(e.valid); })
      .def_property_readonly("status", [](const Estimate& e) { return static_cast<loc::EstimateStatus>(e.status); })
      .def_property_readonly("q_world_body_wxyz", [](const Estimate& e) { return to_wxyz(e.q_world_body); })
      .def_property_readonly(
          "position", [](const Estimate& e) { return to_array(e.position); }, "(3,) [m]")
      .def_property_readonly(
          "velocity", [](const Estimate& e) { return to_array(e.velocity); }, "(3,) [m/s]")
      .def_property_readonly(
          "angular_velocity", [](const Estimate& e) { return to_array(e.angular_velocity); },
          "(3,) [rad/s], in body axes, bias removed")
      .def_property_readonly(
          "gyroscope_bias", [](const Estimate& e) { return to_array(e.gyroscope_bias); }, "(3,) [rad/s]")
      .def_property_readonly(
          "accelerometer_bias", [](const Estimate& e) { return to_array(e.accelerometer_bias); }, "(3,) [m/s^2]")
      .def_property_readonly(
          "covariance",
          [](const Estimate& e) {
            return to_matrix_array(e.covariance.topLeftCorner(e.covariance_dim, e.covariance_dim));
          },
          "(d, d), of the error (theta [rad, body axes], p, v, bg, ba); d = 0: none")
      .def_readonly("scale", &Estimate::scale, "of the odometry: its unit per metre; NaN when it is not estimated")
      .def_readonly("scale_sigma", &Estimate::scale_sigma, "its deviation")
      .def_property_readonly(
          "origin",
          [](const Estimate& e) {
            std::optional<std::tuple<double, double, double>> out;
            if (!std::isnan(e.origin.latitude)) out.emplace(e.origin.latitude, e.origin.longitude, e.origin.altitude);
            return out;
          },
          "Latitude, longitude [rad] and altitude [m] of world's origin; None when nothing ties it to the Earth.");
}

void bind_filter(py::module_& m) {
  py::class_<MadgwickResult>(m, "MadgwickResult", "What MadgwickFilter.run gives; row i is the state after sample i.")
      .def_readonly("q_world_body_wxyz", &MadgwickResult::q_world_body_wxyz,
                    "(N, 4), takes body to world; NaN before the filter has started.")
      .def_readonly("gyroscope_bias", &MadgwickResult::gyroscope_bias,
                    "(N, 3) [rad/s]; NaN before the filter has started.")
      .def_readonly("status", &MadgwickResult::status, "(N,) uint32, bits of EstimateStatus.")
      .def_readonly("magnetometer_used", &MadgwickResult::magnetometer_used,
                    "Magnetometer rows up to the last IMU sample's time; give the others to the next call.");

  py::class_<PyMadgwick>(m, "MadgwickFilter",
                         "Orientation q_world_body from gyroscope and accelerometer, with or without magnetometer: "
                         "Madgwick's filter with rest-bias estimation, magnetic rejection and a low-passed "
                         "accelerometer. Not observable: heading without magnetometer (then relative to the start).")
      .def(py::init([](const std::optional<MadgwickOptions>& options) {
             return std::make_unique<PyMadgwick>(options.value_or(MadgwickOptions{}));
           }),
           py::arg("options") = py::none(), "options: MadgwickOptions, by default the report's form.")
      .def(
          "update",
          [](PyMadgwick& self, loc::TimeNs time_ns, const ArrayLike& gyro, const ArrayLike& force) {
            return static_cast<loc::EstimateStatus>(self.update(time_ns, gyro, force));
          },
          py::arg("time_ns"), py::arg("gyro"), py::arg("force"),
          "One sample: gyro (3,) [rad/s], force (3,) [m/s^2], at rest +9.81 upwards. Gives the status of this step; "
          "input that is skipped (see the status) leaves the state as it was.")
      .def(
          "update_magnetometer",
          [](PyMadgwick& self, loc::TimeNs time_ns, const ArrayLike& field) {
            return static_cast<loc::EstimateStatus>(self.update_magnetometer(time_ns, field));
          },
          py::arg("time_ns"), py::arg("field"),
          "One magnetometer sample (3,) [T], before the IMU sample of the same time.")
      .def("run", &PyMadgwick::run, py::arg("times_ns"), py::arg("gyro"), py::arg("force"),
           py::arg("magnetometer") = py::none(), py::arg("magnetometer_times_ns") = py::none(),
           "All steps of a recording in one call, without the GIL and without copies of the input; the same numbers as "
           "step by step, and the next call goes on from here.\n\n"
           "times_ns: int64 (N,) [ns]. gyro: float64 (N, 3) [rad/s]. force: float64 (N, 3) specific force [m/s^2], at "
           "rest +9.81 upwards.\n"
           "magnetometer: float64 [T]. Either (N, 3), one row per IMU sample, rows of NaN where there is none; or "
           "(M, 3) with magnetometer_times_ns, int64 (M,), increasing.\n"
           "Arrays must be C-contiguous. TypeError or ValueError names the argument, its dtype or shape. "
           "KeyboardInterrupt leaves the filter where it was then.")
      .def("estimate", [](PyMadgwick& self) { return self.idle().estimate(); })
      .def(
          "counts", [](PyMadgwick& self) { return as_map(self.idle().counts()); },
          "What was used and what was skipped, and why: {name: number}.")
      .def(
          "reset", [](PyMadgwick& self) { self.idle().reset(); }, "Forgets the past, not the options or the counts.")
      .def_property_readonly("initialised", [](PyMadgwick& self) { return self.idle().initialised(); })
      .def_property_readonly(
          "q_world_body_wxyz",
          [](PyMadgwick& self) {
            const MadgwickFilter& f = self.idle();
            return to_wxyz(f.initialised() ? f.orientation() : Eigen::Quaterniond(kNaN, kNaN, kNaN, kNaN));
          },
          "(4,); NaN before the filter has started.")
      .def_property_readonly(
          "gyroscope_bias",
          [](PyMadgwick& self) {
            const MadgwickFilter& f = self.idle();
            return to_array(f.initialised() ? f.gyroscope_bias() : Eigen::Vector3d::Constant(kNaN));
          },
          "(3,) [rad/s]; NaN before the filter has started.")
      .def_property_readonly(
          "status", [](PyMadgwick& self) { return static_cast<loc::EstimateStatus>(self.idle().status()); },
          "of the last IMU step")
      .def_property_readonly("options", [](PyMadgwick& self) { return self.idle().options(); });
}

}  // namespace

void bind_estimators(py::module_& m) {
  bind_options(m);
  bind_estimate(m);
  bind_filter(m);
}

}  // namespace locpy
