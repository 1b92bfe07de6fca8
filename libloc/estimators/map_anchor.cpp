#include "libloc/estimators/map_anchor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr TimeNs kPoseEvery = 4'000'000;  // kept of the history
constexpr std::size_t kMostWaiting = 64;  // fixes
constexpr double kDriftEvery = 0.1;       // way for which the drift is added [m]
constexpr double kHeadingDoubt = 0.1;     // after fixes were rejected [rad]
constexpr double kScaleDoubt = 0.1;       // relative
constexpr double kNewScaleDoubt = 0.5;    // of a camera alone in new surroundings, relative
constexpr int kWidenMost = 2;             // times, then it starts anew
constexpr int kToldAfter = 3;             // rejections in a row
constexpr std::uint32_t kPoseIsGuess = kLost | kFewFeatures | kNoImages | kGap | kBridged;

// Places in the covariance of an estimate.
constexpr int kP = 3;
constexpr int kV = 6;

double square(double x) {
  return x * x;
}

bool has_pose(const Estimate& estimate) {
  constexpr std::uint32_t kPose = kValidOrientation | kValidPosition;
  return (estimate.valid & kPose) == kPose;
}

// The variance of the turn about the map's vertical.
double heading_variance(const Estimate& estimate) {
  const Eigen::Vector3d up = estimate.q_world_body.inverse() * Eigen::Vector3d::UnitZ();
  return up.dot(estimate.covariance.topLeftCorner<3, 3>() * up);
}

}  // namespace

MapAnchorOptions MapAnchorOptions::robust(bool inertial) {
  MapAnchorOptions options;
  options.make_robust();
  options.scale_known = inertial;
  if (!inertial) {
    options.tilt_sigma = 0.15;
    options.heading_walk = 0.003;
    options.tilt_walk = 0.003;
    options.scale_walk = 0.01;
    options.position_walk = 0.02;
  }
  return options;
}

void MapAnchorOptions::check() const {
  check_gps();
  require_positive("scale_sigma", scale_sigma);
  require_not_negative("tilt_sigma", tilt_sigma);
  if (origin) origin->check();
  require_not_negative("position_walk", position_walk);
  require_not_negative("heading_walk", heading_walk);
  require_not_negative("tilt_walk", tilt_walk);
  require_not_negative("scale_walk", scale_walk);
  require_positive("start_heading_sigma", start_heading_sigma);
  require_positive("start_scale_sigma", start_scale_sigma);
  require(start_fixes >= 3, "start_fixes", static_cast<double>(start_fixes), "must be 3 or more");
  require(gate_probability > 0 && gate_probability < 1, "gate_probability", gate_probability,
          "must be between 0 and 1");
  require(reject_count > 0, "reject_count", reject_count, "must be positive");
  require_positive("reject_time_s", reject_time_s);
  require_positive("history_s", history_s);
  require_positive("gps_max_ahead_s", gps_max_ahead_s);
  require_positive("outage_s", outage_s);
}

MapAnchor::MapAnchor(const MapAnchorOptions& options)
    : options_((options.check(), options)),
      gate_2_(chi_square_quantile(options.gate_probability, 2)),
      gate_3_(chi_square_quantile(options.gate_probability, 3)),
      covariance_(Eigen::MatrixXd::Zero(kAnchorDim, kAnchorDim)),
      lag_({.drift_order = 1, .scale_known = options.scale_known}),
      correction_(Eigen::VectorXd::Zero(kAnchorDim)) {
  if (options.origin) world_.emplace(*options.origin);
}

void MapAnchor::reset() {
  forget_map();
  if (!options_.origin) world_.reset();
  while (!waiting_.empty()) waiting_.drop_front();
  before_ns_ = newest_gps_ns_ = last_good_ns_ = kNoTime;
  lag_.reset();
  status_ = 0;
}

void MapAnchor::forget_map() {
  ++map_number_;
  anchored_ = searching_ = false;
  begun_ns_ = kNoTime;
  tried_at_way_ = -1;
  heading_hint_.reset();
  last_ = Pose{};
  way_ = 0;
  while (!history_.empty()) history_.drop_front();
  pairs_.clear();
  lag_.break_off();
  rejected_in_a_row_ = widened_ = 0;
  rejected_since_ns_ = kNoTime;
  lost_ = false;
  linked_ = true;
  before_.reset();
  good_position_variance_ = good_heading_variance_ = kUnknown;
  grown_position_ = grown_heading_ = 0;
}

void MapAnchor::hint_heading(double heading, double sigma) {
  heading_hint_ = heading;
  heading_hint_sigma_ = sigma;
}

std::uint32_t MapAnchor::take_status() {
  std::uint32_t status = std::exchange(status_, 0U);
  if (!has_gps()) return status;
  const bool outage = last_good_ns_ == kNoTime || last_.time_ns == kNoTime ||
                      to_seconds(last_.time_ns - last_good_ns_) > options_.outage_s;
  if (!anchored_ || outage) status |= kNoGps;
  if (lag_.doubtful()) status |= kGpsStampsDoubtful;
  return status;
}

void MapAnchor::move(const Estimate& in_map) {
  if (!has_pose(in_map)) return;
  const bool set_back = last_.time_ns != kNoTime && in_map.time_ns < last_.time_ns;
  // A camera alone that starts anew has a unit of its own each time; with an IMU the map begins elsewhere, unless it
  // was carried over a gap.
  const bool started = last_.time_ns != kNoTime && (in_map.status & kReinitialised) != 0;
  if (set_back || (started && (!options_.scale_known || (in_map.status & kGap) == 0))) {
    forget_map();
    if (set_back) before_ns_ = newest_gps_ns_ = last_good_ns_ = kNoTime;
    ++counts_["anchor.map_began_anew"];
  }
  if (last_.time_ns == kNoTime) forget_foreign_fixes(in_map.time_ns);
  const bool guess = (in_map.status & kPoseIsGuess) != 0;
  const bool linked = (in_map.status & kMapLinkUnknown) == 0;
  const bool was_linked = std::exchange(linked_, linked);
  const bool linked_again = linked && !was_linked;
  const bool found = std::exchange(lost_, guess) && !guess && before_;
  if (guess || found || linked_again) lag_.break_off();
  carry(in_map, (found && linked) || linked_again);
  if (found && linked && before_->linked) {
    find_back();
  } else if (found || linked_again) {
    ++counts_[linked ? "anchor.linked_again" : "anchor.went_on_elsewhere"];
    change_surroundings();
  }
  see_doubt(in_map);
  const bool keep = history_.empty() || last_.time_ns - history_.back().time_ns >= kPoseEvery;
  if (keep) history_.push_back(last_);
  while (to_seconds(last_.time_ns - history_.front().time_ns) > options_.history_s) history_.drop_front();
  take_waiting();
}

// Fixes that came before the first pose may be of another clock.
void MapAnchor::forget_foreign_fixes(TimeNs time_ns) {
  before_ns_ = kNoTime;
  for (std::size_t n = waiting_.size(); n > 0; --n) {
    const GpsPosition fix = waiting_.pop_front();
    TimeNs ahead = 0;
    if (__builtin_sub_overflow(fix.time_ns, time_ns, &ahead) || to_seconds(ahead) > options_.gps_max_ahead_s) {
      ++counts_["gps.skipped.ahead"];
      continue;
    }
    before_ns_ = std::max(before_ns_, fix.time_ns);
    waiting_.push_back(fix);
  }
}

// The state follows the way gone in the map. @param found the map has set the pose right: that is no way, the body went
// on as it did
void MapAnchor::carry(const Estimate& in_map, bool found) {
  const Pose before = last_;
  last_.time_ns = in_map.time_ns;
  last_.position = in_map.position;
  last_.rotation = in_map.q_world_body;
  last_.velocity = (in_map.valid & kValidVelocity) != 0 ? in_map.velocity : Eigen::Vector3d::Zero();
  last_.angular_velocity = in_map.angular_velocity.allFinite() ? in_map.angular_velocity : Eigen::Vector3d::Zero();
  last_.velocity_cov.setZero();
  if ((in_map.valid & kValidCovariance) != 0 && in_map.covariance_dim >= kV + 3) {
    last_.velocity_cov = in_map.covariance.block<3, 3>(kV, kV);
  }
  if (before.time_ns == kNoTime) {
    first_ns_ = in_map.time_ns;
    drifted_at_ = in_map.position;
    return;
  }
  if (anchored_) {
    const double dt = to_seconds(last_.time_ns - before.time_ns);
    const Eigen::Vector3d gone = last_.position - before.position;
    go(found ? Eigen::Vector3d(dt * last_.velocity) : gone, x_, covariance_);
  }
  // The jitter of a body that stands is no way.
  const double unit = anchored_ ? x_.scale : 1;
  const double gone = (last_.position - drifted_at_).norm();
  if (gone * unit >= kDriftEvery) {
    way_ += gone;
    drifted_at_ = last_.position;
    if (anchored_) drift(gone * unit);
  }
  last_.way = way_;
}

// P = F P F^T, where F is the identity but for what an error of turn and scale does to the place.
void MapAnchor::go(const Eigen::Vector3d& in_map, AnchorState& state, Eigen::MatrixXd& covariance) {
  const Eigen::Vector3d way = state.scale * (state.q_world_map * in_map);
  const Eigen::Matrix3d turned = -so3::hat(way);
  state.position += way;
  const Eigen::Matrix<double, 3, kAnchorDim> rows =
      turned * covariance.middleRows<3>(kAnchorTurn) + way * covariance.row(kAnchorScale);
  covariance.middleRows<3>(kAnchorPosition) += rows;
  const Eigen::Matrix<double, kAnchorDim, 3> columns =
      covariance.middleCols<3>(kAnchorTurn) * turned.transpose() + covariance.col(kAnchorScale) * way.transpose();
  covariance.middleCols<3>(kAnchorPosition) += columns;
}

void MapAnchor::drift(double way) {
  auto variances = covariance_.diagonal();
  variances.segment<3>(kAnchorPosition).array() += square(options_.position_walk) * way;
  variances.segment<2>(kAnchorTurn).array() += square(options_.tilt_walk) * way;
  variances[kAnchorTurn + 2] += square(options_.heading_walk) * way;
  variances[kAnchorScale] += square(options_.scale_walk) * way;
}

// While the camera does not know where it is, the pose's own covariance says by how much it is worse; after a new start
// as well.
void MapAnchor::see_doubt(const Estimate& in_map) {
  if (lost_ && !before_) {
    before_ = Before{x_, covariance_, last_.position, accepted_, linked_};
  }
  if ((in_map.valid & kValidCovariance) == 0) return;
  const double position = in_map.covariance.block<3, 3>(kP, kP).trace() / 3 * square(x_.scale);
  const double heading = heading_variance(in_map);
  const bool started = (in_map.status & kReinitialised) != 0;
  if ((lost_ || started) && anchored_ && std::isfinite(good_position_variance_)) {
    const double more = std::max(0.0, position - good_position_variance_ - grown_position_);
    const double more_heading = std::max(0.0, heading - good_heading_variance_ - grown_heading_);
    covariance_.diagonal().segment<3>(kAnchorPosition).array() += more;
    covariance_(kAnchorTurn + 2, kAnchorTurn + 2) += more_heading;
    grown_position_ += more;
    grown_heading_ += more_heading;
  }
  if (started) before_.reset();  // Its map is another one.
  if (!lost_ || started) {
    good_position_variance_ = position;
    good_heading_variance_ = heading;
    grown_position_ = grown_heading_ = 0;
  }
}

// Back in its map the body is where the map says, unless fixes have told better in the meantime.
void MapAnchor::find_back() {
  const Before before = *std::exchange(before_, std::nullopt);
  while (!history_.empty()) history_.drop_front();  // places in the map that were wrong
  if (!anchored_) return;
  AnchorState by_map = before.state;
  Eigen::MatrixXd covariance = before.covariance;
  const Eigen::Vector3d way = last_.position - before.in_map;
  go(way, by_map, covariance);
  const auto doubt = [](const Eigen::MatrixXd& cov) { return cov.topLeftCorner<3, 3>().trace(); };
  if (accepted_ > before.fixes && doubt(covariance) > doubt(covariance_)) {
    ++counts_["anchor.kept_after_lost"];
    return;
  }
  x_ = by_map;
  covariance_ = covariance;
  drift(by_map.scale * way.norm());
}

// It goes on in surroundings that are new to the map, or is back in those that it had left: the place in the world is
// that of the guess, what was seen so far is in other axes, and the unit of a camera alone is another one.
void MapAnchor::change_surroundings() {
  before_.reset();
  while (!history_.empty()) history_.drop_front();
  pairs_.clear();
  tried_at_way_ = -1;
  if (!anchored_ || options_.scale_known) return;
  double& variance = covariance_(kAnchorScale, kAnchorScale);
  variance = std::max(variance, square(kNewScaleDoubt));
}

bool MapAnchor::refused(GpsRefusal refusal) {
  if (refusal == GpsRefusal::kNone) return false;
  const GpsRefusalNote note = note_of(refusal);
  ++counts_[note.count];
  status_ |= note.status;
  return true;
}

void MapAnchor::fuse(const GpsMeasurement& gps) {
  GeodeticPoint place;
  if (gps.time_ns != kNoTime) newest_gps_ns_ = std::max(newest_gps_ns_, gps.time_ns);
  if (refused(gps_place(gps, place))) return;
  TimeNs ahead = 0;
  const bool timed = gps.time_ns != kNoTime &&
                     (last_.time_ns == kNoTime || !__builtin_sub_overflow(gps.time_ns, last_.time_ns, &ahead));
  if (!timed || to_seconds(ahead) > options_.gps_max_ahead_s) {
    ++counts_["gps.skipped.ahead"];
    status_ |= kOutOfRange;
    return;
  }
  const LocalFrame world = world_ ? *world_ : LocalFrame(place);
  GpsPosition fix;
  if (refused(gps_in_world(gps, options_, world, before_ns_, fix))) return;
  if (!world_) world_ = world;
  if (!options_.use_gps_velocity) fix.velocity.setConstant(kUnknown);
  if (fix.velocity.allFinite() && !is_usable_covariance(fix.velocity_cov)) {
    fix.velocity.setConstant(kUnknown);
    ++counts_["gps_velocity.bad_covariance"];
    status_ |= kBadCovariance;
  }
  before_ns_ = std::max(before_ns_, gps.time_ns);
  if (waiting_.size() == kMostWaiting) {
    waiting_.drop_front();
    ++counts_["gps.skipped.without_pose"];
  }
  std::size_t at = waiting_.size();
  while (at > 0 && waiting_[at - 1].time_ns > fix.time_ns) --at;
  waiting_.insert(at, fix);
  take_waiting();
}

void MapAnchor::take_waiting() {
  while (!waiting_.empty() && last_.time_ns != kNoTime && waiting_.front().time_ns <= last_.time_ns) {
    const GpsPosition fix = waiting_.pop_front();
    const std::optional<Pose> pose = pose_at(fix.time_ns);
    if (pose) {
      take(fix, *pose);
    } else if (fix.time_ns < first_ns_) {
      ++counts_["gps.skipped.without_pose"];
    } else {
      ++counts_["gps.too_late"];
      status_ |= kTooLate;
    }
  }
}

std::optional<MapAnchor::Pose> MapAnchor::pose_at(TimeNs time_ns) const {
  if (history_.empty() || time_ns < history_.front().time_ns) return std::nullopt;
  std::size_t low = 0;
  std::size_t high = history_.size();  // the first one after the time
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (history_[middle].time_ns <= time_ns) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  const Pose& a = history_[low - 1];
  const Pose& b = low < history_.size() ? history_[low] : last_;
  if (b.time_ns <= a.time_ns) return a;
  const double part = to_seconds(time_ns - a.time_ns) / to_seconds(b.time_ns - a.time_ns);
  Pose out = a;
  out.time_ns = time_ns;
  out.position += part * (b.position - a.position);
  out.velocity += part * (b.velocity - a.velocity);
  out.angular_velocity += part * (b.angular_velocity - a.angular_velocity);
  out.rotation = a.rotation.slerp(part, b.rotation);
  return out;
}

void MapAnchor::take(const GpsPosition& received, const Pose& pose) {
  GpsPosition fix = received;
  const Eigen::Vector3d lever = pose.rotation * options_.gps_antenna;
  const Eigen::Vector3d lever_velocity = pose.rotation * pose.angular_velocity.cross(options_.gps_antenna);
  const Eigen::Vector3d velocity = to_world(pose.velocity);
  const Eigen::Vector3d way = options_.gps_time_sigma * velocity;
  if (fix.velocity.allFinite() && (anchored_ || options_.scale_known)) {
    // A camera alone knows its velocity less well than the receiver does. (Without a heading: as much of it as there is
    // in any direction.)
    const Eigen::Matrix3d turn = x_.scale * x_.q_world_map.toRotationMatrix();
    if (anchored_) {
      fix.velocity_cov += turn * pose.velocity_cov * turn.transpose();
    } else {
      fix.velocity_cov += pose.velocity_cov.trace() * Eigen::Matrix3d::Identity();
    }
  }
  if (anchored_) {
    fix.position_cov += way * way.transpose();
  } else if (options_.scale_known) {
    fix.position_cov += way.squaredNorm() * Eigen::Matrix3d::Identity();
  }
  if (!lost_) {
    if (pairs_.size() == options_.start_fixes) {
      // Half as dense: what is left goes back as far.
      std::size_t kept = 0;
      for (std::size_t i = 0; i < pairs_.size(); i += 2) pairs_[kept++] = pairs_[i];
      pairs_.resize(kept);
    }
    pairs_.push_back({fix, pose.position, pose.velocity, lever, lever_velocity, pose.way});
  }
  if (!anchored_ || searching_) look_for_start();
  if (!anchored_ || begun_ns_ == fix.time_ns) return;
  if (!lost_) see_lag(fix, pose);
  const Eigen::Vector3d lag = to_world(last_.position - pose.position);
  const Eigen::Vector3d arm = x_.q_world_map * lever;
  const Eigen::Vector3d residual = fix.position - (x_.position - lag + arm);
  Jacobian J;
  J << Eigen::Matrix3d::Identity(), -so3::hat(arm - lag), -lag;
  if (update(residual, J, fix.position_cov, fix.has_height ? 3 : 2)) {
    rejected_in_a_row_ = widened_ = 0;
    rejected_since_ns_ = kNoTime;
    searching_ = false;
    last_good_ns_ = std::max(last_good_ns_, fix.time_ns);
    ++accepted_;
    ++counts_["gps.accepted"];
  } else {
    ++counts_["gps.rejected"];
    doubt(fix.time_ns, residual);
  }
  if (!fix.velocity.allFinite()) return;
  const Eigen::Vector3d by_turning = x_.q_world_map * lever_velocity;
  const Eigen::Vector3d of_body = to_world(pose.velocity);
  J << Eigen::Matrix3d::Zero(), -so3::hat(of_body + by_turning), of_body;
  const bool good = update(fix.velocity - of_body - by_turning, J, fix.velocity_cov, 3);
  ++counts_[good ? "gps_velocity.accepted" : "gps_velocity.rejected"];
}

// The way in the map by a transform that fixes do not change while a window lasts.
void MapAnchor::see_lag(const GpsPosition& fix, const Pose& pose) {
  const Eigen::Matrix3d turn = x_.q_world_map.toRotationMatrix();
  if (lag_.begins()) {
    lag_to_world_ = x_.scale * turn;
    lag_from_ = pose.position;
  }
  const Eigen::Vector3d way =
      lag_to_world_ * (pose.position - lag_from_) + turn * (pose.rotation * options_.gps_antenna);
  const Eigen::Vector3d velocity = lag_to_world_ * pose.velocity;
  lag_.see(fix.time_ns, fix.position.head<2>(), way.head<2>(), velocity.head<2>());
}

bool MapAnchor::update(const Eigen::Vector3d& residual, const Jacobian& J, const Eigen::Matrix3d& cov, int rows) {
  observation_.begin(rows);
  for (int row = 0; row < rows; ++row) {
    observation_.residual[row] = residual[row];
    for (int column = 0; column < kAnchorDim; ++column) observation_.add(row, column, J(row, column));
  }
  observation_.noise_cov.topLeftCorner(rows, rows) = cov.topLeftCorner(rows, rows);
  if (!innovate(covariance_, observation_, innovation_)) return false;
  if (!(innovation_.nis <= (rows == 3 ? gate_3_ : gate_2_))) return false;
  joseph_update(covariance_, observation_, innovation_, correction_);
  x_.position += correction_.segment<3>(kAnchorPosition);
  x_.q_world_map = (so3::exp(correction_.segment<3>(kAnchorTurn)) * x_.q_world_map).normalized();
  x_.scale *= std::exp(correction_[kAnchorScale]);
  return true;
}

// What is rejected for long is believed again; the residual says by how much the state may be off.
void MapAnchor::doubt(TimeNs time_ns, const Eigen::Vector3d& residual) {
  if (rejected_in_a_row_++ == 0) rejected_since_ns_ = time_ns;
  if (rejected_in_a_row_ >= kToldAfter) status_ |= kGpsRejected;
  if (rejected_in_a_row_ < options_.reject_count) return;
  if (to_seconds(time_ns - rejected_since_ns_) < options_.reject_time_s) return;
  status_ |= kRecovered;
  ++counts_["anchor.widened"];
  if (++widened_ > kWidenMost) {
    // It did not help: the heading may be anything.
    const TimeNs since = rejected_since_ns_;
    std::erase_if(pairs_, [&](const AnchorPair& pair) { return pair.fix.time_ns < since; });
    searching_ = true;
    heading_hint_.reset();
    widened_ = 0;
  }
  covariance_.diagonal().segment<3>(kAnchorPosition).array() += residual.squaredNorm();
  covariance_(kAnchorTurn + 2, kAnchorTurn + 2) += square(kHeadingDoubt);
  if (!options_.scale_known) covariance_(kAnchorScale, kAnchorScale) += square(kScaleDoubt);
  rejected_in_a_row_ = 0;
}

void MapAnchor::look_for_start() {
  const bool hinted = heading_hint_ && options_.scale_known;
  if (!hinted && way_ == tried_at_way_) return;
  tried_at_way_ = way_;
  AnchorPrior prior;
  prior.scale_known = options_.scale_known;
  prior.scale_sigma = options_.scale_sigma;
  prior.tilt_sigma = options_.tilt_sigma;
  prior.position_walk = options_.position_walk;
  if (hinted) {
    prior.heading = heading_hint_;
    prior.heading_sigma = heading_hint_sigma_;
  }
  const auto found = find_anchor(pairs_, prior, last_.position, way_);
  if (!found) return;
  const double heading_sigma = std::sqrt(found->covariance(kAnchorTurn + 2, kAnchorTurn + 2));
  const double scale_sigma = std::sqrt(found->covariance(kAnchorScale, kAnchorScale));
  const double enough =
      hinted ? std::max(options_.start_heading_sigma, heading_hint_sigma_) : options_.start_heading_sigma;
  if (heading_sigma > enough || scale_sigma > options_.start_scale_sigma) return;
  x_ = found->state;
  covariance_ = found->covariance;
  anchored_ = true;
  searching_ = false;
  begun_ns_ = last_good_ns_ = pairs_.back().fix.time_ns;
  rejected_in_a_row_ = widened_ = 0;
  rejected_since_ns_ = kNoTime;
  ++accepted_;
  status_ |= kReinitialised;
  ++counts_["anchor.started"];
}

Estimate MapAnchor::in_world(const Estimate& in_map) const {
  if (!anchored_ || !has_pose(in_map)) return in_map;
  using Matrix15 = Eigen::Matrix<double, kMaxEstimateDim, kMaxEstimateDim>;
  Estimate out = in_map;
  const Eigen::Vector3d way = to_world(in_map.position - last_.position);
  out.position = x_.position + way;
  out.q_world_body = (x_.q_world_map * in_map.q_world_body).normalized();
  out.velocity = to_world(in_map.velocity);
  out.origin = world_->origin();
  out.valid |= kValidHeading;
  if (!options_.scale_known) {
    out.status &= ~static_cast<std::uint32_t>(kScaleUnknown);
    out.valid |= kValidScale;
    out.scale = 1 / x_.scale;
    out.scale_sigma = std::sqrt(covariance_(kAnchorScale, kAnchorScale)) / x_.scale;
  }
  if ((in_map.valid & kValidCovariance) == 0) return out;
  const int n = in_map.covariance_dim;
  Matrix15 cov = Matrix15::Zero();
  cov.topLeftCorner(n, n) = in_map.covariance.topLeftCorner(n, n);
  // Heading and place of the pose in the map are the anchor's business.
  const Eigen::Vector3d up = in_map.q_world_body.inverse() * Eigen::Vector3d::UnitZ();
  Matrix15 of_map = Matrix15::Identity();
  of_map.topLeftCorner<3, 3>() -= up * up.transpose();
  of_map.block<3, 3>(kP, kP).setZero();
  of_map.block<3, 3>(kV, kV) = x_.scale * x_.q_world_map.toRotationMatrix();
  Eigen::Matrix<double, kMaxEstimateDim, kAnchorDim> of_anchor;
  of_anchor.setZero();
  of_anchor.block<3, 3>(0, kAnchorTurn) = out.q_world_body.inverse().toRotationMatrix();
  of_anchor.block<3, kAnchorDim>(kP, 0) = place_jacobian(way);
  of_anchor.block<3, 3>(kV, kAnchorTurn) = -so3::hat(out.velocity);
  of_anchor.block<3, 1>(kV, kAnchorScale) = out.velocity;
  cov = (of_map * cov * of_map.transpose() + of_anchor * covariance_ * of_anchor.transpose()).eval();
  out.covariance.topLeftCorner(n, n) = cov.topLeftCorner(n, n);
  return out;
}

MapAnchor::Jacobian MapAnchor::place_jacobian(const Eigen::Vector3d& way) {
  Jacobian J;
  J << Eigen::Matrix3d::Identity(), -so3::hat(way), way;
  return J;
}

void MapAnchor::put_in_world(SlamFrame& frame) const {
  if (!anchored_ || std::isfinite(frame.estimate.origin.latitude)) return;  // it is there already
  frame.estimate = in_world(frame.estimate);
  frame.camera_position = x_.position + to_world(frame.camera_position - last_.position);
  frame.q_world_camera = (x_.q_world_map * frame.q_world_camera).normalized();
  for (SlamFeature& feature : frame.features) {
    feature.inverse_depth /= x_.scale;
    feature.sigma_inverse_depth /= x_.scale;
  }
}

void MapAnchor::put_in_world(SlamMapPoint& point) const {
  if (!anchored_) return;
  const Eigen::Matrix3d turn = x_.scale * x_.q_world_map.toRotationMatrix();
  const auto moved = [&](const Eigen::Vector3d& in_map, Eigen::Matrix3d& cov) {
    const Eigen::Vector3d way = to_world(in_map - last_.position);
    const Jacobian J = place_jacobian(way);
    cov = (turn * cov * turn.transpose() + J * covariance_ * J.transpose()).eval();
    return Eigen::Vector3d(x_.position + way);
  };
  point.position = moved(point.position, point.position_cov);
  if (point.converted) return;
  InverseDepthPoint& ray = point.inverse_depth;
  Eigen::Matrix<double, kInverseDepthDim, kInverseDepthDim> of_map;
  of_map.setIdentity();
  of_map.topLeftCorner<3, 3>() = turn;
  of_map(kInverseDepth, kInverseDepth) = 1 / x_.scale;
  const Eigen::Vector3d way = to_world(ray.anchor - last_.position);
  ray.anchor = x_.position + way;
  ray.frame = (x_.q_world_map * ray.frame).normalized();
  ray.inverse_depth /= x_.scale;
  Eigen::Matrix<double, kInverseDepthDim, kAnchorDim> of_anchor;
  of_anchor.setZero();
  of_anchor.topRows<3>() = place_jacobian(way);
  of_anchor.block<2, 3>(kRay, kAnchorTurn) = -ray.ray_basis().transpose() * so3::hat(ray.ray());
  of_anchor(kInverseDepth, kAnchorScale) = -ray.inverse_depth;
  point.inverse_depth_cov =
      (of_map * point.inverse_depth_cov * of_map.transpose() + of_anchor * covariance_ * of_anchor.transpose()).eval();
}

NamedCounts MapAnchor::counts() const {
  NamedCounts out;
  for (const auto& [name, value] : counts_) out.push_back({name, value});
  if (lag_.doubtful()) out.push_back({"stamps.gps_to_add_ms", std::llround(1e3 * lag_.offset_s())});
  return out;
}

}  // namespace loc
