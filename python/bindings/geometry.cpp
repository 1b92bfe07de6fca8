// geometry/: rotations (submodule so3), rigid transforms, places on the Earth.
#include <pybind11/typing.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/geometry/geodesy.hpp"
#include "libloc/geometry/pose3.hpp"
#include "libloc/geometry/so3.hpp"

namespace locpy {
namespace {

using loc::Pose3;

/// A quaternion of an array's row; as it stands, checked like a single one.
Eigen::Quaterniond row_quaternion(const double* v, const char* name, py::ssize_t row) {
  const Eigen::Quaterniond q(v[0], v[1], v[2], v[3]);
  if (!(std::abs(q.norm() - 1) < 1e-3)) {
    throw py::value_error(std::string(name) + "[" + std::to_string(row) + "] must be a unit quaternion, its norm is " +
                          std::to_string(q.norm()));
  }
  return q.normalized();
}

/// An argument that is one row or an array of rows.
struct RowArgument {
  RowArgument(const ArrayLike& object, const char* argument_name, py::ssize_t columns)
      : name(argument_name), array(numbers(object, argument_name)) {
    const auto n = array.ndim();
    if ((n != 1 && n != 2) || array.shape(n - 1) != columns) {
      throw py::value_error(std::string(name) + " must have shape (" + std::to_string(columns) + ",) or (N, " +
                            std::to_string(columns) + "), has " +
                            py::str(py::tuple(array.attr("shape"))).cast<std::string>());
    }
    single = n == 1;
    rows = single ? 1 : array.shape(0);
    stride = columns;
  }
  /// A single row stands for as many as the other argument has.
  const double* row(py::ssize_t i) const { return array.data() + (single ? 0 : i * stride); }
  Eigen::Vector3d vector(py::ssize_t i) const { return Eigen::Map<const Eigen::Vector3d>(row(i)); }
  Eigen::Quaterniond rotation(py::ssize_t i) const { return row_quaternion(row(i), name, i); }

  const char* name;
  py::array_t<double> array;
  bool single = true;
  py::ssize_t rows = 1;
  py::ssize_t stride = 0;
};

/// Calls f(i, out) for each row; the result has one row or N like the arguments.
template <class F>
py::array_t<double> map_rows(const RowArgument& a, const RowArgument& b, py::ssize_t columns, F f) {
  if (!a.single && !b.single) require_rows(b.rows, b.name, a.rows, a.name);
  const bool single = a.single && b.single;
  const py::ssize_t rows = a.single ? b.rows : a.rows;
  py::array_t<double> out = single ? py::array_t<double>(columns) : py::array_t<double>({rows, columns});
  double* data = out.mutable_data();
  for (py::ssize_t i = 0; i < rows; ++i) f(i, data + i * columns);
  return out;
}

template <class F>
py::array_t<double> map_rows(const RowArgument& a, py::ssize_t columns, F f) {
  return map_rows(a, a, columns, f);
}

/// The same for f(i) that gives one number: a float, or an array (N,).
using FloatOrArray = py::typing::Union<py::float_, py::array_t<double>>;
template <class F>
FloatOrArray map_to_number(const RowArgument& a, const RowArgument& b, F f) {
  const py::array_t<double> out = map_rows(a, b, 1, [&](py::ssize_t i, double* value) { *value = f(i); });
  if (a.single && b.single) return FloatOrArray(py::float_(out.data()[0]));
  return FloatOrArray(out.attr("ravel")());
}

void set3(double* out, const Eigen::Vector3d& v) {
  Eigen::Map<Eigen::Vector3d>{out} = v;
}

void bind_so3(py::module_& m) {
  auto so3 = m.def_submodule("so3",
                             "Rotations. Quaternions are Hamilton, wxyz; perturbations are on the right, "
                             "R_true = R * Exp(theta), theta in the body's axes [rad]. Every function takes one row or "
                             "an array of N rows and gives float64 accordingly.");
  so3.def(
      "exp",
      [](const ArrayLike& theta) {
        const RowArgument a(theta, "theta", 3);
        return map_rows(a, 4, [&](auto i, double* out) { write_wxyz(loc::so3::exp(a.vector(i)), out); });
      },
      py::arg("theta"), "Rotation vectors (3,) or (N, 3) [rad] to unit quaternions wxyz (4,) or (N, 4).");
  so3.def(
      "log",
      [](const ArrayLike& q) {
        const RowArgument a(q, "q_wxyz", 4);
        return map_rows(a, 3, [&](auto i, double* out) { set3(out, loc::so3::log(a.rotation(i))); });
      },
      py::arg("q_wxyz"), "Unit quaternions wxyz to rotation vectors [rad] with norm in [0, pi].");
  so3.def(
      "boxplus",
      [](const ArrayLike& q, const ArrayLike& theta) {
        const RowArgument a(q, "q_wxyz", 4);
        const RowArgument b(theta, "theta", 3);
        return map_rows(a, b, 4,
                        [&](auto i, double* out) { write_wxyz(loc::so3::boxplus(a.rotation(i), b.vector(i)), out); });
      },
      py::arg("q_wxyz"), py::arg("theta"), "q * Exp(theta).");
  so3.def(
      "boxminus",
      [](const ArrayLike& q1, const ArrayLike& q0) {
        const RowArgument a(q1, "q1_wxyz", 4);
        const RowArgument b(q0, "q0_wxyz", 4);
        return map_rows(a, b, 3,
                        [&](auto i, double* out) { set3(out, loc::so3::boxminus(a.rotation(i), b.rotation(i))); });
      },
      py::arg("q1_wxyz"), py::arg("q0_wxyz"), "theta [rad] with boxplus(q0, theta) = q1.");
  so3.def(
      "angle_between",
      [](const ArrayLike& q1, const ArrayLike& q0) {
        const RowArgument a(q1, "q1_wxyz", 4);
        const RowArgument b(q0, "q0_wxyz", 4);
        return map_to_number(a, b, [&](auto i) { return loc::so3::angle_between(a.rotation(i), b.rotation(i)); });
      },
      py::arg("q1_wxyz"), py::arg("q0_wxyz"), "Angle of rotation [rad] in [0, pi]: a float, or an array (N,).");
  so3.def(
      "heading",
      [](const ArrayLike& q) {
        const RowArgument a(q, "q_wxyz", 4);
        return map_to_number(a, a, [&](auto i) { return loc::so3::heading(a.rotation(i)); });
      },
      py::arg("q_wxyz"), "Rotation about z [rad] that is closest to q: a float, or an array (N,).");
  so3.def(
      "right_jacobian",
      [](const ArrayLike& theta) { return to_matrix_array(loc::so3::right_jacobian(vector3(theta, "theta"))); },
      py::arg("theta"), "(3, 3) matrix J with Exp(theta + d) = Exp(theta) * Exp(J d) to first order.");
  so3.def(
      "left_jacobian",
      [](const ArrayLike& theta) { return to_matrix_array(loc::so3::left_jacobian(vector3(theta, "theta"))); },
      py::arg("theta"), "(3, 3) matrix J with Exp(theta + d) = Exp(J d) * Exp(theta) to first order.");
}

loc::Vector6d vector6(const ArrayLike& xi) {
  return matrix(xi, "xi", 6, 1);
}

void bind_pose3(py::module_& m) {
  py::class_<Pose3>(m, "Pose3",
                    "A rigid transform, SE(3). T_a_b takes coordinates of b to coordinates of a: p_a = T_a_b * p_b. "
                    "Tangent vectors are xi = (rho, theta) [m, rad].")
      .def(py::init([](const ArrayLike& rotation, const ArrayLike& translation) {
             return Pose3{.rotation = quaternion(rotation, "rotation_wxyz"),
                          .translation = vector3(translation, "translation")};
           }),
           py::arg("rotation_wxyz") = py::make_tuple(1.0, 0.0, 0.0, 0.0),
           py::arg("translation") = py::make_tuple(0.0, 0.0, 0.0))
      .def_static(
          "from_matrix", [](const ArrayLike& m4) { return Pose3::from_matrix(matrix(m4, "matrix", 4, 4)); },
          py::arg("matrix"), "From a homogeneous matrix (4, 4). ValueError unless it is rigid to 1e-3.")
      .def_static(
          "exp", [](const ArrayLike& xi) { return Pose3::exp(vector6(xi)); }, py::arg("xi"), "The group's exponential.")
      .def(
          "matrix", [](const Pose3& self) { return to_matrix_array(self.matrix()); }, "Homogeneous matrix (4, 4).")
      .def("inverse", &Pose3::inverse)
      .def(
          "log", [](const Pose3& self) { return to_array(self.log()); }, "Inverse of exp: (6,).")
      .def(
          "boxplus", [](const Pose3& self, const ArrayLike& xi) { return self.boxplus(vector6(xi)); }, py::arg("xi"),
          "self * Exp(xi).")
      .def(
          "boxminus", [](const Pose3& self, const Pose3& other) { return to_array(self.boxminus(other)); },
          py::arg("other"), "xi (6,) with other.boxplus(xi) = self.")
      .def(
          "adjoint", [](const Pose3& self) { return to_matrix_array(self.adjoint()); },
          "(6, 6) matrix with self * Exp(xi) = Exp(adjoint @ xi) * self.")
      .def(
          "__mul__", [](const Pose3& self, const Pose3& other) { return self * other; }, py::is_operator())
      .def(
          "transform",
          [](const Pose3& self, const ArrayLike& points) {
            const RowArgument a(points, "points", 3);
            return map_rows(a, 3, [&](auto i, double* out) { set3(out, self * a.vector(i)); });
          },
          py::arg("points"), "p_a = T_a_b * p_b for points (3,) or (N, 3) [m].")
      .def_property(
          "rotation_wxyz", [](const Pose3& self) { return to_wxyz(self.rotation); },
          [](Pose3& self, const ArrayLike& q) { self.rotation = quaternion(q, "rotation_wxyz"); },
          "Unit quaternion (4,), a copy.")
      .def_property(
          "translation", [](const Pose3& self) { return to_array(self.translation); },
          [](Pose3& self, const ArrayLike& t) { self.translation = vector3(t, "translation"); }, "(3,) [m], a copy.")
      .def("__repr__",
           [](const Pose3& self) {
             return py::str("Pose3(rotation_wxyz={}, translation={})")
                 .format(to_wxyz(self.rotation).attr("tolist")(), to_array(self.translation).attr("tolist")());
           })
      .def(py::pickle(
          [](const Pose3& self) { return py::make_tuple(to_wxyz(self.rotation), to_array(self.translation)); },
          [](const py::tuple& state) {
            return Pose3{.rotation = quaternion(ArrayLike(state[0]), "rotation_wxyz"),
                         .translation = vector3(ArrayLike(state[1]), "translation")};
          }));
}

void bind_local_frame(py::module_& m) {
  using loc::GeodeticPoint;
  using loc::LocalFrame;
  const auto point = [](const double* row) { return GeodeticPoint{row[0], row[1], row[2]}; };
  py::class_<LocalFrame>(
      m, "LocalFrame",
      "East, north, up of an origin on WGS 84 [m]: a plane that touches the ellipsoid, valid at any distance.")
      .def(py::init<double, double, double>(), py::arg("latitude"), py::arg("longitude"), py::arg("altitude"),
           "[rad], [rad], [m] above the ellipsoid.")
      .def(
          "to_local",
          [point](const LocalFrame& self, const ArrayLike& points) {
            const RowArgument a(points, "latitude_longitude_altitude", 3);
            return map_rows(a, 3, [&](auto i, double* out) { set3(out, self.to_local(point(a.row(i)))); });
          },
          py::arg("latitude_longitude_altitude"), "(3,) or (N, 3) [rad, rad, m] to east, north, up [m].")
      .def(
          "to_geodetic",
          [](const LocalFrame& self, const ArrayLike& positions) {
            const RowArgument a(positions, "position", 3);
            return map_rows(a, 3, [&](auto i, double* out) {
              const GeodeticPoint p = self.to_geodetic(a.vector(i));
              set3(out, {p.latitude, p.longitude, p.altitude});
            });
          },
          py::arg("position"), "(3,) or (N, 3), east, north, up [m] to latitude, longitude [rad] and altitude [m].")
      .def("__repr__", [](const LocalFrame& self) {
        const GeodeticPoint& o = self.origin();
        return py::str("LocalFrame(latitude={}, longitude={}, altitude={})")
            .format(o.latitude, o.longitude, o.altitude);
      });
}

}  // namespace

void bind_geometry(py::module_& m) {
  bind_so3(m);
  bind_pose3(m);
  bind_local_frame(m);
}

}  // namespace locpy
