// Serial ports.
#include <dirent.h>
#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <vector>

#include "tools/support/gps_connection.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr struct {
  int baud;
  speed_t speed;
} kSpeeds[] = {{1200, B1200},     {2400, B2400},     {4800, B4800},      {9600, B9600},     {19200, B19200},
               {38400, B38400},   {57600, B57600},   {115200, B115200},  {230400, B230400}, {460800, B460800},
               {500000, B500000}, {921600, B921600}, {1000000, B1000000}};

/// "/dev/ttyACM0 /dev/ttyUSB0", or "none"
std::string ports_here() {
  std::vector<std::string> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", error)) {
    const std::string name = entry.path().filename();
    if (name.starts_with("ttyUSB") || name.starts_with("ttyACM") || name.starts_with("ttyAMA")) {
      found.push_back(entry.path());
    }
  }
  std::sort(found.begin(), found.end());
  std::string out;
  for (const std::string& name : found) out += (out.empty() ? "" : " ") + name;
  return out.empty() ? "none" : out;
}

std::string advice(int number) {
  switch (number) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return ": is the receiver plugged in? Serial ports here: " + ports_here();
    case EACCES:
    case EPERM:
      return ": serial ports belong to the group dialout: sudo usermod -aG dialout $USER, then log in again";
    case EBUSY:
      return ": another program has opened it (gpsd? then read from it: loc-driver gpsd)";
    default:
      return "";
  }
}

[[noreturn]] void fail(const std::string& device, const std::string& what, int number) {
  throw GpsConnectionError(device + ": " + what + ": " + std::generic_category().message(number) + advice(number));
}

FileDescriptor open_port(const std::string& device, speed_t speed, int baud) {
  FileDescriptor port(::open(device.c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!port) fail(device, "cannot be opened", errno);
  struct stat status {};
  if (::fstat(port.get(), &status) == 0 && S_ISREG(status.st_mode)) {
    throw GpsConnectionError(device + ": is a file, not a serial port: read it with loc-driver nmea " + device);
  }
  if (::isatty(port.get()) == 0) {
    throw GpsConnectionError(device + ": is not a serial port. Serial ports here: " + ports_here());
  }
  termios settings{};
  if (::tcgetattr(port.get(), &settings) != 0) fail(device, "its settings cannot be read", errno);
  ::cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB);
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  if (::cfsetispeed(&settings, speed) != 0 || ::cfsetospeed(&settings, speed) != 0 ||
      ::tcsetattr(port.get(), TCSANOW, &settings) != 0) {
    fail(device, "cannot be set to " + std::to_string(baud) + " baud", errno);
  }
  // tcsetattr succeeds when it could do any of it.
  termios set{};
  if (::tcgetattr(port.get(), &set) != 0 || ::cfgetispeed(&set) != speed) {
    throw GpsConnectionError(device + ": does not take " + std::to_string(baud) + " baud");
  }
  // Two readers of one port would each get half of the bytes.
  ::ioctl(port.get(), TIOCEXCL);
  ::tcflush(port.get(), TCIFLUSH);
  return port;
}

}  // namespace

GpsConnection serial_connection(const std::string& device, int baud) {
  std::string known;
  for (const auto& s : kSpeeds) {
    if (s.baud == baud) {
      return {.name = device,
              .hint = "is --baud " + std::to_string(baud) +
                      " right (4800, 9600, 38400, 115200 are common), and does it send NMEA?",
              .open = [device, speed = s.speed, baud] { return open_port(device, speed, baud); }};
    }
    known += (known.empty() ? "" : ", ") + std::to_string(s.baud);
  }
  throw UsageError("--baud " + std::to_string(baud) + ": must be one of " + known);
}

}  // namespace loc
