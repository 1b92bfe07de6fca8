// --time-base and what belongs to it: wires a source, a receiver's time events and LOC_CLOCK together (see
// restamp.hpp).
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "libloc/io/source.hpp"
#include "libloc/sensors/gps_time_event.hpp"
#include "tools/support/cli_forward.hpp"
#include "tools/support/clock_link.hpp"
#include "tools/support/restamp.hpp"

namespace loc {

class TimeBaseWiring {
 public:
  void add_options(CLI::App& app);

  /// Before a device is touched. @throws UsageError for an option that is wrong, or a base that this kind of source
  /// (see SourceSpec) cannot have.
  void check(const std::string& source_kind) const;
  /// The source in the time base that was asked for; as it is where there is nothing to do.
  /// @param source_kind a GPS receiver publishes LOC_CLOCK, in any base; an NMEA log is on GPS time as it is.
  /// @throws as check() and open_lcm.
  std::unique_ptr<MeasurementSource> wrap(std::unique_ptr<MeasurementSource> source, const std::string& lcm_url,
                                          const std::string& source_kind);
  /// For the receiver's handler of time events.
  void take(const GpsTimeEvent& event) {
    if (source_ != nullptr) source_->take(event);
  }

 private:
  RestampOptions restamp_options() const;

  std::string base_ = "device";
  std::string pulse_label_ = "previous";
  double wait_s_ = RestampOptions{}.wait_s;
  double label_delay_s_ = to_seconds(GpsClockOptions{}.label_delay_ns);
  double sigma_label_delay_s_ = to_seconds(GpsClockOptions{}.sigma_label_delay_ns);
  RestampedSource* source_ = nullptr;  // lives in the driver
  std::optional<ClockLink> link_;
};

}  // namespace loc
