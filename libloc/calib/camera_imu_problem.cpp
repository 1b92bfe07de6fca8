#include "libloc/calib/camera_imu_problem.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "libloc/calib/camera_bundle.hpp"
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
constexpr int kMostSegments = 100;  // more cost memory with their square
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
  const int per_bias =
      static_cast<int>(std::clamp(std::round(bias_spacing_s / spacing_s), 1.0, static_cast<double>(kMostSegments)));
  if (per_bias >= least) {
    plan.segments_per_window = per_bias;
  } else {
    plan.biases_per_window = (least + per_bias - 1) / per_bias;
    plan.segments_per_window = plan.biases_per_window * per_bias;
  }
  const double wanted = std::ceil(length / spacing_s - 1e-6);
  plan.windows = std::max(1, static_cast<int>(std::lround(wanted / plan.segments_per_window)));
  const auto per_bias_step =
      static_cast<int>(std::ceil(wanted / (static_cast<double>(plan.windows) * plan.biases_per_window)));
  plan.segments_per_window =
      plan.biases_per_window * std::max(per_bias_step, (least + plan.biases_per_window - 1) / plan.biases_per_window);
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

std::vector<FrameRow> split_rows(const std::vector<FrameRow>& frames, std::span<const double> heights_px, int bands) {
  std::vector<FrameRow> out;
  for (const FrameRow& frame : frames) {
    const double height = heights_px[frame.camera];
    std::map<int, std::vector<FrameCorner>> rows;
    for (const FrameCorner& corner : frame.corners) {
      rows[static_cast<int>(std::floor(corner.pixel.y() * bands / height))].push_back(corner);
    }
    for (auto& [band, corners] : rows) {
      double sum = 0;
      for (const FrameCorner& corner : corners) sum += corner.pixel.y() - height / 2;
      FrameRow row = frame;
      row.lines = sum / static_cast<double>(corners.size());
      row.corners = std::move(corners);
      out.push_back(std::move(row));
    }
  }
  return out;
}

SharedLayout shared_layout(std::span<const CameraState> cameras, const SharedChoice& choice) {
  SharedLayout out;
  int next = 0;
  const auto take = [&](bool wanted, int size) {
    const int at = wanted ? next : -1;
    if (wanted) next += size;
    return at;
  };
  for (const CameraState& camera : cameras) {
    SharedLayout::OfCamera c;
    c.first = take(true, kMountingSize);
    c.drift = take(choice.drift, 1);
    c.line_delay = take(choice.line_delay, 1);
    c.intrinsics_size = choice.intrinsics ? parameter_count(camera.camera.distortion_model) : 0;
    c.intrinsics = take(choice.intrinsics, c.intrinsics_size);
    c.size = next - c.first;
    out.cameras.push_back(c);
  }
  out.gravity = take(true, 2);
  out.gravity_size = take(choice.gravity_size, 1);
  out.target_scale = take(choice.target_scale, 1);
  out.gyro_matrix = take(choice.imu_matrices, 9);
  out.accel_matrix = take(choice.imu_matrices, 6);
  out.size = next;
  return out;
}

// Reused from segment to segment.
struct CameraImuProblem::Scratch {
  RotationJacobians by;
  std::vector<RotationStep> steps;  // of all control points
  std::vector<Camera> cameras;
  MatrixXd jacobian;  // rows of a segment by its columns
  VectorXd residual;
  MatrixXd square;
  VectorXd pull;
  std::vector<int> places;  // of the columns in the window
};

CameraImuProblem::Scratch CameraImuProblem::scratch_of(const CameraImuState& state) const {
  Scratch out;
  for (std::size_t i = 0; i + 1 < state.rotations.size(); ++i) {
    out.steps.push_back(step_between(state.rotations[i], state.rotations[i + 1]));
  }
  for (const CameraState& camera : state.cameras) out.cameras.emplace_back(camera.camera);
  return out;
}

RotationState CameraImuProblem::rotation_of(const CameraImuState& state, const Scratch& scratch, int segment,
                                            const SplineWeights& weights, const SplineWeights& cumulative,
                                            RotationJacobians* by) const {
  const int k = plan_.grid.order;
  if (state.form == RotationForm::kThreeAngles) {
    return angles_at(state.mean, state.angles.middleCols(segment, k), weights, by);
  }
  const auto at = static_cast<std::size_t>(segment);
  return rotation_at(state.rotations[at], std::span(scratch.steps).subspan(at, static_cast<std::size_t>(k) - 1),
                     cumulative, by);
}

CameraImuProblem::CameraImuProblem(std::vector<ImuRow> imu, std::vector<FrameRow> frames, const CameraImuSigmas& sigmas,
                                   double loss_sigmas, const ChainPlan& plan)
    : imu_(std::move(imu)), frames_(std::move(frames)), sigmas_(sigmas), loss_(loss_sigmas), plan_(plan) {
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

ChainLayout CameraImuProblem::layout(const SharedLayout& shared) const {
  ChainLayout out;
  const int k = plan_.grid.order;
  out.inner.assign(static_cast<std::size_t>(plan_.windows),
                   6 * (plan_.segments_per_window - (k - 1)) + 6 * (plan_.biases_per_window - 1));
  out.node = 6 * (k - 1) + 6;
  out.shared = shared.size;
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

void CameraImuProblem::add_imu(const CameraImuState& state, int segment, const SharedLayout* shared, Scratch& scratch,
                               ChainSystem* system, CameraImuCost& cost) const {
  const std::size_t first = first_imu_[static_cast<std::size_t>(segment)];
  const std::size_t last = first_imu_[static_cast<std::size_t>(segment) + 1];
  if (first >= last) return;
  const SplineGrid& grid = plan_.grid;
  const int k = grid.order;
  const Index pose_columns = 6 * k;
  const Index bias_columns = pose_columns;
  const Index shared_columns = bias_columns + 12;
  const Index columns = shared_columns + (shared != nullptr ? shared->imu_size() : 0);
  const Index rows = 6 * static_cast<Index>(last - first);
  const auto points = state.positions.middleCols(segment, k);
  const int segments_per_bias = plan_.segments_per_window / plan_.biases_per_window;
  const int knot = segment / segments_per_bias;
  const double knot_s = grid.start_s + grid.spacing_s * segments_per_bias * knot;
  const double size = state.gravity.norm();
  const Eigen::Matrix<double, 3, 2> tangent = across(state.gravity) * size;
  const Matrix3d& G = state.gyro_matrix;
  const Matrix3d& A = state.accel_matrix;
  if (system != nullptr) scratch.jacobian.setZero(rows, columns);
  scratch.residual.resize(rows);
  for (std::size_t i = first; i < last; ++i) {
    const Index row = 6 * static_cast<Index>(i - first);
    const SplineWeights& w = imu_weights_[i];
    const RotationState r =
        rotation_of(state, scratch, segment, w, imu_cumulative_[i], system != nullptr ? &scratch.by : nullptr);
    const Matrix3d R_transposed = r.rotation.conjugate().toRotationMatrix();
    const Vector3d acceleration = points * Eigen::Map<const VectorXd>(w.second.data(), k);
    const Vector3d force = R_transposed * (state.target_scale * acceleration - state.gravity);
    const double share = (imu_[i].t_s - knot_s) / plan_.bias_spacing_s();
    const Vector6d bias = (1 - share) * state.biases.col(knot) + share * state.biases.col(knot + 1);
    scratch.residual.segment<3>(row) = (G * r.angular_velocity + bias.head<3>() - imu_[i].gyro) / sigmas_.gyro;
    scratch.residual.segment<3>(row + 3) = (A * force + bias.tail<3>() - imu_[i].accel) / sigmas_.accel;
    cost.gyro += 0.5 * scratch.residual.segment<3>(row).squaredNorm();
    cost.accel += 0.5 * scratch.residual.segment<3>(row + 3).squaredNorm();
    if (system == nullptr) continue;
    const Matrix3d rate = G / sigmas_.gyro;
    const Matrix3d force_by_turn = A * so3::hat(force) / sigmas_.accel;
    const Matrix3d force_by_acceleration = A * R_transposed / sigmas_.accel;
    for (int j = 0; j < k; ++j) {
      const auto c = static_cast<std::size_t>(j);
      scratch.jacobian.block<3, 3>(row, 6 * j) = rate * scratch.by.angular_velocity[c];
      scratch.jacobian.block<3, 3>(row + 3, 6 * j) = force_by_turn * scratch.by.rotation[c];
      scratch.jacobian.block<3, 3>(row + 3, 6 * j + 3) = force_by_acceleration * (state.target_scale * w.second[c]);
    }
    for (Index a = 0; a < 3; ++a) {
      scratch.jacobian(row + a, bias_columns + a) = (1 - share) / sigmas_.gyro;
      scratch.jacobian(row + 3 + a, bias_columns + 3 + a) = (1 - share) / sigmas_.accel;
      scratch.jacobian(row + a, bias_columns + 6 + a) = share / sigmas_.gyro;
      scratch.jacobian(row + 3 + a, bias_columns + 9 + a) = share / sigmas_.accel;
    }
    const auto column = [&](int place) { return shared_columns + place - shared->gravity; };
    scratch.jacobian.block<3, 2>(row + 3, column(shared->gravity)) = -force_by_acceleration * tangent;
    if (shared->gravity_size >= 0) {
      scratch.jacobian.block<3, 1>(row + 3, column(shared->gravity_size)) =
          -force_by_acceleration * state.gravity / size;
    }
    if (shared->target_scale >= 0) {
      scratch.jacobian.block<3, 1>(row + 3, column(shared->target_scale)) = force_by_acceleration * acceleration;
    }
    if (shared->gyro_matrix >= 0) {
      const Index gyro = column(shared->gyro_matrix);
      Index accel = column(shared->accel_matrix);
      for (Index a = 0; a < 3; ++a) {
        scratch.jacobian.block<1, 3>(row + a, gyro + 3 * a) = r.angular_velocity.transpose() / sigmas_.gyro;
        for (Index b = 0; b <= a; ++b) scratch.jacobian(row + 3 + a, accel++) = force[b] / sigmas_.accel;
      }
    }
  }
  if (system == nullptr) return;
  scratch.square.noalias() = scratch.jacobian.transpose() * scratch.jacobian;
  scratch.pull.noalias() = scratch.jacobian.transpose() * scratch.residual;
  const int window = window_of(segment);
  const int shared_place = system->layout().local_size(window) - shared->size;
  scratch.places.clear();
  for (int j = 0; j < k; ++j) {
    for (int a = 0; a < 6; ++a) scratch.places.push_back(control_place(window, segment + j) + a);
  }
  for (int b = 0; b < 2; ++b) {
    for (int a = 0; a < 6; ++a) scratch.places.push_back(bias_place(window, knot + b) + a);
  }
  for (int a = 0; a < shared->imu_size(); ++a) scratch.places.push_back(shared_place + shared->gravity + a);
  scatter(scratch.square, scratch.pull, scratch.places, columns, system->matrix(window), system->gradient(window));
}

namespace {

// What a frame sees, by six: a turn of the IMU on the right and the place of the points in camera; or by fourteen: and
// the camera's parameters. Corners enter through these sums alone.
template <int N>
struct FrameSums {
  Eigen::Matrix<double, N, N> square = Eigen::Matrix<double, N, N>::Zero();
  Eigen::Matrix<double, N, 1> pull = Eigen::Matrix<double, N, 1>::Zero();
};

struct FrameView {
  const Camera& camera;
  const FrameRow& frame;
  Matrix3d R_imu_target;
  Vector3d position;  // of the IMU in target
  Matrix3d R_camera_imu;
  Vector3d t_camera_imu;
  double loss;
};

constexpr double kBehind = 1e12;  // [sigmas^2] of a corner without projection: very far off, for the loss to bound

double corner_cost(const FrameView& v) {
  const double loss_square = v.loss * v.loss;
  const double sigma_square = v.frame.sigma_px * v.frame.sigma_px;
  double sum = 0;
  for (const FrameCorner& corner : v.frame.corners) {
    const auto pixel =
        v.camera.project(v.R_camera_imu * (v.R_imu_target * (corner.point - v.position)) + v.t_camera_imu);
    const double s = pixel ? (*pixel - corner.pixel).squaredNorm() / sigma_square : kBehind;
    sum += 0.5 * loss_square * std::log1p(s / loss_square);
  }
  return sum;
}

template <int N>
double add_corners(const FrameView& v, FrameSums<N>& sums) {
  const double loss_square = v.loss * v.loss;
  double cost = 0;
  for (const FrameCorner& corner : v.frame.corners) {
    const Vector3d in_imu = v.R_imu_target * (corner.point - v.position);
    const auto projection = v.camera.project_with_jacobians(v.R_camera_imu * in_imu + v.t_camera_imu);
    if (!projection) {
      cost += 0.5 * loss_square * std::log1p(kBehind / loss_square);
      continue;
    }
    const Eigen::Vector2d residual = (projection->pixel_px - corner.pixel) / v.frame.sigma_px;
    const double s = residual.squaredNorm();
    cost += 0.5 * loss_square * std::log1p(s / loss_square);
    const double weight = 1 / (1 + s / loss_square);
    // Along the residual the loss bends the other way beyond loss sigmas; a little is left there.
    const double along = std::max(kLeastCurvature, 1 - 2 * s / loss_square * weight);
    Eigen::Matrix<double, 2, N> J;
    const Eigen::Matrix<double, 2, 3> by_point = projection->d_point / v.frame.sigma_px;
    J.template leftCols<3>() = by_point * v.R_camera_imu * so3::hat(in_imu);
    J.template middleCols<3>(3) = by_point;
    if constexpr (N == 14) J.template rightCols<8>() = projection->d_parameters / v.frame.sigma_px;
    sums.pull.noalias() += weight * J.transpose() * residual;
    sums.square.noalias() += weight * J.transpose() * J;
    if (s > 0) {
      const Eigen::Matrix<double, N, 1> along_residual = J.transpose() * residual / std::sqrt(s);
      sums.square.noalias() -= weight * (1 - along) * along_residual * along_residual.transpose();
    }
  }
  return cost;
}

}  // namespace

void CameraImuProblem::add_frame(const CameraImuState& state, const FrameRow& frame, const SharedLayout* shared,
                                 Scratch& scratch, ChainSystem* system, CameraImuCost& cost) const {
  const SplineGrid& grid = plan_.grid;
  const int k = grid.order;
  const CameraState& camera = state.cameras[frame.camera];
  const auto [segment, u] = place_of(grid, state.time_of(frame));
  const SplineWeights w = weights_at(k, grid.spacing_s, u);
  const RotationState r = rotation_of(state, scratch, segment, w, cumulative_weights_at(k, grid.spacing_s, u),
                                      system != nullptr ? &scratch.by : nullptr);
  const auto points = state.positions.middleCols(segment, k);
  const FrameView view{scratch.cameras[frame.camera],
                       frame,
                       r.rotation.conjugate().toRotationMatrix(),
                       points * Eigen::Map<const VectorXd>(w.value.data(), k),
                       camera.R_camera_imu.toRotationMatrix(),
                       camera.t_camera_imu,
                       loss_};
  if (system == nullptr) {
    cost.corner += corner_cost(view);
    return;
  }
  // The chain from (turn, point in camera, parameters) to what is unknown.
  const SharedLayout::OfCamera& places = shared->cameras[frame.camera];
  const Vector3d velocity = points * Eigen::Map<const VectorXd>(w.first.data(), k);
  const Matrix3d to_camera = view.R_camera_imu * view.R_imu_target;
  const Index poses = 6 * k;
  const Index columns = poses + places.size;
  const bool intrinsics = places.intrinsics >= 0;
  MatrixXd& M = scratch.jacobian;
  M.setZero(6 + places.intrinsics_size, columns);
  for (int j = 0; j < k; ++j) {
    const auto c = static_cast<std::size_t>(j);
    M.block<3, 3>(0, 6 * j) = scratch.by.rotation[c];
    M.block<3, 3>(3, 6 * j + 3) = -to_camera * w.value[c];
  }
  // R_ci Exp(theta) turns the points against what the IMU's turn does.
  M.block<3, 3>(0, poses + kTurn) = -Matrix3d::Identity();
  M.block<3, 3>(3, poses + kShift) = Matrix3d::Identity();
  Vector6d by_time;
  by_time << r.angular_velocity, -to_camera * velocity;
  M.block<6, 1>(0, poses + kOffset) = by_time;
  if (places.drift >= 0) {
    M.block<6, 1>(0, poses + places.drift - places.first) = by_time * frame.drift_s;
  }
  if (places.line_delay >= 0) {
    M.block<6, 1>(0, poses + places.line_delay - places.first) = by_time * frame.lines;
  }
  if (intrinsics) {
    M.block(6, poses + places.intrinsics - places.first, places.intrinsics_size, places.intrinsics_size).setIdentity();
    FrameSums<14> sums;
    cost.corner += add_corners(view, sums);
    const Index n = M.rows();  // four of the parameters may be none
    scratch.square.noalias() = M.transpose() * sums.square.topLeftCorner(n, n) * M;
    scratch.pull.noalias() = M.transpose() * sums.pull.head(n);
  } else {
    FrameSums<6> sums;
    cost.corner += add_corners(view, sums);
    scratch.square.noalias() = M.transpose() * sums.square * M;
    scratch.pull.noalias() = M.transpose() * sums.pull;
  }
  const int window = window_of(segment);
  const int shared_place = system->layout().local_size(window) - shared->size;
  scratch.places.clear();
  for (int j = 0; j < k; ++j) {
    for (int a = 0; a < 6; ++a) scratch.places.push_back(control_place(window, segment + j) + a);
  }
  for (int a = 0; a < places.size; ++a) scratch.places.push_back(shared_place + places.first + a);
  scatter(scratch.square, scratch.pull, scratch.places, columns, system->matrix(window), system->gradient(window));
}

// Second differences of the control points segment … segment + 2.
void CameraImuProblem::add_smoothing(const CameraImuState& state, int segment, Scratch& scratch, ChainSystem* system,
                                     CameraImuCost& cost) const {
  const auto at = static_cast<std::size_t>(segment);
  const bool cumulative = state.form == RotationForm::kCumulative;
  const auto bend = [&](const MatrixXd& x) { return x.col(segment) - 2 * x.col(segment + 1) + x.col(segment + 2); };
  Vector6d residual;
  residual.head<3>() = cumulative ? Vector3d(scratch.steps[at + 1].difference - scratch.steps[at].difference)
                                  : Vector3d(bend(state.angles));
  residual.tail<3>() = bend(state.positions);
  residual /= kBendSigma;
  cost.smoothing += 0.5 * residual.squaredNorm();
  if (system == nullptr) return;
  const Matrix3d one = Matrix3d::Identity() / kBendSigma;
  scratch.jacobian.setZero(6, 18);
  if (cumulative) {
    const Matrix3d& a = scratch.steps[at].right_inverse;
    const Matrix3d& b = scratch.steps[at + 1].right_inverse;
    scratch.jacobian.block<3, 3>(0, 0) = a.transpose() / kBendSigma;
    scratch.jacobian.block<3, 3>(0, 6) = -(a + b.transpose()) / kBendSigma;
    scratch.jacobian.block<3, 3>(0, 12) = b / kBendSigma;
  } else {
    scratch.jacobian.block<3, 3>(0, 0) = one;
    scratch.jacobian.block<3, 3>(0, 6) = -2 * one;
    scratch.jacobian.block<3, 3>(0, 12) = one;
  }
  scratch.jacobian.block<3, 3>(3, 3) = one;
  scratch.jacobian.block<3, 3>(3, 9) = -2 * one;
  scratch.jacobian.block<3, 3>(3, 15) = one;
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
  Vector6d usual;
  usual << Vector3d::Constant(sigmas_.gyro_bias_step), Vector3d::Constant(sigmas_.accel_bias_step);
  for (int knot = 0; knot + 1 < plan_.bias_knots(); ++knot) {
    const Vector6d sigma = usual * (bias_growth_.empty() ? 1 : bias_growth_[static_cast<std::size_t>(knot)]);
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

// In the first window: it has all shared unknowns, as every other.
void CameraImuProblem::add_priors(const CameraImuState& state, const SharedLayout* shared, ChainSystem* system,
                                  CameraImuCost& cost) const {
  for (std::size_t c = 0; c < priors_.size(); ++c) {
    const Vector8d step = (parameters_of(state.cameras[c].camera) - priors_[c].mean).cwiseQuotient(priors_[c].sigma);
    cost.prior += 0.5 * step.squaredNorm();
    if (system == nullptr || shared->cameras[c].intrinsics < 0) continue;
    const int at = system->layout().local_size(0) - shared->size + shared->cameras[c].intrinsics;
    for (int i = 0; i < shared->cameras[c].intrinsics_size; ++i) {
      system->matrix(0)(at + i, at + i) += 1 / (priors_[c].sigma[i] * priors_[c].sigma[i]);
      system->gradient(0)[at + i] += step[i] / priors_[c].sigma[i];
    }
  }
}

CameraImuCost CameraImuProblem::evaluate(const CameraImuState& state, const SharedLayout* shared,
                                         ChainSystem* system) const {
  Scratch scratch = scratch_of(state);
  CameraImuCost cost;
  if (system != nullptr) system->clear();
  for (int segment = 0; segment < plan_.grid.segments; ++segment) {
    add_imu(state, segment, shared, scratch, system, cost);
    add_smoothing(state, segment, scratch, system, cost);
  }
  for (const FrameRow& frame : frames_) add_frame(state, frame, shared, scratch, system, cost);
  add_biases(state, system, cost);
  add_priors(state, shared, system, cost);
  return cost;
}

CameraImuState CameraImuProblem::stepped(const CameraImuState& state, const SharedLayout& shared,
                                         const ChainStep& step) const {
  CameraImuState out = state;
  const int k = plan_.grid.order;
  const int s = plan_.segments_per_window;
  const auto move = [&](int control, const Eigen::Ref<const VectorXd>& x) {
    if (out.form == RotationForm::kCumulative) {
      const auto i = static_cast<std::size_t>(control);
      out.rotations[i] = so3::boxplus(out.rotations[i], x.head<3>());
    } else {
      out.angles.col(control) += x.head<3>();
    }
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
  const VectorXd& x = step.shared;
  for (std::size_t c = 0; c < out.cameras.size(); ++c) {
    const SharedLayout::OfCamera& at = shared.cameras[c];
    CameraState& camera = out.cameras[c];
    camera.R_camera_imu = so3::boxplus(camera.R_camera_imu, x.segment<3>(at.first + kTurn));
    camera.t_camera_imu += x.segment<3>(at.first + kShift);
    camera.offset_s += x[at.first + kOffset];
    if (at.drift >= 0) camera.drift += x[at.drift];
    if (at.line_delay >= 0) camera.line_delay_s += x[at.line_delay];
    if (at.intrinsics >= 0) {
      Vector8d parameters = parameters_of(camera.camera);
      parameters.head(at.intrinsics_size) += x.segment(at.intrinsics, at.intrinsics_size);
      set_parameters(camera.camera, parameters);
    }
  }
  const double size = state.gravity.norm();
  const Vector3d direction = state.gravity / size + across(state.gravity) * x.segment<2>(shared.gravity);
  out.gravity = direction.normalized() * (size + (shared.gravity_size >= 0 ? x[shared.gravity_size] : 0));
  if (shared.target_scale >= 0) out.target_scale += x[shared.target_scale];
  if (shared.gyro_matrix >= 0) {
    int accel = shared.accel_matrix;
    for (Index a = 0; a < 3; ++a) {
      for (Index b = 0; b < 3; ++b) out.gyro_matrix(a, b) += x[shared.gyro_matrix + 3 * a + b];
      for (Index b = 0; b <= a; ++b) out.accel_matrix(a, b) += x[accel++];
    }
  }
  return out;
}

Pose3 CameraImuProblem::pose_at(const CameraImuState& state, double t_s) const {
  const int k = plan_.grid.order;
  const auto [segment, u] = place_of(plan_.grid, t_s);
  const SplineWeights w = weights_at(k, plan_.grid.spacing_s, u);
  const Vector3d position = state.positions.middleCols(segment, k) * Eigen::Map<const VectorXd>(w.value.data(), k);
  if (state.form == RotationForm::kThreeAngles) {
    return {angles_at(state.mean, state.angles.middleCols(segment, k), w, nullptr).rotation, position};
  }
  std::vector<RotationStep> steps;
  const auto first = static_cast<std::size_t>(segment);
  for (std::size_t at = first; at + 1 < first + static_cast<std::size_t>(k); ++at) {
    steps.push_back(step_between(state.rotations[at], state.rotations[at + 1]));
  }
  return {
      rotation_at(state.rotations[first], steps, cumulative_weights_at(k, plan_.grid.spacing_s, u), nullptr).rotation,
      position};
}

MatrixXd CameraImuProblem::imu_residuals(const CameraImuState& state) const {
  Scratch scratch = scratch_of(state);
  MatrixXd out(6, static_cast<Index>(imu_.size()));
  CameraImuCost cost;
  for (int segment = 0; segment < plan_.grid.segments; ++segment) {
    const std::size_t first = first_imu_[static_cast<std::size_t>(segment)];
    const std::size_t last = first_imu_[static_cast<std::size_t>(segment) + 1];
    if (first >= last) continue;
    add_imu(state, segment, nullptr, scratch, nullptr, cost);
    out.middleCols(static_cast<Index>(first), static_cast<Index>(last - first)) =
        Eigen::Map<const MatrixXd>(scratch.residual.data(), 6, static_cast<Index>(last - first));
  }
  return out;
}

std::vector<MatrixXd> CameraImuProblem::corner_residuals(const CameraImuState& state) const {
  std::vector<Camera> cameras;
  for (const CameraState& camera : state.cameras) cameras.emplace_back(camera.camera);
  std::vector<MatrixXd> out;
  for (const FrameRow& frame : frames_) {
    const CameraState& camera = state.cameras[frame.camera];
    const Pose3 T_camera_target =
        Pose3{camera.R_camera_imu, camera.t_camera_imu} * pose_at(state, state.time_of(frame)).inverse();
    MatrixXd residuals = MatrixXd::Constant(2, static_cast<Index>(frame.corners.size()), kUnknown);
    for (std::size_t i = 0; i < frame.corners.size(); ++i) {
      const auto pixel = cameras[frame.camera].project(T_camera_target * frame.corners[i].point);
      if (pixel) residuals.col(static_cast<Index>(i)) = *pixel - frame.corners[i].pixel;
    }
    out.push_back(std::move(residuals));
  }
  return out;
}

}  // namespace loc::calib
