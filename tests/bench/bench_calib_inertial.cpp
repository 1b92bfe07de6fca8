// Times of the inertial calibrations, each beside the direct way of doing the same: windows summed anew at every
// sample, Allan deviation by its definition, a derivative by differences instead of the analytic one.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "libloc/calib/accelerometer.hpp"
#include "libloc/calib/allan.hpp"
#include "libloc/calib/gyroscope.hpp"
#include "libloc/calib/magnetometer_alignment.hpp"
#include "libloc/calib/stillness.hpp"
#include "support/pose_sequence.hpp"

namespace loc {
namespace {

struct Prepared {
  test::PoseSequence recording;
  Stillness still;
  AccelerometerFit accelerometer;
};

/// 40 poses, 200 s at 100 Hz.
const Prepared& prepared() {
  static const Prepared instance = [] {
    Prepared p;
    Random random(1);
    p.recording.sigma_gyroscope = 5e-3;
    p.recording.sigma_accelerometer = 1e-2;
    p.recording.run(40, random);
    p.still = find_stillness(p.recording.times_ns, p.recording.gyroscope, p.recording.accelerometer);
    p.accelerometer = fit_accelerometer(accelerometer_poses(p.still.segments));
    return p;
  }();
  return instance;
}

const std::vector<double>& white_noise() {
  static const std::vector<double> instance = [] {
    Random random(2);
    std::vector<double> v;
    for (int i = 0; i < 1'000'000; ++i) v.push_back(random.normal());
    return v;
  }();
  return instance;
}

void stillness(benchmark::State& state) {
  const test::PoseSequence& r = prepared().recording;
  for (auto _ : state) benchmark::DoNotOptimize(find_stillness(r.times_ns, r.gyroscope, r.accelerometer));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(r.times_ns.size()));
}

/// The variance of every window of both sensors alone, each window summed anew.
void stillness_naive_windows(benchmark::State& state) {
  const test::PoseSequence& r = prepared().recording;
  constexpr Eigen::Index kWindow = 50;
  for (auto _ : state) {
    double sum = 0;
    for (const auto* rows : {&r.gyroscope, &r.accelerometer}) {
      for (Eigen::Index i = 0; i + kWindow <= rows->rows(); ++i) {
        const auto window = rows->middleRows(i, kWindow);
        const Eigen::RowVector3d mean = window.colwise().mean();
        sum += (window.rowwise() - mean).squaredNorm();
      }
    }
    benchmark::DoNotOptimize(sum);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(r.times_ns.size()));
}

void stillness_detector(benchmark::State& state) {
  const Prepared& p = prepared();
  const test::PoseSequence& r = p.recording;
  for (auto _ : state) {
    StillnessDetector detector(p.still.gyroscope, p.still.accelerometer, p.still.rate_hz, p.still.window_samples);
    for (std::size_t i = 0; i < r.times_ns.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      detector.update(r.times_ns[i], r.gyroscope.row(row), r.accelerometer.row(row));
    }
    benchmark::DoNotOptimize(detector.still());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(r.times_ns.size()));
}

void accelerometer(benchmark::State& state) {
  const std::vector<StillPose> poses = accelerometer_poses(prepared().still.segments);
  for (auto _ : state) benchmark::DoNotOptimize(fit_accelerometer(poses));
}

void gyroscope(benchmark::State& state) {
  const Prepared& p = prepared();
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        fit_gyroscope(p.recording.times_ns, p.recording.gyroscope, p.still.segments, p.accelerometer));
  }
}

std::vector<RateStep> one_turn() {
  const test::PoseSequence& r = prepared().recording;
  std::vector<RateStep> steps;
  for (Eigen::Index i = 300; i < 500; ++i) {
    steps.push_back({.dt_s = 0.01,
                     .share = 0.5,
                     .begin = r.gyroscope.row(i).transpose(),
                     .end = r.gyroscope.row(i + 1).transpose()});
  }
  return steps;
}

void turn_analytic_jacobian(benchmark::State& state) {
  const std::vector<RateStep> steps = one_turn();
  for (auto _ : state) {
    benchmark::DoNotOptimize(integrate_turn(steps, Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity()));
  }
}

/// Attitude alone, integrated 19 times: once, and twice for each of nine parameters.
void turn_naive_jacobian(benchmark::State& state) {
  const std::vector<RateStep> steps = one_turn();
  for (auto _ : state) {
    for (int k = 0; k < 19; ++k) {
      Eigen::Matrix3d a = Eigen::Matrix3d::Identity();
      if (k > 0) a((k - 1) / 2 / 3, (k - 1) / 2 % 3) += k % 2 == 0 ? 1e-6 : -1e-6;
      Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
      for (const RateStep& s : steps) q = so3::boxplus(q, a * (s.dt_s / 2 * (s.begin + s.end)));
      benchmark::DoNotOptimize(q);
    }
  }
}

void allan(benchmark::State& state) {
  const std::span<const double> v = std::span(white_noise()).first(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(allan_fit(v, 100));
}

/// The same averaging times, each mean summed anew.
void allan_naive(benchmark::State& state) {
  const std::span<const double> v = std::span(white_noise()).first(static_cast<std::size_t>(state.range(0)));
  const AllanFit fit = allan_fit(v, 100);
  for (auto _ : state) {
    double all = 0;
    for (const AllanPoint& p : fit.points) {
      const auto m = static_cast<std::size_t>(p.samples);
      for (std::size_t i = 0; i + 2 * m <= v.size(); ++i) {
        double d = 0;
        for (std::size_t k = 0; k < m; ++k) d += v[i + m + k] - v[i + k];
        all += d * d;
      }
    }
    benchmark::DoNotOptimize(all);
  }
}

void magnetometer_alignment(benchmark::State& state) {
  const test::PoseSequence& r = prepared().recording;
  for (auto _ : state) {
    benchmark::DoNotOptimize(align_magnetometer(r.times_ns, r.gyroscope, r.accelerometer, r.magnetometer));
  }
}

BENCHMARK(stillness)->Unit(benchmark::kMillisecond);
BENCHMARK(stillness_naive_windows)->Unit(benchmark::kMillisecond);
BENCHMARK(stillness_detector)->Unit(benchmark::kMillisecond);
BENCHMARK(accelerometer)->Unit(benchmark::kMillisecond);
BENCHMARK(gyroscope)->Unit(benchmark::kMillisecond);
BENCHMARK(turn_analytic_jacobian)->Unit(benchmark::kMicrosecond);
BENCHMARK(turn_naive_jacobian)->Unit(benchmark::kMicrosecond);
BENCHMARK(allan)->Arg(20'000)->Arg(1'000'000)->Unit(benchmark::kMillisecond);
BENCHMARK(allan_naive)->Arg(20'000)->Unit(benchmark::kMillisecond);
BENCHMARK(magnetometer_alignment)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace loc

BENCHMARK_MAIN();
