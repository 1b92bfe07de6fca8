// LCM event logs, event by event in constant memory. Reading does not use liblcm: its reader stops for good at a
// damaged header, passes over damage in silence, prints, and allocates whatever a length field says. Here damage is
// skipped to the next event, and the skipped bytes are counted. Writing goes through liblcm. Format: 0xEDA1DA01, event
// number, time stamp [us], length of channel, length of data, channel, data; big endian.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace loc {

/// One message. Views are valid until the next call of next().
struct LcmLogEvent {
  std::int64_t number = 0;
  std::int64_t log_time_us = 0;  ///< When the logger received it, since 1970. The message has its own time.
  std::uint64_t offset = 0;      ///< Of its first byte in the file.
  std::string_view channel;
  std::span<const std::uint8_t> data;
};

/// What was not readable.
struct LcmLogDamage {
  std::int64_t gaps = 0;           ///< Stretches that were skipped, the tail not included.
  std::int64_t skipped_bytes = 0;  ///< In them.
  std::optional<std::uint64_t> first_gap_offset;
  std::optional<std::uint64_t> truncated_at;  ///< The file ends inside the event that begins here.
  std::int64_t truncated_bytes = 0;           ///< From there to the end of the file.
};

class LcmLogReader {
 public:
  /// @param max_event_bytes an event with a longer channel and data than that is taken for damage
  /// @throws DataError when the file is missing, not a regular file, or empty.
  explicit LcmLogReader(const std::filesystem::path& path, std::int64_t max_event_bytes = 256 << 20);
  LcmLogReader(LcmLogReader&&) noexcept;
  LcmLogReader& operator=(LcmLogReader&&) noexcept;
  ~LcmLogReader();

  /// nullptr at the end. LCM's own test messages (LCM_SELF_TEST) are left out.
  /// @throws DataError naming file and byte when there is not one event in the whole file, or reading fails.
  const LcmLogEvent* next();
  const LcmLogDamage& damage() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

class LcmLogWriter {
 public:
  /// Replaces the file. @throws DataError when it cannot be written.
  explicit LcmLogWriter(const std::filesystem::path& path);
  LcmLogWriter(LcmLogWriter&&) noexcept;
  LcmLogWriter& operator=(LcmLogWriter&&) noexcept;
  ~LcmLogWriter();

  /// @throws DataError when it cannot be written (disk full); std::invalid_argument for a channel that is empty or
  /// longer than LCM's 63 bytes.
  void write(std::int64_t log_time_us, std::string_view channel, std::span<const std::uint8_t> data);
  /// @throws DataError when it is not on its way to the disk.
  void flush();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace loc
