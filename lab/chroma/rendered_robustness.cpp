#include "lab/chroma/rendered_robustness.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <variant>

#include "core/error.h"

namespace touchstone::lab {
namespace {

constexpr double kGel_mm = 8.0;  // as scenes/devices/chroma.yaml
constexpr double kGelIndex = 1.41;
constexpr double kWhite = 0.9;
constexpr double kBlack = 0.04;  // a matt black print; a size by a threshold hardly depends on it
constexpr double kLargest = 1.6;
constexpr int kRimParts = 16;  // the picture's rim that white is measured on is this part of its width

/// The camera of [Lin2019], as far from a gel as thick as the device's as it is from the paper's, with pixels so small
/// that the film has as many as are asked for. As on the device, the film stands before a marker of the usual side.
TiltSetup setup_of(const RenderedRungs& rungs) {
  TiltSetup setup = far_setup();
  setup.camera_mm += kGel_mm - setup.gel_mm;
  setup.gel_mm = kGel_mm;
  const auto camera = std::get<render::LensCamera>(tilt_camera(setup));
  setup.film_mm = setup.side_mm * (1.0 - kGel_mm / kGelIndex / camera.focus_distance_mm);
  const double marker_px = setup.side_mm * camera.matrix.fx / camera.focus_distance_mm;
  setup.pixel_pitch_um *= marker_px / rungs.filter_px;
  setup.half_view_mm = setup.side_mm * (1.0 - 1e-9);  // a whole number of pixels mustn't be rounded up by one
  setup.samples = rungs.samples;
  return setup;
}

/// Black markers behind a film that takes no light; its faces in the gel reflect a thousandth.
TiltSpectra black_and_white(TiltSpectra spectra) {
  spectra.magenta.setConstant(kBlack);
  spectra.film.setOnes();
  return spectra;
}

/// The mean brightness along the picture's rim, which is white.
double white_of(const cv::Mat& picture) {
  cv::Mat mask(picture.size(), CV_8U, cv::Scalar(255));
  const int rim = std::max(1, picture.cols / kRimParts);
  mask(cv::Rect(rim, rim, picture.cols - 2 * rim, picture.rows - 2 * rim)).setTo(0);
  const cv::Scalar mean = cv::mean(picture, mask);
  return (mean[0] + mean[1] + mean[2]) / 3.0;
}

}  // namespace

std::vector<RobustnessRung> rendered_robustness_rungs(const TiltSpectra& spectra, const RenderedRungs& rungs,
                                                      std::uint64_t seed) {
  if (rungs.count < 2) fail("rendered markers: {} sizes, at least 2 are needed", rungs.count);
  if (!(rungs.smallest > 0.0 && rungs.smallest < rungs.largest && rungs.largest <= kLargest)) {
    fail("rendered markers: sizes from {} to {} of the film's, they must rise, above 0 and up to {}", rungs.smallest,
         rungs.largest, kLargest);
  }
  if (!(rungs.filter_px >= 4.0)) fail("rendered markers: a film of {} px, at least 4 are needed", rungs.filter_px);
  const TiltSetup usual = setup_of(rungs);
  const TiltSpectra black = black_and_white(spectra);
  std::vector<RobustnessRung> made;
  double colour_exposure = 0.0, black_exposure = 0.0;
  for (int i = 0; i < rungs.count; ++i) {
    RobustnessRung rung;
    rung.displacement = rungs.smallest + (rungs.largest - rungs.smallest) * i / (rungs.count - 1);
    TiltSetup setup = usual;
    setup.side_mm *= rung.displacement;
    const auto picture_of = [&](const TiltSpectra& colours, int part) {
      return tilt_picture(setup, colours, TiltMarker::flat, {}, seed + static_cast<std::uint64_t>(2 * i + part));
    };
    const cv::Mat colour = picture_of(spectra, 0), grey = picture_of(black, 1);
    if (i == 0) {
      colour_exposure = kWhite / white_of(colour);
      black_exposure = kWhite / white_of(grey);
    }
    cv::cvtColor(colour_exposure * colour, rung.colour, cv::COLOR_RGB2BGR);
    cv::transform(grey, rung.black_white, cv::Matx13d::all(black_exposure / 3.0));
    made.push_back(std::move(rung));
  }
  return made;
}

}  // namespace touchstone::lab
