#include "render/direct/wide_lamps.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace touchstone::render {
namespace {

constexpr double kCells = 48.0;     // that luminous rectangles are cut into, all together: as many beams
constexpr double kWideCell = 0.06;  // of a lamp's distance from the gel's middle: smaller cells are of no use
constexpr double kGrowth = 1.05;    // of the cells, until they are few enough

/// A luminous rectangle's cells along its width and height, of `side` mm at most.
Eigen::Array2i cells_of(const AreaLamp& lamp, double side) {
  side = std::max(side, kWideCell * lamp.centre.norm());
  return Eigen::Array2d(lamp.width / side, lamp.height / side).ceil().cast<int>().max(1);
}

}  // namespace

void cut_wide_lamps(std::vector<Lamp>& lamps) {
  double side = 0.0;  // mm
  int others = 0;
  for (const Lamp& lamp : lamps) {
    if (std::holds_alternative<GuideLamp>(lamp)) return;  // they are cut into beams as far as beams go
    const auto* area = std::get_if<AreaLamp>(&lamp);
    if (area == nullptr) {
      ++others;
    } else {
      side = std::max(side, 0.02 * std::max(area->width, area->height));
    }
  }
  if (side == 0.0) return;
  const auto count = [&] {
    double sum = others;
    for (const Lamp& lamp : lamps) {
      if (const auto* area = std::get_if<AreaLamp>(&lamp)) sum += cells_of(*area, side).cast<double>().prod();
    }
    return sum;
  };
  // As many lamps as there are is the least that this comes to.
  while (count() > std::max(kCells, static_cast<double>(lamps.size()))) side *= kGrowth;
  std::vector<Lamp> cut;
  for (const Lamp& lamp : lamps) {
    const auto* area = std::get_if<AreaLamp>(&lamp);
    if (area == nullptr) {
      cut.push_back(lamp);
      continue;
    }
    const Eigen::Array2i cells = cells_of(*area, side);
    const auto [across, up] = sides_of(*area);
    AreaLamp cell = *area;
    cell.width /= cells.x();
    cell.height /= cells.y();
    cell.power_W /= static_cast<double>(cells.prod());
    for (int row = 0; row < cells.y(); ++row) {
      for (int column = 0; column < cells.x(); ++column) {
        cell.centre = area->centre + (column - 0.5 * (cells.x() - 1)) * cell.width * across +
                      (row - 0.5 * (cells.y() - 1)) * cell.height * up;
        cut.emplace_back(cell);
      }
    }
  }
  lamps = std::move(cut);
}

}  // namespace touchstone::render
