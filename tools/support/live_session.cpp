#include "tools/support/live_session.hpp"

#include <sys/poll.h>

#include <filesystem>
#include <stdexcept>
#include <utility>

#include "libloc/core/check.hpp"
#include "msgs/convert.hpp"
#include "tools/support/log.hpp"
#include "tools/support/program.hpp"
#include "tools/support/statistics.hpp"

namespace loc {
namespace {

constexpr TimeNs kMs = 1'000'000;
constexpr TimeNs kWatchEvery = 20 * kMs;
constexpr TimeNs kStopPatience = 1500 * kMs;
constexpr TimeNs kEstimatorPatience = 30'000 * kMs;  // to finish what it has after the end of the recording
constexpr TimeNs kQuiet = 400 * kMs;                 // the logger writes to its file ten times a second
constexpr TimeNs kQuietLimit = 5000 * kMs;
constexpr const char* kFlushMs = "100";

// Also when a stop was asked for.
void pause(TimeNs duration) {
  ::poll(nullptr, 0, static_cast<int>(duration / kMs));
}

std::uintmax_t size_of(const std::string& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

}  // namespace

LiveSession::LiveSession(LiveSessionOptions options) : options_(std::move(options)) {
  require_positive("ready-timeout", options_.ready_timeout_s);
  require(options_.max_restarts >= 0, "max-restarts", options_.max_restarts, "must not be negative");
}

std::vector<std::string> LiveSession::command(const std::string& program,
                                              const std::vector<std::string>& arguments) const {
  std::vector<std::string> out = {own_folder() + "/" + program};
  out.insert(out.end(), arguments.begin(), arguments.end());
  out.insert(out.end(), options_.common.begin(), options_.common.end());
  return out;
}

void LiveSession::choose_transport() {
  if (!options_.lcm_url.empty()) {
    url_ = options_.lcm_url;
    log_info("event=transport kind=given url={}", url_);
    return;
  }
  std::string reason;
  bool multicast = options_.transport != Transport::kHub && multicast_works(kDefaultLcmUrl, &reason);
  if (options_.as_fast_as_taken && !options_.log_path.empty() && multicast) {
    if (options_.transport == Transport::kUdpm) {
      log_warning("event=log_may_lack_messages reason=\"the logger is slower than --speed max on udpm\"");
    } else {
      multicast = false;
      reason = "at full speed the logger would lose messages on udpm";
    }
  }
  if (options_.transport == Transport::kUdpm && !multicast) {
    throw std::runtime_error("multicast does not work here (" + reason +
                             "): as root, ip route add 224.0.0.0/4 dev lo; or use --transport hub");
  }
  if (multicast) {
    url_ = kDefaultLcmUrl;
    log_info("event=transport kind=udpm url={}", url_);
    return;
  }
  own_hub_ = true;
  start_hub();
  log_info("event=transport kind=hub url={} reason=\"{}\"", url_, reason.empty() ? "asked for" : reason);
}

void LiveSession::start_hub() {
  hub_.process =
      std::make_unique<ChildProcess>(hub_.name, command("loc-hub", {"--port", std::to_string(hub_port_)}), true);
  const auto line = hub_.process->read_line(from_seconds(options_.ready_timeout_s));
  if (!line) {
    hub_.process->running();
    throw std::runtime_error("loc-hub does not listen (" + hub_.process->describe() + ")");
  }
  url_ = *line;
  // A hub that is started anew is looked for at the same place.
  hub_port_ = static_cast<std::uint16_t>(std::stoi(url_.substr(url_.rfind(':') + 1)));
}

void LiveSession::start_logger() {
  // A log that was cut off is kept; the logger does not append to a broken end.
  log_path_ = options_.log_path + (logger_.restarts > 0 ? "." + std::to_string(logger_.restarts) : "");
  // Its -l is broken in LCM 1.3.1. --flush-interval bounds what a sudden death costs.
  logger_.process =
      std::make_unique<ChildProcess>(logger_.name, std::vector<std::string>{"lcm-logger", "--quiet", "--force",
                                                                            "--flush-interval=" + std::string(kFlushMs),
                                                                            "--lcm-url=" + url_, log_path_});
  // It listens when something that was sent has arrived in its file.
  LcmPublisher publisher(url_);
  const TimeNs give_up = steady_now() + from_seconds(options_.ready_timeout_s);
  while (size_of(log_path_) == 0 && !stop_requested()) {
    if (!logger_.process->running() || steady_now() > give_up) {
      throw std::runtime_error("lcm-logger does not write to " + log_path_ + " (" + logger_.process->describe() + ")");
    }
    publisher.publish(kStatisticsChannel, statistics_message("loc-live", {}));
    pause(kWatchEvery);
  }
  log_info("event=logging file=\"{}\"", log_path_);
}

void LiveSession::start_estimator() {
  std::vector<std::string> arguments = options_.estimator;
  arguments.insert(arguments.end(), {"--exit-at-end", "--lcm-url", url_});
  estimator_.process = std::make_unique<ChildProcess>(estimator_.name, command("loc-estimator", arguments));
}

void LiveSession::start_driver() {
  std::vector<std::string> arguments = options_.driver;
  arguments.insert(arguments.end(),
                   {"--wait-for-estimator", std::to_string(options_.ready_timeout_s), "--lcm-url", url_});
  driver_.process = std::make_unique<ChildProcess>(driver_.name, command("loc-driver", arguments));
}

bool LiveSession::run() {
  try {
    choose_transport();
    if (!options_.log_path.empty() && !stop_requested()) start_logger();
    if (!stop_requested()) start_estimator();
    if (!stop_requested()) start_driver();
    if (!stop_requested() && watch()) finish();
  } catch (...) {
    stop_all();
    throw;
  }
  stop_all();
  return all_well_;
}

// @return true when the driver came to the end of the recording.
bool LiveSession::watch() {
  while (sleep_for(kWatchEvery)) {
    if (!driver_.process->running()) {
      if (driver_.process->succeeded()) return true;
      log_error("event=process_died program={} how=\"{}\"", driver_.name, driver_.process->describe());
      all_well_ = false;
      return false;
    }
    look_after(hub_, &LiveSession::start_hub);
    look_after(logger_, &LiveSession::start_logger);
    look_after(estimator_, &LiveSession::start_estimator);
    if (hub_.given_up) return false;  // the others have nobody to talk to
  }
  return false;
}

void LiveSession::look_after(Member& member, void (LiveSession::*start)()) {
  if (member.process == nullptr || member.given_up || member.process->running()) return;
  // The estimator ends by itself a moment before the driver does.
  if (&member == &estimator_ && member.process->succeeded()) return;
  log_error("event=process_died program={} how=\"{}\" restart={}", member.name, member.process->describe(),
            options_.restart);
  if (!options_.restart || member.restarts >= options_.max_restarts) {
    member.given_up = true;
    all_well_ = false;
    return;
  }
  ++member.restarts;
  (this->*start)();
  log_warning("event=process_restarted program={} restarts={}", member.name, member.restarts);
}

void LiveSession::finish() {
  if (estimator_.process->running()) {
    // In short steps, so that Ctrl-C is heard.
    const TimeNs give_up = steady_now() + kEstimatorPatience;
    while (!estimator_.process->wait(kWatchEvery) && !stop_requested() && steady_now() < give_up) {
    }
  }
  if (!estimator_.given_up && !stop_requested() && !estimator_.process->succeeded()) {
    log_error("event=estimator_not_finished how=\"{}\"", estimator_.process->describe());
    all_well_ = false;
  }
  wait_until_logged();
}

// The logger drops what waits in its memory when it is asked to end: let it write first.
void LiveSession::wait_until_logged() {
  if (logger_.process == nullptr || !logger_.process->running()) return;
  const TimeNs give_up = steady_now() + kQuietLimit;
  std::uintmax_t size = size_of(log_path_);
  TimeNs since = steady_now();
  while (!stop_requested() && steady_now() < give_up && steady_now() - since < kQuiet) {
    pause(kWatchEvery);
    if (const std::uintmax_t now = size_of(log_path_); now != size) {
      size = now;
      since = steady_now();
    }
  }
}

void LiveSession::stop_all() {
  for (Member* member : {&driver_, &estimator_}) stop(*member);
  if (stop_requested() && logger_.process != nullptr) pause(2 * 100 * kMs);  // what is on its way, and one flush
  for (Member* member : {&logger_, &hub_}) stop(*member);
}

void LiveSession::stop(Member& member) {
  if (member.process == nullptr) return;
  const bool ran = member.process->running();
  if (ran && !member.process->stop(kStopPatience)) {
    log_error("event=process_killed program={} reason=\"did not end when asked to\"", member.name);
    all_well_ = false;
  } else if (ran && !member.process->succeeded() && !member.process->stopped_early()) {
    log_error("event=process_failed program={} how=\"{}\"", member.name, member.process->describe());
    all_well_ = false;
  } else {
    log_info("event=process_ended program={} how=\"{}\" restarts={}", member.name, member.process->describe(),
             member.restarts);
  }
}

}  // namespace loc
