#include "sensors/colour/hue_model_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

using testing::HasSubstr;

HueModel known_model(HueForm form) {
  HueModel model;
  model.form = form;
  model.spacing_mm = 3.0;
  model.parallax = {.viewing_distance_mm = 381.25, .axis_mm = {0.1, -0.2}};
  model.line = {.hue_slope = -0.1 / 3.0, .hue_offset = 0.01, .gain_slope = 0.1, .gain = 0.3, .of_ink = true};
  model.polynomial.features = {.ink_centroid = false, .ink_area = false};
  model.polynomial.degree = 2;
  model.polynomial.scale = Eigen::Vector4d(0.2, 0.4, 0.4, 0.1 + 0.2);
  const Eigen::Index terms = hue_terms(4, 2).rows();
  model.polynomial.coefficients.resize(terms, 3);
  for (Eigen::Index i = 0; i < 3 * terms; ++i)
    model.polynomial.coefficients.data()[i] = 1.0 / (3.0 + static_cast<double>(i));
  model.isotropic.features = {.coloured_area = false};
  model.isotropic.degree = 2;
  model.isotropic.scale = Eigen::Vector4d(0.2, 0.4, 0.4, 0.1 / 3.0);
  model.isotropic.press = Eigen::VectorXd::LinSpaced(hue_terms(4, 2).rows(), 0.1, 1.0);
  model.isotropic.lateral = Eigen::VectorXd::LinSpaced(2 * (1 + count_lower_terms(4, 2)), -0.3, 1.0);
  model.gains = {{7, 1.1, 0.9}, {42, 1.0 / 3.0, 1.0}};
  model.range.lowest_hue = -0.5;
  model.range.highest_hue = 0.1;
  model.range.largest_shift_mm = 0.6;
  model.range.largest_ink_shift_mm = 1.1;
  model.range.precision.setIdentity();
  model.range.precision(2, 3) = model.range.precision(3, 2) = 1.0 / 7.0;
  model.range.largest_distance = 17.0;
  model.samples = 315;
  model.rms_error_mm = 0.1 / 3.0;
  return model;
}

TEST(HueModelFile, WhatIsReadIsWhatWasWrittenBitForBit) {
  for (const HueForm form : {HueForm::kEquation4, HueForm::kIsotropic, HueForm::kPolynomial}) {
    const HueModel model = known_model(form);
    const auto path = std::filesystem::path(testing::TempDir()) / "hue_model.json";
    save(model, path);
    const HueModel read = load_hue_model(path);
    EXPECT_EQ(to_json(read), to_json(model));
    EXPECT_EQ(read.form, form);
    EXPECT_EQ(read.parallax.axis_mm, model.parallax.axis_mm);
    EXPECT_EQ(read.range.precision, model.range.precision);
    EXPECT_EQ(read.gains[1].lateral, model.gains[1].lateral);
    if (form == HueForm::kEquation4) {
      EXPECT_EQ(read.line.hue_slope, model.line.hue_slope);
      EXPECT_EQ(read.line.of_ink, true);
    } else if (form == HueForm::kIsotropic) {
      EXPECT_EQ(read.isotropic.features, model.isotropic.features);
      EXPECT_EQ(read.isotropic.scale, model.isotropic.scale);
      EXPECT_EQ(read.isotropic.press, model.isotropic.press);
      EXPECT_EQ(read.isotropic.lateral, model.isotropic.lateral);
    } else {
      EXPECT_EQ(read.polynomial.features, model.polynomial.features);
      EXPECT_EQ(read.polynomial.scale, model.polynomial.scale);
      EXPECT_EQ(read.polynomial.coefficients, model.polynomial.coefficients);
    }
  }
}

std::string error_of(const std::string& text) {
  try {
    hue_model_from_json(text, "m.json");
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

/// The model's file with one piece of its text replaced.
std::string with(const std::string& from, const std::string& to, HueForm form = HueForm::kPolynomial) {
  std::string text = to_json(known_model(form));
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

TEST(HueModelFile, WhatDoesNotFitIsNamed) {
  EXPECT_THAT(error_of("{"), HasSubstr("m.json"));
  EXPECT_THAT(error_of("[]"), HasSubstr("map"));
  EXPECT_THAT(error_of(with("touchstone.hue_model", "touchstone.other")), HasSubstr("format"));
  EXPECT_THAT(error_of(with("\"version\": 2", "\"version\": 1")), HasSubstr("version"));
  EXPECT_THAT(error_of(with("\"polynomial\",", "\"spline\",")), HasSubstr("form"));
  EXPECT_THAT(error_of(with("\"samples\"", "\"sample\"")), HasSubstr("sample"));
  EXPECT_THAT(error_of(with("\"degree\": 2", "\"degree\": 3")), HasSubstr("coefficients_mm"));
  EXPECT_THAT(error_of(with("\"degree\": 2", "\"degree\": 9")), HasSubstr("degree"));
  EXPECT_THAT(error_of(with("\"hue\",", "\"colour\",")), HasSubstr("isn't a feature"));
  EXPECT_THAT(error_of(with("\"hue\",", "\"centroid\",")), HasSubstr("twice"));
  EXPECT_THAT(error_of(with("381.25", "1e999")), HasSubstr("m.json"));
  EXPECT_THAT(error_of(with("381.25", "3.0")), HasSubstr("viewing distance"));
  EXPECT_THAT(error_of(with("\"marker\": 7", "\"marker\": -7")), HasSubstr("gains[0].marker"));
  EXPECT_THAT(error_of(with("\"spacing_mm\": 3.0", "\"spacing_mm\": -3.0")), HasSubstr("spacing"));
  EXPECT_THAT(error_of(with("\"ink\"", "\"paint\"", HueForm::kEquation4)), HasSubstr("line.centroid"));
  EXPECT_THAT(error_of(with("\"degree\": 2", "\"degree\": 1", HueForm::kIsotropic)), HasSubstr("press_mm"));
  EXPECT_THAT(error_of(with("\"lateral_mm\"", "\"sideways_mm\"", HueForm::kIsotropic)), HasSubstr("sideways_mm"));
  HueModel faulty = known_model(HueForm::kEquation4);
  faulty.line.hue_slope = 0.0;
  EXPECT_THROW(to_json(faulty), Error);
}

TEST(HueModelFile, CutAnywhereItIsAnError) {
  const std::string text = to_json(known_model(HueForm::kPolynomial));
  for (std::size_t length = 0; length + 3 < text.size(); length += 13) {
    EXPECT_THROW(hue_model_from_json(text.substr(0, length), "m.json"), Error) << length;
  }
}

}  // namespace
}  // namespace touchstone::sensors
