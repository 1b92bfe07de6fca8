// loc-live: driver, estimator, logger and, where there is no multicast, a hub, from one command.

#include <CLI/CLI.hpp>
#include <filesystem>

#include "tools/support/live_session.hpp"
#include "tools/support/log.hpp"
#include "tools/support/open_source.hpp"
#include "tools/support/program.hpp"

int main(int argc, char** argv) {
  loc::LiveSessionOptions options;
  std::string transport = "auto";
  std::string config;
  std::string kind;
  std::string path;
  std::string driver_arguments;
  std::string estimator_arguments;
  std::string speed = "1";
  bool statistics = false;
  loc::Program program("loc-live",
                       "Runs driver, estimator and logger as processes of their own, watches them and stops them in "
                       "order at the end of the recording or on Ctrl-C.");
  CLI::App& app = program.app();
  app.add_option("SOURCE", kind,
                 "Recordings: euroc, lcm-log, csv, eqvio, broad, nmea, video, images, rawlog; live: gps-serial, "
                 "gps-tcp, gpsd, camera")
      ->required()
      ->check(CLI::IsMember({"euroc", "lcm-log", "csv", "eqvio", "broad", "nmea", "video", "images", "rawlog",
                             "gps-serial", "gps-tcp", "gpsd", "camera"}));
  app.add_option("PATH", path, "The recording; live: device, HOST:PORT")->required();
  app.add_option("--transport", transport,
                 "auto: multicast where it works, otherwise (and to log at full speed) a hub of its own; udpm; hub")
      ->check(CLI::IsMember({"auto", "udpm", "hub"}))
      ->capture_default_str();
  app.add_option("--lcm-url", options.lcm_url, "Use this transport; a hub there must run already");
  program.add_config(config);
  app.add_option("--log", options.log_path, "LCM log to write, by the stock lcm-logger; replaced when it exists");
  app.add_option("--speed", speed, "As of loc-driver: 1, N or max")->capture_default_str();
  app.add_option("--driver-args", driver_arguments, "More arguments of loc-driver, in one string");
  app.add_option("--estimator-args", estimator_arguments, "More arguments of loc-estimator, in one string");
  app.add_flag("--restart", options.restart, "Start a dead estimator, logger or hub anew (else: report it)");
  app.add_option("--max-restarts", options.max_restarts, "… at most so many times each")->capture_default_str();
  app.add_option("--ready-timeout", options.ready_timeout_s, "Seconds for a process to get ready")
      ->capture_default_str();
  app.add_flag("--statistics", statistics, "All programs log and publish counters once per second");

  return program.run(argc, argv, [&] {
    options.transport = transport == "auto"   ? loc::Transport::kAuto
                        : transport == "udpm" ? loc::Transport::kUdpm
                                              : loc::Transport::kHub;
    options.as_fast_as_taken = speed == "max";
    const bool live = loc::is_live(kind);
    std::error_code ignored;
    if (!live && !std::filesystem::exists(path, ignored)) throw loc::UsageError("'" + path + "' does not exist");
    if (!options.log_path.empty()) loc::refuse_to_overwrite(path, options.log_path);
    options.driver = {kind, path, "--speed", speed};
    for (std::string& argument : CLI::detail::split_up(driver_arguments)) options.driver.push_back(std::move(argument));
    options.estimator = CLI::detail::split_up(estimator_arguments);
    options.common = {"--log-level", program.log_level()};
    if (!config.empty()) options.common.insert(options.common.end(), {"--config", config});
    if (statistics) options.common.emplace_back("--statistics");
    loc::LiveSession session(options);
    const bool all_well = session.run();
    loc::log_info("event=ended interrupted={} all_well={}", loc::stop_requested(), all_well);
    return all_well ? loc::kExitOk : loc::kExitFailed;
  });
}
