// Lets a recording run at the pace of its time stamps, or a multiple of it.
#pragma once

#include <cstdint>

#include "libloc/core/time.hpp"

namespace loc {

class Pacer {
 public:
  /// @param speed 1: as recorded; N: N times as fast; 0: does not wait at all
  /// @throws std::invalid_argument unless finite and not negative
  explicit Pacer(double speed);

  /// Time [ns] to wait at now (monotonic) before the sample of that time is due; 0 when it is due or late. Where the
  /// recording's clock steps back by more than kMaxLateNs, or on by more than kMaxStepNs, it takes up the pace anew
  /// from there. A sample that is a little older than the newest so far has come late, and is due at once.
  TimeNs wait_ns(TimeNs sample_time_ns, TimeNs now_ns);

  std::int64_t restarts() const { return restarts_; }
  /// Most that a sample was behind the pace so far, those left aside that had come late.
  TimeNs max_lag_ns() const { return max_lag_ns_; }

  static constexpr TimeNs kMaxStepNs = 10'000'000'000;
  static constexpr TimeNs kMaxLateNs = 1'000'000'000;  ///< a receiver's fix may take that long

 private:
  double speed_;
  bool started_ = false;
  TimeNs origin_sample_ns_ = 0;
  TimeNs origin_now_ns_ = 0;
  TimeNs newest_sample_ns_ = 0;
  std::int64_t restarts_ = 0;
  TimeNs max_lag_ns_ = 0;
};

}  // namespace loc
