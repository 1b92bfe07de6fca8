#include "libloc/sim/look_at_motion.hpp"

#include <cmath>
#include <string>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

using Eigen::Vector3d;

// A vector that changes.
struct VectorJet {
  Vector3d value;
  Vector3d rate;
  Vector3d acceleration;
};

VectorJet cross(const VectorJet& a, const VectorJet& b) {
  return {a.value.cross(b.value), a.rate.cross(b.value) + a.value.cross(b.rate),
          a.acceleration.cross(b.value) + 2 * a.rate.cross(b.rate) + a.value.cross(b.acceleration)};
}

// a / |a|, from a = n r: a' = n' r + n r', a'' = n'' r + 2 n' r' + n r''.
VectorJet unit(const VectorJet& a) {
  const double r = a.value.norm();
  const Vector3d n = a.value / r;
  const double r1 = n.dot(a.rate);
  const Vector3d n1 = (a.rate - r1 * n) / r;
  const double r2 = n1.dot(a.rate) + n.dot(a.acceleration);
  return {n, n1, (a.acceleration - 2 * r1 * n1 - r2 * n) / r};
}

VectorJet spline_at(const std::vector<PiecewiseCubic>& axes, double time_s) {
  const std::size_t piece = axes.front().piece(time_s);
  VectorJet out;
  for (int i = 0; i < 3; ++i) {
    const PiecewiseCubic::Value v = axes[static_cast<std::size_t>(i)].at(time_s, piece);
    out.value[i] = v.value;
    out.rate[i] = v.rate;
    out.acceleration[i] = v.acceleration;
  }
  return out;
}

std::vector<PiecewiseCubic> spline_through(const std::vector<double>& times, const std::vector<Vector3d>& points) {
  std::vector<PiecewiseCubic> axes;
  for (int i = 0; i < 3; ++i) {
    std::vector<double> values;
    values.reserve(points.size());
    for (const Vector3d& point : points) values.push_back(point[i]);
    axes.push_back(PiecewiseCubic::spline(times, values));
  }
  return axes;
}

// Bezier points of a cubic piece: the curve lies in their hull, and halving it gives tighter hulls.
using Hull = std::array<Vector3d, 4>;

std::pair<Hull, Hull> halves(const Hull& h) {
  const Vector3d a = 0.5 * (h[0] + h[1]);
  const Vector3d b = 0.5 * (h[1] + h[2]);
  const Vector3d c = 0.5 * (h[2] + h[3]);
  const Vector3d ab = 0.5 * (a + b);
  const Vector3d bc = 0.5 * (b + c);
  const Vector3d middle = 0.5 * (ab + bc);
  return {{h[0], a, ab, middle}, {middle, bc, c, h[3]}};
}

struct Limits {
  Vector3d up;
  double distance;  // [m]
  double sine;      // of the smallest angle
};

double steepness(const Vector3d& direction, const Vector3d& up) {
  return direction.cross(up).norm();
}

bool allowed(const Vector3d& direction, const Limits& limits) {
  return direction.norm() >= limits.distance && steepness(direction, limits.up) >= limits.sine * direction.norm();
}

// Proven of all points of the hull: they are no further from the middle than the farthest corner.
bool all_allowed(const Hull& hull, const Limits& limits) {
  const Vector3d middle = 0.25 * (hull[0] + hull[1] + hull[2] + hull[3]);
  double radius = 0;
  for (const Vector3d& corner : hull) radius = std::max(radius, (corner - middle).norm());
  const double distance = middle.norm();
  return distance - radius >= limits.distance &&
         steepness(middle, limits.up) - radius >= limits.sine * (distance + radius);
}

// The first time in [begin, begin + length] that is not allowed, to a billionth of the length; none.
std::optional<double> first_forbidden(const Hull& hull, double begin, double length, const Limits& limits, int depth) {
  if (!allowed(hull[0], limits)) return begin;
  if (all_allowed(hull, limits)) return std::nullopt;
  if (depth == 30) return allowed(hull[3], limits) ? begin : begin + length;  // no finer
  const auto [first, second] = halves(hull);
  if (const auto time = first_forbidden(first, begin, 0.5 * length, limits, depth + 1)) return time;
  if (const auto time = first_forbidden(second, begin + 0.5 * length, 0.5 * length, limits, depth + 1)) return time;
  return allowed(hull[3], limits) ? std::nullopt : std::optional(begin + length);
}

}  // namespace

void LookAtOptions::check() const {
  const std::size_t n = times_s.size();
  require(n >= 2, "number of times_s", static_cast<double>(n), "must be at least 2");
  require(positions.size() == n, "number of positions", static_cast<double>(positions.size()),
          "must be the number of times_s, " + std::to_string(n));
  require(look_at.size() == n, "number of look_at", static_cast<double>(look_at.size()),
          "must be the number of times_s, " + std::to_string(n));
  for (std::size_t i = 0; i < n; ++i) {
    const std::string at = "[" + std::to_string(i) + "]";
    require_finite("times_s" + at, times_s[i]);
    require(i > 0 || times_s[0] == 0, "times_s[0]", times_s[0], "must be 0");
    require(i == 0 || times_s[i] > times_s[i - 1], "times_s" + at, times_s[i], "must be greater than the one before");
    for (int axis = 0; axis < 3; ++axis) {
      const std::string place = at + "[" + std::to_string(axis) + "]";
      require_finite("positions" + place, positions[i][axis]);
      require_finite("look_at" + place, look_at[i][axis]);
    }
  }
  require_positive("length of up", up.norm());
  require_positive("smallest_distance_m", smallest_distance_m);
  require(smallest_angle_rad > 0 && smallest_angle_rad < 1.5, "smallest_angle_rad", smallest_angle_rad,
          "must be in (0, 1.5)");
}

LookAtMotion::LookAtMotion(const LookAtOptions& options) {
  options.check();
  position_ = spline_through(options.times_s, options.positions);
  look_at_ = spline_through(options.times_s, options.look_at);
  up_ = options.up.normalized();
  check_directions(options);
}

void LookAtMotion::check_directions(const LookAtOptions& options) const {
  const Limits limits = {up_, options.smallest_distance_m, std::sin(options.smallest_angle_rad)};
  for (std::size_t piece = 0; piece + 1 < options.times_s.size(); ++piece) {
    const double begin = options.times_s[piece];
    const double length = options.times_s[piece + 1] - begin;
    Hull hull;
    for (int i = 0; i < 3; ++i) {
      const double* to = look_at_[static_cast<std::size_t>(i)].coefficients(piece);
      const double* from = position_[static_cast<std::size_t>(i)].coefficients(piece);
      const double c1 = (to[1] - from[1]) * length / 3;
      const double c2 = (to[2] - from[2]) * length * length / 3;
      const double c3 = (to[3] - from[3]) * length * length * length;
      hull[0][i] = to[0] - from[0];
      hull[1][i] = hull[0][i] + c1;
      hull[2][i] = hull[1][i] + c1 + c2;
      hull[3][i] = hull[0][i] + 3 * c1 + 3 * c2 + c3;
    }
    const std::optional<double> time = first_forbidden(hull, begin, length, limits, 0);
    if (!time) continue;
    const Vector3d direction = spline_at(look_at_, *time).value - spline_at(position_, *time).value;
    require(direction.norm() >= options.smallest_distance_m, "at " + to_text(*time, 9) + " s: distance from the camera",
            direction.norm(), "m to the point it looks at, less than " + to_text(options.smallest_distance_m));
    require(false, "at " + to_text(*time, 9) + " s: angle between the look direction and up or down",
            std::asin(std::min(1.0, steepness(direction, up_) / direction.norm())),
            "rad, less than " + to_text(options.smallest_angle_rad));
  }
}

MotionState LookAtMotion::at(double time_s) const {
  check_time(time_s);
  const VectorJet position = spline_at(position_, time_s);
  const VectorJet target = spline_at(look_at_, time_s);
  const VectorJet look = {target.value - position.value, target.rate - position.rate,
                          target.acceleration - position.acceleration};
  const VectorJet z = unit(look);
  const VectorJet x = unit(cross(look, {up_, Vector3d::Zero(), Vector3d::Zero()}));
  const VectorJet y = cross(z, x);

  MotionState state;
  state.time_s = time_s;
  Eigen::Matrix3d R;
  R << x.value, y.value, z.value;
  state.T_world_body.rotation = Eigen::Quaterniond(R).normalized();
  state.T_world_body.translation = position.value;
  state.velocity = position.rate;
  state.acceleration = position.acceleration;
  // [w]x = R' R_dot, entries (2,1), (0,2), (1,0).
  state.angular_velocity = {z.value.dot(y.rate), x.value.dot(z.rate), y.value.dot(x.rate)};
  state.angular_acceleration = {z.rate.dot(y.rate) + z.value.dot(y.acceleration),
                                x.rate.dot(z.rate) + x.value.dot(z.acceleration),
                                y.rate.dot(x.rate) + y.value.dot(x.acceleration)};
  return state;
}

}  // namespace loc
