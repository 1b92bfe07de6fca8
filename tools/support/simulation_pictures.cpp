#include "tools/support/simulation_pictures.hpp"

#include "tools/support/program.hpp"

#ifdef LOC_HAVE_VISION
#include <fstream>
#include <map>
#include <optional>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/sim/scene_renderer.hpp"
#include "libloc/vision/feature_video.hpp"
#include "libloc/vision/image_file.hpp"
#endif

namespace loc {

#ifdef LOC_HAVE_VISION

namespace {

namespace fs = std::filesystem;

// "drive.mp4" is drive.incomplete.mp4 until it is whole; the ending tells the codec.
fs::path incomplete(const fs::path& path) {
  return path.parent_path() / (path.stem().string() + ".incomplete" + path.extension().string());
}

}  // namespace

struct SimulationPictures::Parts {
  PictureRequest request;
  fs::path unfinished_video;
  std::optional<FeatureVideo> video;
  std::vector<std::optional<SceneRenderer>> renderers;
  std::map<std::int32_t, std::ofstream> lists;  // data.csv of each camera
};

SimulationPictures::SimulationPictures(const PictureRequest& request, const Simulation& simulation)
    : parts_(std::make_unique<Parts>()) {
  Parts& p = *parts_;
  p.request = request;
  const std::vector<ScenarioCamera>& cameras = simulation.scenario().cameras;
  p.renderers.resize(cameras.size());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (request.images || (request.rendered && i == 0)) {
      p.renderers[i].emplace(simulation.world(), cameras[i].calibration, RendererOptions{});
    }
  }
  if (request.video.empty()) return;
  if (fs::exists(request.video))
    throw UsageError(request.video + ": is there already; remove it or choose another name");
  const CameraCalibration& first = cameras.at(0).calibration;
  p.unfinished_video = incomplete(request.video);
  p.video.emplace(p.unfinished_video,
                  FeatureVideoOptions{
                      .width_px = first.width_px, .height_px = first.height_px, .rate_hz = cameras[0].model.rate_hz});
}

SimulationPictures::~SimulationPictures() {
  if (parts_->unfinished_video.empty()) return;
  parts_->video.reset();
  std::error_code error;  // what cannot be removed keeps its telling name
  fs::remove(parts_->unfinished_video, error);
}

void SimulationPictures::add(const FeaturesMeasurement& features, const FrameTruth& truth, RecordingWriter* writer) {
  Parts& p = *parts_;
  const auto camera = static_cast<std::size_t>(features.camera);
  std::optional<ImageMeasurement> picture;
  if (p.renderers.at(camera)) {
    picture = p.renderers[camera]->render(truth.T_world_camera);
    static_cast<Stamp&>(*picture) = features;
    picture->camera = features.camera;
  }
  if (p.video && camera == 0) p.video->add(features, p.request.rendered ? &*picture : nullptr);
  if (!p.request.images) return;
  if (p.request.recording.empty()) {
    if (writer != nullptr) writer->write(Measurement(*picture));
    return;
  }
  const fs::path folder = fs::path(p.request.recording) / "mav0" / ("cam" + std::to_string(camera));
  auto list = p.lists.find(features.camera);
  if (list == p.lists.end()) {
    fs::create_directories(folder / "data");
    list = p.lists.try_emplace(features.camera, folder / "data.csv", std::ios::binary).first;
    list->second << "#timestamp [ns],filename\n";
  }
  const std::string name = std::to_string(features.time_ns) + ".png";
  write_image(folder / "data" / name, *picture);
  list->second << features.time_ns << ',' << name << '\n';
  if (!list->second) throw DataError((folder / "data.csv").string() + ": cannot be written");
}

void SimulationPictures::finish() {
  Parts& p = *parts_;
  for (auto& [camera, list] : p.lists) {
    list.close();
    if (!list) throw DataError("mav0/cam" + std::to_string(camera) + "/data.csv: cannot be written");
  }
  if (!p.video) return;
  p.video->finish();
  fs::rename(p.unfinished_video, p.request.video);
  p.unfinished_video.clear();
}

#else

struct SimulationPictures::Parts {};

SimulationPictures::SimulationPictures(const PictureRequest& /*request*/, const Simulation& /*simulation*/) {
  throw UsageError(
      "--video and --images need OpenCV, and this program was built without it (Debian: libopencv-videoio-dev)");
}
SimulationPictures::~SimulationPictures() = default;
void SimulationPictures::add(const FeaturesMeasurement& /*features*/, const FrameTruth& /*truth*/,
                             RecordingWriter* /*writer*/) {}
void SimulationPictures::finish() {}

#endif

}  // namespace loc
