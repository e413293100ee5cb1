#pragma once
// A network of fully connected layers: k hidden ones of sigmoids and a linear output, which the time delay network
// [Naeini2020, fig. 4] and the classifier before its softmax (fig. 6) have in common.
//
// "Sigmoid" may mean 1 / (1 + exp(-x)) or tanh(x). Since the first is (1 + tanh(x / 2)) / 2, networks of either are the
// same functions, with other weights; what differs is how they train. tanh has its mean at zero and twice the slope,
// and is what MATLAB's toolbox, which the paper used, starts from; it is the default.

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "core/random.h"

namespace touchstone::sensors {

/// The function of a hidden unit: tanh(x), or 1 / (1 + exp(-x)).
enum class Sigmoid : std::uint8_t { kTanh, kLogistic };
/// "tanh", "logistic"
const char* name_of(Sigmoid sigmoid);

/// Weights and biases, layer by layer.
struct FeedForwardNetwork {
  Sigmoid sigmoid = Sigmoid::kTanh;      ///< of all layers but the last, which is linear
  std::vector<Eigen::MatrixXd> weights;  ///< of each layer: its units x its inputs
  std::vector<Eigen::VectorXd> biases;   ///< of each layer

  Eigen::Index inputs() const { return weights.front().cols(); }
  Eigen::Index outputs() const { return weights.back().rows(); }
  /// Number of weights and biases.
  Eigen::Index parameters() const;
};

/// What is wrong with a network (no layer, sizes that don't fit, values that aren't finite), or nothing.
std::string fault_of(const FeedForwardNetwork& network);

/// How many units each layer has.
struct NetworkShape {
  int inputs = 1;
  int hidden_layers = 1;  ///< k, 0 to 100: 0 is a linear map
  int units = 10;         ///< n of each hidden layer, 1 to 10,000
  int outputs = 1;
  Sigmoid sigmoid = Sigmoid::kTanh;
};

/// Biases zero, weights uniform within sqrt(6 / (inputs + units)) of zero [Glorot2010]. The paper has biases "set to
/// zero at the first place" and weights "initialized randomly", without a range.
/// @throws Error naming what is out of its range
FeedForwardNetwork random_network(const NetworkShape& shape, RandomStream& random);

/// All weights and biases in a row: layer by layer, weights column by column, then biases.
Eigen::VectorXd parameters_of(const FeedForwardNetwork& network);
/// @pre as many as there are
void set_parameters(FeedForwardNetwork& network, const Eigen::VectorXd& parameters);

/// Outputs (a column a sample) of inputs (a column a sample). @pre inputs.rows() == network.inputs()
Eigen::MatrixXd evaluate(const FeedForwardNetwork& network, const Eigen::MatrixXd& inputs);

/// What goes into each layer, and last what comes out: a column a sample.
using LayerValues = std::vector<Eigen::MatrixXd>;

/// evaluate(), with all that stands between.
LayerValues run_forward(const FeedForwardNetwork& network, const Eigen::MatrixXd& inputs);

/// From the derivatives of something by the outputs to those by each layer's sums before its sigmoids (units x
/// samples).
std::vector<Eigen::MatrixXd> run_backward(const FeedForwardNetwork& network, const LayerValues& values,
                                          const Eigen::MatrixXd& by_outputs);

/// The derivatives by all parameters, summed over samples, in the order of parameters_of().
Eigen::VectorXd sum_gradient(const LayerValues& values, const std::vector<Eigen::MatrixXd>& by_sums);

/// evaluate() for one sample at a time, without allocating. One object is for one thread.
class NetworkRunner {
 public:
  /// Allocates the values of networks of this shape.
  explicit NetworkRunner(const FeedForwardNetwork& network);
  /// @pre network is that of the constructor, inputs fit. What it returns holds until the next call
  const Eigen::VectorXd& run(const FeedForwardNetwork& network, const Eigen::VectorXd& inputs);

 private:
  std::vector<Eigen::VectorXd> values_;
};

}  // namespace touchstone::sensors
