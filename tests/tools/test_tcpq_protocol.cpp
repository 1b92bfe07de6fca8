// The parser of what clients send to the hub: any cut of the stream gives the same frames, and no bytes harm it.
#include <gtest/gtest.h>

#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "tools/support/tcpq_protocol.hpp"

namespace loc {
namespace {

using Bytes = std::vector<std::uint8_t>;

void append(Bytes& to, const Bytes& more) {
  to.insert(to.end(), more.begin(), more.end());
}

Bytes conversation() {
  Bytes all = tcpq_hello(kTcpqClientMagic);
  append(all, tcpq_subscribe_frame("LOC_.*"));
  append(all, tcpq_publish_frame("LOC_IMU", Bytes{1, 2, 3}));
  append(all, tcpq_publish_frame("EMPTY", Bytes{}));
  append(all, tcpq_publish_frame("BIG", Bytes(100'000, 7)));
  append(all, tcpq_subscribe_frame("LOC_.*", false));
  return all;
}

std::string parse_in_pieces(const Bytes& bytes, const std::function<std::size_t()>& piece) {
  TcpqParser parser({});
  std::string seen;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t size = std::min(piece(), bytes.size() - at);
    parser.feed(std::span(bytes).subspan(at, size));
    at += size;
    while (const auto frame = parser.next()) {
      seen += std::to_string(static_cast<int>(frame->kind)) + std::string(frame->channel) + ":" +
              std::to_string(frame->bytes.size()) + " ";
    }
  }
  EXPECT_EQ(parser.held(), 0U);
  return seen;
}

TEST(TcpqProtocol, FramesDoNotDependOnHowTheStreamIsCut) {
  const Bytes bytes = conversation();
  const std::string expected = "0:0 2LOC_.*:14 1LOC_IMU:22 1EMPTY:17 1BIG:100015 3LOC_.*:14 ";
  EXPECT_EQ(parse_in_pieces(bytes, [&] { return bytes.size(); }), expected);
  EXPECT_EQ(parse_in_pieces(bytes, [] { return std::size_t{1}; }), expected);
  Random random(11);
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(parse_in_pieces(bytes, [&] { return 1 + static_cast<std::size_t>(random.uniform(0, 5000)); }), expected);
  }
}

TEST(TcpqProtocol, ForwardsTheFrameAsItCame) {
  const Bytes frame_bytes = tcpq_publish_frame("LOC_IMU", Bytes{9, 8, 7});
  Bytes bytes = tcpq_hello(kTcpqClientMagic);
  append(bytes, frame_bytes);
  TcpqParser parser({});
  parser.feed(bytes);
  ASSERT_TRUE(parser.next());
  const auto frame = parser.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(Bytes(frame->bytes.begin(), frame->bytes.end()), frame_bytes);
}

void expect_malformed(const Bytes& after_hello, const std::string& reason) {
  TcpqParser parser({.max_channel_bytes = 10, .max_pattern_bytes = 20, .max_data_bytes = 1000});
  parser.feed(tcpq_hello(kTcpqClientMagic));
  ASSERT_TRUE(parser.next());
  parser.feed(after_hello);
  try {
    while (parser.next()) {
    }
    FAIL() << "accepted; expected: " << reason;
  } catch (const DataError& error) {
    EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
  }
}

TEST(TcpqProtocol, RefusesMalformedFramesBeforeTheirBytesArrive) {
  expect_malformed({0, 0, 0, 0}, "frame type 0");
  expect_malformed({0, 0, 0, 4}, "frame type 4");
  expect_malformed({0xff, 0xff, 0xff, 0xff}, "frame type");
  expect_malformed({0, 0, 0, 1, 0xff, 0xff, 0xff, 0xff}, "channel of 4294967295 bytes");
  expect_malformed({0, 0, 0, 1, 0, 0, 0, 11}, "channel of 11 bytes");
  expect_malformed({0, 0, 0, 2, 0, 0, 0, 21}, "subscription of 21 bytes");
  expect_malformed({0, 0, 0, 1, 0, 0, 0, 1, 'A', 0x7f, 0xff, 0xff, 0xff}, "message of 2147483647 bytes");
  expect_malformed({0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0}, "channel is empty");
  expect_malformed({0, 0, 0, 1, 0, 0, 0, 2, 'A', 0, 0, 0, 0, 0}, "control characters");
}

TEST(TcpqProtocol, RefusesAnotherGreeting) {
  for (const Bytes& greeting : {Bytes{'G', 'E', 'T', ' '}, tcpq_hello(kTcpqServerMagic)}) {
    TcpqParser parser({});
    parser.feed(greeting);
    EXPECT_THROW(parser.next(), DataError);
  }
  TcpqParser parser({});
  Bytes other_version = tcpq_hello(kTcpqClientMagic);
  other_version.back() = 1;
  parser.feed(other_version);
  EXPECT_THROW(parser.next(), DataError);
}

// Damaged streams: frames or DataError, nothing else, and never more memory than was fed.
TEST(TcpqProtocol, AnyBytesAreHarmless) {
  const Bytes good = conversation();
  Random random(12);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    Bytes bytes(good.begin(), good.begin() + 200);
    const int changes = 1 + static_cast<int>(random.uniform(0, 4));
    for (int k = 0; k < changes; ++k) {
      bytes[static_cast<std::size_t>(random.uniform(0, 200))] = static_cast<std::uint8_t>(random.uniform(0, 256));
    }
    TcpqParser parser({});
    try {
      for (std::size_t at = 0; at < bytes.size(); at += 10) {
        parser.feed(std::span(bytes).subspan(at, 10));
        while (parser.next()) {
        }
        EXPECT_LE(parser.held(), bytes.size());
      }
    } catch (const DataError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100);
  EXPECT_LT(refused, 3000);
}

}  // namespace
}  // namespace loc
