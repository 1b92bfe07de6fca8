#include "libloc/geometry/so3.hpp"

#include <cmath>

namespace loc::so3 {
namespace {

// Below this angle the closed forms lose digits to cancellation and the series, cut after theta^4, are exact to
// rounding.
constexpr double kSeriesAngle = 1e-2;

struct JacobianCoefficients {
  double a;  // (1 - cos t) / t^2
  double b;  // (t - sin t) / t^3
};

JacobianCoefficients jacobian_coefficients(double t) {
  const double t2 = t * t;
  if (t < kSeriesAngle) {
    return {0.5 - t2 / 24 * (1 - t2 / 30 * (1 - t2 / 56)), (1 - t2 / 20 * (1 - t2 / 42 * (1 - t2 / 72))) / 6};
  }
  const double s = std::sin(0.5 * t);  // 1 - cos t = 2 s^2 keeps its digits
  return {2 * s * s / t2, (t - std::sin(t)) / (t2 * t)};
}

}  // namespace

Eigen::Matrix3d hat(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Vector3d vee(const Eigen::Matrix3d& m) {
  return {m(2, 1), m(0, 2), m(1, 0)};
}

Eigen::Quaterniond exp(const Eigen::Vector3d& theta) {
  const double half = 0.5 * theta.norm();
  const double half2 = half * half;
  // sin(half)/half; dividing is exact enough for any angle that is not close to zero.
  const double sinc = half < kSeriesAngle ? 1 - half2 / 6 * (1 - half2 / 20 * (1 - half2 / 42)) : std::sin(half) / half;
  Eigen::Quaterniond q;
  q.w() = std::cos(half);
  q.vec() = 0.5 * sinc * theta;
  return q;
}

Eigen::Vector3d log(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1.0 : 1.0;
  const double s = q.vec().norm();
  const double w = sign * q.w();
  // angle = 2 atan2(s, w); atan2(s, w) / s needs its series only where s itself is lost.
  double factor = 0;
  if (s < 1e-6) {
    const double r = s / w;
    factor = 2 / w * (1 - r * r / 3);
  } else {
    factor = 2 * std::atan2(s, w) / s;
  }
  return sign * factor * q.vec();
}

Eigen::Quaterniond boxplus(const Eigen::Quaterniond& q, const Eigen::Vector3d& theta) {
  return (q * exp(theta)).normalized();
}

Eigen::Vector3d boxminus(const Eigen::Quaterniond& q1, const Eigen::Quaterniond& q0) {
  return log(q0.conjugate() * q1);
}

Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& theta) {
  return left_jacobian(-theta);
}

Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& theta) {
  const auto [a, b] = jacobian_coefficients(theta.norm());
  const Eigen::Matrix3d k = hat(theta);
  return Eigen::Matrix3d::Identity() + a * k + b * k * k;
}

Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& theta) {
  const double t = theta.norm();
  const double t2 = t * t;
  // (1/t^2) - (1 + cos t) / (2 t sin t), written with cot(t/2): no singularity at pi.
  const double c = t < kSeriesAngle ? (1 + t2 / 60 * (1 + t2 / 42)) / 12 : (1 - 0.5 * t / std::tan(0.5 * t)) / t2;
  const Eigen::Matrix3d k = hat(theta);
  return Eigen::Matrix3d::Identity() + 0.5 * k + c * k * k;
}

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return boxminus(b, a).norm();
}

double heading(const Eigen::Quaterniond& q) {
  // q and -q are one rotation; with w >= 0 the result is in [-pi, pi].
  return q.w() < 0 ? 2 * std::atan2(-q.z(), -q.w()) : 2 * std::atan2(q.z(), q.w());
}

}  // namespace loc::so3
