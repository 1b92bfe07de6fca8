#include "libloc/calib/camera_imu_problem.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc::calib {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kLeastSegments = 20;  // of a window: fewer are no cheaper
// Deviation of the second differences of control points [rad, m]: a thousand times what a hand does. It decides where
// nothing was measured, and keeps the equations solvable there.
constexpr double kBendSigma = 10;
constexpr double kLeastCurvature = 0.1;  // of the loss along a residual, as a share of its weight

}  // namespace

ChainPlan plan_chain(double begin_s, double end_s, double spacing_s, int order, double bias_spacing_s) {
  const double length = end_s - begin_s;
  require_positive("length", length);
  ChainPlan plan;
  const int least = std::max(kLeastSegments, order);
  int per_bias = std::max(1, static_cast<int>(std::lround(bias_spacing_s / spacing_s)));
  if (per_bias >= least) {
    plan.segments_per_window = per_bias;
  } else {
    plan.biases_per_window = (least + per_bias - 1) / per_bias;
    plan.segments_per_window = plan.biases_per_window * per_bias;
  }
  plan.windows = std::max(1, static_cast<int>(std::lround(length / (spacing_s * plan.segments_per_window))));
  const int segments = plan.windows * plan.segments_per_window;
  plan.grid = {begin_s, length / segments, segments, order};
  plan.grid.check();
  return plan;
}

Eigen::Matrix<double, 3, 2> across(const Vector3d& gravity) {
  const Vector3d down = gravity.normalized();
  Index least = 0;
  down.cwiseAbs().minCoeff(&least);
  const Vector3d a = down.cross(Vector3d::Unit(least)).normalized();
  Eigen::Matrix<double, 3, 2> out;
  out << a, down.cross(a);
  return out;
}

// Reused from segment to segment.
struct CameraImuProblem::Scratch {
  RotationJacobians by;
  std::vector<RotationStep> steps;  // of all control points
  MatrixXd jacobian;                // rows of a segment by its columns
  VectorXd residual;
  MatrixXd square;
  VectorXd pull;
  std::vector<int> places;  // of the columns in the window
};

CameraImuProblem::CameraImuProblem(Camera camera, std::vector<ImuRow> imu, std::vector<FrameRow> frames,
                                   const CameraImuSigmas& sigmas, double loss_sigmas, const ChainPlan& plan)
    : camera_(std::move(camera)),
      imu_(std::move(imu)),
      frames_(std::move(frames)),
      sigmas_(sigmas),
      loss_(loss_sigmas),
      plan_(plan) {
  const SplineGrid& grid = plan_.grid;
  first_imu_.assign(static_cast<std::size_t>(grid.segments) + 1, imu_.size());
  for (std::size_t i = 0; i < imu_.size(); ++i) {
    const auto [segment, u] = place_of(grid, imu_[i].t_s);
    imu_weights_.push_back(weights_at(grid.order, grid.spacing_s, u));
    imu_cumulative_.push_back(cumulative_weights_at(grid.order, grid.spacing_s, u));
    for (int s = segment; s >= 0 && first_imu_[static_cast<std::size_t>(s)] == imu_.size(); --s) {
      first_imu_[static_cast<std::size_t>(s)] = i;
    }
  }
}

ChainLayout CameraImuProblem::layout() const {
  ChainLayout out;
  const int k = plan_.grid.order;
  out.inner.assign(static_cast<std::size_t>(plan_.windows),
                   6 * (plan_.segments_per_window - (k - 1)) + 6 * (plan_.biases_per_window - 1));
  out.node = 6 * (k - 1) + 6;
  out.shared = kSharedSize;
  return out;
}

int CameraImuProblem::window_of(int segment) const {
  return segment / plan_.segments_per_window;
}

// The first order - 1 control points of a window are those of the node before it.
int CameraImuProblem::control_place(int window, int control) const {
  const int k = plan_.grid.order;
  const int s = plan_.segments_per_window;
  const int at = control - window * s;
  const int inner = 6 * (s - (k - 1)) + 6 * (plan_.biases_per_window - 1);
  if (at < k - 1) return inner + 6 * at;
  if (at < s) return 6 * (at - (k - 1));
  return inner + 6 * k + 6 * (at - s);
}

int CameraImuProblem::bias_place(int window, int knot) const {
  const int k = plan_.grid.order;
  const int at = knot - window * plan_.biases_per_window;
  const int poses = 6 * (plan_.segments_per_window - (k - 1));
  const int inner = poses + 6 * (plan_.biases_per_window - 1);
  if (at == 0) return inner + 6 * (k - 1);
  if (at < plan_.biases_per_window) return poses + 6 * (at - 1);
  return inner + 6 * k + 6 * (k - 1);
}

namespace {

// square and pull into a window's lower triangle.
void scatter(const MatrixXd& square, const VectorXd& pull, const std::vector<int>& places, Index columns,
             MatrixXd& matrix, VectorXd& gradient) {
  for (Index j = 0; j < columns; ++j) {
    const Index at_j = places[static_cast<std::size_t>(j)];
    gradient[at_j] += pull[j];
    for (Index i = j; i < columns; ++i) {
      const Index at_i = places[static_cast<std::size_t>(i)];
      matrix(std::max(at_i, at_j), std::min(at_i, at_j)) += square(i, j);
    }
  }
}

}  // namespace

void CameraImuProblem::add_imu(const CameraImuState& state, int segment, Scratch& scratch, ChainSystem* system,
                               CameraImuCost& cost) const {
  const std::size_t first = first_imu_[static_cast<std::size_t>(segment)];
  const std::size_t last = first_imu_[static_cast<std::size_t>(segment) + 1];
  if (first >= last) return;
  const SplineGrid& grid = plan_.grid;
  const int k = grid.order;
  const Index pose_columns = 6 * k;
  const Index columns = pose_columns + 12 + 2;
  const Index rows = 6 * static_cast<Index>(last - first);
  const auto at = static_cast<std::size_t>(segment);
  const auto steps = std::span(scratch.steps).subspan(at, static_cast<std::size_t>(k) - 1);
  const auto points = state.positions.middleCols(segment, k);
  const int segments_per_bias = plan_.segments_per_window / plan_.biases_per_window;
  const int knot = segment / segments_per_bias;
  const double knot_s = grid.start_s + grid.spacing_s * segments_per_bias * knot;
  const Eigen::Matrix<double, 3, 2> tangent = across(state.gravity) * state.gravity.norm();
  if (system != nullptr) scratch.jacobian.setZero(rows, columns);
  scratch.residual.resize(rows);
  for (std::size_t i = first; i < last; ++i) {
    const Index row = 6 * static_cast<Index>(i - first);
    const RotationState r =
        rotation_at(state.rotations[at], steps, imu_cumulative_[i], system != nullptr ? &scratch.by : nullptr);
    const Matrix3d R_transposed = r.rotation.conjugate().toRotationMatrix();
    const SplineWeights& w = imu_weights_[i];
    const Vector3d acceleration = points * Eigen::Map<const VectorXd>(w.second.data(), k);
    const Vector3d force = R_transposed * (acceleration - state.gravity);
    const double share = (imu_[i].t_s - knot_s) / plan_.bias_spacing_s();
    const Vector6d bias = (1 - share) * state.biases.col(knot) + share * state.biases.col(knot + 1);
    scratch.residual.segment<3>(row) = (r.angular_velocity + bias.head<3>() - imu_[i].gyro) / sigmas_.gyro;
    scratch.residual.segment<3>(row + 3) = (force + bias.tail<3>() - imu_[i].accel) / sigmas_.accel;
    cost.gyro += 0.5 * scratch.residual.segment<3>(row).squaredNorm();
    cost.accel += 0.5 * scratch.residual.segment<3>(row + 3).squaredNorm();
    if (system == nullptr) continue;
    const Matrix3d force_by_turn = so3::hat(force) / sigmas_.accel;
    for (int j = 0; j < k; ++j) {
      const auto c = static_cast<std::size_t>(j);
      scratch.jacobian.block<3, 3>(row, 6 * j) = scratch.by.angular_velocity[c] / sigmas_.gyro;
      scratch.jacobian.block<3, 3>(row + 3, 6 * j) = force_by_turn * scratch.by.rotation[c];
      scratch.jacobian.block<3, 3>(row + 3, 6 * j + 3) = R_transposed * (w.second[c] / sigmas_.accel);
    }
    for (Index a = 0; a < 3; ++a) {
      scratch.jacobian(row + a, pose_columns + a) = (1 - share) / sigmas_.gyro;
      scratch.jacobian(row + 3 + a, pose_columns + 3 + a) = (1 - share) / sigmas_.accel;
      scratch.jacobian(row + a, pose_columns + 6 + a) = share / sigmas_.gyro;
      scratch.jacobian(row + 3 + a, pose_columns + 9 + a) = share / sigmas_.accel;
    }
    scratch.jacobian.block<3, 2>(row + 3, pose_columns + 12) = -R_transposed * tangent / sigmas_.accel;
  }
  if (system == nullptr) return;
  scratch.square.noalias() = scratch.jacobian.transpose() * scratch.jacobian;
  scratch.pull.noalias() = scratch.jacobian.transpose() * scratch.residual;
  const int window = window_of(segment);
  const int shared = system->layout().local_size(window) - kSharedSize;
  scratch.places.clear();
  for (int j = 0; j < k; ++j) {
    for (int a = 0; a < 6; ++a) scratch.places.push_back(control_place(window, segment + j) + a);
  }
  for (int b = 0; b < 2; ++b) {
    for (int a = 0; a < 6; ++a) scratch.places.push_back(bias_place(window, knot + b) + a);
  }
  scratch.places.push_back(shared + kGravity);
  scratch.places.push_back(shared + kGravity + 1);
  scatter(scratch.square, scratch.pull, scratch.places, columns, system->matrix(window), system->gradient(window));
}

void CameraImuProblem::add_frame(const CameraImuState& state, const FrameRow& frame, Scratch& scratch,
                                 ChainSystem* system, CameraImuCost& cost) const {
  const SplineGrid& grid = plan_.grid;
  const int k = grid.order;
  const auto [segment, u] = place_of(grid, frame.t_s + state.offset_s);
  const auto at = static_cast<std::size_t>(segment);
  const auto steps = std::span(scratch.steps).subspan(at, static_cast<std::size_t>(k) - 1);
  const RotationState r = rotation_at(state.rotations[at], steps, cumulative_weights_at(k, grid.spacing_s, u),
                                      system != nullptr ? &scratch.by : nullptr);
  const SplineWeights w = weights_at(k, grid.spacing_s, u);
  const auto points = state.positions.middleCols(segment, k);
  const Vector3d position = points * Eigen::Map<const VectorXd>(w.value.data(), k);
  const Matrix3d R_transposed = r.rotation.conjugate().toRotationMatrix();
  const Matrix3d R_ci = state.R_camera_imu.toRotationMatrix();
  // By a turn of the IMU on the right, and by the place of the point in camera.
  Matrix6d square = Matrix6d::Zero();
  Vector6d pull = Vector6d::Zero();
  const double loss_square = loss_ * loss_;
  for (const FrameCorner& corner : frame.corners) {
    const Vector3d in_imu = R_transposed * (corner.point - position);
    const Vector3d in_camera = R_ci * in_imu + state.t_camera_imu;
    if (system == nullptr) {
      const auto pixel = camera_.project(in_camera);
      const double s = pixel ? (*pixel - corner.pixel).squaredNorm() / (frame.sigma_px * frame.sigma_px) : 1e12;
      cost.corner += 0.5 * loss_square * std::log1p(s / loss_square);
      continue;
    }
    const auto projection = camera_.project_with_jacobians(in_camera);
    if (!projection) {  // behind the camera: as if it were very far off
      cost.corner += 0.5 * loss_square * std::log1p(1e12 / loss_square);
      continue;
    }
    const Eigen::Vector2d residual = (projection->pixel_px - corner.pixel) / frame.sigma_px;
    const double s = residual.squaredNorm();
    cost.corner += 0.5 * loss_square * std::log1p(s / loss_square);
    const double weight = 1 / (1 + s / loss_square);
    // Along the residual the loss bends the other way beyond loss sigmas; a little is left there.
    const double along = std::max(kLeastCurvature, 1 - 2 * s / loss_square * weight);
    Eigen::Matrix<double, 2, 6> J;
    const Eigen::Matrix<double, 2, 3> by_point = projection->d_point / frame.sigma_px;
    J.leftCols<3>() = by_point * R_ci * so3::hat(in_imu);
    J.rightCols<3>() = by_point;
    pull.noalias() += weight * J.transpose() * residual;
    if (s > 0) {
      const Vector6d across_part = J.transpose() * residual / std::sqrt(s);
      square.noalias() += weight * J.transpose() * J;
      square.noalias() -= weight * (1 - along) * across_part * across_part.transpose();
    } else {
      square.noalias() += weight * J.transpose() * J;
    }
  }
  if (system == nullptr) return;
  // The chain from (turn, point in camera) to what is unknown.
  const Vector3d velocity = points * Eigen::Map<const VectorXd>(w.first.data(), k);
  const Matrix3d to_camera = R_ci * R_transposed;
  const Index columns = 6 * k + 7;
  MatrixXd& M = scratch.jacobian;
  M.setZero(6, columns);
  for (int j = 0; j < k; ++j) {
    const auto c = static_cast<std::size_t>(j);
    M.block<3, 3>(0, 6 * j) = scratch.by.rotation[c];
    M.block<3, 3>(3, 6 * j + 3) = -to_camera * w.value[c];
  }
  // R_ci Exp(theta) turns the points against what the IMU's turn does.
  M.block<3, 3>(0, 6 * k + kTurn) = -Matrix3d::Identity();
  M.block<3, 3>(3, 6 * k + kShift) = Matrix3d::Identity();
  M.block<3, 1>(0, 6 * k + kOffset) = r.angular_velocity;
  M.block<3, 1>(3, 6 * k + kOffset) = -to_camera * velocity;
  scratch.square.noalias() = M.transpose() * square * M;
  scratch.pull.noalias() = M.transpose() * pull;
  const int window = window_of(segment);
  const int shared = system->layout().local_size(window) - kSharedSize;
  scratch.places.clear();
  for (int j = 0; j < k; ++j) {
    for (int a = 0; a < 6; ++a) scratch.places.push_back(control_place(window, segment + j) + a);
  }
  for (int a = 0; a < 7; ++a) scratch.places.push_back(shared + a);
  scatter(scratch.square, scratch.pull, scratch.places, columns, system->matrix(window), system->gradient(window));
}

// Second differences of the control points segment … segment + 2.
void CameraImuProblem::add_smoothing(const CameraImuState& state, int segment, Scratch& scratch, ChainSystem* system,
                                     CameraImuCost& cost) const {
  const auto at = static_cast<std::size_t>(segment);
  const RotationStep& a = scratch.steps[at];
  const RotationStep& b = scratch.steps[at + 1];
  Vector6d residual;
  residual << b.difference - a.difference,
      state.positions.col(segment) - 2 * state.positions.col(segment + 1) + state.positions.col(segment + 2);
  residual /= kBendSigma;
  cost.smoothing += 0.5 * residual.squaredNorm();
  if (system == nullptr) return;
  scratch.jacobian.setZero(6, 18);
  scratch.jacobian.block<3, 3>(0, 0) = a.right_inverse.transpose() / kBendSigma;
  scratch.jacobian.block<3, 3>(0, 6) = -(a.right_inverse + b.right_inverse.transpose()) / kBendSigma;
  scratch.jacobian.block<3, 3>(0, 12) = b.right_inverse / kBendSigma;
  scratch.jacobian.block<3, 3>(3, 3) = Matrix3d::Identity() / kBendSigma;
  scratch.jacobian.block<3, 3>(3, 9) = -2 * Matrix3d::Identity() / kBendSigma;
  scratch.jacobian.block<3, 3>(3, 15) = Matrix3d::Identity() / kBendSigma;
  scratch.square.noalias() = scratch.jacobian.transpose() * scratch.jacobian;
  scratch.pull.noalias() = scratch.jacobian.transpose() * residual;
  const int window = window_of(segment);
  scratch.places.clear();
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 6; ++i) scratch.places.push_back(control_place(window, segment + j) + i);
  }
  scatter(scratch.square, scratch.pull, scratch.places, 18, system->matrix(window), system->gradient(window));
}

void CameraImuProblem::add_biases(const CameraImuState& state, ChainSystem* system, CameraImuCost& cost) const {
  Vector6d sigma;
  sigma << Vector3d::Constant(sigmas_.gyro_bias_step), Vector3d::Constant(sigmas_.accel_bias_step);
  for (int knot = 0; knot + 1 < plan_.bias_knots(); ++knot) {
    const Vector6d step = (state.biases.col(knot + 1) - state.biases.col(knot)).cwiseQuotient(sigma);
    cost.bias += 0.5 * step.squaredNorm();
    if (system == nullptr) continue;
    const int window = knot / plan_.biases_per_window;
    MatrixXd& H = system->matrix(window);
    VectorXd& g = system->gradient(window);
    const int from = bias_place(window, knot);
    const int to = bias_place(window, knot + 1);
    for (int i = 0; i < 6; ++i) {
      const double information = 1 / (sigma[i] * sigma[i]);
      H(from + i, from + i) += information;
      H(to + i, to + i) += information;
      H(std::max(from, to) + i, std::min(from, to) + i) -= information;
      g[from + i] -= step[i] / sigma[i];
      g[to + i] += step[i] / sigma[i];
    }
  }
}

CameraImuCost CameraImuProblem::evaluate(const CameraImuState& state, ChainSystem* system) const {
  Scratch scratch;
  for (std::size_t i = 0; i + 1 < state.rotations.size(); ++i) {
    scratch.steps.push_back(step_between(state.rotations[i], state.rotations[i + 1]));
  }
  CameraImuCost cost;
  if (system != nullptr) system->clear();
  for (int segment = 0; segment < plan_.grid.segments; ++segment) {
    add_imu(state, segment, scratch, system, cost);
    add_smoothing(state, segment, scratch, system, cost);
  }
  for (const FrameRow& frame : frames_) add_frame(state, frame, scratch, system, cost);
  add_biases(state, system, cost);
  return cost;
}

CameraImuState CameraImuProblem::stepped(const CameraImuState& state, const ChainStep& step) const {
  CameraImuState out = state;
  const int k = plan_.grid.order;
  const int s = plan_.segments_per_window;
  const auto move = [&](int control, const Eigen::Ref<const VectorXd>& x) {
    const auto i = static_cast<std::size_t>(control);
    out.rotations[i] = so3::boxplus(out.rotations[i], x.head<3>());
    out.positions.col(control) += x.tail<3>();
  };
  for (int w = 0; w <= plan_.windows; ++w) {
    const VectorXd& node = step.node[static_cast<std::size_t>(w)];
    for (int j = 0; j < k - 1; ++j) move(w * s + j, node.segment(6 * j, 6));
    out.biases.col(w * plan_.biases_per_window) += node.tail<6>();
    if (w == plan_.windows) break;
    const VectorXd& inner = step.inner[static_cast<std::size_t>(w)];
    for (int j = k - 1; j < s; ++j) move(w * s + j, inner.segment(6 * (j - (k - 1)), 6));
    for (int b = 1; b < plan_.biases_per_window; ++b) {
      out.biases.col(w * plan_.biases_per_window + b) += inner.segment(6 * (s - (k - 1)) + 6 * (b - 1), 6);
    }
  }
  out.R_camera_imu = so3::boxplus(out.R_camera_imu, step.shared.segment<3>(kTurn));
  out.t_camera_imu += step.shared.segment<3>(kShift);
  out.offset_s += step.shared[kOffset];
  const double g = state.gravity.norm();
  out.gravity = (state.gravity + across(state.gravity) * g * step.shared.segment<2>(kGravity)).normalized() * g;
  return out;
}

MatrixXd CameraImuProblem::imu_residuals(const CameraImuState& state) const {
  Scratch scratch;
  for (std::size_t i = 0; i + 1 < state.rotations.size(); ++i) {
    scratch.steps.push_back(step_between(state.rotations[i], state.rotations[i + 1]));
  }
  MatrixXd out(6, static_cast<Index>(imu_.size()));
  CameraImuCost cost;
  for (int segment = 0; segment < plan_.grid.segments; ++segment) {
    const std::size_t first = first_imu_[static_cast<std::size_t>(segment)];
    const std::size_t last = first_imu_[static_cast<std::size_t>(segment) + 1];
    if (first >= last) continue;
    add_imu(state, segment, scratch, nullptr, cost);
    out.middleCols(static_cast<Index>(first), static_cast<Index>(last - first)) =
        Eigen::Map<const MatrixXd>(scratch.residual.data(), 6, static_cast<Index>(last - first));
  }
  return out;
}

std::vector<MatrixXd> CameraImuProblem::corner_residuals(const CameraImuState& state) const {
  const RotationSpline rotation(plan_.grid, state.rotations);
  const VectorSpline position(plan_.grid, state.positions);
  std::vector<MatrixXd> out;
  for (const FrameRow& frame : frames_) {
    const double t = frame.t_s + state.offset_s;
    const Pose3 T_imu_target = Pose3{rotation.at(t).rotation, position.value(t)}.inverse();
    MatrixXd residuals = MatrixXd::Constant(2, static_cast<Index>(frame.corners.size()), kUnknown);
    for (std::size_t i = 0; i < frame.corners.size(); ++i) {
      const auto pixel =
          camera_.project(state.R_camera_imu * (T_imu_target * frame.corners[i].point) + state.t_camera_imu);
      if (pixel) residuals.col(static_cast<Index>(i)) = *pixel - frame.corners[i].pixel;
    }
    out.push_back(std::move(residuals));
  }
  return out;
}

}  // namespace loc::calib
