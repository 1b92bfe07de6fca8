#include "libloc/io/lcm_log.hpp"

#include <lcm/eventlog.h>
#include <lcm/lcm.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"

namespace loc {
namespace {

constexpr std::size_t kHeaderBytes = 28;
constexpr std::array<std::uint8_t, 4> kSync{0xED, 0xA1, 0xDA, 0x01};
constexpr std::int64_t kLongestChannel = 999;  // what liblcm accepts
constexpr std::size_t kChunkBytes = 1 << 20;
constexpr std::size_t kFirstPieceBytes = 1 << 12;  // pieces grow: where much is damaged, the next header is near
constexpr std::size_t kSearchBytes = 1 << 16;  // much less than a chunk: the buffer is moved up once in many searches

std::uint64_t big_endian(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes) value = (value << 8U) | byte;
  return value;
}

bool begins_with_sync(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= kSync.size() && std::equal(kSync.begin(), kSync.end(), bytes.begin());
}

// A window that slides over the file.
class Window {
 public:
  explicit Window(const std::filesystem::path& path) : path_(path.string()) {
    const auto status = io::status_of(path);
    if (!std::filesystem::exists(status)) throw DataError(path_ + ": no such file");
    if (!std::filesystem::is_regular_file(status)) throw DataError(path_ + ": not a file");
    size_ = io::size_of(path);
    if (size_ == 0) throw DataError(path_ + ": the file is empty");
    file_.open(path, std::ios::binary);
    if (!file_) throw DataError(path_ + ": cannot be opened");
  }

  std::uint64_t offset() const { return offset_; }
  std::uint64_t size() const { return size_; }
  std::uint64_t left() const { return size_ - offset_; }

  /// The next bytes, fewer at the end of the file. Earlier views become invalid.
  std::span<const std::uint8_t> peek(std::size_t bytes) {
    bytes = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, left()));
    if (held_ - begin_ < bytes) {
      std::memmove(buffer_.data(), buffer_.data() + begin_, held_ - begin_);
      held_ -= begin_;
      begin_ = 0;
      const std::uint64_t want = std::min<std::uint64_t>(std::max(bytes, kChunkBytes), left());
      if (buffer_.size() < want) buffer_.resize(static_cast<std::size_t>(want));
      file_.read(reinterpret_cast<char*>(buffer_.data() + held_), static_cast<std::streamsize>(want - held_));
      held_ += static_cast<std::size_t>(file_.gcount());
      if (held_ < bytes) throw DataError(path_ + ": reading failed at byte " + std::to_string(offset_));
    }
    return {buffer_.data() + begin_, bytes};
  }
  /// Bytes farther on, for a look at them: what peek() holds does not grow. At most a chunk, fewer at the end of the
  /// file. Earlier views become invalid.
  std::span<const std::uint8_t> peek_at(std::uint64_t distance, std::size_t bytes) {
    if (distance >= left()) return {};
    bytes = static_cast<std::size_t>(std::min<std::uint64_t>({bytes, kChunkBytes, left() - distance}));
    const std::uint64_t held = held_ - begin_;
    if (distance + bytes <= held) return {buffer_.data() + begin_ + distance, bytes};
    ahead_.resize(kChunkBytes);
    file_.seekg(static_cast<std::streamoff>(offset_ + distance));
    file_.read(reinterpret_cast<char*>(ahead_.data()), static_cast<std::streamsize>(bytes));
    const bool complete = file_.gcount() == static_cast<std::streamsize>(bytes);
    file_.seekg(static_cast<std::streamoff>(offset_ + held));
    if (!complete || !file_) throw DataError(path_ + ": reading failed at byte " + std::to_string(offset_ + distance));
    return {ahead_.data(), bytes};
  }
  void skip(std::size_t bytes) {
    begin_ += bytes;
    offset_ += bytes;
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  std::ifstream file_;
  std::uint64_t size_ = 0;
  std::uint64_t offset_ = 0;
  std::vector<std::uint8_t> buffer_ = std::vector<std::uint8_t>(kChunkBytes);
  std::size_t begin_ = 0;
  std::size_t held_ = 0;
  std::vector<std::uint8_t> ahead_;  // of peek_at()
};

struct Header {
  std::int64_t number = 0;
  std::int64_t time_us = 0;
  std::int64_t channel_bytes = 0;
  std::int64_t data_bytes = 0;

  std::int64_t event_bytes() const { return static_cast<std::int64_t>(kHeaderBytes) + channel_bytes + data_bytes; }
};

// nullopt when no logger can have written this.
std::optional<Header> parse_header(std::span<const std::uint8_t> bytes, std::int64_t max_event_bytes) {
  if (bytes.size() < kHeaderBytes || !begins_with_sync(bytes)) return std::nullopt;
  Header header;
  header.number = static_cast<std::int64_t>(big_endian(bytes.subspan(4, 8)));
  header.time_us = static_cast<std::int64_t>(big_endian(bytes.subspan(12, 8)));
  header.channel_bytes = static_cast<std::int32_t>(big_endian(bytes.subspan(20, 4)));
  header.data_bytes = static_cast<std::int32_t>(big_endian(bytes.subspan(24, 4)));
  if (header.channel_bytes <= 0 || header.channel_bytes > kLongestChannel) return std::nullopt;
  if (header.data_bytes < 0 || header.event_bytes() > max_event_bytes) return std::nullopt;
  return header;
}

}  // namespace

struct LcmLogReader::State {
  State(const std::filesystem::path& path, std::int64_t max_bytes) : window(path), max_event_bytes(max_bytes) {}

  Window window;
  std::int64_t max_event_bytes;
  LcmLogEvent event;
  std::size_t event_bytes = 0;  // of the event that was given last, still in the window
  LcmLogDamage damage;
  bool any = false;

  // An event begins here whose lengths can be believed: it ends with the file or where the next one begins, or at
  // least no other event begins inside it.
  std::optional<Header> event_here() {
    const auto header = parse_header(window.peek(kHeaderBytes), max_event_bytes);
    if (!header || static_cast<std::uint64_t>(header->event_bytes()) > window.left()) return std::nullopt;
    const auto bytes = static_cast<std::uint64_t>(header->event_bytes());
    // The bytes in between are fetched when the event is taken: a damaged header may state any length.
    if (bytes + kSync.size() <= kChunkBytes) window.peek(static_cast<std::size_t>(bytes) + kSync.size());
    const auto next = window.peek_at(bytes, kSync.size());
    if (next.empty() || begins_with_sync(next) || !header_within(kHeaderBytes, bytes)) return header;
    return std::nullopt;
  }

  // A header that can be believed lies between these distances. Stops at the first, so that the time for a damaged
  // stretch does not grow with the lengths that are stated in it.
  bool header_within(std::uint64_t from, std::uint64_t to) {
    std::size_t most = kFirstPieceBytes;
    while (from + kHeaderBytes <= to) {
      const auto piece = window.peek_at(from, static_cast<std::size_t>(std::min<std::uint64_t>(to - from, most)));
      if (piece.size() < kHeaderBytes) return false;
      for (auto at = piece.begin();; ++at) {
        at = std::search(at, piece.end(), kSync.begin(), kSync.end());
        if (piece.end() - at < static_cast<std::ptrdiff_t>(kHeaderBytes)) break;
        if (parse_header(piece.subspan(static_cast<std::size_t>(at - piece.begin()), kHeaderBytes), max_event_bytes)) {
          return true;
        }
      }
      from += piece.size() - (kHeaderBytes - 1);  // a header may begin in this piece and end in the next
      most = std::min(4 * most, kChunkBytes);
    }
    return false;
  }

  void count_skipped(std::uint64_t from, std::uint64_t bytes) {
    ++damage.gaps;
    if (!damage.first_gap_offset) damage.first_gap_offset = from;
    damage.skipped_bytes += static_cast<std::int64_t>(bytes);
  }

  // Bytes up to the next place where an event may begin; at least one.
  std::size_t distance_to_sync() {
    const auto bytes = window.peek(kSearchBytes);
    const auto found = std::search(bytes.begin() + 1, bytes.end(), kSync.begin(), kSync.end());
    if (found != bytes.end()) return static_cast<std::size_t>(found - bytes.begin());
    // The last three bytes may be the beginning of one, unless the file ends here.
    if (bytes.size() == window.left() || bytes.size() <= kSync.size()) return bytes.size();
    return bytes.size() - (kSync.size() - 1);
  }

  const LcmLogEvent* next() {
    window.skip(event_bytes);
    event_bytes = 0;
    std::optional<std::uint64_t> cut;  // a header that can be believed, of an event that the file is too short for
    const std::uint64_t skipped_from = window.offset();
    while (window.left() > 0) {
      if (const auto header = event_here()) {
        if (window.offset() > skipped_from) count_skipped(skipped_from, window.offset() - skipped_from);
        return take(*header);
      }
      if (!cut) {
        const auto bytes = window.peek(kHeaderBytes);
        const bool begun =
            bytes.size() < kHeaderBytes
                ? std::equal(bytes.begin(), bytes.begin() + std::min<std::ptrdiff_t>(4, std::ssize(bytes)),
                             kSync.begin())
                : parse_header(bytes, max_event_bytes).has_value();
        if (begun) cut = window.offset();
      }
      window.skip(distance_to_sync());
    }
    // No event follows: what looked like the beginning of one is the cut tail, what lies before it is damage.
    const std::uint64_t end = cut.value_or(window.size());
    if (end > skipped_from) count_skipped(skipped_from, end - skipped_from);
    if (cut) {
      damage.truncated_at = *cut;
      damage.truncated_bytes = static_cast<std::int64_t>(window.size() - *cut);
    }
    if (!any)
      throw DataError(window.path() + ": not an LCM log, no event in " + std::to_string(window.size()) + " bytes");
    return nullptr;
  }

  const LcmLogEvent* take(const Header& header) {
    event_bytes = static_cast<std::size_t>(header.event_bytes());
    const auto bytes = window.peek(event_bytes);
    event.number = header.number;
    event.log_time_us = header.time_us;
    event.offset = window.offset();
    const auto channel = bytes.subspan(kHeaderBytes, static_cast<std::size_t>(header.channel_bytes));
    event.channel = {reinterpret_cast<const char*>(channel.data()), channel.size()};
    event.data = bytes.subspan(kHeaderBytes + channel.size());
    any = true;
    return &event;
  }
};

LcmLogReader::LcmLogReader(const std::filesystem::path& path, std::int64_t max_event_bytes)
    : state_(std::make_unique<State>(path, max_event_bytes)) {
  require(max_event_bytes > 0, "max_event_bytes", static_cast<double>(max_event_bytes), "must be positive");
}
LcmLogReader::LcmLogReader(LcmLogReader&&) noexcept = default;
LcmLogReader& LcmLogReader::operator=(LcmLogReader&&) noexcept = default;
LcmLogReader::~LcmLogReader() = default;

const LcmLogEvent* LcmLogReader::next() {
  const LcmLogEvent* event = state_->next();
  while (event != nullptr && event->channel == "LCM_SELF_TEST") event = state_->next();
  return event;
}

const LcmLogDamage& LcmLogReader::damage() const {
  return state_->damage;
}

struct LcmLogWriter::State {
  std::string path;
  std::unique_ptr<lcm_eventlog_t, decltype(&lcm_eventlog_destroy)> log{nullptr, &lcm_eventlog_destroy};
};

LcmLogWriter::LcmLogWriter(const std::filesystem::path& path) : state_(std::make_unique<State>()) {
  state_->path = path.string();
  state_->log.reset(lcm_eventlog_create(path.c_str(), "w"));
  if (!state_->log) throw DataError(state_->path + ": cannot be written");
}
LcmLogWriter::LcmLogWriter(LcmLogWriter&&) noexcept = default;
LcmLogWriter& LcmLogWriter::operator=(LcmLogWriter&&) noexcept = default;
LcmLogWriter::~LcmLogWriter() = default;

void LcmLogWriter::write(std::int64_t log_time_us, std::string_view channel, std::span<const std::uint8_t> data) {
  require(!channel.empty() && channel.size() <= LCM_MAX_CHANNEL_NAME_LENGTH,
          "channel '" + std::string(channel) + "': must have 1 to 63 bytes");
  require(data.size() <= static_cast<std::size_t>(INT32_MAX), "data", static_cast<double>(data.size()),
          "must be less than 2^31 bytes");
  std::string name(channel);
  std::vector<std::uint8_t> unused(1);
  lcm_eventlog_event_t event{};
  event.timestamp = log_time_us;
  event.channellen = static_cast<std::int32_t>(name.size());
  event.datalen = static_cast<std::int32_t>(data.size());
  event.channel = name.data();
  // liblcm takes a pointer to non-const, and only reads.
  event.data = data.empty() ? unused.data() : const_cast<std::uint8_t*>(data.data());
  if (lcm_eventlog_write_event(state_->log.get(), &event) != 0) throw DataError(state_->path + ": writing failed");
}

void LcmLogWriter::flush() {
  if (std::fflush(state_->log->f) != 0) throw DataError(state_->path + ": writing failed");
}

}  // namespace loc
