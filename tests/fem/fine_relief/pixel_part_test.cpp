// Contact that is looked for in a part of its grid, against the whole grid's own.

#include "fem/fine_relief/pixel_part.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <vector>

namespace touchstone::fem {
namespace {

constexpr double kPitch_mm = 0.04;
constexpr PixelBox kWhole{-90, -70, 89, 79};
const ElasticMaterial kGel{0.33, 0.49};
constexpr PixelTolerance kTolerance{2e-5, 1000};

/// Responses by size, and how many pixels were asked for.
struct Responses {
  std::map<std::pair<int, int>, std::shared_ptr<const LayerResponse>> made;
  std::size_t largest = 0;

  ResponseOf get() {
    return [this](const PixelGrid& grid) {
      largest = std::max(largest, grid.size());
      auto& one = made[{grid.nx, grid.ny}];
      if (!one) one = std::make_shared<const LayerResponse>(kGel, 4.0, grid, GridEdges::free);
      return one;
    };
  }
};

/// Balls of 4 mm radius over the places given, the second `lower` mm higher than the first; none elsewhere.
std::vector<double> balls(const std::vector<Eigen::Vector2d>& places, double higher) {
  const PixelGrid grid = kWhole.grid(kPitch_mm);
  std::vector<double> gap(grid.size(), std::numeric_limits<double>::infinity());
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < grid.nx; ++i) {
      for (std::size_t k = 0; k < places.size(); ++k) {
        const double r2 = (grid.centre(i, j) - places[k]).squaredNorm();
        if (r2 >= 4.0) continue;
        double& here = gap[grid.at(i, j)];
        here = std::min(here, 4.0 - std::sqrt(16.0 - r2) + higher * static_cast<double>(k));
      }
    }
  }
  return gap;
}

void expect_same(const PixelContactAnswer& found, const PixelContactAnswer& expected) {
  ASSERT_TRUE(found.converged && expected.converged);
  EXPECT_NEAR(found.shift, expected.shift, 2e-5);
  EXPECT_NEAR(found.force, expected.force, 1e-4 * expected.force);
  double furthest = 0.0;
  for (std::size_t k = 0; k < found.displacement.size(); ++k) {
    furthest = std::max(furthest, std::abs(found.displacement[k] - expected.displacement[k]));
  }
  EXPECT_LT(furthest, 6e-5);  // each meets the gap to 2e-5
}

TEST(PixelPart, TheAnswerIsTheWholeGrids) {
  const std::vector<double> gap = balls({{0.8, -0.5}}, 0.0);
  Responses responses;
  const PixelContactAnswer whole =
      solve_pixel_contact(*responses.get()(kWhole.grid(kPitch_mm)), {gap, 0.5}, kTolerance);
  // Round the contact; so small that it spreads beyond all sides; beside it.
  for (const PixelBox part : {PixelBox{-10, -40, 50, 15}, PixelBox{15, -16, 25, -8}, PixelBox{20, -16, 50, 60}}) {
    expect_same(solve_in_part(responses.get(), kWhole, part, kPitch_mm, {gap, 0.5}, kTolerance, {}), whole);
  }
  // By pose, and from the answer itself.
  const std::vector<double> pressed = [&] {
    std::vector<double> lower = gap;
    for (double& g : lower) g -= 0.1;
    return lower;
  }();
  const PixelContactAnswer posed =
      solve_pixel_contact(*responses.get()(kWhole.grid(kPitch_mm)), {pressed, {}}, kTolerance);
  const PixelBox part{0, -30, 40, 5};
  expect_same(solve_in_part(responses.get(), kWhole, part, kPitch_mm, {pressed, {}}, kTolerance, {}), posed);
  expect_same(solve_in_part(responses.get(), kWhole, part, kPitch_mm, {pressed, {}}, kTolerance, posed.pressure),
              posed);
}

TEST(PixelPart, ABodyThatTouchesElsewhereTooIsntMissed) {
  const std::vector<double> gap = balls({{-2.0, -1.0}, {2.0, 1.0}}, 0.01);
  Responses responses;
  const PixelContactAnswer whole =
      solve_pixel_contact(*responses.get()(kWhole.grid(kPitch_mm)), {gap, 0.5}, kTolerance);
  expect_same(solve_in_part(responses.get(), kWhole, {-75, -50, -25, 0}, kPitch_mm, {gap, 0.5}, kTolerance, {}), whole);
}

TEST(PixelPart, NothingIsThereButInTheWhole) {
  const std::vector<double> gap = balls({{2.0, 1.0}}, 0.0);
  Responses responses;
  const PixelContactAnswer whole =
      solve_pixel_contact(*responses.get()(kWhole.grid(kPitch_mm)), {gap, 0.2}, kTolerance);
  expect_same(solve_in_part(responses.get(), kWhole, {-80, -60, -50, -30}, kPitch_mm, {gap, 0.2}, kTolerance, {}),
              whole);
}

}  // namespace
}  // namespace touchstone::fem
