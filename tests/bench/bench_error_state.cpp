// Times of the error-state filter beside what it stands for: the step and the update of 16 errors as the plain matrix
// formulas say them (F P F^T and the Joseph form with dense fixed-size matrices), and a minute of the example, 6000 IMU
// samples and 1500 poses of odometry, with and without history.
#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/estimators/error_state_detail.hpp"
#include "libloc/estimators/fusion_preset.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr int kSize = 16;
using Square = Eigen::Matrix<double, kSize, kSize>;

Square some_covariance() {
  Random random(1);
  Square a;
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j < kSize; ++j) a(i, j) = random.normal();
  }
  return a * a.transpose() / kSize + 0.1 * Square::Identity();
}

const InertialStep kInertialStep{{0.1, -0.2, 0.3}, {0.5, 0.2, 9.8}, 0.01};
const Eigen::Vector3d kDown(0, 0, -9.81);

// One pose of odometry as an observation of 16 errors.
Observation some_observation() {
  FusionPreset preset = FusionPreset::inflated();
  error_state::Machine machine(preset.options);
  error_state::Core core;
  core.state.inertial.position = {3, -2, 1};
  core.covariance = some_covariance();
  error_state::Correction c;
  c.source = FusionSource::kOdometry;
  c.vector = {3.01, -2.02, 1.01};
  c.vector_cov = 0.01 * Eigen::Matrix3d::Identity();
  c.second_cov = 1e-4 * Eigen::Matrix3d::Identity();
  Observation o;
  machine.linearise(core, c, o);
  return o;
}

void predict_sparse(benchmark::State& state) {
  InertialState x;
  Eigen::MatrixXd p = some_covariance();
  for (auto _ : state) {
    const InertialJacobian f = propagate(x, kInertialStep, kDown, ImuIntegration::kMidpoint);
    propagate_covariance(p, f, {1e-6, 1e-4, 0, 1e-12, 1e-10});
    benchmark::DoNotOptimize(p.data());
    if (p(0, 0) > 1e3) p = some_covariance();
  }
}
BENCHMARK(predict_sparse);

void predict_dense(benchmark::State& state) {
  InertialState x;
  Square p = some_covariance();
  for (auto _ : state) {
    Square f = Square::Identity();
    f.topLeftCorner<kInertialDim, kInertialDim>() =
        dense(propagate(x, kInertialStep, kDown, ImuIntegration::kMidpoint));
    p = (f * p * f.transpose()).eval();
    p.diagonal().array() += 1e-6;
    benchmark::DoNotOptimize(p.data());
    if (p(0, 0) > 1e3) p = some_covariance();
  }
}
BENCHMARK(predict_dense);

void update_sparse(benchmark::State& state) {
  const Observation o = some_observation();
  const Eigen::MatrixXd start = some_covariance();
  Eigen::MatrixXd p = start;
  Eigen::VectorXd dx(kSize);
  Innovation innovation;
  for (auto _ : state) {
    p = start;
    benchmark::DoNotOptimize(innovate(p, o, innovation));
    joseph_update(p, o, innovation, dx);
    benchmark::DoNotOptimize(p.data());
    benchmark::DoNotOptimize(dx.data());
  }
}
BENCHMARK(update_sparse);

void update_dense(benchmark::State& state) {
  const Observation o = some_observation();
  Eigen::Matrix<double, 6, kSize> h = Eigen::Matrix<double, 6, kSize>::Zero();
  for (int i = 0; i < o.count(); ++i) h(o.entries()[i].row, o.entries()[i].column) += o.entries()[i].value;
  const Square start = some_covariance();
  for (auto _ : state) {
    Square p = start;
    const Matrix6d s = h * p * h.transpose() + o.noise_cov;
    const Eigen::Matrix<double, kSize, 6> k = s.llt().solve(h * p).transpose();
    const Eigen::Matrix<double, kSize, 1> dx = k * o.residual;
    const Square i_kh = Square::Identity() - k * h;
    p = (i_kh * p * i_kh.transpose() + k * o.noise_cov * k.transpose()).eval();
    benchmark::DoNotOptimize(p.data());
    benchmark::DoNotOptimize(dx.data());
  }
}
BENCHMARK(update_dense);

// predict() and fuse_vo() as a user calls them: history kept, input checked, residual and S given back.
void minute_of_the_example(benchmark::State& state, const FusionPreset& preset, TimeNs history_ns, int late_samples) {
  ErrorStateOptions options = preset.options;
  options.history_ns = history_ns;
  Random random(2);
  std::vector<ImuMeasurement> imu(6000);
  std::vector<Eigen::Vector3d> vo(1500);
  for (int i = 0; i < 6000; ++i) {
    imu[i].time_ns = i * 10'000'000LL;
    imu[i].angular_velocity = 0.01 * random.normal3();
    imu[i].specific_force = Eigen::Vector3d(0, 0, 9.81) + 0.1 * random.normal3();
    if (i % 4 == 0) vo[i / 4] = 0.14 * random.normal3();
  }
  ErrorStateFilter filter(options);
  for (auto _ : state) {
    filter.start(0, {}, preset.start_cov);
    for (int i = 0; i < 6000; ++i) {
      filter.predict(imu[i]);
      const int of = i - late_samples;
      if (of < 0 || of % 4 != 0) continue;
      benchmark::DoNotOptimize(filter.fuse_vo(imu[of].time_ns, vo[of / 4], preset.odometry_position_cov,
                                              Eigen::Quaterniond::Identity(), preset.odometry_orientation_cov));
    }
  }
}
BENCHMARK_CAPTURE(minute_of_the_example, errors_16, FusionPreset::inflated(), 500'000'000, 0)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(minute_of_the_example, errors_19, FusionPreset::drift(), 500'000'000, 0)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(minute_of_the_example, errors_16_no_history, FusionPreset::inflated(), 0, 0)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(minute_of_the_example, errors_16_all_100ms_late, FusionPreset::inflated(), 500'000'000, 10)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace loc

BENCHMARK_MAIN();
