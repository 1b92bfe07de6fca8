// A receiver that is connected now: NMEA from a serial port or TCP, or what gpsd tells. When the connection is lost it
// is made anew, as often as it takes; what happened is told and counted. time_ns of a fix is its arrival (the first
// byte of its epoch) on the host's clock: late by what the receiver needs, 10 to 700 ms. The time of validity is
// gps_time_ns; whoever knows the relation of the clocks puts one for the other.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "libloc/io/nmea_fix.hpp"
#include "libloc/io/source.hpp"
#include "tools/support/gps_connection.hpp"
#include "tools/support/reconnection.hpp"

namespace loc {

struct LiveGpsOptions {
  /// reference_date is set to the host's date (or library_date(), if later) when it has none.
  NmeaFixOptions fix;
  double silence_s = 5;               ///< without a byte, or with bytes and no sentence, after which it is told
  double reconnect_s = 1;             ///< between two attempts
  GpsTimeEventHandler on_time_event;  ///< every label and pulse, from the thread that calls next()
  std::function<void()> on_idle;      ///< at least five times a second while next() waits
  /// When something is wrong, what; an empty text when all is well again.
  std::function<void(const std::string&)> on_trouble;

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// @return a source whose next() waits. @throws GpsConnectionError when the first connection fails.
std::unique_ptr<MeasurementSource> open_nmea_stream(GpsConnection connection, LiveGpsOptions options);

/// gpsd, through its own library: position, velocity, errors, its leap seconds, and both kinds of its time messages:
/// TOFF (a label) and PPS (a pulse that it has paired already).
/// @param address HOST, HOST:PORT, or empty for the local one. @throws GpsConnectionError; UsageError when the programs
/// were built without libgps.
std::unique_ptr<MeasurementSource> open_gpsd(const std::string& address, LiveGpsOptions options);

/// Whether there is a fix, as it is told in the log. Internal to the sources of this file.
class FixWatch {
 public:
  explicit FixWatch(const LiveGpsOptions& options) : options_(options) {}

  /// What has come: tells the first fix, and the first after there was none.
  void heard(const GpsMeasurement& fix);
  /// Called now and then: tells once when there has been no fix for silence_s.
  void look_for_fix();

 private:
  enum class FixState { kNothingYet, kFix, kNoFix };

  const LiveGpsOptions& options_;
  FixState fix_state_ = FixState::kNothingYet;
  TimeNs last_fix_ns_ = kNoTime;  // monotonic; at first the first look
};

/// The state of a receiver's connection. Internal to the sources of this file.
Reconnection gps_reconnection(const LiveGpsOptions& options);

}  // namespace loc
