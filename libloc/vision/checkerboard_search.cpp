// Checkerboards: OpenCV finds them, here they are checked, numbered and refined.
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "libloc/vision/target_search.hpp"

namespace loc::vision {
namespace {

using Corners = std::vector<cv::Point2f>;

constexpr int kQuickSide = 480;    // [px] larger pictures are searched at half the size, or less
constexpr int kSearchSide = 1200;  // where it may take longer

// A grid of corners as found, to be read in another order.
struct Grid {
  Corners corners;
  int columns;
  int rows;
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
  }
  const cv::Point2f& at(int column, int row) const { return corners[index(column, row)]; }
  Grid turned() const {  // by half a turn
    Grid out = *this;
    std::ranges::reverse(out.corners);
    return out;
  }
  Grid mirrored() const {  // rows from the other side
    Grid out = *this;
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < columns; ++c) out.corners[index(c, r)] = at(c, rows - 1 - r);
    }
    return out;
  }
};

// By how much a picture is made smaller so that its longer side is at most so long.
int shrink_to(const cv::Mat& gray, int side) {
  return (std::max(gray.cols, gray.rows) + side - 1) / side;
}

// A picture that is shrunk, and corners in it put back to the whole one.
class Smaller {
 public:
  Smaller(const cv::Mat& gray, int shrink) : whole_(gray.size()), picture_(gray) {
    if (shrink > 1) cv::resize(gray, picture_, {gray.cols / shrink, gray.rows / shrink}, 0, 0, cv::INTER_AREA);
  }
  const cv::Mat& picture() const { return picture_; }
  void put_back(Corners& corners) const {
    const float x = static_cast<float>(whole_.width) / static_cast<float>(picture_.cols);
    const float y = static_cast<float>(whole_.height) / static_cast<float>(picture_.rows);
    for (cv::Point2f& p : corners) p = {(p.x + 0.5F) * x - 0.5F, (p.y + 0.5F) * y - 0.5F};
  }

 private:
  cv::Size whole_;
  cv::Mat picture_;
};

// Shortest side of a square, and whether the corners are a regular grid: each between its neighbours.
bool regular(const Grid& grid, double& spacing) {
  spacing = 1e9;
  const auto check_line = [&](const cv::Point2f& a, const cv::Point2f& b, const cv::Point2f& c) {
    const double whole = cv::norm(c - a);
    return cv::norm((a + c) * 0.5F - b) < 0.2 * whole;
  };
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.columns; ++c) {
      const cv::Point2f p = grid.at(c, r);
      if (c + 1 < grid.columns) spacing = std::min(spacing, cv::norm(grid.at(c + 1, r) - p));
      if (r + 1 < grid.rows) spacing = std::min(spacing, cv::norm(grid.at(c, r + 1) - p));
      if (c > 0 && c + 1 < grid.columns && !check_line(grid.at(c - 1, r), p, grid.at(c + 1, r))) return false;
      if (r > 0 && r + 1 < grid.rows && !check_line(grid.at(c, r - 1), p, grid.at(c, r + 1))) return false;
    }
  }
  return spacing > 2;
}

// Black squares of a picture with one threshold are found quickest. With thresholds for each place OpenCV tries 56
// times instead of 16: up to 0.7 s in a small picture of a part of the board, seconds in a large one. What that would
// find the search for saddles finds nearly always, sooner, so that it comes last. One that finds corners which are no
// grid has found nothing. Gives the spacing of regular(), too.
std::optional<Grid> search(const cv::Mat& gray, const cv::Size& size, bool thorough, double& spacing) {
  constexpr int kEachPlace = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE;
  Grid grid{{}, size.width, size.height};
  const auto is_grid = [&](bool found, const Smaller& searched) {
    if (!found || grid.corners.size() != static_cast<std::size_t>(size.area())) return false;
    searched.put_back(grid.corners);
    return regular(grid, spacing);
  };
  const Smaller small(gray, shrink_to(gray, kQuickSide));
  const auto squares = [&](int flags) {
    return is_grid(cv::findChessboardCorners(small.picture(), size, grid.corners, flags | cv::CALIB_CB_FAST_CHECK),
                   small);
  };
  const auto saddles = [&](const Smaller& searched) {
    return is_grid(cv::findChessboardCornersSB(searched.picture(), size, grid.corners, cv::CALIB_CB_NORMALIZE_IMAGE),
                   searched);
  };
  const bool found =
      squares(0) || (thorough ? saddles({gray, shrink_to(gray, kSearchSide)}) || squares(kEachPlace) : saddles(small));
  if (!found) return std::nullopt;
  return grid;
}

// Mean brightness of the squares inside the grid whose column + row is even, less that of the odd ones.
std::optional<double> even_less_odd(const cv::Mat& gray, const Grid& grid) {
  double sums[2] = {0, 0};
  int counts[2] = {0, 0};
  for (int r = 0; r + 1 < grid.rows; ++r) {
    for (int c = 0; c + 1 < grid.columns; ++c) {
      const cv::Point2f middle =
          (grid.at(c, r) + grid.at(c + 1, r) + grid.at(c, r + 1) + grid.at(c + 1, r + 1)) * 0.25F;
      const auto value = brightness(gray, middle);
      if (!value) return std::nullopt;
      sums[(c + r) % 2] += *value;
      ++counts[(c + r) % 2];
    }
  }
  if (counts[0] == 0 || counts[1] == 0) return std::nullopt;
  return sums[0] / counts[0] - sums[1] / counts[1];
}

// So that x is right, y up on a board that is looked at from its front, and the corner's square of the board is black.
Grid numbered(const cv::Mat& gray, Grid grid) {
  const cv::Point2f along_x = grid.at(grid.columns - 1, 0) - grid.at(0, 0);
  const cv::Point2f along_y = grid.at(0, grid.rows - 1) - grid.at(0, 0);
  if (along_x.cross(along_y) > 0) grid = grid.mirrored();  // in the picture y counts downwards
  // Squares (0, 0) and (-1, -1), diagonal neighbours, have one colour.
  const auto difference = even_less_odd(gray, grid);
  if (difference && *difference > 0 && (grid.columns + grid.rows) % 2 == 1) grid = grid.turned();
  return grid;
}

// True for a corner that lies where those around it say.
bool among_neighbours(const Grid& grid, const std::vector<bool>& good, int column, int row) {
  std::vector<cv::Point2d> board;
  std::vector<cv::Point2d> pixels;
  const cv::Point2f corner = grid.at(column, row);
  double spacing = 1e9;
  for (int reach = 2; reach <= 4 && board.size() < kFewestForSmooth; ++reach) {  // at the border there are fewer
    board.clear();
    pixels.clear();
    for (int r = std::max(0, row - reach); r <= std::min(grid.rows - 1, row + reach); ++r) {
      for (int c = std::max(0, column - reach); c <= std::min(grid.columns - 1, column + reach); ++c) {
        if ((r == row && c == column) || !good[grid.index(c, r)]) continue;
        board.emplace_back(c - column, r - row);
        pixels.emplace_back(grid.at(c, r));
        spacing = std::min(spacing, cv::norm(grid.at(c, r) - corner));
      }
    }
  }
  const auto expected = smooth_place(board, pixels);
  return !expected || cv::norm(*expected - cv::Point2d(corner)) <= 0.08 * spacing + 0.6;
}

}  // namespace

TargetDetection find_checkerboard(const cv::Mat& gray, const CalibrationTarget& target,
                                  const TargetDetectorOptions& options) {
  TargetDetection out;
  double spacing = 0;
  std::optional<Grid> found = search(gray, {target.columns, target.rows}, options.thorough, spacing);
  if (!found) {
    out.reason =
        "no checkerboard of " + std::to_string(target.columns) + " x " + std::to_string(target.rows) + " inner corners";
    return out;
  }
  Grid grid = std::move(*found);
  const auto contrast = even_less_odd(gray, grid);
  if (target.columns > 2 && target.rows > 2 && !(contrast && std::abs(*contrast) >= options.min_contrast)) {
    out.reason = "the checkerboard has too little contrast";
    return out;
  }
  grid = numbered(gray, std::move(grid));
  // A third of the shortest side: no window reaches the next corner.
  const int half_side = std::clamp(static_cast<int>(spacing / 3), 2, 5 * shrink_to(gray, kSearchSide));
  const std::vector<bool> good =
      refine_corners(gray, grid.corners, half_side, 0.25 * spacing + 1, options.max_disagreement_px);
  for (std::size_t i = 0; i < grid.corners.size(); ++i) {
    if (!good[i] ||
        !among_neighbours(grid, good, static_cast<int>(i) % grid.columns, static_cast<int>(i) / grid.columns)) {
      ++out.corners_left_out;
      continue;
    }
    out.view.corners.push_back({static_cast<std::int32_t>(i), {grid.corners[i].x, grid.corners[i].y}});
  }
  if (out.view.corners.empty()) out.reason = "no corner of the checkerboard is sharp enough to be placed";
  return out;
}

}  // namespace loc::vision
