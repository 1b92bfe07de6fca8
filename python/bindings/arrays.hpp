// NumPy arrays at the boundary. Long arrays come in and go out without copies, so they must have the right type and
// layout already: anything else raises TypeError or ValueError naming the argument, what it must be and what it is.
// Short ones (vectors, quaternions, matrices) may be lists as well. Quaternions are wxyz.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <string>

#include "libloc/core/time.hpp"

namespace locpy {

namespace py = pybind11;

/// A long array of float64, taken as it is.
class FloatArray : public py::object {
 public:
  PYBIND11_OBJECT_DEFAULT(FloatArray, py::object, is_any)
  static bool is_any(PyObject* /*object*/) { return true; }
};

/// A long array of int64 nanoseconds, taken as it is.
class TimeArray : public py::object {
 public:
  PYBIND11_OBJECT_DEFAULT(TimeArray, py::object, is_any)
  static bool is_any(PyObject* /*object*/) { return true; }
};

/// A long array of bool, taken as it is.
class BoolArray : public py::object {
 public:
  PYBIND11_OBJECT_DEFAULT(BoolArray, py::object, is_any)
  static bool is_any(PyObject* /*object*/) { return true; }
};

/// A short array, or a list of numbers.
class ArrayLike : public py::object {
 public:
  PYBIND11_OBJECT_DEFAULT(ArrayLike, py::object, is_any)
  static bool is_any(PyObject* /*object*/) { return true; }
};

template <int columns>
using Rows = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, columns, Eigen::RowMajor>>;
template <int columns>
using MutableRows = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, columns, Eigen::RowMajor>>;

/// Views of what Python holds; valid while the argument lives. @param expected, like how many rows it must have, and
/// like which other argument. @throws py::type_error, py::value_error
std::span<const loc::TimeNs> times_view(const TimeArray& array, const char* name);
std::span<const double> values_view(const FloatArray& array, const char* name);
std::span<const std::uint8_t> mask_view(const BoolArray& array, const char* name);
const double* rows_data(const FloatArray& array, const char* name, py::ssize_t columns, py::ssize_t& rows);
void require_rows(py::ssize_t rows, const char* name, py::ssize_t expected, const char* like);

template <int columns>
Rows<columns> rows_view(const FloatArray& array, const char* name) {
  py::ssize_t rows = 0;
  const double* data = rows_data(array, name, columns, rows);
  return Rows<columns>(data, rows, columns);
}

template <int columns>
Rows<columns> rows_view(const FloatArray& array, const char* name, py::ssize_t expected, const char* like) {
  const Rows<columns> view = rows_view<columns>(array, name);
  require_rows(view.rows(), name, expected, like);
  return view;
}

/// Copies of short arrays. @throws py::type_error when not numbers, py::value_error for another shape.
py::array_t<double> numbers(const ArrayLike& array, const char* name);
Eigen::Vector3d vector3(const ArrayLike& array, const char* name);
Eigen::MatrixXd matrix(const ArrayLike& array, const char* name, py::ssize_t rows, py::ssize_t columns);
/// wxyz, normalised. @throws py::value_error unless its norm is 1 to 1e-3.
Eigen::Quaterniond quaternion(const ArrayLike& wxyz, const char* name);

/// New arrays for Python.
py::array_t<double> to_array(const Eigen::Ref<const Eigen::VectorXd>& vector);
py::array_t<double> to_matrix_array(const Eigen::Ref<const Eigen::MatrixXd>& matrix);
py::array_t<double> to_wxyz(const Eigen::Quaterniond& q);

inline void write_wxyz(const Eigen::Quaterniond& q, double* out) {
  out[0] = q.w();
  out[1] = q.x();
  out[2] = q.y();
  out[3] = q.z();
}

/// kNoTime is None in Python.
inline std::optional<loc::TimeNs> optional_time(loc::TimeNs time_ns) {
  return time_ns == loc::kNoTime ? std::nullopt : std::optional(time_ns);
}

/// Called now and then in long loops that run without the GIL: lets Ctrl-C through.
/// @throws py::error_already_set (KeyboardInterrupt)
void check_signals();
inline constexpr py::ssize_t kSignalInterval = 100'000;

}  // namespace locpy

namespace pybind11::detail {
template <>
struct handle_type_name<locpy::FloatArray> {
  static constexpr auto name = const_name("numpy.typing.NDArray[numpy.float64]");
};
template <>
struct handle_type_name<locpy::TimeArray> {
  static constexpr auto name = const_name("numpy.typing.NDArray[numpy.int64]");
};
template <>
struct handle_type_name<locpy::BoolArray> {
  static constexpr auto name = const_name("numpy.typing.NDArray[numpy.bool]");
};
template <>
struct handle_type_name<locpy::ArrayLike> {
  static constexpr auto name = const_name("numpy.typing.ArrayLike");
};
}  // namespace pybind11::detail
