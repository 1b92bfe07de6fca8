// A simulated scenario as a source of measurements: whatever reads recordings runs on it as well.
#pragma once

#include <atomic>
#include <optional>
#include <utility>
#include <vector>

#include "libloc/io/source.hpp"
#include "libloc/sim/simulation.hpp"

namespace loc {

class SimulationSource : public MeasurementSource {
 public:
  explicit SimulationSource(Simulation simulation) : simulation_(std::move(simulation)) {}

  std::optional<Measurement> next() override {
    if (stopped_) return std::nullopt;
    auto m = simulation_.next();
    if (m && std::holds_alternative<ReferenceMeasurement>(*m)) truth_.push_back(simulation_.truth());
    return m;
  }
  void stop() override { stopped_ = true; }
  NamedCounts counts() const override { return simulation_.counts(); }

  const Simulation& simulation() const { return simulation_; }
  /// Of the reference measurements so far.
  const std::vector<SimulationTruth>& truth() const { return truth_; }

 private:
  Simulation simulation_;
  std::vector<SimulationTruth> truth_;
  std::atomic<bool> stopped_ = false;
};

}  // namespace loc
