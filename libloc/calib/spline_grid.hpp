// Uniform B-splines: where the knots are, and the weights of the control points.
// A spline of order k (degree k - 1) is in each segment between two knots a polynomial, and has k - 2 continuous
// derivatives. In segment i, with u = (t - t_i) / spacing in [0, 1),
//   x(t) = sum_j B_j(u) c_{i+j},  j = 0 … k-1,     or cumulatively
//   x(t) = c_i + sum_j L_j(u) (c_{i+j} - c_{i+j-1}),  j = 1 … k-1,  L_j = B_j + … + B_{k-1}.
// The second form carries over to rotations (spline.hpp). u outside [0, 1] extrapolates the segment's polynomial.
// Source: Qin, "General matrix representations for B-splines", 2000; the closed form of the entries as in Sommer,
// Usenko, Schubert, Demmel, Cremers, "Efficient derivative computation for cumulative B-splines on Lie groups", 2020.
#pragma once

#include <array>

namespace loc {

constexpr int kMinSplineOrder = 3;
constexpr int kMaxSplineOrder = 8;

/// Knots at start_s + i * spacing_s. Times are seconds since an origin of the caller's.
struct SplineGrid {
  double start_s = 0;    ///< begin of the first segment
  double spacing_s = 0;  ///< of the knots
  int segments = 0;
  int order = 4;  ///< degree + 1

  int control_points() const { return segments + order - 1; }
  double end_s() const { return start_s + segments * spacing_s; }
  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Shortest grid that covers [begin_s, end_s], beginning at begin_s.
/// @throws std::invalid_argument for times that are not finite or run backwards, and as SplineGrid::check.
SplineGrid grid_over(double begin_s, double end_s, double spacing_s, int order);

/// A time as segment and place in it.
struct SplinePlace {
  int segment = 0;
  double u = 0;
};

/// Of any finite time: before the first and after the last segment u is outside [0, 1).
SplinePlace place_of(const SplineGrid& grid, double t_s);

/// Time at which control point i has its largest influence (Greville's abscissa): the start value for the control point
/// of a smooth function is its value there.
double abscissa_of(const SplineGrid& grid, int i);

/// Weights of the control points segment … segment + order - 1, and their derivatives by time [1/s, 1/s^2].
struct SplineWeights {
  std::array<double, kMaxSplineOrder> value{};
  std::array<double, kMaxSplineOrder> first{};
  std::array<double, kMaxSplineOrder> second{};
};

/// B_j, their sum is 1.
/// @param order in [1, kMaxSplineOrder] @param spacing_s positive. Both as a grid that was checked has them: this is
/// called for every sample, so they are asserted only.
SplineWeights weights_at(int order, double spacing_s, double u);
/// L_j, the first is 1 everywhere. Parameters likewise.
SplineWeights cumulative_weights_at(int order, double spacing_s, double u);

}  // namespace loc
