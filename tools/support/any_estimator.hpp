// The link between the name of a method and its estimator. A new method is one more alternative of the variant, one
// entry of the table in any_estimator.cpp and its own options in EstimatorSettings.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "libloc/estimators/attitude_check.hpp"
#include "libloc/estimators/estimator.hpp"
#include "libloc/estimators/inertial_fusion.hpp"
#include "libloc/estimators/inertial_slam.hpp"
#include "libloc/estimators/madgwick.hpp"
#include "libloc/estimators/map_anchor.hpp"
#include "libloc/estimators/mono_slam.hpp"
#include "libloc/estimators/stream_watch.hpp"
#include "tools/support/picture_front_end.hpp"

namespace loc {

struct EstimatorSettings {
  std::string method = "madgwick";
  bool use_magnetometer = true;
  MadgwickOptions madgwick = MadgwickOptions::robust();
  InertialFusionOptions fusion = InertialFusionOptions::robust();  ///< its use_magnetometer is overruled
  SlamOptions slam;                                                ///< its motion must be the method's
  std::optional<MapAnchorOptions> anchor;                          ///< SLAM: GPS ties its map to the Earth
  std::optional<SlamSnapshot> slam_start;  ///< where SLAM goes on from, at its start and after each reset
};

/// Names that make_estimator() knows.
std::vector<std::string> estimator_methods();

class AnyEstimator {
 public:
  using Implementation = std::variant<MadgwickFilter, InertialFusion, MonoSlam, InertialSlam>;

  /// @param start for SLAM: a state to go on from @throws std::invalid_argument when it does not fit
  AnyEstimator(std::string method, std::string world, std::vector<StreamKind> inputs, Implementation implementation,
               std::optional<SlamSnapshot> start = {});

  /// SLAM: features are found in the camera's pictures, and tracks that come are left aside.
  /// @throws std::invalid_argument for another method.
  void set_front_end(std::unique_ptr<PictureFrontEnd> front_end);
  /// SLAM: GPS ties the map to the Earth (map_anchor.hpp). @throws std::invalid_argument for another method.
  void set_anchor(const MapAnchorOptions& options);
  /// SLAM with an IMU: Madgwick's filter beside it looks after the vertical and, with a magnetometer, tells the anchor
  /// a first heading. @throws std::invalid_argument for another method.
  void set_attitude_check(bool use_magnetometer);

  const std::string& method() const { return method_; }
  const std::string& world() const { return world_; }
  /// Streams that it takes.
  const std::vector<StreamKind>& inputs() const { return inputs_; }
  bool takes(StreamKind kind) const;
  /// It puts samples of this kind where they belong, though later ones have been there already.
  bool takes_late(StreamKind kind) const;
  /// Samples of this kind need no place among the others: nothing waits for them.
  bool takes_at_once(StreamKind kind) const {
    return (kind == StreamKind::kGps && anchor_.has_value()) ||
           (kind == StreamKind::kMagnetometer && attitude_.has_value());
  }

  // Estimator concept.
  bool process(const Measurement& measurement);
  Estimate estimate() const;
  NamedCounts counts() const;
  void reset();
  /// The end of a recording: what waits in the estimator is used. @returns whether estimate() is new.
  bool finish();

  /// EstimateStatus that holds now, whether or not there are estimates.
  std::uint32_t status() const;
  /// What is known of a doubt in it, in words: by how much, with its deviation. Empty for other bits.
  std::string detail_of(std::uint32_t bit) const;
  TimeNs newest_measurement_ns() const { return watch_.newest_ns(); }
  /// Poses are on the Earth: of the last estimate.
  bool georeferenced() const { return georeferenced_; }

  // Of SLAM; the others have nothing there.
  /// Frames that the last process() or finish() has completed, until the next one.
  std::span<const SlamFrame> slam_frames() const { return {frames_.data(), frame_count_}; }
  /// As it is in the estimates' world.
  std::vector<SlamMapPoint> slam_map() const;
  const MapAnchor* anchor() const { return anchor_ ? &*anchor_ : nullptr; }
  /// @return nullptr before the start, too.
  const SlamFilter* slam() const;

 private:
  void restore();
  template <class Slam>
  bool process_with_pictures(Slam& slam, const Measurement& measurement);
  bool pass_to_method(const Measurement& measurement);
  std::span<const SlamFrame> raw_frames() const;
  void take_result();
  void give_frames();

  std::string method_;
  std::string world_;
  std::vector<StreamKind> inputs_;
  Implementation implementation_;
  std::optional<SlamSnapshot> start_;
  std::unique_ptr<PictureFrontEnd> front_end_;
  SlamPrediction expected_;
  Measurement features_ = FeaturesMeasurement{};
  StreamWatch watch_;
  std::optional<MapAnchor> anchor_;
  std::optional<AttitudeCheck> attitude_;
  Estimate estimate_;
  std::vector<SlamFrame> frames_;  // of the last process(), in the world; slots keep their memory
  std::size_t frame_count_ = 0;
  bool georeferenced_ = false;
  bool gave_estimate_ = false;   // the last process()
  bool frames_are_new_ = false;  // it came to the estimator
};
static_assert(Estimator<AnyEstimator>);

/// @throws std::invalid_argument for an unknown method or options that its estimator refuses.
AnyEstimator make_estimator(const EstimatorSettings& settings);

}  // namespace loc
