#include "tools/support/simulate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>

#include "libloc/core/check.hpp"
#include "libloc/io/recording_writer.hpp"
#include "libloc/io/rig_yaml.hpp"
#include "libloc/io/scenario_yaml.hpp"
#include "libloc/io/simulation_source.hpp"
#include "libloc/io/text_file.hpp"
#include "libloc/io/tracks.hpp"
#include "libloc/io/tum.hpp"
#include "libloc/sim/scenario_parameters.hpp"
#include "libloc/sim/simulation.hpp"
#include "msgs/lcm_log_writer.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

namespace fs = std::filesystem;

bool is_log(const fs::path& path) {
  return path.extension() == ".lcm" || path.extension() == ".log";
}

void choose_streams(Scenario& scenario, const std::string& list) {
  scenario.streams = {false, false, false, false, false, false};
  for (std::size_t at = 0; at <= list.size();) {
    const std::size_t end = std::min(list.find(',', at), list.size());
    const std::string name = list.substr(at, end - at);
    at = end + 1;
    constexpr std::array kAll = {"imu", "magnetometer", "odometry", "gps", "features", "reference"};
    if (std::find(kAll.begin(), kAll.end(), name) == kAll.end()) {
      throw UsageError("--streams: '" + name + "' is none of imu, magnetometer, odometry, gps, features, reference");
    }
    set_parameter(scenario, "streams." + name, "true");
  }
}

// Truth as columns, one line for each reference measurement. What a scenario does not have is empty.
class TruthFile {
 public:
  explicit TruthFile(const fs::path& path) : file_(path) {
    file_.stream() << "time_ns,q_world_body_w,q_world_body_x,q_world_body_y,q_world_body_z";
    for (const char* triad : {"position_%_m", "velocity_%_m_s", "acceleration_%_m_s2", "angular_velocity_%_rad_s",
                              "gyroscope_bias_%_rad_s", "accelerometer_bias_%_m_s2"}) {
      heading(triad, "xyz");
    }
    file_.stream() << ",odometry_scale";
    heading("odometry_drift_%", "xyz");
    heading("gps_error_%_m", "enu");
    file_.stream() << '\n';
  }

  void write(const SimulationTruth& t) {
    line_ = std::to_string(t.time_ns);
    const Eigen::Quaterniond& q = t.state.T_world_body.rotation;
    for (const double x : {q.w(), q.x(), q.y(), q.z()}) add(x);
    for (const Eigen::Vector3d& v : {t.state.T_world_body.translation, t.state.velocity, t.state.acceleration,
                                     t.state.angular_velocity, t.gyroscope_bias, t.accelerometer_bias}) {
      add(v);
    }
    add(t.odometry_scale);
    add(t.odometry_drift);
    add(t.gps_error);
    file_.stream() << line_ << '\n';
  }
  void commit() { file_.commit(); }

 private:
  void heading(const std::string& name, const std::string& axes) {
    for (const char axis : axes) {
      std::string column = name;
      column.replace(column.find('%'), 1, 1, axis);
      file_.stream() << ',' << column;
    }
  }
  void add(double x) {
    line_ += ',';
    if (!std::isnan(x)) io::append_number(line_, x);
  }
  void add(const Eigen::Vector3d& v) {
    for (const double x : v) add(x);
  }

  io::AtomicFile file_;
  std::string line_;
};

// Once a second where a person may look.
class Progress {
 public:
  void tell(const Simulation& simulation) {
    const TimeNs now = steady_now();
    if (now - last_ns_ < 1'000'000'000) return;
    last_ns_ = now;
    log_info("event=progress percent={}", static_cast<int>(100 * simulation.progress()));
  }

 private:
  TimeNs last_ns_ = steady_now();
};

}  // namespace

SimulationPlan plan_simulation(const SimulateRequest& request) {
  try {
    ScenarioFile file;
    if (!request.file.empty()) file = read_scenario_file(request.file);
    const std::string name = request.scenario.empty() ? file.scenario.value_or("") : request.scenario;
    if (name.empty()) throw UsageError("no scenario: name one with --scenario (--list tells them) or in --config");
    SimulationPlan plan;
    plan.scenario = make_scenario(name, request.duration_s.value_or(file.duration_s.value_or(kUnknown)));
    plan.seed = request.seed.value_or(file.seed.value_or(plan.seed));
    file.apply(plan.scenario);
    if (!request.streams.empty()) choose_streams(plan.scenario, request.streams);
    for (const auto& [parameter, value] : request.parameters) set_parameter(plan.scenario, parameter, value);
    if (!request.tracks.empty() || request.pictures.any()) {
      require(!plan.scenario.cameras.empty(), "--tracks, --video, --images: the scenario has no camera");
      plan.scenario.streams.features = true;
    }
    plan.scenario.check();
    return plan;
  } catch (const DataError& error) {
    throw UsageError(error.what());
  }
}

bool write_simulation(const SimulationPlan& plan, const SimulateRequest& request) {
  const bool log = is_log(request.out);
  const Rig rig = plan.scenario.rig();
  std::unique_ptr<RecordingWriter> writer;
  fs::path beside;  // of the files that belong to the recording
  if (!request.out.empty()) {
    writer = log ? create_lcm_log(request.out) : create_euroc(request.out, rig);
    beside = log ? fs::path(request.out + ".") : writer->unfinished() / "";
  }
  const auto named = [&](const char* name) { return fs::path(beside.string() + name); };
  std::optional<TruthFile> truth;
  if (writer && plan.scenario.streams.reference) truth.emplace(named("truth.csv"));
  Trajectory trajectory;
  std::vector<FeaturesMeasurement> features;

  Simulation simulation(plan.scenario, plan.seed,
                        {log ? SimulationOptions::Order::kArrival : SimulationOptions::Order::kTime});
  std::optional<SimulationPictures> pictures;
  if (request.pictures.any()) {
    PictureRequest wanted = request.pictures;
    if (writer && !log) wanted.recording = writer->unfinished();
    pictures.emplace(wanted, simulation);
  }
  Progress progress;
  while (const auto m = simulation.next()) {
    if (stop_requested()) return false;
    if (const auto* reference = std::get_if<ReferenceMeasurement>(&*m); reference != nullptr && writer) {
      const SimulationTruth& t = simulation.truth();
      writer->write(*reference, {t.gyroscope_bias, t.accelerometer_bias});
      truth->write(t);
      trajectory.push_back(t.time_ns, t.state.T_world_body);
    } else if (writer) {
      writer->write(*m);
    }
    if (const auto* frame = std::get_if<FeaturesMeasurement>(&*m)) {
      if (frame->camera == 0 && !request.tracks.empty()) features.push_back(*frame);
      if (pictures) pictures->add(*frame, simulation.frame(), writer.get());
    }
    progress.tell(simulation);
  }
  log_info("event=simulated {}", format_counts(simulation.counts()));
  if (pictures) pictures->finish();
  if (!request.tracks.empty()) write_tracks(request.tracks, to_track_frames(features));
  if (!request.rig.empty()) write_rig(request.rig, rig);
  if (!writer) return true;
  if (truth) truth->commit();
  if (!trajectory.empty()) write_tum(named("truth.tum"), trajectory);
  write_rig(named("rig.yaml"), rig);
  write_scenario_file(named("scenario.yaml"), plan.scenario, plan.seed);
  for (const NamedCount& count : writer->counts()) {
    if (count.name.ends_with(".no_room")) {
      log_warning("event=not_in_recording {}={} reason=\"a folder has no room for them: an LCM log or --tracks has\"",
                  count.name, count.value);
    }
  }
  writer->finish();
  return true;
}

void publish_simulation(const SimulationPlan& plan, const SimulateRequest& request, DriverOptions options) {
  if (!request.rig.empty()) write_rig(request.rig, plan.scenario.rig());
  options.source_name = "simulation " + plan.scenario.name + " seed " + std::to_string(plan.seed);
  options.keep_sequence = true;
  Driver driver(options, std::make_unique<SimulationSource>(
                             Simulation(plan.scenario, plan.seed, {SimulationOptions::Order::kArrival})));
  driver.run();
  log_info("event=published interrupted={} {}", stop_requested(), format_counts(driver.counts()));
}

}  // namespace loc
