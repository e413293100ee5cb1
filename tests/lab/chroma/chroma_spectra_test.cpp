#include "lab/chroma/chroma_spectra.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/error.h"
#include "datasets/jobs/scenes_folder.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

sim::DeviceSpec chroma() {
  return sim::read_device(datasets::scenes_folder() / "devices" / "chroma.yaml");
}

TEST(ChromaSpectra, ArePartsOfTheLightAndProductsOfTheCurves) {
  const test::TemporaryFolder folder;
  const ChromaSpectra spectra = measure_chroma_spectra(chroma(), folder.path(), 16, 3);
  ASSERT_EQ(spectra.bands.count(), 16);
  for (const ChromaSpectrum& one : spectra.colours) {
    EXPECT_NEAR(one.rendered.sum(), 1.0, 1e-9) << one.name;
    EXPECT_NEAR(one.product.sum(), 1.0, 1e-9) << one.name;
    EXPECT_GE(one.rendered.minCoeff(), 0.0) << one.name;
  }
  for (const ChromaColour colour : {ChromaColour::magenta, ChromaColour::yellow, ChromaColour::red}) {
    EXPECT_LT(spectra.of(colour).error, 0.01) << spectra.of(colour).name;
  }
  // Were a place looked for beside its colour, its hue would be another one's.
  EXPECT_LT(spectra.of(ChromaColour::white).rendered_hue.saturation, 0.25);
  EXPECT_NEAR(spectra.of(ChromaColour::yellow).rendered_hue.hue_deg, 50.0, 8.0);
  EXPECT_NEAR(spectra.of(ChromaColour::red).rendered_hue.hue_deg, 6.0, 8.0);
  EXPECT_LT(spectra.of(ChromaColour::magenta).rendered_hue.hue_deg, -20.0);
}

TEST(ChromaSpectra, OfTheLampsLightAreGreyWhereItIsWhite) {
  const test::TemporaryFolder folder;
  // White balance makes the lamps' light grey, so what reflects all of it alike has no colour.
  const SeenHue white = measure_chroma_spectra(chroma(), folder.path(), 8, 3).of(ChromaColour::white).product_hue;
  EXPECT_LT(white.saturation, 0.02);
}

TEST(ChromaSpectra, ArePlottedWithTheirProducts) {
  ChromaSpectra spectra;
  spectra.bands = render::even_bands(400.0, 700.0, 3);
  for (ChromaSpectrum& one : spectra.colours) {
    one.rendered = one.product = render::Spectrum::Constant(3, 1.0 / 3.0);
  }
  const plots::LinePlot plot = plot_of(spectra);
  ASSERT_EQ(plot.curves.size(), 8u);
  EXPECT_EQ(plot.curves[1].colour, plot.curves[5].colour);
  EXPECT_FALSE(plot.curves[1].dashed);
  EXPECT_TRUE(plot.curves[5].dashed);
  EXPECT_NEAR(plot.curves[0].points[1].first, 550.0, 1e-9);
  EXPECT_NEAR(plot.curves[0].points[1].second, 100.0 / 300.0, 1e-9);
}

TEST(ChromaSpectra, RefuseADeviceThatHasNoneOrHidesThem) {
  const test::TemporaryFolder folder;
  const auto fault = [&](const std::function<void(sim::DeviceSpec&)>& spoil) -> std::string {
    sim::DeviceSpec device = chroma();
    spoil(device);
    try {
      measure_chroma_spectra(device, folder.path(), 1, 1);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(fault([](auto& d) { d.bands.reset(); }).find("bands"), std::string::npos);
  EXPECT_NE(fault([](auto& d) { d.films.reset(); }).find("films"), std::string::npos);
  EXPECT_NE(fault([](auto& d) { d.camera.reset(); }).find("camera"), std::string::npos);
  EXPECT_NE(fault([](auto& d) { d.lamps.clear(); }).find("lamps"), std::string::npos);
  EXPECT_NE(fault([](auto& d) { d.coating->print.reset(); }).find("markers"), std::string::npos);
  EXPECT_NE(fault([](auto& d) { d.coating->albedo = 0.9; }).find("coating.albedo"), std::string::npos);
  EXPECT_NE(fault([](auto& d) { d.coating->print->width_mm = 2.8; }).find("apart"), std::string::npos);
  EXPECT_NE(fault([](auto& d) { d.films->side_mm = 2.6; }).find("free"), std::string::npos);
}

}  // namespace
}  // namespace touchstone::lab
