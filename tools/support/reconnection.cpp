#include "tools/support/reconnection.hpp"

#include <algorithm>
#include <utility>

#include "tools/support/log.hpp"
#include "tools/support/program.hpp"

namespace loc {
namespace {

constexpr TimeNs kIdleStep = 100'000'000;

}  // namespace

Reconnection::Reconnection(std::string sensor, ReconnectionOptions options)
    : sensor_(std::move(sensor)), options_(std::move(options)) {}

void Reconnection::connected(const std::string& name) {
  ++connections_;
  log_info("event={}_connected name=\"{}\" connections={}", sensor_, name, connections_);
}

void Reconnection::lost(const std::string& name, const std::string& why) {
  ++losses_;
  trouble(name + ": lost: " + why);
}

void Reconnection::failed(const std::string& why) {
  ++failures_;
  trouble(why);
}

void Reconnection::trouble(const std::string& why) {
  if (why == trouble_) return;
  if (why.empty()) {
    log_info("event={}_well", sensor_);
  } else {
    log_warning("event={}_trouble reason=\"{}\"", sensor_, why);
  }
  trouble_ = why;
  if (options_.on_trouble) options_.on_trouble(why);
}

bool Reconnection::wait() const {
  const TimeNs end = steady_now() + from_seconds(options_.reconnect_s);
  while (steady_now() < end && !stopped_) {
    if (!sleep_for(std::min(kIdleStep, end - steady_now()))) return false;
    if (options_.on_idle) options_.on_idle();
  }
  return !stop_requested() && !stopped_;
}

void Reconnection::add_to(NamedCounts& counts) const {
  counts.push_back({sensor_ + ".connections", connections_});
  if (losses_ > 0) counts.push_back({sensor_ + ".connections_lost", losses_});
  if (failures_ > 0) counts.push_back({sensor_ + ".connections_failed", failures_});
}

}  // namespace loc
