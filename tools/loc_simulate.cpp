// loc-simulate: sensors on a known motion, written as a recording with its truth or published as if they were real.

#include <CLI/CLI.hpp>
#include <array>
#include <charconv>
#include <cmath>
#include <iostream>

#include "libloc/core/check.hpp"
#include "libloc/sim/scenario_parameters.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"
#include "tools/support/simulate.hpp"

namespace {

// "90", "90s", "500ms", "2min", "1h" in seconds.
double parse_duration(const std::string& option, const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string unit(end, text.data() + text.size());
  const double factor = unit.empty() || unit == "s" ? 1
                        : unit == "ms"              ? 1e-3
                        : unit == "min"             ? 60
                        : unit == "h"               ? 3600
                                                    : std::nan("");
  if (error != std::errc{} || !std::isfinite(value * factor)) {
    throw loc::UsageError(option + " '" + text + "': must be a number with s, ms, min or h");
  }
  return value * factor;
}

// Options that stand for one parameter.
struct Shortcut {
  const char* option;
  const char* parameter;
  const char* text;
  bool is_time;
};
constexpr std::array kShortcuts = {
    Shortcut{"--imu", "imu.sampling", "point, interval-mean or increment", false},
    Shortcut{"--accelerometer-sign", "imu.accelerometer_sign", "1: specific force; -1: its negative", false},
    Shortcut{"--vo-scale", "odometry.scale", "Odometry's units per metre", false},
    Shortcut{"--vo-scale-walk", "odometry.scale_walk", "Random walk of the scale's logarithm [1/sqrt(s)]", false},
    Shortcut{"--vo-latency", "odometry.latency_s", "Arrival after the frame (0.1, 100ms)", true},
    Shortcut{"--vo-outliers", "odometry.outlier_fraction", "Share of frames", false},
    Shortcut{"--vo-outage", "odometry.outages", "Begin and end, 20:30,40:45 [s]", false},
    Shortcut{"--vo-relative", "odometry.relative", "true: pose since the frame before", false},
    Shortcut{"--gps-latency", "gps.latency_s", "Arrival after the time of validity", true},
    Shortcut{"--gps-outage", "gps.outages", "Begin and end, 20:30 [s]", false},
};

void list_scenarios() {
  for (const loc::ScenarioInfo& info : loc::scenario_list()) std::cout << info.name << "\t" << info.description << "\n";
}

void list_parameters(const loc::Scenario& scenario) {
  for (const loc::ScenarioParameter& p : loc::parameters(scenario)) {
    std::cout << p.name << "\t" << p.value << "\t" << p.unit << "\n";
  }
}

}  // namespace

int main(int argc, char** argv) {
  loc::SimulateRequest request;
  loc::DriverOptions driver;
  std::string duration;
  std::string speed = "1";
  std::int64_t seed = 1;
  std::vector<std::string> settings;
  std::array<std::string, kShortcuts.size()> shortcuts;
  bool list = false;
  bool list_all_parameters = false;
  bool live = false;
  loc::Program program("loc-simulate",
                       "Simulates sensors on a known motion: a recording with its truth (--out), or live (--live).");
  CLI::App& app = program.app();
  driver.lcm_url.clear();
  program.add_lcm_url(driver.lcm_url);
  app.add_flag("--list", list, "Tells the scenarios and ends");
  app.add_flag("--parameters", list_all_parameters, "Tells all parameters of the scenario, as they are set, and ends");
  app.add_option("--scenario", request.scenario, "Name of a scenario");
  CLI::Option* seed_option =
      app.add_option("--seed", seed, "The same seed gives the same recording")->capture_default_str();
  app.add_option("--duration", duration, "60s, 2min; 60 s unless given");
  app.add_option("--config", request.file, "Scenario file: name, seed, duration, parameters")->check(CLI::ExistingFile);
  app.add_option("--set", settings, "NAME=VALUE, any parameter (--parameters tells them)");
  app.add_option("--streams", request.streams, "imu,magnetometer,odometry,gps,features,reference: these alone");
  for (std::size_t i = 0; i < kShortcuts.size(); ++i) {
    app.add_option(kShortcuts[i].option, shortcuts[i], kShortcuts[i].text);
  }
  app.add_option("--out", request.out, "New recording: a folder, or an LCM log (*.lcm, *.log)");
  app.add_option("--tracks", request.tracks, "Writes the first camera's features as a tracks file");
  app.add_option("--video", request.pictures.video, "Draws the first camera's features (*.mp4, *.avi); needs OpenCV");
  app.add_flag("--rendered", request.pictures.rendered, "With --video: over pictures of the simulated world");
  app.add_flag("--images", request.pictures.images, "The recording gets pictures of the simulated world");
  app.add_option("--write-rig", request.rig, "Writes the calibration of the sensors (rig.yaml)");
  app.add_flag("--live", live, "Publishes on LCM, paced by the time stamps");
  app.add_option("--speed", speed, "With --live: 1 as in reality, N times as fast")->capture_default_str();

  return program.run(argc, argv, [&] {
    if (list) {
      list_scenarios();
      return loc::kExitOk;
    }
    if (seed < 0) throw loc::UsageError("--seed " + std::to_string(seed) + ": must not be negative");
    if (seed_option->count() > 0) request.seed = static_cast<std::uint64_t>(seed);
    if (!duration.empty()) request.duration_s = parse_duration("--duration", duration);
    for (std::size_t i = 0; i < kShortcuts.size(); ++i) {
      if (app.get_option(kShortcuts[i].option)->count() == 0) continue;
      const Shortcut& s = kShortcuts[i];
      request.parameters.emplace_back(s.parameter,
                                      s.is_time ? loc::to_text(parse_duration(s.option, shortcuts[i])) : shortcuts[i]);
    }
    for (const std::string& setting : settings) {
      const std::size_t equals = setting.find('=');
      if (equals == std::string::npos) throw loc::UsageError("--set '" + setting + "': must be NAME=VALUE");
      request.parameters.emplace_back(setting.substr(0, equals), setting.substr(equals + 1));
    }
    if (live && (!request.tracks.empty() || request.pictures.any())) {
      throw loc::UsageError("--tracks and --video are for recordings, not for --live");
    }
    if (live && !request.out.empty()) throw loc::UsageError("--out and --live exclude each other");
    if (request.pictures.images && request.out.empty()) throw loc::UsageError("--images needs --out");
    if (request.pictures.rendered && request.pictures.video.empty()) throw loc::UsageError("--rendered needs --video");
    loc::SimulationPlan plan = loc::plan_simulation(request);
    if (list_all_parameters) {
      list_parameters(plan.scenario);
      return loc::kExitOk;
    }
    if (live) {
      if (!CLI::detail::lexical_cast(speed, driver.speed) || !std::isfinite(driver.speed) || driver.speed <= 0) {
        throw loc::UsageError("--speed '" + speed + "': must be a positive number");
      }
      plan.scenario.start_time_ns = loc::host_now();
      loc::log_info("event=started scenario={} seed={} url={}", plan.scenario.name, plan.seed, driver.lcm_url);
      loc::publish_simulation(plan, request, driver);
      return loc::kExitOk;
    }
    if (request.out.empty() && request.tracks.empty() && request.rig.empty() && request.pictures.video.empty()) {
      throw loc::UsageError("nothing to do: --out, --tracks, --video, --write-rig, or --live");
    }
    loc::log_info("event=started scenario={} seed={} duration_s={}", plan.scenario.name, plan.seed,
                  plan.scenario.duration_s);
    if (!loc::write_simulation(plan, request)) {
      loc::log_error("event=interrupted result=\"nothing was written\"");
      return loc::kExitFailed;
    }
    loc::log_info("event=ended out={}", request.out);
    return loc::kExitOk;
  });
}
