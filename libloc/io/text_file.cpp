#include "libloc/io/text_file.hpp"

#include <unistd.h>

#include <charconv>
#include <locale>
#include <stdexcept>
#include <system_error>

namespace loc::io {
namespace {

constexpr std::size_t kLongestLine = 65536;

// What is to be replaced when path is written.
std::filesystem::path behind_links(const std::filesystem::path& path) {
  const auto status = status_of(path);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw DataError(path.string() + ": cannot be written: is no regular file");
  }
  std::error_code error;
  if (!std::filesystem::is_symlink(path, error)) return path;
  if (!std::filesystem::exists(status)) {
    throw DataError(path.string() + ": cannot be written: the link leads to no file");
  }
  auto target = std::filesystem::canonical(path, error);
  if (error) throw DataError(path.string() + ": " + error.message());
  return target;
}

}  // namespace

std::filesystem::file_status status_of(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::status_known(status)) {
    throw DataError(path.string() + ": " + error.message());
  }
  return status;
}

std::uint64_t size_of(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw DataError(path.string() + ": cannot be read: " + error.message());
  return size;
}

LineReader::LineReader(std::filesystem::path path) : path_(std::move(path)), buffer_(kLongestLine) {
  const auto status = status_of(path_);
  if (!std::filesystem::exists(status)) throw DataError(path_.string() + ": no such file");
  if (std::filesystem::is_directory(status)) throw DataError(path_.string() + ": is a folder, not a file");
  file_.open(path_, std::ios::binary);
  if (!file_) throw DataError(path_.string() + ": cannot be opened");
  if (file_.peek() == std::ifstream::traits_type::eof()) throw DataError(path_.string() + ": the file is empty");
}

std::optional<std::string_view> LineReader::next() {
  if (cut_tail_ || !file_.good()) return std::nullopt;
  file_.getline(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
  auto length = static_cast<std::size_t>(file_.gcount());
  ++line_;
  if (file_.bad()) throw DataError(where() + ": reading failed");
  if (file_.eof()) {
    cut_tail_ = length > 0;
    return std::nullopt;
  }
  if (file_.fail()) throw DataError(where() + ": longer than " + std::to_string(kLongestLine) + " bytes");
  --length;  // the line end was taken too
  std::string_view line(buffer_.data(), length);
  if (line_ == 1 && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::string_view next_word(std::string_view& rest) {
  rest = trim(rest);
  const std::string_view word = rest.substr(0, rest.find_first_of(" \t"));
  rest.remove_prefix(word.size());
  return word;
}

void split_cells(std::string_view line, std::vector<std::string_view>& cells) {
  cells.clear();
  for (;;) {
    const auto comma = line.find(',');
    cells.push_back(trim(line.substr(0, comma)));
    if (comma == std::string_view::npos) return;
    line.remove_prefix(comma + 1);
  }
}

std::optional<double> parse_number(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<std::int64_t> parse_integer(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<TimeNs> parse_time(std::string_view text, int exponent) {
  if (exponent == -9) {
    if (const auto ns = parse_integer(text)) return *ns == kNoTime ? std::nullopt : ns;
  }
  // The decimal exponent is moved instead of the value being multiplied: stays exact.
  std::string_view mantissa = text;
  std::int64_t own_exponent = 0;
  if (const auto e = text.find_first_of("eE"); e != std::string_view::npos) {
    std::string_view digits = text.substr(e + 1);
    if (digits.starts_with('+') && !digits.starts_with("+-")) digits.remove_prefix(1);
    const auto value = parse_integer(digits);
    if (!value || *value < -30 || *value > 30) return std::nullopt;
    own_exponent = *value;
    mantissa = text.substr(0, e);
  }
  try {
    return parse_seconds(std::string(mantissa) + "e" + std::to_string(own_exponent + exponent));
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
}

void append_number(std::string& text, double value) {
  std::array<char, 32> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  text.append(buffer.data(), end);
}

AtomicFile::AtomicFile(const std::filesystem::path& path)
    : path_(behind_links(path)), temporary_(path_.string() + "." + std::to_string(::getpid()) + ".tmp") {
  file_.imbue(std::locale::classic());  // the global one may write 1280 as 1.280
  file_.open(temporary_, std::ios::binary | std::ios::trunc);
  if (!file_) throw DataError(path_.string() + ": cannot be written");
  const auto old = status_of(path_);
  if (!std::filesystem::exists(old)) return;
  std::error_code error;
  // Before anything is in it: what only its owner may read stays so.
  std::filesystem::permissions(temporary_, old.permissions(), error);
  if (error) {
    file_.close();
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);
    throw DataError(path_.string() + ": its permissions cannot be kept: " + error.message());
  }
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  file_.close();
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void AtomicFile::commit() {
  file_.close();
  if (!file_) throw DataError(path_.string() + ": not everything could be written");
  std::error_code error;
  std::filesystem::rename(temporary_, path_, error);
  if (error) throw DataError(path_.string() + ": " + error.message());
  committed_ = true;
}

}  // namespace loc::io
