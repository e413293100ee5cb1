#include <gtest/gtest.h>

#include "closed_forms/contact_closed_forms.h"
#include "sensors/heights/ball_imprint.h"

namespace touchstone {
namespace {

// The estimators' imprint and the closed form were written apart, with other quadratures: the depth at which one has a
// contact radius gives it to the other.
TEST(BallImprint, HasTheLayersDepth) {
  for (const auto& [ball, contact, thickness] :
       {std::tuple{2.35, 2.0, 4.0}, {2.35, 1.0, 4.0}, {4.0, 2.0, 1.0}, {4.0, 0.3, 2.0}, {6.0, 1.0, 10.0}}) {
    const sensors::BallImprint imprint(ball, contact, thickness);
    EXPECT_NEAR(closed_forms::sphere_on_layer(0.3, 0.5, thickness, ball, imprint.depth()).contact_radius, contact,
                1e-5 * contact)
        << ball << ", " << contact << ", " << thickness;
  }
}

}  // namespace
}  // namespace touchstone
