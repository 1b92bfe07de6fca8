// What each measurement of the error-state filter says about its state. Notation: error_state_filter.hpp.
#include <Eigen/Cholesky>
#include <numbers>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/estimators/error_state_detail.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc::error_state {
namespace {

bool is_covariance(const Eigen::Matrix3d& m) {
  const double scale = m.diagonal().cwiseAbs().maxCoeff();
  if ((m - m.transpose()).cwiseAbs().maxCoeff() > 1e-9 * scale) return false;
  return m.diagonal().minCoeff() > 0 && m.llt().info() == Eigen::Success;
}

bool is_rotation(const Eigen::Quaterniond& q) {
  return q.coeffs().allFinite() && std::abs(q.squaredNorm() - 1) < 2e-3;
}

FusionOutcome judge(bool finite, bool covariance) {
  if (!finite) return FusionOutcome::kNotFinite;
  return covariance ? FusionOutcome::kAccepted : FusionOutcome::kBadCovariance;
}

double wrapped(double angle) {
  return std::remainder(angle, 2 * std::numbers::pi);
}

}  // namespace

FusionOutcome judge(const Correction& c) {
  if (c.keeps_pose) return FusionOutcome::kAccepted;
  switch (c.source) {
    case FusionSource::kOdometry:
    case FusionSource::kRelativeOdometry:
      return judge(
          c.vector.allFinite() && is_rotation(c.rotation) && c.vector_cov.allFinite() && c.second_cov.allFinite(),
          is_covariance(c.vector_cov) && is_covariance(c.second_cov));
    case FusionSource::kGps:
      return judge((c.has_vector || c.has_velocity) && c.lever.allFinite() &&
                       (!c.has_vector || (c.vector.allFinite() && c.vector_cov.allFinite())) &&
                       (!c.has_velocity || (c.velocity.allFinite() && c.second_cov.allFinite())),
                   (!c.has_vector || is_covariance(c.vector_cov)) && (!c.has_velocity || is_covariance(c.second_cov)));
    case FusionSource::kMeasuredVelocity:
    case FusionSource::kZeroVelocity:
      return judge(c.vector.allFinite() && c.vector_cov.allFinite() && c.second_cov.allFinite(),
                   is_covariance(c.vector_cov) && (!c.has_velocity || is_covariance(c.second_cov)));
    case FusionSource::kHeight:
    case FusionSource::kHeading:
      return judge(std::isfinite(c.value) && std::isfinite(c.sigma), c.sigma > 0);
    case FusionSource::kModel:
      break;
  }
  return FusionOutcome::kAccepted;
}

bool Machine::linearise(const Core& core, const Correction& c, Observation& o) {
  const InertialState& x = core.state.inertial;
  switch (c.source) {
    case FusionSource::kOdometry:
      linearise_absolute(core, c, o);
      break;
    case FusionSource::kRelativeOdometry: {
      for (int i = 0; i < options_.clones; ++i) {
        const Clone& from = core.clones[i];
        if (from.time_ns != c.start_time_ns) continue;
        linearise_relative(core, from, layout_.clones + 6 * i, c, o);
        return true;
      }
      return false;
    }
    case FusionSource::kGps:
      linearise_gps(core, c, o);
      break;
    case FusionSource::kMeasuredVelocity:
      o.begin(3);
      o.noise_cov.topLeftCorner<3, 3>() = c.vector_cov;
      if (c.frame == VelocityFrame::kWorld) {
        o.residual.head<3>() = c.vector - x.velocity;
        o.add3(0, kVelocity, 1.0);
      } else {
        const Eigen::Matrix3d rotation = x.q_world_body.toRotationMatrix();
        const Eigen::Vector3d velocity = rotation.transpose() * x.velocity;
        o.residual.head<3>() = c.vector - velocity;
        o.add3(0, kTheta, so3::hat(velocity));
        o.add3(0, kVelocity, rotation.transpose());
      }
      break;
    case FusionSource::kZeroVelocity:
      o.begin(c.has_velocity ? 6 : 3);
      o.residual.head<3>() = -x.velocity;
      o.add3(0, kVelocity, 1.0);
      o.noise_cov.topLeftCorner<3, 3>() = c.vector_cov;
      if (c.has_velocity) {
        o.residual.tail<3>() = c.velocity - x.gyroscope_bias;
        o.add3(3, kGyroscopeBias, 1.0);
        o.noise_cov.bottomRightCorner<3, 3>() = c.second_cov;
      }
      break;
    case FusionSource::kHeight:
      o.begin(1);
      o.residual[0] = c.value - x.position.z();
      o.add(0, kPosition + 2, 1.0);
      o.noise_cov(0, 0) = c.sigma * c.sigma;
      break;
    case FusionSource::kHeading: {
      o.begin(1);
      o.residual[0] = wrapped(c.value - so3::heading(x.q_world_body));
      o.noise_cov(0, 0) = c.sigma * c.sigma;
      // heading = 2 atan2(q_z, q_w); d(w, z) = 1/2 (-x dx - y dy - z dz, w dz + x dy - y dx)
      const Eigen::Quaterniond& q = x.q_world_body;
      const double norm = q.w() * q.w() + q.z() * q.z();
      o.add(0, kTheta + 0, (-q.w() * q.y() + q.z() * q.x()) / norm);
      o.add(0, kTheta + 1, (q.w() * q.x() + q.z() * q.y()) / norm);
      o.add(0, kTheta + 2, 1.0);
      break;
    }
    case FusionSource::kModel:
      linearise_model(core, c, o);
      break;
  }
  return true;
}

void Machine::linearise_absolute(const Core& core, const Correction& c, Observation& o) const {
  const InertialState& x = core.state.inertial;
  const double s = core.state.scale;
  const Pose3& mount = core.state.T_body_odometry;
  const Eigen::Matrix3d rotation = x.q_world_body.toRotationMatrix();
  const Eigen::Matrix3d mount_rotation = mount.rotation.toRotationMatrix();
  const Eigen::Vector3d sensor = x.position + rotation * mount.translation;

  o.begin(6);
  o.residual.head<3>() = c.vector - (s * sensor + core.state.drift);
  o.residual.tail<3>() = so3::boxminus(c.rotation, x.q_world_body * mount.rotation);
  o.noise_cov.topLeftCorner<3, 3>() = c.vector_cov;
  o.noise_cov.bottomRightCorner<3, 3>() = c.second_cov;

  o.add3(0, kTheta, -s * rotation * so3::hat(mount.translation));
  o.add3(0, kPosition, s);
  o.add3(3, kTheta, mount_rotation.transpose());
  if (layout_.scale >= 0) {
    for (int i = 0; i < 3; ++i) o.add(i, layout_.scale, sensor[i]);
  }
  if (layout_.drift >= 0) o.add3(0, layout_.drift, 1.0);
  if (layout_.extrinsics >= 0) {
    o.add3(3, layout_.extrinsics, 1.0);
    o.add3(0, layout_.extrinsics + 3, s * rotation);
  }
}

void Machine::linearise_relative(const Core& core, const Clone& from, int from_column, const Correction& c,
                                 Observation& o) const {
  const InertialState& x = core.state.inertial;
  const double s = core.state.scale;
  const Pose3& mount = core.state.T_body_odometry;
  const Eigen::Matrix3d r0 = from.pose.rotation.toRotationMatrix();
  const Eigen::Matrix3d r1 = x.q_world_body.toRotationMatrix();
  const Eigen::Matrix3d ro = mount.rotation.toRotationMatrix();
  const Eigen::Matrix3d to_start = (r0 * ro).transpose();  // world to the sensor's axes at the start
  // The sensor's place at the end seen from body at the start, and the way of the sensor in its axes at the start [m].
  const Eigen::Vector3d end = r0.transpose() * (x.position + r1 * mount.translation - from.pose.translation);
  const Eigen::Vector3d way = ro.transpose() * (end - mount.translation);
  const Eigen::Quaterniond turn = (from.pose.rotation * mount.rotation).conjugate() * x.q_world_body * mount.rotation;

  o.begin(6);
  o.residual.head<3>() = c.vector - s * way;
  o.residual.tail<3>() = so3::boxminus(c.rotation, turn);
  o.noise_cov.topLeftCorner<3, 3>() = c.vector_cov;
  o.noise_cov.bottomRightCorner<3, 3>() = c.second_cov;

  o.add3(0, kTheta, -s * to_start * r1 * so3::hat(mount.translation));
  o.add3(0, kPosition, s * to_start);
  o.add3(0, from_column, s * ro.transpose() * so3::hat(end));
  o.add3(0, from_column + 3, -s * to_start);
  o.add3(3, kTheta, ro.transpose());
  o.add3(3, from_column, -(r0.transpose() * r1 * ro).transpose());
  if (layout_.scale >= 0) {
    for (int i = 0; i < 3; ++i) o.add(i, layout_.scale, way[i]);
  }
  if (layout_.extrinsics >= 0) {
    o.add3(0, layout_.extrinsics, s * so3::hat(way));
    o.add3(0, layout_.extrinsics + 3, s * ro.transpose() * (r0.transpose() * r1 - Eigen::Matrix3d::Identity()));
    o.add3(3, layout_.extrinsics, Eigen::Matrix3d::Identity() - turn.toRotationMatrix().transpose());
  }
}

void Machine::linearise_gps(const Core& core, const Correction& c, Observation& o) const {
  const InertialState& x = core.state.inertial;
  const Eigen::Matrix3d rotation = x.q_world_body.toRotationMatrix();
  o.begin(c.has_vector && c.has_velocity ? 6 : 3);
  int row = 0;
  if (c.has_vector) {
    o.residual.head<3>() = c.vector - (x.position + rotation * c.lever);
    o.noise_cov.topLeftCorner<3, 3>() = c.vector_cov;
    o.add3(0, kTheta, -rotation * so3::hat(c.lever));
    o.add3(0, kPosition, 1.0);
    row = 3;
  }
  if (c.has_velocity) {
    // Before the first IMU sample nothing is known of the rate: a body at rest.
    const Eigen::Vector3d rate = core.has_imu ? Eigen::Vector3d(core.last_imu.angular_velocity - x.gyroscope_bias)
                                              : Eigen::Vector3d(Eigen::Vector3d::Zero());
    const Eigen::Vector3d swing = rate.cross(c.lever);
    o.residual.segment<3>(row) = c.velocity - (x.velocity + rotation * swing);
    o.noise_cov.block<3, 3>(row, row) = c.second_cov;
    o.add3(row, kTheta, -rotation * so3::hat(swing));
    o.add3(row, kVelocity, 1.0);
    if (core.has_imu) o.add3(row, kGyroscopeBias, rotation * so3::hat(c.lever));
  }
}

void Machine::linearise_model(const Core& core, const Correction& c, Observation& o) {
  Linearisation& l = linearisation_;
  l.residual.resize(0);
  c.model(core.state, layout_, l);
  const auto dim = static_cast<int>(l.residual.size());
  require(dim >= 1 && dim <= kMaxUpdateDim, "residual of the model: size", dim, "must be 1 to 6");
  require(l.jacobian.rows() == dim && l.jacobian.cols() == layout_.size,
          "Jacobian of the model is " + std::to_string(l.jacobian.rows()) + " x " + std::to_string(l.jacobian.cols()) +
              ", not " + std::to_string(dim) + " x " + std::to_string(layout_.size));
  require(l.noise_cov.rows() == dim && l.noise_cov.cols() == dim,
          "covariance of the model is " + std::to_string(l.noise_cov.rows()) + " x " +
              std::to_string(l.noise_cov.cols()) + ", not " + std::to_string(dim) + " x " + std::to_string(dim));
  o.begin(dim);
  o.residual.head(dim) = l.residual;
  o.noise_cov.topLeftCorner(dim, dim) = l.noise_cov;
  for (int column = 0; column < layout_.size; ++column) {
    for (int row = 0; row < dim; ++row) o.add(row, column, l.jacobian(row, column));
  }
}

}  // namespace loc::error_state
