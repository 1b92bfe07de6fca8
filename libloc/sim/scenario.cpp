#include "libloc/sim/scenario.hpp"

#include <algorithm>
#include <cmath>

#include "libloc/core/check.hpp"
#include "libloc/sim/composed_motion.hpp"
#include "libloc/sim/ground_motion.hpp"
#include "libloc/sim/room.hpp"
#include "libloc/sim/shape_motion.hpp"
#include "libloc/sim/street.hpp"
#include "libloc/sim/waypoint_motion.hpp"

namespace loc {
namespace {

// Of what a scenario itself draws: its motion and its world are the same in every run.
constexpr std::uint64_t kScenarioSeed = 20;

// A motion that goes on as long as the scenario lasts. Estimators level themselves at rest first.
std::shared_ptr<const Motion> after_rest(std::shared_ptr<const Motion> motion) {
  return std::make_shared<RestFirstMotion>(std::move(motion));
}

// So many times round a closed course.
GroundCourseOptions repeated(GroundCourseOptions course, double duration_s) {
  course.cycles *= static_cast<int>(std::ceil(duration_s / GroundCourse(course).duration_s()));
  return course;
}

// A magnetometer in a device with iron of its own, which the rig's calibration knows.
void magnetise(MagnetometerModel& m) {
  m.hard_iron = {12e-6, -7e-6, 18e-6};
  m.soft_iron << 1.04, 0.02, -0.01, 0.02, 0.97, 0.015, -0.01, 0.015, 1.02;
}

// Looks forwards, 752 x 480, 79 degrees wide. @param place in body [m]
ScenarioCamera front_camera(const Eigen::Vector3d& place) {
  ScenarioCamera c;
  c.calibration.name = "cam0";
  c.calibration.width_px = 752;
  c.calibration.height_px = 480;
  c.calibration.intrinsics_px = {458, 457, 367, 248};
  c.calibration.distortion_model = DistortionModel::kRadtan;
  c.calibration.distortion = {-0.283, 0.074, 2e-4, 2e-5};
  Eigen::Matrix3d axes;  // columns: the camera's x (right), y (down), z (forward) in body
  axes << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  c.calibration.T_body_camera = {Eigen::Quaterniond(axes), place};
  c.calibration.rate_hz = c.model.rate_hz;
  return c;
}

// Houses on both sides of a way. @param once the motion, not repeated
std::function<Scene()> street_along(const std::shared_ptr<const Motion>& once) {
  return [once] { return street(sampled_path(*once, 1.0, 0.0), {}, Random(kScenarioSeed)); };
}

std::function<Scene()> room(const Eigen::Vector3d& size, double cell) {
  return [=] { return box_room({.size_m = size, .cell_m = cell}, Random(kScenarioSeed)); };
}

void vio_example(Scenario& s) {
  s.motion = std::make_shared<WaypointMotion>(example_drive());
  s.cameras = {front_camera({1.5, 0, 1.3})};
  s.world = street_along(s.motion);
  s.imu = ImuModel::vio_example();
  s.gps.antenna_in_body = {0.5, 0, 1.2};
  // The example has these two alone; the others are there to be switched on.
  s.streams = {
      .imu = true, .magnetometer = false, .odometry = true, .gps = false, .features = false, .reference = true};
}

void street_car(Scenario& s) {
  CarOptions car;
  car.course.start.z() = 0.6;
  s.cameras = {front_camera({1.2, 0, 0.7})};
  s.world = street_along(std::make_shared<CarMotion>(car));
  car.course = repeated(car.course, s.duration_s);
  s.motion = std::make_shared<CarMotion>(car);
  s.odometry.scale = 0.6;
  s.odometry.scale_walk = 0.005;
  s.odometry.sigma_position = 0.03;
  s.odometry.sigma_orientation = 0.003;
  s.odometry.drift_sigma = 0.3;
  s.odometry.outlier_fraction = 0.005;
  s.odometry.outlier_position = 5;
  s.odometry.latency_s = 0.08;
  s.gps = GpsModel::single();
  s.gps.rate_hz = 5;
  s.gps.antenna_in_body = {0.5, 0, 1.2};
  s.gps.latency_s = 0.12;
  // Parked cars along the first side of the block.
  for (const double x : {20.0, 32.0, 45.0}) s.magnetometer.dipoles.push_back({{x, 3, -0.5}, {60, 20, -90}, 0.8});
}

void pedestrian(Scenario& s) {
  PedestrianOptions walk;
  walk.course.start.z() = 1.6;
  s.cameras = {front_camera({0.1, 0, 0})};
  s.world = street_along(std::make_shared<PedestrianMotion>(walk));
  walk.course = repeated(walk.course, s.duration_s);
  s.motion = std::make_shared<PedestrianMotion>(walk);
  s.odometry.scale = 1.4;
  s.odometry.scale_walk = 0.01;
  s.odometry.sigma_position = 0.01;
  s.odometry.sigma_orientation = 0.005;
  s.odometry.drift_sigma = 0.1;
  s.odometry.latency_s = 0.05;
  s.gps = GpsModel::single();
  s.gps.latency_s = 0.15;
  // A steel door at the first corner, and a tram.
  s.magnetometer.dipoles.push_back({{14, 2, 1}, {0, 40, 60}, 0.6});
  s.magnetometer.disturbances.push_back({{30, 34}, {0, 6e-6, -3e-6}});
}

void hand_held(Scenario& s) {
  HandHeldOptions shaken;
  shaken.T_world_mean.translation = {0, 0, 1.4};
  s.motion = after_rest(std::make_shared<HandHeldMotion>(shaken, Random(kScenarioSeed)));
  s.odometry.scale = 1;
  s.odometry.sigma_position = 0.003;
  s.odometry.sigma_orientation = 0.002;
  s.odometry.drift_sigma = 0.01;
  s.gps.antenna_in_body = {0, 0, 0.1};
  s.cameras = {front_camera({0.05, 0, 0})};
  s.world = room({8, 6, 3}, 0.5);
}

void circle(Scenario& s) {
  CircleOptions round;
  round.center.z() = 1.5;
  s.motion = after_rest(std::make_shared<CircleMotion>(round));
  s.cameras = {front_camera({0.5, 0, 0})};
  s.world = room({50, 30, 6}, 1);
}

void figure_eight(Scenario& s) {
  FigureEightOptions eight;
  eight.center.z() = 1.5;
  s.motion = after_rest(std::make_shared<FigureEightMotion>(eight));
  s.cameras = {front_camera({0.5, 0, 0})};
  s.world = room({50, 30, 6}, 1);
}

void rest(Scenario& s) {
  s.motion = std::make_shared<RestMotion>(RestOptions{{Eigen::Quaterniond::Identity(), {0, 0, 1.4}}});
  s.cameras = {front_camera({0.05, 0, 0})};
  s.world = room({8, 6, 3}, 0.5);
}

struct Named {
  ScenarioInfo info;
  void (*make)(Scenario&);
};

const std::vector<Named>& named() {
  static const std::vector<Named> all = {
      {{"vio-example",
        "The drive and the sensors of the example \"Visual-Inertial Odometry Using Synthetic Data\"; at most 90 s."},
       vio_example},
      {{"street-car", "A car goes round a block, with stops; GPS, odometry of a wandering scale, parked cars."},
       street_car},
      {{"pedestrian", "Somebody walks round a square, stops and looks around."}, pedestrian},
      {{"hand-held", "A device is shaken and turned in a room, all axes: for calibration."}, hand_held},
      {{"circle", "At rest, then a circle of 10 m at 5 m/s."}, circle},
      {{"figure-eight", "At rest, then a figure eight of 40 m by 20 m."}, figure_eight},
      {{"rest", "Nothing moves."}, rest},
  };
  return all;
}

}  // namespace

void Scenario::check() const {
  require(motion != nullptr, "scenario.motion: there is none");
  require_positive("scenario.duration_s", duration_s);
  require(duration_s <= motion->duration_s(), "scenario.duration_s", duration_s,
          "is longer than the motion, " + to_text(motion->duration_s()) + " s");
  require(start_time_ns >= 0, "scenario.start_time_ns", static_cast<double>(start_time_ns), "must not be negative");
  imu.check();
  imu_clock.check("imu.clock");
  magnetometer.check();
  magnetometer_clock.check("magnetometer.clock");
  odometry.check();
  odometry_clock.check("odometry.clock");
  gps.check();
  gps_clock.check("gps.clock");
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const std::string at = "cameras[" + std::to_string(i) + "]";
    cameras[i].model.check();
    cameras[i].clock.check(at + ".clock");
    require_not_negative(at + ".latency_s", cameras[i].latency_s);
  }
  require(!streams.features || cameras.empty() || world != nullptr, "scenario.world: the cameras have nothing to see");
  require_positive("reference.rate_hz", reference_rate_hz);
  require(reference_rate_hz <= 1e5, "reference.rate_hz", reference_rate_hz, "must not exceed 1e5");
}

Rig Scenario::rig() const {
  check();
  Rig rig;
  if (streams.imu) rig.imu = imu.calibration();
  if (streams.magnetometer) rig.magnetometer = magnetometer.calibration();
  if (streams.features) {
    for (const ScenarioCamera& c : cameras) {
      rig.cameras.push_back(c.calibration);
      rig.cameras.back().rate_hz = c.model.rate_hz;
    }
  }
  if (streams.gps) rig.gps = GpsCalibration{gps.antenna_in_body, -gps.stamp_delay_s, kUnknown};
  return rig;
}

const std::vector<ScenarioInfo>& scenario_list() {
  static const std::vector<ScenarioInfo> list = [] {
    std::vector<ScenarioInfo> out;
    for (const Named& n : named()) out.push_back(n.info);
    return out;
  }();
  return list;
}

Scenario make_scenario(const std::string& name, double duration_s) {
  const auto found = std::find_if(named().begin(), named().end(), [&](const Named& n) { return n.info.name == name; });
  if (found == named().end()) {
    std::string known;
    for (const Named& n : named()) known += (known.empty() ? "" : ", ") + n.info.name;
    throw std::invalid_argument("scenario '" + name + "' is not known; there are " + known);
  }
  Scenario s;
  s.name = found->info.name;
  s.description = found->info.description;
  if (!std::isnan(duration_s)) s.duration_s = duration_s;
  require_positive("scenario.duration_s", s.duration_s);
  require(s.duration_s <= 86'400, "scenario.duration_s", s.duration_s, "must not exceed a day");
  s.imu = ImuModel::consumer();
  magnetise(s.magnetometer);
  found->make(s);
  s.check();
  return s;
}

}  // namespace loc
