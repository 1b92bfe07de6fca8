// GPS and odometry in InertialFusion, and what is done when they are rejected.
#include <algorithm>
#include <cmath>

#include "libloc/estimators/inertial_fusion.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr int kToldAfter = 3;     // rejections in a row
constexpr int kFixesToDoubt = 3;  // rejections of GPS in a row
// So little is known of what is not measured that nothing follows from it, however often it is said. [m^2], [rad^2]
constexpr double kNothing = 1e8;
constexpr double kOldestAnchor = 1;        // [s]
constexpr double kApartToSeeMotion = 0.5;  // between two poses [s]
constexpr double kSeesMotion = 5;          // deviations
constexpr double kScaleDoubt = 0.3;        // of the scale, when the odometry is not believed any more
constexpr double kAttitudeDoubt = 0.1;     // [rad]

double square(double x) {
  return x * x;
}

}  // namespace

void InertialFusion::process_other(const Measurement& measurement) {
  if (const auto* gps = std::get_if<GpsMeasurement>(&measurement)) {
    fuse(*gps);
  } else if (const auto* odometry = std::get_if<OdometryMeasurement>(&measurement)) {
    fuse(*odometry);
  }
}

bool InertialFusion::refused(GpsRefusal refusal) {
  if (refusal == GpsRefusal::kNone) return false;
  const GpsRefusalNote note = note_of(refusal);
  skip(note.count, note.status);
  return true;
}

bool InertialFusion::prepare(const GpsMeasurement& gps, GpsPosition& fix) {
  GeodeticPoint place;
  if (refused(gps_place(gps, place))) return false;
  TimeNs ahead = 0;
  if (gps.time_ns == kNoTime || __builtin_sub_overflow(gps.time_ns, filter().time_ns(), &ahead) ||
      to_seconds(ahead) > options_.gps_max_ahead_s) {
    skip("gps.skipped.ahead", kOutOfRange);
    return false;
  }
  const InertialState& x = filter().state().inertial;
  if (!world_) {
    world_.emplace(place);
    if (options_.given_start) {
      // Nobody said where on the Earth the given start is; this fix does.
      world_.emplace(LocalFrame(place).to_geodetic(-(x.position + x.q_world_body * options_.gps_antenna)));
      anchored_ = tied_ = true;
    }
  }
  // The first fix becomes the state, so that the filter cannot judge it.
  if (refused(gps_in_world(gps, options_, *world_, gps_before_ns_, fix))) return false;
  const Eigen::Vector3d way = options_.gps_time_sigma * x.velocity;
  if (heading_known_) {
    fix.position_cov += way * way.transpose();
  } else {
    fix.position_cov += way.squaredNorm() * Eigen::Matrix3d::Identity();
  }
  if (!fix.has_height) {
    fix.position.z() = x.position.z();
    fix.position_cov.row(2).setZero();
    fix.position_cov.col(2).setZero();
    fix.position_cov(2, 2) = kNothing;
  }
  if (!options_.use_gps_velocity) fix.velocity.setConstant(kUnknown);
  return true;
}

void InertialFusion::fuse(const GpsMeasurement& gps) {
  GpsPosition fix;
  if (!prepare(gps, fix)) return;
  rest_.confirm_speed(fix.velocity.norm(), std::sqrt(fix.velocity_cov.diagonal().maxCoeff()));
  if (!anchored_) {
    if (std::abs(to_seconds(filter().time_ns() - gps.time_ns)) > kOldestAnchor) {
      skip("gps.too_late", kTooLate);
      return;
    }
    anchor(gps.time_ns, fix.position, fix.position_cov);
    fix.position.setConstant(kUnknown);  // it is in the state now
    if (!fix.velocity.allFinite()) return;
  } else if (!heading_known_ && bank_.size() == 1) {
    const ErrorStateState state = filter().state();
    bank_.start_all_headings(filter().time_ns(), state, Eigen::MatrixXd(filter().covariance()));
  }
  gps_before_ns_ = std::max(gps_before_ns_, gps.time_ns);
  see_lag(fix);
  take_note(bank_.fuse([&](ErrorStateFilter& one) {
    return one.fuse_gps(gps.time_ns, fix.position, fix.position_cov, options_.gps_antenna, fix.velocity,
                        fix.velocity_cov);
  }));
}

// A window's reckoning begins at the filter's state, which is of now: a fix that is late finds no place in it at first.
void InertialFusion::see_lag(const GpsPosition& fix) {
  if (!heading_known_ || bank_.size() != 1) {
    lag_.break_off();
    reckoning_.stop();
    return;
  }
  if (!reckoning_.running() || (lag_.begins() && reckoning_used_)) {
    lag_.break_off();
    const InertialState& x = filter().state().inertial;
    reckoning_.begin({filter().time_ns(), x.position, x.velocity, x.q_world_body}, x.gyroscope_bias,
                     x.accelerometer_bias);
    reckoning_used_ = false;
  }
  const auto point = reckoning_.at(fix.time_ns);
  if (!point) return;
  reckoning_used_ = true;
  const Eigen::Vector3d antenna = point->position + point->q_world_body * options_.gps_antenna;
  lag_.see(fix.time_ns, fix.position.head<2>(), antenna.head<2>(), point->velocity.head<2>());
}

// Moves the state to where GPS is; without a heading, in all of them.
void InertialFusion::anchor(TimeNs time_ns, const Eigen::Vector3d& position, const Eigen::Matrix3d& position_cov) {
  ErrorStateState state = filter().state();
  Eigen::MatrixXd covariance = filter().covariance();
  InertialState& x = state.inertial;
  const double age = to_seconds(filter().time_ns() - time_ns);
  const Eigen::Matrix3d velocity_cov = covariance.block<3, 3>(kVelocity, kVelocity);
  Eigen::Matrix3d cov = position_cov + age * age * velocity_cov;
  if (heading_known_) {
    x.position = position - x.q_world_body * options_.gps_antenna + age * x.velocity;
  } else {
    x.position = position;
    cov += (options_.gps_antenna.squaredNorm() + square(age * x.velocity.norm())) * Eigen::Matrix3d::Identity();
  }
  covariance.middleRows<3>(kPosition).setZero();
  covariance.middleCols<3>(kPosition).setZero();
  covariance.block<3, 3>(kPosition, kPosition) = 0.5 * (cov + cov.transpose());
  const TimeNs now = filter().time_ns();
  if (heading_known_) {
    bank_.start(now, state, covariance);
  } else {
    bank_.start_all_headings(now, state, covariance);
  }
  anchored_ = tied_ = true;
  follows_odometry_ = false;
  pose_before_.reset();
  next_status_ |= kReinitialised;
  ++counts_["gps.anchored"];
}

void InertialFusion::fuse(const OdometryMeasurement& odometry) {
  TimeNs ahead = 0;
  if (odometry.time_ns == kNoTime || __builtin_sub_overflow(odometry.time_ns, filter().time_ns(), &ahead) ||
      to_seconds(ahead) > options_.gps_max_ahead_s) {
    skip("odometry.skipped.ahead", kOutOfRange);
    return;
  }
  if (!odometry.position.allFinite() || odometry.rotation.coeffs().array().isInf().any()) {
    skip("odometry.skipped.not_finite", kNotFinite);
    return;
  }
  const auto chosen = [](const std::optional<Eigen::Matrix3d>& fixed, const Eigen::Matrix3d& said, double sigma) {
    if (fixed) return *fixed;
    return said.hasNaN() ? Eigen::Matrix3d(square(sigma) * Eigen::Matrix3d::Identity()) : said;
  };
  const Eigen::Matrix3d position_cov =
      chosen(options_.odometry_position_cov, odometry.position_cov, options_.odometry_position_sigma);
  const Eigen::Matrix3d orientation_cov =
      chosen(options_.odometry_orientation_cov, odometry.orientation_cov, options_.odometry_orientation_sigma);
  if (!is_usable_covariance(position_cov) || !is_usable_covariance(orientation_cov)) {
    skip("odometry.bad_covariance", kBadCovariance);
    return;
  }
  look_for_motion(odometry, position_cov);
  stamps_.see(odometry);
  const bool clones = options_.filter.clones > 0;
  if (odometry.start_time_ns != kNoTime) {
    if (!clones || odometry.start_time_ns >= odometry.time_ns || odometry.rotation.coeffs().hasNaN()) {
      ++counts_[clones ? "odometry.skipped.incomplete" : "odometry.skipped.relative"];
      return;
    }
    take_note(bank_.fuse([&](ErrorStateFilter& one) {
      return one.fuse_vo_relative(odometry.start_time_ns, odometry.time_ns, odometry.position, position_cov,
                                  odometry.rotation, orientation_cov);
    }));
    return;
  }
  const bool free = !anchored_ && !heading_known_;  // nothing else says where world is
  const bool absolute =
      options_.odometry == OdometryUse::kAbsolute || (options_.odometry == OdometryUse::kAutomatic &&
                                                      (follows_odometry_ || free) && !(odometry_left_world_ && clones));
  if (!absolute) {
    fuse_as_relative(odometry, position_cov, orientation_cov);
  } else if (!follows_odometry_ && free) {
    adopt_axes_of(odometry, position_cov, orientation_cov);
  } else {
    fuse_absolute(odometry, position_cov, orientation_cov);
  }
}

// Whatever its unit, odometry that moves says that the body is not at rest.
void InertialFusion::look_for_motion(const OdometryMeasurement& odometry, const Eigen::Matrix3d& position_cov) {
  odometry_used_ = true;
  const bool relative = odometry.start_time_ns != kNoTime;
  const TimeNs from = relative ? odometry.start_time_ns : seen_.time_ns;
  if (from == kNoTime) {
    seen_ = odometry;
    return;
  }
  const double apart = to_seconds(odometry.time_ns - from);
  if (!(apart >= (relative ? 0 : kApartToSeeMotion))) return;
  const Eigen::Vector3d way = relative ? odometry.position : Eigen::Vector3d(odometry.position - seen_.position);
  const double sigma = std::sqrt((relative ? 1 : 2) * position_cov.diagonal().maxCoeff());
  const double unit = std::max(std::abs(filter().state().scale), 1e-3) * apart;
  if (apart > 0 && way.norm() > kSeesMotion * sigma) rest_.confirm_speed(way.norm() / unit, 0);
  if (!relative) seen_ = odometry;
}

void InertialFusion::fuse_absolute(const OdometryMeasurement& odometry, const Eigen::Matrix3d& position_cov,
                                   const Eigen::Matrix3d& orientation_cov) {
  const bool has_rotation = !odometry.rotation.coeffs().hasNaN();
  const Eigen::Quaterniond rotation = has_rotation ? odometry.rotation : filter().state().inertial.q_world_body;
  const Eigen::Matrix3d cov = has_rotation ? orientation_cov : Eigen::Matrix3d(kNothing * Eigen::Matrix3d::Identity());
  const Eigen::Vector3d position = odometry.position - odometry_origin_;
  take_note(bank_.fuse(
      [&](ErrorStateFilter& one) { return one.fuse_vo(odometry.time_ns, position, position_cov, rotation, cov); }));
}

// Our world gets the axes of the odometry's, with the origin here: where the body is in its world is a length times a
// scale that nobody knows yet.
void InertialFusion::adopt_axes_of(const OdometryMeasurement& odometry, const Eigen::Matrix3d& position_cov,
                                   const Eigen::Matrix3d& orientation_cov) {
  TimeNs age_ns = 0;
  if (__builtin_sub_overflow(filter().time_ns(), odometry.time_ns, &age_ns) || to_seconds(age_ns) > kOldestAnchor) {
    skip("odometry.too_late", kTooLate);
    return;
  }
  ErrorStateState state = filter().state();
  Eigen::MatrixXd covariance = filter().covariance();
  const ErrorStateLayout& layout = filter().layout();
  InertialState& x = state.inertial;
  if (!odometry.rotation.coeffs().hasNaN()) {
    turn_heading(so3::heading(odometry.rotation) - so3::heading(x.q_world_body),
                 std::sqrt(orientation_cov.diagonal().maxCoeff()), state, covariance);
  }
  const double s = state.scale;
  const double age = to_seconds(age_ns);
  odometry_origin_ = odometry.position;
  x.position = age * x.velocity;
  const Eigen::Matrix3d velocity_cov = covariance.block<3, 3>(kVelocity, kVelocity);
  covariance.middleRows<3>(kPosition).setZero();
  covariance.middleCols<3>(kPosition).setZero();
  Eigen::Matrix3d cov = position_cov / (s * s) + age * age * velocity_cov;
  if (layout.drift >= 0) cov += covariance.block<3, 3>(layout.drift, layout.drift) / (s * s);
  covariance.block<3, 3>(kPosition, kPosition) = 0.5 * (cov + cov.transpose());
  bank_.start(filter().time_ns(), state, covariance);
  follows_odometry_ = true;
  next_status_ |= kReinitialised;
  ++counts_["odometry.world_adopted"];
}

void InertialFusion::fuse_as_relative(const OdometryMeasurement& odometry, const Eigen::Matrix3d& position_cov,
                                      const Eigen::Matrix3d& orientation_cov) {
  if (odometry.rotation.coeffs().hasNaN() || options_.filter.clones == 0) {
    ++counts_["odometry.skipped.incomplete"];
    return;
  }
  const double since = pose_before_ ? to_seconds(odometry.time_ns - pose_before_->time_ns) : kUnknown;
  if (since >= 0 && since < options_.odometry_interval_s) {
    ++counts_["odometry.between"];
    return;
  }
  const std::optional<OdometryMeasurement> before = pose_before_;
  pose_before_ = odometry;
  pose_before_->position_cov = position_cov;
  pose_before_->orientation_cov = orientation_cov;
  if (!before || !(since > 0)) {
    bank_.fuse([&](ErrorStateFilter& one) { return one.keep_pose(odometry.time_ns); });
    return;
  }
  const Eigen::Quaterniond from = before->rotation.inverse();
  const Eigen::Matrix3d R0 = from.toRotationMatrix();
  const Eigen::Quaterniond rotation = from * odometry.rotation;
  const Eigen::Matrix3d R10 = rotation.toRotationMatrix().transpose();
  const Eigen::Vector3d position = from * (odometry.position - before->position);
  const Eigen::Matrix3d relative_cov = R0 * (before->position_cov + position_cov) * R0.transpose();
  const Eigen::Matrix3d turn_cov = orientation_cov + R10 * before->orientation_cov * R10.transpose();
  take_note(bank_.fuse([&](ErrorStateFilter& one) {
    return one.fuse_vo_relative(before->time_ns, odometry.time_ns, position, relative_cov, rotation, turn_cov);
  }));
}

void InertialFusion::take_note(const FusionResult& result) {
  switch (result.outcome) {
    case FusionOutcome::kTooLate:
      next_status_ |= kTooLate;
      return;
    case FusionOutcome::kNoClone:
      next_status_ |= kOdometryRejected;
      return;
    case FusionOutcome::kNotFinite:
      next_status_ |= kNotFinite;
      return;
    case FusionOutcome::kBadCovariance:
      next_status_ |= kBadCovariance;
      return;
    case FusionOutcome::kAccepted:
    case FusionOutcome::kGated:
      break;
    default:
      return;
  }
  const bool gps = result.source == FusionSource::kGps;
  const bool odometry = result.source == FusionSource::kOdometry || result.source == FusionSource::kRelativeOdometry;
  if (!gps && !odometry) return;
  Watch& watch = watches_[result.source];
  if (result.accepted()) {
    watch.rejected = 0;
    watch.since_ns = kNoTime;
    if (++watch.accepted >= options_.reject_count) watch.widened = 0;
    return;
  }
  watch.accepted = 0;
  if (watch.rejected++ == 0) watch.since_ns = result.time_ns;
  if (watch.rejected >= kToldAfter) next_status_ |= gps ? kGpsRejected : kOdometryRejected;
  // Fixes are seldom: waiting for many of them would leave the filter lost for long.
  const int enough = gps ? std::min(options_.reject_count, kFixesToDoubt) : options_.reject_count;
  if (watch.rejected >= enough && to_seconds(result.time_ns - watch.since_ns) >= options_.reject_time_s) {
    recover(result, watch);
  }
}

// The residual says by how much the state may be off.
void InertialFusion::recover(const FusionResult& result, Watch& watch) {
  next_status_ |= kRecovered;
  if (result.source == FusionSource::kGps && watch.widened > 0) {
    // It did not help: attitude or heading are wrong. GPS begins again from the level.
    start_anew(kReinitialised | kRecovered);
    carried_->heading_known = false;
    anchored_ = heading_known_ = false;
    return;
  }
  const ErrorStateLayout& layout = filter().layout();
  const double scale = filter().state().scale;
  const double over = std::max(options_.reject_time_s, to_seconds(result.time_ns - watch.since_ns));
  const Eigen::Index most = std::min<Eigen::Index>(3, result.residual.size());
  double off = result.residual.head(most).norm();
  if (result.source != FusionSource::kGps) off /= std::max(std::abs(scale), 1e-3);
  Eigen::VectorXd variances = Eigen::VectorXd::Zero(layout.size);
  variances.segment<3>(kTheta).setConstant(square(kAttitudeDoubt));
  variances.segment<3>(kVelocity).setConstant(square(off / over));
  if (result.source != FusionSource::kRelativeOdometry) variances.segment<3>(kPosition).setConstant(square(off));
  if (result.source != FusionSource::kGps && layout.scale >= 0) variances[layout.scale] = square(kScaleDoubt * scale);
  bank_.widen(variances);
  if (result.source == FusionSource::kOdometry && watch.widened > 0) odometry_left_world_ = true;
  ++watch.widened;
  watch.rejected = 0;
  watch.since_ns = kNoTime;
  ++counts_["widened"];
}

}  // namespace loc
