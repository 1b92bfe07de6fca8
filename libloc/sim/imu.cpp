#include "libloc/sim/imu.hpp"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;

// Gauss-Legendre, eight points, positive half: abscissa and weight on [-1, 1]. Abramowitz and Stegun, table 25.4.
constexpr std::array<std::array<double, 2>, 4> kGaussLegendre = {{{0.183434642495649805, 0.362683783378361983},
                                                                  {0.525532409916328986, 0.313706645877887287},
                                                                  {0.796666477413626740, 0.222381034453374471},
                                                                  {0.960289856497536232, 0.101228536290376259}}};

// Each a generator of its own, so that one kind of error can be switched on without changing the others.
enum Part : std::uint64_t { kGyroscope, kAccelerometer };
enum Draw : std::uint64_t { kWhite, kTurnOn, kWalk, kInstability };

}  // namespace

void InertialTriadModel::check(std::string_view name) const {
  const std::string at = std::string(name) + ".";
  require_not_negative(at + "noise_density", noise_density);
  require_not_negative(at + "random_walk", random_walk);
  require_not_negative(at + "instability_sigma", instability_sigma);
  require_positive(at + "instability_time_s", instability_time_s);
  require_not_negative(at + "turn_on_bias_sigma", turn_on_bias_sigma);
  for (const double b : constant_bias) require_finite(at + "constant_bias", b);
  require(matrix.allFinite() && std::abs(matrix.determinant()) > 1e-6, at + "matrix: must be finite and not singular");
  require(range > 0, at + "range", range, "must be positive");
  require_not_negative(at + "resolution", resolution);
  require(resolution <= range, at + "resolution", resolution, "must not exceed the range");
}

const char* sampling_name(ImuSampleModel sampling) {
  switch (sampling) {
    case ImuSampleModel::kPoint:
      return "point";
    case ImuSampleModel::kIntervalMean:
      return "interval-mean";
    case ImuSampleModel::kIncrement:
      return "increment";
  }
  return "unknown";
}

ImuSampleModel parse_sampling(const std::string& name) {
  for (const ImuSampleModel s : {ImuSampleModel::kPoint, ImuSampleModel::kIntervalMean, ImuSampleModel::kIncrement}) {
    if (name == sampling_name(s)) return s;
  }
  throw std::invalid_argument("sampling = '" + name + "': must be point, interval-mean or increment");
}

ImuModel ImuModel::consumer() {
  ImuModel m;
  m.gyroscope.noise_density = 1.7e-4;
  m.gyroscope.random_walk = 2e-5;
  m.gyroscope.instability_sigma = 1e-4;
  m.gyroscope.turn_on_bias_sigma = 1e-2;
  m.gyroscope.range = 2000 * kRadiansPerDegree;
  m.gyroscope.resolution = m.gyroscope.range / 32768;
  m.accelerometer.noise_density = 2e-3;
  m.accelerometer.random_walk = 3e-4;
  m.accelerometer.instability_sigma = 2e-3;
  m.accelerometer.turn_on_bias_sigma = 5e-2;
  m.accelerometer.range = 16 * 9.80665;
  m.accelerometer.resolution = m.accelerometer.range / 32768;
  m.sampling = ImuSampleModel::kIntervalMean;
  return m;
}

ImuModel ImuModel::vio_example() {
  ImuModel m;
  m.rate_hz = 100;
  m.gyroscope.noise_density = density_from_one_sided(0.0573 * kRadiansPerDegree);
  m.gyroscope.constant_bias.setConstant(2 * kRadiansPerDegree);
  m.gyroscope.range = 250 * kRadiansPerDegree;
  m.gyroscope.resolution = 0.0625 * kRadiansPerDegree;
  m.accelerometer.noise_density = density_from_one_sided(0.01);
  m.accelerometer.range = 19.6;
  m.accelerometer.resolution = 0.0024;
  m.gravity = {0, 0, -9.81};
  return m;
}

ImuModel ImuModel::perfect(double rate_hz) {
  ImuModel m;
  m.rate_hz = rate_hz;
  return m;
}

void ImuModel::check() const {
  require_positive("imu.rate_hz", rate_hz);
  require(rate_hz <= 1e5, "imu.rate_hz", rate_hz, "must not exceed 1e5");
  gyroscope.check("imu.gyroscope");
  accelerometer.check("imu.accelerometer");
  require(accelerometer_sign == 1 || accelerometer_sign == -1, "imu.accelerometer_sign", accelerometer_sign,
          "must be 1 or -1");
  for (const double g : gravity) require_finite("imu.gravity", g);
}

ImuCalibration ImuModel::calibration() const {
  check();
  ImuCalibration c;
  c.rate_hz = rate_hz;
  c.noise = {.gyroscope_noise_density = gyroscope.noise_density,
             .gyroscope_random_walk = gyroscope.random_walk,
             .accelerometer_noise_density = accelerometer.noise_density,
             .accelerometer_random_walk = accelerometer.random_walk,
             .gyroscope_bias_sigma = std::hypot(gyroscope.turn_on_bias_sigma, gyroscope.instability_sigma,
                                                gyroscope.constant_bias.cwiseAbs().maxCoeff()),
             .accelerometer_bias_sigma = std::hypot(accelerometer.turn_on_bias_sigma, accelerometer.instability_sigma,
                                                    accelerometer.constant_bias.cwiseAbs().maxCoeff())};
  for (const std::string_view field : kImuNoiseFields) c.noise_measured.emplace_back(field);
  c.gyroscope.matrix = gyroscope.matrix.inverse();
  c.accelerometer.matrix = accelerometer_sign * accelerometer.matrix.inverse();
  return c;
}

ImuInput imu_point(const MotionState& state, const Eigen::Vector3d& gravity) {
  return {state.angular_velocity, state.T_world_body.rotation.conjugate() * (state.acceleration - gravity)};
}

ImuInput imu_interval_mean(const Motion& motion, double begin_s, double end_s, const Eigen::Vector3d& gravity) {
  require(begin_s < end_s, "end_s", end_s, "must be after begin_s");
  const double middle = (begin_s + end_s) / 2;
  const double half = (end_s - begin_s) / 2;
  ImuInput sum;
  for (const auto& [abscissa, weight] : kGaussLegendre) {
    for (const double sign : {-1.0, 1.0}) {
      const ImuInput at = imu_point(motion.at(middle + sign * abscissa * half), gravity);
      sum.angular_velocity += weight / 2 * at.angular_velocity;
      sum.specific_force += weight / 2 * at.specific_force;
    }
  }
  return sum;
}

ImuInput imu_increment(const MotionState& begin, const MotionState& end, const Eigen::Vector3d& gravity) {
  const double dt = end.time_s - begin.time_s;
  require(dt > 0, "end.time_s", end.time_s, "must be after begin.time_s");
  const Eigen::Vector3d turn = so3::boxminus(end.T_world_body.rotation, begin.T_world_body.rotation);
  const Eigen::Quaterniond half_way = so3::boxplus(begin.T_world_body.rotation, turn / 2);
  return {turn / dt, half_way.conjugate() * ((end.velocity - begin.velocity) / dt - gravity)};
}

ImuSimulator::Triad::Triad(const InertialTriadModel& model, Random random)
    : white(random.fork(kWhite)),
      fixed_bias(model.constant_bias + model.turn_on_bias_sigma * random.fork(kTurnOn).normal3()),
      walk(model.random_walk, random.fork(kWalk)),
      instability(model.instability_sigma, model.instability_time_s, random.fork(kInstability)) {}

Eigen::Vector3d ImuSimulator::Triad::measure(const InertialTriadModel& model, const Eigen::Vector3d& input,
                                             double rate_hz, bool& saturated) {
  const Eigen::Vector3d bias = fixed_bias + walk.value() + instability.value();
  const Eigen::Vector3d noise = model.noise_density * std::sqrt(rate_hz) * white.normal3();
  const RoundedReading reading = round_reading(model.matrix * input + bias + noise, model.range, model.resolution);
  saturated = saturated || reading.saturated;
  return reading.value;
}

ImuSimulator::ImuSimulator(const ImuModel& model, Random random)
    : model_((model.check(), model)),
      gyroscope_(model_.gyroscope, random.fork(kGyroscope)),
      accelerometer_(model_.accelerometer, random.fork(kAccelerometer)) {}

ImuMeasurement ImuSimulator::measure(const Motion& motion, TimeNs time_ns) {
  const MotionState state = motion.at(to_seconds(time_ns));
  ImuInput input;
  if (model_.sampling == ImuSampleModel::kPoint || !last_state_) {
    input = imu_point(state, model_.gravity);
  } else if (model_.sampling == ImuSampleModel::kIntervalMean) {
    input = imu_interval_mean(motion, last_state_->time_s, state.time_s, model_.gravity);
  } else {
    input = imu_increment(*last_state_, state, model_.gravity);
  }
  ImuMeasurement m = measure(input, time_ns);
  last_state_ = state;
  return m;
}

ImuMeasurement ImuSimulator::measure(const ImuInput& input, TimeNs time_ns) {
  require(input.angular_velocity.allFinite() && input.specific_force.allFinite(), "input: must be finite");
  if (last_time_ns_ != kNoTime) {
    require(time_ns > last_time_ns_, "time_ns", static_cast<double>(time_ns), "must be after the last sample's");
    const double dt = to_seconds(time_ns - last_time_ns_);
    for (Triad* triad : {&gyroscope_, &accelerometer_}) {
      triad->walk.advance(dt);
      triad->instability.advance(dt);
    }
  }
  last_time_ns_ = time_ns;
  bool saturated = false;
  ImuMeasurement m;
  m.time_ns = time_ns;
  m.angular_velocity = gyroscope_.measure(model_.gyroscope, input.angular_velocity, model_.rate_hz, saturated);
  m.specific_force = accelerometer_.measure(model_.accelerometer, model_.accelerometer_sign * input.specific_force,
                                            model_.rate_hz, saturated);
  truth_.gyroscope_bias = gyroscope_.fixed_bias + gyroscope_.walk.value() + gyroscope_.instability.value();
  truth_.accelerometer_bias =
      accelerometer_.fixed_bias + accelerometer_.walk.value() + accelerometer_.instability.value();
  truth_.saturated += saturated ? 1 : 0;
  return m;
}

}  // namespace loc
