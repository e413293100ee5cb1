#include "lab/press/mechanics_press.h"

#include <utility>

#include "core/error.h"

namespace touchstone::lab {

double normal_force(const fem::Compliance& gel, fem::ContactShape shape, double z) {
  return fem::Press(gel, std::move(shape), 0.0).step(press_target(0.013, 0.021, z)).wrench[2];
}

double mean_flat_punch(const fem::Compliance& gel, double radius, double depth, double edge) {
  constexpr int kPlaces = 4;
  double sum = 0.0;
  for (int i = 0; i < kPlaces; ++i) {
    for (int j = 0; j < kPlaces; ++j) {
      const double x = edge * (i + 0.5) / kPlaces;
      const double y = std::sqrt(0.75) * edge * (j + 0.5) / kPlaces;
      fem::Press press(gel, fem::RoundedCylinder{radius, 0.0, 3.0}, 0.0);
      sum += press.step(press_target(x, y, -depth)).wrench[2];
    }
  }
  return sum / (kPlaces * kPlaces);
}

double extrapolated(const std::vector<double>& forces) {
  TS_ASSERT(forces.size() == 1 || forces.size() == 2);
  return forces.size() == 1 ? forces[0] : 2.0 * forces[1] - forces[0];
}

}  // namespace touchstone::lab
