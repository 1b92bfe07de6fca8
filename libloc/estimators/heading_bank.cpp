#include "libloc/estimators/heading_bank.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

// An outlier hits all of them; it must not decide by how much.
constexpr double kMostNis = 100;
constexpr double kRemembered = 0.8;  // of earlier NIS: the start may be off, the present must fit
constexpr double kSigmaPerDistance = 0.6;
constexpr double kNegligible = 1e-6;  // likelihood against the best one's
// Filters closer than this have come to the same heading.
constexpr double kSameHeading = 0.7;  // [rad]

double wrapped(double angle) {
  return std::remainder(angle, 2 * std::numbers::pi);
}

double log_determinant(const FusionResult& result) {
  const Eigen::Index n = result.innovation_cov.rows();
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, FusionResult::kMaxDim, FusionResult::kMaxDim> S =
      result.innovation_cov;
  const Eigen::LLT<Eigen::Ref<decltype(S)>> llt(S);
  double sum = 0;
  for (Eigen::Index i = 0; i < n; ++i) sum += 2 * std::log(S(i, i));
  return sum;
}

// Of two states, as an error state; clones are left out.
Eigen::VectorXd difference(const ErrorStateState& a, const ErrorStateState& b, const ErrorStateLayout& layout) {
  Eigen::VectorXd d = Eigen::VectorXd::Zero(layout.size);
  const InertialState& x = a.inertial;
  const InertialState& y = b.inertial;
  d.segment<3>(kTheta) = so3::boxminus(x.q_world_body, y.q_world_body);
  d.segment<3>(kPosition) = x.position - y.position;
  d.segment<3>(kVelocity) = x.velocity - y.velocity;
  d.segment<3>(kGyroscopeBias) = x.gyroscope_bias - y.gyroscope_bias;
  d.segment<3>(kAccelerometerBias) = x.accelerometer_bias - y.accelerometer_bias;
  if (layout.scale >= 0) d[layout.scale] = a.scale - b.scale;
  if (layout.drift >= 0) d.segment<3>(layout.drift) = a.drift - b.drift;
  if (layout.extrinsics >= 0) {
    d.segment<3>(layout.extrinsics) = so3::boxminus(a.T_body_odometry.rotation, b.T_body_odometry.rotation);
    d.segment<3>(layout.extrinsics + 3) = a.T_body_odometry.translation - b.T_body_odometry.translation;
  }
  return d;
}

}  // namespace

void HeadingBankOptions::check() const {
  require(headings >= 4 && headings <= 72, "headings", headings, "must be 4 to 72");
  require_positive("separation", separation);
  require_positive("max_heading_sigma", max_heading_sigma);
  require(min_measurements >= 1, "min_measurements", min_measurements, "must be positive");
  require_positive("max_mean_nis", max_mean_nis);
}

double heading_variance(const ErrorStateState& state, const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  const Eigen::Vector3d up = state.inertial.q_world_body.inverse() * Eigen::Vector3d::UnitZ();
  return up.dot(covariance.block<3, 3>(kTheta, kTheta) * up);
}

void turn_heading(double angle, double sigma, ErrorStateState& state, Eigen::MatrixXd& covariance) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()));
  InertialState& x = state.inertial;
  x.q_world_body = (turn * x.q_world_body).normalized();
  x.velocity = turn * x.velocity;
  const Eigen::Matrix3d R = turn.toRotationMatrix();
  for (const int at : {kPosition, kVelocity}) {
    covariance.middleRows<3>(at) = (R * covariance.middleRows<3>(at)).eval();
    covariance.middleCols<3>(at) = (covariance.middleCols<3>(at) * R.transpose()).eval();
  }
  Eigen::VectorXd direction = Eigen::VectorXd::Zero(covariance.rows());
  direction.segment<3>(kTheta) = x.q_world_body.inverse() * Eigen::Vector3d::UnitZ();
  direction.segment<3>(kVelocity) = Eigen::Vector3d::UnitZ().cross(x.velocity);
  covariance += sigma * sigma * direction * direction.transpose();
}

HeadingBank::HeadingBank(const HeadingBankOptions& options, const ErrorStateOptions& filter) : options_(options) {
  options_.check();
  filters_.emplace_back(filter);
  scores_.assign(1, 0);
  nis_.assign(1, 0);
}

void HeadingBank::start(TimeNs time_ns, const ErrorStateState& state, const Eigen::MatrixXd& covariance) {
  std::swap(filters_.front(), filters_[best_]);
  filters_.erase(filters_.begin() + 1, filters_.end());
  scores_.assign(1, 0);
  nis_.assign(1, 0);
  best_ = 0;
  scored_ = 0;
  dof_ = 0;
  filters_.front().start(time_ns, state, covariance);
}

void HeadingBank::start_all_headings(TimeNs time_ns, const ErrorStateState& state, const Eigen::MatrixXd& covariance) {
  // A heading that is not known has no uncertainty of its own.
  Eigen::MatrixXd known = covariance;
  const Eigen::Vector3d up = state.inertial.q_world_body.inverse() * Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d tilt_only = Eigen::Matrix3d::Identity() - up * up.transpose();
  known.middleRows<3>(kTheta) = (tilt_only * known.middleRows<3>(kTheta)).eval();
  known.middleCols<3>(kTheta) = (known.middleCols<3>(kTheta) * tilt_only).eval();
  start(time_ns, state, known);
  const double distance = 2 * std::numbers::pi / options_.headings;
  for (int i = 0; i < options_.headings; ++i) {
    ErrorStateState turned = state;
    Eigen::MatrixXd cov = known;
    turn_heading(distance * i, kSigmaPerDistance * distance, turned, cov);
    if (i > 0) filters_.push_back(filters_.front());
    filters_.back().start(time_ns, turned, cov);
  }
  scores_.assign(filters_.size(), 0);
  nis_.assign(filters_.size(), 0);
}

void HeadingBank::score(std::size_t i, const FusionResult& result) {
  const bool judged = result.outcome == FusionOutcome::kAccepted || result.outcome == FusionOutcome::kGated;
  if (!judged || result.source != FusionSource::kGps) return;
  scores_[i] += std::min(result.nis, kMostNis) + log_determinant(result);
  nis_[i] = kRemembered * nis_[i] + std::min(result.nis, kMostNis);
  if (i == 0) {
    ++scored_;
    dof_ = kRemembered * dof_ + result.dof;
  }
}

void HeadingBank::find_best() {
  best_ = static_cast<std::size_t>(std::ranges::min_element(scores_) - scores_.begin());
}

PredictOutcome HeadingBank::predict(const ImuMeasurement& imu) {
  if (filters_.size() == 1) return filters_.front().predict(imu);
  PredictOutcome outcome = PredictOutcome::kNotStarted;
  for (std::size_t i = 0; i < filters_.size(); ++i) {
    outcome = filters_[i].predict(imu);
    for (const FusionResult& result : filters_[i].finished()) score(i, result);
  }
  find_best();
  return outcome;
}

FusionResult HeadingBank::fuse(const std::function<FusionResult(ErrorStateFilter&)>& feed) {
  FusionResult of_best;
  for (std::size_t i = 0; i < filters_.size(); ++i) {
    const FusionResult result = feed(filters_[i]);
    if (filters_.size() > 1) score(i, result);
    if (i == best_) of_best = result;
  }
  if (filters_.size() > 1) find_best();
  return of_best;
}

void HeadingBank::widen(const Eigen::VectorXd& variances) {
  for (ErrorStateFilter& filter : filters_) filter.widen(variances);
}

bool HeadingBank::decide() {
  if (filters_.size() == 1 || scored_ < options_.min_measurements) return false;
  const ErrorStateFilter& best = filters_[best_];
  if (loc::heading_variance(best.state(), best.covariance()) >
      options_.max_heading_sigma * options_.max_heading_sigma) {
    return false;
  }
  if (nis_[best_] > options_.max_mean_nis * dof_) return false;
  const double heading = so3::heading(best.state().inertial.q_world_body);
  for (std::size_t i = 0; i < filters_.size(); ++i) {
    const double other = so3::heading(filters_[i].state().inertial.q_world_body);
    if (std::abs(wrapped(other - heading)) < kSameHeading) continue;
    if (scores_[i] - scores_[best_] < options_.separation) return false;
  }
  const ErrorStateState state = best.state();
  const Eigen::MatrixXd covariance = mixed_covariance();
  start(best.time_ns(), state, covariance);
  return true;
}

// Second moment about the best one: what separates filters that are nearly as likely is not known.
Eigen::MatrixXd HeadingBank::mixed_covariance() const {
  const ErrorStateFilter& best = filters_[best_];
  const ErrorStateLayout& layout = best.layout();
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(layout.size, layout.size);
  double weights = 0;
  for (std::size_t i = 0; i < filters_.size(); ++i) {
    const double weight = std::exp(-0.5 * (scores_[i] - scores_[best_]));
    if (weight < kNegligible) continue;
    const Eigen::VectorXd off = difference(filters_[i].state(), best.state(), layout);
    weights += weight;
    sum += weight * (filters_[i].covariance() + off * off.transpose());
  }
  sum /= weights;
  return 0.5 * (sum + sum.transpose());
}

double HeadingBank::spread() const {
  if (filters_.size() == 1) return 0;
  const double heading = so3::heading(filters_[best_].state().inertial.q_world_body);
  double weights = 0;
  double sum = 0;
  for (std::size_t i = 0; i < filters_.size(); ++i) {
    const double weight = std::exp(-0.5 * (scores_[i] - scores_[best_]));
    const double off = wrapped(so3::heading(filters_[i].state().inertial.q_world_body) - heading);
    weights += weight;
    sum += weight * off * off;
  }
  return sum / weights;
}

double HeadingBank::heading_variance() const {
  return loc::heading_variance(best().state(), best().covariance()) + spread();
}

}  // namespace loc
