// calib/ellipsoid: fit to an array of readings, and the collector that advises while they come.
#include "libloc/calib/ellipsoid.hpp"

#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"

namespace locpy {
namespace {

using loc::EllipsoidAdvice;
using loc::EllipsoidCollector;
using loc::EllipsoidFit;
using loc::EllipsoidOptions;
using loc::SphereCoverage;

void bind_options(py::module_& m) {
  const EllipsoidOptions d;
  py::class_<EllipsoidOptions>(m, "EllipsoidOptions", "How an ellipsoid is fitted, and where the verdicts change.")
      .def(py::init([](const std::string& method, double reference_norm, double shape_prior_sigma, double tukey_c,
                       double outlier_share, int max_iterations, std::uint64_t seed, double ok, double fair,
                       double warn) {
             EllipsoidOptions options;
             options.method = loc::parse_ellipsoid_method(method);
             options.reference_norm = reference_norm;
             options.shape_prior_sigma = shape_prior_sigma;
             options.tukey_c = tukey_c;
             options.outlier_share = outlier_share;
             options.max_iterations = max_iterations;
             options.seed = seed;
             options.ok_centre_sigma = ok;
             options.fair_centre_sigma = fair;
             options.warn_centre_sigma = warn;
             options.check();
             return options;
           }),
           py::kw_only(), py::arg("method") = loc::ellipsoid_method_name(d.method),
           py::arg("reference_norm") = d.reference_norm, py::arg("shape_prior_sigma") = d.shape_prior_sigma,
           py::arg("tukey_c") = d.tukey_c, py::arg("outlier_share") = d.outlier_share,
           py::arg("max_iterations") = d.max_iterations, py::arg("seed") = d.seed,
           py::arg("ok_centre_sigma") = d.ok_centre_sigma, py::arg("fair_centre_sigma") = d.fair_centre_sigma,
           py::arg("warn_centre_sigma") = d.warn_centre_sigma,
           "method: 'lsq', 'robust', 'als' or 'sphere'. ValueError names a field that is out of range.")
      .def_property_readonly("method",
                             [](const EllipsoidOptions& self) { return loc::ellipsoid_method_name(self.method); })
      .def_readonly("reference_norm", &EllipsoidOptions::reference_norm,
                    "norm of corrected readings, in the unit wanted; 0: the readings' own mean radius")
      .def_readonly("shape_prior_sigma", &EllipsoidOptions::shape_prior_sigma,
                    "robust: deviation of the relative axis lengths from a sphere; 0: no prior")
      .def_readonly("tukey_c", &EllipsoidOptions::tukey_c, "residuals beyond this many sigma do not count")
      .def_readonly("outlier_share", &EllipsoidOptions::outlier_share,
                    "robust: above this share the start is the least median of squares")
      .def_readonly("max_iterations", &EllipsoidOptions::max_iterations)
      .def_readonly("seed", &EllipsoidOptions::seed, "of the subsets of the least median of squares")
      .def_readonly("ok_centre_sigma", &EllipsoidOptions::ok_centre_sigma,
                    "largest predicted deviation of the centre over the radius that is ok")
      .def_readonly("fair_centre_sigma", &EllipsoidOptions::fair_centre_sigma, "… fair")
      .def_readonly("warn_centre_sigma", &EllipsoidOptions::warn_centre_sigma, "… a warning; beyond: refused");
}

void bind_fit(py::module_& m) {
  py::class_<EllipsoidFit>(
      m, "EllipsoidFit",
      "corrected = matrix @ (raw - centre), of norm reference_norm. matrix is symmetric: a rotation "
      "is not observable from norms. Look at quality before using it.")
      .def_property_readonly("method", [](const EllipsoidFit& self) { return loc::ellipsoid_method_name(self.method); })
      .def_readonly("is_ellipsoid", &EllipsoidFit::is_ellipsoid, "False: the readings determine none")
      .def_readonly("converged", &EllipsoidFit::converged)
      .def_readonly("iterations", &EllipsoidFit::iterations)
      .def_property_readonly(
          "centre", [](const EllipsoidFit& self) { return to_array(self.centre); }, "(3,), in the readings' unit")
      .def_property_readonly(
          "matrix", [](const EllipsoidFit& self) { return to_matrix_array(self.matrix); }, "(3, 3), symmetric")
      .def_property_readonly(
          "cov", [](const EllipsoidFit& self) { return to_matrix_array(self.cov); },
          "(9, 9) covariance of centre x, y, z and matrix xx, yy, zz, xy, xz, yz")
      .def_readonly("radius", &EllipsoidFit::radius, "geometric mean of the half axes, in the readings' unit")
      .def_readonly("reference_norm", &EllipsoidFit::reference_norm)
      .def_readonly("noise_sigma", &EllipsoidFit::noise_sigma, "of a reading across the surface, in the readings' unit")
      .def_readonly("residual_rms", &EllipsoidFit::residual_rms, "of the corrected norm over the inliers, relative")
      .def_readonly("norm_variation_before", &EllipsoidFit::norm_variation_before, "of |raw|: deviation over mean")
      .def_readonly("norm_variation_after", &EllipsoidFit::norm_variation_after, "of |corrected|, all readings")
      .def_readonly("readings", &EllipsoidFit::readings, "taken")
      .def_readonly("not_finite", &EllipsoidFit::not_finite, "left out")
      .def_readonly("inliers", &EllipsoidFit::inliers)
      .def_readonly("centre_sigma", &EllipsoidFit::centre_sigma,
                    "largest deviation of the centre in any direction, over the radius")
      .def_readonly("axis_ratio", &EllipsoidFit::axis_ratio, "longest over shortest axis")
      .def_readonly("centre_over_radius", &EllipsoidFit::centre_over_radius, "|centre| / radius")
      .def_property_readonly(
          "coverage",
          [](const EllipsoidFit& self) {
            py::array_t<std::int32_t> out({SphereCoverage::kBands, SphereCoverage::kSectors});
            std::copy(self.coverage.hits.begin(), self.coverage.hits.end(), out.mutable_data());
            return out;
          },
          "(10, 10) int32: readings in cells of equal area; rows from -z up, columns from +x towards +y")
      .def_property_readonly("cells_hit", [](const EllipsoidFit& self) { return self.coverage.cells_hit(); })
      .def_readonly("quality", &EllipsoidFit::quality)
      .def("triad", &EllipsoidFit::triad,
           "For the rig, with its quality. DataError with the reasons when there is none.");

  m.def(
      "fit_ellipsoid",
      [](const FloatArray& readings, const EllipsoidOptions& options, const std::optional<FloatArray>& weights) {
        const Rows<3> rows = rows_view<3>(readings, "readings");
        std::span<const double> w;
        if (weights) {
          w = values_view(*weights, "weights");
          require_rows(static_cast<py::ssize_t>(w.size()), "weights", rows.rows(), "readings");
        }
        const py::gil_scoped_release release;
        return loc::fit_ellipsoid(rows, options, w);
      },
      py::arg("readings"), py::arg_v("options", EllipsoidOptions{}, "EllipsoidOptions()"),
      py::arg("weights") = py::none(),
      "Fits an ellipsoid to float64 (N, 3) readings of any unit; weights (N,): information of a reading relative to "
      "the "
      "others. Bad data do not raise: see EllipsoidFit.quality.");
}

void bind_collector(py::module_& m) {
  py::class_<EllipsoidAdvice>(m, "EllipsoidAdvice", "What to do next while readings are collected.")
      .def_readonly("enough", &EllipsoidAdvice::enough)
      .def_property_readonly(
          "missing_direction", [](const EllipsoidAdvice& self) { return to_array(self.missing_direction); },
          "(3,) in the sensor's axes, of length 1: point it along the field; NaN when there is none")
      .def_property_readonly(
          "turn_axis", [](const EllipsoidAdvice& self) { return to_array(self.turn_axis); },
          "(3,) in the sensor's axes, of length 1: turn about it to get there")
      .def_readonly("text", &EllipsoidAdvice::text, "in words");
  py::class_<EllipsoidCollector>(m, "EllipsoidCollector",
                                 "Collects readings in bounded memory for a calibration that a person watches. Each "
                                 "direction keeps its latest readings.")
      .def(py::init<EllipsoidOptions, int>(), py::arg_v("options", EllipsoidOptions{}, "EllipsoidOptions()"),
           py::arg("readings_per_cell") = 20)
      .def(
          "add",
          [](EllipsoidCollector& self, const ArrayLike& reading) { return self.add(vector3(reading, "reading")); },
          py::arg("reading"), "False when it is not finite: counted and left out.")
      .def("fit", &EllipsoidCollector::fit, "Of what is kept now.")
      .def("advice", &EllipsoidCollector::advice, py::arg("fit"))
      .def_property_readonly("received", &EllipsoidCollector::received)
      .def_property_readonly(
          "kept",
          [](const EllipsoidCollector& self) {
            const std::vector<Eigen::Vector3d> kept = self.kept();
            py::array_t<double> out({static_cast<py::ssize_t>(kept.size()), py::ssize_t{3}});
            double* row = out.mutable_data();
            for (const Eigen::Vector3d& reading : kept) {
              Eigen::Map<Eigen::Vector3d>{row} = reading;
              row += 3;
            }
            return out;
          },
          "(N, 3): the readings that fit() uses, in order of arrival");
}

}  // namespace

void bind_ellipsoid(py::module_& m) {
  bind_options(m);
  bind_fit(m);
  bind_collector(m);
}

}  // namespace locpy
