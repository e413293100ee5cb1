#include "sensors/events/material_classifier.h"

#include <cmath>
#include <set>

#include "core/error.h"
#include "sensors/learning/early_stopping.h"

namespace touchstone::sensors {
namespace {

std::string fault_of_names(const std::vector<std::string>& materials) {
  if (materials.size() < 2) return fmt::format("{} materials; at least 2 are needed", materials.size());
  std::set<std::string> names;
  for (const std::string& name : materials) {
    if (name.empty()) return "a material has no name";
    if (!names.insert(name).second) return fmt::format("two materials are called '{}'", name);
  }
  return {};
}

void check(std::span<const MaterialSample> samples, std::size_t materials, std::span<const int> chosen,
           Eigen::Index features) {
  for (const int index : chosen) {
    if (index < 0 || index >= static_cast<int>(samples.size())) {
      fail("material classifier: sample {} is chosen, there are {}", index, samples.size());
    }
    const MaterialSample& sample = samples[static_cast<std::size_t>(index)];
    if (sample.label < 0 || sample.label >= static_cast<int>(materials)) {
      fail("material classifier: sample {} is of material {}, there are {}", index, sample.label, materials);
    }
    if (sample.features.size() != features || features == 0) {
      fail("material classifier: sample {} has {} features, {} are needed", index, sample.features.size(),
           std::max<Eigen::Index>(features, 1));
    }
    if (!sample.features.allFinite()) fail("material classifier: a feature of sample {} isn't finite", index);
  }
}

Eigen::VectorXd scaled(const RangeScaling& scaling, const Eigen::VectorXd& features) {
  Eigen::VectorXd result(features.size());
  for (Eigen::Index i = 0; i < features.size(); ++i) result[i] = scaling.scaled(i, features[i]);
  return result;
}

struct LabelledColumns {
  Eigen::MatrixXd inputs;
  std::vector<int> labels;
};

LabelledColumns columns_of(std::span<const MaterialSample> samples, std::span<const int> chosen,
                           const RangeScaling& scaling) {
  LabelledColumns columns{Eigen::MatrixXd(scaling.size(), static_cast<Eigen::Index>(chosen.size())), {}};
  for (const int index : chosen) {
    const MaterialSample& sample = samples[static_cast<std::size_t>(index)];
    columns.inputs.col(static_cast<Eigen::Index>(columns.labels.size())) = scaled(scaling, sample.features);
    columns.labels.push_back(sample.label);
  }
  return columns;
}

}  // namespace

Eigen::VectorXd grasp_features(const Eigen::MatrixXd& features, std::span<const int> judged) {
  const auto windows = static_cast<Eigen::Index>(judged.size());
  Eigen::VectorXd row(windows * features.cols());
  for (Eigen::Index i = 0; i < features.cols(); ++i) {
    for (Eigen::Index window = 0; window < windows; ++window) {
      const int from = judged[static_cast<std::size_t>(window)];
      TS_ASSERT(from >= 0 && from < features.rows());
      row[i * windows + window] = features(from, i);
    }
  }
  return row;
}

std::string fault_of(const MaterialClassifier& model) {
  std::string fault = fault_of_names(model.materials);
  if (fault.empty()) fault = fault_of(model.network);
  if (!fault.empty()) return fault;
  if (!is_sound(model.features)) return "the features' ranges are faulty";
  if (model.network.inputs() != model.features.size()) {
    return fmt::format("the network has {} inputs, there are {} features", model.network.inputs(),
                       model.features.size());
  }
  if (model.network.outputs() != static_cast<Eigen::Index>(model.materials.size())) {
    return fmt::format("the network has {} outputs, there are {} materials", model.network.outputs(),
                       model.materials.size());
  }
  return {};
}

double cross_entropy(const Eigen::MatrixXd& outputs, std::span<const int> labels, Eigen::MatrixXd& by_outputs) {
  TS_ASSERT(static_cast<Eigen::Index>(labels.size()) == outputs.cols() && outputs.cols() > 0);
  const auto count = static_cast<double>(labels.size());
  by_outputs.resize(outputs.rows(), outputs.cols());
  double sum = 0.0;
  for (Eigen::Index j = 0; j < outputs.cols(); ++j) {
    const int label = labels[static_cast<std::size_t>(j)];
    const double most = outputs.col(j).maxCoeff();
    by_outputs.col(j) = (outputs.col(j).array() - most).exp();
    const double total = by_outputs.col(j).sum();
    sum += std::log(total) + most - outputs(label, j);
    by_outputs.col(j) /= total;
    by_outputs(label, j) -= 1.0;
  }
  by_outputs /= count;
  return sum / count;
}

TrainedMaterialClassifier train_material_classifier(std::span<const MaterialSample> samples,
                                                    const std::vector<std::string>& materials,
                                                    std::span<const int> training, std::span<const int> validation,
                                                    const MaterialClassifierSettings& settings, int fold) {
  const std::string fault = fault_of_names(materials);
  if (!fault.empty()) fail("material classifier: {}", fault);
  if (settings.patience < 1) fail("material classifier: patience is {}, it must be at least 1", settings.patience);
  if (fold < 0) fail("material classifier: fold is {}, it must be at least 0", fold);
  if (training.empty()) fail("material classifier: there is no training sample");
  const int first = training.front();
  const Eigen::Index features = first >= 0 && first < static_cast<int>(samples.size())
                                    ? samples[static_cast<std::size_t>(first)].features.size()
                                    : 0;
  check(samples, materials.size(), training, features);
  check(samples, materials.size(), validation, features);
  std::vector<int> seen(materials.size(), 0);
  for (const int index : training) ++seen[static_cast<std::size_t>(samples[static_cast<std::size_t>(index)].label)];
  for (std::size_t i = 0; i < materials.size(); ++i) {
    if (seen[i] == 0) fail("material classifier: '{}' has no training sample", materials[i]);
  }

  TrainedMaterialClassifier trained;
  MaterialClassifier& model = trained.model;
  NetworkTrainingReport& report = trained.report;
  model.materials = materials;
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(training.size()), features);
  for (std::size_t i = 0; i < training.size(); ++i) {
    rows.row(static_cast<Eigen::Index>(i)) = samples[static_cast<std::size_t>(training[i])].features.transpose();
  }
  model.features = range_scaling(rows);
  RandomStream random(settings.seed, static_cast<std::uint64_t>(fold), Purpose::kNetworkWeights);
  model.network = random_network({.inputs = static_cast<int>(features),
                                  .hidden_layers = settings.hidden_layers,
                                  .units = settings.units,
                                  .outputs = static_cast<int>(materials.size()),
                                  .sigmoid = settings.sigmoid},
                                 random);

  const LabelledColumns learnt = columns_of(samples, training, model.features);
  const LabelledColumns kept = columns_of(samples, validation, model.features);
  FeedForwardNetwork network = model.network;
  Eigen::MatrixXd by_outputs;
  const ValueAndGradient loss = [&](const Eigen::VectorXd& parameters, Eigen::VectorXd& gradient) {
    set_parameters(network, parameters);
    const LayerValues values = run_forward(network, learnt.inputs);
    const double value = cross_entropy(values.back(), learnt.labels, by_outputs);
    gradient = sum_gradient(values, run_backward(network, values, by_outputs));
    return value;
  };
  EarlyStopping stopping(settings.patience);
  int accepted = 0;
  const auto watch = [&](int, const Eigen::VectorXd& parameters, double value) {
    double validation_loss = 0.0;
    if (!validation.empty()) {
      set_parameters(network, parameters);
      Eigen::MatrixXd unused;
      validation_loss = cross_entropy(evaluate(network, kept.inputs), kept.labels, unused);
    }
    report.history.push_back({value, validation_loss});
    return !validation.empty() && stopping.shows(accepted++, validation_loss, parameters);
  };
  Eigen::VectorXd parameters = parameters_of(model.network);
  Eigen::VectorXd unused(parameters.size());
  watch(0, parameters, loss(parameters, unused));
  const ScaledConjugateGradientEnd end =
      minimise_by_scaled_conjugate_gradient(loss, parameters, settings.training, watch);
  report.end = end.was_stopped                             ? NetworkTrainingEnd::kValidation
               : end.is_flat                               ? NetworkTrainingEnd::kFlat
               : end.steps >= settings.training.most_steps ? NetworkTrainingEnd::kOutOfSteps
                                                           : NetworkTrainingEnd::kStuck;
  report.steps = static_cast<int>(report.history.size()) - 1;
  report.factorisations = end.gradients;
  const bool has_best = !validation.empty() && stopping.best().size() > 0;
  report.best_step = has_best ? stopping.best_step() : report.steps;
  set_parameters(model.network, has_best ? stopping.best() : parameters);
  return trained;
}

MaterialGuess classify(const MaterialClassifier& model, const Eigen::VectorXd& features) {
  if (features.size() != model.features.size()) {
    fail("material classifier: {} features, the model has {}", features.size(), model.features.size());
  }
  if (!features.allFinite()) fail("material classifier: a feature isn't finite");
  MaterialGuess guess;
  guess.probabilities = evaluate(model.network, scaled(model.features, features)).col(0);
  guess.probabilities = (guess.probabilities.array() - guess.probabilities.maxCoeff()).exp().matrix().eval();
  guess.probabilities /= guess.probabilities.sum();
  guess.probabilities.maxCoeff(&guess.label);
  return guess;
}

}  // namespace touchstone::sensors
