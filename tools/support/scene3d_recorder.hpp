// From the messages of a live session or of a log to what the 3-D viewer shows: a SceneRecorder takes messages as they
// come and says at any moment what the scene is. Its memory is bounded: long tracks are thinned out. Estimates and
// frames whose stamps are far off are counted and left out (stamp_guard.hpp).
// Where the estimates are tied to the Earth (fusion_t), GPS fixes are drawn where they are; those without altitude at
// that of the origin, or else of the first fix that has one. Otherwise they, and the
// reference always (its world is another one), are laid over the trajectory: turned about the vertical and shifted,
// with a scale when the estimator does not know metres. Once GPS has tied a map to the Earth, estimates are in another
// world than before: what is older is taken there by the two poses around that moment, or left out without metres.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "libloc/core/named_count.hpp"
#include "libloc/sensors/rig.hpp"
#include "msgs/decode.hpp"
#include "tools/support/scene3d.hpp"
#include "tools/support/stamp_guard.hpp"

namespace loc {

struct SceneRecorderOptions {
  DecodeOptions decode;
  std::string estimate_channel = "LOC_ESTIMATE";
  std::int32_t camera = 0;                       ///< whose pictures are shown
  std::optional<CameraCalibration> calibration;  ///< of it: shape of its frustum
  std::size_t max_track_points = 20'000;         ///< of a track; above, every second one is dropped
};

class SceneRecorder {
 public:
  /// @throws std::invalid_argument when two streams have one channel, or a camera's calibration is wrong.
  explicit SceneRecorder(SceneRecorderOptions options);

  /// Takes a message; those of other channels are left aside, those that cannot be decoded are counted.
  void take(std::string_view channel, std::span<const std::uint8_t> data, TimeNs receive_time_ns = kNoTime);

  /// Those that it has a use for.
  std::vector<std::string> channels() const;
  /// Time of the newest estimate or frame, on the clock of the measurements; kNoTime before the first.
  TimeNs time_ns() const { return time_ns_; }
  TimeNs first_time_ns() const { return first_time_ns_; }
  /// What there is to see now. Of the points of a map that GPS has tied to the Earth, the uncertainty that they share
  /// with the pose is left out: they would all look alike otherwise. Decodes the newest picture and lays the tracks
  /// over each other: milliseconds.
  Scene3d scene() const;

  /// {"estimates", 200}, {"frames", 20}, …, {"undecodable:LOC_IMAGE", 1}, {"time.skipped.far_off", 1},
  /// {"time.jumped", 1} (followed to another clock), {"time.stepped_back", 1} (of estimates), and what the decoder
  /// skipped.
  NamedCounts counts() const;
  std::int64_t undecodable() const;

 private:
  struct Track {
    std::vector<TrackPoint> points;
    TimeNs spacing_ns = 20'000'000;
    void add(const TrackPoint& point, std::size_t max_points);
  };
  struct MapPoint {
    Eigen::Vector3d position;
    Eigen::Matrix3d covariance;
  };

  void take_estimate(std::span<const std::uint8_t> data);
  void take_fusion(std::span<const std::uint8_t> data);
  void move_into_world(const Pose3& T_world_map);
  void take_frame(std::span<const std::uint8_t> data);
  void take_map(std::span<const std::uint8_t> data);
  void take_measurement(std::string_view channel, std::span<const std::uint8_t> data, TimeNs receive_time_ns);
  void take_gps(const GpsMeasurement& fix);
  bool follow(TimeNs time_ns);
  void advance(TimeNs time_ns);
  void add_points(Scene3d& scene) const;
  void add_reference(Scene3d& scene) const;
  void add_gps(Scene3d& scene) const;
  void add_picture(Scene3d& scene) const;
  void add_text(Scene3d& scene) const;

  SceneRecorderOptions options_;
  MeasurementDecoder decoder_;
  StampGuard guard_;
  TimeNs time_ns_ = kNoTime;
  TimeNs first_time_ns_ = kNoTime;
  Estimate estimate_;
  std::optional<Pose3> pose_before_;  // of the estimate before that one
  bool unknown_scale_before_ = false;
  std::string method_;
  std::optional<GeodeticPoint> origin_;
  std::optional<SlamFrame> frame_;
  std::map<std::int64_t, MapPoint> map_;
  Eigen::Matrix3d shared_cov_ = Eigen::Matrix3d::Zero();  // of all its points, where GPS has tied it to the Earth
  std::map<std::int64_t, Eigen::Vector3d> anchors_;       // of the features that are in the map
  std::deque<ImageMeasurement> pictures_;                 // the newest few; a frame comes after its picture
  std::vector<std::string> conditions_;
  TimeNs conditions_time_ns_ = kNoTime;
  Track trajectory_;
  Track reference_;
  Track gps_;  // latitude, longitude [rad], altitude [m] or NaN
  std::optional<double> first_altitude_;
  std::map<std::string, std::int64_t> counts_;
};

}  // namespace loc
