#include "libloc/calib/time_offset.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr double kCoarseStep = 0.05;  // [s]
constexpr int kMaxIterations = 50;
constexpr double kHuber = 1.5;  // in units of the robust deviation
constexpr std::size_t kMinSamples = 20;
constexpr double kMinVelocityDeviation = 0.3;  // [m/s]
constexpr double kMinSpeedDeviation = 0.1;     // of the rms speed

std::string fixed(double value, int digits) {
  const double scale = std::pow(10.0, digits);
  return to_text(std::round(value * scale) / scale);
}

void check_stream(const PositionStream& s, const char* name, bool finite) {
  const auto fail = [&](const std::string& what) { throw DataError(std::string(name) + ": " + what); };
  if (s.times_ns.empty()) fail("no positions");
  const auto size_of = [&](const char* field, std::size_t size, bool may_be_empty) {
    if (size == s.times_ns.size() || (may_be_empty && size == 0)) return;
    fail(std::to_string(size) + " " + field + " for " + std::to_string(s.times_ns.size()) + " times");
  };
  size_of("positions", s.positions.size(), false);
  size_of("velocities", s.velocities.size(), true);
  size_of("rotations", s.rotations.size(), true);
  for (std::size_t i = 0; i < s.times_ns.size(); ++i) {
    const std::string at = "[" + std::to_string(i) + "]";
    if (i > 0 && s.times_ns[i] <= s.times_ns[i - 1]) {
      fail("times_ns" + at + " = " + std::to_string(s.times_ns[i]) + ": not after the one before");
    }
    if (!finite) continue;
    if (!s.positions[i].allFinite()) fail("positions" + at + " is not finite");
    if (!s.velocities.empty() && !s.velocities[i].allFinite()) fail("velocities" + at + " is not finite");
    if (!s.rotations.empty() && !(std::abs(s.rotations[i].norm() - 1) < 1e-3)) {
      fail("rotations" + at + " is not a unit quaternion");
    }
  }
}

struct State {
  Eigen::Vector3d position;
  Eigen::Vector3d velocity;
  Eigen::Matrix3d R_world_body = Eigen::Matrix3d::Identity();
};

// The reference at any time.
class Reference {
 public:
  Reference(const PositionStream& stream, TimeNs max_gap_ns) : stream_(stream), max_gap_ns_(max_gap_ns) {}

  // @param margin_ns it must be known from this before to this after
  bool covers(TimeNs time_ns, TimeNs margin_ns) const {
    const auto& t = stream_.times_ns;
    if (time_ns - t.front() < margin_ns || t.back() - time_ns < margin_ns) return false;
    std::size_t i = segment(time_ns - margin_ns);
    for (; i + 1 < t.size() && t[i] < time_ns + margin_ns; ++i) {
      if (t[i + 1] - t[i] > max_gap_ns_) return false;
    }
    return true;
  }

  // Cubic between positions and velocities; the time lies inside.
  State at(TimeNs time_ns) const {
    const auto& s = stream_;
    const std::size_t i = segment(time_ns);
    const double dt = to_seconds(s.times_ns[i + 1] - s.times_ns[i]);
    const double u = to_seconds(time_ns - s.times_ns[i]) / dt;
    const Eigen::Vector3d chord = s.positions[i + 1] - s.positions[i];
    const Eigen::Vector3d v0 = velocity(i) * dt;
    const Eigen::Vector3d v1 = velocity(i + 1) * dt;
    State out;
    out.position = s.positions[i] + u * v0 + u * u * (3 * chord - 2 * v0 - v1) + u * u * u * (v0 + v1 - 2 * chord);
    out.velocity = (v0 + 2 * u * (3 * chord - 2 * v0 - v1) + 3 * u * u * (v0 + v1 - 2 * chord)) / dt;
    if (!s.rotations.empty()) out.R_world_body = s.rotations[i].slerp(u, s.rotations[i + 1]).toRotationMatrix();
    return out;
  }

 private:
  std::size_t segment(TimeNs time_ns) const {
    const auto& t = stream_.times_ns;
    const auto after = std::upper_bound(t.begin(), t.end(), time_ns);
    const auto i = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, after - t.begin() - 1));
    return std::min(i, t.size() - 2);
  }

  Eigen::Vector3d velocity(std::size_t i) const {
    if (!stream_.velocities.empty()) return stream_.velocities[i];
    const std::size_t before = i == 0 ? 0 : i - 1;
    const std::size_t after = std::min(i + 1, stream_.times_ns.size() - 1);
    return (stream_.positions[after] - stream_.positions[before]) /
           to_seconds(stream_.times_ns[after] - stream_.times_ns[before]);
  }

  const PositionStream& stream_;
  TimeNs max_gap_ns_;
};

using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 7>;
using Parameters = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 7, 1>;
using Residual = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1>;

class Problem {
 public:
  Problem(const PositionStream& stream, const Reference& reference, const TimeOffsetOptions& options)
      : stream_(stream), reference_(reference), options_(options), axes_(options.horizontal ? 2 : 3) {}

  std::vector<std::size_t> used;  // indices into the stream

  Eigen::Index axes() const { return axes_; }
  Eigen::Index parameters() const {
    return 1 + (options_.estimate_bias ? axes_ : 0) + (options_.estimate_lever_arm ? 3 : 0);
  }

  // x: offset [s], bias (by axis), lever arm (difference to the one given).
  Residual residual(std::size_t i, const Parameters& x, Jacobian* jacobian = nullptr) const {
    const State ref = reference_.at(stream_.times_ns[i] + from_seconds(x(0)));
    Eigen::Vector3d lever = options_.lever_arm;
    const Eigen::Index lever_at = 1 + (options_.estimate_bias ? axes_ : 0);
    if (options_.estimate_lever_arm) lever += x.segment<3>(lever_at);
    Residual r = (stream_.positions[i] - ref.position - ref.R_world_body * lever).head(axes_);
    if (options_.estimate_bias) r -= x.segment(1, axes_);
    if (jacobian != nullptr) {
      jacobian->setZero(axes_, parameters());
      jacobian->col(0) = -ref.velocity.head(axes_);
      if (options_.estimate_bias) jacobian->middleCols(1, axes_) = -Eigen::MatrixXd::Identity(axes_, axes_);
      if (options_.estimate_lever_arm) jacobian->middleCols(lever_at, 3) = -ref.R_world_body.topRows(axes_);
    }
    return r;
  }

  std::vector<double> norms(const Parameters& x) const {
    std::vector<double> out;
    out.reserve(used.size());
    for (const std::size_t i : used) out.push_back(residual(i, x).norm());
    return out;
  }

 private:
  const PositionStream& stream_;
  const Reference& reference_;
  const TimeOffsetOptions& options_;
  Eigen::Index axes_;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double rms(const std::vector<double>& norms) {
  double sum = 0;
  for (const double x : norms) sum += x * x;
  return std::sqrt(sum / static_cast<double>(norms.size()));
}

// Median of the norms is robust to outliers, and has its least value where the offset is about right.
double coarse_offset(const Problem& problem, double max_offset_s) {
  const int steps = std::max(1, static_cast<int>(std::ceil(max_offset_s / kCoarseStep)));
  double best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int k = -steps; k <= steps; ++k) {
    Parameters x = Parameters::Zero(problem.parameters());
    x(0) = max_offset_s * k / steps;
    const double cost = median(problem.norms(x));
    if (cost < least) {
      least = cost;
      best = x(0);
    }
  }
  return best;
}

struct Solution {
  Parameters x;
  Eigen::MatrixXd cov;
  double scale = 0;
  int iterations = 0;
  bool converged = false;
  bool singular = false;
};

struct Row {
  TimeNs time_ns = 0;
  Jacobian J;
  Residual r;       // weighted
  double norm = 0;  // of the residual, without weight
};

// Covariance of sum(J^T r), where residuals are correlated in time: sum over pairs of J_a^T J_b times the residuals'
// autocovariance at that distance. That is taken over the whole recording, which makes it far less noisy than sums of
// products of the terms themselves. The autocovariance is taken in full up to the share `flat` of the longest distance
// and fades from there (Politis, Romano, "Bias-corrected nonparametric spectral estimation", 1995); with 0 the sum
// cannot become negative, and is too small by what fades.
Eigen::MatrixXd correlated_information(const std::vector<Row>& rows, double correlation_s, double flat) {
  const Eigen::Index n = rows[0].J.cols();
  const double span = to_seconds(rows.back().time_ns - rows[0].time_ns);
  const double period = span / static_cast<double>(rows.size() - 1);
  const auto lags = std::min(rows.size() / 2, static_cast<std::size_t>(correlation_s / std::max(period, 1e-9)) + 1);
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t lag = 0; lag < lags; ++lag) {
    double covariance = 0;
    Eigen::MatrixXd products = Eigen::MatrixXd::Zero(n, n);
    std::int64_t pairs = 0;
    for (std::size_t a = 0; a + lag < rows.size(); ++a) {
      const Row& b = rows[a + lag];
      if (to_seconds(b.time_ns - rows[a].time_ns) > correlation_s && lag > 0) continue;
      covariance += rows[a].r.dot(b.r) / static_cast<double>(rows[a].r.size());
      products += rows[a].J.transpose() * b.J;
      ++pairs;
    }
    if (pairs == 0) continue;
    const double distance = static_cast<double>(lag) / static_cast<double>(lags);
    const double taper = std::min(1.0, (1 - distance) / (1 - flat));
    covariance *= taper / static_cast<double>(pairs);
    out += lag == 0 ? Eigen::MatrixXd(covariance * products)
                    : Eigen::MatrixXd(covariance * (products + products.transpose()));
  }
  return out;
}

// Gauss-Newton with Huber weights; the scale is set anew in each step.
Solution solve(const Problem& problem, const PositionStream& stream, const TimeOffsetOptions& options) {
  const Eigen::Index n = problem.parameters();
  Solution s;
  s.x = Parameters::Zero(n);
  s.x(0) = coarse_offset(problem, options.max_offset_s);
  Eigen::MatrixXd information(n, n);
  std::vector<Row> rows(problem.used.size());
  const auto linearise = [&] {
    information.setZero();
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    s.scale = std::max(median(problem.norms(s.x)) * 0.85, 1e-6);  // of a norm in two dimensions: 1.18 sigma
    for (std::size_t k = 0; k < problem.used.size(); ++k) {
      Row& row = rows[k];
      row.time_ns = stream.times_ns[problem.used[k]];
      row.r = problem.residual(problem.used[k], s.x, &row.J);
      row.norm = row.r.norm();
      const double weight = std::min(1.0, kHuber * s.scale / std::max(row.norm, 1e-12));
      information += weight * row.J.transpose() * row.J;
      row.r *= weight;
      right += row.J.transpose() * row.r;
    }
    return right;
  };
  for (s.iterations = 0; s.iterations < kMaxIterations && !s.converged; ++s.iterations) {
    const Eigen::VectorXd right = linearise();
    const Eigen::LDLT<Eigen::MatrixXd> solver(information);
    if (solver.info() != Eigen::Success || solver.rcond() < 1e-12) {
      s.singular = true;
      return s;
    }
    Eigen::VectorXd step = solver.solve(-right);
    step(0) = std::clamp(s.x(0) + step(0), -options.max_offset_s, options.max_offset_s) - s.x(0);
    s.x += step;
    s.converged = std::abs(step(0)) < 1e-6 && step.cwiseAbs().maxCoeff() < 1e-5;
  }
  linearise();
  const Eigen::LDLT<Eigen::MatrixXd> solver(information);
  for (const double flat : {0.0, 0.5}) {
    const Eigen::MatrixXd half = solver.solve(correlated_information(rows, options.correlation_s, flat));
    const Eigen::MatrixXd cov = solver.solve(half.transpose());
    if (flat == 0 || cov(0, 0) > s.cov(0, 0)) s.cov = cov;
  }
  if (!options.estimate_bias) {
    // A constant difference of the positions shifts the offset by as much as the mean velocity lets it.
    Eigen::MatrixXd pulls = Eigen::MatrixXd::Zero(n, problem.axes());
    for (const Row& row : rows) {
      const double weight = std::min(1.0, kHuber * s.scale / std::max(row.norm, 1e-12));
      pulls += weight * row.J.transpose();
    }
    const Eigen::MatrixXd shift = options.bias_sigma_m * solver.solve(pulls);
    s.cov += shift * shift.transpose();
  }
  return s;
}

void judge(TimeOffsetResult& r, const TimeOffsetOptions& options, bool singular) {
  Quality& q = r.quality;
  if (singular || r.velocity_deviation < kMinVelocityDeviation) {
    q.lower_to(Verdict::kRefused, "The velocity changes by " + fixed(r.velocity_deviation, 3) +
                                      " m/s only: an offset and a constant error along the track are the same then. "
                                      "Record a drive with stops and turns.");
    return;
  }
  if (r.speed_deviation < kMinSpeedDeviation * r.speed_rms) {
    q.lower_to(options.estimate_lever_arm ? Verdict::kRefused : Verdict::kWarn,
               "The speed varies by " + fixed(r.speed_deviation, 3) + " m/s around " + fixed(r.speed_rms, 1) +
                   " m/s only: an antenna farther ahead looks like an offset. Record a drive with stops.");
  }
  if (!r.converged) q.lower_to(Verdict::kRefused, "The solution did not settle.");
  if (options.max_offset_s - std::abs(r.offset_s) < 1e-3) {
    q.lower_to(Verdict::kRefused, "The offset lies at the end of the search range, " + fixed(options.max_offset_s, 3) +
                                      " s: the range is too narrow, or the streams do not belong together.");
  }
  if (r.rms_after_m > r.rms_before_m * 1.001) {
    q.lower_to(Verdict::kWarn, "The offset does not make the positions agree better (" + fixed(r.rms_before_m, 3) +
                                   " m before, " + fixed(r.rms_after_m, 3) + " m after).");
  }
  const Verdict by_sigma = r.sigma_s > 0.1 ? Verdict::kRefused : r.sigma_s > 0.03 ? Verdict::kFair : Verdict::kOk;
  if (by_sigma != Verdict::kOk) {
    q.lower_to(by_sigma, "The offset is known to " + fixed(r.sigma_s, 3) +
                             " s (standard deviation) only. A longer recording with more changes of speed helps.");
  }
}

}  // namespace

void TimeOffsetOptions::check() const {
  require_positive("max_offset_s", max_offset_s);
  require(max_offset_s <= 1000, "max_offset_s", max_offset_s, "must be at most 1000");
  require_positive("max_reference_gap_s", max_reference_gap_s);
  require(max_reference_gap_s <= 1e6, "max_reference_gap_s", max_reference_gap_s, "must be at most 1e6");
  require_not_negative("correlation_s", correlation_s);
  require_not_negative("bias_sigma_m", bias_sigma_m);
  require(lever_arm.allFinite(), "lever_arm must be finite");
}

TimeOffsetResult estimate_time_offset(const PositionStream& stream, const PositionStream& reference,
                                      const TimeOffsetOptions& options) {
  options.check();
  check_stream(stream, "stream", false);
  check_stream(reference, "reference", true);
  if (reference.times_ns.size() < 2) throw DataError("reference: one position only");
  const bool lever = options.estimate_lever_arm || !options.lever_arm.isZero();
  require(!lever || !reference.rotations.empty(), "a lever arm needs the rotations of the reference");

  TimeOffsetResult out;
  out.lever_arm = options.lever_arm;
  const Reference ref(reference, from_seconds(options.max_reference_gap_s));
  Problem problem(stream, ref, options);
  const TimeNs margin = from_seconds(options.max_offset_s) + 1;
  for (std::size_t i = 0; i < stream.times_ns.size(); ++i) {
    if (!stream.positions[i].head(problem.axes()).allFinite()) {
      ++out.not_finite;
    } else if (!ref.covers(stream.times_ns[i], margin)) {
      ++out.outside;
    } else {
      problem.used.push_back(i);
    }
  }
  out.used = static_cast<std::int64_t>(problem.used.size());
  if (problem.used.size() < kMinSamples) {
    out.quality.lower_to(Verdict::kRefused, std::to_string(out.used) + " positions have a reference at their time; " +
                                                std::to_string(kMinSamples) +
                                                " are needed. Do both streams have the "
                                                "same clock?");
    return out;
  }

  Eigen::Vector3d mean_velocity = Eigen::Vector3d::Zero();
  double mean_speed = 0;
  double speed_2 = 0;
  const auto count = static_cast<double>(problem.used.size());
  for (const std::size_t i : problem.used) {
    Eigen::Vector3d v = ref.at(stream.times_ns[i]).velocity;
    if (options.horizontal) v.z() = 0;
    mean_velocity += v / count;
    mean_speed += v.norm() / count;
    speed_2 += v.squaredNorm() / count;
  }
  out.speed_rms = std::sqrt(speed_2);
  out.speed_deviation = std::sqrt(std::max(0.0, speed_2 - mean_speed * mean_speed));
  out.velocity_deviation = std::sqrt(std::max(0.0, speed_2 - mean_velocity.squaredNorm()));

  Parameters x = Parameters::Zero(problem.parameters());
  out.rms_before_m = rms(problem.norms(x));
  const Solution solution = solve(problem, stream, options);
  out.iterations = solution.iterations;
  out.converged = solution.converged;
  if (!solution.singular) {
    x = solution.x;
    out.offset_s = x(0);
    out.sigma_s = std::sqrt(solution.cov(0, 0));
    if (options.estimate_bias) out.bias.head(problem.axes()) = x.segment(1, problem.axes());
    if (options.estimate_lever_arm) out.lever_arm += x.tail<3>();
  }
  const std::vector<double> after = problem.norms(x);
  out.rms_after_m = rms(after);
  out.down_weighted = std::count_if(after.begin(), after.end(), [&](double r) { return r > kHuber * solution.scale; });
  judge(out, options, solution.singular);
  return out;
}

}  // namespace loc
