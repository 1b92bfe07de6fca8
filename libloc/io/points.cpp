#include "libloc/io/points.hpp"

#include <array>
#include <cmath>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/io/text_file.hpp"

namespace loc {
namespace {

constexpr std::array<const char*, 3> kNames{"x", "y", "z"};

void split(std::string_view row, std::vector<std::string_view>& cells) {
  if (row.find(',') != std::string_view::npos) {
    io::split_cells(row, cells);
    return;
  }
  cells.clear();
  while (true) {
    const std::string_view word = io::next_word(row);
    if (word.empty()) return;
    cells.push_back(word);
  }
}

}  // namespace

PointsFile read_points(const std::filesystem::path& path) {
  io::LineReader lines(path);
  PointsFile file;
  std::vector<std::string_view> cells;
  bool first = true;
  while (const auto line = lines.next()) {
    const std::string_view row = io::trim(line->substr(0, line->find('#')));
    if (row.empty()) continue;
    split(row, cells);
    const bool heading = first && cells.size() == 3 && cells[0] == "x" && cells[1] == "y" && cells[2] == "z";
    first = false;
    if (heading) continue;
    if (cells.size() != 3) {
      throw DataError(lines.where() + ": " + std::to_string(cells.size()) + " columns; a point has x y z");
    }
    Eigen::Vector3d point;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view cell = cells[static_cast<std::size_t>(axis)];
      const auto value = io::parse_number(cell);
      if (!value || !std::isfinite(*value)) {
        throw DataError(lines.where() + ": " + kNames.at(static_cast<std::size_t>(axis)) + " = '" + std::string(cell) +
                        "' is not a finite number");
      }
      point[axis] = *value;
    }
    file.points.push_back(point);
  }
  if (file.points.empty()) throw DataError(path.string() + ": no complete point in it");
  file.counts.push_back({"points.read", std::ssize(file.points)});
  if (lines.cut_tail()) file.counts.push_back({"points.skipped.no_line_end", 1});
  return file;
}

void write_points(const std::filesystem::path& path, const std::vector<Eigen::Vector3d>& points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    require(points[i].allFinite(), "points[" + std::to_string(i) + "]: must be finite");
  }
  io::AtomicFile file(path);
  file.stream() << "# x y z [m]\n";
  std::string line;
  for (const Eigen::Vector3d& point : points) {
    line.clear();
    for (const double value : point) {
      if (!line.empty()) line += ' ';
      io::append_number(line, value);
    }
    file.stream() << line << '\n';
  }
  file.commit();
}

}  // namespace loc
