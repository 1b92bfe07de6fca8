// Start of visual-inertial SLAM in motion: velocity, tilt, gyroscope bias and the depths of tracked features from half
// a second to two seconds of IMU samples and tracks, in metres and without a prior guess. The camera need not stand
// still before.
//   p_i = v0 t_i + g t_i^2 / 2 + s_i      position of body at frame i in the axes of body at frame 0; s_i and the
//                                         attitude R_i are the integrals of the IMU's readings, biases removed
// Steps: (1) gyroscope bias from the epipolar constraint between frames, whose directions of motion are free;
// (2) v0, g and the points from b x R_i^T (X - c_i) = 0, which is linear in them, with |g| known; (3) all of them and
// the accelerometer's bias by robust least squares of the pixels, with the IMU's noise as deviations of the poses.
// Not observable: position and heading (zero by convention). Without acceleration, neither scale nor speed, and without
// parallax, nothing: such windows are refused, by the deviations of the solution. The accelerometer's bias trades off
// with the tilt: its prior (ImuNoise) is part of the covariance.
// Frames: body at the first frame while it works; the result is in a world with z up.
// Source: Martinelli, "Closed-form solution of visual-inertial structure from motion", IJCV 2014; Dong-Si, Mourikis,
// "Estimator initialization in vision-aided inertial navigation with unknown camera-IMU calibration", IROS 2012;
// Kneip, Lynen, "Direct optimization of frame-to-frame rotation", ICCV 2013 (step 1); Kaiser, Martinelli, Fontana,
// Scaramuzza, "Simultaneous state initialization and gyroscope bias calibration in visual inertial aided navigation",
// RA-L 2017.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "libloc/filter/imu_propagation.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc {

struct SlamStartOptions {
  double min_duration_s = 0.5;  ///< of the frames that are looked at [s]
  double max_duration_s = 2;    ///< older ones are forgotten [s]
  int min_frames = 6;
  int max_frames = 20;  ///< of more, so many spread evenly are looked at; bounds the cost, as does the next one
  int min_features = 10;
  int max_features = 60;          ///< those with the longest tracks
  int min_observations = 4;       ///< of a feature
  double max_gap_s = 0.1;         ///< between IMU samples; a longer one begins anew [s]
  double sigma_px = 1;            ///< deviation of one coordinate, of frames that do not say it [px]
  double max_sigma_ratio = 1.5;   ///< residuals may be so much larger than that says; the covariance grows with them
  double min_inliers = 0.6;       ///< share of observations that must fit
  double min_parallax = 6;        ///< median over the features of the largest, in deviations of an observation
  double max_scale_sigma = 0.15;  ///< relative deviation of the scale: of the mean inverse depth, and of the speed
  double velocity_floor = 0.3;    ///< a deviation of the velocity below max_scale_sigma times this is good enough [m/s]
  double max_tilt_sigma = 0.1;    ///< [rad]
  double max_condition = 1e9;     ///< of the normal equations of v0, g and the biases, scaled to a unit diagonal
  double gyroscope_bias_sigma = 0.2;  ///< wide prior, so that turning about an axis that tells nothing does no harm
                                      ///< [rad/s]
  ImuSampling sampling = ImuSampling::kPoint;

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// A feature of the start; its ray is that of its observation at anchor_time_ns.
struct SlamStartFeature {
  std::int64_t id = -1;
  TimeNs anchor_time_ns = kNoTime;  ///< stamp (of the camera) of the first frame looked at that saw it
  double inverse_distance = 0;      ///< along the ray from there [1/m], positive
  double sigma = 0;                 ///< of the inverse distance [1/m]
};

struct SlamStartEstimate {
  TimeNs time_ns = kNoTime;  ///< of the first frame, on the IMU's clock (its stamp plus the camera's time offset)
  /// At that time: position 0, heading 0 (so3::heading), velocity in world, both biases. The accelerometer's is mostly
  /// its prior, 0; where the window tells something of it, tilt and velocity are right with this value only.
  InertialState state;
  /// Of theta p v bg ba. Rows of the position and of a turn about the world's vertical are zero: they define world.
  Eigen::Matrix<double, kInertialDim, kInertialDim> covariance;
  double residual_px_rms = 0;  ///< of one coordinate, of the observations that were used
  double sigma_ratio = 1;      ///< of the residuals over the stated deviation; at least 1; in the covariance
  int features = 0;
  int frames = 0;
  int observations = 0;
  int outliers = 0;                      ///< observations that were left out
  double scale_sigma = 0;                ///< relative deviation of the mean inverse depth
  double parallax = 0;                   ///< median over the features, in deviations of an observation
  double condition = 0;                  ///< see max_condition
  int iterations = 0;                    ///< of step (3)
  std::vector<SlamStartFeature> points;  ///< those in front of the camera
};

/// What the last solve() came to.
enum class SlamStartOutcome : std::uint8_t {
  kNone,          ///< not asked yet
  kStarted,       ///< there is an estimate
  kTooShort,      ///< the frames that the IMU covers do not reach min_duration_s
  kFewFrames,     ///< fewer than min_frames
  kFewFeatures,   ///< fewer than min_features that were tracked long enough, or that are left without outliers
  kNoSolution,    ///< the equations have none: no convergence, or points behind the camera
  kResidual,      ///< what came out does not explain the observations
  kNoParallax,    ///< the camera did not move sideways: rest, pure rotation
  kNoExcitation,  ///< scale, speed or tilt are not determined: too little acceleration or too short
  kCondition      ///< max_condition is exceeded
};
const char* slam_start_outcome_name(SlamStartOutcome outcome);

/// What was pushed and left aside.
struct SlamStartCounts {
  std::int64_t imu_not_finite = 0;
  std::int64_t imu_not_later = 0;
  std::int64_t bad_times = 0;  ///< of samples and frames: kNoTime, or farther than 73 years from 0
  std::int64_t imu_gaps = 0;   ///< times that it began anew
  std::int64_t frames_not_later = 0;
  std::int64_t features_bad = 0;  ///< negative or repeated identity, pixel not finite or without a ray
};

/// Measurements of one camera and its IMU; streams may be pushed one after the other, each in its order of time.
class SlamStart {
 public:
  /// @param gravity its size [m/s^2]
  /// @throws std::invalid_argument as the checks of options, camera and noise.
  SlamStart(const SlamStartOptions& options, const CameraCalibration& camera, const ImuNoise& noise, double gravity);

  void push(const ImuMeasurement& imu);
  void push(const FeaturesMeasurement& frame);
  /// From what is in the window. nullopt: outcome() and reason() say why; to be asked again after more frames.
  std::optional<SlamStartEstimate> solve();

  SlamStartOutcome outcome() const { return outcome_; }
  /// A sentence with the figure that decided; empty after kStarted and kNone.
  const std::string& reason() const { return reason_; }
  const SlamStartCounts& counts() const { return counts_; }
  /// From the first to the last frame in the window [s].
  double duration_s() const;
  /// Forgets the window, not the counts.
  void reset();

 private:
  struct Feature {
    std::int64_t id;
    Eigen::Vector2d pixel_px;
    Eigen::Vector3d ray;
  };
  struct Frame {
    TimeNs time_ns;   // IMU clock
    TimeNs stamp_ns;  // camera clock
    double sigma_px;
    std::vector<Feature> features;
  };

  void forget_before(TimeNs newest_ns);
  std::optional<SlamStartEstimate> refuse(SlamStartOutcome outcome, std::string reason);

  SlamStartOptions options_;
  Camera camera_;
  Pose3 T_body_camera_;
  TimeNs time_offset_ns_ = 0;
  ImuNoise noise_;
  double gravity_;
  std::deque<ImuMeasurement> imu_;
  std::deque<Frame> frames_;
  SlamStartCounts counts_;
  SlamStartOutcome outcome_ = SlamStartOutcome::kNone;
  std::string reason_;
};

}  // namespace loc
