// LCM as the programs use it: publishing and receiving each have their own connection (liblcm's tcpq is not made for
// two threads on one), what cannot work is said with the way to mend it, and a hub that was restarted is found again.
#pragma once

#include <cstdint>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "libloc/core/time.hpp"

namespace loc {

/// Multicast that stays on this host, with a receive buffer that holds a few images.
inline constexpr const char* kDefaultLcmUrl = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";

/// Opens a transport.
/// @throws UsageError for a URL that is not understood; std::runtime_error saying what is missing (no hub listens, no
/// multicast route) and what mends it.
std::unique_ptr<lcm::LCM> open_lcm(const std::string& url);

/// Whether messages can be sent by multicast here. @param reason says why not.
bool multicast_works(const std::string& url, std::string* reason);

class LcmPublisher {
 public:
  /// @throws as open_lcm
  explicit LcmPublisher(std::string url);

  /// Sends. After a failure it connects anew, at most twice a second.
  /// @return false when the message could not be sent: counted in failed().
  bool publish(const std::string& channel, std::span<const std::uint8_t> data);
  template <class Message>
  requires requires(const Message& m) { m.getEncodedSize(); }
  bool publish(const std::string& channel, const Message& message) {
    buffer_.resize(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
    return publish(channel, std::span<const std::uint8_t>(buffer_));
  }
  std::int64_t failed() const { return failed_; }

 private:
  bool connected();

  std::string url_;
  std::unique_ptr<lcm::LCM> lcm_;
  std::vector<std::uint8_t> buffer_;
  TimeNs next_try_ns_ = 0;
  std::int64_t failed_ = 0;
};

class LcmReceiver {
 public:
  using Handler = std::function<void(std::string_view channel, std::span<const std::uint8_t> data)>;

  /// @throws as open_lcm
  explicit LcmReceiver(std::string url);
  LcmReceiver(const LcmReceiver&) = delete;
  LcmReceiver& operator=(const LcmReceiver&) = delete;
  ~LcmReceiver();

  /// @param pattern regular expression that matches the whole channel
  void subscribe(const std::string& pattern, Handler handler);
  /// Waits for a message and hands it to its handlers. After the connection was lost it connects anew, twice a second.
  /// @return false when nothing came in time.
  bool handle(int timeout_ms);
  /// Times that the connection was lost.
  std::int64_t disconnects() const { return disconnects_; }

 private:
  struct Subscription {
    std::string pattern;
    Handler handler;
  };
  void attach(Subscription& subscription);

  std::string url_;
  std::unique_ptr<lcm::LCM> lcm_;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
  std::int64_t disconnects_ = 0;
};

}  // namespace loc
