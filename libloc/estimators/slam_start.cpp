#include "libloc/estimators/slam_start.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "libloc/core/check.hpp"
#include "libloc/estimators/slam_start_detail.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr TimeNs kMaxTime = TimeNs{1} << 61;  // farther ones are no times, and their differences overflow
constexpr double kMaxTimeOffsetS = 1e6;
constexpr std::size_t kMaxSamples = 50'000;  // of the IMU in the window
constexpr std::size_t kMaxWindow = 2'000;    // frames in it
constexpr double kMuchParallax = 20;         // in deviations: one minimum is likely the only one
constexpr double kSameCost = 1;              // difference of two results' costs that makes them one minimum
constexpr double kLargeRatio = 1.2;          // of residuals to what is stated

bool is_time(TimeNs time_ns) {
  return time_ns > -kMaxTime && time_ns < kMaxTime;
}

void require_count(std::string_view name, int value, int least) {
  require(value >= least, name, value, "must be at least " + std::to_string(least));
}

// Reading at a time between two samples, or the mean of the interval that it lies in.
ImuMeasurement reading_at(const ImuMeasurement& before, const ImuMeasurement& after, TimeNs time_ns) {
  const double share = to_seconds(time_ns - before.time_ns) / to_seconds(after.time_ns - before.time_ns);
  ImuMeasurement out;
  out.time_ns = time_ns;
  out.angular_velocity = before.angular_velocity + share * (after.angular_velocity - before.angular_velocity);
  out.specific_force = before.specific_force + share * (after.specific_force - before.specific_force);
  return out;
}

// Steps from the first of the times to the last, split at each of them.
void make_steps(const std::deque<ImuMeasurement>& imu, const std::vector<TimeNs>& times, ImuSampling sampling,
                slam_start::Problem& problem) {
  auto next = std::ranges::upper_bound(imu, times.front(), {}, &ImuMeasurement::time_ns);
  TimeNs at = times.front();
  problem.step_end.push_back(0);
  for (std::size_t i = 1; i < times.size(); ++i) {
    while (at < times[i]) {
      const ImuMeasurement& before = *std::prev(next);
      const TimeNs end = std::min(next->time_ns, times[i]);
      InertialStep step;
      step.dt_s = to_seconds(end - at);
      if (sampling == ImuSampling::kIntervalMean) {
        step.angular_velocity = next->angular_velocity;
        step.specific_force = next->specific_force;
      } else {
        const ImuMeasurement a = reading_at(before, *next, at);
        const ImuMeasurement b = reading_at(before, *next, end);
        step.angular_velocity = 0.5 * (a.angular_velocity + b.angular_velocity);
        step.specific_force = 0.5 * (a.specific_force + b.specific_force);
      }
      problem.steps.push_back(step);
      at = end;
      if (at == next->time_ns) ++next;
    }
    problem.step_end.push_back(problem.steps.size());
  }
}

// So many of the indices 0 .. count - 1, spread evenly, first and last among them.
std::vector<std::size_t> spread(std::size_t count, int most) {
  const std::size_t n = std::min(count, static_cast<std::size_t>(most));
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < n; ++i) out.push_back((i * (count - 1) + (n - 1) / 2) / (n - 1));
  return out;
}

// Along the worst direction.
double largest_sigma(const Eigen::Matrix3d& covariance) {
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance, Eigen::EigenvaluesOnly).eigenvalues()[2]);
}

std::string text(double value) {
  return to_text(value, 3);
}

}  // namespace

void SlamStartOptions::check() const {
  require_positive("slam_start.min_duration_s", min_duration_s);
  require_positive("slam_start.max_duration_s", max_duration_s);
  require(min_duration_s < max_duration_s, "slam_start.min_duration_s", min_duration_s,
          "must be less than max_duration_s");
  require(max_duration_s <= 20, "slam_start.max_duration_s", max_duration_s, "must not exceed 20");
  require_count("slam_start.min_frames", min_frames, 4);
  require_count("slam_start.max_frames", max_frames, min_frames);
  require_count("slam_start.min_features", min_features, 6);
  require_count("slam_start.max_features", max_features, min_features);
  require_count("slam_start.min_observations", min_observations, 3);
  require(min_observations <= max_frames, "slam_start.min_observations", min_observations,
          "must not exceed max_frames");
  require_positive("slam_start.max_gap_s", max_gap_s);
  require_positive("slam_start.sigma_px", sigma_px);
  require(max_sigma_ratio >= 1 && std::isfinite(max_sigma_ratio), "slam_start.max_sigma_ratio", max_sigma_ratio,
          "must be at least 1 and finite");
  require(min_inliers > 0 && min_inliers <= 1, "slam_start.min_inliers", min_inliers, "must be in (0, 1]");
  require_not_negative("slam_start.min_parallax", min_parallax);
  require_positive("slam_start.max_scale_sigma", max_scale_sigma);
  require_not_negative("slam_start.velocity_floor", velocity_floor);
  require_positive("slam_start.max_tilt_sigma", max_tilt_sigma);
  require_positive("slam_start.max_condition", max_condition);
  require_positive("slam_start.gyroscope_bias_sigma", gyroscope_bias_sigma);
}

const char* slam_start_outcome_name(SlamStartOutcome outcome) {
  switch (outcome) {
    case SlamStartOutcome::kNone:
      return "none";
    case SlamStartOutcome::kStarted:
      return "started";
    case SlamStartOutcome::kTooShort:
      return "too-short";
    case SlamStartOutcome::kFewFrames:
      return "few-frames";
    case SlamStartOutcome::kFewFeatures:
      return "few-features";
    case SlamStartOutcome::kNoSolution:
      return "no-solution";
    case SlamStartOutcome::kResidual:
      return "residual";
    case SlamStartOutcome::kNoParallax:
      return "no-parallax";
    case SlamStartOutcome::kNoExcitation:
      return "no-excitation";
    case SlamStartOutcome::kCondition:
      return "condition";
  }
  return "unknown";
}

SlamStart::SlamStart(const SlamStartOptions& options, const CameraCalibration& camera, const ImuNoise& noise,
                     double gravity)
    : options_(options), camera_(camera), T_body_camera_(camera.T_body_camera), noise_(noise), gravity_(gravity) {
  options_.check();
  noise_.check();
  require_positive("gravity", gravity);
  require(std::abs(camera.time_offset_s) <= kMaxTimeOffsetS, "time_offset_s", camera.time_offset_s,
          "must not exceed a million seconds");
  time_offset_ns_ = from_seconds(camera.time_offset_s);
}

void SlamStart::reset() {
  imu_.clear();
  frames_.clear();
  outcome_ = SlamStartOutcome::kNone;
  reason_.clear();
}

double SlamStart::duration_s() const {
  return frames_.empty() ? 0 : to_seconds(frames_.back().time_ns - frames_.front().time_ns);
}

// Frames older than the window go, and the samples before the first frame but one, which the interval to it needs.
void SlamStart::forget_before(TimeNs newest_ns) {
  const TimeNs oldest = newest_ns - from_seconds(options_.max_duration_s);
  while (!frames_.empty() && (frames_.front().time_ns < oldest || frames_.size() > kMaxWindow)) frames_.pop_front();
  const TimeNs needed = frames_.empty() ? oldest : std::min(oldest, frames_.front().time_ns);
  while (imu_.size() > 1 && (imu_[1].time_ns <= needed || imu_.size() > kMaxSamples)) imu_.pop_front();
}

void SlamStart::push(const ImuMeasurement& imu) {
  if (!imu.angular_velocity.allFinite() || !imu.specific_force.allFinite()) {
    ++counts_.imu_not_finite;
    return;
  }
  if (!is_time(imu.time_ns)) {
    ++counts_.bad_times;
    return;
  }
  if (!imu_.empty()) {
    if (imu.time_ns <= imu_.back().time_ns) {
      ++counts_.imu_not_later;
      return;
    }
    if (to_seconds(imu.time_ns - imu_.back().time_ns) > options_.max_gap_s) {
      ++counts_.imu_gaps;
      imu_.clear();
      while (!frames_.empty() && frames_.front().time_ns < imu.time_ns) frames_.pop_front();
    }
  }
  imu_.push_back(imu);
  forget_before(frames_.empty() ? imu.time_ns : std::max(imu.time_ns, frames_.back().time_ns));
}

void SlamStart::push(const FeaturesMeasurement& measurement) {
  if (!is_time(measurement.time_ns)) {
    ++counts_.bad_times;
    return;
  }
  Frame frame;
  frame.stamp_ns = measurement.time_ns;
  frame.time_ns = measurement.time_ns + time_offset_ns_;
  if (!frames_.empty() && frame.time_ns <= frames_.back().time_ns) {
    ++counts_.frames_not_later;
    return;
  }
  const double sigma = measurement.sigma_px;
  frame.sigma_px = std::isfinite(sigma) && sigma > 0 ? sigma : options_.sigma_px;
  for (const FeatureObservation& f : measurement.features) {
    const bool known = std::ranges::any_of(frame.features, [&](const Feature& other) { return other.id == f.id; });
    const auto ray = f.pixel_px.allFinite() ? camera_.unproject(f.pixel_px) : std::nullopt;
    if (f.id < 0 || known || !ray) {
      ++counts_.features_bad;
      continue;
    }
    frame.features.push_back({f.id, f.pixel_px, *ray});
  }
  frames_.push_back(std::move(frame));
  forget_before(imu_.empty() ? frames_.back().time_ns : std::max(imu_.back().time_ns, frames_.back().time_ns));
}

std::optional<SlamStartEstimate> SlamStart::refuse(SlamStartOutcome outcome, std::string reason) {
  outcome_ = outcome;
  reason_ = std::move(reason);
  return std::nullopt;
}

std::optional<SlamStartEstimate> SlamStart::solve() {
  using Outcome = SlamStartOutcome;
  // Frames that the IMU covers.
  std::vector<const Frame*> covered;
  for (const Frame& frame : frames_) {
    if (imu_.empty() || frame.time_ns < imu_.front().time_ns || frame.time_ns > imu_.back().time_ns) continue;
    covered.push_back(&frame);
  }
  const double duration = covered.empty() ? 0 : to_seconds(covered.back()->time_ns - covered.front()->time_ns);
  if (duration < options_.min_duration_s) {
    return refuse(Outcome::kTooShort, "the frames that the IMU covers reach over " + text(duration) + " s, " +
                                          text(options_.min_duration_s) + " s are asked for");
  }
  if (covered.size() < static_cast<std::size_t>(options_.min_frames)) {
    return refuse(Outcome::kFewFrames, "there are " + std::to_string(covered.size()) + " frames, " +
                                           std::to_string(options_.min_frames) + " are asked for");
  }

  slam_start::Problem problem;
  problem.camera = &camera_;
  problem.T_body_camera = T_body_camera_;
  problem.gravity = gravity_;
  problem.noise = noise_;
  problem.gyroscope_bias_sigma = options_.gyroscope_bias_sigma;
  std::vector<TimeNs> times;
  std::vector<TimeNs> stamps;
  std::unordered_map<std::int64_t, std::size_t> places;
  for (const std::size_t index : spread(covered.size(), options_.max_frames)) {
    const Frame& frame = *covered[index];
    const int number = static_cast<int>(times.size());
    times.push_back(frame.time_ns);
    stamps.push_back(frame.stamp_ns);
    problem.times_s.push_back(to_seconds(frame.time_ns - times.front()));
    problem.sigma_px.push_back(frame.sigma_px);
    for (const Feature& f : frame.features) {
      const auto [place, is_new] = places.try_emplace(f.id, problem.tracks.size());
      if (is_new) problem.tracks.push_back({f.id, {}});
      problem.tracks[place->second].observations.push_back({number, f.pixel_px, f.ray, true});
    }
  }
  std::erase_if(problem.tracks, [&](const slam_start::Track& track) {
    return track.observations.size() < static_cast<std::size_t>(options_.min_observations);
  });
  std::ranges::stable_sort(problem.tracks, std::greater{},
                           [](const slam_start::Track& track) { return track.observations.size(); });
  if (problem.tracks.size() > static_cast<std::size_t>(options_.max_features)) {
    problem.tracks.resize(static_cast<std::size_t>(options_.max_features));
  }
  const auto few = [&](std::size_t count) {
    return refuse(Outcome::kFewFeatures, "there are " + std::to_string(count) + " features that can be used, " +
                                             std::to_string(options_.min_features) + " are asked for");
  };
  if (problem.tracks.size() < static_cast<std::size_t>(options_.min_features)) return few(problem.tracks.size());
  make_steps(imu_, times, options_.sampling, problem);

  slam_start::mark_jumps(problem);
  const auto no_parallax = [&](double parallax) {
    return refuse(Outcome::kNoParallax, "half of the features have a parallax of less than " + text(parallax) +
                                            " deviations of an observation: the camera rests or only turns");
  };
  const slam_start::RotationOnly turning = slam_start::rotation_only(problem);
  if (turning.parallax < options_.min_parallax) return no_parallax(turning.parallax);
  const auto attempt = [&](const Eigen::Vector3d& bias) -> std::optional<slam_start::Refined> {
    const auto start = slam_start::closed_form(problem, bias);
    if (!start) return std::nullopt;
    return slam_start::refine(problem, bias, *start);
  };
  const Eigen::Vector3d bias = slam_start::epipolar_gyroscope_bias(problem);
  auto refined = bias.allFinite() ? attempt(bias) : std::nullopt;
  // With little parallax, turning and moving sideways look alike, and there are several minima.
  if (!refined || refined->parallax < kMuchParallax || refined->sigma_ratio > kLargeRatio) {
    bool agree = refined.has_value();
    const auto consider = [&](const Eigen::Vector3d& other) {
      auto second = attempt(other);
      agree = agree && second && std::abs(second->cost - refined->cost) < kSameCost;
      if (second && (!refined || second->cost < refined->cost)) refined = std::move(second);
    };
    consider(turning.gyroscope_bias);
    consider(Eigen::Vector3d::Zero());
    if (refined && !agree) {
      // Once more without the outliers that were found.
      problem.tracks = refined->tracks;
      consider(slam_start::epipolar_gyroscope_bias(problem));
      consider(Eigen::Vector3d::Zero());
      consider(refined->x.gyroscope_bias);
    }
  }
  if (!refined) return refuse(Outcome::kNoSolution, "the least squares of the pixels have no solution");
  problem.tracks = std::move(refined->tracks);
  const slam_start::Unknowns& x = refined->x;

  if (refined->features < options_.min_features) return few(static_cast<std::size_t>(refined->features));
  const double inliers =
      static_cast<double>(refined->observations) / static_cast<double>(refined->observations + refined->outliers);
  if (inliers < options_.min_inliers) {
    return refuse(Outcome::kResidual, text(100 * inliers) + " % of the observations fit");
  }
  if (refined->sigma_ratio > options_.max_sigma_ratio) {
    return refuse(Outcome::kResidual,
                  "the residuals are " + text(refined->sigma_ratio) + " times as large as the stated deviation");
  }
  if (!refined->converged) return refuse(Outcome::kNoSolution, "the least squares of the pixels do not converge");
  if (refined->parallax < options_.min_parallax) return no_parallax(refined->parallax);
  if (refined->behind > 0.1) {
    return refuse(Outcome::kNoSolution, text(100 * refined->behind) + " % of the points are behind the camera");
  }

  // From the axes of body at the first frame to the world.
  SlamStartEstimate out;
  out.time_ns = times.front();
  const Eigen::Quaterniond level = Eigen::Quaterniond::FromTwoVectors(x.down, -Eigen::Vector3d::UnitZ());
  out.state.q_world_body =
      (Eigen::Quaterniond(Eigen::AngleAxisd(-so3::heading(level), Eigen::Vector3d::UnitZ())) * level).normalized();
  out.state.velocity = out.state.q_world_body * x.velocity;
  out.state.gyroscope_bias = x.gyroscope_bias;
  out.state.accelerometer_bias = x.accelerometer_bias;
  // d down = theta' with theta = -down x d down: a turn about a horizontal axis.
  Eigen::Matrix<double, kInertialDim, slam_start::kStartDim> map =
      Eigen::Matrix<double, kInertialDim, slam_start::kStartDim>::Zero();
  const Eigen::Matrix3d R = out.state.q_world_body.toRotationMatrix();
  const Eigen::Matrix<double, 3, 2> theta = -so3::hat(x.down) * slam_start::tangent(x.down);
  map.block<3, 2>(kTheta, slam_start::kStartDown) = theta;
  map.block<3, 3>(kVelocity, slam_start::kStartVelocity) = R;
  map.block<3, 2>(kVelocity, slam_start::kStartDown) = -R * so3::hat(x.velocity) * theta;
  map.block<3, 3>(kGyroscopeBias, slam_start::kStartGyroscopeBias).setIdentity();
  map.block<3, 3>(kAccelerometerBias, slam_start::kStartAccelerometerBias).setIdentity();
  out.covariance = map * refined->covariance * map.transpose();
  out.covariance = (0.5 * (out.covariance + out.covariance.transpose())).eval();

  const double velocity_sigma = largest_sigma(out.covariance.block<3, 3>(kVelocity, kVelocity));
  const double velocity_limit = options_.max_scale_sigma * std::max(x.velocity.norm(), options_.velocity_floor);
  const double tilt_sigma = largest_sigma(out.covariance.block<3, 3>(kTheta, kTheta));
  if (!(refined->scale_sigma <= options_.max_scale_sigma)) {
    return refuse(Outcome::kNoExcitation,
                  "the scale has a relative deviation of " + text(refined->scale_sigma) + ": too little acceleration");
  }
  if (!(velocity_sigma <= velocity_limit)) {
    return refuse(Outcome::kNoExcitation, "the velocity has a deviation of " + text(velocity_sigma) + " m/s at " +
                                              text(x.velocity.norm()) + " m/s");
  }
  if (!(tilt_sigma <= options_.max_tilt_sigma)) {
    return refuse(Outcome::kNoExcitation, "the tilt has a deviation of " + text(tilt_sigma) + " rad");
  }
  if (!(refined->condition <= options_.max_condition)) {
    return refuse(Outcome::kCondition, "the equations have a condition of " + text(refined->condition));
  }

  out.residual_px_rms = refined->residual_px_rms;
  out.sigma_ratio = refined->sigma_ratio;
  out.features = refined->features;
  out.frames = problem.frames();
  out.observations = refined->observations;
  out.outliers = refined->outliers;
  out.scale_sigma = refined->scale_sigma;
  out.parallax = refined->parallax;
  out.condition = refined->condition;
  out.iterations = refined->iterations;
  const std::vector<slam_start::PoseModel> poses = slam_start::pose_models(problem, x);
  for (std::size_t t = 0; t < problem.tracks.size(); ++t) {
    const slam_start::Point& point = x.points[t];
    if (!point.used || !(point.inverse_distance > 0)) continue;
    const auto anchor = std::ranges::find_if(problem.tracks[t].observations, &slam_start::Observation::used);
    const auto frame = static_cast<std::size_t>(anchor->frame);
    const Eigen::Vector3d moved =
        poses[frame].position + poses[frame].rotation * T_body_camera_.translation - T_body_camera_.translation;
    // From the camera at the anchor: (direction - inverse distance * moved) / inverse distance.
    const Eigen::Vector3d ray = point.direction - point.inverse_distance * moved;
    const double length = ray.norm();
    const double slope = 1 / length + point.inverse_distance * ray.dot(moved) / (length * length * length);
    out.points.push_back({problem.tracks[t].id, stamps[frame], point.inverse_distance / length,
                          std::abs(slope) * refined->inverse_distance_sigma[t]});
  }
  outcome_ = Outcome::kStarted;
  reason_.clear();
  return out;
}

}  // namespace loc
