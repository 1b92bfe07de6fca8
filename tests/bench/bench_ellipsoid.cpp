// Time of an ellipsoid fit of 10,000 readings, by method, beside the dense least squares that the formula suggests.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>

#include "libloc/calib/ellipsoid.hpp"
#include "support/ellipsoid_simulation.hpp"

namespace loc {
namespace {

const test::EllipsoidSample& sample() {
  static const test::EllipsoidSample instance = [] {
    Random random(1);
    return test::simulate_ellipsoid({.name = "", .cap = 0.6, .outlier_share = 0.05, .readings = 10'000}, random);
  }();
  return instance;
}

void fit(benchmark::State& state, EllipsoidMethod method) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(fit_ellipsoid(sample().readings, {.method = method}));
  }
}

// The formula's N x 9 system through a QR decomposition, without covariance and verdict.
void formula(benchmark::State& state) {
  const auto& readings = sample().readings;
  for (auto _ : state) {
    Eigen::MatrixXd d(readings.rows(), 9);
    const auto x = readings.col(0).array();
    const auto y = readings.col(1).array();
    const auto z = readings.col(2).array();
    d << x * x, y * y, z * z, x * y, x * z, y * z, x, y, z;
    benchmark::DoNotOptimize(d.householderQr().solve(Eigen::VectorXd::Ones(d.rows())).eval());
  }
}

BENCHMARK(formula)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(fit, lsq, EllipsoidMethod::kLsq)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(fit, als, EllipsoidMethod::kAls)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(fit, sphere, EllipsoidMethod::kSphere)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(fit, robust, EllipsoidMethod::kRobust)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace loc

BENCHMARK_MAIN();
