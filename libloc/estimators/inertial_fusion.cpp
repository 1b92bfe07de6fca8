#include "libloc/estimators/inertial_fusion.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/estimators/fusion_preset.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

// Samples in a row on another time line that mean: the clock was set back.
constexpr int kSetBackAfter = 20;
constexpr double kSurelyMoving = 5;  // deviations
constexpr std::size_t kMostEarly = 20'000;
// A heading that is worse than this is none.
constexpr double kMostHeadingSigma = 0.35;      // [rad]
constexpr double kNoHeadingSigma = 1.8;         // of any angle in a turn [rad]
constexpr double kMostCarriedHeading = 0.7;     // [rad]
constexpr double kExtrinsicsAngleSigma = 0.05;  // [rad]
constexpr double kExtrinsicsSigma = 0.1;        // [m]

double square(double x) {
  return x * x;
}

}  // namespace

const char* odometry_use_name(OdometryUse use) {
  switch (use) {
    case OdometryUse::kAutomatic:
      return "auto";
    case OdometryUse::kAbsolute:
      return "absolute";
    case OdometryUse::kRelative:
      return "relative";
  }
  return "unknown";
}

OdometryUse parse_odometry_use(std::string_view name) {
  for (const OdometryUse use : {OdometryUse::kAutomatic, OdometryUse::kAbsolute, OdometryUse::kRelative}) {
    if (name == odometry_use_name(use)) return use;
  }
  throw std::invalid_argument("odometry '" + std::string(name) + "': must be auto, absolute or relative");
}

InertialFusionOptions InertialFusionOptions::robust() {
  InertialFusionOptions options;
  options.filter.clones = 1;
  options.filter.estimate_drift = true;
  options.filter.scale_random_walk = 0.003;
  // A vehicle's engine and road are in it, which a calibration at rest does not see.
  options.filter.noise.gyroscope_noise_density = 5e-4;
  options.filter.noise.accelerometer_noise_density = 1e-2;
  options.make_robust();
  return options;
}

InertialFusionOptions InertialFusionOptions::preset(std::string_view name) {
  if (name == "robust") return robust();
  const FusionPreset preset = FusionPreset::by_name(name);
  InertialFusionOptions options;
  options.filter = preset.options;
  options.odometry = OdometryUse::kAbsolute;
  options.odometry_position_cov = preset.odometry_position_cov;
  options.odometry_orientation_cov = preset.odometry_orientation_cov;
  if (preset.options.estimate_drift) {
    options.drift_start_sigma = std::sqrt(preset.start_cov(kInertialDim + 1, kInertialDim + 1));
  }
  options.zero_velocity = false;
  return options;
}

void InertialFusionOptions::check() const {
  filter.check();
  start.check();
  stand_still.check();
  heading_bank.check();
  require(filter.gravity.head<2>().norm() < 1e-9 && filter.gravity.z() < 0, "gravity: world must have z up");
  if (origin) origin->check();
  check_gps();
  require_positive("gps_max_ahead_s", gps_max_ahead_s);
  require_positive("odometry_position_sigma", odometry_position_sigma);
  require_positive("odometry_orientation_sigma", odometry_orientation_sigma);
  require(!odometry_position_cov || odometry_position_cov->allFinite(), "odometry_position_cov is not finite");
  require(!odometry_orientation_cov || odometry_orientation_cov->allFinite(), "odometry_orientation_cov is not finite");
  require_positive("odometry_interval_s", odometry_interval_s);
  require_positive("scale", scale);
  require_not_negative("scale_sigma", scale_sigma);
  require_not_negative("drift_start_sigma", drift_start_sigma);
  require_positive("zero_velocity_sigma", zero_velocity_sigma);
  require_positive("zero_rate_sigma_floor", zero_rate_sigma_floor);
  require_positive("max_angular_velocity", max_angular_velocity);
  require_positive("max_specific_force", max_specific_force);
  require_positive("gap_acceleration_sigma", gap_acceleration_sigma);
  require_positive("gap_angular_velocity_sigma", gap_angular_velocity_sigma);
  require(reject_count > 0, "reject_count", reject_count, "must be positive");
  require_positive("reject_time_s", reject_time_s);
  require(odometry != OdometryUse::kRelative || filter.clones > 0, "odometry: relative use needs filter.clones >= 1");
}

InertialFusion::InertialFusion(const InertialFusionOptions& options)
    : options_((options.check(), options)),
      bank_(options.heading_bank, options.filter),
      start_(options.start, options.stand_still, options.filter.noise, options.filter.gravity.norm()),
      rest_(options.stand_still, options.filter.noise, options.filter.gravity.norm()),
      lag_({.drift_order = 2}) {
  if (options.origin) world_.emplace(*options.origin);
  if (options.given_start) {
    // What is wrong with it is told now, not at the first sample.
    bank_.start(0, options.given_start->state, options.given_start->covariance);
  }
}

void InertialFusion::reset() {
  for (const NamedCount& count : bank_.best().counts()) counts_[count.name] += count.value;
  const std::int64_t used = imu_used_;
  std::map<std::string, std::int64_t> counts = std::move(counts_);
  *this = InertialFusion(options_);
  imu_used_ = used;
  counts_ = std::move(counts);
}

void InertialFusion::skip(const char* count, std::uint32_t status) {
  ++counts_[count];
  next_status_ |= status;
}

bool InertialFusion::process(const Measurement& measurement) {
  if (const auto* imu = std::get_if<ImuMeasurement>(&measurement)) return process_imu(*imu);
  const StreamKind kind = kind_of(measurement);
  const bool wanted = (kind == StreamKind::kGps && options_.use_gps) ||
                      (kind == StreamKind::kOdometry && options_.use_odometry) ||
                      (kind == StreamKind::kMagnetometer && options_.use_magnetometer && !running_);
  if (!wanted) return false;
  if (running_) {
    process_other(measurement);
  } else if (const auto* field = std::get_if<MagnetometerMeasurement>(&measurement)) {
    start_.push(*field);
  } else {
    early_.push_back(measurement);
    if (early_.size() > kMostEarly) {
      early_.pop_front();
      ++counts_["early.dropped"];
    }
  }
  return false;
}

bool InertialFusion::time_set_back(TimeNs time_ns) {
  refused_in_a_row_ = refused_in_a_row_ > 0 && time_ns > refused_ns_ ? refused_in_a_row_ + 1 : 1;
  refused_ns_ = time_ns;
  return refused_in_a_row_ >= kSetBackAfter;
}

bool InertialFusion::process_imu(const ImuMeasurement& imu) {
  if (!imu.angular_velocity.allFinite() || !imu.specific_force.allFinite()) {
    skip("imu.skipped.not_finite", kNotFinite);
    return false;
  }
  if (imu.angular_velocity.norm() > options_.max_angular_velocity ||
      imu.specific_force.norm() > options_.max_specific_force) {
    skip("imu.skipped.out_of_range", kOutOfRange);
    return false;
  }
  if (imu.time_ns <= last_.time_ns) {  // false for the first: kNoTime is before every time
    if (!time_set_back(imu.time_ns)) {
      skip("imu.skipped.time_not_increasing", kTimeNotIncreasing);
      return false;
    }
    // Where the world is does not depend on the clock; where the body is by now nobody knows.
    const std::optional<LocalFrame> world = world_;
    reset();
    world_ = world;
    given_used_ = true;
    skip("imu.clock_set_back", kReinitialised);
  }
  refused_in_a_row_ = 0;
  last_ = imu;
  return running_ ? step(imu) : collect(imu);
}

bool InertialFusion::collect(const ImuMeasurement& imu) {
  if (options_.given_start && !carried_ && !given_used_) {
    begin_given(imu);
    return true;
  }
  if (!start_.push(imu)) return false;
  begin();
  return running_;
}

void InertialFusion::begin_given(const ImuMeasurement& imu) {
  bank_.start(imu.time_ns, options_.given_start->state, options_.given_start->covariance);
  given_used_ = true;
  started_in_motion_ = false;
  heading_known_ = follows_odometry_ = true;
  anchored_ = tied_ = world_.has_value();
  run_from(imu.time_ns, {imu});
}

ErrorStateState InertialFusion::first_state(const FusionStartEstimate& start, Eigen::MatrixXd& covariance) {
  const ErrorStateLayout& layout = bank_.best().layout();
  ErrorStateState state;
  state.inertial = start.state;
  state.scale = options_.scale;
  covariance = Eigen::MatrixXd::Zero(layout.size, layout.size);
  covariance.topLeftCorner<kInertialDim, kInertialDim>() = start.covariance;
  const auto set = [&](int at, int size, double sigma) {
    if (at >= 0) covariance.diagonal().segment(at, size).setConstant(square(sigma));
  };
  set(layout.scale, 1, options_.scale_sigma);
  set(layout.drift, 3, options_.drift_start_sigma);
  if (layout.extrinsics >= 0) {
    set(layout.extrinsics, 3, kExtrinsicsAngleSigma);
    set(layout.extrinsics + 3, 3, kExtrinsicsSigma);
  }
  return state;
}

// From before the gap: position, heading, biases and scale with the uncertainty that they have now. Motion in the gap
// is not known, so correlations are dropped.
void InertialFusion::carry_over(const FusionStartEstimate& start, ErrorStateState& state, Eigen::MatrixXd& covariance) {
  const Carried& c = *carried_;
  const double gap = std::max(0.0, to_seconds(start.time_ns - c.time_ns));
  const auto sigma_of = [&](int at) { return std::sqrt(c.variances.segment<3>(at).maxCoeff()); };
  const auto set = [&](int at, int size, double variance) {
    covariance.middleRows(at, size).setZero();
    covariance.middleCols(at, size).setZero();
    covariance.diagonal().segment(at, size).setConstant(variance);
  };
  InertialState& x = state.inertial;
  const InertialState& was = c.state.inertial;
  const ImuNoise& noise = options_.filter.noise;

  const double carried =
      std::min(square(kNoHeadingSigma), c.heading_variance + square(options_.gap_angular_velocity_sigma * gap));
  const double magnetic = heading_variance(state, covariance);
  const bool from_field = start.heading == HeadingSource::kMagnetometer && (magnetic < carried || !c.heading_known);
  if (from_field) {
    heading_known_ = true;
  } else {
    // Relative headings are carried as well: world stays what it was.
    covariance.block<3, 3>(kTheta, kTheta) -= [&] {
      const Eigen::Vector3d up = x.q_world_body.inverse() * Eigen::Vector3d::UnitZ();
      return Eigen::Matrix3d(magnetic * up * up.transpose());
    }();
    heading_known_ = c.heading_known && carried < square(kMostCarriedHeading);
    turn_heading(so3::heading(was.q_world_body) - so3::heading(x.q_world_body), std::sqrt(carried), state, covariance);
  }
  const double sigma_v = sigma_of(kVelocity);
  x.position = was.position;
  set(kPosition, 3,
      square(sigma_of(kPosition)) + square((was.velocity.norm() + sigma_v) * gap) +
          square(0.5 * options_.gap_acceleration_sigma * gap * gap));
  const double faster = options_.gap_acceleration_sigma * gap;
  if (!start.at_rest && faster < options_.start.moving_velocity_sigma) {
    x.velocity = was.velocity;
    set(kVelocity, 3, square(sigma_v) + square(faster));
  }
  const auto keep_bias = [&](int at, const Eigen::Vector3d& before, double walk, Eigen::Vector3d& bias) {
    const double variance = square(sigma_of(at)) + walk * walk * gap;
    if (variance > covariance.diagonal().segment<3>(at).maxCoeff()) return;
    bias = before;
    set(at, 3, variance);
  };
  keep_bias(kGyroscopeBias, was.gyroscope_bias, noise.gyroscope_random_walk, x.gyroscope_bias);
  keep_bias(kAccelerometerBias, was.accelerometer_bias, noise.accelerometer_random_walk, x.accelerometer_bias);
  const ErrorStateLayout& layout = bank_.best().layout();
  if (layout.scale >= 0) {
    state.scale = c.state.scale;
    set(layout.scale, 1, c.variances[layout.scale] + square(options_.filter.scale_random_walk * state.scale) * gap);
  }
  if (layout.extrinsics >= 0) {
    state.T_body_odometry = c.state.T_body_odometry;
    covariance.diagonal().segment<6>(layout.extrinsics) = c.variances.segment<6>(layout.extrinsics);
  }
}

// Does what came with the first second say that the body moves?
bool InertialFusion::early_motion() const {
  const OdometryMeasurement* first = nullptr;
  for (const Measurement& m : early_) {
    if (const auto* gps = std::get_if<GpsMeasurement>(&m)) {
      const double sigma =
          gps->velocity_cov.hasNaN() ? options_.gps_velocity_sigma : std::sqrt(gps->velocity_cov.diagonal().maxCoeff());
      if (options_.use_gps && gps->velocity_enu.norm() > kSurelyMoving * std::max(sigma, 0.1)) return true;
    }
    const auto* odometry = std::get_if<OdometryMeasurement>(&m);
    if (odometry == nullptr || !options_.use_odometry || !odometry->position.allFinite()) continue;
    const double variance = odometry->position_cov.hasNaN() ? square(options_.odometry_position_sigma)
                                                            : odometry->position_cov.diagonal().maxCoeff();
    const double sigma = std::sqrt(2 * std::max(variance, 0.0));
    if (odometry->start_time_ns != kNoTime) {
      if (odometry->position.norm() > kSurelyMoving * sigma) return true;
    } else if (first == nullptr) {
      first = odometry;
    } else if ((odometry->position - first->position).norm() > kSurelyMoving * sigma) {
      return true;
    }
  }
  return false;
}

void InertialFusion::begin() {
  const FusionStartEstimate start = start_.estimate(!early_motion());
  started_in_motion_ = !start.at_rest && !carried_;
  Eigen::MatrixXd covariance;
  ErrorStateState state = first_state(start, covariance);
  if (carried_) {
    carry_over(start, state, covariance);
    carried_.reset();
  } else {
    heading_known_ = start.heading != HeadingSource::kNone;
    if (start.at_rest) ++counts_["start.at_rest"];
  }
  bank_.start(start.time_ns, state, covariance);
  const std::vector<ImuMeasurement> samples = start_.samples();
  run_from(start.time_ns, samples);
}

// The samples that the start was made from, and what else came in the meantime.
void InertialFusion::run_from(TimeNs /*time_ns*/, const std::vector<ImuMeasurement>& samples) {
  running_ = true;
  rest_.reset();
  start_.reset();
  rest_fused_ns_ = kNoTime;
  const std::deque<Measurement> early = std::exchange(early_, {});
  std::size_t next = 0;
  std::uint32_t all = 0;
  for (const ImuMeasurement& imu : samples) {
    while (next < early.size() && stamp_of(early[next]).time_ns <= imu.time_ns) process_other(early[next++]);
    step(imu);
    all |= status_;
  }
  while (next < early.size()) process_other(early[next++]);
  status_ = all;
}

bool InertialFusion::step(const ImuMeasurement& imu) {
  status_ = std::exchange(next_status_, 0U);
  const PredictOutcome outcome = bank_.predict(imu);
  if (outcome == PredictOutcome::kGap) {
    start_anew(kGap | kReinitialised | status_);
    return collect(imu);
  }
  if (outcome == PredictOutcome::kBridged) status_ |= kBridged | kGap;
  reckoning_.step(imu, options_.filter.gravity.norm());
  if (odometry_used_) stamps_.see(imu);
  ++imu_used_;
  const std::vector<FusionResult> results = bank_.results();
  for (const FusionResult& result : results) take_note(result);
  look_for_rest(imu);
  if (bank_.decide()) {
    heading_known_ = true;
    ++counts_["heading.found"];
  }
  return running_;
}

void InertialFusion::start_anew(std::uint32_t status) {
  const ErrorStateFilter& filter = bank_.best();
  carried_ = Carried{filter.time_ns(), filter.state(), filter.covariance().diagonal(), bank_.heading_variance(),
                     heading_known_};
  running_ = false;
  start_.reset();
  pose_before_.reset();
  watches_.clear();
  lag_.break_off();
  reckoning_.stop();
  next_status_ |= status;
  ++counts_["start.again"];
}

void InertialFusion::look_for_rest(const ImuMeasurement& imu) {
  const ErrorStateFilter& filter = bank_.best();
  const double bias_sigma = std::sqrt(filter.covariance().diagonal().segment<3>(kGyroscopeBias).maxCoeff());
  if (!rest_.update(imu, filter.state().inertial.gyroscope_bias, bias_sigma)) return;
  status_ |= kAtRest;
  const bool due =
      rest_fused_ns_ == kNoTime || to_seconds(imu.time_ns - rest_fused_ns_) >= options_.stand_still.window_s;
  if (!options_.zero_velocity || !due) return;
  rest_fused_ns_ = imu.time_ns;
  const double rate_sigma = std::hypot(rest_.mean_rate_sigma(), options_.zero_rate_sigma_floor);
  take_note(bank_.fuse([&](ErrorStateFilter& one) {
    return one.fuse_zero_velocity(imu.time_ns, options_.zero_velocity_sigma, rest_.mean_rate(), rate_sigma);
  }));
}

Estimate InertialFusion::estimate() const {
  Estimate out;
  out.time_ns = last_.time_ns;
  out.host_time_ns = last_.host_time_ns;
  out.sequence = last_.sequence;
  out.status = status_;
  if (lag_.doubtful()) out.status |= kGpsStampsDoubtful;
  if (stamps_.doubtful()) out.status |= kStampsDoubtful;
  if (!running_) {
    out.status |= kInitialising;
    return out;
  }
  const ErrorStateFilter& filter = bank_.best();
  const ErrorStateState& state = filter.state();
  const ErrorStateLayout& layout = filter.layout();
  out.valid = kValidOrientation | kValidPosition | kValidVelocity | kValidGyroscopeBias | kValidAccelerometerBias |
              kValidCovariance;
  if (heading_known_ && bank_.size() == 1 && bank_.heading_variance() < square(kMostHeadingSigma)) {
    out.valid |= kValidHeading;
  }
  out.q_world_body = state.inertial.q_world_body;
  out.position = state.inertial.position;
  out.velocity = state.inertial.velocity;
  out.angular_velocity = filter.angular_velocity();
  out.gyroscope_bias = state.inertial.gyroscope_bias;
  out.accelerometer_bias = state.inertial.accelerometer_bias;
  out.covariance = filter.covariance().topLeftCorner<kMaxEstimateDim, kMaxEstimateDim>();
  out.covariance_dim = kMaxEstimateDim;
  if (bank_.size() > 1) {
    const Eigen::Vector3d up = out.q_world_body.inverse() * Eigen::Vector3d::UnitZ();
    out.covariance.topLeftCorner<3, 3>() += bank_.spread() * up * up.transpose();
  }
  if (started_in_motion_ && odometry_used_ && !tied_) out.valid &= ~(kValidPosition | kValidVelocity);
  if (layout.scale >= 0 && options_.use_odometry) {
    if (!(started_in_motion_ && !tied_)) out.valid |= kValidScale;
    out.scale = state.scale;
    out.scale_sigma = std::sqrt(filter.covariance()(layout.scale, layout.scale));
  }
  if (tied_) out.origin = world_->origin();
  return out;
}

NamedCounts InertialFusion::counts() const {
  std::map<std::string, std::int64_t> all = counts_;
  for (const NamedCount& count : bank_.best().counts()) all[count.name] += count.value;
  NamedCounts out = {{"imu.used", imu_used_}};
  for (const auto& [name, value] : all) out.push_back({name, value});
  out.push_back({"rest.false_alarms", rest_.false_alarms()});
  if (stamps_.doubtful()) out.push_back({"stamps.odometry_to_add_ms", std::llround(1e3 * stamps_.offset_s())});
  if (lag_.doubtful()) out.push_back({"stamps.gps_to_add_ms", std::llround(1e3 * lag_.offset_s())});
  return out;
}

}  // namespace loc
