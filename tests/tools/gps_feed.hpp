// Receivers for tests: sentences with known values, a serial cable (pty) that can be unplugged, and a TCP server.
#pragma once

#include <cstdint>
#include <string>

#include "libloc/core/gps_time.hpp"
#include "tools/support/file_descriptor.hpp"

namespace loc::test {

/// RMC and GGA of second i after 12:00:00 on 2026-11-22: latitude 45 deg + i * 0.001 min.
std::string epoch(int i);
/// Latitude [rad] of that epoch, and its GPS time.
double epoch_latitude(int i);
TimeNs epoch_gps_time_ns(int i);

/// A pty whose receiving end is reached by a path of the test's choice.
class SerialCable {
 public:
  /// @param path of the symbolic link to the port
  explicit SerialCable(std::string path);
  /// Whether this machine gives out pseudo-terminals: a bare chroot has no /dev/pts.
  static bool available();
  SerialCable(const SerialCable&) = delete;
  SerialCable& operator=(const SerialCable&) = delete;
  ~SerialCable();
  void plug();
  void unplug();
  /// Writes all of it; waits for the reader. @return false when nobody reads for 5 s.
  bool send(const std::string& bytes) const;

 private:
  std::string path_;
  FileDescriptor master_;
};

/// Listens on a port of 127.0.0.1 and serves one client at a time.
class TcpServer {
 public:
  /// @param port 0: any
  explicit TcpServer(int port = 0);
  int port() const { return port_; }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  /// Waits for a client. @return false when none comes in 10 s.
  bool accept();
  bool send(const std::string& bytes) const;
  /// What the client has sent until it contains text, or 5 s are over.
  std::string receive_until(const std::string& text) const;
  void drop_client();
  void close();

 private:
  FileDescriptor listener_;
  FileDescriptor client_;
  int port_ = 0;
};

}  // namespace loc::test
