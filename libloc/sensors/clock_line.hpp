// A line from one clock to another, what a clock model knows at a moment: plain data that can be sent to another
// process. And the rule by which times that are put out never step back.
#pragma once

#include "libloc/core/time.hpp"

namespace loc {

/// a - b; times too far apart give the largest difference there is instead of an overflow.
TimeNs saturating_difference(TimeNs a, TimeNs b);
/// a + b, likewise.
TimeNs saturating_sum(TimeNs a, TimeNs b);

/// A time with its standard deviation.
struct ClockStamp {
  TimeNs time_ns = kNoTime;
  double sigma_ns = 0;
};

/// output = output_ref + (input - input_ref) * (1 + skew)
struct ClockLine {
  TimeNs input_ref_ns = 0;
  TimeNs output_ref_ns = 0;
  double skew = 0;      ///< relative frequency error; 1e-6 is 1 ppm
  double sigma_ns = 0;  ///< of the output at input_ref
  double sigma_skew = 0;
  double skew_walk = 0;  ///< how fast the skew wanders [1/sqrt(s)]
  /// Span of the input for which the line holds.
  TimeNs valid_from_ns = 0;
  TimeNs valid_to_ns = 0;

  bool valid_at(TimeNs input_ns) const { return input_ns >= valid_from_ns && input_ns <= valid_to_ns; }
  TimeNs offset_ns() const { return saturating_difference(output_ref_ns, input_ref_ns); }
  double skew_ppm() const { return skew * 1e6; }
  TimeNs convert(TimeNs input_ns) const;
  /// Standard deviation of convert(input_ns) [ns]; grows away from the reference with the skew's own and its wandering.
  double sigma_at_ns(TimeNs input_ns) const;
  /// The line from output to input.
  ClockLine inverse() const;
};

/// Makes times follow their input in order although the line under them is corrected now and then: where a correction
/// would take time back, or make it stand still, it advances at half the input's rate until the line has caught up.
/// That holds from the latest input on; an input from before it gets a time before the latest one.
class MonotoneTime {
 public:
  /// Of inputs that increase the outputs do, too (by at least 1 ns for inputs 2 ns apart); the same input as the last
  /// gives the same output again.
  TimeNs apply(TimeNs input_ns, TimeNs output_ns);
  /// Likewise; what the time was held back or ahead by goes into sigma.
  ClockStamp apply(TimeNs input_ns, const ClockStamp& output);
  /// The input starts anew (its counter was reset); the output goes on from where it is.
  void restart_input() { has_input_ = false; }
  /// The output's clock itself was set back: there is nothing to be held to.
  void forget() { *this = {}; }

 private:
  TimeNs input_ns_ = 0;
  TimeNs output_ns_ = 0;
  bool has_input_ = false;
  bool has_output_ = false;
};

}  // namespace loc
