#include "libloc/core/quality.hpp"

#include <algorithm>
#include <utility>

#include "libloc/core/check.hpp"

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

Verdict parse_verdict(const std::string& name) {
  for (const Verdict verdict : {Verdict::kOk, Verdict::kFair, Verdict::kWarn, Verdict::kRefused}) {
    if (name == verdict_name(verdict)) return verdict;
  }
  throw std::invalid_argument("verdict = '" + name + "': must be ok, fair, warn or refused");
}

void Quality::lower_to(Verdict at_most, std::string reason) {
  verdict = std::max(verdict, at_most);
  reasons.push_back(std::move(reason));
}

}  // namespace loc
