#include "libloc/geometry/camera.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Straight behind a fisheye lens every direction of the image is the same point.
constexpr double kMaxAngle = std::numbers::pi * (1 - 1e-9);
// Below this angle the series of the fisheye is its first term, to rounding.
constexpr double kSmallAngle = 1e-8;
// Of a search for a ray, in units of the distorted normalised image: 1e-9 px at a focal length of 1000 px.
constexpr double kTolerance = 1e-12;

// Roots of c0 + c1 x + ... in (0, end) at which the sign changes, ascending: between the roots of the derivative the
// polynomial is monotone.
template <std::size_t N>
std::size_t sign_changes(const std::array<double, N>& c, double end, std::array<double, N>& roots) {
  if constexpr (N < 2) {
    return 0;
  } else {
    std::array<double, N - 1> derivative{};
    for (std::size_t i = 1; i < N; ++i) derivative[i - 1] = static_cast<double>(i) * c[i];
    std::array<double, N - 1> turns{};
    const std::size_t turn_count = sign_changes(derivative, end, turns);
    const auto value = [&](double x) {
      double sum = 0;
      for (std::size_t i = N; i-- > 0;) sum = sum * x + c[i];
      return sum;
    };
    std::size_t count = 0;
    double low = 0;
    for (std::size_t i = 0; i <= turn_count; ++i) {
      double high = i < turn_count ? turns[i] : end;
      const double next = high;
      const bool falls = value(low) > 0;
      if (falls != (value(high) > 0)) {
        for (int step = 0; step < 100; ++step) {
          const double middle = (low + high) / 2;
          ((value(middle) > 0) == falls ? low : high) = middle;
        }
        roots[count++] = low;
      }
      low = next;
    }
    return count;
  }
}

// Where the slope 1 + 3 k1 x + 5 k2 x^2 of the radial part, x = r^2, becomes 0 first; infinity when it does not.
double first_flat_radtan(double k1, double k2) {
  const double a = 5 * k2;
  const double b = 3 * k1;
  const double discriminant = b * b - 4 * a;
  if (discriminant < 0) return kInfinity;
  const double q = -(b + std::copysign(std::sqrt(discriminant), b)) / 2;
  double first = kInfinity;
  if (q > 0) first = 1 / q;
  if (a != 0 && q / a > 0) first = std::min(first, q / a);
  return first;
}

double radius_limit(DistortionModel model, const Eigen::Vector4d& k) {
  switch (model) {
    case DistortionModel::kNone:
      return kInfinity;
    case DistortionModel::kRadtan:
      return std::sqrt(first_flat_radtan(k[0], k[1]));
    case DistortionModel::kEquidistant: {
      const std::array<double, 5> slope{1, 3 * k[0], 5 * k[1], 7 * k[2], 9 * k[3]};
      std::array<double, 5> roots{};
      const std::size_t count = sign_changes(slope, kMaxAngle * kMaxAngle, roots);
      return count > 0 ? std::sqrt(roots[0]) : kMaxAngle;
    }
  }
  throw std::invalid_argument("distortion_model: unknown");
}

Eigen::Vector4d radial_series(DistortionModel model, const Eigen::Vector4d& k) {
  if (model == DistortionModel::kEquidistant) return k;
  if (model == DistortionModel::kRadtan) return {k[0], k[1], 0, 0};
  return Eigen::Vector4d::Zero();
}

}  // namespace

Camera::Camera(const CameraCalibration& calibration)
    : model_((calibration.check(), calibration.distortion_model)),
      width_px_(calibration.width_px),
      height_px_(calibration.height_px),
      intrinsics_(calibration.intrinsics_px),
      distortion_(calibration.distortion),
      series_(radial_series(model_, distortion_)),
      max_radius_(radius_limit(model_, distortion_)) {}

double Camera::radial(double r) const {
  const double x = r * r;
  return r * (1 + x * (series_[0] + x * (series_[1] + x * (series_[2] + x * series_[3]))));
}

double Camera::radial_slope(double r) const {
  const double x = r * r;
  return 1 + x * (3 * series_[0] + x * (5 * series_[1] + x * (7 * series_[2] + x * 9 * series_[3])));
}

// Not for the fisheye. False outside the domain.
bool Camera::distort(const Eigen::Vector2d& m, Eigen::Vector2d& distorted, Eigen::Matrix2d& jacobian) const {
  if (model_ == DistortionModel::kNone) {
    distorted = m;
    jacobian.setIdentity();
    return true;
  }
  const double p1 = distortion_[2];
  const double p2 = distortion_[3];
  const double x = m.x();
  const double y = m.y();
  const double r2 = m.squaredNorm();
  if (!(r2 < max_radius_ * max_radius_)) return false;
  const double factor = 1 + r2 * (series_[0] + r2 * series_[1]);
  const double twice_slope = 2 * (series_[0] + 2 * r2 * series_[1]);  // d factor / d x = twice_slope * x
  distorted = {x * factor + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
               y * factor + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
  const double mixed = twice_slope * x * y + 2 * p1 * x + 2 * p2 * y;
  jacobian << factor + twice_slope * x * x + 2 * p1 * y + 6 * p2 * x, mixed,  //
      mixed, factor + twice_slope * y * y + 6 * p1 * y + 2 * p2 * x;
  // The tangential part folds where the radial one alone does not.
  return jacobian(0, 0) * jacobian(1, 1) - mixed * mixed > 0;
}

std::optional<Projection> Camera::project_in_front(const Eigen::Vector3d& point) const {
  if (!(point.z() > 0)) return std::nullopt;
  const Eigen::Vector2d m = point.head<2>() / point.z();
  Eigen::Vector2d distorted;
  Eigen::Matrix2d jacobian;
  if (!distort(m, distorted, jacobian)) return std::nullopt;

  Projection out;
  const Eigen::Vector2d f = intrinsics_.head<2>();
  out.pixel_px = f.cwiseProduct(distorted) + intrinsics_.tail<2>();
  Eigen::Matrix<double, 2, 3> d_m;
  d_m << 1, 0, -m.x(), 0, 1, -m.y();
  out.d_point = f.asDiagonal() * (jacobian * d_m) / point.z();
  out.d_parameters.setZero();
  out.d_parameters.topLeftCorner<2, 2>().diagonal() = distorted;
  out.d_parameters.middleCols<2>(2).setIdentity();
  if (model_ == DistortionModel::kRadtan) {
    const double r2 = m.squaredNorm();
    const double xy = m.x() * m.y();
    out.d_parameters.col(4) = f.cwiseProduct(m) * r2;
    out.d_parameters.col(5) = f.cwiseProduct(m) * (r2 * r2);
    out.d_parameters.col(6) = f.cwiseProduct(Eigen::Vector2d(2 * xy, r2 + 2 * m.y() * m.y()));
    out.d_parameters.col(7) = f.cwiseProduct(Eigen::Vector2d(r2 + 2 * m.x() * m.x(), 2 * xy));
  }
  return out;
}

std::optional<Projection> Camera::project_equidistant(const Eigen::Vector3d& point) const {
  const double z = point.z();
  const double r = point.head<2>().norm();
  const double square = r * r + z * z;
  // Also what is so far away that its square overflows.
  if (!(r > 0 || z > 0) || !std::isfinite(square)) return std::nullopt;
  const double theta = std::atan2(r, z);
  if (!(theta < max_radius_)) return std::nullopt;

  // distorted = a (x, y); a and its derivatives by r and z.
  const bool central = theta < kSmallAngle;
  const double slope = radial_slope(theta);
  const double a = central ? 1 / z : radial(theta) / r;
  const double a_r = central ? 0 : (slope * z / square - a) / r;
  const double a_z = central ? -1 / (z * z) : -slope / square;
  const Eigen::Vector2d unit = central ? Eigen::Vector2d::Zero() : Eigen::Vector2d(point.head<2>() / r);

  Projection out;
  const Eigen::Vector2d f = intrinsics_.head<2>();
  const Eigen::Vector2d distorted = a * point.head<2>();
  out.pixel_px = f.cwiseProduct(distorted) + intrinsics_.tail<2>();
  Eigen::Matrix<double, 2, 3> d_point;
  d_point.leftCols<2>() = a * Eigen::Matrix2d::Identity() + point.head<2>() * (a_r * unit).transpose();
  d_point.col(2) = a_z * point.head<2>();
  out.d_point = f.asDiagonal() * d_point;
  out.d_parameters.setZero();
  out.d_parameters.topLeftCorner<2, 2>().diagonal() = distorted;
  out.d_parameters.middleCols<2>(2).setIdentity();
  double power = theta;
  for (int i = 4; i < 8; ++i) {
    power *= theta * theta;
    out.d_parameters.col(i) = power * f.cwiseProduct(unit);
  }
  return out;
}

std::optional<Projection> Camera::project_with_jacobians(const Eigen::Vector3d& point) const {
  std::optional<Projection> out =
      model_ == DistortionModel::kEquidistant ? project_equidistant(point) : project_in_front(point);
  // Overflow next to the plane z = 0; NaN and infinity come to this too.
  if (out && !(out->pixel_px.allFinite() && out->d_point.allFinite())) return std::nullopt;
  return out;
}

std::optional<Eigen::Vector2d> Camera::project(const Eigen::Vector3d& point) const {
  const std::optional<Projection> full = project_with_jacobians(point);
  if (!full) return std::nullopt;
  return full->pixel_px;
}

// Radius whose radial part is distorted: Newton's method within a bracket.
std::optional<double> Camera::radial_inverse(double distorted) const {
  double high = max_radius_;
  if (!std::isfinite(high)) {
    high = std::max(distorted, 1.0);
    while (radial(high) < distorted) high *= 2;
  }
  if (!(distorted < radial(high))) return std::nullopt;
  double low = 0;
  double r = std::min(distorted, high);
  for (int i = 0; i < 100; ++i) {
    const double excess = radial(r) - distorted;
    (excess > 0 ? high : low) = r;
    if (std::abs(excess) <= 0.1 * kTolerance * (1 + distorted)) return r;
    r -= excess / radial_slope(r);
    if (!(r > low && r < high)) r = (low + high) / 2;
  }
  return std::nullopt;
}

// Not for the fisheye. Newton's method from the ray that the radial part alone would give.
std::optional<Eigen::Vector2d> Camera::undistort(const Eigen::Vector2d& target) const {
  if (model_ == DistortionModel::kNone) return target;
  const double norm = target.norm();
  if (norm == 0 && distortion_.tail<2>().isZero(0)) return target;
  // Beyond the radial part's end the tangential one may still reach it: search from the border then.
  const double radius = radial_inverse(norm).value_or(0.999 * max_radius_);
  Eigen::Vector2d m = norm > 0 ? Eigen::Vector2d(target * (radius / norm)) : Eigen::Vector2d::Zero();
  Eigen::Vector2d distorted;
  Eigen::Matrix2d jacobian;
  if (!distort(m, distorted, jacobian)) return std::nullopt;
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector2d error = target - distorted;
    if (error.norm() <= kTolerance * (1 + norm)) return m;
    const double determinant = jacobian.determinant();
    Eigen::Vector2d step(jacobian(1, 1) * error.x() - jacobian(0, 1) * error.y(),
                         jacobian(0, 0) * error.y() - jacobian(1, 0) * error.x());
    step /= determinant;
    // Shorter until it stays in the domain and helps.
    bool better = false;
    for (int half = 0; half < 20 && !better; ++half, step /= 2) {
      better = distort(m + step, distorted, jacobian) && (target - distorted).norm() < error.norm();
      if (better) m += step;
    }
    if (!better) return std::nullopt;
  }
  return std::nullopt;
}

std::optional<Eigen::Vector3d> Camera::unproject(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d distorted = (pixel - intrinsics_.tail<2>()).cwiseQuotient(intrinsics_.head<2>());
  // A square that overflows is as far from any image as infinity.
  if (!std::isfinite(distorted.squaredNorm())) return std::nullopt;
  if (model_ == DistortionModel::kEquidistant) {
    const double norm = distorted.norm();
    const std::optional<double> theta = radial_inverse(norm);
    if (!theta) return std::nullopt;
    const double factor = norm > 0 ? std::sin(*theta) / norm : 1;
    return Eigen::Vector3d(factor * distorted.x(), factor * distorted.y(), std::cos(*theta)).normalized();
  }
  const std::optional<Eigen::Vector2d> m = undistort(distorted);
  if (!m) return std::nullopt;
  return m->homogeneous().normalized();
}

std::optional<Ray> Camera::unproject_with_jacobian(const Eigen::Vector2d& pixel) const {
  const std::optional<Eigen::Vector3d> direction = unproject(pixel);
  if (!direction) return std::nullopt;
  const std::optional<Projection> back = project_with_jacobians(*direction);
  if (!back) return std::nullopt;
  // J direction = 0, because all points of a ray have one pixel: the pseudo-inverse of J is orthogonal to it.
  const Eigen::Matrix<double, 2, 3>& j = back->d_point;
  const double a = j.row(0).squaredNorm();
  const double b = j.row(0).dot(j.row(1));
  const double c = j.row(1).squaredNorm();
  const double determinant = a * c - b * b;
  if (!(determinant > 0)) return std::nullopt;
  Eigen::Matrix2d inverse;
  inverse << c, -b, -b, a;
  return Ray{*direction, j.transpose() * (inverse / determinant)};
}

bool Camera::in_image(const Eigen::Vector2d& pixel, double border) const {
  return pixel.x() >= border - 0.5 && pixel.x() <= width_px_ - 0.5 - border && pixel.y() >= border - 0.5 &&
         pixel.y() <= height_px_ - 0.5 - border;
}

double Camera::max_angle() const {
  return model_ == DistortionModel::kEquidistant ? max_radius_ : std::atan(max_radius_);
}

}  // namespace loc
