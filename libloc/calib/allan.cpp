#include "libloc/calib/allan.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "libloc/calib/dense.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"

namespace loc {
namespace {

enum Term { kNoise, kBias, kWalk, kQuantisation, kRamp, kTerms };
using Terms = Eigen::Matrix<double, kTerms, 1>;
constexpr std::size_t kLeastSamples = 64;

/// Variance that a term of value 1 gives at tau.
Terms unit_variances(double tau) {
  Terms v;
  v[kNoise] = 1 / tau;
  v[kBias] = 2 * std::numbers::ln2 / std::numbers::pi;
  v[kWalk] = tau / 3;
  v[kQuantisation] = 3 / (tau * tau);
  v[kRamp] = tau * tau / 2;
  return v;
}

/// Equivalent degrees of freedom of the overlapping estimator for n phases and m samples a tau; slope of log variance
/// over log tau tells the kind of noise.
double degrees_of_freedom(double n, double m, double slope) {
  if (slope < -0.5) return (3 * (n - 1) / (2 * m) - 2 * (n - 2) / n) * 4 * m * m / (4 * m * m + 5);
  if (slope < 0.5) {
    return m < 2 ? 2 * (n - 2) * (n - 2) / (2.3 * n - 4.9) : 5 * n * n / (4 * m * (n + 3 * m));
  }
  return (n - 2) / m * ((n - 1) * (n - 1) - 3 * m * (n - 1) + 4 * m * m) / ((n - 3) * (n - 3));
}

std::vector<AllanPoint> curve(std::span<const double> values, double rate_hz, const AllanOptions& options) {
  const std::size_t n = values.size();
  const double average = mean(values);
  // Phase: integral of the rate. Without the mean its size stays that of the noise.
  std::vector<double> phase(n + 1, 0.0);
  for (std::size_t i = 0; i < n; ++i) phase[i + 1] = phase[i] + (values[i] - average);
  std::vector<AllanPoint> points;
  const double longest = std::max(1.0, std::floor(static_cast<double>(n) * options.longest_share));
  for (int k = 0;; ++k) {
    const double exact = std::exp2(static_cast<double>(k) / options.points_per_octave);
    if (exact > longest) break;
    const auto m = static_cast<std::size_t>(std::llround(exact));
    if (!points.empty() && points.back().samples == static_cast<std::int64_t>(m)) continue;
    double sum = 0;
    for (std::size_t i = 0; i + 2 * m <= n; ++i) {
      const double d = phase[i + 2 * m] - 2 * phase[i + m] + phase[i];
      sum += d * d;
    }
    const auto md = static_cast<double>(m);
    AllanPoint point;
    point.samples = static_cast<std::int64_t>(m);
    point.tau_s = md / rate_hz;
    point.deviation = std::sqrt(sum / (2 * md * md * static_cast<double>(n + 1 - 2 * m)));
    points.push_back(point);
  }
  return points;
}

/// Slope of log variance over log tau around each point, over an octave.
std::vector<double> slopes(const std::vector<AllanPoint>& points, int points_per_octave) {
  std::vector<double> out(points.size(), -1.0);
  const int reach = std::max(1, points_per_octave / 2);
  for (int i = 0; i < static_cast<int>(points.size()); ++i) {
    const AllanPoint& a = points[static_cast<std::size_t>(std::max(0, i - reach))];
    const AllanPoint& b = points[static_cast<std::size_t>(std::min(static_cast<int>(points.size()) - 1, i + reach))];
    if (b.tau_s > a.tau_s && a.deviation > 0 && b.deviation > 0) {
      out[static_cast<std::size_t>(i)] = 2 * std::log(b.deviation / a.deviation) / std::log(b.tau_s / a.tau_s);
    }
  }
  return out;
}

/// First point of the fit: a low-pass filter in the sensor flattens the beginning of the curve, before the slope of
/// white noise sets in.
std::size_t first_fitted(const std::vector<double>& slope) {
  constexpr double kWhite = -0.8;
  const std::size_t half = slope.size() / 2;
  if (slope.empty() || slope.front() <= kWhite) return 0;
  for (std::size_t i = 0; i < half; ++i) {
    if (slope[i] <= kWhite) return i;
  }
  return 0;
}

struct TermFit {
  Terms squares = Terms::Zero();  ///< of N, B, K, Q, R
  Eigen::Matrix<double, kTerms, kTerms> cov = Eigen::Matrix<double, kTerms, kTerms>::Zero();
  double cost = std::numeric_limits<double>::infinity();
};

/// Least squares without negative and without needless terms: with five of them, all choices can be tried.
TermFit fit_choices(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  TermFit best;
  double least = std::numeric_limits<double>::infinity();
  for (unsigned choice = 1; choice < (1U << kTerms); ++choice) {
    std::vector<int> columns;
    for (int k = 0; k < kTerms; ++k) {
      if (((choice >> static_cast<unsigned>(k)) & 1U) != 0) columns.push_back(k);
    }
    const auto n = static_cast<Eigen::Index>(columns.size());
    if (n > a.rows()) continue;
    Eigen::MatrixXd part(a.rows(), n);
    for (Eigen::Index k = 0; k < n; ++k) part.col(k) = a.col(columns[static_cast<std::size_t>(k)]);
    const Eigen::VectorXd scale = part.colwise().norm().cwiseInverse();
    const Eigen::MatrixXd scaled = part * scale.asDiagonal();
    const Eigen::MatrixXd normal = dense::gram(scaled);
    const Eigen::VectorXd x = dense::solve_symmetric(normal, scaled.transpose() * b);
    if (!x.allFinite() || !(x.array() > 0).all()) continue;
    const double cost = (scaled * x - b).squaredNorm();
    // A term more must pay (Akaike's criterion), or the ramp takes a part of every random walk.
    const double judged = cost + 2 * static_cast<double>(n);
    if (!(judged < least)) continue;
    least = judged;
    best = TermFit{};
    best.cost = cost;
    const Eigen::MatrixXd cov =
        scale.asDiagonal() * dense::solve_symmetric(normal, Eigen::MatrixXd::Identity(n, n)) * scale.asDiagonal();
    for (Eigen::Index i = 0; i < n; ++i) {
      best.squares[columns[static_cast<std::size_t>(i)]] = x[i] * scale[i];
      for (Eigen::Index j = 0; j < n; ++j) {
        best.cov(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)]) = cov(i, j);
      }
    }
  }
  return best;
}

TermFit fit_terms(std::span<const AllanPoint> points, int points_per_octave) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::VectorXd model(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double d = points[static_cast<std::size_t>(i)].deviation;
    model[i] = d * d;
  }
  const Eigen::VectorXd measured = model;
  TermFit fit;
  // The deviation of a variance is in proportion to its true value: weights follow the model.
  for (int round = 0; round < 20; ++round) {
    Eigen::MatrixXd a(n, kTerms);
    Eigen::VectorXd b(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const AllanPoint& p = points[static_cast<std::size_t>(i)];
      // Points within an octave share most of their data: together they count as one.
      const double weight = std::sqrt(p.freedom / 2 / points_per_octave) / model[i];
      a.row(i) = weight * unit_variances(p.tau_s).transpose();
      b[i] = weight * measured[i];
    }
    fit = fit_choices(a, b);
    if (!std::isfinite(fit.cost)) return fit;
    Eigen::VectorXd next(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      next[i] = unit_variances(points[static_cast<std::size_t>(i)].tau_s).dot(fit.squares);
    }
    const double change = ((next - model).array() / next.array()).abs().maxCoeff();
    model = next;
    if (change < 1e-6) break;
  }
  return fit;
}

/// Variances beyond it would have given so low a point once in 200 times.
double largest_variance(const AllanPoint& p) {
  constexpr double kProbability = 0.005;
  constexpr double kNormal = 2.5758;  // its quantile, for the many degrees of freedom that make chi-square normal
  const double low = p.freedom > 1e4 ? 1 - kNormal * std::sqrt(2 / p.freedom)
                                     : chi_square_quantile(kProbability, p.freedom) / p.freedom;
  return p.deviation * p.deviation / low;
}

AllanTerm term_of(Term term, const TermFit& fit, std::span<const AllanPoint> points, double least_share) {
  AllanTerm out;
  double bound = std::numeric_limits<double>::infinity();
  for (const AllanPoint& p : points) {
    const Terms unit = unit_variances(p.tau_s);
    bound = std::min(bound, largest_variance(p) / unit[term]);
    const double share = unit[term] * fit.squares[term] / unit.dot(fit.squares);
    if (share > out.share) {
      out.share = share;
      out.tau_s = p.tau_s;
    }
  }
  out.upper_bound = std::sqrt(bound);
  const double square = fit.squares[term];
  // Neighbouring octaves are correlated too, which the fit does not know: factor found by simulation (see the test).
  constexpr double kCorrelation = 1.4;
  const double square_sigma = kCorrelation * std::sqrt(fit.cov(term, term));
  constexpr double kSignificant = 3;
  if (square > kSignificant * square_sigma && out.share >= least_share) {
    out.identified = true;
    out.value = std::sqrt(square);
    out.sigma = square_sigma / (2 * out.value);
  }
  return out;
}

/// Of one axis, or of the three of a sensor: axes with the same lack share one sentence.
void judge(std::span<const AllanFit> fits, const std::string& sensor, Quality& quality) {
  const auto lower = [&](Verdict verdict, const auto& is, const std::string& reason) {
    std::string axes;
    for (std::size_t k = 0; k < fits.size(); ++k) {
      if (is(fits[k])) axes += std::string(" ") + "xyz"[k];
    }
    if (!axes.empty()) quality.lower_to(verdict, sensor.empty() ? reason : sensor + axes + ": " + reason);
  };
  std::vector<std::string> refused;
  double duration_s = 0;
  for (const AllanFit& fit : fits) {
    duration_s = fit.duration_s;
    if (fit.quality.usable()) continue;
    for (const std::string& reason : fit.quality.reasons) {
      if (std::find(refused.begin(), refused.end(), reason) == refused.end()) refused.push_back(reason);
    }
  }
  for (const std::string& reason : refused) {
    lower(
        Verdict::kRefused,
        [&](const AllanFit& fit) {
          return !fit.quality.usable() &&
                 std::find(fit.quality.reasons.begin(), fit.quality.reasons.end(), reason) != fit.quality.reasons.end();
        },
        reason);
  }
  const auto unseen = [](AllanTerm AllanFit::*term) {
    return [term](const AllanFit& fit) { return fit.quality.usable() && !(fit.*term).identified; };
  };
  const auto at_most = [&](AllanTerm AllanFit::*term) {
    double bound = 0;
    for (const AllanFit& fit : fits) {
      if (unseen(term)(fit)) bound = std::max(bound, (fit.*term).upper_bound);
    }
    return ", it is at most " + to_text(bound, 3);
  };
  const std::string duration = to_text(std::round(duration_s)) + " s of recording";
  lower(Verdict::kWarn, unseen(&AllanFit::noise_density),
        "The noise density is not visible in " + duration + ": no part of the curve falls as white noise does.");
  lower(Verdict::kFair, unseen(&AllanFit::bias_instability),
        "The bias instability is not visible in " + duration + at_most(&AllanFit::bias_instability) +
            ": the curve has no floor of its own. Record longer.");
  lower(Verdict::kFair, unseen(&AllanFit::random_walk),
        "The random walk of the bias is not visible in " + duration + at_most(&AllanFit::random_walk) +
            ": the curve does not rise at its end. Record longer, hours rather than minutes.");
  double misfit = 0;
  for (const AllanFit& fit : fits) misfit = std::max(misfit, std::isfinite(fit.misfit) ? fit.misfit : 0);
  lower(
      Verdict::kWarn, [](const AllanFit& fit) { return fit.misfit > 3; },
      "The curve is not a sum of the usual terms (misfit " + to_text(std::round(misfit * 10) / 10) +
          " deviations): vibration, or a filter in the sensor.");
}

}  // namespace

void AllanOptions::check() const {
  require(points_per_octave >= 1 && points_per_octave <= 64, "points_per_octave", points_per_octave,
          "must be in [1, 64]");
  require(longest_share > 0 && longest_share <= 0.5, "longest_share", longest_share, "must be in (0, 0.5]");
}

AllanFit allan_fit(std::span<const double> values, double rate_hz, const AllanOptions& options) {
  options.check();
  require_positive("rate_hz", rate_hz);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) {
      throw DataError("value " + std::to_string(i) + " = " + to_text(values[i]) + ": must be finite");
    }
  }
  AllanFit fit;
  fit.rate_hz = rate_hz;
  fit.duration_s = static_cast<double>(values.size()) / rate_hz;
  const auto refuse = [&](std::string reason) {
    fit.quality.lower_to(Verdict::kRefused, std::move(reason));
    return fit;
  };
  if (values.size() < kLeastSamples) {
    return refuse(std::to_string(values.size()) + " samples: at least " + std::to_string(kLeastSamples) +
                  " are needed, and hours of them for a random walk.");
  }
  fit.points = curve(values, rate_hz, options);
  const bool positive = std::all_of(fit.points.begin(), fit.points.end(),
                                    [](const AllanPoint& p) { return std::isfinite(p.deviation) && p.deviation > 0; });
  if (!positive) {
    fit.points.clear();
    return refuse("The values do not change, or are too large to square.");
  }
  const std::vector<double> slope = slopes(fit.points, options.points_per_octave);
  const auto phases = static_cast<double>(values.size() + 1);
  for (std::size_t i = 0; i < fit.points.size(); ++i) {
    AllanPoint& p = fit.points[i];
    p.freedom = std::max(1.0, degrees_of_freedom(phases, static_cast<double>(p.samples), slope[i]));
    p.sigma = p.deviation / std::sqrt(2 * p.freedom);
    if (!(p.deviation >= fit.minimum_deviation)) {
      fit.minimum_deviation = p.deviation;
      fit.minimum_tau_s = p.tau_s;
    }
  }
  const std::size_t first = first_fitted(slope);
  const std::span<const AllanPoint> fitted = std::span(fit.points).subspan(first);
  fit.fitted_from_tau_s = fitted.front().tau_s;
  const TermFit terms = fit_terms(fitted, options.points_per_octave);
  if (!std::isfinite(terms.cost)) return refuse("No sum of noise terms fits the curve.");
  fit.misfit = std::sqrt(terms.cost * options.points_per_octave / static_cast<double>(fitted.size()));
  constexpr double kMain = 0.5;
  // Between white noise and random walk the floor never has the curve to itself.
  constexpr double kFloor = 0.4;
  fit.noise_density = term_of(kNoise, terms, fitted, kMain);
  fit.bias_instability = term_of(kBias, terms, fitted, kFloor);
  fit.random_walk = term_of(kWalk, terms, fitted, kMain);
  Quality quality;
  judge(std::span(&fit, 1), "", quality);
  fit.quality = quality;
  return fit;
}

namespace {

constexpr int kLongestBridge = 4;      // samples: more that are lost in one place end the part
constexpr double kMuchBridged = 0.01;  // of the samples
constexpr double kLeastShare = 0.1;    // of the recording, without a warning
constexpr double kLeastDuration = 60;  // [s]

/// The usable rows of a part, and how many samples were lost before each of them.
struct SteadyRows {
  std::vector<Eigen::Index> rows;
  std::vector<int> lost_before;
  std::int64_t bridged = 0;

  std::vector<double> values(const TriadRows& data, int axis) const {
    std::vector<double> out;
    out.reserve(rows.size() + static_cast<std::size_t>(bridged));
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const double value = data(rows[k], axis);
      for (int i = 1; i <= lost_before[k]; ++i) {
        const double before = data(rows[k - 1], axis);
        out.push_back(before + (value - before) * i / (lost_before[k] + 1));
      }
      out.push_back(value);
    }
    return out;
  }
};

/// A late time stamp is made up for by the next ones, a lost sample is not: the steps until some rows later tell.
SteadyRows steady_rows(std::span<const TimeNs> times_ns, const TriadRows& gyroscope, const TriadRows& accelerometer,
                       const StillSegment& part) {
  SteadyRows out;
  std::vector<TimeNs> times;
  for (auto row = part.begin; row < part.end; ++row) {
    const TimeNs t = times_ns[static_cast<std::size_t>(row)];
    const bool finite = (gyroscope.rows() == 0 || gyroscope.row(row).allFinite()) &&
                        (accelerometer.rows() == 0 || accelerometer.row(row).allFinite());
    if (!finite || t == kNoTime || (!times.empty() && t <= times.back())) continue;
    times.push_back(t);
    out.rows.push_back(row);
  }
  out.lost_before.assign(times.size(), 0);
  // Over many steps, as single ones may have the resolution of a coarse clock.
  constexpr std::size_t kMany = 50;
  const std::size_t reach = std::min(kMany, times.size() - 1);
  std::vector<double> periods;
  for (std::size_t k = 0; k + reach < times.size(); ++k) {
    periods.push_back(elapsed_s(times[k], times[k + reach]) / static_cast<double>(reach));
  }
  if (reach == 0) return out;
  const double period = quantile(periods, 0.5);
  constexpr std::size_t kAhead = 4;
  for (std::size_t k = 1; k < times.size(); ++k) {
    if (elapsed_s(times[k - 1], times[k]) <= 1.5 * period) continue;
    // The least that any later row leaves: further losses ahead must not be counted here.
    int lost = kLongestBridge;
    for (std::size_t j = k; j < std::min(times.size(), k + kAhead + 1); ++j) {
      const double periods_passed = elapsed_s(times[k - 1], times[j]) / period;
      lost = std::min(lost, static_cast<int>(std::lround(periods_passed)) - static_cast<int>(j - k + 1));
    }
    out.lost_before[k] = std::max(0, lost);
    out.bridged += out.lost_before[k];
  }
  return out;
}

}  // namespace

ImuAllan analyse_imu_noise(std::span<const TimeNs> times_ns, const TriadRows& gyroscope, const TriadRows& accelerometer,
                           const AllanOptions& options, StillnessOptions stillness) {
  options.check();
  stillness.gap_periods = std::min(stillness.gap_periods, kLongestBridge + 1.5);
  const Stillness still = find_stillness(times_ns, gyroscope, accelerometer, stillness);
  ImuAllan out;
  out.quality = still.quality;
  if (still.segments.empty()) return out;
  const StillSegment& longest =
      *std::max_element(still.segments.begin(), still.segments.end(),
                        [](const StillSegment& a, const StillSegment& b) { return a.samples < b.samples; });
  out.begin = longest.begin;
  out.end = longest.end;
  out.duration_s = longest.duration_s();
  out.used_share = static_cast<double>(out.end - out.begin) / static_cast<double>(times_ns.size());
  if (out.used_share < 0.9) {
    out.quality.lower_to(Verdict::kFair, "Only " + to_text(std::round(out.used_share * 1000) / 10) +
                                             " % of the recording is used, rows " + std::to_string(out.begin) + " to " +
                                             std::to_string(out.end) + ": " + std::to_string(still.segments.size()) +
                                             " still parts, " + std::to_string(still.gaps) + " gaps, " +
                                             std::to_string(still.not_finite + still.out_of_order) + " bad rows.");
  }
  if (out.used_share < kLeastShare || out.duration_s < kLeastDuration) {
    out.quality.lower_to(Verdict::kWarn, "Only " + to_text(std::round(out.duration_s * 10) / 10) + " s were used, " +
                                             to_text(std::round(out.used_share * 1000) / 10) +
                                             " % of the recording: let the device lie still, without lost samples.");
  }
  const SteadyRows steady = steady_rows(times_ns, gyroscope, accelerometer, longest);
  out.bridged = steady.bridged;
  const auto count = static_cast<std::int64_t>(steady.rows.size()) + steady.bridged;
  if (static_cast<double>(out.bridged) > kMuchBridged * static_cast<double>(count)) {
    out.quality.lower_to(Verdict::kFair, std::to_string(out.bridged) + " of " + std::to_string(count) +
                                             " samples are lost or not finite and were interpolated: the noise comes "
                                             "out a little too small.");
  }
  // Mean rate over the part: the median period has the resolution of the time stamps.
  const double rate_hz = static_cast<double>(count - 1) / longest.duration_s();
  const auto analyse = [&](const TriadRows& rows, const char* name, std::array<AllanFit, 3>& fits) {
    for (int axis = 0; axis < 3; ++axis) {
      fits[static_cast<std::size_t>(axis)] = allan_fit(steady.values(rows, axis), rate_hz, options);
    }
    judge(fits, name, out.quality);
  };
  out.has_gyroscope = gyroscope.rows() > 0;
  out.has_accelerometer = accelerometer.rows() > 0;
  if (out.has_gyroscope) analyse(gyroscope, "gyroscope", out.gyroscope);
  if (out.has_accelerometer) analyse(accelerometer, "accelerometer", out.accelerometer);
  return out;
}

ImuNoiseFit imu_noise_from(const ImuAllan& allan, const ImuNoise& fallback) {
  fallback.check();
  ImuNoiseFit out{.noise = fallback, .measured = {}, .quality = {}};
  const auto take = [&](const std::array<AllanFit, 3>& axes, bool present, AllanTerm AllanFit::*term,
                        const std::string& name, Verdict missing, double& field) {
    if (!present) {
      out.quality.lower_to(missing, name + " was not recorded: " + to_text(field, 3) + " is the fallback.");
      return;
    }
    double square = 0;
    double bound = 0;
    int identified = 0;
    for (const AllanFit& axis : axes) {
      const AllanTerm& t = axis.*term;
      if (t.identified) {
        square += t.value * t.value;
        ++identified;
      }
      if (!std::isnan(t.upper_bound)) bound = std::max(bound, t.upper_bound);
    }
    if (identified > 0) {
      field = std::sqrt(square / identified);
      out.measured.push_back(name);
      if (identified < 3) {
        out.quality.lower_to(Verdict::kFair, name + " was identified on " + std::to_string(identified) + " of 3 axes.");
      }
    } else if (bound > 0 && bound < field) {
      field = bound;
      out.quality.lower_to(missing, name + " was not identified: " + to_text(field, 3) +
                                        " is the largest value that the recording allows.");
    } else {
      out.quality.lower_to(missing, name + " was not identified: " + to_text(field, 3) + " is the fallback.");
    }
  };
  take(allan.gyroscope, allan.has_gyroscope, &AllanFit::noise_density, "gyroscope_noise_density", Verdict::kWarn,
       out.noise.gyroscope_noise_density);
  take(allan.gyroscope, allan.has_gyroscope, &AllanFit::random_walk, "gyroscope_random_walk", Verdict::kFair,
       out.noise.gyroscope_random_walk);
  take(allan.accelerometer, allan.has_accelerometer, &AllanFit::noise_density, "accelerometer_noise_density",
       Verdict::kWarn, out.noise.accelerometer_noise_density);
  take(allan.accelerometer, allan.has_accelerometer, &AllanFit::random_walk, "accelerometer_random_walk",
       Verdict::kFair, out.noise.accelerometer_random_walk);
  if (!allan.has_gyroscope && !allan.has_accelerometer) {
    out.quality.lower_to(Verdict::kRefused, "Nothing was measured: all values are the fallback.");
  }
  return out;
}

}  // namespace loc
