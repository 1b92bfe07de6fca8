#include "libloc/vision/image_codec.hpp"

#include <turbojpeg.h>

#include <opencv2/imgproc.hpp>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/vision/image_view.hpp"

namespace loc {
namespace {

constexpr std::int64_t kMostPixels = 1 << 28;

class Codec {
 public:
  explicit Codec(tjhandle handle) : handle_(handle) {
    if (handle_ == nullptr) throw std::runtime_error("TurboJPEG cannot be used");
  }
  Codec(const Codec&) = delete;
  Codec& operator=(const Codec&) = delete;
  ~Codec() { tjDestroy(handle_); }
  tjhandle get() const { return handle_; }
  std::string error() const { return tjGetErrorStr2(handle_); }

 private:
  tjhandle handle_;
};

struct FreeJpeg {
  void operator()(unsigned char* bytes) const { tjFree(bytes); }
};

struct Size {
  int width_px = 0;
  int height_px = 0;
};

Size read_header(const Codec& codec, const std::vector<std::uint8_t>& bytes) {
  Size size;
  int subsampling = 0;
  int colours = 0;
  if (tjDecompressHeader3(codec.get(), bytes.data(), bytes.size(), &size.width_px, &size.height_px, &subsampling,
                          &colours) != 0) {
    throw DataError("is no JPEG that can be read: " + codec.error());
  }
  if (std::int64_t{size.width_px} * size.height_px > kMostPixels) {
    throw DataError("is a JPEG of " + std::to_string(size.width_px) + " x " + std::to_string(size.height_px) +
                    " pixels: too large");
  }
  return size;
}

// The end mark after the picture itself: an embedded preview has one of its own before it, and what comes after it
// (zeros that fill a camera's buffer, a phone's video) does not matter. Within the data of a picture 0xff is always
// followed by 0 or a restart mark.
bool has_end_mark(const std::vector<std::uint8_t>& bytes) {
  constexpr std::uint8_t kScan = 0xda;
  constexpr std::uint8_t kEnd = 0xd9;
  std::size_t at = 2;
  while (at + 4 <= bytes.size() && bytes[at] == 0xff && bytes[at + 1] != kScan) {
    at += bytes[at + 1] == 0xff ? 1 : 2 + (std::size_t{bytes[at + 2]} << 8U) + bytes[at + 3];
  }
  for (std::size_t i = at + 2; i + 1 < bytes.size(); ++i) {
    if (bytes[i] == 0xff && bytes[i + 1] == kEnd) return true;
  }
  return false;
}

ImageMeasurement with_pixels(const ImageMeasurement& like, int width_px, int height_px, PixelFormat format,
                             std::vector<std::uint8_t> pixels) {
  ImageMeasurement out = like;
  out.width_px = width_px;
  out.height_px = height_px;
  out.row_stride_bytes = width_px * (format == PixelFormat::kGray ? 1 : 3);
  out.format = format;
  out.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(pixels));
  return out;
}

ImageMeasurement decode_jpeg(const ImageMeasurement& image, PixelFormat format) {
  require(image.data != nullptr, "image.data: there is none");
  const std::vector<std::uint8_t>& bytes = *image.data;
  const Codec codec(tjInitDecompress());
  const Size size = read_header(codec, bytes);
  if (size.width_px != image.width_px || size.height_px != image.height_px) {
    throw DataError("JPEG of " + std::to_string(size.width_px) + " x " + std::to_string(size.height_px) +
                    " pixels; the image is said to have " + std::to_string(image.width_px) + " x " +
                    std::to_string(image.height_px));
  }
  const int channels = format == PixelFormat::kGray ? 1 : 3;
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(size.width_px) * static_cast<std::size_t>(size.height_px) *
                                   static_cast<std::size_t>(channels));
  const int layout = format == PixelFormat::kGray ? TJPF_GRAY : TJPF_BGR;
  if (tjDecompress2(codec.get(), bytes.data(), bytes.size(), pixels.data(), size.width_px, size.width_px * channels,
                    size.height_px, layout, TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS | TJFLAG_ACCURATEDCT) != 0) {
    throw DataError("JPEG is damaged: " + codec.error());
  }
  return with_pixels(image, size.width_px, size.height_px, format, std::move(pixels));
}

}  // namespace

bool is_jpeg(const std::vector<std::uint8_t>& bytes) {
  return bytes.size() >= 3 && bytes[0] == 0xff && bytes[1] == 0xd8 && bytes[2] == 0xff;
}

ImageMeasurement jpeg_image(std::shared_ptr<const std::vector<std::uint8_t>> bytes) {
  require(bytes != nullptr, "bytes: there are none");
  if (!is_jpeg(*bytes)) throw DataError("does not begin as a JPEG does");
  const Size size = read_header(Codec(tjInitDecompress()), *bytes);
  if (!has_end_mark(*bytes)) throw DataError("JPEG is cut off: its end mark is missing");
  ImageMeasurement out;
  out.width_px = size.width_px;
  out.height_px = size.height_px;
  out.format = PixelFormat::kMjpeg;
  out.data = std::move(bytes);
  return out;
}

ImageMeasurement encode_jpeg(const ImageMeasurement& image, int quality) {
  require(quality >= 1 && quality <= 100, "quality", quality, "must be 1 to 100");
  if (image.format == PixelFormat::kMjpeg) return image;
  const cv::Mat view = view_of(image);
  const bool grey = image.format == PixelFormat::kGray;
  const int layout = grey ? TJPF_GRAY : image.format == PixelFormat::kBgr ? TJPF_BGR : TJPF_RGB;
  const Codec codec(tjInitCompress());
  unsigned char* bytes = nullptr;
  unsigned long size = 0;  // NOLINT(google-runtime-int): TurboJPEG's own type
  const int failed = tjCompress2(codec.get(), view.data, view.cols, static_cast<int>(view.step[0]), view.rows, layout,
                                 &bytes, &size, grey ? TJSAMP_GRAY : TJSAMP_420, quality, TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, FreeJpeg> owner(bytes);
  if (failed != 0) throw std::runtime_error("JPEG cannot be made: " + codec.error());
  ImageMeasurement out = image;
  out.format = PixelFormat::kMjpeg;
  out.row_stride_bytes = 0;
  out.data = std::make_shared<const std::vector<std::uint8_t>>(bytes, bytes + size);
  return out;
}

ImageMeasurement decode_image(const ImageMeasurement& image, PixelFormat format) {
  require(format == PixelFormat::kGray || format == PixelFormat::kBgr, "format: must be grey or BGR");
  if (image.format == PixelFormat::kMjpeg) return decode_jpeg(image, format);
  const cv::Mat view = view_of(image);
  if (image.format == format) return image;
  cv::Mat pixels;
  if (format == PixelFormat::kBgr) {
    pixels = bgr_of(image);
  } else {
    cv::cvtColor(view, pixels, image.format == PixelFormat::kBgr ? cv::COLOR_BGR2GRAY : cv::COLOR_RGB2GRAY);
  }
  const ImageMeasurement out = image_of(pixels, format);
  return with_pixels(image, out.width_px, out.height_px, format, *out.data);
}

}  // namespace loc
