#include "sim/relief/leaf_relief.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/units.h"

namespace touchstone::sim {
namespace {

constexpr double kPointsAVein = 8.0;   // across the narrowest
constexpr double kNarrowest_mm = 0.2;  // with the largest leaf this keeps the map below 100 MB
constexpr double kLargest_mm = 100.0;

/// The section of a vein of height 1 at this distance from its middle.
double section(double distance, double width) {
  return distance >= 0.5 * width ? 0.0 : 0.5 * (1.0 + std::cos(2.0 * kPi * distance / width));
}

}  // namespace

void fields(YamlReader& in, LeafRelief& leaf) {
  in.required("size_mm", leaf.size_mm, Allowed::above_up_to(0.0, kLargest_mm));
  in.required("midrib_height_um", leaf.midrib_height_um, Allowed::above_up_to(0.0, 5000.0));
  in.required("midrib_width_mm", leaf.midrib_width_mm, Allowed::within(kNarrowest_mm, 20.0));
  in.required("vein_height_um", leaf.vein_height_um, Allowed::within(0.0, 5000.0));
  in.required("vein_width_mm", leaf.vein_width_mm, Allowed::within(kNarrowest_mm, 20.0));
  in.required("vein_pitch_mm", leaf.vein_pitch_mm, Allowed::within(leaf.vein_width_mm, kLargest_mm));
  in.optional("vein_angle_deg", leaf.vein_angle_deg, Allowed::within(20.0, 90.0));
}

double finest_detail(const LeafRelief& leaf) {
  return std::min(leaf.midrib_width_mm, leaf.vein_width_mm);
}

fem::ReliefMap relief_map(const LeafRelief& leaf) {
  const double wanted = finest_detail(leaf) / kPointsAVein;
  const int nx = std::max(2, static_cast<int>(std::ceil(leaf.size_mm.x() / wanted)));
  const int ny = std::max(2, static_cast<int>(std::ceil(leaf.size_mm.y() / wanted)));
  const Eigen::Vector2d spacing(leaf.size_mm.x() / nx, leaf.size_mm.y() / ny);
  const Eigen::Vector2d first = 0.5 * (spacing - leaf.size_mm);
  const double cosine = std::cos(leaf.vein_angle_deg * kRadiansPerDegree);
  const double sine = std::sin(leaf.vein_angle_deg * kRadiansPerDegree);
  const double midrib = leaf.midrib_height_um / kMicrometresPerMillimetre;
  const double vein = leaf.vein_height_um / kMicrometresPerMillimetre;
  std::vector<float> heights;
  heights.reserve(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny));
  for (int j = 0; j < ny; ++j) {
    const double aside = std::abs(first.y() + spacing.y() * j);
    for (int i = 0; i < nx; ++i) {
      // Where the side vein through this place left the midrib, and how far along the midrib the next root is.
      const double root = first.x() + spacing.x() * i - aside * cosine / sine;
      const double beside = std::abs(std::remainder(root, leaf.vein_pitch_mm)) * sine;
      const double thinned = vein * std::max(0.0, 1.0 - aside / (0.5 * leaf.size_mm.y()));
      heights.push_back(static_cast<float>(
          std::max(midrib * section(aside, leaf.midrib_width_mm), thinned * section(beside, leaf.vein_width_mm))));
    }
  }
  return {nx, ny, first, spacing, {false, false}, std::move(heights)};
}

}  // namespace touchstone::sim
