// estimators/error_state_filter: step by step, and a whole recording in one call.
#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "fields.hpp"
#include "libloc/estimators/error_state_filter.hpp"
#include "libloc/estimators/fusion_preset.hpp"
#include "recording.hpp"

namespace locpy {
namespace {

using loc::ErrorStateFilter;
using loc::ErrorStateOptions;
using loc::ErrorStateState;
using loc::FusionOutcome;
using loc::FusionPreset;
using loc::FusionPresetSensors;
using loc::FusionResult;
using loc::ImuMeasurement;
using loc::PredictOutcome;

Eigen::Matrix3d matrix3(const ArrayLike& array, const char* name) {
  return matrix(array, name, 3, 3);
}

/// A stream of measurements as arrays, and what becomes of them.
struct Stream {
  std::vector<loc::TimeNs> times;
  std::vector<loc::TimeNs> arrivals;
  std::vector<loc::TimeNs> starts;  // of relative odometry
  const double* vectors = nullptr;
  const double* rotations = nullptr;
  const double* vector_covs = nullptr;  // one, or one for each row
  const double* rotation_covs = nullptr;
  bool many_vector_covs = false;
  bool many_rotation_covs = false;
  std::size_t next = 0;
  std::vector<double> nis;
  std::vector<std::uint8_t> outcome;

  std::size_t size() const { return times.size(); }
  Eigen::Vector3d vector(std::size_t i) const { return Eigen::Map<const Eigen::Vector3d>(vectors + 3 * i); }
  static Eigen::Matrix3d cov(const double* data, bool many, std::size_t i) {
    return Eigen::Map<const Eigen::Matrix3d>(data + (many ? 9 * i : 0));
  }
  void note(std::size_t i, const FusionResult& result) {
    nis[i] = result.nis;
    outcome[i] = static_cast<std::uint8_t>(result.outcome);
  }
};

struct ErrorStateRun {
  py::array_t<double> q_world_body_wxyz, position, velocity, gyroscope_bias, accelerometer_bias, scale, drift,
      variances;
  std::optional<py::array_t<double>> covariance;
  py::array_t<std::uint8_t> predict_outcome;
  py::array_t<double> odometry_nis, gps_nis;
  py::array_t<std::uint8_t> odometry_outcome, gps_outcome;
};

struct StreamArguments {
  std::optional<TimeArray> times, arrivals, starts;
  std::optional<FloatArray> vectors, rotations;
  std::optional<FloatArray> vector_covs, rotation_covs;
};

const double* covariances(const FloatArray& array, const char* name, std::size_t rows, bool& many) {
  const auto a = py::array_t<double>::ensure(array);
  if (!a || (a.ndim() != 2 && a.ndim() != 3) || a.shape(a.ndim() - 1) != 3 || a.shape(a.ndim() - 2) != 3) {
    throw py::value_error(std::string(name) + " must be (3, 3) or (M, 3, 3)");
  }
  many = a.ndim() == 3;
  if (many && a.shape(0) != static_cast<py::ssize_t>(rows)) {
    throw py::value_error(std::string(name) + " has " + std::to_string(a.shape(0)) + " matrices for " +
                          std::to_string(rows) + " times");
  }
  if (!(a.flags() & py::array::c_style) || a.ptr() != array.ptr()) {
    throw py::type_error(std::string(name) + " must be a C-contiguous array of float64");
  }
  return a.data();
}

std::vector<loc::TimeNs> copied(const TimeArray& array, const char* name) {
  const auto view = times_view(array, name);
  return {view.begin(), view.end()};
}

Stream make_stream(const StreamArguments& a, const std::string& name, bool with_rotation) {
  Stream s;
  if (!a.times) {
    if (a.vectors) throw py::value_error(name + "_position is given without " + name + "_times_ns");
    return s;
  }
  s.times = copied(*a.times, (name + "_times_ns").c_str());
  const auto rows = static_cast<py::ssize_t>(s.size());
  const auto needed = [&](const auto& argument, const char* field) -> const auto& {
    if (!argument) throw py::value_error(name + "_times_ns is given without " + name + field);
    return *argument;
  };
  s.vectors = rows_view<3>(needed(a.vectors, "_position"), (name + "_position").c_str(), rows, "its times").data();
  s.vector_covs = covariances(needed(a.vector_covs, "_position_cov"), (name + "_position_cov").c_str(), s.size(),
                              s.many_vector_covs);
  if (with_rotation) {
    s.rotations = rows_view<4>(needed(a.rotations, "_wxyz"), (name + "_wxyz").c_str(), rows, "its times").data();
    s.rotation_covs = covariances(needed(a.rotation_covs, "_orientation_cov"), (name + "_orientation_cov").c_str(),
                                  s.size(), s.many_rotation_covs);
  }
  s.arrivals = a.arrivals ? copied(*a.arrivals, (name + "_arrivals_ns").c_str()) : s.times;
  if (a.starts) s.starts = copied(*a.starts, (name + "_start_times_ns").c_str());
  for (const auto* other : {&s.arrivals, &s.starts}) {
    if (!other->empty() && other->size() != s.size()) throw py::value_error(name + ": not one value for each time");
  }
  if (!std::is_sorted(s.arrivals.begin(), s.arrivals.end())) {
    throw py::value_error(name + ": arrivals are not in time order");
  }
  s.nis.assign(s.size(), loc::kUnknown);
  // What never reaches the filter waits for an IMU sample that does not come.
  s.outcome.assign(s.size(), static_cast<std::uint8_t>(FusionOutcome::kWaiting));
  return s;
}

class PyErrorState {
 public:
  explicit PyErrorState(const ErrorStateOptions& options) : filter_(options) {}

  ErrorStateFilter& idle() {
    if (busy_) throw std::runtime_error("this ErrorStateFilter is running in another thread");
    return filter_;
  }

  ErrorStateRun run(const TimeArray& times_array, const FloatArray& gyro_array, const FloatArray& force_array,
                    const StreamArguments& odometry_arguments, const StreamArguments& gps_arguments,
                    const ArrayLike& antenna_array, bool with_covariance);

 private:
  // Gives the filter what has arrived by this time; what is newer than the filter waits there for the next sample.
  template <class Fuse>
  void feed(Stream& s, loc::TimeNs until, const Fuse& fuse) {
    for (; s.next < s.size() && s.arrivals[s.next] <= until; ++s.next) s.note(s.next, fuse(s.next));
  }
  static void note_finished(Stream& s, const FusionResult& result) {
    // Of what was given, the last with this time that still waits.
    for (std::size_t i = s.next; i-- > 0;) {
      if (s.times[i] == result.time_ns && s.outcome[i] == static_cast<std::uint8_t>(FusionOutcome::kWaiting)) {
        s.note(i, result);
        return;
      }
      if (s.next - i > 4096) return;
    }
  }

  ErrorStateFilter filter_;
  std::atomic<bool> busy_ = false;
};

ErrorStateRun PyErrorState::run(const TimeArray& times_array, const FloatArray& gyro_array,
                                const FloatArray& force_array, const StreamArguments& odometry_arguments,
                                const StreamArguments& gps_arguments, const ArrayLike& antenna_array,
                                bool with_covariance) {
  ErrorStateFilter& filter = idle();
  if (!filter.started()) throw py::value_error("run: the filter is not started; call start() first");
  const auto times = times_view(times_array, "times_ns");
  const auto n = static_cast<py::ssize_t>(times.size());
  const auto gyro = rows_view<3>(gyro_array, "gyro", n, "times_ns");
  const auto force = rows_view<3>(force_array, "force", n, "times_ns");
  Stream odometry = make_stream(odometry_arguments, "odometry", true);
  Stream gps = make_stream(gps_arguments, "gps", false);
  const Eigen::Vector3d antenna = vector3(antenna_array, "antenna");
  const py::ssize_t size = filter.layout().size;

  ErrorStateRun r;
  r.q_world_body_wxyz = py::array_t<double>({n, py::ssize_t{4}});
  for (auto* array : {&r.position, &r.velocity, &r.gyroscope_bias, &r.accelerometer_bias, &r.drift}) {
    *array = py::array_t<double>({n, py::ssize_t{3}});
  }
  r.scale = py::array_t<double>(n);
  r.variances = py::array_t<double>({n, size});
  r.predict_outcome = py::array_t<std::uint8_t>(n);
  if (with_covariance) r.covariance = py::array_t<double>({n, size, size});
  double* q = r.q_world_body_wxyz.mutable_data();
  double* p = r.position.mutable_data();
  double* v = r.velocity.mutable_data();
  double* bg = r.gyroscope_bias.mutable_data();
  double* ba = r.accelerometer_bias.mutable_data();
  double* c = r.drift.mutable_data();
  double* s = r.scale.mutable_data();
  double* variances = r.variances.mutable_data();
  double* covariance = with_covariance ? r.covariance->mutable_data() : nullptr;
  std::uint8_t* outcome = r.predict_outcome.mutable_data();

  const auto fuse_odometry = [&](std::size_t i) {
    const double* wxyz = odometry.rotations + 4 * i;
    const Eigen::Quaterniond rotation(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    const Eigen::Matrix3d position_cov = Stream::cov(odometry.vector_covs, odometry.many_vector_covs, i);
    const Eigen::Matrix3d orientation_cov = Stream::cov(odometry.rotation_covs, odometry.many_rotation_covs, i);
    if (odometry.starts.empty()) {
      return filter.fuse_vo(odometry.times[i], odometry.vector(i), position_cov, rotation, orientation_cov);
    }
    return filter.fuse_vo_relative(odometry.starts[i], odometry.times[i], odometry.vector(i), position_cov, rotation,
                                   orientation_cov);
  };
  const auto fuse_gps = [&](std::size_t i) {
    return filter.fuse_gps(gps.times[i], gps.vector(i), Stream::cov(gps.vector_covs, gps.many_vector_covs, i), antenna);
  };

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
      imu.angular_velocity = gyro.row(i);
      imu.specific_force = force.row(i);
      // What is measured by now waits in the filter, and is applied in the right place of this step.
      feed(odometry, imu.time_ns, fuse_odometry);
      feed(gps, imu.time_ns, fuse_gps);
      outcome[i] = static_cast<std::uint8_t>(filter.predict(imu));
      for (const FusionResult& result : filter.finished()) {
        note_finished(result.source == loc::FusionSource::kGps ? gps : odometry, result);
      }
      const ErrorStateState& x = filter.state();
      write_wxyz(x.inertial.q_world_body, q + 4 * i);
      Eigen::Map<Eigen::Vector3d>{p + 3 * i} = x.inertial.position;
      Eigen::Map<Eigen::Vector3d>{v + 3 * i} = x.inertial.velocity;
      Eigen::Map<Eigen::Vector3d>{bg + 3 * i} = x.inertial.gyroscope_bias;
      Eigen::Map<Eigen::Vector3d>{ba + 3 * i} = x.inertial.accelerometer_bias;
      Eigen::Map<Eigen::Vector3d>{c + 3 * i} = x.drift;
      s[i] = x.scale;
      Eigen::Map<Eigen::VectorXd>{variances + size * i, size} = filter.covariance().diagonal();
      if (covariance != nullptr) {
        Eigen::Map<Eigen::MatrixXd>{covariance + size * size * i, size, size} = filter.covariance();
      }
      if (i % kSignalInterval == kSignalInterval - 1) check_signals();
    }
  }
  r.odometry_nis = hand_over(std::move(odometry.nis));
  r.gps_nis = hand_over(std::move(gps.nis));
  r.odometry_outcome = hand_over(std::move(odometry.outcome));
  r.gps_outcome = hand_over(std::move(gps.outcome));
  return r;
}

void bind_options(py::module_& m) {
  py::native_enum<loc::ImuIntegration>(m, "ImuIntegration", "enum.IntEnum",
                                       "How a step is integrated: with the attitude in its middle, or at its start.")
      .value("MIDPOINT", loc::ImuIntegration::kMidpoint)
      .value("EULER", loc::ImuIntegration::kEuler)
      .finalize();
  py::native_enum<loc::ImuSampling>(m, "ImuSampling", "enum.IntEnum",
                                    "What an IMU sample says: the value at its time, or the mean since the last one.")
      .value("POINT", loc::ImuSampling::kPoint)
      .value("INTERVAL_MEAN", loc::ImuSampling::kIntervalMean)
      .finalize();
  using O = ErrorStateOptions;
  py::class_<O>(m, "ErrorStateOptions",
                "Options of ErrorStateFilter; every field is a keyword: ErrorStateOptions(clones=1, gate=False).")
      .def(py::init([](const py::kwargs& fields) { return with_fields<O>("ErrorStateOptions", fields); }),
           "TypeError for an unknown field, ValueError for a value out of range.")
      .def_readwrite("noise", &O::noise, "ImuNoise; its turn-on sigmas are not used here.")
      .def_property(
          "gravity", [](const O& o) { return to_array(o.gravity); },
          [](O& o, const ArrayLike& g) { o.gravity = vector3(g, "gravity"); }, "(3,) in world [m/s^2]")
      .def_readwrite("integration", &O::integration)
      .def_readwrite("sampling", &O::sampling)
      .def_readwrite("estimate_scale", &O::estimate_scale, "Odometry's unit per metre.")
      .def_readwrite("scale_random_walk", &O::scale_random_walk, "Relative [1/sqrt(s)].")
      .def_readwrite("estimate_drift", &O::estimate_drift, "Gauss-Markov drift of absolute odometry.")
      .def_readwrite("drift_sigma", &O::drift_sigma, "Steady state, one component [odometry's unit].")
      .def_readwrite("drift_time_constant_s", &O::drift_time_constant_s)
      .def_readwrite("estimate_extrinsics", &O::estimate_extrinsics, "Where the odometry's sensor sits.")
      .def_readwrite("clones", &O::clones, "Past poses that are kept, for relative odometry.")
      .def_readwrite("gate", &O::gate, "Chi-square gate before every update.")
      .def_readwrite("gate_probability", &O::gate_probability, "Share of good measurements that pass it.")
      .def_readwrite("reset_jacobian", &O::reset_jacobian)
      .def_readwrite("history_ns", &O::history_ns, "How late a measurement may come.")
      .def_readwrite("max_step_ns", &O::max_step_ns, "Longer steps between IMU samples are bridged and counted.")
      .def_readwrite("max_bridge_ns", &O::max_bridge_ns, "Still longer ones are refused.")
      .def_readwrite("bridge_angular_velocity_sigma", &O::bridge_angular_velocity_sigma, "[rad/s]")
      .def_readwrite("bridge_specific_force_sigma", &O::bridge_specific_force_sigma, "[m/s^2]")
      .def("check", &O::check, "ValueError names a field that is out of range.");

  using S = FusionPresetSensors;
  py::class_<S>(m, "FusionPresetSensors",
                "Sensors of the visual-inertial example, for FusionPreset; every field is a keyword.")
      .def(py::init([](const py::kwargs& fields) { return with_fields<S>("FusionPresetSensors", fields); }))
      .def_readwrite("imu_rate_hz", &S::imu_rate_hz)
      .def_readwrite("gyroscope_noise_density", &S::gyroscope_noise_density, "One-sided [rad/s/sqrt(Hz)].")
      .def_readwrite("gyroscope_resolution", &S::gyroscope_resolution, "[rad/s]")
      .def_readwrite("accelerometer_noise_density", &S::accelerometer_noise_density, "One-sided [m/s^2/sqrt(Hz)].")
      .def_readwrite("accelerometer_resolution", &S::accelerometer_resolution, "[m/s^2]")
      .def_readwrite("odometry_rate_hz", &S::odometry_rate_hz)
      .def_readwrite("odometry_white_sigma", &S::odometry_white_sigma, "[odometry's unit]")
      .def_readwrite("odometry_drift_sigma", &S::odometry_drift_sigma, "[odometry's unit]")
      .def_readwrite("odometry_drift_tau", &S::odometry_drift_tau, "Frames.")
      .def_readwrite("odometry_orientation_sigma", &S::odometry_orientation_sigma, "[rad]")
      .def("check", &S::check);
  py::class_<FusionPreset>(
      m, "FusionPreset",
      "A ready configuration: options, start covariance (of a start at the truth) and noise of the "
      "odometry.")
      .def_static("by_name", &FusionPreset::by_name, py::arg("name"),
                  py::arg_v("sensors", S{}, "FusionPresetSensors()"),
                  "\"as_published\", \"16\" or \"19\". ValueError for another name.")
      .def_readwrite("options", &FusionPreset::options)
      .def_property_readonly("start_cov", [](const FusionPreset& p) { return to_matrix_array(p.start_cov); })
      .def_property_readonly("odometry_position_cov",
                             [](const FusionPreset& p) { return to_matrix_array(p.odometry_position_cov); })
      .def_property_readonly("odometry_orientation_cov",
                             [](const FusionPreset& p) { return to_matrix_array(p.odometry_orientation_cov); });
}

void bind_results(py::module_& m) {
  py::native_enum<PredictOutcome>(m, "PredictOutcome", "enum.IntEnum", "What became of an IMU sample.")
      .value("PREDICTED", PredictOutcome::kPredicted)
      .value("FIRST", PredictOutcome::kFirst)
      .value("BRIDGED", PredictOutcome::kBridged)
      .value("GAP", PredictOutcome::kGap)
      .value("NOT_FINITE", PredictOutcome::kNotFinite)
      .value("TIME_NOT_INCREASING", PredictOutcome::kTimeNotIncreasing)
      .value("NOT_STARTED", PredictOutcome::kNotStarted)
      .finalize();
  py::native_enum<FusionOutcome>(m, "FusionOutcome", "enum.IntEnum", "What became of a measurement.")
      .value("ACCEPTED", FusionOutcome::kAccepted)
      .value("GATED", FusionOutcome::kGated)
      .value("WAITING", FusionOutcome::kWaiting)
      .value("TOO_LATE", FusionOutcome::kTooLate)
      .value("NOT_FINITE", FusionOutcome::kNotFinite)
      .value("BAD_COVARIANCE", FusionOutcome::kBadCovariance)
      .value("NO_CLONE", FusionOutcome::kNoClone)
      .value("NOT_STARTED", FusionOutcome::kNotStarted)
      .value("TOO_EARLY", FusionOutcome::kTooEarly)
      .value("MODEL_FAILED", FusionOutcome::kModelFailed)
      .finalize();
  py::class_<FusionResult>(m, "FusionResult", "What became of a measurement, and why.")
      .def_property_readonly("source",
                             [](const FusionResult& r) { return std::string(loc::fusion_source_name(r.source)); })
      .def_readonly("outcome", &FusionResult::outcome)
      .def_property_readonly("accepted", &FusionResult::accepted)
      .def_property_readonly("time_ns", [](const FusionResult& r) { return optional_time(r.time_ns); })
      .def_readonly("dof", &FusionResult::dof)
      .def_readonly("nis", &FusionResult::nis)
      .def_property_readonly("residual", [](const FusionResult& r) { return to_array(r.residual); })
      .def_property_readonly("innovation_cov", [](const FusionResult& r) { return to_matrix_array(r.innovation_cov); });
  using R = ErrorStateRun;
  py::class_<R>(m, "ErrorStateRun", "What ErrorStateFilter.run gives; row i is the state after IMU sample i.")
      .def_readonly("q_world_body_wxyz", &R::q_world_body_wxyz, "(N, 4)")
      .def_readonly("position", &R::position, "(N, 3) [m]")
      .def_readonly("velocity", &R::velocity, "(N, 3) [m/s]")
      .def_readonly("gyroscope_bias", &R::gyroscope_bias, "(N, 3) [rad/s]")
      .def_readonly("accelerometer_bias", &R::accelerometer_bias, "(N, 3) [m/s^2]")
      .def_readonly("scale", &R::scale, "(N,)")
      .def_readonly("drift", &R::drift, "(N, 3)")
      .def_readonly("variances", &R::variances, "(N, n), diagonal of the covariance: theta p v bg ba s c …")
      .def_readonly("covariance", &R::covariance, "(N, n, n) when asked for, otherwise None.")
      .def_readonly("predict_outcome", &R::predict_outcome, "(N,) PredictOutcome")
      .def_readonly("odometry_nis", &R::odometry_nis, "One for each row of odometry; NaN where it was not applied.")
      .def_readonly("odometry_outcome", &R::odometry_outcome, "FusionOutcome; WAITING: newer than the last IMU sample.")
      .def_readonly("gps_nis", &R::gps_nis)
      .def_readonly("gps_outcome", &R::gps_outcome);
}

/// A function of Python as a model; run() works without the GIL, hence the lock.
loc::MeasurementModel model_of(const py::function& model) {
  // Released under the GIL too, wherever the filter drops it.
  const std::shared_ptr<py::function> held(new py::function(model), [](py::function* f) {
    const py::gil_scoped_acquire gil;
    delete f;
  });
  return [held](const ErrorStateState& x, const loc::ErrorStateLayout& layout, loc::Linearisation& out) {
    const py::gil_scoped_acquire gil;
    py::dict state;
    state["q_world_body_wxyz"] = to_wxyz(x.inertial.q_world_body);
    state["position"] = to_array(x.inertial.position);
    state["velocity"] = to_array(x.inertial.velocity);
    state["gyroscope_bias"] = to_array(x.inertial.gyroscope_bias);
    state["accelerometer_bias"] = to_array(x.inertial.accelerometer_bias);
    state["scale"] = x.scale;
    state["drift"] = to_array(x.drift);
    const auto given = (*held)(state).cast<py::tuple>();
    if (given.size() != 3) throw py::value_error("the model must give (residual, jacobian, noise_cov)");
    const py::array_t<double> residual = numbers(given[0].cast<ArrayLike>(), "residual");
    if (residual.ndim() != 1 || residual.size() < 1 || residual.size() > FusionResult::kMaxDim) {
      throw py::value_error("the model's residual must be (d,) with d from 1 to 6");
    }
    out.residual = Eigen::Map<const Eigen::VectorXd>(residual.data(), residual.size());
    out.jacobian = matrix(given[1].cast<ArrayLike>(), "jacobian", residual.size(), layout.size);
    out.noise_cov = matrix(given[2].cast<ArrayLike>(), "noise_cov", residual.size(), residual.size());
  };
}

void bind_filter(py::module_& m) {
  py::class_<PyErrorState> c(
      m, "ErrorStateFilter",
      "Attitude, position, velocity and biases from an IMU, corrected by odometry without scale, GPS, velocity, "
      "height, "
      "heading, rest. Error state theta p v bg ba | scale | drift | extrinsics | clones, theta on the right. Late "
      "measurements are put where they belong.");
  c.def(py::init([](const std::optional<ErrorStateOptions>& options) {
          return std::make_unique<PyErrorState>(options.value_or(ErrorStateOptions{}));
        }),
        py::arg("options") = py::none());
  c.def(
      "start",
      [](PyErrorState& self, loc::TimeNs time_ns, const ArrayLike& covariance, const ArrayLike& q, const ArrayLike& p,
         const ArrayLike& v, const ArrayLike& bg, const ArrayLike& ba, double scale) {
        ErrorStateState state;
        state.inertial = {quaternion(q, "q_world_body_wxyz"), vector3(p, "position"), vector3(v, "velocity"),
                          vector3(bg, "gyroscope_bias"), vector3(ba, "accelerometer_bias")};
        state.scale = scale;
        const py::ssize_t size = self.idle().layout().size;
        self.idle().start(time_ns, state, matrix(covariance, "covariance", size, size));
      },
      py::arg("time_ns"), py::arg("covariance"), py::arg("q_world_body_wxyz") = std::vector<double>{1, 0, 0, 0},
      py::arg("position") = std::vector<double>{0, 0, 0}, py::arg("velocity") = std::vector<double>{0, 0, 0},
      py::arg("gyroscope_bias") = std::vector<double>{0, 0, 0},
      py::arg("accelerometer_bias") = std::vector<double>{0, 0, 0}, py::arg("scale") = 1.0,
      "Starts, or starts anew. covariance (n, n) of the error state; ValueError unless symmetric and positive "
      "semidefinite.");
  c.def(
      "predict",
      [](PyErrorState& self, loc::TimeNs time_ns, const ArrayLike& gyro, const ArrayLike& force) {
        ImuMeasurement imu;
        imu.time_ns = time_ns;
        imu.angular_velocity = vector3(gyro, "gyro");
        imu.specific_force = vector3(force, "force");
        return self.idle().predict(imu);
      },
      py::arg("time_ns"), py::arg("gyro"), py::arg("force"), "The next IMU sample [rad/s], [m/s^2].");
  c.def(
      "fuse_vo",
      [](PyErrorState& self, loc::TimeNs time_ns, const ArrayLike& p, const ArrayLike& p_cov, const ArrayLike& q,
         const ArrayLike& q_cov) {
        return self.idle().fuse_vo(time_ns, vector3(p, "position"), matrix3(p_cov, "position_cov"),
                                   quaternion(q, "q_world_odometry_wxyz"), matrix3(q_cov, "orientation_cov"));
      },
      py::arg("time_ns"), py::arg("position"), py::arg("position_cov"), py::arg("q_world_odometry_wxyz"),
      py::arg("orientation_cov"), "Absolute odometry, position in its own unit.");
  c.def(
      "fuse_vo_relative",
      [](PyErrorState& self, loc::TimeNs time0_ns, loc::TimeNs time1_ns, const ArrayLike& p, const ArrayLike& p_cov,
         const ArrayLike& q, const ArrayLike& q_cov) {
        return self.idle().fuse_vo_relative(time0_ns, time1_ns, vector3(p, "position"), matrix3(p_cov, "position_cov"),
                                            quaternion(q, "rotation_wxyz"), matrix3(q_cov, "orientation_cov"));
      },
      py::arg("time0_ns"), py::arg("time1_ns"), py::arg("position"), py::arg("position_cov"), py::arg("rotation_wxyz"),
      py::arg("orientation_cov"), "Pose of the odometry's sensor at time1 in its axes at time0; needs options.clones.");
  c.def(
      "keep_pose", [](PyErrorState& self, loc::TimeNs time_ns) { return self.idle().keep_pose(time_ns); },
      py::arg("time_ns"));
  c.def(
      "fuse_gps",
      [](PyErrorState& self, loc::TimeNs time_ns, const ArrayLike& p, const ArrayLike& p_cov, const ArrayLike& antenna,
         const std::optional<ArrayLike>& v, const std::optional<ArrayLike>& v_cov) {
        return self.idle().fuse_gps(time_ns, vector3(p, "position"), matrix3(p_cov, "position_cov"),
                                    vector3(antenna, "antenna"),
                                    v ? vector3(*v, "velocity") : Eigen::Vector3d::Constant(loc::kUnknown),
                                    v_cov ? matrix3(*v_cov, "velocity_cov") : Eigen::Matrix3d::Constant(loc::kUnknown));
      },
      py::arg("time_ns"), py::arg("position"), py::arg("position_cov"),
      py::arg("antenna") = std::vector<double>{0, 0, 0}, py::arg("velocity") = py::none(),
      py::arg("velocity_cov") = py::none(),
      "Position in world [m], velocity in world [m/s], antenna in body axes [m].");
  c.def(
      "fuse_velocity",
      [](PyErrorState& self, loc::TimeNs time_ns, const ArrayLike& v, const ArrayLike& v_cov, bool in_body) {
        return self.idle().fuse_velocity(time_ns, vector3(v, "velocity"), matrix3(v_cov, "velocity_cov"),
                                         in_body ? loc::VelocityFrame::kBody : loc::VelocityFrame::kWorld);
      },
      py::arg("time_ns"), py::arg("velocity"), py::arg("velocity_cov"), py::arg("in_body") = false);
  c.def(
      "fuse_zero_velocity",
      [](PyErrorState& self, loc::TimeNs time_ns, double sigma, const std::optional<ArrayLike>& rate,
         double rate_sigma) {
        return self.idle().fuse_zero_velocity(
            time_ns, sigma, rate ? vector3(*rate, "angular_velocity") : Eigen::Vector3d::Constant(loc::kUnknown),
            rate_sigma);
      },
      py::arg("time_ns"), py::arg("velocity_sigma"), py::arg("angular_velocity") = py::none(),
      py::arg("angular_velocity_sigma") = loc::kUnknown, "At rest: velocity zero, and the gyroscope reads its bias.");
  c.def(
      "fuse_height",
      [](PyErrorState& self, loc::TimeNs time_ns, double height, double sigma) {
        return self.idle().fuse_height(time_ns, height, sigma);
      },
      py::arg("time_ns"), py::arg("height"), py::arg("sigma"), "[m]");
  c.def(
      "fuse_heading",
      [](PyErrorState& self, loc::TimeNs time_ns, double heading, double sigma) {
        return self.idle().fuse_heading(time_ns, heading, sigma);
      },
      py::arg("time_ns"), py::arg("heading"), py::arg("sigma"), "[rad]");
  c.def(
      "correct",
      [](PyErrorState& self, loc::TimeNs time_ns, const py::function& model) {
        return self.idle().correct(time_ns, model_of(model));
      },
      py::arg("time_ns"), py::arg("model"),
      "A measurement of one's own: model(state) gives (residual, jacobian, noise_cov), shapes (d,), (d, n), (d, d), "
      "d <= 6; state is a dict of arrays: q_world_body_wxyz, position, velocity, gyroscope_bias, accelerometer_bias, "
      "scale, drift. It is called again when history is computed anew.");
  c.def(
      "residual", [](PyErrorState& self, const py::function& model) { return self.idle().residual(model_of(model)); },
      py::arg("model"), "What correct() would find now, without applying it.");
  c.def(
      "widen",
      [](PyErrorState& self, const ArrayLike& variances) {
        const py::array_t<double> values = numbers(variances, "variances");
        if (values.ndim() != 1) throw py::value_error("variances must be (n,)");
        self.idle().widen(Eigen::Map<const Eigen::VectorXd>(values.data(), values.size()));
      },
      py::arg("variances"),
      "Adds to the variances of the error state, (n,): a filter that rejects everything listens.");
  c.def(
      "run",
      [](PyErrorState& self, const TimeArray& times, const FloatArray& gyro, const FloatArray& force,
         const std::optional<TimeArray>& odometry_times, const std::optional<FloatArray>& odometry_position,
         const std::optional<FloatArray>& odometry_position_cov, const std::optional<FloatArray>& odometry_wxyz,
         const std::optional<FloatArray>& odometry_orientation_cov, const std::optional<TimeArray>& odometry_arrivals,
         const std::optional<TimeArray>& odometry_starts, const std::optional<TimeArray>& gps_times,
         const std::optional<FloatArray>& gps_position, const std::optional<FloatArray>& gps_position_cov,
         const std::optional<TimeArray>& gps_arrivals, const ArrayLike& antenna, bool with_covariance) {
        return self.run(times, gyro, force,
                        {odometry_times, odometry_arrivals, odometry_starts, odometry_position, odometry_wxyz,
                         odometry_position_cov, odometry_orientation_cov},
                        {gps_times, gps_arrivals, {}, gps_position, {}, gps_position_cov, {}}, antenna,
                        with_covariance);
      },
      py::arg("times_ns"), py::arg("gyro"), py::arg("force"), py::kw_only(), py::arg("odometry_times_ns") = py::none(),
      py::arg("odometry_position") = py::none(), py::arg("odometry_position_cov") = py::none(),
      py::arg("odometry_wxyz") = py::none(), py::arg("odometry_orientation_cov") = py::none(),
      py::arg("odometry_arrivals_ns") = py::none(), py::arg("odometry_start_times_ns") = py::none(),
      py::arg("gps_times_ns") = py::none(), py::arg("gps_position") = py::none(),
      py::arg("gps_position_cov") = py::none(), py::arg("gps_arrivals_ns") = py::none(),
      py::arg("antenna") = std::vector<double>{0, 0, 0}, py::arg("with_covariance") = false,
      "A whole recording in one call, without the GIL and without copies of the input.\n\n"
      "times_ns (N,) int64, gyro (N, 3) [rad/s], force (N, 3) [m/s^2]. Odometry: times (M,), position (M, 3), wxyz "
      "(M, 4), covariances (3, 3) or (M, 3, 3); with start times it is relative to the poses of then. GPS: position "
      "(K, 3) in world [m]. Arrivals say when a measurement comes (default: at once); they must not decrease.");
  c.def_property_readonly("started", [](PyErrorState& self) { return self.idle().started(); });
  c.def_property_readonly("time_ns", [](PyErrorState& self) { return optional_time(self.idle().time_ns()); });
  c.def_property_readonly("q_world_body_wxyz",
                          [](PyErrorState& self) { return to_wxyz(self.idle().state().inertial.q_world_body); });
  c.def_property_readonly("position",
                          [](PyErrorState& self) { return to_array(self.idle().state().inertial.position); });
  c.def_property_readonly("velocity",
                          [](PyErrorState& self) { return to_array(self.idle().state().inertial.velocity); });
  c.def_property_readonly("gyroscope_bias",
                          [](PyErrorState& self) { return to_array(self.idle().state().inertial.gyroscope_bias); });
  c.def_property_readonly("accelerometer_bias",
                          [](PyErrorState& self) { return to_array(self.idle().state().inertial.accelerometer_bias); });
  c.def_property_readonly("scale", [](PyErrorState& self) { return self.idle().state().scale; });
  c.def_property_readonly("drift", [](PyErrorState& self) { return to_array(self.idle().state().drift); });
  c.def_property_readonly("T_body_odometry", [](PyErrorState& self) { return self.idle().state().T_body_odometry; });
  c.def_property_readonly("covariance", [](PyErrorState& self) { return to_matrix_array(self.idle().covariance()); });
  c.def_property_readonly(
      "finished", [](PyErrorState& self) { return self.idle().finished(); },
      "What became of the measurements that waited for the last predict().");
  c.def(
      "counts", [](PyErrorState& self) { return as_map(self.idle().counts()); }, "{name: number}");
}

}  // namespace

void bind_error_state(py::module_& m) {
  bind_options(m);
  bind_results(m);
  bind_filter(m);
}

}  // namespace locpy
