// Accuracy of the camera-IMU calibration on simulated recordings (support/waved_rig.hpp: 60 s, IMU 200 Hz, camera
// 20 Hz, 54 corners, 0.3 px, noise of a MEMS IMU), every one from a cold start.
//   compare_camera_imu [--only=WORD,…] [--seeds=N]
// Rows by name: nominal, exact, offset, start, order, angles, outliers, motion, short, axis, still, view, missing,
// cameras, line, drift, matrices, gravity, intrinsics. A seed draws motion and noise. Exit code 1: a figure is beyond
// its bar.
//   NEES       of the seven of a mounting (turn, translation, offset), by the covariance that the fit tells: 7 is
//   right.
//              Its mean over n seeds has the deviation sqrt(14 / n); bars are at 1.96 of them for the nominal row and
//              at 3 for the others, of which there are many
//   doubted    seeds whose verdict is warn or refused
//   refused    seeds that end with an error in place of a result
//   wrong      seeds that are neither, and have a component beyond 5 of its deviations
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "bar_table.hpp"
#include "libloc/calib/camera_imu.hpp"
#include "libloc/core/check.hpp"
#include "support/waved_rig.hpp"

namespace loc {
namespace {

using bench::BarTable;
using test::WavedRig;
using test::WavedRigOptions;

constexpr double kDeg = 57.29577951308232;
constexpr double kWrongSigmas = 5;

struct Row {
  std::string name;
  int seeds = 20;
  WavedRigOptions rig;
  CameraImuOptions options{};
  bool may_fail = false;                         ///< what matters is that nothing is confidently wrong
  std::function<void(WavedRig&, int)> change{};  ///< of the recording, before it is calibrated
  /// Of a further unknown: (found less true) over its deviation.
  std::function<double(const CameraImuFit&)> further{};
};

struct Sums {
  int answered = 0;
  int doubted = 0;
  int refused = 0;
  int wrong = 0;
  int mountings = 0;
  int inside = 0;
  double nees = 0;
  double largest_nees = 0;
  Vector7d square = Vector7d::Zero();
  Vector7d variance = Vector7d::Zero();
  double further = 0;
  double start_cpu = 0;
  double solve_cpu = 0;
  std::map<std::string, int> reasons;
};

Vector7d error_of(const CameraImuCamera& camera, const Pose3& T_camera_imu, double offset_s) {
  Vector7d out;
  out << so3::boxminus(T_camera_imu.rotation, camera.T_camera_imu.rotation),
      T_camera_imu.translation - camera.T_camera_imu.translation, offset_s - camera.time_offset_s;
  return out;
}

CameraImuFit calibrate(const WavedRig& rig, const CameraImuOptions& options, const ImuNoise& noise) {
  std::vector<CameraRecording> cameras = {{rig.camera, rig.views}};
  if (!rig.second_views.empty()) cameras.push_back({rig.second, rig.second_views});
  return calibrate_camera_imu(rig.target, cameras, rig.imu, noise, options);
}

// The same reason has other figures every time.
std::string kind_of(const std::string& reason) {
  std::string out;
  for (const char c : reason.substr(0, std::min<std::size_t>(reason.size(), 150))) {
    const bool figure = (c >= '0' && c <= '9') || (c == '.' && out.ends_with('#'));
    if (!figure) out += c;
    if (figure && !out.ends_with('#')) out += '#';
  }
  return out;
}

void add(const Row& row, const WavedRig& rig, const CameraImuFit& fit, Sums& sums) {
  ++sums.answered;
  const bool doubted = fit.quality.verdict >= Verdict::kWarn;
  if (doubted) {
    ++sums.doubted;
    if (!fit.quality.reasons.empty()) ++sums.reasons[kind_of(fit.quality.reasons.front())];
  }
  bool wrong = false;
  for (std::size_t c = 0; c < fit.cameras.size(); ++c) {
    const CameraImuCamera& camera = fit.cameras[c];
    const Vector7d e = c == 0 ? error_of(camera, rig.T_camera_imu, row.rig.time_offset_s)
                              : error_of(camera, rig.T_second_imu, row.rig.time_offset_s + test::kSecondOffset);
    const double nees = e.dot(camera.covariance.ldlt().solve(e));
    sums.nees += nees;
    sums.largest_nees = std::max(sums.largest_nees, nees);
    sums.square += e.cwiseAbs2();
    sums.variance += camera.sigma.cwiseAbs2();
    for (int i = 0; i < 7; ++i) {
      if (std::abs(e[i]) < 3 * camera.sigma[i]) ++sums.inside;
      if (!(std::abs(e[i]) < kWrongSigmas * camera.sigma[i])) wrong = true;
    }
    ++sums.mountings;
  }
  if (wrong && !doubted) ++sums.wrong;
  if (row.further) sums.further += std::pow(row.further(fit), 2);
  sums.start_cpu += fit.start_cpu_s;
  sums.solve_cpu += fit.solve_cpu_s;
}

void report(const Row& row, int seeds, const Sums& sums, BarTable& table) {
  std::printf("  seeds %d: answered %d (doubted %d), refused %d\n", seeds, sums.answered, sums.doubted, sums.refused);
  for (const auto& [reason, count] : sums.reasons) std::printf("    %d x %s\n", count, reason.c_str());
  table.at_most("wrong and not doubted", sums.wrong, 0);
  if (sums.mountings == 0) {
    if (!row.may_fail) table.at_least("answered", 0, 1);
    return;
  }
  const double n = sums.mountings;
  const auto rms = [&](const Vector7d& sum, int first, int size) {
    return std::sqrt(sum.segment(first, size).sum() / n);
  };
  std::printf("  rms: turn %.4f deg, translation %.4f mm, offset %.3f us\n", kDeg * rms(sums.square, 0, 3),
              1e3 * rms(sums.square, 3, 3), 1e6 * rms(sums.square, 6, 1));
  const bool nominal = row.name == "nominal";
  // Mountings of one seed share its motion and IMU: as many independent ones as there are seeds.
  const double spread = (nominal ? 1.96 : 3) * std::sqrt(14.0 / sums.answered);
  const double nees = sums.nees / n;
  if (row.may_fail) {
    BarTable::figure("mean NEES (7)", nees);
    BarTable::figure("largest NEES", sums.largest_nees);
  } else if (nominal) {
    table.between("mean NEES", nees, 7 - spread, 7 + spread);
  } else {
    table.at_most("mean NEES", nees, 7 + spread);
  }
  const double inside = sums.inside / (7 * n);
  if (nominal) {
    table.at_least("share of the components within 3 sigma", inside, 0.99);
    table.between("rms over sigma: turn", rms(sums.square, 0, 3) / rms(sums.variance, 0, 3), 0.8, 1.2);
    table.between("rms over sigma: translation", rms(sums.square, 3, 3) / rms(sums.variance, 3, 3), 0.8, 1.2);
    table.between("rms over sigma: offset", rms(sums.square, 6, 1) / rms(sums.variance, 6, 1), 0.8, 1.2);
    table.at_most("CPU of the solution [s]", sums.solve_cpu / sums.answered, 3);
    table.at_most("CPU of all [s]", (sums.start_cpu + sums.solve_cpu) / sums.answered, 5);
  } else {
    BarTable::figure("share of the components within 3 sigma", inside);
    BarTable::figure("rms over sigma: turn", rms(sums.square, 0, 3) / rms(sums.variance, 0, 3));
    BarTable::figure("rms over sigma: translation", rms(sums.square, 3, 3) / rms(sums.variance, 3, 3));
    BarTable::figure("rms over sigma: offset", rms(sums.square, 6, 1) / rms(sums.variance, 6, 1));
    std::printf("  CPU: start %.2f s, solution %.2f s\n", sums.start_cpu / sums.answered,
                sums.solve_cpu / sums.answered);
  }
  if (row.further) {
    // Of a chi-square variable's mean over n, as the NEES.
    table.at_most("further unknown: mean square over variance", sums.further / sums.answered,
                  1 + 3 * std::sqrt(2.0 / sums.answered));
  }
}

void run(const Row& row, int seeds, BarTable& table) {
  std::printf("%s\n", row.name.c_str());
  Sums sums;
  for (int seed = 1; seed <= seeds; ++seed) {
    WavedRig rig = test::wave(row.rig, static_cast<std::uint64_t>(seed));
    if (row.change) row.change(rig, seed);
    try {
      add(row, rig, calibrate(rig, row.options, row.rig.noise), sums);
    } catch (const DataError& error) {
      ++sums.refused;
      ++sums.reasons[kind_of(error.what())];
    }
  }
  report(row, seeds, sums, table);
}

/// Errors of intrinsics as large as their deviations say.
void draw_intrinsics(WavedRig& rig, int seed) {
  Random random(static_cast<std::uint64_t>(1000 + seed));
  IntrinsicsQuality quality;
  quality.method = "simulation";
  quality.intrinsics_sigma_px.setConstant(0.8);
  quality.distortion_sigma << 0.002, 0.002, 1e-4, 1e-4;
  for (int i = 0; i < 4; ++i) {
    rig.camera.intrinsics_px[i] += quality.intrinsics_sigma_px[i] * random.normal();
    rig.camera.distortion[i] += quality.distortion_sigma[i] * random.normal();
  }
  rig.camera.intrinsics_quality = quality;
}

double pull(const CameraImuCheck& found, double truth) {
  return found.estimated ? (found.value - truth) / found.sigma : std::numeric_limits<double>::quiet_NaN();
}

template <class Set>
Row with(const char* name, int seeds, Set set) {
  Row row;
  row.name = name;
  row.seeds = seeds;
  set(row);
  return row;
}

std::vector<Row> rows() {
  std::vector<Row> out;
  const auto add = [&](const char* name, int seeds, const std::function<void(Row&)>& set) {
    out.push_back(with(name, seeds, set));
  };
  add("nominal", 50, [](Row&) {});
  add("order 4", 20, [](Row& r) { r.options.order = 4; });
  add("three angles", 20, [](Row& r) { r.options.rotation = RotationForm::kThreeAngles; });
  add("outliers of 20 px, 2 %", 20, [](Row& r) { r.rig.outliers = 0.02; });
  for (const double factor : {0.3, 0.1}) {
    add(factor == 0.3 ? "motion x 0.3" : "motion x 0.1", 20, [factor](Row& r) {
      r.rig.turning *= factor;
      r.rig.moving *= factor;
      r.may_fail = true;
    });
  }
  add("short: 10 s", 20, [](Row& r) {
    r.rig.seconds = 10;
    r.may_fail = true;
  });
  add("one axis", 20, [](Row& r) {
    r.rig.turning = {1, 0, 0};
    r.may_fail = true;
  });
  add("still: no rotation", 20, [](Row& r) {
    r.rig.turning.setZero();
    r.may_fail = true;
  });
  add("still: no translation", 20, [](Row& r) { r.rig.moving = 0; });
  add("still: neither", 20, [](Row& r) {
    r.rig.turning.setZero();
    r.rig.moving = 0;
    r.may_fail = true;
  });
  add("partly out of view", 20, [](Row& r) { r.rig.board_shift_m = 0.35; });
  add("30 % of the pictures missing", 20, [](Row& r) { r.rig.missing = 0.3; });
  add("two cameras", 20, [](Row& r) { r.rig.second_camera = true; });
  add("line delay, estimated", 20, [](Row& r) {
    r.rig.line_delay_s = 30e-6;
    r.options.estimate_line_delay = true;
    r.further = [](const CameraImuFit& fit) { return pull(fit.cameras[0].line_delay_s, 30e-6); };
  });
  add("line delay, held at 0", 20, [](Row& r) {
    r.rig.line_delay_s = 30e-6;
    r.may_fail = true;
  });
  add("drift, estimated", 20, [](Row& r) {
    r.rig.drift = 50e-6;
    r.options.estimate_drift = true;
    r.further = [](const CameraImuFit& fit) { return pull(fit.cameras[0].offset_drift, 50e-6); };
  });
  add("drift, held at 0", 20, [](Row& r) {
    r.rig.drift = 50e-6;
    r.may_fail = true;
  });
  add("IMU matrices, estimated", 20, [](Row& r) {
    r.rig.gyroscope_matrix << 1.01, 0.004, -0.003, -0.002, 0.99, 0.005, 0.003, 0.002, 1.004;
    r.rig.accelerometer_matrix << 1.006, 0, 0, 0.004, 0.995, 0, -0.003, 0.002, 1.003;
    r.options.estimate_imu_matrices = true;
    const Eigen::Matrix3d truth = r.rig.gyroscope_matrix;
    r.further = [truth](const CameraImuFit& fit) {
      return std::sqrt(
          ((fit.gyroscope_matrix.value - truth).array() / fit.gyroscope_matrix.sigma.array()).square().mean());
    };
  });
  add("gravity's size, estimated", 20, [](Row& r) {
    r.options.estimate_gravity = true;
    r.options.gravity = 9.82;
    r.further = [](const CameraImuFit& fit) { return pull(fit.gravity_size, 9.80665); };
  });
  add("intrinsics off by their sigma, held", 20, [](Row& r) { r.change = draw_intrinsics; });
  add("intrinsics off by their sigma, refined", 20, [](Row& r) {
    r.change = draw_intrinsics;
    r.options.refine_intrinsics = true;
  });
  return out;
}

void print_difference(const char* what, const Vector7d& d) {
  std::printf("  %-34s turn %.2e deg, translation %.2e mm, offset %.2e us\n", what, kDeg * d.head<3>().norm(),
              1e3 * d.segment<3>(3).norm(), 1e6 * d[6]);
}

void exact(BarTable& table) {
  std::printf("exact: no noise\n");
  for (const int order : {4, 6}) {
    for (const RotationForm form : {RotationForm::kCumulative, RotationForm::kThreeAngles}) {
      WavedRigOptions rig;
      rig.imu_noise = 0;
      rig.corner_sigma_px = 0;
      rig.time_offset_s = 0.0123;
      const WavedRig recording = test::wave(rig, 1);
      CameraImuOptions options;
      options.order = order;
      options.rotation = form;
      const Vector7d e =
          error_of(calibrate(recording, options, rig.noise).cameras[0], recording.T_camera_imu, rig.time_offset_s);
      std::printf("  order %d, %s\n", order, form == RotationForm::kCumulative ? "cumulative" : "three angles");
      table.at_most("  translation [mm]", 1e3 * e.segment<3>(3).norm(), 0.02);
      table.at_most("  offset [us]", 1e6 * std::abs(e[6]), 1);
      BarTable::figure("  turn [deg]", kDeg * e.head<3>().norm());
    }
  }
}

// Fits of one recording that must not differ: the error of each against that of the first.
void same_optimum(const bench::RowChoice& choice, BarTable& table) {
  WavedRigOptions rig;
  const WavedRig nominal = test::wave(rig, 1);
  const CameraImuCamera base = calibrate(nominal, {}, rig.noise).cameras[0];
  const Vector7d e0 = error_of(base, nominal.T_camera_imu, 0);
  const auto compare = [&](const char* what, const WavedRig& recording, const CameraImuOptions& options, double offset,
                           double bar_sigmas) {
    const CameraImuCamera found = calibrate(recording, options, rig.noise).cameras[0];
    const Vector7d d = error_of(found, recording.T_camera_imu, offset) - e0;
    print_difference(what, d);
    table.at_most("  largest difference over sigma", (d.array() / base.sigma.array()).abs().maxCoeff(), bar_sigmas);
  };
  if (choice.has("offset")) {
    std::printf("offset: the true one; against the same recording without\n");
    for (const double offset : {0.05, -0.05, 0.5, -2.0}) {
      rig.time_offset_s = offset;
      compare((std::to_string(offset) + " s").c_str(), test::wave(rig, 1), {}, offset, 0.1);
    }
  }
  if (choice.has("start")) {
    std::printf("start: told wrongly\n");
    for (const double wrong : {0.08, -0.08}) {
      CameraImuOptions options;
      options.time_offset_s = wrong;
      compare((std::to_string(wrong) + " s").c_str(), nominal, options, 0, 0.1);
    }
  }
  if (choice.has("order") || choice.has("angles")) {
    std::printf("order, three angles: against order 6, cumulative\n");
    for (const int order : {4, 6}) {
      for (const RotationForm form : {RotationForm::kCumulative, RotationForm::kThreeAngles}) {
        if (order == 6 && form == RotationForm::kCumulative) continue;
        CameraImuOptions options;
        options.order = order;
        options.rotation = form;
        compare((std::string(order == 4 ? "order 4, " : "order 6, ") +
                 (form == RotationForm::kCumulative ? "cumulative" : "three angles"))
                    .c_str(),
                nominal, options, 0, order == 6 ? 0.1 : 0.5);
      }
    }
  }
}

void without_loss(int seeds) {
  Row row = with("outliers of 20 px, 2 %, without loss, noise as given", seeds, [](Row& r) {
    r.rig.outliers = 0.02;
    r.options.loss_sigmas = 1e6;
    r.options.adapt_noise = false;  // it would make the deviations larger instead
  });
  std::printf("%s (for comparison; no bar)\n", row.name.c_str());
  Sums sums;
  for (int seed = 1; seed <= seeds; ++seed) {
    const WavedRig rig = test::wave(row.rig, static_cast<std::uint64_t>(seed));
    add(row, rig, calibrate(rig, row.options, row.rig.noise), sums);
  }
  BarTable::figure("mean NEES (7)", sums.nees / sums.mountings);
  BarTable::figure("rms of the translation [mm]", 1e3 * std::sqrt(sums.square.segment<3>(3).sum() / sums.mountings));
}

int run(const bench::RowChoice& choice) {
  BarTable table;
  if (choice.has("exact")) exact(table);
  if (choice.has("offset") || choice.has("start") || choice.has("order") || choice.has("angles")) {
    same_optimum(choice, table);
  }
  for (const Row& row : rows()) {
    if (choice.has(row.name)) run(row, choice.seeds > 0 ? choice.seeds : row.seeds, table);
  }
  if (choice.has("outliers")) without_loss(choice.seeds > 0 ? choice.seeds : 5);
  std::printf("%d FAILED\n", table.failed());
  return table.failed() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace loc

int main(int argc, char** argv) {
  try {
    return loc::run(loc::bench::RowChoice(
        argc, argv,
        {"nominal", "exact", "offset", "start", "order", "angles", "outliers", "motion", "short", "axis", "still",
         "view", "missing", "cameras", "line", "drift", "matrices", "gravity", "intrinsics"}));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "compare_camera_imu: %s\n", error.what());
    return 2;
  }
}
