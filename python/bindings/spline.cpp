// calib/spline, calib/euler_trajectory: splines of vectors, rotations and poses, evaluated at arrays of times.
#include "libloc/calib/spline.hpp"

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/calib/euler_trajectory.hpp"
#include "libloc/geometry/trajectory.hpp"

namespace locpy {
namespace {

using loc::EulerTrajectory;
using loc::EulerTrajectoryFit;
using loc::Pose3;
using loc::PoseSpline;
using loc::PoseSplineFit;
using loc::RotationSpline;
using loc::SplineFitOptions;
using loc::SplineGrid;
using loc::VectorSpline;
using loc::VectorSplineFit;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct RotationStates {
  explicit RotationStates(py::ssize_t n)
      : q_world_body_wxyz({n, py::ssize_t{4}}),
        angular_velocity({n, py::ssize_t{3}}),
        angular_acceleration({n, py::ssize_t{3}}) {}

  py::array_t<double> q_world_body_wxyz;
  py::array_t<double> angular_velocity;
  py::array_t<double> angular_acceleration;
};

struct PoseStates : RotationStates {
  explicit PoseStates(py::ssize_t n)
      : RotationStates(n),
        position({n, py::ssize_t{3}}),
        velocity({n, py::ssize_t{3}}),
        acceleration({n, py::ssize_t{3}}) {}

  py::array_t<double> position;
  py::array_t<double> velocity;
  py::array_t<double> acceleration;
};

/// Calls f(i, t) for every time, without the GIL.
template <class F>
void for_times(std::span<const double> times, F f) {
  const py::gil_scoped_release release;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (i % kSignalInterval == kSignalInterval - 1) check_signals();
    f(static_cast<py::ssize_t>(i), times[i]);
  }
}

/// A writer of the rows of an array (N, 3).
MutableRows<3> rows_of(py::array_t<double>& array) {
  return {array.mutable_data(), array.shape(0), 3};
}

RotationStates rotations_at(const RotationSpline& spline, const FloatArray& times_s) {
  const auto times = values_view(times_s, "times_s");
  RotationStates out(static_cast<py::ssize_t>(times.size()));
  double* q = out.q_world_body_wxyz.mutable_data();
  MutableRows<3> velocity = rows_of(out.angular_velocity);
  MutableRows<3> acceleration = rows_of(out.angular_acceleration);
  for_times(times, [&](py::ssize_t i, double t) {
    const loc::RotationState state = spline.at(t);
    write_wxyz(state.rotation, q + 4 * i);
    velocity.row(i) = state.angular_velocity;
    acceleration.row(i) = state.angular_acceleration;
  });
  return out;
}

template <class Spline>
PoseStates poses_at(const Spline& spline, const FloatArray& times_s) {
  const auto times = values_view(times_s, "times_s");
  PoseStates out(static_cast<py::ssize_t>(times.size()));
  double* q = out.q_world_body_wxyz.mutable_data();
  MutableRows<3> position = rows_of(out.position);
  MutableRows<3> velocity = rows_of(out.velocity);
  MutableRows<3> acceleration = rows_of(out.acceleration);
  MutableRows<3> angular_velocity = rows_of(out.angular_velocity);
  MutableRows<3> angular_acceleration = rows_of(out.angular_acceleration);
  for_times(times, [&](py::ssize_t i, double t) {
    const loc::PoseState state = spline.at(t);
    write_wxyz(state.pose.rotation, q + 4 * i);
    position.row(i) = state.pose.translation;
    velocity.row(i) = state.velocity;
    acceleration.row(i) = state.acceleration;
    angular_velocity.row(i) = state.angular_velocity;
    angular_acceleration.row(i) = state.angular_acceleration;
  });
  return out;
}

py::array_t<double> vectors_at(const VectorSpline& spline, const FloatArray& times_s, int derivative) {
  const auto times = values_view(times_s, "times_s");
  const auto n = static_cast<py::ssize_t>(times.size());
  py::array_t<double> out({n, static_cast<py::ssize_t>(spline.control_points().rows())});
  Eigen::Map<RowMajor> rows(out.mutable_data(), n, spline.control_points().rows());
  for_times(times, [&](py::ssize_t i, double t) { rows.row(i) = spline.value(t, derivative); });
  return out;
}

template <class Spline>
loc::Trajectory resample(const Spline& spline, const TimeArray& times_ns, loc::TimeNs origin_ns) {
  const auto times = times_view(times_ns, "times_ns");
  loc::Trajectory out;
  {
    const py::gil_scoped_release release;
    for (const loc::TimeNs t : times) {
      // Not apart_s: that is exact to a microsecond only.
      loc::TimeNs since = 0;
      if (__builtin_sub_overflow(t, origin_ns, &since)) {
        throw py::value_error("times_ns: " + std::to_string(t) + " is too far from the origin, " +
                              std::to_string(origin_ns));
      }
      out.push_back(t, spline.at(loc::to_seconds(since)).pose);
    }
  }
  out.check("times_ns");
  return out;
}

/// (N, any) of rows, copied into columns.
Eigen::MatrixXd columns_of(const FloatArray& array, const char* name) {
  const py::array_t<double> checked = numbers(ArrayLike(array), name);
  if (checked.ndim() != 2) {
    throw py::value_error(std::string(name) + " must have shape (N, d), has " +
                          py::str(py::tuple(checked.attr("shape"))).cast<std::string>());
  }
  return Eigen::Map<const RowMajor>(checked.data(), checked.shape(0), checked.shape(1)).transpose();
}

/// Rows wxyz; of norm 1 to 1e-3, as everywhere, and then normalised. Others are left for the checks of C++, which name
/// them.
std::vector<Eigen::Quaterniond> quaternions_of(const FloatArray& array, const char* name) {
  const Rows<4> rows = rows_view<4>(array, name);
  std::vector<Eigen::Quaterniond> out;
  for (const auto& row : rows.rowwise()) {
    Eigen::Quaterniond q(row[0], row[1], row[2], row[3]);
    if (std::abs(q.norm() - 1) < 1e-3) q.normalize();
    out.push_back(q);
  }
  return out;
}

py::array_t<double> wxyz_rows(const std::vector<Eigen::Quaterniond>& list) {
  py::array_t<double> out({static_cast<py::ssize_t>(list.size()), py::ssize_t{4}});
  for (std::size_t i = 0; i < list.size(); ++i) write_wxyz(list[i], out.mutable_data() + 4 * i);
  return out;
}

std::vector<Pose3> poses_of(const FloatArray& q, const FloatArray& position) {
  const std::vector<Eigen::Quaterniond> rotations = quaternions_of(q, "q_world_body_wxyz");
  const Rows<3> positions =
      rows_view<3>(position, "position", static_cast<py::ssize_t>(rotations.size()), "q_world_body_wxyz");
  std::vector<Pose3> out;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    out.push_back({rotations[i], positions.row(static_cast<Eigen::Index>(i))});
  }
  return out;
}

void bind_states(py::module_& m) {
  using R = RotationStates;
  using P = PoseStates;
  py::class_<R>(m, "RotationStates", "What a rotation spline gives at N times.")
      .def_property_readonly(
          "q_world_body_wxyz", [](const R& self) { return self.q_world_body_wxyz; }, "(N, 4)")
      .def_property_readonly(
          "angular_velocity", [](const R& self) { return self.angular_velocity; }, "(N, 3) in body [rad/s]")
      .def_property_readonly(
          "angular_acceleration", [](const R& self) { return self.angular_acceleration; }, "(N, 3) in body [rad/s^2]");
  py::class_<P, R>(m, "PoseStates", "What a spline of poses gives at N times.")
      .def_property_readonly(
          "position", [](const P& self) { return self.position; }, "(N, 3) in world [m]")
      .def_property_readonly(
          "velocity", [](const P& self) { return self.velocity; }, "(N, 3) in world [m/s]")
      .def_property_readonly(
          "acceleration", [](const P& self) { return self.acceleration; }, "(N, 3) in world [m/s^2]");
}

void bind_grid(py::module_& m) {
  py::class_<SplineGrid>(m, "SplineGrid",
                         "Knots of a uniform B-spline at start_s + i * spacing_s. Order 4 is cubic, 6 quintic; 3 to 8 "
                         "can be had. ValueError names a field that is out of range.")
      .def(py::init([](double start_s, double spacing_s, int segments, int order) {
             const SplineGrid grid{start_s, spacing_s, segments, order};
             grid.check();
             return grid;
           }),
           py::arg("start_s"), py::arg("spacing_s"), py::arg("segments"), py::arg("order") = 4)
      .def_static("over", &loc::grid_over, py::arg("begin_s"), py::arg("end_s"), py::arg("spacing_s"),
                  py::arg("order") = 4, "The shortest grid that covers these times, beginning at begin_s.")
      .def_readonly("start_s", &SplineGrid::start_s, "begin of the first segment")
      .def_readonly("spacing_s", &SplineGrid::spacing_s)
      .def_readonly("segments", &SplineGrid::segments)
      .def_readonly("order", &SplineGrid::order, "degree + 1")
      .def_property_readonly("end_s", &SplineGrid::end_s, "end of the last segment")
      .def_property_readonly("control_points", &SplineGrid::control_points, "their number, segments + order - 1")
      .def_property_readonly(
          "abscissae_s",
          [](const SplineGrid& self) {
            py::array_t<double> out(self.control_points());
            for (int i = 0; i < self.control_points(); ++i) out.mutable_data()[i] = loc::abscissa_of(self, i);
            return out;
          },
          "(n,): the time at which each control point has its largest influence")
      .def("__repr__", [](const SplineGrid& self) {
        return py::str("SplineGrid(start_s={}, spacing_s={}, segments={}, order={})")
            .format(self.start_s, self.spacing_s, self.segments, self.order);
      });
}

void bind_splines(py::module_& m) {
  py::class_<VectorSpline>(
      m, "VectorSpline",
      "A function of time on R^d. Before the first and behind the last segment its polynomial goes "
      "on.")
      .def(py::init([](const SplineGrid& grid, const FloatArray& points) {
             return VectorSpline(grid, columns_of(points, "control_points"));
           }),
           py::arg("grid"), py::arg("control_points"), "control_points (n, d), n = grid.control_points")
      .def_property_readonly("grid", &VectorSpline::grid)
      .def_property_readonly(
          "control_points", [](const VectorSpline& self) { return to_matrix_array(self.control_points().transpose()); },
          "(n, d), a copy")
      .def("value", &vectors_at, py::arg("times_s"), py::arg("derivative") = 0,
           "(N, d) at times (N,) [s]; derivative by time: 0, 1 or 2.");

  py::class_<RotationSpline>(m, "RotationSpline",
                             "An attitude R_world_body over time, a cumulative B-spline on SO(3): no attitude is "
                             "special. Neighbouring control points must be less than half a turn apart.")
      .def(py::init([](const SplineGrid& grid, const FloatArray& points) {
             return RotationSpline(grid, quaternions_of(points, "control_points"));
           }),
           py::arg("grid"), py::arg("control_points"), "control_points (n, 4) wxyz, n = grid.control_points")
      .def_property_readonly("grid", &RotationSpline::grid)
      .def_property_readonly(
          "control_points", [](const RotationSpline& self) { return wxyz_rows(self.control_points()); },
          "(n, 4) wxyz, a copy")
      .def("at", &rotations_at, py::arg("times_s"), "RotationStates at times (N,) [s].");

  py::class_<PoseSpline>(m, "PoseSpline", "A pose T_world_body over time: rotation and position apart, on one grid.")
      .def(py::init<RotationSpline, VectorSpline>(), py::arg("rotation"), py::arg("position"),
           "ValueError when the grids differ or position has not three columns.")
      .def_property_readonly("grid", &PoseSpline::grid)
      .def_property_readonly("rotation", &PoseSpline::rotation)
      .def_property_readonly("position", &PoseSpline::position)
      .def("at", &poses_at<PoseSpline>, py::arg("times_s"), "PoseStates at times (N,) [s].")
      .def("resample", &resample<PoseSpline>, py::arg("times_ns"), py::arg("origin_ns") = 0,
           "Trajectory with the poses at these times (N,) int64; origin_ns: the time that is 0 s of the spline.");

  py::class_<EulerTrajectory>(m, "EulerTrajectory",
                              "A pose T_world_body over time as six B-splines, three angles about a mean attitude and "
                              "a position: R = R_mean Rz(phi3) Ry(phi2) Rx(phi1). For motion about one attitude; "
                              "PoseSpline has no such limit.")
      .def(py::init([](const ArrayLike& mean, const SplineGrid& grid, const FloatArray& points) {
             return EulerTrajectory(quaternion(mean, "mean_wxyz"), grid, columns_of(points, "control_points"));
           }),
           py::arg("mean_wxyz"), py::arg("grid"), py::arg("control_points"),
           "control_points (n, 6): three angles [rad] and the position [m]")
      .def_property_readonly("grid", &EulerTrajectory::grid)
      .def_property_readonly("mean_wxyz", [](const EulerTrajectory& self) { return to_wxyz(self.mean()); })
      .def_property_readonly(
          "control_points",
          [](const EulerTrajectory& self) { return to_matrix_array(self.control_points().transpose()); },
          "(n, 6), a copy")
      .def("at", &poses_at<EulerTrajectory>, py::arg("times_s"), "PoseStates at times (N,) [s].")
      .def("resample", &resample<EulerTrajectory>, py::arg("times_ns"), py::arg("origin_ns") = 0,
           "Trajectory with the poses at these times (N,) int64; origin_ns: the time that is 0 s of the spline.");
}

void bind_fits(py::module_& m) {
  const SplineFitOptions d;
  py::class_<VectorSplineFit>(m, "VectorSplineFit", "Result of fit_vector_spline.")
      .def_readonly("spline", &VectorSplineFit::spline)
      .def_readonly("rms", &VectorSplineFit::rms, "of the residuals' norms");
  py::class_<PoseSplineFit>(m, "PoseSplineFit", "Result of fit_pose_spline.")
      .def_readonly("spline", &PoseSplineFit::spline)
      .def_readonly("rms_rotation", &PoseSplineFit::rms_rotation, "of the residuals' angles [rad]")
      .def_readonly("rms_position", &PoseSplineFit::rms_position, "of their distances [m]")
      .def_readonly("iterations", &PoseSplineFit::iterations)
      .def_readonly("converged", &PoseSplineFit::converged);
  py::class_<EulerTrajectoryFit>(m, "EulerTrajectoryFit", "Result of fit_euler_trajectory.")
      .def_readonly("trajectory", &EulerTrajectoryFit::trajectory)
      .def_readonly("rms_rotation", &EulerTrajectoryFit::rms_rotation, "of the residuals' angles [rad]")
      .def_readonly("rms_position", &EulerTrajectoryFit::rms_position, "of their distances [m]");

  m.def(
      "fit_vector_spline",
      [](const FloatArray& times_s, const FloatArray& values, int order, double spacing_s, double smoothing) {
        const auto times = values_view(times_s, "times_s");
        const Eigen::MatrixXd columns = columns_of(values, "values");
        const SplineFitOptions options{order, spacing_s, smoothing};
        const py::gil_scoped_release release;
        return loc::fit_vector_spline(times, columns, options);
      },
      py::arg("times_s"), py::arg("values"), py::kw_only(), py::arg("order") = d.order,
      py::arg("spacing_s") = d.spacing_s, py::arg("smoothing") = d.smoothing,
      "Least squares: times_s (N,) [s] increasing, values (N, d). The grid begins at the first time and covers the "
      "last. smoothing: weight of the control points' second differences, which decides where there are no samples. "
      "DataError names what is not finite, not in order, or so late that the spline would take too many control "
      "points.");
  m.def(
      "fit_pose_spline",
      [](const FloatArray& times_s, const FloatArray& q, const FloatArray& position, int order, double spacing_s,
         double smoothing, int max_iterations) {
        const auto times = values_view(times_s, "times_s");
        const std::vector<Pose3> poses = poses_of(q, position);
        const SplineFitOptions options{order, spacing_s, smoothing, max_iterations};
        const py::gil_scoped_release release;
        return loc::fit_pose_spline(times, poses, options);
      },
      py::arg("times_s"), py::arg("q_world_body_wxyz"), py::arg("position"), py::kw_only(), py::arg("order") = d.order,
      py::arg("spacing_s") = d.spacing_s, py::arg("smoothing") = d.smoothing,
      py::arg("max_iterations") = d.max_iterations,
      "Least squares of poses: times_s (N,) [s], q_world_body_wxyz (N, 4), position (N, 3) [m]. Otherwise as "
      "fit_vector_spline; DataError also for poses that follow each other by more than 120 degrees.");
  m.def(
      "fit_euler_trajectory",
      [](const FloatArray& times_s, const FloatArray& q, const FloatArray& position, int order, double spacing_s,
         double smoothing) {
        const auto times = values_view(times_s, "times_s");
        const std::vector<Pose3> poses = poses_of(q, position);
        const SplineFitOptions options{order, spacing_s, smoothing};
        const py::gil_scoped_release release;
        return loc::fit_euler_trajectory(times, poses, options);
      },
      py::arg("times_s"), py::arg("q_world_body_wxyz"), py::arg("position"), py::kw_only(), py::arg("order") = d.order,
      py::arg("spacing_s") = d.spacing_s, py::arg("smoothing") = d.smoothing,
      "The same as three angles about the mean attitude; DataError also for motion too wide for them (the second angle "
      "beyond 80 degrees).");
}

}  // namespace

void bind_spline(py::module_& m) {
  bind_states(m);
  bind_grid(m);
  bind_splines(m);
  bind_fits(m);
}

}  // namespace locpy
