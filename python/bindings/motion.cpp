// sim/: true motions, sampled at many times at once.
#include "libloc/sim/motion.hpp"

#include <pybind11/stl.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "bindings.hpp"
#include "libloc/sim/composed_motion.hpp"
#include "libloc/sim/ground_motion.hpp"
#include "libloc/sim/look_at_motion.hpp"
#include "libloc/sim/shape_motion.hpp"
#include "libloc/sim/waypoint_motion.hpp"

namespace locpy {
namespace {

using loc::CarMotion;
using loc::CarOptions;
using loc::CircleMotion;
using loc::CircleOptions;
using loc::FigureEightMotion;
using loc::FigureEightOptions;
using loc::GroundCourseOptions;
using loc::HandHeldMotion;
using loc::HandHeldOptions;
using loc::LookAtMotion;
using loc::LookAtOptions;
using loc::Motion;
using loc::MotionState;
using loc::MountedMotion;
using loc::PedestrianMotion;
using loc::PedestrianOptions;
using loc::Pose3;
using loc::RestFirstMotion;
using loc::RestFirstOptions;
using loc::RestMotion;
using loc::WaypointMotion;
using loc::WaypointOptions;

struct MotionArrays {
  explicit MotionArrays(py::ssize_t n)
      : times_s(n),
        q_world_body_wxyz({n, py::ssize_t{4}}),
        position({n, py::ssize_t{3}}),
        velocity({n, py::ssize_t{3}}),
        acceleration({n, py::ssize_t{3}}),
        angular_velocity({n, py::ssize_t{3}}),
        angular_acceleration({n, py::ssize_t{3}}) {}

  py::array_t<double> times_s;
  py::array_t<double> q_world_body_wxyz;
  py::array_t<double> position;
  py::array_t<double> velocity;
  py::array_t<double> acceleration;
  py::array_t<double> angular_velocity;
  py::array_t<double> angular_acceleration;
};

MotionArrays sample(const Motion& motion, const FloatArray& times_s) {
  const auto times = values_view(times_s, "times_s");
  const auto n = static_cast<py::ssize_t>(times.size());
  MotionArrays out(n);
  double* time = out.times_s.mutable_data();
  double* q = out.q_world_body_wxyz.mutable_data();
  const auto rows = [n](py::array_t<double>& array) { return MutableRows<3>(array.mutable_data(), n, 3); };
  MutableRows<3> position = rows(out.position);
  MutableRows<3> velocity = rows(out.velocity);
  MutableRows<3> acceleration = rows(out.acceleration);
  MutableRows<3> angular_velocity = rows(out.angular_velocity);
  MutableRows<3> angular_acceleration = rows(out.angular_acceleration);
  const py::gil_scoped_release release;
  for (py::ssize_t i = 0; i < n; ++i) {
    if (i % kSignalInterval == kSignalInterval - 1) check_signals();
    const MotionState state = motion.at(times[static_cast<std::size_t>(i)]);
    time[i] = state.time_s;
    write_wxyz(state.T_world_body.rotation, q + 4 * i);
    position.row(i) = state.T_world_body.translation;
    velocity.row(i) = state.velocity;
    acceleration.row(i) = state.acceleration;
    angular_velocity.row(i) = state.angular_velocity;
    angular_acceleration.row(i) = state.angular_acceleration;
  }
  return out;
}

std::vector<double> number_list(const ArrayLike& object, const char* name) {
  const py::array_t<double> array = numbers(object, name);
  if (array.ndim() != 1) {
    throw py::value_error(std::string(name) + " must have shape (N,), has " +
                          py::str(py::tuple(array.attr("shape"))).cast<std::string>());
  }
  return {array.data(), array.data() + array.size()};
}

std::vector<Eigen::Vector3d> vector3_list(const ArrayLike& object, const char* name) {
  const py::array_t<double> array = numbers(object, name);
  if (array.ndim() != 2 || array.shape(1) != 3) {
    throw py::value_error(std::string(name) + " must have shape (N, 3), has " +
                          py::str(py::tuple(array.attr("shape"))).cast<std::string>());
  }
  std::vector<Eigen::Vector3d> out;
  for (py::ssize_t i = 0; i < array.shape(0); ++i) out.emplace_back(array.data() + 3 * i);
  return out;
}

py::array_t<double> to_rows(const std::vector<Eigen::Vector3d>& vectors) {
  py::array_t<double> out({static_cast<py::ssize_t>(vectors.size()), py::ssize_t{3}});
  double* data = out.mutable_data();
  for (std::size_t i = 0; i < vectors.size(); ++i) Eigen::Map<Eigen::Vector3d>{data + 3 * i} = vectors[i];
  return out;
}

GroundCourseOptions ground_course(const GroundCourseOptions& preset, const std::optional<ArrayLike>& phases,
                                  const std::optional<ArrayLike>& start, double course_rad, double speed_mps,
                                  std::optional<int> cycles) {
  GroundCourseOptions o = preset;
  if (phases) {
    o.phases.clear();
    o.cycles = 1;
    for (const Eigen::Vector3d& p : vector3_list(*phases, "phases")) o.phases.push_back({p[0], p[1], p[2]});
  }
  if (start) o.start = vector3(*start, "start");
  o.course_rad = course_rad;
  o.speed_mps = speed_mps;
  if (cycles) o.cycles = *cycles;
  return o;
}

void bind_waypoints(py::module_& m) {
  py::class_<WaypointMotion, Motion, std::shared_ptr<WaypointMotion>>(
      m, "WaypointMotion",
      "A ground vehicle that passes way-points at given times: clothoids through the points with their courses, cubic "
      "distance over time with the given speeds, height a cubic (with the given vertical velocities, else "
      "shape-preserving), yaw along the path. The same place twice is a stop.")
      .def(py::init([](const ArrayLike& times_s, const ArrayLike& positions, const std::optional<ArrayLike>& velocities,
                       std::vector<std::optional<double>> courses_rad) {
             WaypointOptions o;
             o.times_s = number_list(times_s, "times_s");
             o.positions = vector3_list(positions, "positions");
             if (velocities) o.velocities = vector3_list(*velocities, "velocities");
             o.courses_rad = std::move(courses_rad);
             return std::make_shared<WaypointMotion>(o);
           }),
           py::arg("times_s"), py::arg("positions"), py::arg("velocities") = py::none(),
           py::arg("courses_rad") = std::vector<std::optional<double>>(),
           "times_s (N,), positions (N, 3) [m]; velocities (N, 3) [m/s]: none are estimated; courses_rad: N numbers or "
           "None, from x towards y, for points where the velocity is zero or not given; those left out are estimated. "
           "Raises ValueError naming index and value.")
      .def_property_readonly(
          "courses_rad",
          [](const WaypointMotion& self) {
            return to_array(Eigen::Map<const Eigen::VectorXd>(self.courses().data(),
                                                              static_cast<py::ssize_t>(self.courses().size())));
          },
          "(N,) as used, without steps of two pi.")
      .def_property_readonly("length", &WaypointMotion::length, "Of the horizontal path [m].");
  m.def(
      "example_drive",
      [] {
        const WaypointOptions o = loc::example_drive();
        py::dict d;
        d["times_s"] =
            to_array(Eigen::Map<const Eigen::VectorXd>(o.times_s.data(), static_cast<py::ssize_t>(o.times_s.size())));
        d["positions"] = to_rows(o.positions);
        d["velocities"] = to_rows(o.velocities);
        return d;
      },
      "Arguments of WaypointMotion: the drive of the example 'Visual-Inertial Odometry Using Synthetic Data'.");
}

void bind_look_at(py::module_& m) {
  const LookAtOptions preset;
  py::class_<LookAtMotion, Motion, std::shared_ptr<LookAtMotion>>(
      m, "LookAtMotion",
      "A camera (x right, y down, z forward) on a spline of positions that looks at a spline of points; both have two "
      "continuous derivatives. q_world_body_wxyz is that of the camera.")
      .def(py::init([](const ArrayLike& times_s, const ArrayLike& positions, const ArrayLike& look_at,
                       const std::optional<ArrayLike>& up, double smallest_distance_m, double smallest_angle_rad) {
             LookAtOptions o;
             o.times_s = number_list(times_s, "times_s");
             o.positions = vector3_list(positions, "positions");
             o.look_at = vector3_list(look_at, "look_at");
             if (up) o.up = vector3(*up, "up");
             o.smallest_distance_m = smallest_distance_m;
             o.smallest_angle_rad = smallest_angle_rad;
             return std::make_shared<LookAtMotion>(o);
           }),
           py::arg("times_s"), py::arg("positions"), py::arg("look_at"), py::kw_only(), py::arg("up") = py::none(),
           py::arg("smallest_distance_m") = preset.smallest_distance_m,
           py::arg("smallest_angle_rad") = preset.smallest_angle_rad,
           "times_s (N,), positions and look_at (N, 3) [m]; up (3,), by default z. Raises ValueError naming the time "
           "at which the camera comes closer to the point than smallest_distance_m, or looks more steeply up or down "
           "than smallest_angle_rad.");
}

void bind_shapes(py::module_& m) {
  py::class_<RestMotion, Motion, std::shared_ptr<RestMotion>>(m, "RestMotion", "Stays where it is.")
      .def(py::init([](const std::optional<Pose3>& T_world_body) {
             return std::make_shared<RestMotion>(loc::RestOptions{T_world_body.value_or(Pose3{})});
           }),
           py::arg("T_world_body") = py::none());

  const CircleOptions circle;
  py::class_<CircleMotion, Motion, std::shared_ptr<CircleMotion>>(
      m, "CircleMotion", "Horizontal circle with constant speed; body x along it. Negative speed: clockwise.")
      .def(py::init(
               [](const std::optional<ArrayLike>& center, double radius_m, double speed_mps, double start_angle_rad) {
                 CircleOptions o;
                 if (center) o.center = vector3(*center, "center");
                 o.radius_m = radius_m;
                 o.speed_mps = speed_mps;
                 o.start_angle_rad = start_angle_rad;
                 return std::make_shared<CircleMotion>(o);
               }),
           py::kw_only(), py::arg("center") = py::none(), py::arg("radius_m") = circle.radius_m,
           py::arg("speed_mps") = circle.speed_mps, py::arg("start_angle_rad") = circle.start_angle_rad);

  const FigureEightOptions eight;
  py::class_<FigureEightMotion, Motion, std::shared_ptr<FigureEightMotion>>(
      m, "FigureEightMotion", "x = length/2 sin u, y = width/2 sin 2u, z = height/2 sin u, u = 2 pi t/period.")
      .def(py::init([](const std::optional<ArrayLike>& center, double length_m, double width_m, double height_m,
                       double period_s) {
             FigureEightOptions o;
             if (center) o.center = vector3(*center, "center");
             o.length_m = length_m;
             o.width_m = width_m;
             o.height_m = height_m;
             o.period_s = period_s;
             return std::make_shared<FigureEightMotion>(o);
           }),
           py::kw_only(), py::arg("center") = py::none(), py::arg("length_m") = eight.length_m,
           py::arg("width_m") = eight.width_m, py::arg("height_m") = eight.height_m,
           py::arg("period_s") = eight.period_s);

  const HandHeldOptions hand;
  py::class_<HandHeldMotion, Motion, std::shared_ptr<HandHeldMotion>>(
      m, "HandHeldMotion",
      "A sensor shaken and turned by hand about a mean pose: sums of sines in six axes, frequencies and phases drawn "
      "at "
      "random. rotates and moves switch axes of the mean pose off, and leave the others as they were.")
      .def(py::init([](const loc::Random& random, const std::optional<Pose3>& T_world_mean, double angular_rate_rms,
                       double acceleration_rms, double lowest_hz, double highest_hz, double scale,
                       const std::array<bool, 3>& rotates, const std::array<bool, 3>& moves) {
             HandHeldOptions o;
             if (T_world_mean) o.T_world_mean = *T_world_mean;
             o.angular_rate_rms = angular_rate_rms;
             o.acceleration_rms = acceleration_rms;
             o.lowest_hz = lowest_hz;
             o.highest_hz = highest_hz;
             o.scale = scale;
             o.rotates = rotates;
             o.moves = moves;
             return std::make_shared<HandHeldMotion>(o, random);
           }),
           py::arg("random"), py::kw_only(), py::arg("T_world_mean") = py::none(),
           py::arg("angular_rate_rms") = hand.angular_rate_rms, py::arg("acceleration_rms") = hand.acceleration_rms,
           py::arg("lowest_hz") = hand.lowest_hz, py::arg("highest_hz") = hand.highest_hz,
           py::arg("scale") = hand.scale, py::arg("rotates") = hand.rotates, py::arg("moves") = hand.moves,
           "Takes a copy of random, which is left as it was.");
}

void bind_ground(py::module_& m) {
  py::class_<CarMotion, Motion, std::shared_ptr<CarMotion>>(
      m, "CarMotion",
      "phases (N, 3): duration [s], speed at the end [m/s], turn to the left [rad], each passed smoothly; by default "
      "round a block. Exactly at rest between speeds of zero.")
      .def(py::init([](const std::optional<ArrayLike>& phases, const std::optional<ArrayLike>& start, double course_rad,
                       double speed_mps, std::optional<int> cycles) {
             return std::make_shared<CarMotion>(
                 CarOptions{ground_course(CarOptions{}.course, phases, start, course_rad, speed_mps, cycles)});
           }),
           py::arg("phases") = py::none(), py::kw_only(), py::arg("start") = py::none(), py::arg("course_rad") = 0.0,
           py::arg("speed_mps") = 0.0, py::arg("cycles") = py::none());

  const PedestrianOptions walker;
  py::class_<PedestrianMotion, Motion, std::shared_ptr<PedestrianMotion>>(
      m, "PedestrianMotion",
      "phases as of CarMotion, by default round a square with pauses; bob, sway, nod and roll with the steps, glances "
      "to "
      "both sides.")
      .def(py::init([](const std::optional<ArrayLike>& phases, const std::optional<ArrayLike>& start, double course_rad,
                       double speed_mps, std::optional<int> cycles, double step_length_m, double walking_speed_mps,
                       double bob_m, double sway_m, double nod_rad, double roll_rad, double head_turn_rad,
                       double head_turn_s, double head_turn_period_s) {
             PedestrianOptions o;
             o.course = ground_course(o.course, phases, start, course_rad, speed_mps, cycles);
             o.step_length_m = step_length_m;
             o.walking_speed_mps = walking_speed_mps;
             o.bob_m = bob_m;
             o.sway_m = sway_m;
             o.nod_rad = nod_rad;
             o.roll_rad = roll_rad;
             o.head_turn_rad = head_turn_rad;
             o.head_turn_s = head_turn_s;
             o.head_turn_period_s = head_turn_period_s;
             return std::make_shared<PedestrianMotion>(o);
           }),
           py::arg("phases") = py::none(), py::kw_only(), py::arg("start") = py::none(), py::arg("course_rad") = 0.0,
           py::arg("speed_mps") = 0.0, py::arg("cycles") = py::none(), py::arg("step_length_m") = walker.step_length_m,
           py::arg("walking_speed_mps") = walker.walking_speed_mps, py::arg("bob_m") = walker.bob_m,
           py::arg("sway_m") = walker.sway_m, py::arg("nod_rad") = walker.nod_rad,
           py::arg("roll_rad") = walker.roll_rad, py::arg("head_turn_rad") = walker.head_turn_rad,
           py::arg("head_turn_s") = walker.head_turn_s, py::arg("head_turn_period_s") = walker.head_turn_period_s);
}

void bind_composed(py::module_& m) {
  py::class_<MountedMotion, Motion, std::shared_ptr<MountedMotion>>(
      m, "MountedMotion", "A sensor fixed to a moving body: its own pose, velocity, acceleration and rates.")
      .def(py::init([](const std::shared_ptr<Motion>& body, const Pose3& T_body_sensor) {
             return std::make_shared<MountedMotion>(body, T_body_sensor);
           }),
           py::arg("body").none(false), py::arg("T_body_sensor"));
  const RestFirstOptions preset;
  py::class_<RestFirstMotion, Motion, std::shared_ptr<RestFirstMotion>>(
      m, "RestFirstMotion",
      "A motion after a rest: then its own time begins to run, at a rate that goes smoothly from 0 to 1 in ease_s.")
      .def(py::init([](const std::shared_ptr<Motion>& motion, double rest_s, double ease_s) {
             return std::make_shared<RestFirstMotion>(motion, RestFirstOptions{rest_s, ease_s});
           }),
           py::arg("motion").none(false), py::kw_only(), py::arg("rest_s") = preset.rest_s,
           py::arg("ease_s") = preset.ease_s)
      .def("motion_time_s", &RestFirstMotion::motion_time_s, py::arg("time_s"),
           "The motion's own time at a time of this one.");
}

}  // namespace

void bind_motion(py::module_& m) {
  py::class_<MotionArrays>(m, "MotionArrays", "States of a motion at N times.")
      .def_readonly("times_s", &MotionArrays::times_s, "(N,)")
      .def_readonly("q_world_body_wxyz", &MotionArrays::q_world_body_wxyz, "(N, 4)")
      .def_readonly("position", &MotionArrays::position, "(N, 3) [m], of body in world")
      .def_readonly("velocity", &MotionArrays::velocity, "(N, 3) [m/s], in world")
      .def_readonly("acceleration", &MotionArrays::acceleration, "(N, 3) [m/s^2], in world, without gravity")
      .def_readonly("angular_velocity", &MotionArrays::angular_velocity, "(N, 3) [rad/s], in body axes")
      .def_readonly("angular_acceleration", &MotionArrays::angular_acceleration, "(N, 3) [rad/s^2], in body axes");
  py::class_<Motion, std::shared_ptr<Motion>>(m, "Motion",
                                              "True motion of a body: what simulated sensors measure, without noise. "
                                              "World has z up; vehicles: x forward, y left, z up.")
      .def_property_readonly("duration_s", &Motion::duration_s, "inf for motions that go on for ever")
      .def(
          "sample", &sample, py::arg("times_s"),
          "States at times_s, float64 (N,), each in [0, duration_s]; in any order. Raises ValueError naming the time.");
  bind_waypoints(m);
  bind_look_at(m);
  bind_shapes(m);
  bind_ground(m);
  bind_composed(m);
}

}  // namespace locpy
