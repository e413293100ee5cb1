#include "lab/chroma/rendered_robustness.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/error.h"
#include "datasets/jobs/scenes_folder.h"

namespace touchstone::lab {
namespace {

const TiltSpectra& spectra() {
  static const TiltSpectra read = read_tilt_spectra(datasets::scenes_folder() / "spectra");
  return read;
}

RenderedRungs few() {
  RenderedRungs rungs;
  rungs.filter_px = 16.0;
  rungs.smallest = 0.75;  // rims on pixels' rims
  rungs.largest = 1.25;
  rungs.count = 5;
  return rungs;
}

TEST(RenderedRobustness, PicturesShowTheMarkerBehindTheFilm) {
  const std::vector<RobustnessRung> rungs = rendered_robustness_rungs(spectra(), few(), 1);
  ASSERT_EQ(rungs.size(), 5u);
  for (const RobustnessRung& rung : rungs) {
    ASSERT_EQ(rung.colour.size(), cv::Size(32, 32));
    ASSERT_EQ(rung.black_white.size(), cv::Size(32, 32));
    const auto corner = rung.colour.at<cv::Vec3f>(1, 1), middle = rung.colour.at<cv::Vec3f>(16, 16);
    for (int channel = 0; channel < 3; ++channel) EXPECT_NEAR(corner[channel], 0.9, 0.1) << rung.displacement;
    // Both in the mix: red, hardly any green or blue.
    EXPECT_GT(middle[2], 2.5 * middle[1]);
    EXPECT_GT(middle[2], 2.5 * middle[0]);
    EXPECT_NEAR(rung.black_white.at<float>(1, 1), 0.9, 0.1);
    EXPECT_LT(rung.black_white.at<float>(16, 16), 0.1);
  }
  // A pixel right outside the film at its left is white until the marker reaches it, then magenta.
  EXPECT_GT(rungs.front().colour.at<cv::Vec3f>(16, 7)[1], 0.7);
  EXPECT_LT(rungs.back().colour.at<cv::Vec3f>(16, 7)[1], 0.3);
  EXPECT_GT(rungs.back().colour.at<cv::Vec3f>(16, 7)[0], 0.3);
  // One right inside of it is yellow until then.
  EXPECT_LT(rungs.front().colour.at<cv::Vec3f>(16, 8)[0], 0.5);
  EXPECT_GT(rungs.front().colour.at<cv::Vec3f>(16, 8)[1], 0.4);
}

TEST(RenderedRobustness, TheBlackMarkersPixelsAreItsArea) {
  const std::vector<RobustnessRung> rungs = rendered_robustness_rungs(spectra(), few(), 1);
  for (const RobustnessRung& rung : rungs) {
    const double side = 16.0 * rung.displacement;
    const double dark = cv::sum(rung.black_white < 0.45)[0] / 255.0;
    EXPECT_NEAR(dark, side * side, 2.0 * side) << rung.displacement;
  }
}

TEST(RenderedRobustness, WhatCannotBeMadeIsRefused) {
  const auto refused = [](auto change) {
    RenderedRungs rungs = few();
    change(rungs);
    EXPECT_THROW(rendered_robustness_rungs(spectra(), rungs, 1), Error);
  };
  refused([](RenderedRungs& r) { r.count = 1; });
  refused([](RenderedRungs& r) { r.smallest = 0.0; });
  refused([](RenderedRungs& r) { r.smallest = r.largest; });
  refused([](RenderedRungs& r) { r.largest = 1.7; });
  refused([](RenderedRungs& r) { r.filter_px = 3.0; });
}

}  // namespace
}  // namespace touchstone::lab
