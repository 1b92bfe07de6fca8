// Simulated visual odometry: the pose that a camera's odometry tells, at an unknown scale.
//   position    = scale * true position + drift + white noise   (in world; odometry's unit)
//   orientation = true orientation * Exp(white noise)
// Drift: b <- (1 - 1/tau) b + sigma_A n at every frame, sigma_A = sqrt(2/tau + 1/tau^2) sigma_B, as in the example
// "Visual-Inertial Odometry Using Synthetic Data" (after Jiang, Klette, Wang, "Modeling of unbounded long-range drift
// in visual odometry", 2010). Extensions: a scale that wanders, latency, outliers, outages, relative poses.
// A scale that wanders acts on the way: each piece of it is measured with the scale of its time, so that the position
// is the sum of the scaled pieces, as it is where a camera chains frame to frame.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libloc/core/random.hpp"
#include "libloc/core/time.hpp"
#include "libloc/geometry/pose3.hpp"
#include "libloc/sensors/measurements.hpp"
#include "libloc/sim/motion.hpp"
#include "libloc/sim/noise.hpp"

namespace loc {

/// The defaults are the example's. "unit" is the odometry's unit of length.
struct VisualOdometryModel {
  double rate_hz = 25;
  double scale = 2;                         ///< [unit/m]
  double scale_walk = 0;                    ///< [1/sqrt(s)], random walk of the scale's logarithm
  double sigma_position = 0.139;            ///< [unit], white, each axis; of relative poses: of the change of position
  double sigma_orientation = 0;             ///< [rad], white, each axis of body; of relative poses: of the rotation
  double drift_sigma = 1.1575836902790225;  ///< [unit], sigma_B = sqrt(1.34), each axis; 0: no drift
  double drift_frames = 232;                ///< tau, time constant in frames
  Eigen::Vector3d drift_start = Eigen::Vector3d::Zero();  ///< [unit], before the first frame
  double outlier_fraction = 0;                            ///< of frames, which get a further error of
  double outlier_position = 20;                           ///< [unit] and
  double outlier_orientation = 0;                         ///< [rad], deviations of each axis
  double latency_s = 0;                                   ///< arrival after the frame
  double stamp_delay_s = 0;                               ///< time stamps are later than the frame by this
  std::vector<TimeInterval> outages;                      ///< no measurement
  /// False: pose in world. True: pose since the frame before, without drift, which then comes from adding up; the first
  /// frame and the first one after an outage give none.
  bool relative = false;
  /// The measured pose is that of the odometry's own axes, T_world_body * T_body_odometry.
  Pose3 T_body_odometry;
  /// What the measurements say of their deviations; NaN: sigma_position (0.001 at least), and 0.01 rad.
  double told_sigma_position = kUnknown;     ///< [unit]
  double told_sigma_orientation = kUnknown;  ///< [rad]

  static VisualOdometryModel perfect(double rate_hz = 25);  ///< metres, no error

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
  /// Deviation of the step of the drift, sigma_A [unit].
  double drift_step_sigma() const;
};

/// What was error in the last frame.
struct VisualOdometryTruth {
  double scale = 1;                                 ///< [unit/m]
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();  ///< [unit]
  bool outlier = false;
};

class VisualOdometrySimulator {
 public:
  /// @throws as VisualOdometryModel::check
  VisualOdometrySimulator(const VisualOdometryModel& model, Random random);

  /// The next frame; nullopt in an outage and where a relative pose has no frame before it. Called for every frame, in
  /// outages too, because drift and scale go on. time_ns is since the start of the motion, plus stamp_delay;
  /// host_time_ns is the arrival.
  /// @throws std::invalid_argument when the time does not increase.
  std::optional<OdometryMeasurement> measure(const MotionState& state);

  const VisualOdometryModel& model() const { return model_; }
  const VisualOdometryTruth& truth() const { return truth_; }

 private:
  VisualOdometryModel model_;
  Random white_;
  Random orientation_;
  Random drift_;
  Random outliers_;
  RandomWalk log_scale_;
  VisualOdometryTruth truth_;
  std::optional<MotionState> last_;
  Pose3 last_pose_;                                // of the odometry's axes, true, at the last frame
  Eigen::Vector3d way_ = Eigen::Vector3d::Zero();  // [unit], sum of the scaled pieces
  bool last_seen_ = false;                         // the last frame was no outage
};

/// The relative pose between two absolute ones, with the covariance of two independent errors.
/// @throws std::invalid_argument when one is relative already or end is not after start.
OdometryMeasurement relative_odometry(const OdometryMeasurement& start, const OdometryMeasurement& end);

}  // namespace loc
