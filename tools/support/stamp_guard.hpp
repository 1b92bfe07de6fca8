// Which stamps of a stream of messages can be followed: a damaged one may be years off, the first one as well. A stamp
// is believed when it is near the newest that was, and two in a row that agree with each other take the clock
// elsewhere: it was set, or the source has begun anew.
#pragma once

#include <cstdint>
#include <limits>

#include "libloc/core/time.hpp"

namespace loc {

/// to - from; the largest or smallest number where it is even more.
constexpr TimeNs time_between(TimeNs from, TimeNs to) {
  TimeNs out = 0;
  if (!__builtin_sub_overflow(to, from, &out)) return out;
  return to > from ? std::numeric_limits<TimeNs>::max() : std::numeric_limits<TimeNs>::min();
}

class StampGuard {
 public:
  static constexpr TimeNs kFarNs = 3'600'000'000'000;

  enum class Verdict {
    kGood,
    kInstead,  ///< to be followed instead of the only one before, with which it does not agree
    kJumped,   ///< to be followed from here on: the one before, which was far off, was right
    kFarOff,   ///< not to be followed
  };

  Verdict judge(TimeNs time_ns) {
    if (newest_ns_ == kNoTime) {
      newest_ns_ = time_ns;
      return Verdict::kGood;
    }
    if (near(time_ns, newest_ns_)) {
      newest_ns_ = time_ns;
      odd_ns_ = kNoTime;
      confirmed_ = true;
      return Verdict::kGood;
    }
    if (!confirmed_) {
      newest_ns_ = time_ns;
      return Verdict::kInstead;
    }
    if (odd_ns_ != kNoTime && near(time_ns, odd_ns_)) {
      newest_ns_ = time_ns;
      odd_ns_ = kNoTime;
      return Verdict::kJumped;
    }
    odd_ns_ = time_ns;
    return Verdict::kFarOff;
  }
  /// Two have agreed.
  bool confirmed() const { return confirmed_; }
  /// The newest that is followed; kNoTime before the first.
  TimeNs newest_ns() const { return newest_ns_; }

 private:
  static bool near(TimeNs a, TimeNs b) {
    const TimeNs d = time_between(b, a);
    return d <= kFarNs && d >= -kFarNs;
  }
  TimeNs newest_ns_ = kNoTime;
  TimeNs odd_ns_ = kNoTime;
  bool confirmed_ = false;
};

}  // namespace loc
