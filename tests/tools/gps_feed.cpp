#include "gps_feed.hpp"

#include <fcntl.h>
#include <netinet/in.h>
#include <pty.h>
#include <sys/poll.h>
#include <sys/socket.h>
#include <termios.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "libloc/core/gps_time.hpp"
#include "support/nmea_text.hpp"

namespace loc::test {
namespace {

constexpr int kPatienceMs = 5000;

bool write_all(int fd, const std::string& bytes) {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    pollfd event{fd, POLLOUT, 0};
    if (::poll(&event, 1, kPatienceMs) <= 0) return false;
    // A peer that has gone must not end the test's program.
    ssize_t size = ::send(fd, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (size < 0 && errno == ENOTSOCK) size = ::write(fd, bytes.data() + sent, bytes.size() - sent);
    if (size < 0 && errno == EAGAIN) continue;
    if (size <= 0) return false;
    sent += static_cast<std::size_t>(size);
  }
  return true;
}

}  // namespace

std::string epoch(int i) {
  std::array<char, 160> rmc{};
  std::array<char, 160> gga{};
  const int second = i % 60;
  const int minute = i / 60 % 60;
  const double minutes = i * 0.001;
  std::snprintf(rmc.data(), rmc.size(), "GNRMC,12%02d%02d.00,A,45%07.4f,N,00730.0000,E,1.0,90.0,221126,,,A", minute,
                second, minutes);
  std::snprintf(gga.data(), gga.size(), "GNGGA,12%02d%02d.00,45%07.4f,N,00730.0000,E,1,09,0.9,300.0,M,48.0,M,,", minute,
                second, minutes);
  return sentence(rmc.data()) + sentence(gga.data());
}

double epoch_latitude(int i) {
  return (45 + i * 0.001 / 60) * std::numbers::pi / 180;
}

TimeNs epoch_gps_time_ns(int i) {
  return *gps_from_utc({{2026, 11, 22}, 12, i / 60 % 60, i % 60, 0});
}

SerialCable::SerialCable(std::string path) : path_(std::move(path)) {
  plug();
}

SerialCable::~SerialCable() {
  unplug();
}

bool SerialCable::available() {
  int master = -1;
  int slave = -1;
  if (::openpty(&master, &slave, nullptr, nullptr, nullptr) != 0) return false;
  ::close(master);
  ::close(slave);
  return true;
}

void SerialCable::plug() {
  int master = -1;
  int slave = -1;
  std::array<char, 128> name{};
  if (::openpty(&master, &slave, name.data(), nullptr, nullptr) != 0) throw std::runtime_error("openpty failed");
  master_ = FileDescriptor(master);
  ::fcntl(master, F_SETFL, O_NONBLOCK);
  // A program that inherits it would hold the cable in.
  ::fcntl(master, F_SETFD, FD_CLOEXEC);
  // Without echo from the beginning: nobody may read what was written to us.
  termios settings{};
  ::tcgetattr(slave, &settings);
  ::cfmakeraw(&settings);
  ::tcsetattr(slave, TCSANOW, &settings);
  ::close(slave);
  std::filesystem::create_symlink(name.data(), path_);
}

void SerialCable::unplug() {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
  master_.close();
}

bool SerialCable::send(const std::string& bytes) const {
  return write_all(master_.get(), bytes);
}

TcpServer::TcpServer(int port) : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const int yes = 1;
  ::setsockopt(listener_.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (::bind(listener_.get(), reinterpret_cast<sockaddr*>(&address), size) != 0 || ::listen(listener_.get(), 4) != 0 ||
      ::getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw std::runtime_error("no server");
  }
  port_ = ntohs(address.sin_port);
}

bool TcpServer::accept() {
  pollfd event{listener_.get(), POLLIN, 0};
  if (::poll(&event, 1, 10'000) <= 0) return false;
  client_ = FileDescriptor(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
  return static_cast<bool>(client_);
}

bool TcpServer::send(const std::string& bytes) const {
  return write_all(client_.get(), bytes);
}

std::string TcpServer::receive_until(const std::string& text) const {
  std::string received;
  std::array<char, 1024> buffer{};
  while (received.find(text) == std::string::npos) {
    pollfd event{client_.get(), POLLIN, 0};
    if (::poll(&event, 1, kPatienceMs) <= 0) break;
    const ssize_t size = ::recv(client_.get(), buffer.data(), buffer.size(), 0);
    if (size <= 0) break;
    received.append(buffer.data(), static_cast<std::size_t>(size));
  }
  return received;
}

void TcpServer::drop_client() {
  client_.close();
}

void TcpServer::close() {
  client_.close();
  listener_.close();
}

}  // namespace loc::test
