// The clock of a simulated sensor: when it samples, what its time stamps say, when the samples arrive at the host, and
// which of them are lost. The oscillator and the delays are those of sim/clock.
//   true time of sample k: the device counts k periods; its oscillator runs off, so the samples come early or late
//   stamp = offset + k periods           (of the device's clock)
//   arrival = true time + delay
#pragma once

#include <cstdint>
#include <string_view>

#include "libloc/core/random.hpp"
#include "libloc/core/time.hpp"
#include "libloc/sim/clock.hpp"

namespace loc {

/// The default is a perfect one: on the true time, samples arrive at once, none is lost.
struct StreamClockModel {
  double offset_s = 0;  ///< of the stamps: device clock less true time, at the start
  OscillatorModel oscillator{.constant_ppm = 0, .wave_ppm = 0, .wave_period_s = 1200, .skew_walk = 0};
  DelayModel delay{.minimum_ns = 0,
                   .exponential_ns = 0,
                   .outlier_fraction = 0,
                   .outlier_max_ns = 0,
                   .wobble_ns = 0,
                   .wobble_period_s = 1800};
  double loss_fraction = 0;  ///< of samples that never arrive; they leave a jump in the sequence numbers

  static StreamClockModel usb();  ///< own oscillator, 50 ppm off; delays of a USB device

  /// @throws std::invalid_argument naming the field and its value. @param name goes before the field's.
  void check(std::string_view name) const;
};

/// One sample. Times are since the start.
struct StreamTick {
  std::int64_t sequence = 0;
  TimeNs time_ns = 0;   ///< true
  TimeNs stamp_ns = 0;  ///< on the device's clock
  TimeNs delay_ns = 0;  ///< from the true time to the arrival
  bool lost = false;
};

/// Gives one sample after the other, for as long as one asks.
class StreamClock {
 public:
  /// @throws std::invalid_argument as StreamClockModel::check, and for a rate that is not positive.
  StreamClock(const StreamClockModel& model, double rate_hz, Random random);
  StreamTick next();

 private:
  StreamClock(const StreamClockModel& model, double rate_hz, Random clock, Random loss);

  ClockSimulator clock_;
  Random loss_;
  TimeNs minimum_delay_ns_;
  double loss_fraction_;
  std::int64_t sequence_ = 0;
};

}  // namespace loc
