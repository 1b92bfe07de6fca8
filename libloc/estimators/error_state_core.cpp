#include <Eigen/Cholesky>
#include <cmath>

#include "libloc/core/statistics.hpp"
#include "libloc/estimators/error_state_detail.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc::error_state {

Machine::Machine(const ErrorStateOptions& options) : options_(options) {
  options.check();
  if (options.estimate_scale) layout_.scale = layout_.size++;
  if (options.estimate_drift) {
    layout_.drift = layout_.size;
    layout_.size += 3;
  }
  if (options.estimate_extrinsics) {
    layout_.extrinsics = layout_.size;
    layout_.size += 6;
  }
  if (options.clones > 0) {
    layout_.clones = layout_.size;
    layout_.size += 6 * options.clones;
  }
  for (int dof = 1; dof <= kMaxUpdateDim; ++dof) {
    gate_[dof] =
        options.gate ? chi_square_quantile(options.gate_probability, dof) : std::numeric_limits<double>::infinity();
  }
  correction_ = Eigen::VectorXd::Zero(layout_.size);
  linearisation_.jacobian.resize(kMaxUpdateDim, layout_.size);
}

void Machine::step(Core& core, const ImuSample& next, TimeNs time_ns, double gap_s) const {
  const double dt = to_seconds(time_ns - core.time_ns);
  // The sample at the end of this step, which is the next one, or lies on the line to it.
  ImuSample end = next;
  end.time_ns = time_ns;
  if (time_ns != next.time_ns && core.has_imu && options_.sampling == ImuSampling::kPoint) {
    const double share = dt / to_seconds(next.time_ns - core.time_ns);
    end.angular_velocity =
        core.last_imu.angular_velocity + share * (next.angular_velocity - core.last_imu.angular_velocity);
    end.specific_force = core.last_imu.specific_force + share * (next.specific_force - core.last_imu.specific_force);
  }
  InertialStep step{end.angular_velocity, end.specific_force, dt};
  if (core.has_imu && options_.sampling == ImuSampling::kPoint && options_.integration == ImuIntegration::kMidpoint) {
    step.angular_velocity = 0.5 * (core.last_imu.angular_velocity + end.angular_velocity);
    step.specific_force = 0.5 * (core.last_imu.specific_force + end.specific_force);
  }
  InertialState& x = core.state.inertial;
  step.angular_velocity -= x.gyroscope_bias;
  step.specific_force -= x.accelerometer_bias;

  const auto squared = [](double a) { return a * a; };
  InertialStepNoise noise;
  noise.theta = squared(options_.noise.gyroscope_noise_density) * dt;
  noise.velocity = squared(options_.noise.accelerometer_noise_density) * dt;
  noise.gyroscope_bias = squared(options_.noise.gyroscope_random_walk) * dt;
  noise.accelerometer_bias = squared(options_.noise.accelerometer_random_walk) * dt;
  if (gap_s > 0) {
    // An error of rate and force that lasts for the whole gap; written as a density, so that a split step adds the
    // same.
    noise.theta += squared(options_.bridge_angular_velocity_sigma) * gap_s * dt;
    const double density = squared(options_.bridge_specific_force_sigma) * gap_s;
    noise.velocity += density * dt;
    noise.position += density * dt * dt * dt / 3;
  }

  const InertialJacobian jacobian = propagate(x, step, options_.gravity, options_.integration);
  propagate_covariance(core.covariance, jacobian, noise);
  if (layout_.scale >= 0) {
    core.covariance(layout_.scale, layout_.scale) += squared(options_.scale_random_walk * core.state.scale) * dt;
  }
  if (layout_.drift >= 0) {
    const double phi = std::exp(-dt / options_.drift_time_constant_s);
    core.state.drift *= phi;
    core.covariance.middleRows<3>(layout_.drift) *= phi;
    core.covariance.middleCols<3>(layout_.drift) *= phi;
    const double added = squared(options_.drift_sigma) * (1 - phi * phi);
    for (int i = 0; i < 3; ++i) core.covariance(layout_.drift + i, layout_.drift + i) += added;
  }
  core.last_imu = end;
  core.has_imu = true;
  core.time_ns = time_ns;
}

FusionResult Machine::examine(const Core& core, const Correction& correction) {
  FusionResult result;
  result.source = correction.source;
  result.time_ns = correction.time_ns;
  if (!linearise(core, correction, observation_)) {
    result.outcome = FusionOutcome::kNoClone;
    return result;
  }
  const int dim = observation_.dim();
  result.dof = dim;
  result.residual = observation_.residual.head(dim);
  if (correction.source == FusionSource::kModel) {
    const auto noise = observation_.noise_cov.topLeftCorner(dim, dim);
    bool finite = result.residual.allFinite() && noise.allFinite();
    for (int i = 0; i < observation_.count(); ++i) finite = finite && std::isfinite(observation_.entries()[i].value);
    if (!finite) {
      result.outcome = FusionOutcome::kNotFinite;
      return result;
    }
    const double scale = noise.diagonal().cwiseAbs().maxCoeff();
    if ((noise - noise.transpose()).cwiseAbs().maxCoeff() > 1e-9 * scale || noise.diagonal().minCoeff() <= 0 ||
        noise.llt().info() != Eigen::Success) {
      result.outcome = FusionOutcome::kBadCovariance;
      return result;
    }
  }
  if (!innovate(core.covariance, observation_, innovation_)) {
    result.outcome = FusionOutcome::kBadCovariance;
    return result;
  }
  result.innovation_cov = Eigen::Map<const Eigen::MatrixXd>(innovation_.cov.data(), dim, dim);
  result.nis = innovation_.nis;
  result.outcome = innovation_.nis <= gate_[dim] ? FusionOutcome::kAccepted : FusionOutcome::kGated;
  return result;
}

FusionResult Machine::apply(Core& core, const Correction& correction) {
  if (correction.keeps_pose) {
    clone(core);
    FusionResult result;
    result.source = correction.source;
    result.time_ns = correction.time_ns;
    result.outcome = FusionOutcome::kAccepted;
    return result;
  }
  FusionResult result = examine(core, correction);
  if (result.accepted()) {
    joseph_update(core.covariance, observation_, innovation_, correction_);
    inject(core);
  }
  if (correction.source == FusionSource::kRelativeOdometry) clone(core);  // the next one starts here
  return result;
}

void Machine::inject(Core& core) {
  ErrorStateState& state = core.state;
  InertialState& x = state.inertial;
  const auto part = [&](int column) { return Eigen::Vector3d(correction_.segment<3>(column)); };
  x.q_world_body = so3::boxplus(x.q_world_body, part(kTheta));
  x.position += part(kPosition);
  x.velocity += part(kVelocity);
  x.gyroscope_bias += part(kGyroscopeBias);
  x.accelerometer_bias += part(kAccelerometerBias);
  reset_attitude(core, kTheta, part(kTheta));
  if (layout_.scale >= 0) state.scale += correction_[layout_.scale];
  if (layout_.drift >= 0) state.drift += part(layout_.drift);
  if (layout_.extrinsics >= 0) {
    state.T_body_odometry.rotation = so3::boxplus(state.T_body_odometry.rotation, part(layout_.extrinsics));
    state.T_body_odometry.translation += part(layout_.extrinsics + 3);
    reset_attitude(core, layout_.extrinsics, part(layout_.extrinsics));
  }
  for (int i = 0; i < options_.clones; ++i) {
    if (core.clones[i].time_ns == kNoTime) continue;
    const int column = layout_.clones + 6 * i;
    core.clones[i].pose.rotation = so3::boxplus(core.clones[i].pose.rotation, part(column));
    core.clones[i].pose.translation += part(column + 3);
    reset_attitude(core, column, part(column));
  }
}

void Machine::reset_attitude(Core& core, int column, const Eigen::Vector3d& theta) const {
  if (!options_.reset_jacobian) return;
  // G = I - [theta]x/2 on both sides. Row by row, so that nothing is allocated.
  const Eigen::Vector3d half = 0.5 * theta;
  Eigen::MatrixXd& p = core.covariance;
  for (Eigen::Index i = 0; i < p.rows(); ++i) {
    const Eigen::Vector3d row = p.block<1, 3>(i, column).transpose();
    p.block<1, 3>(i, column) = (row - half.cross(row)).transpose();
  }
  for (Eigen::Index i = 0; i < p.cols(); ++i) {
    const Eigen::Vector3d entry = p.block<3, 1>(column, i);
    p.block<3, 1>(column, i) = entry - half.cross(entry);
  }
  // Both sides were at work here, in an order that rounding sees.
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < i; ++j) p(column + j, column + i) = p(column + i, column + j);
  }
}

void Machine::clone(Core& core) const {
  if (options_.clones == 0) return;
  int place = 0;
  for (int i = 0; i < options_.clones; ++i) {
    // The same time again: the pose as it is known by now.
    if (core.clones[i].time_ns == core.time_ns) {
      place = i;
      break;
    }
    if (core.clones[i].time_ns < core.clones[place].time_ns) place = i;
  }
  core.clones[place] = {core.time_ns, {core.state.inertial.q_world_body, core.state.inertial.position}};
  const int column = layout_.clones + 6 * place;
  Eigen::MatrixXd& p = core.covariance;
  for (int i = 0; i < 6; ++i) p.col(column + i) = p.col(i);  // theta and p are the first six
  for (int i = 0; i < 6; ++i) p.row(column + i) = p.row(i);
}

}  // namespace loc::error_state
