#include "libloc/sim/clothoid.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "libloc/core/check.hpp"
#include "libloc/sim/quadrature.hpp"

namespace loc {
namespace {

constexpr double kShortestShare = 0.01;  // length of the straight line by that of the curve

// Integrals over [0, 1] of t^k cos(phase) and t^k sin(phase).
struct Moments {
  double c0 = 0, c1 = 0, c2 = 0;
  double s0 = 0, s1 = 0, s2 = 0;
};

// phase(t) = a t^2 + (delta - a) t + phi0, equation 6 of the source.
Moments moments(double a, double delta, double phi0) {
  Moments m;
  detail::integrate(1, detail::panels_for(std::abs(a) + std::abs(delta - a)), [&](double t, double weight) {
    const double phase = (a * t + delta - a) * t + phi0;
    const double c = weight * std::cos(phase);
    const double s = weight * std::sin(phase);
    m.c0 += c;
    m.c1 += c * t;
    m.c2 += c * t * t;
    m.s0 += s;
    m.s1 += s * t;
    m.s2 += s * t * t;
  });
  return m;
}

// The source's fit of the solution over both angles: good to about 1e-2, from where Newton takes a few steps.
double start_value(double phi0, double phi1) {
  const double x = phi0 / std::numbers::pi;
  const double y = phi1 / std::numbers::pi;
  const double xy = x * y;
  const double squares = x * x + y * y;
  const double fourths = x * x * x * x + y * y * y * y;
  return (phi0 + phi1) * (2.989696028701907 + xy * (0.716228953608281 - 0.458969738821509 * xy) +
                          (-0.502821153340377 + 0.261062141752652 * xy) * squares - 0.045854475238709 * fourths);
}

}  // namespace

double wrap_angle(double angle) {
  const double wrapped = std::remainder(angle, 2 * std::numbers::pi);
  return wrapped <= -std::numbers::pi ? std::numbers::pi : wrapped;
}

ClothoidPoint Clothoid::at(double arc_length) const {
  ClothoidPoint point;
  point.position = start;
  const double turn = std::abs(curvature * arc_length) + 0.5 * std::abs(curvature_rate) * arc_length * arc_length;
  detail::integrate(arc_length, detail::panels_for(turn), [&](double s, double weight) {
    const double angle = course + (curvature + 0.5 * curvature_rate * s) * s;
    point.position += weight * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  });
  point.course = course + (curvature + 0.5 * curvature_rate * arc_length) * arc_length;
  point.curvature = curvature + curvature_rate * arc_length;
  return point;
}

ClothoidFit fit_clothoid(const Eigen::Vector2d& start, double start_course, const Eigen::Vector2d& end,
                         double end_course) {
  require_finite("start_course", start_course);
  require_finite("end_course", end_course);
  require(start.allFinite() && end.allFinite(), "the ends of a clothoid must be finite");
  const Eigen::Vector2d chord = end - start;
  const double distance = chord.norm();
  require_positive("distance of the ends of a clothoid", distance);
  const double direction = std::atan2(chord.y(), chord.x());
  const double phi0 = wrap_angle(start_course - direction);
  const double phi1 = wrap_angle(end_course - direction);
  const double delta = phi1 - phi0;

  // Newton on the lateral miss s0(a) = 0, equation 10.
  double a = start_value(phi0, phi1);
  Moments m = moments(a, delta, phi0);
  for (int i = 0; i < 20; ++i) {
    const double step = m.s0 / (m.c2 - m.c1);
    if (!(std::abs(step) > 1e-15 * (1 + std::abs(a)))) break;
    a -= step;
    m = moments(a, delta, phi0);
  }
  if (!(std::abs(m.s0) < 1e-13 && m.c0 > kShortestShare)) {
    throw std::invalid_argument("courses " + to_text(phi0, 6) + " and " + to_text(phi1, 6) +
                                " rad from the straight line: the clothoid would be more than 100 times as long as "
                                "the line");
  }

  ClothoidFit fit;
  const double length = distance / m.c0;
  fit.clothoid = {start, start_course, (delta - a) / length, 2 * a / (length * length), length};
  fit.end_curvature = (delta + a) / length;
  // Derivatives by (phi0, phi1): of a from s0 = 0, of the length from length * c0 = distance.
  const Eigen::Vector2d a_by = Eigen::Vector2d(m.c0 - m.c1, m.c1) / (m.c1 - m.c2);
  const Eigen::Vector2d c0_by = (m.s1 - m.s2) * a_by - Eigen::Vector2d(m.s0 - m.s1, m.s1);
  const Eigen::Vector2d delta_by(-1, 1);
  fit.start_curvature_jacobian = ((delta_by - a_by) * m.c0 + (delta - a) * c0_by) / distance;
  fit.end_curvature_jacobian = ((delta_by + a_by) * m.c0 + (delta + a) * c0_by) / distance;
  return fit;
}

}  // namespace loc
