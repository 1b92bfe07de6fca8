#include "libloc/calib/camera_imu_knots.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"

namespace loc::calib {
namespace {

constexpr double kPiece = 1.28;      // [s] of the recording that is transformed at a time
constexpr double kFloorBand = 0.75;  // above this share of the highest frequency there is only noise
constexpr double kMostLeft = 0.25;   // of the noise's power
// … or of the motion's: a hand-held rig's falls off slowly, and what is left acts as a little more noise.
constexpr double kMostTurning = 1e-3;
constexpr double kMostForce = 2e-2;
constexpr double kUsualSpacing = 0.02;  // [s]
constexpr double kUsualSamples = 4;     // of the IMU between two knots
constexpr double kLeastSamples = 2;     // fewer do not determine the spline
constexpr double kStepShare = 0.03;     // nearer to a whole number, two periods keep step
constexpr double kOutOfStep = 0.93;

// Mean power of the three axes in each bin of a piece, pieces overlapping by half, von Hann's window (Welch 1967).
std::vector<double> spectrum(const std::vector<Eigen::Vector3d>& samples, std::size_t piece) {
  std::vector<double> window(piece);
  double norm = 0;
  for (std::size_t i = 0; i < piece; ++i) {
    window[i] = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(piece));
    norm += window[i] * window[i];
  }
  std::vector<double> power(piece / 2, 0.0);
  Eigen::FFT<double> fft;
  std::vector<double> x(piece);
  std::vector<std::complex<double>> X;
  int pieces = 0;
  for (std::size_t begin = 0; begin + piece <= samples.size(); begin += piece / 2) {
    ++pieces;
    for (int axis = 0; axis < 3; ++axis) {
      double mean = 0;
      for (std::size_t i = 0; i < piece; ++i) mean += samples[begin + i][axis];
      mean /= static_cast<double>(piece);
      for (std::size_t i = 0; i < piece; ++i) x[i] = (samples[begin + i][axis] - mean) * window[i];
      fft.fwd(X, x);
      for (std::size_t k = 0; k < power.size(); ++k) power[k] += std::norm(X[k]) / norm;
    }
  }
  for (double& p : power) p /= std::max(1, pieces);
  return power;
}

double bandwidth_of(const std::vector<Eigen::Vector3d>& samples, std::size_t piece, double dt, double most) {
  const std::vector<double> power = spectrum(samples, piece);
  const auto high = static_cast<std::size_t>(kFloorBand * static_cast<double>(power.size()));
  const double floor = quantile(std::span(power).subspan(high), 0.5);
  const auto bins = static_cast<double>(power.size());
  const double motion = std::accumulate(power.begin(), power.end(), 0.0) - floor * bins;
  const double allowed = std::max(kMostLeft * floor * bins, most * motion);
  double left = 0;
  std::size_t k = power.size();
  while (k > 0) {
    left += power[k - 1] - floor;
    if (left > allowed) break;
    --k;
  }
  return static_cast<double>(k) / (static_cast<double>(piece) * dt);
}

double knots_per_period(int order) {
  // Of order 3 the acceleration jumps at each knot.
  return order >= 6 ? 5 : order == 5 ? 6.5 : order == 4 ? 8 : 16;
}

bool in_step(double a, double b) {
  const double ratio = std::max(a, b) / std::min(a, b);
  return std::abs(ratio - std::round(ratio)) < kStepShare * ratio;
}

}  // namespace

double bandwidth_of(std::span<const ImuRow> imu) {
  if (imu.size() < 2) return 0;
  const double dt = sample_period(imu);
  auto piece = static_cast<std::size_t>(std::lround(kPiece / dt));
  piece += piece % 2;
  if (piece < 16 || imu.size() < 2 * piece) return 0;
  std::vector<Eigen::Vector3d> gyro;
  std::vector<Eigen::Vector3d> accel;
  for (const ImuRow& row : imu) {
    gyro.push_back(row.gyro);
    accel.push_back(row.accel);
  }
  return std::max(bandwidth_of(gyro, piece, dt, kMostTurning), bandwidth_of(accel, piece, dt, kMostForce));
}

KnotChoice choose_knots(std::span<const ImuRow> imu, int order, double given_s, double camera_period_s) {
  KnotChoice out;
  const double dt = sample_period(imu);
  out.bandwidth_hz = bandwidth_of(imu);
  const auto ms = [](double s) { return to_text(1e3 * s, 3) + " ms"; };
  const double wanted = out.bandwidth_hz > 0 ? 1 / (knots_per_period(order) * out.bandwidth_hz) : kUsualSamples * dt;
  const double least = kLeastSamples * dt;
  const std::string motion = out.bandwidth_hz == 0
                                 ? std::string("the recording is too short, or too quiet, for a spectrum")
                                 : "the motion reaches " + to_text(out.bandwidth_hz, 2) + " Hz, for which order " +
                                       std::to_string(order) + " needs knots at most " + ms(wanted) + " apart";
  if (given_s > 0) {
    out.spacing_s = given_s;
    out.too_fast = given_s > 1.5 * wanted;
    out.reason = ms(given_s) + " as asked for; " + motion + ".";
    return out;
  }
  const double usual = std::max(kUsualSamples * dt, kUsualSpacing);
  out.spacing_s = std::clamp(wanted, least, usual);
  out.too_fast = wanted < least;
  if (wanted >= usual) {
    out.reason = ms(usual) + ", the usual spacing for an IMU of " + to_text(1 / dt, 3) + " Hz; " + motion + ".";
  } else if (!out.too_fast) {
    out.reason = ms(wanted) + ": " + motion + ".";
  } else {
    out.reason = ms(least) + ", two samples of the IMU: " + motion + ", which this IMU is too slow for.";
  }
  if (camera_period_s > 0 && in_step(out.spacing_s, camera_period_s)) {
    const bool shorter = out.spacing_s * kOutOfStep >= least;
    out.spacing_s *= shorter ? kOutOfStep : 1 / kOutOfStep;
    out.reason += (shorter ? " Shortened to " : " Lengthened to ") + ms(out.spacing_s) +
                  ", so that the knots do not keep step with the camera (" + ms(camera_period_s) + ").";
  }
  return out;
}

}  // namespace loc::calib
