#include "libloc/sim/clock.hpp"

#include <cmath>
#include <numbers>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr TimeNs kLateness = 500'000'000;

double sine(double time_s, double period_s) {
  return std::sin(2 * std::numbers::pi * time_s / period_s);
}

double exponential(Random& random, double mean) {
  return -mean * std::log1p(-random.uniform());
}

// Beyond the minimum [ns].
double lateness(const DelayModel& d, double time_s, Random& random) {
  double delay = exponential(random, static_cast<double>(d.exponential_ns));
  if (random.uniform() < d.outlier_fraction) delay += random.uniform(0, static_cast<double>(d.outlier_max_ns));
  return delay + static_cast<double>(d.wobble_ns) * sine(time_s, d.wobble_period_s);
}

}  // namespace

ClockSimulation ClockSimulation::usb_imu() {
  return {};
}

ClockSimulation ClockSimulation::pps() {
  ClockSimulation s;
  s.rate_hz = 1;
  s.oscillator.constant_ppm = 20;
  s.oscillator.wave_ppm = 0.3;
  s.delay.minimum_ns = 2'000;
  s.delay.exponential_ns = 5'000;
  s.delay.outlier_max_ns = 300'000;
  return s;
}

ClockSimulation ClockSimulation::nmea_only() {
  ClockSimulation s = pps();
  s.delay.minimum_ns = 110'000'000;
  s.delay.exponential_ns = 15'000'000;
  s.delay.outlier_fraction = 0.02;
  s.delay.outlier_max_ns = 200'000'000;
  s.delay.wobble_ns = 30'000'000;
  return s;
}

void ClockSimulation::check() const {
  require_positive("rate_hz", rate_hz);
  require(rate_hz >= 1e-6 && rate_hz <= 1e8, "rate_hz", rate_hz, "must be in [1e-6, 1e8]");
  require(std::abs(oscillator.constant_ppm) < 1e5, "constant_ppm", oscillator.constant_ppm, "must be below 1e5");
  require(std::abs(oscillator.wave_ppm) < 1e5, "wave_ppm", oscillator.wave_ppm, "must be below 1e5");
  require_positive("wave_period_s", oscillator.wave_period_s);
  require_not_negative("skew_walk", oscillator.skew_walk);
  require(delay.minimum_ns >= 0, "minimum_ns", static_cast<double>(delay.minimum_ns), "must not be negative");
  require(delay.exponential_ns >= 0, "exponential_ns", static_cast<double>(delay.exponential_ns),
          "must not be negative");
  require(delay.outlier_fraction >= 0 && delay.outlier_fraction <= 1, "outlier_fraction", delay.outlier_fraction,
          "must be in [0, 1]");
  require(delay.outlier_max_ns >= 0, "outlier_max_ns", static_cast<double>(delay.outlier_max_ns),
          "must not be negative");
  require_positive("wobble_period_s", delay.wobble_period_s);
  for (std::size_t i = 0; i < events.size(); ++i) {
    require_not_negative("event.time_s", events[i].time_s);
    require(i == 0 || events[i].time_s >= events[i - 1].time_s, "event.time_s", events[i].time_s,
            "events must be in order of time");
  }
}

ClockSimulator::ClockSimulator(ClockSimulation simulation, Random random)
    : simulation_((simulation.check(), std::move(simulation))),
      random_(random),
      period_ns_(from_seconds(1 / simulation_.rate_hz)),
      device_time_ns_(simulation_.device_start_ns),
      walk_step_(simulation_.oscillator.skew_walk * std::sqrt(to_seconds(period_ns_))) {}

void ClockSimulator::advance() {
  const OscillatorModel& o = simulation_.oscillator;
  walk_ += walk_step_ * random_.normal();
  const double error =
      1e-6 * (o.constant_ppm + o.wave_ppm * sine(to_seconds(since_start_ns_), o.wave_period_s)) + walk_;
  device_time_ns_ += period_ns_;
  // Whole nanoseconds and a rest, because a double of nanoseconds since the start would lose digits in long runs.
  since_start_rest_ns_ += error * static_cast<double>(period_ns_);
  const double whole = std::floor(since_start_rest_ns_);
  since_start_rest_ns_ -= whole;
  since_start_ns_ += period_ns_ + static_cast<TimeNs>(whole);
}

ClockSample ClockSimulator::regular() {
  const DelayModel& d = simulation_.delay;
  const double delay = lateness(d, to_seconds(since_start_ns_), random_);
  ClockSample sample;
  sample.device_time_ns = device_time_ns_;
  sample.earliest_host_ns = simulation_.host_start_ns + host_shift_ns_ + since_start_ns_ + d.minimum_ns;
  sample.host_time_ns = sample.earliest_host_ns + std::llround(delay);
  if (since_start_ns_ < late_until_ns_) sample.host_time_ns += kLateness;
  return sample;
}

ClockSample ClockSimulator::next() {
  if (!again_.empty()) {
    const ClockSample sample = again_.back();
    again_.pop_back();
    return sample;
  }
  bool twice = false;
  while (next_event_ < simulation_.events.size() &&
         from_seconds(simulation_.events[next_event_].time_s) <= since_start_ns_) {
    const ClockEvent& event = simulation_.events[next_event_++];
    switch (event.kind) {
      case ClockEvent::Kind::kDeviceReset:
        device_time_ns_ = event.amount_ns;
        break;
      case ClockEvent::Kind::kHostStep:
        host_shift_ns_ += event.amount_ns;
        break;
      case ClockEvent::Kind::kSilence:
        for (const TimeNs end = since_start_ns_ + event.amount_ns; since_start_ns_ < end;) advance();
        break;
      case ClockEvent::Kind::kDuplicate:
        twice = true;
        break;
      case ClockEvent::Kind::kLateness:
        late_until_ns_ = since_start_ns_ + event.amount_ns;
        break;
      case ClockEvent::Kind::kSpurious: {
        ClockSample extra = regular();
        extra.host_time_ns = simulation_.host_start_ns + host_shift_ns_ + from_seconds(event.time_s) + event.amount_ns;
        extra.spurious = true;
        return extra;
      }
    }
  }
  const ClockSample sample = regular();
  if (twice) again_.push_back(sample);
  advance();
  return sample;
}

std::vector<ClockSample> simulate_clock(const ClockSimulation& simulation, double duration_s, Random random) {
  require_positive("duration_s", duration_s);
  ClockSimulator simulator(simulation, random);
  const auto count = static_cast<std::size_t>(std::llround(duration_s * simulation.rate_hz));
  std::vector<ClockSample> samples;
  samples.reserve(count);
  while (samples.size() < count) samples.push_back(simulator.next());
  return samples;
}

SimulatedGpsTime simulate_gps_time(const GpsTimeSimulation& simulation, double duration_s, Random random) {
  Random label_random = random.fork(1);
  SimulatedGpsTime out;
  const TimeNs begin = simulation.pulses.device_start_ns;
  for (const ClockSample& pulse : simulate_clock(simulation.pulses, duration_s, random.fork(2))) {
    if (pulse.spurious) {
      out.events.push_back({GpsTimeEvent::Kind::kPulse, pulse.host_time_ns, kNoTime});
      continue;
    }
    const TimeNs gps = simulation.first_gps_time_ns + pulse.device_time_ns - begin;
    const TimeNs host = pulse.earliest_host_ns - simulation.pulses.delay.minimum_ns;
    out.gps_time_ns.push_back(gps);
    out.host_time_ns.push_back(host);
    if (simulation.with_pulses && label_random.uniform() >= simulation.pulse_loss) {
      out.events.push_back({GpsTimeEvent::Kind::kPulse, pulse.host_time_ns, kNoTime});
    }
    const double late = lateness(simulation.labels, to_seconds(gps - simulation.first_gps_time_ns), label_random);
    if (label_random.uniform() < simulation.label_loss) continue;
    const TimeNs label = simulation.label_next ? gps + 1'000'000'000 : gps;
    out.events.push_back({GpsTimeEvent::Kind::kLabel, host + simulation.labels.minimum_ns + std::llround(late), label});
  }
  return out;
}

}  // namespace loc
