// The two searches of vision/target_detector. Internal to vision.
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <vector>

#include "libloc/vision/target_detector.hpp"

namespace loc::vision {

/// Mean over a square of some samples around a place, bilinear; nullopt outside the image.
std::optional<double> brightness(const cv::Mat& gray, const cv::Point2f& at);

/// Refines corners in place in windows of half side and half side + 1. @return of each whether it stayed in place
/// between them (within max_disagreement_px), within max_way_px of its start, and inside the image.
std::vector<bool> refine_corners(const cv::Mat& gray, std::vector<cv::Point2f>& corners, int half_side,
                                 double max_way_px, double max_disagreement_px);

inline constexpr std::size_t kFewestForSmooth = 10;
/// Where the place (0, 0) of the board must be in the picture, from places around it: the polynomial of second order
/// through them, those that do not fit outvoted. nullopt for fewer than kFewestForSmooth.
std::optional<cv::Point2d> smooth_place(std::span<const cv::Point2d> board, std::span<const cv::Point2d> pixels);

/// @param gray one channel, 8 bits
TargetDetection find_checkerboard(const cv::Mat& gray, const CalibrationTarget& target,
                                  const TargetDetectorOptions& options);

/// Keeps the tables of the tag family.
class AprilGridSearch {
 public:
  AprilGridSearch(const CalibrationTarget& target, const TargetDetectorOptions& options);
  AprilGridSearch(const AprilGridSearch&) = delete;
  AprilGridSearch& operator=(const AprilGridSearch&) = delete;
  ~AprilGridSearch();
  TargetDetection find(const cv::Mat& gray) const;

 private:
  struct Library;
  CalibrationTarget target_;
  TargetDetectorOptions options_;
  std::unique_ptr<Library> library_;
};

}  // namespace loc::vision
