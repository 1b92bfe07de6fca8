// The link between the name of a method and its estimator. A new method is one more alternative of the variant, one
// entry of the table in any_estimator.cpp and its own options in EstimatorSettings.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "libloc/estimators/estimator.hpp"
#include "libloc/estimators/inertial_fusion.hpp"
#include "libloc/estimators/inertial_slam.hpp"
#include "libloc/estimators/madgwick.hpp"
#include "libloc/estimators/mono_slam.hpp"
#include "tools/support/picture_front_end.hpp"

namespace loc {

struct EstimatorSettings {
  std::string method = "madgwick";
  bool use_magnetometer = true;
  MadgwickOptions madgwick = MadgwickOptions::robust();
  InertialFusionOptions fusion = InertialFusionOptions::robust();  ///< its use_magnetometer is overruled
  SlamOptions slam;                                                ///< its motion must be the method's
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

  const std::string& method() const { return method_; }
  const std::string& world() const { return world_; }
  /// Streams that it takes.
  const std::vector<StreamKind>& inputs() const { return inputs_; }
  bool takes(StreamKind kind) const;
  /// It puts samples of this kind where they belong, though later ones have been there already.
  bool takes_late(StreamKind kind) const;

  // Estimator concept.
  bool process(const Measurement& measurement);
  Estimate estimate() const;
  NamedCounts counts() const;
  void reset();
  /// The end of a recording: what waits in the estimator is used. @returns whether estimate() is new.
  bool finish();

  // Of SLAM; the others have nothing there.
  /// Frames that the last process() or finish() has completed, until the next one.
  std::span<const SlamFrame> slam_frames() const;
  std::vector<SlamMapPoint> slam_map() const;
  /// @return nullptr before the start, too.
  const SlamFilter* slam() const;

 private:
  void restore();
  template <class Slam>
  bool process_with_pictures(Slam& slam, const Measurement& measurement);

  std::string method_;
  std::string world_;
  std::vector<StreamKind> inputs_;
  Implementation implementation_;
  std::optional<SlamSnapshot> start_;
  std::unique_ptr<PictureFrontEnd> front_end_;
  SlamPrediction expected_;
  Measurement features_ = FeaturesMeasurement{};
  bool gave_estimate_ = false;   // the last process()
  bool frames_are_new_ = false;  // it came to the estimator
};
static_assert(Estimator<AnyEstimator>);

/// @throws std::invalid_argument for an unknown method or options that its estimator refuses.
AnyEstimator make_estimator(const EstimatorSettings& settings);

}  // namespace loc
