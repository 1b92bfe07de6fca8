#include "tools/support/any_estimator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
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
  AnyEstimator out("mono-slam", world_frame_name(WorldFrame::kEnu), kSlamInputs, MonoSlam(settings.slam),
                   settings.slam_start);
  if (settings.anchor) out.set_anchor(*settings.anchor);
  return out;
}

AnyEstimator make_inertial_slam(const EstimatorSettings& settings) {
  AnyEstimator out("inertial-slam", world_frame_name(WorldFrame::kEnu), kSlamInputs, InertialSlam(settings.slam),
                   settings.slam_start);
  if (settings.anchor) out.set_anchor(*settings.anchor);
  out.set_attitude_check(settings.use_magnetometer && settings.anchor.has_value());
  return out;
}

// What each method cannot do without.
StreamWatchOptions watch_options(const AnyEstimator::Implementation& implementation) {
  StreamWatchOptions options;
  if (!std::holds_alternative<MonoSlam>(implementation)) options.needed.push_back(StreamKind::kImu);
  if (std::holds_alternative<MonoSlam>(implementation) || std::holds_alternative<InertialSlam>(implementation)) {
    options.needed.push_back(StreamKind::kImage);
  }
  return options;
}

std::string to_add(const std::string& what, double offset_s, double sigma_s) {
  const std::string deviation = std::isfinite(sigma_s) ? " (deviation " + to_text(1e3 * sigma_s, 2) + ")" : "";
  return to_text(1e3 * offset_s, 3) + " ms" + deviation + " to add to " + what;
}

// The deviation is that of the least squares; without them the offset is one of a coarse search.
std::string to_add(const std::string& what, const StampWatch& watch) {
  return to_add(what, watch.offset_s(), watch.offset_s() == watch.fine_s() ? watch.sigma_s() : kUnknown);
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
      start_(std::move(start)),
      watch_(watch_options(implementation_)) {
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
  std::replace(inputs_.begin(), inputs_.end(), StreamKind::kFeatures, StreamKind::kImage);
}

void AnyEstimator::set_anchor(const MapAnchorOptions& options) {
  require(std::holds_alternative<MonoSlam>(implementation_) || std::holds_alternative<InertialSlam>(implementation_),
          "method '" + method_ + "' has no map to anchor");
  anchor_.emplace(options);
  if (!takes(StreamKind::kGps)) inputs_.push_back(StreamKind::kGps);
}

void AnyEstimator::set_attitude_check(bool use_magnetometer) {
  require(std::holds_alternative<InertialSlam>(implementation_), "method '" + method_ + "' has no attitude to check");
  attitude_.emplace();
  if (use_magnetometer && !takes(StreamKind::kMagnetometer)) inputs_.push_back(StreamKind::kMagnetometer);
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
  for (const SlamFrame& frame : raw_frames()) front_end_->learn(frame);
  return is_new;
}

bool AnyEstimator::pass_to_method(const Measurement& measurement) {
  auto* mono = std::get_if<MonoSlam>(&implementation_);
  auto* inertial = std::get_if<InertialSlam>(&implementation_);
  if (front_end_ != nullptr && mono != nullptr) return process_with_pictures(*mono, measurement);
  if (front_end_ != nullptr && inertial != nullptr) return process_with_pictures(*inertial, measurement);
  frames_are_new_ = true;
  return std::visit([&](auto& estimator) { return estimator.process(measurement); }, implementation_);
}

bool AnyEstimator::process(const Measurement& measurement) {
  gave_estimate_ = frames_are_new_ = false;
  frame_count_ = 0;
  watch_.see(measurement);
  if (const auto* gps = std::get_if<GpsMeasurement>(&measurement); gps != nullptr && anchor_) {
    anchor_->fuse(*gps);
    return false;
  }
  if (attitude_) attitude_->see(measurement);
  gave_estimate_ = pass_to_method(measurement);
  take_result();
  return gave_estimate_;
}

bool AnyEstimator::finish() {
  gave_estimate_ = false;
  frame_count_ = 0;
  auto* inertial = std::get_if<InertialSlam>(&implementation_);
  frames_are_new_ = inertial != nullptr;
  if (inertial != nullptr) gave_estimate_ = inertial->finish();
  take_result();
  return gave_estimate_;
}

// The method's estimate, in the world that GPS gives it, with what else is known of it.
void AnyEstimator::take_result() {
  if (gave_estimate_) {
    const Estimate made = std::visit([](const auto& estimator) { return estimator.estimate(); }, implementation_);
    std::uint32_t status = watch_.status();
    if (attitude_) status |= attitude_->compare(made);
    if (anchor_) {
      if (attitude_ && !anchor_->anchored()) {
        if (const auto heading = attitude_->heading_of_world(made)) {
          anchor_->hint_heading(*heading, attitude_->options().heading_sigma);
        }
      }
      Estimate in_map = made;
      in_map.status |= status;
      anchor_->move(in_map);
      estimate_ = anchor_->in_world(in_map);
      estimate_.status |= anchor_->take_status();
    } else {
      estimate_ = made;
      estimate_.status |= status;
    }
    georeferenced_ = std::isfinite(estimate_.origin.latitude);
  }
  give_frames();
}

void AnyEstimator::give_frames() {
  for (const SlamFrame& frame : raw_frames()) {
    if (frames_.size() == frame_count_) frames_.emplace_back();
    SlamFrame& out = frames_[frame_count_++];
    out = frame;
    if (anchor_) anchor_->put_in_world(out);
  }
}

Estimate AnyEstimator::estimate() const {
  return estimate_;
}

std::uint32_t AnyEstimator::status() const {
  constexpr std::uint32_t kOfStreams = kNoImages | kNoImu;
  // Of streams the newest measurement tells, of the rest the last estimate; an event happens once.
  const std::uint32_t events = gave_estimate_ ? 0U : kRefound;
  return (estimate_.status & ~(kOfStreams | events)) | watch_.status();
}

std::string AnyEstimator::detail_of(std::uint32_t bit) const {
  const auto* inertial = std::get_if<InertialSlam>(&implementation_);
  const auto* fusion = std::get_if<InertialFusion>(&implementation_);
  if (bit == kStampsDoubtful && inertial != nullptr) {
    return to_add("the camera's stamps", inertial->stamp_watch());
  }
  if (bit == kStampsDoubtful && fusion != nullptr) {
    return to_add("the odometry's stamps", fusion->stamp_watch());
  }
  if (bit == kGpsStampsDoubtful && (anchor_ || fusion != nullptr)) {
    const GpsLagWatch& watch = anchor_ ? anchor_->lag_watch() : fusion->lag_watch();
    return to_add("the fixes' stamps", watch.offset_s(), watch.sigma_s());
  }
  const SlamFilter* filter = slam();
  if (bit != kCalibrationDoubtful || filter == nullptr) return {};
  const ResidualWatchVerdict& verdict = filter->residual_watch().verdict();
  const auto number = [&](int i) { return to_text(verdict.db[i], 3) + " +- " + to_text(verdict.sigma[i], 2); };
  return "innovations turn with ln f " + number(0) + ", cx " + number(1) + " px, cy " + number(2) + " px, k1 " +
         number(3);
}

NamedCounts AnyEstimator::counts() const {
  NamedCounts out = std::visit([](const auto& estimator) { return estimator.counts(); }, implementation_);
  if (front_end_ != nullptr) {
    for (NamedCount& count : front_end_->counts()) out.push_back(std::move(count));
  }
  if (anchor_) {
    for (NamedCount& count : anchor_->counts()) out.push_back(std::move(count));
  }
  return out;
}

void AnyEstimator::reset() {
  std::visit([](auto& estimator) { estimator.reset(); }, implementation_);
  gave_estimate_ = frames_are_new_ = georeferenced_ = false;
  frame_count_ = 0;
  estimate_.time_ns = kNoTime;
  estimate_.valid = estimate_.status = 0;
  estimate_.covariance_dim = 0;
  watch_.reset();
  if (anchor_) anchor_->reset();
  if (attitude_) attitude_->reset();
  if (front_end_ != nullptr) front_end_->reset();
  restore();
}

std::span<const SlamFrame> AnyEstimator::raw_frames() const {
  if (!frames_are_new_) return {};
  if (const auto* inertial = std::get_if<InertialSlam>(&implementation_)) return inertial->frames();
  const auto* mono = std::get_if<MonoSlam>(&implementation_);
  if (mono == nullptr || !gave_estimate_) return {};
  return {&mono->frame(), 1};
}

std::vector<SlamMapPoint> AnyEstimator::slam_map() const {
  const SlamFilter* filter = slam();
  if (filter == nullptr) return {};
  std::vector<SlamMapPoint> points = filter->map();
  if (anchor_) {
    for (SlamMapPoint& point : points) anchor_->put_in_world(point);
  }
  return points;
}

const SlamFilter* AnyEstimator::slam() const {
  const SlamFilter* filter = nullptr;
  if (const auto* mono = std::get_if<MonoSlam>(&implementation_)) filter = &mono->filter();
  if (const auto* inertial = std::get_if<InertialSlam>(&implementation_)) filter = &inertial->filter();
  return filter != nullptr && filter->started() ? filter : nullptr;
}

}  // namespace loc
