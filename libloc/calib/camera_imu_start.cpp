#include "libloc/calib/camera_imu_start.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "libloc/calib/least_squares.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc::calib {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Between two pictures whose turn is used [s]: long enough that slow motion is more than the poses' noise.
constexpr double kShortestStep = 0.15;
constexpr double kLongestStep = 0.4;
constexpr double kLeastCorrelation = 0.5;
constexpr double kDoubtfulShare = 0.7;  // of the least correlation, for another peak to be looked at
constexpr std::size_t kPeaks = 6;
constexpr double kMostUnexplained = 0.5;  // of the variance of the turn rates
constexpr double kSecondApart = 0.3;      // [s] from the peak, to count as another one
constexpr double kLeastOverlap = 0.5;     // of the pictures, or of what the shorter recording allows
constexpr std::size_t kLeastSteps = 20;
constexpr double kLeastExcitation = 0.02;  // [rad/s] along the second axis
constexpr double kOtherUnit = 3;           // ratio of the turn rates that no mounting and no scale explains
constexpr double kAroundGiven = 0.5;       // [s] of an offset that is known
constexpr int kRobustRounds = 3;
constexpr double kMostProducts = 1e9;  // of a correlation: seconds; beyond, not every turn is needed

// A turn of the camera between two pictures.
struct Turn {
  double from_s;
  double to_s;
  Vector3d rate;  // mean, in camera
};

std::vector<Turn> turns_of(std::span<const CameraPoseSample> poses) {
  std::vector<Turn> out;
  std::size_t to = 0;
  for (std::size_t from = 0; from < poses.size(); ++from) {
    while (to < poses.size() && poses[to].t_s - poses[from].t_s < kShortestStep) ++to;
    if (to == poses.size()) break;
    const double dt = poses[to].t_s - poses[from].t_s;
    if (dt > kLongestStep) continue;
    const Vector3d turn = so3::boxminus(poses[to].T_target_camera.rotation, poses[from].T_target_camera.rotation);
    out.push_back({poses[from].t_s, poses[to].t_s, turn / dt});
  }
  return out;
}

// Sums over pairs, for a correlation.
struct PairSums {
  double n = 0;
  double x = 0;
  double y = 0;
  double xx = 0;
  double yy = 0;
  double xy = 0;
  void add(double a, double b) {
    n += 1;
    x += a;
    y += b;
    xx += a * a;
    yy += b * b;
    xy += a * b;
  }
  double correlation() const {
    const double vx = xx - x * x / n;
    const double vy = yy - y * y / n;
    return vx > 0 && vy > 0 ? (xy - x * y / n) / std::sqrt(vx * vy) : 0;
  }
};

struct Peak {
  double offset_s = 0;
  double correlation = -1;
};

// The highest ones, not two of one hill.
std::vector<Peak> peaks_of(const OffsetCurve& curve) {
  std::vector<std::size_t> order(curve.offset_s.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, std::ranges::greater{}, [&](std::size_t i) { return curve.correlation[i]; });
  std::vector<Peak> out;
  for (const std::size_t i : order) {
    if (out.size() == kPeaks) break;
    const double d = curve.offset_s[i];
    if (std::ranges::all_of(out, [&](const Peak& p) { return std::abs(p.offset_s - d) > kSecondApart; })) {
      out.push_back({d, curve.correlation[i]});
    }
  }
  return out;
}

// Norms of the turn rates know nothing of the rotation between the sensors; all offsets are tried at which half of the
// pictures (or of the shorter recording) have IMU samples.
OffsetCurve correlate(const std::vector<Turn>& turns, const MeanRate& gyro, double low_s, double high_s) {
  std::vector<double> lengths(turns.size());
  std::vector<double> speeds(turns.size());
  std::vector<double> middles(turns.size());
  for (std::size_t i = 0; i < turns.size(); ++i) {
    lengths[i] = turns[i].to_s - turns[i].from_s;
    speeds[i] = turns[i].rate.norm();
    middles[i] = (turns[i].from_s + turns[i].to_s) / 2;
  }
  const double step = quantile(lengths, 0.5);
  const double h = step / 8;
  const double first = gyro.begin_s() + step / 2;
  std::vector<double> norms(static_cast<std::size_t>(std::max(0.0, (gyro.end_s() - gyro.begin_s() - step) / h)) + 1);
  for (std::size_t i = 0; i < norms.size(); ++i) {
    const double t = first + static_cast<double>(i) * h;
    norms[i] = gyro.between(t - step / 2, t + step / 2).norm();
  }
  const double seen = turns.back().to_s - turns.front().from_s;
  const double possible = std::min(1.0, (gyro.end_s() - gyro.begin_s()) / seen);
  OffsetCurve out;
  const auto offsets = static_cast<std::int64_t>((high_s - low_s) / h);
  const double products = static_cast<double>(offsets) * static_cast<double>(turns.size());
  const auto stride = static_cast<std::size_t>(std::max(1.0, std::ceil(products / kMostProducts)));
  const double needed = std::max<double>(
      kLeastSteps, kLeastOverlap * possible * static_cast<double>(turns.size()) / static_cast<double>(stride));
  for (std::int64_t k = 0; k <= offsets; ++k) {
    const double d = low_s + static_cast<double>(k) * h;
    PairSums sums;
    for (std::size_t i = 0; i < turns.size(); i += stride) {
      const double at = (middles[i] + d - first) / h;
      if (at < -0.5 || at >= static_cast<double>(norms.size()) - 0.5) continue;
      sums.add(speeds[i], norms[static_cast<std::size_t>(std::lround(std::max(at, 0.0)))]);
    }
    if (sums.n < needed) continue;
    out.offset_s.push_back(d);
    out.correlation.push_back(sums.correlation());
  }
  return out;
}

// rate in camera = R (rate of the gyroscope - bias), least squares with weights.
struct Wahba {
  Eigen::Quaterniond R_camera_imu = Eigen::Quaterniond::Identity();
  Vector3d bias = Vector3d::Zero();
  double cost = 0;                     // mean square of the residuals, weighted
  double camera_square = 0;            // mean square of the camera's rates about their mean
  Matrix3d spread = Matrix3d::Zero();  // of the gyroscope's rates
  double scatter = 0;                  // robust deviation of the residuals, before the last weights
};

Wahba solve_wahba(const std::vector<Turn>& turns, const MeanRate& gyro, double offset_s, std::vector<double>& weights,
                  bool reweight) {
  const std::size_t n = turns.size();
  std::vector<Vector3d> rates(n);
  std::vector<bool> covered(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double from = turns[i].from_s + offset_s;
    const double to = turns[i].to_s + offset_s;
    covered[i] = from >= gyro.begin_s() && to <= gyro.end_s();
    rates[i] = gyro.between(from, to);
  }
  Wahba out;
  for (int round = 0; round < (reweight ? kRobustRounds : 1); ++round) {
    Vector3d x_mean = Vector3d::Zero();
    Vector3d y_mean = Vector3d::Zero();
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (!covered[i]) continue;
      x_mean += weights[i] * turns[i].rate;
      y_mean += weights[i] * rates[i];
      sum += weights[i];
    }
    if (!(sum > 0)) return out;
    x_mean /= sum;
    y_mean /= sum;
    Matrix3d correlation = Matrix3d::Zero();
    out.camera_square = 0;
    out.spread.setZero();
    for (std::size_t i = 0; i < n; ++i) {
      if (!covered[i]) continue;
      const Vector3d y = rates[i] - y_mean;
      correlation += weights[i] * (turns[i].rate - x_mean) * y.transpose();
      out.spread += weights[i] * y * y.transpose();
      out.camera_square += weights[i] * (turns[i].rate - x_mean).squaredNorm();
    }
    out.spread /= sum;
    out.camera_square /= sum;
    const Eigen::JacobiSVD<Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Matrix3d fix = Matrix3d::Identity();
    fix(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    const Matrix3d R = svd.matrixU() * fix * svd.matrixV().transpose();
    out.R_camera_imu = Eigen::Quaterniond(R).normalized();
    out.bias = y_mean - R.transpose() * x_mean;
    std::vector<double> norms;
    double cost = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (!covered[i]) continue;
      norms.push_back((turns[i].rate - R * (rates[i] - out.bias)).norm());
      cost += weights[i] * norms.back() * norms.back();
    }
    out.cost = cost / sum;
    if (!reweight) break;
    out.scatter = robust_sigma(norms);
    const double scale = std::max(out.scatter, 1e-9);
    std::size_t k = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (covered[i]) weights[i] = tukey_weight(norms[k++] / scale);
    }
  }
  return out;
}

// Deviation of the turn rate, all axes together.
double turning_of(std::span<const ImuRow> imu) {
  Vector3d sum = Vector3d::Zero();
  double squares = 0;
  for (const ImuRow& row : imu) {
    sum += row.gyro;
    squares += row.gyro.squaredNorm();
  }
  const auto n = static_cast<double>(imu.size());
  return std::sqrt(std::max(0.0, squares / n - (sum / n).squaredNorm()));
}

}  // namespace

double sample_period(std::span<const ImuRow> imu) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < imu.size(); ++i) steps.push_back(imu[i].t_s - imu[i - 1].t_s);
  return quantile(steps, 0.5);
}

MeanRate::MeanRate(std::span<const ImuRow> imu) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t i = 0; i < imu.size(); ++i) {
    if (i > 0) sum += 0.5 * (imu[i].gyro + imu[i - 1].gyro) * (imu[i].t_s - imu[i - 1].t_s);
    times_.push_back(imu[i].t_s);
    sums_.push_back(sum);
    rates_.push_back(imu[i].gyro);
  }
}

Vector3d MeanRate::integral(double t_s) const {
  if (t_s <= times_.front()) return sums_.front() + (t_s - times_.front()) * rates_.front();
  if (t_s >= times_.back()) return sums_.back() + (t_s - times_.back()) * rates_.back();
  const auto next = static_cast<std::size_t>(std::upper_bound(times_.begin(), times_.end(), t_s) - times_.begin());
  const double span = times_[next] - times_[next - 1];
  const double part = t_s - times_[next - 1];
  // The rate runs straight between two readings.
  return sums_[next - 1] + part * rates_[next - 1] + 0.5 * part * part / span * (rates_[next] - rates_[next - 1]);
}

Vector3d MeanRate::between(double from_s, double to_s) const {
  return (integral(to_s) - integral(from_s)) / (to_s - from_s);
}

GyroTurns::GyroTurns(std::span<const ImuRow> imu, Vector3d bias)
    : rate_(imu), bias_(std::move(bias)), turns_{Eigen::Quaterniond::Identity()} {
  const std::vector<double>& times = rate_.times_s();
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double dt = times[i] - times[i - 1];
    turns_.push_back(so3::boxplus(turns_.back(), (rate_.between(times[i - 1], times[i]) - bias_) * dt));
  }
}

Eigen::Quaterniond GyroTurns::since_begin(double t_s) const {
  const std::vector<double>& times = rate_.times_s();
  const auto next = static_cast<std::size_t>(std::ranges::upper_bound(times, t_s) - times.begin());
  const std::size_t at = next == 0 ? 0 : next - 1;
  const double dt = t_s - times[at];
  if (dt == 0) return turns_[at];
  return so3::boxplus(turns_[at], (rate_.between(times[at], t_s) - bias_) * dt);
}

Eigen::Quaterniond GyroTurns::between(double from_s, double to_s) const {
  return since_begin(from_s).conjugate() * since_begin(to_s);
}

StartResult find_start(std::span<const CameraPoseSample> poses, std::span<const ImuRow> imu,
                       std::optional<double> given_offset_s) {
  const std::vector<Turn> turns = turns_of(poses);
  if (turns.size() < kLeastSteps) {
    std::vector<double> steps;
    for (std::size_t i = 1; i < poses.size(); ++i) steps.push_back(poses[i].t_s - poses[i - 1].t_s);
    const double step = steps.empty() ? 0 : quantile(steps, 0.5);
    return {{},
            "The target was seen in too few pictures that follow each other within " + to_text(kLongestStep) +
                " s: " + std::to_string(turns.size()) + " pairs, " + std::to_string(kLeastSteps) + " are needed" +
                (step > kLongestStep ? "; it is seen every " + to_text(step, 2) +
                                           " s, too rarely: let the camera take at least 3 pictures a second."
                                     : ".")};
  }
  const MeanRate gyro(imu);
  double low = imu.front().t_s - turns.back().to_s;
  double high = imu.back().t_s - turns.front().from_s;
  if (given_offset_s) {
    low = *given_offset_s - kAroundGiven;
    high = *given_offset_s + kAroundGiven;
  }
  CameraImuStart out;
  out.curve = correlate(turns, gyro, low, high);
  const std::vector<Peak> peaks = peaks_of(out.curve);
  // Which of them it is, the rates as vectors tell: poses that are wrong spoil the sums of a correlation.
  std::vector<double> weights;
  Wahba wahba;
  Peak peak;
  for (const Peak& candidate : peaks) {
    if (candidate.correlation < kLeastCorrelation * (peak.correlation < 0 ? 1 : kDoubtfulShare)) break;
    std::vector<double> own(turns.size(), 1.0);
    const Wahba here = solve_wahba(turns, gyro, candidate.offset_s, own, true);
    const auto misfit = [](const Wahba& w) { return w.scatter * w.scatter / std::max(w.spread.trace(), 1e-300); };
    if (peak.correlation >= 0 && !(misfit(here) < misfit(wahba))) continue;
    peak = candidate;
    wahba = here;
    weights = std::move(own);
  }
  if (peak.correlation < 0) {
    const double turning = turning_of(imu);
    if (turning < kLeastExcitation) {
      return {{},
              "The rig does not turn (deviation of the turn rate " + to_text(turning, 2) +
                  " rad/s): turn it briskly about all three axes."};
    }
    return {{},
            "Camera and gyroscope do not turn alike at any offset of their clocks" +
                (given_offset_s ? " within " + to_text(kAroundGiven) + " s of the one that was given" : std::string()) +
                " (correlation " + to_text(peaks.empty() ? 0 : std::max(peaks.front().correlation, 0.0), 2) + ", " +
                to_text(kLeastCorrelation) +
                " is needed): are both recordings of the same motion, and does the rig turn?"};
  }
  out.correlation = peak.correlation;
  out.second_correlation = -1;
  for (const Peak& other : peaks) {
    if (other.offset_s != peak.offset_s) out.second_correlation = std::max(out.second_correlation, other.correlation);
  }
  // Golden section around the peak, with the weights that it gave.
  const auto cost = [&](double d) { return solve_wahba(turns, gyro, d, weights, false).cost; };
  const double reach = turns.front().to_s - turns.front().from_s;
  out.time_offset_s = golden_section(cost, peak.offset_s - reach, peak.offset_s + reach, 1e-5);
  wahba = solve_wahba(turns, gyro, out.time_offset_s, weights, true);
  out.R_camera_imu = wahba.R_camera_imu;
  out.gyroscope_bias = wahba.bias;
  out.rate_ratio = std::sqrt(wahba.spread.trace() / std::max(wahba.camera_square, 1e-300));
  if (out.rate_ratio > kOtherUnit || out.rate_ratio < 1 / kOtherUnit) {
    return {{},
            "The gyroscope turns " + to_text(out.rate_ratio, 3) +
                " times as fast as the camera: its unit is not rad/s" +
                (std::abs(out.rate_ratio * std::numbers::pi / 180 - 1) < 0.2 ? " but deg/s." : ".")};
  }
  const double unexplained = wahba.cost / wahba.spread.trace();
  if (!(unexplained < kMostUnexplained)) {
    return {
        {},
        "Camera and gyroscope do not turn alike: at the best offset of their clocks no mounting explains more than " +
            to_text(100 * std::max(0.0, 1 - unexplained), 2) +
            " % of the turn rates: are both recordings of the same motion?"};
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(wahba.spread, Eigen::EigenvaluesOnly);
  out.excitation = axes.eigenvalues().reverse().cwiseMax(0).cwiseSqrt();
  if (out.excitation[1] < kLeastExcitation) {
    return {{},
            "The rig turned about one axis only (deviation of the turn rate " + to_text(out.excitation[0], 2) + ", " +
                to_text(out.excitation[1], 2) + ", " + to_text(out.excitation[2], 2) +
                " rad/s along its main axes): turn it about all three."};
  }
  return {out, ""};
}

}  // namespace loc::calib
