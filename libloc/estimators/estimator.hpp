// The small concept that all estimators share. Programs drive an estimator through it and know nothing else about it.
#pragma once

#include <concepts>

#include "libloc/core/named_count.hpp"
#include "libloc/estimators/estimate.hpp"
#include "libloc/sensors/measurements.hpp"

namespace loc {

/// process() takes the next measurement in time order (kinds it does not use change nothing) and says whether
/// estimate() is new; reset() forgets the past but not the options or the counts (the clock of the recording was set
/// back).
template <class T>
concept Estimator = requires(T estimator, const T& constant, const Measurement& measurement) {
  { estimator.process(measurement) } -> std::same_as<bool>;
  { constant.estimate() } -> std::same_as<Estimate>;
  { constant.counts() } -> std::same_as<NamedCounts>;
  { estimator.reset() } -> std::same_as<void>;
};

}  // namespace loc
