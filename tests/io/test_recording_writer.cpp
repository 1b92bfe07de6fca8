// What is written is read back the same; what was not finished is not there.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"
#include "libloc/io/euroc.hpp"
#include "libloc/io/recording_writer.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "libloc/io/scenario_yaml.hpp"
#include "libloc/io/simulation_source.hpp"
#include "libloc/sim/scenario_parameters.hpp"
#include "libloc/sim/simulation.hpp"
#include "msgs/lcm_log_source.hpp"
#include "msgs/lcm_log_writer.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/temp_folder.hpp"

namespace loc {
namespace {

namespace fs = std::filesystem;
using test::near;
using test::TempFolder;

Scenario all_streams(double duration_s) {
  Scenario s = make_scenario("street-car", duration_s);
  s.streams = {};
  return s;
}

std::vector<Measurement> read_all(MeasurementSource& source) {
  std::vector<Measurement> out;
  while (auto m = source.next()) out.push_back(std::move(*m));
  return out;
}

std::map<StreamKind, std::vector<Measurement>> by_kind(const std::vector<Measurement>& measurements) {
  std::map<StreamKind, std::vector<Measurement>> out;
  for (const Measurement& m : measurements) out[kind_of(m)].push_back(m);
  return out;
}

// The same up to the last digit of a deviation, whose square root is written.
struct Same {
  double sigma_tolerance;
  void operator()(const ImuMeasurement& a, const ImuMeasurement& b) const {
    EXPECT_EQ(a.angular_velocity, b.angular_velocity);
    EXPECT_EQ(a.specific_force, b.specific_force);
  }
  void operator()(const MagnetometerMeasurement& a, const MagnetometerMeasurement& b) const {
    EXPECT_EQ(a.magnetic_field, b.magnetic_field);
  }
  void operator()(const GpsMeasurement& a, const GpsMeasurement& b) const {
    EXPECT_EQ(a.fix, b.fix);
    EXPECT_EQ(a.satellites, b.satellites);
    EXPECT_EQ(a.latitude, b.latitude);
    EXPECT_EQ(a.longitude, b.longitude);
    EXPECT_EQ(a.altitude, b.altitude);
    EXPECT_EQ(a.velocity_enu, b.velocity_enu);
    EXPECT_TRUE(near(a.position_cov.diagonal(), b.position_cov.diagonal(), sigma_tolerance));
    EXPECT_TRUE(near(a.velocity_cov.diagonal(), b.velocity_cov.diagonal(), sigma_tolerance));
  }
  void operator()(const ReferenceMeasurement& a, const ReferenceMeasurement& b) const {
    EXPECT_TRUE(near(a.q_world_body.coeffs(), b.q_world_body.coeffs(), 1e-15));
    EXPECT_EQ(a.position, b.position);
    EXPECT_EQ(a.velocity, b.velocity);
  }
  void operator()(const OdometryMeasurement& a, const OdometryMeasurement& b) const {
    EXPECT_EQ(a.start_time_ns, b.start_time_ns);
    EXPECT_EQ(a.position, b.position);
    EXPECT_TRUE(near(a.rotation.coeffs(), b.rotation.coeffs(), 1e-15));
    EXPECT_TRUE(near(a.position_cov.diagonal(), b.position_cov.diagonal(), sigma_tolerance));
    EXPECT_TRUE(near(a.orientation_cov.diagonal(), b.orientation_cov.diagonal(), sigma_tolerance));
  }
  void operator()(const FeaturesMeasurement& a, const FeaturesMeasurement& b) const {
    EXPECT_EQ(a.camera, b.camera);
    EXPECT_EQ(a.sigma_px, b.sigma_px);
    ASSERT_EQ(a.features.size(), b.features.size());
    for (std::size_t i = 0; i < a.features.size(); ++i) {
      EXPECT_EQ(a.features[i].id, b.features[i].id);
      EXPECT_EQ(a.features[i].pixel_px, b.features[i].pixel_px);
    }
  }
  template <class A, class B>
  void operator()(const A& /*a*/, const B& /*b*/) const {
    ADD_FAILURE() << "other kinds";
  }
};

TEST(RecordingWriter, EurocFolderReadsBackTheSame) {
  const TempFolder folder;
  const fs::path out = folder.path() / "drive";
  for (const bool relative : {false, true}) {
    Scenario scenario = all_streams(2);
    scenario.odometry.relative = relative;
    const Rig rig = scenario.rig();
    Simulation simulation(scenario, 3);
    std::vector<Measurement> written;
    auto writer = create_euroc(out, rig);
    while (auto m = simulation.next()) {
      if (const auto* reference = std::get_if<ReferenceMeasurement>(&*m)) {
        writer->write(*reference, {simulation.truth().gyroscope_bias, simulation.truth().accelerometer_bias});
      } else {
        writer->write(*m);
      }
      if (kind_of(*m) != StreamKind::kFeatures) written.push_back(*m);
    }
    EXPECT_FALSE(fs::exists(out));
    writer->finish();
    writer.reset();
    EXPECT_FALSE(fs::exists(folder.path() / "drive.incomplete"));

    const auto source = open_euroc(out);
    const std::vector<Measurement> read = read_all(*source);
    ASSERT_EQ(read.size(), written.size());
    for (std::size_t i = 0; i < read.size(); ++i) {
      EXPECT_EQ(stamp_of(read[i]).time_ns, stamp_of(written[i]).time_ns);
      std::visit(Same{1e-14}, written[i], read[i]);
    }
    for (const NamedCount& c : source->counts()) EXPECT_TRUE(c.name.ends_with(".read")) << c.name;
    const ImuCalibration imu = read_euroc_imu(out / "mav0" / "imu0" / "sensor.yaml");
    EXPECT_EQ(imu.rate_hz, 200);
    EXPECT_EQ(imu.noise.gyroscope_noise_density, rig.imu->noise.gyroscope_noise_density);
    const CameraCalibration camera = read_euroc_camera(out / "mav0" / "cam0" / "sensor.yaml");
    EXPECT_EQ(camera.intrinsics_px, rig.cameras[0].intrinsics_px);
    EXPECT_EQ(camera.distortion, rig.cameras[0].distortion);
    EXPECT_TRUE(near(camera.T_body_camera.matrix(), rig.cameras[0].T_body_camera.matrix(), 1e-15));
    fs::remove_all(out);
  }
}

TEST(RecordingWriter, SaysWhatAFolderHasNoRoomFor) {
  const TempFolder folder;
  auto writer = create_euroc(folder.path() / "r", {});
  FeaturesMeasurement features;
  features.time_ns = 5;
  writer->write(Measurement(features));
  ImuMeasurement imu;
  imu.time_ns = 5;
  imu.angular_velocity.setZero();
  imu.specific_force.setZero();
  writer->write(Measurement(imu));
  std::map<std::string, std::int64_t> counts;
  for (const NamedCount& c : writer->counts()) counts[c.name] = c.value;
  EXPECT_EQ(counts, (std::map<std::string, std::int64_t>{{"imu.written", 1}, {"features.no_room", 1}}));
}

TEST(RecordingWriter, LcmLogReadsBackTheSame) {
  const TempFolder folder;
  const fs::path out = folder.path() / "drive.lcm";
  Scenario scenario = all_streams(2);
  scenario.imu_clock.loss_fraction = 0.1;
  scenario.imu_clock.delay.exponential_ns = 3'000'000;
  Simulation simulation(scenario, 3, {SimulationOptions::Order::kArrival});
  std::vector<Measurement> written;
  auto writer = create_lcm_log(out);
  while (auto m = simulation.next()) {
    writer->write(*m);
    written.push_back(std::move(*m));
  }
  EXPECT_FALSE(fs::exists(out));
  writer->finish();
  const std::vector<Measurement> read = read_all(*open_lcm_log(out));
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(stamp_of(read[i]).time_ns, stamp_of(written[i]).time_ns);
    EXPECT_EQ(stamp_of(read[i]).host_time_ns, stamp_of(written[i]).host_time_ns);
    EXPECT_EQ(stamp_of(read[i]).sequence, stamp_of(written[i]).sequence);
    std::visit(Same{0}, written[i], read[i]);
  }
  EXPECT_EQ(by_kind(read).size(), 6);
}

TEST(RecordingWriter, NothingIsLeftOfWhatWasNotFinished) {
  const TempFolder folder;
  Simulation simulation(all_streams(1), 3);
  const Measurement m = *simulation.next();
  {
    const auto euroc = create_euroc(folder.path() / "e", {});
    const auto log = create_lcm_log(folder.path() / "l.lcm");
    euroc->write(m);
    log->write(m);
    EXPECT_TRUE(fs::exists(folder.path() / "e.incomplete"));
    EXPECT_TRUE(fs::exists(folder.path() / "l.lcm.incomplete"));
    // A second one of the same name would write into it.
    EXPECT_THROW(create_euroc(folder.path() / "e", {}), DataError);
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(RecordingWriter, DoesNotReplaceWhatIsThere) {
  const TempFolder folder;
  fs::create_directories(folder.path() / "full" / "mav0");
  EXPECT_THROW(create_euroc(folder.path() / "full", {}), DataError);
  EXPECT_TRUE(fs::exists(folder.path() / "full" / "mav0"));
  std::ofstream(folder.path() / "file.lcm") << "x";
  EXPECT_THROW(create_lcm_log(folder.path() / "file.lcm"), DataError);
  EXPECT_THROW(create_euroc(folder.path() / "file.lcm", {}), DataError);
  EXPECT_THROW(create_euroc(folder.path() / "file.lcm" / "sub", {}), DataError);
  EXPECT_THROW(create_lcm_log(folder.path() / "no" / "such" / "folder.lcm"), DataError);
  // An empty folder may be filled, also when it is named with a slash.
  fs::create_directories(folder.path() / "empty");
  auto writer = create_euroc(folder.path() / "empty" / "", {});
  writer->finish();
  EXPECT_TRUE(fs::is_directory(folder.path() / "empty" / "mav0"));
}

TEST(ScenarioFile, WritesAndReadsAllParameters) {
  const TempFolder folder;
  const fs::path path = folder.path() / "scenario.yaml";
  Scenario scenario = all_streams(33);
  scenario.gps.outages = {{1, 2}, {3, 4.5}};
  scenario.imu.gyroscope.constant_bias = {1e-3, -2e-3, 1.0 / 3};
  scenario.imu.sampling = ImuSampleModel::kIncrement;
  write_scenario_file(path, scenario, 12345);
  const ScenarioFile file = read_scenario_file(path);
  EXPECT_EQ(file.scenario, "street-car");
  EXPECT_EQ(file.seed, 12345U);
  EXPECT_EQ(file.duration_s, 33);
  Scenario again = make_scenario(*file.scenario, *file.duration_s);
  file.apply(again);
  const auto a = parameters(scenario);
  const auto b = parameters(again);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].value, b[i].value) << a[i].name;
}

TEST(ScenarioFile, NestedKeysAndErrors) {
  const TempFolder folder;
  const fs::path path = folder.path() / "s.yaml";
  const auto write = [&](const std::string& text) { std::ofstream(path) << text; };
  write(
      "parameters:\n  gps:\n    outages: [[20, 30], [40, 41]]\n    antenna_in_body: [1, 2, 3]\n  odometry.scale: 3\n");
  Scenario scenario = all_streams(60);
  const ScenarioFile file = read_scenario_file(path);
  EXPECT_FALSE(file.scenario || file.seed || file.duration_s);
  file.apply(scenario);
  ASSERT_EQ(scenario.gps.outages.size(), 2);
  EXPECT_EQ(scenario.gps.outages[1].begin_s, 40);
  EXPECT_EQ(scenario.gps.antenna_in_body, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(scenario.odometry.scale, 3);

  const auto message = [&](const std::string& text) {
    write(text);
    try {
      read_scenario_file(path).apply(scenario);
    } catch (const DataError& e) {
      return std::string(e.what()).substr(path.string().size());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(message("parameters:\n  gps:\n    outage: [1, 2]\n"), ":3: there is no parameter 'gps.outage'");
  EXPECT_EQ(message("parameters:\n  imu.rate_hz: fast\n"), ":2: imu.rate_hz = 'fast': must be a number");
  EXPECT_EQ(message("seed: -1\n"), ":1: key 'seed' must not be negative");
  EXPECT_EQ(message("format: libloc-rig-1\n"), ":1: key 'format' must be libloc-scenario-1");
  EXPECT_NE(message("sceanrio: rest\n"), "accepted");
  EXPECT_NE(message("parameters:\n  gps.outages: [{a: 1}]\n"), "accepted");
  EXPECT_NE(message("parameters: [1, 2\n"), "accepted");
}

TEST(SimulationSource, GivesWhatTheSimulationGives) {
  Scenario scenario = make_scenario("vio-example", 1);
  SimulationSource source(Simulation(scenario, 4));
  EXPECT_EQ(read_all(source).size(), 225U);
  EXPECT_EQ(source.truth().size(), 100U);
  SimulationSource stopped(Simulation(scenario, 4));
  stopped.next();
  stopped.stop();
  EXPECT_FALSE(stopped.next());
}

}  // namespace
}  // namespace loc
