#include "render/spectra/spectral_curve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::render {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kSpectra = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes" / "spectra";

std::string error_of(const std::string& content, CurveKind kind = CurveKind::share) {
  const test::TemporaryFolder folder;
  try {
    read_spectral_curve(folder.write("curve.csv", content), kind);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(SpectralCurve, IsLinearBetweenItsPointsAndConstantBeyond) {
  const SpectralCurve curve{{400, 500, 700}, {0.0, 1.0, 0.5}, ""};
  EXPECT_DOUBLE_EQ(curve.at(300), 0.0);
  EXPECT_DOUBLE_EQ(curve.at(450), 0.5);
  EXPECT_DOUBLE_EQ(curve.at(500), 1.0);
  EXPECT_DOUBLE_EQ(curve.at(600), 0.75);
  EXPECT_DOUBLE_EQ(curve.at(900), 0.5);
  EXPECT_DOUBLE_EQ(curve.integral(400, 700), 50.0 + 150.0);      // a triangle and a trapezium
  EXPECT_DOUBLE_EQ(curve.integral(350, 450), 0.5 * 50.0 * 0.5);  // nothing below 400 nm, then a triangle
  EXPECT_DOUBLE_EQ(curve.mean(700, 800), 0.5);
  EXPECT_DOUBLE_EQ(curve.mean(450, 450), 0.5);
}

TEST(SpectralCurve, AllShippedOnesAreSoundAndSayTheirSource) {
  int read = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kSpectra)) {
    const std::string name = entry.path().stem().string();
    const CurveKind kind = name.starts_with("led-")       ? CurveKind::relative
                           : name.starts_with("urethane") ? CurveKind::per_mm
                                                          : CurveKind::share;
    const SpectralCurve curve = read_spectral_curve(entry.path(), kind);
    EXPECT_GT(curve.source.size(), 20u) << name;
    ++read;
  }
  EXPECT_GE(read, 10);
}

TEST(SpectralCurve, BadFilesAreNamedByLineAndValue) {
  const std::string head = "# source: a test\nwavelength_nm,share\n";
  EXPECT_EQ(error_of(head + "400,0.1\n500,0.2\n"), "no error");
  EXPECT_EQ(error_of(head + "400,0.1\r\n500,0.2\r\n"), "no error");
  EXPECT_THAT(error_of(head + "400,0.1\n400,0.2\n"), HasSubstr("curve.csv:4: wavelength_nm: 400 follows 400"));
  EXPECT_THAT(error_of(head + "400,0.1\n500,1.2\n"), HasSubstr(":4: value: '1.2' must be a number from 0 to 1"));
  EXPECT_THAT(error_of(head + "400,0.1\n500,nan\n"), HasSubstr("'nan'"));
  EXPECT_THAT(error_of(head + "400,0.1\n500,-1\n", CurveKind::per_mm), HasSubstr("of at least 0"));
  EXPECT_THAT(error_of(head + "0.4,0.1\n0.5,0.2\n"), HasSubstr("'0.4' must be a number from 100 to 10000"));
  EXPECT_THAT(error_of(head + "400;0.1\n"), HasSubstr("has 1 cells"));
  EXPECT_THAT(error_of(head + "400,0.1,7\n"), HasSubstr("has 3 cells"));
  EXPECT_THAT(error_of(head + "400,0.1\n"), HasSubstr("has 1 rows; a spectrum needs two"));
  EXPECT_THAT(error_of("# source: a test\n400,0.1\n500,0.2\n"), HasSubstr("must stand before the rows"));
  EXPECT_THAT(error_of("wavelength_nm,share\n400,0.1\n500,0.2\n"), HasSubstr("# source:"));
  EXPECT_THAT(error_of(head + "400,0\n500,0\n", CurveKind::relative), HasSubstr("all values are 0"));
  EXPECT_THAT(error_of(""), HasSubstr("source"));
}

}  // namespace
}  // namespace touchstone::render
