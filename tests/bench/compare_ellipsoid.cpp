// Table of the ellipsoid fits on simulated readings: median over 40 runs of the angular error over the whole sphere.
//   compare_ellipsoid [RUNS]
#include <Eigen/Dense>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

#include "libloc/calib/ellipsoid.hpp"
#include "libloc/calib/ellipsoid_detail.hpp"
#include "libloc/core/statistics.hpp"
#include "support/ellipsoid_simulation.hpp"

namespace {

using loc::test::EllipsoidSample;

// The nine-parameter formula as the textbook has it, on the readings as they are.
loc::EllipsoidFit literal(const EllipsoidSample& s) {
  loc::EllipsoidFit fit;
  Eigen::MatrixXd d(s.readings.rows(), 9);
  const auto x = s.readings.col(0).array() / s.radius;
  const auto y = s.readings.col(1).array() / s.radius;
  const auto z = s.readings.col(2).array() / s.radius;
  d << x * x, y * y, z * z, x * y, x * z, y * z, x, y, z;
  const Eigen::VectorXd a = d.colPivHouseholderQr().solve(Eigen::VectorXd::Ones(d.rows()));
  Eigen::Matrix3d m;
  m << a[0], a[3] / 2, a[4] / 2, a[3] / 2, a[1], a[5] / 2, a[4] / 2, a[5] / 2, a[2];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(m);
  if (eigen.eigenvalues()[0] <= 0) return fit;
  fit.is_ellipsoid = true;
  fit.centre = -0.5 * s.radius * m.ldlt().solve(a.tail<3>());
  fit.matrix = eigen.operatorSqrt();
  return fit;
}

loc::EllipsoidFit li_griffiths(const EllipsoidSample& s) {
  loc::EllipsoidFit fit;
  const Eigen::Vector3d mean = s.readings.colwise().mean();
  loc::detail::QuarticMoments moments;
  for (Eigen::Index i = 0; i < s.readings.rows(); ++i) {
    moments.add((s.readings.row(i).transpose() - mean) / s.radius, 1);
  }
  const auto e = loc::detail::fit_li_griffiths(moments);
  fit.is_ellipsoid = e.has_value();
  if (!e) return fit;
  fit.centre = mean + s.radius * e->centre;
  fit.matrix = e->matrix;
  return fit;
}

std::function<loc::EllipsoidFit(const EllipsoidSample&)> ours(loc::EllipsoidMethod method, double prior = 0.2) {
  return [=](const EllipsoidSample& s) {
    return loc::fit_ellipsoid(s.readings, {.method = method, .shape_prior_sigma = prior});
  };
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::atoi(argv[1]) : 40;
  if (runs <= 0) {
    std::fprintf(stderr, "compare_ellipsoid: '%s': a number of runs is needed\n", argv[1]);
    return 2;
  }
  struct Row {
    const char* name;
    std::function<loc::EllipsoidFit(const EllipsoidSample&)> fit;
  };
  const std::vector<Row> rows = {{"formula, literally", literal},
                                 {"Li-Griffiths, centred", li_griffiths},
                                 {"lsq", ours(loc::EllipsoidMethod::kLsq)},
                                 {"als", ours(loc::EllipsoidMethod::kAls)},
                                 {"sphere", ours(loc::EllipsoidMethod::kSphere)},
                                 {"robust without prior", ours(loc::EllipsoidMethod::kRobust, 0)},
                                 {"robust", ours(loc::EllipsoidMethod::kRobust)}};
  const auto cases = loc::test::ellipsoid_cases();
  std::printf("Median of %d runs [deg]; (n): runs without an ellipsoid, which count as 90 deg\n%-24s", runs, "");
  for (const auto& c : cases) std::printf("%24s", c.name.c_str());
  std::printf("\n");
  for (const Row& row : rows) {
    std::printf("%-24s", row.name);
    for (const auto& c : cases) {
      loc::Random random(1);
      std::vector<double> errors;
      int none = 0;
      for (int run = 0; run < runs; ++run) {
        const EllipsoidSample sample = loc::test::simulate_ellipsoid(c, random);
        const loc::EllipsoidFit fit = row.fit(sample);
        if (!fit.is_ellipsoid) ++none;
        errors.push_back(fit.is_ellipsoid ? loc::test::sphere_error_deg(sample, fit.centre, fit.matrix) : 90.0);
      }
      char text[64];
      std::snprintf(text, sizeof text, none > 0 ? "%.3f (%d)" : "%.3f", loc::quantile(errors, 0.5), none);
      std::printf("%24s", text);
    }
    std::printf("\n");
  }
  return 0;
}
