#include "libloc/sensors/target.hpp"

#include <charconv>
#include <sstream>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr int kFamilySize = 587;  // tags 36h11
constexpr int kMaxSide = 1000;

constexpr const char* kForm = "must be like 'checkerboard 9x6 0.025' or 'aprilgrid 6x6 0.088 0.3'";

template <class Number>
Number number_of(const std::string& word, const std::string& text, const char* what) {
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  require(error == std::errc{} && end == word.data() + word.size(),
          "target = '" + text + "': '" + word + "' is no " + what + "; it " + kForm);
  return value;
}

}  // namespace

void CalibrationTarget::check() const {
  const bool board = kind == TargetKind::kCheckerboard;
  require(columns >= (board ? 2 : 1) && columns <= kMaxSide, "target.columns", columns,
          board ? "must be 2 to 1000 inner corners" : "must be 1 to 1000 tags");
  require(rows >= (board ? 2 : 1) && rows <= kMaxSide, "target.rows", rows,
          board ? "must be 2 to 1000 inner corners" : "must be 1 to 1000 tags");
  require_positive("target.size_m", size_m);
  require(size_m <= 100, "target.size_m", size_m, "is more than 100 m: lengths are in metres");
  if (board) return;
  require(spacing > 0 && spacing <= 10, "target.spacing", spacing, "must be positive and at most 10 times the tag");
  require(first_tag >= 0, "target.first_tag", first_tag, "must not be negative");
  require(first_tag + columns * rows <= kFamilySize, "target's last tag", first_tag + columns * rows - 1,
          "the family 36h11 ends at 586");
}

int CalibrationTarget::corner_count() const {
  return columns * rows * (kind == TargetKind::kCheckerboard ? 1 : 4);
}

Eigen::Vector3d CalibrationTarget::corner(int id) const {
  require(id >= 0 && id < corner_count(), "target corner", id, "there is no such corner on " + target_text(*this));
  if (kind == TargetKind::kCheckerboard) return {id % columns * size_m, id / columns * size_m, 0};
  const int tag = id / 4;
  const int k = id % 4;
  const double pitch = size_m * (1 + spacing);
  return {tag % columns * pitch + (k == 1 || k == 2 ? size_m : 0), tag / columns * pitch + (k >= 2 ? size_m : 0), 0};
}

bool CalibrationTarget::has_direction() const {
  return kind == TargetKind::kAprilGrid || (columns + rows) % 2 == 1;
}

CalibrationTarget parse_target(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  CalibrationTarget target;
  const bool board = !words.empty() && words[0] == "checkerboard";
  const bool grid = !words.empty() && words[0] == "aprilgrid";
  require((board && words.size() == 3) || (grid && (words.size() == 4 || words.size() == 5)),
          "target = '" + text + "': " + kForm + ", with inner corners or tags along x and y, and lengths in metres");
  const std::size_t cross = words[1].find('x');
  require(cross != std::string::npos, "target = '" + text + "': '" + words[1] + "' is no size like 9x6; it " + kForm);
  target.columns = number_of<int>(words[1].substr(0, cross), text, "whole number");
  target.rows = number_of<int>(words[1].substr(cross + 1), text, "whole number");
  target.size_m = number_of<double>(words[2], text, "length in metres");
  if (grid) {
    target.kind = TargetKind::kAprilGrid;
    target.spacing = number_of<double>(words[3], text, "ratio");
    if (words.size() == 5) target.first_tag = number_of<int>(words[4], text, "whole number");
  }
  target.check();
  return target;
}

std::string target_text(const CalibrationTarget& target) {
  const bool board = target.kind == TargetKind::kCheckerboard;
  std::string text = board ? "checkerboard " : "aprilgrid ";
  text += std::to_string(target.columns) + "x" + std::to_string(target.rows) + " " + to_text(target.size_m);
  if (!board) text += " " + to_text(target.spacing);
  if (!board && target.first_tag != 0) text += " " + std::to_string(target.first_tag);
  return text;
}

void TargetView::check(const CalibrationTarget& target) const {
  std::vector<bool> seen(static_cast<std::size_t>(target.corner_count()));
  for (const TargetCorner& corner : corners) {
    require(corner.id >= 0 && corner.id < target.corner_count(), "corner id", corner.id,
            "there is no such corner on " + target_text(target));
    require(!seen[static_cast<std::size_t>(corner.id)], "corner id", corner.id, "comes twice in one view");
    seen[static_cast<std::size_t>(corner.id)] = true;
    require(corner.pixel_px.allFinite(), "corner " + std::to_string(corner.id) + ": its pixel must be finite");
  }
}

}  // namespace loc
