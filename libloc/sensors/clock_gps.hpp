// Host clock -> GPS time, from pulses and labels (sensors/gps_time_event.hpp). A pulse says exactly when a second
// begins, a label says which second it is: the integer second is the one that most labels agree on, against the line
// through the pulses. Without pulses the labels alone give the time, late by what the receiver and the line take: 10 to
// 700 ms that nothing here can observe: by default 350 ms are taken off, and sigma is 200 ms.
//
// Wrong pulses (not at a whole second from the others, within the gate) and wrong labels (midnight, leap seconds that
// the receiver learns late, week rollover) are rejected while they are few. When labels go on to disagree, nothing is
// answered until it is clear which of them to follow: see GpsClockCounts.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "libloc/sensors/clock.hpp"
#include "libloc/sensors/gps_time_event.hpp"

namespace loc {

/// Which pulse a label names: the one before it, as NMEA does, or the one after it, as u-blox TIM-TP does.
enum class PulseLabel : std::uint8_t { kPrevious, kNext };

struct GpsClockOptions {
  PulseLabel label = PulseLabel::kPrevious;
  TimeNs pulse_gate_ns = 100'000'000;  ///< A pulse farther from a whole second than this is none.
  TimeNs pulse_delay_ns = 0;           ///< Delay from the edge to its stamp, at best;
  TimeNs sigma_pulse_delay_ns = 2000;  ///< how well that is known: nothing here can observe it. Interrupts take 2 us.
  /// Labels that come this long after their pulse, or up to 0.4 s earlier or 0.5 s later, are paired rightly. Where
  /// they come is seen only within a second: 0.95 s late looks as 0.05 s early. While their mean and spread leave open
  /// which pulse they belong to, labels alone give the time (GpsClockCounts::labels_ambiguous).
  TimeNs pairing_delay_ns = 400'000'000;
  /// Without pulses: how late labels are at best, and how well that is known. Receivers have 10 to 700 ms, each its
  /// own: the middle of that, and the deviation of a uniform distribution.
  TimeNs label_delay_ns = 350'000'000;
  TimeNs sigma_label_delay_ns = 200'000'000;
  double max_pulse_extrapolation_s = 600;  ///< So long after the last pulse it still answers, sigma growing.
  double max_label_extrapolation_s = 60;   ///< Likewise after the last label, without pulses.

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct GpsClockCounts {
  std::int64_t pulses = 0;  ///< offered
  std::int64_t pulses_used = 0;
  std::int64_t pulses_missing = 0;      ///< seconds without a pulse between two that were used
  std::int64_t pulses_spurious = 0;     ///< rejected: not at a whole second, or a second one in the same
  std::int64_t pulse_locks = 0;         ///< times that a train of pulses was found: 1, more after host steps
  std::int64_t labels = 0;              ///< offered
  std::int64_t labels_disagreeing = 0;  ///< named another second than the one in use
  std::int64_t labels_ambiguous = 0;    ///< came while it was not clear which pulse labels belong to
  std::int64_t label_jumps = 0;     ///< the labels' second changed for good and was followed (leap second, wrong date)
  std::int64_t week_rollovers = 0;  ///< labels that were a multiple of 1024 weeks off, and were mended
  std::int64_t invalid = 0;         ///< without a time
};

enum class GpsClockBasis : std::uint8_t {
  kNone,    ///< no answer yet, or none any more
  kLabels,  ///< labels only: tenths of a second, unless their delay is known
  kPulses   ///< pulses and labels: microseconds
};
/// "none", "labels", "pulses"
const char* basis_name(GpsClockBasis basis);

class GpsClock {
 public:
  /// @throws std::invalid_argument as GpsClockOptions::check.
  explicit GpsClock(const GpsClockOptions& options = {});

  /// Events in the order of their arrival. What cannot be used is counted.
  void update(const GpsTimeEvent& event);

  /// GPS time (without leap seconds) of a host time; nullopt when it is not known. Never steps back for increasing host
  /// times unless epoch() has changed: then what was said before was wrong, or the host's clock was set. (When pulses
  /// take the place of labels, time slows down for as long as labels were ahead; sigma says so.)
  std::optional<ClockStamp> convert(TimeNs host_time_ns);
  /// As convert(), without the promise that times increase, and without changing anything.
  std::optional<ClockStamp> convert_once(TimeNs host_time_ns) const;
  /// Host -> GPS as it is known now. nullopt as GpsClockBasis::kNone.
  std::optional<ClockLine> line() const;
  GpsClockBasis basis() const;
  std::int64_t epoch() const { return epoch_; }
  const GpsClockCounts& counts() const { return counts_; }
  const ClockModel& pulse_model() const { return pulse_model_; }  ///< GPS seconds from the first pulse -> host
  const ClockModel& label_model() const { return label_model_; }  ///< labels -> their arrival
  const GpsClockOptions& options() const { return options_; }

 private:
  static constexpr std::size_t kCandidates = 8;
  static constexpr std::size_t kVotes = 15;
  static constexpr std::size_t kPhases = 60;

  std::optional<std::int64_t> take_pulse(TimeNs host_ns);
  std::optional<std::int64_t> look_for_train(TimeNs host_ns);
  void take_label(TimeNs gps_ns, TimeNs host_ns);
  TimeNs mend_rollover(TimeNs gps_ns, TimeNs host_ns);
  void vote(std::int64_t second);
  void judge_pairing(TimeNs off_ns);
  void forget_pairing();
  void count_epochs();
  bool pulses_answer() const;

  GpsClockOptions options_;
  ClockModel pulse_model_;
  ClockModel label_model_;
  // Pulses that belong to no train (yet).
  std::array<TimeNs, kCandidates> candidates_{};
  std::size_t candidate_count_ = 0;
  bool locked_ = false;
  std::int64_t last_pulse_ = 0;  // index; pulse 0 is the first of the train
  std::int64_t rejected_in_a_row_ = 0;
  // GPS second of pulse 0: what the latest labels said, and what is used.
  std::array<std::int64_t, kVotes> votes_{};
  std::size_t vote_count_ = 0;  // also of those that have been overwritten
  std::optional<std::int64_t> second_;
  // How much later than expected the last labels came, modulo 1 s [s], and whether that says which pulse is theirs.
  std::array<double, kPhases> phases_{};
  std::size_t phase_count_ = 0;  // also of those that have been overwritten
  bool paired_ = false;
  bool labelled_ = false;  // pulses bring their labels with them
  int disagreeing_in_a_row_ = 0;
  std::int64_t epoch_ = 0;
  std::int64_t pulse_epoch_ = 0;  // of the models, as counted in epoch_
  std::int64_t label_epoch_ = 0;
  MonotoneTime monotone_;
  std::int64_t monotone_epoch_ = 0;
  GpsClockCounts counts_;
};

/// Device -> host -> GPS: both models as one.
class ClockChain {
 public:
  /// @throws std::invalid_argument as the options' check().
  explicit ClockChain(const ClockModelOptions& device = {}, const GpsClockOptions& gps = {});

  bool update(TimeNs device_time_ns, TimeNs host_time_ns) { return device_.update(device_time_ns, host_time_ns); }
  void update(const GpsTimeEvent& event) { gps_.update(event); }
  /// GPS time of a device time, sigma of both steps; nullopt as long as one of them has no answer. Never steps back for
  /// increasing device times unless gps().epoch() has changed.
  std::optional<ClockStamp> convert(TimeNs device_time_ns);
  const ClockModel& device() const { return device_; }
  const GpsClock& gps() const { return gps_; }

 private:
  ClockModel device_;
  GpsClock gps_;
  MonotoneTime monotone_;
  std::int64_t device_epoch_ = 0;
  std::int64_t gps_epoch_ = 0;
};

}  // namespace loc
