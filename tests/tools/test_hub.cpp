// The hub in this process, with clients that are LCM's own, raw sockets, or hostile.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <spdlog/spdlog.h>
#include <sys/poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <thread>

#include "libloc/core/random.hpp"
#include "tools/support/hub.hpp"

namespace loc {
namespace {

using Bytes = std::vector<std::uint8_t>;
using std::chrono::milliseconds;

/// A hub in a thread of its own; counts() stops it.
class RunningHub {
 public:
  explicit RunningHub(HubOptions options = {}) : hub_(on_free_port(std::move(options))) {
    spdlog::set_level(spdlog::level::off);
    thread_ = std::thread([this] {
      while (!stop_) hub_.run_once(milliseconds(2));
    });
  }
  RunningHub(const RunningHub&) = delete;
  RunningHub& operator=(const RunningHub&) = delete;
  ~RunningHub() { stop(); }

  std::uint16_t port() const { return hub_.port(); }
  std::string url() const { return "tcpq://127.0.0.1:" + std::to_string(hub_.port()); }
  const Hub& stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return hub_;
  }

 private:
  static HubOptions on_free_port(HubOptions options) {
    options.port = 0;
    return options;
  }
  Hub hub_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

/// A client that sends what it is told to.
class RawClient {
 public:
  explicit RawClient(std::uint16_t port, int receive_buffer = 0)
      : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (receive_buffer > 0) ::setsockopt(fd_.get(), SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  bool send(const Bytes& bytes) const {
    return ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  /// What comes until size bytes are there, the connection ends or nothing comes for a while.
  Bytes receive(std::size_t size, int patience_ms = 2000) const {
    Bytes out;
    pollfd event{fd_.get(), POLLIN, 0};
    while (out.size() < size && ::poll(&event, 1, patience_ms) == 1) {
      Bytes part(std::min<std::size_t>(size - out.size(), 1 << 16));
      const ssize_t got = ::recv(fd_.get(), part.data(), part.size(), 0);
      if (got <= 0) break;
      out.insert(out.end(), part.begin(), part.begin() + got);
    }
    return out;
  }
  bool greet() const { return send(tcpq_hello(kTcpqClientMagic)) && receive(8) == tcpq_hello(kTcpqServerMagic); }
  /// Sends its own message and waits for it: all that was sent before has been handled by then.
  bool settle() const {
    static std::atomic<int> marks = 0;
    const std::string channel = "SETTLE" + std::to_string(++marks);
    const Bytes mark = tcpq_publish_frame(channel, Bytes{1});
    return send(tcpq_subscribe_frame(channel)) && send(mark) && receive(mark.size()) == mark;
  }
  bool is_closed_by_hub(int patience_ms = 3000) const {
    pollfd event{fd_.get(), POLLIN, 0};
    std::uint8_t byte = 0;
    while (::poll(&event, 1, patience_ms) == 1) {
      if (::recv(fd_.get(), &byte, 1, 0) <= 0) return true;
    }
    return false;
  }

 private:
  FileDescriptor fd_;
};

/// LCM's own client that counts what it gets.
class LcmClient {
 public:
  LcmClient(const std::string& url, const std::string& channel) : lcm_(url) {
    using Function = void (*)(const lcm::ReceiveBuffer*, const std::string&, std::vector<std::string>*);
    const Function keep = [](const lcm::ReceiveBuffer* buffer, const std::string& name, std::vector<std::string>* got) {
      got->push_back(name + "=" + std::string(static_cast<const char*>(buffer->data), buffer->data_size));
    };
    lcm_.subscribeFunction(channel, keep, &got_);
  }
  void publish(const std::string& channel, const std::string& text) {
    lcm_.publish(channel, text.data(), static_cast<unsigned int>(text.size()));
  }
  bool wait_for(const std::string& message) {
    while ((got_.empty() || got_.back() != message) && lcm_.handleTimeout(3000) > 0) {
    }
    return !got_.empty() && got_.back() == message;
  }
  /// Handles messages until so many are there.
  bool wait_for(std::size_t count) {
    while (got_.size() < count && lcm_.handleTimeout(3000) > 0) {
    }
    return got_.size() >= count;
  }
  const std::vector<std::string>& got() const { return got_; }

 private:
  lcm::LCM lcm_;
  std::vector<std::string> got_;
};

TEST(Hub, ServesLcmClients) {
  RunningHub hub;
  LcmClient sender(hub.url(), "ECHO_.*");
  LcmClient imu(hub.url(), "LOC_IMU");
  LcmClient all(hub.url(), ".*");
  // Whoever got something has its subscription in force.
  for (LcmClient* client : {&imu, &all}) {
    client->publish("LOC_IMU", "warm");
    ASSERT_TRUE(client->wait_for("LOC_IMU=warm"));
  }
  sender.publish("LOC_IMU_2", "b");
  sender.publish("LOC_IMU", "a");
  sender.publish("ECHO_1", "c");
  EXPECT_TRUE(sender.wait_for("ECHO_1=c"));
  EXPECT_EQ(sender.got(), std::vector<std::string>{"ECHO_1=c"});
  EXPECT_TRUE(imu.wait_for("LOC_IMU=a"));
  EXPECT_EQ(std::count(imu.got().begin(), imu.got().end(), "LOC_IMU_2=b"), 0)
      << "a pattern matches whole channels only";
  EXPECT_TRUE(all.wait_for("ECHO_1=c"));
  EXPECT_EQ(std::count(all.got().begin(), all.got().end(), "LOC_IMU_2=b"), 1);
}

TEST(Hub, HalfFramesOneByteAtATime) {
  RunningHub hub;
  const RawClient listener(hub.port());
  ASSERT_TRUE(listener.greet());
  ASSERT_TRUE(listener.send(tcpq_subscribe_frame("A")));
  ASSERT_TRUE(listener.settle());
  const RawClient sender(hub.port());
  const Bytes message = tcpq_publish_frame("A", Bytes{5, 6, 7});
  Bytes all = tcpq_hello(kTcpqClientMagic);
  all.insert(all.end(), message.begin(), message.end());
  for (const std::uint8_t byte : all) ASSERT_TRUE(sender.send({byte}));
  EXPECT_EQ(listener.receive(message.size()), message);
}

TEST(Hub, UnsubscribedChannelsStop) {
  RunningHub hub;
  const RawClient client(hub.port());
  ASSERT_TRUE(client.greet());
  ASSERT_TRUE(client.send(tcpq_subscribe_frame("A")));
  ASSERT_TRUE(client.send(tcpq_subscribe_frame("A", false)));
  ASSERT_TRUE(client.send(tcpq_publish_frame("A", Bytes{1})));
  EXPECT_TRUE(client.settle()) << "the first that comes back is the mark, not A";
}

TEST(Hub, MalformedFramesCloseThatClientOnly) {
  RunningHub hub;
  const RawClient good(hub.port());
  ASSERT_TRUE(good.greet());
  const std::vector<Bytes> wrong = {{0, 0, 0, 9},
                                    {0, 0, 0, 1, 0xff, 0, 0, 0},
                                    tcpq_subscribe_frame("[broken"),
                                    tcpq_subscribe_frame(std::string(5000, 'x')),
                                    tcpq_subscribe_frame("((((a{1,500}){1,500}){1,500}){1,500})")};
  for (const Bytes& bytes : wrong) {
    const RawClient bad(hub.port());
    ASSERT_TRUE(bad.greet());
    ASSERT_TRUE(bad.send(bytes));
    EXPECT_TRUE(bad.is_closed_by_hub());
  }
  const RawClient web_browser(hub.port());
  ASSERT_TRUE(web_browser.send({'G', 'E', 'T', ' ', '/', '\r', '\n', '\r', '\n'}));
  EXPECT_TRUE(web_browser.is_closed_by_hub());
  EXPECT_TRUE(good.settle());
  EXPECT_EQ(hub.stop().counts().malformed, static_cast<std::int64_t>(wrong.size()) + 1);
}

// In PCRE this pattern takes exponential time. LCM's own clients would send such a one as readily as any other.
TEST(Hub, PatternThatBacktrackersChokeOnIsHarmless) {
  RunningHub hub;
  const RawClient evil(hub.port());
  ASSERT_TRUE(evil.greet());
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(evil.send(tcpq_subscribe_frame("(((a+)+)+)+b" + std::to_string(i))));
  }
  LcmClient good(hub.url(), "OK");
  for (int i = 0; i < 50; ++i) good.publish(std::string(40, 'a') + std::to_string(i), "x");
  good.publish("OK", "1");
  EXPECT_TRUE(good.wait_for(1));
}

TEST(Hub, PatternBeyondRe2IsTakenAsAll) {
  RunningHub hub;
  LcmClient client(hub.url(), "LOC_(?!IMU).*");
  client.publish("LOC_IMU", "no");
  client.publish("LOC_GPS", "yes");
  ASSERT_TRUE(client.wait_for(1));
  EXPECT_EQ(client.got(), std::vector<std::string>{"LOC_GPS=yes"}) << "the client filters itself";
}

TEST(Hub, TooManySubscriptionsCloseTheClient) {
  RunningHub hub({.max_subscriptions = 10});
  const RawClient client(hub.port());
  ASSERT_TRUE(client.greet());
  for (int i = 0; i < 11; ++i) client.send(tcpq_subscribe_frame("A" + std::to_string(i)));
  EXPECT_TRUE(client.is_closed_by_hub());
}

TEST(Hub, ClientThatDoesNotGreetIsClosed) {
  RunningHub hub({.greeting_timeout = milliseconds(50)});
  const RawClient silent(hub.port());
  EXPECT_TRUE(silent.is_closed_by_hub());
  EXPECT_EQ(hub.stop().counts().malformed, 1);
}

TEST(Hub, SlowReaderLosesWholeMessagesAndHarmsNobody) {
  RunningHub hub({.max_queue_bytes = 100'000});
  const RawClient slow(hub.port(), 4096);
  ASSERT_TRUE(slow.greet());
  ASSERT_TRUE(slow.send(tcpq_subscribe_frame("DATA")));
  ASSERT_TRUE(slow.settle());
  LcmClient fast(hub.url(), "DATA");
  constexpr int kMessages = 3000;
  const std::string text(10'000, 'x');
  for (int i = 0; i < kMessages; ++i) {
    fast.publish("DATA", text);
    ASSERT_TRUE(fast.wait_for(static_cast<std::size_t>(i) + 1));
  }
  // What the slow one gets in the end: fewer messages, none of them cut.
  const Bytes frame =
      tcpq_publish_frame("DATA", std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  std::int64_t got = 0;
  for (;;) {
    const Bytes received = slow.receive(frame.size(), 300);
    if (received.empty()) break;
    ASSERT_EQ(received, frame);
    ++got;
  }
  const HubCounts& counts = hub.stop().counts();
  EXPECT_GT(counts.dropped, 0);
  EXPECT_EQ(got + counts.dropped, kMessages);
}

TEST(Hub, LargestHolderIsClosedWhenAllHoldTooMuch) {
  HubOptions options;
  options.max_queue_bytes = 1 << 20;
  options.max_total_bytes = 1 << 20;
  options.limits.max_data_bytes = 1 << 20;
  RunningHub hub(options);
  const RawClient small(hub.port());
  ASSERT_TRUE(small.greet());
  std::vector<std::unique_ptr<RawClient>> hoarders;
  for (int i = 0; i < 3; ++i) {
    hoarders.push_back(std::make_unique<RawClient>(hub.port()));
    ASSERT_TRUE(hoarders.back()->greet());
    Bytes unfinished = tcpq_publish_frame("A", Bytes(500'000));
    unfinished.pop_back();
    hoarders.back()->send(unfinished);
  }
  int closed = 0;
  for (const auto& hoarder : hoarders) closed += hoarder->is_closed_by_hub(300) ? 1 : 0;
  EXPECT_EQ(closed, 1);
  EXPECT_TRUE(small.settle());
  EXPECT_EQ(hub.stop().counts().overfull, 1);
}

TEST(Hub, ClientsPastTheLimitAreRefused) {
  RunningHub hub({.max_clients = 2});
  const RawClient a(hub.port());
  const RawClient b(hub.port());
  ASSERT_TRUE(a.greet());
  ASSERT_TRUE(b.greet());
  const RawClient c(hub.port());
  EXPECT_TRUE(c.is_closed_by_hub());
  EXPECT_TRUE(a.settle());
  EXPECT_EQ(hub.stop().counts().refused, 1);
}

TEST(Hub, AHundredClientsAndSuddenCloses) {
  RunningHub hub;
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < 100; ++i) {
    clients.push_back(std::make_unique<RawClient>(hub.port()));
    ASSERT_TRUE(clients.back()->greet());
    ASSERT_TRUE(clients.back()->send(tcpq_subscribe_frame("X")));
  }
  for (const auto& client : clients) ASSERT_TRUE(client->settle());
  const Bytes message = tcpq_publish_frame("X", Bytes(2000, 3));
  for (std::size_t i = 0; i < clients.size(); i += 2) clients[i].reset();  // unread bytes in them: a reset, not an end
  for (int round = 0; round < 20; ++round) ASSERT_TRUE(clients[1]->send(message));
  for (std::size_t i = 1; i < clients.size(); i += 2) {
    for (int round = 0; round < 20; ++round) ASSERT_EQ(clients[i]->receive(message.size()), message) << i;
  }
  EXPECT_EQ(hub.stop().clients(), 50U);
}

TEST(Hub, SurvivesRandomBytes) {
  RunningHub hub;
  Random random(31);
  for (int i = 0; i < 300; ++i) {
    const RawClient client(hub.port());
    if (i % 3 != 0) client.send(tcpq_hello(kTcpqClientMagic));
    Bytes bytes(1 + static_cast<std::size_t>(random.uniform(0, 300)));
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.uniform(0, 256));
    // Often a plausible head, so that the bytes get past the first check.
    if (i % 2 == 0 && bytes.size() > 8) {
      const Bytes head = {0, 0, 0, static_cast<std::uint8_t>(1 + i % 3), 0, 0, 0, static_cast<std::uint8_t>(i % 20)};
      std::copy(head.begin(), head.end(), bytes.begin());
    }
    client.send(bytes);
  }
  const RawClient good(hub.port());
  ASSERT_TRUE(good.greet());
  EXPECT_TRUE(good.settle());
}

TEST(Hub, OwnMessagesAreDelivered) {
  Hub hub({.port = 0});
  const RawClient client(hub.port());
  client.send(tcpq_hello(kTcpqClientMagic));
  client.send(tcpq_subscribe_frame("LOC_STATISTICS"));
  for (int i = 0; i < 20; ++i) hub.run_once(milliseconds(5));
  hub.publish("LOC_STATISTICS", Bytes{1, 2});
  const Bytes frame = tcpq_publish_frame("LOC_STATISTICS", Bytes{1, 2});
  EXPECT_EQ(client.receive(8), tcpq_hello(kTcpqServerMagic));
  EXPECT_EQ(client.receive(frame.size()), frame);
}

TEST(Hub, OptionsAreChecked) {
  EXPECT_THROW(Hub({.bind_address = "localhost"}), std::invalid_argument);
  EXPECT_THROW(Hub({.max_clients = 0}), std::invalid_argument);
  EXPECT_THROW(Hub({.max_queue_bytes = 0}), std::invalid_argument);
  EXPECT_THROW(Hub({.max_total_bytes = 1000}), std::invalid_argument);
  const Hub first({.port = 0});
  EXPECT_THROW(Hub({.port = first.port()}), std::system_error);
}

}  // namespace
}  // namespace loc
