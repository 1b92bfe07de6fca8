// The way of a sample from its bytes to its estimate, stage by stage, each beside the plain thing: decoding (beside the
// generated decoder alone), merging (beside handing the sample on), the whole pipeline (beside the filter alone),
// reading a log (beside liblcm's reader and beside reading the bytes). Times per IMU sample or event.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <vector>

#include "libloc/estimators/madgwick.hpp"
#include "libloc/io/lcm_log.hpp"
#include "libloc/sensors/stream.hpp"
#include "msgs/convert.hpp"
#include "msgs/decode.hpp"
#include "support/simulated_imu.hpp"
#include "support/temp_folder.hpp"
#include "tools/support/pipeline.hpp"

namespace loc {
namespace {

constexpr int kSamples = 20000;

template <class Message>
std::vector<std::uint8_t> encoded(const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

// Magnetometer and IMU by turns, as they arrive.
const std::vector<Measurement>& samples() {
  static const std::vector<Measurement> instance = [] {
    std::vector<Measurement> all;
    test::SimulatedImu sim;
    for (int i = 0; i < kSamples; ++i) {
      sim.step({0.5, 0.2, -0.3});
      all.emplace_back(sim.magnetometer);
      all.emplace_back(sim.imu);
    }
    return all;
  }();
  return instance;
}

const std::vector<std::vector<std::uint8_t>>& messages() {
  static const std::vector<std::vector<std::uint8_t>> instance = [] {
    std::vector<std::vector<std::uint8_t>> all;
    for (const Measurement& m : samples()) {
      if (const auto* imu = std::get_if<ImuMeasurement>(&m)) all.push_back(encoded(to_message(*imu)));
    }
    return all;
  }();
  return instance;
}

void report_time(benchmark::State& state, const char* name) {
  state.counters[name] = benchmark::Counter(static_cast<double>(kSamples) * static_cast<double>(state.iterations()),
                                            benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void decode_generated_only(benchmark::State& state) {
  for (auto _ : state) {
    for (const auto& bytes : messages()) {
      imu_t message{};
      message.decode(bytes.data(), 0, static_cast<int>(bytes.size()));
      benchmark::DoNotOptimize(message);
    }
  }
  report_time(state, "per_message");
}

void decode_checked(benchmark::State& state) {
  MeasurementDecoder decoder;
  for (auto _ : state) {
    for (const auto& bytes : messages()) benchmark::DoNotOptimize(decoder.decode("LOC_IMU", bytes));
  }
  report_time(state, "per_message");
}

void filter_only(benchmark::State& state) {
  for (auto _ : state) {
    MadgwickFilter filter(MadgwickOptions::robust());
    for (const Measurement& m : samples()) {
      if (filter.process(m)) benchmark::DoNotOptimize(filter.estimate());
    }
  }
  report_time(state, "per_sample");
}

void merger_only(benchmark::State& state) {
  for (auto _ : state) {
    StreamMerger merger;
    for (const Measurement& m : samples()) {
      merger.push(m);
      while (const auto out = merger.pop()) benchmark::DoNotOptimize(*out);
    }
  }
  report_time(state, "per_sample");
}

void copy_only(benchmark::State& state) {
  for (auto _ : state) {
    for (const Measurement& m : samples()) {
      Measurement out = m;
      benchmark::DoNotOptimize(out);
    }
  }
  report_time(state, "per_sample");
}

void whole_pipeline(benchmark::State& state) {
  for (auto _ : state) {
    EstimatorPipeline pipeline(make_estimator({}), {}, {}, [](const Estimate& e) { benchmark::DoNotOptimize(e); });
    for (const Measurement& m : samples()) pipeline.push(m);
    pipeline.end();
  }
  report_time(state, "per_sample");
}

struct Log {
  test::TempFolder folder;
  std::filesystem::path path = folder.path() / "bench.lcm";
  Log() {
    LcmLogWriter writer(path);
    std::int64_t time_us = 0;
    for (const auto& bytes : messages()) writer.write(time_us += 5000, "LOC_IMU", bytes);
    writer.flush();
  }
};

const std::filesystem::path& log_path() {
  static const Log log;
  return log.path;
}

void read_log(benchmark::State& state) {
  const auto path = log_path();
  for (auto _ : state) {
    LcmLogReader reader(path);
    while (const LcmLogEvent* event = reader.next()) benchmark::DoNotOptimize(event->data.data());
  }
  report_time(state, "per_event");
}

void read_log_liblcm(benchmark::State& state) {
  const auto path = log_path();
  for (auto _ : state) {
    lcm::LogFile file(path.string(), "r");
    while (const lcm::LogEvent* event = file.readNextEvent()) benchmark::DoNotOptimize(event->data);
  }
  report_time(state, "per_event");
}

void read_bytes_only(benchmark::State& state) {
  const auto path = log_path();
  std::vector<char> buffer(1 << 16);
  for (auto _ : state) {
    std::ifstream file(path, std::ios::binary);
    while (file.read(buffer.data(), static_cast<std::streamsize>(buffer.size()))) benchmark::DoNotOptimize(buffer[0]);
  }
  report_time(state, "per_event");
}

BENCHMARK(decode_generated_only)->Unit(benchmark::kMillisecond);
BENCHMARK(decode_checked)->Unit(benchmark::kMillisecond);
BENCHMARK(copy_only)->Unit(benchmark::kMillisecond);
BENCHMARK(merger_only)->Unit(benchmark::kMillisecond);
BENCHMARK(filter_only)->Unit(benchmark::kMillisecond);
BENCHMARK(whole_pipeline)->Unit(benchmark::kMillisecond);
BENCHMARK(read_bytes_only)->Unit(benchmark::kMillisecond);
BENCHMARK(read_log_liblcm)->Unit(benchmark::kMillisecond);
BENCHMARK(read_log)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace loc

BENCHMARK_MAIN();
