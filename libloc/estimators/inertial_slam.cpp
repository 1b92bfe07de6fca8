#include "libloc/estimators/inertial_slam.hpp"

#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr int kSetBackAfter = 20;           // samples in a row on an earlier time line
constexpr std::size_t kMostWaiting = 256;   // frames without an IMU sample after them
constexpr TimeNs kRestEvery = 100'000'000;  // between two uses of rest [ns]
constexpr std::size_t kFewestStill = 5;     // features that tell whether the picture stands still

double square(double x) {
  return x * x;
}

InertialStepNoise noise_of(const ImuNoise& noise, double dt_s) {
  return {.theta = square(noise.gyroscope_noise_density) * dt_s,
          .velocity = square(noise.accelerometer_noise_density) * dt_s,
          .position = 0,
          .gyroscope_bias = square(noise.gyroscope_random_walk) * dt_s,
          .accelerometer_bias = square(noise.accelerometer_random_walk) * dt_s};
}

}  // namespace

InertialSlam::InertialSlam(const SlamOptions& options)
    : filter_(options),
      start_(options.start, options.stand_still, options.imu_noise, options.gravity),
      rest_(options.stand_still, options.imu_noise, options.gravity) {
  require(options.motion == SlamMotion::kInertial, "motion: InertialSlam needs an IMU, MonoSlam does without");
}

void InertialSlam::skip(const char* count, std::uint32_t status) {
  ++counts_[count];
  next_status_ |= status;
}

void InertialSlam::reset() {
  filter_.stop();
  start_.reset();
  rest_.reset();
  while (!waiting_.empty()) waiting_.pop_front();
  early_.clear();
  frame_count_ = 0;
  carried_.reset();
  picture_.clear();
  still_frames_ = 0;
  last_ = Stamp{};
  last_good_frame_ns_ = last_frame_ns_ = rest_used_ns_ = kNoTime;
  restored_ = false;
  set_back_in_a_row_ = 0;
}

void InertialSlam::restore(const SlamSnapshot& snapshot) {
  reset();
  filter_.restore(snapshot);
  restored_ = true;
}

bool InertialSlam::process(const Measurement& measurement) {
  frame_count_ = 0;
  if (const auto* imu = std::get_if<ImuMeasurement>(&measurement)) return process_imu(*imu);
  if (const auto* frame = std::get_if<FeaturesMeasurement>(&measurement)) {
    if (frame->camera == options().camera_index) process_frame(*frame);
  }
  return false;
}

TimeNs InertialSlam::on_imu_clock(TimeNs camera_time_ns) const {
  const double offset = filter_.started() ? filter_.state().time_offset_s : options().camera.time_offset_s;
  return camera_time_ns + from_seconds(offset);
}

void InertialSlam::process_frame(const FeaturesMeasurement& frame) {
  if (last_frame_ns_ != kNoTime && frame.time_ns <= last_frame_ns_) {
    skip("features.skipped.time_not_increasing", kTimeNotIncreasing);
    return;
  }
  if (waiting_.size() == kMostWaiting) {
    waiting_.pop_front();
    skip("features.skipped.without_imu", 0);
  }
  last_frame_ns_ = frame.time_ns;
  waiting_.push_back(frame);
}

bool InertialSlam::usable(const ImuMeasurement& imu) {
  if (!imu.angular_velocity.allFinite() || !imu.specific_force.allFinite()) {
    skip("imu.skipped.not_finite", kNotFinite);
    return false;
  }
  if (imu.angular_velocity.norm() > options().max_angular_velocity ||
      imu.specific_force.norm() > options().max_specific_force) {
    skip("imu.skipped.out_of_range", kOutOfRange);
    return false;
  }
  if (imu.time_ns > last_.time_ns) {  // kNoTime is before every time
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
  if (!usable(imu)) return false;
  last_ = imu;
  status_ = next_status_;
  next_status_ = 0;
  if (restored_) {
    // The state is from another time; nobody knows how the body moved since.
    filter_.set_time(imu.time_ns);
    last_imu_ = imu;
    Eigen::VectorXd variance = Eigen::VectorXd::Zero(filter_.layout().dim);
    const double gap = options().max_imu_bridge_s;
    variance.segment<3>(kTheta).setConstant(square(options().gap_angular_velocity_sigma * gap));
    variance.segment<3>(kVelocity).setConstant(square(options().gap_acceleration_sigma * gap));
    variance.segment<3>(kPosition).setConstant(square(options().gap_acceleration_sigma * gap * gap));
    filter_.widen(variance);
    status_ |= kGap;
    restored_ = false;
    return true;
  }
  if (!filter_.started()) {
    early_.push_back(imu);
    if (!start_.push(imu)) return false;
    return start();
  }
  run(imu);
  return filter_.started();
}

bool InertialSlam::start() {
  // A gyroscope at rest reads its bias, whatever that is, and an accelerometer that shakes reads gravity on the whole:
  // whether it is rest, the picture tells, to about a pixel.
  if (waiting_frames_stand_still()) {
    const double pixel = options().still_picture_px / options().camera.intrinsics_px.head<2>().minCoeff();
    begin(start_.estimate_still(pixel / options().start.duration_s));
  } else {
    begin(start_.estimate(false));
  }
  // All that came since then, in order.
  std::vector<ImuMeasurement> samples;
  samples.swap(early_);
  for (const ImuMeasurement& imu : samples) {
    if (imu.time_ns > filter_.time_ns()) {
      run(imu);
    } else if (imu.time_ns == filter_.time_ns()) {
      last_imu_ = imu;
    }
  }
  return filter_.started();
}

void InertialSlam::begin(const FusionStartEstimate& from) {
  const SlamOptions& o = options();
  const SlamLayout& layout = filter_.layout();
  SlamState state;
  static_cast<InertialState&>(state) = from.state;
  state.position = o.position;
  state.T_body_camera = o.camera.T_body_camera;
  state.time_offset_s = o.camera.time_offset_s;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(layout.dim, layout.dim);
  covariance.topLeftCorner<kInertialDim, kInertialDim>() = from.covariance;
  covariance.block<3, 3>(kPosition, kPosition) = square(o.sigma_position) * Eigen::Matrix3d::Identity();
  if (layout.extrinsic_rotation >= 0) {
    covariance.diagonal().segment<3>(layout.extrinsic_rotation).setConstant(square(o.sigma_extrinsic_rotation));
    covariance.diagonal().segment<3>(layout.extrinsic_position).setConstant(square(o.sigma_extrinsic_position));
  }
  if (layout.time_offset >= 0) covariance(layout.time_offset, layout.time_offset) = square(o.sigma_time_offset);
  ++counts_[from.at_rest ? "starts.at_rest" : "starts.moving"];
  filter_.start(from.time_ns, state, covariance);
  last_good_frame_ns_ = from.time_ns;
  // Frames from before the start have no place in it.
  while (!waiting_.empty() && on_imu_clock(waiting_.front().time_ns) < from.time_ns) {
    waiting_.pop_front();
    skip("features.skipped.before_start", 0);
  }
}

// To that time on the line between the last sample and this one.
void InertialSlam::step_to(TimeNs time_ns, const ImuMeasurement& to) {
  const TimeNs from_ns = filter_.time_ns();
  if (time_ns <= from_ns) return;
  const double dt = to_seconds(time_ns - from_ns);
  const double part = dt / to_seconds(to.time_ns - from_ns);
  ImuMeasurement end = to;
  end.time_ns = time_ns;
  end.angular_velocity = (1 - part) * last_imu_.angular_velocity + part * to.angular_velocity;
  end.specific_force = (1 - part) * last_imu_.specific_force + part * to.specific_force;
  const SlamState& state = filter_.state();
  const InertialStep step{0.5 * (last_imu_.angular_velocity + end.angular_velocity) - state.gyroscope_bias,
                          0.5 * (last_imu_.specific_force + end.specific_force) - state.accelerometer_bias, dt};
  filter_.propagate(time_ns, step, noise_of(options().imu_noise, dt));
  last_imu_ = end;
}

void InertialSlam::bridge(const ImuMeasurement& imu) {
  const double gap = to_seconds(imu.time_ns - filter_.time_ns());
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(filter_.layout().dim);
  variance.segment<3>(kTheta).setConstant(square(options().gap_angular_velocity_sigma * gap));
  variance.segment<3>(kVelocity).setConstant(square(options().gap_acceleration_sigma * gap));
  variance.segment<3>(kPosition).setConstant(square(0.5 * options().gap_acceleration_sigma * gap * gap));
  filter_.widen(variance);
  ++counts_["imu.gaps.bridged"];
  status_ |= kGap | kBridged;
}

void InertialSlam::start_anew() {
  ++counts_["imu.gaps.restarted"];
  next_status_ |= kGap | kReinitialised;
  filter_.stop();
  start_.reset();
  rest_.reset();
  early_.clear();
  still_frames_ = 0;
}

void InertialSlam::run(const ImuMeasurement& imu) {
  const double dt = to_seconds(imu.time_ns - filter_.time_ns());
  if (dt > options().max_imu_bridge_s) {
    start_anew();
    early_.push_back(imu);
    start_.push(imu);
    return;
  }
  if (dt > options().max_imu_step_s) bridge(imu);
  while (!waiting_.empty()) {
    const TimeNs time_ns = on_imu_clock(waiting_.front().time_ns);
    if (time_ns > imu.time_ns) break;
    const FeaturesMeasurement frame = waiting_.pop_front();
    if (time_ns < filter_.time_ns()) {
      skip("features.skipped.late", kTooLate);
      continue;
    }
    step_to(time_ns, imu);
    take_frame(frame);
  }
  step_to(imu.time_ns, imu);
  last_imu_ = imu;
  ++imu_used_;
  look_for_rest(imu);
  if (to_seconds(imu.time_ns - last_good_frame_ns_) > options().lost_after_s) status_ |= kFewFeatures;
}

// Median of how far features moved since the frame before; NaN when too few are in both.
double InertialSlam::moved_px(const FeaturesMeasurement& frame) {
  picture_.swap(picture_before_);
  picture_.assign(frame.features.begin(), frame.features.end());
  std::sort(picture_.begin(), picture_.end(),
            [](const FeatureObservation& a, const FeatureObservation& b) { return a.id < b.id; });
  moves_.clear();
  auto other = picture_before_.begin();
  for (const FeatureObservation& feature : picture_) {
    while (other != picture_before_.end() && other->id < feature.id) ++other;
    if (other == picture_before_.end()) break;
    if (other->id == feature.id) moves_.push_back((other->pixel_px - feature.pixel_px).norm());
  }
  if (moves_.size() < kFewestStill) return kUnknown;
  const auto middle = moves_.begin() + static_cast<std::ptrdiff_t>(moves_.size() / 2);
  std::nth_element(moves_.begin(), middle, moves_.end());
  return *middle;
}

// Over the time of the start.
bool InertialSlam::waiting_frames_stand_still() {
  bool still = waiting_.size() >= 3;
  for (std::size_t i = 0; i < waiting_.size() && still; ++i) {
    const double moved = moved_px(waiting_[i]);
    still = i == 0 || moved < options().still_picture_px;
  }
  if (!still) return false;
  // What creeps from frame to frame shows over all of them.
  moved_px(waiting_.front());
  return moved_px(waiting_.back()) < 2 * options().still_picture_px;
}

void InertialSlam::take_frame(const FeaturesMeasurement& frame) {
  still_frames_ = moved_px(frame) < options().still_picture_px ? still_frames_ + 1 : 0;

  const SlamFrame& done = filter_.update(frame);
  ++frames_used_;
  if ((done.estimate.status & kFewFeatures) == 0 && done.counts.in_frame > 0) last_good_frame_ns_ = filter_.time_ns();
  if (frame_count_ == frames_.size()) frames_.emplace_back();
  SlamFrame& out = frames_[frame_count_++];
  out = done;
  out.estimate.host_time_ns = frame.host_time_ns;
  out.estimate.sequence = frame.sequence;
}

void InertialSlam::look_for_rest(const ImuMeasurement& imu) {
  const double bias_sigma = std::sqrt(std::max(0.0, filter_.covariance()(kGyroscopeBias, kGyroscopeBias)));
  const bool still = rest_.update(imu, filter_.state().gyroscope_bias, bias_sigma) && picture_stands_still();
  if (!still) return;
  status_ |= kAtRest;
  if (!options().zero_velocity) return;
  if (rest_used_ns_ != kNoTime && imu.time_ns - rest_used_ns_ < kRestEvery) return;
  rest_used_ns_ = imu.time_ns;
  const double sigma_rate = std::hypot(rest_.mean_rate_sigma(), options().zero_rate_sigma_floor);
  const bool taken = filter_.zero_velocity(options().zero_velocity_sigma, rest_.mean_rate(), sigma_rate);
  ++counts_[taken ? "rest.used" : "rest.rejected"];
}

Estimate InertialSlam::estimate() const {
  Estimate out;
  if (!filter_.started()) {
    out.status = status_ | kInitialising;
  } else {
    out = filter_.estimate();
    out.status |= status_;
  }
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
  for (NamedCount& count : filter_.counts()) out.push_back(std::move(count));
  return out;
}

}  // namespace loc
