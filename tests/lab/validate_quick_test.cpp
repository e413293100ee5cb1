// The quick forms of the groups that take seconds: every row holds.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "lab/validation.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

std::vector<ValidationRow> quick(const std::string& group) {
  const test::TemporaryFolder folder;
  ValidateOptions options;
  options.quick = true;
  options.cache = folder.path();
  options.scratch = folder.path();
  options.scenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";
  return validate({group}, validation_groups(), options);
}

class QuickValidation : public testing::TestWithParam<std::string> {};

TEST_P(QuickValidation, EveryRowHoldsAndIsNamedAfterItsGroup) {
  const std::vector<ValidationRow> rows = quick(GetParam());
  EXPECT_GE(rows.size(), 10u);
  std::set<std::string> ids;
  for (const ValidationRow& row : rows) {
    EXPECT_TRUE(row.holds) << row.id << ": " << row.ours;
    EXPECT_TRUE(ids.insert(row.id).second) << row.id << " stands twice";
    EXPECT_EQ(row.id.rfind(GetParam() + ".", 0), 0u) << row.id;
    EXPECT_TRUE(row.published || row.reference) << row.id << " is held against nothing";
  }
}

INSTANTIATE_TEST_SUITE_P(Groups, QuickValidation, testing::Values("mechanics", "vibration", "light"));

}  // namespace
}  // namespace touchstone::lab
