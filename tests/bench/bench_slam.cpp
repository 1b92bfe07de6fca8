// SLAM: one update of the large covariance, in this form and in the plain one; a whole frame of the filter, IMU
// included; the cost over an hour. The label of every line names the kernels that the BLAS chose for this machine.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/estimators/slam_filter.hpp"
#include "libloc/filter/blas.hpp"
#include "libloc/filter/large_covariance.hpp"

namespace {

using loc::BlockMeasurement;

constexpr int kHead = 13;  // as the sources count a state with a quaternion

struct Problem {
  Eigen::MatrixXd covariance;
  std::vector<BlockMeasurement> measurements;
  std::vector<int> which;
  std::vector<int> accepted;
  std::vector<double> residual;
};

Problem make_problem(int features, int measured) {
  loc::Random random(7);
  Problem out;
  const int n = kHead + 6 * features;
  Eigen::MatrixXd root(n, n);
  for (Eigen::Index i = 0; i < root.size(); ++i) root.data()[i] = random.normal() / std::sqrt(n);
  out.covariance = root * root.transpose() + 0.1 * Eigen::MatrixXd::Identity(n, n);
  for (int k = 0; k < measured; ++k) {
    BlockMeasurement m;
    m.rows = 2;
    m.head.setZero();
    m.noise_cov.setIdentity();
    m.block = kHead + 6 * (k * features / measured);
    m.block_dim = 6;
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < kHead; ++j) m.head(i, j) = random.normal();
      for (int j = 0; j < 6; ++j) m.block_jacobian(i, j) = random.normal();
      m.residual[i] = random.normal();
      out.accepted.push_back(2 * k + i);
      out.residual.push_back(m.residual[i]);
    }
    out.which.push_back(k);
    out.measurements.push_back(m);
  }
  return out;
}

template <class Scalar>
void Update(benchmark::State& state) {
  const int features = static_cast<int>(state.range(0));
  const int measured = static_cast<int>(state.range(1));
  const Problem problem = make_problem(features, measured);
  loc::LargeCovariance<Scalar> covariance(kHead, kHead + 6 * features, 2 * measured);
  Eigen::VectorXd dx(kHead + 6 * features);
  double nis = 0;
  for (auto _ : state) {
    state.PauseTiming();
    covariance.set_dense(problem.covariance);
    state.ResumeTiming();
    covariance.innovate(problem.measurements, problem.which);
    benchmark::DoNotOptimize(covariance.update(problem.accepted, problem.residual, dx, nis));
  }
  state.SetLabel(loc::blas::kernel_name());
}
BENCHMARK(Update<double>)
    ->Name("update")
    ->Args({100, 50})
    ->Args({100, 100})
    ->Args({200, 50})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(Update<float>)->Name("update_float")->Args({100, 50})->Args({200, 50})->Unit(benchmark::kMillisecond);

// K = P H^T S^-1, P = (I - K H) P, all dense: as the textbook has it.
void UpdateNaive(benchmark::State& state) {
  const Problem problem = make_problem(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  const Eigen::Index n = problem.covariance.rows();
  const auto m = static_cast<Eigen::Index>(problem.accepted.size());
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(m, n);
  Eigen::VectorXd r(m);
  for (std::size_t k = 0; k < problem.measurements.size(); ++k) {
    const BlockMeasurement& one = problem.measurements[k];
    const auto row = static_cast<Eigen::Index>(2 * k);
    h.block(row, 0, 2, kHead) = one.head.topLeftCorner(2, kHead);
    h.block(row, one.block, 2, 6) = one.block_jacobian.topRows(2);
    r.segment<2>(row) = one.residual.head<2>();
  }
  for (auto _ : state) {
    const Eigen::MatrixXd s = h * problem.covariance * h.transpose() + Eigen::MatrixXd::Identity(m, m);
    const Eigen::MatrixXd gain = problem.covariance * h.transpose() * s.inverse();
    const Eigen::VectorXd dx = gain * r;
    const Eigen::MatrixXd after = (Eigen::MatrixXd::Identity(n, n) - gain * h) * problem.covariance;
    benchmark::DoNotOptimize(after.data());
    benchmark::DoNotOptimize(dx.data());
  }
}
BENCHMARK(UpdateNaive)
    ->Name("update_naive")
    ->Args({100, 50})
    ->Args({100, 100})
    ->Args({200, 50})
    ->Unit(benchmark::kMillisecond);

// A camera that circles in a cloud of points with an IMU: 10 samples and one frame are one iteration.
class Ride {
 public:
  Ride(int features, int measured) : filter_(options(features, measured)) {
    loc::Random random(3);
    for (int i = 0; i < 4 * features; ++i) {
      const double angle = random.uniform(0, 2 * std::numbers::pi);
      const double distance = random.uniform(4, 9);
      points_.emplace_back(distance * std::cos(angle), distance * std::sin(angle), random.uniform(-2, 2));
    }
    loc::SlamState state = truth(0);
    filter_.start(1, state, Eigen::MatrixXd::Identity(filter_.layout().dim, filter_.layout().dim) * 1e-4);
    frame_.features.reserve(points_.size());
  }

  void step() {
    constexpr int kSamples = 10;
    for (int i = 0; i < kSamples; ++i) {
      const loc::InertialStep step{{0, 0, kRate}, {-kRadius * kRate * kRate, 0, 9.80665}, 0.005};
      filter_.propagate(filter_.time_ns() + 5'000'000, step, {1e-8, 1e-6, 0, 1e-12, 1e-10});
    }
    time_s_ += 0.005 * kSamples;
    const loc::Pose3 look = truth(time_s_).T_world_camera().inverse();
    frame_.features.clear();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const auto pixel = camera_.project(look * points_[i]);
      if (!pixel || !camera_.in_image(*pixel, 5)) continue;
      frame_.features.push_back(
          {static_cast<std::int64_t>(i), *pixel + Eigen::Vector2d(noise_.normal(), noise_.normal())});
    }
    frame_.time_ns = filter_.time_ns();
    filter_.update(frame_);
  }
  const loc::SlamFilter& filter() const { return filter_; }

 private:
  static constexpr double kRadius = 2;
  static constexpr double kRate = 0.3;

  static loc::SlamOptions options(int features, int measured) {
    loc::SlamOptions out;
    out.motion = loc::SlamMotion::kInertial;
    out.camera.width_px = 752;
    out.camera.height_px = 480;
    out.camera.intrinsics_px = {458, 457, 367, 248};
    out.camera.T_body_camera.rotation = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
    out.map.max_features = features;
    out.map.max_measured = measured;
    out.map.min_visible = measured;
    out.map.max_linearity_index = 0;  // all stay at six numbers: the most expensive case
    out.sigma_px = 1;
    return out;
  }
  static loc::SlamState truth(double time_s) {
    loc::SlamState out;
    const double angle = kRate * time_s;
    out.q_world_body = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ());
    out.position = {kRadius * std::cos(angle), kRadius * std::sin(angle), 0};
    out.velocity = kRadius * kRate * Eigen::Vector3d(-std::sin(angle), std::cos(angle), 0);
    out.T_body_camera.rotation = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
    return out;
  }

  loc::SlamFilter filter_;
  loc::Camera camera_{options(10, 10).camera};
  std::vector<Eigen::Vector3d> points_;
  loc::FeaturesMeasurement frame_;
  loc::Random noise_{5};
  double time_s_ = 0;
};

// The time that the filter itself states: propagation of the covariance, association, update, map.
void Frame(benchmark::State& state) {
  Ride ride(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  for (int i = 0; i < 200; ++i) ride.step();
  std::int64_t map = 0;
  std::int64_t measured = 0;
  for (auto _ : state) {
    ride.step();
    state.SetIterationTime(ride.filter().frame().time_spent_s);
    map += ride.filter().frame().counts.map;
    measured += ride.filter().frame().counts.measured;
  }
  const auto mean = [&](std::int64_t sum) {
    return static_cast<double>(sum) / static_cast<double>(state.iterations());
  };
  state.counters["map"] = mean(map);
  state.counters["measured"] = mean(measured);
  state.SetLabel(loc::blas::kernel_name());
}
BENCHMARK(Frame)->Name("frame")->Args({100, 50})->Args({200, 50})->UseManualTime()->Unit(benchmark::kMillisecond);

// An hour of frames at 20 Hz: the first and the last ten minutes cost the same.
void Hour(benchmark::State& state) {
  constexpr int kFrames = 72'000;
  constexpr int kPart = 12'000;
  for (auto _ : state) {
    Ride ride(40, 20);
    double first = 0;
    double last = 0;
    for (int i = 0; i < kFrames; ++i) {
      ride.step();
      if (i < kPart) first += ride.filter().frame().time_spent_s;
      if (i >= kFrames - kPart) last += ride.filter().frame().time_spent_s;
    }
    state.counters["first_ms"] = first / kPart * 1e3;
    state.counters["last_ms"] = last / kPart * 1e3;
  }
}
BENCHMARK(Hour)->Name("hour")->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace

BENCHMARK_MAIN();
