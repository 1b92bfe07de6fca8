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

// The IMU tells a driver how far the estimator has got (flow_control.hpp), though the camera alone has no use for it.
const std::vector<StreamKind> kSlamInputs = {StreamKind::kImu, StreamKind::kFeatures};

AnyEstimator make_mono_slam(const EstimatorSettings& settings) {
  return {"mono-slam", world_frame_name(WorldFrame::kEnu), kSlamInputs, MonoSlam(settings.slam), settings.slam_start};
}

AnyEstimator make_inertial_slam(const EstimatorSettings& settings) {
  return {"inertial-slam", world_frame_name(WorldFrame::kEnu), kSlamInputs, InertialSlam(settings.slam),
          settings.slam_start};
}

constexpr std::array kMethods = {Method{"madgwick", make_madgwick}, Method{"error-state", make_error_state},
                                 Method{"mono-slam", make_mono_slam}, Method{"inertial-slam", make_inertial_slam}};

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
                           Implementation implementation, std::optional<SlamSnapshot> start)
    : method_(std::move(method)),
      world_(std::move(world)),
      inputs_(std::move(inputs)),
      implementation_(std::move(implementation)),
      start_(std::move(start)) {
  restore();
}

void AnyEstimator::restore() {
  if (!start_) return;
  if (auto* mono = std::get_if<MonoSlam>(&implementation_)) mono->restore(*start_);
  if (auto* inertial = std::get_if<InertialSlam>(&implementation_)) inertial->restore(*start_);
}

bool AnyEstimator::takes(StreamKind kind) const {
  return std::find(inputs_.begin(), inputs_.end(), kind) != inputs_.end();
}

bool AnyEstimator::takes_late(StreamKind kind) const {
  return std::holds_alternative<InertialFusion>(implementation_) &&
         (kind == StreamKind::kGps || kind == StreamKind::kOdometry);
}

void AnyEstimator::set_front_end(std::unique_ptr<PictureFrontEnd> front_end) {
  require(std::holds_alternative<MonoSlam>(implementation_) || std::holds_alternative<InertialSlam>(implementation_),
          "method '" + method_ + "' has no use for pictures");
  // The front end counts its features from 0, whoever had these numbers before.
  const SlamOptions& options = std::holds_alternative<MonoSlam>(implementation_)
                                   ? std::get<MonoSlam>(implementation_).options()
                                   : std::get<InertialSlam>(implementation_).options();
  require(!start_ && options.landmarks.empty(),
          "pictures: features of a saved map or known landmarks are not recognised");
  front_end_ = std::move(front_end);
  inputs_ = {StreamKind::kImu, StreamKind::kImage};
}

template <class Slam>
bool AnyEstimator::process_with_pictures(Slam& slam, const Measurement& measurement) {
  const auto* image = std::get_if<ImageMeasurement>(&measurement);
  bool is_new = false;
  if (image == nullptr) {
    is_new = slam.process(measurement);
  } else {
    if (image->camera != slam.options().camera_index) return false;
    slam.predict_frame(image->time_ns, expected_);
    const FeaturesMeasurement* features = front_end_->track(*image, expected_);
    if (features == nullptr) return false;
    features_ = *features;
    is_new = slam.process(features_);
  }
  gave_estimate_ = is_new;
  frames_are_new_ = true;
  for (const SlamFrame& frame : slam_frames()) front_end_->learn(frame);
  return is_new;
}

bool AnyEstimator::process(const Measurement& measurement) {
  gave_estimate_ = frames_are_new_ = false;
  auto* mono = std::get_if<MonoSlam>(&implementation_);
  auto* inertial = std::get_if<InertialSlam>(&implementation_);
  if (front_end_ != nullptr && mono != nullptr) {
    gave_estimate_ = process_with_pictures(*mono, measurement);
  } else if (front_end_ != nullptr && inertial != nullptr) {
    gave_estimate_ = process_with_pictures(*inertial, measurement);
  } else {
    gave_estimate_ = std::visit([&](auto& estimator) { return estimator.process(measurement); }, implementation_);
    frames_are_new_ = true;
  }
  return gave_estimate_;
}

bool AnyEstimator::finish() {
  gave_estimate_ = false;
  auto* inertial = std::get_if<InertialSlam>(&implementation_);
  frames_are_new_ = inertial != nullptr;
  if (inertial != nullptr) gave_estimate_ = inertial->finish();
  return gave_estimate_;
}

Estimate AnyEstimator::estimate() const {
  return std::visit([](const auto& estimator) { return estimator.estimate(); }, implementation_);
}

NamedCounts AnyEstimator::counts() const {
  NamedCounts out = std::visit([](const auto& estimator) { return estimator.counts(); }, implementation_);
  if (front_end_ != nullptr) {
    for (NamedCount& count : front_end_->counts()) out.push_back(std::move(count));
  }
  return out;
}

void AnyEstimator::reset() {
  std::visit([](auto& estimator) { estimator.reset(); }, implementation_);
  gave_estimate_ = frames_are_new_ = false;
  if (front_end_ != nullptr) front_end_->reset();
  restore();
}

std::span<const SlamFrame> AnyEstimator::slam_frames() const {
  if (!frames_are_new_) return {};
  if (const auto* inertial = std::get_if<InertialSlam>(&implementation_)) return inertial->frames();
  const auto* mono = std::get_if<MonoSlam>(&implementation_);
  if (mono == nullptr || !gave_estimate_) return {};
  return {&mono->frame(), 1};
}

std::vector<SlamMapPoint> AnyEstimator::slam_map() const {
  const SlamFilter* filter = slam();
  return filter != nullptr ? filter->map() : std::vector<SlamMapPoint>{};
}

const SlamFilter* AnyEstimator::slam() const {
  const SlamFilter* filter = nullptr;
  if (const auto* mono = std::get_if<MonoSlam>(&implementation_)) filter = &mono->filter();
  if (const auto* inertial = std::get_if<InertialSlam>(&implementation_)) filter = &inertial->filter();
  return filter != nullptr && filter->started() ? filter : nullptr;
}

}  // namespace loc
