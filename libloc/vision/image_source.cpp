#include "libloc/vision/image_source.hpp"

#include <optional>
#include <utility>

#include "libloc/core/check.hpp"
#include "libloc/io/merged_source.hpp"
#include "libloc/vision/image_file.hpp"

namespace loc {
namespace {

namespace fs = std::filesystem;

class ImageSource final : public MeasurementSource {
 public:
  ImageSource(ImageList list, std::string name, std::int32_t camera, ImageReadOptions options)
      : options_((options.check(), std::move(options))),
        list_(std::move(list)),
        name_(std::move(name)),
        camera_(camera) {
    require(camera >= 0, "camera", camera, "must not be negative");
  }

  std::optional<Measurement> next() override {
    while (next_ < list_.entries.size()) {
      const std::size_t index = next_++;
      std::optional<ImageMeasurement> image = read(list_.entries[index]);
      if (!image) continue;
      image->time_ns = list_.entries[index].time_ns;
      image->sequence = static_cast<std::int64_t>(index);
      image->camera = camera_;
      ++read_;
      return Measurement(std::move(*image));
    }
    if (read_ == 0 && !first_trouble_.empty()) {
      throw DataError(name_ + ": none of its " + std::to_string(list_.entries.size()) +
                      " pictures can be read; the first: " + first_trouble_);
    }
    return std::nullopt;
  }

  NamedCounts counts() const override {
    NamedCounts out = {{"image.read", read_}};
    for (const NamedCount& count : list_.counts) out.push_back(count);
    if (missing_ > 0) out.push_back({"image.skipped.missing", missing_});
    if (damaged_ > 0) out.push_back({"image.skipped.damaged", damaged_});
    if (other_size_ > 0) out.push_back({"image.skipped.other_size", other_size_});
    return out;
  }

 private:
  std::optional<ImageMeasurement> read(const ImageListEntry& entry) {
    std::error_code error;
    if (!fs::exists(entry.file, error)) return skip(missing_, entry.file.string() + ": no such file");
    std::optional<ImageMeasurement> image;
    try {
      image = read_image(entry.file, options_.format);
    } catch (const DataError& e) {
      return skip(damaged_, e.what());
    }
    if (width_px_ == 0) {
      width_px_ = image->width_px;
      height_px_ = image->height_px;
    }
    if (image->width_px != width_px_ || image->height_px != height_px_) {
      return skip(other_size_, entry.file.string() + ": has " + std::to_string(image->width_px) + " x " +
                                   std::to_string(image->height_px) + " pixels, the first one " +
                                   std::to_string(width_px_) + " x " + std::to_string(height_px_));
    }
    return image;
  }

  std::optional<ImageMeasurement> skip(std::int64_t& count, const std::string& why) {
    ++count;
    if (first_trouble_.empty()) first_trouble_ = why;
    if (options_.on_skip) options_.on_skip(why);
    return std::nullopt;
  }

  ImageReadOptions options_;
  ImageList list_;
  std::string name_;
  std::int32_t camera_;
  std::size_t next_ = 0;
  int width_px_ = 0;
  int height_px_ = 0;
  std::string first_trouble_;
  std::int64_t read_ = 0;
  std::int64_t missing_ = 0;
  std::int64_t damaged_ = 0;
  std::int64_t other_size_ = 0;
};

ImageList list_of(const fs::path& folder, const ImageFolderOptions& options) {
  if (options.rate_hz > 0) return list_images_at_rate(folder, options.rate_hz, options.first_time_ns);
  if (!options.name_unit.empty()) return list_images_by_name(folder, options.name_unit);
  if (!options.times_file.empty()) {
    return read_image_list(options.times_file, folder, options.time_unit);
  }
  for (const char* name : {"rgb.txt", "times.txt"}) {
    std::error_code error;
    if (fs::exists(folder / name, error)) return read_image_list(folder / name, folder, options.time_unit);
  }
  if (!fs::is_directory(folder)) throw DataError(folder.string() + ": no such folder");
  throw DataError(folder.string() +
                  ": when were its pictures taken? It needs a rate, a unit (names that are times), or a list of times "
                  "(rgb.txt and times.txt are found by themselves)");
}

}  // namespace

void ImageReadOptions::check() const {
  require(format == PixelFormat::kGray || format == PixelFormat::kBgr || format == PixelFormat::kMjpeg,
          "format: must be grey, BGR or JPEG");
}

void ImageFolderOptions::check() const {
  read.check();
  require_not_negative("rate_hz", rate_hz);
  const int ways = (rate_hz > 0 ? 1 : 0) + (name_unit.empty() ? 0 : 1) + (times_file.empty() ? 0 : 1);
  require(ways <= 1, "rate_hz, name_unit, times_file: only one of them");
}

std::unique_ptr<MeasurementSource> open_images(ImageList list, const std::string& name, std::int32_t camera,
                                               const ImageReadOptions& options) {
  return std::make_unique<ImageSource>(std::move(list), name, camera, options);
}

std::unique_ptr<MeasurementSource> open_image_folder(const fs::path& folder, const ImageFolderOptions& options) {
  options.check();
  return open_images(list_of(folder, options), folder.string(), options.camera, options.read);
}

std::unique_ptr<MeasurementSource> open_euroc_images(const fs::path& folder, const EurocImageOptions& options) {
  std::vector<MergeInput> inputs;
  const std::vector<std::int32_t> cameras = options.cameras.empty() ? euroc_cameras(folder) : options.cameras;
  for (const std::int32_t camera : cameras) {
    const std::string name = (folder / "mav0" / ("cam" + std::to_string(camera))).string();
    inputs.push_back({name, open_images(list_euroc_images(folder, camera), name, camera, options.read)});
  }
  if (options.read_other) inputs.push_back({folder.string(), open_euroc(folder, options.other)});
  if (inputs.empty()) throw DataError(folder.string() + ": no cameras in it (mav0/cam0/data.csv)");
  return merge_sources(std::move(inputs));
}

}  // namespace loc
