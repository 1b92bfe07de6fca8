#include "libloc/vision/image_view.hpp"

#include <opencv2/imgproc.hpp>

#include "libloc/core/check.hpp"

namespace loc {

cv::Mat view_of(const ImageMeasurement& image) {
  require(image.format != PixelFormat::kMjpeg, "image.format: JPEG must be decoded first");
  const int channels = image.format == PixelFormat::kGray ? 1 : 3;
  require(image.width_px > 0 && image.height_px > 0, "image: width and height must be positive");
  require(image.row_stride_bytes >= image.width_px * channels, "image.row_stride_bytes", image.row_stride_bytes,
          "is less than a row");
  const std::size_t needed =
      static_cast<std::size_t>(image.row_stride_bytes) * static_cast<std::size_t>(image.height_px);
  require(image.data != nullptr && image.data->size() >= needed, "image.data: fewer bytes than height * row stride");
  // OpenCV has no view of what must not be changed.
  auto* bytes = const_cast<std::uint8_t*>(image.data->data());
  return {image.height_px, image.width_px, CV_8UC(channels), bytes, static_cast<std::size_t>(image.row_stride_bytes)};
}

cv::Mat bgr_of(const ImageMeasurement& image) {
  const cv::Mat view = view_of(image);
  cv::Mat out;
  if (image.format == PixelFormat::kGray) {
    cv::cvtColor(view, out, cv::COLOR_GRAY2BGR);
  } else if (image.format == PixelFormat::kRgb) {
    cv::cvtColor(view, out, cv::COLOR_RGB2BGR);
  } else {
    out = view.clone();
  }
  return out;
}

ImageMeasurement image_of(const cv::Mat& picture, PixelFormat format) {
  const int channels = format == PixelFormat::kGray ? 1 : 3;
  require(format != PixelFormat::kMjpeg && !picture.empty() && picture.type() == CV_8UC(channels),
          "picture: must be of 8 bits, with the channels of the format");
  ImageMeasurement image;
  image.width_px = picture.cols;
  image.height_px = picture.rows;
  image.row_stride_bytes = picture.cols * channels;
  image.format = format;
  auto bytes = std::make_shared<std::vector<std::uint8_t>>();
  bytes->reserve(picture.total() * static_cast<std::size_t>(channels));
  for (int y = 0; y < picture.rows; ++y) {
    const std::uint8_t* row = picture.ptr(y);
    bytes->insert(bytes->end(), row, row + image.row_stride_bytes);
  }
  image.data = std::move(bytes);
  return image;
}

}  // namespace loc
