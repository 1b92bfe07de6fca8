// Integrals of smooth functions: Gauss-Legendre with ten nodes on equal panels. Exact to rounding while the phase of
// the oscillation that is integrated changes by about two radians a panel.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace loc::detail {

struct QuadratureNode {
  double position;  // on (0, 1); the other half mirrors it
  double weight;
};

inline constexpr std::array<QuadratureNode, 5> kHalfOfTenNodes = {{{0.1488743389816312, 0.2955242247147529},
                                                                   {0.4333953941292472, 0.2692667193099963},
                                                                   {0.6794095682990244, 0.2190863625159820},
                                                                   {0.8650633666889845, 0.1494513491505806},
                                                                   {0.9739065285171717, 0.0666713443086881}}};

/// Panels for a phase that changes by so much [rad] in all.
inline int panels_for(double phase) {
  return std::max(1, static_cast<int>(std::ceil(std::abs(phase) / 1.5)));
}

/// Calls add(x, weight) so that the sum of weight * f(x) is the integral of f over [0, length]; the length may be
/// negative.
template <class Add>
void integrate(double length, int panels, const Add& add) {
  const double half = 0.5 * length / panels;
  for (int panel = 0; panel < panels; ++panel) {
    const double middle = (2 * panel + 1) * half;
    for (const QuadratureNode& node : kHalfOfTenNodes) {
      add(middle - node.position * half, node.weight * half);
      add(middle + node.position * half, node.weight * half);
    }
  }
}

}  // namespace loc::detail
