// The byte stream of LCM's tcpq:// transport, as liblcm 1.3.1 speaks it. All numbers are big-endian uint32.
//   client: 0x287617fb, version 0x0100           server: 0x287617fa, version 0x0100
//   then    1, length, channel, length, data     publish, the same in both directions
//           2, length, regular expression        subscribe; it must match the whole channel
//           3, length, regular expression        unsubscribe
// The parser takes bytes in pieces of any size and trusts none of them: every length is checked before bytes of it are
// waited for, and memory grows with what has arrived, not with what was announced.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace loc {

inline constexpr std::uint32_t kTcpqServerMagic = 0x287617fa;
inline constexpr std::uint32_t kTcpqClientMagic = 0x287617fb;
inline constexpr std::uint32_t kTcpqVersion = 0x0100;

struct TcpqLimits {
  std::size_t max_channel_bytes = 255;    ///< liblcm itself stops at 63 on udpm
  std::size_t max_pattern_bytes = 1024;   ///< of a subscription
  std::size_t max_data_bytes = 16 << 20;  ///< of one message
};

struct TcpqFrame {
  enum class Kind : std::uint8_t { kHello, kPublish, kSubscribe, kUnsubscribe };
  Kind kind = Kind::kHello;
  std::string_view channel;             ///< channel, or the regular expression
  std::span<const std::uint8_t> bytes;  ///< the whole frame, as it goes on to subscribers
};

/// What one client sends. Views in a frame hold until the next call of feed() or next().
class TcpqParser {
 public:
  explicit TcpqParser(const TcpqLimits& limits) : limits_(limits) {}

  void feed(std::span<const std::uint8_t> bytes);
  /// The next whole frame; nullopt: more bytes are needed. The first one is kHello.
  /// @throws DataError saying what is malformed; nothing can be read from this client afterwards.
  std::optional<TcpqFrame> next();

  bool greeted() const { return greeted_; }
  /// Bytes that wait for the rest of their frame.
  std::size_t held() const { return buffer_.size() - begin_; }

 private:
  std::optional<std::uint32_t> number_at(std::size_t offset) const;

  TcpqLimits limits_;
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0;
  bool greeted_ = false;
};

/// A publish frame. @throws std::invalid_argument when the channel is empty.
std::vector<std::uint8_t> tcpq_publish_frame(std::string_view channel, std::span<const std::uint8_t> data);
/// A subscribe or unsubscribe frame.
std::vector<std::uint8_t> tcpq_subscribe_frame(std::string_view pattern, bool subscribe = true);
/// The greeting of one side: its magic number and the version.
std::vector<std::uint8_t> tcpq_hello(std::uint32_t magic);

}  // namespace loc
