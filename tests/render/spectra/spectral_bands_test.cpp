#include "render/spectra/spectral_bands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/error.h"

namespace touchstone::render {
namespace {

SpectralCurve shipped(const std::string& name, CurveKind kind = CurveKind::share) {
  return read_spectral_curve(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes" / "spectra" / (name + ".csv"),
                             kind);
}

/// The chroma sensor's hardest paths: white light through the yellow film or beside it, off magenta or white, back
/// through the film, into a red, green or blue pixel.
struct Chroma {
  SpectralCurve lamp = shipped("led-white-4000K", CurveKind::relative);
  std::vector<SpectralPath> paths;
  Chroma() {
    const SpectralCurve film = shipped("film-yellow-500");
    for (const char* pixel : {"red", "green", "blue"}) {
      for (const char* pigment : {"pigment-magenta", "silicone-white"}) {
        const SpectralCurve efficiency = shipped(std::string("qe-imx273-") + pixel);
        paths.push_back({lamp, {film, shipped(pigment), film, efficiency}});
        paths.push_back({lamp, {shipped(pigment), efficiency}});
      }
    }
  }
  double worst(const SpectralBands& bands) const {
    double error = 0.0;
    for (const SpectralPath& path : paths) error = std::max(error, band_error(path, bands));
    return error;
  }
  SpectralBands adapted(int count) const { return adapted_bands(paths, lamp, 400, 720, count); }
};

TEST(SpectralBands, ShareALampsPowerWithoutLoss) {
  const SpectralCurve white = shipped("led-white-4000K", CurveKind::relative);
  for (const int count : {1, 3, 8, 16}) {
    const Spectrum powers = band_powers(white, 2.5, even_bands(400, 760, count));
    EXPECT_EQ(powers.size(), count);
    EXPECT_NEAR(powers.sum(), 2.5, 1e-12);
    EXPECT_GE(powers.minCoeff(), 0.0);
  }
  EXPECT_LT(band_powers(white, 2.5, even_bands(500, 600, 4)).sum(), 2.0);  // the rest is outside
}

TEST(SpectralBands, MeansOfNarrowOnesAreTheCurve) {
  const SpectralCurve film = shipped("film-yellow-500");
  const SpectralBands bands = even_bands(400, 720, 16);
  const Spectrum means = band_means(film, bands);
  const Spectrum centres = bands.centres_nm();
  for (int k = 0; k < bands.count(); ++k) EXPECT_NEAR(means[k], film.at(centres[k]), 0.03);
  // 400 to 500 nm is stopped, the rest passes: that is what makes it yellow.
  EXPECT_LT(film.mean(400, 480), 0.02);
  EXPECT_GT(film.mean(540, 700), 0.85);
}

TEST(SpectralBands, WeightMovesMeansAndCentresToWhereTheLightIs) {
  // Light only from 500 to 600 nm, even: in one band from 400 to 800 nm all else is what it is at 550 nm on average.
  SpectralBands bands = even_bands(400, 800, 1);
  const SpectralCurve rising{{400, 800}, {0.0, 1.0}, ""};
  EXPECT_NEAR(band_means(rising, bands)[0], 0.5, 1e-12);
  EXPECT_NEAR(bands.centres_nm()[0], 600.0, 1e-12);
  bands.weight = SpectralCurve{{500, 600}, {1.0, 1.0}, ""};
  EXPECT_NEAR(band_means(rising, bands)[0], 0.375, 1e-12);
  EXPECT_NEAR(bands.centres_nm()[0], 550.0, 1e-9);
  bands.weight = SpectralCurve{{900, 950}, {1.0, 1.0}, ""};  // none of it in the band: as without
  EXPECT_NEAR(band_means(rising, bands)[0], 0.5, 1e-12);
}

TEST(SpectralBands, ErrorOfOneFactorIsNothingAndOfTwoTheirCovariance) {
  // Mean of x (1 - x) over [0, 1] is 1/6, product of the means 1/4: off by 1/12, half of the mean.
  const SpectralCurve light{{500, 600}, {1.0, 1.0}, ""};
  const SpectralCurve up{{500, 600}, {0.0, 1.0}, ""};
  const SpectralCurve down{{500, 600}, {1.0, 0.0}, ""};
  EXPECT_NEAR(band_error({light, {up}}, even_bands(500, 600, 1)), 0.0, 1e-12);
  EXPECT_NEAR(band_error({light, {up, down}}, even_bands(500, 600, 1)), 0.5, 1e-4);
  // Over half the width the covariance is a quarter.
  EXPECT_NEAR(band_error({light, {up, down}}, even_bands(500, 600, 2)), 0.125, 1e-4);
  // Nothing arrives: nothing is wrong.
  EXPECT_EQ(band_error({light, {{{500, 600}, {0.0, 0.0}, ""}}}, even_bands(500, 600, 2)), 0.0);
}

TEST(SpectralBands, AdaptedOnesPutTheirEdgesOnASteepFilter) {
  // A filter that opens at 607 nm, twice: two bands with their edge there are exact to what lies on the edge's flank.
  const SpectralCurve light{{400, 700}, {1.0, 1.0}, ""};
  const SpectralCurve filter{{400, 606, 608, 700}, {0.0, 0.0, 1.0, 1.0}, ""};
  const std::vector<SpectralPath> twice = {{light, {filter, filter}}};
  const SpectralBands bands = adapted_bands(twice, std::nullopt, 400, 700, 2);
  EXPECT_NEAR(bands.edges_nm[1], 607.0, 1.5);
  EXPECT_LT(band_error(twice[0], bands), 0.01);
  EXPECT_GT(band_error(twice[0], even_bands(400, 700, 2)), 0.2);
}

TEST(SpectralBands, AdaptedOnesAreRightForTheChromaSensor) {
  const Chroma chroma;
  SpectralBands even = even_bands(400, 720, 3);
  EXPECT_GT(chroma.worst(even), 0.3);  // three bands won't do for the chroma sensor
  even = even_bands(400, 720, 16);
  const double eight = chroma.worst(chroma.adapted(8));
  const double sixteen = chroma.worst(chroma.adapted(16));
  RecordProperty("three_even", std::to_string(chroma.worst(even_bands(400, 720, 3))));
  RecordProperty("sixteen_even", std::to_string(chroma.worst(even)));
  RecordProperty("three", std::to_string(chroma.worst(chroma.adapted(3))));
  RecordProperty("eight", std::to_string(eight));
  RecordProperty("sixteen", std::to_string(sixteen));
  EXPECT_LT(sixteen, 0.25 * chroma.worst(even));
  EXPECT_LT(eight, chroma.worst(even));
  EXPECT_LT(sixteen, 0.02);
}

TEST(SpectralBands, AsManyAsThePathsNeed) {
  const Chroma chroma;
  const std::array counts = {1, 3, 8, 16};
  const auto needed = [&](std::span<const SpectralPath> paths, double tolerance) {
    return bands_within(paths, chroma.lamp, 400, 720, tolerance, counts).count();
  };
  const SpectralCurve grey{{400, 700}, {0.5, 0.5}, ""};
  const std::vector<SpectralPath> plain = {{chroma.lamp, {grey, shipped("film-yellow-500")}}};
  EXPECT_EQ(needed(plain, 1e-9), 1);  // one thing that varies is no trouble
  EXPECT_EQ(needed(chroma.paths, 1e-9), 16);
  EXPECT_EQ(needed(chroma.paths, 10.0), 1);
  EXPECT_EQ(needed({}, 1e-9), 1);
}

TEST(SpectralBands, WrongOnesAreRefused) {
  EXPECT_THROW(even_bands(700, 400, 3), Error);
  EXPECT_THROW(even_bands(400, 700, 0), Error);
  EXPECT_THROW(even_bands(400, 700, 17), Error);
  EXPECT_THROW(even_bands(0, 700, 3), Error);
  EXPECT_THROW(adapted_bands({}, std::nullopt, 400, 420, 16), Error);
  const SpectralCurve red = shipped("led-red-625", CurveKind::relative);
  EXPECT_THROW(band_powers(red, 1.0, even_bands(380, 500, 3)), Error);
}

}  // namespace
}  // namespace touchstone::render
