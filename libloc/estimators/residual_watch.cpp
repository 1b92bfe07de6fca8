#include "libloc/estimators/residual_watch.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

constexpr double kHuber = 1.5;  // deviations, beyond which a residual counts less
constexpr int kFewest = 6;      // features of a frame

// Of errors that no calibration makes: keeps the equations regular where a direction was not excited. [1, px, px, 1]
const Eigen::Vector4d kWidest{10, 3000, 3000, 10};

}  // namespace

void ResidualWatchOptions::check() const {
  require_positive("least_turn_px", least_turn_px);
  require_positive("longest_step_s", longest_step_s);
  require(batch_frames > 0, "batch_frames: must be positive");
  require(least_in_a_row > 0, "least_in_a_row: must be positive");
  require(least_batches > 2 && least_batches <= 15, "least_batches: must be 3 to 15");
  require_positive("least_sigmas", least_sigmas);
  require_positive("least_focal", least_focal);
  require_positive("least_centre_px", least_centre_px);
  require_positive("least_k1", least_k1);
}

ResidualWatch::ResidualWatch(const CameraCalibration& camera, const ResidualWatchOptions& options)
    : options_(options), camera_(camera) {
  options.check();
  constexpr std::size_t kUsualFeatures = 1000;
  last_.reserve(kUsualFeatures);
}

// false: the frame tells nothing.
bool ResidualWatch::add(const SlamFrame& frame, Sums& sums) const {
  const Eigen::Matrix3d turn = (frame.q_world_camera.conjugate() * last_attitude_).toRotationMatrix();
  Sums of_frame;
  double moved = 0;
  int used = 0;
  for (const SlamFeature& feature : frame.features) {
    if (!feature.pixel_px.allFinite() || !feature.predicted_px.allFinite() || !feature.innovation_cov.allFinite())
      continue;
    const auto before = std::lower_bound(last_.begin(), last_.end(), feature.id,
                                         [](const auto& entry, std::int64_t id) { return entry.first < id; });
    if (before == last_.end() || before->first != feature.id) continue;
    const auto ray = camera_.unproject_with_jacobian(before->second);
    if (!ray) continue;
    const auto there = camera_.project_with_jacobians(ray->direction);
    const auto here = camera_.project_with_jacobians(turn * ray->direction);
    if (!there || !here) continue;
    // Through the lens with b at the first pixel (d ray = -d ray/d pixel * d pixel/d b), and back at the second.
    const Eigen::Matrix<double, 2, 8> all =
        here->d_parameters - here->d_point * turn * (ray->d_pixel * there->d_parameters);
    Eigen::Matrix<double, 2, 4> x;
    x.col(0) = all.leftCols<2>() * camera_.intrinsics_px().head<2>();
    x.col(1) = all.col(2);
    x.col(2) = all.col(3);
    x.col(3) = all.col(4);
    const Eigen::Vector2d residual = feature.pixel_px - feature.predicted_px;
    const double variance = feature.innovation_cov.trace() / 2;
    if (!(variance > 0)) continue;
    const double far = residual.norm() / std::sqrt(variance);
    const double weight = (far > kHuber ? kHuber / far : 1) / variance;
    of_frame.normal += weight * x.transpose() * x;
    of_frame.right += weight * x.transpose() * residual;
    moved += (here->pixel_px - before->second).squaredNorm();
    ++used;
  }
  if (used < kFewest || !(moved >= used * options_.least_turn_px * options_.least_turn_px)) return false;
  if (!of_frame.normal.allFinite() || !of_frame.right.allFinite()) return false;
  sums.normal += of_frame.normal;
  sums.right += of_frame.right;
  return true;
}

void ResidualWatch::see(const SlamFrame& frame) {
  const bool has_attitude = frame.q_world_camera.coeffs().allFinite();
  const bool follows = last_time_ns_ != kNoTime && frame.time_ns > last_time_ns_ &&
                       to_seconds(frame.time_ns - last_time_ns_) <= options_.longest_step_s;
  if (has_attitude && follows && add(frame, open_) && ++open_frames_ >= options_.batch_frames) {
    batches_[static_cast<std::size_t>(batches_done_ % kWindow)] = open_;
    ++batches_done_;
    open_ = Sums{};
    open_frames_ = 0;
    judge();
  }
  last_.clear();
  last_time_ns_ = has_attitude ? frame.time_ns : kNoTime;
  if (!has_attitude) return;
  last_attitude_ = frame.q_world_camera;
  for (const SlamFeature& feature : frame.features) {
    if (feature.pixel_px.allFinite()) last_.emplace_back(feature.id, feature.pixel_px);
  }
  std::sort(last_.begin(), last_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
}

Eigen::Vector4d ResidualWatch::solve(const Sums& sums) {
  Eigen::Matrix4d normal = sums.normal;
  normal.diagonal() += kWidest.cwiseAbs2().cwiseInverse();
  return normal.ldlt().solve(sums.right);
}

void ResidualWatch::judge() {
  const auto count = static_cast<int>(std::min<std::int64_t>(batches_done_, kWindow));
  if (count < options_.least_batches) return;
  Sums all;
  for (int i = 0; i < count; ++i) {
    all.normal += batches_[static_cast<std::size_t>(i)].normal;
    all.right += batches_[static_cast<std::size_t>(i)].right;
  }
  Eigen::Matrix<double, 4, kWindow> without;
  for (int i = 0; i < count; ++i) {
    const Sums& left_out = batches_[static_cast<std::size_t>(i)];
    without.col(i) = solve({all.normal - left_out.normal, all.right - left_out.right});
  }
  const Eigen::Vector4d mean = without.leftCols(count).rowwise().mean();
  verdict_.db = solve(all);
  verdict_.sigma =
      ((count - 1.0) / count * (without.leftCols(count).colwise() - mean).rowwise().squaredNorm()).cwiseSqrt();
  const Eigen::Vector4d least(options_.least_focal, options_.least_centre_px, options_.least_centre_px,
                              options_.least_k1);
  bool wrong = false;
  for (int i = 0; i < 4; ++i) {
    if (!options_.judge_centre && (i == 1 || i == 2)) continue;
    const double size = std::abs(verdict_.db[i]);
    wrong |= size > least[i] && size > options_.least_sigmas * verdict_.sigma[i];
  }
  in_a_row_ = wrong ? in_a_row_ + 1 : 0;
  verdict_.doubtful = in_a_row_ >= options_.least_in_a_row;
}

}  // namespace loc
