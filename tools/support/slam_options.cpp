#include "tools/support/slam_options.hpp"

#include <CLI/CLI.hpp>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <vector>

#include "libloc/core/check.hpp"
#include "libloc/io/ply.hpp"
#include "libloc/io/slam_yaml.hpp"
#include "msgs/slam_file.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr const char* kMono = "mono-slam";
constexpr const char* kInertial = "inertial-slam";

PlyPoint ply_point(const SlamMapPoint& point) {
  PlyPoint out;
  out.position = point.position;
  // A PLY int has 32 bit.
  const bool fits = std::in_range<std::int32_t>(point.id);
  out.id = fits ? point.id : -1;
  out.sigma = kUnknown;
  if (point.position_cov.allFinite()) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(point.position_cov, Eigen::EigenvaluesOnly);
    out.sigma = std::sqrt(std::max(0.0, solver.eigenvalues().maxCoeff()));
  }
  return out;
}

std::string world_of_map(const SlamFilter& filter, const MapAnchor* anchor) {
  if (anchor != nullptr && anchor->anchored()) {
    const GeodeticPoint& origin = anchor->world()->origin();
    return "east, north, up [m] of latitude " + to_text(origin.latitude * 180 / std::numbers::pi, 11) +
           " deg, longitude " + to_text(origin.longitude * 180 / std::numbers::pi, 11) + " deg, altitude " +
           to_text(origin.altitude, 9) + " m";
  }
  const bool metres = filter.options().motion == SlamMotion::kInertial || !filter.options().landmarks.empty();
  return metres ? "world, z up [m]" : "world of the camera's start, unit of its own";
}

}  // namespace

void add_slam_options(CLI::App& app, SlamArguments& arguments) {
  arguments.config_option = app.add_option("--slam-config", arguments.config,
                                           "mono-slam, inertial-slam: settings (slam.yaml, names as in SlamOptions)")
                                ->check(CLI::ExistingFile);
  arguments.map_in_option = app.add_option("--map-in", arguments.map_in, "SLAM: go on from what --map-out has saved")
                                ->check(CLI::ExistingFile);
  arguments.map_out_option = app.add_option(
      "--map-out", arguments.map_out, "SLAM: at the end, save map and state to go on from; *.ply: points, for viewers");
  arguments.camera_option =
      app.add_option("--camera", arguments.camera, "SLAM: index in the rig of the camera")->check(CLI::Range(0, 1000));
  arguments.images_option = app.add_flag("--images", arguments.images,
                                         "SLAM: features are found in the camera's pictures; tracks are left aside");
}

bool is_slam(const std::string& method) {
  return method == kMono || method == kInertial;
}

SlamOptions slam_options(const SlamArguments& arguments, const std::string& method, const Rig& rig) {
  const SlamMotion motion = method == kInertial ? SlamMotion::kInertial : SlamMotion::kConstantVelocity;
  SlamOptions options;
  options.motion = motion;
  if (arguments.images) options = slam_options_for_images(options);
  if (rig.imu && !rig.imu->noise_measured.empty()) options.imu_noise = rig.imu->noise;
  if (!arguments.config.empty()) {
    try {
      options = read_slam_options(arguments.config, options);
    } catch (const DataError& error) {
      throw UsageError(error.what());
    }
    if (options.motion != motion) {
      throw UsageError(arguments.config + ": motion is another one than that of --method " + method);
    }
  }
  if (arguments.camera) options.camera_index = *arguments.camera;
  if (options.camera_index < 0 || static_cast<std::size_t>(options.camera_index) >= rig.cameras.size()) {
    throw UsageError("--method " + method + " needs the calibration of camera " + std::to_string(options.camera_index) +
                     "; the rig has " + std::to_string(rig.cameras.size()) + " cameras (--config)");
  }
  options.camera = rig.cameras[static_cast<std::size_t>(options.camera_index)];
  options.check();
  return options;
}

std::optional<SlamSnapshot> slam_start(const SlamArguments& arguments, const SlamOptions& options) {
  if (arguments.map_in.empty()) return std::nullopt;
  try {
    SlamFile file = load_slam(arguments.map_in);
    const std::string why = why_not_restorable(file, options);
    if (!why.empty()) throw UsageError("--map-in " + arguments.map_in + ": " + why);
    log_info(R"(event=map_read file="{}" features={} time={})", arguments.map_in, file.snapshot.landmarks.size(),
             format_seconds(file.snapshot.time_ns));
    return std::move(file.snapshot);
  } catch (const DataError& error) {
    throw UsageError(error.what());
  }
}

bool write_map(const SlamArguments& arguments, const SlamFilter* filter, const MapAnchor* anchor) {
  if (arguments.map_out.empty()) return true;
  if (filter == nullptr) {
    log_error(R"(event=no_map file="{}" reason="the filter has not started")", arguments.map_out);
    return false;
  }
  if (std::filesystem::path(arguments.map_out).extension() != ".ply") {
    const SlamSnapshot snapshot = filter->snapshot();
    save_slam(arguments.map_out, snapshot, filter->options());
    log_info(R"(event=map_written file="{}" features={} time={})", arguments.map_out, snapshot.landmarks.size(),
             format_seconds(snapshot.time_ns));
    return true;
  }
  std::vector<PlyPoint> points;
  for (SlamMapPoint point : filter->map()) {
    if (anchor != nullptr) anchor->put_in_world(point);
    points.push_back(ply_point(point));
  }
  const std::int64_t left_out = write_ply(arguments.map_out, points, {world_of_map(*filter, anchor)});
  log_info(R"(event=map_written file="{}" points={} left_out={})", arguments.map_out,
           static_cast<std::int64_t>(points.size()) - left_out, left_out);
  return true;
}

}  // namespace loc
