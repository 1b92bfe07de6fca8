#include "libloc/io/nmea.hpp"

#include <cstring>
#include <numeric>
#include <string>

#include "libloc/io/nmea_fields.hpp"

namespace loc {
namespace {

constexpr int kNotHex = -1;

int hex_digit(std::uint8_t byte) {
  if (byte >= '0' && byte <= '9') return byte - '0';
  if (byte >= 'A' && byte <= 'F') return byte - 'A' + 10;
  if (byte >= 'a' && byte <= 'f') return byte - 'a' + 10;
  return kNotHex;
}

bool is_line_end(std::uint8_t byte) {
  return byte == '\r' || byte == '\n';
}

/// A '$' in binary data is no sentence that went wrong: one begins with three letters or digits at least.
bool looks_like_sentence(const char* text, std::size_t length) {
  if (length < 3) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    const char c = text[i];
    if (!(c >= 'A' && c <= 'Z') && !(c >= '0' && c <= '9')) return false;
  }
  return true;
}

}  // namespace

const char* nmea_type_name(std::size_t type) {
  static constexpr const char* kNames[kNmeaTypes] = {"rmc", "gga", "zda", "gsa", "gst", "vtg"};
  return type < kNmeaTypes ? kNames[type] : "";
}

const char* nmea_problem_name(NmeaProblem problem) {
  static constexpr const char* kNames[kNmeaProblems] = {"none",        "cut",       "not_text", "too_long",
                                                        "no_checksum", "fields",    "time",     "date",
                                                        "latitude",    "longitude", "number",   "letter"};
  return kNames[static_cast<std::size_t>(problem)];
}

std::int64_t NmeaCounts::valid_in_all() const {
  return std::accumulate(valid.begin(), valid.end(), std::int64_t{0});
}

void NmeaCounts::add_to(NamedCounts& counts) const {
  for (std::size_t i = 0; i < kNmeaTypes; ++i) counts.push_back({std::string("nmea.") + nmea_type_name(i), valid[i]});
  counts.push_back({"nmea.unknown", unknown});
  counts.push_back({"nmea.bad_checksum", bad_checksum});
  for (std::size_t i = 1; i < kNmeaProblems; ++i) {
    if (malformed[i] == 0) continue;
    counts.push_back({std::string("nmea.malformed.") + nmea_problem_name(static_cast<NmeaProblem>(i)), malformed[i]});
  }
  counts.push_back({"nmea.bytes", bytes});
  counts.push_back({"nmea.bytes_skipped", bytes_skipped});
}

void NmeaReader::begin(TimeNs host_time_ns) {
  state_ = State::kBody;
  after_sentence_ = false;
  sum_ = 0;
  length_ = 0;
  sentence_.offset = counts_.bytes;
  sentence_.host_time_ns = host_time_ns;
}

// The '$' and what was taken since belong to no sentence.
void NmeaReader::abandon(NmeaProblem problem) {
  if (looks_like_sentence(text_.data(), length_)) ++counts_.malformed[static_cast<std::size_t>(problem)];
  counts_.bytes_skipped += counts_.bytes - sentence_.offset;
  state_ = State::kOutside;
}

void NmeaReader::interrupt() {
  if (state_ != State::kOutside) abandon(NmeaProblem::kCut);
  after_sentence_ = false;
}

void NmeaReader::skip_to_dollar(std::span<const std::uint8_t>& bytes, TimeNs host_time_ns) {
  std::size_t line_ends = 0;
  while (after_sentence_ && line_ends < bytes.size() && is_line_end(bytes[line_ends])) ++line_ends;
  counts_.bytes += static_cast<std::int64_t>(line_ends);
  bytes = bytes.subspan(line_ends);
  if (bytes.empty()) return;
  const auto* dollar = static_cast<const std::uint8_t*>(std::memchr(bytes.data(), '$', bytes.size()));
  const std::size_t skipped = dollar == nullptr ? bytes.size() : static_cast<std::size_t>(dollar - bytes.data());
  if (skipped > 0) after_sentence_ = false;
  counts_.bytes += static_cast<std::int64_t>(skipped);
  counts_.bytes_skipped += static_cast<std::int64_t>(skipped);
  bytes = bytes.subspan(skipped);
  if (bytes.empty()) return;
  begin(host_time_ns);
  ++counts_.bytes;
  bytes = bytes.subspan(1);
}

// True for a valid sentence.
bool NmeaReader::complete() {
  state_ = State::kOutside;
  after_sentence_ = true;
  if (told_sum_ != sum_) {
    ++counts_.bad_checksum;
    return false;
  }
  NmeaProblem problem = NmeaProblem::kNone;
  switch (io::decode_nmea({text_.data(), length_}, sentence_, problem)) {
    case io::NmeaDecoded::kValid:
      ++counts_.valid[sentence_.content.index()];
      return true;
    case io::NmeaDecoded::kUnknownType:
      ++counts_.unknown;
      return false;
    case io::NmeaDecoded::kMalformed:
      ++counts_.malformed[static_cast<std::size_t>(problem)];
      return false;
  }
  return false;
}

// A byte that cannot be where it is ends the sentence; a '$' begins the next, any other byte is skipped.
void NmeaReader::refuse_digit(std::uint8_t byte, TimeNs host_time_ns) {
  abandon(byte == '$' ? NmeaProblem::kCut : NmeaProblem::kNoChecksum);
  if (byte == '$') {
    begin(host_time_ns);
  } else {
    ++counts_.bytes_skipped;
  }
}

const NmeaSentence* NmeaReader::next(std::span<const std::uint8_t>& bytes, TimeNs host_time_ns) {
  while (!bytes.empty()) {
    if (state_ == State::kOutside) {
      skip_to_dollar(bytes, host_time_ns);
      continue;
    }
    if (state_ == State::kBody) {
      // The inner loop: text goes to the buffer, anything else leaves it.
      const std::size_t most = std::min(bytes.size(), kNmeaMaxLength - length_);
      std::size_t taken = 0;
      std::uint8_t sum = sum_;
      while (taken < most) {
        const std::uint8_t byte = bytes[taken];
        if (byte < 0x20 || byte > 0x7e || byte == '*' || byte == '$') break;
        sum ^= byte;
        text_[length_ + taken++] = static_cast<char>(byte);
      }
      sum_ = sum;
      length_ += taken;
      counts_.bytes += static_cast<std::int64_t>(taken);
      bytes = bytes.subspan(taken);
      if (bytes.empty()) return nullptr;
      const std::uint8_t byte = bytes.front();
      if (byte == '*') {
        state_ = State::kFirstDigit;
      } else if (byte == '$') {
        abandon(NmeaProblem::kCut);
        begin(host_time_ns);
      } else {
        abandon(is_line_end(byte)           ? NmeaProblem::kNoChecksum
                : length_ == kNmeaMaxLength ? NmeaProblem::kTooLong
                                            : NmeaProblem::kNotText);
        ++counts_.bytes_skipped;
      }
      ++counts_.bytes;
      bytes = bytes.subspan(1);
      continue;
    }
    const std::uint8_t byte = bytes.front();
    bytes = bytes.subspan(1);
    const int digit = hex_digit(byte);
    if (digit == kNotHex) {
      refuse_digit(byte, host_time_ns);
      ++counts_.bytes;
    } else if (state_ == State::kFirstDigit) {
      told_sum_ = static_cast<std::uint8_t>(digit << 4);
      state_ = State::kSecondDigit;
      ++counts_.bytes;
    } else {
      told_sum_ = static_cast<std::uint8_t>(told_sum_ | digit);
      ++counts_.bytes;
      if (complete()) return &sentence_;
    }
  }
  return nullptr;
}

}  // namespace loc
