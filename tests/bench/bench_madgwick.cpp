// Time of one 9-axis update (gyroscope, accelerometer, magnetometer sample) of the Madgwick filter, beside the textbook
// form compiled in the same program: the report's 6-vector objective, its 6x4 Jacobian written out, gradient J^T f,
// normalisations with division, Euler integration.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "libloc/estimators/madgwick.hpp"
#include "support/simulated_imu.hpp"

namespace loc {
namespace {

struct Recording {
  std::vector<ImuMeasurement> imu;
  std::vector<MagnetometerMeasurement> magnetometer;
};

const Recording& recording() {
  static const Recording instance = [] {
    Recording r;
    test::SimulatedImu sim;
    sim.sigma_gyroscope = 0.005;
    sim.sigma_accelerometer = 0.1;
    sim.sigma_magnetometer = 0.3e-6;
    for (int i = 0; i < 20000; ++i) {
      const double t = i * 0.005;
      sim.step({1.2 * std::sin(1.1 * t), 0.9 * std::cos(0.7 * t + 1), 0.8 * std::sin(0.5 * t + 2)});
      r.imu.push_back(sim.imu);
      r.magnetometer.push_back(sim.magnetometer);
    }
    return r;
  }();
  return instance;
}

void report_time(benchmark::State& state) {
  const auto updates = static_cast<double>(recording().imu.size()) * static_cast<double>(state.iterations());
  state.counters["per_update"] = benchmark::Counter(updates, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void madgwick(benchmark::State& state, const MadgwickOptions& options, bool with_magnetometer) {
  const Recording& r = recording();
  for (auto _ : state) {
    MadgwickFilter filter(options);
    for (std::size_t i = 0; i < r.imu.size(); ++i) {
      if (with_magnetometer) filter.update(r.magnetometer[i]);
      filter.update(r.imu[i]);
    }
    benchmark::DoNotOptimize(filter.orientation());
  }
  report_time(state);
}

// Quaternion wxyz, world x north, z up.
struct Textbook {
  double q0 = 1, q1 = 0, q2 = 0, q3 = 0;
  double beta = 0.1;

  void update(const Eigen::Vector3d& gyro, const Eigen::Vector3d& force, const Eigen::Vector3d& field, double dt) {
    const double a_norm = force.norm();
    const double ax = force.x() / a_norm, ay = force.y() / a_norm, az = force.z() / a_norm;
    const double m_norm = field.norm();
    const double mx = field.x() / m_norm, my = field.y() / m_norm, mz = field.z() / m_norm;
    // Field in world, turned into the x-z plane.
    const double hx = 2 * mx * (0.5 - q2 * q2 - q3 * q3) + 2 * my * (q1 * q2 - q0 * q3) + 2 * mz * (q1 * q3 + q0 * q2);
    const double hy = 2 * mx * (q1 * q2 + q0 * q3) + 2 * my * (0.5 - q1 * q1 - q3 * q3) + 2 * mz * (q2 * q3 - q0 * q1);
    const double bz = 2 * mx * (q1 * q3 - q0 * q2) + 2 * my * (q2 * q3 + q0 * q1) + 2 * mz * (0.5 - q1 * q1 - q2 * q2);
    const double bx = std::sqrt(hx * hx + hy * hy);
    const double f[6] = {2 * (q1 * q3 - q0 * q2) - ax,
                         2 * (q0 * q1 + q2 * q3) - ay,
                         2 * (0.5 - q1 * q1 - q2 * q2) - az,
                         2 * bx * (0.5 - q2 * q2 - q3 * q3) + 2 * bz * (q1 * q3 - q0 * q2) - mx,
                         2 * bx * (q1 * q2 - q0 * q3) + 2 * bz * (q0 * q1 + q2 * q3) - my,
                         2 * bx * (q0 * q2 + q1 * q3) + 2 * bz * (0.5 - q1 * q1 - q2 * q2) - mz};
    const double jacobian[6][4] = {
        {-2 * q2, 2 * q3, -2 * q0, 2 * q1},
        {2 * q1, 2 * q0, 2 * q3, 2 * q2},
        {0, -4 * q1, -4 * q2, 0},
        {-2 * bz * q2, 2 * bz * q3, -4 * bx * q2 - 2 * bz * q0, -4 * bx * q3 + 2 * bz * q1},
        {-2 * bx * q3 + 2 * bz * q1, 2 * bx * q2 + 2 * bz * q0, 2 * bx * q1 + 2 * bz * q3, -2 * bx * q0 + 2 * bz * q2},
        {2 * bx * q2, 2 * bx * q3 - 4 * bz * q1, 2 * bx * q0 - 4 * bz * q2, 2 * bx * q1}};
    double gradient[4] = {0, 0, 0, 0};
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 4; ++j) gradient[j] += jacobian[i][j] * f[i];
    }
    const double g_norm = std::sqrt(gradient[0] * gradient[0] + gradient[1] * gradient[1] + gradient[2] * gradient[2] +
                                    gradient[3] * gradient[3]);
    const double step = g_norm > 0 ? beta / g_norm : 0;
    const double wx = gyro.x(), wy = gyro.y(), wz = gyro.z();
    const double d0 = 0.5 * (-q1 * wx - q2 * wy - q3 * wz) - step * gradient[0];
    const double d1 = 0.5 * (q0 * wx + q2 * wz - q3 * wy) - step * gradient[1];
    const double d2 = 0.5 * (q0 * wy - q1 * wz + q3 * wx) - step * gradient[2];
    const double d3 = 0.5 * (q0 * wz + q1 * wy - q2 * wx) - step * gradient[3];
    q0 += d0 * dt;
    q1 += d1 * dt;
    q2 += d2 * dt;
    q3 += d3 * dt;
    const double norm = std::sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3);
    q0 /= norm;
    q1 /= norm;
    q2 /= norm;
    q3 /= norm;
  }
};

void report_9_axis(benchmark::State& state) {
  madgwick(state, MadgwickOptions::report(), true);
}
void robust_9_axis(benchmark::State& state) {
  madgwick(state, MadgwickOptions::robust(), true);
}
void report_6_axis(benchmark::State& state) {
  madgwick(state, MadgwickOptions::report(), false);
}
void robust_6_axis(benchmark::State& state) {
  madgwick(state, MadgwickOptions::robust(), false);
}

void textbook_9_axis(benchmark::State& state) {
  const Recording& r = recording();
  for (auto _ : state) {
    Textbook filter;
    for (std::size_t i = 0; i < r.imu.size(); ++i) {
      filter.update(r.imu[i].angular_velocity, r.imu[i].specific_force, r.magnetometer[i].magnetic_field, 0.005);
    }
    benchmark::DoNotOptimize(filter.q0);
  }
  report_time(state);
}

BENCHMARK(textbook_9_axis)->Unit(benchmark::kMillisecond);
BENCHMARK(report_9_axis)->Unit(benchmark::kMillisecond);
BENCHMARK(robust_9_axis)->Unit(benchmark::kMillisecond);
BENCHMARK(report_6_axis)->Unit(benchmark::kMillisecond);
BENCHMARK(robust_6_axis)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace loc

BENCHMARK_MAIN();
