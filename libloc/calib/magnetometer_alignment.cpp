#include "libloc/calib/magnetometer_alignment.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "libloc/calib/dense.hpp"
#include "libloc/calib/least_squares.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr double kBiasPrior = 0.1;    // [rad/s]: a gyroscope at rest shows less
constexpr double kDelayPrior = 0.05;  // [s]
constexpr double kSlowTurn = 0.15;    // [rad] in an interval, up to which its mean readings belong together
constexpr double kFlatDip = 10 * std::numbers::pi / 180;  // the sign of a smaller dip is not trusted
constexpr std::size_t kLeastIntervals = 20;
constexpr std::size_t kLeastGravity = 10;  // readings: the scatter of fewer says little
constexpr double kGravitySigma = 0.002;    // [rad]: no accelerometer shows the vertical better

std::string degrees(double angle) {
  return to_text(std::round(angle * 180 / std::numbers::pi * 100) / 100) + " deg";
}

double median_norm(const TriadRows& rows) {
  std::vector<double> norms;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const double n = rows.row(i).norm();
    if (std::isfinite(n) && n > 0) norms.push_back(n);
  }
  return norms.empty() ? kUnknown : quantile(norms, 0.5);
}

/// Cuts the recording into intervals between two good readings of the field.
class IntervalBuilder {
 public:
  IntervalBuilder(const MagnetometerAlignmentOptions& options, double field, double gravity, double longest_step)
      : options_(options), field_(field), gravity_(gravity), longest_step_(longest_step) {}

  /// Rows in order of time, all but the field finite. @param up NaN when there is no accelerometer
  void add(TimeNs time_ns, const Eigen::Vector3d& rate, const Eigen::Vector3d& force, const Eigen::Vector3d& reading) {
    if (last_ns_ != kNoTime && time_ns <= last_ns_) return;
    if (last_ns_ != kNoTime) {
      const double dt = elapsed_s(last_ns_, time_ns);
      if (dt > longest_step_) {
        open_ = false;
      } else if (open_) {
        integrate(dt, rate);
      }
    }
    last_ns_ = time_ns;
    last_rate_ = rate;
    force_sum_ += force;
    largest_force_error_ = std::max(largest_force_error_, std::abs(force.norm() / gravity_ - 1));
    ++rows_;
    take_field(time_ns, reading);
  }

  std::vector<FieldInterval> intervals;
  std::int64_t repeated = 0;
  std::int64_t disturbed = 0;
  std::int64_t too_fast = 0;

 private:
  void integrate(double dt, const Eigen::Vector3d& rate) {
    const Eigen::Vector3d theta = dt / 2 * (last_rate_ + rate) + dt * dt / 12 * last_rate_.cross(rate);
    if (!(theta.norm() <= std::numbers::pi)) {
      ++too_fast;
      open_ = false;
      return;
    }
    const Eigen::Quaterniond turn = so3::exp(theta);
    now_.d_bias = turn.conjugate().toRotationMatrix() * now_.d_bias - dt * so3::right_jacobian(theta);
    now_.d_matrix = turn.conjugate().toRotationMatrix() * now_.d_matrix;
    const Eigen::Vector3d angle = dt / 2 * (last_rate_ + rate);
    for (int k = 0; k < 3; ++k) now_.d_matrix.middleCols<3>(3 * k) += angle[k] * so3::right_jacobian(theta);
    now_.q_begin_end = (now_.q_begin_end * turn).normalized();
  }

  void take_field(TimeNs time_ns, const Eigen::Vector3d& reading) {
    if (!reading.allFinite()) return;
    if (reading == last_reading_) {
      ++repeated;
      return;
    }
    last_reading_ = reading;
    const Eigen::Vector3d m = reading / field_;
    if (!(std::abs(m.norm() - 1) <= options_.norm_tolerance)) {
      ++disturbed;
      open_ = false;
      return;
    }
    if (open_) {
      field_sum_ += m;
      ++fields_;
      if (elapsed_s(start_ns_, time_ns) < options_.interval_s * (1 - 1e-6)) return;
      now_.end = m;
      now_.rate_end = last_rate_;
      now_.field = field_sum_ / fields_;
      const double turned = Eigen::AngleAxisd(now_.q_begin_end).angle();
      now_.has_gravity = largest_force_error_ <= options_.force_tolerance && turned <= kSlowTurn;
      if (now_.has_gravity) now_.up = (force_sum_ / rows_).normalized();
      intervals.push_back(now_);
    }
    now_ = FieldInterval{};
    now_.begin = m;
    now_.rate_begin = last_rate_;
    open_ = true;
    start_ns_ = time_ns;
    field_sum_ = m;
    fields_ = 1;
    force_sum_.setZero();
    largest_force_error_ = std::isfinite(gravity_) ? 0 : std::numeric_limits<double>::infinity();
    rows_ = 0;
  }

  const MagnetometerAlignmentOptions& options_;
  double field_;
  double gravity_;
  double longest_step_;
  FieldInterval now_;
  bool open_ = false;
  TimeNs last_ns_ = kNoTime;
  TimeNs start_ns_ = kNoTime;
  Eigen::Vector3d last_rate_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d last_reading_ = Eigen::Vector3d::Constant(kUnknown);
  Eigen::Vector3d field_sum_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_sum_ = Eigen::Vector3d::Zero();
  double largest_force_error_ = std::numeric_limits<double>::infinity();
  double fields_ = 0;
  double rows_ = 0;
};

/// Constraint 1 as linear equations in the nine entries of R.
Eigen::Quaterniond linear_start(const std::vector<FieldInterval>& intervals) {
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (const FieldInterval& k : intervals) {
    const Eigen::Matrix3d back = k.q_begin_end.conjugate().toRotationMatrix();
    Eigen::Matrix<double, 3, 9> a;
    for (int column = 0; column < 3; ++column) {
      a.middleCols<3>(3 * column) = k.end[column] * Eigen::Matrix3d::Identity() - k.begin[column] * back;
    }
    normal += dense::gram(a);
  }
  const Eigen::Matrix<double, 9, 1> entries = dense::symmetric_eigen(normal).vectors.col(0);
  const Eigen::Matrix3d g = Eigen::Map<const Eigen::Matrix3d>(entries.data());
  Eigen::Matrix3d r = dense::nearest_orthogonal(g);
  if (r.determinant() < 0) r = -r;  // the sign of the solution is free
  return Eigen::Quaterniond(r).normalized();
}

double median_residual(const std::vector<FieldInterval>& intervals, const Eigen::Quaterniond& r) {
  std::vector<double> sizes;
  for (const FieldInterval& k : intervals) {
    sizes.push_back(alignment_residual(k, r, AlignmentVector::Zero(), nullptr).head<3>().norm());
  }
  return quantile(sizes, 0.5);
}

/// The linear solution, unless an exchange of axes fits better (when the turning hardly determines it).
Eigen::Quaterniond best_start(const std::vector<FieldInterval>& intervals) {
  Eigen::Quaterniond best = linear_start(intervals);
  double least = median_residual(intervals, best);
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (unsigned signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) {
        m(row, order[static_cast<std::size_t>(row)]) = ((signs >> static_cast<unsigned>(row)) & 1U) != 0 ? -1 : 1;
      }
      if (m.determinant() < 0) continue;
      const Eigen::Quaterniond q(m);
      const double residual = median_residual(intervals, q);
      if (residual < least) {
        least = residual;
        best = q;
      }
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return best;
}

using ErrorJacobian = Eigen::Matrix<double, 4, kCalibrationErrors>;
using CalibrationErrors = Eigen::Matrix<double, kCalibrationErrors, 1>;  // in units of their deviations

/// The fit around one point: residuals with the effect of the calibrations' errors, which is linear.
struct Problem {
  std::span<const FieldInterval> intervals;
  Eigen::Quaterniond start;
  std::vector<ErrorJacobian> effects;

  Problem(const std::vector<FieldInterval>& all, const Eigen::Quaterniond& r, const AlignmentVector& x,
          const MagnetometerAlignmentOptions& options)
      : intervals(all), start(r) {
    effects.reserve(all.size());
    for (const FieldInterval& k : all) {
      ErrorJacobian j = alignment_error_jacobian(k, r, x);
      j.leftCols<9>() *= options.gyroscope_matrix_sigma;
      j.rightCols<9>() *= options.field_sigma;
      j.middleCols<3>(12) *= std::numbers::sqrt2 / 2;  // a symmetric matrix without a preferred direction
      effects.push_back(j);
    }
  }

  Eigen::Vector4d residual(std::size_t k, const AlignmentVector& x, const CalibrationErrors& errors,
                           Eigen::Matrix<double, 4, 8>* jacobian = nullptr) const {
    return alignment_residual(intervals[k], start, x, jacobian) + effects[k] * errors;
  }
};

struct Weights {
  Eigen::VectorXd turn;
  Eigen::VectorXd gravity;
};

/// One over the robust deviation of each kind of residual, times the root of Tukey's weight. A few readings of gravity
/// agree by chance and would then count for more than all the turning: they are left out.
Weights weights_at(const Problem& problem, const AlignmentVector& x, const CalibrationErrors& errors) {
  std::vector<double> turn;
  std::vector<double> gravity;
  for (std::size_t k = 0; k < problem.intervals.size(); ++k) {
    const Eigen::Vector4d r = problem.residual(k, x, errors);
    for (int i = 0; i < 3; ++i) turn.push_back(r[i]);
    if (problem.intervals[k].has_gravity) gravity.push_back(r[3]);
  }
  constexpr double kFloor = 1e-6;  // exact data must not divide by zero
  const double turn_sigma = std::max(kFloor, robust_sigma(turn));
  const bool use_gravity = gravity.size() >= kLeastGravity;
  const double gravity_scatter =
      use_gravity ? robust_sigma(gravity) * small_sample_factor(static_cast<int>(gravity.size()) - 1) : 0;
  const double gravity_sigma = std::max(kGravitySigma, gravity_scatter);
  const auto n = static_cast<Eigen::Index>(problem.intervals.size());
  Weights w{.turn = Eigen::VectorXd::Zero(n), .gravity = Eigen::VectorXd::Zero(n)};
  for (Eigen::Index k = 0; k < n; ++k) {
    const FieldInterval& interval = problem.intervals[static_cast<std::size_t>(k)];
    const Eigen::Vector4d r = problem.residual(static_cast<std::size_t>(k), x, errors);
    w.turn[k] = std::sqrt(tukey_weight(r.head<3>().norm() / turn_sigma / std::sqrt(3.0))) / turn_sigma;
    if (use_gravity && interval.has_gravity)
      w.gravity[k] = std::sqrt(tukey_weight(r[3] / gravity_sigma)) / gravity_sigma;
  }
  return w;
}

LeastSquaresResult refine(const Problem& problem, const Weights& w, const Eigen::VectorXd& x0) {
  const auto n = static_cast<Eigen::Index>(problem.intervals.size());
  constexpr int kAll = 8 + kCalibrationErrors;
  const ResidualFunction function = [&](const Eigen::VectorXd& x, Eigen::VectorXd& r, Eigen::MatrixXd* jacobian) {
    r.resize(4 * n + 5 + kCalibrationErrors);
    if (jacobian != nullptr) jacobian->setZero(r.size(), kAll);
    Eigen::Matrix<double, 4, 8> j;
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const Eigen::Vector4d weight(w.turn[k], w.turn[k], w.turn[k], w.gravity[k]);
      r.segment<4>(4 * k) = weight.cwiseProduct(
          problem.residual(i, x.head<8>(), x.tail<kCalibrationErrors>(), jacobian != nullptr ? &j : nullptr));
      if (jacobian != nullptr) {
        jacobian->middleRows<4>(4 * k) << weight.asDiagonal() * j, weight.asDiagonal() * problem.effects[i];
      }
    }
    // Weak knowledge of bias, dip and delay, so that each is determined in any recording.
    r.segment<5>(4 * n) << x.segment<3>(3) / kBiasPrior, x[6], x[7] / kDelayPrior;
    r.tail<kCalibrationErrors>() = x.tail<kCalibrationErrors>();
    if (jacobian != nullptr) {
      for (int i = 0; i < 3; ++i) (*jacobian)(4 * n + i, 3 + i) = 1 / kBiasPrior;
      (*jacobian)(4 * n + 3, 6) = 1;
      (*jacobian)(4 * n + 4, 7) = 1 / kDelayPrior;
      jacobian->bottomRightCorner<kCalibrationErrors, kCalibrationErrors>().setIdentity();
    }
  };
  return minimise(function, x0, {.max_iterations = 30});
}

/// Covariance that also holds where residuals are not independent: neighbours share a reading, and what the model
/// leaves out (filters of the sensors, disturbed field) lasts longer than one interval. The scores of whole blocks tell
/// (Liang, Zeger, "Longitudinal data analysis using generalized linear models", 1986); where they say less than the
/// curvature, the curvature holds.
/// @return (8, 8) of AlignmentVector
Eigen::MatrixXd cautious_covariance(const Problem& problem, const AlignmentVector& x, const CalibrationErrors& errors,
                                    const Weights& w, const Eigen::MatrixXd& cov_all) {
  const std::span<const FieldInterval> intervals = problem.intervals;
  const Eigen::MatrixXd cov = cov_all.topLeftCorner<8, 8>();
  constexpr std::size_t kBlock = 20;
  constexpr std::size_t kLeastBlocks = 8;
  const std::size_t block = std::max<std::size_t>(1, std::min(kBlock, intervals.size() / kLeastBlocks));
  Eigen::Matrix<double, 8, 8> scores = Eigen::Matrix<double, 8, 8>::Zero();
  AlignmentVector score = AlignmentVector::Zero();
  std::size_t blocks = 0;
  for (std::size_t k = 0; k < intervals.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const Eigen::Vector4d weight(w.turn[i], w.turn[i], w.turn[i], w.gravity[i]);
    Eigen::Matrix<double, 4, 8> jacobian;
    const Eigen::Vector4d residual = weight.cwiseAbs2().cwiseProduct(problem.residual(k, x, errors, &jacobian));
    // Pull of the block on the solution: the calibrations' errors follow, so their columns count too.
    Eigen::VectorXd pull(8 + kCalibrationErrors);
    pull.head<8>() = jacobian.transpose() * residual;
    pull.tail<kCalibrationErrors>() = problem.effects[k].transpose() * residual;
    score += dense::product(cov_all.topRows(8), pull);
    if ((k + 1) % block == 0 || k + 1 == intervals.size()) {
      scores += score * score.transpose();
      score.setZero();
      ++blocks;
    }
  }
  scores *= static_cast<double>(blocks) / std::max(1.0, static_cast<double>(blocks) - 1);
  const auto root = dense::cholesky(cov);
  if (!root) return cov;
  // In units of the curvature's own deviations the model says 1 in every direction.
  const Eigen::MatrixXd half = dense::solve_lower(*root, scores);
  const dense::SymmetricEigen eigen = dense::symmetric_eigen(dense::solve_lower(*root, half.transpose()));
  return dense::compose(dense::product(*root, eigen.vectors), eigen.values.cwiseMax(1.0));
}

/// The signed axes that the matrix is nearest to, and by how much it is off.
void name_axes(MagnetometerAlignment& out) {
  Eigen::Matrix3d nearest = Eigen::Matrix3d::Zero();
  for (int row = 0; row < 3; ++row) {
    int column = 0;
    out.matrix.row(row).cwiseAbs().maxCoeff(&column);
    nearest(row, column) = out.matrix(row, column) > 0 ? 1 : -1;
    out.axes += (row > 0 ? " " : "") + std::string(nearest(row, column) < 0 ? "-" : "") + "xyz"[column];
  }
  constexpr double kNear = 20 * std::numbers::pi / 180;
  const Eigen::Matrix3d rest = out.matrix * nearest.transpose();
  const bool is_exchange = std::abs(std::abs(nearest.determinant()) - 1) < 1e-9 && rest.determinant() > 0;
  out.permuted = is_exchange && !nearest.isIdentity() && Eigen::AngleAxisd(rest).angle() < kNear;
}

/// The field may be reversed: most mirrored sensors then look turned by half a turn, or the dip has the wrong sign.
void judge_unchecked_mirror(const MagnetometerAlignmentOptions& options, MagnetometerAlignment& out) {
  constexpr double kHalfTurn = 160 * std::numbers::pi / 180;
  const bool asked = !std::isnan(options.expected_dip);
  const std::string cure = asked ? "" : ": give the place (expected_dip)";
  if (out.dip < 0 && !asked) {
    out.quality.lower_to(Verdict::kWarn, "The dip comes out as " + degrees(out.dip) +
                                             ": either the field points up here (southern hemisphere) or the "
                                             "magnetometer is mirrored and the field reversed" +
                                             cure + ".");
  } else if (out.angle > kHalfTurn) {
    out.quality.lower_to(
        Verdict::kWarn, "The magnetometer is turned by " + degrees(out.angle) +
                            " against the IMU, or mirrored and the field reversed, which was not checked" + cure + ".");
  } else {
    out.quality.lower_to(Verdict::kFair, asked ? "Whether the magnetometer is mirrored cannot be told: the dip is too "
                                                 "small, or gravity was not seen."
                                               : "Whether the magnetometer is mirrored was not checked" + cure + ".");
  }
}

void judge(const MagnetometerAlignmentOptions& options, MagnetometerAlignment& out) {
  if (out.second_axis_share < options.least_second_axis) {
    out.quality.lower_to(Verdict::kRefused, "The device was turned about one axis only (second axis " +
                                                to_text(std::round(out.second_axis_share * 1000) / 10) +
                                                " % of the first): turn it about the others too.");
  }
  if (!(out.sigma <= options.ok_sigma)) {
    const Verdict verdict = out.sigma <= options.fair_sigma   ? Verdict::kFair
                            : out.sigma <= options.warn_sigma ? Verdict::kWarn
                                                              : Verdict::kRefused;
    out.quality.lower_to(verdict, "Predicted deviation of the rotation " + degrees(out.sigma) + ", ok is up to " +
                                      degrees(options.ok_sigma) + ": turn the device more, about all axes.");
  }
  if (5 * out.inliers < 4 * out.intervals) {
    out.quality.lower_to(Verdict::kWarn, "Only " + std::to_string(out.inliers) + " of " +
                                             std::to_string(out.intervals) + " intervals fit: the field is disturbed.");
  }
  constexpr double kWideScatter = 5 * std::numbers::pi / 180;
  if (out.dip_scatter > kWideScatter) {
    out.quality.lower_to(Verdict::kWarn, "The dip angle scatters by " + degrees(out.dip_scatter) +
                                             ": the field is disturbed, or the magnetometer not well calibrated.");
  }
  if (out.mirrored) {
    out.quality.lower_to(
        Verdict::kWarn,
        "The magnetometer is mirrored (left-handed) against the IMU: an odd number of its axes has the "
        "wrong sign. The matrix corrects it.");
  }
  if (!out.mirror_checked) judge_unchecked_mirror(options, out);
}

}  // namespace

void MagnetometerAlignmentOptions::check() const {
  require_positive("interval_s", interval_s);
  require(std::isnan(expected_dip) || std::abs(expected_dip) <= std::numbers::pi / 2, "expected_dip", expected_dip,
          "must be in [-pi/2, pi/2], or NaN");
  require_positive("norm_tolerance", norm_tolerance);
  require_positive("force_tolerance", force_tolerance);
  require(std::isfinite(gap_periods) && gap_periods > 1, "gap_periods", gap_periods, "must be above 1");
  require_not_negative("gyroscope_matrix_sigma", gyroscope_matrix_sigma);
  require_not_negative("field_sigma", field_sigma);
  require_not_negative("least_second_axis", least_second_axis);
  require_positive("ok_sigma", ok_sigma);
  require(std::isfinite(fair_sigma) && fair_sigma >= ok_sigma, "fair_sigma", fair_sigma, "must not be below ok_sigma");
  require(std::isfinite(warn_sigma) && warn_sigma >= fair_sigma, "warn_sigma", warn_sigma,
          "must not be below fair_sigma");
}

Eigen::Vector4d alignment_residual(const FieldInterval& interval, const Eigen::Quaterniond& start,
                                   const AlignmentVector& x, Eigen::Matrix<double, 4, 8>* jacobian) {
  const Eigen::Vector3d theta = x.head<3>();
  const Eigen::Vector3d bias = x.segment<3>(3);
  const Eigen::Matrix3d r = (start * so3::exp(theta)).toRotationMatrix();
  const Eigen::Vector3d turn_error = interval.d_bias * bias;
  const Eigen::Matrix3d back = (interval.q_begin_end * so3::exp(turn_error)).conjugate().toRotationMatrix();
  // Of so much before the time stamp: the field has turned on against the body by then.
  const double delay = x[7];
  const Eigen::Matrix3d later_begin = Eigen::Matrix3d::Identity() - delay * so3::hat(interval.rate_begin);
  const Eigen::Matrix3d later_end = Eigen::Matrix3d::Identity() - delay * so3::hat(interval.rate_end);
  const Eigen::Vector3d begin = r * interval.begin;
  const Eigen::Vector3d end = r * interval.end;
  const Eigen::Vector3d carried = back * (later_begin * begin);
  Eigen::Vector4d out;
  out.head<3>() = later_end * end - carried;
  out[3] = interval.has_gravity ? interval.up.dot(r * interval.field) + x[6] : 0;
  if (jacobian != nullptr) {
    jacobian->setZero();
    const Eigen::Matrix3d right = so3::right_jacobian(theta);
    jacobian->topLeftCorner<3, 3>() =
        (back * later_begin * r * so3::hat(interval.begin) - later_end * r * so3::hat(interval.end)) * right;
    jacobian->block<3, 3>(0, 3) = -so3::hat(carried) * so3::right_jacobian(turn_error) * interval.d_bias;
    jacobian->block<3, 1>(0, 7) = back * interval.rate_begin.cross(begin) - interval.rate_end.cross(end);
    if (interval.has_gravity) {
      jacobian->block<1, 3>(3, 0) = -interval.up.transpose() * r * so3::hat(interval.field) * right;
      (*jacobian)(3, 6) = 1;
    }
  }
  return out;
}

Eigen::Matrix<double, 4, kCalibrationErrors> alignment_error_jacobian(const FieldInterval& interval,
                                                                      const Eigen::Quaterniond& start,
                                                                      const AlignmentVector& x) {
  const Eigen::Matrix3d r = (start * so3::exp(x.head<3>())).toRotationMatrix();
  const Eigen::Vector3d turn_error = interval.d_bias * x.segment<3>(3);
  const Eigen::Matrix3d back = (interval.q_begin_end * so3::exp(turn_error)).conjugate().toRotationMatrix();
  const Eigen::Matrix3d later_begin = Eigen::Matrix3d::Identity() - x[7] * so3::hat(interval.rate_begin);
  const Eigen::Matrix3d later_end = Eigen::Matrix3d::Identity() - x[7] * so3::hat(interval.rate_end);
  const Eigen::Vector3d carried = back * (later_begin * (r * interval.begin));
  const auto by_field = [](const Eigen::Vector3d& m) {
    Eigen::Matrix<double, 3, 9> d;
    d << m.x(), 0, 0, 0, m.z(), m.y(), 1, 0, 0,  //
        0, m.y(), 0, m.z(), 0, m.x(), 0, 1, 0,   //
        0, 0, m.z(), m.y(), m.x(), 0, 0, 0, 1;
    return d;
  };
  Eigen::Matrix<double, 4, kCalibrationErrors> out = Eigen::Matrix<double, 4, kCalibrationErrors>::Zero();
  // A turn by the delay changes with G as well, by a hundredth of what is a hundredth already.
  out.topLeftCorner<3, 9>() = -so3::hat(carried) * so3::right_jacobian(turn_error) * interval.d_matrix;
  out.topRightCorner<3, 9>() =
      later_end * r * by_field(interval.end) - back * later_begin * r * by_field(interval.begin);
  if (interval.has_gravity) out.bottomRightCorner<1, 9>() = interval.up.transpose() * r * by_field(interval.field);
  return out;
}

MagnetometerAlignment align_magnetometer(std::span<const TimeNs> times_ns, const TriadRows& gyroscope,
                                         const TriadRows& accelerometer, const TriadRows& magnetometer,
                                         const MagnetometerAlignmentOptions& options) {
  options.check();
  const auto n = static_cast<Eigen::Index>(times_ns.size());
  require(gyroscope.rows() == n, "rows of gyroscope", static_cast<double>(gyroscope.rows()),
          "must be as many as times");
  require(magnetometer.rows() == n, "rows of magnetometer", static_cast<double>(magnetometer.rows()),
          "must be as many as times");
  require(accelerometer.rows() == 0 || accelerometer.rows() == n, "rows of accelerometer",
          static_cast<double>(accelerometer.rows()), "must be as many as times, or none");

  MagnetometerAlignment out;
  const auto refuse = [&](std::string reason) {
    out.quality.lower_to(Verdict::kRefused, std::move(reason));
    return out;
  };
  const double field = median_norm(magnetometer);
  const double gravity = median_norm(accelerometer);
  std::vector<double> periods;
  TimeNs last = kNoTime;
  for (const TimeNs t : times_ns) {
    if (t == kNoTime) continue;
    if (last != kNoTime && t > last) periods.push_back(elapsed_s(last, t));
    last = t;
  }
  if (std::isnan(field) || periods.empty()) return refuse("There is no usable reading of the magnetometer.");

  IntervalBuilder builder(options, field, gravity, options.gap_periods * quantile(periods, 0.5));
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d force =
        accelerometer.rows() == 0 ? Eigen::Vector3d::Zero().eval() : Eigen::Vector3d(accelerometer.row(i));
    const TimeNs t = times_ns[static_cast<std::size_t>(i)];
    if (t == kNoTime || !gyroscope.row(i).allFinite() || !force.allFinite()) {
      ++out.not_finite;
      continue;
    }
    builder.add(t, gyroscope.row(i), force, magnetometer.row(i));
  }
  const std::vector<FieldInterval>& intervals = builder.intervals;
  out.repeated = builder.repeated;
  out.disturbed = builder.disturbed;
  out.too_fast = builder.too_fast;
  out.intervals = static_cast<std::int64_t>(intervals.size());
  if (intervals.size() < kLeastIntervals) {
    return refuse("Only " + std::to_string(intervals.size()) + " intervals with a steady field: at least " +
                  std::to_string(kLeastIntervals) + " of " + to_text(options.interval_s) + " s are needed.");
  }
  Eigen::Matrix3d turning = Eigen::Matrix3d::Zero();
  for (const FieldInterval& k : intervals) {
    const Eigen::Vector3d angle = so3::log(k.q_begin_end);
    turning += angle * angle.transpose();
    out.gravity_readings += k.has_gravity ? 1 : 0;
  }
  const Eigen::VectorXd spread = dense::symmetric_eigenvalues(turning);
  const double total = spread[2];
  out.second_axis_share = total > 0 ? std::sqrt(std::max(0.0, spread[1]) / total) : 0;

  Eigen::Quaterniond r = best_start(intervals);
  AlignmentVector x = AlignmentVector::Zero();
  if (out.gravity_readings > 0) {
    std::vector<double> sines;
    for (const FieldInterval& k : intervals) {
      if (k.has_gravity) sines.push_back(-k.up.dot(r * k.field));
    }
    x[6] = quantile(sines, 0.5);
  }
  CalibrationErrors errors = CalibrationErrors::Zero();
  LeastSquaresResult result;
  Weights w;
  Problem problem(intervals, r, x, options);
  for (int round = 0; round < 8; ++round) {
    w = weights_at(problem, x, errors);
    Eigen::VectorXd all(x.size() + errors.size());
    all << x, errors;
    result = refine(problem, w, all);
    r = so3::boxplus(r, result.x.head<3>());
    const double step = result.x.head<3>().norm();
    x = result.x.head<8>();
    x.head<3>().setZero();
    errors = result.x.tail<kCalibrationErrors>();
    if (!result.x.allFinite()) break;
    problem = Problem(intervals, r, x, options);
    if (step < 1e-9) break;
  }
  auto cov = covariance_from(result.information);
  if (!cov || !result.x.allFinite()) {
    return refuse("The turning does not determine the rotation: turn the device about all axes.");
  }
  cov = cautious_covariance(problem, x, errors, w, *cov);

  out.solved = true;
  out.matrix = r.toRotationMatrix();
  out.cov = cov->topLeftCorner<3, 3>();
  out.sigma = std::sqrt(dense::symmetric_eigenvalues(out.cov)[2]);
  out.angle = Eigen::AngleAxisd(r).angle();
  out.gyroscope_bias = x.segment<3>(3);
  out.delay_s = x[7];
  out.delay_sigma_s = std::sqrt((*cov)(7, 7));
  std::vector<double> sizes;
  std::vector<double> dips;
  for (std::size_t k = 0; k < intervals.size(); ++k) {
    if (w.turn[static_cast<Eigen::Index>(k)] > 0) {
      sizes.push_back(problem.residual(k, x, errors).head<3>().norm());
    }
    if (intervals[k].has_gravity) {
      dips.push_back(std::asin(std::clamp(-intervals[k].up.dot(r * intervals[k].field.normalized()), -1.0, 1.0)));
    }
  }
  out.inliers = static_cast<std::int64_t>(sizes.size());
  if (!sizes.empty()) out.residual_rms = root_mean_square(sizes);
  if (!dips.empty()) {
    out.dip = quantile(dips, 0.5);
    for (double& d : dips) d -= out.dip;
    out.dip_scatter = robust_sigma(dips);
    out.dip_sigma = dips.size() >= kLeastGravity ? std::sqrt((*cov)(6, 6)) / std::max(0.05, std::cos(out.dip))
                                                 : std::hypot(out.sigma, kGravitySigma, out.dip_scatter);
  }
  if (std::abs(options.expected_dip) > kFlatDip && std::abs(out.dip) > kFlatDip) {
    out.mirror_checked = true;
    out.mirrored = (options.expected_dip > 0) != (out.dip > 0);
    if (out.mirrored) {
      out.matrix = -out.matrix;
      out.dip = -out.dip;
    }
  }
  name_axes(out);
  judge(options, out);
  return out;
}

TriadCalibration aligned(const TriadCalibration& magnetometer, const MagnetometerAlignment& alignment) {
  if (!alignment.solved) {
    std::string text = "the magnetometer's alignment is not solved";
    for (const std::string& reason : alignment.quality.reasons) text += "; " + reason;
    throw DataError(text);
  }
  TriadCalibration out = magnetometer;
  out.matrix = alignment.matrix * magnetometer.matrix;
  if (out.quality) {
    TriadQuality& q = *out.quality;
    Eigen::Matrix3d variance = alignment.matrix.cwiseAbs2() * q.matrix_sigma.cwiseAbs2();
    // The rotation's own uncertainty: column w of the calibration moves by matrix (theta x w).
    for (int column = 0; column < 3 && alignment.cov.allFinite(); ++column) {
      const Eigen::Matrix3d d_theta = alignment.matrix * so3::hat(magnetometer.matrix.col(column));
      variance.col(column) += (d_theta * alignment.cov * d_theta.transpose()).diagonal();
    }
    q.matrix_sigma = variance.cwiseSqrt();
    q.verdict = std::max(q.verdict, alignment.quality.verdict);
    q.reasons.insert(q.reasons.end(), alignment.quality.reasons.begin(), alignment.quality.reasons.end());
  }
  return out;
}

}  // namespace loc
