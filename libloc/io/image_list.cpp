#include "libloc/io/image_list.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <optional>
#include <string_view>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"

namespace loc {
namespace {

namespace fs = std::filesystem;

constexpr double kLongestNs = 9e18;

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

bool is_picture(const fs::path& path) {
  static constexpr std::array<std::string_view, 9> kEndings{".png",  ".jpg", ".jpeg", ".bmp", ".tif",
                                                            ".tiff", ".pgm", ".ppm",  ".webp"};
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
  return std::ranges::find(kEndings, ending) != kEndings.end();
}

bool is_kept_picture(const fs::path& path) {
  return !path.filename().string().starts_with('.') && is_picture(path);
}

// 2 before 10: digits are compared as numbers, all else as letters.
bool natural_less(std::string_view a, std::string_view b) {
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
      continue;
    }
    const auto number = [](std::string_view text, std::size_t& at) {
      while (at < text.size() && text[at] == '0') ++at;
      const std::size_t begin = at;
      while (at < text.size() && is_digit(text[at])) ++at;
      return text.substr(begin, at - begin);
    };
    const std::string_view x = number(a, i);
    const std::string_view y = number(b, j);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  if ((i < a.size()) != (j < b.size())) return j < b.size();
  return a < b;  // 1 and 01
}

std::vector<fs::path> pictures_in(const fs::path& folder) {
  if (!fs::is_directory(io::status_of(folder))) throw DataError(folder.string() + ": no such folder");
  std::vector<fs::path> out;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (is_kept_picture(entry->path())) out.push_back(entry->path());
  }
  if (error) throw DataError(folder.string() + ": cannot be read: " + error.message());
  if (out.empty()) throw DataError(folder.string() + ": no pictures in it (png, jpg, bmp, tif, pgm, ppm, webp)");
  std::ranges::sort(out, [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return out;
}

int exponent_of(const std::string& unit, const std::string& where) {
  if (unit == "ns") return -9;
  if (unit == "us") return -6;
  if (unit == "ms") return -3;
  if (unit == "s") return 0;
  throw DataError(where + ": unit of time '" + unit + "': must be ns, us, ms or s");
}

// Pictures in order of time, each later than the one before it.
class Collector {
 public:
  void add(TimeNs time_ns, fs::path file) {
    if (!list_.entries.empty() && time_ns <= list_.entries.back().time_ns) {
      ++back_;
      return;
    }
    list_.entries.push_back({time_ns, std::move(file)});
  }
  ImageList take() {
    if (back_ > 0) list_.counts.push_back({"image.skipped.time_not_increasing", back_});
    return std::move(list_);
  }

 private:
  ImageList list_;
  std::int64_t back_ = 0;
};

struct NamedTime {
  TimeNs time_ns;
  std::string name;
};

std::string unit_in_heading(std::string_view line) {
  for (const char* unit : {"ns", "us", "ms", "s"}) {
    if (line.find("[" + std::string(unit) + "]") != std::string_view::npos) return unit;
  }
  return {};
}

// Cells between commas where there is one, otherwise between blanks; a name may hold blanks.
NamedTime parse_line(std::string_view line, const std::string& unit, const std::string& where) {
  const auto comma = line.find(',');
  std::string_view rest = line;
  std::string_view time;
  if (comma != std::string_view::npos) {
    time = io::trim(line.substr(0, comma));
    rest = line.substr(comma + 1);
  } else {
    time = io::next_word(rest);
  }
  const auto time_ns = io::parse_time(time, exponent_of(unit, where));
  if (!time_ns) throw DataError(where + ": '" + std::string(time) + "' is not a time in " + unit);
  return {*time_ns, std::string(io::trim(rest))};
}

fs::path mav_folder(const fs::path& folder) {
  return fs::is_directory(io::status_of(folder / "mav0")) ? folder / "mav0" : folder;
}

std::optional<std::int64_t> last_number(std::string_view stem) {
  std::size_t end = stem.size();
  while (end > 0 && !is_digit(stem[end - 1])) --end;
  std::size_t begin = end;
  while (begin > 0 && is_digit(stem[begin - 1])) --begin;
  return io::parse_integer(stem.substr(begin, end - begin));
}

}  // namespace

bool is_image_folder(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (is_kept_picture(entry->path())) return true;
  }
  return false;
}

std::vector<std::int32_t> euroc_cameras(const fs::path& folder) {
  const fs::path mav = mav_folder(folder);
  std::vector<std::int32_t> out;
  std::error_code error;
  for (fs::directory_iterator entry(mav, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with("cam") || name.size() > 6) continue;
    const auto number = io::parse_integer(std::string_view(name).substr(3));
    if (number && *number >= 0 && fs::exists(io::status_of(entry->path() / "data.csv"))) {
      out.push_back(static_cast<std::int32_t>(*number));
    }
  }
  std::ranges::sort(out);
  return out;
}

ImageList list_euroc_images(const fs::path& folder, std::int32_t camera) {
  const fs::path base = mav_folder(folder) / ("cam" + std::to_string(camera));
  return read_image_list(base / "data.csv", base / "data", "ns");
}

ImageList read_image_list(const fs::path& list, const fs::path& folder, const std::string& unit) {
  io::LineReader lines(list);
  std::string used_unit = unit;
  std::vector<NamedTime> rows;
  while (const auto line = lines.next()) {
    const std::string_view text = io::trim(*line);
    if (text.empty()) continue;
    if (text.starts_with('#')) {
      if (used_unit.empty() && rows.empty()) used_unit = unit_in_heading(text);
      continue;
    }
    if (used_unit.empty()) used_unit = "s";
    rows.push_back(parse_line(text, used_unit, lines.where()));
    if (rows.back().name.empty() != rows.front().name.empty()) {
      throw DataError(lines.where() + (rows.back().name.empty() ? ": no name of a picture; the lines before have one"
                                                                : ": a name; the lines before have none"));
    }
  }
  if (rows.empty()) throw DataError(list.string() + ": no complete line with a time and a picture");
  Collector collector;
  if (rows.front().name.empty()) {
    const std::vector<fs::path> pictures = pictures_in(folder);
    if (pictures.size() != rows.size()) {
      throw DataError(list.string() + ": " + std::to_string(rows.size()) + " times, but " +
                      std::to_string(pictures.size()) + " pictures in " + folder.string());
    }
    for (std::size_t i = 0; i < rows.size(); ++i) collector.add(rows[i].time_ns, pictures[i]);
  } else {
    for (const NamedTime& row : rows) collector.add(row.time_ns, folder / row.name);
  }
  ImageList out = collector.take();
  if (lines.cut_tail()) out.counts.push_back({"image.skipped.no_line_end", 1});
  return out;
}

ImageList list_images_at_rate(const fs::path& folder, double rate_hz, TimeNs first_time_ns) {
  require_positive("rate_hz", rate_hz);
  const std::vector<fs::path> pictures = pictures_in(folder);
  std::vector<std::int64_t> numbers;
  for (const fs::path& picture : pictures) {
    const auto number = last_number(picture.stem().string());
    if (!number) break;
    numbers.push_back(*number);
  }
  const bool numbered = numbers.size() == pictures.size();
  std::int64_t step = 0;
  for (std::size_t i = 1; numbered && i < numbers.size(); ++i) {
    const std::int64_t difference = numbers[i] - numbers[i - 1];
    if (difference <= 0) {
      throw DataError(pictures[i].string() + ": its number does not come after that of " +
                      pictures[i - 1].filename().string() + "; are there two series of pictures in the folder?");
    }
    step = step == 0 ? difference : std::min(step, difference);
  }
  ImageList out;
  std::int64_t missing = 0;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    auto index = static_cast<std::int64_t>(i);
    if (numbered && i > 0) {
      const std::int64_t distance = numbers[i] - numbers[0];
      if (distance % step != 0) {
        throw DataError(pictures[i].string() + ": the numbers of the pictures go up by " + std::to_string(step) +
                        ", and this one does not fit; if they are times, name their unit in place of a rate");
      }
      index = distance / step;
      missing = index - static_cast<std::int64_t>(i);
    }
    const double since_first_ns = std::round(static_cast<double>(index) / rate_hz * 1e9);
    if (since_first_ns + static_cast<double>(first_time_ns) > kLongestNs) {
      throw DataError(pictures[i].string() + ": its number gives a time that is out of range");
    }
    out.entries.push_back({first_time_ns + static_cast<TimeNs>(since_first_ns), pictures[i]});
  }
  if (missing > 0) out.counts.push_back({"image.missing_numbers", missing});
  return out;
}

ImageList list_images_by_name(const fs::path& folder, const std::string& unit) {
  const int exponent = exponent_of(unit, folder.string());
  std::vector<ImageListEntry> entries;
  for (const fs::path& picture : pictures_in(folder)) {
    const auto time_ns = io::parse_time(picture.stem().string(), exponent);
    if (!time_ns) throw DataError(picture.string() + ": its name is not a time in " + unit);
    entries.push_back({*time_ns, picture});
  }
  std::ranges::stable_sort(entries, {}, &ImageListEntry::time_ns);
  Collector collector;
  for (ImageListEntry& entry : entries) collector.add(entry.time_ns, std::move(entry.file));
  return collector.take();
}

}  // namespace loc
