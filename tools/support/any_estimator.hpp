// The link between the name of a method and its estimator. A new method is one more alternative of the variant, one
// entry of the table in any_estimator.cpp and its own options in EstimatorSettings.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "libloc/estimators/estimator.hpp"
#include "libloc/estimators/inertial_fusion.hpp"
#include "libloc/estimators/madgwick.hpp"

namespace loc {

struct EstimatorSettings {
  std::string method = "madgwick";
  bool use_magnetometer = true;
  MadgwickOptions madgwick = MadgwickOptions::robust();
  InertialFusionOptions fusion = InertialFusionOptions::robust();  ///< its use_magnetometer is overruled
};

/// Names that make_estimator() knows.
std::vector<std::string> estimator_methods();

class AnyEstimator {
 public:
  using Implementation = std::variant<MadgwickFilter, InertialFusion>;

  AnyEstimator(std::string method, std::string world, std::vector<StreamKind> inputs, Implementation implementation);

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

 private:
  std::string method_;
  std::string world_;
  std::vector<StreamKind> inputs_;
  Implementation implementation_;
};
static_assert(Estimator<AnyEstimator>);

/// @throws std::invalid_argument for an unknown method or options that its estimator refuses.
AnyEstimator make_estimator(const EstimatorSettings& settings);

}  // namespace loc
