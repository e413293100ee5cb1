#include "sensors/tractions/seen_markers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

MarkerCompliance two_markers() {
  MarkerCompliance compliance;
  compliance.marker_grid = {2, 1};
  compliance.marker_rest = {{-6.0, 1.0, 0.0}, {9.0, 1.0, 0.0}};
  compliance.patch_grid = {1, 1};
  compliance.patch_side = 2.0;
  compliance.displacement.resize(6, 3);
  compliance.displacement << 4, 1, 2, 0, 3, 1, 1, 0, 5, 4, 1, -2, 1, 3, 0, 2, 0, 7;
  compliance.displacement *= 1e-4;
  compliance.thickness = 8.0;
  compliance.youngs_modulus = 0.4;
  compliance.poisson_ratio = 0.5;
  return compliance;
}

MarkerField moved_by(const MarkerCompliance& compliance, const Eigen::Vector3d& traction) {
  const Eigen::VectorXd all = compliance.displacement * traction;
  return {compliance.marker_grid, {all.head<3>(), all.tail<3>()}, {1, 1}};
}

TEST(SeenMarkers, TheMapOfWhatIsSeenTellsWhatIsSeen) {
  const ViewParallax parallax{60.0, {1.0, -2.0}};
  const MarkerCompliance straight = two_markers();
  const Eigen::Vector3d traction(0.3, -0.2, -1.0);
  const MarkerField seen = as_seen(moved_by(straight, traction), straight, parallax);
  const MarkerField mapped = moved_by(as_seen(straight, parallax), traction);
  for (std::size_t m = 0; m < 2; ++m) {
    EXPECT_LT((seen.displacement[m] - mapped.displacement[m]).norm(), 1e-8) << "second order in 1e-3 mm over 60 mm";
    EXPECT_GT((seen.displacement[m] - moved_by(straight, traction).displacement[m]).norm(), 1e-6);
  }
}

TEST(SeenMarkers, FromFarAwayNothingShifts) {
  const MarkerCompliance straight = two_markers();
  EXPECT_EQ(as_seen(straight, {}).displacement, straight.displacement);
  const MarkerField field = moved_by(straight, {0.1, 0.2, -1.0});
  EXPECT_EQ(as_seen(field, straight, {}).displacement, field.displacement);
}

TEST(SeenMarkers, FieldAndMapMustBelongTogether) {
  MarkerField field = moved_by(two_markers(), {0, 0, -1});
  field.grid = {1, 1};
  EXPECT_THAT([&] { as_seen(field, two_markers(), {}); },
              ::testing::ThrowsMessage<Error>(::testing::HasSubstr("grid of 1 x 1")));
  EXPECT_THAT([&] { as_seen(MarkerCompliance{}, {}); },
              ::testing::ThrowsMessage<Error>(::testing::HasSubstr("markers as seen")));
}

}  // namespace
}  // namespace touchstone::sensors
