#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "libloc/calib/ellipsoid.hpp"
#include "libloc/calib/ellipsoid_detail.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "libloc/core/statistics.hpp"
#include "support/data.hpp"
#include "support/ellipsoid_checks.hpp"
#include "support/ellipsoid_simulation.hpp"
#include "support/number_table.hpp"
#include "support/numeric_jacobian.hpp"

namespace loc {
namespace {

using test::EllipsoidCase;
using test::EllipsoidSample;
using test::simulate_ellipsoid;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

EllipsoidFit fit_with(const Rows& readings, EllipsoidMethod method) {
  return fit_ellipsoid(readings, {.method = method});
}

constexpr std::array<EllipsoidMethod, 3> kShapeMethods = {EllipsoidMethod::kLsq, EllipsoidMethod::kRobust,
                                                          EllipsoidMethod::kAls};

TEST(SphereCoverage, CellsHaveEqualAreaAndTheirMiddlesLieInThem) {
  for (int cell = 0; cell < SphereCoverage::kCells; ++cell) {
    EXPECT_EQ(SphereCoverage::cell(3.7 * SphereCoverage::direction(cell)), cell);
    EXPECT_NEAR(SphereCoverage::direction(cell).norm(), 1, 1e-15);
  }
  Random random(1);
  SphereCoverage coverage;
  for (int i = 0; i < 100'000; ++i) coverage.add(random.direction());
  EXPECT_EQ(coverage.cells_hit(), SphereCoverage::kCells);
  double chi_square = 0;
  for (const int hits : coverage.hits) chi_square += (hits - 1000.0) * (hits - 1000.0) / 1000.0;
  EXPECT_LT(chi_square, chi_square_quantile(0.999, 99));
  EXPECT_THROW(SphereCoverage::cell(Eigen::Vector3d::Zero()), std::invalid_argument);
  EXPECT_THROW(SphereCoverage::cell({NAN, 0, 1}), std::invalid_argument);
  EXPECT_EQ(SphereCoverage::cell({0, 0, -1}), 0);
  EXPECT_LT(SphereCoverage::cell({-1, -1e-300, 1}), SphereCoverage::kCells);
}

TEST(EllipsoidJacobian, SampsonDistance) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    detail::Ellipsoid e;
    e.centre = 0.3 * random.normal3();
    const Eigen::Vector3d axes = Eigen::Vector3d(1, 1.3, 0.7) + 0.1 * random.normal3();
    const Eigen::Matrix3d r = random.rotation().toRotationMatrix();
    e.matrix = r * axes.asDiagonal() * r.transpose();
    e.matrix = Eigen::Matrix3d(e.matrix.selfadjointView<Eigen::Lower>());
    const Eigen::Vector3d z = e.centre + random.uniform(0.3, 2) * random.direction();
    using Vector1 = Eigen::Matrix<double, 1, 1>;
    const auto distance = [&](const detail::Vector9& x) {
      detail::Ellipsoid moved;
      moved.centre = x.head<3>();
      moved.matrix << x[3], x[6], x[7], x[6], x[4], x[8], x[7], x[8], x[5];
      Vector1 out;
      EXPECT_TRUE(detail::sampson_distance(moved, z, out[0], nullptr));
      return out;
    };
    detail::Vector9 x;
    x << e.centre, e.matrix(0, 0), e.matrix(1, 1), e.matrix(2, 2), e.matrix(0, 1), e.matrix(0, 2), e.matrix(1, 2);
    double value = 0;
    detail::Vector9 jacobian;
    ASSERT_TRUE(detail::sampson_distance(e, z, value, &jacobian));
    EXPECT_EQ(value, distance(x)[0]);
    EXPECT_TRUE(test::near(jacobian.transpose().eval(), test::numeric_jacobian(distance, x), 1e-7));
  }
}

TEST(EllipsoidJacobian, ShapePrior) {
  detail::Ellipsoid e;
  e.matrix << 1.1, 0.1, -0.05, 0.1, 0.8, 0.2, -0.05, 0.2, 1.4;
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  const auto prior = [](const Vector6& w) {
    detail::Ellipsoid moved;
    moved.matrix << w[0], w[3], w[4], w[3], w[1], w[5], w[4], w[5], w[2];
    Vector6 residual;
    Eigen::Matrix<double, 6, 6> unused;
    detail::shape_prior(moved, 0.2, residual, unused);
    return residual;
  };
  Vector6 w;
  w << 1.1, 0.8, 1.4, 0.1, -0.05, 0.2;
  Vector6 residual;
  Eigen::Matrix<double, 6, 6> jacobian;
  detail::shape_prior(e, 0.2, residual, jacobian);
  EXPECT_TRUE(test::near(jacobian, test::numeric_jacobian(prior, w), 1e-8));
}

TEST(Ellipsoid, ExactReadingsGiveExactParametersWhateverUnitAndOffset) {
  for (const double offset : {0.0, 1.0, 4.4, 8.0, 30.0}) {
    for (const double radius : {48e-6, 1.0, 3e4}) {
      Random random(3);
      const EllipsoidSample s =
          simulate_ellipsoid({.name = "", .offset = offset, .readings = 200, .noise = 0, .radius = radius}, random);
      const Eigen::Matrix3d expected = s.soft_iron.inverse() * std::cbrt(s.soft_iron.determinant());
      for (const EllipsoidMethod method : kShapeMethods) {
        const EllipsoidFit fit = fit_with(s.readings, method);
        ASSERT_TRUE(fit.is_ellipsoid) << ellipsoid_method_name(method);
        EXPECT_TRUE(test::near((fit.centre / radius).eval(), (s.centre / radius).eval(), 1e-8));
        EXPECT_TRUE(test::near(fit.matrix, expected, 1e-8)) << ellipsoid_method_name(method);
        EXPECT_NEAR(fit.radius / radius / std::cbrt(s.soft_iron.determinant()), 1, 1e-8);
        EXPECT_NEAR(fit.centre_over_radius, s.centre.norm() / fit.radius, 1e-6 * (1 + offset));
        EXPECT_LT(fit.norm_variation_after, 1e-8);
        EXPECT_EQ(fit.quality.verdict, Verdict::kOk);
      }
    }
  }
}

TEST(Ellipsoid, ReferenceNormSetsTheSizeOfTheCorrectedField) {
  Random random(4);
  const EllipsoidSample s = simulate_ellipsoid({.name = ""}, random);
  const EllipsoidFit fit = fit_ellipsoid(s.readings, {.reference_norm = 9.80665});
  double sum = 0;
  for (Eigen::Index i = 0; i < s.readings.rows(); ++i) {
    const Eigen::Vector3d corrected = fit.triad().apply(s.readings.row(i).transpose());
    sum += corrected.norm();
  }
  EXPECT_NEAR(sum / static_cast<double>(s.readings.rows()), 9.80665, 9.80665 * 5e-4);
  EXPECT_EQ(fit.reference_norm, 9.80665);
  EXPECT_EQ(fit.matrix, fit.matrix.transpose());
}

TEST(Ellipsoid, PredictedDeviationRanksTheErrors) {
  // Across coverages from good to hopeless, the predicted deviation of the centre tells good from bad.
  Random random(8);
  std::vector<double> predicted;
  std::vector<double> actual;
  for (int run = 0; run < 200; ++run) {
    const EllipsoidCase c{.name = "", .cap = random.uniform(0.1, 1)};
    const EllipsoidSample s = simulate_ellipsoid(c, random);
    const EllipsoidFit fit = fit_with(s.readings, EllipsoidMethod::kRobust);
    ASSERT_TRUE(fit.is_ellipsoid);
    predicted.push_back(fit.centre_sigma);
    actual.push_back((fit.centre - s.centre).norm() / s.radius);
    if (fit.quality.verdict == Verdict::kOk) {
      EXPECT_LT(actual.back(), 4 * 0.003);
    }
    if (actual.back() > 0.1) {
      EXPECT_GE(fit.quality.verdict, Verdict::kWarn) << actual.back();
    }
  }
  const auto rank = [](const std::vector<double>& v) {
    std::vector<double> r(v.size());
    for (std::size_t i = 0; i < v.size(); ++i) {
      r[i] = static_cast<double>(std::count_if(v.begin(), v.end(), [&](double x) { return x < v[i]; }));
    }
    return r;
  };
  const std::vector<double> a = rank(predicted);
  const std::vector<double> b = rank(actual);
  double difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference += (a[i] - b[i]) * (a[i] - b[i]);
  const double n = static_cast<double>(a.size());
  EXPECT_GT(1 - 6 * difference / (n * (n * n - 1)), 0.85);  // Spearman
}

TEST(Ellipsoid, NeverReturnsAnythingElse) {
  test::expect_ellipsoids_or_refusals(400);
}

TEST(Ellipsoid, RotationAboutOneAxisOnlyIsRefused) {
  // A table turned flat: the readings lie in a plane, whatever their number.
  Random random(10);
  Rows readings(2000, 3);
  for (int i = 0; i < readings.rows(); ++i) {
    const double angle = random.uniform(0, 6.28);
    readings.row(i) << 20e-6 * std::cos(angle), 20e-6 * std::sin(angle), -43e-6;
    readings.row(i) += 0.2e-6 * random.normal3().transpose();
  }
  const EllipsoidFit fit = fit_with(readings, EllipsoidMethod::kRobust);
  EXPECT_EQ(fit.quality.verdict, Verdict::kRefused);
  EXPECT_NE(fit.quality.reasons.at(0).find("turn the device"), std::string::npos);
}

TEST(Ellipsoid, BadReadingsAreCountedAndWeightsCount) {
  Random random(11);
  EllipsoidSample s = simulate_ellipsoid({.name = ""}, random);
  s.readings(3, 1) = std::numeric_limits<double>::quiet_NaN();
  s.readings(7, 0) = std::numeric_limits<double>::infinity();
  const EllipsoidFit fit = fit_with(s.readings, EllipsoidMethod::kRobust);
  EXPECT_EQ(fit.not_finite, 2);
  EXPECT_EQ(fit.readings, 498);
  EXPECT_EQ(fit.quality.verdict, Verdict::kFair);

  // A reading of weight k is k readings, for centre and matrix.
  EllipsoidSample t = simulate_ellipsoid({.name = "", .readings = 80}, random);
  std::vector<double> weights(80, 1.0);
  Rows repeated(160, 3);
  int rows = 0;
  for (int i = 0; i < 80; ++i) {
    weights[i] = i % 3 == 0 ? 3 : 1;
    for (int k = 0; k < weights[i]; ++k) repeated.row(rows++) = t.readings.row(i);
  }
  repeated.conservativeResize(rows, 3);
  for (const EllipsoidMethod method : {EllipsoidMethod::kLsq, EllipsoidMethod::kAls}) {
    const EllipsoidFit weighted = fit_ellipsoid(t.readings, {.method = method}, weights);
    EXPECT_TRUE(test::near(weighted.matrix, fit_with(repeated, method).matrix, 1e-9));
    EXPECT_FALSE(test::near(weighted.matrix, fit_with(t.readings, method).matrix, 1e-6));
  }
  // Weight 0 is as absent.
  std::vector<double> some(80, 1.0);
  for (int i = 40; i < 80; ++i) some[i] = 0;
  const EllipsoidFit half = fit_ellipsoid(t.readings, {}, some);
  EXPECT_TRUE(test::near(half.matrix, fit_ellipsoid(t.readings.topRows(40)).matrix, 1e-12));
  EXPECT_EQ(half.readings, 40);

  // A better reading gets a larger say in the robust fit, too: half of the readings have four times the noise.
  double with = 0;
  double without = 0;
  for (int run = 0; run < 30; ++run) {
    EllipsoidSample u = simulate_ellipsoid({.name = "", .noise = 0.002}, random);
    std::vector<double> w(500, 1.0);
    for (int i = 0; i < 500; i += 2) {
      u.readings.row(i) += 0.01 * u.radius * random.normal3().transpose();
      w[i] = 0.002 * 0.002 / (0.002 * 0.002 + 0.01 * 0.01);
    }
    const EllipsoidFit a = fit_ellipsoid(u.readings, {}, w);
    const EllipsoidFit b = fit_ellipsoid(u.readings);
    with += test::sphere_error_deg(u, a.centre, a.matrix);
    without += test::sphere_error_deg(u, b.centre, b.matrix);
  }
  EXPECT_LT(with, 0.97 * without);
}

TEST(Ellipsoid, ARecordingThatIsMostlyRestDoesNotMislead) {
  // A coarse sensor that lies still gives one reading thousands of times.
  for (std::uint64_t seed = 20; seed < 30; ++seed) {
    Random random(seed);
    const EllipsoidSample s = simulate_ellipsoid({.name = "", .readings = 1500}, random);
    Rows readings(5000, 3);
    readings.topRows(1500) = s.readings;
    for (Eigen::Index i = 1500; i < readings.rows(); ++i) readings.row(i) = s.readings.row(i % 3 == 0 ? 0 : 1);
    constexpr double kQuantum = 0.6e-6;
    readings = (readings / kQuantum).array().round() * kQuantum;
    const EllipsoidFit fit = fit_with(readings, EllipsoidMethod::kRobust);
    EXPECT_TRUE(fit.quality.usable()) << seed;
    EXPECT_LT(test::sphere_error_deg(s, fit.centre, fit.matrix), 0.5) << seed;
  }
}

TEST(Ellipsoid, CorrelatedReadingsHaveALargerSigma) {
  // Ten readings of each pose with the same error tell no more than one.
  Random random(12);
  const EllipsoidSample s = simulate_ellipsoid({.name = ""}, random);
  Rows repeated(s.readings.rows() * 10, 3);
  for (Eigen::Index i = 0; i < repeated.rows(); ++i) repeated.row(i) = s.readings.row(i / 10);
  const double one = fit_with(s.readings, EllipsoidMethod::kRobust).centre_sigma;
  const double ten = fit_with(repeated, EllipsoidMethod::kRobust).centre_sigma;
  EXPECT_NEAR(ten / one, 1, 0.25);
}

TEST(Ellipsoid, VerdictsNameTheReason) {
  Random random(13);
  const auto reasons = [](const EllipsoidFit& fit) {
    std::string all;
    for (const std::string& reason : fit.quality.reasons) all += reason + "\n";
    return all;
  };
  EllipsoidSample s = simulate_ellipsoid({.name = "", .outlier_share = 0.3}, random);
  EllipsoidFit fit = fit_with(s.readings, EllipsoidMethod::kRobust);
  EXPECT_EQ(fit.quality.verdict, Verdict::kWarn);
  EXPECT_NE(reasons(fit).find("lie on one ellipsoid"), std::string::npos) << reasons(fit);
  EXPECT_LT(test::sphere_error_deg(s, fit.centre, fit.matrix), 0.2);

  s = simulate_ellipsoid({.name = "", .noise = 0.08}, random);
  fit = fit_with(s.readings, EllipsoidMethod::kRobust);
  EXPECT_NE(reasons(fit).find("scatter"), std::string::npos) << reasons(fit);

  s = simulate_ellipsoid({.name = ""}, random);
  s.readings.col(1) *= 3;
  fit = fit_with(s.readings, EllipsoidMethod::kRobust);
  EXPECT_NE(reasons(fit).find("longest axis"), std::string::npos) << reasons(fit);
  EXPECT_NEAR(fit.norm_variation_after, 0.005, 0.002);

  fit = fit_with(s.readings.topRows(9), EllipsoidMethod::kRobust);
  EXPECT_NE(reasons(fit).find("9 readings"), std::string::npos) << reasons(fit);
}

TEST(Ellipsoid, SphereFindsTheCentre) {
  Random random(14);
  EllipsoidSample s = simulate_ellipsoid({.name = ""}, random);
  for (Eigen::Index i = 0; i < s.readings.rows(); ++i) {
    s.readings.row(i) = (s.centre + s.radius * (random.direction() + 0.005 * random.normal3())).transpose();
    if (i % 20 == 0) s.readings.row(i) += 0.8 * s.radius * Eigen::RowVector3d(1, 0, 0);
  }
  const EllipsoidFit fit = fit_ellipsoid(s.readings, {.method = EllipsoidMethod::kSphere, .shape_prior_sigma = 0});
  EXPECT_LT((fit.centre - s.centre).norm(), 4 * fit.centre_sigma * fit.radius);
  EXPECT_LT(fit.centre_sigma, 0.001);
  EXPECT_TRUE(test::near(fit.matrix, Eigen::Matrix3d::Identity().eval(), 1e-12));
}

TEST(Ellipsoid, SphereKnowsWhatAShapeNearASphereDoesToItsCentre) {
  // True shapes drawn as the prior says; errors of the centre over their deviation, for caps from small to whole.
  for (const double cap : {0.2, 0.5, 1.0}) {
    Random random(16);
    int inside = 0;
    double largest = 0;
    for (int run = 0; run < 100; ++run) {
      const EllipsoidSample s = simulate_ellipsoid({.name = "", .cap = cap}, random);
      const EllipsoidFit fit =
          fit_ellipsoid(s.readings, {.method = EllipsoidMethod::kSphere, .shape_prior_sigma = 0.1});
      const Eigen::Vector3d error = fit.centre - s.centre;
      inside += error.dot(fit.cov.topLeftCorner<3, 3>().ldlt().solve(error)) < chi_square_quantile(0.99, 3) ? 1 : 0;
      largest = std::max(largest, error.norm() / s.radius);
    }
    EXPECT_GE(inside, 90) << "cap " << cap << ", largest error " << largest;
  }
  // A sphere that is one is known as well as its readings say.
  Random random(17);
  for (int run = 0; run < 20; ++run) {
    EllipsoidSample s = simulate_ellipsoid({.name = ""}, random);
    const Eigen::Vector3d pole = random.direction();
    for (Eigen::Index i = 0; i < s.readings.rows(); ++i) {
      Eigen::Vector3d u = random.direction();
      if (u.dot(pole) < -0.2) u = -u;  // a cap of 60 %
      s.readings.row(i) = (s.centre + s.radius * (u + 0.005 * random.normal3())).transpose();
    }
    const EllipsoidFit fit = fit_with(s.readings, EllipsoidMethod::kSphere);
    EXPECT_LT(fit.centre_sigma, 0.01);
    EXPECT_LT((fit.centre - s.centre).norm(), 5 * fit.centre_sigma * s.radius);
  }
}

TEST(Ellipsoid, OptionsAndSizesAreChecked) {
  const Rows readings = Rows::Random(20, 3);
  EXPECT_THROW(fit_ellipsoid(readings, {.reference_norm = -1}), std::invalid_argument);
  EXPECT_THROW(fit_ellipsoid(readings, {.shape_prior_sigma = NAN}), std::invalid_argument);
  EXPECT_THROW(fit_ellipsoid(readings, {.tukey_c = 0}), std::invalid_argument);
  EXPECT_THROW(fit_ellipsoid(readings, {.max_iterations = 0}), std::invalid_argument);
  EXPECT_THROW(fit_ellipsoid(readings, {.ok_centre_sigma = 0.5}), std::invalid_argument);
  EXPECT_THROW(fit_ellipsoid(readings, {}, std::vector<double>(19, 1.0)), std::invalid_argument);
  EXPECT_THROW(fit_ellipsoid(readings, {}, std::vector<double>(20, -1.0)), std::invalid_argument);
  EXPECT_THROW(parse_ellipsoid_method("best"), std::invalid_argument);
  for (const char* name : {"lsq", "robust", "als", "sphere"}) {
    EXPECT_STREQ(ellipsoid_method_name(parse_ellipsoid_method(name)), name);
  }
}

TEST(EllipsoidCollector, AdviceLeadsToAGoodCalibration) {
  // A person who does what the advice says, from a device that lies still: a reading each half degree of the turn.
  Random random(15);
  const EllipsoidSample truth = simulate_ellipsoid({.name = "", .offset = 2}, random);
  EllipsoidCollector collector;
  Eigen::Vector3d field = random.direction();  // in the sensor's axes
  const auto read = [&] {
    collector.add(truth.centre + truth.radius * (truth.soft_iron * field + 0.005 * random.normal3()));
  };
  for (int i = 0; i < 20'000; ++i) read();
  EllipsoidFit fit = collector.fit();
  EXPECT_GE(fit.quality.verdict, Verdict::kWarn);
  EXPECT_FALSE(collector.advice(fit).enough);
  // Nothing is known yet: a turn about each axis.
  for (const Eigen::Vector3d axis : {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()}) {
    for (int i = 0; i < 120; ++i) {
      field = Eigen::AngleAxisd(-M_PI / 180, axis) * field;
      read();
    }
  }
  int turns = 0;
  for (; turns < 40; ++turns) {
    fit = collector.fit();
    const EllipsoidAdvice advice = collector.advice(fit);
    EXPECT_FALSE(advice.text.empty());
    if (advice.enough) break;
    ASSERT_TRUE(advice.turn_axis.allFinite()) << advice.text;
    // The device turns about turn_axis, hence the field about it the other way in the sensor's axes.
    const double before = std::acos(std::clamp(field.dot(advice.missing_direction), -1.0, 1.0));
    for (double angle = 0; angle < before; angle += M_PI / 360) {
      field = (Eigen::AngleAxisd(-M_PI / 360, advice.turn_axis) * field).normalized();
      read();
    }
    EXPECT_LT(std::acos(std::clamp(field.dot(advice.missing_direction), -1.0, 1.0)), 0.35) << advice.text;
  }
  EXPECT_LT(turns, 40);
  EXPECT_LT(test::sphere_error_deg(truth, fit.centre, fit.matrix), 0.2);
  EXPECT_GT(collector.received(), 20'000);
  EXPECT_FALSE(collector.add({0, NAN, 0}));
  EXPECT_EQ(collector.fit().not_finite, 1);
}

TEST(EllipsoidReal, CkexplorersMagnetometer) {
  LOC_DATA_OR_SKIP(path, "magnetometer/ckexplorer_acc_mag.csv");
  const Eigen::MatrixXd table = test::read_number_table(path);
  ASSERT_EQ(table.rows(), 12'000);
  const EllipsoidFit fit = fit_ellipsoid(table.rightCols<3>());
  EXPECT_NEAR(fit.norm_variation_before, 0.32, 0.01);
  // 1.2551 % is the least that any ellipsoid gives (orthogonal least squares by SciPy); a robust loss costs little.
  EXPECT_LE(fit.norm_variation_after, 0.0126);
  EXPECT_TRUE(fit.quality.usable());
  EXPECT_NEAR(fit_with(table.rightCols<3>(), EllipsoidMethod::kLsq).norm_variation_after, 0.012551, 2e-6);
}

TEST(EllipsoidReal, CentreFourRadiiAway) {
  LOC_DATA_OR_SKIP(path, "magnetometer/jremington_mag3_raw.csv");
  const Eigen::MatrixXd table = test::read_number_table(path);
  for (const EllipsoidMethod method : kShapeMethods) {
    const EllipsoidFit fit = fit_ellipsoid(table.leftCols<3>(), {.method = method});
    ASSERT_TRUE(fit.is_ellipsoid);
    EXPECT_NEAR(fit.centre_over_radius, 4.4, 0.1) << ellipsoid_method_name(method);
    EXPECT_LT(fit.norm_variation_after, 0.03);
  }
}

}  // namespace
}  // namespace loc
