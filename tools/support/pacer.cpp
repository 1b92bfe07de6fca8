#include "tools/support/pacer.hpp"

#include <algorithm>

#include "libloc/core/check.hpp"

namespace loc {
Pacer::Pacer(double speed) : speed_(speed) {
  require_not_negative("speed", speed);
}

TimeNs Pacer::wait_ns(TimeNs sample_time_ns, TimeNs now_ns) {
  if (speed_ == 0) return 0;
  TimeNs step = 0;
  const bool overflow = __builtin_sub_overflow(sample_time_ns, newest_sample_ns_, &step);
  if (!started_ || overflow || step < -kMaxLateNs || step > kMaxStepNs) {
    if (started_) ++restarts_;
    started_ = true;
    origin_sample_ns_ = sample_time_ns;
    origin_now_ns_ = now_ns;
  } else if (step < 0) {
    return 0;
  }
  newest_sample_ns_ = sample_time_ns;
  const TimeNs elapsed = sample_time_ns - origin_sample_ns_;
  const TimeNs due = origin_now_ns_ + from_seconds(to_seconds(elapsed) / speed_);
  max_lag_ns_ = std::max(max_lag_ns_, now_ns - due);
  return std::max<TimeNs>(due - now_ns, 0);
}

}  // namespace loc
