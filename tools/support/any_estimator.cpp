#include "tools/support/any_estimator.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

struct Method {
  const char* name;
  AnyEstimator (*make)(const EstimatorSettings& settings);
};

AnyEstimator make_madgwick(const EstimatorSettings& settings) {
  std::vector<StreamKind> inputs = {StreamKind::kImu};
  if (settings.use_magnetometer) inputs.push_back(StreamKind::kMagnetometer);
  return {"madgwick", world_frame_name(settings.madgwick.world), std::move(inputs), MadgwickFilter(settings.madgwick)};
}

AnyEstimator make_error_state(const EstimatorSettings& settings) {
  InertialFusionOptions options = settings.fusion;
  options.use_magnetometer = settings.use_magnetometer;
  std::vector<StreamKind> inputs = {StreamKind::kImu};
  if (options.use_magnetometer) inputs.push_back(StreamKind::kMagnetometer);
  if (options.use_gps) inputs.push_back(StreamKind::kGps);
  if (options.use_odometry) inputs.push_back(StreamKind::kOdometry);
  return {"error-state", world_frame_name(WorldFrame::kEnu), std::move(inputs), InertialFusion(options)};
}

constexpr std::array kMethods = {Method{"madgwick", make_madgwick}, Method{"error-state", make_error_state}};

}  // namespace

std::vector<std::string> estimator_methods() {
  std::vector<std::string> names;
  for (const Method& method : kMethods) names.emplace_back(method.name);
  return names;
}

AnyEstimator make_estimator(const EstimatorSettings& settings) {
  const auto* const found = std::find_if(kMethods.begin(), kMethods.end(),
                                         [&](const Method& method) { return settings.method == method.name; });
  require(found != kMethods.end(), "method '" + settings.method + "' is not known");
  return found->make(settings);
}

AnyEstimator::AnyEstimator(std::string method, std::string world, std::vector<StreamKind> inputs,
                           Implementation implementation)
    : method_(std::move(method)),
      world_(std::move(world)),
      inputs_(std::move(inputs)),
      implementation_(std::move(implementation)) {}

bool AnyEstimator::takes(StreamKind kind) const {
  return std::find(inputs_.begin(), inputs_.end(), kind) != inputs_.end();
}

bool AnyEstimator::takes_late(StreamKind kind) const {
  return std::holds_alternative<InertialFusion>(implementation_) &&
         (kind == StreamKind::kGps || kind == StreamKind::kOdometry);
}

bool AnyEstimator::process(const Measurement& measurement) {
  return std::visit([&](auto& estimator) { return estimator.process(measurement); }, implementation_);
}

Estimate AnyEstimator::estimate() const {
  return std::visit([](const auto& estimator) { return estimator.estimate(); }, implementation_);
}

NamedCounts AnyEstimator::counts() const {
  return std::visit([](const auto& estimator) { return estimator.counts(); }, implementation_);
}

void AnyEstimator::reset() {
  std::visit([](auto& estimator) { estimator.reset(); }, implementation_);
}

}  // namespace loc
