#include "libloc/calib/euler_trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "libloc/calib/dense.hpp"
#include "libloc/calib/spline_detail.hpp"
#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr double kWidestPitch = 80 * std::numbers::pi / 180;

Eigen::Vector3d sum_of(const Eigen::MatrixXd& points, int row, const SplinePlace& place, int order,
                       const std::array<double, kMaxSplineOrder>& weights) {
  return points.block(row, place.segment, 3, order) * Eigen::Map<const Eigen::VectorXd>(weights.data(), order);
}

}  // namespace

Eigen::Quaterniond rotation_from_angles(const Eigen::Vector3d& phi) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  return AngleAxisd(phi.z(), Vector3d::UnitZ()) * AngleAxisd(phi.y(), Vector3d::UnitY()) *
         AngleAxisd(phi.x(), Vector3d::UnitX());
}

Eigen::Vector3d angles_of(const Eigen::Quaterniond& rotation) {
  const Eigen::Matrix3d R = rotation.toRotationMatrix();
  const double cos_pitch = std::hypot(R(2, 1), R(2, 2));
  const double pitch = std::atan2(-R(2, 0), cos_pitch);
  if (cos_pitch < 1e-12) return {std::atan2(-R(1, 2), R(1, 1)), pitch, 0};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

Eigen::Matrix3d angle_rate_matrix(const Eigen::Vector3d& phi) {
  const double s1 = std::sin(phi.x());
  const double c1 = std::cos(phi.x());
  const double s2 = std::sin(phi.y());
  const double c2 = std::cos(phi.y());
  return (Eigen::Matrix3d() << 1, 0, -s2, 0, c1, s1 * c2, 0, -s1, c1 * c2).finished();
}

Eigen::Matrix3d angle_rate_matrix_derivative(const Eigen::Vector3d& phi, const Eigen::Vector3d& v) {
  const double s1 = std::sin(phi.x());
  const double c1 = std::cos(phi.x());
  const double s2 = std::sin(phi.y());
  const double c2 = std::cos(phi.y());
  Eigen::Matrix3d out = Eigen::Matrix3d::Zero();
  out.col(0) = Eigen::Vector3d(0, -s1 * v.y() + c1 * c2 * v.z(), -c1 * v.y() - s1 * c2 * v.z());
  out.col(1) = Eigen::Vector3d(-c2, -s1 * s2, -c1 * s2) * v.z();
  return out;
}

Eigen::Quaterniond mean_rotation(std::span<const Eigen::Quaterniond> rotations) {
  require(!rotations.empty(), "mean_rotation: no rotations");
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const Eigen::Quaterniond& q : rotations) sum += q.coeffs() * q.coeffs().transpose();
  Eigen::Quaterniond mean;
  mean.coeffs() = dense::symmetric_eigen(sum).vectors.col(3);
  if (mean.w() < 0) mean.coeffs() = -mean.coeffs();
  return mean.normalized();
}

EulerTrajectory::EulerTrajectory(const Eigen::Quaterniond& mean, const SplineGrid& grid, Eigen::MatrixXd control_points)
    : mean_(mean), spline_(grid, std::move(control_points)) {
  // False for NaN.
  require(std::abs(mean_.norm() - 1) < 1e-6, "norm of mean", mean_.norm(), "must be 1");
  mean_.normalize();
  require(spline_.control_points().rows() == 6, "rows of control_points",
          static_cast<double>(spline_.control_points().rows()), "must be 6");
}

RotationState calib::angles_at(const Eigen::Quaterniond& mean, const Eigen::Ref<const Eigen::MatrixXd>& angles,
                               const SplineWeights& w, RotationJacobians* jacobians) {
  const Eigen::Index order = angles.cols();
  const auto sum = [&](const std::array<double, kMaxSplineOrder>& weights) -> Eigen::Vector3d {
    return angles * Eigen::Map<const Eigen::VectorXd>(weights.data(), order);
  };
  const Eigen::Vector3d phi = sum(w.value);
  const Eigen::Vector3d rate = sum(w.first);
  const Eigen::Vector3d acceleration = sum(w.second);
  const Eigen::Matrix3d S = angle_rate_matrix(phi);
  const Eigen::Matrix3d S_by_phi = angle_rate_matrix_derivative(phi, rate);  // of S(phi) rate
  RotationState out{mean * rotation_from_angles(phi), S * rate, S_by_phi * rate + S * acceleration};
  out.rotation.normalize();
  if (jacobians == nullptr) return out;
  // Of S'(phi) rate = (d(S(phi) rate)/d phi) rate by phi: its first column depends on phi_1 and phi_2, the second too.
  const double s1 = std::sin(phi.x());
  const double c1 = std::cos(phi.x());
  const double s2 = std::sin(phi.y());
  const double c2 = std::cos(phi.y());
  const double x = rate.x();
  const double y = rate.y();
  const double z = rate.z();
  Eigen::Matrix3d bend = Eigen::Matrix3d::Zero();
  bend.col(0) = x * Eigen::Vector3d(0, -c1 * y - s1 * c2 * z, s1 * y - c1 * c2 * z) +
                y * z * Eigen::Vector3d(0, -c1 * s2, s1 * s2);
  bend.col(1) = x * z * Eigen::Vector3d(0, -c1 * s2, s1 * s2) + y * z * Eigen::Vector3d(s2, -s1 * c2, -c1 * c2);
  // (S'(phi) rate) by rate: S_by_phi, and its own dependence on the rate.
  Eigen::Matrix3d by_rate = S_by_phi;
  for (int i = 0; i < 3; ++i) {
    by_rate.col(i) += angle_rate_matrix_derivative(phi, Eigen::Vector3d::Unit(i)) * rate;
  }
  const Eigen::Matrix3d by_phi = bend + angle_rate_matrix_derivative(phi, acceleration);
  for (std::size_t j = 0; j < static_cast<std::size_t>(order); ++j) {
    jacobians->rotation[j] = S * w.value[j];
    jacobians->angular_velocity[j] = S_by_phi * w.value[j] + S * w.first[j];
    jacobians->angular_acceleration[j] = by_phi * w.value[j] + by_rate * w.first[j] + S * w.second[j];
  }
  return out;
}

RotationState EulerTrajectory::rotation_at(double t_s, RotationJacobians* jacobians) const {
  require_finite("t_s", t_s);
  const int order = grid().order;
  const SplinePlace place = place_of(grid(), t_s);
  if (jacobians != nullptr) jacobians->first = place.segment;
  return calib::angles_at(mean_, control_points().block(0, place.segment, 3, order),
                          weights_at(order, grid().spacing_s, place.u), jacobians);
}

PoseState EulerTrajectory::at(double t_s) const {
  const RotationState rotation = rotation_at(t_s);
  const int order = grid().order;
  const SplinePlace place = place_of(grid(), t_s);
  const SplineWeights w = weights_at(order, grid().spacing_s, place.u);
  return {Pose3{rotation.rotation, sum_of(control_points(), 3, place, order, w.value)},
          sum_of(control_points(), 3, place, order, w.first), sum_of(control_points(), 3, place, order, w.second),
          rotation.angular_velocity, rotation.angular_acceleration};
}

EulerTrajectoryFit fit_euler_trajectory(std::span<const double> times_s, std::span<const Pose3> poses,
                                        const SplineFitOptions& options) {
  options.check();
  calib::check_samples(times_s, poses);
  std::vector<Eigen::Quaterniond> rotations;
  rotations.reserve(poses.size());
  for (const Pose3& pose : poses) rotations.push_back(pose.rotation);
  const Eigen::Quaterniond mean = mean_rotation(rotations);
  Eigen::MatrixXd values(6, static_cast<Eigen::Index>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    Eigen::Vector3d phi = angles_of(mean.conjugate() * rotations[i]);
    if (std::abs(phi.y()) > kWidestPitch) {
      throw DataError("poses[" + std::to_string(i) + "]: its second angle is " + to_text(phi.y(), 3) +
                      " rad from the mean attitude: too wide a motion for three angles");
    }
    // The others may go round: continued from the sample before.
    for (const int axis : {0, 2}) {
      if (i > 0)
        phi[axis] += 2 * std::numbers::pi * std::round((values(axis, column - 1) - phi[axis]) / (2 * std::numbers::pi));
    }
    values.col(column) << phi, poses[i].translation;
  }
  const VectorSplineFit fit = fit_vector_spline(times_s, values, options);
  EulerTrajectoryFit out{EulerTrajectory(mean, fit.spline.grid(), fit.spline.control_points())};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Pose3 pose = out.trajectory.at(times_s[i]).pose;
    out.rms_rotation += std::pow(so3::angle_between(pose.rotation, poses[i].rotation), 2);
    out.rms_position += (pose.translation - poses[i].translation).squaredNorm();
  }
  const auto n = static_cast<double>(poses.size());
  out.rms_rotation = std::sqrt(out.rms_rotation / n);
  out.rms_position = std::sqrt(out.rms_position / n);
  return out;
}

}  // namespace loc
