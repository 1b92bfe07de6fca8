#include "libloc/vision/image_file.hpp"

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/vision/image_codec.hpp"
#include "libloc/vision/image_view.hpp"

namespace loc {
namespace {

std::vector<std::uint8_t> bytes_of(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) throw DataError(path.string() + ": no such file");
  const auto size = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  std::vector<std::uint8_t> bytes(error ? 0 : size);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (error || !file) throw DataError(path.string() + ": cannot be read");
  if (bytes.empty()) throw DataError(path.string() + ": is empty");
  return bytes;
}

}  // namespace

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
  require(format == PixelFormat::kGray || format == PixelFormat::kBgr || format == PixelFormat::kMjpeg,
          "format: must be grey, BGR or JPEG");
  std::vector<std::uint8_t> bytes = bytes_of(path);
  const bool stored = format == PixelFormat::kMjpeg;
  if (is_jpeg(bytes)) {
    try {
      const ImageMeasurement jpeg = jpeg_image(std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes)));
      return stored ? jpeg : decode_image(jpeg, format);
    } catch (const DataError& error) {
      throw DataError(path.string() + ": " + error.what());
    }
  }
  // Cameras and datasets mean the pixels as they are stored, whatever a tag says about how to hold the picture.
  const int mode = stored                         ? cv::IMREAD_ANYCOLOR
                   : format == PixelFormat::kGray ? cv::IMREAD_GRAYSCALE
                                                  : cv::IMREAD_COLOR;
  cv::Mat picture;
  try {
    picture = cv::imdecode(bytes, mode | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception& e) {
    throw DataError(path.string() + ": cannot be read: " + e.err);
  }
  if (picture.empty()) throw DataError(path.string() + ": is no picture that can be read");
  return image_of(picture, picture.channels() == 1 ? PixelFormat::kGray : PixelFormat::kBgr);
}

}  // namespace loc
