// A server for LCM's tcpq:// transport: hands every message on to the clients that subscribed to its channel.
// One thread, never blocks on a client. What a slow or malicious client can do is bounded:
//  - each client has a queue of max_queue_bytes; when it is full, new messages for that client are dropped whole, and
//    counted. Others do not notice.
//  - malformed frames, no greeting in time, too many subscriptions: that client is closed, with the reason in the log.
//  - all clients together hold at most max_total_bytes; past it, the one that holds the most is closed.
//  - subscriptions run in RE2, whose time is linear and whose memory is bounded. A pattern with features that RE2 lacks
//    (look-around) is taken as ".*": clients filter what they get once more themselves.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "libloc/core/named_count.hpp"
#include "tools/support/file_descriptor.hpp"
#include "tools/support/tcpq_protocol.hpp"

namespace loc {

struct HubOptions {
  std::string bind_address = "127.0.0.1";  ///< IPv4; 0.0.0.0 serves other hosts too: LCM has no access control
  std::uint16_t port = 7700;               ///< 0: any free one
  std::size_t max_clients = 256;
  std::size_t max_subscriptions = 256;       ///< per client
  std::size_t max_queue_bytes = 32 << 20;    ///< per client
  std::size_t max_total_bytes = 1024 << 20;  ///< queues and unfinished frames of all clients
  std::chrono::milliseconds greeting_timeout{5000};
  TcpqLimits limits{};

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct HubCounts {
  std::int64_t accepted = 0;
  std::int64_t refused = 0;    ///< past max_clients
  std::int64_t malformed = 0;  ///< clients closed for what they sent or did not send
  std::int64_t overfull = 0;   ///< clients closed because all together held too much
  std::int64_t messages = 0;   ///< received
  std::int64_t bytes = 0;      ///< of these
  std::int64_t delivered = 0;  ///< put into the queue of a subscriber
  std::int64_t dropped = 0;    ///< not put there, because it was full
};

class Hub {
 public:
  /// Listens from here on. @throws std::invalid_argument for the options, std::system_error when it cannot listen.
  explicit Hub(HubOptions options);
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;
  ~Hub();

  std::uint16_t port() const { return port_; }
  /// Serves what is ready; waits at most that long for something.
  void run_once(std::chrono::milliseconds timeout);
  /// A message of the hub itself.
  void publish(std::string_view channel, std::span<const std::uint8_t> data);

  const HubCounts& counts() const { return counts_; }
  std::size_t clients() const { return clients_.size(); }
  /// For statistics: the counts, bytes that wait, and what was dropped for each client that is still there.
  NamedCounts statistics() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Client;
  using Frame = std::shared_ptr<const std::vector<std::uint8_t>>;

  void accept_clients();
  void read_from(Client& client);
  void handle_frame(Client& client, const TcpqFrame& frame);
  void subscribe(Client& client, std::string_view pattern);
  void route(std::string_view channel, std::span<const std::uint8_t> frame_bytes);
  void enqueue(Client& client, const Frame& frame);
  void flush(Client& client);
  void flush_pending();
  void hold(Client& client);
  void bound_total();
  void close_late_greeters();
  void condemn(Client& client, const std::string& reason, std::int64_t* counter);
  void bury();
  bool may_log();

  HubOptions options_;
  FileDescriptor listener_;
  FileDescriptor epoll_;
  std::uint16_t port_ = 0;
  std::unordered_map<std::uint64_t, std::unique_ptr<Client>> clients_;
  std::vector<std::uint64_t> pending_;  // clients with something new to send
  std::vector<std::uint64_t> dead_;
  std::vector<std::uint8_t> read_buffer_;
  std::uint64_t next_id_ = 1;  // 0 is the listener
  std::size_t total_held_ = 0;
  HubCounts counts_;
  Clock::time_point accept_again_{};
  bool accepting_ = true;
  Clock::time_point log_second_{};
  int logged_in_second_ = 0;
};

}  // namespace loc
