// What ties the host's clock to GPS time: pulses, which are exact and do not say which second they begin, and labels
// (sentences, packets), which say the second and arrive late. Sources of GPS deliver them beside their fixes,
// sensors/clock pairs them.
#pragma once

#include <cstdint>

#include "libloc/core/time.hpp"

namespace loc {

struct GpsTimeEvent {
  enum class Kind : std::uint8_t {
    kPulse,  ///< edge of the pulse per second
    kLabel   ///< a time told by the receiver
  };
  Kind kind = Kind::kLabel;
  TimeNs host_time_ns = kNoTime;  ///< pulse: the edge, as the kernel (or gpsd) stamped it; label: arrival; host clock
  /// GPS time (since 1980-01-06 00:00:00 UTC, without leap seconds) that the label says; of a pulse kNoTime, unless its
  /// source has paired it already (gpsd).
  TimeNs gps_time_ns = kNoTime;
};

}  // namespace loc
