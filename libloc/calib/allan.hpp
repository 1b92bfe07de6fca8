// Noise of an inertial sensor from a still recording: Allan deviation and what it is made of.
//
//   sigma^2(tau) = N^2 / tau + (2 ln 2 / pi) B^2 + K^2 tau / 3   (+ 3 Q^2 / tau^2 + R^2 tau^2 / 2)
//
// N noise density (angle or velocity random walk), B bias instability, K random walk of the bias, as IEEE Std 952,
// annex C, defines them; Q quantisation and R ramp are fitted too, so that they do not pass for the others. Overlapping
// estimator and its degrees of freedom: Howe, Allan, Barnes, "Properties of signal sources and measurement methods",
// 1981 (also NIST SP 1065, table 5). The terms come from a weighted fit without negative terms. A term is identified
// only where it makes up much of the measured curve; otherwise there is just an upper bound, and nothing is
// extrapolated.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "libloc/calib/stillness.hpp"
#include "libloc/core/quality.hpp"
#include "libloc/sensors/imu_noise.hpp"

namespace loc {

struct AllanOptions {
  int points_per_octave = 4;     ///< of tau
  double longest_share = 0.125;  ///< of the recording: the longest tau; beyond, the estimate hardly has freedom

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct AllanPoint {
  double tau_s = 0;
  std::int64_t samples = 0;  ///< tau in samples
  double deviation = 0;      ///< unit of the values
  double sigma = 0;          ///< one standard deviation of it
  double freedom = 0;        ///< equivalent degrees of freedom of its square
};

/// N [unit sqrt(s) = unit/sqrt(Hz)], B [unit] or K [unit/sqrt(s) = unit/s/sqrt(Hz)].
struct AllanTerm {
  bool identified = false;
  double value = kUnknown;        ///< NaN unless identified
  double sigma = kUnknown;        ///< NaN unless identified
  double upper_bound = kUnknown;  ///< a larger value would have given so low a point once in 200 times
  double tau_s = kUnknown;        ///< where its share of the fitted variance is largest
  double share = 0;               ///< that share
};

struct AllanFit {
  std::vector<AllanPoint> points;
  AllanTerm noise_density;
  AllanTerm bias_instability;
  AllanTerm random_walk;
  double minimum_tau_s = kUnknown;      ///< where the curve is lowest
  double minimum_deviation = kUnknown;  ///< there
  double fitted_from_tau_s = kUnknown;  ///< shorter ones are shaped by the sensor's own filter
  double misfit = kUnknown;             ///< rms of the fitted points' residuals in their own deviations
  double rate_hz = kUnknown;
  double duration_s = kUnknown;
  Quality quality;
};

/// @param values N samples at a constant rate, the sensor at rest.
/// @throws std::invalid_argument for wrong options or rate; DataError naming the first value that is not finite.
AllanFit allan_fit(std::span<const double> values, double rate_hz, const AllanOptions& options = {});

/// Curve and terms of all axes of a recording, from its longest part without motion, gaps and bad rows.
struct ImuAllan {
  std::array<AllanFit, 3> gyroscope;
  std::array<AllanFit, 3> accelerometer;
  bool has_gyroscope = false;
  bool has_accelerometer = false;
  std::int64_t begin = 0;  ///< rows used
  std::int64_t end = 0;
  double duration_s = 0;
  double used_share = 0;     ///< of the rows given
  std::int64_t bridged = 0;  ///< samples lost or not finite, up to 4 in one place, and interpolated
  Quality quality;           ///< of the choice of the part, and the worst of the axes
};

/// @param gyroscope [rad/s], accelerometer [m/s^2]: N rows, or none. Up to 4 samples lost in one place are interpolated
/// and counted, a longer pause is a gap; single late time stamps do no harm.
/// @throws std::invalid_argument for wrong options or sizes.
ImuAllan analyse_imu_noise(std::span<const TimeNs> times_ns, const TriadRows& gyroscope, const TriadRows& accelerometer,
                           const AllanOptions& options = {}, StillnessOptions stillness = {});

struct ImuNoiseFit {
  ImuNoise noise;
  std::vector<std::string> measured;  ///< names of the fields of noise that the recording determines
  Quality quality;                    ///< says of every field that was not measured where its value is from
};

/// Noise for the estimators: root mean square over the axes. What was not identified keeps the fallback's value, or the
/// upper bound where that is lower; the turn-on biases are not visible in one recording and keep the fallback's.
ImuNoiseFit imu_noise_from(const ImuAllan& allan, const ImuNoise& fallback = {});

}  // namespace loc
