#include "libloc/estimators/gps_position.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "libloc/core/check.hpp"
#include "libloc/estimators/estimate.hpp"

namespace loc {
namespace {

constexpr double kMostVariance = 1e14;
constexpr double kHighest = 1e7;  // that a receiver can be [m]

double square(double x) {
  return x * x;
}

// Adds what the horizontal (and vertical) variances lack.
void raise(Eigen::Matrix3d& cov, double sigma_floor, double vertical_factor) {
  const double horizontal = square(sigma_floor) - 0.5 * (cov(0, 0) + cov(1, 1));
  const double vertical = square(sigma_floor * vertical_factor) - cov(2, 2);
  cov.diagonal() += Eigen::Vector3d(horizontal, horizontal, vertical).cwiseMax(0);
}

Eigen::Matrix3d usual_covariance(GpsFixType fix, const GpsErrorModel& errors) {
  double sigma = errors.gps_sigma;
  if (fix == GpsFixType::kDifferential) sigma *= errors.gps_differential_part;
  if (fix == GpsFixType::kFloat) sigma *= errors.gps_float_part;
  if (fix == GpsFixType::kFixed) sigma *= errors.gps_fixed_part;
  return Eigen::Vector3d(square(sigma), square(sigma), square(sigma * errors.gps_vertical_factor)).asDiagonal();
}

}  // namespace

void GpsErrorModel::make_robust() {
  gps_sigma_floor = 1;
  gps_velocity_sigma_floor = 0.1;
  gps_time_sigma = 0.05;
  gps_correlation_time_s = 20;
}

void GpsErrorModel::check_gps() const {
  require(gps_antenna.allFinite(), "gps_antenna is not finite");
  require_positive("gps_sigma", gps_sigma);
  require_positive("gps_differential_part", gps_differential_part);
  require_positive("gps_float_part", gps_float_part);
  require_positive("gps_fixed_part", gps_fixed_part);
  require_positive("gps_vertical_factor", gps_vertical_factor);
  require_positive("gps_velocity_sigma", gps_velocity_sigma);
  require_not_negative("gps_sigma_floor", gps_sigma_floor);
  require_not_negative("gps_velocity_sigma_floor", gps_velocity_sigma_floor);
  require_not_negative("gps_time_sigma", gps_time_sigma);
  require_not_negative("gps_correlation_time_s", gps_correlation_time_s);
}

bool is_usable_covariance(const Eigen::Matrix3d& cov) {
  return cov.allFinite() && cov.cwiseAbs().maxCoeff() < kMostVariance &&
         (cov - cov.transpose()).isZero(1e-6 * cov.norm()) && cov.diagonal().minCoeff() > 0 &&
         cov.llt().info() == Eigen::Success;
}

GpsRefusalNote note_of(GpsRefusal refusal) {
  switch (refusal) {
    case GpsRefusal::kNoFix:
      return {"gps.skipped.no_fix", 0};
    case GpsRefusal::kNotFinite:
      return {"gps.skipped.not_finite", kNotFinite};
    case GpsRefusal::kOutOfRange:
      return {"gps.skipped.out_of_range", kOutOfRange};
    case GpsRefusal::kBadCovariance:
      return {"gps.bad_covariance", kBadCovariance};
    case GpsRefusal::kRepeated:
      return {"gps.skipped.repeated", 0};
    case GpsRefusal::kNone:
      break;
  }
  throw std::invalid_argument("refusal: there is none");
}

GpsRefusal gps_place(const GpsMeasurement& gps, GeodeticPoint& place) {
  if (gps.fix < GpsFixType::k2d) return GpsRefusal::kNoFix;
  if (!std::isfinite(gps.latitude) || !std::isfinite(gps.longitude)) return GpsRefusal::kNotFinite;
  if (std::abs(gps.latitude) > std::numbers::pi / 2) return GpsRefusal::kOutOfRange;
  if (std::isfinite(gps.altitude) && std::abs(gps.altitude) > kHighest) return GpsRefusal::kOutOfRange;
  place = {gps.latitude, gps.longitude, std::isfinite(gps.altitude) ? gps.altitude : 0};
  return GpsRefusal::kNone;
}

GpsRefusal gps_in_world(const GpsMeasurement& gps, const GpsErrorModel& errors, const LocalFrame& world,
                        TimeNs before_ns, GpsPosition& out) {
  GeodeticPoint place;
  if (const GpsRefusal refusal = gps_place(gps, place); refusal != GpsRefusal::kNone) return refusal;
  out = GpsPosition{};
  out.time_ns = gps.time_ns;
  out.has_height = std::isfinite(gps.altitude) && gps.fix != GpsFixType::k2d;
  out.position = world.to_local(place);
  const Eigen::Matrix3d turn = world.R_local_enu(place);
  out.position_cov = gps.position_cov.hasNaN() ? usual_covariance(gps.fix, errors) : gps.position_cov;
  if (!is_usable_covariance(out.position_cov)) return GpsRefusal::kBadCovariance;
  out.position_cov = (turn * out.position_cov * turn.transpose()).eval();
  const bool carrier_phase = gps.fix >= GpsFixType::kFloat;
  raise(out.position_cov, carrier_phase ? 0 : errors.gps_sigma_floor, errors.gps_vertical_factor);
  if (errors.gps_correlation_time_s > 0 && !carrier_phase && before_ns != kNoTime) {
    TimeNs since = 0;
    const bool far = __builtin_sub_overflow(gps.time_ns, before_ns, &since);
    const double apart = far ? std::numeric_limits<double>::infinity() : std::abs(to_seconds(since));
    if (apart == 0) return GpsRefusal::kRepeated;
    const double phi = std::exp(-apart / errors.gps_correlation_time_s);
    out.position_cov *= (1 + phi) / (1 - phi);
  }
  if (gps.velocity_enu.allFinite()) {
    out.velocity = turn * gps.velocity_enu;
    out.velocity_cov = gps.velocity_cov.hasNaN()
                           ? Eigen::Matrix3d(square(errors.gps_velocity_sigma) * Eigen::Matrix3d::Identity())
                           : Eigen::Matrix3d(turn * gps.velocity_cov * turn.transpose());
    raise(out.velocity_cov, errors.gps_velocity_sigma_floor, 1);
  }
  return GpsRefusal::kNone;
}

}  // namespace loc
