#include "tools/support/picture_front_end.hpp"

#include <exception>

#include "libloc/core/check.hpp"
#include "libloc/vision/feature_tracker.hpp"
#include "libloc/vision/image_codec.hpp"
#include "tools/support/log.hpp"

namespace loc {
namespace {

constexpr int kSkipsLogged = 10;

class Tracking final : public PictureFrontEnd {
 public:
  explicit Tracking(const CameraCalibration& camera) : tracker_(camera) {}

  const FeaturesMeasurement* track(const ImageMeasurement& image, const SlamPrediction& expected) override {
    try {
      return &tracker_.track(decode_image(image), &expected);
    } catch (const DataError& error) {
      skip(damaged_, image, error);
    } catch (const std::exception& error) {  // of OpenCV and TurboJPEG, too: one picture must not end a live program
      skip(not_usable_, image, error);
    }
    return nullptr;
  }
  void learn(const SlamFrame& frame) override { tracker_.learn(frame); }
  void reset() override { tracker_.reset(); }
  NamedCounts counts() const override {
    NamedCounts out = tracker_.counts();
    out.push_back({"pictures.skipped.damaged", damaged_});
    out.push_back({"pictures.skipped.not_usable", not_usable_});
    return out;
  }

 private:
  void skip(std::int64_t& count, const ImageMeasurement& image, const std::exception& error) {
    ++count;
    if (++told_ > kSkipsLogged) return;
    log_warning("event=picture_left_out sequence={} time={} reason=\"{}\"", image.sequence,
                format_seconds(image.time_ns), error.what());
  }

  FeatureTracker tracker_;
  std::int64_t damaged_ = 0;
  std::int64_t not_usable_ = 0;
  int told_ = 0;
};

}  // namespace

std::unique_ptr<PictureFrontEnd> make_picture_front_end(const CameraCalibration& camera) {
  return std::make_unique<Tracking>(camera);
}

}  // namespace loc
