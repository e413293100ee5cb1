#include "sim/relief/foam_relief.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/units.h"
#include "sim/relief/relief_cells.h"
#include "sim/relief/relief_tile.h"

namespace touchstone::sim {
namespace {

constexpr double kMicrometre = 1e-3;
enum Part : std::uint64_t { kPoints, kCells, kRoughness, kWalls = 16 };

/// What a cell has of its own.
struct Cell {
  double depth = 1.0;  // of its pit or dome, as a factor
};

CellDiagram cells_of(const FoamRelief& relief, const Eigen::Vector2d& size) {
  constexpr double kCloseness = 0.6;
  RandomStream random = relief_stream(relief.seed, kPoints);
  const double radius = 0.5 * relief.cell_mm;
  std::vector<CellPoint> points;
  for (const Eigen::Vector2d& place : scatter(size, 1.0 / (kPi * radius * radius), kCloseness, random)) {
    // In a diagram of powers a cell's own radius squared is its weight.
    const double own = std::max(0.2, 1.0 + relief.spread * random.normal());
    points.push_back({place, radius * radius * (own * own - 1.0)});
  }
  return {size, std::move(points)};
}

/// A number from 0 to 1 that both cells of a wall agree on.
double wall_chance(const FoamRelief& relief, const CellPlace& place) {
  const auto low = static_cast<std::uint64_t>(std::min(place.cell, place.neighbour));
  const auto high = static_cast<std::uint64_t>(std::max(place.cell, place.neighbour));
  return relief_stream(relief.seed, kWalls + (low << 24) + high).uniform();
}

double open_height(const FoamRelief& relief, const CellPlace& place, const Cell& cell) {
  const double half = 0.5 * relief.wall_mm;
  const double chance = wall_chance(relief, place);
  // Struts: round on top, wider towards the corners where a third cell is near (Plateau borders).
  const double strut = half * (1.0 + 1.2 * std::exp(-place.second_wall / (2.0 * half)));
  const double share = place.wall / strut;
  const double pit = -cell.depth * (1.0 - std::exp(-std::max(0.0, place.wall - 0.5 * strut) / (0.25 * relief.cell_mm)));
  const double sunk = chance < relief.openness ? 0.75 * std::min(1.0, place.second_wall / relief.wall_mm) : 0.0;
  const double top = -cell.depth * sunk - 0.1 * chance;
  if (share >= 1.0) return std::min(pit, -0.3);
  return std::max(top - 0.3 * (1.0 - std::sqrt(1.0 - share * share)), pit);
}

double closed_height(const FoamRelief& relief, const CellPlace& place, const Cell& cell) {
  const double half = 0.5 * relief.wall_mm;
  const double inside = std::max(0.0, place.wall - half) / (0.45 * relief.cell_mm);
  const double bowl = inside < 1.0 ? std::sqrt(1.0 - (1.0 - inside) * (1.0 - inside)) : 1.0;
  const double rounding = 0.15 * std::pow(std::min(1.0, place.wall / half), 2);
  return -rounding - cell.depth * bowl;
}

double bead_height(const FoamRelief& relief, const CellPlace& place, const Cell& cell) {
  const double inside = std::min(1.0, place.wall / (0.45 * relief.cell_mm));
  const double dome = std::sqrt(1.0 - (1.0 - inside) * (1.0 - inside));
  const double groove = std::exp(-std::pow(place.wall / (0.5 * relief.wall_mm), 2));
  return 0.4 * (cell.depth - 1.0) + dome - 0.5 * groove;
}

double height_of(const FoamRelief& relief, const CellPlace& place, const Cell& cell) {
  switch (relief.kind) {
    case FoamKind::closed:
      return closed_height(relief, place, cell);
    case FoamKind::beads:
      return bead_height(relief, place, cell);
    default:
      return open_height(relief, place, cell);
  }
}

}  // namespace

EnumNames<FoamKind> enum_names(FoamKind) {
  return {{"open", FoamKind::open}, {"closed", FoamKind::closed}, {"beads", FoamKind::beads}};
}

void fields(YamlReader& in, FoamRelief& relief) {
  in.required("kind", relief.kind);
  in.required("cell_mm", relief.cell_mm, Allowed::within(0.08, 8.0));
  in.optional("spread", relief.spread, Allowed::within(0.0, 0.5));
  in.required("wall_mm", relief.wall_mm, Allowed::within(0.01, 4.0));
  in.required("depth_um", relief.depth_um, Allowed::above_up_to(0.0, 3000.0));
  if (relief.kind == FoamKind::open) in.optional("openness", relief.openness, Allowed::within(0.0, 1.0));
  in.optional("roughness_um", relief.roughness_um, Allowed::within(0.0, 200.0));
  in.optional("roughness_mm", relief.roughness_mm, Allowed::within(0.02, 2.0));
  in.optional("unevenness_um", relief.unevenness_um, Allowed::within(0.0, 1000.0));
  in.optional("size_mm", relief.size_mm, Allowed::within(4.0, 60.0));
  in.optional("seed", relief.seed);
  if (relief.wall_mm >= relief.cell_mm) {
    fail_at(in.where("wall_mm"), "walls of {} mm leave nothing of cells of {} mm", relief.wall_mm, relief.cell_mm);
  }
  if (4.0 * relief.cell_mm > relief.size_mm) {
    fail_at(in.where("cell_mm"), "cells of {} mm are too large for a period of {} mm; at most a quarter is allowed",
            relief.cell_mm, relief.size_mm);
  }
}

fem::ReliefMap relief_map(const FoamRelief& relief) {
  ReliefTile tile(Eigen::Vector2d::Constant(relief.size_mm), 0.0F);
  const CellDiagram diagram = cells_of(relief, tile.size());
  RandomStream random = relief_stream(relief.seed, kCells);
  std::vector<Cell> cells(diagram.points().size());
  for (Cell& cell : cells) cell.depth = std::max(0.3, 1.0 + 0.3 * random.normal());
  const double depth = relief.depth_um * kMicrometre;
  for (int j = 0; j < tile.ny; ++j) {
    for (int i = 0; i < tile.nx; ++i) {
      const CellPlace place = diagram.at({i * tile.spacing.x(), j * tile.spacing.y()});
      tile.heights[tile.at(i, j)] = static_cast<float>(depth * height_of(relief, place, cells[place.cell]));
    }
  }
  tile.heights = blurred(tile, 0.5 * kTilePitch);  // no cut is sharper than that
  RandomStream roughness = relief_stream(relief.seed, kRoughness);
  roughen(tile, relief.roughness_um * kMicrometre, relief.roughness_mm, roughness);
  roughen(tile, relief.unevenness_um * kMicrometre, 2.0 * relief.cell_mm, roughness);
  return tile.map();
}

double finest_detail(const FoamRelief&) {
  return kTileDetail;
}

}  // namespace touchstone::sim
