#include "libloc/estimators/inertial_slam.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr int kSetBackAfter = 20;          // samples in a row on an earlier time line
constexpr std::size_t kMostWaiting = 256;  // frames without an IMU sample after them
constexpr int kTryEvery = 5;               // frames from one try of a start in motion to the next
constexpr double kShortestWait = 0.25;     // for the next one, when it was hopeless [s]
constexpr double kVibrationTime = 0.1;     // over which shaking is averaged [s]
constexpr double kLongestHold = 0.5;       // of samples for frames [s]
constexpr double kFarthestAhead = 10;      // of the IMU: a frame is on another clock [s]
constexpr double kLeastDepthPart = 0.02;   // deviation of a depth that a start found, at least
constexpr double kFarthestWay = 100;       // deviation of a place after a gap [m]
constexpr double kAnyHeading = 1.8;        // deviation of any angle in a turn [rad]
constexpr double kRecoverAngle = 0.02;     // what is unknown after a contradiction [rad]
constexpr double kRecoverPosition = 0.1;   // [m]
constexpr double kRecoverVelocity = 0.5;   // [m/s]
constexpr int kFewestRejected = 5;         // that contradict a state

double square(double x) {
  return x * x;
}

// On the line between two samples.
ImuMeasurement between(const ImuMeasurement& a, const ImuMeasurement& b, TimeNs time_ns) {
  const double part = to_seconds(time_ns - a.time_ns) / to_seconds(b.time_ns - a.time_ns);
  ImuMeasurement out = b;
  out.time_ns = time_ns;
  out.angular_velocity = (1 - part) * a.angular_velocity + part * b.angular_velocity;
  out.specific_force = (1 - part) * a.specific_force + part * b.specific_force;
  return out;
}

// The world turns under the body by that angle about its vertical.
void turn_about_up(double angle, SlamState& state, Eigen::MatrixXd& covariance) {
  const Eigen::Quaterniond about_up(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()));
  state.q_world_body = (about_up * state.q_world_body).normalized();
  state.velocity = about_up * state.velocity;
  const Eigen::Matrix3d turned = about_up.toRotationMatrix();
  covariance.middleRows<3>(kVelocity) = (turned * covariance.middleRows<3>(kVelocity)).eval();
  covariance.middleCols<3>(kVelocity) = (covariance.middleCols<3>(kVelocity) * turned.transpose()).eval();
}

SlamStartOptions moving_start_options(const SlamOptions& options) {
  SlamStartOptions out = options.moving_start;
  out.sigma_px = options.sigma_px;
  out.sampling = options.imu_sampling;
  return out;
}

}  // namespace

InertialSlam::InertialSlam(const SlamOptions& options)
    : filter_(options),
      start_(options.start, options.stand_still, options.imu_noise, options.gravity),
      moving_start_(moving_start_options(options), options.camera, options.imu_noise, options.gravity),
      rest_(options.stand_still, options.imu_noise, options.gravity),
      picture_rest_(options.camera.intrinsics_px.tail<2>(), options.still_picture_px, options.still_picture_s),
      stamps_(options.camera) {
  require(options.motion == SlamMotion::kInertial, "motion: InertialSlam needs an IMU, MonoSlam does without");
}

void InertialSlam::skip(const char* count, std::uint32_t status) {
  ++counts_[count];
  next_status_ |= status;
}

void InertialSlam::reset() {
  filter_.stop();
  forget();
}

// All but the filter, the options and the counts.
void InertialSlam::forget() {
  rest_.reset();
  forget_early();
  while (!waiting_.empty()) waiting_.drop_front();
  while (!held_.empty()) held_.drop_front();
  leap_.reset();
  newest_ns_ = kNoTime;
  frames_set_back_ = 0;
  vibration_ = Vibration{};
  sample_ns_ = 0;
  frame_status_ = status_ = next_status_ = 0;
  frame_count_ = 0;
  carried_.reset();
  early_frames_ = rejected_in_a_row_ = 0;
  last_ = Stamp{};
  last_good_frame_ns_ = last_frame_ns_ = rest_used_ns_ = kNoTime;
  restored_ = false;
  set_back_in_a_row_ = 0;
}

// What was gathered for a start, and what is known of rest.
void InertialSlam::forget_early() {
  start_.reset();
  moving_start_.reset();
  early_.clear();
  picture_rest_.reset();
  at_rest_ = false;
  try_wait_s_ = 0;
  try_after_ns_ = kNoTime;
}

void InertialSlam::restore(const SlamSnapshot& snapshot) {
  filter_.restore(snapshot);
  forget();
  restored_ = true;
}

bool InertialSlam::process(const Measurement& measurement) {
  frame_count_ = 0;
  if (const auto* imu = std::get_if<ImuMeasurement>(&measurement)) return receive(*imu);
  if (const auto* frame = std::get_if<FeaturesMeasurement>(&measurement)) {
    if (frame->camera == options().camera_index) process_frame(*frame);
  }
  return false;
}

// Streams come in the order of their stamps. A camera whose clock is ahead (negative time offset) has its frames come
// when the IMU is past them: samples are held back for so long.
TimeNs InertialSlam::hold_back_ns() const {
  const SlamLayout& layout = filter_.layout();
  double offset = options().camera.time_offset_s;
  double sigma = layout.time_offset >= 0 ? options().sigma_time_offset : 0;
  if (filter_.started() && layout.time_offset >= 0) {
    offset = filter_.state().time_offset_s;
    sigma = std::sqrt(std::max(0.0, filter_.covariance()(layout.time_offset, layout.time_offset)));
  }
  return from_seconds(std::clamp(-offset + 3 * sigma, 0.0, kLongestHold));
}

bool InertialSlam::receive(const ImuMeasurement& imu) {
  if (!usable(imu)) return false;
  // One sample far ahead is an error of the stamp, two are a pause.
  const std::optional<ImuMeasurement> leap = std::exchange(leap_, std::nullopt);
  const double bridge = options().max_imu_bridge_s;
  const bool ahead = newest_ns_ != kNoTime && to_seconds(imu.time_ns - newest_ns_) > bridge;
  if (ahead && leap && imu.time_ns > leap->time_ns && to_seconds(imu.time_ns - leap->time_ns) <= bridge) {
    const bool first = hold_back(*leap);
    return hold_back(imu) || first;
  }
  if (leap) skip("imu.skipped.alone_after_gap", kOutOfRange);
  if (!ahead) return hold_back(imu);
  leap_ = imu;
  return false;
}

bool InertialSlam::hold_back(const ImuMeasurement& imu) {
  newest_ns_ = imu.time_ns;
  stamps_.see(imu);
  const TimeNs hold = hold_back_ns();
  if (hold == 0 && held_.empty()) return process_imu(imu);
  held_.push_back(imu);
  bool any = false;
  while (!held_.empty() && held_.front().time_ns + hold <= imu.time_ns) any = process_imu(held_.pop_front()) || any;
  return any;
}

TimeNs InertialSlam::on_imu_clock(TimeNs camera_time_ns) const {
  const double offset = filter_.started() ? filter_.state().time_offset_s : options().camera.time_offset_s;
  return camera_time_ns + from_seconds(offset);
}

void InertialSlam::process_frame(const FeaturesMeasurement& frame) {
  if (!SlamFilter::is_usable(frame.time_ns) ||
      (newest_ns_ != kNoTime && to_seconds(frame.time_ns - newest_ns_) > kFarthestAhead)) {
    skip("features.skipped.out_of_range", kOutOfRange);
    return;
  }
  if (last_frame_ns_ != kNoTime && frame.time_ns <= last_frame_ns_) {
    skip("features.skipped.time_not_increasing", kTimeNotIncreasing);
    if (++frames_set_back_ < kSetBackAfter) return;
    while (!waiting_.empty()) waiting_.drop_front();
  }
  frames_set_back_ = 0;
  if (waiting_.size() == kMostWaiting) {
    waiting_.drop_front();
    skip("features.skipped.without_imu", 0);
  }
  last_frame_ns_ = frame.time_ns;
  stamps_.see(frame);
  waiting_.push_slot() = frame;
  if (filter_.started()) return;
  ++early_frames_;
  moving_start_.push(frame);
}

bool InertialSlam::usable(const ImuMeasurement& imu) {
  if (!SlamFilter::is_usable(imu.time_ns)) {
    skip("imu.skipped.out_of_range", kOutOfRange);
    return false;
  }
  if (!imu.angular_velocity.allFinite() || !imu.specific_force.allFinite()) {
    skip("imu.skipped.not_finite", kNotFinite);
    return false;
  }
  if (imu.angular_velocity.norm() > options().max_angular_velocity ||
      imu.specific_force.norm() > options().max_specific_force) {
    skip("imu.skipped.out_of_range", kOutOfRange);
    return false;
  }
  if (imu.time_ns > newest_ns_) {  // kNoTime is before every time
    set_back_in_a_row_ = 0;
    return true;
  }
  if (++set_back_in_a_row_ < kSetBackAfter) {
    skip("imu.skipped.time_not_increasing", kTimeNotIncreasing);
    return false;
  }
  reset();
  skip("imu.clock_set_back", kReinitialised);
  return true;
}

bool InertialSlam::process_imu(const ImuMeasurement& imu) {
  last_ = imu;
  status_ = next_status_;
  next_status_ = 0;
  if (restored_) {
    // The state is from another time; nobody knows how the body moved since.
    filter_.set_time(imu.time_ns);
    last_imu_ = imu;
    const double gap = options().max_imu_bridge_s;
    const double acceleration = options().gap_acceleration_sigma;
    widen(options().gap_angular_velocity_sigma * gap, acceleration * gap * gap, acceleration * gap);
    status_ |= kGap;
    last_good_frame_ns_ = imu.time_ns;
    restored_ = false;
    return true;
  }
  if (!filter_.started()) {
    last_imu_ = imu;
    const bool found = look_for_start();
    if (!found) next_status_ |= status_;
    return found;
  }
  run(imu);
  if (!filter_.started()) next_status_ |= status_;  // for the first estimate after it
  return filter_.started();
}

// The last sample is in last_imu_.
bool InertialSlam::look_for_start() {
  early_.push_back(last_imu_);
  moving_start_.push(last_imu_);
  if (start_.push(last_imu_)) {
    // A gyroscope at rest reads its bias, whatever that is, and an accelerometer that shakes reads gravity on the
    // whole: whether it is rest, the picture tells, to about a pixel.
    std::size_t first = 0;
    while (first < waiting_.size() && on_imu_clock(waiting_[first].time_ns) < start_.samples().front().time_ns) ++first;
    const TimeNs first_ns = first < waiting_.size() ? on_imu_clock(waiting_[first].time_ns) : kNoTime;
    if (picture_rest_.stood_still(waiting_, first, first_ns)) {
      const double pixel = options().still_picture_px / options().camera.intrinsics_px.head<2>().minCoeff();
      const FusionStartEstimate from = start_.estimate_still(pixel / options().start.duration_s);
      begin(from.time_ns, from.state, from.covariance, "starts.at_rest");
      rest_used_ns_ = last_imu_.time_ns;  // All until here is in the start already.
      replay_early();
      return true;
    }
    start_.reset();
  }
  if (early_frames_ >= kTryEvery && last_imu_.time_ns >= try_after_ns_) {
    early_frames_ = 0;
    if (start_moving()) return true;
  }
  // What is too old for either start goes.
  const double keep = std::max(options().moving_start.max_duration_s, options().start.duration_s) + 1;
  const TimeNs oldest = last_imu_.time_ns - from_seconds(keep);
  if (early_.front().time_ns < oldest - from_seconds(keep)) {
    std::erase_if(early_, [&](const ImuMeasurement& imu) { return imu.time_ns < oldest; });
  }
  while (!waiting_.empty() && on_imu_clock(waiting_.front().time_ns) < oldest) {
    waiting_.drop_front();
    skip("features.skipped.before_start", 0);
  }
  return false;
}

bool InertialSlam::start_moving() {
  const auto found = moving_start_.solve();
  if (!found) {
    const SlamStartOutcome outcome = moving_start_.outcome();
    ++counts_[std::string("starts.refused.") + slam_start_outcome_name(outcome)];
    // Tracks of which most is wrong cost all attempts that there are, a second perhaps: what follows must not wait for
    // them ever longer.
    const bool hopeless = outcome == SlamStartOutcome::kResidual || outcome == SlamStartOutcome::kNoSolution;
    if (hopeless) {
      try_wait_s_ = std::min(std::max(2 * try_wait_s_, kShortestWait), options().moving_start.max_duration_s);
    } else if (outcome != SlamStartOutcome::kFewFeatures) {
      try_wait_s_ = 0;
    }
    try_after_ns_ = last_imu_.time_ns + from_seconds(try_wait_s_);
    return false;
  }
  // The filter uses the same measurements again: the solution tells where to linearise, and little more. The
  // accelerometer's bias is its prior's, and comes from outside.
  Eigen::Matrix<double, kInertialDim, 1> factor;
  factor.setConstant(options().moving_start_factor);
  factor.segment<3>(kAccelerometerBias).setOnes();
  begin(found->time_ns, found->state, factor.asDiagonal() * found->covariance * factor.asDiagonal(), "starts.moving");
  for (const SlamStartFeature& point : found->points) {
    const double sigma =
        std::max(options().moving_start_factor * point.sigma, kLeastDepthPart * point.inverse_distance);
    filter_.expect_depth(point.id, point.inverse_distance, sigma);
  }
  replay_early();
  return true;
}

// All that came since the start, in order.
void InertialSlam::replay_early() {
  std::vector<ImuMeasurement> samples;
  samples.swap(early_);
  const TimeNs begin_ns = filter_.time_ns();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].time_ns <= begin_ns) {
      // The state is at a frame, between two samples.
      last_imu_ = samples[i];
      if (i + 1 < samples.size() && samples[i + 1].time_ns > begin_ns)
        last_imu_ = between(samples[i], samples[i + 1], begin_ns);
      continue;
    }
    run(samples[i]);
  }
  start_.reset();
  moving_start_.reset();
}

void InertialSlam::begin(TimeNs time_ns, const InertialState& from,
                         const Eigen::Matrix<double, kInertialDim, kInertialDim>& from_covariance, const char* count) {
  const SlamOptions& o = options();
  const SlamLayout& layout = filter_.layout();
  SlamState state;
  static_cast<InertialState&>(state) = from;
  state.position = o.position;
  state.T_body_camera = o.camera.T_body_camera;
  state.time_offset_s = o.camera.time_offset_s;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(layout.dim, layout.dim);
  covariance.topLeftCorner<kInertialDim, kInertialDim>() = from_covariance;
  covariance.block<3, 3>(kPosition, kPosition) = square(o.sigma_position) * Eigen::Matrix3d::Identity();
  if (layout.extrinsic_rotation >= 0) {
    covariance.diagonal().segment<3>(layout.extrinsic_rotation).setConstant(square(o.sigma_extrinsic_rotation));
    covariance.diagonal().segment<3>(layout.extrinsic_position).setConstant(square(o.sigma_extrinsic_position));
  }
  if (layout.time_offset >= 0) covariance(layout.time_offset, layout.time_offset) = square(o.sigma_time_offset);
  if (carried_) {
    carry_over(time_ns, state, covariance);
  } else if (o.q_world_body) {
    turn_about_up(so3::heading(*o.q_world_body) - so3::heading(state.q_world_body), state, covariance);
    const Eigen::Vector3d up = state.q_world_body.conjugate() * Eigen::Vector3d::UnitZ();
    covariance.block<3, 3>(kTheta, kTheta) += square(o.sigma_orientation) * up * up.transpose();
  }
  ++counts_[count];
  try_wait_s_ = 0;
  try_after_ns_ = kNoTime;
  filter_.start(time_ns, state, covariance);
  frame_status_ = 0;
  last_good_frame_ns_ = time_ns;
  carried_.reset();
  // Frames from before the start have no place in it.
  while (!waiting_.empty() && on_imu_clock(waiting_.front().time_ns) < time_ns) {
    waiting_.drop_front();
    skip("features.skipped.before_start", 0);
  }
}

// Place and heading from before the gap, as well as they are known by then.
void InertialSlam::carry_over(TimeNs time_ns, SlamState& state, Eigen::MatrixXd& covariance) const {
  const SlamState& was = carried_->state;
  const double gap = std::max(0.0, to_seconds(time_ns - carried_->time_ns));
  turn_about_up(so3::heading(was.q_world_body) - so3::heading(state.q_world_body), state, covariance);
  state.position = was.position;

  const Eigen::Vector3d up_then = was.q_world_body.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d up = state.q_world_body.conjugate() * Eigen::Vector3d::UnitZ();
  const double heading = up_then.dot(carried_->covariance.block<3, 3>(kTheta, kTheta) * up_then) +
                         square(std::min(options().gap_angular_velocity_sigma * gap, kAnyHeading));
  covariance.block<3, 3>(kTheta, kTheta) += heading * up * up.transpose();
  covariance.block<3, 3>(kPosition, kPosition) = carried_->covariance.block<3, 3>(kPosition, kPosition);
  // A bound, or the numbers would be such that nobody can calculate with them; the place is one of many by then.
  const double way =
      std::min(kFarthestWay, was.velocity.norm() * gap + 0.5 * options().gap_acceleration_sigma * gap * gap);
  covariance.diagonal().segment<3>(kPosition).array() += square(way);
}

// Of a step, from the densities, and from how much the readings shake: what happens between two samples is not seen,
// and a part of the shaking counts as white. Half of the mean square of a difference is the variance of a reading.
InertialStepNoise InertialSlam::noise_of(double dt_s) const {
  const ImuNoise& noise = options().imu_noise;
  const double part = options().vibration_part;
  const double rate = square(noise.gyroscope_noise_density) + part * vibration_.rate * dt_s;
  const double force = square(noise.accelerometer_noise_density) + part * vibration_.force * dt_s;
  return {.theta = rate * dt_s,
          .velocity = force * dt_s,
          .position = 0,
          .gyroscope_bias = square(noise.gyroscope_random_walk) * dt_s,
          .accelerometer_bias = square(noise.accelerometer_random_walk) * dt_s};
}

void InertialSlam::see_vibration(const ImuMeasurement& imu) {
  const double dt = vibration_.last.time_ns == kNoTime ? 0 : to_seconds(imu.time_ns - vibration_.last.time_ns);
  if (dt > 0 && dt < options().max_imu_step_s) {
    const double part = std::min(1.0, dt / kVibrationTime);
    sample_ns_ = imu.time_ns - vibration_.last.time_ns;
    const auto see = [&](double& mean, const Eigen::Vector3d& now, const Eigen::Vector3d& then) {
      mean += part * ((now - then).squaredNorm() / 6 - mean);
    };
    see(vibration_.rate, imu.angular_velocity, vibration_.last.angular_velocity);
    see(vibration_.force, imu.specific_force, vibration_.last.specific_force);
  }
  vibration_.last = imu;
}

// To that time on the line between the last sample and this one.
void InertialSlam::step_to(TimeNs time_ns, const ImuMeasurement& to) {
  const TimeNs from_ns = filter_.time_ns();
  if (time_ns <= from_ns) return;
  const double dt = to_seconds(time_ns - from_ns);
  const SlamState& state = filter_.state();
  ImuMeasurement end = to;
  InertialStep step{to.angular_velocity, to.specific_force, dt};
  if (options().imu_sampling == ImuSampling::kPoint) {
    end = between(last_imu_, to, time_ns);
    step.angular_velocity = 0.5 * (last_imu_.angular_velocity + end.angular_velocity);
    step.specific_force = 0.5 * (last_imu_.specific_force + end.specific_force);
  }
  end.time_ns = time_ns;
  step.angular_velocity -= state.gyroscope_bias;
  step.specific_force -= state.accelerometer_bias;
  filter_.propagate(time_ns, step, noise_of(dt));
  last_imu_ = end;
}

void InertialSlam::predict_frame(TimeNs time_ns, SlamPrediction& out) const {
  out.time_ns = time_ns;
  out.valid = out.lost = false;
  out.features.clear();
  if (!filter_.started() || restored_ || !SlamFilter::is_usable(time_ns)) return;
  const double ahead = to_seconds(on_imu_clock(time_ns) - filter_.time_ns());
  if (ahead < 0 || ahead > options().max_imu_bridge_s) return;
  const SlamState& state = filter_.state();
  const InertialStep step{last_imu_.angular_velocity - state.gyroscope_bias,
                          last_imu_.specific_force - state.accelerometer_bias, ahead};
  filter_.predict_frame(time_ns, step, noise_of(ahead), out);
}

// By deviations of each component: what happened meanwhile is not known.
void InertialSlam::widen(double angle, double position, double velocity) {
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(filter_.layout().dim);
  variance.segment<3>(kTheta).setConstant(square(angle));
  variance.segment<3>(kPosition).setConstant(square(position));
  variance.segment<3>(kVelocity).setConstant(square(velocity));
  filter_.widen(variance);
}

void InertialSlam::bridge(const ImuMeasurement& imu) {
  const double gap = to_seconds(imu.time_ns - filter_.time_ns());
  const double acceleration = options().gap_acceleration_sigma;
  widen(options().gap_angular_velocity_sigma * gap, 0.5 * acceleration * gap * gap, acceleration * gap);
  ++counts_["imu.gaps.bridged"];
  status_ |= kGap | kBridged;
}

void InertialSlam::start_anew() {
  ++counts_["imu.gaps.restarted"];
  next_status_ |= kGap | kReinitialised;
  carried_ = Carried{filter_.time_ns(), filter_.state(), filter_.head_covariance()};
  filter_.stop();
  rest_.reset();
  forget_early();
}

void InertialSlam::take_frames_until(TimeNs until_ns, const ImuMeasurement& imu) {
  while (!waiting_.empty()) {
    const TimeNs time_ns = on_imu_clock(waiting_.front().time_ns);
    if (time_ns > until_ns) break;
    std::swap(taking_, waiting_[0]);
    waiting_.drop_front();
    if (time_ns < filter_.time_ns()) {
      skip("features.skipped.late", kTooLate);
      continue;
    }
    step_to(time_ns, imu);
    take_frame(taking_);
  }
}

bool InertialSlam::finish() {
  frame_count_ = 0;
  bool any = false;
  while (!held_.empty()) any = process_imu(held_.pop_front()) || any;
  if (!filter_.started() || restored_) return any;
  // Between the last sample and where the next one would be, the IMU reads what it read last.
  const TimeNs until_ns = last_.time_ns + sample_ns_;
  ImuMeasurement same = last_imu_;
  same.time_ns = until_ns;
  take_frames_until(until_ns, same);
  if (frame_count_ > 0 && filter_.time_ns() > last_.time_ns) {
    last_.time_ns = filter_.time_ns();
    any = true;
  }
  return any;
}

void InertialSlam::run(const ImuMeasurement& imu) {
  see_vibration(imu);
  const double dt = to_seconds(imu.time_ns - filter_.time_ns());
  if (dt > options().max_imu_bridge_s) {
    start_anew();
    last_imu_ = imu;
    look_for_start();
    return;
  }
  if (dt > options().max_imu_step_s) bridge(imu);
  take_frames_until(imu.time_ns, imu);
  step_to(imu.time_ns, imu);
  last_imu_ = imu;
  ++imu_used_;
  look_for_rest(imu);
  if (!filter_.healthy()) {
    ++counts_["diverged"];
    next_status_ |= kReinitialised;
    filter_.stop();
    forget_early();
    return;
  }
  if (to_seconds(imu.time_ns - last_good_frame_ns_) > options().lost_after_s) {
    status_ |= kFewFeatures;
    filter_.lose();
  }
  if (filter_.lost()) status_ |= kLost;
}

void InertialSlam::take_frame(const FeaturesMeasurement& frame) {
  picture_rest_.see(frame, filter_.time_ns());
  const SlamFrame& done = filter_.update(frame, status_ | (at_rest_ ? kAtRest : 0U));
  ++frames_used_;
  if ((done.estimate.status & kFewFeatures) == 0) last_good_frame_ns_ = filter_.time_ns();
  frame_status_ = done.estimate.status & (kFewFeatures | kFeaturesRejected | kCalibrationDoubtful | kMapLinkUnknown);
  status_ |= done.estimate.status & kRefound;
  recover(done);
  if (frame_count_ == frames_.size()) frames_.emplace_back();
  SlamFrame& out = frames_[frame_count_++];
  out = done;
}

// Most of what is seen contradicts the state for some frames: the state is wrong, and does not know it.
void InertialSlam::recover(const SlamFrame& frame) {
  const bool contradicted = frame.counts.rejected >= kFewestRejected && frame.counts.rejected > frame.counts.measured;
  rejected_in_a_row_ = contradicted ? rejected_in_a_row_ + 1 : 0;
  if (rejected_in_a_row_ < options().recover_after) return;
  rejected_in_a_row_ = 0;
  widen(kRecoverAngle, kRecoverPosition, kRecoverVelocity);
  ++counts_["recovered"];
  next_status_ |= kRecovered;
}

void InertialSlam::look_for_rest(const ImuMeasurement& imu) {
  const double bias_sigma = std::sqrt(std::max(0.0, filter_.covariance()(kGyroscopeBias, kGyroscopeBias)));
  const bool still =
      rest_.update(imu, filter_.state().gyroscope_bias, bias_sigma) && picture_rest_.stands_still(last_.time_ns);
  if (!still) {
    at_rest_ = false;
    return;
  }
  if (!options().zero_velocity) {
    at_rest_ = true;
  } else if (rest_used_ns_ == kNoTime || imu.time_ns - rest_used_ns_ >= from_seconds(options().stand_still.window_s)) {
    rest_used_ns_ = imu.time_ns;
    const double sigma_rate = std::hypot(rest_.mean_rate_sigma(), options().zero_rate_sigma_floor);
    at_rest_ = filter_.zero_velocity(options().zero_velocity_sigma, rest_.mean_rate(), sigma_rate);
    ++counts_[at_rest_ ? "rest.used" : "rest.rejected"];
    if (!at_rest_) picture_rest_.reset();  // The filter knows that it moves; let the picture prove the contrary.
  }
  if (at_rest_) status_ |= kAtRest;
}

Estimate InertialSlam::estimate() const {
  Estimate out;
  if (!filter_.started()) {
    out.status = status_ | kInitialising;
  } else {
    out = filter_.estimate();
    out.status |= status_ | frame_status_;
  }
  if (stamps_.doubtful()) out.status |= kStampsDoubtful;
  out.time_ns = last_.time_ns;
  out.host_time_ns = last_.host_time_ns;
  out.sequence = last_.sequence;
  return out;
}

NamedCounts InertialSlam::counts() const {
  NamedCounts out = {{"imu.used", imu_used_},
                     {"features.used", frames_used_},
                     {"features.waiting", static_cast<std::int64_t>(waiting_.size())}};
  for (const auto& [name, value] : counts_) out.push_back({name, value});
  if (stamps_.doubtful()) out.push_back({"stamps.camera_to_add_ms", std::llround(1e3 * stamps_.offset_s())});
  for (NamedCount& count : filter_.counts()) out.push_back(std::move(count));
  return out;
}

}  // namespace loc
