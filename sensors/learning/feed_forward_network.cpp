#include "sensors/learning/feed_forward_network.h"

#include <cmath>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

template <typename Derived>
void apply(Sigmoid sigmoid, Eigen::MatrixBase<Derived>& values) {
  if (sigmoid == Sigmoid::kTanh) {
    for (Eigen::Index j = 0; j < values.cols(); ++j) {
      for (Eigen::Index i = 0; i < values.rows(); ++i) values(i, j) = std::tanh(values(i, j));
    }
  } else {
    for (Eigen::Index j = 0; j < values.cols(); ++j) {
      for (Eigen::Index i = 0; i < values.rows(); ++i) values(i, j) = 1.0 / (1.0 + std::exp(-values(i, j)));
    }
  }
}

/// From a sigmoid's value to its slope there.
Eigen::ArrayXXd slopes(Sigmoid sigmoid, const Eigen::MatrixXd& values) {
  if (sigmoid == Sigmoid::kTanh) return 1.0 - values.array().square();
  return values.array() * (1.0 - values.array());
}

}  // namespace

const char* name_of(Sigmoid sigmoid) {
  return sigmoid == Sigmoid::kTanh ? "tanh" : "logistic";
}

Eigen::Index FeedForwardNetwork::parameters() const {
  Eigen::Index count = 0;
  for (const Eigen::MatrixXd& layer : weights) count += layer.size() + layer.rows();
  return count;
}

std::string fault_of(const FeedForwardNetwork& network) {
  if (network.weights.empty()) return "the network has no layer";
  if (network.weights.size() != network.biases.size()) {
    return fmt::format("the network has weights of {} layers and biases of {}", network.weights.size(),
                       network.biases.size());
  }
  for (std::size_t i = 0; i < network.weights.size(); ++i) {
    const Eigen::MatrixXd& weights = network.weights[i];
    if (weights.size() == 0) return fmt::format("layer {} has no weights", i);
    if (network.biases[i].size() != weights.rows()) {
      return fmt::format("layer {} has {} units and {} biases", i, weights.rows(), network.biases[i].size());
    }
    if (i > 0 && weights.cols() != network.weights[i - 1].rows()) {
      return fmt::format("layer {} has {} inputs, the one before has {} units", i, weights.cols(),
                         network.weights[i - 1].rows());
    }
    if (!weights.allFinite() || !network.biases[i].allFinite()) {
      return fmt::format("a weight of layer {} isn't finite", i);
    }
  }
  return {};
}

FeedForwardNetwork random_network(const NetworkShape& shape, RandomStream& random) {
  const auto within = [](const char* name, int value, int low, int high) {
    if (value < low || value > high) fail("network: {} is {}, it must be from {} to {}", name, value, low, high);
  };
  within("inputs", shape.inputs, 1, 1'000'000);
  within("hidden_layers", shape.hidden_layers, 0, 100);
  within("units", shape.units, 1, 10'000);
  within("outputs", shape.outputs, 1, 10'000);
  FeedForwardNetwork network;
  network.sigmoid = shape.sigmoid;
  int inputs = shape.inputs;
  for (int layer = 0; layer <= shape.hidden_layers; ++layer) {
    const int units = layer < shape.hidden_layers ? shape.units : shape.outputs;
    const double limit = std::sqrt(6.0 / (inputs + units));
    Eigen::MatrixXd weights(units, inputs);
    for (double& weight : weights.reshaped()) weight = limit * (2.0 * random.uniform() - 1.0);
    network.weights.push_back(std::move(weights));
    network.biases.emplace_back(Eigen::VectorXd::Zero(units));
    inputs = units;
  }
  return network;
}

Eigen::VectorXd parameters_of(const FeedForwardNetwork& network) {
  Eigen::VectorXd parameters(network.parameters());
  Eigen::Index next = 0;
  for (std::size_t i = 0; i < network.weights.size(); ++i) {
    parameters.segment(next, network.weights[i].size()) = network.weights[i].reshaped();
    next += network.weights[i].size();
    parameters.segment(next, network.biases[i].size()) = network.biases[i];
    next += network.biases[i].size();
  }
  return parameters;
}

void set_parameters(FeedForwardNetwork& network, const Eigen::VectorXd& parameters) {
  TS_ASSERT(parameters.size() == network.parameters());
  Eigen::Index next = 0;
  for (std::size_t i = 0; i < network.weights.size(); ++i) {
    network.weights[i].reshaped() = parameters.segment(next, network.weights[i].size());
    next += network.weights[i].size();
    network.biases[i] = parameters.segment(next, network.biases[i].size());
    next += network.biases[i].size();
  }
}

Eigen::MatrixXd evaluate(const FeedForwardNetwork& network, const Eigen::MatrixXd& inputs) {
  return run_forward(network, inputs).back();
}

LayerValues run_forward(const FeedForwardNetwork& network, const Eigen::MatrixXd& inputs) {
  TS_ASSERT(inputs.rows() == network.inputs());
  LayerValues values{inputs};
  for (std::size_t i = 0; i < network.weights.size(); ++i) {
    Eigen::MatrixXd next = network.weights[i] * values.back();
    next.colwise() += network.biases[i];
    if (i + 1 < network.weights.size()) apply(network.sigmoid, next);
    values.push_back(std::move(next));
  }
  return values;
}

std::vector<Eigen::MatrixXd> run_backward(const FeedForwardNetwork& network, const LayerValues& values,
                                          const Eigen::MatrixXd& by_outputs) {
  const std::size_t layers = network.weights.size();
  TS_ASSERT(values.size() == layers + 1 && by_outputs.rows() == network.outputs());
  std::vector<Eigen::MatrixXd> by_sums(layers);
  by_sums.back() = by_outputs;
  for (std::size_t i = layers - 1; i > 0; --i) {
    by_sums[i - 1] = network.weights[i].transpose() * by_sums[i];
    by_sums[i - 1].array() *= slopes(network.sigmoid, values[i]);
  }
  return by_sums;
}

Eigen::VectorXd sum_gradient(const LayerValues& values, const std::vector<Eigen::MatrixXd>& by_sums) {
  Eigen::Index size = 0;
  for (std::size_t i = 0; i < by_sums.size(); ++i) size += by_sums[i].rows() * (values[i].rows() + 1);
  Eigen::VectorXd gradient(size);
  Eigen::Index next = 0;
  for (std::size_t i = 0; i < by_sums.size(); ++i) {
    const Eigen::MatrixXd weights = by_sums[i] * values[i].transpose();
    gradient.segment(next, weights.size()) = weights.reshaped();
    next += weights.size();
    gradient.segment(next, by_sums[i].rows()) = by_sums[i].rowwise().sum();
    next += by_sums[i].rows();
  }
  return gradient;
}

NetworkRunner::NetworkRunner(const FeedForwardNetwork& network) {
  for (const Eigen::VectorXd& biases : network.biases) values_.emplace_back(biases.size());
}

const Eigen::VectorXd& NetworkRunner::run(const FeedForwardNetwork& network, const Eigen::VectorXd& inputs) {
  TS_ASSERT(values_.size() == network.weights.size() && inputs.size() == network.inputs());
  for (std::size_t i = 0; i < network.weights.size(); ++i) {
    values_[i] = network.biases[i];
    values_[i].noalias() += network.weights[i] * (i == 0 ? inputs : values_[i - 1]);
    if (i + 1 < network.weights.size()) apply(network.sigmoid, values_[i]);
  }
  return values_.back();
}

}  // namespace touchstone::sensors
