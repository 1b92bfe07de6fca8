#include "libloc/vision/image_file.hpp"

#include <opencv2/imgcodecs.hpp>

#include "libloc/core/check.hpp"
#include "libloc/vision/image_view.hpp"

namespace loc {

void write_image(const std::filesystem::path& path, const ImageMeasurement& image) {
  const cv::Mat picture = image.format == PixelFormat::kGray ? view_of(image) : bgr_of(image);
  bool written = false;
  try {
    written = cv::imwrite(path.string(), picture);
  } catch (const cv::Exception& e) {
    throw DataError(path.string() + ": cannot be written: " + e.err);
  }
  if (!written) throw DataError(path.string() + ": cannot be written");
}

ImageMeasurement read_image(const std::filesystem::path& path, PixelFormat format) {
  require(format == PixelFormat::kGray || format == PixelFormat::kBgr, "format: must be grey or BGR");
  if (!std::filesystem::is_regular_file(path)) throw DataError(path.string() + ": no such file");
  const int mode = format == PixelFormat::kGray ? cv::IMREAD_GRAYSCALE : cv::IMREAD_COLOR;
  cv::Mat picture;
  try {
    // Cameras and datasets mean the pixels as they are stored, whatever a tag says about how to hold the picture.
    picture = cv::imread(path.string(), mode | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception& e) {
    throw DataError(path.string() + ": cannot be read: " + e.err);
  }
  if (picture.empty()) throw DataError(path.string() + ": is no picture that can be read");
  return image_of(picture, format);
}

}  // namespace loc
