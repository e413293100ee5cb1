#include "lab/studies/bead_design_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "lab/studies/study.h"
#include "sim/scene/device.h"
#include "tests/support/message_of.h"

namespace touchstone::lab {
namespace {

double of(const std::vector<DesignFigure>& figures, const std::vector<double>& values, const std::string& name) {
  return values[figure_number(figures, name, {})];
}

TEST(BeadDesign, OfTheVhsSensorHoldsItsOrders) {
  const std::filesystem::path scenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";
  BeadDesignSpec spec = std::get<BeadDesignSpec>(read_study(scenes / "studies" / "vhs-thickness-spacing.yaml").kind);
  spec.exposures = 6;
  sim::DeviceSpec device = spec.base.device;
  device.mesh.fine_mm = 0.7;
  const std::vector<DesignFigure> figures = bead_design_figures(spec);
  const std::vector<double> found = bead_design(spec, device, {});
  ASSERT_EQ(found.size(), figures.size());
  for (std::size_t f = 0; f < found.size(); ++f) EXPECT_TRUE(std::isfinite(found[f])) << figures[f].name;
  const auto figure = [&](const char* name) { return of(figures, found, name); };
  // No estimate, of a force or of a centroid, is better than can be.
  EXPECT_GT(figure("error_over_bound"), 1.0);
  EXPECT_GT(figure("tracker_noise_px"), figure("least_noise_px"));
  EXPECT_GT(figure("bound_unknown_place_N"), figure("bound_N"));
  // The published sensor bears its 5 N, at 0.93 mm by the device file's own reckoning, and trained to convergence it is
  // off by 0.18 N, whatever the mesh (0.176, 0.190 and 0.183 with edges of 0.7, 0.6 and 0.5 mm).
  EXPECT_GT(figure("range_N"), 5.0);
  EXPECT_NEAR(figure("depth_mm"), 0.93, 0.05);
  EXPECT_NEAR(figure("error_N"), 0.18, 0.04);
  EXPECT_EQ(figure("frame_rate_Hz"), 601.25);
  // In the dark the tracker has nothing to follow, and the study says so.
  device.camera->exposure_us = 1.0;
  EXPECT_THAT(test::message_of([&] { bead_design(spec, device, {}); }), ::testing::HasSubstr("loses bead"));
}

}  // namespace
}  // namespace touchstone::lab
