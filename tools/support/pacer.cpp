#include "tools/support/pacer.hpp"

#include <algorithm>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

// Streams are in order by and large only: an image may be a little older than the IMU sample before it.
constexpr TimeNs kTolerance = 100'000'000;

}  // namespace

Pacer::Pacer(double speed) : speed_(speed) {
  require_not_negative("speed", speed);
}

TimeNs Pacer::wait_ns(TimeNs sample_time_ns, TimeNs now_ns) {
  if (speed_ == 0) return 0;
  TimeNs step = 0;
  const bool overflow = __builtin_sub_overflow(sample_time_ns, last_sample_ns_, &step);
  if (!started_ || overflow || step < -kTolerance || step > kMaxStepNs) {
    if (started_) ++restarts_;
    started_ = true;
    origin_sample_ns_ = sample_time_ns;
    origin_now_ns_ = now_ns;
  }
  last_sample_ns_ = sample_time_ns;
  const TimeNs elapsed = sample_time_ns - origin_sample_ns_;
  const TimeNs due = origin_now_ns_ + from_seconds(to_seconds(elapsed) / speed_);
  max_lag_ns_ = std::max(max_lag_ns_, now_ns - due);
  return std::max<TimeNs>(due - now_ns, 0);
}

}  // namespace loc
