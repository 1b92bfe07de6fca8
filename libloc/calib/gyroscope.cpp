#include "libloc/calib/gyroscope.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "libloc/calib/dense.hpp"
#include "libloc/calib/gyroscope_start.hpp"
#include "libloc/calib/least_squares.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

using Matrix3x9d = Eigen::Matrix<double, 3, 9>;

/// d (A v) / d A row by row
Matrix3x9d row_jacobian(const Eigen::Vector3d& v) {
  Matrix3x9d j = Matrix3x9d::Zero();
  for (int row = 0; row < 3; ++row) j.block<1, 3>(row, 3 * row) = v.transpose();
  return j;
}

Eigen::Matrix3d from_rows(const Eigen::VectorXd& a) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(a.data());
}

Eigen::VectorXd to_rows(const Eigen::Matrix3d& m) {
  Eigen::VectorXd a(9);
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(a.data()) = m;
  return a;
}

/// Directions of gravity in the segments [accelerometer's axes, up] and how well they are known, all at once, because
/// an error of the accelerometer's calibration is in all of them.
struct Directions {
  std::vector<Eigen::Vector3d> up;
  Eigen::MatrixXd cov;
};

Directions gravity_directions(std::span<const StillSegment> segments, const AccelerometerFit& accelerometer) {
  const auto n = static_cast<Eigen::Index>(segments.size());
  Directions d;
  d.cov = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  Eigen::MatrixXd j(3 * n, 9);
  const Eigen::Matrix3d& m = accelerometer.triad.matrix;
  for (Eigen::Index i = 0; i < n; ++i) {
    const StillSegment& s = segments[static_cast<std::size_t>(i)];
    const Eigen::Vector3d v = s.accelerometer.mean - accelerometer.triad.bias;
    const Eigen::Vector3d force = m * v;
    const double g = force.norm();
    const Eigen::Vector3d u = force / g;
    const Eigen::Matrix3d across = (Eigen::Matrix3d::Identity() - u * u.transpose()) / g;
    const double pose = std::isfinite(accelerometer.pose_sigma) ? accelerometer.pose_sigma : 0;
    const Eigen::Matrix3d force_cov = m * s.accelerometer.cov * m.transpose() / static_cast<double>(s.samples) +
                                      pose * pose * Eigen::Matrix3d::Identity();
    d.up.push_back(u);
    d.cov.block<3, 3>(3 * i, 3 * i) = across * force_cov * across.transpose();
    Matrix3x9d jacobian;
    Eigen::Matrix<double, 3, 6> entries = Eigen::Matrix<double, 3, 6>::Zero();
    entries(0, 0) = entries(1, 3) = entries(2, 4) = v.x();
    entries(1, 1) = entries(0, 3) = entries(2, 5) = v.y();
    entries(2, 2) = entries(0, 4) = entries(1, 5) = v.z();
    jacobian << -m, entries;
    j.middleRows<3>(3 * i) = across * jacobian;
  }
  if (accelerometer.cov.allFinite()) d.cov += dense::propagate(j, accelerometer.cov);
  return d;
}

/// Rest rates of the segments, and their covariance: that of the mean, and the wandering from segment to segment, which
/// goes on during a turn.
struct Biases {
  std::vector<Eigen::Vector3d> mean;
  std::vector<Eigen::Matrix3d> cov;
  Eigen::Matrix3d sample_cov = Eigen::Matrix3d::Zero();
};

Biases segment_biases(std::span<const StillSegment> segments) {
  Biases b;
  double samples = 0;
  for (const StillSegment& s : segments) {
    b.mean.push_back(s.gyroscope.mean);
    b.sample_cov += s.gyroscope.cov * static_cast<double>(s.samples);
    samples += static_cast<double>(s.samples);
  }
  b.sample_cov /= samples;
  Eigen::Vector3d wander = Eigen::Vector3d::Zero();
  if (segments.size() >= 4) {
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> steps;
      double expected = 0;
      for (std::size_t i = 1; i < segments.size(); ++i) {
        steps.push_back(b.mean[i][axis] - b.mean[i - 1][axis]);
        expected += b.sample_cov(axis, axis) * (1.0 / static_cast<double>(segments[i].samples) +
                                                1.0 / static_cast<double>(segments[i - 1].samples));
      }
      const double sigma = robust_sigma(steps);
      wander[axis] = std::max(0.0, sigma * sigma - expected / static_cast<double>(steps.size())) / 4;
    }
  }
  for (const StillSegment& s : segments) {
    b.cov.emplace_back(b.sample_cov / static_cast<double>(s.samples) + Eigen::Matrix3d(wander.asDiagonal()));
  }
  return b;
}

/// Steps of the turn from segment i to i + 1; empty when it has a gap or rows that cannot be used.
std::vector<RateStep> turn_steps(std::span<const TimeNs> times, const TriadRows& gyroscope, const StillSegment& before,
                                 const StillSegment& after, const Biases& biases, std::size_t i, double longest_step) {
  std::vector<RateStep> steps;
  const double total = elapsed_s(before.end_ns, after.start_ns);
  const Eigen::Vector3d drift = biases.mean[i + 1] - biases.mean[i];
  auto last = before.end - 1;
  for (auto k = before.end; k <= after.begin; ++k) {
    const TimeNs t = times[static_cast<std::size_t>(k)];
    if (!gyroscope.row(k).allFinite() || t == kNoTime || t <= times[static_cast<std::size_t>(last)]) continue;
    RateStep step;
    const TimeNs from = times[static_cast<std::size_t>(last)];
    step.dt_s = elapsed_s(from, t);
    if (step.dt_s > longest_step) return {};
    const double begin = elapsed_s(before.end_ns, from) / total;
    const double end = elapsed_s(before.end_ns, t) / total;
    step.share = (begin + end) / 2;
    step.begin = gyroscope.row(last).transpose() - biases.mean[i] - begin * drift;
    step.end = gyroscope.row(k).transpose() - biases.mean[i] - end * drift;
    steps.push_back(step);
    last = k;
  }
  if (last != after.begin) return {};
  return steps;
}

Eigen::Matrix<double, 3, 2> tangent(const Eigen::Vector3d& u) {
  Eigen::Matrix<double, 3, 2> b;
  b.col(0) = u.unitOrthogonal();
  b.col(1) = u.cross(b.col(0));
  return b;
}

/// What the turns in use say: residuals (two a turn), their Jacobian with respect to A row by row, their covariance.
struct Stacked {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;
  Eigen::MatrixXd cov;
};

class TurnProblem {
 public:
  TurnProblem(Directions directions, Biases biases) : directions_(std::move(directions)), biases_(std::move(biases)) {}

  void add(std::size_t turn, std::vector<RateStep> steps) {
    turns_.push_back(turn);
    steps_.push_back(std::move(steps));
    use_.push_back(true);
  }
  std::size_t size() const { return turns_.size(); }
  std::size_t turn(std::size_t k) const { return turns_[k]; }
  bool used(std::size_t k) const { return use_[k]; }
  void set_use(std::vector<bool> use) { use_ = std::move(use); }
  const std::vector<bool>& use() const { return use_; }
  int used_count() const { return static_cast<int>(std::count(use_.begin(), use_.end(), true)); }
  const std::vector<std::vector<RateStep>>& steps() const { return steps_; }
  const std::vector<Eigen::Vector3d>& up() const { return directions_.up; }
  const std::vector<std::size_t>& turns() const { return turns_; }

  /// @param all also the turns that are left out
  Stacked evaluate(const Eigen::Matrix3d& matrix, bool all, bool with_cov) const {
    std::vector<std::size_t> rows;
    for (std::size_t k = 0; k < turns_.size(); ++k) {
      if (all || use_[k]) rows.push_back(k);
    }
    const auto n = static_cast<Eigen::Index>(rows.size());
    const auto segments = static_cast<Eigen::Index>(directions_.up.size());
    Stacked out{.residuals = Eigen::VectorXd(2 * n), .jacobian = Eigen::MatrixXd(2 * n, 9), .cov = {}};
    Eigen::MatrixXd by_direction = Eigen::MatrixXd::Zero(2 * n, 3 * segments);
    Eigen::MatrixXd by_bias = Eigen::MatrixXd::Zero(2 * n, 3 * segments);
    if (with_cov) out.cov = Eigen::MatrixXd::Zero(2 * n, 2 * n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const std::size_t at = rows[static_cast<std::size_t>(k)];
      const std::size_t i = turns_[at];
      const auto first = 3 * static_cast<Eigen::Index>(i);
      const TurnIntegral turn = integrate_turn(steps_[at], matrix, biases_.sample_cov);
      const Eigen::Vector3d predicted = turn.q_before_after.conjugate() * directions_.up[i];
      const Eigen::Matrix<double, 2, 3> across = tangent(directions_.up[i + 1]).transpose();
      // Exp(-delta) p = p + p x delta
      const Eigen::Matrix<double, 2, 3> by_turn = across * so3::hat(predicted);
      out.residuals.segment<2>(2 * k) = across * (predicted - directions_.up[i + 1]);
      out.jacobian.middleRows<2>(2 * k) = by_turn * turn.d_matrix;
      if (!with_cov) continue;
      by_direction.block<2, 3>(2 * k, first) = across * turn.q_before_after.conjugate().toRotationMatrix();
      by_direction.block<2, 3>(2 * k, first + 3) = -across;
      by_bias.block<2, 3>(2 * k, first) = by_turn * turn.d_bias_before;
      by_bias.block<2, 3>(2 * k, first + 3) = by_turn * turn.d_bias_after;
      out.cov.block<2, 2>(2 * k, 2 * k) = by_turn * turn.noise * by_turn.transpose();
    }
    if (with_cov) {
      Eigen::MatrixXd bias_cov = Eigen::MatrixXd::Zero(3 * segments, 3 * segments);
      for (Eigen::Index i = 0; i < segments; ++i) {
        bias_cov.block<3, 3>(3 * i, 3 * i) = biases_.cov[static_cast<std::size_t>(i)];
      }
      out.cov += dense::propagate(by_direction, directions_.cov) + dense::propagate(by_bias, bias_cov);
      // Data without any noise must not make the covariance singular: a microradian is less than any sensor knows.
      out.cov.diagonal().array() += 1e-12;
    }
    return out;
  }

 private:
  Directions directions_;
  Biases biases_;
  std::vector<std::size_t> turns_;
  std::vector<std::vector<RateStep>> steps_;
  std::vector<bool> use_;
};

/// Generalised least squares on A in units of its start's scale; the covariance of the residuals follows A.
LeastSquaresResult solve(const TurnProblem& problem, Eigen::Matrix3d& matrix) {
  LeastSquaresResult result;
  for (int round = 0; round < 3; ++round) {
    const double scale = std::cbrt(std::abs(matrix.determinant()));
    const auto root = dense::cholesky(problem.evaluate(matrix, false, true).cov);
    if (!root) throw DataError("the covariance of the turns is not positive definite");
    const ResidualFunction function = [&](const Eigen::VectorXd& x, Eigen::VectorXd& r, Eigen::MatrixXd* jacobian) {
      const Stacked s = problem.evaluate(scale * from_rows(x), false, false);
      r = dense::solve_lower(*root, s.residuals);
      if (jacobian != nullptr) *jacobian = dense::solve_lower(*root, s.jacobian * scale);
    };
    result = minimise(function, to_rows(matrix / scale), {.max_iterations = 50, .step_tolerance = 1e-9});
    matrix = scale * from_rows(result.x);
  }
  return result;
}

/// Equal weights for all turns and Tukey's loss, so that a turn that is quite wrong does not draw the first fit.
void robust_start(const TurnProblem& problem, Eigen::Matrix3d& matrix) {
  const double scale = std::cbrt(std::abs(matrix.determinant()));
  for (int round = 0; round < 6; ++round) {
    const Stacked now = problem.evaluate(matrix, true, false);
    std::vector<double> angles;
    for (std::size_t k = 0; k < problem.size(); ++k) {
      angles.push_back(now.residuals.segment<2>(2 * static_cast<Eigen::Index>(k)).norm());
    }
    constexpr double kMedianOfRayleigh = 1.1774100225154747;
    const double sigma = std::max(1e-6, quantile(angles, 0.5) / kMedianOfRayleigh);
    Eigen::VectorXd weights(now.residuals.size());
    for (std::size_t k = 0; k < angles.size(); ++k) {
      weights.segment<2>(2 * static_cast<Eigen::Index>(k)).setConstant(std::sqrt(tukey_weight(angles[k] / sigma)));
    }
    const ResidualFunction function = [&](const Eigen::VectorXd& x, Eigen::VectorXd& r, Eigen::MatrixXd* jacobian) {
      const Stacked s = problem.evaluate(scale * from_rows(x), true, false);
      r = weights.cwiseProduct(s.residuals);
      if (jacobian != nullptr) *jacobian = weights.asDiagonal() * s.jacobian * scale;
    };
    matrix = scale * from_rows(minimise(function, to_rows(matrix / scale), {.max_iterations = 10}).x);
  }
}

/// Turns whose residuals do not stand out from the others'.
std::vector<bool> fitting_turns(const TurnProblem& problem, const Eigen::Matrix3d& matrix, double limit) {
  const Stacked s = problem.evaluate(matrix, true, true);
  std::vector<double> chi2;
  for (std::size_t k = 0; k < problem.size(); ++k) {
    const auto at = 2 * static_cast<Eigen::Index>(k);
    const Eigen::Vector2d r = s.residuals.segment<2>(at);
    chi2.push_back(r.dot(s.cov.block<2, 2>(at, at).ldlt().solve(r)));
  }
  constexpr double kMedianOfTwo = 1.3862943611198906;  // of chi-square with 2 degrees of freedom
  const double scatter = std::max(1.0, quantile(chi2, 0.5) / kMedianOfTwo);
  std::vector<bool> fits(chi2.size());
  std::transform(chi2.begin(), chi2.end(), fits.begin(), [&](double c) { return c <= limit * scatter; });
  return fits;
}

/// Length of the way, in raw units.
double raw_path(const std::vector<RateStep>& steps) {
  double path = 0;
  for (const RateStep& step : steps) path += step.dt_s * step.begin.norm();
  return path;
}

void judge_bias(std::span<const StillSegment> segments, GyroscopeFit& fit) {
  // A drift that is several times the noise of a sample is a gyroscope that warms up.
  Eigen::Vector3d noise = Eigen::Vector3d::Zero();
  for (const StillSegment& s : segments) {
    noise += s.gyroscope.cov.diagonal() / static_cast<double>(segments.size());
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (segments.size() > 1 && fit.bias_range[axis] > 2 * std::sqrt(noise[axis])) {
      fit.quality.lower_to(Verdict::kFair, std::string("The rest rate of axis ") + "xyz"[axis] + " changes by " +
                                               to_text(fit.bias_range[axis]) +
                                               " (raw units) between segments: let the device warm up first.");
    }
  }
}

/// For the rig.
GyroscopeFit with_quality(GyroscopeFit fit) {
  TriadQuality& q = fit.triad.quality.emplace();
  q.verdict = fit.quality.verdict;
  q.reasons = fit.quality.reasons;
  q.method = fit.matrix_known ? "still-turns" : "rest-bias";
  q.samples = fit.matrix_known ? fit.inliers : fit.segments;
  q.bias_sigma = fit.bias_cov.diagonal().cwiseSqrt();
  if (fit.matrix_known) {
    const Vector9d sigma = fit.cov.diagonal().cwiseSqrt();
    q.matrix_sigma = from_rows(sigma);
  }
  return fit;
}

std::string percent(double share) {
  return to_text(std::round(share * 1e5) / 1e3) + " %";
}

}  // namespace

void GyroscopeOptions::check() const {
  require(std::isfinite(gap_periods) && gap_periods > 1, "gap_periods", gap_periods, "must be above 1");
  require_positive("outlier_chi2", outlier_chi2);
  require_positive("ok_sigma", ok_sigma);
  require(std::isfinite(fair_sigma) && fair_sigma >= ok_sigma, "fair_sigma", fair_sigma, "must not be below ok_sigma");
  require(std::isfinite(warn_sigma) && warn_sigma >= fair_sigma, "warn_sigma", warn_sigma,
          "must not be below fair_sigma");
}

TurnIntegral integrate_turn(std::span<const RateStep> steps, const Eigen::Matrix3d& matrix,
                            const Eigen::Matrix3d& sample_cov) {
  TurnIntegral out;
  const Eigen::Matrix3d rate_cov = matrix * sample_cov * matrix.transpose();
  for (const RateStep& step : steps) {
    const double dt = step.dt_s;
    const Eigen::Vector3d w0 = matrix * step.begin;
    const Eigen::Vector3d w1 = matrix * step.end;
    // Magnus expansion for a rate that goes linearly from w0 to w1.
    const Eigen::Vector3d theta = dt / 2 * (w0 + w1) + dt * dt / 12 * w0.cross(w1);
    const Matrix3x9d d0 = row_jacobian(step.begin);
    const Matrix3x9d d1 = row_jacobian(step.end);
    const Matrix3x9d d_theta = dt / 2 * (d0 + d1) + dt * dt / 12 * (so3::hat(w0) * d1 - so3::hat(w1) * d0);
    // Both readings have the bias: to first order in dt.
    const Eigen::Matrix3d d_bias =
        (-dt * Eigen::Matrix3d::Identity() + dt * dt / 12 * (so3::hat(w1) - so3::hat(w0))) * matrix;
    const Eigen::Quaterniond turn = so3::exp(theta);
    const Eigen::Matrix3d back = turn.conjugate().toRotationMatrix();
    const Eigen::Matrix3d right = so3::right_jacobian(theta);
    out.d_matrix = back * out.d_matrix + right * d_theta;
    out.d_bias_before = back * out.d_bias_before + right * d_bias * (1 - step.share);
    out.d_bias_after = back * out.d_bias_after + right * d_bias * step.share;
    // Each reading counts for half a period on both sides.
    out.noise = back * out.noise * back.transpose() + dt * dt * rate_cov;
    out.q_before_after = (out.q_before_after * turn).normalized();
  }
  return out;
}

GyroscopeFit fit_gyroscope_bias(std::span<const StillSegment> segments) {
  GyroscopeFit fit;
  std::vector<StillSegment> good;
  for (const StillSegment& s : segments) {
    if (s.samples > 1 && s.gyroscope.mean.allFinite() && s.gyroscope.cov.allFinite()) good.push_back(s);
  }
  if (good.empty()) {
    fit.quality.lower_to(Verdict::kRefused, "No still segment with a gyroscope: the bias cannot be found.");
    return fit;
  }
  const Biases biases = segment_biases(good);
  // Weights by the samples: the wandering is the same for all.
  double total = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double time = 0;
  const auto middle = [&](const StillSegment& s) {
    return elapsed_s(good.front().start_ns, s.start_ns) + s.duration_s() / 2;
  };
  for (const StillSegment& s : good) {
    const auto w = static_cast<double>(s.samples);
    total += w;
    mean += w * (s.gyroscope.mean - good.front().gyroscope.mean);
    time += w * middle(s);
  }
  mean = good.front().gyroscope.mean + mean / total;
  time /= total;
  Eigen::Vector3d low = mean;
  Eigen::Vector3d high = mean;
  Eigen::Vector3d square = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_time = Eigen::Vector3d::Zero();
  double time_square = 0;
  Eigen::Matrix3d cov = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < good.size(); ++i) {
    const double w = static_cast<double>(good[i].samples) / total;
    const Eigen::Vector3d d = good[i].gyroscope.mean - mean;
    low = low.cwiseMin(good[i].gyroscope.mean);
    high = high.cwiseMax(good[i].gyroscope.mean);
    square += w * d.cwiseAbs2();
    by_time += w * (middle(good[i]) - time) * d;
    time_square += w * (middle(good[i]) - time) * (middle(good[i]) - time);
    cov += w * w * biases.cov[i];
  }
  fit.bias_known = true;
  fit.triad.bias = mean;
  fit.bias_cov = cov;
  fit.bias_range = high - low;
  if (good.size() > 1) {
    fit.bias_spread = square.cwiseSqrt();
    if (time_square > 0) fit.bias_slope = by_time / time_square;
  }
  judge_bias(good, fit);
  fit.quality.lower_to(Verdict::kFair, "Bias only: scale and misalignment are not known and stay as they are.");
  fit.segments = static_cast<int>(good.size());
  return with_quality(std::move(fit));
}

GyroscopeFit fit_gyroscope(std::span<const TimeNs> times_ns, const TriadRows& gyroscope,
                           std::span<const StillSegment> segments, const AccelerometerFit& accelerometer,
                           const GyroscopeOptions& options) {
  options.check();
  require(gyroscope.rows() == static_cast<Eigen::Index>(times_ns.size()), "rows of gyroscope",
          static_cast<double>(gyroscope.rows()), "must be as many as times");
  std::int64_t last = 0;
  for (const StillSegment& s : segments) {
    require(s.begin >= last && s.end > s.begin && s.end <= gyroscope.rows(), "begin of a segment",
            static_cast<double>(s.begin), "segments must be inside the recording and in order");
    last = s.end;
  }

  GyroscopeFit fit = fit_gyroscope_bias(segments);
  const auto bias_only = [&](const std::string& reason) {
    fit.quality.reasons.push_back(reason);
    return with_quality(fit);
  };
  if (!fit.bias_known) return fit;
  const bool usable = std::all_of(segments.begin(), segments.end(), [](const StillSegment& s) {
    return s.samples > 1 && s.gyroscope.mean.allFinite() && s.gyroscope.cov.allFinite() &&
           s.accelerometer.mean.allFinite() && s.accelerometer.cov.allFinite();
  });
  if (!accelerometer.solved)
    return bias_only(
        "The accelerometer could not be calibrated from this recording, which scale and misalignment need.");
  if (!usable) return bias_only("Some segments lack one of the two sensors.");

  double rest_s = 0;
  double rest_periods = 0;
  for (const StillSegment& s : segments) {
    rest_s += s.duration_s();
    rest_periods += static_cast<double>(s.samples - 1);
  }
  const double longest_step = options.gap_periods * rest_s / rest_periods;
  const Biases biases = segment_biases(segments);
  const Directions directions = gravity_directions(segments, accelerometer);
  TurnProblem problem(directions, biases);
  std::vector<std::vector<RateStep>> steps;
  std::vector<double> paths;
  for (std::size_t i = 0; i + 1 < segments.size(); ++i) {
    GyroscopeTurn turn;
    turn.from_segment = i;
    turn.to_segment = i + 1;
    turn.duration_s = elapsed_s(segments[i].end_ns, segments[i + 1].start_ns);
    turn.gravity_angle =
        std::atan2(directions.up[i].cross(directions.up[i + 1]).norm(), directions.up[i].dot(directions.up[i + 1]));
    steps.push_back(turn_steps(times_ns, gyroscope, segments[i], segments[i + 1], biases, i, longest_step));
    if (!steps.back().empty()) paths.push_back(raw_path(steps.back()));
    fit.turns.push_back(turn);
  }
  constexpr double kAbsurd = 1e3;  // times the median: one value of 1e200 would overflow everything
  for (std::size_t i = 0; i < steps.size(); ++i) {
    fit.turns[i].usable = !steps[i].empty() && raw_path(steps[i]) <= kAbsurd * quantile(paths, 0.5);
    if (fit.turns[i].usable) problem.add(i, std::move(steps[i]));
  }
  constexpr int kLeastTurns = 6;
  if (problem.used_count() < kLeastTurns) {
    return bias_only("Only " + std::to_string(problem.used_count()) + " turns between still poses: at least " +
                     std::to_string(kLeastTurns) + " are needed for scale and misalignment.");
  }
  const auto start = gyroscope_start(problem.steps(), problem.turns(), problem.up());
  if (!start) return bias_only("The turns between still poses are too small to find the scale.");

  Eigen::Matrix3d matrix = *start;
  robust_start(problem, matrix);
  LeastSquaresResult result;
  for (int i = 0; i < 10; ++i) {
    std::vector<bool> fits = fitting_turns(problem, matrix, options.outlier_chi2);
    if (i > 0 && fits == problem.use()) break;
    problem.set_use(std::move(fits));
    if (problem.used_count() < kLeastTurns) return bias_only("The turns do not agree with each other.");
    result = solve(problem, matrix);
  }

  const Stacked all = problem.evaluate(matrix, true, false);
  std::vector<double> angles;
  for (std::size_t k = 0; k < problem.size(); ++k) {
    GyroscopeTurn& turn = fit.turns[problem.turn(k)];
    turn.residual = all.residuals.segment<2>(2 * static_cast<Eigen::Index>(k)).norm();
    turn.inlier = problem.used(k);
    if (turn.inlier) angles.push_back(turn.residual);
  }
  fit.inliers = problem.used_count();
  fit.residual_rms = root_mean_square(angles);
  const int dof = 2 * fit.inliers - 9;
  fit.chi2_ratio = result.cost / dof;
  const auto cov = covariance_from(result.information);
  if (!cov || !matrix.allFinite())
    return bias_only("The turns do not determine scale and misalignment: turn about all axes.");
  const double scale = std::cbrt(std::abs(matrix.determinant()));
  const double inflation = std::max(1.0, fit.chi2_ratio);
  fit.relative_sigma = std::sqrt(dense::symmetric_eigenvalues(*cov * inflation)[8]) * small_sample_factor(dof);
  fit.cov = *cov * (inflation * scale * scale);
  if (!(fit.relative_sigma <= options.warn_sigma)) {
    return bias_only("Predicted deviation of scale and misalignment " + percent(fit.relative_sigma) + ", at most " +
                     percent(options.warn_sigma) + ": turn about all axes, between more poses.");
  }
  fit.matrix_known = true;
  fit.converged = result.converged;
  fit.triad.matrix = matrix;
  fit.left_handed = matrix.determinant() < 0;
  const Eigen::Matrix3d turned = dense::nearest_orthogonal(matrix) * (fit.left_handed ? -1 : 1);
  fit.rotation_angle = Eigen::AngleAxisd(turned).angle();

  // What said "bias only" no longer holds.
  Quality quality;
  GyroscopeFit bias;
  bias.bias_range = fit.bias_range;
  judge_bias(segments, bias);
  quality = bias.quality;
  if (fit.relative_sigma > options.ok_sigma) {
    quality.lower_to(fit.relative_sigma > options.fair_sigma ? Verdict::kWarn : Verdict::kFair,
                     "Predicted deviation of scale and misalignment " + percent(fit.relative_sigma) + ", ok is up to " +
                         percent(options.ok_sigma) + ": more turns between still poses, about all axes.");
  }
  if (!fit.converged) quality.lower_to(Verdict::kWarn, "The fit did not converge: look at the residuals.");
  const int dropped = static_cast<int>(problem.size()) - fit.inliers;
  if (dropped > 0) {
    quality.lower_to(5 * dropped > static_cast<int>(problem.size()) ? Verdict::kWarn : Verdict::kFair,
                     std::to_string(dropped) + " of " + std::to_string(problem.size()) +
                         " turns do not fit and were left out: too fast for the sensor, or samples were lost.");
  }
  if (fit.left_handed) {
    quality.lower_to(Verdict::kWarn,
                     "The gyroscope's axes are left-handed against the accelerometer's: an axis has the "
                     "wrong sign.");
  } else if (fit.rotation_angle > 0.35) {
    quality.lower_to(Verdict::kWarn, "The gyroscope's axes are turned against the accelerometer's by " +
                                         to_text(std::round(fit.rotation_angle * 1800 / std::numbers::pi) / 10) +
                                         " deg: axes are swapped. The matrix corrects it.");
  }
  fit.quality = quality;
  return with_quality(std::move(fit));
}

}  // namespace loc
