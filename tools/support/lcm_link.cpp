#include "tools/support/lcm_link.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/poll.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <optional>
#include <system_error>
#include <utility>

#include "tools/support/file_descriptor.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"
#include "tools/support/tcpq_protocol.hpp"

namespace loc {
namespace {

constexpr TimeNs kRetryNs = 500'000'000;
constexpr int kConnectTimeoutMs = 1000;
constexpr int kSocketTimeoutS = 1;

struct Url {
  std::string provider;
  std::string network;  // between :// and ?
  std::string options;  // after ?
};

Url split_url(const std::string& text) {
  const auto colon = text.find("://");
  if (colon == std::string::npos) {
    throw UsageError("--lcm-url '" + text + "': must look like udpm://239.255.76.67:7667 or tcpq://127.0.0.1:7700");
  }
  Url url;
  url.provider = text.substr(0, colon);
  const std::string rest = text.substr(colon + 3);
  const auto question = rest.find('?');
  url.network = rest.substr(0, question);
  if (question != std::string::npos) url.options = rest.substr(question + 1);
  if (url.provider != "udpm" && url.provider != "tcpq" && url.provider != "memq") {
    throw UsageError("--lcm-url '" + text + "': transport '" + url.provider + "' is not udpm or tcpq");
  }
  return url;
}

sockaddr_in parse_endpoint(const std::string& text, const Url& url, const char* default_address,
                           std::uint16_t default_port) {
  const std::string network = url.network.empty() ? default_address : url.network;
  const auto colon = network.find(':');
  sockaddr_in out{};
  out.sin_family = AF_INET;
  if (::inet_pton(AF_INET, network.substr(0, colon).c_str(), &out.sin_addr) != 1) {
    throw UsageError("--lcm-url '" + text + "': '" + network.substr(0, colon) +
                     "' is not an IPv4 address (LCM resolves no host names)");
  }
  std::uint16_t port = default_port;
  if (colon != std::string::npos) {
    const char* begin = network.data() + colon + 1;
    const char* end = network.data() + network.size();
    const auto [stop, error] = std::from_chars(begin, end, port);
    if (error != std::errc{} || stop != end || port == 0) throw UsageError("--lcm-url '" + text + "': bad port");
  }
  out.sin_port = htons(port);
  return out;
}

// A signal ends no wait here: who asked to stop is heard after it, a second later at most.
bool wait_for(pollfd& event, int timeout_ms) {
  int ready = 0;
  do {
    ready = ::poll(&event, 1, timeout_ms);
  } while (ready < 0 && errno == EINTR);
  return ready == 1;
}

// liblcm connects without a time limit and takes any server for one of its own: look first.
std::optional<std::string> why_no_hub(const sockaddr_in& endpoint) {
  FileDescriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket) return std::generic_category().message(errno);
  pollfd event{socket.get(), POLLOUT, 0};
  if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&endpoint), sizeof endpoint) != 0) {
    if (errno != EINPROGRESS) return std::generic_category().message(errno);
    if (!wait_for(event, kConnectTimeoutMs)) return "no answer in time";
    int error = 0;
    socklen_t size = sizeof error;
    ::getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &error, &size);
    if (error != 0) return std::generic_category().message(error);
  }
  const std::vector<std::uint8_t> hello = tcpq_hello(kTcpqClientMagic);
  const std::vector<std::uint8_t> expected = tcpq_hello(kTcpqServerMagic);
  if (::send(socket.get(), hello.data(), hello.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(hello.size())) {
    return "it closed the connection";
  }
  std::vector<std::uint8_t> answer(expected.size());
  std::size_t got = 0;
  event.events = POLLIN;
  while (got < answer.size()) {
    if (!wait_for(event, kConnectTimeoutMs)) return "it does not greet as an LCM hub does";
    const ssize_t size = ::recv(socket.get(), answer.data() + got, answer.size() - got, 0);
    if (size <= 0) return "it closed the connection";
    got += static_cast<std::size_t>(size);
  }
  if (answer != expected) return "it does not greet as an LCM hub does";
  return std::nullopt;
}

// Small messages at once, and no wait without end on a hub that hangs.
void tune_tcp(int fd) {
  const int on = 1;
  (void)::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  const timeval limit{kSocketTimeoutS, 0};
  (void)::setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  (void)::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
}

// The kernel clamps the receive buffer without a word, and then loses images.
void warn_of_small_buffer(const std::string& options) {
  const auto at = options.find("recv_buf_size=");
  if (at == std::string::npos) return;
  const long wanted = std::atol(options.c_str() + at + std::string_view("recv_buf_size=").size());
  long limit = 0;
  if (std::ifstream("/proc/sys/net/core/rmem_max") >> limit && limit < wanted) {
    static bool warned = false;
    if (!std::exchange(warned, true)) {
      log_warning(
          "event=small_receive_buffer wanted={} limit={} effect=\"large images may be lost\" mend=\"sysctl -w "
          "net.core.rmem_max={}\"",
          wanted, limit, wanted);
    }
  }
}

}  // namespace

std::unique_ptr<lcm::LCM> open_lcm(const std::string& text) {
  const Url url = split_url(text);
  if (url.provider == "tcpq") {
    const sockaddr_in endpoint = parse_endpoint(text, url, "127.0.0.1", 7700);
    if (const auto reason = why_no_hub(endpoint)) {
      throw std::runtime_error("no hub at " + text + " (" + *reason + "): start loc-hub, or give its --lcm-url");
    }
  } else if (url.provider == "udpm") {
    parse_endpoint(text, url, "239.255.76.67", 7667);
    std::string reason;
    if (!multicast_works(text, &reason)) {
      throw std::runtime_error("multicast does not work here (" + reason +
                               "): as root, ip route add 224.0.0.0/4 dev lo; or use loc-hub and --lcm-url "
                               "tcpq://127.0.0.1:7700");
    }
    warn_of_small_buffer(url.options);
  }
  auto lcm = std::make_unique<lcm::LCM>(text);
  if (!lcm->good()) throw std::runtime_error("LCM does not open " + text + "; its own message stands above");
  // LCM aborts when it polls a connection that is not there.
  if (lcm->getFileno() < 0) throw std::runtime_error("LCM is not connected to " + text);
  if (url.provider == "tcpq") tune_tcp(lcm->getFileno());
  return lcm;
}

bool multicast_works(const std::string& text, std::string* reason) {
  const Url url = split_url(text);
  if (url.provider != "udpm") return true;
  const sockaddr_in endpoint = parse_endpoint(text, url, "239.255.76.67", 7667);
  // Connecting a datagram socket asks the kernel for a route and sends nothing.
  const FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ip_mreq membership{};
  membership.imr_multiaddr = endpoint.sin_addr;
  membership.imr_interface.s_addr = htonl(INADDR_ANY);
  if (!socket || ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&endpoint), sizeof endpoint) != 0 ||
      ::setsockopt(socket.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) {
    if (reason != nullptr) *reason = std::generic_category().message(errno);
    return false;
  }
  return true;
}

LcmPublisher::LcmPublisher(std::string url) : url_(std::move(url)), lcm_(open_lcm(url_)) {}

bool LcmPublisher::connected() {
  if (lcm_ != nullptr && lcm_->getFileno() >= 0) return true;
  const TimeNs now = steady_now();
  if (now < next_try_ns_) return false;
  next_try_ns_ = now + kRetryNs;
  try {
    lcm_.reset();
    lcm_ = open_lcm(url_);
    log_info("event=publisher_reconnected failed={}", failed_);
    return true;
  } catch (const std::runtime_error& error) {
    log_warning("event=publisher_not_connected reason=\"{}\"", error.what());
    return false;
  }
}

bool LcmPublisher::publish(const std::string& channel, std::span<const std::uint8_t> data) {
  if (connected() && lcm_->publish(channel, data.data(), static_cast<unsigned int>(data.size())) == 0 &&
      lcm_->getFileno() >= 0) {
    return true;
  }
  ++failed_;
  return false;
}

LcmReceiver::LcmReceiver(std::string url) : url_(std::move(url)), lcm_(open_lcm(url_)) {}

LcmReceiver::~LcmReceiver() = default;

void LcmReceiver::subscribe(const std::string& pattern, Handler handler) {
  subscriptions_.push_back(std::make_unique<Subscription>(Subscription{pattern, std::move(handler)}));
  attach(*subscriptions_.back());
}

void LcmReceiver::attach(Subscription& subscription) {
  using Function = void (*)(const lcm::ReceiveBuffer*, const std::string&, Subscription*);
  // Called through C code: nothing may be thrown here.
  const Function deliver = [](const lcm::ReceiveBuffer* buffer, const std::string& channel, Subscription* to) {
    to->handler(channel, {static_cast<const std::uint8_t*>(buffer->data), buffer->data_size});
  };
  lcm::Subscription* added = lcm_->subscribeFunction(subscription.pattern, deliver, &subscription);
  if (added == nullptr) throw UsageError("channel '" + subscription.pattern + "' is not a regular expression");
  // LCM would silently drop all but 30 messages that wait; bounding and counting is our queues' task.
  added->setQueueCapacity(0);
}

bool LcmReceiver::handle(int timeout_ms) {
  if (lcm_ == nullptr || lcm_->getFileno() < 0) {
    if (lcm_ != nullptr) {
      lcm_.reset();
      ++disconnects_;
      log_warning("event=receiver_disconnected url={}", url_);
    }
    try {
      auto fresh = open_lcm(url_);
      lcm_ = std::move(fresh);
      for (auto& subscription : subscriptions_) attach(*subscription);
      log_info("event=receiver_reconnected url={}", url_);
    } catch (const std::runtime_error&) {
      sleep_for(std::min<TimeNs>(kRetryNs, static_cast<TimeNs>(timeout_ms) * 1'000'000));
    }
    return false;
  }
  return lcm_->handleTimeout(timeout_ms) > 0;
}

}  // namespace loc
