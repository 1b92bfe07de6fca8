#include "tools/support/unit_check.hpp"

#include <cmath>

#include "libloc/core/check.hpp"

namespace loc {
namespace {

// Wide enough for iron nearby and for any motion that a person or a vehicle can keep up.
constexpr double kLeastForce = 4;      // [m/s^2]
constexpr double kMostForce = 25;      // [m/s^2]
constexpr double kLeastField = 5e-6;   // [T]
constexpr double kMostField = 500e-6;  // [T]

}  // namespace

void UnitCheck::Sizes::see(double size, double low, double high) {
  if (!std::isfinite(size)) return;
  ++samples;
  sum += size;
  if (size < low) ++small;
  if (size > high) ++large;
}

bool UnitCheck::Sizes::doubtful() const {
  return samples >= 100 && (10 * small > 9 * samples || 10 * large > 9 * samples);
}

std::string UnitCheck::Sizes::mean() const {
  return to_text(sum / static_cast<double>(samples));
}

void UnitCheck::see(const Measurement& measurement) {
  if (const auto* imu = std::get_if<ImuMeasurement>(&measurement)) {
    force_.see(imu->specific_force.norm(), kLeastForce, kMostForce);
  } else if (const auto* field = std::get_if<MagnetometerMeasurement>(&measurement)) {
    field_.see(field->magnetic_field.norm(), kLeastField, kMostField);
  }
}

std::vector<std::string> UnitCheck::doubts() const {
  std::vector<std::string> out;
  if (force_.doubtful()) {
    out.push_back("the specific force is " + force_.mean() +
                  " m/s^2 on average, 9.8 at rest: is it really in the unit "
                  "that the recording says (m/s^2, g)?");
  }
  if (field_.doubtful()) {
    out.push_back("the magnetic field is " + field_.mean() +
                  " T on average, the earth's is 25e-6 to 65e-6: is it "
                  "really in the unit that the recording says (T, uT, gauss)?");
  }
  return out;
}

}  // namespace loc
