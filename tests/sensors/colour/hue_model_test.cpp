// Displacements from coloured markers' appearance: made by [Lin2019, eq. 4] itself, and painted.

#include "sensors/colour/hue_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/error.h"
#include "sensors/colour/colour_marker_finder.h"
#include "sensors/colour/hue.h"
#include "sensors/colour/hue_calibration.h"
#include "sensors/colour/hue_estimator.h"
#include "tests/sensors/colour/painted_colour_markers.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using fixtures::ColourPicture;
using fixtures::PaintedGel;
using testing::HasSubstr;
using touchstone::test::message_of;

constexpr double kPxPerMm = 10.0;
constexpr double kSpacing = 3.0;

/// A reading of a grid of 4 x 3 at rest, each marker with a hue of its own near red.
ColourMarkerReading rest_reading() {
  ColourMarkerReading rest;
  rest.grid = {4, 3};
  const auto places = grid_places(rest.grid, kSpacing);
  for (std::size_t i = 0; i < places.size(); ++i) {
    ColourMarker marker;
    marker.flaw = MarkerFlaw::kNone;
    marker.hue = hue_of({std::cos(0.02 * static_cast<double>(i) - 0.1), std::sin(0.02 * static_cast<double>(i) - 0.1)});
    marker.centroid_px = marker.ink_centroid_px = Eigen::Vector2d(100.0, 80.0) + kPxPerMm * places[i];
    marker.coloured_area_px = marker.ink_area_px = 400.0;
    rest.markers.push_back(marker);
  }
  return rest;
}

/// What eq. 4 makes of a displacement.
ColourMarker marker_moved_by(const ColourMarker& rest, const Eigen::Vector3d& displacement, const HueLine& line) {
  ColourMarker seen = rest;
  const double press = -displacement.z();
  const double hue = rest.hue + line.hue_offset + line.hue_slope * press;
  seen.hue = hue_of({std::cos(hue), std::sin(hue)});
  seen.centroid_px += kPxPerMm * (line.gain_slope * press + line.gain) * displacement.head<2>();
  seen.ink_centroid_px += kPxPerMm * displacement.head<2>();
  return seen;
}

/// Series of lateral motion along x at several depths, as in fig. 9.
std::vector<HueSample> shear_series(const ColourMarkerReading& rest, const HueLine& line,
                                    const std::vector<std::size_t>& markers) {
  std::vector<HueSample> samples;
  int series = 0;
  for (const std::size_t marker : markers) {
    for (double press = 0.5; press <= 2.0; press += 0.25) {
      for (double x = 0.0; x <= 1.0; x += 0.1) {
        const Eigen::Vector3d displacement(x, 0.0, -press);
        samples.push_back({marker, marker_moved_by(rest.markers[marker], displacement, line), displacement, series});
      }
      ++series;
    }
  }
  return samples;
}

TEST(HueModel, EquationFourIsRecoveredFromWhatObeysIt) {
  const ColourMarkerReading rest = rest_reading();
  const HueLine truth{.hue_slope = -0.13, .gain_slope = 0.12, .gain = 0.31};  // its hue goes through red
  const HueModel model = calibrate_hue(rest, shear_series(rest, truth, {5}), {.form = {.form = HueForm::kEquation4}});
  EXPECT_NEAR(model.line.hue_slope, truth.hue_slope, 1e-9);
  EXPECT_NEAR(model.line.gain_slope, truth.gain_slope, 1e-9);
  EXPECT_NEAR(model.line.gain, truth.gain, 1e-9);
  EXPECT_EQ(model.line.hue_offset, 0.0);
  EXPECT_LT(model.rms_error_mm, 1e-9);
}

TEST(HueModel, EquationFiveInvertsItForEveryMarkerOfTheGrid) {
  const ColourMarkerReading rest = rest_reading();
  const HueLine truth{.hue_slope = 0.2, .gain_slope = -0.05, .gain = 0.5};
  const HueModel model = calibrate_hue(rest, shear_series(rest, truth, {5}), {.form = {.form = HueForm::kEquation4}});
  const HueEstimator estimator(model, rest);
  ColourMarkerReading reading = rest;
  std::vector<Eigen::Vector3d> displacements;
  for (std::size_t i = 0; i < rest.markers.size(); ++i) {
    displacements.emplace_back(0.05 * static_cast<double>(i), 0.4 - 0.05 * static_cast<double>(i),
                               -0.15 * static_cast<double>(i));
    reading.markers[i] = marker_moved_by(rest.markers[i], displacements[i], truth);
  }
  const HueField field = estimator.estimate(reading);
  EXPECT_EQ(field.field.grid, rest.grid);
  for (std::size_t i = 0; i < displacements.size(); ++i) {
    EXPECT_TRUE(field.field.measured[i]);
    EXPECT_LT((field.field.displacement[i] - displacements[i]).norm(), 1e-9) << i;
  }
}

TEST(HueModel, AFreeOffsetIsRecovered) {
  const ColourMarkerReading rest = rest_reading();
  const HueLine truth{.hue_slope = 0.2, .hue_offset = 0.07, .gain_slope = 0.05, .gain = 0.5};
  const HueModel model =
      calibrate_hue(rest, shear_series(rest, truth, {5}), {.form = {.form = HueForm::kEquation4, .free_offset = true}});
  EXPECT_NEAR(model.line.hue_offset, 0.07, 1e-9);
  EXPECT_NEAR(model.line.hue_slope, 0.2, 1e-9);
}

// A marker that is pressed by w looks larger by 2 w / 60, and by the logarithm of its stretch besides; the grid about
// it shows the stretch. So 30 times what the area grew by, less the cell's growth, is the press, and without the cells
// the stretch of up to 0.1 is taken for up to 3 mm.
TEST(HueModel, NeighboursTellAStretchFromAPress) {
  const ColourMarkerReading rest = rest_reading();
  const auto sample_of = [&](double press, double stretch, double x) {
    HueSample sample{5, rest.markers[5], {x, 0.0, -press}, 0};
    sample.seen.ink_area_px *= std::exp(press / 30 + stretch);
    sample.seen.ink_centroid_px.x() += kPxPerMm * x;
    sample.seen.surroundings = {true, stretch, 0.0};
    return sample;
  };
  std::vector<HueSample> samples;
  for (int i = 0; i < 60; ++i) samples.push_back(sample_of(0.1 * (i % 20), 0.025 * ((7 * i) % 5), 0.1 * (i % 7)));
  HueCalibrationSettings settings;
  settings.form = {.features = {.hue = false, .centroid = false, .coloured_area = false}, .degree = 1, .ridge = 1e-9};
  EXPECT_GT(calibrate_hue(rest, samples, settings).rms_error_mm, 0.3);
  settings.form.features.cell_area = true;
  const HueModel model = calibrate_hue(rest, samples, settings);
  EXPECT_LT(model.rms_error_mm, 1e-4);
  const HueEstimator estimator(model, rest);
  ColourMarker seen = sample_of(1.23, 0.07, 0.4).seen;
  EXPECT_NEAR(estimator.estimate(5, seen).displacement_mm.z(), -1.23, 1e-4);
  // Without neighbours nothing is said; without enough samples that have them nothing is learned.
  seen.surroundings = {};
  EXPECT_FALSE(estimator.estimate(5, seen).measured);
  std::vector<HueSample> some = samples;
  some[0].seen.surroundings = some[1].seen.surroundings = {};
  const HueErrors errors = hue_errors(model, rest, some);
  EXPECT_EQ(errors.declined, 2u);
  EXPECT_EQ(errors.samples, samples.size() - 2);
  EXPECT_LT(errors.rms_mm(), 1e-4) << "what isn't estimated isn't an error of the estimates";
  EXPECT_GT(errors.rms_of_all_mm(), 0.01);
  for (std::size_t i = 7; i < samples.size(); ++i) samples[i].seen.surroundings = {};
  EXPECT_THAT(message_of([&] { calibrate_hue(rest, samples, settings); }),
              HasSubstr("7 samples have sound neighbours"));
}

TEST(HueModel, WhatLooksAsAtRestIsAtRest) {
  const ColourMarkerReading rest = rest_reading();
  const HueLine truth{.hue_slope = 0.2, .gain_slope = 0.05, .gain = 0.5};
  for (const HueForm form : {HueForm::kEquation4, HueForm::kIsotropic, HueForm::kPolynomial}) {
    const HueModel model = calibrate_hue(rest, shear_series(rest, truth, {5}), {.form = {.form = form}});
    const HueField field = HueEstimator(model, rest).estimate(rest);
    for (std::size_t i = 0; i < rest.markers.size(); ++i) {
      EXPECT_TRUE(field.field.measured[i]);
      EXPECT_FALSE(field.extrapolated[i]);
      EXPECT_LT(field.field.displacement[i].norm(), 1e-12);
    }
  }
}

TEST(HueModel, AMarkersOwnSamplesGiveItsOwnGains) {
  const ColourMarkerReading rest = rest_reading();
  const HueLine truth{.hue_slope = 0.2, .gain_slope = 0.0, .gain = 0.5};
  std::vector<HueSample> samples = shear_series(rest, truth, {5});
  HueLine weak = truth;
  weak.hue_slope *= 0.8;
  weak.gain *= 0.9;
  for (const HueSample& sample : shear_series(rest, weak, {6})) samples.push_back(sample);
  HueCalibrationSettings settings{.form = {.form = HueForm::kEquation4}, .own_gains = true};
  const HueModel model = calibrate_hue(rest, samples, settings);
  ASSERT_EQ(model.gains.size(), 2u);
  EXPECT_EQ(model.gains[0].marker, 5);
  EXPECT_NEAR(model.gains[1].press / model.gains[0].press, 1.0 / 0.8, 1e-6);
  settings.own_gains = false;
  EXPECT_LT(model.rms_error_mm, 0.2 * calibrate_hue(rest, samples, settings).rms_error_mm);
}

TEST(HueModel, FlawedMarkersAreNotMeasured) {
  const ColourMarkerReading rest = rest_reading();
  const HueLine truth{.hue_slope = 0.2, .gain_slope = 0.05, .gain = 0.5};
  const HueModel model = calibrate_hue(rest, shear_series(rest, truth, {5}), {.form = {.form = HueForm::kEquation4}});
  ColourMarkerReading reading = rest, flawed_rest = rest;
  reading.markers[3].flaw = MarkerFlaw::kTwoFilters;
  flawed_rest.markers[4].flaw = MarkerFlaw::kMissing;
  const HueField field = HueEstimator(model, flawed_rest).estimate(reading);
  for (std::size_t i = 0; i < rest.markers.size(); ++i) EXPECT_EQ(field.field.measured[i], i != 3 && i != 4) << i;
  ColourMarkerReading other = rest;
  other.grid = {3, 4};
  EXPECT_THROW(HueEstimator(model, rest).estimate(other), Error);
}

TEST(HueModel, AppearancesThatCalibrationDidNotSeeAreReported) {
  const ColourMarkerReading rest = rest_reading();
  const HueLine truth{.hue_slope = 0.2, .gain_slope = 0.05, .gain = 0.5};
  for (const HueForm form : {HueForm::kEquation4, HueForm::kIsotropic, HueForm::kPolynomial}) {
    const HueModel model = calibrate_hue(rest, shear_series(rest, truth, {5}), {.form = {.form = form}});
    const HueEstimator estimator(model, rest);
    const auto extrapolated = [&](const Eigen::Vector3d& displacement) {
      return estimator.estimate(2, marker_moved_by(rest.markers[2], displacement, truth)).extrapolated;
    };
    EXPECT_FALSE(extrapolated({0.6, 0.5, -1.2}));
    EXPECT_FALSE(extrapolated({0.0, -0.9, -1.9}));
    EXPECT_TRUE(extrapolated({0.0, 0.0, -2.3}));
    EXPECT_TRUE(extrapolated({0.0, 0.0, 0.3}));
    EXPECT_TRUE(extrapolated({1.0, 0.9, -1.0}));
    // Within each range, but no such pair was there: the hue of no press, and a shift that only a shear makes.
    ColourMarker swollen = marker_moved_by(rest.markers[2], {0.5, 0.0, -1.0}, truth);
    swollen.ink_area_px *= 1.4;
    EXPECT_TRUE(estimator.estimate(2, swollen).extrapolated);
  }
}

TEST(HueModel, BadCalibrationsAreRefused) {
  const ColourMarkerReading rest = rest_reading();
  const HueLine truth{.hue_slope = 0.2, .gain_slope = 0.05, .gain = 0.5};
  const std::vector<HueSample> samples = shear_series(rest, truth, {5});
  const auto message = [&](const std::vector<HueSample>& some, const HueCalibrationSettings& settings = {}) {
    return message_of([&] { calibrate_hue(rest, some, settings); });
  };
  EXPECT_THAT(message({}), HasSubstr("at least 8"));
  std::vector<HueSample> flawed = samples, off_grid = samples, still = samples, flat = samples;
  flawed[3].seen.flaw = MarkerFlaw::kOverexposed;
  EXPECT_THAT(message(flawed), HasSubstr("overexposed"));
  off_grid[0].marker = 12;
  EXPECT_THAT(message(off_grid), HasSubstr("marker 12"));
  for (HueSample& sample : still) sample.displacement_mm.head<2>().setZero();
  EXPECT_THAT(message(still), HasSubstr("no lateral"));
  for (HueSample& sample : flat) sample.displacement_mm.z() = 0.0;
  EXPECT_THAT(message(flat), HasSubstr("no press"));
  EXPECT_THAT(message(samples, {.form = {.degree = 5}}), HasSubstr("degree"));
  EXPECT_THAT(message(samples, {.form = {.ridge = 0.0}}), HasSubstr("ridge"));
  EXPECT_THAT(message(samples, {.form = {.features = {.centroid = false, .ink_centroid = false}}}),
              HasSubstr("needs a centroid"));
  EXPECT_THAT(message(samples, {.spacing_mm = 0.0}), HasSubstr("spacing"));
  EXPECT_THAT(message(samples, {.parallax = {.viewing_distance_mm = -1.0}}), HasSubstr("viewing distance"));
  std::vector<HueSample> one_series = samples;
  for (HueSample& sample : one_series) sample.series = 7;
  EXPECT_THAT(message_of([&] { cross_validate_hue(rest, one_series, {}); }), HasSubstr("series"));
}

TEST(HueModel, RankingPutsTheFormThatMadeTheSamplesFirst) {
  const ColourMarkerReading rest = rest_reading();
  const HueLine truth{.hue_slope = 0.2, .gain_slope = 0.1, .gain = 0.4};
  std::vector<HueSample> samples = shear_series(rest, truth, {5});
  RandomStream random(8, 0, Purpose::kTest);
  for (HueSample& sample : samples) {
    sample.seen.hue = hue_of({std::cos(sample.seen.hue + 0.01 * random.normal()), std::sin(sample.seen.hue)});
    for (Eigen::Vector2d* place : {&sample.seen.centroid_px, &sample.seen.ink_centroid_px}) {
      *place += 0.5 * Eigen::Vector2d(random.normal(), random.normal());
    }
  }
  const HueFeatures some{.ink_centroid = false, .coloured_area = false, .ink_area = false};
  const std::vector<HueFormScore> ranked = rank_hue_forms(
      rest, samples, {},
      {{.form = HueForm::kPolynomial, .features = some, .degree = 4, .ridge = 1e-9, .symmetric = false},
       {.form = HueForm::kPolynomial,
        .features = {.hue = true, .centroid = false, .ink_centroid = false, .coloured_area = false, .ink_area = false},
        .degree = 2},
       {.form = HueForm::kEquation4}});
  ASSERT_EQ(ranked.size(), 3u);
  EXPECT_EQ(ranked[0].form.form, HueForm::kEquation4);
  for (const HueFormScore& score : ranked) EXPECT_EQ(score.errors.samples, samples.size());
}

// From here on pictures are painted, found and read.

ColourPicture painted_sensor(double noise = 1.0) {
  ColourPicture picture = fixtures::small_colour_picture(20.0);
  picture.film_px = 21.0;
  picture.noise = noise;
  picture.samples = 6;
  return picture;
}

/// Random displacements, of up to 0.8 mm lateral and 2 mm press.
std::vector<Eigen::Vector3d> random_displacements(std::size_t count, std::uint64_t seed, double lateral = 0.8) {
  RandomStream random(seed, 1, Purpose::kTest);
  std::vector<Eigen::Vector3d> all;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2.0 * 3.14159265358979323846 * random.uniform();
    const double far = lateral * random.uniform();
    all.emplace_back(far * std::cos(angle), far * std::sin(angle), -2.0 * random.uniform());
  }
  return all;
}

struct PaintedSamples {
  ColourMarkerReading rest;
  std::vector<HueSample> samples;
};

/// Pictures of a sensor whose markers all move on their own. Each picture is a series.
PaintedSamples paint_samples(ColourPicture picture, int pictures, std::uint64_t seed, const PaintedGel& gel = {}) {
  ColourMarkerFinder finder({.grid = {picture.columns, picture.rows}});
  PaintedSamples out;
  out.rest = finder.find_rest(fixtures::paint_colour_markers(picture));
  for (int i = 0; i < pictures; ++i) {
    picture.seed = seed + static_cast<std::uint64_t>(i);
    const auto displacements = random_displacements(picture.count(), picture.seed);
    fixtures::displace(picture, displacements, gel);
    const ColourMarkerReading& reading = finder.find(fixtures::paint_colour_markers(picture));
    for (std::size_t marker = 0; marker < picture.count(); ++marker) {
      if (reading.markers[marker].flaw != MarkerFlaw::kNone) continue;
      out.samples.push_back({marker, reading.markers[marker], displacements[marker], i});
    }
  }
  return out;
}

TEST(HueModelOnPaint, ThePolynomialBeatsEquationFourOnPicturesItHasNotSeen) {
  const PaintedSamples training = paint_samples(painted_sensor(), 12, 100);
  const PaintedSamples test = paint_samples(painted_sensor(), 4, 900);
  ASSERT_GT(training.samples.size(), 200u);  // neighbours that move at random may run into each other
  const HueModel line = calibrate_hue(training.rest, training.samples, {.form = {.form = HueForm::kEquation4}});
  const HueModel curve = calibrate_hue(training.rest, training.samples, {});
  const HueErrors of_line = hue_errors(line, test.rest, test.samples);
  const HueErrors of_curve = hue_errors(curve, test.rest, test.samples);
  EXPECT_LT(of_curve.rms_mm(), 0.5 * of_line.rms_mm());
  EXPECT_LT(of_curve.rms_press_mm, 0.1);
  EXPECT_LT(of_curve.rms_lateral_mm, 0.02);
}

TEST(HueModelOnPaint, WhatShearAlongOneAxisTaughtHoldsForTheOther) {
  PaintedSamples training = paint_samples(painted_sensor(), 12, 100);
  const PaintedSamples test = paint_samples(painted_sensor(), 4, 900);
  std::erase_if(training.samples, [](const HueSample& sample) {
    return sample.displacement_mm.x() < 0.0 || std::abs(sample.displacement_mm.y()) > 0.4 * sample.displacement_mm.x();
  });
  const auto lateral_error = [&](const HueModelForm& form) {
    return hue_errors(calibrate_hue(training.rest, training.samples, {.form = form}), test.rest, test.samples)
        .rms_lateral_mm;
  };
  EXPECT_LT(lateral_error({.form = HueForm::kIsotropic}), 0.05);
  EXPECT_LT(lateral_error({.form = HueForm::kPolynomial}), 0.05);
  EXPECT_GT(lateral_error({.form = HueForm::kPolynomial, .symmetric = false}), 0.1);
}

TEST(HueModelOnPaint, ATurnedCameraReadsInTheGridsOwnFrame) {
  ColourPicture picture = painted_sensor();
  const PaintedSamples training = paint_samples(picture, 10, 100);
  picture.angle = 0.06;
  picture.spacing_px *= 0.95;
  picture.marker_px *= 0.95;
  picture.film_px *= 0.95;
  const PaintedSamples test = paint_samples(picture, 3, 900);
  const HueModel model = calibrate_hue(training.rest, training.samples, {});
  const HueErrors errors = hue_errors(model, test.rest, test.samples);
  EXPECT_LT(errors.rms_lateral_mm, 0.03);
  EXPECT_LT(errors.rms_press_mm, 0.15);
}

TEST(HueModelOnPaint, ParallaxOfCornerMarkersIsTakenOut) {
  const PaintedGel near{.viewing_distance_mm = 60.0};
  const PaintedSamples all = paint_samples(painted_sensor(), 12, 100, near);
  const PaintedSamples test = paint_samples(painted_sensor(), 4, 900, near);
  const ViewParallax parallax{.viewing_distance_mm = 60.0};
  std::vector<HueSample> middle, corners;
  for (const HueSample& sample : all.samples) {
    if (sample.marker == 14 || sample.marker == 15 || sample.marker == 8 || sample.marker == 9)
      middle.push_back(sample);
  }
  for (const HueSample& sample : test.samples) {
    if (sample.marker == 0 || sample.marker == 5 || sample.marker == 24 || sample.marker == 29)
      corners.push_back(sample);
  }
  ASSERT_GT(corners.size(), 8u);
  const HueModel with = calibrate_hue(all.rest, middle, {.parallax = parallax, .form = {.degree = 2}});
  const HueModel without = calibrate_hue(all.rest, middle, {.form = {.degree = 2}});
  const double corrected = hue_errors(with, test.rest, corners).rms_lateral_mm;
  const double not_corrected = hue_errors(without, test.rest, corners).rms_lateral_mm;
  // A corner is 9.6 mm off the axis: a press by 1 mm shifts it by 0.16 mm in the picture.
  EXPECT_GT(not_corrected, 0.1);
  EXPECT_LT(corrected, 0.04);
}

TEST(ViewParallax, IsItsOwnInverse) {
  const ViewParallax parallax{.viewing_distance_mm = 60.0, .axis_mm = {0.7, -0.3}};
  const Eigen::Vector3d displacement(0.4, -0.2, -1.5);
  const Eigen::Vector2d rest(-9.0, 6.0);
  const Eigen::Vector2d seen = parallax.seen(displacement, rest);
  EXPECT_NEAR((seen - displacement.head<2>()).norm(),
              1.5 / 58.5 * (rest - parallax.axis_mm + displacement.head<2>()).norm(), 1e-12);
  EXPECT_LT((parallax.true_one(seen, 1.5, rest) - displacement.head<2>()).norm(), 1e-12);
  EXPECT_EQ(ViewParallax{}.seen(displacement, rest), displacement.head<2>());
}

TEST(PictureMap, RecoversAHomography) {
  Eigen::Matrix3d truth;
  truth << 0.1, 0.01, -3.0, -0.012, 0.09, -2.0, 1e-4, -2e-4, 1.0;
  std::vector<Eigen::Vector2d> px, mm;
  for (int i = 0; i < 12; ++i) {
    px.emplace_back(37.0 * (i % 4), 29.0 * (i / 4));
    mm.push_back((truth * px.back().homogeneous()).hnormalized());
  }
  const PictureMap map = fit_picture_map(px, mm);
  EXPECT_LT((map.mm_from_px - truth).norm(), 1e-9);
  EXPECT_LT((map(Eigen::Vector2d(50.0, 40.0)) - (truth * Eigen::Vector3d(50.0, 40.0, 1.0)).hnormalized()).norm(), 1e-9);
  std::vector<Eigen::Vector2d> line;
  for (int i = 0; i < 12; ++i) line.emplace_back(i, 2.0 * i);
  EXPECT_THROW(fit_picture_map(line, mm), Error);
  EXPECT_THROW(fit_picture_map({px[0], px[1], px[5]}, {mm[0], mm[1], mm[5]}), Error);
}

}  // namespace
}  // namespace touchstone::sensors
