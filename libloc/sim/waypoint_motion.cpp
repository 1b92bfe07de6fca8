#include "libloc/sim/waypoint_motion.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr double kSmallestStep = 1e-6;        // [m], between way-points that are not the same
constexpr double kCourseAgreement = 1e-6;     // [rad]
constexpr double kBackwardsTolerance = 1e-9;  // of the speeds: rounding of cubics that just touch zero

std::string indexed(const char* name, std::size_t i) {
  return std::string(name) + "[" + std::to_string(i) + "]";
}

bool same_place(const WaypointOptions& o, std::size_t i, std::size_t j) {
  return o.positions[i].head<2>() == o.positions[j].head<2>();
}

double speed(const WaypointOptions& o, std::size_t i) {
  return o.velocities[i].head<2>().norm();
}

// From velocity or option; none when to be estimated.
std::optional<double> known_course(const WaypointOptions& o, std::size_t i) {
  if (!o.velocities.empty() && speed(o, i) > 0) return std::atan2(o.velocities[i].y(), o.velocities[i].x());
  return o.courses_rad.empty() ? std::nullopt : o.courses_rad[i];
}

// Smallest rate of the cubic on a piece, and when.
std::pair<double, double> smallest_rate(const PiecewiseCubic& cubic, std::size_t piece) {
  const double begin = cubic.knots()[piece];
  const double end = cubic.knots()[piece + 1];
  std::pair<double, double> smallest = {cubic.at(begin, piece).rate, begin};
  const double* c = cubic.coefficients(piece);
  const double vertex = begin - c[2] / (3 * c[3]);
  for (const double t : {vertex, end}) {
    if (!(t > begin && t <= end)) continue;  // false for NaN: no vertex
    if (const double rate = cubic.at(t, piece).rate; rate < smallest.first) smallest = {rate, t};
  }
  return smallest;
}

}  // namespace

void WaypointOptions::check() const {
  const std::size_t n = positions.size();
  const auto same_number = [&](const char* name, std::size_t size) {
    require(size == n, "number of " + std::string(name), static_cast<double>(size),
            "must be the number of positions, " + std::to_string(n));
  };
  require(n >= 2, "number of positions", static_cast<double>(n), "must be at least 2");
  same_number("times_s", times_s.size());
  if (!velocities.empty()) same_number("velocities", velocities.size());
  if (!courses_rad.empty()) same_number("courses_rad", courses_rad.size());
  for (std::size_t i = 0; i < n; ++i) {
    require_finite(indexed("times_s", i), times_s[i]);
    require(i > 0 || times_s[0] == 0, "times_s[0]", times_s[0], "must be 0");
    require(i == 0 || times_s[i] > times_s[i - 1], indexed("times_s", i), times_s[i],
            "must be greater than the one before");
    for (int axis = 0; axis < 3; ++axis) {
      const std::string place = "[" + std::to_string(i) + "][" + std::to_string(axis) + "]";
      require_finite("positions" + place, positions[i][axis]);
      if (!velocities.empty()) require_finite("velocities" + place, velocities[i][axis]);
    }
    if (!courses_rad.empty() && courses_rad[i]) {
      require_finite(indexed("courses_rad", i), *courses_rad[i]);
      const double apart = wrap_angle(*courses_rad[i] - known_course(*this, i).value_or(0));
      require(std::abs(apart) <= kCourseAgreement, indexed("courses_rad", i), *courses_rad[i],
              "differs from the direction of " + indexed("velocities", i));
    }
    if (i == 0) continue;
    if (const double step = (positions[i] - positions[i - 1]).head<2>().norm(); step > 0) {
      require(step >= kSmallestStep, indexed("positions", i) + " is from the one before", step,
              "m; must be at least 1e-6, or exactly 0 for a stop");
    } else if (!velocities.empty()) {
      for (const std::size_t k : {i - 1, i}) {
        require(speed(*this, k) == 0, "horizontal speed of " + indexed("velocities", k), speed(*this, k),
                "must be 0: positions " + std::to_string(i - 1) + " and " + std::to_string(i) + " are the same place");
      }
    }
  }
}

WaypointOptions example_drive() {
  constexpr double kSpeed = 10;
  WaypointOptions o;
  o.times_s = {0, 20, 25, 44, 46, 50, 54, 56, 59, 63, 90};
  o.positions = {{0, 0, 0},     {200, 0, 0},   {200, 50, 0},  {200, 230, 0}, {215, 245, 0}, {260, 245, 0},
                 {290, 240, 0}, {310, 258, 0}, {290, 275, 0}, {260, 260, 0}, {-20, 260, 0}};
  const Eigen::Vector3d east(kSpeed, 0, 0);
  const Eigen::Vector3d north(0, kSpeed, 0);
  o.velocities = {east, east, north, north, east, east, east, north, -east, -east, -east};
  return o;
}

WaypointMotion::WaypointMotion(const WaypointOptions& options) {
  options.check();
  const std::size_t n = options.positions.size();

  // Neighbours at the same place are one point of the path.
  std::vector<Eigen::Vector2d> points;
  std::vector<std::optional<double>> courses;
  std::vector<std::size_t> point_of(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::optional<double> course = known_course(options, i);
    if (i == 0 || !same_place(options, i, i - 1)) {
      points.emplace_back(options.positions[i].head<2>());
      courses.push_back(course);
    } else if (course) {
      require(!courses.back() || std::abs(wrap_angle(*course - *courses.back())) <= kCourseAgreement,
              indexed("courses_rad", i), *course, "differs from the one before at the same place");
      courses.back() = course;
    }
    point_of[i] = points.size() - 1;
  }
  require(points.size() > 1 || courses[0].has_value(),
          "positions are all the same place: courses_rad must give the course");
  std::optional<ClothoidPath> path;
  try {
    path.emplace(points, courses);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("horizontal path through the way-points without stops: " + std::string(error.what()));
  }

  std::vector<double> distances = {0};
  std::vector<double> heights;
  for (std::size_t i = 0; i < n; ++i) {
    courses_.push_back(path->courses()[point_of[i]]);
    heights.push_back(options.positions[i].z());
    if (i + 1 == n) break;
    Clothoid piece;
    if (point_of[i + 1] != point_of[i]) {
      piece = path->pieces()[point_of[i]];
    } else {
      piece.start = points[point_of[i]];
      piece.course = courses_[i];
    }
    pieces_.push_back(piece);
    starts_.push_back(distances.back());
    distances.push_back(distances.back() + piece.length);
  }

  if (options.velocities.empty()) {
    distance_ = PiecewiseCubic::shape_preserving(options.times_s, distances);
    height_ = PiecewiseCubic::shape_preserving(options.times_s, heights);
  } else {
    std::vector<double> speeds;
    std::vector<double> climbs;
    for (std::size_t i = 0; i < n; ++i) {
      speeds.push_back(speed(options, i));
      climbs.push_back(options.velocities[i].z());
    }
    distance_ = PiecewiseCubic::hermite(options.times_s, distances, speeds);
    height_ = PiecewiseCubic::hermite(options.times_s, heights, climbs);
  }
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const auto [rate, time] = smallest_rate(*distance_, i);
    const double mean = pieces_[i].length / (options.times_s[i + 1] - options.times_s[i]);
    const double tolerance = kBackwardsTolerance * std::max({mean, distance_->at(options.times_s[i], i).rate,
                                                             distance_->at(options.times_s[i + 1], i).rate});
    require(rate >= -tolerance,
            "way-points " + std::to_string(i) + " to " + std::to_string(i + 1) + ": speed at " + to_text(time) + " s",
            rate, "the vehicle would go backwards; the speeds are too high for a mean of " + to_text(mean, 6) + " m/s");
  }
}

double WaypointMotion::length() const {
  return starts_.back() + pieces_.back().length;
}

MotionState WaypointMotion::at(double time_s) const {
  check_time(time_s);
  const std::size_t i = distance_->piece(time_s);
  const PiecewiseCubic::Value along = distance_->at(time_s, i);
  const PiecewiseCubic::Value height = height_->at(time_s, i);
  const Clothoid& piece = pieces_[i];
  const ClothoidPoint point = piece.at(along.value - starts_[i]);
  const Eigen::Vector2d forward(std::cos(point.course), std::sin(point.course));
  const Eigen::Vector2d left(-forward.y(), forward.x());

  MotionState state;
  state.time_s = time_s;
  state.T_world_body.rotation = {std::cos(0.5 * point.course), 0, 0, std::sin(0.5 * point.course)};
  state.T_world_body.translation << point.position, height.value;
  state.velocity << along.rate * forward, height.rate;
  state.acceleration << along.acceleration * forward + along.rate * along.rate * point.curvature * left,
      height.acceleration;
  state.angular_velocity.z() = point.curvature * along.rate;
  state.angular_acceleration.z() =
      point.curvature * along.acceleration + piece.curvature_rate * along.rate * along.rate;
  return state;
}

}  // namespace loc
