// Off line, GPS may tell only after a while where on the Earth a map is. Until then estimates are held back, and come
// out as they are in the world then: one file has one world.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <variant>

#include "libloc/estimators/map_anchor.hpp"
#include "tools/support/estimate_output.hpp"

namespace loc {

class HeldBackOutput : public EstimateOutput {
 public:
  /// @param anchor asked for when an estimate on the Earth comes
  /// @param most estimates and frames that are held; what is older goes out as it is in the map, which is said aloud
  HeldBackOutput(std::unique_ptr<EstimateOutput> to, std::function<const MapAnchor*()> anchor, std::size_t most);

  void write(const Estimate& estimate) override;
  void write_frame(const SlamFrame& frame) override;
  void write_map(const Stamp& stamp, std::span<const SlamMapPoint> map) override;
  void finish() override;

 private:
  struct Held {
    std::variant<Estimate, SlamFrame> what;
    std::int64_t map = 0;  // which one it is of
  };
  void put(const Held& held);
  void release();
  void hold(std::variant<Estimate, SlamFrame> what);

  std::unique_ptr<EstimateOutput> to_;
  std::function<const MapAnchor*()> anchor_;
  std::size_t most_;
  std::deque<Held> held_;
  bool released_ = false;
  bool some_in_map_ = false;  // went out before
};

}  // namespace loc
