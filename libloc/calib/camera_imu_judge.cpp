#include "libloc/calib/camera_imu_judge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>

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
constexpr double kNoNoise = 20;        // from here on it is not noise
constexpr double kOtherScale = 0.003;  // as a share
constexpr double kPulledApart = 2;
constexpr double kTornApart = 5;
constexpr double kByChance = 2;  // deviations
// Deviations from which what was held is something else. What was held wrongly also pulls pieces of the recording
// apart, so the deviations have grown with it.
constexpr double kSignificant = 2.5;
constexpr double kOfMany = 1.4;           // of that, for the largest of a matrix
constexpr double kMovedFar = 3;           // deviations
constexpr double kLeastKnown = 0.2;       // deviation of a scale, that says anything of it
constexpr double kRollingShutter = 1e-3;  // [s] from the first row to the last
constexpr double kDrift = 1e-4;           // [s] over the recording
constexpr double kIntrinsicsPull = 1;     // [px]
constexpr double kLeastIntrinsicsSigma = 1e-6;

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
  double gain = kUnknown;  // that the step lowers the cost by
  MatrixXd covariance;     // by noise; NaN, as all that follows: they are not determined
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
  out.gain = -0.5 * pulls.rowwise().sum().dot(out.step);
  out.by_noise = out.covariance.diagonal().cwiseSqrt();
  // About their mean: at the solution they sum up to nothing, for what was held they do not.
  const MatrixXd apart = moves.colwise() - moves.rowwise().mean();
  out.groups = static_cast<double>(pulls.cols());
  out.by_blocks = apart.rowwise().norm() * std::sqrt(out.groups / std::max(1.0, out.groups - 1));
  return out;
}

// Together with what was estimated, further unknowns; those that there are.
Part with_further(const SharedEquations& e, const Part& estimated, std::span<const int> further) {
  std::vector<int> places = estimated.places;
  for (const int place : further) {
    if (place >= 0 && std::ranges::find(places, place) == places.end()) places.push_back(place);
  }
  return solve_for(e, std::move(places));
}

// The solution, and with it what is known of intrinsics that were held: an error of theirs within its deviation must
// not be taken for one of something else.
struct Solution {
  SharedEquations known;  // with the deviations of intrinsics as measurements
  Part estimated;
  Part free;  // estimated, and those intrinsics; of known
};

Solution solution_of(const SharedEquations& e, std::span<const Vector8d> intrinsics_sigma) {
  Solution out{e, solve_for(e, estimated_places(e)), {}};
  std::vector<int> places = out.estimated.places;
  for (std::size_t c = 0; c < e.all.cameras.size(); ++c) {
    if (e.estimated.cameras[c].intrinsics >= 0) continue;
    const SharedLayout::OfCamera& all = e.all.cameras[c];
    append(places, all.intrinsics, all.intrinsics_size);
    for (int i = 0; i < all.intrinsics_size; ++i) {
      const double sigma = std::max(intrinsics_sigma[c][i], kLeastIntrinsicsSigma);
      out.known.information(all.intrinsics + i, all.intrinsics + i) += 1 / (sigma * sigma);
    }
  }
  out.free = solve_for(out.known, std::move(places));
  return out;
}

// @param also what is to be free besides, because its errors look alike
CameraImuCheck check_of(const Solution& solution, int place, bool was_estimated, double value, int also = -1) {
  CameraImuCheck out;
  if (place < 0) return out;
  out.estimated = was_estimated;
  const Part with =
      was_estimated ? solution.estimated : with_further(solution.known, solution.free, std::array{place, also});
  out.value = was_estimated ? value : value + with.step[with.at(place)];
  out.sigma = with.sigma(place);
  return out;
}

// Row by row; the upper half of a lower triangle is zero.
CameraImuMatrixCheck check_of(const Solution& solution, int place, bool was_estimated, const Eigen::Matrix3d& value,
                              bool lower) {
  CameraImuMatrixCheck out;
  if (place < 0) return out;
  std::vector<int> places;
  append(places, place, lower ? 6 : 9);
  const Part with = was_estimated ? solution.estimated : with_further(solution.known, solution.free, places);
  out.estimated = was_estimated;
  out.value = value;
  out.sigma.setZero();
  int next = place;
  for (Index a = 0; a < 3; ++a) {
    for (Index b = 0; b < (lower ? a + 1 : 3); ++b, ++next) {
      if (!was_estimated) out.value(a, b) += with.step[with.at(next)];
      out.sigma(a, b) = with.sigma(next);
    }
  }
  return out;
}

void put_intrinsics(const SharedEquations& e, const Part& estimated, std::size_t c, const Vector8d& sigma,
                    CameraImuCamera& camera, Matrix7d& covariance) {
  const SharedLayout::OfCamera& all = e.all.cameras[c];
  const int size = all.intrinsics_size;
  std::vector<int> own;
  append(own, all.intrinsics, size);
  if (e.estimated.cameras[c].intrinsics >= 0) {
    for (int i = 0; i < size; ++i) camera.intrinsics_sigma[i] = estimated.sigma(own[static_cast<std::size_t>(i)]);
    return;
  }
  camera.intrinsics_sigma.head(size) = sigma.head(size);
  const Part with = with_further(e, estimated, own);
  camera.intrinsics_change.head(size) = with.step.tail(size);
  // How the mounting moves with the intrinsics that are held.
  const MatrixXd all_moves = dense::product(-estimated.covariance, e.information(estimated.places, own));
  const MatrixXd moves = all_moves.middleRows<kMountingSize>(estimated.at(all.first));
  camera.by_intrinsics.leftCols(size) = moves;
  const MatrixXd by_intrinsics = dense::compose(moves, sigma.head(size).cwiseAbs2());
  camera.sigma_by_intrinsics = by_intrinsics.diagonal().cwiseSqrt();
  covariance += by_intrinsics;
}

// ---- what was held and is something else

// Something that was held, which may be the cause of what does not fit.
struct Suspect {
  std::vector<int> places;
  // Of the solution with it free: what it says, empty where that is no more than chance or too little to matter.
  std::function<std::string(const Part&)> says;
  bool always_warn = false;
  bool intrinsics = false;  // what is known of them is doubted
};

bool beyond_chance(const Part& with, int place, double floor) {
  const double value = std::abs(with.step[with.at(place)]);
  return value > floor && value > kSignificant * with.sigma(place);
}

std::string percent(double share) {
  return to_text(100 * std::abs(share), 2) + " %";
}

std::string matrix_doubt(const Part& with, int place, bool lower, const std::string& sensor) {
  double most = 0;
  int at = place;
  for (Index a = 0; a < 3; ++a) {
    for (Index b = 0; b < (lower ? a + 1 : 3); ++b, ++at) {
      // Of so many entries one lies beyond the usual limit by chance.
      const double off = with.step[with.at(at)];
      if (std::abs(off) > kSignificant * kOfMany * with.sigma(at) && std::abs(off) > std::abs(most)) most = off;
    }
  }
  if (std::abs(most) < kOtherScale) return "";
  return "The " + sensor + "'s scale or alignment seems to be off by " + percent(most) +
         ": calibrate it, or let the IMU's matrices be estimated";
}

std::string intrinsics_doubt(const Part& with, const std::vector<int>& own, const Vector8d& sigma,
                             const std::string& of) {
  double pull = 0;
  bool beyond = false;
  for (Index i = 0; i < 4; ++i) {
    const int place = own[static_cast<std::size_t>(i)];
    const double change = with.step[with.at(place)];
    pull = std::max(pull, std::abs(change));
    beyond = beyond || std::abs(change) > 3 * std::hypot(sigma[i], with.sigma(place));
  }
  if (!beyond || pull < kIntrinsicsPull) return "";
  return "This recording would change the intrinsics" + of + " by up to " + to_text(pull, 2) +
         " px, more than their deviations allow: are they of this camera, lens and focus? Calibrate them, or let them "
         "be refined";
}

std::vector<Suspect> suspects_of(const SharedEquations& e, const CameraImuState& state, const CameraImuOptions& options,
                                 std::span<const Vector8d> intrinsics_sigma, double length_s, const CameraImuFit& fit) {
  std::vector<Suspect> out;
  const auto add = [&](int place, bool estimated, const std::function<std::string(const Part&)>& says,
                       bool always_warn = false) {
    if (place >= 0 && !estimated) out.push_back({{place}, says, always_warn});
  };
  for (std::size_t c = 0; c < fit.cameras.size(); ++c) {
    const SharedLayout::OfCamera& all = e.all.cameras[c];
    const SharedLayout::OfCamera& own = e.estimated.cameras[c];
    const std::string of = fit.cameras.size() > 1 ? " of " + fit.cameras[c].camera.name : "";
    const double height = state.cameras[c].camera.height_px;
    add(
        all.line_delay, own.line_delay >= 0,
        [=](const Part& with) {
          if (!beyond_chance(with, all.line_delay, kRollingShutter / height)) return std::string();
          return "The rows" + of + " seem to be taken one after the other, " +
                 to_text(1e3 * with.step[with.at(all.line_delay)] * height, 2) +
                 " ms from the first to the last: a rolling shutter. Let the line delay be estimated";
        },
        true);
    add(
        all.drift, own.drift >= 0,
        [=](const Part& with) {
          if (!beyond_chance(with, all.drift, kDrift / length_s)) return std::string();
          return "The clocks" + of + " drift apart by " + to_text(1e6 * with.step[with.at(all.drift)], 2) +
                 " us a second: the offset holds for the middle of the recording only. Put both on one clock, or let "
                 "the "
                 "drift be estimated";
        },
        true);
    if (own.intrinsics < 0) {
      std::vector<int> places;
      append(places, all.intrinsics, all.intrinsics_size);
      const Vector8d& sigma = intrinsics_sigma[c];  // copied by the capture
      out.push_back({places, [=](const Part& with) { return intrinsics_doubt(with, places, sigma, of); }, false, true});
    }
  }
  add(e.all.gravity_size, e.estimated.gravity_size >= 0, [=](const Part& with) {
    if (!beyond_chance(with, e.all.gravity_size, kOtherScale * options.gravity)) return std::string();
    return "Gravity seems to be " + to_text(options.gravity + with.step[with.at(e.all.gravity_size)], 4) +
           " m/s^2, not " + to_text(options.gravity, 4) +
           ": is it that of the place, and the accelerometer calibrated?";
  });
  add(e.all.target_scale, false, [=](const Part& with) {
    if (!beyond_chance(with, e.all.target_scale, kOtherScale)) return std::string();
    const double off = with.step[with.at(e.all.target_scale)];
    return "By the accelerometer the target is " + percent(off) + (off > 0 ? " larger" : " smaller") +
           " than it was said to be: measure it once more";
  });
  if (e.estimated.gyro_matrix < 0) {
    for (const bool accel : {false, true}) {
      std::vector<int> places;
      const int first = accel ? e.all.accel_matrix : e.all.gyro_matrix;
      append(places, first, accel ? 6 : 9);
      out.push_back({places, [=](const Part& with) {
                       return matrix_doubt(with, first, accel, accel ? "accelerometer" : "gyroscope");
                     }});
    }
  }
  return out;
}

// What a mounting moves by from one solution to the other, in words, and whether that is more than was said of it.
std::string moves_of(const SharedEquations& e, const Part& from, const Part& to, const CameraImuFit& fit,
                     bool& too_far) {
  Vector7d most = Vector7d::Zero();
  for (std::size_t c = 0; c < fit.cameras.size(); ++c) {
    const int first = e.all.cameras[c].first;
    const Vector7d step = to.step.segment<7>(to.at(first)) - from.step.segment<7>(from.at(first));
    if ((step.array().abs() > kMovedFar * fit.cameras[c].sigma.array()).any()) too_far = true;
    if (step.segment<3>(kShift).norm() >= most.segment<3>(kShift).norm()) most = step;
  }
  return " (the mounting would move by " + to_text(most.head<3>().norm() * 180 / std::numbers::pi, 2) + " deg, " +
         to_text(1e3 * most.segment<3>(kShift).norm(), 2) + " mm, " + to_text(1e6 * std::abs(most[kOffset]), 2) +
         " us)";
}

// One fault is seen in many quantities: the one that explains most is taken first, and the others are looked at with
// that one free. @returns whether there is any.
bool put_doubts(const SharedEquations& e, const Solution& solution, std::vector<Suspect> suspects,
                const CameraImuFit& fit, Quality& q) {
  SharedEquations known = solution.known;
  Part free = solution.free;
  const std::size_t all = suspects.size();
  while (!suspects.empty()) {
    std::size_t best = suspects.size();
    Part with_best;
    SharedEquations known_best;
    std::string text;
    for (std::size_t i = 0; i < suspects.size(); ++i) {
      SharedEquations own = known;
      if (suspects[i].intrinsics) {
        for (const int place : suspects[i].places) own.information(place, place) = e.information(place, place);
      }
      Part with = with_further(own, free, suspects[i].places);
      if (!with.step.allFinite()) continue;
      const std::string says = suspects[i].says(with);
      if (says.empty() || (best < suspects.size() && with.gain <= with_best.gain)) continue;
      best = i;
      text = says;
      with_best = std::move(with);
      known_best = std::move(own);
    }
    if (best == suspects.size()) break;
    bool warn = suspects[best].always_warn;
    std::vector<int> others = with_best.places;
    std::erase_if(others, [&](int place) {
      return std::ranges::find(suspects[best].places, place) != suspects[best].places.end();
    });
    text += moves_of(e, solve_for(known, std::move(others)), with_best, fit, warn) + ".";
    q.lower_to(warn ? Verdict::kWarn : Verdict::kFair, text);
    free = std::move(with_best);
    known = std::move(known_best);
    suspects.erase(suspects.begin() + static_cast<std::ptrdiff_t>(best));
  }
  return suspects.size() < all;
}

// @param doubted something that was held is doubted
void judge_camera(const CameraImuCamera& camera, bool several, bool doubted, Quality& q) {
  const std::string of = several ? " of " + camera.camera.name : "";
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
    q.lower_to(blocks < kTornApart ? Verdict::kFair : Verdict::kWarn,
               "Parts of the recording" + of + " pull apart " + to_text(blocks, 2) + " times more than noise can" +
                   " (blurred pictures, the lens at the image's edge, coloured residuals of the IMU" +
                   (doubted ? ", or what is said above)" : ")") + ". The deviations take that into account.");
  }
  const auto used = std::ranges::count_if(camera.views, &CameraImuView::used);
  if (2 * used < static_cast<std::ptrdiff_t>(camera.views.size())) {
    q.lower_to(Verdict::kFair, "Only " + std::to_string(used) + " of " + std::to_string(camera.views.size()) +
                                   " pictures" + of + " could be used: the reason stands with each.");
  }
}

void put_deviations(const SharedEquations& e, const Solution& solution, const CameraImuState& state,
                    std::span<const Vector8d> intrinsics_sigma, CameraImuFit& fit) {
  const Part& estimated = solution.estimated;
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
    put_intrinsics(e, estimated, c, intrinsics_sigma[c], camera, camera.covariance);
    camera.sigma = camera.covariance.diagonal().cwiseSqrt();
    camera.line_delay_s = check_of(solution, all.line_delay, own.line_delay >= 0, state.cameras[c].line_delay_s);
    camera.offset_drift = check_of(solution, all.drift, own.drift >= 0, state.cameras[c].drift);
  }
  fit.gravity_direction_sigma =
      std::hypot(estimated.sigma(e.all.gravity), estimated.sigma(e.all.gravity + 1)) / std::numbers::sqrt2;
  fit.gravity_size = check_of(solution, e.all.gravity_size, e.estimated.gravity_size >= 0, state.gravity.norm());
  const bool matrices = e.estimated.gyro_matrix >= 0;
  // A scale of the accelerometer is in gravity's size as well.
  fit.target_scale = check_of(solution, e.all.target_scale, false, state.target_scale, e.all.gravity_size);
  // Beside gravity and the accelerometer's scale there is nothing left to tell it by.
  if (!(fit.target_scale.sigma < kLeastKnown)) fit.target_scale = {};
  fit.gyroscope_matrix = check_of(solution, e.all.gyro_matrix, matrices, state.gyro_matrix, false);
  fit.accelerometer_matrix = check_of(solution, e.all.accel_matrix, matrices, state.accel_matrix, true);
}

}  // namespace

void conclude(const SharedEquations& e, const CameraImuState& state, const CameraImuOptions& options,
              std::span<const Vector8d> intrinsics_sigma, bool too_fast, double length_s, CameraImuFit& fit) {
  const Solution solution = solution_of(e, intrinsics_sigma);
  if (!solution.estimated.by_noise.allFinite()) throw DataError("the recording does not determine the calibration");
  put_deviations(e, solution, state, intrinsics_sigma, fit);
  Quality& q = fit.quality;
  if (!fit.converged) {
    q.lower_to(Verdict::kRefused, "The solution has not settled" +
                                      (fit.stopped.empty() ? std::string() : " (" + fit.stopped + ")") +
                                      ": give it more time, or a better recording.");
  }
  // First what was held wrongly: it spoils all that follows.
  const bool doubted = put_doubts(e, solution, suspects_of(e, state, options, intrinsics_sigma, length_s, fit), fit, q);
  const auto noisy = [&](double scale, const std::string& sensor) {
    if (scale < kDoubtfulNoise) return;
    q.lower_to(scale < kNoNoise ? Verdict::kFair : Verdict::kWarn,
               "The " + sensor + " fits " + to_text(scale, 2) +
                   " times worse than its noise density says: check the density, its unit and axes, gravity and the "
                   "target's size, or take a closer knot spacing if the rig was shaken.");
  };
  noisy(fit.gyroscope_noise_scale, "gyroscope");
  noisy(fit.accelerometer_noise_scale, "accelerometer");
  for (const CameraImuCamera& camera : fit.cameras) judge_camera(camera, fit.cameras.size() > 1, doubted, q);
  if (too_fast) {
    q.lower_to(Verdict::kWarn, "The rig was moved faster than the knots can follow (" + fit.knot_reason +
                                   "): move it more gently, or take a faster IMU.");
  }
}

}  // namespace loc::calib
