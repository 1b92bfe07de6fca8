// Sentences with their checksum, and readers of whole texts, for tests.
#pragma once

#include <cstdio>
#include <span>
#include <string>
#include <vector>

#include "libloc/io/nmea.hpp"

namespace loc::test {

/// "$" + body + "*hh" + end
inline std::string sentence(const std::string& body, const std::string& end = "\r\n") {
  unsigned sum = 0;
  for (const char c : body) sum ^= static_cast<unsigned char>(c);
  char digits[4];
  std::snprintf(digits, sizeof digits, "*%02X", sum);
  return "$" + body + digits + end;
}

inline std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// All valid sentences of a text, given in pieces of a size.
inline std::vector<NmeaSentence> read_all(NmeaReader& reader, const std::string& text, std::size_t piece = 1 << 20) {
  std::vector<NmeaSentence> out;
  for (std::size_t at = 0; at < text.size(); at += piece) {
    std::span<const std::uint8_t> bytes = bytes_of(text).subspan(at, std::min(piece, text.size() - at));
    while (const NmeaSentence* s = reader.next(bytes)) out.push_back(*s);
  }
  return out;
}

}  // namespace loc::test
