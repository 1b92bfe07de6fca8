// One frame of the SLAM filter: which features it has, which of them are believed, and what they change.
#include <algorithm>
#include <cmath>

#include "libloc/estimators/slam_filter.hpp"
#include "libloc/geometry/absolute_pose.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr double kNonlinearSigmas = 1;  // so far from where the Jacobians say: another iteration
constexpr std::size_t kFewestForPose = 6;
constexpr double kWidePx = 150;          // a prediction that is no better than this says where to look, and no more
constexpr double kKnownDepthPart = 0.3;  // relative deviation of a depth that gives a place
constexpr double kLeastSigmaPx = 1e-3;   // what no tracker does better
constexpr double kFarthest = 27.9;       // chi-square of 6, 0.9999
constexpr double kAbsurdPx = 1e4;        // a residual without meaning: the point is in the plane of the camera
constexpr double kNarrowSigmas = 3;      // of a pixel's own deviation
constexpr int kEnoughToSteer = 8;        // older features, so that younger ones need not

double square(double x) {
  return x * x;
}

double root_mean_square(double sum, int count) {
  return count > 0 ? std::sqrt(sum / count) : kUnknown;
}

// How a turn of the world by w moves the errors of a ray: the frame's first two axes feel (u_y, -u_x), u = Q^T w.
Eigen::Matrix<double, 2, 3> turn_of_ray(const Eigen::Quaterniond& frame) {
  const Eigen::Matrix3d to_frame = frame.conjugate().toRotationMatrix();
  Eigen::Matrix<double, 2, 3> out;
  out.row(0) = to_frame.row(1);
  out.row(1) = -to_frame.row(0);
  return out;
}

}  // namespace

bool SlamFilter::sigma_is_usable(double sigma_px) const {
  return sigma_px >= kLeastSigmaPx && sigma_px <= std::max(camera_.width_px(), camera_.height_px());
}

double SlamFilter::sigma_px(const FeaturesMeasurement& frame) const {
  const bool says = !options_.override_sigma && sigma_is_usable(frame.sigma_px);
  return says ? frame.sigma_px : options_.sigma_px;
}

// Identities of the frame to landmarks. One that comes twice belongs to nobody.
void SlamFilter::match(const FeaturesMeasurement& frame) {
  by_id_.clear();
  taken_.assign(frame.features.size(), 0);
  for (std::size_t i = 0; i < frame.features.size(); ++i) {
    const FeatureObservation& feature = frame.features[i];
    if (!feature.pixel_px.allFinite() || !camera_.in_image(feature.pixel_px)) {
      ++not_usable_;
      taken_[i] = 1;
      continue;
    }
    by_id_.emplace_back(feature.id, static_cast<int>(i));
  }
  std::sort(by_id_.begin(), by_id_.end());
  for (std::size_t i = 0; i + 1 < by_id_.size(); ++i) {
    if (by_id_[i].first != by_id_[i + 1].first) continue;
    ambiguous_ += 1;
    taken_[static_cast<std::size_t>(by_id_[i].second)] = 1;
    taken_[static_cast<std::size_t>(by_id_[i + 1].second)] = 1;
  }
  for (SlamLandmark& landmark : landmarks_) {
    landmark.observation = -1;
    landmark.state = SlamFeatureState::kPredicted;
    landmark.innovation_cov.setConstant(kUnknown);
    const auto predicted = predict(state_, camera_, landmark.point);
    landmark.predicted_px = predicted ? *predicted : Eigen::Vector2d::Constant(kUnknown);
    landmark.visible = predicted && camera_.in_image(*predicted, options_.map.border_px);
    const auto found = std::lower_bound(by_id_.begin(), by_id_.end(), std::pair{landmark.id, -1});
    if (found == by_id_.end() || found->first != landmark.id) continue;
    const auto index = static_cast<std::size_t>(found->second);
    if (taken_[index] == 0) landmark.observation = found->second;
    taken_[index] = 1;
  }
}

bool SlamFilter::linearise(const SlamLandmark& landmark, const Eigen::Vector2d& pixel_px, double sigma_px,
                           BlockMeasurement& out) const {
  const auto predicted = predict(state_, camera_, landmark.point);
  if (!predicted || !((pixel_px - *predicted).norm() < kAbsurdPx)) return false;
  const bool first = options_.consistency == SlamConsistency::kFirstEstimate;
  SlamState at = state_;
  SlamPoint point = landmark.point;
  if (first) {
    at.q_world_body = first_.q_world_body;
    at.position = first_.position;
    at.velocity = first_.velocity;
    // The depth does not turn or move with the world: its latest value is the better one.
    if (point.converted) {
      point.position = landmark.first.position;
    } else {
      point.inverse_depth.anchor = landmark.first.inverse_depth.anchor;
      point.inverse_depth.frame = landmark.first.inverse_depth.frame;
    }
  }
  const auto jacobian = jacobian_of(at, layout_, camera_, point);
  if (!jacobian) return false;
  out.rows = 2;
  if (sigma_px > 0) {
    out.noise_cov.topLeftCorner<2, 2>() = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
    if (options_.second_order_noise && !landmark.point.converted) {
      out.noise_cov.topLeftCorner<2, 2>() += product_cov(landmark, jacobian->by_way, transition_);
    }
  }
  out.head.topRows<2>() = jacobian->head;
  out.block = landmark.offset;
  out.block_dim = landmark.point.dim();
  out.block_jacobian.topRows<2>() = jacobian->block;
  out.residual.head<2>() = pixel_px - *predicted;
  return true;
}

// What the linear model leaves out where neither the depth nor the way is known, as at the start: their product, of
// variance P_rho P_way. Without it a camera that has not moved yet takes all depths for what the prior says, and their
// differences for motion. Source: Y. Bar-Shalom et al., "Estimation with applications to tracking and navigation",
// 2001, 10.3.2 (second-order filter); the two errors are taken to be independent.
Eigen::Matrix2d SlamFilter::product_cov(const SlamLandmark& landmark, const Eigen::Matrix<double, 2, 3>& by_way,
                                        const SlamTransition& since) const {
  const int anchor = landmark.offset + kAnchor;
  const int rho = landmark.offset + kInverseDepth;
  Eigen::Matrix3d body;
  Eigen::Matrix3d anchors;
  Eigen::Matrix3d between;
  covariance_.read(anchor, anchor, anchors);
  if (since.empty()) {
    covariance_.read(kPosition, kPosition, body);
    covariance_.read(anchor, kPosition, between);
  } else {
    const auto moves = since.f().middleRows<3>(kPosition);
    Eigen::Matrix<double, kMaxHeadDim, kMaxHeadDim> all;
    auto head = all.topLeftCorner(layout_.dim, layout_.dim);
    covariance_.read(0, 0, head);
    Eigen::Matrix<double, 3, kMaxHeadDim> moved;
    moved.leftCols(layout_.dim) = moves.lazyProduct(head);
    body = moved.leftCols(layout_.dim).lazyProduct(moves.transpose());
    body += since.q().block<3, 3>(kPosition, kPosition);
    auto with_head = moved.leftCols(layout_.dim);
    covariance_.read(anchor, 0, with_head);
    between = with_head.lazyProduct(moves.transpose());
  }
  const Eigen::Matrix3d way = body + anchors - between - between.transpose();
  return covariance_(rho, rho) * (by_way * way * by_way.transpose());
}

bool SlamFilter::is_placed(const SlamLandmark& landmark) const {
  if (landmark.point.converted) return true;
  const int at = landmark.offset + kInverseDepth;
  const double rho = landmark.point.inverse_depth.inverse_depth;
  return std::sqrt(std::max(0.0, covariance_(at, at))) < kKnownDepthPart * rho;
}

// After a while without features the prior is so wide that Jacobians at it mean nothing. The pose that explains most
// pixels with the map as it is tells where to take them; the prior itself stays what it was: r = z - h(x_1) +
// H_1 (x_1 - x_0). dx_ is x_1 - x_0 then.
bool SlamFilter::approach(const FeaturesMeasurement& frame, SlamState& near) {
  Matrix6d prior_cov;
  covariance_.read(0, 0, prior_cov);
  const double focal_px = options_.camera.intrinsics_px.head<2>().minCoeff();
  const double usual = usual_inverse_depth();
  const double wide_px = focal_px * std::sqrt(prior_cov.topLeftCorner<3, 3>().trace() +
                                              square(std::isfinite(usual) ? usual : options_.map.inverse_depth) *
                                                  prior_cov.bottomRightCorner<3, 3>().trace());
  if (!(wide_px > kWidePx)) return false;
  // What the map shares (place and heading of the world) is not seen: how far pixels may be off decides.
  depths_.clear();
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    SlamLandmark& landmark = landmarks_[i];
    if (landmark.observation < 0) continue;
    BlockMeasurement& m = measurements_[i];
    m.noise_cov.topLeftCorner<2, 2>().setZero();
    const Eigen::Vector2d& pixel = frame.features[static_cast<std::size_t>(landmark.observation)].pixel_px;
    const bool seen = linearise(landmark, pixel, 0, m);
    depths_.push_back(seen ? std::sqrt(covariance_.innovation_cov(m).topLeftCorner<2, 2>().trace()) : kAbsurdPx);
  }
  if (depths_.size() < kFewestForPose) return false;
  const auto middle = depths_.begin() + static_cast<std::ptrdiff_t>(depths_.size() / 2);
  std::nth_element(depths_.begin(), middle, depths_.end());
  if (!(*middle > kWidePx)) return false;
  // Directions to those points whose place is known.
  sighted_.clear();
  for (const SlamLandmark& landmark : landmarks_) {
    if (landmark.observation < 0) continue;
    const auto ray = camera_.unproject(frame.features[static_cast<std::size_t>(landmark.observation)].pixel_px);
    if (!ray) continue;
    if (!is_placed(landmark)) continue;
    const SlamPoint& point = landmark.point;
    sighted_.push_back({point.converted ? point.position : point.inverse_depth.xyz(), *ray});
  }
  if (sighted_.size() < kFewestForPose) return false;
  AbsolutePoseOptions narrowing;
  narrowing.last_width = kNarrowSigmas * sigma_px(frame) / focal_px;
  const auto found = absolute_pose(sighted_, state_.T_world_camera(), narrowing);
  if (!found) return false;
  const Pose3 body = *found * state_.T_body_camera.inverse();
  dx_.setZero(covariance_.dim());  // features may have come and gone since it was last used
  dx_.segment<3>(kTheta) = so3::boxminus(body.rotation, state_.q_world_body);
  dx_.segment<3>(kPosition) = body.translation - state_.position;
  // What the prior excludes, it is not.
  prior_cov.diagonal().array() += 1e-12;
  if (!(dx_.head<6>().dot(prior_cov.ldlt().solve(dx_.head<6>())) < kFarthest)) return false;
  near = state_;
  boxplus(near, layout_, dx_);
  return true;
}

void SlamFilter::select_measured(const FeaturesMeasurement& frame) {
  const double sigma = sigma_px(frame);
  candidates_.clear();
  which_.clear();
  const SlamState prior = state_;
  approached_ = approach(frame, state_);
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    SlamLandmark& landmark = landmarks_[i];
    BlockMeasurement& measurement = measurements_[i];
    if (landmark.observation < 0) {
      // Where to look for it, and how far around.
      if (landmark.visible && linearise(landmark, landmark.predicted_px, sigma, measurement)) {
        landmark.innovation_cov = covariance_.innovation_cov(measurement).topLeftCorner<2, 2>();
      }
      continue;
    }
    const Eigen::Vector2d& pixel = frame.features[static_cast<std::size_t>(landmark.observation)].pixel_px;
    if (!linearise(landmark, pixel, sigma, measurement)) {
      landmark.state = SlamFeatureState::kRejected;
      continue;
    }
    if (approached_) measurement.residual.head<2>() += moved_by(measurement);
    landmark.innovation_cov = covariance_.innovation_cov(measurement).topLeftCorner<2, 2>();
    candidates_.push_back(static_cast<int>(i));
  }
  if (approached_) first_ = state_;  // the first estimate that means anything
  state_ = prior;
  // The map is in the order of its age.
  const auto first_young = std::partition_point(candidates_.begin(), candidates_.end(), [&](int i) {
    return !is_young(landmarks_[static_cast<std::size_t>(i)]);
  });
  young_.clear();
  if (below_cover() && first_young - candidates_.begin() >= kEnoughToSteer) {
    young_.assign(first_young, candidates_.end());
    candidates_.erase(first_young, candidates_.end());
  }
  const auto keep = [&](std::vector<int>& which, std::size_t most) {
    if (which.size() <= most) return;
    const auto tells = [&](int i) { return landmarks_[static_cast<std::size_t>(i)].innovation_cov.determinant(); };
    std::nth_element(which.begin(), which.begin() + static_cast<std::ptrdiff_t>(most), which.end(),
                     [&](int a, int b) { return tells(a) > tells(b); });
    which.resize(most);
    std::sort(which.begin(), which.end());
  };
  keep(candidates_, static_cast<std::size_t>(options_.map.max_measured));
  keep(young_, static_cast<std::size_t>(options_.map.max_measured));
  which_ = candidates_;
}

// After covariance_.update(): the state takes the correction, and what follows from it.
void SlamFilter::apply_update() {
  const SlamState before = state_;
  boxplus(state_, layout_, dx_);
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    SlamLandmark& landmark = landmarks_[i];
    points_before_[i] = landmark.point;
    landmark.point.boxplus(dx_.segment(landmark.offset, landmark.point.dim()));
  }
  if (options_.consistency == SlamConsistency::kPlain) return;

  // T = I + U E^T, which takes the unobservable directions at the state before to those after the update: an error of
  // attitude theta turns what is known of the world by w = R theta, and everything moves by w x x.
  const Eigen::Matrix3d to_world = before.q_world_body.toRotationMatrix();
  const int dim = covariance_.dim();
  shear_.topRows(dim).setZero();
  const auto move = [&](int row, const Eigen::Vector3d& after, const Eigen::Vector3d& was) {
    shear_.middleRows<3>(row) = -so3::hat(after - was) * to_world;
  };
  shear_.middleRows<3>(kTheta) =
      (state_.q_world_body.conjugate() * before.q_world_body).toRotationMatrix() - Eigen::Matrix3d::Identity();
  move(kPosition, state_.position, before.position);
  move(kVelocity, state_.velocity, before.velocity);
  if (options_.consistency == SlamConsistency::kInvariant) {
    for (std::size_t i = 0; i < landmarks_.size(); ++i) {
      const SlamLandmark& landmark = landmarks_[i];
      const SlamPoint& was = points_before_[i];
      if (landmark.point.converted) {
        move(landmark.offset, landmark.point.position, was.position);
        continue;
      }
      move(landmark.offset + kAnchor, landmark.point.inverse_depth.anchor, was.inverse_depth.anchor);
      shear_.middleRows<2>(landmark.offset + kRay) =
          (turn_of_ray(landmark.point.inverse_depth.frame) - turn_of_ray(was.inverse_depth.frame)) * to_world;
    }
  }
  covariance_.shear(kTheta, shear_);
}

const std::vector<char>& SlamFilter::agreeing(double sigma) {
  if (!approached_) {
    return options_.association.ransac
               ? ransac_.run(covariance_, residual_, sigma, static_cast<std::uint64_t>(time_ns_))
               : ransac_.compatible(covariance_, residual_);
  }
  // One measurement says nothing where the prior says nothing: those agree that fit the pose that was found.
  agrees_.assign(which_.size(), 0);
  for (std::size_t k = 0; k < which_.size(); ++k) {
    const BlockMeasurement& m = measurements_[static_cast<std::size_t>(which_[k])];
    const Eigen::Vector2d left = m.residual.head<2>() - moved_by(m);
    agrees_[k] = left.norm() < 2 * kNarrowSigmas * sigma ? 1 : 0;
  }
  return agrees_;
}

// P H^T, S and the residuals of which_.
void SlamFilter::innovate() {
  covariance_.innovate(measurements_, which_);
  residual_.clear();
  for (const int i : which_) {
    const BlockMeasurement& measurement = measurements_[static_cast<std::size_t>(i)];
    residual_.push_back(measurement.residual[0]);
    residual_.push_back(measurement.residual[1]);
  }
}

// The rows of those of which_ that are chosen, for the update.
void SlamFilter::accept(const std::vector<char>& chosen) {
  accepted_.clear();
  accepted_residual_.clear();
  for (std::size_t k = 0; k < which_.size(); ++k) {
    if (chosen[k] == 0) continue;
    for (std::size_t row = 2 * k; row < 2 * k + 2; ++row) {
      accepted_.push_back(static_cast<int>(row));
      accepted_residual_.push_back(residual_[row]);
    }
  }
}

void SlamFilter::update_agreeing(const FeaturesMeasurement& frame) {
  if (which_.empty()) return;
  innovate();
  const std::vector<char>& agrees = agreeing(sigma_px(frame));
  const auto agreeing_count =
      std::count(agrees.begin(), agrees.begin() + static_cast<std::ptrdiff_t>(which_.size()), 1);
  if (looks_for_map() && agreeing_count < fewest_to_find()) {
    // A few may agree by chance, and always do where the prior says nothing.
    for (const int i : which_) landmarks_[static_cast<std::size_t>(i)].state = SlamFeatureState::kRejected;
    candidates_.clear();
    young_.clear();
    return;
  }
  for (std::size_t k = 0; k < which_.size(); ++k) {
    SlamLandmark& landmark = landmarks_[static_cast<std::size_t>(which_[k])];
    landmark.state = agrees[k] != 0 ? SlamFeatureState::kMeasured : SlamFeatureState::kRejected;
  }
  accept(agrees);
  if (accepted_.empty()) return;
  iterate(frame);
  if (!covariance_.update(accepted_, accepted_residual_, dx_, nis_)) {
    ++failed_updates_;
    for (SlamLandmark& landmark : landmarks_) {
      if (landmark.state == SlamFeatureState::kMeasured) landmark.state = SlamFeatureState::kRejected;
    }
    return;
  }
  frame_.nis += nis_;
  frame_.nis_dim += static_cast<int>(accepted_.size());
  apply_update();
}

// Iterated update: where the correction is so large that pixels do not go where the Jacobians say, these are taken at
// the corrected state, and the residual is that of the prior in their terms: r = z - h(x_i) + H_i (x_i - x_0).
// Source: B. Bell, F. Cathey, "The iterated Kalman filter update as a Gauss-Newton method", IEEE TAC 38, 1993.
void SlamFilter::iterate(const FeaturesMeasurement& frame) {
  const SlamState prior = state_;
  for (int i = 1; i < options_.max_iterations; ++i) {
    if (!covariance_.correction(accepted_, accepted_residual_, dx_) || !dx_.allFinite()) return;
    for (std::size_t k = 0; k < landmarks_.size(); ++k) {
      SlamLandmark& landmark = landmarks_[k];
      if (i == 1) points_before_[k] = landmark.point;
      landmark.point = points_before_[k];
      landmark.point.boxplus(dx_.segment(landmark.offset, landmark.point.dim()));
    }
    state_ = prior;
    boxplus(state_, layout_, dx_);
    double worst = 0;
    bool good = true;
    for (std::size_t k = 0; k < accepted_.size() && good; k += 2) {
      const auto row = static_cast<std::size_t>(accepted_[k]);
      const auto at = static_cast<std::size_t>(which_[row / 2]);
      const BlockMeasurement& m = measurements_[at];
      const auto now = predict(state_, camera_, landmarks_[at].point);
      good = now.has_value();
      if (!good) break;
      const Eigen::Vector2d& z = frame.features[static_cast<std::size_t>(landmarks_[at].observation)].pixel_px;
      const Eigen::Vector2d linear = Eigen::Vector2d(accepted_residual_[k], accepted_residual_[k + 1]) - moved_by(m);
      worst = std::max(worst, (z - *now - linear).norm());
    }
    const bool again = good && worst > kNonlinearSigmas * sigma_px(frame);
    if (again) {
      for (std::size_t k = 0; k < accepted_.size() && good; k += 2) {
        const auto at = static_cast<std::size_t>(which_[static_cast<std::size_t>(accepted_[k]) / 2]);
        BlockMeasurement& m = measurements_[at];
        const Eigen::Vector2d& z = frame.features[static_cast<std::size_t>(landmarks_[at].observation)].pixel_px;
        good = linearise(landmarks_[at], z, 0, m);
        if (!good) break;
        const Eigen::Vector2d r = m.residual.head<2>() + moved_by(m);
        accepted_residual_[k] = r[0];
        accepted_residual_[k + 1] = r[1];
      }
    }
    // x_0 again: the update takes it to where it belongs.
    state_ = prior;
    for (std::size_t k = 0; k < landmarks_.size(); ++k) landmarks_[k].point = points_before_[k];
    if (!again) return;
    if (!good) {
      // Half of it is at another place: all of it at the prior again.
      for (std::size_t k = 0; k < accepted_.size(); k += 2) {
        const auto at = static_cast<std::size_t>(which_[static_cast<std::size_t>(accepted_[k]) / 2]);
        BlockMeasurement& m = measurements_[at];
        const Eigen::Vector2d& z = frame.features[static_cast<std::size_t>(landmarks_[at].observation)].pixel_px;
        linearise(landmarks_[at], z, 0, m);
        accepted_residual_[k] = m.residual[0];
        accepted_residual_[k + 1] = m.residual[1];
      }
    }
    covariance_.innovate(measurements_, which_);
    if (!good) return;
    ++frame_.iterations;
  }
}

// H dx
Eigen::Vector2d SlamFilter::moved_by(const BlockMeasurement& m) const {
  return m.head.topLeftCorner(2, layout_.dim).lazyProduct(dx_.head(layout_.dim)) +
         m.block_jacobian.topLeftCorner(2, m.block_dim).lazyProduct(dx_.segment(m.block, m.block_dim));
}

void SlamFilter::rescue(const FeaturesMeasurement& frame) {
  which_.clear();
  for (const int i : candidates_) {
    SlamLandmark& landmark = landmarks_[static_cast<std::size_t>(i)];
    if (landmark.state != SlamFeatureState::kRejected) continue;
    BlockMeasurement& measurement = measurements_[static_cast<std::size_t>(i)];
    const Eigen::Vector2d& pixel = frame.features[static_cast<std::size_t>(landmark.observation)].pixel_px;
    if (!linearise(landmark, pixel, sigma_px(frame), measurement)) continue;
    which_.push_back(i);
  }
  if (which_.empty()) return;
  innovate();
  accept(ransac_.compatible(covariance_, residual_));
  if (accepted_.empty()) return;
  iterate(frame);
  if (!covariance_.update(accepted_, accepted_residual_, dx_, nis_)) {
    ++failed_updates_;
    return;
  }
  for (std::size_t k = 0; k < accepted_.size(); k += 2) {
    const auto i = static_cast<std::size_t>(which_[static_cast<std::size_t>(accepted_[k]) / 2]);
    landmarks_[i].state = SlamFeatureState::kRescued;
  }
  frame_.nis += nis_;
  frame_.nis_dim += static_cast<int>(accepted_.size());
  apply_update();
}

// What is new may move by itself, and moves as a near feature would for a while. It is tracked by the pose that the
// others gave, and learns its depth with all that this pose is not known by, but changes nothing else.
void SlamFilter::estimate_young(const FeaturesMeasurement& frame) {
  which_.clear();
  for (const int i : young_) {
    const auto at = static_cast<std::size_t>(i);
    const Eigen::Vector2d& pixel = frame.features[static_cast<std::size_t>(landmarks_[at].observation)].pixel_px;
    landmarks_[at].state = SlamFeatureState::kRejected;
    if (linearise(landmarks_[at], pixel, sigma_px(frame), measurements_[at])) which_.push_back(i);
  }
  if (which_.empty()) return;
  innovate();
  accept(ransac_.compatible(covariance_, residual_));
  if (accepted_.empty()) return;
  const auto first = static_cast<std::size_t>(which_.front());
  if (!covariance_.update(accepted_, accepted_residual_, dx_, nis_, landmarks_[first].offset)) {
    ++failed_updates_;
    return;
  }
  for (std::size_t k = 0; k < accepted_.size(); k += 2) {
    const auto i = static_cast<std::size_t>(which_[static_cast<std::size_t>(accepted_[k]) / 2]);
    landmarks_[i].state = SlamFeatureState::kMeasured;
  }
  frame_.nis += nis_;
  frame_.nis_dim += static_cast<int>(accepted_.size());
  apply_update();
}

// Who was measured, and who should have been.
void SlamFilter::judge(const FeaturesMeasurement& frame) {
  double before = 0;
  double after = 0;
  int used = 0;
  const double forget = 1 - 1.0 / (2 * options_.map.delete_after_tries);
  SlamCounts& counts = frame_.counts;
  // A frame in which nothing was found says something of the frame, not of the features.
  const bool any = frame_.nis_dim > 0 && found_;
  for (SlamLandmark& landmark : landmarks_) {
    const bool measured = landmark.state == SlamFeatureState::kMeasured || landmark.state == SlamFeatureState::kRescued;
    if (landmark.visible) ++counts.visible;
    if (any && (landmark.visible || landmark.observation >= 0)) {
      landmark.tries = forget * landmark.tries + 1;
      // One that was found, but is not among the most informative, did nothing wrong.
      const bool fine = measured || (landmark.observation >= 0 && landmark.state == SlamFeatureState::kPredicted);
      landmark.hits = forget * landmark.hits + (fine ? 1 : 0);
    }
    if (landmark.state == SlamFeatureState::kRejected) ++counts.rejected;
    if (landmark.state == SlamFeatureState::kRescued) ++counts.rescued;
    if (!measured) continue;
    ++counts.measured;
    ++landmark.measured;
    landmark.last_measured_ns = time_ns_;
    landmark.last_measured_frame = frames_;
    const Eigen::Vector2d& pixel = frame.features[static_cast<std::size_t>(landmark.observation)].pixel_px;
    before += (pixel - landmark.predicted_px).squaredNorm();
    if (const auto now = predict(state_, camera_, landmark.point)) after += (pixel - *now).squaredNorm();
    ++used;
  }
  see_cover();
  frame_.reprojection_before_px = root_mean_square(before, used);
  frame_.reprojection_after_px = root_mean_square(after, used);
}

void SlamFilter::report(const FeaturesMeasurement& frame) {
  frame_.features.clear();
  for (const SlamLandmark& landmark : landmarks_) {
    if (!landmark.visible && landmark.observation < 0) continue;
    SlamFeature& out = frame_.features.emplace_back();
    out.id = landmark.id;
    out.state = landmark.state;
    out.converted = landmark.point.converted;
    if (landmark.observation >= 0)
      out.pixel_px = frame.features[static_cast<std::size_t>(landmark.observation)].pixel_px;
    out.predicted_px = landmark.predicted_px;
    out.innovation_cov = landmark.innovation_cov;
    if (const auto now = predict(state_, camera_, landmark.point)) out.estimated_px = *now;
    if (landmark.point.converted) {
      out.inverse_depth = 1 / (landmark.point.position - frame_.camera_position).norm();
    } else {
      out.inverse_depth = landmark.point.inverse_depth.inverse_depth;
      const int at = landmark.offset + kInverseDepth;
      out.sigma_inverse_depth = std::sqrt(std::max(0.0, covariance_(at, at)));
    }
  }
}

}  // namespace loc
