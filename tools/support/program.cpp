#include "tools/support/program.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <ctime>
#include <utility>

#include "tools/support/lcm_link.hpp"
#include "tools/support/log.hpp"

namespace loc {
namespace {

volatile std::sig_atomic_t stop_flag = 0;
int stop_event = -1;  // an eventfd that becomes readable, so that sleepers wake

extern "C" void on_stop_signal(int /*number*/) {
  const int saved = errno;
  request_stop();
  errno = saved;
}

void install_signals() {
  stop_event = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  struct sigaction action {};
  action.sa_handler = on_stop_signal;
  // LCM's reads and writes do not expect to be interrupted.
  action.sa_flags = SA_RESTART;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  // Whoever reads our output may go away.
  action.sa_handler = SIG_IGN;
  ::sigaction(SIGPIPE, &action, nullptr);
}

void start_log(const std::string& program, const std::string& level) {
  auto logger = std::make_shared<spdlog::logger>(program, std::make_shared<spdlog::sinks::stderr_sink_mt>());
  logger->set_pattern("time=%Y-%m-%dT%H:%M:%S.%eZ level=%l program=%n pid=%P %v", spdlog::pattern_time_type::utc);
  logger->set_level(spdlog::level::from_str(level));
  logger->flush_on(spdlog::level::trace);
  spdlog::set_default_logger(std::move(logger));
}

TimeNs clock_now(clockid_t clock) {
  timespec t{};
  ::clock_gettime(clock, &t);
  return static_cast<TimeNs>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

}  // namespace

Program::Program(std::string name, const std::string& description)
    : name_(std::move(name)), app_(std::make_unique<CLI::App>(description, name_)) {
  app_->set_version_flag("--version", name_ + " " LOC_VERSION);
  app_->add_option("--log-level", log_level_, "Log lines on stderr from this level on")
      ->check(CLI::IsMember({"debug", "info", "warning", "error", "off"}))
      ->capture_default_str();
  app_->footer("Exit codes: 0 all went well, 1 failed while running, 2 wrong options or configuration.");
  app_->get_formatter()->column_width(34);
}

Program::~Program() = default;

void Program::add_lcm_url(std::string& url) {
  if (url.empty()) url = kDefaultLcmUrl;
  app_->add_option("--lcm-url", url, "Transport: udpm://GROUP:PORT?ttl=0&recv_buf_size=BYTES or tcpq://ADDRESS:PORT")
      ->envname("LCM_DEFAULT_URL")
      ->capture_default_str();
}

CLI::Option* Program::add_config(std::string& path) {
  return app_->add_option("--config,--rig", path, "Calibration of the sensors (rig.yaml)")->check(CLI::ExistingFile);
}

int Program::run(int argc, char** argv, const std::function<int()>& body) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version are "errors" with code 0.
    return app_->exit(error) == 0 ? kExitOk : kExitUsage;
  }
  start_log(name_, log_level_);
  install_signals();
  try {
    return body();
  } catch (const UsageError& error) {
    log_error("event=usage reason=\"{}\"", error.what());
    return kExitUsage;
  } catch (const std::invalid_argument& error) {
    log_error("event=usage reason=\"{}\"", error.what());
    return kExitUsage;
  } catch (const std::exception& error) {
    log_error("event=failed reason=\"{}\"", error.what());
    return kExitFailed;
  }
}

bool stop_requested() {
  return stop_flag != 0;
}

void request_stop() {
  stop_flag = 1;
  const std::uint64_t one = 1;
  // Async-signal-safe; the event is never full.
  if (stop_event >= 0) (void)!::write(stop_event, &one, sizeof one);
}

bool sleep_for(TimeNs duration_ns) {
  if (stop_requested() || duration_ns <= 0) return !stop_requested();
  const timespec timeout{static_cast<std::time_t>(duration_ns / 1'000'000'000), duration_ns % 1'000'000'000};
  pollfd event{stop_event, POLLIN, 0};
  ::ppoll(&event, 1, &timeout, nullptr);
  return !stop_requested();
}

TimeNs host_now() {
  return clock_now(CLOCK_REALTIME);
}

TimeNs steady_now() {
  return clock_now(CLOCK_MONOTONIC);
}

std::string format_counts(const NamedCounts& counts) {
  std::string out;
  for (const NamedCount& count : counts) {
    if (!out.empty()) out += ' ';
    out += count.name + "=" + std::to_string(count.value);
  }
  return out;
}

}  // namespace loc
