#include "libloc/eval/orientation_error.hpp"

#include <cmath>
#include <limits>
#include <string>

#include "libloc/core/check.hpp"
#include "libloc/geometry/so3.hpp"

namespace loc {
namespace {

bool is_unit_or_unknown(const Eigen::Quaterniond& q, const char* name, std::size_t index) {
  if (!q.coeffs().allFinite()) return false;
  const double norm = q.norm();
  if (std::abs(norm - 1) > 1e-3) {
    throw DataError(std::string(name) + " " + std::to_string(index) + ": its quaternion has norm " + to_text(norm) +
                    ": must be 1");
  }
  return true;
}

struct Parts {
  double total, heading, inclination;
};

// The definitions with atan2: acos loses half the digits near 1.
Parts split(const Eigen::Quaterniond& error) {
  const double w = std::abs(error.w());
  const double z = std::abs(error.z());
  return {2 * std::atan2(error.vec().norm(), w), 2 * std::atan2(z, w),
          2 * std::atan2(std::hypot(error.x(), error.y()), std::hypot(w, z))};
}

}  // namespace

OrientationError orientation_error(std::span<const Eigen::Quaterniond> estimate,
                                   std::span<const Eigen::Quaterniond> reference, std::span<const std::uint8_t> mask,
                                   const OrientationErrorOptions& options) {
  require(estimate.size() == reference.size(), "orientation_error: " + std::to_string(estimate.size()) +
                                                   " orientations of the estimate, but " +
                                                   std::to_string(reference.size()) + " of the reference");
  require(mask.empty() || mask.size() == estimate.size(), "orientation_error: mask has " + std::to_string(mask.size()) +
                                                              " values for " + std::to_string(estimate.size()) +
                                                              " orientations");
  const std::size_t n = estimate.size();
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  OrientationError result;
  std::vector<Eigen::Quaterniond> errors(n, Eigen::Quaterniond(kNan, kNan, kNan, kNan));
  std::vector<bool> scored(n, false);
  double sine = 0;
  double cosine = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const bool estimate_known = is_unit_or_unknown(estimate[i], "estimate", i);
    const bool reference_known = is_unit_or_unknown(reference[i], "reference", i);
    const bool known = estimate_known && reference_known;
    if (known) errors[i] = (estimate[i] * reference[i].conjugate()).normalized();
    if (!mask.empty() && mask[i] == 0) {
      ++result.masked;
    } else if (!estimate_known) {
      ++result.estimate_not_finite;
    } else if (!reference_known) {
      ++result.reference_not_finite;
    } else {
      scored[i] = true;
      ++result.scored;
      const double heading = so3::heading(errors[i]);
      sine += std::sin(heading);
      cosine += std::cos(heading);
    }
  }
  if (result.scored == 0) {
    throw DataError("orientation_error: nothing to score: of " + std::to_string(n) + " samples, " +
                    std::to_string(result.masked) + " outside the mask, " + std::to_string(result.estimate_not_finite) +
                    " without estimate, " + std::to_string(result.reference_not_finite) + " without reference");
  }
  if (options.align_heading) result.heading_offset = std::atan2(sine, cosine);
  const Eigen::Quaterniond back = so3::exp({0, 0, -result.heading_offset});

  result.total.assign(n, kNan);
  result.heading.assign(n, kNan);
  result.inclination.assign(n, kNan);
  double total = 0;
  double heading = 0;
  double inclination = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (!errors[i].coeffs().allFinite()) continue;
    const Parts parts = split(back * errors[i]);
    result.total[i] = parts.total;
    result.heading[i] = parts.heading;
    result.inclination[i] = parts.inclination;
    if (!scored[i]) continue;
    total += parts.total * parts.total;
    heading += parts.heading * parts.heading;
    inclination += parts.inclination * parts.inclination;
  }
  const auto count = static_cast<double>(result.scored);
  result.total_rmse = std::sqrt(total / count);
  result.heading_rmse = std::sqrt(heading / count);
  result.inclination_rmse = std::sqrt(inclination / count);
  return result;
}

}  // namespace loc
