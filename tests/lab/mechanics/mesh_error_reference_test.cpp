// Are the mesh's error estimates honest against theory that knows no mesh? Spheres and punches on a bonded layer.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "closed_forms/contact_closed_forms.h"
#include "core/random.h"
#include "fem/contact/press.h"
#include "fem/error/compliance_cache.h"
#include "fem/error/press_error.h"

namespace touchstone::lab {
namespace {

constexpr double kModulus = 1.0;
constexpr double kThickness = 5.0;
constexpr double kEdge = 0.5;

class LayerReference : public ::testing::TestWithParam<double> {};

TEST_P(LayerReference, TrueForceErrorsAreOfTheEstimatesSize) {
  const double nu = GetParam();
  // Half as wide as four thicknesses: the layer's own end has an effect of some 0.1 %.
  const fem::SlabMesh slab{40.0, 40.0, kThickness, kEdge, 2.5, 3.0, 3.0, 1.0};
  const fem::Compliance gel = fem::cached_compliance(slab, {kModulus, nu}, {}, {});
  RandomStream random(3, 0, Purpose::kTest);
  for (const bool sharp : {false, true}) {
    double squares = 0.0;
    double largest = 0.0;
    constexpr int kPresses = 40;
    for (int k = 0; k < kPresses; ++k) {
      const double radius = 1.2 * kEdge * std::pow(4.0, random.uniform());  // 1.2 to 4.8 edges
      const double x = 0.8 * random.uniform() - 0.4;
      const double y = 0.8 * random.uniform() - 0.4;
      const double depth = 0.1 * radius;
      const double sphere = radius * radius / depth;
      fem::PressTarget target;
      target.axis = {fem::AxisControl::at(x), fem::AxisControl::at(y),
                     fem::AxisControl::at(sharp ? -depth : sphere - depth)};
      const fem::ContactShape shape = sharp ? fem::ContactShape(fem::RoundedCylinder{radius, 0.0, 8.0})
                                            : fem::ContactShape(fem::SphereShape{sphere});
      fem::Press press(gel, shape, 0.0);
      const fem::PressState& state = press.step(target);
      const double expected = sharp ? closed_forms::flat_punch_on_layer(kModulus, nu, kThickness, radius, depth).force
                                    : closed_forms::sphere_on_layer(kModulus, nu, kThickness, sphere, depth).force;
      const double ratio = std::abs(state.wrench[2] - expected) / fem::estimate_error(gel, state).force.z();
      squares += ratio * ratio / kPresses;
      largest = std::max(largest, ratio);
    }
    std::printf("nu %g, %s: true force error over estimated: root mean square %.2f, largest %.2f\n", nu,
                sharp ? "punches" : "spheres", std::sqrt(squares), largest);
    EXPECT_GT(std::sqrt(squares), 0.3);
    EXPECT_LT(std::sqrt(squares), 1.6);
    EXPECT_LT(largest, 3.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Materials, LayerReference, ::testing::Values(0.3, 0.49));

}  // namespace
}  // namespace touchstone::lab
