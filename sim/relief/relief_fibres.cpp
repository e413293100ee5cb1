#include "sim/relief/relief_fibres.h"

#include <cmath>

#include "core/random_pairs.h"
#include "core/units.h"

namespace touchstone::sim {
namespace {

constexpr double kStep = 0.75 * kTilePitch;  // along a fibre

}  // namespace

void lay_fibres(ReliefTile& layer, const Fibres& fibres, const std::function<double(double)>& level,
                RandomStream& random) {
  const Eigen::Vector2d size = layer.size();
  const int count = static_cast<int>(std::lround(fibres.per_mm2 * size.x() * size.y()));
  for (int k = 0; k < count; ++k) {
    Eigen::Vector2d place = size.cwiseProduct(uniform_pair(random));
    const double length = fibres.length_mm * (0.5 + random.uniform());
    const double radius = 0.5 * fibres.diameter_mm * (0.7 + 0.6 * random.uniform());
    double direction = 2.0 * kPi * random.uniform();
    // Squeezing the circle of directions towards y.
    direction = std::atan2(std::sin(direction), (1.0 - fibres.alignment) * std::cos(direction));
    double curvature = fibres.curl_per_mm * random.normal();
    const double base = level(static_cast<double>(k) / count);
    const double reach = std::max(radius, 0.5 * kTilePitch);  // a thin one still shows on the points below it
    const int steps = std::max(1, static_cast<int>(length / kStep));
    for (int step = 0; step < steps; ++step) {
      layer.raise(place, reach, [&](const Eigen::Vector2d& offset) {
        const double rest = reach * reach - offset.squaredNorm();
        return rest > 0.0 ? base + radius * (1.0 + std::sqrt(rest) / reach) : base;
      });
      place += kStep * Eigen::Vector2d(std::cos(direction), std::sin(direction));
      direction += kStep * curvature;
      // The curvature forgets itself over a third of a millimetre.
      const double kept = std::exp(-kStep / 0.33);
      curvature = kept * curvature + std::sqrt(1.0 - kept * kept) * fibres.curl_per_mm * random.normal();
    }
  }
}

void add_fuzz(ReliefTile& tile, const Fibres& fibres, RandomStream& random) {
  if (fibres.per_mm2 == 0.0) return;
  ReliefTile layer(tile.size(), 0.0F);
  lay_fibres(
      layer, fibres, [](double) { return 0.0; }, random);
  for (std::size_t k = 0; k < tile.heights.size(); ++k) tile.heights[k] += layer.heights[k];
}

}  // namespace touchstone::sim
