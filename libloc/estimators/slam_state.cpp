#include "libloc/estimators/slam_state.hpp"

#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

using Matrix12 = Eigen::Matrix<double, 12, 12>;
using Matrix15 = Eigen::Matrix<double, kInertialDim, kInertialDim>;

// M = F M for the sparse F of one IMU step, by rows.
void multiply_from_left(const InertialJacobian& f, Matrix15& m) {
  const double dt = f.dt_s;
  const double half = f.position_from_attitude ? 0.5 * dt : 0.0;
  const Eigen::Matrix<double, 3, kInertialDim> pull =
      f.velocity_theta.lazyProduct(m.middleRows<3>(kTheta)) +
      f.velocity_accelerometer_bias.lazyProduct(m.middleRows<3>(kAccelerometerBias));
  const Eigen::Matrix<double, 3, kInertialDim> turned =
      f.theta_theta.lazyProduct(m.middleRows<3>(kTheta)) - dt * m.middleRows<3>(kGyroscopeBias);
  m.middleRows<3>(kTheta) = turned;
  m.middleRows<3>(kPosition) += dt * m.middleRows<3>(kVelocity) + half * pull;
  m.middleRows<3>(kVelocity) += pull;
}

}  // namespace

SlamLayout::SlamLayout(const SlamOptions& options)
    : inertial(options.motion == SlamMotion::kInertial), motion_dim(inertial ? kInertialDim : 12), dim(motion_dim) {
  if (options.estimate_extrinsics) {
    extrinsic_rotation = dim;
    extrinsic_position = dim + 3;
    dim += 6;
  }
  if (options.estimate_time_offset) time_offset = dim++;
}

void boxplus(SlamState& state, const SlamLayout& layout, const Eigen::VectorXd& error) {
  state.q_world_body = so3::boxplus(state.q_world_body, error.segment<3>(kTheta));
  state.position += error.segment<3>(kPosition);
  state.velocity += error.segment<3>(kVelocity);
  if (layout.inertial) {
    state.gyroscope_bias += error.segment<3>(kGyroscopeBias);
    state.accelerometer_bias += error.segment<3>(kAccelerometerBias);
    state.angular_velocity -= error.segment<3>(kGyroscopeBias);
  } else {
    state.angular_velocity += error.segment<3>(kAngularVelocity);
  }
  if (layout.extrinsic_rotation >= 0) {
    Pose3& T = state.T_body_camera;
    T.rotation = so3::boxplus(T.rotation, error.segment<3>(layout.extrinsic_rotation));
    T.translation += error.segment<3>(layout.extrinsic_position);
  }
  if (layout.time_offset >= 0) state.time_offset_s += error[layout.time_offset];
}

Eigen::VectorXd boxminus(const SlamState& a, const SlamState& b, const SlamLayout& layout) {
  Eigen::VectorXd error(layout.dim);
  error.segment<3>(kTheta) = so3::boxminus(a.q_world_body, b.q_world_body);
  error.segment<3>(kPosition) = a.position - b.position;
  error.segment<3>(kVelocity) = a.velocity - b.velocity;
  if (layout.inertial) {
    error.segment<3>(kGyroscopeBias) = a.gyroscope_bias - b.gyroscope_bias;
    error.segment<3>(kAccelerometerBias) = a.accelerometer_bias - b.accelerometer_bias;
  } else {
    error.segment<3>(kAngularVelocity) = a.angular_velocity - b.angular_velocity;
  }
  if (layout.extrinsic_rotation >= 0) {
    error.segment<3>(layout.extrinsic_rotation) = so3::boxminus(a.T_body_camera.rotation, b.T_body_camera.rotation);
    error.segment<3>(layout.extrinsic_position) = a.T_body_camera.translation - b.T_body_camera.translation;
  }
  if (layout.time_offset >= 0) error[layout.time_offset] = a.time_offset_s - b.time_offset_s;
  return error;
}

SlamTransition::SlamTransition(const SlamLayout& layout) : f_(layout.dim, layout.dim), q_(layout.dim, layout.dim) {
  reset();
}

void SlamTransition::reset() {
  f_.setIdentity();
  q_.setZero();
  empty_ = true;
}

void SlamTransition::move(SlamState& state, double dt_s, double acceleration_density,
                          double angular_acceleration_density) {
  const Eigen::Vector3d turn = state.angular_velocity * dt_s;
  state.q_world_body = so3::boxplus(state.q_world_body, turn);
  state.position += state.velocity * dt_s;

  Matrix12 f = Matrix12::Identity();
  f.block<3, 3>(kTheta, kTheta) = so3::exp(-turn).toRotationMatrix();
  f.block<3, 3>(kTheta, kAngularVelocity) = dt_s * so3::right_jacobian(turn);
  f.block<3, 3>(kPosition, kVelocity) = dt_s * Eigen::Matrix3d::Identity();
  const auto times_f = [&](const Matrix12& m) -> Matrix12 { return f.lazyProduct(m); };
  const Matrix12 fq = times_f(q_.topLeftCorner<12, 12>());
  q_.topLeftCorner<12, 12>() = fq.lazyProduct(f.transpose());
  const Matrix12 ff = times_f(f_.topLeftCorner<12, 12>());
  f_.topLeftCorner<12, 12>() = ff;

  // Integral of white noise through the model; the turn within a step changes it in third order only.
  const auto add = [&](int place, int rate, double density) {
    const double variance = density * density;
    for (int i = 0; i < 3; ++i) {
      q_(place + i, place + i) += variance * dt_s * dt_s * dt_s / 3;
      q_(place + i, rate + i) += variance * dt_s * dt_s / 2;
      q_(rate + i, place + i) += variance * dt_s * dt_s / 2;
      q_(rate + i, rate + i) += variance * dt_s;
    }
  };
  add(kPosition, kVelocity, acceleration_density);
  add(kTheta, kAngularVelocity, angular_acceleration_density);
  empty_ = false;
}

void SlamTransition::move(SlamState& state, const InertialStep& step, const InertialStepNoise& noise,
                          const Eigen::Vector3d& gravity) {
  InertialJacobian jacobian = propagate(state, step, gravity, ImuIntegration::kMidpoint);
  // The pull is that of the attitude in the middle of the step, and so is the error that turns it: only then is a turn
  // of the world about the vertical carried over exactly, and stays unobservable.
  jacobian.velocity_theta *= so3::exp(-0.5 * step.dt_s * step.angular_velocity).toRotationMatrix();
  state.angular_velocity = step.angular_velocity;
  Matrix15 f = f_.topLeftCorner<kInertialDim, kInertialDim>();
  multiply_from_left(jacobian, f);
  f_.topLeftCorner<kInertialDim, kInertialDim>() = f;
  Matrix15 q = q_.topLeftCorner<kInertialDim, kInertialDim>();
  multiply_from_left(jacobian, q);
  q.transposeInPlace();
  multiply_from_left(jacobian, q);
  for (int i = 0; i < 3; ++i) {
    q(kTheta + i, kTheta + i) += noise.theta;
    q(kPosition + i, kPosition + i) += noise.position;
    q(kVelocity + i, kVelocity + i) += noise.velocity;
    q(kGyroscopeBias + i, kGyroscopeBias + i) += noise.gyroscope_bias;
    q(kAccelerometerBias + i, kAccelerometerBias + i) += noise.accelerometer_bias;
  }
  q_.topLeftCorner<kInertialDim, kInertialDim>() = q;
  empty_ = false;
}

}  // namespace loc
