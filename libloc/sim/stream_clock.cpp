#include "libloc/sim/stream_clock.hpp"

#include <string>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

ClockSimulation simulation_of(const StreamClockModel& model, double rate_hz) {
  model.check("clock");
  ClockSimulation s;
  s.rate_hz = rate_hz;
  s.oscillator = model.oscillator;
  s.delay = model.delay;
  s.device_start_ns = from_seconds(model.offset_s);
  s.host_start_ns = 0;
  return s;
}

}  // namespace

StreamClockModel StreamClockModel::usb() {
  StreamClockModel m;
  m.oscillator = {};
  m.delay = {};
  return m;
}

void StreamClockModel::check(std::string_view name) const {
  require_finite(std::string(name) + ".offset_s", offset_s);
  require(loss_fraction >= 0 && loss_fraction < 1, std::string(name) + ".loss_fraction", loss_fraction,
          "must be in [0, 1)");
  ClockSimulation s;
  s.oscillator = oscillator;
  s.delay = delay;
  s.check();
}

StreamClock::StreamClock(const StreamClockModel& model, double rate_hz, Random random)
    : StreamClock(model, rate_hz, random.fork(0), random.fork(1)) {}

StreamClock::StreamClock(const StreamClockModel& model, double rate_hz, Random clock, Random loss)
    : clock_(simulation_of(model, rate_hz), clock),
      loss_(loss),
      minimum_delay_ns_(model.delay.minimum_ns),
      loss_fraction_(model.loss_fraction) {}

StreamTick StreamClock::next() {
  const ClockSample sample = clock_.next();
  StreamTick tick;
  tick.sequence = sequence_++;
  tick.time_ns = sample.earliest_host_ns - minimum_delay_ns_;
  tick.stamp_ns = sample.device_time_ns;
  tick.delay_ns = sample.host_time_ns - tick.time_ns;
  tick.lost = loss_.uniform() < loss_fraction_;
  return tick;
}

}  // namespace loc
