// A plane path through points: one clothoid from each to the next, the course continuous. Courses that are not given
// are estimated: the first value is that of a circle through the point and its neighbours (nearly; at hairpins not more
// than a right angle to either straight line), then those within 0.5 rad of it that make the jumps of curvature at
// their points smallest in least squares. On roads that do not zigzag the jumps vanish and the curvature is continuous.
// Where the first or last course is free, the first or last piece is an arc of a circle, and between two free points a
// straight line. So points on a line or a circle give that line or circle.
// Source: Bertolazzi and Frego, "Interpolating clothoid splines with curvature continuity", Mathematical Methods in the
// Applied Sciences 41(4), 2018; bounds and
// arcs at the ends are ours, so that there is always an answer, without loops.
#pragma once

#include <optional>
#include <vector>

#include "libloc/sim/clothoid.hpp"

namespace loc {

class ClothoidPath {
 public:
  /// @param points [m], at least one, each different from the one before
  /// @param courses [rad], as many; nullopt: to be estimated. A single point needs its course.
  /// @throws std::invalid_argument naming the point when something is not finite or courses cannot be joined.
  ClothoidPath(const std::vector<Eigen::Vector2d>& points, const std::vector<std::optional<double>>& courses);

  /// One fewer than points. The course of each is that of the one before at its end, without steps of two pi.
  const std::vector<Clothoid>& pieces() const { return pieces_; }
  /// At the points, without steps of two pi [rad].
  const std::vector<double>& courses() const { return courses_; }

 private:
  std::vector<Clothoid> pieces_;
  std::vector<double> courses_;
};

}  // namespace loc
