// A simulated camera with a feature tracker: which points of a scene it sees, where, and under which identity.
// From: the true motion of the body, the scene, and the calibration of the camera as it truly is (an estimator may be
// given another one): lens, image size, T_body_camera, and time_offset_s, by which its time stamps are off.
//   stamp = start_time_ns + time of exposure - time_offset_s + jitter        (t_imu = t_camera + time_offset)
// Frames: world, body, camera as everywhere; pixel (0,0) is the centre of the top-left pixel. What is measured is
// distorted, as in the picture.
// Errors, each from its own random numbers, so that switching one on leaves the others as they were: noise of the
// pixel, outliers, identities that change places, tracks that are lost and found again (with or without their
// identity).
//
//   CameraSimulator simulator(CameraModel{}, rig.cameras[0], scene, Random(7));
//   const SimulatedFrame frame = simulator.observe(motion.at(t));   // frame.measurement, frame.truth
//   const auto frames = simulate_camera(motion, CameraModel{}, rig.cameras[0], scene, Random(7));
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/core/time.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/rig.hpp"
#include "libloc/sim/motion.hpp"
#include "libloc/sim/scene.hpp"

namespace loc {

struct CameraModel {
  double rate_hz = 20;            ///< frames, from time 0 of the motion on (simulate_camera)
  TimeNs start_time_ns = 0;       ///< time 0 of the motion on the IMU's clock
  double stamp_jitter_s = 0;      ///< deviation of a frame's time stamp
  double sigma_px = 0.5;          ///< white noise of each coordinate; also what the measurement says of itself
  double border_px = 2;           ///< features nearer to the image's border are not found
  double min_depth_m = 0.1;       ///< along the optical axis (fisheye: the distance); nearer points are not seen
  double max_depth_m = 200;       ///< farther ones neither
  bool occlusion = true;          ///< faces of the scene hide what is behind them
  int max_features = 200;         ///< tracked at the same time; 0: no limit
  double min_separation_px = 10;  ///< a new feature is not taken nearer to another one, as detectors spread them
  double outlier_rate = 0;        ///< share of observations that are anywhere in the image
  double wrong_id_rate = 0;       ///< share of observations that have changed identities with another one of the frame
  double loss_rate = 0;           ///< probability of losing a track that is in view, per frame
  double reappear_rate = 0.3;     ///< probability of finding a lost feature that is in view, per frame
  double new_id_rate = 0;         ///< share of found ones that get a new identity, as trackers without memory give them

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// What is true of one observation.
struct ObservationTruth {
  std::int64_t point = -1;                                         ///< index in the scene
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Constant(kUnknown);  ///< without noise
  double depth_m = kUnknown;                                       ///< along the optical axis
  bool outlier = false;                                            ///< the measured pixel has nothing to do with it
  bool wrong_id = false;                                           ///< the measured identity is another point's
};

struct SimulatedFrame {
  double time_s = 0;                    ///< true time of exposure, since the start of the motion
  Pose3 T_world_camera;                 ///< true pose at that time
  FeaturesMeasurement measurement;      ///< what an estimator is given
  std::vector<ObservationTruth> truth;  ///< of each feature of the measurement, in the same order
};

class CameraSimulator {
 public:
  /// @param camera_index of the measurements: which camera of the rig this is.
  /// @throws std::invalid_argument as check() of model, calibration and scene.
  CameraSimulator(const CameraModel& model, const CameraCalibration& calibration, Scene scene, Random random,
                  std::int32_t camera_index = 0);

  /// The frame of that moment. @throws std::invalid_argument when the time does not increase from call to call.
  SimulatedFrame observe(const MotionState& state);

  const Scene& scene() const { return scene_; }
  const Camera& camera() const { return camera_; }

 private:
  enum class Status : std::uint8_t { kNew, kTracked, kLost };
  struct Track {
    Status status = Status::kNew;
    std::int64_t id = -1;
  };

  void look(const Pose3& T_world_camera);
  void update_tracks();
  void fill_up(std::vector<std::size_t>& candidates, std::size_t room);
  bool has_space(const Eigen::Vector2d& pixel_px) const;
  void disturb(SimulatedFrame& frame);

  CameraModel model_;
  CameraCalibration calibration_;
  Camera camera_;
  Scene scene_;
  std::int32_t camera_index_;
  Random noise_, outliers_, identities_, tracking_, stamps_;
  std::vector<Track> tracks_;              // of each point of the scene
  std::vector<ObservationTruth> in_view_;  // of each point of the scene; point = -1 where it is not seen
  std::vector<Eigen::Vector2d> taken_;     // pixels of the features of this frame
  std::int64_t next_id_;
  std::int64_t sequence_ = 0;
  double last_time_s_ = -std::numeric_limits<double>::infinity();
};

/// All frames of a motion, at 0, 1 / rate_hz, ...
/// @param duration_s how much of the motion; NaN: all. @throws std::invalid_argument as CameraSimulator; when the
/// motion has no end and no duration is given.
std::vector<SimulatedFrame> simulate_camera(const Motion& motion, const CameraModel& model,
                                            const CameraCalibration& calibration, const Scene& scene, Random random,
                                            double duration_s = kUnknown);

}  // namespace loc
