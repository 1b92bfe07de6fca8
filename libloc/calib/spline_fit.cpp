#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "libloc/calib/band_system.hpp"
#include "libloc/calib/spline.hpp"
#include "libloc/calib/spline_detail.hpp"
#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

using calib::BandSystem;
using calib::RotationStep;
using calib::step_between;
using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kLargestTurn = 120 * std::numbers::pi / 180;  // between two samples
constexpr double kStepTolerance = 1e-11;                       // [rad]
// Of control points: what a fit of poses has room for in 100 MB, and as many a sample when there are more samples. A
// grid that is larger than both spans a gap, which only a wrong time can be.
constexpr double kAlwaysAllowed = 100'000;
constexpr double kAllowedASample = 20;
// Second differences of three neighbours.
constexpr std::array<double, 3> kBend{1, -2, 1};

void check_times(std::span<const double> times_s, std::size_t values) {
  if (times_s.empty()) throw DataError("no samples");
  if (times_s.size() != values) {
    throw DataError(std::to_string(times_s.size()) + " times but " + std::to_string(values) + " values");
  }
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    if (!std::isfinite(times_s[i])) throw DataError("times_s[" + std::to_string(i) + "] is not finite");
    if (i > 0 && times_s[i] <= times_s[i - 1]) {
      throw DataError("times_s[" + std::to_string(i) + "] = " + to_text(times_s[i]) + " is not after the one before, " +
                      to_text(times_s[i - 1]));
    }
  }
}

SplineGrid grid_of(std::span<const double> times_s, const SplineFitOptions& options) {
  const double needed = std::ceil((times_s.back() - times_s.front()) / options.spacing_s) + options.order - 1;
  // False for a span that overflows.
  if (!(needed <= std::max(kAlwaysAllowed, kAllowedASample * static_cast<double>(times_s.size())))) {
    std::size_t late = 1;
    for (std::size_t i = 2; i < times_s.size(); ++i) {
      if (times_s[i] - times_s[i - 1] > times_s[late] - times_s[late - 1]) late = i;
    }
    throw DataError("times_s[" + std::to_string(late) + "] = " + to_text(times_s[late]) + " comes " +
                    to_text(times_s[late] - times_s[late - 1], 6) + " s after the one before: from " +
                    to_text(times_s.front()) + " s to " + to_text(times_s.back()) + " s a spacing of " +
                    to_text(options.spacing_s) + " s needs " + to_text(needed, 10) + " control points for " +
                    std::to_string(times_s.size()) + " samples");
  }
  return grid_over(times_s.front(), times_s.back(), options.spacing_s, options.order);
}

// Neighbours reach over order - 1 columns; the bending over two.
Index reach_of(const SplineGrid& grid) {
  return std::max(grid.order - 1, 2);
}

Eigen::MatrixXd fit_columns(const SplineGrid& grid, std::span<const double> times_s, const Eigen::MatrixXd& values,
                            double smoothing) {
  const Index n = grid.control_points();
  BandSystem system(n, reach_of(grid));
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n, values.rows());
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const auto [segment, u] = place_of(grid, times_s[i]);
    const SplineWeights w = weights_at(grid.order, grid.spacing_s, u);
    for (int a = 0; a < grid.order; ++a) {
      right.row(segment + a) += w.value[static_cast<std::size_t>(a)] * values.col(static_cast<Index>(i)).transpose();
      for (int b = 0; b <= a; ++b) {
        system.at(segment + a, segment + b) +=
            w.value[static_cast<std::size_t>(a)] * w.value[static_cast<std::size_t>(b)];
      }
    }
  }
  for (Index i = 0; i + 2 < n; ++i) {
    for (Index a = 0; a < 3; ++a) {
      for (Index b = 0; b <= a; ++b) {
        system.at(i + a, i + b) += smoothing * kBend[static_cast<std::size_t>(a)] * kBend[static_cast<std::size_t>(b)];
      }
    }
  }
  system.solve(right);
  return right.transpose();
}

// ---- rotations

std::vector<Eigen::Quaterniond> first_rotations(const SplineGrid& grid, std::span<const double> times_s,
                                                std::span<const Pose3> poses) {
  std::vector<Eigen::Quaterniond> out;
  std::size_t next = 0;  // first sample that is not before
  double turned = 0;     // along the samples since the last control point
  for (int i = 0; i < grid.control_points(); ++i) {
    const double t = abscissa_of(grid, i);
    while (next < times_s.size() && times_s[next] < t) {
      if (next > 0) turned += so3::angle_between(poses[next - 1].rotation, poses[next].rotation);
      ++next;
    }
    if (turned > 0.9 * std::numbers::pi) {
      throw DataError("around " + to_text(t, 6) + " s the body turns by " + to_text(turned, 3) +
                      " rad within a knot spacing of " + to_text(grid.spacing_s) + " s: too far for one spacing");
    }
    turned = 0;
    if (next == 0) {
      out.push_back(poses.front().rotation);
    } else if (next == times_s.size()) {
      out.push_back(poses.back().rotation);
    } else {
      const double share = (t - times_s[next - 1]) / (times_s[next] - times_s[next - 1]);
      out.push_back(poses[next - 1].rotation.slerp(share, poses[next].rotation));
    }
  }
  return out;
}

class RotationFit {
 public:
  RotationFit(const SplineGrid& grid, std::span<const double> times_s, std::span<const Pose3> poses, double smoothing)
      : grid_(grid),
        times_s_(times_s),
        poses_(poses),
        smoothing_(smoothing),
        rotations_(first_rotations(grid, times_s, poses)) {}

  /// One step of Gauss and Newton. @returns the largest turn of a control point [rad].
  double iterate() {
    const Index n = grid_.control_points();
    BandSystem system(3 * n, 3 * reach_of(grid_) + 2);
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(3 * n, 1);
    steps_.clear();
    for (std::size_t i = 0; i + 1 < rotations_.size(); ++i) {
      steps_.push_back(step_between(rotations_[i], rotations_[i + 1]));
    }
    RotationJacobians by;
    std::array<Matrix3d, kMaxSplineOrder> jacobian;
    const auto order = static_cast<std::size_t>(grid_.order);
    for (std::size_t i = 0; i < times_s_.size(); ++i) {
      const auto [segment, u] = place_of(grid_, times_s_[i]);
      const auto first = static_cast<std::size_t>(segment);
      const RotationState state = calib::rotation_at(rotations_[first], std::span(steps_).subspan(first, order - 1),
                                                     cumulative_weights_at(grid_.order, grid_.spacing_s, u), &by);
      const Vector3d residual = so3::boxminus(poses_[i].rotation, state.rotation);
      // Log(Exp(-e) Exp(r)) = r - J_l^-1(r) e, and J_l(r) = J_r(r)^T.
      const Matrix3d outer = so3::right_jacobian_inverse(residual).transpose();
      for (std::size_t a = 0; a < order; ++a) jacobian[a] = outer * by.rotation[a];
      add(system, right, segment, std::span(jacobian).first(order), residual, 1);
    }
    for (std::size_t i = 0; i + 1 < steps_.size(); ++i) {
      jacobian[0] = steps_[i].right_inverse.transpose();
      jacobian[1] = -steps_[i].right_inverse - steps_[i + 1].right_inverse.transpose();
      jacobian[2] = steps_[i + 1].right_inverse;
      add(system, right, static_cast<Index>(i), std::span(jacobian).first(3),
          steps_[i].difference - steps_[i + 1].difference, smoothing_);
    }
    system.solve(right);
    double largest = 0;
    for (std::size_t i = 0; i < rotations_.size(); ++i) {
      const Vector3d step = right.col(0).segment<3>(3 * static_cast<Index>(i));
      rotations_[i] = so3::boxplus(rotations_[i], step);
      largest = std::max(largest, step.norm());
    }
    return largest;
  }

  std::vector<Eigen::Quaterniond> take() { return std::move(rotations_); }

 private:
  // Normal equations of weight * |residual - sum_a J_a e_{first + a}|^2.
  static void add(BandSystem& system, Eigen::MatrixXd& right, Index first, std::span<const Matrix3d> jacobian,
                  const Vector3d& residual, double weight) {
    for (std::size_t a = 0; a < jacobian.size(); ++a) {
      const Index row = 3 * (first + static_cast<Index>(a));
      right.col(0).segment<3>(row) += weight * jacobian[a].transpose() * residual;
      for (std::size_t b = 0; b <= a; ++b) {
        const Index column = 3 * (first + static_cast<Index>(b));
        const Matrix3d block = weight * jacobian[a].transpose() * jacobian[b];
        for (Index i = 0; i < 3; ++i) {
          for (Index j = 0; j < 3; ++j) {
            if (row + i >= column + j) system.at(row + i, column + j) += block(i, j);
          }
        }
      }
    }
  }

  SplineGrid grid_;
  std::span<const double> times_s_;
  std::span<const Pose3> poses_;
  double smoothing_;
  std::vector<Eigen::Quaterniond> rotations_;
  std::vector<RotationStep> steps_;
};

}  // namespace

namespace calib {

void check_samples(std::span<const double> times_s, std::span<const Pose3> poses) {
  check_times(times_s, poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string name = "poses[" + std::to_string(i) + "]";
    // False for NaN.
    if (!(std::abs(poses[i].rotation.norm() - 1) < 1e-6) || !poses[i].translation.allFinite()) {
      throw DataError(name + ": must be finite, with a quaternion of norm 1");
    }
    if (i == 0) continue;
    const double turn = so3::angle_between(poses[i - 1].rotation, poses[i].rotation);
    if (turn > kLargestTurn) {
      throw DataError(name + " is turned by " + to_text(turn, 3) +
                      " rad against the one before: the way between them is not known");
    }
  }
}

Eigen::MatrixXd fit_vectors(const SplineGrid& grid, std::span<const double> times_s, const Eigen::MatrixXd& values,
                            double smoothing) {
  return fit_columns(grid, times_s, values, smoothing);
}

std::vector<Eigen::Quaterniond> fit_rotations(const SplineGrid& grid, std::span<const double> times_s,
                                              std::span<const Pose3> poses, double smoothing) {
  RotationFit fit(grid, times_s, poses, smoothing);
  for (int i = 0; i < 3; ++i) fit.iterate();
  return fit.take();
}

}  // namespace calib

void SplineFitOptions::check() const {
  require(order >= kMinSplineOrder && order <= kMaxSplineOrder, "order", order, "must be in [3, 8]");
  require_positive("spacing_s", spacing_s);
  require_positive("smoothing", smoothing);
  require(max_iterations > 0, "max_iterations", max_iterations, "must be positive");
}

VectorSplineFit fit_vector_spline(std::span<const double> times_s, const Eigen::MatrixXd& values,
                                  const SplineFitOptions& options) {
  options.check();
  check_times(times_s, static_cast<std::size_t>(values.cols()));
  if (values.rows() == 0) throw DataError("values have no rows");
  for (Index i = 0; i < values.cols(); ++i) {
    if (!values.col(i).allFinite()) throw DataError("values[" + std::to_string(i) + "] are not finite");
  }
  const SplineGrid grid = grid_of(times_s, options);
  VectorSplineFit out{VectorSpline(grid, fit_columns(grid, times_s, values, options.smoothing))};
  double sum = 0;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    sum += (out.spline.value(times_s[i]) - values.col(static_cast<Index>(i))).squaredNorm();
  }
  out.rms = std::sqrt(sum / static_cast<double>(times_s.size()));
  return out;
}

PoseSplineFit fit_pose_spline(std::span<const double> times_s, std::span<const Pose3> poses,
                              const SplineFitOptions& options) {
  options.check();
  calib::check_samples(times_s, poses);
  Eigen::MatrixXd positions(3, static_cast<Index>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i) positions.col(static_cast<Index>(i)) = poses[i].translation;
  const SplineGrid grid = grid_of(times_s, options);
  RotationFit fit(grid, times_s, poses, options.smoothing);
  int iterations = 0;
  bool converged = false;
  while (!converged && iterations < options.max_iterations) {
    ++iterations;
    converged = fit.iterate() < kStepTolerance;
  }
  PoseSplineFit out{PoseSpline(RotationSpline(grid, fit.take()),
                               VectorSpline(grid, fit_columns(grid, times_s, positions, options.smoothing)))};
  out.iterations = iterations;
  out.converged = converged;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const Pose3 pose = out.spline.at(times_s[i]).pose;
    out.rms_rotation += std::pow(so3::angle_between(pose.rotation, poses[i].rotation), 2);
    out.rms_position += (pose.translation - poses[i].translation).squaredNorm();
  }
  const auto n = static_cast<double>(times_s.size());
  out.rms_rotation = std::sqrt(out.rms_rotation / n);
  out.rms_position = std::sqrt(out.rms_position / n);
  return out;
}

}  // namespace loc
