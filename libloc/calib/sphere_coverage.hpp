// Share of the sphere of directions that readings hit, in cells of equal area: the honest picture of how far a sensor
// was turned.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace loc {

struct SphereCoverage {
  static constexpr int kBands = 10;    ///< of equal height in z
  static constexpr int kSectors = 10;  ///< in azimuth
  static constexpr int kCells = kBands * kSectors;
  std::array<std::int32_t, kCells> hits{};  ///< [band * kSectors + sector], from -z up, from +x towards +y

  /// Cell of a direction, which need not be of length 1. @throws std::invalid_argument when not finite or zero.
  static int cell(const Eigen::Vector3d& direction);
  /// Middle of a cell, of length 1.
  static Eigen::Vector3d direction(int cell);
  void add(const Eigen::Vector3d& direction) { ++hits[static_cast<std::size_t>(cell(direction))]; }
  int cells_hit() const;
};

}  // namespace loc
