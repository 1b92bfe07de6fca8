#include "libloc/calib/camera_imu.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <numbers>
#include <utility>

#include "libloc/calib/camera_bundle.hpp"
#include "libloc/calib/camera_imu_problem.hpp"
#include "libloc/calib/camera_imu_start.hpp"
#include "libloc/calib/least_squares.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

using calib::CameraImuProblem;
using calib::CameraImuState;
using calib::CameraPoseSample;
using calib::ChainStep;
using calib::ChainSystem;
using calib::FrameRow;
using calib::ImuRow;
using Eigen::Vector3d;

constexpr int kLeastCorners = 6;
constexpr double kMargin = 0.5;   // [s] of IMU samples beyond the pictures
constexpr double kInside = 0.02;  // [s] that pictures keep from the ends
constexpr double kWorstPose = 5;  // [px] rms of a picture's corners
constexpr double kStartSmoothing = 1e-4;
constexpr double kAlikePeaks = 0.9;
constexpr double kDoubtfulNoise = 3;
constexpr double kPulledApart = 2;
constexpr int kNoiseRounds = 2;
constexpr double kCommonWeight = 20;        // coordinates of corners that the common noise counts for
constexpr double kLeastCornerSigma = 0.01;  // [px]

double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

struct Recording {
  TimeNs origin = 0;
  std::vector<ImuRow> imu;
  std::vector<FrameRow> frames;
  std::vector<std::size_t> view_of;  // of each frame
  std::vector<CameraPoseSample> poses;
};

Recording read(const CalibrationTarget& target, std::span<const TargetView> views, const CameraCalibration& camera,
               std::span<const ImuMeasurement> imu, const CameraImuOptions& options, CameraImuFit& fit) {
  Recording out;
  if (imu.size() < 2) throw DataError("there are " + std::to_string(imu.size()) + " IMU samples");
  out.origin = imu.front().time_ns;
  for (const ImuMeasurement& m : imu) {
    out.imu.push_back({to_seconds(m.time_ns - out.origin), m.angular_velocity, m.specific_force});
  }
  fit.views.resize(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    calib::BundleView view;
    FrameRow frame{to_seconds(views[i].time_ns - out.origin), options.corner_sigma_px, {}};
    for (const TargetCorner& corner : views[i].corners) {
      view.corners.push_back({corner.id, target.corner(corner.id), corner.pixel_px, true});
      frame.corners.push_back({view.corners.back().point, corner.pixel_px});
    }
    CameraImuView& report = fit.views[i];
    if (view.corners.empty()) {
      report.reason = "no corners";
      continue;
    }
    if (static_cast<int>(view.corners.size()) < kLeastCorners || !calib::find_pose(camera, view, 1.0)) {
      report.reason = "its corners give no pose";
      continue;
    }
    double sum = 0;
    int n = 0;
    for (const auto& r : calib::residuals_of(Camera(camera), view)) {
      if (r) sum += r->squaredNorm();
      ++n;
    }
    const double rms = std::sqrt(sum / n);
    if (rms > kWorstPose) {
      report.reason = "no pose explains its corners";
      continue;
    }
    out.poses.push_back({frame.t_s, view.T_camera_target.inverse()});
    out.frames.push_back(std::move(frame));
    out.view_of.push_back(i);
  }
  return out;
}

CameraImuState first_state(const Recording& recording, const calib::ChainPlan& plan, const CameraImuStart& start,
                           double gravity) {
  CameraImuState state;
  // Rotations: from each picture to the next by the gyroscope, what is left over spread evenly.
  std::vector<double> times;
  std::vector<Pose3> poses;
  std::vector<double> frame_times;
  Eigen::MatrixXd positions(3, static_cast<Eigen::Index>(recording.poses.size()));
  std::vector<Eigen::Quaterniond> R_frame;
  for (std::size_t i = 0; i < recording.poses.size(); ++i) {
    frame_times.push_back(recording.poses[i].t_s + start.time_offset_s);
    positions.col(static_cast<Eigen::Index>(i)) = recording.poses[i].T_target_camera.translation;
    R_frame.push_back(recording.poses[i].T_target_camera.rotation * start.R_camera_imu);
  }
  const calib::MeanRate gyro(recording.imu);
  const auto turn = [&](const Eigen::Quaterniond& from, double from_s, double to_s) {
    // In steps so small that the mean rate is enough.
    Eigen::Quaterniond R = from;
    const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(to_s - from_s) / 0.01)));
    const double h = (to_s - from_s) / steps;
    for (int s = 0; s < steps && h != 0; ++s) {
      const double a = from_s + s * h;
      const Vector3d rate = h > 0 ? gyro.between(a, a + h) : gyro.between(a + h, a);
      R = so3::boxplus(R, (rate - start.gyroscope_bias) * h);
    }
    return R;
  };
  Vector3d force = Vector3d::Zero();
  std::size_t next = 0;
  const double step = plan.grid.spacing_s / 2;
  for (double t = plan.grid.start_s; t <= plan.grid.end_s(); t += step) {
    while (next < frame_times.size() && frame_times[next] <= t) ++next;
    Eigen::Quaterniond R;
    if (next == 0) {
      R = turn(R_frame.front(), frame_times.front(), t);
    } else if (next == frame_times.size()) {
      R = turn(R_frame.back(), frame_times.back(), t);
    } else {
      const double from = frame_times[next - 1];
      const double to = frame_times[next];
      const Vector3d left = so3::boxminus(R_frame[next], turn(R_frame[next - 1], from, to));
      R = so3::boxplus(turn(R_frame[next - 1], from, t), (t - from) / (to - from) * left);
    }
    times.push_back(t);
    poses.push_back({R, Vector3d::Zero()});
  }
  state.rotations = calib::fit_rotations(plan.grid, times, poses, kStartSmoothing);
  state.positions = calib::fit_vectors(plan.grid, frame_times, positions, kStartSmoothing);
  state.biases = Eigen::MatrixXd::Zero(6, plan.bias_knots());
  state.biases.topRows(3).colwise() = start.gyroscope_bias;
  state.R_camera_imu = start.R_camera_imu;
  state.offset_s = start.time_offset_s;
  const RotationSpline rotation(plan.grid, state.rotations);
  for (const ImuRow& row : recording.imu) force += rotation.at(row.t_s).rotation * row.accel;
  state.gravity = -force.normalized() * gravity;
  return state;
}

class Solver {
 public:
  Solver(const CameraImuProblem& problem, const CameraImuOptions& options, CameraImuFit& fit)
      : problem_(problem), options_(options), fit_(fit), system_(problem.layout()) {}

  ChainSystem& system() { return system_; }

  /// Levenberg and Marquardt; damping by the gain ratio after Nielsen 1999. @returns the cost; the system is that of
  /// the state that it leaves.
  double run(CameraImuState& state) {
    double damping = 1e-8;
    double growth = 2;
    double cost = problem_.evaluate(state, &system_).total();
    ChainStep step;
    fit_.converged = false;
    for (int i = 0; i < options_.max_iterations; ++i) {
      ++fit_.iterations;
      if (!system_.solve(damping, step)) {
        damping = std::max(damping, 1e-8) * growth;
        growth *= 2;
        continue;
      }
      const CameraImuState next = problem_.stepped(state, step);
      const double next_cost = problem_.evaluate(next, nullptr).total();
      const double predicted = -0.5 * system_.slope(step) + 0.5 * damping * system_.damped_square(step);
      const double gain = (cost - next_cost) / std::max(predicted, 1e-300);
      const bool small = step.shared.segment<3>(calib::kTurn).norm() < 1e-7 &&
                         step.shared.segment<3>(calib::kShift).norm() < 1e-7 &&
                         std::abs(step.shared[calib::kOffset]) < 1e-8;
      if (gain > 0 || small) {
        state = next;
        const double old = cost;
        cost = problem_.evaluate(state, &system_).total();
        damping = std::max(damping * std::max(0.1, 1 - std::pow(2 * gain - 1, 3)), 1e-12);
        growth = 2;
        if (small && std::abs(old - cost) < 1e-6 * cost) {
          fit_.converged = true;
          break;
        }
      } else {
        damping *= growth;
        growth *= 2;
      }
      const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
      if (options_.progress && !options_.progress({fit_.iterations, cost, state.offset_s, elapsed})) {
        fit_.stopped = "interrupted";
        break;
      }
      if (options_.time_limit_s > 0 && elapsed > options_.time_limit_s) {
        fit_.stopped = "time limit";
        break;
      }
    }
    return cost;
  }

 private:
  const CameraImuProblem& problem_;
  const CameraImuOptions& options_;
  CameraImuFit& fit_;
  ChainSystem system_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

// Noise of the IMU's sensors and of each picture, as their residuals have it. The spline takes one in (spacing / dt) of
// the IMU's degrees of freedom. A picture's noise is drawn towards that of all, because it has few corners.
void adapt_noise(CameraImuProblem& problem, const CameraImuState& state, double dt, CameraImuFit& fit) {
  const Eigen::MatrixXd imu = problem.imu_residuals(state);
  const double left = std::sqrt(std::max(0.1, 1 - dt / problem.plan().grid.spacing_s));
  const auto deviation = [&](int row) {
    std::vector<double> values;
    for (Eigen::Index i = 0; i < imu.cols(); ++i) {
      for (int axis = 0; axis < 3; ++axis) values.push_back(imu(row + axis, i));
    }
    return robust_sigma(values) / left;
  };
  const double gyro = deviation(0);
  const double accel = deviation(3);
  problem.sigmas().gyro *= gyro;
  problem.sigmas().accel *= accel;
  fit.gyroscope_noise_scale *= gyro;
  fit.accelerometer_noise_scale *= accel;
  std::vector<double> all;
  const auto residuals = problem.corner_residuals(state);
  for (const Eigen::MatrixXd& r : residuals) {
    for (const double x : r.reshaped()) {
      if (std::isfinite(x)) all.push_back(x);
    }
  }
  const double common = robust_sigma(all);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    std::vector<double> own;
    for (const double x : residuals[i].reshaped()) {
      if (std::isfinite(x)) own.push_back(x);
    }
    const auto n = static_cast<double>(own.size());
    const double sigma = own.empty() ? common : robust_sigma(own);
    problem.frames()[i].sigma_px = std::max(
        std::sqrt((kCommonWeight * common * common + n * sigma * sigma) / (kCommonWeight + n)), kLeastCornerSigma);
  }
}

// What the deviations, the residuals and the start say together.
void judge(CameraImuFit& fit, std::size_t pictures) {
  Quality& q = fit.quality;
  if (!fit.converged) {
    q.lower_to(Verdict::kRefused, "The solution has not settled" +
                                      (fit.stopped.empty() ? std::string() : " (" + fit.stopped + ")") +
                                      ": give it more time, or a better recording.");
  }
  const double turn_deg = fit.sigma.head<3>().norm() * 180 / std::numbers::pi;
  const double shift_mm = 1e3 * fit.sigma.segment<3>(3).norm();
  const double time_ms = 1e3 * fit.sigma[6];
  const auto by_size = [&](double value, double fair, double warn, double refused, const std::string& text) {
    if (value < fair) return;
    const Verdict verdict = value < warn ? Verdict::kFair : value < refused ? Verdict::kWarn : Verdict::kRefused;
    q.lower_to(verdict, text);
  };
  const std::string more = ": turn the rig faster and about all axes, and record for longer.";
  by_size(turn_deg, 0.1, 0.3, 1, "The deviation of the rotation is " + to_text(turn_deg, 2) + " deg" + more);
  by_size(shift_mm, 2, 5, 20, "The deviation of the translation is " + to_text(shift_mm, 2) + " mm" + more);
  by_size(time_ms, 0.1, 0.5, 5, "The deviation of the offset is " + to_text(time_ms, 2) + " ms" + more);
  if (fit.start.second_correlation > kAlikePeaks * fit.start.correlation) {
    q.lower_to(Verdict::kWarn, "The turn rates agree nearly as well at another offset (correlation " +
                                   to_text(fit.start.second_correlation, 2) + " against " +
                                   to_text(fit.start.correlation, 2) + "): move less regularly.");
  }
  const double noise = std::max(fit.gyroscope_noise_scale, fit.accelerometer_noise_scale);
  if (noise > kDoubtfulNoise) {
    q.lower_to(Verdict::kFair, "The IMU is " + to_text(noise, 2) +
                                   " times as noisy as its densities say: check them and the units, or take a closer "
                                   "knot spacing if it was shaken.");
  }
  const double blocks = (fit.sigma_by_blocks.array() / fit.sigma_by_noise.array()).maxCoeff();
  if (blocks > kPulledApart) {
    q.lower_to(Verdict::kFair, "Parts of the recording pull apart " + to_text(blocks, 2) +
                                   " times more than noise can (blurred pictures, the lens at the image's edge, "
                                   "coloured residuals of the IMU); the deviations take that into account.");
  }
  const auto used = static_cast<std::size_t>(std::ranges::count_if(fit.views, &CameraImuView::used));
  if (2 * used < pictures) {
    q.lower_to(Verdict::kFair, "Only " + std::to_string(used) + " of " + std::to_string(pictures) +
                                   " pictures could be used: the reason stands with each.");
  }
}

}  // namespace

void CameraImuOptions::check() const {
  require(order >= kMinSplineOrder && order <= kMaxSplineOrder, "order", order, "must be in [3, 8]");
  require_not_negative("knot_spacing_s", knot_spacing_s);
  require_positive("bias_spacing_s", bias_spacing_s);
  require_positive("corner_sigma_px", corner_sigma_px);
  require_positive("loss_sigmas", loss_sigmas);
  require_positive("gravity", gravity);
  if (time_offset_s) require_finite("time_offset_s", *time_offset_s);
  require(max_iterations > 0, "max_iterations", max_iterations, "must be positive");
  require_not_negative("time_limit_s", time_limit_s);
}

CameraImuFit calibrate_camera_imu(const CalibrationTarget& target, std::span<const TargetView> views,
                                  const CameraCalibration& camera, std::span<const ImuMeasurement> imu,
                                  const ImuNoise& noise, const CameraImuOptions& options) {
  options.check();
  target.check();
  CameraImuFit fit;
  const double begin_cpu = cpu_s();
  Recording recording = read(target, views, camera, imu, options, fit);
  auto found = calib::find_start(recording.poses, recording.imu, options.time_offset_s);
  if (!found.start) throw DataError(found.failure);
  fit.start = *found.start;
  // What both have seen, and a little more of the IMU.
  const double d = fit.start.time_offset_s;
  const double begin = std::max(recording.imu.front().t_s, recording.frames.front().t_s + d - kMargin);
  const double end = std::min(recording.imu.back().t_s, recording.frames.back().t_s + d + kMargin);
  std::erase_if(recording.imu, [&](const ImuRow& row) { return row.t_s < begin || row.t_s > end; });
  std::vector<FrameRow> frames;
  std::vector<CameraPoseSample> poses;
  std::vector<std::size_t> view_of;
  for (std::size_t i = 0; i < recording.frames.size(); ++i) {
    const double t = recording.frames[i].t_s + d;
    if (t < begin + kInside || t > end - kInside) {
      fit.views[recording.view_of[i]].reason = "no IMU samples at its time";
      continue;
    }
    frames.push_back(std::move(recording.frames[i]));
    poses.push_back(recording.poses[i]);
    view_of.push_back(recording.view_of[i]);
  }
  recording.poses = poses;
  const double dt =
      (recording.imu.back().t_s - recording.imu.front().t_s) / static_cast<double>(recording.imu.size() - 1);
  const double spacing = options.knot_spacing_s > 0 ? options.knot_spacing_s : 4 * dt;
  const calib::ChainPlan plan = calib::plan_chain(begin, end, spacing, options.order, options.bias_spacing_s);
  fit.knot_spacing_s = plan.grid.spacing_s;
  const DiscreteImuNoise sample = discretise(noise, dt);
  const DiscreteImuNoise knot = discretise(noise, plan.bias_spacing_s());
  CameraImuState state = first_state(recording, plan, fit.start, options.gravity);
  fit.start.gravity_target = state.gravity;
  CameraImuProblem problem(Camera(camera), recording.imu, frames,
                           {sample.sigma_angular_velocity, sample.sigma_specific_force, knot.sigma_gyroscope_bias_step,
                            knot.sigma_accelerometer_bias_step},
                           options.loss_sigmas, plan);
  fit.start_cpu_s = cpu_s() - begin_cpu;

  const double solve_begin = cpu_s();
  Solver solver(problem, options, fit);
  double cost = solver.run(state);
  if (options.adapt_noise) {
    for (int round = 0; round < kNoiseRounds && fit.stopped.empty(); ++round) {
      adapt_noise(problem, state, dt, fit);
      cost = solver.run(state);
    }
  }
  ChainSystem& system = solver.system();
  ChainStep step;
  if (!system.solve(0, step)) throw DataError("the recording does not determine the calibration");
  fit.covariance = system.shared_covariance().topLeftCorner<7, 7>();
  fit.sigma_by_noise = fit.covariance.diagonal().cwiseSqrt();
  const int groups = std::clamp(plan.windows / 3, 1, 24);
  std::vector<int> group;
  for (int w = 0; w < plan.windows; ++w) group.push_back(w * groups / plan.windows);
  const Eigen::MatrixXd pulls = system.shared_covariance() * system.shared_pulls(group, groups);
  fit.sigma_by_blocks = pulls.topRows<7>().rowwise().norm() * std::sqrt(groups / std::max(1.0, groups - 1.0));
  fit.sigma = fit.sigma_by_noise.cwiseMax(fit.sigma_by_blocks);
  fit.cost = cost;
  fit.T_camera_imu = {state.R_camera_imu, state.t_camera_imu};
  fit.time_offset_s = state.offset_s;
  fit.gravity_target = state.gravity;
  const Eigen::MatrixXd residuals = problem.imu_residuals(state);
  fit.gyroscope_chi = std::sqrt(residuals.topRows(3).squaredNorm() / static_cast<double>(3 * residuals.cols()));
  fit.accelerometer_chi = std::sqrt(residuals.bottomRows(3).squaredNorm() / static_cast<double>(3 * residuals.cols()));
  const auto corners = problem.corner_residuals(state);
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    CameraImuView& view = fit.views[view_of[i]];
    view.used = true;
    view.rms_px = std::sqrt(corners[i].squaredNorm() / static_cast<double>(corners[i].cols()));
    view.sigma_px = problem.frames()[i].sigma_px;
    sum += corners[i].squaredNorm() / (view.sigma_px * view.sigma_px);
    count += static_cast<double>(corners[i].size());
  }
  fit.corner_chi = std::sqrt(sum / count);
  judge(fit, views.size());
  fit.solve_cpu_s = cpu_s() - solve_begin;
  return fit;
}

}  // namespace loc
