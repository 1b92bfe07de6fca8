#include "libloc/estimators/slam_filter.hpp"

#include <Eigen/Cholesky>
#include <chrono>
#include <cmath>
#include <set>
#include <stdexcept>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr int kFewest = 3;                    // features in a frame that hold a pose
constexpr std::size_t kUsualFeatures = 1000;  // of a frame; more take memory once
constexpr TimeNs kFarthestTime = 4'000'000'000'000'000'000;
// How far rounding may leave correlations from what they can be.
constexpr double kRounding = 1e-3;
constexpr double kRoundingOfFloat = 0.1;

// P is positive semidefinite by construction: points that were first seen in one frame share its place.
void require_covariance(const Eigen::MatrixXd& p, double rounding) {
  require((p.diagonal().array() >= 0).all(), "snapshot: a variance is negative");
  const Eigen::VectorXd sigma = p.diagonal().cwiseSqrt();
  const Eigen::VectorXd scale = (sigma.array() > 0).select(sigma.cwiseInverse(), 0.0);
  Eigen::MatrixXd correlation = scale.asDiagonal() * p * scale.asDiagonal();
  require((correlation - correlation.transpose()).cwiseAbs().maxCoeff() < rounding,
          "snapshot: the covariance is not symmetric");
  correlation.diagonal().array() += rounding;
  for (Eigen::Index i = 0; i < p.rows(); ++i) {
    if (!(sigma[i] > 0)) correlation(i, i) = 1;
  }
  require(Eigen::LLT<Eigen::MatrixXd>(correlation).info() == Eigen::Success,
          "snapshot: the covariance is not positive semidefinite");
}

}  // namespace

SlamFilter::SlamFilter(const SlamOptions& options)
    : options_((options.check(), options)),
      layout_(options),
      camera_(options.camera),
      covariance_(options.precision == SlamPrecision::kFloat, layout_.dim,
                  layout_.dim + kInverseDepthDim * options.map.max_features, 2 * std::max(options.map.max_measured, 3)),
      transition_(layout_),
      ahead_(layout_),
      ransac_(options.association, options.motion, options.map.max_measured),
      watch_(options.camera, {.judge_centre = options.motion == SlamMotion::kInertial}),
      dx_(covariance_.capacity()),
      shear_(covariance_.capacity(), 3) {
  const auto features = static_cast<std::size_t>(options.map.max_features);
  landmarks_.reserve(features);
  measurements_.resize(features);
  which_.reserve(features);
  candidates_.reserve(features);
  young_.reserve(features);
  residual_.reserve(2 * features);
  accepted_.reserve(2 * features);
  accepted_residual_.reserve(2 * features);
  points_before_.resize(features);
  ranges_.reserve(features);
  marked_.reserve(features);
  agrees_.reserve(features);
  depths_.reserve(features);
  sighted_.reserve(features);
  cells_.resize(static_cast<std::size_t>(options.map.grid_columns * options.map.grid_rows));
  frame_.features.reserve(2 * features);
  by_id_.reserve(kUsualFeatures);
  taken_.reserve(kUsualFeatures);
}

bool SlamFilter::is_usable(TimeNs time_ns) {
  return time_ns >= -kFarthestTime && time_ns <= kFarthestTime;
}

void SlamFilter::start(TimeNs time_ns, const SlamState& state, const Eigen::MatrixXd& covariance) {
  state_ = state;
  first_ = state;
  time_ns_ = time_ns;
  landmarks_.clear();
  transition_.reset();
  covariance_.reset(covariance);
  frame_.counts = SlamCounts{};
  frame_.features.clear();
  expected_.clear();
  watch_.break_off();
  forget_location();
  add_known_landmarks();
}

void SlamFilter::expect_depth(std::int64_t id, double inverse_depth, double sigma) {
  const auto place = std::lower_bound(expected_.begin(), expected_.end(), id,
                                      [](const ExpectedDepth& one, std::int64_t other) { return one.id < other; });
  expected_.insert(place, {id, inverse_depth, sigma});
}

void SlamFilter::start(TimeNs time_ns) {
  SlamState state;
  // Camera: z along x of world, y down.
  const Eigen::Quaterniond looking(0.5, -0.5, 0.5, -0.5);
  state.q_world_body = options_.q_world_body ? options_.q_world_body->normalized()
                                             : looking * options_.camera.T_body_camera.rotation.conjugate();
  state.position = options_.position;
  state.velocity = options_.velocity;
  state.angular_velocity = options_.angular_velocity;
  state.T_body_camera = options_.camera.T_body_camera;
  state.time_offset_s = options_.camera.time_offset_s;
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(layout_.dim);
  sigma.segment<3>(kTheta).setConstant(options_.sigma_orientation);
  sigma.segment<3>(kPosition).setConstant(options_.sigma_position);
  sigma.segment<3>(kVelocity).setConstant(options_.sigma_velocity);
  if (layout_.inertial) {
    sigma.segment<3>(kGyroscopeBias).setConstant(options_.imu_noise.gyroscope_bias_sigma);
    sigma.segment<3>(kAccelerometerBias).setConstant(options_.imu_noise.accelerometer_bias_sigma);
  } else {
    sigma.segment<3>(kAngularVelocity).setConstant(options_.sigma_angular_velocity);
  }
  if (layout_.extrinsic_rotation >= 0) {
    sigma.segment<3>(layout_.extrinsic_rotation).setConstant(options_.sigma_extrinsic_rotation);
    sigma.segment<3>(layout_.extrinsic_position).setConstant(options_.sigma_extrinsic_position);
  }
  if (layout_.time_offset >= 0) sigma[layout_.time_offset] = options_.sigma_time_offset;
  start(time_ns, state, Eigen::MatrixXd(sigma.array().square().matrix().asDiagonal()));
}

bool SlamFilter::healthy() const {
  const auto finite = [](const Eigen::Quaterniond& q) { return q.coeffs().allFinite(); };
  bool good = finite(state_.q_world_body) && finite(state_.T_body_camera.rotation) && state_.position.allFinite() &&
              state_.velocity.allFinite() && state_.angular_velocity.allFinite();
  for (int i = 0; i < layout_.dim && good; ++i) {
    const double variance = covariance_(i, i);
    good = std::isfinite(variance) && variance >= 0;
  }
  return good;
}

void SlamFilter::stop() {
  time_ns_ = kNoTime;
  landmarks_.clear();
  transition_.reset();
  frame_.features.clear();
  frame_.counts = SlamCounts{};
}

void SlamFilter::propagate(TimeNs time_ns) {
  const double dt = to_seconds(time_ns - time_ns_);
  if (dt > 0) {
    transition_.move(state_, dt, options_.acceleration_density, options_.angular_acceleration_density);
  }
  time_ns_ = time_ns;
}

void SlamFilter::propagate(TimeNs time_ns, const InertialStep& step, const InertialStepNoise& noise) {
  transition_.move(state_, step, noise, {0, 0, -options_.gravity});
  time_ns_ = time_ns;
}

void SlamFilter::bring_covariance_up() {
  first_ = state_;
  if (transition_.empty()) return;
  covariance_.propagate(transition_.f(), transition_.q());
  transition_.reset();
}

void SlamFilter::widen(const Eigen::VectorXd& variance) {
  bring_covariance_up();
  for (int i = 0; i < layout_.dim; ++i) covariance_.inflate(i, 1, variance[i]);
}

Eigen::MatrixXd SlamFilter::head_covariance() const {
  Eigen::MatrixXd p(layout_.dim, layout_.dim);
  covariance_.read(0, 0, p);
  if (transition_.empty()) return p;
  return transition_.f() * p * transition_.f().transpose() + transition_.q();
}

const SlamFrame& SlamFilter::update(const FeaturesMeasurement& frame, std::uint32_t status) {
  const auto begin = std::chrono::steady_clock::now();
  static_cast<Stamp&>(frame_) = frame;
  frame_.camera = frame.camera;
  frame_.counts = SlamCounts{};
  frame_.counts.in_frame = static_cast<std::int64_t>(frame.features.size());
  frame_.nis = 0;
  frame_.iterations = 1;
  frame_.nis_dim = 0;
  if (!std::isnan(frame.sigma_px) && !sigma_is_usable(frame.sigma_px)) ++sigma_not_usable_;
  bring_covariance_up();
  match(frame);
  select_measured(frame);
  update_agreeing(frame);
  rescue(frame);
  estimate_young(frame);
  locate(frame);
  judge(frame);
  const Pose3 T_world_camera = state_.T_world_camera();
  frame_.camera_position = T_world_camera.translation;
  frame_.q_world_camera = T_world_camera.rotation;
  convert_landmarks();
  delete_landmarks();
  if (found_ || !looks_for_map()) add_landmarks(frame);
  report(frame);

  SlamCounts& counts = frame_.counts;
  counts.map = static_cast<std::int64_t>(landmarks_.size());
  total_.in_frame += counts.in_frame;
  total_.measured += counts.measured;
  total_.rescued += counts.rescued;
  total_.rejected += counts.rejected;
  total_.added += counts.added;
  total_.converted += counts.converted;
  total_.deleted += counts.deleted;
  ++frames_;

  frame_.estimate = estimate();
  frame_.estimate.host_time_ns = frame.host_time_ns;
  frame_.estimate.sequence = frame.sequence;
  frame_.estimate.status |= status;
  if (counts.measured + counts.added < kFewest) frame_.estimate.status |= kFewFeatures;
  if (counts.rejected > counts.measured) frame_.estimate.status |= kFeaturesRejected;
  watch_.see(frame_);
  if (watch_.doubtful()) frame_.estimate.status |= kCalibrationDoubtful;
  if (lost_) frame_.estimate.status |= kLost;
  if (refound_) frame_.estimate.status |= kRefound;
  if (left_frame_ >= 0) frame_.estimate.status |= kMapLinkUnknown;
  frame_.time_spent_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return frame_;
}

void SlamFilter::predict_frame(TimeNs time_ns, SlamPrediction& out) const {
  SlamState ahead = state_;
  ahead_ = transition_;
  const double dt = to_seconds(time_ns - time_ns_);
  if (dt > 0) ahead_.move(ahead, dt, options_.acceleration_density, options_.angular_acceleration_density);
  predict_frame_at(ahead, time_ns, out);
}

void SlamFilter::predict_frame(TimeNs time_ns, const InertialStep& step, const InertialStepNoise& noise,
                               SlamPrediction& out) const {
  SlamState ahead = state_;
  ahead_ = transition_;
  if (step.dt_s > 0) ahead_.move(ahead, step, noise, {0, 0, -options_.gravity});
  predict_frame_at(ahead, time_ns, out);
}

void SlamFilter::predict_lost(TimeNs time_ns, SlamPrediction& out) const {
  out.time_ns = time_ns;
  out.valid = false;
  out.lost = true;
  out.T_world_camera = state_.T_world_camera();
  out.features.resize(landmarks_.size());
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const SlamLandmark& landmark = landmarks_[i];
    SlamFeaturePrediction& feature = out.features[i];
    feature.id = landmark.id;
    feature.visible = false;
    feature.placed = is_placed(landmark);
    if (landmark.point.converted) {
      feature.point = landmark.point.position;
      feature.weight = 1;
    } else {
      const InverseDepthPoint& p = landmark.point.inverse_depth;
      feature.weight = std::max(0.0, p.inverse_depth);
      feature.point = feature.weight * p.anchor + p.ray();
    }
  }
}

// With x' = F x + noise of Q: S = (H F) P (H F)^T + H_h Q H_h^T + R, so that P stays as it is.
void SlamFilter::predict_frame_at(const SlamState& ahead, TimeNs time_ns, SlamPrediction& out) const {
  predict_lost(time_ns, out);
  out.valid = true;
  out.lost = !found_;
  out.T_world_camera = ahead.T_world_camera();
  const int dim = layout_.dim;
  BlockMeasurement m;
  m.rows = 2;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const SlamLandmark& landmark = landmarks_[i];
    SlamFeaturePrediction& feature = out.features[i];
    const auto pixel = predict(ahead, camera_, landmark.point);
    feature.visible = pixel && camera_.in_image(*pixel, options_.map.border_px);
    if (!feature.visible) continue;
    const auto jacobian = jacobian_of(ahead, layout_, camera_, landmark.point);
    feature.visible = jacobian.has_value();
    if (!feature.visible) continue;
    feature.pixel_px = *pixel;
    const auto head = jacobian->head.leftCols(dim);
    m.noise_cov.topLeftCorner<2, 2>() = options_.sigma_px * options_.sigma_px * Eigen::Matrix2d::Identity();
    if (options_.second_order_noise && !landmark.point.converted) {
      m.noise_cov.topLeftCorner<2, 2>() += product_cov(landmark, jacobian->by_way, ahead_);
    }
    if (ahead_.empty()) {
      m.head.topLeftCorner(2, dim) = head;
    } else {
      m.head.topLeftCorner(2, dim) = head.lazyProduct(ahead_.f());
      Eigen::Matrix<double, 2, kMaxHeadDim> noise;
      noise.leftCols(dim) = head.lazyProduct(ahead_.q());
      m.noise_cov.topLeftCorner<2, 2>() += noise.leftCols(dim).lazyProduct(head.transpose());
    }
    m.block = landmark.offset;
    m.block_dim = landmark.point.dim();
    m.block_jacobian.topRows<2>() = jacobian->block;
    feature.search_cov = covariance_.innovation_cov(m).topLeftCorner<2, 2>();
  }
}

bool SlamFilter::zero_velocity(double sigma_velocity, const Eigen::Vector3d& rate, double sigma_rate) {
  bring_covariance_up();
  BlockMeasurement& m = measurements_.front();
  m.rows = 6;
  m.block = -1;
  m.head.setZero();
  m.noise_cov.setZero();
  m.head.block<3, 3>(0, kVelocity).setIdentity();
  m.residual.head<3>() = -state_.velocity;
  // The rate: with an IMU that of the gyroscope is its bias, without one the state's own is zero.
  m.head.block<3, 3>(3, layout_.inertial ? kGyroscopeBias : kAngularVelocity).setIdentity();
  m.residual.tail<3>() = layout_.inertial ? Eigen::Vector3d(rate - state_.gyroscope_bias) : -state_.angular_velocity;
  for (int i = 0; i < 3; ++i) {
    m.noise_cov(i, i) = sigma_velocity * sigma_velocity;
    m.noise_cov(3 + i, 3 + i) = sigma_rate * sigma_rate;
  }
  constexpr double kGate = 22.46;  // chi-square of 6, 0.999
  which_.assign(1, 0);
  covariance_.innovate(measurements_, which_);
  Eigen::Matrix<double, 6, 6> s;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) s(i, j) = covariance_.s(std::max(i, j), std::min(i, j));
  }
  if (!(m.residual.dot(s.ldlt().solve(m.residual)) < kGate)) return false;
  accepted_.assign({0, 1, 2, 3, 4, 5});
  accepted_residual_.assign(m.residual.data(), m.residual.data() + 6);
  if (!covariance_.update(accepted_, accepted_residual_, dx_, nis_)) {
    ++failed_updates_;
    return false;
  }
  apply_update();
  return true;
}

Estimate SlamFilter::estimate() const {
  Estimate out;
  out.time_ns = time_ns_;
  out.valid = kValidOrientation | kValidPosition | kValidVelocity | kValidCovariance;
  out.q_world_body = state_.q_world_body;
  out.position = state_.position;
  out.velocity = state_.velocity;
  out.angular_velocity = state_.angular_velocity;
  if (layout_.inertial) {
    out.valid |= kValidGyroscopeBias | kValidAccelerometerBias;
    out.gyroscope_bias = state_.gyroscope_bias;
    out.accelerometer_bias = state_.accelerometer_bias;
  } else if (options_.landmarks.empty()) {
    out.status |= kScaleUnknown;
  }
  out.covariance_dim = layout_.inertial ? kInertialDim : kGyroscopeBias;
  // The first rows and columns of F P F^T + Q.
  Eigen::Matrix<double, kMaxHeadDim, kMaxHeadDim> p;
  auto head = p.topLeftCorner(layout_.dim, layout_.dim);
  covariance_.read(0, 0, head);
  out.covariance.setConstant(kUnknown);
  const int n = out.covariance_dim;
  if (transition_.empty()) {
    out.covariance.topLeftCorner(n, n) = p.topLeftCorner(n, n);
  } else {
    Eigen::Matrix<double, kMaxHeadDim, kMaxHeadDim> fp;
    fp.topLeftCorner(layout_.dim, layout_.dim) = transition_.f().lazyProduct(head);
    out.covariance.topLeftCorner(n, n) =
        fp.topLeftCorner(n, layout_.dim).lazyProduct(transition_.f().topRows(n).transpose());
    out.covariance.topLeftCorner(n, n) += transition_.q().topLeftCorner(n, n);
  }
  return out;
}

NamedCounts SlamFilter::counts() const {
  return {{"slam.frames", frames_},
          {"slam.features", total_.in_frame},
          {"slam.features.not_usable", not_usable_},
          {"slam.features.ambiguous", ambiguous_},
          {"slam.sigma_px.not_usable", sigma_not_usable_},
          {"slam.measured", total_.measured},
          {"slam.rescued", total_.rescued},
          {"slam.rejected", total_.rejected},
          {"slam.added", total_.added},
          {"slam.converted", total_.converted},
          {"slam.deleted", total_.deleted},
          {"slam.failed_updates", failed_updates_},
          {"slam.lost", lost_frames_},
          {"slam.refound", times_refound_},
          {"slam.gone_on", times_gone_on_},
          {"slam.map", static_cast<std::int64_t>(landmarks_.size())}};
}

SlamSnapshot SlamFilter::snapshot() const {
  return {time_ns_, state_, landmarks_, covariance_.dense()};
}

void SlamFilter::restore(const SlamSnapshot& snapshot) {
  require(snapshot.landmarks.size() <= static_cast<std::size_t>(options_.map.max_features),
          "snapshot has " + std::to_string(snapshot.landmarks.size()) + " features, map.max_features is " +
              std::to_string(options_.map.max_features));
  int dim = layout_.dim;
  for (const SlamLandmark& landmark : snapshot.landmarks) {
    require(landmark.offset == dim, "snapshot: feature " + std::to_string(landmark.id) + " is out of place");
    dim += landmark.point.dim();
  }
  require(snapshot.covariance.rows() == dim && snapshot.covariance.cols() == dim,
          "snapshot: the covariance does not fit its features (motion model, estimate_extrinsics or "
          "estimate_time_offset may differ)");
  require(snapshot.time_ns != kNoTime && snapshot.covariance.allFinite(), "snapshot: not finite, or without a time");
  require_covariance(snapshot.covariance, options_.precision == SlamPrecision::kFloat ? kRoundingOfFloat : kRounding);
  const SlamState& state = snapshot.state;
  const auto is_rotation = [](const Eigen::Quaterniond& q) { return std::abs(q.norm() - 1) < 1e-6; };
  require(is_rotation(state.q_world_body) && is_rotation(state.T_body_camera.rotation),
          "snapshot: a quaternion is not of length 1");
  require(state.position.allFinite() && state.velocity.allFinite() && state.angular_velocity.allFinite() &&
              state.gyroscope_bias.allFinite() && state.accelerometer_bias.allFinite() &&
              state.T_body_camera.translation.allFinite() && std::isfinite(state.time_offset_s),
          "snapshot: the state is not finite");
  std::set<std::int64_t> ids;
  for (const SlamLandmark& landmark : snapshot.landmarks) {
    const std::string name = "snapshot: feature " + std::to_string(landmark.id);
    require(ids.insert(landmark.id).second, name + " comes twice");
    const auto is_finite = [&](const SlamPoint& point) {
      const InverseDepthPoint& p = point.inverse_depth;
      if (point.converted) return point.position.allFinite();
      return p.anchor.allFinite() && is_rotation(p.frame) && std::isfinite(p.inverse_depth);
    };
    require(landmark.first.converted == landmark.point.converted, name + " is of two kinds");
    require(is_finite(landmark.point) && is_finite(landmark.first) && std::isfinite(landmark.tries) &&
                std::isfinite(landmark.hits),
            name + " is not finite");
  }
  time_ns_ = snapshot.time_ns;
  state_ = snapshot.state;
  first_ = snapshot.state;
  landmarks_ = snapshot.landmarks;
  landmarks_.reserve(static_cast<std::size_t>(options_.map.max_features));
  for (SlamLandmark& landmark : landmarks_)
    landmark.last_measured_frame = landmark.first_frame = -1;  // of another run: older than all of this
  forget_location();
  covariance_.set_dense(snapshot.covariance);
  transition_.reset();
  expected_.clear();
  frame_.features.clear();
  frame_.counts = SlamCounts{};
}

}  // namespace loc
