#include "tools/support/held_back_output.hpp"

#include <cmath>
#include <utility>

#include "tools/support/log.hpp"

namespace loc {
namespace {

bool on_earth(const Estimate& estimate) {
  return std::isfinite(estimate.origin.latitude);
}

}  // namespace

HeldBackOutput::HeldBackOutput(std::unique_ptr<EstimateOutput> to, std::function<const MapAnchor*()> anchor,
                               std::size_t most)
    : to_(std::move(to)), anchor_(std::move(anchor)), most_(most) {}

void HeldBackOutput::put(const Held& held) {
  if (const auto* estimate = std::get_if<Estimate>(&held)) {
    to_->write(*estimate);
  } else {
    to_->write_frame(std::get<SlamFrame>(held));
  }
}

// Everything that waits, in the world of the anchor where there is one.
void HeldBackOutput::release(const MapAnchor* anchor) {
  for (Held& held : held_) {
    if (anchor != nullptr) {
      if (auto* estimate = std::get_if<Estimate>(&held)) {
        *estimate = anchor->in_world(*estimate);
      } else {
        anchor->put_in_world(std::get<SlamFrame>(held));
      }
    }
    put(held);
  }
  held_.clear();
}

void HeldBackOutput::hold(Held held) {
  held_.push_back(std::move(held));
  if (held_.size() <= most_) return;
  some_in_map_ = true;
  put(held_.front());
  held_.pop_front();
}

void HeldBackOutput::write(const Estimate& estimate) {
  if (!released_ && on_earth(estimate)) {
    if (some_in_map_) {
      log_warning("event=world_changed time={} effect=\"estimates long before this one are in the world of the map\"",
                  format_seconds(estimate.time_ns));
    }
    release(anchor_());
    released_ = true;
  }
  if (released_) {
    to_->write(estimate);
  } else {
    hold(estimate);
  }
}

void HeldBackOutput::write_frame(const SlamFrame& frame) {
  if (released_) {
    to_->write_frame(frame);
  } else {
    hold(frame);
  }
}

void HeldBackOutput::write_map(const Stamp& stamp, std::span<const SlamMapPoint> map) {
  release(nullptr);
  to_->write_map(stamp, map);
}

void HeldBackOutput::finish() {
  release(nullptr);
  to_->finish();
}

}  // namespace loc
