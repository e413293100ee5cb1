#pragma once
// Material of a grasped object from its events: [Naeini2020, sec. IV, fig. 6].
//
// "The input consists of two features (accumulation of positive and negative events) for all the sequences of each
// grip". A grasp is one sample: the paper's table IV has whole multiples of 1/192 (48 folds of 4 validation grasps),
// its table V of 1/48. So the input is taken to be all windows' accumulated counts in a row, those of the grasping and
// those of the releasing phase; the paper doesn't say so outright. They are scaled to [-1, 1] by their ranges in
// training.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sensors/learning/feed_forward_network.h"
#include "sensors/learning/levenberg_marquardt.h"
#include "sensors/learning/range_scaling.h"
#include "sensors/learning/scaled_conjugate_gradient.h"

namespace touchstone::sensors {

/// One grasp of a known material.
struct MaterialSample {
  Eigen::VectorXd features;
  int label = 0;  ///< index in the list of materials
};

/// The judged windows of a sequence in a row: the first feature of each window in its order, then the second, ...
/// @pre rows within the features
Eigen::VectorXd grasp_features(const Eigen::MatrixXd& features, std::span<const int> judged);

/// A trained classifier: features are scaled, then the network's outputs go through a softmax.
struct MaterialClassifier {
  std::vector<std::string> materials;  ///< names, each once
  RangeScaling features;
  FeedForwardNetwork network;  ///< one output a material, before the softmax
};

/// What is wrong with a model (sizes, ranges, names, the network), or nothing.
std::string fault_of(const MaterialClassifier& model);

/// The network's size and how it is trained.
struct MaterialClassifierSettings {
  int hidden_layers = 2;  ///< k; the paper's choice
  int units = 30;         ///< n
  Sigmoid sigmoid = Sigmoid::kTanh;
  ScaledConjugateGradientSettings training;
  int patience = 6;        ///< see EarlyStopping; only with validation samples
  std::uint64_t seed = 1;  ///< of the first weights
};

/// What training gives.
struct TrainedMaterialClassifier {
  MaterialClassifier model;
  NetworkTrainingReport report;  ///< losses are mean cross entropies, nats
};

/// Trains on the cross entropy by scaled conjugate gradient, with early stopping on the samples `validation` (which may
/// be empty). A pure function of its arguments.
/// @param fold which of several trainings it is: each has first weights of its own
/// @throws Error for no or doubled names, a label without a name, features that aren't finite or of different numbers,
/// a material without a training sample, an index that isn't there, or a setting out of its range
TrainedMaterialClassifier train_material_classifier(std::span<const MaterialSample> samples,
                                                    const std::vector<std::string>& materials,
                                                    std::span<const int> training, std::span<const int> validation,
                                                    const MaterialClassifierSettings& settings, int fold = 0);

/// The answer for one grasp.
struct MaterialGuess {
  int label = 0;                  ///< the likeliest; of equally likely ones the first
  Eigen::VectorXd probabilities;  ///< the softmax; their sum is 1
};

/// @throws Error for another number of features than the model's, or one that isn't finite
MaterialGuess classify(const MaterialClassifier& model, const Eigen::VectorXd& features);

/// Mean cross entropy of outputs before the softmax (a column a sample), nats, and its derivatives by them.
/// @pre as many labels as columns, each within the rows
double cross_entropy(const Eigen::MatrixXd& outputs, std::span<const int> labels, Eigen::MatrixXd& by_outputs);

}  // namespace touchstone::sensors
