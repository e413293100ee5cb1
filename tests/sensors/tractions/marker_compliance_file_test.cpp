#include "sensors/tractions/marker_compliance_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "tests/sensors/models/payload_file_laws.h"
#include "tests/sensors/tractions/half_space_markers.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sensors {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class MarkerComplianceFile : public ::testing::Test {
 protected:
  auto reading(std::string bytes) {
    return [bytes = std::move(bytes)] { marker_compliance_from_bytes(bytes, "m.bin"); };
  }
  std::string replaced(const std::string& from, const std::string& to) {
    return fixtures::with_line_changed(bytes_, from, to);
  }
  const MarkerCompliance map_ = fixtures::half_space_markers(3, 4, 2.0);
  const std::string bytes_ = to_bytes(map_);
};

TEST_F(MarkerComplianceFile, ReadingGivesTheSameBits) {
  const touchstone::test::TemporaryFolder folder;
  save(map_, folder.path() / "m.bin");
  const MarkerCompliance read = load_marker_compliance(folder.path() / "m.bin");
  EXPECT_EQ(to_bytes(read), bytes_);
  EXPECT_EQ(read.displacement, map_.displacement);
  EXPECT_EQ(read.marker_rest, map_.marker_rest);
  EXPECT_EQ(read.gel, "half space");
  EXPECT_EQ(read.patch_centre(5), map_.patch_centre(5));
}

TEST_F(MarkerComplianceFile, DamageIsNoticed) {
  EXPECT_THAT(reading(""), ThrowsMessage<Error>(HasSubstr("m.bin: isn't a marker compliance")));
  EXPECT_THAT(reading("\n"), ThrowsMessage<Error>(HasSubstr("isn't a marker compliance")));
  fixtures::expect_damage_is_noticed([](const std::string& bytes) { marker_compliance_from_bytes(bytes, "m.bin"); },
                                     bytes_);
}

TEST_F(MarkerComplianceFile, FieldsAreChecked) {
  EXPECT_THAT(reading(replaced("\"thickness_mm\"", "\"thicknes_mm\"")),
              ThrowsMessage<Error>(HasSubstr("'thicknes_mm' isn't known (did you mean 'thickness_mm'?)")));
  EXPECT_THAT(reading(replaced("\"thickness_mm\":5.0", "\"thickness_mm\":0.0")),
              ThrowsMessage<Error>(HasSubstr("thickness is 0 mm")));
  EXPECT_THAT(reading(replaced("\"version\":1", "\"version\":2")), ThrowsMessage<Error>(HasSubstr("version")));
  EXPECT_THAT(reading(replaced("touchstone.marker_compliance", "touchstone.height_model")),
              ThrowsMessage<Error>(HasSubstr("'touchstone.marker_compliance' is needed")));
  EXPECT_THAT(reading(replaced("\"marker_grid\":[3,3]", "\"marker_grid\":[3,4]")),
              ThrowsMessage<Error>(HasSubstr("bytes after its first line")));
  EXPECT_THAT(reading(replaced("\"patch_grid\":[4,4]", "\"patch_grid\":[4000,4000]")),
              ThrowsMessage<Error>(HasSubstr("16000000 patches")));
  EXPECT_THAT(reading(replaced("\"patch_grid\":[4,4]", "\"patch_grid\":[4,\"4\"]")),
              ThrowsMessage<Error>(HasSubstr("patch_grid[1]")));
  EXPECT_THAT(reading(replaced("\"poisson_ratio\":0.5", "\"poisson_ratio\":0.6")),
              ThrowsMessage<Error>(HasSubstr("poisson_ratio is 0.6")));
}

TEST_F(MarkerComplianceFile, FaultyMapsAreNotWritten) {
  const auto fault = [&](auto&& change) {
    MarkerCompliance map = map_;
    change(map);
    EXPECT_THAT([&] { to_bytes(map); }, ThrowsMessage<Error>(HasSubstr("marker compliance: ")));
    return fault_of(map);
  };
  EXPECT_EQ(fault_of(map_), "");
  EXPECT_THAT(fault([](MarkerCompliance& m) { m.marker_grid = {3, 0}; }), HasSubstr("marker grid is 3 x 0"));
  EXPECT_THAT(fault([](MarkerCompliance& m) { m.patch_grid = {1 << 20, 1 << 20}; }), HasSubstr("patch grid"));
  EXPECT_THAT(fault([](MarkerCompliance& m) { m.marker_rest.pop_back(); }), HasSubstr("8 rest positions"));
  EXPECT_THAT(fault([](MarkerCompliance& m) { m.displacement.conservativeResize(27, 47); }), HasSubstr("27 x 47"));
  EXPECT_THAT(fault([](MarkerCompliance& m) { m.displacement.setZero(); }), HasSubstr("zero"));
  EXPECT_THAT(fault([](MarkerCompliance& m) { m.displacement(3, 4) = std::numeric_limits<double>::quiet_NaN(); }),
              HasSubstr("isn't finite"));
  EXPECT_THAT(fault([](MarkerCompliance& m) { m.patch_side = -1.0; }), HasSubstr("patch_side is -1"));
  EXPECT_THAT(fault([](MarkerCompliance& m) { m.youngs_modulus = 0.0; }), HasSubstr("youngs_modulus is 0"));
}

}  // namespace
}  // namespace touchstone::sensors
