#include "sensors/colour/ink_ownership.h"

#include <gtest/gtest.h>

namespace touchstone::sensors {
namespace {

constexpr InkRules kRules{.usual_area_px = 100.0, .most_under_neighbour = 0.1};

TEST(InkOwnership, APatchBelongsToTheFilterThatMostOfItIsUnder) {
  const InkOwners owners = own_ink({{100, false, {95, 0}}, {100, false, {8, 60}}}, 2, kRules);
  EXPECT_EQ(owners.owner, (std::vector<int>{0, 1}));
  EXPECT_EQ(owners.flaws, (std::vector<MarkerFlaw>{MarkerFlaw::kNone, MarkerFlaw::kNone}));
  EXPECT_EQ(owners.stray, 0);
}

TEST(InkOwnership, MoreThanTheAllowedPartUnderANeighbourFlawsBoth) {
  const InkOwners owners = own_ink({{100, false, {11, 60, 0}}, {100, false, {0, 0, 90}}}, 3, kRules);
  EXPECT_EQ(owners.flaws,
            (std::vector<MarkerFlaw>{MarkerFlaw::kTwoFilters, MarkerFlaw::kTwoFilters, MarkerFlaw::kNone}));
}

TEST(InkOwnership, TwoWholePatchesUnderOneFilterFlawIt) {
  EXPECT_EQ(own_ink({{60, false, {50}}, {60, false, {40}}}, 1, kRules).flaws[0], MarkerFlaw::kTwoFilters);
  EXPECT_EQ(own_ink({{80, false, {70}}, {15, false, {15}}}, 1, kRules).flaws[0], MarkerFlaw::kNone);
}

TEST(InkOwnership, APatchOfTwoMarkersFlawsEveryFilterItIsUnder) {
  const InkOwners owners = own_ink({{190, false, {100, 5}}}, 2, kRules);
  EXPECT_EQ(owners.flaws, (std::vector<MarkerFlaw>{MarkerFlaw::kTwoFilters, MarkerFlaw::kTwoFilters}));
}

TEST(InkOwnership, InkUnderNoFilterIsStrayAndAFilterWithoutInkIsMissing) {
  const InkOwners owners = own_ink({{100, false, {0, 0}}, {10, false, {0, 0}}, {90, true, {0, 90}}}, 2, kRules);
  EXPECT_EQ(owners.stray, 1);
  EXPECT_EQ(owners.owner, (std::vector<int>{-1, -1, 1}));
  EXPECT_EQ(owners.flaws, (std::vector<MarkerFlaw>{MarkerFlaw::kMissing, MarkerFlaw::kCutOff}));
}

TEST(InkOwnership, MarkersEnclosedByDoubtfulOnesAreDoubted) {
  const Eigen::Vector2i grid(5, 5);
  const std::vector<Eigen::Vector2d> shift(25, Eigen::Vector2d::Zero());
  const std::vector<std::uint8_t> at_rest(25, 0);
  std::vector<MarkerFlaw> flaws(25, MarkerFlaw::kNone);
  for (const std::size_t i : {7u, 11u, 13u, 17u}) flaws[i] = MarkerFlaw::kTwoFilters;
  doubt_enclosed(grid, shift, at_rest, flaws);
  EXPECT_EQ(flaws[12], MarkerFlaw::kTwoFilters);  // only diagonals lead out
  for (const std::size_t i : {0u, 6u, 8u, 16u, 18u, 24u}) EXPECT_EQ(flaws[i], MarkerFlaw::kNone) << i;
  flaws.assign(25, MarkerFlaw::kNone);
  for (const std::size_t i : {7u, 11u, 17u}) flaws[i] = MarkerFlaw::kTwoFilters;
  doubt_enclosed(grid, shift, at_rest, flaws);
  EXPECT_EQ(flaws[12], MarkerFlaw::kNone);
}

TEST(InkOwnership, AJumpOfAShiftEndsTheChain) {
  const Eigen::Vector2i grid(5, 5);
  std::vector<Eigen::Vector2d> shift(25, Eigen::Vector2d::Zero());
  for (const std::size_t i : {7u, 11u, 12u, 13u, 17u}) shift[i] = {-0.4, 0.0};
  std::vector<MarkerFlaw> flaws(25, MarkerFlaw::kNone);
  doubt_enclosed(grid, shift, std::vector<std::uint8_t>(25, 0), flaws);
  EXPECT_EQ(flaws[12], MarkerFlaw::kNone);  // nothing says that one has left its filter
  flaws[6] = MarkerFlaw::kMissing;
  doubt_enclosed(grid, shift, std::vector<std::uint8_t>(25, 0), flaws);
  for (const std::size_t i : {7u, 11u, 12u, 13u, 17u}) EXPECT_EQ(flaws[i], MarkerFlaw::kTwoFilters) << i;
  // One that was missing at rest says nothing.
  flaws.assign(25, MarkerFlaw::kNone);
  flaws[6] = MarkerFlaw::kMissing;
  std::vector<std::uint8_t> at_rest(25, 0);
  at_rest[6] = 1;
  doubt_enclosed(grid, shift, at_rest, flaws);
  EXPECT_EQ(flaws[12], MarkerFlaw::kNone);
}

}  // namespace
}  // namespace touchstone::sensors
