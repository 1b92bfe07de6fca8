// The extended Kalman filter of SLAM with one camera: head (slam_state.hpp) and features (slam_observation.hpp) in one
// state with one covariance. It knows no streams and no clocks but the times that it is given: mono_slam.hpp and
// inertial_slam.hpp drive it.
//
// One frame:
//   1. the covariance is brought to the frame's time                                 P = F P F^T + Q
//   2. features are predicted, and matched with the frame's by identity; after a while without features, when
//      predictions say nothing, the pose is looked for in the map first (absolute_pose.hpp)
//   3. of those matched the most informative ones (largest det S) are taken, up to max_measured
//   4. 1-point RANSAC finds which of them agree; those update the state together
//   5. the others are predicted anew: who is within the gate now was right (rescued) and updates it, too
//      Features that are new only learn from what is measured of them (steer_after_frames)
//   6. a frame is found in the map when enough features of it that were there before agree. After lost_after_s of
//      frames that are not it is lost (kLost): a few that agree by chance then change nothing, and for relocate_s of
//      frames with something in them nothing is added, while the front end looks for the map. What finds it then says
//      kRefound once; if nothing does, it goes on in surroundings that are new, with the covariance of its guess, and
//      says so (kMapLinkUnknown) until it finds something from before.
//      A camera alone that is lost has the pose of a body that goes on as it did. Since it was last found it may as
//      well have stopped, turned or gone twice as fast: the velocity gets the variance of the speed that was usual (of
//      the start's velocity at least), and the place what that makes in the time gone.
//   7. features that are well known become XYZ, those that are expected and not found are deleted, new ones are added
//      where the picture is empty
// There is no initialisation phase: a feature counts from the first frame on, its depth is unknown within the prior.
//
// Not observable: without known landmarks place and heading of the world (and its tilt without an IMU), which are as
// the start says; without an IMU also the unit of lengths, which is that of the prior of inverse depths
// (kScaleUnknown). Consistency: SlamConsistency. P is of errors at the latest estimate whichever is chosen. Source: J.
// Civera, A. Davison, J. Montiel, "Inverse depth parametrization for monocular SLAM", IEEE Transactions on Robotics 24,
// 2008; J. Civera et al., "1-Point RANSAC for extended Kalman filtering", Journal of Field Robotics 27, 2010.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "libloc/core/named_count.hpp"
#include "libloc/estimators/residual_watch.hpp"
#include "libloc/estimators/slam_frame.hpp"
#include "libloc/estimators/slam_observation.hpp"
#include "libloc/estimators/slam_options.hpp"
#include "libloc/estimators/slam_prediction.hpp"
#include "libloc/estimators/slam_ransac.hpp"
#include "libloc/estimators/slam_state.hpp"
#include "libloc/filter/map_covariance.hpp"
#include "libloc/geometry/absolute_pose.hpp"

namespace loc {

/// A feature of the map.
struct SlamLandmark {
  std::int64_t id = -1;
  int offset = 0;  ///< of its errors in the state
  SlamPoint point;
  SlamPoint first;   ///< as it was first estimated, for first-estimate Jacobians
  double tries = 0;  ///< frames in which it was expected, those long ago count less
  double hits = 0;   ///< and was measured
  std::int64_t measured = 0;
  TimeNs last_measured_ns = kNoTime;
  std::int64_t last_measured_frame = -1;  ///< counted by the filter, whatever clocks do
  std::int64_t first_frame = -1;          ///< the same, when it was added; -1: known before, or of another run
  bool known = false;                     ///< its place was given
  // Of the frame at hand.
  bool visible = false;
  int observation = -1;  ///< index in the frame; -1: no such identity
  SlamFeatureState state = SlamFeatureState::kPredicted;
  Eigen::Vector2d predicted_px = Eigen::Vector2d::Constant(kUnknown);
  Eigen::Matrix2d innovation_cov = Eigen::Matrix2d::Constant(kUnknown);
};

/// All that a filter knows: to be saved, and to go on from.
struct SlamSnapshot {
  TimeNs time_ns = kNoTime;
  SlamState state;
  std::vector<SlamLandmark> landmarks;
  Eigen::MatrixXd covariance;  ///< head and features, symmetric
};

class SlamFilter {
 public:
  /// @throws std::invalid_argument as SlamOptions::check.
  explicit SlamFilter(const SlamOptions& options);

  /// Forgets the map. @param covariance of the head, layout().dim square
  void start(TimeNs time_ns, const SlamState& state, const Eigen::MatrixXd& covariance);
  /// Camera alone: as the options say.
  void start(TimeNs time_ns);
  /// Differences of such times can be taken: within 126 years of zero, and known.
  static bool is_usable(TimeNs time_ns);
  bool started() const { return time_ns_ != kNoTime; }
  /// Forgets all but the options and the counts.
  void stop();
  /// The clock jumps, the state stays: what happened meanwhile is for widen().
  void set_time(TimeNs time_ns) { time_ns_ = time_ns; }

  /// Moves on without an IMU. @param time_ns not before time_ns()
  void propagate(TimeNs time_ns);
  /// Moves on by a step of the IMU. @param time_ns its end
  void propagate(TimeNs time_ns, const InertialStep& step, const InertialStepNoise& noise);
  /// Head's variances grow: what happened meanwhile is not known. @param variance of each error of the head
  void widen(const Eigen::VectorXd& variance);

  /// Of features that are not in the map yet: their depth is known (from the start in motion). Until the next start().
  /// @param inverse_depth along the ray from the camera now [1/m] @param sigma its deviation [1/m]
  void expect_depth(std::int64_t id, double inverse_depth, double sigma);

  /// A frame at time_ns(). The result holds until the next call. @param status EstimateStatus to be said with it
  const SlamFrame& update(const FeaturesMeasurement& frame, std::uint32_t status = 0);

  /// What a frame at that time would find, were the body to move on as the model says. The filter stays where it is.
  /// @param time_ns not before time_ns()
  void predict_frame(TimeNs time_ns, SlamPrediction& out) const;
  /// The same with a step of the IMU.
  void predict_frame(TimeNs time_ns, const InertialStep& step, const InertialStepNoise& noise,
                     SlamPrediction& out) const;

  /// The same when it is not known what happened meanwhile: lost, not valid.
  void predict_lost(TimeNs time_ns, SlamPrediction& out) const;
  /// No frame for too long, says who knows the time.
  void lose();
  bool lost() const { return lost_; }
  /// Of one coordinate of the velocity when nothing is known of the motion: that of the start, or what is usual here.
  double unknown_velocity_sigma() const;

  /// The body does not move: v = 0, and with an IMU the mean rate is the gyroscope's bias.
  /// @param rate as measured, bias not removed [rad/s] @returns false when the filter knows better (gate).
  bool zero_velocity(double sigma_velocity, const Eigen::Vector3d& rate, double sigma_rate);

  TimeNs time_ns() const { return time_ns_; }
  const SlamState& state() const { return state_; }
  const SlamLayout& layout() const { return layout_; }
  const SlamOptions& options() const { return options_; }
  const std::vector<SlamLandmark>& landmarks() const { return landmarks_; }
  const SlamFrame& frame() const { return frame_; }
  const MapCovariance& covariance() const { return covariance_; }
  /// Whether the camera's intrinsics can be right (kCalibrationDoubtful); of all frames so far, over restarts.
  const ResidualWatch& residual_watch() const { return watch_; }
  /// Covariance of the head now, also between frames.
  Eigen::MatrixXd head_covariance() const;
  /// Pose, velocity, biases, their covariance; stamp and sequence are the caller's.
  Estimate estimate() const;
  std::vector<SlamMapPoint> map() const;
  /// State and variances of the head are finite, and no variance is negative. If not, numbers beyond all sense came in:
  /// what is left is to start anew.
  bool healthy() const;
  /// What has been counted since the start.
  NamedCounts counts() const;

  SlamSnapshot snapshot() const;
  /// @throws std::invalid_argument when it does not fit the options, or no filter can have made it: not finite, a
  /// variance below zero, a covariance that is none. The filter is what it was then.
  void restore(const SlamSnapshot& snapshot);

 private:
  void predict_frame_at(const SlamState& ahead, TimeNs time_ns, SlamPrediction& out) const;
  void bring_covariance_up();
  void match(const FeaturesMeasurement& frame);
  void select_measured(const FeaturesMeasurement& frame);
  // @param sigma_px its noise is set anew; 0: it stays
  bool linearise(const SlamLandmark& landmark, const Eigen::Vector2d& pixel_px, double sigma_px,
                 BlockMeasurement& out) const;
  Eigen::Matrix2d product_cov(const SlamLandmark& landmark, const Eigen::Matrix<double, 2, 3>& by_way,
                              const SlamTransition& since) const;
  bool approach(const FeaturesMeasurement& frame, SlamState& near);
  const std::vector<char>& agreeing(double sigma);
  void innovate();
  void accept(const std::vector<char>& chosen);
  void update_agreeing(const FeaturesMeasurement& frame);
  void iterate(const FeaturesMeasurement& frame);
  Eigen::Vector2d moved_by(const BlockMeasurement& measurement) const;
  void rescue(const FeaturesMeasurement& frame);
  void estimate_young(const FeaturesMeasurement& frame);
  void apply_update();
  void judge(const FeaturesMeasurement& frame);
  void report(const FeaturesMeasurement& frame);

  // slam_filter_locate.cpp
  void locate(const FeaturesMeasurement& frame);
  void doubt_motion();
  bool looks_for_map() const;
  int fewest_to_find() const;
  void forget_location();
  bool is_young(const SlamLandmark& landmark) const;
  bool is_hidden(const SlamLandmark& landmark, double lately_s) const;
  bool is_covered(const Eigen::Vector2d& pixel_px) const;
  bool waits_below_cover(const SlamLandmark& landmark) const;
  void see_cover();
  bool below_cover() const;

  // slam_filter_map.cpp
  void delete_landmarks();
  void convert_landmarks();
  void add_landmarks(const FeaturesMeasurement& frame);
  void make_room(int wanted);
  void remove_marked();
  bool add_landmark(const FeatureObservation& observation, double inverse_depth, double sigma);
  double usual_inverse_depth();
  void add_known_landmarks();

  bool is_placed(const SlamLandmark& landmark) const;
  bool sigma_is_usable(double sigma_px) const;
  double sigma_px(const FeaturesMeasurement& frame) const;

  SlamOptions options_;
  SlamLayout layout_;
  Camera camera_;
  MapCovariance covariance_;
  SlamTransition transition_;
  mutable SlamTransition ahead_;  // of predict_frame
  OnePointRansac ransac_;
  ResidualWatch watch_;
  TimeNs time_ns_ = kNoTime;
  SlamState state_;
  SlamState first_;                      // of this time, before any update: for first-estimate Jacobians
  std::vector<SlamLandmark> landmarks_;  // ascending offsets
  SlamFrame frame_;

  // Room for one frame's work, so that nothing is allocated.
  std::vector<std::pair<std::int64_t, int>> by_id_;  // of the frame's features
  std::vector<char> taken_;                          // of the frame's features
  std::vector<BlockMeasurement> measurements_;
  std::vector<int> which_;
  std::vector<int> candidates_;
  std::vector<int> young_;  // of the frame, that do not steer
  std::vector<double> residual_;
  std::vector<int> accepted_;
  std::vector<double> accepted_residual_;
  std::vector<SlamPoint> points_before_;
  std::vector<CovarianceRange> ranges_;
  std::vector<char> marked_;
  std::vector<char> agrees_;
  bool approached_ = false;  // the Jacobians of this frame are at another pose than the prior's
  std::vector<int> cells_;
  struct ExpectedDepth {
    std::int64_t id;
    double inverse_depth;
    double sigma;
  };
  std::vector<ExpectedDepth> expected_;  // by identity
  mutable std::vector<double> depths_;
  std::vector<SightedPoint> sighted_;
  Eigen::VectorXd dx_;
  Eigen::MatrixX3d shear_;
  double nis_ = 0;
  double frame_sigma_px_ = kUnknown;

  // Where the last frames were found.
  bool found_ = true;              // the last one
  bool lost_ = false;              // none for too long
  bool refound_ = false;           // by the frame at hand
  std::int64_t found_frame_ = -1;  // the last one that was; -1: none yet
  std::int64_t left_frame_ = -1;   // the last one of the map that it has left for new surroundings; -1: none
  double usual_speed_ = 0;         // while found [unit/s]
  double usual_log_inverse_depth_ = kUnknown;  // of what was seen lately
  TimeNs usual_depth_ns_ = kNoTime;
  TimeNs found_ns_ = kNoTime;       // its time
  TimeNs last_frame_ns_ = kNoTime;  // of any frame
  double strange_s_ = 0;            // for so long frames have shown something else
  TimeNs cover_ns_ = kNoTime;       // when something last hid many features at once
  double usually_found_ = 0;        // features

  std::int64_t frames_ = 0;
  std::int64_t lost_frames_ = 0;
  std::int64_t times_refound_ = 0;
  std::int64_t times_gone_on_ = 0;
  std::int64_t ambiguous_ = 0;
  std::int64_t not_usable_ = 0;
  std::int64_t sigma_not_usable_ = 0;
  std::int64_t failed_updates_ = 0;
  SlamCounts total_;
};

}  // namespace loc
