// Lists of structs as NumPy arrays, one array for each field.
#pragma once

#include <algorithm>

#include "arrays.hpp"

namespace locpy {

/// (N,) of what get() gives for each item.
template <class T, class Items, class Get>
py::array_t<T> column(const Items& items, Get get) {
  py::array_t<T> out(static_cast<py::ssize_t>(items.size()));
  std::transform(items.begin(), items.end(), out.mutable_data(), get);
  return out;
}

/// (N, columns)
template <int columns, class Items, class Get>
py::array_t<double> rows(const Items& items, Get get) {
  py::array_t<double> out({static_cast<py::ssize_t>(items.size()), py::ssize_t{columns}});
  double* data = out.mutable_data();
  for (const auto& item : items) {
    Eigen::Map<Eigen::Matrix<double, columns, 1>>{data} = get(item);
    data += columns;
  }
  return out;
}

/// (N, size, size)
template <int size, class Items, class Get>
py::array_t<double> matrices(const Items& items, Get get) {
  py::array_t<double> out({static_cast<py::ssize_t>(items.size()), py::ssize_t{size}, py::ssize_t{size}});
  double* data = out.mutable_data();
  for (const auto& item : items) {
    Eigen::Map<Eigen::Matrix<double, size, size, Eigen::RowMajor>>{data} = get(item);
    data += size * size;
  }
  return out;
}

}  // namespace locpy
