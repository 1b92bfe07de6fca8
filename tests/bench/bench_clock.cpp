// Time of one update of the clock model (and of one conversion), beside a line through all samples: by running sums,
// and summed up anew with every sample.
#include <benchmark/benchmark.h>

#include <vector>

#include "bench/clock_peers.hpp"
#include "libloc/sensors/clock.hpp"
#include "libloc/sim/clock.hpp"

namespace loc {
namespace {

const std::vector<ClockSample>& samples(bool pulses) {
  static const std::vector<ClockSample> imu = simulate_clock(ClockSimulation::usb_imu(), 600, Random(1));
  static const std::vector<ClockSample> pps = simulate_clock(ClockSimulation::pps(), 36'000, Random(1));
  return pulses ? pps : imu;
}

void report(benchmark::State& state, std::size_t per_iteration) {
  const auto updates = static_cast<double>(per_iteration) * static_cast<double>(state.iterations());
  state.counters["per_update"] = benchmark::Counter(updates, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void run_model(benchmark::State& state, bool pulses) {
  const auto& data = samples(pulses);
  for (auto _ : state) {
    ClockModel model;
    for (const ClockSample& s : data) model.update(s.device_time_ns, s.host_time_ns);
    benchmark::DoNotOptimize(model.line());
  }
  report(state, data.size());
}

void model_imu_200_hz(benchmark::State& state) {
  run_model(state, false);
}
void model_pulses_1_hz(benchmark::State& state) {
  run_model(state, true);
}

void model_imu_200_hz_update_and_convert(benchmark::State& state) {
  const auto& data = samples(false);
  for (auto _ : state) {
    ClockModel model;
    for (const ClockSample& s : data) {
      model.update(s.device_time_ns, s.host_time_ns);
      benchmark::DoNotOptimize(model.convert(s.device_time_ns));
    }
  }
  report(state, data.size());
}

void growing_least_squares(benchmark::State& state) {
  const auto& data = samples(false);
  for (auto _ : state) {
    bench::GrowingLeastSquares line;
    for (const ClockSample& s : data) benchmark::DoNotOptimize(line.update(s.device_time_ns, s.host_time_ns));
  }
  report(state, data.size());
}

// 20 s only: its time grows with the square of the number of samples.
void full_refit_with_every_sample(benchmark::State& state) {
  const auto& data = samples(false);
  constexpr std::size_t kCount = 4000;
  for (auto _ : state) {
    bench::RefitLeastSquares line;
    for (std::size_t i = 0; i < kCount; ++i) {
      benchmark::DoNotOptimize(line.update(data[i].device_time_ns, data[i].host_time_ns));
    }
  }
  report(state, kCount);
}

BENCHMARK(model_imu_200_hz)->Unit(benchmark::kMillisecond);
BENCHMARK(model_imu_200_hz_update_and_convert)->Unit(benchmark::kMillisecond);
BENCHMARK(model_pulses_1_hz)->Unit(benchmark::kMillisecond);
BENCHMARK(growing_least_squares)->Unit(benchmark::kMillisecond);
BENCHMARK(full_refit_with_every_sample)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace loc

BENCHMARK_MAIN();
