#include "lab/reflex/reflex_record.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <utility>

#include "core/error.h"

namespace touchstone::lab {
namespace {

/// W/m^2 that make the largest number at the longest exposure.
double full_light(const render::MotionChipSettings& chip) {
  const render::ImagerResponse response = render::response_of(chip.imager);
  if (response.electrons_per_irradiance.cols() != 1) {
    fail("reflex: the chip sees {} bands of light; the fingertip's LEDs are of one colour, in one band",
         response.electrons_per_irradiance.cols());
  }
  const double largest = (1 << chip.imager.bits) - 1 - chip.imager.black_level_DN;
  return largest / chip.imager.gain_DN_per_e / response.electrons_per_irradiance(0, 0);
}

struct Refinement {
  const ReflexPathLight::Picture& picture;
  const ReflexPathLightSettings& settings;
  double full;
  std::map<double, cv::Mat> made;
  double largest_off = 0.0;

  const cv::Mat& make(double parameter) {
    if (static_cast<int>(made.size()) >= settings.most_pictures) {
      fail("reflex: {} pictures aren't enough for a motion; allowed is a coarser one than {} of the full light",
           settings.most_pictures, settings.allowed);
    }
    cv::Mat light = picture(parameter);
    if (light.type() != CV_32FC1 || light.rows != kChipSide || light.cols != kChipSide) {
      fail("reflex: a picture of {}x{} pixels and OpenCV type {}; it must have {}x{} of type {}", light.cols,
           light.rows, light.type(), kChipSide, kChipSide, CV_32FC1);
    }
    return made.emplace(parameter, std::move(light)).first->second;
  }

  void refine(double from, double to) {
    if (to - from < 2.0 * settings.least_step) return;
    const double middle = 0.5 * (from + to);
    cv::Mat straight;
    cv::addWeighted(made.at(from), 0.5, made.at(to), 0.5, 0.0, straight);
    const double off = cv::norm(straight, make(middle), cv::NORM_INF) / full;
    if (off <= settings.allowed) {
      largest_off = std::max(largest_off, off);
      return;
    }
    refine(from, middle);
    refine(middle, to);
  }
};

}  // namespace

ReflexPathLight::ReflexPathLight(const Picture& picture, std::span<const double> corners,
                                 const render::MotionChipSettings& chip, const ReflexPathLightSettings& settings) {
  check(chip);
  const bool rising = std::adjacent_find(corners.begin(), corners.end(), std::greater_equal<>()) == corners.end();
  if (corners.size() < 2 || !rising || !std::isfinite(corners.front()) || !std::isfinite(corners.back())) {
    fail("reflex: a motion's corners must rise and be two at least; these are {}", corners.size());
  }
  Refinement all{picture, settings, full_light(chip), {}, 0.0};
  for (const double corner : corners) all.make(corner);
  for (std::size_t k = 1; k < corners.size(); ++k) all.refine(corners[k - 1], corners[k]);
  for (auto& [parameter, light] : all.made) {
    parameters_.push_back(parameter);
    pictures_.push_back(std::move(light));
  }
  largest_off_ = all.largest_off;
}

void ReflexPathLight::light_at(double parameter, cv::Mat& light) const {
  const auto above = std::upper_bound(parameters_.begin() + 1, parameters_.end() - 1, parameter);
  const auto k = static_cast<std::size_t>(above - parameters_.begin()) - 1;
  const double part = std::clamp((parameter - parameters_[k]) / (parameters_[k + 1] - parameters_[k]), 0.0, 1.0);
  cv::addWeighted(pictures_[k], 1.0 - part, pictures_[k + 1], part, 0.0, light);
}

std::vector<ChipStatistics> record_statistics(const ReflexPathLight& path_light, const ReflexMotion& motion,
                                              render::MotionChip& chip, int frames, int every) {
  if (every < 1) fail("reflex: one in {} frames is asked for; allowed is from 1", every);
  std::vector<ChipStatistics> record;
  cv::Mat light;
  for (int k = 0; k < frames; ++k) {
    path_light.light_at(motion(chip.next_middle_s()), light);
    const ChipStatistics statistics = chip.expose(light).statistics;
    if ((k + 1) % every == 0) record.push_back(statistics);
  }
  return record;
}

std::vector<GrabbedImage> record_images(const ReflexPathLight& path_light, const ReflexMotion& motion,
                                        render::MotionChip& chip, int images) {
  std::vector<GrabbedImage> record;
  render::PixelGrabber grabber;
  cv::Mat light;
  while (static_cast<int>(record.size()) < images) {
    path_light.light_at(motion(chip.next_middle_s()), light);
    if (auto image = grabber.add(chip.expose(light))) record.push_back(std::move(*image));
  }
  return record;
}

}  // namespace touchstone::lab
