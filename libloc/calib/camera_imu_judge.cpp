#include "libloc/calib/camera_imu_judge.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "libloc/calib/dense.hpp"
#include "libloc/core/check.hpp"

namespace loc::calib {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLeastPivot = 1e-13;
constexpr double kAlikePeaks = 0.9;
constexpr double kDoubtfulNoise = 3;
constexpr double kNoNoise = 20;          // from here on it is not noise
constexpr double kOtherGravity = 0.003;  // as a share
constexpr double kPulledApart = 2;
constexpr double kByChance = 2;  // deviations
// Deviations from which what was held is something else. What was held wrongly also pulls pieces of the recording
// apart, so the deviations have grown with it.
constexpr double kSignificant = 2.5;
constexpr double kRollingShutter = 1e-3;  // [s] from the first row to the last
constexpr double kDrift = 1e-4;           // [s] over the recording
constexpr double kIntrinsicsPull = 1;     // [px]

void append(std::vector<int>& out, int first, int size) {
  for (int i = 0; i < size && first >= 0; ++i) out.push_back(first + i);
}

// Places in the equations of all that were estimated, in their order.
std::vector<int> estimated_places(const SharedEquations& e) {
  std::vector<int> out;
  for (std::size_t c = 0; c < e.all.cameras.size(); ++c) {
    const SharedLayout::OfCamera& own = e.estimated.cameras[c];
    const SharedLayout::OfCamera& all = e.all.cameras[c];
    append(out, all.first, kMountingSize);
    if (own.drift >= 0) append(out, all.drift, 1);
    if (own.line_delay >= 0) append(out, all.line_delay, 1);
    if (own.intrinsics >= 0) append(out, all.intrinsics, all.intrinsics_size);
  }
  append(out, e.all.gravity, 2);
  if (e.estimated.gravity_size >= 0) append(out, e.all.gravity_size, 1);
  if (e.estimated.gyro_matrix >= 0) {
    append(out, e.all.gyro_matrix, 9);
    append(out, e.all.accel_matrix, 6);
  }
  return out;
}

// Groups of windows are few: a scatter of so many is that of Student's t, not of a normal distribution, and scatters
// itself; only what is more than chance counts.
double growth_by_blocks(double by_noise, double by_blocks, double groups) {
  const double by_chance = 1 + kByChance / std::sqrt(2 * std::max(1.0, groups - 1));
  const double growth = by_blocks / by_noise;
  if (!(growth > by_chance)) return 1;
  return growth * (groups > 4 ? std::sqrt((groups - 1) / (groups - 3)) : 2);
}

// The solution for some of the unknowns, the others held.
struct Part {
  std::vector<int> places;
  double groups = 0;
  MatrixXd covariance;  // by noise
  VectorXd step;
  VectorXd by_noise;
  VectorXd by_blocks;

  Index at(int place) const { return std::ranges::find(places, place) - places.begin(); }
  double sigma(int place) const {
    return by_noise[at(place)] * growth_by_blocks(by_noise[at(place)], by_blocks[at(place)], groups);
  }
};

Part solve_for(const SharedEquations& e, std::vector<int> places) {
  Part out;
  out.places = std::move(places);
  const MatrixXd S = e.information(out.places, out.places);
  // Scaled, because units differ by many orders.
  const VectorXd scale = S.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const auto inverse = dense::solve_definite(scale.asDiagonal() * S * scale.asDiagonal(),
                                             MatrixXd::Identity(S.rows(), S.cols()), kLeastPivot);
  if (!inverse) {
    const auto n = static_cast<Index>(out.places.size());
    out.covariance = MatrixXd::Constant(n, n, kUnknown);
    out.step = out.by_noise = out.by_blocks = VectorXd::Constant(n, kUnknown);
    return out;
  }
  out.covariance = scale.asDiagonal() * *inverse * scale.asDiagonal();
  const MatrixXd pulls = e.pulls(out.places, Eigen::all);
  const MatrixXd moves = dense::product(out.covariance, pulls);
  out.step = -moves.rowwise().sum();
  out.by_noise = out.covariance.diagonal().cwiseSqrt();
  // About their mean: at the solution they sum up to nothing, for what was held they do not.
  const MatrixXd apart = moves.colwise() - moves.rowwise().mean();
  out.groups = static_cast<double>(pulls.cols());
  out.by_blocks = apart.rowwise().norm() * std::sqrt(out.groups / std::max(1.0, out.groups - 1));
  return out;
}

CameraImuCheck check_of(const SharedEquations& e, const Part& estimated, int place, bool was_estimated, double value) {
  CameraImuCheck out;
  if (place < 0) return out;
  out.estimated = was_estimated;
  if (was_estimated) {
    out.value = value;
    out.sigma = estimated.sigma(place);
    return out;
  }
  std::vector<int> places = estimated.places;
  places.push_back(place);
  const Part with = solve_for(e, std::move(places));
  out.value = value + with.step[with.at(place)];
  out.sigma = with.sigma(place);
  return out;
}

// @returns the deviations of the change that the recording would make
Vector8d put_intrinsics(const SharedEquations& e, const Part& estimated, std::size_t c, const Vector8d& sigma,
                        CameraImuCamera& camera, Matrix7d& covariance) {
  Vector8d change_sigma = Vector8d::Zero();
  const SharedLayout::OfCamera& all = e.all.cameras[c];
  const int size = all.intrinsics_size;
  std::vector<int> own;
  append(own, all.intrinsics, size);
  if (e.estimated.cameras[c].intrinsics >= 0) {
    for (int i = 0; i < size; ++i) camera.intrinsics_sigma[i] = estimated.sigma(own[static_cast<std::size_t>(i)]);
    return change_sigma;
  }
  camera.intrinsics_sigma.head(size) = sigma.head(size);
  std::vector<int> places = estimated.places;
  places.insert(places.end(), own.begin(), own.end());
  const Part with = solve_for(e, std::move(places));
  camera.intrinsics_change.head(size) = with.step.tail(size);
  for (int i = 0; i < size; ++i) change_sigma[i] = with.sigma(own[static_cast<std::size_t>(i)]);
  // How the mounting moves with the intrinsics that are held.
  const MatrixXd all_moves = dense::product(-estimated.covariance, e.information(estimated.places, own));
  const MatrixXd moves = all_moves.middleRows<kMountingSize>(estimated.at(all.first));
  camera.by_intrinsics.leftCols(size) = moves;
  const MatrixXd by_intrinsics = dense::compose(moves, sigma.head(size).cwiseAbs2());
  camera.sigma_by_intrinsics = by_intrinsics.diagonal().cwiseSqrt();
  covariance += by_intrinsics;
  return change_sigma;
}

void judge_camera(const CameraImuOptions& options, const CameraImuCamera& camera, const Vector8d& change_sigma,
                  double length_s, bool several, Quality& q) {
  const std::string of = several ? " of " + camera.camera.name : "";
  // First what was held wrongly: it spoils all that follows.
  const CameraImuCheck& line = camera.line_delay_s;
  const double readout = std::abs(line.value) * camera.camera.height_px;
  if (!line.estimated && std::abs(line.value) > kSignificant * line.sigma && readout > kRollingShutter) {
    q.lower_to(Verdict::kWarn,
               "The rows" + of + " seem to be taken one after the other, " +
                   to_text(1e3 * line.value * camera.camera.height_px, 2) +
                   " ms from the first to the last: a rolling shutter. Let the line delay be estimated.");
  }
  const CameraImuCheck& drift = camera.offset_drift;
  if (!drift.estimated && std::abs(drift.value) > kSignificant * drift.sigma &&
      std::abs(drift.value) * length_s > kDrift) {
    q.lower_to(Verdict::kWarn, "The clocks" + of + " drift apart by " + to_text(1e6 * drift.value, 2) +
                                   " us a second: the offset holds for the middle of the recording only. Put both on "
                                   "one clock, or let the drift be estimated.");
  }
  const double pull = camera.intrinsics_change.head<4>().cwiseAbs().maxCoeff();
  if (!options.refine_intrinsics && pull > kIntrinsicsPull &&
      (camera.intrinsics_change.head<4>().cwiseAbs2().array() >
       9 * (camera.intrinsics_sigma.head<4>().cwiseAbs2() + change_sigma.head<4>().cwiseAbs2()).array())
          .any()) {
    q.lower_to(Verdict::kFair, "This recording would change the intrinsics" + of + " by up to " + to_text(pull, 2) +
                                   " px, more than their deviations allow: are they of this camera, lens and focus?");
  }
  const auto by_size = [&](double value, double fair, double warn, double refused, const std::string& text) {
    if (value < fair) return;
    const Verdict verdict = value < warn ? Verdict::kFair : value < refused ? Verdict::kWarn : Verdict::kRefused;
    q.lower_to(verdict, text);
  };
  const double turn_deg = camera.sigma.head<3>().norm() * 180 / std::numbers::pi;
  const double shift_mm = 1e3 * camera.sigma.segment<3>(3).norm();
  const double time_ms = 1e3 * camera.sigma[6];
  const bool lens = (camera.sigma_by_intrinsics.array() > 0.7 * camera.sigma.array()).any();
  const std::string more =
      lens ? ", most of it from what is not known of the camera's intrinsics: calibrate them better."
           : ": turn the rig faster and about all axes, and record for longer.";
  by_size(turn_deg, 0.1, 0.3, 1, "The deviation of the rotation" + of + " is " + to_text(turn_deg, 2) + " deg" + more);
  by_size(shift_mm, 2, 5, 20, "The deviation of the translation" + of + " is " + to_text(shift_mm, 2) + " mm" + more);
  by_size(time_ms, 0.1, 0.5, 5, "The deviation of the offset" + of + " is " + to_text(time_ms, 2) + " ms" + more);
  if (camera.start.second_correlation > kAlikePeaks * camera.start.correlation) {
    q.lower_to(Verdict::kWarn, "The turn rates" + of + " agree nearly as well at another offset (correlation " +
                                   to_text(camera.start.second_correlation, 2) + " against " +
                                   to_text(camera.start.correlation, 2) + "): move less regularly.");
  }
  const double blocks = (camera.sigma_by_blocks.array() / camera.sigma_by_noise.array()).maxCoeff();
  if (blocks > kPulledApart) {
    q.lower_to(Verdict::kFair, "Parts of the recording" + of + " pull apart " + to_text(blocks, 2) +
                                   " times more than noise can (blurred pictures, the lens at the image's edge, "
                                   "coloured residuals of the IMU); the deviations take that into account.");
  }
  const auto used = std::ranges::count_if(camera.views, &CameraImuView::used);
  if (2 * used < static_cast<std::ptrdiff_t>(camera.views.size())) {
    q.lower_to(Verdict::kFair, "Only " + std::to_string(used) + " of " + std::to_string(camera.views.size()) +
                                   " pictures" + of + " could be used: the reason stands with each.");
  }
}

}  // namespace

std::vector<Vector8d> put_deviations(const SharedEquations& e, const CameraImuState& state,
                                     std::span<const Vector8d> intrinsics_sigma, CameraImuFit& fit) {
  const Part estimated = solve_for(e, estimated_places(e));
  if (!estimated.by_noise.allFinite()) throw DataError("the recording does not determine the calibration");
  std::vector<Vector8d> change_sigma;
  for (std::size_t c = 0; c < fit.cameras.size(); ++c) {
    CameraImuCamera& camera = fit.cameras[c];
    const SharedLayout::OfCamera& all = e.all.cameras[c];
    const SharedLayout::OfCamera& own = e.estimated.cameras[c];
    const Index at = estimated.at(all.first);
    camera.sigma_by_noise = estimated.by_noise.segment<7>(at);
    camera.sigma_by_blocks = estimated.by_blocks.segment<7>(at);
    Vector7d grown;
    for (Index i = 0; i < kMountingSize; ++i) {
      grown[i] = growth_by_blocks(camera.sigma_by_noise[i], camera.sigma_by_blocks[i], estimated.groups);
    }
    camera.covariance = grown.asDiagonal() * estimated.covariance.block<7, 7>(at, at) * grown.asDiagonal();
    change_sigma.push_back(put_intrinsics(e, estimated, c, intrinsics_sigma[c], camera, camera.covariance));
    camera.sigma = camera.covariance.diagonal().cwiseSqrt();
    camera.line_delay_s = check_of(e, estimated, all.line_delay, own.line_delay >= 0, state.cameras[c].line_delay_s);
    camera.offset_drift = check_of(e, estimated, all.drift, own.drift >= 0, state.cameras[c].drift);
  }
  fit.gravity_direction_sigma =
      std::hypot(estimated.sigma(e.all.gravity), estimated.sigma(e.all.gravity + 1)) / std::numbers::sqrt2;
  fit.gravity_size = check_of(e, estimated, e.all.gravity_size, e.estimated.gravity_size >= 0, state.gravity.norm());
  if (e.estimated.gyro_matrix >= 0) {
    int gyro = e.all.gyro_matrix;
    int accel = e.all.accel_matrix;
    for (Index a = 0; a < 3; ++a) {
      for (Index b = 0; b < 3; ++b) fit.gyroscope_matrix_sigma(a, b) = estimated.sigma(gyro++);
      for (Index b = 0; b <= a; ++b) fit.accelerometer_matrix_sigma(a, b) = estimated.sigma(accel++);
    }
  }
  return change_sigma;
}

void judge(const CameraImuOptions& options, std::span<const Vector8d> change_sigma, bool too_fast, double length_s,
           CameraImuFit& fit) {
  Quality& q = fit.quality;
  if (!fit.converged) {
    q.lower_to(Verdict::kRefused, "The solution has not settled" +
                                      (fit.stopped.empty() ? std::string() : " (" + fit.stopped + ")") +
                                      ": give it more time, or a better recording.");
  }
  const CameraImuCheck& gravity = fit.gravity_size;
  if (!gravity.estimated && std::abs(gravity.value - options.gravity) > kSignificant * gravity.sigma &&
      std::abs(gravity.value / options.gravity - 1) > kOtherGravity) {
    q.lower_to(Verdict::kWarn, "Gravity seems to be " + to_text(gravity.value, 4) + " m/s^2, not " +
                                   to_text(options.gravity, 4) +
                                   ": is the target as large as it was said to be, and the accelerometer calibrated?");
  }
  const auto noisy = [&](double scale, const std::string& sensor) {
    if (scale < kDoubtfulNoise) return;
    q.lower_to(scale < kNoNoise ? Verdict::kFair : Verdict::kWarn,
               "The " + sensor + " fits " + to_text(scale, 2) +
                   " times worse than its noise density says: check the density, its unit and axes, gravity and the "
                   "target's size, or take a closer knot spacing if the rig was shaken.");
  };
  noisy(fit.gyroscope_noise_scale, "gyroscope");
  noisy(fit.accelerometer_noise_scale, "accelerometer");
  for (std::size_t c = 0; c < fit.cameras.size(); ++c) {
    judge_camera(options, fit.cameras[c], change_sigma[c], length_s, fit.cameras.size() > 1, q);
  }
  if (too_fast) {
    q.lower_to(Verdict::kWarn, "The rig was moved faster than the knots can follow (" + fit.knot_reason +
                                   "): move it more gently, or take a faster IMU.");
  }
}

}  // namespace loc::calib
