// Doubts about units. A reader cannot see that a column is in another unit than its name says; the physics can: on
// average a specific force is about 9.8 m/s^2, and the earth's field 25 to 65 uT.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "libloc/sensors/measurements.hpp"

namespace loc {

class UnitCheck {
 public:
  void see(const Measurement& measurement);
  /// One sentence for each stream whose values are nearly all implausible; empty for less than 100 samples.
  std::vector<std::string> doubts() const;

 private:
  struct Sizes {
    std::int64_t samples = 0;
    std::int64_t small = 0;
    std::int64_t large = 0;
    double sum = 0;
    void see(double size, double low, double high);
    bool doubtful() const;
    std::string mean() const;
  };
  Sizes force_;
  Sizes field_;
};

}  // namespace loc
