// Fig. 6 of [Lin2019], on its own drawing.

#include "lab/chroma/chroma_robustness.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace touchstone::lab {
namespace {

/// The drawing at a quarter of its size: a filter of 64 px.
struct SmallDrawing {
  std::vector<RobustnessRung> rungs = drawn_robustness_rungs(0.7, 1.3, 13);
  RobustnessSettings settings = drawn_robustness_settings();

  SmallDrawing() {
    settings.filter_px = 64.0;
    for (RobustnessRung& rung : rungs) {
      cv::resize(rung.colour, rung.colour, {128, 128}, 0, 0, cv::INTER_AREA);
      cv::resize(rung.black_white, rung.black_white, {128, 128}, 0, 0, cv::INTER_AREA);
    }
  }
};

TEST(ChromaRobustness, HueTellsTheDisplacementDownToFourPixels) {
  const SmallDrawing drawing;
  const auto rows = pixel_robustness(drawing.rungs, drawing.settings);
  ASSERT_EQ(rows.size(), 5u);
  EXPECT_EQ(rows.front().marker_px, 64.0);
  EXPECT_EQ(rows.back().marker_px, 4.0);
  for (const PixelRobustness& row : rows) EXPECT_GT(row.hue_r2, 0.98) << row.marker_px;
}

TEST(ChromaRobustness, TheCountOfPixelsTellsItWorseTheFewerThereAre) {
  const SmallDrawing drawing;
  const auto rows = pixel_robustness(drawing.rungs, drawing.settings);
  EXPECT_GT(rows.front().size_r2, 0.99);
  EXPECT_LT(rows.back().size_r2, 0.95);
  EXPECT_LT(rows.back().size_r2, rows.back().hue_r2);
  // But not by half as much as the paper has it: hue beats it, and the paper's finding is denied all the same.
  EXPECT_FALSE(size_is_lost(rows.back())) << rows.back().size_r2;
  PixelRobustness published = rows.back();
  published.size_r2 = kPublishedSizeR2;
  EXPECT_TRUE(size_is_lost(published));
}

TEST(ChromaRobustness, AGradientOfLightLeavesHueAndNotDarkness) {
  const SmallDrawing drawing;
  for (const double size : {64.0, 16.0, 4.0}) {
    const GradientRobustness result = gradient_robustness(drawing.rungs, drawing.settings, size);
    ASSERT_EQ(result.shifts.size(), drawing.rungs.size());
    EXPECT_LT(result.worst.hue_percent, 1.0) << size;
    EXPECT_GT(result.worst.darkness_percent, 20.0) << size;
    EXPECT_LE(result.mean.darkness_percent, result.worst.darkness_percent);
  }
}

TEST(ChromaRobustness, NoGradientChangesNothing) {
  SmallDrawing drawing;
  drawing.settings.gradient = 0.0;
  const GradientRobustness result = gradient_robustness(drawing.rungs, drawing.settings, 16.0);
  EXPECT_EQ(result.worst.hue_percent, 0.0);
  EXPECT_EQ(result.worst.size_percent, 0.0);
  EXPECT_EQ(result.worst.darkness_percent, 0.0);
}

TEST(ChromaRobustness, WhatDoesNotChangeHasNoFit) {
  SmallDrawing drawing;
  for (RobustnessRung& rung : drawing.rungs) {
    rung.colour = drawing.rungs[0].colour;
    rung.black_white = drawing.rungs[0].black_white;
  }
  for (const PixelRobustness& row : pixel_robustness(drawing.rungs, drawing.settings)) {
    EXPECT_EQ(row.hue_r2, 0.0);
    EXPECT_EQ(row.size_r2, 0.0);
  }
  EXPECT_THROW(gradient_robustness(drawing.rungs, drawing.settings, 16.0), Error);
}

TEST(ChromaRobustness, BytesAndFloatsAgree) {
  const SmallDrawing drawing;
  SmallDrawing bytes;
  for (RobustnessRung& rung : bytes.rungs) {
    rung.colour.convertTo(rung.colour, CV_8U, 255.0);
    rung.black_white.convertTo(rung.black_white, CV_8U, 255.0);
  }
  const auto a = pixel_robustness(drawing.rungs, drawing.settings);
  const auto b = pixel_robustness(bytes.rungs, bytes.settings);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i].hue_r2, b[i].hue_r2, 1e-3);
}

TEST(ChromaRobustness, BadPicturesAreRefused) {
  const SmallDrawing drawing;
  const auto refused = [&](const std::vector<RobustnessRung>& rungs, const RobustnessSettings& settings) {
    EXPECT_THROW(pixel_robustness(rungs, settings), Error);
    EXPECT_THROW(gradient_robustness(rungs, settings, 16.0), Error);
  };
  refused({}, drawing.settings);
  SmallDrawing other;
  other.rungs[3].colour = other.rungs[3].colour(cv::Rect(0, 0, 100, 128));
  refused(other.rungs, other.settings);
  other = {};
  other.rungs[3].black_white = other.rungs[3].colour;
  refused(other.rungs, other.settings);
  other = {};
  other.rungs[0].colour = cv::Mat(128, 128, CV_32FC3, cv::Scalar::all(1.0));
  refused(other.rungs, other.settings);
  other = {};
  other.settings.filter_px = 3.0;
  refused(other.rungs, other.settings);
  other = {};
  other.settings.smallest_px = 0.0;
  refused(other.rungs, other.settings);
}

}  // namespace
}  // namespace touchstone::lab
