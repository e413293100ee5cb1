#include "sensors/heights/darkness_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/error.h"

namespace touchstone::sensors {

double DarknessCurve::last_slope() const {
  const auto zero = static_cast<std::size_t>(-first);
  TS_ASSERT(first <= 0 && heights_mm.size() > zero + 1);
  const std::size_t last = heights_mm.size() - 1;
  const std::size_t part = std::max<std::size_t>(1, (last - zero) / 4);
  return (heights_mm[last] - heights_mm[last - part]) / (static_cast<double>(part) * kStep);
}

double DarknessCurve::height_at(double darkening) const {
  const double place = std::max(darkening / kStep - first, 0.0);
  const std::size_t last = heights_mm.size() - 1;
  if (place >= static_cast<double>(last)) return deepest_mm() + last_slope() * (darkening - darkest());
  const auto knot = static_cast<std::size_t>(place);
  const double part = place - static_cast<double>(knot);
  return (1.0 - part) * heights_mm[knot] + part * heights_mm[knot + 1];
}

std::string fault_of(const DarknessModel& model) {
  if (!(model.mm_per_px > 0.0) || !std::isfinite(model.mm_per_px)) {
    return fmt::format("mm_per_px is {}; it must be above 0", model.mm_per_px);
  }
  const cv::Mat& mean = model.rest.mean;
  if (mean.empty() || mean.type() != CV_32FC1) return "the rest picture isn't a picture of one channel";
  if (!cv::checkRange(mean, true, nullptr, 0.0, 255.001)) return "the rest picture has values out of 0 to 255";
  if (model.rest.channels != 1 && model.rest.channels != 3) return "the frames have neither 1 nor 3 channels";
  if (model.rest.frames < 1) return "the rest picture is of no frame";
  if (!(model.darkening.smoothing_px >= 0.0 && model.darkening.smoothing_px <= kMostSmoothing_px)) {
    return fmt::format("smoothing_px is {}; it must be 0 to {}", model.darkening.smoothing_px, kMostSmoothing_px);
  }

  const DarknessCurve& curve = model.curve;
  const auto knots = static_cast<int>(curve.heights_mm.size());
  if (knots < 2 || knots > DarknessCurve::kMostKnots) {
    return fmt::format("the curve has {} knots; 2 to {} are allowed", knots, DarknessCurve::kMostKnots);
  }
  if (curve.first > 0 || curve.first + knots < 2) return "the curve doesn't reach from darkening 0 upwards";
  if (curve.darkest() > 1.0) return "the curve reaches beyond darkening 1";
  if (curve.spread_mm.size() != curve.heights_mm.size()) return "the curve's spread doesn't fit its knots";
  const auto sound = [](double number) { return std::isfinite(number) && std::abs(number) <= 1000.0; };
  if (!std::all_of(curve.heights_mm.begin(), curve.heights_mm.end(), sound) ||
      !std::all_of(curve.spread_mm.begin(), curve.spread_mm.end(), sound)) {
    return "the curve has numbers that aren't finite or are beyond 1000 mm";
  }
  if (!std::is_sorted(curve.heights_mm.begin(), curve.heights_mm.end())) return "the curve falls";
  if (curve.heights_mm[static_cast<std::size_t>(-curve.first)] != 0.0) return "the curve isn't 0 at darkening 0";
  if (!(curve.deepest_mm() > 0.0)) return "the curve doesn't rise above 0";
  if (model.presses < 1) return "it is made of no press";
  return {};
}

}  // namespace touchstone::sensors
