// Files that estimates go to off line. The kind follows from the name: *.csv, *.tum (or *.txt), *.lcm (or *.log).
#pragma once

#include <memory>
#include <string>

#include "libloc/estimators/estimate.hpp"

namespace loc {

class EstimateOutput {
 public:
  EstimateOutput() = default;
  EstimateOutput(const EstimateOutput&) = delete;
  EstimateOutput& operator=(const EstimateOutput&) = delete;
  virtual ~EstimateOutput() = default;
  virtual void write(const Estimate& estimate) = 0;
  /// To be called at the end. @throws DataError when not everything could be written.
  virtual void finish() = 0;
};

/// @param method, world as in estimate_t
/// @throws UsageError for another ending, DataError when the file cannot be written.
std::unique_ptr<EstimateOutput> open_estimate_output(const std::string& path, const std::string& method,
                                                     const std::string& world);

}  // namespace loc
