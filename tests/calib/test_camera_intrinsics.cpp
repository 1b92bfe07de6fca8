// Intrinsic calibration: simulated corners with truth, real corners, and what must be refused.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "libloc/calib/camera_bundle.hpp"
#include "libloc/calib/camera_intrinsics.hpp"
#include "libloc/core/check.hpp"
#include "libloc/core/random.hpp"
#include "libloc/core/statistics.hpp"
#include "libloc/geometry/camera.hpp"
#include "libloc/io/target_yaml.hpp"
#include "tests/support/camera_models.hpp"
#include "tests/support/data.hpp"
#include "tests/support/number_table.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

struct Look {
  int views = 25;
  double noise_px = 0.2;
  double tilt = 0.7;    // [rad] to both sides
  double aside = 0.15;  // [m]
};

std::vector<TargetView> look_at(const CalibrationTarget& target, const CameraCalibration& calibration, Random random,
                                const Look& look = {}) {
  const Camera camera(calibration);
  const Eigen::Vector3d middle = target.corner(target.corner_count() - 1) / 2;
  const double distance = 0.42 * calibration.intrinsics_px[0] / 458;
  std::vector<TargetView> views;
  for (int i = 0; i < look.views; ++i) {
    const Eigen::Vector3d turned(look.tilt * random.uniform(-1, 1), look.tilt * random.uniform(-1, 1),
                                 random.uniform(-1, 1));
    Pose3 pose = test::in_front(middle, distance, turned);
    pose.translation += Eigen::Vector3d(look.aside * random.uniform(-1, 1), look.aside * random.uniform(-0.7, 0.7),
                                        random.uniform(-0.05, 0.2));
    TargetView& view = views.emplace_back();
    for (int id = 0; id < target.corner_count(); ++id) {
      const auto pixel = camera.project(pose.inverse() * target.corner(id));
      if (!pixel || !camera.in_image(*pixel)) continue;
      view.corners.push_back({id, *pixel + look.noise_px * Eigen::Vector2d(random.normal(), random.normal())});
    }
  }
  return views;
}

CalibrationTarget board() {
  return parse_target("checkerboard 9x6 0.04");
}

CameraFitOptions with(DistortionModel model) {
  CameraFitOptions options;
  options.model = model;
  return options;
}

TEST(Target, TextAndPlaces) {
  for (const char* text : {"checkerboard 9x6 0.025", "aprilgrid 6x6 0.088 0.3", "aprilgrid 4x3 0.05 0.25 100"}) {
    EXPECT_EQ(target_text(parse_target(text)), text);
  }
  for (const char* text :
       {"", "checkerboard", "checkerboard 9x6", "checkerboard 9 6 0.025", "checkerboard 9x6x2 0.025",
        "checkerboard 9x6 25mm", "checkerboard 9x6 -1", "checkerboard 9x6 nan", "checkerboard 1x6 0.02",
        "checkerboard 9x6 2000", "aprilgrid 6x6 0.088", "aprilgrid 6x6 0.088 0", "aprilgrid 30x30 0.088 0.3",
        "aprilgrid 6x6 0.088 0.3 560", "circles 4x4 0.1", "checkerboard 9x6 0.025 0.3"}) {
    EXPECT_THROW(parse_target(text), std::invalid_argument) << text;
  }
  const CalibrationTarget grid = parse_target("aprilgrid 6x6 0.088 0.3");
  EXPECT_EQ(grid.corner_count(), 144);
  // Tag 7 is the second of the second row; its upper right corner.
  EXPECT_LT((grid.corner(4 * 7 + 2) - Eigen::Vector3d(0.088 * 2.3, 0.088 * 2.3, 0)).norm(), 1e-12);
  EXPECT_LT((board().corner(10) - Eigen::Vector3d(0.04, 0.04, 0)).norm(), 1e-12);
  EXPECT_THROW(board().corner(54), std::invalid_argument);
  EXPECT_TRUE(board().has_direction());
  EXPECT_FALSE(parse_target("checkerboard 8x6 0.04").has_direction());
}

TEST(Target, KalibrsFiles) {
  const test::TempFolder folder;
  for (const char* text : {"checkerboard 9x6 0.025", "aprilgrid 6x6 0.088 0.3", "aprilgrid 4x3 0.05 0.25 100"}) {
    write_kalibr_target(folder.path() / "target.yaml", parse_target(text));
    EXPECT_EQ(target_text(read_kalibr_target(folder.path() / "target.yaml")), text);
  }
  const auto kalibr = folder.write("kalibr.yaml",
                                   "target_type: 'aprilgrid' #gridtype\ntagCols: 6 #number of apriltags\n"
                                   "tagRows: 6\ntagSize: 0.088 #[m]\ntagSpacing: 0.3 #ratio\n");
  EXPECT_EQ(target_text(read_kalibr_target(kalibr)), "aprilgrid 6x6 0.088 0.3");
  for (const char* text : {"target_type: circlegrid\ntargetCols: 6\n", "target_type: aprilgrid\ntagCols: 6\n",
                           "target_type: aprilgrid\ntagCols: 6\ntagRows: six\ntagSize: 0.088\ntagSpacing: 0.3\n",
                           "target_type: aprilgrid\ntagCols: 6\ntagRows: 6\ntagSize: -1\ntagSpacing: 0.3\n",
                           "target_type: checkerboard\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: 0.03\n"
                           "colSpacingMeters: 0.04\n"}) {
    try {
      read_kalibr_target(folder.write("bad.yaml", text));
      ADD_FAILURE() << text;
    } catch (const DataError& error) {
      EXPECT_NE(std::string(error.what()).find("bad.yaml"), std::string::npos) << error.what();
    }
  }
}

TEST(CameraFit, FindsTheCameraWithinItsDeviations) {
  for (const CameraCalibration& truth : {test::radtan_camera(), test::fisheye_camera()}) {
    double sum = 0;
    constexpr int kSeeds = 12;
    for (int seed = 0; seed < kSeeds; ++seed) {
      const auto views = look_at(board(), truth, Random(static_cast<std::uint64_t>(seed)));
      CameraFitOptions options = with(truth.distortion_model);
      options.compare_models = false;
      const CameraFit fit = calibrate_camera(board(), views, 752, 480, options);
      ASSERT_TRUE(fit.converged);
      EXPECT_NEAR(fit.noise_px, 0.2, 0.012);
      const Vector8d error =
          calib::parameters_of(fit.camera) - (Vector8d() << truth.intrinsics_px, truth.distortion).finished();
      sum += error.dot(fit.covariance.ldlt().solve(error));
      // Scatter of the pictures says the same when corners are independent.
      EXPECT_TRUE((fit.sigma_by_views.array() > 0.4 * fit.covariance.diagonal().cwiseSqrt().array()).all());
      EXPECT_TRUE((fit.sigma_by_views.array() < 2.5 * fit.covariance.diagonal().cwiseSqrt().array()).all());
    }
    RecordProperty(truth.distortion_model == DistortionModel::kRadtan ? "nees_radtan" : "nees_equidistant",
                   std::to_string(sum / kSeeds));
    // Sum of squares of 8 * 12 normal numbers, 99.9 %.
    EXPECT_GT(sum, chi_square_quantile(0.0005, 8.0 * kSeeds));
    EXPECT_LT(sum, chi_square_quantile(0.9995, 8.0 * kSeeds));
  }
}

TEST(CameraFit, IsExactWithoutNoise) {
  for (const CameraCalibration& truth : {test::radtan_camera(), test::fisheye_camera()}) {
    const auto views = look_at(board(), truth, Random(1), {.noise_px = 0});
    const CameraFit fit = calibrate_camera(board(), views, 752, 480, with(truth.distortion_model));
    EXPECT_LT((fit.camera.intrinsics_px - truth.intrinsics_px).norm(), 1e-6);
    EXPECT_LT((fit.camera.distortion - truth.distortion).norm(), 1e-6);
    EXPECT_LT(fit.rms_px, 1e-7);
    EXPECT_EQ(fit.corners_dropped, 0);
  }
  CameraCalibration pinhole = test::radtan_camera();
  pinhole.distortion_model = DistortionModel::kNone;
  pinhole.distortion.setZero();
  const auto views = look_at(board(), pinhole, Random(2), {.noise_px = 0});
  const CameraFit fit = calibrate_camera(board(), views, 752, 480, with(DistortionModel::kNone));
  EXPECT_LT((fit.camera.intrinsics_px - pinhole.intrinsics_px).norm(), 1e-6);
  EXPECT_TRUE(fit.camera.distortion.isZero());
  EXPECT_TRUE((fit.covariance.bottomRightCorner<4, 4>().isZero()));
}

TEST(CameraFit, TeleAndWideLensesAreFound) {
  for (const double focal : {200.0, 2000.0}) {
    CameraCalibration truth = test::radtan_camera();
    truth.intrinsics_px = {focal, focal, 380, 235};
    truth.distortion = {-0.05, 0.01, 0, 0};
    const CameraFit fit = calibrate_camera(board(), look_at(board(), truth, Random(3)), 752, 480, {});
    EXPECT_TRUE(fit.converged);
    EXPECT_LT(std::abs(fit.camera.intrinsics_px[0] - focal), 5 * fit.sigma()[0]);
    EXPECT_LT(fit.rms_px, 0.3);
  }
}

TEST(CameraFit, DropsWrongCornersAndPictures) {
  const CameraCalibration truth = test::radtan_camera();
  Random random(7);
  auto views = look_at(board(), truth, random.fork(1));
  views[4].corners[10].pixel_px.x() += 15;
  for (TargetCorner& corner : views[3].corners) {
    corner.pixel_px += 3 * Eigen::Vector2d(random.normal(), random.normal());
  }
  std::swap(views[8].corners[3].pixel_px, views[8].corners[30].pixel_px);
  for (std::size_t i = 0; i < views[9].corners.size(); i += 2) views[9].corners[i].pixel_px.y() += 6;
  views[11].corners.resize(5);
  views[12].corners.clear();
  const CameraFit fit = calibrate_camera(board(), views, 752, 480, {});
  EXPECT_EQ(fit.views_used, 21);
  for (const std::size_t i : {3U, 9U, 11U, 12U}) {
    EXPECT_FALSE(fit.views[i].used);
    EXPECT_FALSE(fit.views[i].reason.empty());
  }
  EXPECT_EQ(fit.views[12].reason, "the target was not found");
  EXPECT_EQ(fit.views[4].corners_dropped, 1);
  EXPECT_EQ(fit.views[8].corners_dropped, 2);
  EXPECT_NEAR(fit.noise_px, 0.2, 0.01);
  const Vector8d error =
      calib::parameters_of(fit.camera) - (Vector8d() << truth.intrinsics_px, truth.distortion).finished();
  EXPECT_LT(error.dot(fit.covariance.ldlt().solve(error)), chi_square_quantile(0.999, 8));
  // What was dropped is shown all the same.
  int shown = 0;
  for (const CameraFitCorner& corner : fit.corners) {
    if (corner.view == 4 && corner.id == 10) {
      EXPECT_FALSE(corner.used);
      EXPECT_NEAR(corner.residual_px.x(), 15, 1);
      ++shown;
    }
  }
  EXPECT_EQ(shown, 1);
}

TEST(CameraFit, TheOtherLensModelIsNamed) {
  const auto views = look_at(board(), test::fisheye_camera(), Random(4));
  const CameraFit fit = calibrate_camera(board(), views, 752, 480, with(DistortionModel::kRadtan));
  EXPECT_LT(fit.other_model_rms_px, 0.8 * fit.rms_px);
  EXPECT_EQ(fit.quality.verdict, Verdict::kWarn);
  bool named = false;
  for (const std::string& reason : fit.quality.reasons)
    named = named || reason.find("equidistant") != std::string::npos;
  EXPECT_TRUE(named);
}

TEST(CameraFit, UncertaintyIsThatOfTheProjection) {
  // Scatter of the projection over many calibrations, with the best rotation taken out, against what one says.
  const CameraCalibration truth = test::radtan_camera();
  const Camera lens(truth);
  CameraFitOptions options;
  options.compare_models = false;
  std::vector<double> ratios;
  for (int seed = 0; seed < 12; ++seed) {
    const auto views = look_at(board(), truth, Random(static_cast<std::uint64_t>(100 + seed)));
    const CameraFit fit = calibrate_camera(board(), views, 752, 480, options);
    const Camera found(fit.camera);
    std::vector<Eigen::Vector3d> rays;
    std::vector<Eigen::Vector2d> pixels;
    for (int row = 0; row < 9; ++row) {
      for (int column = 0; column < 12; ++column) {
        const Eigen::Vector2d pixel((column + 0.5) * 752 / 12 - 0.5, (row + 0.5) * 480 / 9 - 0.5);
        rays.push_back(*lens.unproject(pixel));
        pixels.push_back(pixel);
      }
    }
    Eigen::Matrix3d KK = Eigen::Matrix3d::Zero();
    Eigen::Vector3d Kr = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const auto p = found.project_with_jacobians(rays[i]);
      const Eigen::Matrix<double, 2, 3> K = -p->d_point * so3::hat(rays[i]);
      KK += K.transpose() * K;
      Kr += K.transpose() * (pixels[i] - p->pixel_px);
    }
    const Eigen::Quaterniond turn = so3::exp(KK.ldlt().solve(Kr));
    double off = 0;
    double said = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      off += (*found.project(turn * rays[i]) - pixels[i]).squaredNorm();
      said += std::pow(fit.uncertainty.sigma_px[i], 2);
    }
    ratios.push_back(off / said);
  }
  EXPECT_NEAR(mean(ratios), 1, 0.6);
}

TEST(CameraFit, SaysWhatIsMissing) {
  const CameraCalibration truth = test::radtan_camera();
  const auto verdict = [&](const Look& look) {
    return calibrate_camera(board(), look_at(board(), truth, Random(5), look), 752, 480, {}).quality;
  };
  const auto mentions = [](const Quality& q, const char* word) {
    return std::ranges::any_of(q.reasons, [&](const std::string& r) { return r.find(word) != std::string::npos; });
  };
  const Quality good = verdict({});
  EXPECT_EQ(good.verdict, Verdict::kOk) << good.reasons.front();
  const Quality flat = verdict({.tilt = 0.03});
  EXPECT_EQ(flat.verdict, Verdict::kRefused);
  EXPECT_TRUE(mentions(flat, "one direction"));
  const Quality few = verdict({.views = 4});
  EXPECT_EQ(few.verdict, Verdict::kWarn);
  EXPECT_TRUE(mentions(few, "Only 4 pictures"));
  const Quality central = verdict({.views = 20, .aside = 0});
  EXPECT_TRUE(mentions(central, "bring it to all corners")) << verdict_name(central.verdict);
  const Quality noisy = verdict({.noise_px = 3});
  EXPECT_EQ(noisy.verdict, Verdict::kRefused);
  EXPECT_TRUE(mentions(noisy, "not flat"));
  // A grid with another spacing than the one that was given.
  const CalibrationTarget grid = parse_target("aprilgrid 6x6 0.03 0.3");
  const CameraFit wrong =
      calibrate_camera(parse_target("aprilgrid 6x6 0.03 0.2"), look_at(grid, truth, Random(6)), 752, 480, {});
  EXPECT_EQ(wrong.quality.verdict, Verdict::kRefused);
  EXPECT_TRUE(mentions(wrong.quality, "a spacing of 0.3 far better than the target's 0.2"))
      << wrong.quality.reasons.front();
}

TEST(CameraFit, ErrorsNameTheValue) {
  auto views = look_at(board(), test::radtan_camera(), Random(1), {.views = 4});
  EXPECT_THROW(calibrate_camera(board(), views, 0, 480, {}), std::invalid_argument);
  EXPECT_THROW(calibrate_camera(board(), {views.begin(), 2}, 752, 480, {}), DataError);
  EXPECT_THROW(calibrate_camera(board(), {}, 752, 480, {}), DataError);
  CameraFitOptions options;
  options.corner_limit = std::nan("");
  EXPECT_THROW(calibrate_camera(board(), views, 752, 480, options), std::invalid_argument);
  views[0].corners[0].pixel_px.x() = std::nan("");
  EXPECT_THROW(calibrate_camera(board(), views, 752, 480, {}), std::invalid_argument);
  views[0].corners[0] = views[0].corners[1];
  EXPECT_THROW(calibrate_camera(board(), views, 752, 480, {}), std::invalid_argument);
  views[0].corners[0].id = 54;
  EXPECT_THROW(calibrate_camera(board(), views, 752, 480, {}), std::invalid_argument);
  // Corners in one line, all in one point, and pure noise: an answer or an error, never a confident wrong one.
  views = look_at(board(), test::radtan_camera(), Random(1), {.views = 5});
  for (TargetView& view : views) {
    for (TargetCorner& corner : view.corners) corner.pixel_px = {100.0 + corner.id, 50};
  }
  try {
    EXPECT_EQ(calibrate_camera(board(), views, 752, 480, {}).quality.verdict, Verdict::kRefused);
  } catch (const DataError&) {
  }
  Random random(3);
  for (TargetView& view : views) {
    for (TargetCorner& corner : view.corners) corner.pixel_px = {random.uniform(0, 751), random.uniform(0, 479)};
  }
  try {
    EXPECT_EQ(calibrate_camera(board(), views, 752, 480, {}).quality.verdict, Verdict::kRefused);
  } catch (const DataError&) {
  }
}

TEST(CameraFit, ChosenViewsAreDifferentOnes) {
  auto views = look_at(board(), test::radtan_camera(), Random(8), {.views = 30});
  // The same picture many times, as when the board stands still before a camera.
  for (int i = 0; i < 200; ++i) views.insert(views.begin() + 10, views[9]);
  const auto chosen = choose_views(board(), views, 752, 480, 20);
  ASSERT_EQ(chosen.size(), 20U);
  EXPECT_TRUE(std::ranges::is_sorted(chosen));
  EXPECT_LE(std::ranges::count_if(chosen, [](std::size_t i) { return i >= 9 && i <= 209; }), 1);
  EXPECT_EQ(choose_views(board(), views, 752, 480, 1000).size(), views.size());
}

// EuRoC's imu_april recording: corners by another detector, intrinsics by another calibration (Kalibr).
TEST(CameraFit, RealAprilGridAgreesWithItsPublishedCamera) {
  LOC_DATA_OR_SKIP(folder, "euroc-cam-imu-calibration");
  std::map<TimeNs, TargetView> by_time;
  const Eigen::MatrixXd table = test::read_number_table(folder / "cam0_corners.csv");
  for (Eigen::Index i = 0; i < table.rows(); ++i) {
    by_time[static_cast<TimeNs>(table(i, 0) * 1e-6)].corners.push_back(
        {static_cast<std::int32_t>(4 * table(i, 1) + table(i, 2)), {table(i, 3), table(i, 4)}});
  }
  const CalibrationTarget target = parse_target("aprilgrid 6x6 0.088 0.3");
  std::vector<TargetView> views;
  for (auto& [time, view] : by_time) views.push_back(std::move(view));
  const auto chosen = choose_views(target, views, 752, 480, 150);
  std::vector<TargetView> some;
  for (const std::size_t i : chosen) some.push_back(views[i]);
  const CameraFit fit = calibrate_camera(target, some, 752, 480, {});
  EXPECT_LE(fit.quality.verdict, Verdict::kFair);
  EXPECT_LT(fit.rms_px, 0.65);
  const CameraCalibration published = test::radtan_camera();
  EXPECT_NEAR(fit.camera.intrinsics_px[0] / published.intrinsics_px[0], 1, 0.01);
  EXPECT_NEAR(fit.camera.intrinsics_px[1] / published.intrinsics_px[1], 1, 0.01);
  EXPECT_NEAR(fit.camera.distortion[0], published.distortion[0], 0.03);
  RecordProperty("rms_px", std::to_string(fit.rms_px));
  RecordProperty("fx_px", std::to_string(fit.camera.intrinsics_px[0]));
}

}  // namespace
}  // namespace loc
