// TCP connections.
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/poll.h>
#include <sys/socket.h>

#include <cerrno>
#include <charconv>
#include <memory>
#include <system_error>

#include "tools/support/gps_connection.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr TimeNs kConnectPatience = 5'000'000'000;
constexpr int kPollMs = 100;

void set(int socket, int level, int option, int value) {
  // Only comfort: a connection without it works, too.
  (void)::setsockopt(socket, level, option, &value, sizeof value);
}

/// @return 0 or the error
int connect_to(int socket, const addrinfo& address) {
  if (::connect(socket, address.ai_addr, address.ai_addrlen) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  const TimeNs give_up = steady_now() + kConnectPatience;
  pollfd event{socket, POLLOUT, 0};
  while (::poll(&event, 1, kPollMs) <= 0) {
    if (stop_requested()) return EINTR;
    if (steady_now() > give_up) return ETIMEDOUT;
  }
  int error = 0;
  socklen_t size = sizeof error;
  if (::getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size) != 0) return errno;
  return error;
}

FileDescriptor open_tcp(const HostAndPort& where, const std::string& name) {
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(where.host.c_str(), where.port.c_str(), &wanted, &found); error != 0) {
    throw GpsConnectionError(name + ": " + ::gai_strerror(error));
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> addresses(found, &::freeaddrinfo);
  int error = 0;
  for (const addrinfo* a = found; a != nullptr; a = a->ai_next) {
    FileDescriptor socket(::socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol));
    if (!socket) {
      error = errno;
      continue;
    }
    error = connect_to(socket.get(), *a);
    if (error != 0) continue;
    set(socket.get(), SOL_SOCKET, SO_KEEPALIVE, 1);
    set(socket.get(), IPPROTO_TCP, TCP_KEEPIDLE, 20);
    set(socket.get(), IPPROTO_TCP, TCP_KEEPINTVL, 10);
    set(socket.get(), IPPROTO_TCP, TCP_KEEPCNT, 3);
    return socket;
  }
  throw GpsConnectionError(name + ": cannot be connected: " + std::generic_category().message(error) +
                           ": does the receiver or its server send there?");
}

}  // namespace

HostAndPort parse_address(const std::string& address, const std::string& default_port) {
  HostAndPort out{.host = address, .port = default_port};
  if (address.starts_with('[')) {
    const auto close = address.find(']');
    out.host = address.substr(1, close == std::string::npos ? close : close - 1);
    const std::string rest = close == std::string::npos ? "]" : address.substr(close + 1);
    if (rest.starts_with(':')) {
      out.port = rest.substr(1);
    } else if (!rest.empty()) {
      out.host.clear();
    }
  } else if (const auto colon = address.find(':'); colon != std::string::npos) {
    out.host = address.substr(0, colon);
    out.port = address.substr(colon + 1);
  }
  int number = 0;
  const auto [end, error] = std::from_chars(out.port.data(), out.port.data() + out.port.size(), number);
  const bool port_ok = error == std::errc{} && end == out.port.data() + out.port.size() && number > 0 && number < 65536;
  if (out.host.empty() || !port_ok) {
    throw UsageError("'" + address + "' is not HOST:PORT" + (default_port.empty() ? "" : " or HOST"));
  }
  return out;
}

GpsConnection tcp_connection(const std::string& address) {
  const HostAndPort where = parse_address(address, "");
  return {.name = address, .hint = "does it send NMEA?", .open = [where, address] { return open_tcp(where, address); }};
}

}  // namespace loc
