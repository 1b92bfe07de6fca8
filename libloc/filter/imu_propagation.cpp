#include "libloc/filter/imu_propagation.hpp"

#include <algorithm>
#include <cassert>

#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr int kStrip = 16;  // rows at a time, of sizes that the compiler does not know

// P F^T for some rows of P: each row by itself. Only the first nine columns change.
template <int kRows, class Rows>
void propagate_rows(Rows p, const InertialJacobian& f, double half) {
  constexpr int kMaxRows = kRows == Eigen::Dynamic ? kStrip : kRows;
  using Columns = Eigen::Matrix<double, kRows, 3, 0, kMaxRows, 3>;
  const auto theta = p.template middleCols<3>(kTheta);
  Columns pull = theta.lazyProduct(f.velocity_theta.transpose());
  pull.noalias() += p.template middleCols<3>(kAccelerometerBias).lazyProduct(f.velocity_accelerometer_bias.transpose());
  Columns turned = theta.lazyProduct(f.theta_theta.transpose());
  turned -= f.dt_s * p.template middleCols<3>(kGyroscopeBias);
  p.template middleCols<3>(kTheta) = turned;
  p.template middleCols<3>(kPosition) += f.dt_s * p.template middleCols<3>(kVelocity) + half * pull;
  p.template middleCols<3>(kVelocity) += pull;
}

// F P F^T. The usual sizes are known to the compiler; others go through in strips, so that nothing is allocated.
template <int kRows>
void propagate_sized(Eigen::MatrixXd& covariance, const InertialJacobian& f) {
  constexpr int kMoving = kGyroscopeBias;  // theta, p, v
  const Eigen::Index n = covariance.rows();
  Eigen::Map<Eigen::Matrix<double, kRows, kRows>> p(covariance.data(), n, n);
  const double dt = f.dt_s;
  const double half = f.position_from_attitude ? 0.5 * dt : 0.0;

  if constexpr (kRows == Eigen::Dynamic) {
    for (Eigen::Index row = 0; row < n; row += kStrip) {
      propagate_rows<Eigen::Dynamic>(p.middleRows(row, std::min<Eigen::Index>(kStrip, n - row)), f, half);
    }
  } else {
    propagate_rows<kRows>(p.template topRows<kRows>(), f, half);
  }
  // The rows of the moving part, of its own columns; the other columns follow from symmetry.
  Eigen::Matrix<double, 3, kMoving> pull = f.velocity_theta.lazyProduct(p.template block<3, kMoving>(kTheta, 0));
  pull.noalias() += f.velocity_accelerometer_bias.lazyProduct(p.template block<3, kMoving>(kAccelerometerBias, 0));
  Eigen::Matrix<double, 3, kMoving> turned = f.theta_theta.lazyProduct(p.template block<3, kMoving>(kTheta, 0));
  turned -= dt * p.template block<3, kMoving>(kGyroscopeBias, 0);
  p.template block<3, kMoving>(kTheta, 0) = turned;
  p.template block<3, kMoving>(kPosition, 0) += dt * p.template block<3, kMoving>(kVelocity, 0) + half * pull;
  p.template block<3, kMoving>(kVelocity, 0) += pull;
  p.template topRows<kMoving>().rightCols(n - kMoving) =
      p.template leftCols<kMoving>().bottomRows(n - kMoving).transpose();
  // Rounding makes the two triangles of the moving part differ in the last digit; they would drift apart.
  for (int column = 0; column < kMoving; ++column) {
    for (int row = column + 1; row < kMoving; ++row) p(column, row) = p(row, column);
  }
}

}  // namespace

InertialJacobian propagate(InertialState& state, const InertialStep& step, const Eigen::Vector3d& gravity,
                           ImuIntegration integration) {
  const double dt = step.dt_s;
  const Eigen::Vector3d turn = step.angular_velocity * dt;
  const bool midpoint = integration == ImuIntegration::kMidpoint;
  InertialJacobian f;
  f.dt_s = dt;
  f.position_from_attitude = midpoint;
  f.theta_theta = so3::exp(-turn).toRotationMatrix();

  const Eigen::Quaterniond middle = midpoint ? state.q_world_body * so3::exp(0.5 * turn) : state.q_world_body;
  const Eigen::Matrix3d rotation = middle.toRotationMatrix();
  const Eigen::Vector3d acceleration = rotation * step.specific_force + gravity;
  f.velocity_accelerometer_bias = -dt * rotation;
  f.velocity_theta = f.velocity_accelerometer_bias * so3::hat(step.specific_force);

  state.position += state.velocity * dt;
  if (midpoint) {
    state.position += 0.5 * dt * dt * acceleration;
    state.q_world_body = (state.q_world_body * so3::exp(turn)).normalized();
  } else {
    const Eigen::Quaterniond rate(0, 0.5 * turn.x(), 0.5 * turn.y(), 0.5 * turn.z());
    state.q_world_body.coeffs() += (state.q_world_body * rate).coeffs();
    state.q_world_body.normalize();
  }
  state.velocity += acceleration * dt;
  return f;
}

void propagate_covariance(Eigen::MatrixXd& covariance, const InertialJacobian& jacobian,
                          const InertialStepNoise& noise) {
  assert(covariance.rows() == covariance.cols() && covariance.rows() >= kInertialDim);
  switch (covariance.rows()) {
    case 15:
      propagate_sized<15>(covariance, jacobian);
      break;
    case 16:
      propagate_sized<16>(covariance, jacobian);
      break;
    case 19:
      propagate_sized<19>(covariance, jacobian);
      break;
    default:
      propagate_sized<Eigen::Dynamic>(covariance, jacobian);
  }
  for (int i = 0; i < 3; ++i) {
    covariance(kTheta + i, kTheta + i) += noise.theta;
    covariance(kPosition + i, kPosition + i) += noise.position;
    covariance(kVelocity + i, kVelocity + i) += noise.velocity;
    covariance(kGyroscopeBias + i, kGyroscopeBias + i) += noise.gyroscope_bias;
    covariance(kAccelerometerBias + i, kAccelerometerBias + i) += noise.accelerometer_bias;
  }
}

Eigen::Matrix<double, kInertialDim, kInertialDim> dense(const InertialJacobian& jacobian) {
  Eigen::Matrix<double, kInertialDim, kInertialDim> f = Eigen::Matrix<double, kInertialDim, kInertialDim>::Identity();
  const double dt = jacobian.dt_s;
  f.block<3, 3>(kTheta, kTheta) = jacobian.theta_theta;
  f.block<3, 3>(kTheta, kGyroscopeBias) = -dt * Eigen::Matrix3d::Identity();
  f.block<3, 3>(kPosition, kVelocity) = dt * Eigen::Matrix3d::Identity();
  f.block<3, 3>(kVelocity, kTheta) = jacobian.velocity_theta;
  f.block<3, 3>(kVelocity, kAccelerometerBias) = jacobian.velocity_accelerometer_bias;
  if (jacobian.position_from_attitude) {
    f.block<3, 3>(kPosition, kTheta) = 0.5 * dt * jacobian.velocity_theta;
    f.block<3, 3>(kPosition, kAccelerometerBias) = 0.5 * dt * jacobian.velocity_accelerometer_bias;
  }
  return f;
}

}  // namespace loc
