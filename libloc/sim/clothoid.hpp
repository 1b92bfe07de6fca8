// Clothoids: plane curves whose curvature is linear in arc length, and the one that joins two points with given courses
// (G1 Hermite interpolation). Courses are counted from x towards y [rad].
// Source: Bertolazzi and Frego, "G1 fitting with clothoids", Mathematical Methods in the Applied Sciences 38(5), 2015.
#pragma once

#include <Eigen/Core>

namespace loc {

struct ClothoidPoint {
  Eigen::Vector2d position;
  double course = 0;     ///< [rad]
  double curvature = 0;  ///< [1/m], positive to the left
};

struct Clothoid {
  Eigen::Vector2d start = Eigen::Vector2d::Zero();  ///< [m]
  double course = 0;                                ///< at the start [rad]
  double curvature = 0;                             ///< at the start [1/m]
  double curvature_rate = 0;                        ///< [1/m^2]
  double length = 0;                                ///< [m]

  /// @param arc_length from the start [m]; the curve goes on beyond its ends. Exact to rounding.
  ClothoidPoint at(double arc_length) const;
};

/// The clothoid, and how its curvatures at both ends change with the courses (for estimating courses).
struct ClothoidFit {
  Clothoid clothoid;
  double end_curvature = 0;
  Eigen::Vector2d start_curvature_jacobian;  ///< by course at start and end [1/m/rad]
  Eigen::Vector2d end_curvature_jacobian;
};

/// From one point with its course to another with its own: the short way, no more than the turns that the courses ask
/// for (each course is taken within pi of the straight line's). A course opposite to that line gives a loop.
/// @throws std::invalid_argument when the points are the same or something is not finite; when the curve would be more
/// than 100 times as long as the line (courses nearly opposite to it, one turning left and one right).
ClothoidFit fit_clothoid(const Eigen::Vector2d& start, double start_course, const Eigen::Vector2d& end,
                         double end_course);

/// The angle minus the multiple of two pi that leaves it in (-pi, pi].
double wrap_angle(double angle);

}  // namespace loc
