#include "datasets/inspection/inspected_draw.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "datasets/inspection/inspection_page.h"
#include "datasets/sets/generate.h"
#include "tests/support/small_draw.h"

namespace touchstone::datasets {
namespace {

constexpr const char* kBalls = R"(name: balls
licence: CC0-1.0
seed: 4
samples: 4
samples_per_file: 2
draw:
  device: device.yaml
  units: {count: 2, vary: [{path: 'lamps[*].power_W[*]', times: {uniform: [0.9, 1.1]}}]}
  objects: [{file: ball.yaml}]
  place_mm: {x: {uniform: [-1.5, 1.5]}, y: {uniform: [-1.5, 1.5]}}
  force_N: {uniform: [0.2, 0.3]}
outputs: [frame, height, contact]
splits: {train: 0.5, test: 0.5, by: unit}
)";

/// A drawn set as `touchstone generate` makes it, made once: balls pressed straight down.
class InspectedDraw : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder;
    const auto job = test::write_small_draw(*folder_, kBalls);
    generate(job, folder_->path() / "set", simulated(folder_->path() / "cache"));
    set_ = new InspectedSet(read_inspected_set(folder_->path() / "set"));
  }
  static void TearDownTestSuite() {
    delete set_;
    delete folder_;
  }
  static test::TemporaryFolder* folder_;
  static InspectedSet* set_;
};
test::TemporaryFolder* InspectedDraw::folder_ = nullptr;
InspectedSet* InspectedDraw::set_ = nullptr;

TEST_F(InspectedDraw, TheSurfaceIsTheImprintOfTheBall) {
  ASSERT_EQ(set_->samples.size(), 4u);
  constexpr double kRadius = 1.5;
  for (std::size_t i = 0; i < set_->samples.size(); ++i) {
    const InspectedGel gel = read_inspected_gel(*set_, i);
    ASSERT_GT(gel.triangles.size(), 1000u) << "sample " << i;
    const Eigen::Vector3d centre = set_->samples[i].gel_from_object.translation;
    std::size_t deepest = 0;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    int touching = 0;
    double worst = 0.0;
    for (std::size_t k = 0; k < gel.displaced.size(); ++k) {
      if (gel.displaced[k].z() < gel.displaced[deepest].z()) deepest = k;
      if (!gel.contact[k]) continue;
      ++touching;
      middle += gel.displaced[k].head<2>();
      worst = std::max(worst, std::abs((gel.displaced[k] - centre).norm() - kRadius));
    }
    ASSERT_GT(touching, 50) << "sample " << i;
    EXPECT_LT(touching, static_cast<int>(gel.contact.size()) / 3) << "sample " << i << ": most of it is free";
    middle /= touching;
    EXPECT_LT((middle - centre.head<2>()).norm(), 0.1) << "sample " << i << " touches at " << middle.transpose();
    EXPECT_NEAR(gel.displaced[deepest].z(), centre.z() - kRadius, 0.02) << "sample " << i;
    EXPECT_LT(worst, 0.05) << "sample " << i << ": what touches lies on the ball";
  }
}

TEST_F(InspectedDraw, NoTableIsWiderThanThePage) {
  const std::string page = inspection_page(*set_, std::nullopt, "", std::nullopt);
  const auto count = [&](const char* what) {
    const std::regex one(what);
    return std::distance(std::sregex_iterator(page.begin(), page.end(), one), std::sregex_iterator());
  };
  EXPECT_EQ(count("<table>"), 3) << "sensors, what was drawn, arrays";
  EXPECT_EQ(count("<div class=\"wide\"><table>"), 3) << "each can be scrolled";
  // Nine numbers of two sensors: they stand in rows, so that they can be read without scrolling.
  EXPECT_EQ(count("<tr><td>lamps\\[[0-2]\\]\\.power_W\\[[0-2]\\]</td>(<td class=\"number\">[^<]*</td>){2}</tr>"), 9);
}

}  // namespace
}  // namespace touchstone::datasets
