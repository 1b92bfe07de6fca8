#include "libloc/calib/camera_imu.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <map>
#include <utility>

#include "libloc/calib/camera_bundle.hpp"
#include "libloc/calib/camera_imu_first_state.hpp"
#include "libloc/calib/camera_imu_judge.hpp"
#include "libloc/calib/camera_imu_knots.hpp"
#include "libloc/calib/camera_imu_problem.hpp"
#include "libloc/calib/camera_imu_start.hpp"
#include "libloc/calib/camera_imu_views.hpp"
#include "libloc/calib/least_squares.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/statistics.hpp"

namespace loc {
namespace {

using calib::CameraImuProblem;
using calib::CameraImuRecording;
using calib::CameraImuState;
using calib::ChainStep;
using calib::ChainSystem;
using calib::FrameRow;
using calib::ImuRow;
using calib::SharedLayout;

constexpr double kSmallDamping = 1e-3;  // beyond, a step is small because it was held back
constexpr int kNoiseRounds = 2;
constexpr double kCommonWeight = 20;        // coordinates of corners that the common noise counts for
constexpr double kLeastCornerSigma = 0.01;  // [px]
constexpr double kLineBand = 8;             // [px] rows that are taken to be read at one time
constexpr int kCheckBands = 6;              // of an image, where the line delay is only looked at
constexpr int kWindowsPerGroup = 3;         // of those that pull together
constexpr int kLeastGroups = 8;
constexpr int kMostGroups = 24;
// Deviations of intrinsics that come without any: what two calibrations of one camera usually differ by.
constexpr double kUsualIntrinsicsSigma = 5e-4;  // of the focal length; of the principal point as a share of it
constexpr double kUsualDistortionSigma = 1e-3;
constexpr double kLeastPriorSigma = 1e-9;
constexpr const char* kMethod = "camera-imu";

double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

using Clock = std::chrono::steady_clock;

class Solver {
 public:
  /// @param origin_offset_s of the first camera: what is to be added to its offset @param begin of all the work
  Solver(const CameraImuProblem& problem, const SharedLayout& shared, const CameraImuOptions& options,
         double origin_offset_s, Clock::time_point begin, CameraImuFit& fit)
      : problem_(problem),
        shared_(shared),
        options_(options),
        origin_offset_s_(origin_offset_s),
        begin_(begin),
        fit_(fit),
        system_(problem.layout(shared)) {}

  /// Levenberg and Marquardt; damping by the gain ratio after Nielsen 1999. @returns the cost.
  double run(CameraImuState& state) {
    double damping = 1e-8;
    double growth = 2;
    double cost = problem_.linearise(state, shared_, system_).total();
    ChainStep step;
    fit_.converged = false;
    while (!fit_.converged && fit_.stopped.empty()) {
      if (fit_.iterations == options_.max_iterations) {
        fit_.stopped = std::to_string(options_.max_iterations) + " iterations";
        break;
      }
      ++fit_.iterations;
      const bool solved = system_.solve(damping, step) && step.shared.allFinite();
      if (!solved || !taken(state, step, damping, cost)) {
        damping = std::max(damping, 1e-8) * growth;
        growth *= 2;
      } else {
        growth = 2;
      }
      look_up(cost, state);
    }
    return cost;
  }

 private:
  // The step, when it does not raise the cost; then damping, cost and converged are those behind it.
  bool taken(CameraImuState& state, const ChainStep& step, double& damping, double& cost) {
    const CameraImuState next = problem_.stepped(state, shared_, step);
    const double next_cost = problem_.cost(next).total();
    const double predicted = -0.5 * system_.slope(step) + 0.5 * damping * system_.damped_square(step);
    const double gain = (cost - next_cost) / std::max(predicted, 1e-300);
    const bool small =
        damping <= kSmallDamping && std::ranges::all_of(shared_.cameras, [&](const SharedLayout::OfCamera& c) {
          return step.shared.segment<3>(c.first + calib::kTurn).norm() < 1e-7 &&
                 step.shared.segment<3>(c.first + calib::kShift).norm() < 1e-7 &&
                 std::abs(step.shared[c.first + calib::kOffset]) < 1e-8;
        });
    if (!(gain > 0) && !small) return false;
    state = next;
    const double old = std::exchange(cost, problem_.linearise(state, shared_, system_).total());
    damping = std::max(damping * std::max(0.1, 1 - std::pow(2 * gain - 1, 3)), 1e-12);
    fit_.converged = small && std::abs(old - cost) < 1e-6 * cost;
    return true;
  }

  void look_up(double cost, const CameraImuState& state) {
    if (fit_.converged) return;
    const double elapsed = std::chrono::duration<double>(Clock::now() - begin_).count();
    const double offset = state.cameras.front().offset_s + origin_offset_s_;
    if (options_.progress && !options_.progress({fit_.iterations, cost, offset, elapsed})) {
      fit_.stopped = "interrupted";
    } else if (options_.time_limit_s > 0 && elapsed > options_.time_limit_s) {
      fit_.stopped = "time limit";
    }
  }

  const CameraImuProblem& problem_;
  const SharedLayout& shared_;
  const CameraImuOptions& options_;
  double origin_offset_s_;
  Clock::time_point begin_;
  CameraImuFit& fit_;
  ChainSystem system_;
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
  // By pictures: rows of one picture share its noise.
  struct OfPicture {
    std::vector<double> own;
    std::vector<FrameRow*> frames;
  };
  std::map<std::pair<std::size_t, std::size_t>, OfPicture> pictures;
  std::map<std::size_t, std::vector<double>> all;  // of each camera
  const auto residuals = problem.corner_residuals(state);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    FrameRow& frame = problem.frames()[i];
    OfPicture& picture = pictures[{frame.camera, frame.view}];
    picture.frames.push_back(&frame);
    for (const double x : residuals[i].reshaped()) {
      if (!std::isfinite(x)) continue;
      picture.own.push_back(x);
      all[frame.camera].push_back(x);
    }
  }
  std::map<std::size_t, double> common;
  for (const auto& [camera, values] : all) common[camera] = robust_sigma(values);
  for (auto& [key, picture] : pictures) {
    const double usual = common[key.first];
    const auto n = static_cast<double>(picture.own.size());
    const double sigma = picture.own.empty() ? usual : robust_sigma(picture.own);
    const double square = (kCommonWeight * usual * usual + n * sigma * sigma) / (kCommonWeight + n);
    for (FrameRow* frame : picture.frames) frame->sigma_px = std::max(std::sqrt(square), kLeastCornerSigma);
  }
}

void find_starts(const CalibrationTarget& target, const CameraImuOptions& options, CameraImuRecording& recording,
                 std::span<const CameraRecording> cameras, CameraImuFit& fit) {
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    calib::unify_numbers(target, nullptr, nullptr, recording.cameras[c]);
    std::optional<double> given = options.time_offset_s;
    if (given) *given -= recording.cameras[c].origin_offset_s;
    auto found = calib::find_start(recording.cameras[c].poses, recording.imu, given);
    if (!found.start) {
      throw DataError((cameras.size() > 1 ? cameras[c].camera.name + ": " : std::string()) + found.failure);
    }
    fit.cameras[c].start = std::move(*found.start);
    const calib::GyroTurns gyro(recording.imu, fit.cameras[c].start.gyroscope_bias);
    calib::unify_numbers(target, &gyro, &fit.cameras[c].start, recording.cameras[c]);
  }
}

Vector8d sigma_of_intrinsics(const CameraCalibration& camera) {
  Vector8d out;
  const double focal = (camera.intrinsics_px[0] + camera.intrinsics_px[1]) / 2;
  out << Eigen::Vector4d::Constant(kUsualIntrinsicsSigma * focal), Eigen::Vector4d::Constant(kUsualDistortionSigma);
  if (!camera.intrinsics_quality) return out;
  const IntrinsicsQuality& q = *camera.intrinsics_quality;
  if (q.intrinsics_sigma_px.allFinite()) out.head<4>() = q.intrinsics_sigma_px;
  if (q.distortion_sigma.allFinite()) out.tail<4>() = q.distortion_sigma;
  return out;
}

double camera_period(const std::vector<FrameRow>& frames) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < frames.size(); ++i) steps.push_back(frames[i].t_s - frames[i - 1].t_s);
  return steps.empty() ? 0 : quantile(steps, 0.5);
}

// The normal equations twice (with their factors), and the weights of each sample.
void check_memory(const calib::ChainPlan& plan, const CameraImuRecording& recording, const CameraImuOptions& options) {
  const double unknowns = 6.0 * (plan.segments_per_window + plan.grid.order) + 6.0 * plan.biases_per_window;
  const double mb = 1e-6 * (2 * 8 * plan.windows * unknowns * unknowns +
                            2.0 * sizeof(SplineWeights) * static_cast<double>(recording.imu.size()));
  if (mb <= options.memory_limit_mb) return;
  throw DataError("the recording holds " + to_text(plan.grid.end_s() - plan.grid.start_s, 3) +
                  " s with pictures and samples, for which the solution needs about " + to_text(mb, 2) + " MB, and " +
                  to_text(options.memory_limit_mb) +
                  " are allowed (memory_limit_mb): a minute or two of brisk motion is enough, take a part of it");
}

// What a rig says of the cameras.
void put_qualities(const CameraImuOptions& options, CameraImuFit& fit) {
  for (CameraImuCamera& camera : fit.cameras) {
    const std::int64_t used = std::ranges::count_if(camera.views, &CameraImuView::used);
    MountingQuality mounting;
    mounting.verdict = fit.quality.verdict;
    mounting.reasons = fit.quality.reasons;
    mounting.method = kMethod;
    mounting.pictures = used;
    mounting.set_deviations(camera.camera.T_body_camera, camera.covariance);
    if (camera.line_delay_s.estimated) {
      mounting.line_delay_s = camera.line_delay_s.value;
      mounting.line_delay_sigma_s = camera.line_delay_s.sigma;
    }
    camera.camera.mounting_quality = mounting;
    if (!options.refine_intrinsics) continue;
    IntrinsicsQuality intrinsics;
    intrinsics.verdict = fit.quality.verdict;
    intrinsics.reasons = fit.quality.reasons;
    intrinsics.method = kMethod;
    intrinsics.pictures = used;
    intrinsics.intrinsics_sigma_px = camera.intrinsics_sigma.head<4>();
    intrinsics.distortion_sigma = camera.intrinsics_sigma.tail<4>();
    camera.camera.intrinsics_quality = intrinsics;
  }
}

// Equations at the solution for all unknowns that there could be.
calib::SharedEquations equations_of(const CameraImuProblem& problem, const CameraImuState& state,
                                    const calib::SharedChoice& choice, const CameraImuOptions& options) {
  calib::SharedEquations out;
  out.estimated = calib::shared_layout(state.cameras, choice);
  calib::SharedChoice all = choice;
  all.intrinsics = true;
  all.drift = true;
  all.gravity_size = true;
  all.target_scale = true;
  all.imu_matrices = true;
  all.line_delay = choice.line_delay || options.check_line_delay;
  out.all = calib::shared_layout(state.cameras, all);
  CameraImuProblem wide = problem;
  if (options.check_line_delay && !choice.line_delay) {
    std::vector<double> heights;
    for (const calib::CameraState& camera : state.cameras) heights.push_back(camera.camera.height_px);
    wide.frames() = calib::split_rows(problem.frames(), heights, kCheckBands);
  }
  ChainSystem system(wide.layout(out.all));
  wide.linearise(state, out.all, system);
  if (!system.reduce()) throw DataError("the recording does not determine the calibration");
  out.information = system.shared_information();
  const int windows = problem.plan().windows;
  const int groups = std::clamp(windows / kWindowsPerGroup, std::min(windows, kLeastGroups), kMostGroups);
  std::vector<int> group(static_cast<std::size_t>(windows));
  for (int w = 0; w < windows; ++w) group[static_cast<std::size_t>(w)] = w * groups / windows;
  out.pulls = system.shared_pulls(group, groups);
  return out;
}

void put_residuals(const CameraImuProblem& problem, const CameraImuState& state, const CameraImuRecording& recording,
                   double loss, CameraImuFit& fit) {
  fit.imu_residuals = problem.imu_residuals(state);
  const auto n = static_cast<double>(3 * fit.imu_residuals.cols());
  fit.gyroscope_chi = std::sqrt(fit.imu_residuals.topRows(3).squaredNorm() / n);
  fit.accelerometer_chi = std::sqrt(fit.imu_residuals.bottomRows(3).squaredNorm() / n);
  for (const ImuRow& row : problem.imu()) {
    fit.imu_time_ns.push_back(recording.time_of(row.t_s));
    fit.T_target_imu.push_back(problem.pose_at(state, row.t_s));
  }
  fit.biases = state.biases;
  for (int i = 0; i < problem.plan().bias_knots(); ++i) {
    fit.bias_time_ns.push_back(recording.time_of(problem.plan().bias_time_s(i)));
  }
  std::vector<double> chi_sum(fit.cameras.size(), 0.0);
  std::vector<double> chi_count(fit.cameras.size(), 0.0);
  const auto corners = problem.corner_residuals(state);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const FrameRow& frame = problem.frames()[i];
    CameraImuCamera& camera = fit.cameras[frame.camera];
    camera.views[frame.view].used = true;
    camera.views[frame.view].sigma_px = frame.sigma_px;
    for (std::size_t k = 0; k < frame.corners.size(); ++k) {
      const Eigen::Vector2d residual = -corners[i].col(static_cast<Eigen::Index>(k));
      const double s = residual.squaredNorm() / (frame.sigma_px * frame.sigma_px);
      camera.corners.push_back({static_cast<std::int32_t>(frame.view), frame.corners[k].id, frame.corners[k].pixel,
                                residual, std::isfinite(s) ? 1 / (1 + s / (loss * loss)) : 0});
      if (!std::isfinite(s)) continue;
      chi_sum[frame.camera] += loss * loss * std::log1p(s / (loss * loss));
      chi_count[frame.camera] += 2;
    }
  }
  for (std::size_t c = 0; c < fit.cameras.size(); ++c) {
    CameraImuCamera& camera = fit.cameras[c];
    camera.corner_chi = std::sqrt(chi_sum[c] / std::max(1.0, chi_count[c]));
    std::vector<double> squares(camera.views.size(), 0.0);
    std::vector<double> counts(camera.views.size(), 0.0);
    for (const CameraImuCorner& corner : camera.corners) {
      if (!corner.residual_px.allFinite()) continue;
      squares[static_cast<std::size_t>(corner.view)] += corner.residual_px.squaredNorm();
      counts[static_cast<std::size_t>(corner.view)] += 1;
    }
    for (std::size_t v = 0; v < squares.size(); ++v) {
      if (counts[v] > 0) camera.views[v].rms_px = std::sqrt(squares[v] / counts[v]);
    }
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
  require_positive("memory_limit_mb", memory_limit_mb);
}

CameraImuFit calibrate_camera_imu(const CalibrationTarget& target, std::span<const CameraRecording> cameras,
                                  std::span<const ImuMeasurement> imu, const ImuNoise& noise,
                                  const CameraImuOptions& options) {
  options.check();
  target.check();
  require(!cameras.empty(), "cameras", 0, "must be at least one");
  for (const CameraRecording& camera : cameras) camera.camera.check();
  // What has no noise would be an equation, not a measurement.
  require_positive("noise.gyroscope_noise_density", noise.gyroscope_noise_density);
  require_positive("noise.accelerometer_noise_density", noise.accelerometer_noise_density);
  require_positive("noise.gyroscope_random_walk", noise.gyroscope_random_walk);
  require_positive("noise.accelerometer_random_walk", noise.accelerometer_random_walk);
  CameraImuFit fit;
  const double begin_cpu = cpu_s();
  const Clock::time_point begin_time = Clock::now();
  CameraImuRecording recording = calib::read_recording(target, cameras, imu, options.corner_sigma_px, fit);
  for (std::size_t c = 0; c < cameras.size(); ++c) fit.cameras[c].camera = cameras[c].camera;
  find_starts(target, options, recording, cameras, fit);
  calib::keep_common(recording, fit);
  const double begin = recording.imu.front().t_s;
  const double end = recording.imu.back().t_s;
  const double dt = calib::sample_period(recording.imu);
  const calib::KnotChoice knots = calib::choose_knots(recording.imu, options.order, options.knot_spacing_s,
                                                      camera_period(recording.cameras.front().frames));
  require(knots.spacing_s >= dt, "knot_spacing_s", knots.spacing_s,
          "must not be less than from one IMU sample to the next (" + to_text(dt, 3) + " s)");
  const calib::ChainPlan plan = calib::plan_chain(begin, end, knots.spacing_s, options.order, options.bias_spacing_s);
  fit.knot_spacing_s = plan.grid.spacing_s;
  fit.knot_reason = knots.reason;
  check_memory(plan, recording, options);
  fit.bandwidth_hz = knots.bandwidth_hz;
  const DiscreteImuNoise sample = discretise(noise, dt);
  const DiscreteImuNoise knot = discretise(noise, plan.bias_spacing_s());
  std::vector<CameraImuStart> starts;
  for (const CameraImuCamera& camera : fit.cameras) starts.push_back(camera.start);
  const calib::GyroTurns gyro(recording.imu, starts.front().gyroscope_bias);
  const calib::RoughTrack track = calib::rough_track(target, starts, gyro, recording);
  CameraImuState state =
      calib::first_state(recording, track, gyro, plan, cameras, starts, options.rotation, options.gravity);
  std::vector<FrameRow> frames;
  std::vector<Vector8d> intrinsics_sigma;
  std::vector<calib::IntrinsicsPrior> priors;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const CameraCalibration& camera = cameras[c].camera;
    std::vector<FrameRow> own = std::move(recording.cameras[c].frames);
    if (options.estimate_line_delay) {
      const std::vector<double> heights(cameras.size(), camera.height_px);
      own = calib::split_rows(own, heights, static_cast<int>(std::ceil(camera.height_px / kLineBand)));
    }
    frames.insert(frames.end(), std::make_move_iterator(own.begin()), std::make_move_iterator(own.end()));
    intrinsics_sigma.push_back(sigma_of_intrinsics(camera));
    // Where nobody measured them, what they are taken to be is no measurement either.
    Vector8d prior = Vector8d::Constant(std::numeric_limits<double>::infinity());
    if (const auto& known = camera.intrinsics_quality) {
      const Vector8d sigma = intrinsics_sigma.back().cwiseMax(kLeastPriorSigma);
      if (known->intrinsics_sigma_px.allFinite()) prior.head<4>() = sigma.head<4>();
      if (known->distortion_sigma.allFinite()) prior.tail<4>() = sigma.tail<4>();
    }
    priors.push_back({calib::parameters_of(camera), prior});
  }
  CameraImuProblem problem(recording.imu, std::move(frames),
                           {sample.sigma_angular_velocity, sample.sigma_specific_force, knot.sigma_gyroscope_bias_step,
                            knot.sigma_accelerometer_bias_step},
                           options.loss_sigmas, plan);
  if (options.refine_intrinsics) problem.priors() = std::move(priors);
  for (int i = 0; i + 1 < plan.bias_knots(); ++i) {
    // Where a gap was closed, biases had longer to walk.
    const TimeNs between = recording.time_of(plan.bias_time_s(i + 1)) - recording.time_of(plan.bias_time_s(i));
    problem.bias_growth().push_back(std::sqrt(to_seconds(between) / plan.bias_spacing_s()));
  }
  fit.start_cpu_s = cpu_s() - begin_cpu;

  const double solve_begin = cpu_s();
  const calib::SharedChoice choice{.intrinsics = options.refine_intrinsics,
                                   .line_delay = options.estimate_line_delay,
                                   .drift = options.estimate_drift,
                                   .gravity_size = options.estimate_gravity,
                                   .imu_matrices = options.estimate_imu_matrices};
  const SharedLayout shared = calib::shared_layout(state.cameras, choice);
  {  // its matrices are large, and others of that size follow
    Solver solver(problem, shared, options, recording.cameras.front().origin_offset_s, begin_time, fit);
    fit.cost = solver.run(state);
    for (int round = 0; options.adapt_noise && round < kNoiseRounds && fit.stopped.empty(); ++round) {
      adapt_noise(problem, state, dt, fit);
      fit.cost = solver.run(state);
    }
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const calib::CameraState& found = state.cameras[c];
    CameraImuCamera& camera = fit.cameras[c];
    camera.T_camera_imu = {found.R_camera_imu, found.t_camera_imu};
    camera.time_offset_s = found.offset_s + recording.cameras[c].origin_offset_s;
    camera.camera = found.camera;
    camera.camera.T_body_camera = camera.T_camera_imu.inverse();
    camera.camera.time_offset_s = camera.time_offset_s;
    camera.start.time_offset_s += recording.cameras[c].origin_offset_s;
    for (double& offset : camera.start.curve.offset_s) offset += recording.cameras[c].origin_offset_s;
    if (options.refine_intrinsics) {
      camera.intrinsics_change = calib::parameters_of(found.camera) - calib::parameters_of(cameras[c].camera);
    }
  }
  fit.gravity_target = state.gravity;
  put_residuals(problem, state, recording, options.loss_sigmas, fit);
  const double length = to_seconds(recording.time_of(end) - recording.time_of(begin));
  calib::conclude(equations_of(problem, state, choice, options), state, options, intrinsics_sigma, knots.too_fast,
                  length, fit);
  put_qualities(options, fit);
  fit.solve_cpu_s = cpu_s() - solve_begin;
  return fit;
}

}  // namespace loc
