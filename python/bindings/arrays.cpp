#include "arrays.hpp"

#include <algorithm>
#include <cmath>

namespace locpy {
namespace {

std::string shape_text(const py::array& array) {
  return py::str(py::tuple(array.attr("shape"))).cast<std::string>();
}

py::array strict_array(const py::object& object, const char* name, const py::dtype& dtype) {
  const auto dtype_name = py::str(dtype).cast<std::string>();
  if (!py::isinstance<py::array>(object)) {
    throw py::type_error(std::string(name) + " must be a NumPy array of " + dtype_name + ", not " +
                         py::type::of(object).attr("__name__").cast<std::string>());
  }
  auto array = py::reinterpret_borrow<py::array>(object);
  if (!array.dtype().equal(dtype)) {
    throw py::type_error(std::string(name) + " must have dtype " + dtype_name + ", has " +
                         py::str(array.dtype()).cast<std::string>());
  }
  return array;
}

void require_layout(const py::array& array, const char* name) {
  constexpr int need = int{py::array::c_style} | int{py::detail::npy_api::NPY_ARRAY_ALIGNED_};
  if ((array.flags() & need) != need) {
    throw py::value_error(std::string(name) + " must be C-contiguous and aligned: numpy.ascontiguousarray makes it so");
  }
}

py::array flat_array(const py::object& object, const char* name, const py::dtype& dtype) {
  py::array array = strict_array(object, name, dtype);
  if (array.ndim() != 1) {
    throw py::value_error(std::string(name) + " must have shape (N,), has " + shape_text(array));
  }
  require_layout(array, name);
  return array;
}

}  // namespace

std::span<const loc::TimeNs> times_view(const TimeArray& object, const char* name) {
  const py::array array = flat_array(object, name, py::dtype::of<loc::TimeNs>());
  return {static_cast<const loc::TimeNs*>(array.data()), static_cast<std::size_t>(array.size())};
}

std::span<const double> values_view(const FloatArray& object, const char* name) {
  const py::array array = flat_array(object, name, py::dtype::of<double>());
  return {static_cast<const double*>(array.data()), static_cast<std::size_t>(array.size())};
}

std::span<const std::uint8_t> mask_view(const BoolArray& object, const char* name) {
  const py::array array = flat_array(object, name, py::dtype::of<bool>());
  return {static_cast<const std::uint8_t*>(array.data()), static_cast<std::size_t>(array.size())};
}

const double* rows_data(const FloatArray& object, const char* name, py::ssize_t columns, py::ssize_t& rows) {
  const py::array array = strict_array(object, name, py::dtype::of<double>());
  if (array.ndim() != 2 || array.shape(1) != columns) {
    throw py::value_error(std::string(name) + " must have shape (N, " + std::to_string(columns) + "), has " +
                          shape_text(array));
  }
  require_layout(array, name);
  rows = array.shape(0);
  return static_cast<const double*>(array.data());
}

void require_rows(py::ssize_t rows, const char* name, py::ssize_t expected, const char* like) {
  if (rows != expected) {
    throw py::value_error(std::string(name) + " must have as many rows as " + like + " (" + std::to_string(expected) +
                          "), has " + std::to_string(rows));
  }
}

py::array_t<double> numbers(const ArrayLike& object, const char* name) {
  auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(object);
  if (!array) {
    PyErr_Clear();
    throw py::type_error(std::string(name) + " must be numbers, not " + py::repr(object).cast<std::string>());
  }
  return array;
}

Eigen::Vector3d vector3(const ArrayLike& object, const char* name) {
  const py::array_t<double> array = numbers(object, name);
  if (array.ndim() != 1 || array.shape(0) != 3) {
    throw py::value_error(std::string(name) + " must have shape (3,), has " + shape_text(array));
  }
  return {array.data()[0], array.data()[1], array.data()[2]};
}

Eigen::MatrixXd matrix(const ArrayLike& object, const char* name, py::ssize_t rows, py::ssize_t columns) {
  const py::array_t<double> array = numbers(object, name);
  const bool vector = columns == 1 && array.ndim() == 1 && array.shape(0) == rows;
  if (!vector && (array.ndim() != 2 || array.shape(0) != rows || array.shape(1) != columns)) {
    throw py::value_error(std::string(name) + " must have shape (" + std::to_string(rows) +
                          (columns == 1 ? ",)" : ", " + std::to_string(columns) + ")") + ", has " + shape_text(array));
  }
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(array.data(), rows,
                                                                                                  columns);
}

Eigen::Quaterniond quaternion(const ArrayLike& object, const char* name) {
  const py::array_t<double> array = numbers(object, name);
  if (array.ndim() != 1 || array.shape(0) != 4) {
    throw py::value_error(std::string(name) + " must have shape (4,) (wxyz), has " + shape_text(array));
  }
  const double* v = array.data();
  const Eigen::Quaterniond q(v[0], v[1], v[2], v[3]);
  if (!(std::abs(q.norm() - 1) < 1e-3)) {
    throw py::value_error(std::string(name) + " must be a unit quaternion, its norm is " + std::to_string(q.norm()));
  }
  return q.normalized();
}

py::array_t<double> to_array(const Eigen::Ref<const Eigen::VectorXd>& vector) {
  py::array_t<double> out(vector.size());
  std::copy(vector.data(), vector.data() + vector.size(), out.mutable_data());
  return out;
}

py::array_t<double> to_matrix_array(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  py::array_t<double> out({matrix.rows(), matrix.cols()});
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(out.mutable_data(), matrix.rows(),
                                                                                     matrix.cols()) = matrix;
  return out;
}

py::array_t<double> to_wxyz(const Eigen::Quaterniond& q) {
  py::array_t<double> out(4);
  write_wxyz(q, out.mutable_data());
  return out;
}

void check_signals() {
  const py::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

}  // namespace locpy
