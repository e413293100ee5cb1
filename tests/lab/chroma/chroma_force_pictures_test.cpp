#include "lab/chroma/chroma_force_pictures.h"

#include <gtest/gtest.h>

#include "sim/scene/object.h"

namespace touchstone::lab {
namespace {

/// What is seen must be what presses: else the camera would look at another object's contact.
TEST(ChromaForcePictures, AProbeLooksAsItFeels) {
  for (const ForceProbe& probe : draw_force_probes(3, 8)) {
    const sim::ObjectSpec object = visible_object(probe);
    EXPECT_EQ(object.friction, probe.friction);
    const fem::ContactShape seen = sim::contact_shape(object.shape), pressed = contact_shape(probe);
    ASSERT_EQ(seen.index(), pressed.index());
    if (const auto* box = std::get_if<fem::BoxShape>(&pressed)) {
      EXPECT_EQ(std::get<fem::BoxShape>(seen).size, box->size);
    } else if (const auto* cylinder = std::get_if<fem::RoundedCylinder>(&pressed)) {
      EXPECT_EQ(std::get<fem::RoundedCylinder>(seen).radius, cylinder->radius);
      EXPECT_EQ(std::get<fem::RoundedCylinder>(seen).edge_radius, cylinder->edge_radius);
      EXPECT_EQ(std::get<fem::RoundedCylinder>(seen).height, cylinder->height);
    } else {
      EXPECT_EQ(std::get<fem::SphereShape>(seen).radius, std::get<fem::SphereShape>(pressed).radius);
    }
  }
}

/// Nothing that the rows are made of may be calibrated on.
TEST(ChromaForcePictures, CalibrationHasProbesOfItsOwn) {
  EXPECT_LT(calibration_probes(true).size(), calibration_probes(false).size());
  for (const ForceProbe& probe : calibration_probes(false)) {
    const bool ball = probe.shape == ProbeShape::hemisphere;
    EXPECT_NE(probe.shape, ProbeShape::square);
    EXPECT_LT(probe.width_mm, ball ? 20.0 : 10.0) << "narrower than any that draw_force_probes draws";
  }
}

TEST(ChromaForcePictures, GivenFieldsAreThoseOfTheirFrames) {
  std::vector<sensors::MarkerField> fields(2);
  fields[0].grid = {1, 1};
  fields[1].grid = {2, 2};
  const MarkerReader reader = fields_from(fields);
  const ForceProbe probe;
  const fem::PressState press;
  EXPECT_EQ(reader({probe, press, 1, 0.0, false, {}}).grid.x(), 2);
  EXPECT_EQ(reader({probe, press, 0, 0.0, false, {}}).grid.x(), 1);
}

}  // namespace
}  // namespace touchstone::lab
