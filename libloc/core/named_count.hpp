// A counter with its name, for statistics and reports: {"skipped.not_finite", 3}.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace loc {

struct NamedCount {
  std::string name;
  std::int64_t value = 0;
};
using NamedCounts = std::vector<NamedCount>;

}  // namespace loc
