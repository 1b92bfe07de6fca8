// The state of a connection to a sensor: told in the log and to the driver's status, counted; and when to try again.
#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "libloc/core/named_count.hpp"

namespace loc {

struct ReconnectionOptions {
  double reconnect_s = 1;         ///< between two attempts
  std::function<void()> on_idle;  ///< at least five times a second while it waits
  /// When something is wrong, what; an empty text when all is well again.
  std::function<void(const std::string&)> on_trouble;
};

class Reconnection {
 public:
  /// @param sensor "gps", "camera": in events (gps_connected) and counts (gps.connections)
  Reconnection(std::string sensor, ReconnectionOptions options);

  /// The connection stands; all is well when something has come through it. @param name of it
  void connected(const std::string& name);
  void lost(const std::string& name, const std::string& why);
  void failed(const std::string& why);
  /// Tells why, once until it changes; empty: all is well.
  void trouble(const std::string& why);
  /// Sleeps in small steps until the next attempt, calling on_idle. @return false when asked to stop.
  bool wait() const;
  void add_to(NamedCounts& counts) const;

  /// See MeasurementSource::stop().
  void stop() { stopped_ = true; }
  bool stopped() const { return stopped_; }

 private:
  std::string sensor_;
  ReconnectionOptions options_;
  std::atomic<bool> stopped_ = false;
  std::string trouble_;
  std::int64_t connections_ = 0;
  std::int64_t losses_ = 0;
  std::int64_t failures_ = 0;
};

}  // namespace loc
