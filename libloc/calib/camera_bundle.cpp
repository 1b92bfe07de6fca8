#include "libloc/calib/camera_bundle.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "libloc/geometry/so3.hpp"

namespace loc::calib {
namespace {

using Matrix86d = Eigen::Matrix<double, 8, 6>;
using Matrix28d = Eigen::Matrix<double, 2, 8>;
using Matrix26d = Eigen::Matrix<double, 2, 6>;

// Normal equations of one view: A intrinsics, C pose (translation, rotation), B between them.
struct Block {
  Matrix8d A = Matrix8d::Zero();
  Matrix86d B = Matrix86d::Zero();
  Matrix6d C = Matrix6d::Zero();
  Vector8d a = Vector8d::Zero();
  Vector6d c = Vector6d::Zero();
  double cost = 0;
};

double huber_cost(double norm, double width, double& weight) {
  weight = 1;
  if (width <= 0 || norm <= width) return norm * norm / 2;
  weight = width / norm;
  return width * (norm - width / 2);
}

// Cost of a view; nullopt when a corner has no projection.
std::optional<double> cost_of(const Camera& camera, const BundleView& view, double huber) {
  double cost = 0;
  const Eigen::Matrix3d R = view.T_camera_target.rotation.toRotationMatrix();
  for (const BundleCorner& corner : view.corners) {
    if (!corner.used) continue;
    const auto pixel = camera.project(R * corner.point + view.T_camera_target.translation);
    if (!pixel) return std::nullopt;
    double weight = 1;
    cost += huber_cost((corner.pixel - *pixel).norm(), huber, weight);
  }
  return cost;
}

std::optional<Block> block_of(const Camera& camera, const BundleView& view, double huber) {
  Block block;
  const Eigen::Matrix3d R = view.T_camera_target.rotation.toRotationMatrix();
  for (const BundleCorner& corner : view.corners) {
    if (!corner.used) continue;
    const auto projection = camera.project_with_jacobians(R * corner.point + view.T_camera_target.translation);
    if (!projection) return std::nullopt;
    const Eigen::Vector2d r = corner.pixel - projection->pixel_px;
    double weight = 1;
    block.cost += huber_cost(r.norm(), huber, weight);
    const Matrix28d& P = projection->d_parameters;
    Matrix26d Q;
    Q.leftCols<3>() = projection->d_point;
    Q.rightCols<3>() = -projection->d_point * R * so3::hat(corner.point);  // R Exp(theta) X
    const Matrix28d WP = weight * P;
    const Matrix26d WQ = weight * Q;
    block.A.noalias() += P.transpose() * WP;
    block.B.noalias() += P.transpose() * WQ;
    block.C.noalias() += Q.transpose() * WQ;
    block.a.noalias() += WP.transpose() * r;
    block.c.noalias() += WQ.transpose() * r;
  }
  return block;
}

Pose3 moved(const Pose3& pose, const Vector6d& step) {
  return {so3::boxplus(pose.rotation, step.tail<3>()), pose.translation + step.head<3>()};
}

// Directions without curvature get some, so that the factorisation exists: parameters that the model has not, a pose
// that too few corners hold.
template <class Matrix>
void damp(Matrix& m, double damping) {
  const double floor = std::max(1e-12 * m.diagonal().maxCoeff(), std::numeric_limits<double>::min());
  for (Eigen::Index i = 0; i < m.rows(); ++i) m(i, i) += damping * std::max(m(i, i), floor) + floor;
}

}  // namespace

int parameter_count(DistortionModel model) {
  return model == DistortionModel::kNone ? 4 : 8;
}

Vector8d parameters_of(const CameraCalibration& camera) {
  return (Vector8d() << camera.intrinsics_px, camera.distortion).finished();
}

void set_parameters(CameraCalibration& camera, const Vector8d& parameters) {
  camera.intrinsics_px = parameters.head<4>();
  if (camera.distortion_model != DistortionModel::kNone) camera.distortion = parameters.tail<4>();
}

BundleResult adjust(CameraCalibration& camera, std::span<BundleView> views, const BundleOptions& options) {
  BundleResult result;
  std::vector<Block> blocks(views.size());
  const auto linearise = [&] {
    const Camera lens(camera);
    result.cost = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
      auto block = block_of(lens, views[i], options.huber_px);
      if (!block) return false;
      blocks[i] = *block;
      result.cost += block->cost;
    }
    return true;
  };
  result.valid = linearise();
  if (!result.valid) return result;
  double damping = 1e-4;
  std::vector<Pose3> trial(views.size());
  while (result.iterations < options.max_iterations && !result.converged) {
    ++result.iterations;
    bool accepted = false;
    while (!accepted && damping < 1e12) {
      Matrix8d S = Matrix8d::Zero();
      Vector8d s = Vector8d::Zero();
      std::vector<Eigen::LLT<Matrix6d>> factors;
      factors.reserve(views.size());
      double gradient_scale = 0;
      for (const Block& block : blocks) {
        Matrix6d C = block.C;
        damp(C, damping);
        factors.emplace_back(C);
        const Matrix86d BC = factors.back().solve(block.B.transpose()).transpose();
        S += block.A - BC * block.B.transpose();
        s += block.a - BC * block.c;
        gradient_scale += block.A.diagonal().sum();
      }
      Vector8d step = Vector8d::Zero();
      if (!options.fixed_camera) {
        Matrix8d A = Matrix8d::Zero();  // damped by the curvature with the poses held
        for (const Block& block : blocks) A.diagonal() += block.A.diagonal();
        const double floor = std::max(1e-12 * gradient_scale, std::numeric_limits<double>::min());
        S.diagonal() += (damping * A.diagonal()).cwiseMax(floor * 1e-3);
        step = S.ldlt().solve(s);
      }
      CameraCalibration next = camera;
      set_parameters(next, parameters_of(camera) + step);
      double cost = 0;
      bool possible = step.allFinite() && (next.intrinsics_px.head<2>().array() > 0).all();
      // How far all parameters move, in standard deviations of unit noise.
      double moved_by = step.dot(S * step);
      if (possible) {
        const Camera lens(next);
        for (std::size_t i = 0; possible && i < views.size(); ++i) {
          const Vector6d pose_step = factors[i].solve(blocks[i].c - blocks[i].B.transpose() * step);
          possible = pose_step.allFinite();
          if (!possible) break;
          moved_by += pose_step.dot(blocks[i].C * pose_step);
          BundleView candidate;
          std::swap(candidate.corners, views[i].corners);
          candidate.T_camera_target = trial[i] = moved(views[i].T_camera_target, pose_step);
          const auto part = cost_of(lens, candidate, options.huber_px);
          std::swap(candidate.corners, views[i].corners);
          possible = part.has_value();
          cost += part.value_or(0);
        }
      }
      if (possible && cost <= result.cost) {
        // At the bottom: nothing moves by more than a millionth of a pixel's weight, or the cost falls no more.
        result.converged = moved_by < 1e-12 || result.cost - cost <= 1e-12 * result.cost;
        camera = next;
        for (std::size_t i = 0; i < views.size(); ++i) views[i].T_camera_target = trial[i];
        damping = std::max(1e-10, damping / 5);
        accepted = true;
        if (!linearise()) return result;
      } else {
        // A step that is nothing but rounding cannot lower the cost.
        if (possible && (moved_by < 1e-12 || cost - result.cost <= 1e-13 * result.cost)) {
          result.converged = true;
          break;
        }
        damping *= 6;
      }
    }
    if (!accepted) break;
  }
  return result;
}

std::vector<std::optional<Eigen::Vector2d>> residuals_of(const Camera& camera, const BundleView& view) {
  std::vector<std::optional<Eigen::Vector2d>> out;
  out.reserve(view.corners.size());
  for (const BundleCorner& corner : view.corners) {
    const auto pixel = camera.project(view.T_camera_target * corner.point);
    out.push_back(pixel ? std::optional<Eigen::Vector2d>(corner.pixel - *pixel) : std::nullopt);
  }
  return out;
}

BundleInformation information_of(const CameraCalibration& camera, std::span<const BundleView> views) {
  BundleInformation out;
  const Camera lens(camera);
  for (const BundleView& view : views) {
    const auto block = block_of(lens, view, 0);
    if (!block) continue;
    Matrix6d C = block->C;
    damp(C, 0);
    const Matrix86d BC = C.llt().solve(block->B.transpose()).transpose();
    out.information += block->A - BC * block->B.transpose();
    out.pulls.emplace_back(block->a - BC * block->c);
  }
  return out;
}

}  // namespace loc::calib
