#include "libloc/vision/feature_tracker.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/estimators/picture_rest.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/vision/corner_detector.hpp"
#include "libloc/vision/feature_tracker_work.hpp"
#include "libloc/vision/image_view.hpp"
#include "libloc/vision/patch.hpp"

namespace loc {

using namespace feature_tracker;

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kWarpStep = 4;        // over which the warp's derivative is taken [px]
constexpr double kKltDisagrees = 1.5;  // two ways from the last picture to this one: not the same feature [px]
constexpr int kMostKltSteps = 20;
constexpr double kKltConverged = 0.03;  // [px]
constexpr double kKltEigenvalue = 1e-3;
constexpr double kVagueGuess = 60;  // deviation of a place that is no guess any more [px]
constexpr double kTwins = 5;        // two tracks nearer than this are one feature [px]
constexpr int kBrightnessStep = 4;  // every so many pixels count for the mean brightness
constexpr TimeNs kLongestPauseNs = 1'000'000'000;
constexpr double kMostSigmaPx = 30;    // of a standing picture; more says nothing either
constexpr int kRemembered = 200;       // pictures in which nobody expects what is not seen
constexpr double kMostPlaces = 20000;  // at which lost features are looked for in one picture: some 2 ms

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

Brightness brightness_of(const cv::Mat& image) {
  double sum = 0;
  double squares = 0;
  int count = 0;
  for (int y = 0; y < image.rows; y += kBrightnessStep) {
    const std::uint8_t* row = image.ptr(y);
    for (int x = 0; x < image.cols; x += kBrightnessStep) {
      sum += row[x];
      squares += static_cast<double>(row[x]) * row[x];
      ++count;
    }
  }
  const double mean = sum / count;
  return {mean, std::sqrt(std::max(0.0, squares / count - mean * mean))};
}

double largest_sigma(const Eigen::Matrix2d& cov) {
  const double half_trace = 0.5 * cov.trace();
  return std::sqrt(half_trace + std::sqrt(std::max(0.0, half_trace * half_trace - cov.determinant())));
}

}  // namespace

void FeatureTrackerOptions::check() const {
  require(max_tracks >= 4 && max_tracks <= 2000, "max_tracks", max_tracks, "must be in [4, 2000]");
  require(min_separation_px >= 1, "min_separation_px", min_separation_px, "must be 1 or more");
  require(fast_threshold >= 1 && fast_threshold <= 200, "fast_threshold", fast_threshold, "must be in [1, 200]");
  require(min_corner > 0, "min_corner", min_corner, "must be positive");
  require(klt_window_px >= 5 && klt_window_px <= 61 && klt_window_px % 2 == 1, "klt_window_px", klt_window_px,
          "must be odd and in [5, 61]");
  require(klt_levels >= 1 && klt_levels <= 8, "klt_levels", klt_levels, "must be in [1, 8]");
  require(min_correlation > 0 && min_correlation < 1, "min_correlation", min_correlation, "must be in (0, 1)");
  require(min_refind_correlation > 0 && min_refind_correlation < 1, "min_refind_correlation", min_refind_correlation,
          "must be in (0, 1)");
  require(search_sigmas > 0 && search_sigmas < 10, "search_sigmas", search_sigmas, "must be in (0, 10)");
  require(direct_below_px >= 0 && direct_below_px < 1000, "direct_below_px", direct_below_px, "must be in [0, 1000)");
  require(max_search_px > 0 && max_search_px < 1000, "max_search_px", max_search_px, "must be in (0, 1000)");
  require(max_warp > 1 && max_warp < 100, "max_warp", max_warp, "must be in (1, 100)");
  require(drop_after_rejected >= 1, "drop_after_rejected", drop_after_rejected, "must be 1 or more");
  require(avoid_frames >= 0, "avoid_frames", avoid_frames, "must not be negative");
  require(avoid_radius_px >= 0, "avoid_radius_px", avoid_radius_px, "must not be negative");
  require(exposure_step > 0, "exposure_step", exposure_step, "must be positive");
  require(std::isnan(sigma_px) || sigma_px > 0, "sigma_px", sigma_px, "must be positive, or NaN");
}

void FeatureTracker::Work::take_picture(const ImageMeasurement& image) {
  const cv::Mat seen = view_of(image);
  require(seen.cols == camera.width_px() && seen.rows == camera.height_px(),
          "image: " + std::to_string(seen.cols) + " x " + std::to_string(seen.rows) + " pixels, the camera has " +
              std::to_string(camera.width_px()) + " x " + std::to_string(camera.height_px()));
  std::swap(gray, before_gray);
  std::swap(pyramid, before_pyramid);
  std::swap(brightness, before_brightness);
  if (seen.channels() == 1) {
    seen.copyTo(gray);
  } else {
    cv::cvtColor(seen, gray, image.format == PixelFormat::kRgb ? cv::COLOR_RGB2GRAY : cv::COLOR_BGR2GRAY);
  }
  const cv::Size window(options.klt_window_px, options.klt_window_px);
  cv::buildOpticalFlowPyramid(gray, pyramid, window, options.klt_levels - 1, true);
  brightness = brightness_of(gray);
  const Brightness& now = brightness;
  const Brightness& was = before_brightness;
  const bool step = picture > 0 && std::abs(now.mean - was.mean) > options.exposure_step * std::max(now.mean, was.mean);
  is_adjusted = step && was.deviation > 1 && now.deviation > 1;
  if (is_adjusted) {
    // The picture before as it would be with this exposure.
    ++exposure_steps;
    const double gain = now.deviation / was.deviation;
    before_gray.convertTo(adjusted, CV_8U, gain, now.mean - gain * was.mean);
    cv::buildOpticalFlowPyramid(adjusted, adjusted_pyramid, window, options.klt_levels - 1, true);
  }
  ++picture;
  ++pictures;
}

// @param map expected, or what is left of it where the estimator is lost
void FeatureTracker::Work::take_prediction(const SlamPrediction* expected, const SlamPrediction* map) {
  by_id.clear();
  if (map != nullptr) {
    for (const SlamFeaturePrediction& feature : map->features) by_id.emplace(feature.id, &feature);
  }
  T_world_camera.reset();
  if (expected != nullptr && !expected->lost) T_world_camera = expected->T_world_camera;
  for (Track& track : tracks) {
    const auto found = by_id.find(track.id);
    track.expected = found == by_id.end() ? nullptr : found->second;
    if (map != nullptr) track.in_map = track.expected != nullptr;
    track.last_px = track.pixel_px;
    track.unseen = track.seen ? 0 : track.unseen + 1;
    track.was_seen = track.seen;
    track.seen = false;
    track.correlation = kUnknown;
  }
  // What is neither seen nor in the map will not come back, nor what nobody expects for long.
  std::erase_if(tracks, [&](const Track& track) {
    return !track.was_seen && (!track.in_map || (map == nullptr && track.unseen > kRemembered));
  });
}

// How offsets around the feature where its patch was cut come to offsets around it now: the surface is taken to face
// the camera that saw it first. Without poses: as it was.
Eigen::Matrix2d FeatureTracker::Work::warp_of(const Track& track, const Pose3* now) const {
  Eigen::Matrix2d same = Eigen::Matrix2d::Identity();
  if (now == nullptr || track.expected == nullptr || !track.anchor.has_pose) return same;
  const Pose3& then = track.anchor.T_world_camera;
  const Eigen::Vector3d way = track.expected->point - track.expected->weight * then.translation;
  const double distance = way.norm();
  if (!(distance > 0)) return same;
  const Eigen::Vector3d normal = way / distance;
  const Pose3 T_camera_world = now->inverse();
  const auto now_of = [&](double dx, double dy) -> std::optional<Eigen::Vector2d> {
    const auto ray = camera.unproject(track.anchor.pixel_px + Eigen::Vector2d(dx, dy));
    if (!ray) return std::nullopt;
    const Eigen::Vector3d direction = then.rotation * *ray;
    const double along = direction.dot(normal);
    if (!(along > 0.1)) return std::nullopt;
    const Eigen::Vector3d point = track.expected->weight * then.translation + direction * (distance / along);
    return camera.project(T_camera_world.rotation * point + track.expected->weight * T_camera_world.translation);
  };
  const auto left = now_of(-kWarpStep, 0);
  const auto right = now_of(kWarpStep, 0);
  const auto above = now_of(0, -kWarpStep);
  const auto below = now_of(0, kWarpStep);
  if (!left || !right || !above || !below) return same;
  Eigen::Matrix2d warp;
  warp << (*right - *left) / (2 * kWarpStep), (*below - *above) / (2 * kWarpStep);
  return warp;
}

bool FeatureTracker::Work::cut(Track& track, const Eigen::Vector2d& place) const {
  track.anchor.pixel_px = place;
  track.anchor.has_pose = T_world_camera.has_value();
  if (track.anchor.has_pose) track.anchor.T_world_camera = *T_world_camera;
  return track.patch.cut(view(), place);
}

// Within the ellipse of the prediction.
bool FeatureTracker::Work::search(Track& track, const SlamPrediction* expected) {
  WarpedPatch patch;
  if (!track.patch.warp(warp_of(track, &expected->T_world_camera), patch)) return false;
  const SlamFeaturePrediction& there = *track.expected;
  const int farthest = static_cast<int>(std::ceil(options.search_sigmas * options.max_search_px));
  const PatchMatch coarse =
      search_patch(patch, view(), there.pixel_px, there.search_cov, options.search_sigmas, farthest);
  const double least = track.was_seen ? options.min_correlation : options.min_refind_correlation;
  // Between whole pixels a sharp pattern correlates less.
  if (!coarse.found || coarse.correlation < 0.6 * least) return false;
  const PatchMatch fine = align_patch(patch, view(), coarse.pixel_px, kFarthestAlign);
  if (!fine.found || fine.correlation < least) return false;
  track.pixel_px = fine.pixel_px;
  track.correlation = fine.correlation;
  track.seen = true;
  track.origin = track.was_seen ? TrackOrigin::kSearched : TrackOrigin::kRefound;
  // From before the filter began: with a pose, warps are known from here on.
  if (!track.anchor.has_pose) cut(track, track.pixel_px);
  return true;
}

Eigen::Vector2d FeatureTracker::Work::guess_of(const Track& track, const SlamPrediction* expected) const {
  // After a while without pictures an expectation may say less than the last place.
  const bool says =
      track.expected != nullptr && track.expected->visible && largest_sigma(track.expected->search_cov) < kVagueGuess;
  if (says) return track.expected->pixel_px;
  if (track.expected != nullptr && track.expected->visible) return track.last_px;
  if (expected != nullptr && expected->valid && has_before_pose) {
    // Not in the map: as if it were far away.
    const auto ray = camera.unproject(track.last_px);
    if (ray) {
      const auto turned =
          camera.project(expected->T_world_camera.rotation.conjugate() * (T_world_before.rotation * *ray));
      if (turned && camera.in_image(*turned, kBorder)) return *turned;
    }
  }
  return track.last_px;
}

// A place where Lucas-Kanade arrived: does it look like the feature?
void FeatureTracker::Work::confirm(Track& track, const Eigen::Vector2d& place, const SlamPrediction* expected) {
  WarpedPatch patch;
  const Eigen::Matrix2d warp = warp_of(track, expected == nullptr ? nullptr : &expected->T_world_camera);
  const double stretch = warp.norm() / std::sqrt(2.0);
  const bool usual = stretch < options.max_warp && stretch > 1 / options.max_warp;
  if (usual && track.patch.warp(warp, patch)) {
    const PatchMatch fine = align_patch(patch, view(), place, kFarthestAlign);
    if (fine.found && fine.correlation >= options.min_correlation) {
      track.pixel_px = fine.pixel_px;
      track.correlation = fine.correlation;
      track.seen = true;
      track.origin = TrackOrigin::kTracked;
      // From before the filter began: with a pose, warps are known from here on.
      if (!track.anchor.has_pose && track.expected != nullptr) cut(track, track.pixel_px);
      return;
    }
  }
  // It looks different by now. Is it where the last picture says?
  ImagePatch last;
  if (!last.cut(before_view(), track.last_px) || !last.warp(Eigen::Matrix2d::Identity(), patch)) return;
  const PatchMatch fine = align_patch(patch, view(), place, kFarthestAlign);
  if (!fine.found || fine.correlation < options.min_correlation || (fine.pixel_px - place).norm() > kKltDisagrees)
    return;
  if (!cut(track, fine.pixel_px)) return;
  track.pixel_px = fine.pixel_px;
  track.correlation = fine.correlation;
  track.seen = true;
  track.origin = TrackOrigin::kCutAnew;
}

void FeatureTracker::Work::run_klt(const SlamPrediction* expected) {
  klt_from.clear();
  klt_to.clear();
  for (const std::size_t i : klt) {
    const Track& track = tracks[i];
    const Eigen::Vector2d guess = guess_of(track, expected);
    klt_from.emplace_back(static_cast<float>(track.last_px.x()), static_cast<float>(track.last_px.y()));
    klt_to.emplace_back(static_cast<float>(guess.x()), static_cast<float>(guess.y()));
  }
  if (klt.empty()) return;
  const cv::Size window(options.klt_window_px, options.klt_window_px);
  const cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, kMostKltSteps, kKltConverged);
  cv::calcOpticalFlowPyrLK(is_adjusted ? adjusted_pyramid : before_pyramid, pyramid, klt_from, klt_to, klt_status,
                           klt_error, window, options.klt_levels - 1, until, cv::OPTFLOW_USE_INITIAL_FLOW,
                           kKltEigenvalue);
  for (std::size_t k = 0; k < klt.size(); ++k) {
    const Eigen::Vector2d place(klt_to[k].x, klt_to[k].y);
    if (klt_status[k] != 0 && camera.in_image(place, kBorder)) confirm(tracks[klt[k]], place, expected);
  }
}

// Two tracks on one feature: the older one stays.
void FeatureTracker::Work::remove_twins() {
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (!tracks[i].seen) continue;
    for (std::size_t j = i + 1; j < tracks.size(); ++j) {
      if (!tracks[j].seen || (tracks[i].pixel_px - tracks[j].pixel_px).squaredNorm() > kTwins * kTwins) continue;
      Track& younger = tracks[i].age >= tracks[j].age ? tracks[j] : tracks[i];
      younger.seen = false;
      if (!tracks[i].seen) break;
    }
  }
}

void FeatureTracker::Work::detect() {
  taken.clear();
  for (const Track& track : tracks) {
    if (track.seen) taken.push_back(track.pixel_px);
  }
  corner_options.most = options.max_tracks - static_cast<int>(taken.size());
  std::erase_if(avoided, [&](const Avoided& spot) { return spot.until < picture; });
  find_corners(view(), taken, corner_options, corners);
  for (const Corner& corner : corners) {
    const bool avoid = std::any_of(avoided.begin(), avoided.end(), [&](const Avoided& spot) {
      return (spot.pixel_px - corner.pixel_px).norm() < options.avoid_radius_px;
    });
    if (avoid) continue;
    Track track;
    track.pixel_px = corner.pixel_px;
    track.last_px = corner.pixel_px;
    track.seen = true;
    WarpedPatch patch;
    if (!cut(track, corner.pixel_px) || !track.patch.warp(Eigen::Matrix2d::Identity(), patch)) continue;
    track.id = next_id++;
    ++added;
    tracks.push_back(track);
  }
}

// Whole pixels in the ellipse.
double FeatureTracker::Work::places_of(const SlamFeaturePrediction& there) const {
  return std::numbers::pi * options.search_sigmas * options.search_sigmas *
         std::sqrt(std::max(0.0, there.search_cov.determinant()));
}

// Nothing in it: the lens is covered, or all is black or white.
bool FeatureTracker::Work::is_blind() const {
  return !tracks.empty() && std::none_of(tracks.begin(), tracks.end(), [](const Track& track) { return track.seen; });
}

// As if it had not come: the next one goes on from the picture before.
void FeatureTracker::Work::forget_picture() {
  std::swap(gray, before_gray);
  std::swap(pyramid, before_pyramid);
  std::swap(brightness, before_brightness);
  for (Track& track : tracks) {
    track.seen = track.was_seen;
    track.pixel_px = track.last_px;
  }
  ++blind;
}

void FeatureTracker::Work::out_without(const ImageMeasurement& image) {
  static_cast<Stamp&>(out) = image;
  out.camera = image.camera;
  out.features.clear();
  tracked.clear();
}

void FeatureTracker::Work::give_out(const ImageMeasurement& image) {
  out_without(image);
  for (Track& track : tracks) {
    if (!track.seen) {
      if (track.was_seen) ++lost;
      continue;
    }
    out.features.push_back({track.id, track.pixel_px});
    tracked.push_back({track.id, track.origin, track.correlation, track.age});
    ++track.age;
    searched += track.origin == TrackOrigin::kSearched ? 1 : 0;
    tracked_klt += track.origin == TrackOrigin::kTracked ? 1 : 0;
    cut_anew += track.origin == TrackOrigin::kCutAnew ? 1 : 0;
    refound += track.origin == TrackOrigin::kRefound ? 1 : 0;
  }
  // A pause, or a clock that was set: what stood before says nothing.
  if (rest_time_ns == kNoTime || out.time_ns <= rest_time_ns || out.time_ns - rest_time_ns > kLongestPauseNs)
    rest.reset();
  rest_time_ns = out.time_ns;
  rest.see(out, out.time_ns);
  still_pictures = rest.stands_still(out.time_ns) ? still_pictures + 1 : 0;
  out.sigma_px = options.sigma_px * std::sqrt(1.0 + still_pictures);
  if (out.sigma_px > kMostSigmaPx) out.sigma_px = std::max(kMostSigmaPx, options.sigma_px);
}

FeatureTracker::FeatureTracker(const CameraCalibration& camera, const FeatureTrackerOptions& options)
    : work_(std::make_unique<Work>(camera, options)) {}
FeatureTracker::FeatureTracker(FeatureTracker&&) noexcept = default;
FeatureTracker& FeatureTracker::operator=(FeatureTracker&&) noexcept = default;
FeatureTracker::~FeatureTracker() = default;

const FeaturesMeasurement& FeatureTracker::track(const ImageMeasurement& image, const SlamPrediction* expected) {
  Work& w = *work_;
  const auto begin = Clock::now();
  const SlamPrediction* const map = expected != nullptr && (expected->valid || expected->lost) ? expected : nullptr;
  if (expected != nullptr && !expected->valid) expected = nullptr;
  w.take_picture(image);
  w.times.pyramid_s = seconds_since(begin);

  const auto search_begin = Clock::now();
  w.take_prediction(expected, map);
  w.klt.clear();
  double places = 0;
  for (std::size_t k = 0; k < w.tracks.size(); ++k) {
    // Another one first in every picture, so that each gets its turn when there are too many.
    const std::size_t i = (k + static_cast<std::size_t>(w.first_searched)) % w.tracks.size();
    Track& track = w.tracks[i];
    const bool visible = track.expected != nullptr && track.expected->visible;
    const double sigma = visible ? largest_sigma(track.expected->search_cov) : 0;
    const double limit = track.was_seen ? w.options.direct_below_px : w.options.max_search_px;
    bool found = false;
    if (visible && sigma <= limit && (track.was_seen || places < kMostPlaces)) {
      found = w.search(track, expected);
      if (!track.was_seen) places += w.places_of(*track.expected);
    }
    if (!found && track.was_seen) w.klt.push_back(i);
  }
  w.first_searched += places < kMostPlaces ? 0 : 1;
  w.times.search_s = seconds_since(search_begin);

  const auto klt_begin = Clock::now();
  w.run_klt(expected);
  if (map != nullptr && map->lost) w.find_in_map(*map);
  w.times.klt_s = seconds_since(klt_begin);

  const auto detect_begin = Clock::now();
  w.remove_twins();
  w.detect();
  w.times.detect_s = seconds_since(detect_begin);

  if (w.is_blind()) {
    w.out_without(image);
    w.forget_picture();
  } else {
    w.give_out(image);
    w.has_before_pose = w.T_world_camera.has_value();
    if (w.has_before_pose) w.T_world_before = *w.T_world_camera;
  }
  w.times.total_s = seconds_since(begin);
  return w.out;
}

void FeatureTracker::learn(const SlamFrame& frame) {
  Work& w = *work_;
  for (const SlamFeature& feature : frame.features) {
    if (feature.state == SlamFeatureState::kPredicted) continue;
    const auto track =
        std::find_if(w.tracks.begin(), w.tracks.end(), [&](const Track& one) { return one.id == feature.id; });
    if (track == w.tracks.end()) continue;
    track->in_map = true;
    track->rejected = feature.state == SlamFeatureState::kRejected ? track->rejected + 1 : 0;
    if (track->rejected < w.options.drop_after_rejected) continue;
    w.avoided.push_back({track->pixel_px, w.picture + w.options.avoid_frames});
    w.tracks.erase(track);
    ++w.moving;
  }
}

void FeatureTracker::reset() {
  Work& w = *work_;
  w.tracks.clear();
  w.avoided.clear();
  w.picture = 0;
  w.has_before_pose = false;
  w.rest.reset();
  w.still_pictures = 0;
  w.out.features.clear();
  w.tracked.clear();
}

const std::vector<TrackedFeature>& FeatureTracker::last() const {
  return work_->tracked;
}

const FeatureTrackerTimes& FeatureTracker::times() const {
  return work_->times;
}

const FeatureTrackerOptions& FeatureTracker::options() const {
  return work_->options;
}

NamedCounts FeatureTracker::counts() const {
  const Work& w = *work_;
  return {{"pictures", w.pictures},         {"pictures.exposure_steps", w.exposure_steps},
          {"pictures.blind", w.blind},      {"tracks.new", w.added},
          {"tracks.searched", w.searched},  {"tracks.klt", w.tracked_klt},
          {"tracks.cut_anew", w.cut_anew},  {"tracks.refound", w.refound},
          {"tracks.lost", w.lost},          {"tracks.moving", w.moving},
          {"map.searched", w.map_searches}, {"map.found", w.maps_found}};
}

}  // namespace loc
