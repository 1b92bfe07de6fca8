#include "libloc/calib/camera_intrinsics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libloc/calib/camera_bundle.hpp"
#include "libloc/calib/camera_verdict.hpp"
#include "libloc/calib/least_squares.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"

namespace loc {
namespace {

using calib::BundleCorner;
using calib::BundleView;

constexpr std::size_t kFewestViews = 3;
constexpr double kMostDropped = 0.4;  // share of a picture's corners; beyond, the picture itself is wrong

std::string pixels(double value) {
  return to_text(value, 3) + " px";
}

// The pictures that take part, and where they stand in the list that was given.
struct Problem {
  CameraCalibration camera;
  std::vector<BundleView> views;
  std::vector<std::size_t> index;

  void remove(std::size_t i) {
    views.erase(views.begin() + static_cast<std::ptrdiff_t>(i));
    index.erase(index.begin() + static_cast<std::ptrdiff_t>(i));
  }
  std::size_t used_corners() const {
    std::size_t count = 0;
    for (const BundleView& view : views) {
      count += static_cast<std::size_t>(std::ranges::count_if(view.corners, &BundleCorner::used));
    }
    return count;
  }
  /// Deviation of one coordinate when the sum of squares is twice the cost.
  double noise(double cost) const {
    const double freedom = 2.0 * static_cast<double>(used_corners()) - calib::parameter_count(camera.distortion_model) -
                           6.0 * static_cast<double>(views.size());
    return freedom > 0 ? std::sqrt(2 * cost / freedom) : std::numeric_limits<double>::quiet_NaN();
  }
};

double view_rms(const std::vector<std::optional<Eigen::Vector2d>>& residuals, const BundleView& view) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (!view.corners[i].used || !residuals[i]) continue;
    sum += residuals[i]->squaredNorm();
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

// The noise of a coordinate while some corners may be wrong.
double robust_noise(const Problem& problem) {
  const Camera lens(problem.camera);
  std::vector<double> values;
  for (const BundleView& view : problem.views) {
    const auto residuals = calib::residuals_of(lens, view);
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      if (!residuals[i] || !view.corners[i].used) continue;
      values.push_back(residuals[i]->x());
      values.push_back(residuals[i]->y());
    }
  }
  // A perfect simulation has none; a width of zero would make every corner an outlier.
  return std::max(values.empty() ? 0.0 : robust_sigma(values), 1e-6);
}

// Corners without projection cannot take part in an adjustment.
void leave_out_unseen(Problem& problem) {
  const Camera lens(problem.camera);
  for (BundleView& view : problem.views) {
    const auto residuals = calib::residuals_of(lens, view);
    for (std::size_t i = 0; i < residuals.size(); ++i) view.corners[i].used = residuals[i].has_value();
  }
}

// Marks corners and takes out pictures that do not fit. @return whether anything changed.
bool drop(Problem& problem, const CameraFitOptions& options, double noise, std::vector<CameraFitView>& results) {
  const Camera lens(problem.camera);
  bool changed = false;
  std::vector<double> rms;
  std::vector<std::size_t> dropped;
  for (BundleView& view : problem.views) {
    const auto residuals = calib::residuals_of(lens, view);
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      const bool fits = residuals[i] && residuals[i]->norm() <= options.corner_limit * noise;
      changed = changed || fits != view.corners[i].used;
      view.corners[i].used = fits;
    }
    rms.push_back(view_rms(residuals, view));
    dropped.push_back(view.corners.size() -
                      static_cast<std::size_t>(std::ranges::count_if(view.corners, &BundleCorner::used)));
  }
  const double typical = quantile(rms, 0.5);
  for (std::size_t i = problem.views.size(); i-- > 0;) {
    const std::size_t all = problem.views[i].corners.size();
    std::string reason;
    if (static_cast<double>(dropped[i]) > kMostDropped * static_cast<double>(all) ||
        all - dropped[i] < static_cast<std::size_t>(options.min_corners)) {
      reason = std::to_string(dropped[i]) + " of its " + std::to_string(all) + " corners are more than " +
               pixels(options.corner_limit * noise) + " off";
    } else if (rms[i] > options.view_limit * typical && rms[i] > 0.02) {
      reason = "its rms is " + pixels(rms[i]) + ", that of the pictures is " + pixels(typical);
    }
    if (reason.empty() || problem.views.size() <= kFewestViews) continue;
    results[problem.index[i]].reason = reason;
    problem.remove(i);
    changed = true;
  }
  return changed;
}

// From a start to the end: first robust, then without weights on what fits.
calib::BundleResult solve(Problem& problem, const CameraFitOptions& options, std::vector<CameraFitView>& results) {
  int iterations = 0;
  double before = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 6; ++round) {
    leave_out_unseen(problem);
    const double noise = robust_noise(problem);
    if (round > 0 && noise > 0.98 * before) break;
    before = noise;
    iterations += adjust(problem.camera, problem.views,
                         {.huber_px = 1.5 * noise, .max_iterations = options.max_iterations, .fixed_camera = false})
                      .iterations;
  }
  calib::BundleResult result;
  for (int round = 0; round < 8; ++round) {
    // At first the median tells the noise; later all residuals do, of which the tails are cut.
    const double noise = round == 0 ? robust_noise(problem) : std::max(problem.noise(result.cost), 1e-6);
    const bool changed = drop(problem, options, noise, results);
    if (round > 0 && !changed) break;
    result = adjust(problem.camera, problem.views,
                    {.huber_px = 0, .max_iterations = options.max_iterations, .fixed_camera = false});
    iterations += result.iterations;
    if (!result.valid) break;
  }
  result.iterations = iterations;
  return result;
}

// The same corners with the other distortion model; of a long video some pictures are enough.
void compare(const Problem& problem, const CameraFitOptions& options, CameraFit& fit) {
  constexpr std::size_t kEnough = 100;
  Problem other{problem.camera, {}, {}};
  const std::size_t count = std::min(kEnough, problem.views.size());
  for (std::size_t i = 0; i < count; ++i) other.views.push_back(problem.views[i * problem.views.size() / count]);
  other.camera.distortion_model =
      options.model == DistortionModel::kEquidistant ? DistortionModel::kRadtan : DistortionModel::kEquidistant;
  for (BundleView& view : other.views) std::erase_if(view.corners, [](const BundleCorner& c) { return !c.used; });
  if (!calib::find_start(other.camera, other.views)) return;
  for (BundleView& view : other.views) {
    if (!calib::find_pose(other.camera, view, 2)) return;
  }
  adjust(other.camera, other.views, {.huber_px = 1, .max_iterations = options.max_iterations, .fixed_camera = false});
  const auto result = adjust(other.camera, other.views,
                             {.huber_px = 0, .max_iterations = options.max_iterations, .fixed_camera = false});
  if (!result.valid) return;
  fit.other_model_noise_px = other.noise(result.cost);
  fit.other_model_rms_px = std::sqrt(2 * result.cost / static_cast<double>(other.used_corners()));
}

// A grid whose space between tags is not as it was given is the usual reason for large residuals: the space that fits
// best, if it halves them. Golden-section search (Kiefer 1953) over the logarithm, on some of the pictures.
std::optional<double> better_spacing(const CalibrationTarget& target, const Problem& problem) {
  constexpr std::size_t kEnough = 20;
  std::vector<BundleView> some;
  const std::size_t count = std::min(kEnough, problem.views.size());
  for (std::size_t i = 0; i < count; ++i) some.push_back(problem.views[i * problem.views.size() / count]);
  const auto cost = [&](double log_spacing) {
    CalibrationTarget other = target;
    other.spacing = std::exp(log_spacing);
    CameraCalibration camera = problem.camera;
    std::vector<BundleView> views = some;
    for (BundleView& view : views) {
      for (BundleCorner& corner : view.corners) corner.point = other.corner(corner.id);
    }
    const auto result = adjust(camera, views, {.huber_px = 0.5, .max_iterations = 15, .fixed_camera = false});
    return result.valid ? result.cost : std::numeric_limits<double>::infinity();
  };
  const double given = std::log(target.spacing);
  const double best = golden_section(cost, given - std::log(3.0), given + std::log(3.0), 0.004);
  // Huber's cost grows linearly with large residuals.
  return cost(best) < 0.5 * cost(given) ? std::optional(std::exp(best)) : std::nullopt;
}

// Pictures that follow each other hang together as well: the same blur, the same part of the lens. With more groups
// they would not be long enough, with fewer their scatter says little about eight parameters.
constexpr std::size_t kGroupsForScatter = 16;
// Of the deviations from 16 - 8 degrees of freedom by chance: the root of the 99 % quantile of chi square over them.
constexpr double kMoreThanChance = 1.58;

void find_covariance(const Problem& problem, CameraFit& fit) {
  const auto information = calib::information_of(problem.camera, problem.views);
  const int n = calib::parameter_count(problem.camera.distortion_model);
  const auto inverse = covariance_from(information.information.topLeftCorner(n, n));
  if (!inverse) {
    fit.covariance.topLeftCorner(n, n).diagonal().setConstant(std::numeric_limits<double>::infinity());
    fit.quality.lower_to(Verdict::kRefused,
                         "The pictures do not determine the camera: tilt the target in different directions.");
    return;
  }
  fit.covariance.topLeftCorner(n, n) = fit.noise_px * fit.noise_px * *inverse;
  const std::size_t views = information.pulls.size();
  if (views < kGroupsForScatter) return;
  const auto scatter = [&](std::size_t groups) {
    Eigen::MatrixXd pulls = Eigen::MatrixXd::Zero(n, static_cast<Eigen::Index>(groups));
    for (std::size_t i = 0; i < views; ++i) {
      pulls.col(static_cast<Eigen::Index>(i * groups / views)) += information.pulls[i].head(n);
    }
    const auto m = static_cast<double>(groups);
    return Eigen::VectorXd((*inverse * pulls).rowwise().norm() * std::sqrt(m / (m - n)));
  };
  const Eigen::VectorXd single = scatter(views);
  const Eigen::VectorXd runs = scatter(kGroupsForScatter);
  fit.sigma_by_views.setZero();
  fit.sigma_by_views.head(n) = (runs.array() > kMoreThanChance * single.array()).select(runs, single);
}

void fill_views(const Problem& problem, CameraFit& fit) {
  const Camera lens(problem.camera);
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    const BundleView& view = problem.views[i];
    CameraFitView& out = fit.views[problem.index[i]];
    out.T_camera_target = view.T_camera_target;
    const auto residuals = calib::residuals_of(lens, view);
    out.rms_px = view_rms(residuals, view);
    out.worst_px = 0;
    out.corners_dropped = 0;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < residuals.size(); ++k) {
      const BundleCorner& corner = view.corners[k];
      middle += view.T_camera_target * corner.point / static_cast<double>(residuals.size());
      CameraFitCorner& c = fit.corners.emplace_back();
      c.view = static_cast<std::int32_t>(problem.index[i]);
      c.id = corner.id;
      c.used = corner.used && out.reason.empty();
      c.pixel_px = corner.pixel;
      if (residuals[k]) c.residual_px = *residuals[k];
      if (!corner.used) {
        ++out.corners_dropped;
      } else if (residuals[k]) {
        out.worst_px = std::max(out.worst_px, residuals[k]->norm());
      }
    }
    const Eigen::Vector3d normal = view.T_camera_target.rotation * Eigen::Vector3d::UnitZ();
    out.tilt = std::acos(std::clamp(-normal.dot(middle.normalized()), -1.0, 1.0));
    out.used = out.reason.empty();
    if (!out.used) continue;
    ++fit.views_used;
    fit.corners_used += static_cast<int>(residuals.size()) - out.corners_dropped;
    fit.corners_dropped += out.corners_dropped;
  }
}

}  // namespace

void CameraFitOptions::check() const {
  require(min_corners >= 4 && min_corners <= 10000, "min_corners", min_corners, "must be at least 4");
  require(corner_limit >= 2 && std::isfinite(corner_limit), "corner_limit", corner_limit, "must be at least 2");
  require(view_limit > 1 && std::isfinite(view_limit), "view_limit", view_limit, "must be more than 1");
  require(max_iterations >= 1, "max_iterations", max_iterations, "must be positive");
}

Vector8d CameraFit::sigma() const {
  const Vector8d by_corners = covariance.diagonal().cwiseSqrt();
  return sigma_by_views.array().isFinite().all() ? by_corners.cwiseMax(sigma_by_views) : by_corners;
}

CameraFit calibrate_camera(const CalibrationTarget& target, std::span<const TargetView> views, int width_px,
                           int height_px, const CameraFitOptions& options) {
  target.check();
  options.check();
  require(width_px > 0 && height_px > 0, "width_px, height_px: must be positive");
  CameraFit fit;
  fit.views.resize(views.size());
  Problem problem;
  problem.camera.width_px = width_px;
  problem.camera.height_px = height_px;
  problem.camera.distortion_model = options.model;
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i].check(target);
    CameraFitView& out = fit.views[i];
    out.corners = static_cast<int>(views[i].corners.size());
    if (out.corners < options.min_corners) {
      out.reason = out.corners == 0 ? "the target was not found" : "only " + std::to_string(out.corners) + " corners";
      continue;
    }
    BundleView view;
    for (const TargetCorner& corner : views[i].corners) {
      view.corners.push_back({corner.id, target.corner(corner.id), corner.pixel_px, true});
    }
    problem.views.push_back(std::move(view));
    problem.index.push_back(i);
  }
  const auto need_views = [&](const char* what) {
    if (problem.views.size() >= kFewestViews) return;
    throw DataError("calibration of a camera: " + std::to_string(problem.views.size()) + " of " +
                    std::to_string(views.size()) + " pictures " + what + "; at least 3 are needed, 20 are good");
  };
  need_views("show enough of the target");
  if (!calib::find_start(problem.camera, problem.views)) {
    throw DataError("calibration of a camera: no focal length explains the corners: is the target as it was given (" +
                    target_text(target) + ")?");
  }
  for (std::size_t i = problem.views.size(); i-- > 0;) {
    if (calib::find_pose(problem.camera, problem.views[i], 2)) continue;
    fit.views[problem.index[i]].reason = "no pose explains its corners";
    problem.remove(i);
  }
  need_views("have corners that a pose explains");

  const Problem all = problem;
  const calib::BundleResult result = solve(problem, options, fit.views);
  fit.camera = problem.camera;
  fit.iterations = result.iterations;
  fit.converged = result.valid && result.converged;
  fit.noise_px = problem.noise(result.cost);
  fit.rms_px = std::sqrt(2 * result.cost / static_cast<double>(std::max<std::size_t>(problem.used_corners(), 1)));
  fill_views(problem, fit);
  // Pictures that were dropped are shown with the pose that the result gives them.
  Problem dropped{problem.camera, {}, {}};
  for (std::size_t i = 0; i < all.views.size(); ++i) {
    if (std::ranges::find(problem.index, all.index[i]) != problem.index.end()) continue;
    BundleView view = all.views[i];
    if (!calib::find_pose(problem.camera, view, 2)) continue;
    dropped.views.push_back(std::move(view));
    dropped.index.push_back(all.index[i]);
  }
  fill_views(dropped, fit);
  if (!(fit.noise_px >= 0)) {
    fit.quality.lower_to(Verdict::kRefused, "There are no more corners than unknowns: take more pictures.");
    return fit;
  }
  find_covariance(problem, fit);
  if (options.compare_models && options.model != DistortionModel::kNone) compare(problem, options, fit);
  constexpr double kSuspicious = 0.5;  // [px]
  if (target.kind == TargetKind::kAprilGrid && fit.noise_px > kSuspicious) {
    if (const auto spacing = better_spacing(target, problem)) {
      fit.quality.lower_to(Verdict::kRefused, "The corners fit a spacing of " + to_text(*spacing, 3) +
                                                  " far better than the target's " + to_text(target.spacing, 3) +
                                                  ": measure the space between two tags again, as a share of a tag.");
    }
  }
  calib::judge(fit);
  return fit;
}

std::vector<std::size_t> choose_views(const CalibrationTarget& target, std::span<const TargetView> views, int width_px,
                                      int height_px, std::size_t count, int min_corners) {
  target.check();
  require(width_px > 0 && height_px > 0, "width_px, height_px: must be positive");
  // What tells pictures apart: the affine map from the target to the image, at the target's middle.
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  std::vector<std::size_t> able;
  std::vector<Vector6> looks;
  const Eigen::Vector3d middle = (target.corner(0) + target.corner(target.corner_count() - 1)) / 2;
  const double size = std::max(middle.norm(), target.size_m / 2);
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i].check(target);
    if (static_cast<int>(views[i].corners.size()) < min_corners) continue;
    Eigen::Matrix3d A = 1e-9 * Eigen::Matrix3d::Identity();
    Eigen::Matrix<double, 3, 2> b = Eigen::Matrix<double, 3, 2>::Zero();
    for (const TargetCorner& corner : views[i].corners) {
      const Eigen::Vector3d p = (target.corner(corner.id) - middle) / size;
      const Eigen::Vector3d row(p.x(), p.y(), 1);
      A += row * row.transpose();
      b += row * Eigen::RowVector2d(corner.pixel_px.x() / width_px, corner.pixel_px.y() / height_px);
    }
    const Eigen::Matrix<double, 3, 2> map = A.ldlt().solve(b);
    if (!map.allFinite()) continue;
    able.push_back(i);
    looks.emplace_back(Eigen::Map<const Vector6>(map.data()));
  }
  if (able.size() <= count) return able;
  std::vector<std::size_t> chosen;
  std::vector<double> distance(able.size(), std::numeric_limits<double>::infinity());
  // Begins with the picture that shows most corners.
  std::size_t next = 0;
  for (std::size_t i = 1; i < able.size(); ++i) {
    if (views[able[i]].corners.size() > views[able[next]].corners.size()) next = i;
  }
  while (chosen.size() < count) {
    chosen.push_back(able[next]);
    for (std::size_t i = 0; i < able.size(); ++i) {
      distance[i] = std::min(distance[i], (looks[i] - looks[next]).norm());
    }
    next = static_cast<std::size_t>(std::ranges::max_element(distance) - distance.begin());
  }
  std::ranges::sort(chosen);
  return chosen;
}

}  // namespace loc
