// What every program does the same way: options, log lines, signals, exit codes.
// Log lines go to stderr, one event each, as key=value pairs: time, level, program, pid, event, then what belongs to
// it. Exit codes: 0 all went well, 1 something failed while running, 2 wrong options or configuration.
// SIGINT and SIGTERM ask the program to end; its loops look at stop_requested() at least ten times a second.
#pragma once

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "libloc/core/named_count.hpp"
#include "libloc/core/time.hpp"
#include "tools/support/cli_forward.hpp"

namespace loc {

inline constexpr int kExitOk = 0;
inline constexpr int kExitFailed = 1;
inline constexpr int kExitUsage = 2;

/// Wrong options or configuration: exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Program {
 public:
  /// Adds --version and --log-level. @param name as installed: "loc-hub"
  Program(std::string name, const std::string& description);

  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  CLI::App& app() { return *app_; }
  const std::string& name() const { return name_; }
  const std::string& log_level() const { return log_level_; }
  /// Adds --lcm-url, preset with the default transport.
  void add_lcm_url(std::string& url);
  /// Adds --config, also under the name --rig.
  CLI::Option* add_config(std::string& path);

  /// Parses, runs body and turns what it throws into a log line and an exit code.
  int run(int argc, char** argv, const std::function<int()>& body);

 private:
  std::string name_;
  std::string log_level_ = "info";
  std::unique_ptr<CLI::App> app_;
};

/// A signal asked to end, or request_stop() was called.
bool stop_requested();
void request_stop();
/// Sleeps; wakes at once when asked to end. @return false when asked to end.
bool sleep_for(TimeNs duration_ns);

/// Host time, nanoseconds since 1970.
TimeNs host_now();
/// Monotonic time [ns], for durations.
TimeNs steady_now();

/// "imu.read=6000 imu.skipped.not_finite=2", for a log line.
std::string format_counts(const NamedCounts& counts);

}  // namespace loc
