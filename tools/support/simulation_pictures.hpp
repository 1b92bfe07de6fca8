// Pictures of a simulated camera: a video of its features, and what it sees of the rendered world. Needs loc_vision;
// a program that was built without OpenCV says so when it is asked for pictures.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "libloc/io/recording_writer.hpp"
#include "libloc/sim/simulation.hpp"

namespace loc {

struct PictureRequest {
  std::string video;      ///< features of the first camera (*.mp4, *.avi); empty: none
  bool rendered = false;  ///< the video shows them over rendered pictures
  bool images = false;    ///< the recording gets the rendered pictures of all cameras
  std::string recording;  ///< the folder that gets them as files; empty: they are written as measurements
  bool any() const { return !video.empty() || images; }
};

class SimulationPictures {
 public:
  /// @throws UsageError when this program cannot make pictures; DataError when a file cannot be written.
  SimulationPictures(const PictureRequest& request, const Simulation& simulation);
  SimulationPictures(const SimulationPictures&) = delete;
  SimulationPictures& operator=(const SimulationPictures&) = delete;
  /// Removes what was not finished.
  ~SimulationPictures();

  /// @param writer gets the pictures as measurements, when they do not become files; may be null
  void add(const FeaturesMeasurement& features, const FrameTruth& truth, RecordingWriter* writer);
  /// @throws DataError when not everything could be written.
  void finish();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace loc
