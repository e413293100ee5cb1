#include "sensors/events/time_delay_network.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

/// What the network is given for the judged windows, scaled, a column each.
NetworkSamples samples_of(std::span<const ForceSeries> series, std::span<const int> chosen,
                          const TimeDelayNetwork& model) {
  const Eigen::Index features = model.features.size();
  Eigen::Index count = 0;
  for (const int index : chosen)
    count += static_cast<Eigen::Index>(series[static_cast<std::size_t>(index)].judged.size());
  NetworkSamples samples{Eigen::MatrixXd(features * model.delays, count), Eigen::MatrixXd(1, count)};
  Eigen::Index next = 0;
  for (const int index : chosen) {
    const ForceSeries& one = series[static_cast<std::size_t>(index)];
    for (const int row : one.judged) {
      for (int back = 0; back < model.delays; ++back) {
        for (Eigen::Index i = 0; i < features; ++i) {
          samples.inputs(back * features + i, next) =
              model.features.scaled(i, row >= back ? one.features(row - back, i) : 0.0);
        }
      }
      samples.targets(0, next++) = model.force_N.scaled(0, one.force_N[row]);
    }
  }
  return samples;
}

}  // namespace

std::string fault_of(const TimeDelayNetwork& model) {
  if (model.delays < 1 || model.delays > 1000) {
    return fmt::format("{} windows are looked at; it must be 1 to 1000", model.delays);
  }
  if (!is_sound(model.features) || model.features.size() == 0) return "the features' ranges are faulty";
  if (!is_sound(model.force_N) || model.force_N.size() != 1) return "the force's range is faulty";
  const std::string fault = fault_of(model.network);
  if (!fault.empty()) return fault;
  if (model.network.inputs() != model.delays * model.features.size()) {
    return fmt::format("the network has {} inputs; {} features of {} windows are needed", model.network.inputs(),
                       model.features.size(), model.delays);
  }
  if (model.network.outputs() != 1) return fmt::format("the network has {} outputs, not 1", model.network.outputs());
  return {};
}

TrainedTimeDelayNetwork train_time_delay_network(std::span<const ForceSeries> series, std::span<const int> training,
                                                 std::span<const int> validation,
                                                 const TimeDelayNetworkSettings& settings, int fold) {
  if (settings.delays < 1 || settings.delays > 1000) {
    fail("time delay network: delays is {}, it must be from 1 to 1000", settings.delays);
  }
  if (training.empty()) fail("time delay network: there is no series to train on");
  if (fold < 0) fail("time delay network: fold is {}, it must be at least 0", fold);
  const StackedSeries seen = stack(series, training);
  const StackedSeries kept = stack(series, validation);
  if (!validation.empty() && kept.features.cols() != seen.features.cols()) {
    fail("time delay network: {} features to train on and {} to validate on", seen.features.cols(),
         kept.features.cols());
  }
  TrainedTimeDelayNetwork trained;
  TimeDelayNetwork& model = trained.model;
  model.delays = settings.delays;
  model.features = range_scaling(seen.features);
  model.force_N = range_scaling(seen.force_N);
  RandomStream random(settings.seed, static_cast<std::uint64_t>(fold), Purpose::kNetworkWeights);
  model.network = random_network({.inputs = static_cast<int>(seen.features.cols()) * settings.delays,
                                  .hidden_layers = settings.hidden_layers,
                                  .units = settings.units,
                                  .outputs = 1,
                                  .sigmoid = settings.sigmoid},
                                 random);
  trained.report = train_by_levenberg_marquardt(model.network, samples_of(series, training, model),
                                                samples_of(series, validation, model), settings.training);
  return trained;
}

TimeDelayEstimator::TimeDelayEstimator(TimeDelayNetwork model) : model_(std::move(model)), runner_(model_.network) {
  const std::string fault = fault_of(model_);
  if (!fault.empty()) fail("time delay network: {}", fault);
  inputs_.resize(model_.network.inputs());
  begin();
}

void TimeDelayEstimator::begin() {
  const Eigen::Index features = model_.features.size();
  for (Eigen::Index i = 0; i < inputs_.size(); ++i) inputs_[i] = model_.features.scaled(i % features, 0.0);
  strange_windows_ = 0;
}

double TimeDelayEstimator::next(std::span<const double> features) {
  const Eigen::Index size = model_.features.size();
  if (static_cast<Eigen::Index>(features.size()) != size) {
    fail("time delay network: a window of {} features, the model has {}", features.size(), size);
  }
  for (const double feature : features) {
    if (!std::isfinite(feature)) fail("time delay network: a feature is {}, it must be finite", feature);
  }
  for (Eigen::Index i = inputs_.size() - 1; i >= size; --i) inputs_[i] = inputs_[i - size];
  strange_windows_ = std::max(0, strange_windows_ - 1);
  for (Eigen::Index i = 0; i < size; ++i) {
    const double feature = features[static_cast<std::size_t>(i)];
    inputs_[i] = model_.features.scaled(i, feature);
    if (feature < model_.features.low[i] || feature > model_.features.high[i]) strange_windows_ = model_.delays;
  }
  return model_.force_N.unscaled(0, runner_.run(model_.network, inputs_)[0]);
}

Eigen::VectorXd estimate_force(const TimeDelayNetwork& model, const Eigen::MatrixXd& features) {
  TimeDelayEstimator estimator(model);
  Eigen::VectorXd force(features.rows());
  std::vector<double> window(static_cast<std::size_t>(features.cols()));
  for (Eigen::Index row = 0; row < features.rows(); ++row) {
    for (Eigen::Index i = 0; i < features.cols(); ++i) window[static_cast<std::size_t>(i)] = features(row, i);
    force[row] = estimator.next(window);
  }
  return force;
}

}  // namespace touchstone::sensors
