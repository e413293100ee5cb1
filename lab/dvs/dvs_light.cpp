#include "lab/dvs/dvs_light.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <opencv2/core.hpp>

namespace touchstone::lab {
namespace {

constexpr double kLeastCut_mm = 1e-6;  // travels nearer to each other aren't cut again
constexpr int kFirstCuts = 4;          // of the travel before the touch

using Pictures = std::map<double, cv::Mat>;  // logarithms, by travel

void refine(const Pictures::value_type& before, const Pictures::value_type& after, double allowed,
            const std::function<cv::Mat(double)>& picture, Pictures& made) {
  if (after.first - before.first < 2.0 * kLeastCut_mm) return;
  const double travel = 0.5 * (before.first + after.first);
  const Pictures::value_type& middle = *made.emplace(travel, picture(travel)).first;
  cv::Mat straight;
  cv::addWeighted(before.second, 0.5, after.second, 0.5, 0.0, straight);
  if (cv::norm(straight, middle.second, cv::NORM_INF) <= allowed) return;
  refine(before, middle, allowed, picture, made);
  refine(middle, after, allowed, picture, made);
}

}  // namespace

render::FaceState dvs_face(const DvsGraspSetup& setup, const sim::MembraneCamera& camera, const DvsGrasp& grasp,
                           double travel_mm) {
  const sim::ObjectSpec& piece = setup.piece(grasp.parameters.material);
  const sim::GripPoint point = grasp.face->at_travel(travel_mm);
  const sim::FaceMap map = grasp.face->map(point);
  return sim::face_state(camera.grid(), grasp.face->grid(), map.coverage, map.gap_mm, sim::kNoPiece_mm,
                         sim::in_one_band(setup.device(), piece.albedo, "albedo"),
                         piece.shape.across_flats_mm - point.approach_mm);
}

DvsTravelLight::DvsTravelLight(const DvsGraspSetup& setup, const sim::MembraneCamera& camera, const DvsGrasp& grasp,
                               const render::EventPixelSettings& pixels, double allowed)
    : dark_(pixels.dark_intensity) {
  const auto picture = [&](double travel) {
    const cv::Mat light = camera.photocurrent(dvs_face(setup, camera, grasp, travel));
    return render::log_intensity(light * grasp.parameters.light_level, pixels);
  };
  const std::vector<sim::FingerMoment>& moments = grasp.run.moments;
  const auto [least, most] = std::minmax_element(
      moments.begin(), moments.end(),
      [](const sim::FingerMoment& a, const sim::FingerMoment& b) { return a.travel_mm < b.travel_mm; });
  const double low = least->travel_mm;
  const double high = std::max(most->travel_mm, low + kLeastCut_mm);
  // The face's course has corners at its states. Before the touch, the nearer the piece the steeper it is.
  std::vector<double> first = {low, high};
  for (const sim::GripPoint& state : grasp.face->states()) first.push_back(state.travel_mm);
  for (int k = 1; k < kFirstCuts; ++k) first.push_back(std::min(0.0, low) * std::exp2(-k));
  Pictures corners;
  for (const double travel : first) {
    if (travel >= low && travel <= high) corners.emplace(travel, cv::Mat());
  }
  for (auto& [travel, log] : corners) log = picture(travel);
  Pictures made = corners;
  for (auto before = corners.begin(), after = std::next(before); after != corners.end(); ++before, ++after) {
    refine(*before, *after, allowed, picture, made);
  }
  for (const auto& [travel, log] : made) {
    path_.push_back(logs_.empty() ? 0.0 : path_.back() + cv::norm(logs_.back(), log, cv::NORM_INF));
    travels_.push_back(travel);
    logs_.push_back(log);
  }
}

std::pair<std::size_t, double> DvsTravelLight::place_of(double travel_mm) const {
  const auto above = std::upper_bound(travels_.begin() + 1, travels_.end() - 1, travel_mm);
  const auto k = static_cast<std::size_t>(above - travels_.begin()) - 1;
  return {k, std::clamp((travel_mm - travels_[k]) / (travels_[k + 1] - travels_[k]), 0.0, 1.0)};
}

double DvsTravelLight::path_at(double travel_mm) const {
  const auto [k, part] = place_of(travel_mm);
  return path_[k] + part * (path_[k + 1] - path_[k]);
}

cv::Mat DvsTravelLight::log_at(double travel_mm) const {
  const auto [k, part] = place_of(travel_mm);
  cv::Mat log;
  cv::addWeighted(logs_[k], 1.0 - part, logs_[k + 1], part, 0.0, log);
  return log;
}

cv::Mat DvsTravelLight::photocurrent_at(double travel_mm) const {
  cv::Mat light = log_at(travel_mm);
  cv::exp(light, light);
  light -= dark_;
  return cv::max(light, 0.0);
}

}  // namespace touchstone::lab
