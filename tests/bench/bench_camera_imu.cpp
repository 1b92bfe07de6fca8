// Camera-IMU calibration: all of it from a cold start (60 s, IMU 200 Hz, camera 20 Hz, 54 corners), the same with as
// many unknowns as Kalibr has, one set of normal equations, and the residuals of one IMU sample with their Jacobians:
// analytic, as the calibration has them, and by Ceres' Jets (where ceres/jet.h is there; Debian: libceres-dev). Both
// are checked to give the same numbers before they are timed.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "imu_jets.hpp"
#include "libloc/calib/camera_imu.hpp"
#include "libloc/calib/camera_imu_problem.hpp"
#include "libloc/geometry/so3.hpp"
#include "support/waved_rig.hpp"

namespace loc {
namespace {

using bench::ImuJacobian;
using bench::ImuResiduals;
using bench::ImuSegment;
using bench::kJetOrder;

const test::WavedRig& nominal() {
  static const test::WavedRig rig = test::wave({}, 1);
  return rig;
}

CameraImuFit calibrate(const CameraImuOptions& options) {
  const test::WavedRig& rig = nominal();
  const CameraRecording camera{rig.camera, rig.views};
  return calibrate_camera_imu(rig.target, std::span(&camera, 1), rig.imu, ImuNoise{}, options);
}

void calibrate(benchmark::State& state, const CameraImuOptions& options) {
  CameraImuFit fit;
  for (auto _ : state) fit = calibrate(options);
  state.counters["start_s"] = fit.start_cpu_s;
  state.counters["solve_s"] = fit.solve_cpu_s;
  state.counters["iterations"] = fit.iterations;
  state.counters["knots_ms"] = 1e3 * fit.knot_spacing_s;
}

void nominal_20ms(benchmark::State& state) {
  CameraImuOptions options;
  options.knot_spacing_s = 0.02;
  calibrate(state, options);
}

void kalibr_sized(benchmark::State& state) {
  CameraImuOptions options;
  options.knot_spacing_s = 0.01;
  options.bias_spacing_s = 0.02;
  calibrate(state, options);
}

/// The nominal problem near its solution.
struct Prepared {
  calib::CameraImuProblem problem;
  calib::CameraImuState state;
};
Prepared prepare(double spacing_s, double bias_spacing_s) {
  const test::WavedRig& rig = nominal();
  const CameraImuFit fit = calibrate({});
  const TimeNs origin = rig.imu.front().time_ns;
  std::vector<calib::ImuRow> imu;
  std::vector<double> times;
  for (const ImuMeasurement& sample : rig.imu) {
    imu.push_back({to_seconds(sample.time_ns - origin), sample.angular_velocity, sample.specific_force});
  }
  Eigen::MatrixXd positions(3, static_cast<Eigen::Index>(fit.imu_time_ns.size()));
  for (std::size_t i = 0; i < fit.imu_time_ns.size(); ++i) {
    times.push_back(to_seconds(fit.imu_time_ns[i] - origin));
    positions.col(static_cast<Eigen::Index>(i)) = fit.T_target_imu[i].translation;
  }
  std::vector<calib::FrameRow> frames;
  for (std::size_t v = 0; v < rig.views.size(); ++v) {
    if (!fit.cameras[0].views[v].used) continue;
    calib::FrameRow frame;
    frame.view = v;
    frame.t_s = to_seconds(rig.views[v].time_ns - origin);
    frame.sigma_px = 0.3;
    for (const TargetCorner& corner : rig.views[v].corners) {
      frame.corners.push_back({rig.target.corner(corner.id), corner.pixel_px, corner.id});
    }
    frames.push_back(std::move(frame));
  }
  const calib::ChainPlan plan = calib::plan_chain(times.front(), times.back(), spacing_s, kJetOrder, bias_spacing_s);
  calib::CameraImuState state;
  state.rotations = calib::fit_rotations(plan.grid, times, fit.T_target_imu, 1e-9);
  state.positions = calib::fit_vectors(plan.grid, times, positions, 1e-9);
  state.biases = Eigen::MatrixXd::Zero(6, plan.bias_knots());
  calib::CameraState camera;
  camera.R_camera_imu = fit.cameras[0].T_camera_imu.rotation;
  camera.t_camera_imu = fit.cameras[0].T_camera_imu.translation;
  camera.offset_s = fit.cameras[0].time_offset_s;
  camera.camera = rig.camera;
  state.cameras.push_back(camera);
  state.gravity = fit.gravity_target;
  const DiscreteImuNoise sample = discretise(ImuNoise{}, 0.005);
  const DiscreteImuNoise knot = discretise(ImuNoise{}, plan.bias_spacing_s());
  return {calib::CameraImuProblem(std::move(imu), std::move(frames),
                                  {sample.sigma_angular_velocity, sample.sigma_specific_force,
                                   knot.sigma_gyroscope_bias_step, knot.sigma_accelerometer_bias_step},
                                  3, plan),
          std::move(state)};
}

/// @param state knots and bias knots, in ms
void linearise(benchmark::State& state) {
  const Prepared prepared =
      prepare(1e-3 * static_cast<double>(state.range(0)), 1e-3 * static_cast<double>(state.range(1)));
  const calib::SharedLayout shared = calib::shared_layout(prepared.state.cameras, {});
  calib::ChainSystem system(prepared.problem.layout(shared));
  for (auto _ : state) {
    system.clear();
    benchmark::DoNotOptimize(prepared.problem.linearise(prepared.state, shared, system));
  }
}

void solve_step(benchmark::State& state) {
  const Prepared prepared =
      prepare(1e-3 * static_cast<double>(state.range(0)), 1e-3 * static_cast<double>(state.range(1)));
  const calib::SharedLayout shared = calib::shared_layout(prepared.state.cameras, {});
  calib::ChainSystem system(prepared.problem.layout(shared));
  system.clear();
  prepared.problem.linearise(prepared.state, shared, system);
  calib::ChainStep step;
  for (auto _ : state) {
    if (!system.solve(1e-9, step)) state.SkipWithError("not positive definite");
  }
}

/// One sample in a segment of a waved rig's size.
struct Sample {
  std::vector<Eigen::Quaterniond> rotations;
  ImuSegment segment;
  ImuResiduals reading;
  SplineWeights weights = weights_at(kJetOrder, 0.02, 0.37);
  SplineWeights cumulative = cumulative_weights_at(kJetOrder, 0.02, 0.37);

  Sample() {
    Random random(3);
    Eigen::Quaterniond attitude = so3::exp(random.normal3());
    Eigen::Vector3d place = random.normal3();
    for (int j = 0; j < kJetOrder; ++j) {
      rotations.push_back(attitude);
      segment.positions.col(j) = place;
      attitude = attitude * so3::exp(0.02 * random.normal3());
      place += 0.004 * random.normal3();
    }
    segment.rotations = rotations;
    segment.gravity = {0.3, -9.7, 1.1};
    reading << random.normal3(), random.normal3();
  }
};

void analytic(const Sample& s, ImuResiduals& residuals, ImuJacobian& jacobian) {
  std::array<calib::RotationStep, kJetOrder - 1> steps;
  for (std::size_t j = 0; j < steps.size(); ++j) steps[j] = calib::step_between(s.rotations[j], s.rotations[j + 1]);
  RotationJacobians by;
  const RotationState at = calib::rotation_at(s.rotations[0], steps, s.cumulative, &by);
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
  for (int j = 0; j < kJetOrder; ++j) {
    acceleration += s.weights.second[static_cast<std::size_t>(j)] * s.segment.positions.col(j);
  }
  const Eigen::Matrix3d to_body = at.rotation.conjugate().toRotationMatrix();
  const Eigen::Vector3d force = to_body * (acceleration - s.segment.gravity);
  residuals << at.angular_velocity, force;
  residuals -= s.reading;
  const Eigen::Matrix3d by_turn = so3::hat(force);
  for (int j = 0; j < kJetOrder; ++j) {
    const auto k = static_cast<std::size_t>(j);
    jacobian.block<3, 3>(0, 3 * j) = by.angular_velocity[k];
    jacobian.block<3, 3>(3, 3 * j) = by_turn * by.rotation[k];
    jacobian.block<3, 3>(0, 3 * (kJetOrder + j)).setZero();
    jacobian.block<3, 3>(3, 3 * (kJetOrder + j)) = s.weights.second[k] * to_body;
  }
}

void sample_analytic(benchmark::State& state) {
  const Sample sample;
  ImuResiduals residuals;
  ImuJacobian jacobian;
  for (auto _ : state) {
    analytic(sample, residuals, jacobian);
    benchmark::DoNotOptimize(jacobian);
  }
}

#ifdef LOC_HAVE_CERES_JET
void sample_jets(benchmark::State& state) {
  const Sample s;
  ImuResiduals residuals;
  ImuResiduals same;
  ImuJacobian jacobian;
  ImuJacobian likewise;
  analytic(s, same, likewise);
  bench::imu_by_jets(s.segment, s.weights, s.cumulative, s.reading, residuals, jacobian);
  const double scale = likewise.cwiseAbs().maxCoeff();
  if (!((residuals - same).cwiseAbs().maxCoeff() < 1e-9 &&
        (jacobian - likewise).cwiseAbs().maxCoeff() < 1e-9 * scale)) {
    state.SkipWithError("Jets and analytic Jacobians differ");
    return;
  }
  for (auto _ : state) {
    bench::imu_by_jets(s.segment, s.weights, s.cumulative, s.reading, residuals, jacobian);
    benchmark::DoNotOptimize(jacobian);
  }
}
BENCHMARK(sample_jets)->Unit(benchmark::kMicrosecond);
#endif

BENCHMARK(sample_analytic)->Unit(benchmark::kMicrosecond);
BENCHMARK(linearise)->Args({20, 1000})->Args({10, 20})->Unit(benchmark::kMillisecond);
BENCHMARK(solve_step)->Args({20, 1000})->Args({10, 20})->Unit(benchmark::kMillisecond);
BENCHMARK(nominal_20ms)->Unit(benchmark::kMillisecond);
BENCHMARK(kalibr_sized)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace loc

BENCHMARK_MAIN();
