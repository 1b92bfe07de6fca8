// core/: random numbers, statistics, times.
#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/core/random.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/core/time.hpp"

namespace locpy {
namespace {

using loc::Random;

/// Fills an array with what draw gives, `columns` values a row; no count: one row without the first dimension.
template <class Draw>
py::array_t<double> draws(std::optional<py::ssize_t> count, py::ssize_t columns, Draw draw) {
  if (count && *count < 0) throw py::value_error("count = " + std::to_string(*count) + ": must not be negative");
  py::array_t<double> out = count ? py::array_t<double>({*count, columns}) : py::array_t<double>(columns);
  double* data = out.mutable_data();
  for (py::ssize_t i = 0; i < count.value_or(1); ++i, data += columns) draw(data);
  return out;
}

void bind_random(py::module_& m) {
  py::class_<Random>(m, "Random",
                     "Seeded random numbers: the same seed gives the same numbers on every machine, and in C++.")
      .def(py::init<std::uint64_t>(), py::arg("seed"))
      .def("fork", &Random::fork, py::arg("stream"), "A generator for an independent part of a simulation.")
      .def("uniform", py::overload_cast<double, double>(&Random::uniform), py::arg("low") = 0.0, py::arg("high") = 1.0,
           "One number, uniform in [low, high).")
      .def("normal", &Random::normal, "One standard normal number.")
      .def(
          "normal3",
          [](Random& self, std::optional<py::ssize_t> count) {
            return draws(count, 3, [&](double* out) { Eigen::Map<Eigen::Vector3d>{out} = self.normal3(); });
          },
          py::arg("count") = py::none(), "Standard normal vectors: shape (3,), or (count, 3).")
      .def(
          "direction",
          [](Random& self, std::optional<py::ssize_t> count) {
            return draws(count, 3, [&](double* out) { Eigen::Map<Eigen::Vector3d>{out} = self.direction(); });
          },
          py::arg("count") = py::none(), "Unit vectors, uniform on the sphere: shape (3,), or (count, 3).")
      .def(
          "rotation",
          [](Random& self, std::optional<py::ssize_t> count) {
            return draws(count, 4, [&](double* out) { write_wxyz(self.rotation(), out); });
          },
          py::arg("count") = py::none(), "Quaternions wxyz, uniform on SO(3): shape (4,), or (count, 4).");
}

}  // namespace

void bind_core(py::module_& m) {
  bind_random(m);
  m.def(
      "root_mean_square", [](const FloatArray& values) { return loc::root_mean_square(values_view(values, "values")); },
      py::arg("values"), "Root mean square of float64 values (N,). ValueError when empty.");
  m.def(
      "quantile",
      [](const FloatArray& values, double probability) {
        return loc::quantile(values_view(values, "values"), probability);
      },
      py::arg("values"), py::arg("probability"),
      "Quantile of float64 values (N,), interpolated linearly. ValueError when empty or probability is not in [0, 1].");
  m.def("chi_square_cdf", &loc::chi_square_cdf, py::arg("x"), py::arg("dof"),
        "P(X <= x) of the chi-square distribution. ValueError unless dof > 0.");
  m.def("chi_square_quantile", &loc::chi_square_quantile, py::arg("probability"), py::arg("dof"),
        "x with P(X <= x) = probability. ValueError unless 0 <= probability < 1 and dof > 0.");
  m.def("parse_seconds", &loc::parse_seconds, py::arg("text"),
        "Decimal seconds to int nanoseconds, exactly. ValueError for any other text.");
  m.def("format_seconds", &loc::format_seconds, py::arg("time_ns"), "Nanoseconds as seconds with nine decimals.");
}

}  // namespace locpy
