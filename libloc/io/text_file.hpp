// Text files line by line, and numbers without the locale. Internal to io.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/core/time.hpp"

namespace loc::io {

/// What is at path; that there is nothing is no error.
/// @throws DataError when it cannot be found out: a loop of symbolic links, a name too long, a folder that is closed.
std::filesystem::file_status status_of(const std::filesystem::path& path);

/// Bytes of a file. @throws DataError when there is no such file or it has no size.
std::uint64_t size_of(const std::filesystem::path& path);

/// Lines of any file of any size in constant memory. A byte order mark and carriage returns at line ends are taken off.
class LineReader {
 public:
  /// @throws DataError when the file is missing, a folder, or empty.
  explicit LineReader(std::filesystem::path path);

  /// The next line without its end, valid until the next call; nullopt at the end of the file. A last line without line
  /// end is not given, because it may have been cut: see cut_tail().
  /// @throws DataError for a line of more than 64 kB or when reading fails.
  std::optional<std::string_view> next();
  /// True when the file ends without a line end.
  bool cut_tail() const { return cut_tail_; }

  /// "file:line" of the line that next() gave.
  std::string where() const { return path_.string() + ":" + std::to_string(line_); }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  std::ifstream file_;
  std::vector<char> buffer_;
  std::int64_t line_ = 0;
  bool cut_tail_ = false;
};

/// Without blanks and tabs at both ends.
std::string_view trim(std::string_view text);

/// The next word between blanks or tabs, taken off the front of rest; empty at the end.
std::string_view next_word(std::string_view& rest);

/// Cells between commas, trimmed. The result is kept in cells, to save allocations.
void split_cells(std::string_view line, std::vector<std::string_view>& cells);

/// The number that all of text is, nan and inf included; nullopt when it is none or out of range.
std::optional<double> parse_number(std::string_view text);
std::optional<std::int64_t> parse_integer(std::string_view text);

/// A time in units of 10^exponent seconds, exact to the nanosecond; nullopt when it is none or out of range.
std::optional<TimeNs> parse_time(std::string_view text, int exponent);

/// Shortest text that reads back as the same double.
void append_number(std::string& text, double value);

/// A new file beside path that takes its place in commit(): a reader sees the old or the new one, never half. A
/// symbolic link stays one, what it leads to is replaced; the new file has the permissions of the old one.
class AtomicFile {
 public:
  /// @throws DataError when it cannot be made, for a link that leads nowhere, and for what is no regular file.
  explicit AtomicFile(const std::filesystem::path& path);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();
  std::ostream& stream() { return file_; }
  /// @throws DataError when not everything could be written.
  void commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;
  std::ofstream file_;
  bool committed_ = false;
};

}  // namespace loc::io
