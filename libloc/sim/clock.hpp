// Simulated clocks: an oscillator whose frequency wanders, read by a host that hears of it late. It makes what the
// models of sensors/clock are given (device time, arrival) together with the truth that they are asked for.
//   true time of the next sample = true time + period * (1 + frequency error)
//   frequency error = constant + sine + random walk
//   arrival = true time + minimum delay + slow wobble + exponential + now and then a uniform one on top
// Source of the three presets: the figures by which the clock models are compared, see tests/bench/compare_clock.cpp.
#pragma once

#include <cstdint>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/core/time.hpp"
#include "libloc/sensors/gps_time_event.hpp"

namespace loc {

struct OscillatorModel {
  double constant_ppm = 50;
  double wave_ppm = 0.5;  ///< amplitude of the sine
  double wave_period_s = 1200;
  double skew_walk = 2e-9;  ///< random walk of the relative frequency [1/sqrt(s)]
};

struct DelayModel {
  TimeNs minimum_ns = 500'000;
  TimeNs exponential_ns = 1'000'000;  ///< mean
  double outlier_fraction = 0.01;
  TimeNs outlier_max_ns = 20'000'000;  ///< outliers: uniform in [0, this] on top
  TimeNs wobble_ns = 0;                ///< amplitude of a slow sine of the delay, which no method can see
  double wobble_period_s = 1800;
};

/// What happens to a clock in the field. The time is true time since the start.
struct ClockEvent {
  enum class Kind : std::uint8_t {
    kDeviceReset,  ///< the device counts from amount_ns again
    kHostStep,     ///< the host's clock is set by amount_ns
    kSilence,      ///< no samples for amount_ns
    kSpurious,     ///< one sample more, whose arrival is amount_ns after the event
    kDuplicate,    ///< the next sample comes twice
    kLateness      ///< for amount_ns every sample comes 0.5 s late
  };
  Kind kind = Kind::kDeviceReset;
  double time_s = 0;
  TimeNs amount_ns = 0;
};

struct ClockSimulation {
  double rate_hz = 200;
  OscillatorModel oscillator;
  DelayModel delay;
  TimeNs device_start_ns = 0;
  TimeNs host_start_ns = 1'000'000'000'000;
  std::vector<ClockEvent> events;  ///< in order of time

  static ClockSimulation usb_imu();    ///< 200 Hz over USB
  static ClockSimulation pps();        ///< pulse per second, stamped by the kernel; the device's clock is GPS
  static ClockSimulation nmea_only();  ///< sentences at 1 Hz, no pulse
  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct ClockSample {
  TimeNs device_time_ns = 0;
  TimeNs host_time_ns = 0;      ///< arrival
  TimeNs earliest_host_ns = 0;  ///< truth: true time on the host's clock + minimum delay
  bool spurious = false;        ///< a sample without truth
};

/// Gives one sample after the other, for as long as one asks.
class ClockSimulator {
 public:
  /// @throws as ClockSimulation::check
  ClockSimulator(ClockSimulation simulation, Random random);
  ClockSample next();

 private:
  ClockSample regular();
  void advance();

  ClockSimulation simulation_;
  Random random_;
  TimeNs period_ns_ = 0;
  TimeNs device_time_ns_ = 0;
  TimeNs since_start_ns_ = 0;  // true time
  double since_start_rest_ns_ = 0;
  double walk_ = 0;
  double walk_step_ = 0;
  TimeNs host_shift_ns_ = 0;
  TimeNs late_until_ns_ = 0;
  std::size_t next_event_ = 0;
  std::vector<ClockSample> again_;
};

/// The samples of so long. @throws std::invalid_argument when the duration is not positive.
std::vector<ClockSample> simulate_clock(const ClockSimulation& simulation, double duration_s, Random random);

/// A receiver: pulses and labels on one host clock.
struct GpsTimeSimulation {
  ClockSimulation pulses = ClockSimulation::pps();
  DelayModel labels = ClockSimulation::nmea_only().delay;  ///< after the pulse
  bool with_pulses = true;
  bool label_next = false;  ///< the label names the pulse that follows it
  double pulse_loss = 0;    ///< share of pulses that are missing
  double label_loss = 0;
  TimeNs first_gps_time_ns = 1'400'000'000'000'000'000;  ///< of the first pulse, a whole second
};

struct SimulatedGpsTime {
  std::vector<GpsTimeEvent> events;  ///< in the order of their arrival
  /// Truth, second by second: GPS time, and the host's clock at that moment.
  std::vector<TimeNs> gps_time_ns;
  std::vector<TimeNs> host_time_ns;
};

/// @throws std::invalid_argument as ClockSimulation::check.
SimulatedGpsTime simulate_gps_time(const GpsTimeSimulation& simulation, double duration_s, Random random);

}  // namespace loc
