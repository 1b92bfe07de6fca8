#include "libloc/core/quality.hpp"

#include <algorithm>
#include <utility>

namespace loc {

const char* verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::kOk:
      return "ok";
    case Verdict::kFair:
      return "fair";
    case Verdict::kWarn:
      return "warn";
    case Verdict::kRefused:
      return "refused";
  }
  return "unknown";
}

void Quality::lower_to(Verdict at_most, std::string reason) {
  verdict = std::max(verdict, at_most);
  reasons.push_back(std::move(reason));
}

}  // namespace loc
