#include "render/spectral_curve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::render {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kSpectra = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes" / "spectra";

SpectralCurve shipped(const char* name, CurveKind kind) {
  return read_spectral_curve(kSpectra / (std::string(name) + ".csv"), kind);
}

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

TEST(SpectralCurve, BandsShareALampsPowerWithoutLoss) {
  const SpectralCurve white = shipped("led-white-4000K", CurveKind::relative);
  for (const int count : {1, 3, 8, 16}) {
    const Spectrum powers = band_powers(white, 2.5, even_bands(400, 760, count));
    EXPECT_EQ(powers.size(), count);
    EXPECT_NEAR(powers.sum(), 2.5, 1e-12);
    EXPECT_GE(powers.minCoeff(), 0.0);
  }
  EXPECT_LT(band_powers(white, 2.5, even_bands(500, 600, 4)).sum(), 2.0);  // the rest is outside
}

TEST(SpectralCurve, MeansOfNarrowBandsAreTheCurve) {
  const SpectralCurve film = shipped("film-yellow-500", CurveKind::share);
  const SpectralBands bands = even_bands(400, 720, 16);
  const Spectrum means = band_means(film, bands);
  const Spectrum centres = bands.centres_nm();
  for (int k = 0; k < bands.count(); ++k) EXPECT_NEAR(means[k], film.at(centres[k]), 0.03);
  // 400 to 500 nm is stopped, the rest passes: that is what makes it yellow.
  EXPECT_LT(film.mean(400, 480), 0.02);
  EXPECT_GT(film.mean(540, 700), 0.85);
}

TEST(SpectralCurve, ErrorOfProductsFallsWithTheBands) {
  // What a green pixel gets of white light that goes through yellow film, off magenta print and back through the film.
  const std::vector<SpectralCurve> seen = {
      shipped("led-white-4000K", CurveKind::relative), shipped("film-yellow-500", CurveKind::share),
      shipped("film-yellow-500", CurveKind::share), shipped("pigment-magenta", CurveKind::share),
      shipped("qe-imx273-green", CurveKind::share)};
  const double three = band_product_error(seen, even_bands(400, 760, 3));
  const double eight = band_product_error(seen, even_bands(400, 760, 8));
  const double sixteen = band_product_error(seen, even_bands(400, 760, 16));
  EXPECT_GT(three, 0.2);  // DESIGN.md, Light: three bands won't do for the chroma sensor
  EXPECT_GT(three, 2.0 * eight);
  EXPECT_GT(eight, 2.0 * sixteen);
  EXPECT_LT(sixteen, 0.1);
  const std::vector<SpectralCurve> film = {seen[1]};
  EXPECT_LT(band_product_error(film, even_bands(400, 760, 1)), 1e-12);
}

TEST(SpectralCurve, ProductErrorIsExactForStraightLines) {
  // Mean of x (1 - x) over [0, 1] is 1/6, product of the means 1/4: off by 1/12, half of the mean.
  const SpectralCurve up{{500, 600}, {0.0, 1.0}, ""};
  const SpectralCurve down{{500, 600}, {1.0, 0.0}, ""};
  EXPECT_NEAR(band_product_error(std::vector{up, down}, even_bands(500, 600, 1)), 0.5, 1e-12);
}

TEST(SpectralCurve, AsManyBandsAsTheProductNeeds) {
  const SpectralCurve film = shipped("film-yellow-500", CurveKind::share);
  const SpectralCurve grey{{400, 700}, {0.5, 0.5}, ""};
  const std::vector<std::vector<SpectralCurve>> plain = {{grey, film}, {grey, grey}};
  EXPECT_EQ(bands_needed(plain, 400, 760, 1e-9), 1);  // one curve that varies is no trouble
  const std::vector<std::vector<SpectralCurve>> filtered = {
      {film, film, shipped("pigment-magenta", CurveKind::share), shipped("led-white-4000K", CurveKind::relative)}};
  EXPECT_EQ(bands_needed(filtered, 400, 760, 0.001), 16);
  EXPECT_EQ(bands_needed(filtered, 400, 760, 0.5), 1);
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

TEST(SpectralBands, WrongOnesAreRefused) {
  EXPECT_THROW(even_bands(700, 400, 3), Error);
  EXPECT_THROW(even_bands(400, 700, 0), Error);
  EXPECT_THROW(even_bands(400, 700, 17), Error);
  EXPECT_THROW(even_bands(0, 700, 3), Error);
  const SpectralCurve red = shipped("led-red-625", CurveKind::relative);
  EXPECT_THROW(band_powers(red, 1.0, even_bands(380, 500, 3)), Error);
}

}  // namespace
}  // namespace touchstone::render
