// Runs a decoder that lcm-gen made, after the lengths in the message were found possible.
#pragma once

#include <limits>
#include <string>

#include "libloc/core/check.hpp"
#include "msgs/wire.hpp"

namespace loc {

/// @param walk called as walk(wire::Walker&, const T& empty): goes over all fields behind the fingerprint
/// @throws DataError naming the type, unless data is exactly one message of it.
template <class T, class Walk>
T decode_generated(std::span<const std::uint8_t> data, Walk walk) {
  T message{};
  const std::string size = std::to_string(data.size()) + " bytes";
  if (data.size() < 8 || data.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    throw DataError(std::string(T::getTypeName()) + ": " + size + " cannot hold a message");
  }
  if (wire::fingerprint(data) != T::getHash()) {
    throw DataError(std::string(T::getTypeName()) + ": another type, the fingerprint does not match");
  }
  wire::Walker walker(data);
  walk(walker, message);
  const int length = static_cast<int>(data.size());
  if (!walker.complete() || message.decode(data.data(), 0, length) != length) {
    throw DataError(std::string(T::getTypeName()) + ": " + size + " do not match the lengths stated in the message");
  }
  return message;
}

}  // namespace loc
