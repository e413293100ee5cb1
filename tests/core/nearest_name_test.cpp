#include "core/nearest_name.h"

#include <gtest/gtest.h>

#include <vector>

namespace touchstone {
namespace {

const std::vector<std::string> kKnown = {"thickness_mm", "poisson_ratio", "youngs_modulus_MPa", "mu", "size_mm"};

TEST(NearestName, FindsSlipsOfTheKey) {
  EXPECT_EQ(nearest_name("thicknes_mm", kKnown), "thickness_mm");    // a letter missing
  EXPECT_EQ(nearest_name("thickness_mmm", kKnown), "thickness_mm");  // one too many
  EXPECT_EQ(nearest_name("poison_ratoi", kKnown), "poisson_ratio");  // several
  EXPECT_EQ(nearest_name("thickness_mm", kKnown), "thickness_mm");   // none
  EXPECT_EQ(nearest_name("my", kKnown), "mu");                       // one is allowed in a short name
}

TEST(NearestName, SaysNothingWhenNothingIsNear) {
  EXPECT_EQ(nearest_name("colour", kKnown), std::nullopt);
  EXPECT_EQ(nearest_name("xy", kKnown), std::nullopt);
  EXPECT_EQ(nearest_name("anything", {}), std::nullopt);
  EXPECT_EQ(did_you_mean("colour", kKnown), "");
}

TEST(NearestName, AsksPolitely) {
  EXPECT_EQ(did_you_mean("sizemm", kKnown), " (did you mean 'size_mm'?)");
}

}  // namespace
}  // namespace touchstone
