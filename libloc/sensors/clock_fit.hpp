// The curve under a few dozen points whose errors are never negative: value and slope at its newest end.
#pragma once

#include <span>

namespace loc {

struct EnvelopePoint {
  double x_s = 0;   ///< time before the newest point, so <= 0
  double y_ns = 0;  ///< lateness against some line
};

struct EnvelopePrior {
  double slope = 0;        ///< [ns/s] at x = 0
  double sigma_slope = 0;  ///< [ns/s]
  double sigma_bend = 0;   ///< of the change of slope with time [ns/s^2]
  double noise_ns = 0;     ///< mean error of a point as far as is known beforehand; used where there are few points
};

struct Envelope {
  double value_ns = 0;  ///< at x = 0
  double slope = 0;     ///< [ns/s] at x = 0
  double sigma_value_ns = 0;
  double sigma_slope = 0;
  double noise_ns = 0;  ///< mean error of a point
};

/// Theil-Sen slope, then least squares of a parabola with the prior, points far off that line left out; at last the
/// curve is lowered by the mean error of the points, which is seen in the differences of neighbours.
/// @param points 1 to 64, x increasing, the newest last at x = 0. Allocates nothing.
Envelope fit_envelope(std::span<const EnvelopePoint> points, const EnvelopePrior& prior);

}  // namespace loc
