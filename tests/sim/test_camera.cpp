#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>

#include "libloc/geometry/so3.hpp"
#include "libloc/sim/camera.hpp"
#include "libloc/sim/room.hpp"
#include "tests/support/camera_models.hpp"
#include "tests/support/numeric_jacobian.hpp"

namespace loc {
namespace {

using test::near;

/// Turns on the spot and sways a little.
class Turning : public Motion {
 public:
  double duration_s() const override { return 10; }
  MotionState at(double t) const override {
    MotionState s;
    s.time_s = t;
    s.T_world_body = {so3::exp({0, 0, 0.4 * t}), {std::sin(t), 0.5 * std::cos(t), 1.4}};
    return s;
  }
};

CameraCalibration calibration() {
  CameraCalibration c = test::radtan_camera();
  // Looks along the body's x, a little off.
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  c.T_body_camera = {so3::boxplus(Eigen::Quaterniond(R), {0.02, -0.03, 0.01}), {0.1, 0.02, -0.03}};
  return c;
}

Scene room() {
  return box_room({}, Random(1));
}

CameraModel exact() {
  CameraModel model;
  model.sigma_px = 0;
  model.max_features = 0;
  model.reappear_rate = 1;
  model.min_separation_px = 0;
  return model;
}

std::vector<SimulatedFrame> run(const CameraModel& model, std::uint64_t seed = 7) {
  return simulate_camera(Turning(), model, calibration(), room(), Random(seed));
}

TEST(CameraSimulator, WithoutErrorsItMeasuresTheProjection) {
  const Scene scene = room();
  CameraCalibration c = calibration();
  c.time_offset_s = 0.0125;
  CameraModel model = exact();
  model.start_time_ns = 1'700'000'000'000'000'000;
  CameraSimulator simulator(model, c, scene, Random(1), 3);
  const Camera camera(c);
  for (int i = 0; i < 20; ++i) {
    const double t = 0.5 * i;
    const MotionState state = Turning().at(t);
    const SimulatedFrame frame = simulator.observe(state);
    EXPECT_EQ(frame.measurement.sequence, i);
    EXPECT_EQ(frame.measurement.camera, 3);
    EXPECT_EQ(frame.measurement.sigma_px, 0);
    // t_imu = t_camera + time_offset
    EXPECT_EQ(frame.measurement.time_ns + 12'500'000, model.start_time_ns + 500'000'000LL * i);
    const Pose3 T_camera_world = (state.T_world_body * c.T_body_camera).inverse();
    ASSERT_EQ(frame.truth.size(), frame.measurement.features.size());
    std::set<std::int64_t> seen;
    for (std::size_t k = 0; k < frame.truth.size(); ++k) {
      const FeatureObservation& feature = frame.measurement.features[k];
      seen.insert(feature.id);
      EXPECT_EQ(feature.id, frame.truth[k].point);
      const Eigen::Vector3d p = T_camera_world * scene.points[static_cast<std::size_t>(feature.id)].position;
      EXPECT_TRUE(near(feature.pixel_px, *camera.project(p), 1e-9));
      EXPECT_TRUE(near(frame.truth[k].pixel_px, feature.pixel_px, 0));
      EXPECT_NEAR(frame.truth[k].depth_m, p.z(), 1e-12);
      EXPECT_FALSE(frame.truth[k].outlier || frame.truth[k].wrong_id);
    }
    // And all that is in view is measured.
    std::set<std::int64_t> in_view;
    for (std::size_t k = 0; k < scene.points.size(); ++k) {
      const auto pixel = camera.project(T_camera_world * scene.points[k].position);
      if (pixel && camera.in_image(*pixel, model.border_px)) in_view.insert(static_cast<std::int64_t>(k));
    }
    EXPECT_EQ(seen, in_view);
    EXPECT_GT(seen.size(), 50U);
  }
}

TEST(CameraSimulator, NoiseHasTheDeviationThatTheMeasurementClaims) {
  CameraModel model;
  model.sigma_px = 0.7;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();
  double product = 0;
  double n = 0;
  for (const SimulatedFrame& frame : run(model)) {
    EXPECT_EQ(frame.measurement.sigma_px, 0.7);
    for (std::size_t k = 0; k < frame.truth.size(); ++k) {
      const Eigen::Vector2d e = (frame.measurement.features[k].pixel_px - frame.truth[k].pixel_px) / 0.7;
      sum += e;
      squares += e.cwiseAbs2();
      product += e.x() * e.y();
      ++n;
    }
  }
  ASSERT_GT(n, 20'000);
  // 4.5 deviations of the means.
  EXPECT_TRUE(near(sum / n, Eigen::Vector2d::Zero(), 4.5 / std::sqrt(n)));
  EXPECT_TRUE(near(squares / n, Eigen::Vector2d::Ones(), 4.5 * std::sqrt(2 / n)));
  EXPECT_NEAR(product / n, 0, 4.5 / std::sqrt(n));
}

TEST(CameraSimulator, OutliersAndWrongIdentitiesComeAtTheirRatesAndAreKnown) {
  CameraModel model;
  model.outlier_rate = 0.05;
  model.wrong_id_rate = 0.04;
  double n = 0;
  double outliers = 0;
  double wrong = 0;
  double far = 0;
  for (const SimulatedFrame& frame : run(model)) {
    std::set<std::int64_t> ids;
    for (std::size_t k = 0; k < frame.truth.size(); ++k) {
      const FeatureObservation& feature = frame.measurement.features[k];
      EXPECT_TRUE(ids.insert(feature.id).second);  // never twice in a frame
      EXPECT_EQ(frame.truth[k].wrong_id, feature.id != frame.truth[k].point);
      const double distance = (feature.pixel_px - frame.truth[k].pixel_px).norm();
      EXPECT_TRUE(frame.truth[k].outlier || distance < 6 * model.sigma_px);
      outliers += frame.truth[k].outlier ? 1 : 0;
      far += distance > 20 ? 1 : 0;
      wrong += frame.truth[k].wrong_id ? 1 : 0;
      ++n;
    }
  }
  const auto deviation = [&](double p) { return 4.5 * std::sqrt(2 * p / n); };
  EXPECT_NEAR(outliers / n, 0.05, deviation(0.05));
  EXPECT_NEAR(wrong / n, 0.04, deviation(0.04) + 0.001);
  EXPECT_GT(far, 0.95 * outliers);  // anywhere in the image
}

TEST(CameraSimulator, SwitchingOutliersOnLeavesTheRestAsItWas) {
  CameraModel model;
  const auto plain = run(model);
  model.outlier_rate = 0.2;
  const auto disturbed = run(model);
  ASSERT_EQ(plain.size(), disturbed.size());
  for (std::size_t i = 0; i < plain.size(); ++i) {
    ASSERT_EQ(plain[i].truth.size(), disturbed[i].truth.size());
    for (std::size_t k = 0; k < plain[i].truth.size(); ++k) {
      EXPECT_EQ(plain[i].measurement.features[k].id, disturbed[i].measurement.features[k].id);
      if (disturbed[i].truth[k].outlier) continue;
      EXPECT_EQ(plain[i].measurement.features[k].pixel_px, disturbed[i].measurement.features[k].pixel_px);
    }
  }
}

/// How often a point was lost while it stayed in view, and came back under its old or a new identity.
struct Returns {
  int old_id = 0;
  int new_id = 0;
  int gaps = 0;
};
Returns returns_of(const CameraModel& model) {
  Returns out;
  std::map<std::int64_t, std::pair<std::size_t, std::int64_t>> last;  // point: frame, identity
  std::set<std::int64_t> used;
  const auto frames = run(model);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    for (std::size_t k = 0; k < frames[i].truth.size(); ++k) {
      const std::int64_t point = frames[i].truth[k].point;
      const std::int64_t id = frames[i].measurement.features[k].id;
      const auto before = last.find(point);
      if (before != last.end() && before->second.first + 1 < i) {
        ++out.gaps;
        (before->second.second == id ? out.old_id : out.new_id) += 1;
        EXPECT_TRUE(before->second.second == id || !used.contains(id));
      } else if (before != last.end()) {
        EXPECT_EQ(before->second.second, id);
      }
      used.insert(id);
      last[point] = {i, id};
    }
  }
  return out;
}

TEST(CameraSimulator, LostFeaturesComeBackWithOrWithoutTheirIdentity) {
  CameraModel model = exact();
  model.loss_rate = 0;
  const int only_out_of_view = returns_of(model).gaps;
  model.loss_rate = 0.05;
  const Returns remembered = returns_of(model);
  EXPECT_GT(remembered.old_id, only_out_of_view + 500);
  EXPECT_EQ(remembered.new_id, 0);
  model.new_id_rate = 1;
  const Returns forgotten = returns_of(model);
  EXPECT_GT(forgotten.new_id, 500);
  EXPECT_EQ(forgotten.old_id, 0);
  model.reappear_rate = 0;
  EXPECT_EQ(returns_of(model).gaps, 0);
}

TEST(CameraSimulator, LimitsOfNumberDepthAndBorderHold) {
  CameraModel model;
  model.sigma_px = 0;
  model.max_features = 40;
  model.min_depth_m = 2;
  model.max_depth_m = 4;
  model.border_px = 30;
  std::size_t most = 0;
  std::set<std::int64_t> ids;
  for (const SimulatedFrame& frame : run(model)) {
    most = std::max(most, frame.truth.size());
    for (const ObservationTruth& truth : frame.truth) {
      EXPECT_TRUE(truth.depth_m >= 2 && truth.depth_m <= 4);
      EXPECT_TRUE(truth.pixel_px.x() >= 29.5 && truth.pixel_px.x() <= 752 - 30.5);
      EXPECT_TRUE(truth.pixel_px.y() >= 29.5 && truth.pixel_px.y() <= 480 - 30.5);
      ids.insert(truth.point);
    }
  }
  EXPECT_EQ(most, 40U);
  EXPECT_GT(ids.size(), 200U);  // new ones take the places of those that went out of view
}

TEST(CameraSimulator, NewFeaturesKeepTheirDistance) {
  CameraModel model = exact();
  model.min_separation_px = 40;
  const auto frames = simulate_camera(Turning(), model, calibration(), room(), Random(1), 0);
  const auto& truth = frames.at(0).truth;
  EXPECT_GT(truth.size(), 40U);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) EXPECT_GE((truth[i].pixel_px - truth[k].pixel_px).norm(), 40);
  }
}

TEST(CameraSimulator, WallsHideWhatIsBehindThem) {
  // A second room around the first: its walls are seen only where the first one's are not in the way.
  Scene scene = room();
  const auto inner = static_cast<std::int64_t>(scene.points.size());
  scene.add(box_room({.size_m = {20, 20, 10}, .cell_m = 1}, Random(2)), {Eigen::Quaterniond::Identity(), {0, 0, -2}});
  CameraModel model = exact();
  const auto outer_seen = [&] {
    int count = 0;
    for (const SimulatedFrame& frame : simulate_camera(Turning(), model, calibration(), scene, Random(1), 3)) {
      for (const ObservationTruth& truth : frame.truth) count += truth.point >= inner ? 1 : 0;
    }
    return count;
  };
  EXPECT_EQ(outer_seen(), 0);
  model.occlusion = false;
  EXPECT_GT(outer_seen(), 1000);
}

TEST(CameraSimulator, TheSameSeedGivesTheSameFrames) {
  CameraModel model;
  model.outlier_rate = model.wrong_id_rate = model.loss_rate = model.new_id_rate = 0.1;
  model.stamp_jitter_s = 1e-3;
  const auto flat = [&](std::uint64_t seed) {
    std::vector<double> out;
    for (const SimulatedFrame& frame : run(model, seed)) {
      out.push_back(static_cast<double>(frame.measurement.time_ns));
      for (const FeatureObservation& f : frame.measurement.features) {
        out.insert(out.end(), {static_cast<double>(f.id), f.pixel_px.x(), f.pixel_px.y()});
      }
    }
    return out;
  };
  EXPECT_EQ(flat(1), flat(1));
  EXPECT_NE(flat(1), flat(2));
  EXPECT_EQ(run(model).size(), 201U);
}

TEST(CameraSimulator, WrongInputIsNamed) {
  const auto message = [](auto change) -> std::string {
    CameraModel model;
    CameraCalibration c = calibration();
    change(model, c);
    try {
      const CameraSimulator simulator(model, c, room(), Random(1));
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  };
  const auto contains = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_EQ(message([](auto&, auto&) {}), "");
  EXPECT_TRUE(contains(message([](auto& m, auto&) { m.sigma_px = -1; }), "sigma_px = -1"));
  EXPECT_TRUE(contains(message([](auto& m, auto&) { m.outlier_rate = 1.5; }), "outlier_rate = 1.5"));
  EXPECT_TRUE(contains(message([](auto& m, auto&) { m.rate_hz = 0; }), "rate_hz = 0"));
  EXPECT_TRUE(contains(message([](auto& m, auto&) { m.loss_rate = std::nan(""); }), "loss_rate = nan"));
  EXPECT_TRUE(contains(message([](auto& m, auto&) { m.max_depth_m = 0; }), "max_depth_m = 0"));
  EXPECT_TRUE(contains(message([](auto&, auto& c) { c.height_px = 0; }), "cam0.resolution"));

  CameraSimulator simulator(CameraModel{}, calibration(), room(), Random(1));
  simulator.observe(Turning().at(1));
  EXPECT_THROW(simulator.observe(Turning().at(1)), std::invalid_argument);
  EXPECT_THROW(simulator.observe(Turning().at(0.5)), std::invalid_argument);
  MotionState state;
  state.time_s = std::nan("");
  EXPECT_THROW(simulator.observe(state), std::invalid_argument);
  EXPECT_NO_THROW(simulator.observe(Turning().at(1.5)));
}

}  // namespace
}  // namespace loc
