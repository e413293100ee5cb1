// The quick form of dvs.light: every row but those that are times holds.

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "lab/validation/validation.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

TEST(QuickDvsLight, HoldsInEveryRow) {
  const test::TemporaryFolder folder;
  ValidateOptions options;
  options.quick = true;
  options.cache = folder.path();
  options.scratch = folder.path();
  options.scenes = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes";
  const std::vector<ValidationRow> rows = validate({"dvs.light"}, validation_groups(), options);
  EXPECT_EQ(rows.size(), 11u);
  std::set<std::string> ids;
  for (const ValidationRow& row : rows) {
    EXPECT_TRUE(ids.insert(row.id).second) << row.id << " stands twice";
    EXPECT_EQ(row.id.rfind("dvs.light.", 0), 0u) << row.id;
    EXPECT_TRUE(row.published || row.reference) << row.id << " is held against nothing";
    EXPECT_TRUE(std::isfinite(row.ours)) << row.id;
    const bool timed = row.id.find("emulator") != std::string::npos || row.id.find("core_s") != std::string::npos;
    EXPECT_TRUE(row.holds || timed) << row.id << ": " << row.ours;
  }
}

}  // namespace
}  // namespace touchstone::lab
