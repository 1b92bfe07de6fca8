#include "tools/support/hub.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <re2/re2.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <deque>
#include <system_error>
#include <utility>

#include "libloc/core/check.hpp"
#include "tools/support/log.hpp"

namespace loc {
namespace {

constexpr std::size_t kReadBytes = 256 << 10;  // per turn, so that one busy client does not starve the others
constexpr std::size_t kMaxRemembered = 1024;   // channels whose match is remembered, per client
constexpr std::size_t kMaxVectors = 64;
constexpr std::int64_t kPatternMemory = 1 << 20;
constexpr int kMaxLogLinesPerSecond = 50;
constexpr std::chrono::milliseconds kAcceptPause{100};

// Lets a map of strings be searched for a view.
struct TextHash {
  using is_transparent = void;
  std::size_t operator()(std::string_view text) const { return std::hash<std::string_view>{}(text); }
};

[[noreturn]] void fail(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

void set_option(int fd, int level, int name) {
  const int on = 1;
  // Only makes it faster: a socket that does not take it still works.
  (void)::setsockopt(fd, level, name, &on, sizeof on);
}

void watch(int epoll, int operation, int fd, std::uint32_t events, std::uint64_t id) {
  epoll_event event{};
  event.events = events;
  event.data.u64 = id;
  if (::epoll_ctl(epoll, operation, fd, &event) != 0) fail("epoll_ctl");
}

}  // namespace

void HubOptions::check() const {
  in_addr address{};
  require(::inet_pton(AF_INET, bind_address.c_str(), &address) == 1,
          "bind_address = '" + bind_address + "': must be an IPv4 address such as 127.0.0.1");
  require(max_clients > 0, "max_clients", 0, "must be positive");
  require(max_subscriptions > 0, "max_subscriptions", 0, "must be positive");
  require(max_queue_bytes > 0, "max_queue_bytes", 0, "must be positive");
  require(limits.max_data_bytes > 0 && limits.max_data_bytes <= 0x7fffffff, "max_data_bytes",
          static_cast<double>(limits.max_data_bytes), "must be in [1, 2^31)");
  require(max_total_bytes >= limits.max_data_bytes, "max_total_bytes", static_cast<double>(max_total_bytes),
          "must hold at least one message");
  require(greeting_timeout.count() > 0, "greeting_timeout", static_cast<double>(greeting_timeout.count()),
          "must be positive");
}

struct Hub::Client {
  Client(std::uint64_t number, FileDescriptor fd, std::string address, const TcpqLimits& limits)
      : id(number), socket(std::move(fd)), peer(std::move(address)), parser(limits) {}

  struct Subscription {
    std::string pattern;
    std::unique_ptr<RE2> regex;  // none: everything
  };

  bool wants(std::string_view channel) {
    const auto known = matches.find(channel);
    if (known != matches.end()) return known->second;
    const bool match = std::any_of(subscriptions.begin(), subscriptions.end(), [&](const Subscription& s) {
      return s.regex == nullptr || RE2::FullMatch(re2::StringPiece(channel.data(), channel.size()), *s.regex);
    });
    if (matches.size() >= kMaxRemembered) matches.clear();
    matches.emplace(channel, match);
    return match;
  }

  std::uint64_t id;
  FileDescriptor socket;
  std::string peer;
  TcpqParser parser;
  Clock::time_point since = Clock::now();
  std::vector<Subscription> subscriptions;
  std::unordered_map<std::string, bool, TextHash, std::equal_to<>> matches;
  std::deque<Frame> queue;
  std::size_t front_sent = 0;    // bytes of the first frame that are on their way
  std::size_t queued_bytes = 0;  // still to be sent
  std::size_t held = 0;          // as last counted into total_held_
  std::int64_t dropped = 0;
  bool waits_to_write = false;
  bool pending = false;
  bool dead = false;
};

Hub::Hub(HubOptions options) : options_(std::move(options)), read_buffer_(kReadBytes) {
  options_.check();
  listener_ = FileDescriptor(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!listener_) fail("socket");
  set_option(listener_.get(), SOL_SOCKET, SO_REUSEADDR);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(options_.port);
  ::inet_pton(AF_INET, options_.bind_address.c_str(), &address.sin_addr);
  socklen_t size = sizeof address;
  if (::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
      ::listen(listener_.get(), 128) != 0 ||
      ::getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    fail("cannot listen at " + options_.bind_address + ":" + std::to_string(options_.port));
  }
  port_ = ntohs(address.sin_port);
  epoll_ = FileDescriptor(::epoll_create1(EPOLL_CLOEXEC));
  if (!epoll_) fail("epoll_create1");
  watch(epoll_.get(), EPOLL_CTL_ADD, listener_.get(), EPOLLIN, 0);
}

Hub::~Hub() = default;

void Hub::run_once(std::chrono::milliseconds timeout) {
  std::array<epoll_event, 64> events{};
  const int count = ::epoll_wait(epoll_.get(), events.data(), events.size(), static_cast<int>(timeout.count()));
  if (count < 0 && errno != EINTR) fail("epoll_wait");
  for (int i = 0; i < count; ++i) {
    const epoll_event& event = events[static_cast<std::size_t>(i)];
    if (event.data.u64 == 0) {
      accept_clients();
      continue;
    }
    const auto found = clients_.find(event.data.u64);
    if (found == clients_.end() || found->second->dead) continue;
    Client& client = *found->second;
    if ((event.events & EPOLLOUT) != 0) flush(client);
    if (!client.dead && (event.events & (EPOLLIN | EPOLLHUP | EPOLLERR)) != 0) read_from(client);
    flush_pending();
    bound_total();
  }
  close_late_greeters();
  if (!accepting_ && Clock::now() >= accept_again_) {
    watch(epoll_.get(), EPOLL_CTL_ADD, listener_.get(), EPOLLIN, 0);
    accepting_ = true;
  }
  bury();
}

void Hub::accept_clients() {
  for (;;) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    FileDescriptor socket(
        ::accept4(listener_.get(), reinterpret_cast<sockaddr*>(&address), &size, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket) {
      if (errno == EAGAIN || errno == EWOULDBLOCK) return;
      if (errno == EINTR || errno == ECONNABORTED) continue;
      // Out of descriptors or memory: the connection stays in the backlog and would wake us at once again.
      log_error("event=accept_failed reason=\"{}\"", std::generic_category().message(errno));
      watch(epoll_.get(), EPOLL_CTL_DEL, listener_.get(), 0, 0);
      accepting_ = false;
      accept_again_ = Clock::now() + kAcceptPause;
      return;
    }
    std::array<char, INET_ADDRSTRLEN> text{};
    ::inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size());
    std::string peer = std::string(text.data()) + ":" + std::to_string(ntohs(address.sin_port));
    if (clients_.size() - dead_.size() >= options_.max_clients) {
      ++counts_.refused;
      if (may_log()) {
        log_warning("event=client_refused peer={} reason=\"{} clients are the limit\"", peer, options_.max_clients);
      }
      continue;
    }
    set_option(socket.get(), IPPROTO_TCP, TCP_NODELAY);
    set_option(socket.get(), IPPROTO_TCP, TCP_QUICKACK);
    const std::uint64_t id = next_id_++;
    auto client = std::make_unique<Client>(id, std::move(socket), std::move(peer), options_.limits);
    watch(epoll_.get(), EPOLL_CTL_ADD, client->socket.get(), EPOLLIN, id);
    if (may_log()) log_debug("event=client_connected client={} peer={}", id, client->peer);
    clients_.emplace(id, std::move(client));
    ++counts_.accepted;
  }
}

void Hub::read_from(Client& client) {
  const ssize_t size = ::recv(client.socket.get(), read_buffer_.data(), read_buffer_.size(), 0);
  if (size < 0) {
    if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return;
    condemn(client, std::generic_category().message(errno), nullptr);
    return;
  }
  if (size == 0) {
    condemn(client, "closed by the client", nullptr);
    return;
  }
  // liblcm sends a message in five pieces with Nagle's algorithm on: without immediate acknowledgement each message
  // waits for the delayed one, 40 ms. The kernel forgets the option, so it is set each time.
  set_option(client.socket.get(), IPPROTO_TCP, TCP_QUICKACK);
  client.parser.feed(std::span(read_buffer_).first(static_cast<std::size_t>(size)));
  try {
    while (!client.dead) {
      const auto frame = client.parser.next();
      if (!frame) break;
      handle_frame(client, *frame);
    }
  } catch (const DataError& error) {
    condemn(client, std::string("malformed: ") + error.what(), &counts_.malformed);
  }
  hold(client);
}

void Hub::handle_frame(Client& client, const TcpqFrame& frame) {
  switch (frame.kind) {
    case TcpqFrame::Kind::kHello:
      enqueue(client, std::make_shared<const std::vector<std::uint8_t>>(tcpq_hello(kTcpqServerMagic)));
      break;
    case TcpqFrame::Kind::kPublish:
      ++counts_.messages;
      counts_.bytes += static_cast<std::int64_t>(frame.bytes.size());
      route(frame.channel, frame.bytes);
      break;
    case TcpqFrame::Kind::kSubscribe:
      subscribe(client, frame.channel);
      break;
    case TcpqFrame::Kind::kUnsubscribe: {
      const auto found = std::find_if(client.subscriptions.begin(), client.subscriptions.end(),
                                      [&](const auto& s) { return s.pattern == frame.channel; });
      if (found != client.subscriptions.end()) client.subscriptions.erase(found);
      client.matches.clear();
      break;
    }
  }
}

void Hub::subscribe(Client& client, std::string_view pattern) {
  if (client.subscriptions.size() >= options_.max_subscriptions) {
    throw DataError("more than " + std::to_string(options_.max_subscriptions) + " subscriptions");
  }
  RE2::Options regex_options(RE2::Quiet);
  regex_options.set_max_mem(kPatternMemory);
  auto regex = std::make_unique<RE2>(re2::StringPiece(pattern.data(), pattern.size()), regex_options);
  if (!regex->ok()) {
    const bool only_unknown_to_re2 =
        regex->error_code() == RE2::ErrorBadPerlOp || regex->error_code() == RE2::ErrorBadEscape;
    if (!only_unknown_to_re2) throw DataError("subscription '" + std::string(pattern) + "': " + regex->error());
    if (may_log()) {
      log_warning(R"(event=pattern_taken_as_all client={} pattern="{}" reason="{}")", client.id, pattern,
                  regex->error());
    }
    regex.reset();
  }
  client.subscriptions.push_back({std::string(pattern), std::move(regex)});
  client.matches.clear();
}

void Hub::publish(std::string_view channel, std::span<const std::uint8_t> data) {
  route(channel, tcpq_publish_frame(channel, data));
  flush_pending();
  bound_total();
  bury();
}

void Hub::route(std::string_view channel, std::span<const std::uint8_t> frame_bytes) {
  Frame shared;
  for (auto& [id, client] : clients_) {
    if (client->dead || !client->wants(channel)) continue;
    if (!shared) shared = std::make_shared<const std::vector<std::uint8_t>>(frame_bytes.begin(), frame_bytes.end());
    enqueue(*client, shared);
  }
}

void Hub::enqueue(Client& client, const Frame& frame) {
  const auto full = [&] {
    return client.queued_bytes > 0 && client.queued_bytes + frame->size() > options_.max_queue_bytes;
  };
  if (full()) flush(client);
  if (client.dead) return;
  if (full()) {
    ++counts_.dropped;
    if (client.dropped++ == 0) {
      log_warning("event=slow_client client={} peer={} queued_bytes={} action=\"new messages for it are dropped\"",
                  client.id, client.peer, client.queued_bytes);
    }
    return;
  }
  ++counts_.delivered;
  client.queue.push_back(frame);
  client.queued_bytes += frame->size();
  hold(client);
  if (!client.pending) {
    client.pending = true;
    pending_.push_back(client.id);
  }
}

void Hub::flush_pending() {
  // flush() adds nothing to pending_.
  for (const std::uint64_t id : pending_) {
    const auto found = clients_.find(id);
    if (found == clients_.end()) continue;
    found->second->pending = false;
    if (!found->second->dead) flush(*found->second);
  }
  pending_.clear();
}

void Hub::flush(Client& client) {
  bool blocked = false;
  while (!client.queue.empty() && !blocked) {
    std::array<iovec, kMaxVectors> parts{};
    std::size_t count = 0;
    for (const Frame& frame : client.queue) {
      if (count == parts.size()) break;
      const std::size_t skip = count == 0 ? client.front_sent : 0;
      // sendmsg() does not write through it.
      parts[count++] = {const_cast<std::uint8_t*>(frame->data() + skip), frame->size() - skip};
    }
    msghdr message{};
    message.msg_iov = parts.data();
    message.msg_iovlen = count;
    const ssize_t sent = ::sendmsg(client.socket.get(), &message, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0) {
      if (errno == EINTR) continue;
      if (errno != EAGAIN && errno != EWOULDBLOCK) {
        condemn(client, std::generic_category().message(errno), nullptr);
        return;
      }
      blocked = true;
      break;
    }
    client.queued_bytes -= static_cast<std::size_t>(sent);
    auto rest = static_cast<std::size_t>(sent);
    while (rest > 0) {
      const std::size_t left = client.queue.front()->size() - client.front_sent;
      if (rest < left) {
        client.front_sent += rest;
        break;
      }
      rest -= left;
      client.front_sent = 0;
      client.queue.pop_front();
    }
  }
  if (blocked != client.waits_to_write) {
    client.waits_to_write = blocked;
    const std::uint32_t events = blocked ? EPOLLIN | EPOLLOUT : EPOLLIN;
    watch(epoll_.get(), EPOLL_CTL_MOD, client.socket.get(), events, client.id);
  }
  hold(client);
}

void Hub::hold(Client& client) {
  const std::size_t now = client.dead ? 0 : client.queued_bytes + client.parser.held();
  total_held_ += now - client.held;
  client.held = now;
}

void Hub::bound_total() {
  while (total_held_ > options_.max_total_bytes) {
    const auto largest = std::max_element(clients_.begin(), clients_.end(),
                                          [](const auto& a, const auto& b) { return a.second->held < b.second->held; });
    condemn(*largest->second, "all clients together hold too much, and this one the most", &counts_.overfull);
  }
}

void Hub::close_late_greeters() {
  const auto limit = Clock::now() - options_.greeting_timeout;
  for (auto& [id, client] : clients_) {
    if (!client->dead && !client->parser.greeted() && client->since < limit) {
      condemn(*client, "no greeting in time", &counts_.malformed);
    }
  }
}

void Hub::condemn(Client& client, const std::string& reason, std::int64_t* counter) {
  if (client.dead) return;
  client.dead = true;
  hold(client);
  dead_.push_back(client.id);
  if (counter != nullptr) ++*counter;
  if (!may_log()) return;
  const auto level = counter != nullptr || client.dropped > 0 ? LogLevel::kWarning : LogLevel::kDebug;
  log_at(level, "event=client_closed client={} peer={} dropped={} reason=\"{}\"", client.id, client.peer,
         client.dropped, reason);
}

void Hub::bury() {
  for (const std::uint64_t id : dead_) clients_.erase(id);
  dead_.clear();
}

// A client that connects and misbehaves in a loop must not fill the disk with log lines.
bool Hub::may_log() {
  const auto now = Clock::now();
  if (now - log_second_ > std::chrono::seconds(1)) {
    if (logged_in_second_ > kMaxLogLinesPerSecond) {
      log_warning("event=log_lines_left_out count={}", logged_in_second_ - kMaxLogLinesPerSecond);
    }
    log_second_ = now;
    logged_in_second_ = 0;
  }
  return ++logged_in_second_ <= kMaxLogLinesPerSecond;
}

NamedCounts Hub::statistics() const {
  NamedCounts out = {
      {"clients", static_cast<std::int64_t>(clients_.size())},
      {"accepted", counts_.accepted},
      {"refused", counts_.refused},
      {"closed.malformed", counts_.malformed},
      {"closed.overfull", counts_.overfull},
      {"messages", counts_.messages},
      {"messages.bytes", counts_.bytes},
      {"delivered", counts_.delivered},
      {"dropped", counts_.dropped},
      {"held.bytes", static_cast<std::int64_t>(total_held_)},
  };
  for (const auto& [id, client] : clients_) {
    if (client->dropped > 0) out.push_back({"client." + std::to_string(id) + ".dropped", client->dropped});
  }
  return out;
}

}  // namespace loc
