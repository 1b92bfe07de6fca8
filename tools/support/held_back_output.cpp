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
  if (const auto* estimate = std::get_if<Estimate>(&held.what)) {
    to_->write(*estimate);
  } else {
    to_->write_frame(std::get<SlamFrame>(held.what));
  }
}

// Everything that waits: what is of the anchor's map, as it is in the world.
void HeldBackOutput::release() {
  const MapAnchor* anchor = anchor_();
  for (Held& held : held_) {
    if (anchor != nullptr && anchor->anchored()) {
      if (held.map != anchor->map_number()) {
        some_in_map_ = true;
      } else if (auto* estimate = std::get_if<Estimate>(&held.what)) {
        *estimate = anchor->in_world(*estimate);
      } else {
        anchor->put_in_world(std::get<SlamFrame>(held.what));
      }
    }
    put(held);
  }
  held_.clear();
}

void HeldBackOutput::hold(std::variant<Estimate, SlamFrame> what) {
  const MapAnchor* anchor = anchor_();
  held_.push_back({std::move(what), anchor != nullptr ? anchor->map_number() : 0});
  if (held_.size() <= most_) return;
  some_in_map_ = true;
  put(held_.front());
  held_.pop_front();
}

void HeldBackOutput::write(const Estimate& estimate) {
  // Another map began, of which nobody knows yet where it is.
  if (released_ && !on_earth(estimate)) released_ = false;
  if (!released_ && on_earth(estimate)) {
    release();
    released_ = true;
    if (std::exchange(some_in_map_, false)) {
      log_warning("event=world_changed time={} effect=\"some estimates before this one are in the world of a map\"",
                  format_seconds(estimate.time_ns));
    }
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
  release();
  to_->write_map(stamp, map);
}

void HeldBackOutput::finish() {
  release();
  to_->finish();
}

}  // namespace loc
