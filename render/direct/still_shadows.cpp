// Walls that stand about a moving sheet: which lamps they hide is found once, at some heights of the sheet.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "render/direct/direct_parts.h"
#include "render/direct/grid_batches.h"
#include "render/scene/film_screen.h"
#include "render/scene/sheet_index.h"

namespace touchstone::render {
namespace {

constexpr int kAround = 2;  // grid points
constexpr int kLevels = 7;
constexpr double kLevelStep_mm = 0.25;
constexpr double kOutermost_mm = kLevelStep_mm;  // the gel rises beside a contact; the second is that of rest

bool is_curved(const Surface& sheet) {
  constexpr double kFlat_mm = 0.05;
  const auto [low, high] = std::ranges::minmax(sheet.mesh.vertices, {}, [](const Eigen::Vector3d& v) { return v.z(); });
  return high.z() - low.z() > kFlat_mm;
}

/// Shares of 255 of what the points of a square round each see. Shadow rays of 4 x 4 points beside each other go to
/// sixteen parts of a beam; with these weights each part counts alike.
std::vector<std::uint8_t> shares_around(const std::vector<DirectBatch::Visibility>& seen, const ImageGrid& grid,
                                        int lamps) {
  constexpr std::array<float, 2 * kAround + 1> kWeights = {0.5f, 1.0f, 1.0f, 1.0f, 0.5f};
  std::vector<std::uint8_t> shares(seen.size() * static_cast<std::size_t>(lamps), 255);
  tbb::parallel_for(0, grid.rows, [&](int row) {
    std::array<float, kMostDirectLamps> open, known;
    for (int column = 0; column < grid.columns; ++column) {
      open.fill(0.0f);
      known.fill(0.0f);
      for (int j = std::max(row - kAround, 0); j <= std::min(row + kAround, grid.rows - 1); ++j) {
        for (int i = std::max(column - kAround, 0); i <= std::min(column + kAround, grid.columns - 1); ++i) {
          const DirectBatch::Visibility& one = seen[static_cast<std::size_t>(j) * grid.columns + i];
          const float weight = kWeights[j - row + kAround] * kWeights[i - column + kAround];
          for (std::uint64_t rest = one.open | one.hidden; rest != 0; rest &= rest - 1) {
            const int lamp = std::countr_zero(rest);
            known[lamp] += weight;
            if ((one.open >> lamp & 1u) != 0) open[lamp] += weight;
          }
        }
      }
      std::uint8_t* const here = shares.data() + (static_cast<std::size_t>(row) * grid.columns + column) * lamps;
      for (int lamp = 0; lamp < lamps; ++lamp) {
        if (known[lamp] > 0.0f) here[lamp] = static_cast<std::uint8_t>(255.0f * open[lamp] / known[lamp] + 0.5f);
      }
    }
  });
  return shares;
}

}  // namespace

Scene DirectRenderer::Parts::still_things(const Scene& rest) {
  Scene still;
  still.environment = rest.environment;
  still.surfaces.reserve(rest.surfaces.size());
  still.surfaces.push_back({{}, rest.surfaces[0].material});
  still.surfaces.insert(still.surfaces.end(), rest.surfaces.begin() + 1, rest.surfaces.end());
  still.balls = rest.balls;
  return still;
}

bool DirectRenderer::Parts::is_lone_sheet(const Scene& rest) const {
  if (!horizon_settings) return false;
  if (is_sheet_alone(fixture.bearings, rest)) return true;
  // A sheet and its frame; of more things some may move. Of a flat sheet few places are in doubt, and rays are as
  // quick.
  return rest.surfaces.size() == 2 && rest.balls.empty() && !is_film(rest.surfaces[1]) && is_curved(rest.surfaces[0]) &&
         SheetHorizons::find(rest.surfaces[0].mesh, *horizon_settings).has_value();
}

StillShadows DirectRenderer::Parts::find_still_shadows(const Scene& rest) {
  StillShadows found{ShadowReach(fixture.bearings, still_things(rest), false), {}};
  std::vector<DirectMaterial> materials;
  for (const Surface& surface : rest.surfaces) materials.push_back(direct_material(surface.material, conductors));
  Surface sheet = rest.surfaces[0];
  const float inwards = horizon_settings->side;
  for (int level = 0; level < kLevels; ++level) {
    const double by = double(inwards) * (level * kLevelStep_mm - kOutermost_mm);
    for (std::size_t v = 0; v < sheet.mesh.vertices.size(); ++v) {
      sheet.mesh.vertices[v].z() = rest.surfaces[0].mesh.vertices[v].z() + by;
    }
    found.levels.push_back(find_still_level(found.reach, sheet, materials));
  }
  return found;
}

StillShadows::Level DirectRenderer::Parts::find_still_level(const ShadowReach& reach, const Surface& sheet_of,
                                                            const std::vector<DirectMaterial>& materials) const {
  const std::size_t points = static_cast<std::size_t>(rays.grid.columns) * rays.grid.rows;
  StillShadows::Level level;
  level.z.assign(points, std::numeric_limits<float>::infinity());
  std::vector<DirectBatch::Visibility> visible(points);
  const SheetIndex sheet(sheet_of, seen_box);
  const DirectFrame frame{fixture, tree, &sheet, &reach, nullptr, materials};
  for_batches(rays, frame, [&](DirectBatch& batch, int first, int packets, DirectCounts& counts) {
    batch.intersect({rays.packets.data() + first, static_cast<std::size_t>(packets)}, counts);
    batch.cast_shadows(counts);
    for_lanes_on_grid(rays, first, packets, [&](int lane, int row, int column) {
      const float* const place = batch.lit_sheet_place(lane);
      if (place == nullptr) return;
      const std::size_t point = static_cast<std::size_t>(row) * rays.grid.columns + column;
      level.z[point] = place[2];
      visible[point] = batch.visibility(lane);
    });
  });
  level.shares = shares_around(visible, rays.grid, fixture.field.beam_count());
  return level;
}

void DirectRenderer::Parts::take_still(DirectBatch& batch, int first_tile, int packets) const {
  for_lanes_on_grid(rays, first_tile, packets, [&](int lane, int row, int column) {
    take_still(batch, lane, static_cast<std::size_t>(row) * rays.grid.columns + column);
  });
}

void DirectRenderer::Parts::take_still(DirectBatch& batch, int lane, std::size_t point) const {
  const float* const place = batch.lit_sheet_place(lane);
  if (place == nullptr) return;
  const std::size_t first_share = point * static_cast<std::size_t>(fixture.field.beam_count());
  for (std::size_t n = 0; n + 1 < still->levels.size(); ++n) {
    const StillShadows::Level& one = still->levels[n];
    const StillShadows::Level& other = still->levels[n + 1];
    const float apart = other.z[point] - one.z[point];
    if (!std::isfinite(apart) || apart == 0.0f) continue;
    const float part = (place[2] - one.z[point]) / apart;
    if (!(part >= 0.0f && part <= 1.0f)) continue;
    batch.take_shares(lane, one.shares.data() + first_share, other.shares.data() + first_share, part);
    return;
  }
}

}  // namespace touchstone::render
