#include "sensors/events/grasp_force_reader.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/units.h"

namespace touchstone::sensors {

GraspForceReader::GraspForceReader(GraspForceModel model, const EventWindowSettings& windows,
                                   const GraspPhaseSettings& phases)
    : window_settings_(windows), phases_(phases), windows_(windows), model_(std::move(model)) {
  if (const std::string fault = fault_of(model_); !fault.empty()) fail("grasp force: {}", fault);
  if (const auto* network = std::get_if<TimeDelayNetwork>(&model_.estimator)) {
    network_.emplace(*network);
  } else {
    most_ = std::get<GaussianProcess>(model_.estimator).inputs.colwise().maxCoeff().transpose();
  }
}

void GraspForceReader::add(std::span<const Event> events) {
  try {
    windows_.add(events);
  } catch (const Error&) {
    answer();  // windows before the event that is refused
    throw;
  }
  answer();
}

void GraspForceReader::end_at(std::int64_t t_us) {
  windows_.end_at(t_us);
  answer();
}

void GraspForceReader::answer() {
  const std::span<const EventCounts> all = windows_.finished();
  const auto background = static_cast<std::size_t>(phases_.background_windows);
  for (std::size_t i = forces_.size(); i < all.size(); ++i) {
    if (!threshold_ && i >= background) threshold_ = touch_threshold_of(all.first(background), phases_);
    WindowForce window;
    window.end_us = window_settings_.start_us + (static_cast<std::int64_t>(i) + 1) * window_settings_.length_us;
    window.counts = all[i];
    window.touched = since_touch_ > 0 || (threshold_ && all[i].off >= *threshold_);
    if (window.touched) estimate(window);
    forces_.push_back(window);
  }
}

void GraspForceReader::estimate(WindowForce& window) {
  on_ += window.counts.on;
  off_ += window.counts.off;
  ++since_touch_;
  const Eigen::Vector3d inputs(static_cast<double>(on_), static_cast<double>(off_),
                               static_cast<double>(window_settings_.length_us * since_touch_) / kMicrosecondsPerSecond);
  double variance = 0.0;
  if (network_) {
    window.force_N = network_->next(std::span(inputs.data(), 2));
    window.extrapolates = network_->extrapolates();
  } else {
    const GaussianProcessPrediction predicted =
        predict_with_variance(std::get<GaussianProcess>(model_.estimator), inputs.transpose());
    window.force_N = predicted.mean[0];
    variance = predicted.variance[0];
    window.extrapolates = (inputs.array() > most_.array()).any();
  }
  window.sigma_N = model_.sigma_N(window.force_N, variance);
}

}  // namespace touchstone::sensors
