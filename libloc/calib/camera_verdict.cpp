#include "libloc/calib/camera_verdict.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "libloc/calib/dense.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc::calib {
namespace {

constexpr int kColumns = 12;
constexpr int kRows = 9;
constexpr double kDeg = std::numbers::pi / 180;

std::string degrees(double angle) {
  return to_text(angle / kDeg, 2) + " degrees";
}
std::string percent(double share) {
  return to_text(100 * share, 2) + " %";
}
std::string pixels(double value) {
  return to_text(value, 2) + " px";
}

void find_coverage(CameraFit& fit) {
  std::vector<bool> hit(static_cast<std::size_t>(kColumns * kRows), false);
  const Eigen::Vector2d size(fit.camera.width_px, fit.camera.height_px);
  const Eigen::Vector2d centre = (size.array() - 1) / 2;
  for (const CameraFitCorner& corner : fit.corners) {
    if (!corner.used) continue;
    const int x = std::clamp(static_cast<int>((corner.pixel_px.x() + 0.5) / size.x() * kColumns), 0, kColumns - 1);
    const int y = std::clamp(static_cast<int>((corner.pixel_px.y() + 0.5) / size.y() * kRows), 0, kRows - 1);
    hit[static_cast<std::size_t>(y * kColumns + x)] = true;
    fit.radius_share = std::max(fit.radius_share, (corner.pixel_px - centre).norm() / (size.norm() / 2));
  }
  fit.covered_share = static_cast<double>(std::ranges::count(hit, true)) / (kColumns * kRows);

  std::vector<Eigen::Vector3d> normals;
  for (const CameraFitView& view : fit.views) {
    if (view.used) normals.emplace_back(view.T_camera_target.rotation * Eigen::Vector3d::UnitZ());
  }
  double least = 1;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) least = std::min(least, normals[i].dot(normals[j]));
  }
  fit.tilt_range = std::acos(std::clamp(least, -1.0, 1.0));
}

void find_uncertainty(CameraFit& fit) {
  ProjectionUncertainty& out = fit.uncertainty;
  out.columns = kColumns;
  out.rows = kRows;
  out.sigma_px.assign(static_cast<std::size_t>(kColumns * kRows), kUnknown);
  const Camera camera(fit.camera);
  // The covariance, widened where the pictures' scatter says so.
  const Vector8d by_corners = fit.covariance.diagonal().cwiseSqrt();
  Vector8d factor = Vector8d::Ones();
  for (Eigen::Index i = 0; i < 8; ++i) {
    if (by_corners[i] > 0) factor[i] = fit.sigma()[i] / by_corners[i];
  }
  const Matrix8d cov = factor.asDiagonal() * fit.covariance * factor.asDiagonal();
  if (!cov.allFinite()) return;

  // Of each ray: how its pixel changes with the parameters, and with a rotation of the camera.
  struct Cell {
    std::size_t index;
    Eigen::Matrix<double, 2, 8> J;
    Eigen::Matrix<double, 2, 3> K;
  };
  std::vector<Cell> cells;
  Eigen::Matrix3d KK = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 8> KJ = Eigen::Matrix<double, 3, 8>::Zero();
  for (int y = 0; y < kRows; ++y) {
    for (int x = 0; x < kColumns; ++x) {
      const Eigen::Vector2d pixel((x + 0.5) * fit.camera.width_px / kColumns - 0.5,
                                  (y + 0.5) * fit.camera.height_px / kRows - 0.5);
      const auto ray = camera.unproject(pixel);
      if (!ray) continue;
      const auto projection = camera.project_with_jacobians(*ray);
      if (!projection) continue;
      Cell cell{static_cast<std::size_t>(y * kColumns + x), projection->d_parameters,
                -projection->d_point * so3::hat(*ray)};
      KK += cell.K.transpose() * cell.K;
      KJ += cell.K.transpose() * cell.J;
      cells.push_back(cell);
    }
  }
  if (cells.size() < 4) return;
  const Eigen::Matrix<double, 3, 8> turn = KK.ldlt().solve(KJ);
  std::vector<double> sigmas;
  for (const Cell& cell : cells) {
    const Eigen::Matrix<double, 2, 8> J = cell.J - cell.K * turn;
    const double sigma = std::sqrt(dense::propagate(J, cov).trace());
    out.sigma_px[cell.index] = sigma;
    sigmas.push_back(sigma);
  }
  out.median_px = quantile(sigmas, 0.5);
  out.worst_px = *std::ranges::max_element(sigmas);
}

}  // namespace

void judge(CameraFit& fit) {
  find_coverage(fit);
  find_uncertainty(fit);
  Quality& q = fit.quality;
  const Vector8d sigma = fit.sigma();
  if (!fit.converged) {
    q.lower_to(Verdict::kRefused, "The search did not converge after " + std::to_string(fit.iterations) + " steps.");
  }
  if (fit.noise_px > 2) {
    q.lower_to(Verdict::kRefused, "The corners are " + pixels(fit.rms_px) +
                                      " off: wrong target, wrong lens model, or a target that is not flat.");
  } else if (fit.noise_px > 1) {
    q.lower_to(Verdict::kWarn, "The corners are " + pixels(fit.rms_px) +
                                   " off, a good calibration has 0.1 to 0.5 px: check target and lens model.");
  } else if (fit.noise_px > 0.5) {
    q.lower_to(Verdict::kFair, "The corners are " + pixels(fit.rms_px) +
                                   " off, a good calibration has 0.1 to 0.5 px: blur, or a target that is not flat?");
  }
  if (fit.tilt_range < 10 * kDeg) {
    q.lower_to(Verdict::kRefused, "All pictures look at the target from one direction (" + degrees(fit.tilt_range) +
                                      "): tilt it by 30 to 45 degrees to all sides.");
  } else if (fit.tilt_range < 35 * kDeg) {
    q.lower_to(Verdict::kWarn, "The target is tilted by " + degrees(fit.tilt_range) +
                                   " in all: tilt it by 30 to 45 degrees to all sides.");
  }
  const double focal = std::max(sigma[0] / fit.camera.intrinsics_px[0], sigma[1] / fit.camera.intrinsics_px[1]);
  if (focal > 0.05) {
    q.lower_to(Verdict::kRefused,
               "The focal length is known to " + percent(focal) + " only: more pictures, more tilt.");
  } else if (focal > 0.01) {
    q.lower_to(Verdict::kWarn, "The focal length is known to " + percent(focal) + " only: more pictures, more tilt.");
  }
  if (fit.views_used < 6) {
    q.lower_to(Verdict::kWarn, "Only " + std::to_string(fit.views_used) + " pictures were used: take 20.");
  } else if (fit.views_used < 12) {
    q.lower_to(Verdict::kFair, std::to_string(fit.views_used) + " pictures were used: 20 are better.");
  }
  if (fit.covered_share < 0.3) {
    q.lower_to(Verdict::kWarn, "The target was seen in " + percent(fit.covered_share) +
                                   " of the image: bring it to all corners and borders.");
  } else if (fit.covered_share < 0.6) {
    q.lower_to(Verdict::kFair, "The target was seen in " + percent(fit.covered_share) +
                                   " of the image: bring it to all corners and borders.");
  }
  if (fit.radius_share < 0.5) {
    q.lower_to(Verdict::kWarn, "No corner is farther from the middle than " + percent(fit.radius_share) +
                                   " of the way to the image's corners: distortion is a guess beyond.");
  } else if (fit.radius_share < 0.75) {
    q.lower_to(Verdict::kFair, "No corner is farther from the middle than " + percent(fit.radius_share) +
                                   " of the way to the image's corners: distortion is extrapolated beyond.");
  }
  if (fit.uncertainty.worst_px > 5) {
    q.lower_to(Verdict::kWarn, "Somewhere in the image a projected point is uncertain by " +
                                   pixels(fit.uncertainty.worst_px) + ": bring the target there.");
  } else if (fit.uncertainty.worst_px > 1) {
    q.lower_to(Verdict::kFair, "Somewhere in the image a projected point is uncertain by " +
                                   pixels(fit.uncertainty.worst_px) + ": bring the target there.");
  }
  const double ratio = fit.camera.intrinsics_px[0] / fit.camera.intrinsics_px[1];
  if (std::abs(ratio - 1) > 0.03) {
    q.lower_to(Verdict::kWarn, "fx is " + to_text(ratio, 4) +
                                   " times fy: are the target's squares square, and the pictures not stretched?");
  }
  const double aside = std::max(std::abs(fit.camera.intrinsics_px[2] / fit.camera.width_px - 0.5),
                                std::abs(fit.camera.intrinsics_px[3] / fit.camera.height_px - 0.5));
  if (aside > 0.2) {
    q.lower_to(Verdict::kWarn, "The optical axis meets the image " + percent(aside) +
                                   " of its size from the middle: are the pictures cut out of larger ones?");
  }
  const int given = static_cast<int>(std::ranges::count_if(fit.views, [](const auto& v) { return v.corners > 0; }));
  if (given > 0 && fit.views_used < 0.7 * given) {
    q.lower_to(Verdict::kWarn, std::to_string(given - fit.views_used) + " of " + std::to_string(given) +
                                   " pictures with the target do not fit the others.");
  }
  if (fit.corners_dropped > 0.05 * (fit.corners_used + fit.corners_dropped)) {
    q.lower_to(Verdict::kFair, std::to_string(fit.corners_dropped) + " of " +
                                   std::to_string(fit.corners_used + fit.corners_dropped) +
                                   " corners do not fit the others.");
  }
  if (fit.other_model_noise_px < 0.8 * fit.noise_px) {
    const bool fisheye = fit.camera.distortion_model == DistortionModel::kEquidistant;
    q.lower_to(Verdict::kWarn, std::string("The lens model ") + (fisheye ? "radtan" : "equidistant") +
                                   " fits better: " + pixels(fit.other_model_rms_px) + " instead of " +
                                   pixels(fit.rms_px) + ".");
  }
}

}  // namespace loc::calib
