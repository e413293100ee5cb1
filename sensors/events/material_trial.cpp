#include "sensors/events/material_trial.h"

#include "core/error.h"
#include "core/seconds_since.h"
#include "sensors/learning/leave_one_out.h"

namespace touchstone::sensors {

MaterialTrialScore test_material_classifiers(std::span<const MaterialSample> samples,
                                             const std::vector<std::string>& materials,
                                             const MaterialTrialSettings& settings, const Progress& progress) {
  std::vector<int> labels;
  std::vector<int> of_each(materials.size(), 0);
  for (const MaterialSample& sample : samples) {
    if (sample.label < 0 || static_cast<std::size_t>(sample.label) >= materials.size()) {
      fail("event material: a grasp is of material {}, there are {}", sample.label, materials.size());
    }
    labels.push_back(sample.label);
    ++of_each[static_cast<std::size_t>(sample.label)];
  }
  // Left out to test and one to validate on, one has to be left.
  constexpr int kLeast = 3;
  for (std::size_t i = 0; i < materials.size(); ++i) {
    if (of_each[i] < kLeast) {
      fail("event material: {} grasps of {}; at least {} of each material are needed", of_each[i], materials[i],
           kLeast);
    }
  }
  const std::vector<Fold> folds = folds_by_class(labels, settings.seed);
  struct Guesses {
    int test = 0;
    std::vector<int> validation;
    double training_s = 0.0;
  };
  std::vector<Guesses> guesses(folds.size());
  const auto work = [&](int at) {
    const Fold& fold = folds[static_cast<std::size_t>(at)];
    Guesses& mine = guesses[static_cast<std::size_t>(at)];
    const double begun = thread_seconds();
    const TrainedMaterialClassifier trained =
        train_material_classifier(samples, materials, fold.training, fold.validation, settings.classifier, fold.test);
    mine.training_s = thread_seconds() - begun;
    const auto guess = [&](int grasp) {
      return classify(trained.model, samples[static_cast<std::size_t>(grasp)].features).label;
    };
    mine.test = guess(fold.test);
    for (const int grasp : fold.validation) mine.validation.push_back(guess(grasp));
  };
  run_folds(static_cast<int>(folds.size()), settings.threads, work, progress);

  std::vector<int> tested, validated, validation_truth;
  double training_s = 0.0;
  for (std::size_t at = 0; at < folds.size(); ++at) {
    tested.push_back(guesses[at].test);
    training_s += guesses[at].training_s / static_cast<double>(folds.size());
    for (std::size_t k = 0; k < folds[at].validation.size(); ++k) {
      validated.push_back(guesses[at].validation[k]);
      validation_truth.push_back(labels[static_cast<std::size_t>(folds[at].validation[k])]);
    }
  }
  const auto classes = static_cast<int>(materials.size());
  return {confusion_matrix(labels, tested, classes), confusion_matrix(validation_truth, validated, classes),
          training_s};
}

}  // namespace touchstone::sensors
