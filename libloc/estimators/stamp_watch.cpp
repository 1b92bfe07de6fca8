#include "libloc/estimators/stamp_watch.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr TimeNs kGrid = 10'000'000;
constexpr TimeNs kStep = 20'000'000;         // between the offsets that are tried
constexpr TimeNs kFarthest = 2'000'000'000;  // offset
constexpr TimeNs kWindow = 10'000'000'000;
constexpr auto kMost = static_cast<std::size_t>((kWindow + 4 * kFarthest) / kGrid);
constexpr TimeNs kEvery = 2'000'000'000;  // judgement
constexpr TimeNs kGap = 500'000'000;
constexpr std::size_t kFewestTurns = 60;
constexpr std::size_t kFewestFeatures = 6;
constexpr double kLeastRate = 0.05;  // root mean square, about the mean [rad/s]
constexpr double kOwnScale = 2e-3;   // directions that fit worse count less [rad]
constexpr double kLeastCorrelation = 0.6;
constexpr double kClearlyBetter = 0.15;  // than at zero
constexpr double kUnique = 0.05;         // than at offsets that are further away than kNear
constexpr TimeNs kNear = 400'000'000;
constexpr double kLeastOffset = 0.05;  // that is called a doubt [s]
constexpr double kSame = 0.1;          // two judgements in a row [s]
constexpr double kLeastFine = 0.02;    // the same, of the offset by least squares, …
constexpr double kFineSigmas = 5;      // … which is so far from zero
constexpr double kSameFine = 0.015;    // two judgements in a row [s]
constexpr double kAgree = 0.03;        // with the best correlation [s]
constexpr int kFineInARow = 3;
constexpr double kWellKnown = 0.01;  // deviation with which it is better than the best correlation [s]
constexpr double kMostStep = 0.05;   // of an iteration [s]
constexpr double kMostCorrelation = 0.98;
constexpr int kPasses = 5;

}  // namespace

double StampWatch::offset_s() const {
  return sigma_s_ <= kWellKnown && std::abs(fine_s_ - offset_s_) <= kAgree ? fine_s_ : offset_s_;
}

StampWatch::StampWatch(const CameraCalibration& camera) : StampWatch() {
  camera_.emplace(camera);
  body_camera_ = camera.T_body_camera.rotation.toRotationMatrix();
  offset_ns_ = from_seconds(camera.time_offset_s);
}

StampWatch::StampWatch() {
  // Room for all, so that nothing is allocated later.
  for (std::size_t i = 0; i <= kMost; ++i) angles_.push_back(angle_);
  while (!angles_.empty()) angles_.drop_front();
}

void StampWatch::reset() {
  while (!angles_.empty()) angles_.drop_front();
  while (!turns_.empty()) turns_.drop_front();
  grid_ns_ = imu_ns_ = frame_ns_ = judged_ns_ = kNoTime;
  angle_.setZero();
  last_.clear();
  before_s_ = offset_s_ = correlation_ = fine_s_ = sigma_s_ = kUnknown;
  fine_in_a_row_ = 0;
  doubtful_ = false;
}

void StampWatch::see(const ImuMeasurement& imu) {
  if (!imu.angular_velocity.allFinite()) return;
  if (imu_ns_ == kNoTime || imu.time_ns <= imu_ns_ || imu.time_ns - imu_ns_ > kGap) {
    while (!angles_.empty()) angles_.drop_front();
    grid_ns_ = imu_ns_ = imu.time_ns;
    angle_.setZero();
    angles_.push_back(angle_);
    return;
  }
  // The rate of this sample is that of the time since the last one.
  const Eigen::Vector3d before = angle_;
  angle_ += to_seconds(imu.time_ns - imu_ns_) * imu.angular_velocity;
  for (TimeNs next = grid_ns_ + static_cast<TimeNs>(angles_.size()) * kGrid; next <= imu.time_ns; next += kGrid) {
    const double part = static_cast<double>(next - imu_ns_) / static_cast<double>(imu.time_ns - imu_ns_);
    angles_.push_back(before + part * (angle_ - before));
  }
  imu_ns_ = imu.time_ns;
  while (angles_.size() > kMost) {
    angles_.drop_front();
    grid_ns_ += kGrid;
  }
}

// phi that fits r1 - r0 = r0 x phi, the outliers put aside by weights.
bool StampWatch::turn_between(const FeaturesMeasurement& frame, Eigen::Vector3d& turn) const {
  pairs_.clear();
  for (const FeatureObservation& feature : frame.features) {
    const auto before = std::lower_bound(last_.begin(), last_.end(), feature.id,
                                         [](const auto& entry, std::int64_t id) { return entry.first < id; });
    if (before == last_.end() || before->first != feature.id || !feature.pixel_px.allFinite()) continue;
    if (const auto ray = camera_->unproject(feature.pixel_px)) pairs_.emplace_back(before->second, *ray);
  }
  if (pairs_.size() < kFewestFeatures) return false;
  turn.setZero();
  for (int pass = 0; pass < 3; ++pass) {
    Eigen::Matrix3d normal = 1e-9 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const auto& [r0, r1] : pairs_) {
      const double left = pass == 0 ? 0 : (r1 - r0 - r0.cross(turn)).norm() / kOwnScale;
      const double weight = 1 / (1 + left * left);
      normal += weight * (Eigen::Matrix3d::Identity() - r0 * r0.transpose());
      right -= weight * r0.cross(r1);
    }
    turn = normal.ldlt().solve(right);
  }
  return turn.allFinite();
}

void StampWatch::see(const FeaturesMeasurement& frame) {
  if (!camera_) return;
  const bool follows = frame_ns_ != kNoTime && frame.time_ns > frame_ns_ && frame.time_ns - frame_ns_ <= kGap;
  Eigen::Vector3d turn;
  if (follows && turn_between(frame, turn)) {
    const double dt = to_seconds(frame.time_ns - frame_ns_);
    turns_.push_back({frame_ns_ + offset_ns_, frame.time_ns + offset_ns_, body_camera_ * turn / dt});
  } else if (!follows) {
    begin_anew();
  }
  last_.clear();
  for (const FeatureObservation& feature : frame.features) {
    if (!feature.pixel_px.allFinite()) continue;
    if (const auto ray = camera_->unproject(feature.pixel_px)) last_.emplace_back(feature.id, *ray);
  }
  std::sort(last_.begin(), last_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  follow(frame.time_ns);
}

void StampWatch::see(const OdometryMeasurement& odometry) {
  if (odometry.time_ns == kNoTime || !odometry.rotation.coeffs().allFinite()) return;
  const bool relative = odometry.start_time_ns != kNoTime;
  const TimeNs from = relative ? odometry.start_time_ns : frame_ns_;
  const bool follows = from != kNoTime && odometry.time_ns > from &&
                       apart_s(odometry.time_ns, from) <= to_seconds(kGap) &&
                       (frame_ns_ == kNoTime ||
                        (odometry.time_ns > frame_ns_ && apart_s(odometry.time_ns, frame_ns_) <= to_seconds(kGap)));
  if (follows) {
    const Eigen::Quaterniond turned = relative ? odometry.rotation : pose_.conjugate() * odometry.rotation;
    turns_.push_back({from, odometry.time_ns, so3::log(turned.normalized()) / to_seconds(odometry.time_ns - from)});
  } else {
    begin_anew();
  }
  pose_ = odometry.rotation;
  follow(odometry.time_ns);
}

void StampWatch::begin_anew() {
  while (!turns_.empty()) turns_.drop_front();
  judged_ns_ = kNoTime;
  fine_in_a_row_ = 0;
}

// After the turn that ends at this time.
void StampWatch::follow(TimeNs time_ns) {
  frame_ns_ = time_ns;
  while (!turns_.empty() && turns_.back().end_ns - turns_.front().begin_ns > kWindow + 2 * kFarthest) {
    turns_.drop_front();
  }
  if (judged_ns_ == kNoTime) judged_ns_ = time_ns;
  if (time_ns - judged_ns_ < kEvery) return;
  judged_ns_ = time_ns;
  judge();
}

bool StampWatch::angle_at(TimeNs time_ns, Eigen::Vector3d& angle) const {
  if (time_ns < grid_ns_) return false;
  const auto i = static_cast<std::size_t>((time_ns - grid_ns_) / kGrid);
  if (i + 1 >= angles_.size()) return false;
  const double part = static_cast<double>((time_ns - grid_ns_) % kGrid) / static_cast<double>(kGrid);
  angle = angles_[i] + part * (angles_[i + 1] - angles_[i]);
  return true;
}

// Of turns_[from, to) with the gyroscope's, moved. false: there is none, or too little turning.
bool StampWatch::correlate(TimeNs shift_ns, std::size_t from, std::size_t to, double& correlation) {
  Eigen::Vector3d sum_c = Eigen::Vector3d::Zero();
  Eigen::Vector3d sum_g = Eigen::Vector3d::Zero();
  double cc = 0;
  double gg = 0;
  double cg = 0;
  for (std::size_t i = from; i < to; ++i) {
    const Turn& turn = turns_[i];
    Eigen::Vector3d begin;
    Eigen::Vector3d end;
    if (!angle_at(turn.begin_ns + shift_ns, begin) || !angle_at(turn.end_ns + shift_ns, end)) return false;
    const Eigen::Vector3d g = (end - begin) / to_seconds(turn.end_ns - turn.begin_ns);
    sum_c += turn.rate;
    sum_g += g;
    cc += turn.rate.squaredNorm();
    gg += g.squaredNorm();
    cg += turn.rate.dot(g);
  }
  const auto n = static_cast<double>(to - from);
  cc -= sum_c.squaredNorm() / n;
  gg -= sum_g.squaredNorm() / n;
  cg -= sum_c.dot(sum_g) / n;
  const double least = n * kLeastRate * kLeastRate;
  if (!(cc > least && gg > least)) return false;
  correlation = cg / std::sqrt(cc * gg);
  return true;
}

// Least squares about an offset: rate of the camera = G g(t + d) + b, with a matrix G for what the way of the camera
// adds in step with turning, linear in d. The deviation is that of what is left, widened by its correlation in time:
// the way adds more than that, and slowly.
bool StampWatch::refine(std::size_t from, std::size_t to) {
  constexpr int kColumns = 13;
  constexpr double kH = 0.005;  // for the rate's derivative [s]
  using Normal = Eigen::Matrix<double, kColumns, kColumns>;
  using Vector = Eigen::Matrix<double, kColumns, 1>;
  using Rows = Eigen::Matrix<double, 3, kColumns>;
  const auto rate_at = [&](const Turn& turn, double shift_s, Eigen::Vector3d& rate) {
    Eigen::Vector3d begin;
    Eigen::Vector3d end;
    const TimeNs shift = from_seconds(shift_s);
    if (!angle_at(turn.begin_ns + shift, begin) || !angle_at(turn.end_ns + shift, end)) return false;
    rate = (end - begin) / to_seconds(turn.end_ns - turn.begin_ns);
    return true;
  };
  const auto rows_of = [&](const Turn& turn, double shift_s, Rows& rows) {
    Eigen::Vector3d now;
    Eigen::Vector3d after;
    Eigen::Vector3d before;
    if (!rate_at(turn, shift_s, now) || !rate_at(turn, shift_s + kH, after) || !rate_at(turn, shift_s - kH, before)) {
      return false;
    }
    rows.setZero();
    for (int k = 0; k < 3; ++k) rows.block<1, 3>(k, 3 * k) = now.transpose();
    rows.block<3, 3>(0, 9).setIdentity();
    rows.col(kColumns - 1) = (after - before) / (2 * kH);
    return true;
  };
  double d = offset_s_;
  double sigma = kUnknown;
  double c = 0;
  Rows rows;
  Rows before = Rows::Zero();
  for (int pass = 0; pass < kPasses; ++pass) {
    Normal normal = Normal::Zero();
    Vector right = Vector::Zero();
    for (std::size_t i = from; i < to; ++i) {
      if (!rows_of(turns_[i], d, rows)) return false;
      if (i > from) {
        const Rows white = rows - c * before;
        normal += white.transpose() * white;
        right += white.transpose() * (turns_[i].rate - c * turns_[i - 1].rate);
      }
      before = rows;
    }
    const Eigen::LDLT<Normal> solver(normal);
    const Vector x = solver.solve(right);
    double squares = 0;
    double white_squares = 0;
    double products = 0;
    Eigen::Vector3d last = Eigen::Vector3d::Zero();
    for (std::size_t i = from; i < to; ++i) {
      rows_of(turns_[i], d, rows);
      const Eigen::Vector3d left = turns_[i].rate - rows * x;
      if (i > from) {
        squares += last.squaredNorm();
        white_squares += (left - c * last).squaredNorm();
        products += left.dot(last);
      }
      last = left;
    }
    const double variance = white_squares / (3 * static_cast<double>(to - from - 1) - kColumns);
    sigma = std::sqrt(variance * Vector(solver.solve(Vector::Unit(kColumns - 1)))[kColumns - 1]);
    d += std::clamp(x[kColumns - 1], -kMostStep, kMostStep);
    if (!std::isfinite(d) || !std::isfinite(sigma)) return false;
    c = std::clamp(squares > 0 ? products / squares : 0, 0.0, kMostCorrelation);
  }
  fine_s_ = d;
  sigma_s_ = sigma;
  return true;
}

void StampWatch::judge() {
  // The turns for which the gyroscope is known at every offset.
  std::size_t from = 0;
  std::size_t to = turns_.size();
  const TimeNs known_from = grid_ns_ + kFarthest;
  const TimeNs known_to = grid_ns_ + (static_cast<TimeNs>(angles_.size()) - 2) * kGrid - kFarthest;
  while (from < to && turns_[from].begin_ns < known_from) ++from;
  while (to > from && turns_[to - 1].end_ns > known_to) --to;
  while (to > from && turns_[to - 1].end_ns - turns_[from].begin_ns > kWindow) ++from;
  if (to - from < kFewestTurns) return;

  std::vector<std::pair<TimeNs, double>>& found = found_;
  found.clear();
  for (TimeNs shift = -kFarthest; shift <= kFarthest; shift += kStep) {
    double correlation = 0;
    if (correlate(shift, from, to, correlation)) found.emplace_back(shift, correlation);
  }
  const auto at_zero = std::find_if(found.begin(), found.end(), [](const auto& one) { return one.first == 0; });
  if (at_zero == found.end()) return;
  const auto best =
      *std::max_element(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  const bool at_border = std::abs(best.first) == kFarthest;
  const bool unique = std::none_of(found.begin(), found.end(), [&](const auto& one) {
    return std::abs(one.first - best.first) > kNear && one.second > best.second - kUnique;
  });
  if (best.second < kLeastCorrelation || at_border || !unique) return;  // says nothing; what was said stays
  const double offset = to_seconds(best.first);
  const bool wrong = std::abs(offset) >= kLeastOffset && best.second - at_zero->second >= kClearlyBetter;
  const bool surely = wrong && std::abs(offset - before_s_) <= kSame;
  before_s_ = wrong ? offset : kUnknown;
  offset_s_ = offset;
  correlation_ = best.second;
  const double fine_before = fine_s_;
  if (!refine(from, to)) {
    fine_s_ = sigma_s_ = kUnknown;
    fine_in_a_row_ = 0;
  }
  const bool agree = sigma_s_ <= kWellKnown && std::abs(fine_s_ - offset) <= kAgree;
  if (!agree || std::abs(fine_s_) < kLeastFine || std::abs(fine_s_) < kFineSigmas * sigma_s_) {
    fine_in_a_row_ = 0;
  } else {
    fine_in_a_row_ = fine_in_a_row_ > 0 && std::abs(fine_s_ - fine_before) <= kSameFine ? fine_in_a_row_ + 1 : 1;
  }
  doubtful_ = surely || fine_in_a_row_ >= kFineInARow;
}

}  // namespace loc
