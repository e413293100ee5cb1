#include "sensors/events/material_classifier.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sensors/learning/confusion_matrix.h"
#include "sensors/learning/leave_one_out.h"
#include "tests/sensors/events/synthetic_grasps.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using testing::HasSubstr;

const std::vector<std::string> kMaterials{"foam", "rubber", "silicone", "steel"};

TEST(MaterialClassifier, CrossEntropyAndItsDerivatives) {
  Eigen::MatrixXd outputs = (Eigen::MatrixXd(3, 2) << 1.0, 0.0, 2.0, 0.0, -1.0, 0.0).finished();
  const std::vector<int> labels{1, 2};
  Eigen::MatrixXd derivatives;
  const double value = cross_entropy(outputs, labels, derivatives);
  // -log softmax: 2 - log(e + e^2 + 1/e) and log 3.
  EXPECT_NEAR(value, 0.5 * (std::log(std::exp(1.0) + std::exp(2.0) + std::exp(-1.0)) - 2.0 + std::log(3.0)), 1e-14);
  for (Eigen::Index i = 0; i < outputs.size(); ++i) {
    Eigen::MatrixXd unused;
    Eigen::MatrixXd up = outputs;
    Eigen::MatrixXd down = outputs;
    up.reshaped()[i] += 1e-6;
    down.reshaped()[i] -= 1e-6;
    EXPECT_NEAR(derivatives.reshaped()[i],
                (cross_entropy(up, labels, unused) - cross_entropy(down, labels, unused)) / 2e-6, 1e-9);
  }
  outputs *= 1000.0;  // no overflow
  EXPECT_NEAR(cross_entropy(outputs, labels, derivatives), 0.5 * std::log(3.0), 1e-12);
}

TEST(MaterialClassifier, LearnsExclusiveOr) {
  std::vector<MaterialSample> samples;
  for (int i = 0; i < 4; ++i) samples.push_back({Eigen::Vector2d(i % 2, i / 2), (i % 2) ^ (i / 2)});
  MaterialClassifierSettings settings;
  settings.hidden_layers = 1;
  settings.units = 6;
  const auto trained = train_material_classifier(samples, {"same", "different"}, range(0, 4), {}, settings);
  EXPECT_LT(trained.report.history.back().training_loss, 0.01);
  for (const MaterialSample& sample : samples) {
    const MaterialGuess guess = classify(trained.model, sample.features);
    EXPECT_EQ(guess.label, sample.label);
    EXPECT_NEAR(guess.probabilities.sum(), 1.0, 1e-14);
    EXPECT_GT(guess.probabilities[guess.label], 0.95);
  }
}

TEST(MaterialClassifier, TellsSyntheticMaterialsByLeaveOneOut) {
  const std::vector<MaterialSample> samples = synthetic_samples(32);
  std::vector<int> labels;
  for (const MaterialSample& sample : samples) labels.push_back(sample.label);
  const std::vector<Fold> folds = folds_by_class(labels, 1);
  MaterialClassifierSettings settings;
  settings.hidden_layers = 1;
  settings.units = 10;
  const auto run = [&](int threads) {
    std::vector<int> guesses(folds.size());
    run_folds(static_cast<int>(folds.size()), threads, [&](int i) {
      const Fold& fold = folds[static_cast<std::size_t>(i)];
      const auto trained = train_material_classifier(samples, kMaterials, fold.training, fold.validation, settings, i);
      guesses[static_cast<std::size_t>(i)] =
          classify(trained.model, samples[static_cast<std::size_t>(i)].features).label;
    });
    return guesses;
  };
  const std::vector<int> guesses = run(1);
  EXPECT_EQ(run(4), guesses);
  // Chance is 25 %; a binomial of 32 at that has 18 or more right once in 20,000.
  EXPECT_GT(confusion_matrix(labels, guesses, 4).accuracy(), 18.0 / 32.0);
}

TEST(MaterialClassifier, StopsEarlyAndKeepsWhatWasBestOnValidation) {
  const std::vector<MaterialSample> samples = synthetic_samples(24);
  const auto trained = train_material_classifier(samples, kMaterials, range(0, 16), range(16, 24), {});
  const NetworkTrainingReport& report = trained.report;
  EXPECT_EQ(report.end, NetworkTrainingEnd::kValidation);
  EXPECT_EQ(report.best_step, report.steps - 6);
  double loss = 0.0;
  for (int i = 16; i < 24; ++i) {
    const MaterialSample& sample = samples[static_cast<std::size_t>(i)];
    loss -= std::log(classify(trained.model, sample.features).probabilities[sample.label]) / 8.0;
  }
  EXPECT_NEAR(loss, report.history[static_cast<std::size_t>(report.best_step)].validation_loss, 1e-12);
}

TEST(MaterialClassifier, FeaturesAreTheWindowsInARow) {
  const Eigen::MatrixXd counts = (Eigen::MatrixXd(3, 2) << 1, 10, 2, 20, 3, 30).finished();
  EXPECT_EQ(grasp_features(counts, std::vector<int>{0, 2}), Eigen::Vector4d(1, 3, 10, 30));
}

TEST(MaterialClassifier, FaultyInputIsNamed) {
  const auto message = [](auto spoil, const std::vector<int>& training = {0, 1, 2, 3}) {
    std::vector<MaterialSample> samples = synthetic_samples(5);
    std::vector<std::string> materials = kMaterials;
    MaterialClassifierSettings settings;
    settings.training.most_steps = 1;
    spoil(samples, materials, settings);
    return message_of([&] { train_material_classifier(samples, materials, training, std::vector<int>{4}, settings); });
  };
  EXPECT_EQ(message([](auto&...) {}), "no error");
  EXPECT_THAT(message([](auto&...) {}, {0, 1, 2}), HasSubstr("'steel' has no training sample"));
  EXPECT_THAT(message([](auto&...) {}, {}), HasSubstr("no training sample"));
  EXPECT_THAT(message([](auto&...) {}, {5}), HasSubstr("sample 5 is chosen, there are 5"));
  EXPECT_THAT(message([](auto& s, auto&, auto&) { s[2].label = 4; }), HasSubstr("sample 2 is of material 4"));
  EXPECT_THAT(message([](auto& s, auto&, auto&) { s[2].features.setZero(3); }), HasSubstr("sample 2 has 3 features"));
  EXPECT_THAT(message([](auto& s, auto&, auto&) { s[0].features.resize(0); }), HasSubstr("0 features, 1 are needed"));
  EXPECT_THAT(message([](auto& s, auto&, auto&) { s[4].features[7] = std::nan(""); }),
              HasSubstr("sample 4 isn't finite"));
  EXPECT_THAT(message([](auto&, auto& m, auto&) { m[1] = ""; }), HasSubstr("has no name"));
  EXPECT_THAT(message([](auto&, auto& m, auto&) { m[1] = "foam"; }), HasSubstr("two materials are called 'foam'"));
  EXPECT_THAT(message([](auto&, auto& m, auto&) { m = {"foam"}; }), HasSubstr("1 materials"));
  EXPECT_THAT(message([](auto&, auto&, auto& s) { s.patience = 0; }), HasSubstr("patience is 0"));
  EXPECT_THAT(message([](auto&, auto&, auto& s) { s.hidden_layers = -1; }), HasSubstr("hidden_layers is -1"));
  const std::vector<MaterialSample> samples = synthetic_samples(4);
  EXPECT_THAT(message_of([&] { train_material_classifier(samples, kMaterials, range(0, 4), {}, {}, -1); }),
              HasSubstr("fold is -1"));

  const MaterialClassifier model = train_material_classifier(samples, kMaterials, range(0, 4), {}, {}).model;
  EXPECT_EQ(fault_of(model), "");
  EXPECT_THAT(message_of([&] { classify(model, Eigen::VectorXd::Zero(3)); }),
              HasSubstr("3 features, the model has 88"));
  EXPECT_THAT(message_of([&] { classify(model, Eigen::VectorXd::Constant(88, std::nan(""))); }), HasSubstr("finite"));
  const auto fault = [&](auto spoil) {
    MaterialClassifier faulty = model;
    spoil(faulty);
    return fault_of(faulty);
  };
  EXPECT_THAT(fault([](auto& m) { m.materials.pop_back(); }), HasSubstr("4 outputs, there are 3 materials"));
  EXPECT_THAT(fault([](auto& m) { m.materials = {}; }), HasSubstr("0 materials"));
  EXPECT_THAT(fault([](auto& m) { m.network.weights.clear(); }), HasSubstr("no layer"));
  EXPECT_THAT(fault([](auto& m) { m.features.low[0] = 1e9; }), HasSubstr("ranges"));
  EXPECT_THAT(fault([](auto& m) { m.features.low = m.features.high = Eigen::VectorXd::Zero(3); }),
              HasSubstr("88 inputs, there are 3"));
}

}  // namespace
}  // namespace touchstone::sensors
