#include "libloc/sim/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <tuple>
#include <utility>

#include "libloc/core/gps_time.hpp"
#include "libloc/sensors/rig.hpp"

namespace loc {
namespace {

using Order = SimulationOptions::Order;

// Streams in the order in which those of one time are made: the reference last, so that its truth knows the others.
enum StreamIndex : std::uint64_t { kImu, kMagnetometer, kOdometry, kGps, kReference, kCameras };

// Rank among measurements of equal time, as in StreamMerger.
int rank_of(StreamKind kind) {
  switch (kind) {
    case StreamKind::kMagnetometer:
      return 0;
    case StreamKind::kImage:
      return 1;
    case StreamKind::kFeatures:
      return 2;
    case StreamKind::kGps:
      return 3;
    case StreamKind::kOdometry:
      return 4;
    case StreamKind::kReference:
      return 5;
    case StreamKind::kImu:
      return 6;
  }
  return 7;
}

// A deviation that a normal number never exceeds by so many times.
constexpr double kNever = 10;

struct Stream {
  std::string name;
  StreamClock clock;
  std::optional<StreamTick> tick;  // the next one; none: the stream has ended
  // The measurement of a tick, with times as if the clock were perfect and since the start; none: the sensor has
  // nothing to say.
  std::function<std::optional<Measurement>(const StreamTick&)> measure;
  // The stamp, or the arrival, is at most so much earlier than the tick's [ns].
  TimeNs early_ns = 0;
  TimeNs last_stamp_ns = kNoTime;
  std::int64_t made = 0;
  std::int64_t lost = 0;
  std::int64_t none = 0;
};

// Time, rank, running number.
using Key = std::tuple<TimeNs, int, std::int64_t>;

struct Waiting {
  Measurement measurement;
  std::optional<SimulationTruth> truth;
  std::optional<FrameTruth> frame;
};

}  // namespace

struct Simulation::Implementation {
  Implementation(const Scenario& given, std::uint64_t seed, const SimulationOptions& opts);
  void add(const std::string& name, const StreamClockModel& clock, double rate_hz, Random random, TimeNs early_ns,
           std::function<std::optional<Measurement>(const StreamTick&)> measure);
  const MotionState& state_at(TimeNs time_ns);
  bool advance();
  void put(Stream& stream, const StreamTick& tick, Measurement measurement);
  TimeNs earliest_key(const Stream& stream) const;
  Measurement reference(const StreamTick& tick);

  FrameTruth frame;
  std::optional<FrameTruth> measured_frame;  // of the features that are being put
  MotionState state;
  SimulationTruth truth;
  Scenario scenario;
  std::optional<VisualOdometrySimulator> odometry;
  std::optional<ImuSimulator> imu;
  TimeNs end_ns;
  TimeNs state_time_ns = kNoTime;
  TimeNs simulated_ns = 0;
  std::int64_t number = 0;
  std::vector<CameraSimulator> cameras;
  std::vector<Stream> streams;
  std::map<Key, Waiting> waiting;
  Scene world;
  Rig rig;
  std::optional<MagnetometerSimulator> magnetometer;
  std::optional<GpsSimulator> gps;
  SimulationOptions options;
};

Simulation::Implementation::Implementation(const Scenario& given, std::uint64_t seed, const SimulationOptions& opts)
    : scenario((given.check(), given)), end_ns(from_seconds(scenario.duration_s)), rig(scenario.rig()), options(opts) {
  // All are forked whether their sensors are on or not, so that switching one leaves the others as they were.
  Random root(seed);
  const auto fork = [&](std::uint64_t index) {
    Random stream = root.fork(index);
    const Random sensor = stream.fork(0);
    return std::pair{sensor, stream.fork(1)};
  };
  const auto [imu_random, imu_clock] = fork(kImu);
  const auto [magnetometer_random, magnetometer_clock] = fork(kMagnetometer);
  const auto [odometry_random, odometry_clock] = fork(kOdometry);
  const auto [gps_random, gps_clock] = fork(kGps);
  const auto [unused, reference_clock] = fork(kReference);

  const ScenarioStreams& on = scenario.streams;
  if (on.imu) {
    imu.emplace(scenario.imu, imu_random);
    add("imu", scenario.imu_clock, scenario.imu.rate_hz, imu_clock, 0,
        [this](const StreamTick& t) { return Measurement(imu->measure(*scenario.motion, t.time_ns)); });
  }
  if (on.magnetometer) {
    magnetometer.emplace(scenario.magnetometer, magnetometer_random);
    add("magnetometer", scenario.magnetometer_clock, scenario.magnetometer.rate_hz, magnetometer_clock, 0,
        [this](const StreamTick& t) { return Measurement(magnetometer->measure(state_at(t.time_ns))); });
  }
  if (on.odometry) {
    odometry.emplace(scenario.odometry, odometry_random);
    add("odometry", scenario.odometry_clock, scenario.odometry.rate_hz, odometry_clock,
        std::max<TimeNs>(0, from_seconds(-scenario.odometry.stamp_delay_s)),
        [this](const StreamTick& t) { return odometry->measure(state_at(t.time_ns)); });
  }
  if (on.gps) {
    GpsModel model = scenario.gps;
    if (const auto start = gps_from_unix(scenario.start_time_ns)) model.start_gps_time_ns = *start;
    gps.emplace(model, gps_random);
    add("gps", scenario.gps_clock, model.rate_hz, gps_clock, std::max<TimeNs>(0, from_seconds(-model.stamp_delay_s)),
        [this](const StreamTick& t) { return gps->measure(state_at(t.time_ns)); });
  }
  if (on.features && !scenario.cameras.empty()) {
    world = scenario.world();
    cameras.reserve(scenario.cameras.size());
    for (std::size_t i = 0; i < scenario.cameras.size(); ++i) {
      const ScenarioCamera& camera = scenario.cameras[i];
      const auto [camera_random, camera_clock] = fork(kCameras + i);
      CameraModel model = camera.model;
      model.start_time_ns = 0;
      cameras.emplace_back(model, camera.calibration, world, camera_random, static_cast<std::int32_t>(i));
      const double early_s = std::max(0.0, camera.calibration.time_offset_s) + kNever * model.stamp_jitter_s;
      add("features" + std::to_string(i), camera.clock, model.rate_hz, camera_clock, from_seconds(early_s),
          [this, i](const StreamTick& t) {
            SimulatedFrame seen = cameras[i].observe(state_at(t.time_ns));
            measured_frame = FrameTruth{seen.time_s, seen.T_world_camera, std::move(seen.truth)};
            FeaturesMeasurement m = std::move(seen.measurement);
            m.host_time_ns = t.time_ns + from_seconds(scenario.cameras[i].latency_s);
            return Measurement(std::move(m));
          });
    }
  }
  if (on.reference) {
    add("reference", {}, scenario.reference_rate_hz, reference_clock, 0,
        [this](const StreamTick& t) { return reference(t); });
  }
}

void Simulation::Implementation::add(const std::string& name, const StreamClockModel& clock, double rate_hz,
                                     Random random, TimeNs early_ns,
                                     std::function<std::optional<Measurement>(const StreamTick&)> measure) {
  Stream stream{name, StreamClock(clock, rate_hz, random), std::nullopt, std::move(measure)};
  // A wobble may bring a sample earlier than the minimum delay.
  stream.early_ns = options.order == Order::kTime ? early_ns : std::max<TimeNs>(0, clock.delay.wobble_ns);
  const StreamTick first = stream.clock.next();
  if (first.time_ns < end_ns) stream.tick = first;
  streams.push_back(std::move(stream));
}

const MotionState& Simulation::Implementation::state_at(TimeNs time_ns) {
  if (time_ns != state_time_ns) {
    state = scenario.motion->at(to_seconds(time_ns));
    state_time_ns = time_ns;
  }
  return state;
}

Measurement Simulation::Implementation::reference(const StreamTick& tick) {
  const MotionState& s = state_at(tick.time_ns);
  ReferenceMeasurement m;
  m.time_ns = tick.time_ns;
  m.q_world_body = s.T_world_body.rotation;
  m.position = s.T_world_body.translation;
  m.velocity = s.velocity;
  return m;
}

// The measurement with the stream's clock in its times.
void Simulation::Implementation::put(Stream& stream, const StreamTick& tick, Measurement measurement) {
  Stamp& stamp = stamp_of(measurement);
  const TimeNs start = scenario.start_time_ns;
  const TimeNs stamp_delay = stamp.time_ns - tick.time_ns;
  const TimeNs arrival = (stamp.host_time_ns == kNoTime ? tick.time_ns : stamp.host_time_ns) + tick.delay_ns;
  stamp.time_ns = start + tick.stamp_ns + stamp_delay;
  stamp.host_time_ns = start + arrival;
  stamp.sequence = tick.sequence;
  std::optional<SimulationTruth> known;
  if (auto* odometry_measurement = std::get_if<OdometryMeasurement>(&measurement);
      odometry_measurement != nullptr && odometry_measurement->start_time_ns != kNoTime) {
    odometry_measurement->start_time_ns = start + stream.last_stamp_ns + stamp_delay;
  } else if (std::holds_alternative<ReferenceMeasurement>(measurement)) {
    known.emplace();
    known->time_ns = stamp.time_ns;
    known->state = state_at(tick.time_ns);
    if (imu) {
      known->gyroscope_bias = rig.imu->gyroscope.matrix * imu->truth().gyroscope_bias;
      known->accelerometer_bias = rig.imu->accelerometer.matrix * imu->truth().accelerometer_bias;
    }
    if (odometry) {
      known->odometry_scale = odometry->truth().scale;
      known->odometry_drift = odometry->truth().drift;
    }
    if (gps) known->gps_error = gps->truth().coloured_error;
  }
  const TimeNs time = options.order == Order::kTime ? stamp.time_ns : stamp.host_time_ns;
  const int rank = rank_of(kind_of(measurement));
  waiting.emplace(Key{time, rank, number++},
                  Waiting{std::move(measurement), std::move(known), std::exchange(measured_frame, std::nullopt)});
}

TimeNs Simulation::Implementation::earliest_key(const Stream& stream) const {
  if (!stream.tick) return std::numeric_limits<TimeNs>::max();
  const TimeNs at = options.order == Order::kTime ? stream.tick->stamp_ns : stream.tick->time_ns;
  return scenario.start_time_ns + at - stream.early_ns;
}

// One more sample of the stream whose turn it is. False at the end.
bool Simulation::Implementation::advance() {
  Stream* first = nullptr;
  for (Stream& s : streams) {
    if (s.tick && (first == nullptr || s.tick->time_ns < first->tick->time_ns)) first = &s;
  }
  if (first == nullptr) return false;
  const StreamTick tick = *first->tick;
  simulated_ns = std::max(simulated_ns, tick.time_ns);
  // Measured even when it is lost on the way: the sensor does not know.
  std::optional<Measurement> measurement = first->measure(tick);
  if (!measurement) {
    ++first->none;
  } else if (tick.lost) {
    ++first->lost;
    measured_frame.reset();
  } else {
    ++first->made;
    put(*first, tick, std::move(*measurement));
  }
  first->last_stamp_ns = tick.stamp_ns;
  const StreamTick next = first->clock.next();
  first->tick.reset();
  if (next.time_ns < end_ns) first->tick = next;
  return true;
}

Simulation::Simulation(const Scenario& scenario, std::uint64_t seed, const SimulationOptions& options)
    : implementation_(std::make_unique<Implementation>(scenario, seed, options)) {}
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;
Simulation::~Simulation() = default;

std::optional<Measurement> Simulation::next() {
  Implementation& i = *implementation_;
  while (true) {
    if (!i.waiting.empty()) {
      TimeNs until = std::numeric_limits<TimeNs>::max();
      for (const Stream& s : i.streams) until = std::min(until, i.earliest_key(s));
      // What is still to come may share the time and go first.
      if (std::get<0>(i.waiting.begin()->first) < until) break;
    }
    if (!i.advance() && i.waiting.empty()) return std::nullopt;
  }
  Waiting out = std::move(i.waiting.begin()->second);
  i.waiting.erase(i.waiting.begin());
  if (out.truth) i.truth = *out.truth;
  if (out.frame) i.frame = std::move(*out.frame);
  return std::move(out.measurement);
}

const SimulationTruth& Simulation::truth() const {
  return implementation_->truth;
}

const FrameTruth& Simulation::frame() const {
  return implementation_->frame;
}

const Scene& Simulation::world() const {
  return implementation_->world;
}

double Simulation::progress() const {
  const Implementation& i = *implementation_;
  const bool ended =
      std::none_of(i.streams.begin(), i.streams.end(), [](const Stream& s) { return s.tick.has_value(); });
  return ended ? 1.0 : static_cast<double>(i.simulated_ns) / static_cast<double>(i.end_ns);
}

NamedCounts Simulation::counts() const {
  NamedCounts counts;
  for (const Stream& s : implementation_->streams) {
    counts.push_back({s.name + ".made", s.made});
    if (s.lost > 0) counts.push_back({s.name + ".lost", s.lost});
    if (s.none > 0) counts.push_back({s.name + ".none", s.none});
  }
  if (implementation_->imu && implementation_->imu->truth().saturated > 0) {
    counts.push_back({"imu.saturated", implementation_->imu->truth().saturated});
  }
  return counts;
}

const Scenario& Simulation::scenario() const {
  return implementation_->scenario;
}

SimulatedRecording simulate(const Scenario& scenario, std::uint64_t seed, const SimulationOptions& options) {
  Simulation simulation(scenario, seed, options);
  SimulatedRecording recording;
  while (auto m = simulation.next()) {
    if (std::holds_alternative<ReferenceMeasurement>(*m)) recording.truth.push_back(simulation.truth());
    recording.measurements.push_back(std::move(*m));
  }
  recording.counts = simulation.counts();
  return recording;
}

}  // namespace loc
