// SLAM with one camera and an IMU: metres, gravity, and a world with z up. The IMU carries the state from frame to
// frame (filter/imu_propagation.hpp), the tracks of features correct it; slam_filter.hpp has the filter.
//
// Start: from rest by the first second (fusion_start.hpp); from motion by a window of samples and tracks
// (slam_start.hpp). What came in the meantime is used then: the first estimate comes late, frames() has all frames.
// Frames: world has z up; heading 0 is where so3::heading of the body was at the start, the place is options.position.
// Clocks: t_imu = t_camera + time offset. A frame waits for the IMU sample at or after its time.
// Rest: while IMU (stand_still.hpp) and picture stand still, the velocity is zero.
// Gaps of the IMU: up to max_imu_step_s nothing; up to max_imu_bridge_s bridged with more noise (kBridged, kGap);
// beyond it a new start, which keeps place and heading with the uncertainty that they have by then (kReinitialised),
// not the map. Without features the IMU goes on alone; estimates say kFewFeatures after lost_after_s.
//
// Not observable: place and heading of the world. Without acceleration: the scale.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "libloc/core/fifo.hpp"
#include "libloc/estimators/estimator.hpp"
#include "libloc/estimators/fusion_start.hpp"
#include "libloc/estimators/picture_rest.hpp"
#include "libloc/estimators/slam_filter.hpp"
#include "libloc/estimators/slam_options.hpp"
#include "libloc/estimators/slam_start.hpp"
#include "libloc/estimators/stamp_watch.hpp"
#include "libloc/estimators/stand_still.hpp"

namespace loc {

class InertialSlam {
 public:
  /// @throws std::invalid_argument as SlamOptions::check, and for another motion model than kInertial.
  explicit InertialSlam(const SlamOptions& options);

  // Estimator concept. There is an estimate for every IMU sample after the start.
  bool process(const Measurement& measurement);
  Estimate estimate() const;
  NamedCounts counts() const;
  void reset();

  /// Where the features of the map are expected in a picture of that time (clock of the camera), before it is
  /// processed: from the IMU samples so far; what is missing of them to that time the body is taken to go on. Not valid
  /// before the start, for a time before the last sample's that was used, or more than max_imu_bridge_s after it.
  void predict_frame(TimeNs time_ns, SlamPrediction& out) const;

  /// The end of a recording: samples that are held back are used, and frames that wait for a sample after them, when
  /// they are nearer to the last sample than the next one would be. frames() has them. It may go on.
  /// @returns whether estimate() is new.
  bool finish();

  bool running() const { return filter_.started(); }
  /// Frames that the last process() or finish() has completed: usually none or one, at the start those that had waited.
  /// Their estimates are at the frames' own times.
  std::span<const SlamFrame> frames() const { return {frames_.data(), frame_count_}; }
  std::vector<SlamMapPoint> map() const { return filter_.map(); }
  const SlamFilter& filter() const { return filter_; }
  /// Whether the stamps of camera and gyroscope fit (kStampsDoubtful); works before a start, too.
  const StampWatch& stamp_watch() const { return stamps_; }
  const SlamOptions& options() const { return filter_.options(); }

  SlamSnapshot snapshot() const { return filter_.snapshot(); }
  /// Goes on from there with the next IMU sample, which may be at any time: what happened between is unknown but for a
  /// body that went nowhere (as a gap of max_imu_bridge_s).
  /// @throws std::invalid_argument as SlamFilter::restore; the estimator is what it was then.
  void restore(const SlamSnapshot& snapshot);

 private:
  // Variances of one component of a reading, by the differences from sample to sample.
  struct Vibration {
    ImuMeasurement last;
    double rate = 0;
    double force = 0;
  };
  struct Carried {
    TimeNs time_ns = kNoTime;
    SlamState state;
    Eigen::MatrixXd covariance;
  };

  bool receive(const ImuMeasurement& imu);
  bool hold_back(const ImuMeasurement& imu);
  bool process_imu(const ImuMeasurement& imu);
  TimeNs hold_back_ns() const;
  void process_frame(const FeaturesMeasurement& frame);
  bool usable(const ImuMeasurement& imu);
  bool look_for_start();
  bool start_moving();
  void begin(TimeNs time_ns, const InertialState& from,
             const Eigen::Matrix<double, kInertialDim, kInertialDim>& from_covariance, const char* count);
  void carry_over(TimeNs time_ns, SlamState& state, Eigen::MatrixXd& covariance) const;
  void replay_early();
  void recover(const SlamFrame& frame);
  void run(const ImuMeasurement& imu);
  void take_frames_until(TimeNs until_ns, const ImuMeasurement& imu);
  void step_to(TimeNs time_ns, const ImuMeasurement& to);
  void widen(double angle, double position, double velocity);
  void bridge(const ImuMeasurement& imu);
  void start_anew();
  void forget();
  void forget_early();
  InertialStepNoise noise_of(double dt_s) const;
  void see_vibration(const ImuMeasurement& imu);
  void take_frame(const FeaturesMeasurement& frame);
  void look_for_rest(const ImuMeasurement& imu);
  TimeNs on_imu_clock(TimeNs camera_time_ns) const;
  void skip(const char* count, std::uint32_t status);

  SlamFilter filter_;
  FusionStart start_;
  SlamStart moving_start_;
  StandStillDetector rest_;
  PictureRest picture_rest_;
  StampWatch stamps_;
  std::vector<SlamFrame> frames_;
  std::size_t frame_count_ = 0;

  Fifo<ImuMeasurement> held_;           // samples that wait for frames whose clock is ahead
  std::optional<ImuMeasurement> leap_;  // a sample far ahead of all others: the next one tells what it was
  FeaturesMeasurement taking_;          // the frame at hand
  Fifo<FeaturesMeasurement> waiting_;   // frames, for the IMU
  std::vector<ImuMeasurement> early_;   // samples, for the start
  int early_frames_ = 0;                // since a start was last tried
  double try_wait_s_ = 0;               // after which a start is tried again
  TimeNs try_after_ns_ = kNoTime;       // the same, as a time
  ImuMeasurement last_imu_;             // as the filter's state is; its rate and force at the filter's time
  Stamp last_;                          // of the sample that the estimate is for
  TimeNs newest_ns_ = kNoTime;          // sample received
  int frames_set_back_ = 0;             // in a row
  std::optional<Carried> carried_;
  Vibration vibration_;
  TimeNs sample_ns_ = 0;  // between the last two samples
  bool at_rest_ = false;
  int rejected_in_a_row_ = 0;
  TimeNs last_good_frame_ns_ = kNoTime;
  TimeNs last_frame_ns_ = kNoTime;
  TimeNs rest_used_ns_ = kNoTime;
  bool restored_ = false;
  int set_back_in_a_row_ = 0;
  std::uint32_t frame_status_ = 0;  // of the last frame
  std::uint32_t status_ = 0;
  std::uint32_t next_status_ = 0;
  std::int64_t imu_used_ = 0;
  std::int64_t frames_used_ = 0;
  std::map<std::string, std::int64_t> counts_;
};

static_assert(Estimator<InertialSlam>);

}  // namespace loc
