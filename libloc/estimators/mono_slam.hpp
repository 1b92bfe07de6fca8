// SLAM with one camera alone: tracks of features in, pose of the camera and map out, from the first frame on. It moves
// with constant velocity but for white acceleration; slam_filter.hpp has the filter.
//
// Frames: world is where the body began, with the axes of options.q_world_body (default, for a body whose axes are the
// camera's: z up, x where the camera looked). Poses are of body.
// Not observable: the unit of lengths, unless landmarks are known; estimates say so (kScaleUnknown). It is that of the
// prior of inverse depths, and drifts where everything that was seen has been left behind.
// Frames that come late or twice, or jump back in time, are skipped and counted. After a pause of more than max_gap_s
// the motion is unknown, the map is kept.
#pragma once

#include <cstdint>

#include "libloc/estimators/estimator.hpp"
#include "libloc/estimators/slam_filter.hpp"
#include "libloc/estimators/slam_options.hpp"

namespace loc {

class MonoSlam {
 public:
  /// @throws std::invalid_argument as SlamOptions::check, and for another motion model than kConstantVelocity.
  explicit MonoSlam(const SlamOptions& options);

  // Estimator concept. There is an estimate for every frame, the first one included.
  bool process(const Measurement& measurement);
  Estimate estimate() const { return estimate_; }
  NamedCounts counts() const;
  void reset();

  /// Where the features of the map are expected in a picture of that time, before it is processed. Not valid before the
  /// first frame, after a pause of more than max_gap_s, and for a time that is not after the last frame's.
  void predict_frame(TimeNs time_ns, SlamPrediction& out) const;

  bool running() const { return filter_.started(); }
  /// Of the last frame that was used. The reference holds, what it says changes with the next frame.
  const SlamFrame& frame() const { return filter_.frame(); }
  std::vector<SlamMapPoint> map() const { return filter_.map(); }
  const SlamFilter& filter() const { return filter_; }
  const SlamOptions& options() const { return filter_.options(); }

  SlamSnapshot snapshot() const { return filter_.snapshot(); }
  /// Goes on from there: the next frame may come at any later time, or on another clock (a pause of unknown length).
  /// @throws std::invalid_argument as SlamFilter::restore; the estimator is what it was then.
  void restore(const SlamSnapshot& snapshot);

 private:
  bool process_frame(const FeaturesMeasurement& frame);
  void widen_after_gap(double pause_s);

  SlamFilter filter_;
  Estimate estimate_;
  std::uint32_t next_status_ = 0;
  bool restored_ = false;
  int set_back_in_a_row_ = 0;
  std::int64_t used_ = 0;
  std::int64_t not_increasing_ = 0;
  std::int64_t out_of_range_ = 0;
  std::int64_t gaps_ = 0;
  std::int64_t starts_ = 0;
  std::int64_t diverged_ = 0;
};

static_assert(Estimator<MonoSlam>);

}  // namespace loc
