#include "libloc/vision/target_detector.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "libloc/core/check.hpp"
#include "libloc/vision/image_view.hpp"
#include "libloc/vision/target_search.hpp"

namespace loc {
namespace vision {

std::optional<double> brightness(const cv::Mat& gray, const cv::Point2f& at) {
  // NaN fails both.
  if (!(at.x >= 0 && at.x <= static_cast<float>(gray.cols - 1)) ||
      !(at.y >= 0 && at.y <= static_cast<float>(gray.rows - 1))) {
    return std::nullopt;
  }
  const int x = std::min(static_cast<int>(at.x), gray.cols - 2);
  const int y = std::min(static_cast<int>(at.y), gray.rows - 2);
  if (x < 0 || y < 0) return std::nullopt;
  const double u = at.x - static_cast<float>(x);
  const double v = at.y - static_cast<float>(y);
  const std::uint8_t* above = gray.ptr(y) + x;
  const std::uint8_t* below = gray.ptr(y + 1) + x;
  return (1 - v) * ((1 - u) * above[0] + u * above[1]) + v * ((1 - u) * below[0] + u * below[1]);
}

std::vector<bool> refine_corners(const cv::Mat& gray, std::vector<cv::Point2f>& corners, int half_side,
                                 double max_way_px, double max_disagreement_px) {
  std::vector<bool> good(corners.size(), false);
  const int wide = half_side + 1;
  // OpenCV demands an image larger than the window.
  if (corners.empty() || gray.cols < 2 * wide + 5 || gray.rows < 2 * wide + 5) return good;
  const auto inside = [&](const cv::Point2f& p) {
    return p.x >= static_cast<float>(wide) && p.x <= static_cast<float>(gray.cols - 1 - wide) &&
           p.y >= static_cast<float>(wide) && p.y <= static_cast<float>(gray.rows - 1 - wide);
  };
  std::vector<std::size_t> index;
  std::vector<cv::Point2f> narrow_end;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (!inside(corners[i])) continue;
    index.push_back(i);
    narrow_end.push_back(corners[i]);
  }
  if (index.empty()) return good;
  const cv::TermCriteria end(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 40, 1e-3);
  cv::cornerSubPix(gray, narrow_end, {half_side, half_side}, {-1, -1}, end);
  std::vector<cv::Point2f> wide_end = narrow_end;
  cv::cornerSubPix(gray, wide_end, {wide, wide}, {-1, -1}, end);
  for (std::size_t k = 0; k < index.size(); ++k) {
    cv::Point2f& corner = corners[index[k]];
    good[index[k]] = inside(narrow_end[k]) && cv::norm(narrow_end[k] - wide_end[k]) <= max_disagreement_px &&
                     cv::norm(narrow_end[k] - corner) <= max_way_px;
    corner = narrow_end[k];
  }
  return good;
}

std::optional<cv::Point2d> smooth_place(std::span<const cv::Point2d> board, std::span<const cv::Point2d> pixels) {
  if (board.size() < kFewestForSmooth) return std::nullopt;
  Eigen::Matrix<double, 6, 2> solution;
  for (int round = 0; round < 3; ++round) {
    Eigen::Matrix<double, 6, 6> A = 1e-9 * Eigen::Matrix<double, 6, 6>::Identity();
    Eigen::Matrix<double, 6, 2> b = Eigen::Matrix<double, 6, 2>::Zero();
    for (std::size_t n = 0; n < board.size(); ++n) {
      const cv::Point2d& p = board[n];
      Eigen::Matrix<double, 6, 1> row;
      row << 1, p.x, p.y, p.x * p.x, p.x * p.y, p.y * p.y;
      const Eigen::RowVector2d pixel(pixels[n].x, pixels[n].y);
      const double w = round == 0 ? 1 : 1 / (1 + (row.transpose() * solution - pixel).squaredNorm());
      A += w * row * row.transpose();
      b += w * row * pixel;
    }
    solution = A.ldlt().solve(b);
  }
  if (!solution.allFinite()) return std::nullopt;
  return cv::Point2d(solution(0, 0), solution(0, 1));
}

}  // namespace vision

void TargetDetectorOptions::check() const {
  require(min_tags >= 1, "min_tags", min_tags, "must be positive");
  require(min_contrast >= 1 && min_contrast <= 255, "min_contrast", min_contrast, "must be 1 to 255 grey levels");
  require_positive("max_disagreement_px", max_disagreement_px);
}

struct TargetDetector::Parts {
  CalibrationTarget target;
  TargetDetectorOptions options;
  std::unique_ptr<vision::AprilGridSearch> grid;
};

TargetDetector::TargetDetector(const CalibrationTarget& target, const TargetDetectorOptions& options)
    : parts_(std::make_unique<Parts>()) {
  target.check();
  options.check();
  parts_->target = target;
  parts_->options = options;
  if (target.kind == TargetKind::kAprilGrid) parts_->grid = std::make_unique<vision::AprilGridSearch>(target, options);
}

TargetDetector::TargetDetector(TargetDetector&&) noexcept = default;
TargetDetector& TargetDetector::operator=(TargetDetector&&) noexcept = default;
TargetDetector::~TargetDetector() = default;

const CalibrationTarget& TargetDetector::target() const {
  return parts_->target;
}

TargetDetection TargetDetector::detect(const ImageMeasurement& image) const {
  cv::Mat gray = view_of(image);
  if (image.format != PixelFormat::kGray) {
    cv::Mat converted;
    cv::cvtColor(gray, converted, image.format == PixelFormat::kRgb ? cv::COLOR_RGB2GRAY : cv::COLOR_BGR2GRAY);
    gray = converted;
  }
  TargetDetection out;
  constexpr int kSmallest = 24;  // [px] nothing that could be told from noise
  if (gray.cols < kSmallest || gray.rows < kSmallest) {
    out.reason = "the picture has " + std::to_string(gray.cols) + " x " + std::to_string(gray.rows) + " pixels";
  } else {
    try {
      out = parts_->grid ? parts_->grid->find(gray) : vision::find_checkerboard(gray, parts_->target, parts_->options);
    } catch (const cv::Exception& error) {
      // What OpenCV refuses on its way (degenerate outlines and the like) says nothing else about the picture.
      out = {};
      out.reason = "OpenCV could not search it: " + error.err;
    }
  }
  out.view.time_ns = image.time_ns;
  return out;
}

}  // namespace loc
