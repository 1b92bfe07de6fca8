#include "libloc/estimators/gps_lag_watch.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr std::size_t kFewestFixes = 12;
constexpr std::size_t kMostFixes = 400;  // in a window: more are thinned out
constexpr double kLongestWindow = 6;     // of window_s: what took longer tells nothing
constexpr double kHuber = 2.5;           // deviations
constexpr int kPasses = 4;
constexpr double kRegular = 1e-12;
constexpr double kLeastNoise = 0.02;  // of a fix: errors that are no noise [m]
constexpr std::size_t kFewestWindows = 3;
constexpr double kUseful = 5;  // a window with a larger deviation does not count [s]
constexpr double kMostCorrelation = 0.9;
constexpr TimeNs kKept = 3'000'000'000;  // of a reckoning
constexpr TimeNs kEvery = 4'000'000;     // between its points
constexpr double kLongestStep = 1;       // [s]
constexpr double kMostAhead = 0.1;       // of its last sample [s]

constexpr int kMostColumns = 9;
using Normal = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostColumns, kMostColumns>;
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostColumns, 1>;
using Rows = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMostColumns>;

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void GpsLagWatchOptions::check() const {
  require_positive("window_s", window_s);
  require(drift_order >= 0 && drift_order <= 2, "drift_order", drift_order, "must be 0, 1 or 2");
  require_positive("least_s", least_s);
  require_positive("least_sigmas", least_sigmas);
}

GpsLagWatch::GpsLagWatch(const GpsLagWatchOptions& options) : options_((options.check(), options)) {
  window_.reserve(kMostFixes);
}

void GpsLagWatch::reset() {
  window_.clear();
  done_ = 0;
  doubtful_ = false;
  offset_s_ = sigma_s_ = kUnknown;
}

void GpsLagWatch::see(TimeNs time_ns, const Eigen::Vector2d& fix, const Eigen::Vector2d& way,
                      const Eigen::Vector2d& velocity) {
  if (!fix.allFinite() || !way.allFinite() || !velocity.allFinite()) return;
  if (!window_.empty() && time_ns <= window_.back().time_ns) return;
  window_.push_back({time_ns, fix, way, velocity});
  const double span = apart_s(time_ns, window_.front().time_ns);
  if (span > kLongestWindow * options_.window_s) {
    window_.clear();
    return;
  }
  if (window_.size() == kMostFixes) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < window_.size(); i += 2) window_[kept++] = window_[i];
    window_.resize(kept);
  }
  if (span < options_.window_s || window_.size() < kFewestFixes) return;
  if (const auto result = solve()) {
    results_[done_++ % kWindows] = *result;
    judge();
  }
  window_.clear();
}

std::optional<GpsLagWatch::Result> GpsLagWatch::solve() const {
  const auto n = static_cast<double>(window_.size());
  Eigen::Vector2d mean_way = Eigen::Vector2d::Zero();
  Eigen::Vector2d mean_fix = Eigen::Vector2d::Zero();
  for (const Seen& seen : window_) {
    mean_way += seen.way / n;
    mean_fix += seen.fix / n;
  }
  const double half = 0.5 * apart_s(window_.back().time_ns, window_.front().time_ns);
  const int drift = 2 * (options_.drift_order + 1);
  const int columns = drift + (options_.scale_known ? 2 : 3);
  const auto rows_of = [&](const Seen& seen) {
    Rows rows = Rows::Zero(2, columns);
    const double t = apart_s(seen.time_ns, window_.front().time_ns) / half - 1;
    for (int k = 0; k <= options_.drift_order; ++k)
      rows.middleCols(2 * k, 2) = std::pow(t, k) * Eigen::Matrix2d::Identity();
    const Eigen::Vector2d p = seen.way - mean_way;
    rows.col(drift) = Eigen::Vector2d(-p.y(), p.x());
    if (!options_.scale_known) rows.col(drift + 1) = p;
    rows.col(columns - 1) = seen.velocity;
    return rows;
  };
  const auto difference = [&](const Seen& seen) {
    return Eigen::Vector2d((seen.fix - mean_fix) - (seen.way - mean_way));
  };
  Vector x = Vector::Zero(columns);
  Normal normal;
  Eigen::LDLT<Normal> solver;
  std::vector<double> size(window_.size(), 0.0);
  double noise = 0;  // of a coordinate
  for (int pass = 0; pass < kPasses; ++pass) {
    normal = Normal::Zero(columns, columns);
    Vector right = Vector::Zero(columns);
    for (std::size_t i = 0; i < window_.size(); ++i) {
      const Rows rows = rows_of(window_[i]);
      const double weight = pass == 0 || size[i] < kHuber * noise ? 1 : kHuber * noise / size[i];
      normal += weight * rows.transpose() * rows;
      right += weight * rows.transpose() * difference(window_[i]);
    }
    // Directions that were not excited at all stay at zero.
    normal.diagonal() += kRegular * normal.diagonal();
    solver.compute(normal);
    x = solver.solve(right);
    if (!x.allFinite()) return std::nullopt;
    for (std::size_t i = 0; i < window_.size(); ++i) {
      size[i] = (difference(window_[i]) - rows_of(window_[i]) * x).norm();
    }
    std::vector<double> sorted = size;
    // The median of the length of a normal vector in the plane is 1.1774 deviations.
    noise = std::max(kLeastNoise, median(sorted) / 1.1774 * std::sqrt(2 * n / std::max(1.0, 2 * n - columns)));
  }
  double squares = 0;
  double products = 0;
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  for (const Seen& seen : window_) {
    Eigen::Vector2d left = difference(seen) - rows_of(seen) * x;
    if (left.norm() > kHuber * noise) left *= kHuber * noise / left.norm();
    squares += left.squaredNorm();
    products += left.dot(before);
    before = left;
  }
  const double correlation = std::clamp(squares > 0 ? products / squares : 0, 0.0, kMostCorrelation);
  const double variance = std::max(kLeastNoise * kLeastNoise, squares / std::max(1.0, 2 * n - columns)) *
                          (1 + correlation) / (1 - correlation);
  const Vector unit = solver.solve(Vector::Unit(columns, columns - 1));
  const double sigma = std::sqrt(variance * unit[columns - 1]);
  if (!(sigma > 0 && sigma < kUseful)) return std::nullopt;
  return Result{x[columns - 1], sigma};
}

// The mean of the last windows, by their deviations; windows that contradict each other widen its own.
void GpsLagWatch::judge() {
  const std::size_t count = std::min(done_, kWindows);
  if (count < kFewestWindows) return;
  double weights = 0;
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double weight = 1 / (results_[i].sigma_s * results_[i].sigma_s);
    weights += weight;
    sum += weight * results_[i].offset_s;
  }
  offset_s_ = sum / weights;
  double scatter = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double off = (results_[i].offset_s - offset_s_) / results_[i].sigma_s;
    scatter += off * off / static_cast<double>(count - 1);
  }
  sigma_s_ = std::sqrt(std::max(1.0, scatter) / weights);
  doubtful_ = std::abs(offset_s_) > options_.least_s && std::abs(offset_s_) > options_.least_sigmas * sigma_s_;
}

void ImuReckoning::begin(const Point& from, const Eigen::Vector3d& gyroscope_bias,
                         const Eigen::Vector3d& accelerometer_bias) {
  stop();
  points_.push_back(from);
  gyroscope_bias_ = gyroscope_bias;
  accelerometer_bias_ = accelerometer_bias;
}

void ImuReckoning::stop() {
  while (!points_.empty()) points_.drop_front();
}

void ImuReckoning::step(const ImuMeasurement& imu, double gravity) {
  if (points_.empty()) return;
  const Point from = points_.back();
  const double dt = to_seconds(imu.time_ns - from.time_ns);
  if (dt <= 0) return;
  if (dt > kLongestStep) {
    stop();
    return;
  }
  const Eigen::Vector3d turn = dt * (imu.angular_velocity - gyroscope_bias_);
  const Eigen::Quaterniond middle = from.q_world_body * so3::exp(0.5 * turn);
  const Eigen::Vector3d acceleration =
      middle * (imu.specific_force - accelerometer_bias_) - Eigen::Vector3d(0, 0, gravity);
  Point to;
  to.time_ns = imu.time_ns;
  to.position = from.position + dt * from.velocity + 0.5 * dt * dt * acceleration;
  to.velocity = from.velocity + dt * acceleration;
  to.q_world_body = (from.q_world_body * so3::exp(turn)).normalized();
  // The last point is always the newest; those before it are kEvery apart.
  const std::size_t size = points_.size();
  if (size >= 2 && from.time_ns - points_[size - 2].time_ns < kEvery) {
    points_[size - 1] = to;
  } else {
    points_.push_back(to);
  }
  while (points_.size() > 2 && to.time_ns - points_.front().time_ns > kKept) points_.drop_front();
}

std::optional<ImuReckoning::Point> ImuReckoning::at(TimeNs time_ns) const {
  if (points_.empty() || time_ns < points_.front().time_ns) return std::nullopt;
  const double ahead = apart_s(time_ns, points_.back().time_ns);
  if (ahead > kMostAhead) return std::nullopt;
  if (ahead > 0) {
    Point out = points_.back();
    out.time_ns = time_ns;
    out.position += ahead * out.velocity;
    return out;
  }
  std::size_t low = 0;
  std::size_t high = points_.size() - 1;  // the last one at or before the time is in [low, high]
  while (low < high) {
    const std::size_t middle = (low + high + 1) / 2;
    if (points_[middle].time_ns <= time_ns) {
      low = middle;
    } else {
      high = middle - 1;
    }
  }
  const Point& a = points_[low];
  if (low + 1 == points_.size()) return a;
  const Point& b = points_[low + 1];
  const double part = to_seconds(time_ns - a.time_ns) / to_seconds(b.time_ns - a.time_ns);
  Point out = a;
  out.time_ns = time_ns;
  out.position += part * (b.position - a.position);
  out.velocity += part * (b.velocity - a.velocity);
  out.q_world_body = a.q_world_body.slerp(part, b.q_world_body);
  return out;
}

}  // namespace loc
