// How the bytes of a receiver come in: a serial port or pty, or a TCP connection.
#pragma once

#include <functional>
#include <stdexcept>
#include <string>

#include "tools/support/file_descriptor.hpp"

namespace loc {

/// Why a connection could not be made, and what to do about it. It may succeed later.
class GpsConnectionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Something that can be opened and opened again.
struct GpsConnection {
  std::string name;                      ///< for log lines: "/dev/ttyUSB0", "192.168.1.4:5017"
  std::string hint;                      ///< what to look at when bytes come, but no sentence
  std::function<FileDescriptor()> open;  ///< non-blocking; @throws GpsConnectionError
};

/// @param device serial port or pty. Set to raw, 8N1, no handshake, read only; what waited in its buffer is thrown
/// away, because its arrival is not known. @param baud one of the rates that the system knows
/// @throws UsageError for another rate.
GpsConnection serial_connection(const std::string& device, int baud);

/// @param address HOST:PORT or [IPv6]:PORT. A peer that is gone without a word is noticed within a minute.
/// @throws UsageError when it is not of that form.
GpsConnection tcp_connection(const std::string& address);

/// Splits "host:port", "[::1]:port"; without port default_port, which is empty when there is none.
/// @throws UsageError
struct HostAndPort {
  std::string host;
  std::string port;
};
HostAndPort parse_address(const std::string& address, const std::string& default_port);

}  // namespace loc
