#include "libloc/sim/visual_odometry.hpp"

#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

// Each a generator of its own, so that one kind of error can be switched on without changing the others.
enum Draw : std::uint64_t { kWhite, kOrientation, kDrift, kOutlier, kScale };

// Told where the model does not say, because nobody can use a deviation of zero.
constexpr double kToldPosition = 1e-3;     // [unit], at least
constexpr double kToldOrientation = 0.01;  // [rad]

Eigen::Matrix3d isotropic(double sigma) {
  return sigma * sigma * Eigen::Matrix3d::Identity();
}

}  // namespace

VisualOdometryModel VisualOdometryModel::perfect(double rate_hz) {
  VisualOdometryModel m;
  m.rate_hz = rate_hz;
  m.scale = 1;
  m.sigma_position = 0;
  m.drift_sigma = 0;
  m.told_sigma_position = 0.01;
  return m;
}

void VisualOdometryModel::check() const {
  require_positive("odometry.rate_hz", rate_hz);
  require(rate_hz <= 1e4, "odometry.rate_hz", rate_hz, "must not exceed 1e4");
  require_positive("odometry.scale", scale);
  require_not_negative("odometry.scale_walk", scale_walk);
  require_not_negative("odometry.sigma_position", sigma_position);
  require_not_negative("odometry.sigma_orientation", sigma_orientation);
  require_not_negative("odometry.drift_sigma", drift_sigma);
  require(std::isfinite(drift_frames) && drift_frames >= 1, "odometry.drift_frames", drift_frames,
          "must be at least 1");
  for (const double d : drift_start) require_finite("odometry.drift_start", d);
  require(outlier_fraction >= 0 && outlier_fraction <= 1, "odometry.outlier_fraction", outlier_fraction,
          "must be in [0, 1]");
  require_not_negative("odometry.outlier_position", outlier_position);
  require_not_negative("odometry.outlier_orientation", outlier_orientation);
  require_not_negative("odometry.latency_s", latency_s);
  require_finite("odometry.stamp_delay_s", stamp_delay_s);
  check_intervals("odometry.outages", outages);
  require(T_body_odometry.translation.allFinite() && std::abs(T_body_odometry.rotation.norm() - 1) < 1e-6,
          "odometry.T_body_odometry: must be finite and of a unit quaternion");
  require(std::isnan(told_sigma_position) || told_sigma_position > 0, "odometry.told_sigma_position",
          told_sigma_position, "must be positive or NaN");
  require(std::isnan(told_sigma_orientation) || told_sigma_orientation > 0, "odometry.told_sigma_orientation",
          told_sigma_orientation, "must be positive or NaN");
}

double VisualOdometryModel::drift_step_sigma() const {
  return std::sqrt(2 / drift_frames + 1 / (drift_frames * drift_frames)) * drift_sigma;
}

VisualOdometrySimulator::VisualOdometrySimulator(const VisualOdometryModel& model, Random random)
    : model_((model.check(), model)),
      white_(random.fork(kWhite)),
      orientation_(random.fork(kOrientation)),
      drift_(random.fork(kDrift)),
      outliers_(random.fork(kOutlier)),
      log_scale_(model.scale_walk, random.fork(kScale)),
      truth_{model.scale, model.drift_start, false} {}

std::optional<OdometryMeasurement> VisualOdometrySimulator::measure(const MotionState& state) {
  const Pose3 pose = state.T_world_body * model_.T_body_odometry;
  Pose3 since_last;
  if (last_) {
    require(state.time_s > last_->time_s, "time_s", state.time_s, "must be after the last frame's");
    // The piece of way between two frames is measured with the scale at its end.
    truth_.scale = model_.scale * std::exp(log_scale_.advance(state.time_s - last_->time_s).x());
    since_last = last_pose_.inverse() * pose;
    way_ += truth_.scale * (pose.translation - last_pose_.translation);
  } else {
    way_ = truth_.scale * pose.translation;
  }
  truth_.drift = (1 - 1 / model_.drift_frames) * truth_.drift + model_.drift_step_sigma() * drift_.normal3();
  truth_.outlier = outliers_.uniform() < model_.outlier_fraction;
  // Drawn at every frame, so that outages and outliers leave the errors of the other frames as they were.
  const Eigen::Vector3d noise =
      model_.sigma_position * white_.normal3() + (truth_.outlier ? model_.outlier_position : 0.0) * outliers_.normal3();
  const Eigen::Vector3d turn = model_.sigma_orientation * orientation_.normal3() +
                               (truth_.outlier ? model_.outlier_orientation : 0.0) * outliers_.normal3();

  std::optional<OdometryMeasurement> out;
  const bool seen = !contains(model_.outages, state.time_s);
  if (seen && (!model_.relative || last_seen_)) {
    const TimeNs stamp_delay = from_seconds(model_.stamp_delay_s);
    OdometryMeasurement m;
    m.time_ns = from_seconds(state.time_s) + stamp_delay;
    m.host_time_ns = from_seconds(state.time_s) + from_seconds(model_.latency_s);
    if (model_.relative) {
      m.start_time_ns = from_seconds(last_->time_s) + stamp_delay;
      m.position = truth_.scale * since_last.translation + noise;
      m.rotation = so3::boxplus(since_last.rotation, turn);
    } else {
      m.position = way_ + truth_.drift + noise;
      m.rotation = so3::boxplus(pose.rotation, turn);
    }
    m.position_cov = isotropic(std::isnan(model_.told_sigma_position) ? std::max(model_.sigma_position, kToldPosition)
                                                                      : model_.told_sigma_position);
    m.orientation_cov =
        isotropic(std::isnan(model_.told_sigma_orientation) ? kToldOrientation : model_.told_sigma_orientation);
    out = m;
  }
  last_ = state;
  last_pose_ = pose;
  last_seen_ = seen;
  return out;
}

OdometryMeasurement relative_odometry(const OdometryMeasurement& start, const OdometryMeasurement& end) {
  require(start.start_time_ns == kNoTime && end.start_time_ns == kNoTime, "odometry: both poses must be absolute");
  require(end.time_ns > start.time_ns, "end.time_ns", static_cast<double>(end.time_ns), "must be after the start's");
  OdometryMeasurement m = end;
  m.start_time_ns = start.time_ns;
  const Eigen::Quaterniond to_start = start.rotation.conjugate();
  m.position = to_start * (end.position - start.position);
  m.rotation = (to_start * end.rotation).normalized();
  // An error theta of the start's attitude turns the piece of way: -[theta]x position.
  const Eigen::Matrix3d r = to_start.toRotationMatrix();
  const Eigen::Matrix3d lever = so3::hat(m.position);
  m.position_cov =
      r * (start.position_cov + end.position_cov) * r.transpose() + lever * start.orientation_cov * lever.transpose();
  const Eigen::Matrix3d back = m.rotation.conjugate().toRotationMatrix();
  m.orientation_cov = end.orientation_cov + back * start.orientation_cov * back.transpose();
  return m;
}

}  // namespace loc
