#include "sensors/skin/softness_model.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/events/material_classifier_file.h"
#include "sensors/learning/leave_one_out.h"
#include "sensors/models/sealed_json.h"

namespace touchstone::sensors {
namespace {

constexpr const char* kFormat = "touchstone.softness_model";
constexpr int kVersion = 1;
constexpr std::size_t kMostNetworks = 100;

std::vector<MaterialClassifier> train_networks(const std::vector<MaterialSample>& samples,
                                               const std::vector<std::string>& names, const std::vector<int>& training,
                                               const std::vector<int>& validation, const SoftnessTraining& how) {
  std::vector<MaterialClassifier> networks;
  for (int n = 0; n < how.networks; ++n) {
    networks.push_back(train_material_classifier(samples, names, training, validation, how.classifier, n).model);
  }
  return networks;
}

}  // namespace

SoftnessTraining usual_softness_training() {
  SoftnessTraining training;
  training.spectrogram.trigger_N = 0.1;
  training.classifier.hidden_layers = 1;
  training.classifier.units = 10;
  return training;
}

Eigen::VectorXd softness_features(std::span<const double> force_N, double rate_Hz,
                                  const ForceSpectrogramSettings& spectrogram, double lowest_Hz, double highest_Hz) {
  const Eigen::VectorXd frequencies = spectrogram_frequencies(rate_Hz, spectrogram);
  std::vector<Eigen::Index> rows;
  for (Eigen::Index k = 0; k < frequencies.size(); ++k) {
    if (highest_Hz > 0.0 && frequencies[k] > highest_Hz) continue;
    if (frequencies[k] >= lowest_Hz) rows.push_back(k);
  }
  if (rows.empty()) {
    fail("softness: no frequency lies from {} to {} Hz; they are {} Hz apart, to {} Hz", lowest_Hz, highest_Hz,
         frequencies.size() > 1 ? frequencies[1] : 0.0, frequencies[frequencies.size() - 1]);
  }
  const Eigen::MatrixXd picture = force_spectrogram(force_N, rate_Hz, spectrogram);
  const Eigen::MatrixXd kept = picture(rows, Eigen::all);
  return kept.reshaped();
}

MaterialGuess classify(std::span<const MaterialClassifier> networks, const Eigen::VectorXd& features) {
  TS_ASSERT(!networks.empty());
  MaterialGuess mean;
  mean.probabilities = Eigen::VectorXd::Zero(std::ssize(networks.front().materials));
  for (const MaterialClassifier& network : networks) {
    mean.probabilities += classify(network, features).probabilities / static_cast<double>(networks.size());
  }
  mean.probabilities.maxCoeff(&mean.label);
  return mean;
}

SoftnessCalibration calibrate_softness(std::span<const KnownSoftness> presses, double rate_Hz,
                                       const SoftnessTraining& training, int threads) {
  constexpr int kLeast = 3;  // left out to test and one to validate on, one has to be left
  if (training.networks < 1 || static_cast<std::size_t>(training.networks) > kMostNetworks) {
    fail("softness: {} networks; allowed are 1 to {}", training.networks, kMostNetworks);
  }
  std::vector<std::string> names;
  std::vector<MaterialSample> samples;
  std::vector<int> labels, of_each;
  for (const KnownSoftness& press : presses) {
    auto known = std::ranges::find(names, press.softness);
    if (known == names.end()) {
      known = names.insert(known, press.softness);
      of_each.push_back(0);
    }
    labels.push_back(static_cast<int>(known - names.begin()));
    ++of_each[static_cast<std::size_t>(labels.back())];
    samples.push_back(
        {softness_features(press.force_N, rate_Hz, training.spectrogram, training.lowest_Hz, training.highest_Hz),
         labels.back()});
  }
  if (names.size() < 2) fail("softness: presses of two levels or more are needed, there is {}", names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (of_each[i] < kLeast) {
      fail("softness: {} presses of '{}'; at least {} of each level are needed", of_each[i], names[i], kLeast);
    }
  }
  const std::vector<Fold> folds = folds_by_class(labels, training.classifier.seed);
  std::vector<char> right(folds.size(), 0);
  SoftnessCalibration made;
  // The last one trains the model that is delivered, on all presses.
  const auto work = [&](int at) {
    if (at == static_cast<int>(folds.size())) {
      std::vector<int> all = folds.front().training;
      all.push_back(folds.front().test);
      std::ranges::sort(all);
      made.model = {rate_Hz, training.spectrogram, training.highest_Hz, training.lowest_Hz,
                    train_networks(samples, names, all, folds.front().validation, training)};
      return;
    }
    const Fold& fold = folds[static_cast<std::size_t>(at)];
    const auto networks = train_networks(samples, names, fold.training, fold.validation, training);
    const auto tested = static_cast<std::size_t>(fold.test);
    right[static_cast<std::size_t>(at)] = classify(networks, samples[tested].features).label == labels[tested] ? 1 : 0;
  };
  run_folds(static_cast<int>(folds.size()) + 1, threads, work);
  made.right = static_cast<int>(std::ranges::count(right, 1));
  return made;
}

MaterialGuess classify(const SoftnessModel& model, std::span<const double> force_N) {
  return classify(model.networks,
                  softness_features(force_N, model.rate_Hz, model.spectrogram, model.lowest_Hz, model.highest_Hz));
}

std::string fault_of(const SoftnessModel& model) {
  const ForceSpectrogramSettings& s = model.spectrogram;
  for (const double value : {model.rate_Hz, s.window_s, s.hop_s, s.length_s, s.trigger_N, s.floor_N}) {
    if (!(value > 0.0) || !std::isfinite(value)) return "rate, windows, trigger and floor must be above 0 and finite";
  }
  for (const double value : {model.highest_Hz, model.lowest_Hz, s.before_s}) {
    if (!(value >= 0.0) || !std::isfinite(value)) return "frequencies and before_s must be at least 0 and finite";
  }
  if (model.networks.empty() || model.networks.size() > kMostNetworks) {
    return fmt::format("it has {} networks; allowed are 1 to {}", model.networks.size(), kMostNetworks);
  }
  for (const MaterialClassifier& network : model.networks) {
    if (const std::string fault = fault_of(network); !fault.empty()) return fault;
    if (network.materials != model.networks.front().materials) return "its networks are of different levels";
  }
  return {};
}

std::string to_json(const SoftnessModel& model) {
  if (const std::string fault = fault_of(model); !fault.empty()) fail("softness model: {}", fault);
  const ForceSpectrogramSettings& s = model.spectrogram;
  Json networks = Json::array();
  for (const MaterialClassifier& network : model.networks) networks.push_back(Json::parse(to_json(network)));
  return seal({{"format", kFormat},
               {"version", kVersion},
               {"rate_Hz", model.rate_Hz},
               {"spectrogram",
                {{"window_s", s.window_s},
                 {"hop_s", s.hop_s},
                 {"length_s", s.length_s},
                 {"trigger_N", s.trigger_N},
                 {"before_s", s.before_s},
                 {"floor_N", s.floor_N}}},
               {"highest_Hz", model.highest_Hz},
               {"lowest_Hz", model.lowest_Hz},
               {"networks", networks}});
}

SoftnessModel softness_model_from_json(const std::string& text, const std::string& name) {
  const Json json = unseal(text, name, kFormat, kVersion);
  const JsonField root{json, "", name};
  root.expect_map({"format", "version", "rate_Hz", "spectrogram", "highest_Hz", "lowest_Hz", "networks"});
  SoftnessModel model;
  model.rate_Hz = root.at("rate_Hz").number();
  const JsonField s = root.at("spectrogram");
  s.expect_map({"window_s", "hop_s", "length_s", "trigger_N", "before_s", "floor_N"});
  model.spectrogram = {s.at("window_s").number(),  s.at("hop_s").number(),    s.at("length_s").number(),
                       s.at("trigger_N").number(), s.at("before_s").number(), s.at("floor_N").number()};
  model.highest_Hz = root.at("highest_Hz").number();
  model.lowest_Hz = root.at("lowest_Hz").number();
  const JsonField networks = root.at("networks");
  if (!networks.value.is_array()) networks.refuse("is a {}, a list is needed", networks.value.type_name());
  for (std::size_t i = 0; i < networks.value.size(); ++i) {
    const JsonField one = networks.at(i);
    if (!one.value.is_object()) one.refuse("is a {}, a map is needed", one.value.type_name());
    model.networks.push_back(material_classifier_from_json(one.value.dump(), name + ": " + one.path));
  }
  if (const std::string fault = fault_of(model); !fault.empty()) root.refuse("{}", fault);
  return model;
}

void save(const SoftnessModel& model, const std::filesystem::path& path) {
  write_whole_file(path, to_json(model));
}

SoftnessModel load_softness_model(const std::filesystem::path& path) {
  return softness_model_from_json(read_whole_file(path), path.string());
}

}  // namespace touchstone::sensors
