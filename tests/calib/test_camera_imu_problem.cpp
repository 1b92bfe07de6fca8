// Camera-IMU calibration: every derivative of its equations against numbers.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "libloc/calib/camera_imu_problem.hpp"
#include "libloc/core/random.hpp"
#include "libloc/geometry/so3.hpp"
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
using test::wave;
using test::WavedRig;

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
  calib::SharedChoice choice{true, true, true, true, true, true};
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
    const double t = 0.1 * static_cast<double>(i) + 0.103;
    calib::FrameRow frame{.camera = i % 2, .view = i, .t_s = t, .drift_s = t - 0.4, .sigma_px = 0.3, .corners = {}};
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
    camera.line_delay_s = 2e-5 * c;
    camera.camera = rig.camera;
    state.cameras.push_back(camera);
  }
  state.gravity = rig.gravity_target;
  state.target_scale = 1.02;
  constexpr std::array heights{480.0, 480.0};
  std::vector<calib::FrameRow> rows;
  for (const calib::FrameRow& frame : frames) {
    const std::vector<calib::FrameRow> own =
        frame.camera == 1 ? calib::split_rows({frame}, heights, 12) : std::vector<calib::FrameRow>{frame};
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

}  // namespace
}  // namespace loc
