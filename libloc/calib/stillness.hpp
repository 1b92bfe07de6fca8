// Where in a recording of gyroscope and accelerometer the device lay still. Any unit, ADC counts included: the noise at
// rest is estimated from the recording itself, and all thresholds are ratios to it.
//
// 1. Variance over short windows, per axis. At rest its logarithm has a narrow distribution, in motion a broad one
// above
//    it: the lowest mode is the noise at rest (Tedaldi, Pretto, Menegatti, "A robust and easy to implement method for
//    IMU calibration without external equipments", ICRA 2014, take the threshold as a multiple of the variance of a
//    part that the user promises to be still; here it is found).
// 2. That this mode is noise and not gentle motion is judged by its whiteness: von Neumann's ratio of the mean squared
//    successive difference to twice the variance is 1 for white noise and near 0 for what moves smoothly.
// 3. Still: the variance of the window around a sample, averaged over the axes in units of the noise, falls below
//    enter_ratio and has not yet risen above leave_ratio, in each sensor that is there.
// 4. A vibrating device that moves (a drone in flight) has white noise too, but its mean wanders from one window to the
//    next by far more than noise of that size can: such parts are cut out.
// 5. A gyroscope that shows another mean rate than in the other segments was turning evenly: left out.
//
// Even motion in a straight line cannot be told from rest, by nobody. Slow drift of the bias does no harm: it is small
// within a window.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "libloc/calib/sliding_moments.hpp"
#include "libloc/core/quality.hpp"
#include "libloc/core/time.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

/// From one time to a later one; safe for any two times.
inline double elapsed_s(TimeNs from, TimeNs to) {
  return static_cast<double>(static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from)) * 1e-9;
}

/// N rows of samples of a three-axis sensor.
using TriadRows = Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>;

struct StillnessOptions {
  double min_duration_s = 1;   ///< shorter segments are left out
  double window_s = 0.5;       ///< over which the variance is taken; at least 20 samples
  double enter_ratio = 3;      ///< of the variance to that of the noise: below it, stillness begins
  double leave_ratio = 6;      ///< above it, stillness ends
  double min_whiteness = 0.1;  ///< of the quietest windows, 1 for white noise; 0: not judged (strong low-pass filters)
  double turning_sigmas = 10;  ///< mean rate of a segment off the median of all, in deviations of a sample; 0: off
  double max_wander = 4;       ///< mean square step from window to window, in units of what the noise makes; 0: off
  double gap_periods = 5;      ///< a longer pause between samples ends a segment

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Noise of one sensor at rest, what stillness is measured against.
struct RestNoise {
  Eigen::Vector3d variance = Eigen::Vector3d::Constant(kUnknown);  ///< of a sample; NaN: axis without information
  Eigen::Vector3d quantum = Eigen::Vector3d::Zero();               ///< smallest step of the readings
  double whiteness = kUnknown;                                     ///< of the quietest windows
  bool known() const { return !variance.array().isNaN().all(); }
  /// Mean over the axes of the window's variance in units of the noise at rest.
  double activity(const Eigen::Vector3d& window_variance) const;
  /// Mean over the axes of the squared difference of two neighbouring windows' means, in units of what the noise makes.
  double wander(const Eigen::Vector3d& mean_difference, int window) const;
};

/// Mean and scatter of one sensor in a segment; NaN when the sensor is absent.
struct StillStatistics {
  Eigen::Vector3d mean = Eigen::Vector3d::Constant(kUnknown);
  Eigen::Matrix3d cov = Eigen::Matrix3d::Constant(kUnknown);  ///< of a sample, divided by N - 1
};

struct StillSegment {
  std::int64_t begin = 0;  ///< first row
  std::int64_t end = 0;    ///< one past the last row
  TimeNs start_ns = kNoTime;
  TimeNs end_ns = kNoTime;   ///< of the last row in it
  std::int64_t samples = 0;  ///< taken; rows in between that are not finite or out of order are not counted
  StillStatistics gyroscope;
  StillStatistics accelerometer;
  double duration_s() const { return elapsed_s(start_ns, end_ns); }
};

struct Stillness {
  std::vector<StillSegment> segments;
  RestNoise gyroscope;
  RestNoise accelerometer;
  double rate_hz = kUnknown;            ///< one over the median period
  int window_samples = 0;               ///< of the variance
  std::int64_t samples = 0;             ///< taken
  std::int64_t not_finite = 0;          ///< rows left out
  std::int64_t out_of_order = 0;        ///< rows left out: not later than the one before
  std::int64_t gaps = 0;                ///< pauses longer than gap_periods
  std::int64_t wandering_segments = 0;  ///< cut or left out: vibrating, but moving
  std::int64_t turning_segments = 0;    ///< left out: evenly turning
  double still_share = 0;               ///< of the samples taken
  /// Refused: no noise at rest was found, segments is empty.
  Quality quality;
};

/// @param times_ns N times. @param gyroscope, accelerometer N rows each, any unit; one of them may have no rows at all:
/// absent.
/// @throws std::invalid_argument for wrong options or sizes. Bad data do not throw: see Stillness::quality.
Stillness find_stillness(std::span<const TimeNs> times_ns, const TriadRows& gyroscope, const TriadRows& accelerometer,
                         const StillnessOptions& options = {});

/// The same rule sample by sample, given the noise at rest: O(1) amortised, no allocation after construction. Its
/// answer is half a window late, as its window ends at the newest sample.
class StillnessDetector {
 public:
  /// @param window_samples, gyroscope, accelerometer as find_stillness() gives them; one sensor may be unknown.
  /// @param gyroscope_bias [unit of the gyroscope] at rest, checked against turning_sigmas; NaN: not checked
  /// @throws std::invalid_argument
  StillnessDetector(RestNoise gyroscope, RestNoise accelerometer, double rate_hz, int window_samples,
                    const StillnessOptions& options = {},
                    Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Constant(kUnknown));

  /// Takes a sample and says whether the device is still. Samples that are not finite or not later than the one before
  /// are counted and change nothing; a gap empties the window. A sensor whose noise is unknown is not looked at.
  bool update(TimeNs time_ns, const Eigen::Vector3d& gyroscope, const Eigen::Vector3d& accelerometer);

  bool still() const { return still_since_ns_ != kNoTime; }
  /// Time of the sample where the device was found still; kNoTime while it moves.
  TimeNs still_since_ns() const { return still_since_ns_; }
  /// Over the window; must not be asked unless still().
  Eigen::Vector3d gyroscope_mean() const { return gyroscope_window_.mean(); }
  Eigen::Vector3d accelerometer_mean() const { return accelerometer_window_.mean(); }
  std::int64_t rejected() const { return rejected_; }

 private:
  StillnessOptions options_;
  RestNoise gyroscope_;
  RestNoise accelerometer_;
  Eigen::Vector3d gyroscope_bias_;
  double gap_s_;
  SlidingMoments gyroscope_window_;
  SlidingMoments accelerometer_window_;
  TimeNs last_ns_ = kNoTime;
  TimeNs still_since_ns_ = kNoTime;
  std::int64_t rejected_ = 0;
};

}  // namespace loc
