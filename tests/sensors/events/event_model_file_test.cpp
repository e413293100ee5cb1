// Files of the models that the estimators of [Naeini2020] make: network, classifier, Gaussian process.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "sensors/events/material_classifier_file.h"
#include "sensors/events/time_delay_network_file.h"
#include "sensors/learning/gaussian_process_file.h"
#include "tests/sensors/models/resealed_json.h"
#include "tests/support/message_of.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using test::resealed;
using testing::HasSubstr;
using Json = nlohmann::json;

TimeDelayNetwork some_network() {
  RandomStream random(1, 0, Purpose::kTest);
  TimeDelayNetwork model;
  model.delays = 3;
  model.features = {Eigen::Vector2d(0.0, 0.1), Eigen::Vector2d(1234.0, 10.0 / 3.0)};
  model.force_N = {Eigen::VectorXd::Constant(1, 0.1), Eigen::VectorXd::Constant(1, 3.7)};
  model.network = random_network({.inputs = 6, .hidden_layers = 2, .units = 5, .sigmoid = Sigmoid::kLogistic}, random);
  return model;
}

MaterialClassifier some_classifier() {
  RandomStream random(2, 0, Purpose::kTest);
  MaterialClassifier model;
  model.materials = {"foam", "a \"hard\" one"};
  model.features = {Eigen::Vector2d(0.0, 0.1), Eigen::Vector2d(1234.0, 10.0 / 3.0)};
  model.network = random_network({.inputs = 2, .hidden_layers = 1, .units = 4, .outputs = 2}, random);
  return model;
}

GaussianProcess some_process() {
  const Eigen::MatrixXd inputs = (Eigen::MatrixXd(3, 2) << 0.0, 0.1, 1.0 / 3.0, 0.5, 0.3, 2.0).finished();
  return condition({Eigen::Vector2d(0.7, 1.3), 1.5, 0.2}, inputs, Eigen::Vector3d(1.0, 2.0 / 3.0, 0.5));
}

TEST(EventModelFiles, WhatIsReadIsWhatWasWrittenBitForBit) {
  const auto folder = std::filesystem::path(testing::TempDir());
  const TimeDelayNetwork network = some_network();
  save(network, folder / "network.json");
  const TimeDelayNetwork read = load_time_delay_network(folder / "network.json");
  EXPECT_EQ(to_json(read), to_json(network));
  EXPECT_EQ(read.network.weights, network.network.weights);
  EXPECT_EQ(read.network.sigmoid, Sigmoid::kLogistic);
  EXPECT_EQ(read.features.high, network.features.high);
  const Eigen::MatrixXd counts = (Eigen::MatrixXd(3, 2) << 0, 1, 100, 2, 1000, 3).finished();
  EXPECT_EQ(estimate_force(read, counts), estimate_force(network, counts));

  const MaterialClassifier classifier = some_classifier();
  save(classifier, folder / "classifier.json");
  const MaterialClassifier material = load_material_classifier(folder / "classifier.json");
  EXPECT_EQ(to_json(material), to_json(classifier));
  EXPECT_EQ(material.materials, classifier.materials);
  EXPECT_EQ(material.network.weights, classifier.network.weights);

  const GaussianProcess process = some_process();
  save(process, folder / "process.json");
  const GaussianProcess again = load_gaussian_process(folder / "process.json");
  EXPECT_EQ(to_json(again), to_json(process));
  EXPECT_EQ(again.weights, process.weights);
  EXPECT_EQ(again.factor, process.factor);
  EXPECT_EQ(again.mean, process.mean);
}

std::string network_error(const std::string& text) {
  return message_of([&] { time_delay_network_from_json(text, "m.json"); });
}

TEST(EventModelFiles, FaultyNetworksAreNamed) {
  const std::string good = to_json(some_network());
  EXPECT_EQ(network_error(good), "no error");
  EXPECT_THAT(network_error("{"), HasSubstr("m.json:1: isn't valid JSON"));
  EXPECT_THAT(network_error("[]"), HasSubstr("map"));
  EXPECT_THAT(network_error(to_json(some_classifier())), HasSubstr("format: is 'touchstone.material_classifier'"));
  EXPECT_THAT(network_error(resealed(good, [](Json& j) { j["version"] = 2; })), HasSubstr("version"));
  // A digit changed, without the checksum.
  std::string damaged = good;
  const auto at = damaged.find("1234");
  ASSERT_NE(at, std::string::npos);
  damaged[at] = '2';
  EXPECT_THAT(network_error(damaged), HasSubstr("its checksum doesn't fit"));
  Json bare = Json::parse(good);
  bare.erase("sha256");
  EXPECT_THAT(network_error(bare.dump()), HasSubstr("'sha256' is missing"));
  const auto error = [&](auto change) { return network_error(resealed(good, change)); };
  EXPECT_THAT(error([](Json& j) { j.erase("delays"); }), HasSubstr("'delays' is missing"));
  EXPECT_THAT(error([](Json& j) { j["delay"] = 3; }), HasSubstr("'delay' isn't known"));
  EXPECT_THAT(error([](Json& j) { j["delays"] = 0; }), HasSubstr("delays: is 0"));
  EXPECT_THAT(error([](Json& j) { j["delays"] = 2; }), HasSubstr("6 inputs; 2 features of 2 windows"));
  EXPECT_THAT(error([](Json& j) { j["features"]["low"][1] = "x"; }), HasSubstr("features.low[1]"));
  EXPECT_THAT(error([](Json& j) { j["features"]["low"] = Json::array(); }), HasSubstr("features.low: is empty"));
  EXPECT_THAT(error([](Json& j) { j["force_N"]["high"] = 3; }), HasSubstr("force_N.high: is a number, a list"));
  EXPECT_THAT(error([](Json& j) { j["network"]["sigmoid"] = "tan"; }), HasSubstr("network.sigmoid"));
  EXPECT_THAT(error([](Json& j) { j["network"]["layers"] = 1; }), HasSubstr("network.layers: is a number"));
  EXPECT_THAT(error([](Json& j) { j["network"]["layers"][1]["weights"] = 1; }), HasSubstr("a list of rows"));
  EXPECT_THAT(error([](Json& j) { j["network"]["layers"][1]["weights"] = Json::array(); }), HasSubstr("is empty"));
  EXPECT_THAT(error([](Json& j) { j["network"]["layers"][1]["weights"][2].erase(0); }),
              HasSubstr("network.layers[1].weights[2]: has 4 entries, 5 are needed"));
  EXPECT_THAT(error([](Json& j) { j["network"]["layers"].erase(0); }), HasSubstr("the network has 5 inputs"));
  for (std::size_t length = 0; length + 3 < good.size(); length += 17) {
    EXPECT_THROW(time_delay_network_from_json(good.substr(0, length), "m.json"), Error) << length;
  }
  TimeDelayNetwork faulty = some_network();
  faulty.delays = 4;
  EXPECT_THAT(message_of([&] { to_json(faulty); }), HasSubstr("2 features of 4 windows"));
  EXPECT_THAT(message_of([] { load_time_delay_network("/nowhere/n.json"); }), HasSubstr("/nowhere/n.json"));
}

TEST(EventModelFiles, FaultyClassifiersAreNamed) {
  const std::string good = to_json(some_classifier());
  const auto error = [&](auto change) {
    return message_of([&] { material_classifier_from_json(resealed(good, change), "m.json"); });
  };
  EXPECT_EQ(error([](Json&) {}), "no error");
  EXPECT_THAT(error([](Json& j) { j["materials"] = "foam"; }), HasSubstr("materials: is a string, a list"));
  EXPECT_THAT(error([](Json& j) { j["materials"][0] = 1; }), HasSubstr("materials[0]: is a number, text"));
  EXPECT_THAT(error([](Json& j) { j["materials"].push_back("third"); }), HasSubstr("2 outputs, there are 3 materials"));
  MaterialClassifier faulty = some_classifier();
  faulty.materials.clear();
  EXPECT_THAT(message_of([&] { to_json(faulty); }), HasSubstr("0 materials"));
  EXPECT_THAT(message_of([] { load_material_classifier("/nowhere/n.json"); }), HasSubstr("/nowhere/n.json"));
}

TEST(EventModelFiles, FaultyProcessesAreNamed) {
  const std::string good = to_json(some_process());
  const auto error = [&](auto change) {
    return message_of([&] { gaussian_process_from_json(resealed(good, change), "m.json"); });
  };
  EXPECT_EQ(error([](Json&) {}), "no error");
  EXPECT_THAT(error([](Json& j) { j["noise"] = 0.0; }), HasSubstr("m.json: Gaussian process: noise is 0"));
  EXPECT_THAT(error([](Json& j) { j["lengths"].erase(0); }), HasSubstr("1 lengths for 2 inputs"));
  EXPECT_THAT(error([](Json& j) { j["targets"].erase(0); }), HasSubstr("3 samples have 2 targets"));
  EXPECT_THAT(error([](Json& j) { j["inputs"][1].erase(0); }), HasSubstr("inputs[1]: has 1 entries"));
  EXPECT_THAT(message_of([] { to_json(GaussianProcess{}); }), HasSubstr("wasn't conditioned"));
  EXPECT_THAT(message_of([] { load_gaussian_process("/nowhere/n.json"); }), HasSubstr("/nowhere/n.json"));
}

}  // namespace
}  // namespace touchstone::sensors
