#include "sim/relief/wood_relief.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/random_pairs.h"
#include "core/units.h"
#include "sim/relief/relief_tile.h"

namespace touchstone::sim {
namespace {

constexpr double kMicrometre = 1e-3;
enum Part : std::uint64_t { kRings, kVessels, kFibres };

/// Where a place lies between the beginning of early wood, 0, and the end of late wood, 1.
class Rings {
 public:
  Rings(const WoodRelief& relief, const Eigen::Vector2d& size, RandomStream& random)
      : ring_(relief.ring_mm), sway_(random_wave(size.y(), 0.25 * size.y(), random)) {}

  double at(double x, double y) const {
    const double place = x / ring_ + 0.15 * sway_(y);
    return place - std::floor(place);
  }

 private:
  double ring_;
  std::function<double(double)> sway_;
};

/// Late wood grows in over the second half of the year and ends at once.
double lateness(double year) {
  const double grown = std::clamp((year - 0.4) / 0.5, 0.0, 1.0);
  const double ended = std::clamp((1.0 - year) / 0.06, 0.0, 1.0);
  return grown * grown * (3.0 - 2.0 * grown) * ended;
}

void cut_vessels(const WoodRelief& relief, const Rings& rings, ReliefTile& tile) {
  RandomStream random = relief_stream(relief.seed, kVessels);
  const Eigen::Vector2d size = tile.size();
  // Places outside of early wood are dropped by chance, so more are drawn.
  const double kept = 1.0 - 0.7 * relief.ring_porosity;
  const int count = static_cast<int>(std::lround(relief.vessels_per_mm2 * size.x() * size.y() / kept));
  for (int k = 0; k < count; ++k) {
    const Eigen::Vector2d middle = size.cwiseProduct(uniform_pair(random));
    const double half_length = 0.5 * relief.vessel_length_mm * (0.4 + 1.2 * random.uniform());
    const double half_width = 0.5 * relief.vessel_um * kMicrometre * std::max(0.4, 1.0 + 0.25 * random.normal());
    const double depth = relief.vessel_depth_um * kMicrometre * std::max(0.2, 1.0 + 0.3 * random.normal());
    const double lean = 0.02 * random.normal();
    const bool stays = rings.at(middle.x(), middle.y()) < 0.3 || random.uniform() >= relief.ring_porosity;
    if (!stays) continue;
    const double reach = std::max(half_width, kTilePitch) + std::abs(lean) * half_length;
    const int steps = std::max(1, static_cast<int>(std::ceil(2.0 * half_length / tile.spacing.y())));
    for (int step = 0; step <= steps; ++step) {
      const double along = -half_length + 2.0 * half_length * step / steps;
      const double end = 1.0 - std::pow(along / half_length, 6);  // a groove with round ends
      const Eigen::Vector2d centre = middle + Eigen::Vector2d(lean * along, along);
      const int j = static_cast<int>(std::floor(centre.y() / tile.spacing.y()));
      const int left = static_cast<int>(std::ceil((centre.x() - reach) / tile.spacing.x()));
      const int right = static_cast<int>(std::floor((centre.x() + reach) / tile.spacing.x()));
      for (int i = left; i <= right; ++i) {
        const double share = (i * tile.spacing.x() - centre.x()) / half_width;
        if (std::abs(share) >= 1.0) continue;
        float& height = tile.heights[tile.at(i, j)];
        height = std::min(height, static_cast<float>(-depth * std::max(0.0, end) * std::sqrt(1.0 - share * share)));
      }
    }
  }
}

}  // namespace

void fields(YamlReader& in, WoodRelief& relief) {
  in.required("ring_mm", relief.ring_mm, Allowed::within(0.2, 10.0));
  in.required("ring_um", relief.ring_um, Allowed::within(0.0, 500.0));
  in.required("vessels_per_mm2", relief.vessels_per_mm2, Allowed::within(0.0, 100.0));
  if (relief.vessels_per_mm2 > 0.0) {
    in.optional("ring_porosity", relief.ring_porosity, Allowed::within(0.0, 1.0));
    in.required("vessel_um", relief.vessel_um, Allowed::within(10.0, 1000.0));
    in.required("vessel_length_mm", relief.vessel_length_mm, Allowed::within(0.1, 10.0));
    in.required("vessel_depth_um", relief.vessel_depth_um, Allowed::above_up_to(0.0, 1000.0));
  }
  in.optional("fibre_um", relief.fibre_um, Allowed::within(0.0, 100.0));
  in.optional("fibre_mm", relief.fibre_mm, Allowed::within(0.02, 1.0));
  in.optional("fibre_length_mm", relief.fibre_length_mm, Allowed::within(0.1, 10.0));
  in.optional("size_mm", relief.size_mm, Allowed::within(4.0, 60.0));
  in.optional("seed", relief.seed);
}

fem::ReliefMap relief_map(const WoodRelief& relief) {
  // A whole number of years along x.
  const double width = relief.ring_mm * std::ceil(relief.size_mm / relief.ring_mm);
  ReliefTile tile({width, relief.size_mm}, 0.0F);
  RandomStream random = relief_stream(relief.seed, kRings);
  const Rings rings(relief, tile.size(), random);
  cut_vessels(relief, rings, tile);
  RandomStream fibres = relief_stream(relief.seed, kFibres);
  const std::vector<float> ridges = smooth_field(tile, {relief.fibre_mm, relief.fibre_length_mm}, fibres);
  for (int j = 0; j < tile.ny; ++j) {
    for (int i = 0; i < tile.nx; ++i) {
      const double late = lateness(rings.at(i * tile.spacing.x(), j * tile.spacing.y()));
      const std::size_t at = tile.at(i, j);
      // Late wood's thick walls are cut more smoothly.
      const double ridge = relief.fibre_um * ridges[at] * (1.0 - 0.5 * late);
      tile.heights[at] += static_cast<float>(kMicrometre * (relief.ring_um * late + ridge));
    }
  }
  return tile.map();
}

double finest_detail(const WoodRelief&) {
  return kTileDetail;
}

}  // namespace touchstone::sim
