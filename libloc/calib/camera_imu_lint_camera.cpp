// What a camera's pictures of the target say about themselves.
#include "libloc/geometry/camera.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "libloc/calib/camera_bundle.hpp"
#include "libloc/calib/camera_imu_lint_detail.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc::calib {
namespace {

constexpr std::size_t kLeastCorners = 6;  // for a pose
constexpr double kFewCorners = 12;        // median
constexpr std::size_t kHopelessPictures = 25;
constexpr std::size_t kFewPictures = 100;
constexpr double kFewWithTarget = 0.5;   // share
constexpr double kHopelessRate = 2.5;    // [Hz]: turns are taken over at most 0.4 s
constexpr double kLowRate = 5;           // [Hz]
constexpr double kFairRate = 10;         // [Hz]
constexpr double kRateTolerance = 0.05;  // against the nominal one
// Of the gaps and of the spells without the target: no harm.
constexpr double kHarmlessGap = 2;    // [s]
constexpr double kFewMissing = 0.05;  // share
constexpr double kLost = 1;           // [s] without the target
constexpr std::size_t kColumns = 8;   // cells of the image
constexpr std::size_t kRows = 6;
constexpr double kSmallPart = 0.25;  // share of the cells
constexpr double kFairPart = 0.5;
constexpr double kBesideImage = 1;    // [px] that a corner's place may err
constexpr double kFewOutside = 0.01;  // share of the corners
// Median distance of the corners from where the pose has them, which a few wrong corners do not spoil. On EuRoC's
// recording below 0.5; without the lens's distortion 1.8, with a spacing of the tags that is wrong by a third 2.4.
constexpr double kFairPose = 1;    // [px]
constexpr double kBadPose = 1.5;   // [px]
constexpr double kWrongPose = 10;  // [px]
constexpr double kNearest = 0.03;  // [m] median distance of the target
constexpr double kFarthest = 30;
// Turns between two pictures.
constexpr double kShortestStep = 0.15;  // [s]
constexpr double kLongestStep = 0.4;    // [s]
constexpr std::size_t kMostTurns = 150;
constexpr std::size_t kLeastTurns = 20;

class Look {
 public:
  Look(const CalibrationTarget& target, const CameraRecording& recording, std::vector<CameraImuFinding>& out)
      : target_(target), recording_(recording), out_(out) {
    std::vector<TimeNs> times;
    for (std::size_t i = 0; i < recording.views.size(); ++i) {
      if (recording.views[i].time_ns == kNoTime) {
        ++without_time_;
      } else {
        timed_.push_back(i);
        times.push_back(recording.views[i].time_ns);
      }
    }
    times_ = look_at_times(times);
    for (std::size_t k = 0; k < times_.in_order.size(); ++k) {
      const std::size_t view = timed_[times_.in_order[k]];
      if (recording.views[view].corners.size() < kLeastCorners) continue;
      usable_.push_back(view);
      usable_at_s_.push_back(times_.at_s[k]);
    }
  }

  CameraLook run() {
    CameraLook look;
    stamps();
    if (usable_.empty()) {
      add(Verdict::kRefused, "camera.no_target",
          "none of its " + count_of(static_cast<std::int64_t>(recording_.views.size()), "picture") + " shows " +
              std::to_string(kLeastCorners) + " corners of the target. Is it the right target (" +
              target_text(target_) + ")?");
      return look;
    }
    look.first_ns = recording_.views[usable_.front()].time_ns;
    look.last_ns = recording_.views[usable_.back()].time_ns;
    pictures();
    corners();
    poses(look);
    return look;
  }

 private:
  void add(Verdict severity, const std::string& code, const std::string& text) {
    out_.push_back({severity, code, recording_.camera.name + ": " + text});
  }

  void stamps() {
    if (without_time_ > 0) {
      add(Verdict::kWarn, "camera.no_time",
          count_of(without_time_, "picture") + " of " + std::to_string(recording_.views.size()) + " without a time.");
    }
    if (times_.steps_back > 0) {
      add(Verdict::kWarn, "camera.time_back",
          "the pictures' times step back " + count_of(times_.steps_back, "time") + ", by up to " +
              number(times_.longest_back_s) + " s " + at_time(times_.back_at_s) + ": " +
              count_of(times_.behind, "picture") + " of " + std::to_string(timed_.size()) +
              " are not later than one before them.");
    }
    if (times_.same_time > 0) {
      add(Verdict::kWarn, "camera.same_time",
          count_of(times_.same_time, "picture") + " of " + std::to_string(timed_.size()) +
              " have the time of the one before.");
    }
    if (times_.step_s <= 0) return;
    const double rate = 1 / times_.step_s;
    if (rate < kFairRate * (1 - kRateTolerance)) {
      add(rate < kHopelessRate ? Verdict::kRefused
          : rate < kLowRate    ? Verdict::kWarn
                               : Verdict::kFair,
          "camera.rate_low", number(rate) + " pictures a second: take 10 to 30, or move slowly and for longer.");
    }
    const double nominal = recording_.camera.rate_hz;
    if (nominal > 0 && std::abs(rate / nominal - 1) > kRateTolerance) {
      add(Verdict::kFair, "camera.rate_not_nominal",
          number(rate) + " pictures a second, not the " + number(nominal) +
              " of the rig: are pictures lost or left out, or times in another unit?");
    }
    if (times_.gaps > 0) {
      add(harm(times_.longest_gap_s, times_.missing), "camera.gaps",
          "the pictures have " + count_of(times_.gaps, "gap") + ", the longest of " + number(times_.longest_gap_s) +
              " s " + at_time(times_.gap_at_s) + "; about " + percent(times_.missing) + " of them are missing.");
    }
  }

  static Verdict harm(double longest_s, double share) {
    return longest_s < kHarmlessGap && share < kFewMissing ? Verdict::kOk : Verdict::kFair;
  }

  void pictures() {
    const std::size_t n = times_.in_order.size();
    const std::string figures = "the target is seen in " + std::to_string(usable_.size()) + " of " +
                                count_of(static_cast<std::int64_t>(n), "picture");
    if (usable_.size() < kHopelessPictures) {
      add(Verdict::kRefused, "camera.few_pictures", figures + ": some hundreds are wanted.");
    } else if (usable_.size() < kFewPictures) {
      add(Verdict::kWarn, "camera.few_pictures", figures + ": some hundreds are wanted.");
    } else if (static_cast<double>(usable_.size()) < kFewWithTarget * static_cast<double>(n)) {
      add(Verdict::kFair, "camera.few_pictures", figures + ": keep it in view.");
    }
    // Spells without the target in which there were pictures.
    std::int64_t spells = 0;
    double longest = 0;
    double longest_at = 0;
    double sum = 0;
    std::size_t k = 0;
    for (std::size_t u = 1; u < usable_.size(); ++u) {
      while (times_.at_s[k] <= usable_at_s_[u - 1]) ++k;
      const double spell = usable_at_s_[u] - usable_at_s_[u - 1];
      if (spell < kLost || times_.at_s[k] == usable_at_s_[u]) continue;
      ++spells;
      sum += spell;
      if (spell > longest) {
        longest = spell;
        longest_at = usable_at_s_[u - 1];
      }
    }
    if (spells > 0) {
      add(harm(longest, sum / times_.span_s()), "camera.target_lost",
          "the target is lost for more than a second " + count_of(spells, "time") + ", the longest for " +
              number(longest) + " s " + at_time(longest_at) + ".");
    }
  }

  void corners() {
    const double width = recording_.camera.width_px;
    const double height = recording_.camera.height_px;
    std::vector<double> counts;
    std::array<bool, kColumns * kRows> hit{};
    std::int64_t all = 0;
    std::int64_t outside = 0;
    Eigen::Vector2d farthest = Eigen::Vector2d::Zero();
    for (const std::size_t i : usable_) {
      const std::vector<TargetCorner>& found = recording_.views[i].corners;
      counts.push_back(static_cast<double>(found.size()));
      for (const TargetCorner& corner : found) {
        ++all;
        const double x = corner.pixel_px.x() + 0.5;
        const double y = corner.pixel_px.y() + 0.5;
        farthest = farthest.cwiseMax(corner.pixel_px);
        if (x < -kBesideImage || y < -kBesideImage || x > width + kBesideImage || y > height + kBesideImage) {
          ++outside;
          continue;
        }
        const auto column = static_cast<std::size_t>(std::clamp(x / width * kColumns, 0.0, kColumns - 1.0));
        const auto row = static_cast<std::size_t>(std::clamp(y / height * kRows, 0.0, kRows - 1.0));
        hit[row * kColumns + column] = true;
      }
    }
    if (outside > 0) {
      const bool many = static_cast<double>(outside) > kFewOutside * static_cast<double>(all);
      add(many ? Verdict::kRefused : Verdict::kFair, "camera.outside_image",
          count_of(outside, "corner") + " of " + std::to_string(all) + (outside == 1 ? " lies" : " lie") +
              " outside the image of " + std::to_string(recording_.camera.width_px) + "x" +
              std::to_string(recording_.camera.height_px) + " px: " +
              (many ? "they reach " + number(farthest.x()) + ", " + number(farthest.y()) +
                          ", so the camera was calibrated at another resolution."
                    : "wrongly placed."));
    }
    if (const double median = quantile(counts, 0.5); median < kFewCorners) {
      add(Verdict::kFair, "camera.few_corners",
          "half of the pictures with the target have no more than " + to_text(median) +
              " corners: bring it nearer, or take one with more.");
    }
    const double share = static_cast<double>(std::ranges::count(hit, true)) / (kColumns * kRows);
    if (share < kFairPart) {
      add(share < kSmallPart ? Verdict::kWarn : Verdict::kFair, "camera.small_part",
          "the target is only ever seen in " + percent(share) +
              " of the image: bring it nearer, and into the corners too.");
    }
  }

  // nullopt: none.
  std::optional<Pose3> pose_of(std::size_t view) {
    BundleView bundle;
    for (const TargetCorner& corner : recording_.views[view].corners) {
      bundle.corners.push_back({corner.id, target_.corner(corner.id), corner.pixel_px, true});
    }
    ++poses_tried_;
    if (!find_pose(recording_.camera, bundle, 1.0)) return {};
    std::vector<double> distances;
    for (const auto& r : residuals_of(camera_, bundle)) distances.push_back(r ? r->norm() : 2 * kWrongPose);
    errors_px_.push_back(quantile(distances, 0.5));
    distances_.push_back(bundle.T_camera_target.translation.norm());
    return bundle.T_camera_target.inverse();
  }

  // Pairs of pictures whose turn is measured, spread over the recording.
  std::vector<std::pair<std::size_t, std::size_t>> pairs() const {
    std::vector<std::pair<std::size_t, std::size_t>> all;
    std::size_t to = 0;
    for (std::size_t from = 0; from < usable_.size(); ++from) {
      while (to < usable_.size() && usable_at_s_[to] - usable_at_s_[from] < kShortestStep) ++to;
      if (to == usable_.size()) break;
      if (usable_at_s_[to] - usable_at_s_[from] <= kLongestStep) all.emplace_back(from, to);
    }
    if (all.size() <= kMostTurns) return all;
    std::vector<std::pair<std::size_t, std::size_t>> out;
    for (std::size_t i = 0; i < kMostTurns; ++i) out.push_back(all[i * all.size() / kMostTurns]);
    return out;
  }

  void poses(CameraLook& look) {
    std::vector<double> rates;
    std::vector<double> steps;
    for (const auto& [from, to] : pairs()) {
      const auto a = pose_of(usable_[from]);
      const auto b = pose_of(usable_[to]);
      if (!a || !b) continue;
      const double step = usable_at_s_[to] - usable_at_s_[from];
      rates.push_back(so3::angle_between(a->rotation, b->rotation) / step);
      steps.push_back(step);
    }
    if (poses_tried_ == 0) return;
    const double found = static_cast<double>(errors_px_.size()) / static_cast<double>(poses_tried_);
    if (found < 0.5) {
      add(Verdict::kRefused, "camera.lens",
          "no pose explains the corners of " + percent(1 - found) + " of " + count_of(poses_tried_, "picture") +
              ": intrinsics and target (" + target_text(target_) + ") do not fit the pictures.");
      return;
    }
    const double error = quantile(errors_px_, 0.5);
    if (error > kFairPose) {
      add(error > kWrongPose ? Verdict::kRefused
          : error > kBadPose ? Verdict::kWarn
                             : Verdict::kFair,
          "camera.lens",
          "the poses that explain the pictures best leave " + number(error) +
              " px between corner and projection (median): do intrinsics and target (" + target_text(target_) +
              ") fit the pictures, and are these sharp?");
    }
    if (error > kWrongPose) return;
    const double distance = quantile(distances_, 0.5);
    if (distance < kNearest || distance > kFarthest) {
      add(Verdict::kWarn, "target.size",
          "the target would be " + number(distance) + " m away (median): is its size right, " +
              to_text(target_.size_m) + " m?");
    }
    if (rates.size() < kLeastTurns) return;
    look.turn_rate = quantile(rates, 0.5);
    look.turn_step_s = quantile(steps, 0.5);
  }

  const CalibrationTarget& target_;
  const CameraRecording& recording_;
  std::vector<CameraImuFinding>& out_;
  Camera camera_{recording_.camera};
  std::int64_t without_time_ = 0;
  std::vector<std::size_t> timed_;   // views that have a time
  StreamTimes times_;                // of these
  std::vector<std::size_t> usable_;  // views in order of time with corners enough
  std::vector<double> usable_at_s_;
  std::int64_t poses_tried_ = 0;
  std::vector<double> errors_px_;
  std::vector<double> distances_;
};

}  // namespace

CameraLook look_at_camera(const CalibrationTarget& target, const CameraRecording& recording,
                          std::vector<CameraImuFinding>& out) {
  return Look(target, recording, out).run();
}

}  // namespace loc::calib
