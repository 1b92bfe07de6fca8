// The camera-IMU calibration on EuRoC's recording of an AprilGrid (72 s, corners and IMU are at hand) against EuRoC's
// own T_BS, Basalt's published translation and itself: shifted, in thirds, with other options.
//   compare_camera_imu_euroc [--only=WORD,…]      whole, shift, thirds, options
// Recording: euroc-cam-imu-calibration in $LIBLOC_DATA, or in shared/data beside the project's folder; without it it
// says so and ends with 0. Exit code 1: a figure is beyond its bar.
// Intrinsics are EuRoC's and come without deviations; the calibration takes what it takes for such.
#include <sys/resource.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "bar_table.hpp"
#include "libloc/calib/camera_imu.hpp"
#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"
#include "support/data.hpp"

namespace loc {
namespace {

using bench::BarTable;

constexpr double kDeg = 57.29577951308232;
constexpr TimeNs kShifts[] = {37'123'000, -1'500'000'000};

struct Recording {
  CalibrationTarget target = parse_target("aprilgrid 6x6 0.088 0.3");
  CameraRecording camera;
  std::vector<ImuMeasurement> imu;
  ImuNoise noise;
};

std::vector<std::string> cells_of(const std::string& line, std::size_t count, const std::filesystem::path& file) {
  std::vector<std::string> cells;
  std::stringstream text(line);
  for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
  if (cells.size() < count) throw DataError(file.string() + ": '" + line + "': too few columns");
  return cells;
}

Recording read(const std::filesystem::path& folder) {
  Recording out;
  CameraCalibration& camera = out.camera.camera;
  camera.name = "cam0";
  camera.width_px = 752;
  camera.height_px = 480;
  camera.intrinsics_px = {458.654, 457.296, 367.215, 248.375};
  camera.distortion_model = DistortionModel::kRadtan;
  camera.distortion = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  out.noise.gyroscope_noise_density = 1.6968e-4;
  out.noise.accelerometer_noise_density = 2e-3;
  out.noise.gyroscope_random_walk = 1.9393e-5;
  out.noise.accelerometer_random_walk = 3e-3;
  std::string line;
  const std::filesystem::path corners = folder / "cam0_corners.csv";
  std::ifstream corner_file(corners);
  std::getline(corner_file, line);
  std::vector<TargetView>& views = out.camera.views;
  while (std::getline(corner_file, line)) {
    const std::vector<std::string> cell = cells_of(line, 5, corners);
    const TimeNs time = std::stoll(cell[0]);
    if (views.empty() || views.back().time_ns != time) views.push_back({time, {}});
    views.back().corners.push_back(
        {4 * std::stoi(cell[1]) + std::stoi(cell[2]), {std::stod(cell[3]), std::stod(cell[4])}});
  }
  const std::filesystem::path imu = folder / "imu0.csv";
  std::ifstream imu_file(imu);
  std::getline(imu_file, line);
  while (std::getline(imu_file, line)) {
    const std::vector<std::string> cell = cells_of(line, 7, imu);
    ImuMeasurement sample;
    sample.time_ns = std::stoll(cell[0]);
    for (int i = 0; i < 3; ++i) {
      sample.angular_velocity[i] = std::stod(cell[static_cast<std::size_t>(1 + i)]);
      sample.specific_force[i] = std::stod(cell[static_cast<std::size_t>(4 + i)]);
    }
    out.imu.push_back(sample);
  }
  return out;
}

CameraImuFit calibrate(const Recording& recording, const CameraRecording& camera,
                       const CameraImuOptions& options = {}) {
  return calibrate_camera_imu(recording.target, std::vector<CameraRecording>{camera}, recording.imu, recording.noise,
                              options);
}

struct Distances {
  double turn_deg, euroc_mm, basalt_mm;
};
Distances distances_of(const CameraImuCamera& camera) {
  Eigen::Matrix4d T_BS;
  T_BS << 0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975, 0.999557249008, 0.0149672133247,
      0.025715529948, -0.064676986768, -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949, 0, 0, 0, 1;
  const Pose3 euroc = Pose3::from_matrix(T_BS);
  const Eigen::Vector3d basalt(-16.77, -68.94, 5.14);
  const Pose3 found = camera.T_camera_imu.inverse();
  return {kDeg * so3::angle_between(found.rotation, euroc.rotation),
          1e3 * (found.translation - euroc.translation).norm(), (1e3 * found.translation - basalt).norm()};
}

void print(const char* what, const Vector7d& sigma) {
  std::printf("    %-22s %.4f %.4f %.4f deg  %.3f %.3f %.3f mm  %.2f us\n", what, kDeg * sigma[0], kDeg * sigma[1],
              kDeg * sigma[2], 1e3 * sigma[3], 1e3 * sigma[4], 1e3 * sigma[5], 1e6 * sigma[6]);
}

void print(const CameraImuFit& fit) {
  const CameraImuCamera& camera = fit.cameras[0];
  const Eigen::Vector3d t = 1e3 * camera.T_camera_imu.inverse().translation;
  std::printf("  T_imu_camera %.2f %.2f %.2f mm, offset %.2f us; %d iterations%s%s\n", t[0], t[1], t[2],
              1e6 * camera.time_offset_s, fit.iterations,
              fit.converged ? "" : ", not converged: ", fit.stopped.c_str());
  print("sigma", camera.sigma);
  print("  by noise", camera.sigma_by_noise);
  print("  by blocks", camera.sigma_by_blocks);
  print("  by intrinsics", camera.sigma_by_intrinsics);
  std::printf("    chi: gyroscope %.3f, accelerometer %.3f, corners %.3f; knots %.4f s\n", fit.gyroscope_chi,
              fit.accelerometer_chi, camera.corner_chi, fit.knot_spacing_s);
}

double peak_mb() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  return static_cast<double>(use.ru_maxrss) / 1024;
}

void whole(const CameraImuFit& fit, BarTable& table) {
  std::printf("whole recording\n");
  print(fit);
  std::printf("  verdict %s\n", verdict_name(fit.quality.verdict));
  for (const std::string& reason : fit.quality.reasons) std::printf("    - %s\n", reason.c_str());
  const Distances far = distances_of(fit.cameras[0]);
  table.at_most("turn against EuRoC's T_BS [deg]", far.turn_deg, 0.5);
  table.at_most("translation against EuRoC's T_BS [mm]", far.euroc_mm, 10);
  table.at_most("translation against Basalt's [mm]", far.basalt_mm, 3);
  table.at_most("CPU of start and solution [s]", fit.start_cpu_s + fit.solve_cpu_s, 9);
  table.at_most("largest memory so far, recording included [MB]", peak_mb(), 500);
}

void shifted(const Recording& recording, const CameraImuCamera& base, BarTable& table) {
  std::printf("shift: camera's stamps moved\n");
  for (const TimeNs shift : kShifts) {
    CameraRecording moved = recording.camera;
    for (TargetView& view : moved.views) view.time_ns += shift;
    const CameraImuCamera found = calibrate(recording, moved).cameras[0];
    std::printf("  %+.3f ms: offset %.3f ms; translation moved %.2e mm\n", 1e-6 * static_cast<double>(shift),
                1e3 * found.time_offset_s,
                1e3 * (found.T_camera_imu.translation - base.T_camera_imu.translation).norm());
    table.at_most("offset against the unshifted [us]",
                  1e6 * std::abs(found.time_offset_s + to_seconds(shift) - base.time_offset_s), 1);
  }
}

// Differences to the first piece against what the deviations say of them; in the degrees of freedom 1 is right.
// together: what the intrinsics do is common to the pieces; otherwise each sigma is taken as one of its own.
double reduced_chi_square(const std::vector<CameraImuCamera>& pieces, int first, int size, bool together) {
  const auto m = static_cast<Eigen::Index>(pieces.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(7 * m, 7 * m);
  Eigen::VectorXd x(7 * m);
  for (Eigen::Index p = 0; p < m; ++p) {
    const CameraImuCamera& a = pieces[static_cast<std::size_t>(p)];
    x.segment<7>(7 * p) << so3::boxminus(a.T_camera_imu.rotation, pieces[0].T_camera_imu.rotation),
        a.T_camera_imu.translation - pieces[0].T_camera_imu.translation, a.time_offset_s;
    covariance.block<7, 7>(7 * p, 7 * p) = a.covariance;
    if (!together) continue;
    for (Eigen::Index q = 0; q < m; ++q) {
      if (q == p) continue;
      const CameraImuCamera& b = pieces[static_cast<std::size_t>(q)];
      covariance.block<7, 7>(7 * p, 7 * q) =
          a.by_intrinsics * a.intrinsics_sigma.cwiseAbs2().asDiagonal() * b.by_intrinsics.transpose();
    }
  }
  Eigen::MatrixXd by = Eigen::MatrixXd::Zero(size * (m - 1), 7 * m);
  for (Eigen::Index p = 1; p < m; ++p) {
    for (int i = 0; i < size; ++i) {
      by(size * (p - 1) + i, 7 * p + first + i) = 1;
      by(size * (p - 1) + i, first + i) = -1;
    }
  }
  const Eigen::VectorXd d = by * x;
  return d.dot((by * covariance * by.transpose()).ldlt().solve(d)) / static_cast<double>(d.size());
}

void thirds(const Recording& recording, BarTable& table) {
  std::printf("thirds\n");
  std::vector<CameraImuCamera> pieces;
  const std::vector<TargetView>& views = recording.camera.views;
  for (std::size_t p = 0; p < 3; ++p) {
    const auto at = [&](std::size_t third) {
      return views.begin() + static_cast<std::ptrdiff_t>(third * views.size() / 3);
    };
    const CameraImuFit fit = calibrate(recording, {recording.camera.camera, {at(p), at(p + 1)}});
    print(fit);
    pieces.push_back(fit.cameras[0]);
  }
  double turn = 0;
  Eigen::Array4d low = Eigen::Array4d::Constant(1e9);
  Eigen::Array4d high = -low;
  for (const CameraImuCamera& a : pieces) {
    for (const CameraImuCamera& b : pieces) {
      turn = std::max(turn, kDeg * so3::angle_between(a.T_camera_imu.rotation, b.T_camera_imu.rotation));
    }
    Eigen::Array4d one;
    one << 1e3 * a.T_camera_imu.translation.array(), 1e6 * a.time_offset_s;
    low = low.min(one);
    high = high.max(one);
  }
  table.at_most("spread: turn between two [deg]", turn, 0.1);
  for (int i = 0; i < 3; ++i) table.at_most("spread: component of the translation [mm]", high[i] - low[i], 4);
  table.at_most("spread: offset [us]", high[3] - low[3], 90);
  table.between("reduced chi^2 by sigma: offset", reduced_chi_square(pieces, 6, 1, false), 0.3, 2.5);
  table.between("reduced chi^2 by sigma: translation", reduced_chi_square(pieces, 3, 3, false), 0.3, 2.5);
  table.between("reduced chi^2 by sigma: turn", reduced_chi_square(pieces, 0, 3, false), 0.3, 2.5);
  BarTable::figure("  with common intrinsics: offset", reduced_chi_square(pieces, 6, 1, true));
  BarTable::figure("  with common intrinsics: translation", reduced_chi_square(pieces, 3, 3, true));
  BarTable::figure("  with common intrinsics: turn", reduced_chi_square(pieces, 0, 3, true));
}

// What is asked besides, and what it does to the mounting.
void with_options(const Recording& recording, const CameraImuCamera& base) {
  struct Case {
    const char* name;
    CameraImuOptions options;
  };
  std::vector<Case> cases(7);
  cases[0].name = "intrinsics refined";
  cases[0].options.refine_intrinsics = true;
  cases[1].name = "order 4";
  cases[1].options.order = 4;
  cases[2].name = "three angles";
  cases[2].options.rotation = RotationForm::kThreeAngles;
  cases[3].name = "IMU matrices";
  cases[3].options.estimate_imu_matrices = true;
  cases[4].name = "gravity's size";
  cases[4].options.estimate_gravity = true;
  cases[5].name = "drift";
  cases[5].options.estimate_drift = true;
  cases[6].name = "noise as given";
  cases[6].options.adapt_noise = false;
  for (const Case& one : cases) {
    const CameraImuFit fit = calibrate(recording, recording.camera, one.options);
    const CameraImuCamera& camera = fit.cameras[0];
    const Distances far = distances_of(camera);
    std::printf("options: %s\n", one.name);
    print(fit);
    std::printf("  against the usual: turn %.4f deg, translation %.3f mm, offset %.2f us; CPU %.2f s\n",
                kDeg * so3::angle_between(camera.T_camera_imu.rotation, base.T_camera_imu.rotation),
                1e3 * (camera.T_camera_imu.translation - base.T_camera_imu.translation).norm(),
                1e6 * (camera.time_offset_s - base.time_offset_s), fit.start_cpu_s + fit.solve_cpu_s);
    std::printf("  against EuRoC's %.3f deg, %.2f mm; Basalt's %.2f mm\n", far.turn_deg, far.euroc_mm, far.basalt_mm);
    if (one.options.refine_intrinsics) {
      std::printf("  change of fx fy cx cy:");
      for (int i = 0; i < 4; ++i) std::printf(" %.2f +- %.2f", camera.intrinsics_change[i], camera.intrinsics_sigma[i]);
      std::printf(" px\n");
    }
    if (fit.gravity_size.estimated) {
      std::printf("  gravity %.4f +- %.4f m/s^2\n", fit.gravity_size.value, fit.gravity_size.sigma);
    }
    if (camera.offset_drift.estimated) {
      std::printf("  drift %.2f +- %.2f us/s\n", 1e6 * camera.offset_drift.value, 1e6 * camera.offset_drift.sigma);
    }
    std::fflush(stdout);
  }
}

int run(const bench::RowChoice& choice) {
  const std::filesystem::path folder = test::data_folder() / "euroc-cam-imu-calibration";
  if (!std::filesystem::exists(folder)) {
    std::printf("skipped: %s is absent; LIBLOC_DATA names the folder of the recordings\n", folder.c_str());
    return 0;
  }
  const Recording recording = read(folder);
  BarTable table;
  const CameraImuFit base = calibrate(recording, recording.camera);
  if (choice.has("whole")) whole(base, table);
  if (choice.has("shift")) shifted(recording, base.cameras[0], table);
  if (choice.has("thirds")) thirds(recording, table);
  if (choice.has("options")) with_options(recording, base.cameras[0]);
  std::printf("%d FAILED\n", table.failed());
  return table.failed() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace loc

int main(int argc, char** argv) {
  try {
    return loc::run(loc::bench::RowChoice(argc, argv, {"whole", "shift", "thirds", "options"}));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "compare_camera_imu_euroc: %s\n", error.what());
    return 2;
  }
}
