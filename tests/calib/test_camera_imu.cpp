// Camera-IMU calibration: derivatives, start values, and simulated recordings with known truth.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "libloc/calib/camera_imu.hpp"
#include "libloc/calib/camera_imu_knots.hpp"
#include "libloc/calib/camera_imu_problem.hpp"
#include "libloc/core/random.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/geometry/so3.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/sources.hpp"
#include "tests/support/waved_rig.hpp"

namespace loc {
namespace {

using calib::CameraImuProblem;
using calib::CameraImuState;
using calib::ChainStep;
using calib::ChainSystem;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using test::expect_data_error;
using test::near;
using test::wave;
using test::WavedRig;
using test::WavedRigOptions;

constexpr double kDegree = 0.017453292519943295;

// ---- derivatives

// A short problem with residuals of some size, away from its minimum. Two cameras, of which the second has rows of
// their own times.
struct Small {
  CameraImuProblem problem;
  CameraImuState state;
  calib::SharedLayout shared;
};

struct SmallOptions {
  double loss = 3;
  int order = 6;
  double bias_spacing_s = 0.4;
  RotationForm form = RotationForm::kCumulative;
  calib::SharedChoice choice{true, true, true, true, true};
};

Small small_problem(const SmallOptions& options) {
  Random random(9);
  const WavedRig rig = wave({.seconds = 2}, 3);
  const calib::ChainPlan plan = calib::plan_chain(0, 1.2, 0.02, options.order, options.bias_spacing_s);
  std::vector<calib::ImuRow> imu;
  for (int i = 0; i < 240; ++i) {
    const ImuMeasurement& m = rig.imu[static_cast<std::size_t>(i)];
    imu.push_back({i * 0.005, m.angular_velocity, m.specific_force});
  }
  std::vector<calib::FrameRow> frames;
  for (std::size_t i = 0; i < 8; ++i) {
    calib::FrameRow frame{i % 2, i, 0.1 * static_cast<double>(i) + 0.103, 0, 0.3, {}};
    for (const TargetCorner& corner : rig.views[2 * i].corners) {
      if (corner.id % 9 == 0) frame.corners.push_back({rig.target.corner(corner.id), corner.pixel_px, corner.id});
    }
    frames.push_back(frame);
  }
  CameraImuState state;
  state.form = options.form;
  const int n = plan.grid.control_points();
  const auto noise = [&](int rows, int columns) {
    return MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); }).eval();
  };
  const Eigen::Quaterniond ahead = Eigen::Quaterniond(0, 1, 0, 0) * rig.T_camera_imu.rotation;
  if (options.form == RotationForm::kCumulative) {
    for (int i = 0; i < n; ++i) state.rotations.push_back(so3::boxplus(ahead, 0.05 * random.normal3()));
  } else {
    state.mean = so3::boxplus(ahead, Vector3d(0.2, -0.3, 0.1));
    state.angles = Vector3d(-0.2, 0.3, -0.1).replicate(1, n) + 0.05 * noise(3, n);
  }
  state.positions = Vector3d(0.16, 0.1, 0.6).replicate(1, n) + 0.01 * noise(3, n);
  state.biases = 0.01 * noise(6, plan.bias_knots());
  state.gyro_matrix += 0.02 * noise(3, 3);
  state.accel_matrix += 0.02 * Eigen::Matrix3d(noise(3, 3).triangularView<Eigen::Lower>());
  for (int c = 0; c < 2; ++c) {
    calib::CameraState camera;
    camera.R_camera_imu = so3::boxplus(rig.T_camera_imu.rotation, 0.05 * c * Vector3d::Ones());
    camera.t_camera_imu = rig.T_camera_imu.translation + 0.02 * c * Vector3d::Ones();
    camera.offset_s = 0.004 - 0.003 * c;
    camera.drift = 1e-3 * c;
    camera.middle_s = 0.4;
    camera.line_delay_s = 2e-5 * c;
    camera.camera = rig.camera;
    state.cameras.push_back(camera);
  }
  state.gravity = rig.gravity_target;
  std::vector<calib::FrameRow> rows;
  for (const calib::FrameRow& frame : frames) {
    const std::vector<calib::FrameRow> own =
        frame.camera == 1 ? calib::split_rows({frame}, 40, 240) : std::vector<calib::FrameRow>{frame};
    rows.insert(rows.end(), own.begin(), own.end());
  }
  EXPECT_GT(rows.size(), frames.size());
  CameraImuProblem problem(imu, rows, {0.1, 0.5, 0.01, 0.05}, options.loss, plan);
  const calib::SharedLayout shared = calib::shared_layout(state.cameras, options.choice);
  return {problem, state, shared};
}

ChainStep nothing(const calib::ChainLayout& layout) {
  ChainStep step;
  for (const int n : layout.inner) step.inner.emplace_back(VectorXd::Zero(n));
  step.node.assign(layout.inner.size() + 1, VectorXd::Zero(layout.node));
  step.shared = VectorXd::Zero(layout.shared);
  return step;
}

// Every unknown of the problem, one after the other: the gradient is that of the cost, robust loss included, whatever
// unknown it is and wherever in the windows it lies.
void expect_gradient_of_cost(const SmallOptions& options, const std::string& what) {
  SCOPED_TRACE(what);
  auto [problem, state, shared] = small_problem(options);
  if (options.choice.intrinsics) {
    Vector8d mean;
    mean << 450, 450, 370, 245, -0.28, 0.07, 0, 0;
    Vector8d sigma;
    sigma << 5, 5, 5, 5, 0.01, 0.01, 0.001, 0.001;
    problem.priors() = {{mean, sigma}, {mean, 2 * sigma}};
  }
  ChainSystem system(problem.layout(shared));
  EXPECT_EQ(problem.linearise(state, shared, system).total(), problem.cost(state).total());
  const auto cost = [&](const ChainStep& step) { return problem.cost(problem.stepped(state, shared, step)).total(); };
  ChainStep step = nothing(problem.layout(shared));
  double largest = 0;
  const auto check = [&](double& x, const std::string& name, double h = 1e-6) {
    x = h;
    const double plus = cost(step);
    x = -h;
    const double minus = cost(step);
    x = 1;
    const double slope = system.slope(step);
    x = 0;
    const double numeric = (plus - minus) / (2 * h);
    EXPECT_NEAR(slope, numeric, 1e-5 * std::max(1.0, std::abs(numeric)) + 1e-9 / h) << name;
    largest = std::max(largest, std::abs(numeric));
  };
  for (std::size_t w = 0; w < step.inner.size(); ++w) {
    for (Index i = 0; i < step.inner[w].size(); i += 5) {
      check(step.inner[w][i], "inner " + std::to_string(w) + " " + std::to_string(i));
    }
  }
  for (std::size_t w = 0; w < step.node.size(); ++w) {
    for (Index i = 0; i < step.node[w].size(); i += options.choice.drift ? 3 : 1) {
      check(step.node[w][i], "node " + std::to_string(w) + " " + std::to_string(i));
    }
  }
  for (Index i = 0; i < step.shared.size(); ++i) {
    const bool line =
        options.choice.line_delay && (i == shared.cameras[0].line_delay || i == shared.cameras[1].line_delay);
    check(step.shared[i], "shared " + std::to_string(i), line ? 1e-8 : 1e-6);
  }
  EXPECT_GT(largest, 100);
}

TEST(CameraImuProblem, GradientIsThatOfTheCost) {
  const calib::SharedChoice plain;
  expect_gradient_of_cost({.order = 4, .bias_spacing_s = 0.1, .choice = plain}, "plain, order 4");
  expect_gradient_of_cost({.choice = plain}, "plain");
  expect_gradient_of_cost({}, "all");
  expect_gradient_of_cost({.form = RotationForm::kThreeAngles}, "three angles");
}

// Where residuals are zero, J^T J is the second derivative: all Jacobians of one problem against their products.
TEST(CameraImuProblem, MatrixIsTheCurvatureOfTheCost) {
  for (const RotationForm form : {RotationForm::kCumulative, RotationForm::kThreeAngles}) {
    auto [problem, state, shared] = small_problem({.loss = 1e6, .order = 5, .bias_spacing_s = 0.2, .form = form});
    state.biases.colwise() = state.biases.col(0).eval();
    // What this state would measure.
    std::vector<calib::ImuRow> imu = problem.imu();
    const MatrixXd residuals = problem.imu_residuals(state);
    for (std::size_t i = 0; i < imu.size(); ++i) {
      imu[i].gyro += 0.1 * residuals.col(static_cast<Index>(i)).head<3>();
      imu[i].accel += 0.5 * residuals.col(static_cast<Index>(i)).tail<3>();
    }
    std::vector<calib::FrameRow> frames = problem.frames();
    const auto corners = problem.corner_residuals(state);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      for (std::size_t c = 0; c < frames[i].corners.size(); ++c) {
        frames[i].corners[c].pixel += corners[i].col(static_cast<Index>(c));
      }
    }
    const CameraImuProblem zero(imu, frames, {0.1, 0.5, 0.01, 0.05}, 1e6, problem.plan());
    const calib::CameraImuCost at_state = zero.cost(state);
    ASSERT_LT(at_state.total() - at_state.smoothing, 1e-12);
    ChainSystem here(zero.layout(shared));
    zero.linearise(state, shared, here);
    // x^T H x is twice what the cost rises by. The shared unknowns move by what changes the cost alike.
    VectorXd size = VectorXd::Ones(shared.size);
    for (const calib::SharedLayout::OfCamera& c : shared.cameras) {
      size[c.line_delay] = 1e-3;
      size.segment<4>(c.intrinsics).setConstant(100);
    }
    Random random(4);
    for (int trial = 0; trial < 20; ++trial) {
      ChainStep step = nothing(zero.layout(shared));
      const auto fill = [&](VectorXd& v, double h) {
        for (double& x : v) x = h * random.normal();
      };
      const double h = 1e-5;
      // Alone or together: a wrong sign of one block shows in the mixed terms.
      if (trial % 3 != 0) {
        for (VectorXd& v : step.inner) fill(v, h);
        for (VectorXd& v : step.node) fill(v, h);
      }
      if (trial % 3 != 1) {
        fill(step.shared, h);
        step.shared.array() *= size.array();
      }
      double square = 0;
      for (int w = 0; w < zero.plan().windows; ++w) {
        const auto at = static_cast<std::size_t>(w);
        VectorXd x(here.layout().local_size(w));
        x << step.inner[at], step.node[at], step.node[at + 1], step.shared;
        square += x.dot(here.matrix(w).selfadjointView<Eigen::Lower>() * x);
      }
      ChainStep back = step;
      for (VectorXd& v : back.inner) v = -v;
      for (VectorXd& v : back.node) v = -v;
      back.shared = -back.shared;
      const double rise = zero.cost(zero.stepped(state, shared, step)).total() +
                          zero.cost(zero.stepped(state, shared, back)).total() - 2 * at_state.total();
      EXPECT_NEAR(rise / square, 1, 2e-3) << trial;
    }
  }
}

// ---- whole calibrations

CameraImuFit calibrate(const WavedRig& rig, const CameraImuOptions& options = {}, const ImuNoise& noise = {}) {
  return calibrate_camera_imu(rig.target, std::array{CameraRecording{rig.camera, rig.views}}, rig.imu, noise, options);
}

Vector7d error_of(const CameraImuFit& fit, const WavedRig& rig, double offset_s) {
  Vector7d out;
  out.head<3>() = so3::boxminus(rig.T_camera_imu.rotation, fit.cameras[0].T_camera_imu.rotation);
  out.segment<3>(3) = rig.T_camera_imu.translation - fit.cameras[0].T_camera_imu.translation;
  out[6] = offset_s - fit.cameras[0].time_offset_s;
  return out;
}

TEST(CameraImu, IsExactWithoutNoise) {
  const WavedRig rig = wave({.seconds = 20, .corner_sigma_px = 0, .imu_noise = 0, .time_offset_s = 0.0123}, 1);
  for (const int order : {4, 6}) {
    const CameraImuFit fit = calibrate(rig, {.order = order, .adapt_noise = false});
    EXPECT_TRUE(fit.converged);
    const Vector7d error = error_of(fit, rig, 0.0123);
    EXPECT_LT(error.head<3>().norm(), 0.001 * kDegree) << order;
    EXPECT_LT(error.segment<3>(3).norm(), 2e-5) << order;
    EXPECT_LT(std::abs(error[6]), 1e-6) << order;
    EXPECT_TRUE(near(fit.gravity_target, rig.gravity_target, 0.003));
  }
}

TEST(CameraImu, ErrorsAreAsLargeAsTheirDeviations) {
  constexpr int kSeeds = 5;
  double nees = 0;
  Vector7d squares = Vector7d::Zero();
  Vector7d variances = Vector7d::Zero();
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const WavedRig rig = wave({.seconds = 20}, static_cast<std::uint64_t>(seed));
    EXPECT_NEAR(rig.turn_rate_rms, 0.9, 0.1);
    const CameraImuFit fit = calibrate(rig, {.check_line_delay = false});
    EXPECT_TRUE(fit.converged);
    EXPECT_GT(fit.cameras[0].start.correlation, 0.8);
    const Vector7d error = error_of(fit, rig, 0);
    nees += error.dot(fit.cameras[0].covariance.ldlt().solve(error));
    squares += error.cwiseAbs2();
    variances += fit.cameras[0].sigma_by_noise.cwiseAbs2();
    EXPECT_TRUE((error.array().abs() < 4 * fit.cameras[0].sigma_by_noise.array()).all()) << error.transpose();
    EXPECT_TRUE((fit.cameras[0].sigma_by_blocks.array() > 0.3 * fit.cameras[0].sigma_by_noise.array()).all());
    EXPECT_TRUE((fit.cameras[0].sigma_by_blocks.array() < 3 * fit.cameras[0].sigma_by_noise.array()).all());
    EXPECT_NEAR(fit.gyroscope_noise_scale, 1, 0.1);
    EXPECT_NEAR(fit.accelerometer_noise_scale, 1, 0.1);
    EXPECT_EQ(fit.quality.verdict, Verdict::kOk) << fit.quality.reasons.front();
    EXPECT_TRUE(std::ranges::all_of(fit.cameras[0].views, &CameraImuView::used));
  }
  EXPECT_GT(nees, chi_square_quantile(0.0005, 7 * kSeeds));
  EXPECT_LT(nees, chi_square_quantile(0.9995, 7 * kSeeds));
  RecordProperty("nees", std::to_string(nees / kSeeds));
}

TEST(CameraImu, AnyOffsetGivesTheSame) {
  const WavedRig rig = wave({.seconds = 15}, 4);
  const CameraImuFit here = calibrate(rig);
  for (const double shift : {0.05, -2.0, 3600.0}) {
    WavedRig moved = rig;
    for (TargetView& view : moved.views) view.time_ns -= from_seconds(shift);
    const CameraImuFit fit = calibrate(moved);
    EXPECT_NEAR(fit.cameras[0].time_offset_s - shift, here.cameras[0].time_offset_s, 5e-7) << shift;
    EXPECT_TRUE(near(fit.cameras[0].T_camera_imu.translation, here.cameras[0].T_camera_imu.translation, 1e-5)) << shift;
  }
  for (const double wrong : {0.08, -0.08}) {
    const CameraImuFit fit = calibrate(rig, {.time_offset_s = wrong});
    EXPECT_NEAR(fit.cameras[0].time_offset_s, here.cameras[0].time_offset_s, 1e-7);
  }
}

TEST(CameraImu, OutliersAndMissingPicturesDoLittle) {
  for (const bool missing : {false, true}) {
    WavedRigOptions options{.seconds = 20};
    (missing ? options.missing : options.outliers) = missing ? 0.3 : 0.02;
    double nees = 0;
    for (int seed = 1; seed <= 3; ++seed) {
      const WavedRig rig = wave(options, static_cast<std::uint64_t>(seed));
      const CameraImuFit fit = calibrate(rig, {.check_line_delay = false});
      const Vector7d error = error_of(fit, rig, 0);
      nees += error.dot(fit.cameras[0].covariance.ldlt().solve(error));
    }
    EXPECT_LT(nees, chi_square_quantile(0.9999, 21)) << missing;
  }
}

TEST(CameraImu, SlowAndShortIsUncertainAndRight) {
  for (const bool slow : {false, true}) {
    WavedRigOptions options{.seconds = slow ? 30.0 : 10.0};
    if (slow) {
      options.turning *= 0.1;
      options.moving = 0.1;
    }
    double nees = 0;
    for (int seed = 1; seed <= 3; ++seed) {
      const WavedRig rig = wave(options, static_cast<std::uint64_t>(seed));
      const CameraImuFit fit = calibrate(rig, {.check_line_delay = false});
      const Vector7d error = error_of(fit, rig, 0);
      nees += error.dot(fit.cameras[0].covariance.ldlt().solve(error));
      EXPECT_GT(fit.cameras[0].sigma.segment<3>(3).norm(), slow ? 1e-3 : 2e-4);
      EXPECT_EQ(fit.quality.verdict == Verdict::kOk, !slow);
    }
    EXPECT_LT(nees, chi_square_quantile(0.9999, 21)) << slow;
  }
}

TEST(CameraImu, TellsWhatItSaw) {
  WavedRig rig = wave({.seconds = 15}, 2);
  for (std::size_t i = 100; i < 110; ++i) rig.views[i].corners.clear();
  rig.views[120].corners.resize(4);
  for (TargetCorner& corner : rig.views[130].corners) corner.pixel_px.x() += 30 * (corner.id % 2);
  const CameraImuFit fit = calibrate(rig);
  EXPECT_EQ(fit.cameras[0].views[100].reason, "no corners");
  EXPECT_EQ(fit.cameras[0].views[120].reason, "its corners give no pose");
  EXPECT_EQ(fit.cameras[0].views[130].reason, "no pose explains its corners");
  EXPECT_TRUE(fit.cameras[0].views[99].used);
  EXPECT_NEAR(fit.cameras[0].views[99].rms_px, 0.3 * std::sqrt(2), 0.15);
  EXPECT_NEAR(fit.cameras[0].views[99].sigma_px, 0.3, 0.08);
  // Noise that was said ten times too small is found, and told.
  ImuNoise optimistic;
  optimistic.gyroscope_noise_density /= 10;
  optimistic.accelerometer_noise_density /= 10;
  const CameraImuFit doubtful = calibrate(rig, {}, optimistic);
  EXPECT_NEAR(doubtful.gyroscope_noise_scale, 10, 1.5);
  EXPECT_NEAR(doubtful.accelerometer_noise_scale, 10, 1.5);
  EXPECT_EQ(doubtful.quality.verdict, Verdict::kFair);
  EXPECT_TRUE(near(doubtful.cameras[0].T_camera_imu.translation, fit.cameras[0].T_camera_imu.translation, 3e-4));
  // Stopped: the best so far, and it says so.
  int calls = 0;
  const CameraImuFit stopped = calibrate(rig, {.progress = [&](const CameraImuProgress& p) {
                                           EXPECT_EQ(p.iteration, ++calls);
                                           return calls < 2;
                                         }});
  EXPECT_FALSE(stopped.converged);
  EXPECT_EQ(stopped.stopped, "interrupted");
  const CameraImuFit late = calibrate(rig, {.time_limit_s = 1e-6});
  EXPECT_EQ(late.stopped, "time limit");
  EXPECT_EQ(late.iterations, 1);
  EXPECT_EQ(late.quality.verdict, Verdict::kRefused);
  EXPECT_EQ(stopped.quality.verdict, Verdict::kRefused);
  EXPECT_TRUE(near(stopped.cameras[0].T_camera_imu.translation, fit.cameras[0].T_camera_imu.translation, 0.01));
}

// ---- more unknowns

// By deviations: each error over what was said of it.
Vector7d in_sigmas(const Vector7d& error, const CameraImuCamera& camera) {
  return error.cwiseQuotient(camera.sigma);
}

TEST(CameraImu, BothRotationFormsAgree) {
  const WavedRig rig = wave({.seconds = 15}, 8);
  const CameraImuFit cumulative = calibrate(rig);
  const CameraImuFit angles = calibrate(rig, {.rotation = RotationForm::kThreeAngles});
  EXPECT_TRUE(angles.converged);
  const Vector7d apart = in_sigmas(error_of(cumulative, rig, 0) - error_of(angles, rig, 0), cumulative.cameras[0]);
  EXPECT_LT(apart.norm(), 0.05);
  EXPECT_NEAR(angles.gyroscope_chi, cumulative.gyroscope_chi, 1e-3);
  // Close to a quarter of a turn from the mean is more than three angles can say.
  WavedRigOptions wide{.seconds = 15};
  wide.turning = {1, 6, 1};
  const WavedRig turned = wave(wide, 8);
  expect_data_error([&] { calibrate(turned, {.rotation = RotationForm::kThreeAngles}); },
                    {"too wide a motion for three angles", "cumulative"});
}

TEST(CameraImu, TwoCameras) {
  const WavedRig rig = wave({.seconds = 20, .time_offset_s = 0.05, .second_camera = true}, 5);
  const std::array recordings{CameraRecording{rig.camera, rig.views}, CameraRecording{rig.second, rig.second_views}};
  const CameraImuFit both = calibrate_camera_imu(rig.target, recordings, rig.imu, ImuNoise{});
  const CameraImuFit alone = calibrate(rig);
  EXPECT_TRUE(both.converged);
  ASSERT_EQ(both.cameras.size(), 2U);
  EXPECT_EQ(both.cameras[1].camera.name, "cam1");
  const Vector7d first = error_of(both, rig, 0.05);
  Vector7d second;
  second << so3::boxminus(rig.T_second_imu.rotation, both.cameras[1].T_camera_imu.rotation),
      rig.T_second_imu.translation - both.cameras[1].T_camera_imu.translation,
      0.05 + test::kSecondOffset - both.cameras[1].time_offset_s;
  EXPECT_LT(in_sigmas(first, both.cameras[0]).cwiseAbs().maxCoeff(), 3.5);
  EXPECT_LT(in_sigmas(second, both.cameras[1]).cwiseAbs().maxCoeff(), 3.5);
  EXPECT_LT(both.cameras[0].sigma_by_noise.norm(), alone.cameras[0].sigma_by_noise.norm());
  // The rig as it is written.
  EXPECT_TRUE(near(both.cameras[1].camera.T_body_camera.translation, rig.T_second_imu.inverse().translation, 2e-3));
  EXPECT_EQ(both.cameras[1].camera.time_offset_s, both.cameras[1].time_offset_s);
}

TEST(CameraImu, RollingShutterIsToldAndEstimated) {
  const double delay = 3e-5;  // 14 ms from the first row to the last
  const WavedRig rig = wave({.seconds = 15, .line_delay_s = delay}, 6);
  const CameraImuFit held = calibrate(rig);
  const CameraImuCamera& told = held.cameras[0];
  EXPECT_FALSE(told.line_delay_s.estimated);
  EXPECT_NEAR(told.line_delay_s.value, delay, 0.5 * delay);  // one step only
  EXPECT_GE(held.quality.verdict, Verdict::kWarn);
  EXPECT_NE(held.quality.reasons.front().find("rolling shutter"), std::string::npos);
  const CameraImuFit fit = calibrate(rig, {.estimate_line_delay = true});
  const CameraImuCheck& line = fit.cameras[0].line_delay_s;
  EXPECT_TRUE(line.estimated);
  EXPECT_NEAR(line.value, delay, 4 * line.sigma);
  EXPECT_LT(line.sigma, 0.02 * delay);
  EXPECT_LT(in_sigmas(error_of(fit, rig, 0), fit.cameras[0]).cwiseAbs().maxCoeff(), 4);
  EXPECT_EQ(fit.quality.verdict, Verdict::kOk) << fit.quality.reasons.front();
}

TEST(CameraImu, DriftOfTheClocksIsToldAndEstimated) {
  const double drift = 5e-5;
  const WavedRig rig = wave({.seconds = 20, .drift = drift}, 6);
  const CameraImuFit held = calibrate(rig);
  const CameraImuCheck& told = held.cameras[0].offset_drift;
  EXPECT_FALSE(told.estimated);
  EXPECT_NEAR(told.value, drift, 5 * told.sigma);
  EXPECT_EQ(held.quality.verdict, Verdict::kWarn);
  EXPECT_NE(held.quality.reasons.front().find("drift apart"), std::string::npos);
  const CameraImuFit fit = calibrate(rig, {.estimate_drift = true});
  EXPECT_NEAR(fit.cameras[0].offset_drift.value, drift, 4 * fit.cameras[0].offset_drift.sigma);
  EXPECT_LT(in_sigmas(error_of(fit, rig, 0), fit.cameras[0]).cwiseAbs().maxCoeff(), 4);
  EXPECT_EQ(fit.quality.verdict, Verdict::kOk) << fit.quality.reasons.front();
}

TEST(CameraImu, IntrinsicsTakePart) {
  WavedRig rig = wave({.seconds = 15}, 7);
  const CameraCalibration truth = rig.camera;
  rig.camera.intrinsics_px += Eigen::Vector4d(1.5, 1.2, -1.4, 1.3);
  rig.camera.intrinsics_quality->intrinsics_sigma_px.setConstant(1.5);
  rig.camera.intrinsics_quality->distortion_sigma.setConstant(1e-4);
  // Held: wrong by more than noise can, and the deviations say so.
  const CameraImuFit held = calibrate(rig);
  const Vector7d error = error_of(held, rig, 0);
  EXPECT_GT(error.cwiseQuotient(held.cameras[0].sigma_by_noise).norm(), 10);
  EXPECT_LT(in_sigmas(error, held.cameras[0]).cwiseAbs().maxCoeff(), 3);
  EXPECT_GT(held.cameras[0].sigma_by_intrinsics.norm(), 5 * held.cameras[0].sigma_by_noise.norm());
  // What the mounting moves by is what by_intrinsics says.
  rig.camera.intrinsics_px[2] += 0.5;
  const CameraImuFit moved = calibrate(rig);
  const Vector7d by_cx = 0.5 * held.cameras[0].by_intrinsics.col(2);
  EXPECT_LT((error - error_of(moved, rig, 0) - by_cx).norm(), 0.1 * by_cx.norm());
  rig.camera.intrinsics_px[2] -= 0.5;
  // Refined: found.
  const CameraImuFit fit = calibrate(rig, {.refine_intrinsics = true});
  const CameraImuCamera& camera = fit.cameras[0];
  EXPECT_TRUE(fit.converged);
  const Eigen::Vector4d left =
      (truth.intrinsics_px - camera.camera.intrinsics_px).cwiseQuotient(camera.intrinsics_sigma.head<4>());
  EXPECT_LT(left.cwiseAbs().maxCoeff(), 4);
  EXPECT_LT(camera.intrinsics_sigma.head<4>().maxCoeff(), 0.8);
  EXPECT_TRUE(near(camera.intrinsics_change.head<4>(), -Eigen::Vector4d(1.5, 1.2, -1.4, 1.3), 1.0));
  EXPECT_LT(in_sigmas(error_of(fit, rig, 0), camera).cwiseAbs().maxCoeff(), 4);
  // Where nobody measured them, something is taken to be.
  rig.camera.intrinsics_quality.reset();
  EXPECT_NEAR(calibrate(rig).cameras[0].intrinsics_sigma[0], 0.23, 0.02);
}

TEST(CameraImu, MatricesOfTheImuAndGravityAreFound) {
  WavedRigOptions options{.seconds = 20};
  options.gyroscope_matrix << 1.01, 0.003, -0.002, 0.004, 0.99, 0.001, -0.003, 0.002, 1.005;
  options.accelerometer_matrix << 1.008, 0, 0, 0.004, 0.995, 0, -0.003, 0.002, 1.004;
  const WavedRig rig = wave(options, 3);
  const CameraImuFit fit = calibrate(rig, {.estimate_imu_matrices = true});
  EXPECT_TRUE(fit.converged);
  const auto off = [](const Eigen::Matrix3d& found, const Eigen::Matrix3d& truth, const Eigen::Matrix3d& sigma) {
    double most = 0;
    for (int i = 0; i < 9; ++i) {
      if (sigma(i) > 0) most = std::max(most, std::abs(found(i) - truth(i)) / sigma(i));
    }
    return most;
  };
  EXPECT_LT(off(fit.gyroscope_matrix, options.gyroscope_matrix, fit.gyroscope_matrix_sigma), 4);
  EXPECT_LT(off(fit.accelerometer_matrix, options.accelerometer_matrix, fit.accelerometer_matrix_sigma), 4);
  EXPECT_LT(fit.gyroscope_matrix_sigma.maxCoeff(), 2e-3);
  EXPECT_LT(in_sigmas(error_of(fit, rig, 0), fit.cameras[0]).cwiseAbs().maxCoeff(), 4);
  // Gravity's size: looked at where it is held, found where it is asked for.
  const WavedRig plain = wave({.seconds = 20}, 3);
  const CameraImuFit wrong = calibrate(plain, {.gravity = 9.75});
  EXPECT_NEAR(wrong.gravity_size.value, 9.80665, 5 * wrong.gravity_size.sigma);
  EXPECT_LT(wrong.gravity_size.sigma, 0.02);
  const CameraImuFit far_off = calibrate(plain, {.gravity = 8});
  EXPECT_GE(far_off.quality.verdict, Verdict::kWarn);
  EXPECT_NE(far_off.quality.reasons.front().find("Gravity seems to be"), std::string::npos)
      << far_off.quality.reasons.front();
  const CameraImuFit found = calibrate(plain, {.gravity = 9.75, .estimate_gravity = true});
  EXPECT_NEAR(found.gravity_size.value, 9.80665, 4 * found.gravity_size.sigma);
  EXPECT_NEAR(found.gravity_target.norm(), found.gravity_size.value, 1e-9);
}

// ---- input that is not as it should be

TEST(CameraImu, ABoardWithoutDirectionKeepsItsNumbers) {
  const WavedRig rig = wave({.seconds = 12, .target = "checkerboard 8x6 0.045", .half_turns = true}, 2);
  ASSERT_FALSE(rig.target.has_direction());
  const CameraImuFit fit = calibrate(rig);
  EXPECT_TRUE(fit.converged);
  EXPECT_LT(in_sigmas(error_of(fit, rig, 0), fit.cameras[0]).cwiseAbs().maxCoeff(), 4);
  EXPECT_TRUE(std::ranges::all_of(fit.cameras[0].views, &CameraImuView::used));
  // Over a gap the gyroscope tells which end is which.
  WavedRig gap = rig;
  gap.views.erase(gap.views.begin() + 80, gap.views.begin() + 121);  // of both kinds
  EXPECT_LT(in_sigmas(error_of(calibrate(gap), rig, 0), fit.cameras[0]).cwiseAbs().maxCoeff(), 6);
}

// Gauge: the target's frame, turned by half a turn, turns gravity and the way with it, and nothing else.
TEST(CameraImu, TheFrameOfTheTargetDoesNotMatter) {
  const WavedRig rig = wave({.seconds = 12}, 5);
  WavedRig turned = rig;
  for (TargetView& view : turned.views) {
    for (TargetCorner& corner : view.corners) corner.id = rig.target.corner_count() - 1 - corner.id;
    std::ranges::sort(view.corners, {}, &TargetCorner::id);
  }
  const CameraImuFit a = calibrate(rig);
  const CameraImuFit b = calibrate(turned);
  EXPECT_LT((error_of(a, rig, 0) - error_of(b, rig, 0)).norm(), 1e-6);
  EXPECT_TRUE(
      near(b.gravity_target, Vector3d(-a.gravity_target.x(), -a.gravity_target.y(), a.gravity_target.z()), 1e-5));
  const Vector3d far_corner = rig.target.corner(rig.target.corner_count() - 1);
  const Vector3d at = a.T_target_imu[1000].translation;
  EXPECT_TRUE(
      near(b.T_target_imu[1000].translation, Vector3d(far_corner.x() - at.x(), far_corner.y() - at.y(), at.z()), 1e-5));
}

TEST(CameraImu, SamplesAndPicturesThatCannotBeUsedAreCounted) {
  WavedRig rig = wave({.seconds = 12}, 2);
  const CameraImuFit clean = calibrate(rig);
  std::swap(rig.views[40], rig.views[60]);        // out of order: no harm
  rig.views[70].time_ns = rig.views[71].time_ns;  // twice
  rig.views[90].time_ns = kNoTime;
  rig.imu.insert(rig.imu.begin() + 500, rig.imu[499]);  // twice
  rig.imu.insert(rig.imu.begin() + 800, rig.imu[300]);  // steps back
  rig.imu[1000].specific_force.x() = std::nan("");
  const CameraImuFit fit = calibrate(rig);
  const auto count = [&](const std::string& name) {
    const auto at = std::ranges::find(fit.counts, name, &NamedCount::name);
    return at == fit.counts.end() ? -1 : at->value;
  };
  EXPECT_EQ(count("imu.skipped.not_finite"), 1);
  EXPECT_EQ(count("imu.skipped.time_not_later"), 2);
  EXPECT_EQ(count("imu.used"), static_cast<std::int64_t>(fit.imu_time_ns.size()));
  EXPECT_EQ(fit.cameras[0].views[71].reason, "its time is that of another picture");
  EXPECT_EQ(fit.cameras[0].views[90].reason, "it has no time");
  EXPECT_TRUE(fit.cameras[0].views[40].used);
  EXPECT_LT(in_sigmas(error_of(fit, rig, 0) - error_of(clean, rig, 0), clean.cameras[0]).norm(), 1);
  // Half of the IMU is lost in the middle: neither knots nor noise take the gap for the rate.
  WavedRig gap = wave({.seconds = 20}, 2);
  gap.imu.erase(gap.imu.begin() + 1500, gap.imu.begin() + 2500);
  const CameraImuFit half = calibrate(gap);
  EXPECT_TRUE(half.converged);
  EXPECT_NEAR(half.knot_spacing_s, 0.02, 0.001);
  EXPECT_NEAR(half.gyroscope_noise_scale, 1, 0.15);
  EXPECT_LT(in_sigmas(error_of(half, gap, 0), half.cameras[0]).cwiseAbs().maxCoeff(), 4);
  // An accelerometer in g, or that is not there.
  for (const double factor : {1 / 9.80665, 0.0}) {
    WavedRig other = wave({.seconds = 12}, 2);
    for (ImuMeasurement& m : other.imu) m.specific_force *= factor;
    expect_data_error([&] { calibrate(other); }, {"accelerometer's mean is", "unit"});
  }
  // Readings in degrees: the camera knows better.
  for (ImuMeasurement& m : rig.imu) m.angular_velocity *= 180 / std::numbers::pi;
  expect_data_error([&] { calibrate(rig); }, {"times as fast as the camera", "deg/s"});
}

TEST(CameraImu, KnotsFollowTheSpectrum) {
  const auto knots = [](double speed, double imu_hz, int order, double camera_hz = 20) {
    const WavedRig rig = wave({.seconds = 20, .imu_hz = imu_hz, .camera_hz = camera_hz, .speed = speed}, 1);
    std::vector<calib::ImuRow> imu;
    for (const ImuMeasurement& m : rig.imu) {
      imu.push_back({to_seconds(m.time_ns - rig.imu[0].time_ns), m.angular_velocity, m.specific_force});
    }
    return calib::choose_knots(imu, order, 0, 1 / camera_hz);
  };
  const calib::KnotChoice slow = knots(1, 200, 6);
  EXPECT_EQ(slow.spacing_s, 0.02);
  EXPECT_NEAR(slow.bandwidth_hz, 3, 1.5);  // the motion reaches 1.3 Hz
  EXPECT_FALSE(slow.too_fast);
  const calib::KnotChoice fast = knots(10, 200, 6);
  EXPECT_GT(fast.bandwidth_hz, 11);
  EXPECT_LT(fast.bandwidth_hz, 22);
  EXPECT_NEAR(fast.spacing_s * 5 * fast.bandwidth_hz, 1, 0.08);
  EXPECT_LT(knots(10, 200, 4).spacing_s, fast.spacing_s);
  EXPECT_TRUE(knots(25, 200, 6).too_fast);
  EXPECT_NEAR(knots(1, 100, 6).spacing_s, 0.04, 1e-9);
  // 40 ms and 25 pictures a second keep step.
  const calib::KnotChoice step = knots(1, 100, 6, 25);
  EXPECT_LT(step.spacing_s, 0.038);
  EXPECT_NE(step.reason.find("keep step"), std::string::npos);
}

TEST(CameraImu, WhatCannotBeSaysWhy) {
  const auto refused = [](const WavedRigOptions& options, const std::vector<std::string>& parts) {
    const WavedRig rig = wave(options, 2);
    expect_data_error([&] { calibrate(rig); }, parts);
  };
  refused({.seconds = 20, .turning = {1, 0, 0}}, {"one axis", "all three"});
  refused({.seconds = 20, .turning = {0, 0, 0}}, {"does not turn"});
  refused({.seconds = 20, .missing = 1}, {"too few pictures"});
  WavedRig other = wave({.seconds = 20}, 1);
  other.imu = wave({.seconds = 20}, 7).imu;
  expect_data_error([&] { calibrate(other); }, {"do not turn alike"});
  const WavedRig rig = wave({.seconds = 3}, 1);
  EXPECT_THROW(calibrate(rig, {.order = 2}), std::invalid_argument);
  EXPECT_THROW(calibrate(rig, {.loss_sigmas = 0}), std::invalid_argument);
  // What is said to have no noise.
  for (double ImuNoise::*field : {&ImuNoise::gyroscope_noise_density, &ImuNoise::accelerometer_noise_density,
                                  &ImuNoise::gyroscope_random_walk, &ImuNoise::accelerometer_random_walk}) {
    ImuNoise none;
    none.*field = 0;
    EXPECT_THROW(calibrate(wave({.seconds = 12}, 1), {}, none), std::invalid_argument);
  }
  // Knots closer than samples are refused before any memory is asked for.
  EXPECT_THROW(calibrate(wave({.seconds = 12}, 1), {.knot_spacing_s = 0.004}), std::invalid_argument);
  // Biases that are all but constant: knots all the same, at every hundredth of the pose's.
  const CameraImuFit even = calibrate(wave({.seconds = 12}, 1), {.bias_spacing_s = 1000});
  EXPECT_TRUE(even.converged);
  EXPECT_GT(even.bias_time_ns.size(), 4U);
}

}  // namespace
}  // namespace loc
