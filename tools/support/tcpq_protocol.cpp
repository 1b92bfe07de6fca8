#include "tools/support/tcpq_protocol.hpp"

#include <algorithm>
#include <string>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr std::uint32_t kPublish = 1;
constexpr std::uint32_t kSubscribe = 2;
constexpr std::uint32_t kUnsubscribe = 3;
// A buffer that one large message has blown up is given back.
constexpr std::size_t kKeepCapacity = 1 << 20;

void append_number(std::vector<std::uint8_t>& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(value >> shift));
}

void append_text(std::vector<std::uint8_t>& out, std::string_view text) {
  append_number(out, static_cast<std::uint32_t>(text.size()));
  out.insert(out.end(), text.begin(), text.end());
}

void check_length(const char* what, std::uint32_t length, std::size_t limit) {
  if (length > limit) {
    throw DataError(std::string(what) + " of " + std::to_string(length) + " bytes; the limit is " +
                    std::to_string(limit));
  }
}

// Clients take the name as a C string and may print it: no control characters.
void check_name(const char* what, std::string_view name) {
  if (name.empty()) throw DataError(std::string(what) + " is empty");
  const bool ok = std::all_of(name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) >= 0x20; });
  if (!ok) throw DataError(std::string(what) + " has control characters in it");
}

}  // namespace

void TcpqParser::feed(std::span<const std::uint8_t> bytes) {
  if (begin_ == buffer_.size()) {
    buffer_.clear();
    begin_ = 0;
    if (buffer_.capacity() > kKeepCapacity) buffer_.shrink_to_fit();
  } else if (begin_ > buffer_.size() / 2) {
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin_));
    begin_ = 0;
  }
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

std::optional<std::uint32_t> TcpqParser::number_at(std::size_t offset) const {
  if (held() < offset + 4) return std::nullopt;
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8U | buffer_[begin_ + offset + i];
  return value;
}

std::optional<TcpqFrame> TcpqParser::next() {
  const auto first = number_at(0);
  if (!first) return std::nullopt;
  if (!greeted_) {
    if (*first != kTcpqClientMagic) throw DataError("greeting is not LCM's: " + std::to_string(*first));
    const auto version = number_at(4);
    if (!version) return std::nullopt;
    if (*version != kTcpqVersion) throw DataError("protocol version " + std::to_string(*version) + " is not known");
    greeted_ = true;
    begin_ += 8;
    return TcpqFrame{};
  }

  if (*first < kPublish || *first > kUnsubscribe) throw DataError("frame type " + std::to_string(*first));
  const bool publish = *first == kPublish;
  const auto name_length = number_at(4);
  if (!name_length) return std::nullopt;
  const char* name_kind = publish ? "channel" : "subscription";
  check_length(name_kind, *name_length, publish ? limits_.max_channel_bytes : limits_.max_pattern_bytes);
  std::size_t size = 8 + static_cast<std::size_t>(*name_length);
  if (held() < size) return std::nullopt;
  if (publish) {
    const auto data_length = number_at(size);
    if (!data_length) return std::nullopt;
    check_length("message", *data_length, limits_.max_data_bytes);
    size += 4 + static_cast<std::size_t>(*data_length);
    if (held() < size) return std::nullopt;
  }

  TcpqFrame frame;
  frame.kind = publish                ? TcpqFrame::Kind::kPublish
               : *first == kSubscribe ? TcpqFrame::Kind::kSubscribe
                                      : TcpqFrame::Kind::kUnsubscribe;
  frame.bytes = std::span(buffer_).subspan(begin_, size);
  // The bytes of a name are characters.
  frame.channel = std::string_view(reinterpret_cast<const char*>(frame.bytes.data()) + 8, *name_length);
  check_name(name_kind, frame.channel);
  begin_ += size;
  return frame;
}

std::vector<std::uint8_t> tcpq_publish_frame(std::string_view channel, std::span<const std::uint8_t> data) {
  require(!channel.empty(), "channel: must not be empty");
  std::vector<std::uint8_t> out;
  out.reserve(12 + channel.size() + data.size());
  append_number(out, kPublish);
  append_text(out, channel);
  append_number(out, static_cast<std::uint32_t>(data.size()));
  out.insert(out.end(), data.begin(), data.end());
  return out;
}

std::vector<std::uint8_t> tcpq_subscribe_frame(std::string_view pattern, bool subscribe) {
  std::vector<std::uint8_t> out;
  append_number(out, subscribe ? kSubscribe : kUnsubscribe);
  append_text(out, pattern);
  return out;
}

std::vector<std::uint8_t> tcpq_hello(std::uint32_t magic) {
  std::vector<std::uint8_t> out;
  append_number(out, magic);
  append_number(out, kTcpqVersion);
  return out;
}

}  // namespace loc
