#include "sensors/learning/network_json.h"

#include <array>

#include "sensors/models/sealed_json.h"

namespace touchstone::sensors {

Json json_of(const FeedForwardNetwork& network) {
  Json layers = Json::array();
  for (std::size_t i = 0; i < network.weights.size(); ++i) {
    layers.push_back({{"weights", json_of(network.weights[i])}, {"biases", json_of(network.biases[i])}});
  }
  return {{"sigmoid", name_of(network.sigmoid)}, {"layers", layers}};
}

FeedForwardNetwork network_of(const JsonField& field) {
  field.expect_map({"sigmoid", "layers"});
  FeedForwardNetwork network;
  network.sigmoid = field.at("sigmoid").name_among(std::array{Sigmoid::kTanh, Sigmoid::kLogistic});
  const JsonField layers = field.at("layers");
  if (!layers.value.is_array()) layers.refuse("is a {}, a list is needed", layers.value.type_name());
  for (std::size_t i = 0; i < layers.value.size(); ++i) {
    const JsonField layer = layers.at(i);
    layer.expect_map({"weights", "biases"});
    network.weights.push_back(matrix_of(layer.at("weights")));
    network.biases.push_back(vector_of(layer.at("biases")));
  }
  return network;
}

Json json_of(const RangeScaling& scaling) {
  return {{"low", json_of(scaling.low)}, {"high", json_of(scaling.high)}};
}

RangeScaling range_scaling_of(const JsonField& field) {
  field.expect_map({"low", "high"});
  return {vector_of(field.at("low")), vector_of(field.at("high"))};
}

}  // namespace touchstone::sensors
