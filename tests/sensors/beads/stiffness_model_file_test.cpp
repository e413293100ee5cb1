#include "sensors/beads/stiffness_model_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>

#include "core/error.h"
#include "tests/sensors/beads/force_samples.h"

namespace touchstone::sensors {
namespace {

using fixtures::known_model;
using testing::HasSubstr;
using testing::StartsWith;

bool same_bits(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

template <typename A, typename B>
void expect_same_bits(const A& a, const B& b) {
  ASSERT_EQ(a.size(), b.size());
  for (Eigen::Index i = 0; i < a.size(); ++i) EXPECT_TRUE(same_bits(a.data()[i], b.data()[i]));
}

TEST(StiffnessModelFile, WhatIsReadIsWhatWasWrittenBitForBit) {
  const auto folder = std::filesystem::path(testing::TempDir());
  for (const MatrixForm form : {MatrixForm::kAsymmetric, MatrixForm::kSymmetric, MatrixForm::kDiagonal}) {
    for (const int grid : {2, 3, 7}) {
      StiffnessForceModel model = known_model(grid, form, 31);
      model.stiffness[0](0, 0) = 0.1 + 0.2;              // no short decimal
      model.rest[0] = {5e-324, 1.7976931348623157e308};  // the smallest and the largest double
      model.rest[1].x() = -0.0;
      model.training = {
          .samples = 10000, .stop = StopRule::kConvergence, .iterations = 4711, .rms_error_N = {0.1 / 3.0, 0.02, 0.3}};
      const auto path = folder / "model.json";
      save(model, path);
      const StiffnessForceModel read = load_stiffness_model(path);
      EXPECT_EQ(read.grid, grid);
      EXPECT_EQ(read.form, form);
      for (std::size_t i = 0; i < model.stiffness.size(); ++i) expect_same_bits(model.stiffness[i], read.stiffness[i]);
      for (std::size_t i = 0; i < model.rest.size(); ++i) {
        expect_same_bits(model.rest[i], read.rest[i]);
        expect_same_bits(model.lowest_seen[i], read.lowest_seen[i]);
        expect_same_bits(model.highest_seen[i], read.highest_seen[i]);
      }
      EXPECT_EQ(read.training.samples, 10000);
      EXPECT_EQ(read.training.stop, StopRule::kConvergence);
      EXPECT_EQ(read.training.iterations, 4711);
      expect_same_bits(model.training.rms_error_N, read.training.rms_error_N);
      EXPECT_EQ(to_json(read), to_json(model));
    }
  }
}

std::string error_of(const std::string& text) {
  try {
    stiffness_model_from_json(text, "bad.json");
  } catch (const Error& error) {
    return error.what();
  }
  return "(no error)";
}

/// The good file with the first `from` replaced by `to`.
std::string with(const std::string& from, const std::string& to) {
  std::string text = to_json(known_model(3, MatrixForm::kAsymmetric, 32));
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

TEST(StiffnessModelFile, BadFilesAreRefusedWithFileAndField) {
  EXPECT_EQ(error_of(with("\"grid\"", "\"grid\"")), "(no error)");
  const std::pair<std::string, std::string> cases[] = {
      {"", "isn't valid JSON"},
      {"{", "isn't valid JSON"},
      {"[1, 2]", "is a array, a map is needed"},
      {"{}", "'format' is missing"},
      {with("touchstone.stiffness_force_model", "something.else"), "format: is 'something.else'"},
      {with("\"version\": 1", "\"version\": 2"), "version: is 2"},
      {with("\"version\": 1", "\"version\": \"1\""), "version: is \"1\", a whole number"},
      {with("\"grid\": 3", "\"grid\": 4"), "stiffness_N_per_px: has 4 entries, 9 are needed"},
      {with("\"grid\": 3", "\"grid\": 3.5"), "grid: is 3.5, a whole number"},
      {with("\"grid\": 3", "\"grid\": 1000000000000000000000"), "grid"},
      {with("\"grid\": 3", "\"grid\": 18446744073709551615"), "grid: is 18446744073709551615"},
      {with("\"grid\": 3", "\"grid\": -3"), "grid: is -3, it must be from 2 to 32"},
      {with("\"form\": \"asymmetric\"", "\"form\": \"asymetric\""), "did you mean 'asymmetric'?"},
      {with("\"form\": \"asymmetric\"", "\"form\": \"diagonal\""), "must be 0 in the diagonal form"},
      {with("\"form\"", "\"from\""), "'from' isn't known"},
      {with("\"samples\"", "\"sample\""), "training: 'sample' isn't known (did you mean 'samples'?)"},
      {with("\"samples\": 0", "\"samples\": -1"), "training.samples: is -1"},
      {with("\"stop\": \"loss_drop\"", "\"stop\": 3"), "training.stop: is a number, text is needed"},
      {with(",\n  \"stop\": \"loss_drop\"", ""), "training: 'stop' is missing"},
      {with("140.0", "NaN"), "isn't valid JSON"},
      {with("140.0", "null"), "rest_px[0][0]: is a null, a number is needed"},
      {with("140.0", "1e999"), "isn't usable JSON"},
      {with("140.0", "\"140\""), "rest_px[0][0]: is a string"},
      {with("140.0,", "140.0, 1.0,"), "rest_px[0]: has 3 entries, 2 are needed"},
      {with("-10.0", "11.0"), "highest_seen"},
  };
  for (const auto& [text, expected] : cases) {
    EXPECT_THAT(error_of(text), StartsWith("bad.json:")) << expected;
    EXPECT_THAT(error_of(text), HasSubstr(expected));
    EXPECT_EQ(error_of(text).find('\n'), std::string::npos);
  }
}

TEST(StiffnessModelFile, LineOfASyntaxErrorIsGiven) {
  EXPECT_THAT(error_of("{\n \"grid\": 3,\n \"form\": ?\n}"), HasSubstr("bad.json:3:"));
}

TEST(StiffnessModelFile, EveryTruncationIsRefused) {
  const std::string text = to_json(known_model(2, MatrixForm::kAsymmetric, 33));
  for (std::size_t size = 0; size + 2 < text.size(); ++size) {
    EXPECT_NE(error_of(text.substr(0, size)), "(no error)") << size;
  }
}

TEST(StiffnessModelFile, FaultyModelIsNotWritten) {
  StiffnessForceModel model = known_model(3, MatrixForm::kAsymmetric, 34);
  model.stiffness[1](2, 2) = std::nan("");
  const auto path = std::filesystem::path(testing::TempDir()) / "faulty.json";
  std::filesystem::remove(path);
  EXPECT_THROW(save(model, path), Error);
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_THROW(load_stiffness_model(path), Error);
}

}  // namespace
}  // namespace touchstone::sensors
