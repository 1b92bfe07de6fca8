// Start value of a gyroscope's matrix of unknown unit and axes. Internal to calib.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libloc/calib/gyroscope.hpp"

namespace loc {

/// A scale times a signed permutation, the one that carries gravity through the turns best; the identity where it does
/// well. @param turns the k-th turn goes from up[turns[k]] to the next. nullopt when no turn is large enough.
std::optional<Eigen::Matrix3d> gyroscope_start(const std::vector<std::vector<RateStep>>& steps,
                                               const std::vector<std::size_t>& turns,
                                               const std::vector<Eigen::Vector3d>& up);

}  // namespace loc
