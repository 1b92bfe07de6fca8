// Settings of SLAM with one camera: one struct for both motion models. Defaults are those of real sensors.
// Names in brackets are those of Popov, "Monocular simultaneous location and mapping based on recursive filtering",
// St. Petersburg 2015, 4.1.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "libloc/core/time.hpp"
#include "libloc/estimators/fusion_start.hpp"
#include "libloc/estimators/slam_start.hpp"
#include "libloc/estimators/stand_still.hpp"
#include "libloc/filter/imu_propagation.hpp"
#include "libloc/sensors/imu_noise.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc {

enum class SlamMotion : std::uint8_t {
  kConstantVelocity,  ///< camera alone: white acceleration; lengths in an unknown unit unless landmarks are known
  kInertial           ///< an IMU: metres, and a world with z up
};

/// What keeps the filter from learning what it cannot know (place, heading) out of its own linearisation errors.
enum class SlamConsistency : std::uint8_t {
  kPlain,          ///< nothing: Jacobians at the latest estimate
  kFirstEstimate,  ///< Jacobians by pose, velocity, anchor and ray at their first estimates (Huang, Mourikis,
                   ///< Roumeliotis 2010)
  kInvariant  ///< Jacobians at the latest estimate; errors of everything that turns with the world count in a frame
              ///< that turns with the attitude's error (right-invariant EKF: Barrau, Bonnabel 2015)
};

enum class SlamPrecision : std::uint8_t { kDouble, kFloat };

const char* slam_consistency_name(SlamConsistency consistency);
/// "plain", "first-estimate", "invariant". @throws std::invalid_argument naming the text.
SlamConsistency parse_slam_consistency(std::string_view name);

/// A point whose place in world is known beforehand: it gives the scale and ties the world.
struct KnownLandmark {
  std::int64_t id = -1;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< in world [m]
  double sigma = 0.001;                                ///< of each coordinate [m]
};

/// Which features the map has.
struct SlamMapOptions {
  int max_features = 100;             ///< in the map; bounds memory and time
  int max_measured = 50;              ///< in one frame: the most informative ones of those in view
  int min_visible = 40;               ///< fewer measured: features are added
  int max_added = 20;                 ///< in one frame (the first frame fills up to min_visible)
  int grid_columns = 8;               ///< the picture's cells, over which new features are spread
  int grid_rows = 6;                  ///< the same
  double min_separation_px = 12;      ///< of a new feature from those in the map
  double border_px = 2;               ///< predicted nearer to the border: not expected to be seen
  double inverse_depth = 0.3;         ///< of a new feature (rho_0) [1/m]
  double sigma_inverse_depth = 0.2;   ///< its deviation (sigma_rho); 0 must lie within 2 sigma [1/m]
  bool depth_from_neighbours = true;  ///< rho_0 of a new feature is the median of those that are known, over the last
                                      ///< seconds; its deviation grows with it
  double max_linearity_index = 0.07;  ///< below it a feature becomes XYZ (inverse_depth.hpp); 0: never
  /// While something hides many features at once, younger ones than that are estimated but move nothing else, if there
  /// are enough older ones: what moves by itself is found out before it spoils the pose. 0: off
  int steer_after_frames = 0;
  /// Nothing joins the map so near to features that are expected but hidden, where most are, and they stay in the map
  /// for a while: what came before them may move on. A share of the picture's width; 0: off [1]
  double cover_radius = 0;
  int delete_after_tries = 10;      ///< frames in which it was expected, before it is judged
  double delete_below_ratio = 0.5;  ///< measured in less than this share of them: deleted

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Which measurements are believed.
struct SlamAssociationOptions {
  /// Of a right measurement to pass (chi-square of 2). 0: 0.95 with an IMU, which predicts well; 0.999 alone.
  double gate_probability = 0;
  bool ransac = true;                ///< hypotheses from one measurement each; without it the gate alone
  double ransac_probability = 0.99;  ///< of having tried one right measurement at least
  int max_hypotheses = 50;
  std::uint64_t seed = 1;  ///< of the draws

  /// The same, the default resolved.
  double gate(SlamMotion motion) const;
  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

struct SlamOptions {
  SlamMotion motion = SlamMotion::kConstantVelocity;
  SlamConsistency consistency = SlamConsistency::kInvariant;
  SlamPrecision precision = SlamPrecision::kDouble;
  int max_iterations = 5;  ///< of an update that is far from linear; 1: plain EKF
  /// K with distortion, the pose in body and the clock. Without an IMU body is what moves smoothly; T_body_camera may
  /// be the identity.
  CameraCalibration camera;
  std::int32_t camera_index = 0;  ///< which frames are ours

  // Start. Camera alone: as it is given. With an IMU only position and heading are; tilt, velocity and biases are
  // found.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of body in world (X_cam) [m]
  /// Of body in world (X_cam_rotation). None: the camera looks along x of a world with z up.
  std::optional<Eigen::Quaterniond> q_world_body;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< in world (X_cam_velocity) [m/s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< in body (X_cam_angular_velocity) [rad/s]
  double sigma_position = 0;                                   ///< [m]; 0: world is where the camera began
  double sigma_orientation = 0;                                ///< [rad]
  double sigma_velocity = 0.5;                                 ///< root of P_velocity [m/s]
  double sigma_angular_velocity = 0.5;                         ///< root of P_angular [rad/s]

  // Q: continuous densities.
  double acceleration_density = 1;          ///< camera alone [m/s^2/sqrt(Hz)]
  double angular_acceleration_density = 1;  ///< camera alone [rad/s^2/sqrt(Hz)]

  /// With an IMU; biases begin with its deviations.
  ImuNoise imu_noise{.accelerometer_random_walk = 1e-3};
  ImuSampling imu_sampling = ImuSampling::kIntervalMean;  ///< what a sample of the IMU says
  /// So much of the variance by which readings differ from sample to sample counts as white noise of the IMU.
  double vibration_part = 0.01;
  double gravity = 9.80665;  ///< [m/s^2]

  // R.
  double sigma_px = 1.5;        ///< deviation of one coordinate, of frames that do not say
  bool override_sigma = false;  ///< sigma_px also in place of what frames say
  /// A pixel's variance grows by what the product of the errors of depth and way makes: starts of a camera alone that
  /// turns more than it moves come right more often; one that stands still at first gives away some of its accuracy.
  bool second_order_noise = false;

  bool estimate_extrinsics = false;        ///< T_body_camera is part of the state
  bool estimate_time_offset = false;       ///< camera.time_offset_s is
  double sigma_extrinsic_rotation = 0.01;  ///< [rad]
  double sigma_extrinsic_position = 0.01;  ///< [m]
  double sigma_time_offset = 0.005;        ///< [s]

  std::vector<KnownLandmark> landmarks;
  SlamMapOptions map;
  SlamAssociationOptions association;

  double max_gap_s = 1;  ///< camera alone: after a longer pause between frames the motion is unknown [s]

  // With an IMU.
  FusionStartOptions start;       ///< from rest
  SlamStartOptions moving_start;  ///< from motion; its sigma_px and sampling are those of these options
  /// By which the deviations of a start from motion are multiplied: what it rests on is used again by the filter.
  double moving_start_factor = 3;
  StandStillOptions stand_still;        ///< when the body rests
  bool zero_velocity = true;            ///< the velocity is zero while IMU and picture stand still
  double zero_velocity_sigma = 0.02;    ///< [m/s]
  double zero_rate_sigma_floor = 1e-4;  ///< what a body at rest may turn, earth rate included [rad/s]
  double still_picture_px = 1;  ///< the picture is, as a whole, that near to where it was: it stands still … [px]
  double still_picture_s = 1;   ///< … when it has been for so long [s]
  double max_imu_step_s = 0.1;  ///< a longer step is a gap: bridged with more noise … [s]
  double max_imu_bridge_s = 1;  ///< … up to here; beyond it a new start [s]
  double gap_acceleration_sigma = 3;        ///< what the body may do in a gap [m/s^2]
  double gap_angular_velocity_sigma = 0.5;  ///< the same [rad/s]
  double max_angular_velocity = 70;         ///< A sample with more is an error of the sensor: skipped. [rad/s]
  double max_specific_force = 500;          ///< The same. [m/s^2]
  /// So many frames in a row of which most is not believed: the motion is taken for unknown (kRecovered).
  int recover_after = 10;
  /// Without a frame that is found in the map: estimates say so (kLost; with an IMU kFewFeatures, too) [s]
  double lost_after_s = 0.5;
  /// For so long of frames that show something, but not the map, nothing is added to it: for front ends that look for
  /// it. 0: the next frame is one of new surroundings [s]
  double relocate_s = 0;

  /// @throws std::invalid_argument naming the field and its value.
  void check() const;
};

/// Settings for tracks of FeatureTracker (vision), where they differ from the general ones: pixels as good as the
/// tracker says by default (for search ellipses), features that stay inverse depth for longer, and for a camera alone
/// the noise of second order, since pictures may begin in a turn, and care with what appears where something hides the
/// map. FeatureTracker looks for the map where it was lost. Depends on options.motion alone.
SlamOptions slam_options_for_images(SlamOptions options);

}  // namespace loc
