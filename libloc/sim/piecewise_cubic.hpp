// Cubic polynomials joined at knots: Hermite (values and slopes given), shape-preserving (no overshoot between the
// values) and the spline with two continuous derivatives.
// Sources: Fritsch and Butland, "A method for constructing local monotone piecewise cubic interpolants", SIAM J. Sci.
// Stat. Comput. 5(2), 1984, with the ends of Moler, "Numerical Computing with MATLAB", 2004, chapter 3; de Boor, "A
// Practical Guide to Splines", 1978 (not-a-knot ends).
#pragma once

#include <cstddef>
#include <vector>

namespace loc {

class PiecewiseCubic {
 public:
  struct Value {
    double value = 0;
    double rate = 0;          ///< first derivative
    double acceleration = 0;  ///< second derivative
  };

  /// knots: at least two, increasing; values and slopes: one each. @throws std::invalid_argument naming the index.
  static PiecewiseCubic hermite(std::vector<double> knots, const std::vector<double>& values,
                                const std::vector<double>& slopes);
  /// Monotone where the values are; continuous first derivative.
  static PiecewiseCubic shape_preserving(std::vector<double> knots, const std::vector<double>& values);
  /// Continuous second derivative; the third is continuous at the second and the last but one knot. Three values: a
  /// parabola; two: a straight line.
  static PiecewiseCubic spline(std::vector<double> knots, const std::vector<double>& values);

  const std::vector<double>& knots() const { return knots_; }
  /// Which piece holds x: at a knot the one that begins there; beyond the ends the first or last.
  std::size_t piece(double x) const;
  Value at(double x) const { return at(x, piece(x)); }
  Value at(double x, std::size_t piece) const;
  /// c[0] + c[1] d + c[2] d^2 + c[3] d^3, with d = x - knots()[piece].
  const double* coefficients(std::size_t piece) const { return pieces_[piece].c; }

 private:
  struct Piece {
    double c[4];
  };
  std::vector<double> knots_;
  std::vector<Piece> pieces_;
};

}  // namespace loc
