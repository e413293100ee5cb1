#include "sim/relief/plastic_relief.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/units.h"
#include "sim/relief/relief_cells.h"
#include "sim/relief/relief_tile.h"

namespace touchstone::sim {
namespace {

constexpr double kMicrometre = 1e-3;
enum Part : std::uint64_t { kPoints, kPebbles, kFinish };

}  // namespace

void fields(YamlReader& in, PlasticRelief& relief) {
  in.required("pebble_mm", relief.pebble_mm, Allowed::within(0.1, 4.0));
  in.optional("spread", relief.spread, Allowed::within(0.0, 0.5));
  in.required("valley_mm", relief.valley_mm, Allowed::above_up_to(0.0, relief.pebble_mm));
  in.required("depth_um", relief.depth_um, Allowed::above_up_to(0.0, 1000.0));
  in.optional("finish_um", relief.finish_um, Allowed::within(0.0, 100.0));
  in.optional("finish_mm", relief.finish_mm, Allowed::within(0.02, 2.0));
  in.optional("size_mm", relief.size_mm, Allowed::within(4.0 * relief.pebble_mm, 60.0));
  in.optional("seed", relief.seed);
}

fem::ReliefMap relief_map(const PlasticRelief& relief) {
  constexpr double kCloseness = 0.45;  // leather's pebbles are of very unequal sizes
  ReliefTile tile(Eigen::Vector2d::Constant(relief.size_mm), 0.0F);
  RandomStream random = relief_stream(relief.seed, kPoints);
  const double radius = 0.5 * relief.pebble_mm;
  std::vector<CellPoint> points;
  for (const Eigen::Vector2d& place : scatter(tile.size(), 1.0 / (kPi * radius * radius), kCloseness, random)) {
    const double own = std::max(0.2, 1.0 + relief.spread * random.normal());
    points.push_back({place, radius * radius * (own * own - 1.0)});
  }
  const CellDiagram pebbles(tile.size(), std::move(points));
  RandomStream own_heights = relief_stream(relief.seed, kPebbles);
  std::vector<double> heights(pebbles.points().size());
  for (double& height : heights) height = 1.0 + 0.15 * own_heights.normal();
  for (int j = 0; j < tile.ny; ++j) {
    for (int i = 0; i < tile.nx; ++i) {
      const CellPlace place = pebbles.at({i * tile.spacing.x(), j * tile.spacing.y()});
      const double rise = 1.0 - std::exp(-std::pow(2.0 * place.wall / relief.valley_mm, 2));
      tile.heights[tile.at(i, j)] = static_cast<float>(relief.depth_um * kMicrometre * heights[place.cell] * rise);
    }
  }
  tile.heights = blurred(tile, 0.15 * relief.valley_mm);  // where three valleys meet, corners are round
  RandomStream finish = relief_stream(relief.seed, kFinish);
  roughen(tile, relief.finish_um * kMicrometre, relief.finish_mm, finish);
  return tile.map();
}

double finest_detail(const PlasticRelief&) {
  return kTileDetail;
}

}  // namespace touchstone::sim
