// LOC_CLOCK: what a program with a receiver tells the others about host and GPS time.
#pragma once

#include <string>

#include "loc/clock_t.hpp"
#include "msgs/convert.hpp"
#include "tools/support/lcm_link.hpp"
#include "tools/support/restamp.hpp"

namespace loc {

class ClockLink {
 public:
  /// @throws as open_lcm
  explicit ClockLink(const std::string& url);

  /// Hands over what has come; does not wait.
  void poll(RestampedSource& source);
  void publish(const clock_t& message) { publisher_.publish(kClockChannel, message); }
  std::int64_t garbage() const { return garbage_; }

 private:
  LcmPublisher publisher_;
  LcmReceiver receiver_;
  RestampedSource* target_ = nullptr;  // while poll() runs
  std::int64_t garbage_ = 0;
};

}  // namespace loc
