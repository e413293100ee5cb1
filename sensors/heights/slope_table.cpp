#include "sensors/heights/slope_table.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "sensors/numerics/quantile.h"

namespace touchstone::sensors {
namespace {

constexpr float kMargin_DN = 8.0F;    // around the calibration's colours
constexpr float kGrowth = 1.05F;      // of the step, until the table is small enough
constexpr double kRestPixels = 50.0;  // as which the certainty counts that the colour of rest is flat

/// Sums of deviations over the cells of one level; each level's cells are twice as wide as those of the one before.
struct Level {
  std::array<int, 3> cells{};
  std::vector<Eigen::Vector3f> sums;  // deviation of slope u, of slope v; weight. Later: mean deviation, weight

  Level(const std::array<int, 3>& size)
      : cells(size),
        sums(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2]),
             Eigen::Vector3f::Zero()) {}

  std::size_t index(int b, int g, int r) const {
    return (static_cast<std::size_t>(b) * static_cast<std::size_t>(cells[1]) + static_cast<std::size_t>(g)) *
               static_cast<std::size_t>(cells[2]) +
           static_cast<std::size_t>(r);
  }
};

/// The two coarse cells beside the centre of a fine one along one axis, and the weight of the second.
struct Between {
  int low, high;
  float share;
};
Between between_cells(int fine, int coarse_cells) {
  const float at = std::clamp((static_cast<float>(fine) - 0.5F) / 2.0F, 0.0F, static_cast<float>(coarse_cells - 1));
  const int low = std::min(static_cast<int>(at), coarse_cells - 1);
  return {low, std::min(low + 1, coarse_cells - 1), at - static_cast<float>(low)};
}

/// Turns the sums of `fine` into means, blended with those of `coarse` (or with zero).
void blend(Level& fine, const Level* coarse, float prior) {
  for (int b = 0; b < fine.cells[0]; ++b) {
    for (int g = 0; g < fine.cells[1]; ++g) {
      for (int r = 0; r < fine.cells[2]; ++r) {
        Eigen::Vector2f around = Eigen::Vector2f::Zero();
        if (coarse != nullptr) {
          const Between along[] = {between_cells(b, coarse->cells[0]), between_cells(g, coarse->cells[1]),
                                   between_cells(r, coarse->cells[2])};
          for (int corner = 0; corner < 8; ++corner) {
            float weight = 1.0F;
            std::array<int, 3> at{};
            for (std::size_t axis = 0; axis < 3; ++axis) {
              const bool high = (corner >> axis & 1) != 0;
              weight *= high ? along[axis].share : 1.0F - along[axis].share;
              at[axis] = high ? along[axis].high : along[axis].low;
            }
            around += weight * coarse->sums[coarse->index(at[0], at[1], at[2])].head<2>();
          }
        }
        Eigen::Vector3f& cell = fine.sums[fine.index(b, g, r)];
        cell.head<2>() = (cell.head<2>() + prior * around) / (cell[2] + prior);
      }
    }
  }
}

}  // namespace

std::size_t SlopeTable::index_of(const Eigen::Vector3f& colour) const {
  std::size_t index = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto axis = static_cast<Eigen::Index>(c);
    const float at = std::clamp((colour[axis] - lowest[axis]) / step, 0.0F, static_cast<float>(cells[c] - 1));
    index = index * static_cast<std::size_t>(cells[c]) + static_cast<std::size_t>(at + 0.5F);
  }
  return index;
}

bool SlopeTable::measured_near(const Eigen::Vector3f& colour) const {
  for (int i = 0; i < 27; ++i) {
    const Eigen::Vector3f beside = step * Eigen::Vector3i(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1).cast<float>();
    if (hits[index_of(colour + beside)] > 0) return true;
  }
  return false;
}

SlopeTable build_slope_table(std::span<const ColourSample> samples, const Eigen::Matrix3d& lamps,
                             const SlopeTableSettings& settings) {
  TS_ASSERT(!samples.empty());
  Eigen::Vector3f low = Eigen::Vector3f::Zero();
  Eigen::Vector3f high = Eigen::Vector3f::Zero();
  for (const ColourSample& sample : samples) {
    low = low.cwiseMin(sample.colour);
    high = high.cwiseMax(sample.colour);
  }
  SlopeTable table;
  table.step = static_cast<float>(settings.finest_step_DN);
  std::size_t cells = 0;
  for (;; table.step *= kGrowth) {
    cells = 1;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto axis = static_cast<Eigen::Index>(c);
      // Whole steps from zero, so that the colour of rest is the centre of a cell.
      const float below = std::ceil((kMargin_DN - low[axis]) / table.step);
      const float above = std::ceil((kMargin_DN + high[axis]) / table.step);
      table.lowest[axis] = -below * table.step;
      table.cells[c] = static_cast<int>(below + above) + 1;
      cells *= static_cast<std::size_t>(table.cells[c]);
    }
    if (cells <= settings.most_cells) break;
  }

  table.slopes.resize(cells);
  table.hits.assign(cells, 0);
  std::size_t index = 0;
  for (int b = 0; b < table.cells[0]; ++b) {
    for (int g = 0; g < table.cells[1]; ++g) {
      for (int r = 0; r < table.cells[2]; ++r, ++index) {
        const Eigen::Vector3f colour = table.lowest + table.step * Eigen::Vector3i(b, g, r).cast<float>();
        table.slopes[index] = slope_by_lamps(lamps, colour.cast<double>(), settings.steepest).cast<float>();
      }
    }
  }

  std::vector<Level> levels;
  levels.emplace_back(table.cells);
  const auto add = [&](std::size_t cell, const Eigen::Vector2f& slope, double weight) {
    const Eigen::Vector2f deviation = slope - table.slopes[cell];
    const auto w = static_cast<float>(weight);
    levels.front().sums[cell] += w * Eigen::Vector3f(deviation.x(), deviation.y(), 1.0F);
  };
  for (const ColourSample& sample : samples) {
    const std::size_t cell = table.index_of(sample.colour);
    add(cell, sample.slope, 1.0);
    if (table.hits[cell] < 65535) ++table.hits[cell];
  }
  add(table.index_of(Eigen::Vector3f::Zero()), Eigen::Vector2f::Zero(), kRestPixels);

  while (*std::max_element(levels.back().cells.begin(), levels.back().cells.end()) > 1) {
    const Level& fine = levels.back();
    Level coarse({(fine.cells[0] + 1) / 2, (fine.cells[1] + 1) / 2, (fine.cells[2] + 1) / 2});
    for (int b = 0; b < fine.cells[0]; ++b) {
      for (int g = 0; g < fine.cells[1]; ++g) {
        for (int r = 0; r < fine.cells[2]; ++r) {
          coarse.sums[coarse.index(b / 2, g / 2, r / 2)] += fine.sums[fine.index(b, g, r)];
        }
      }
    }
    levels.push_back(std::move(coarse));
  }
  const auto prior = static_cast<float>(settings.prior_pixels);
  for (std::size_t level = levels.size(); level-- > 0;) {
    blend(levels[level], level + 1 < levels.size() ? &levels[level + 1] : nullptr, prior);
  }
  const auto steepest = static_cast<float>(settings.steepest);
  for (std::size_t i = 0; i < cells; ++i) {
    table.slopes[i] += levels.front().sums[i].head<2>();
    if (const float length = table.slopes[i].norm(); length > steepest) table.slopes[i] *= steepest / length;
  }
  return table;
}

TableCoverage coverage_of(const SlopeTable& table, std::span<const ColourSample> samples) {
  TableCoverage coverage;
  coverage.cells = table.hits.size();
  coverage.cells_hit =
      table.hits.size() - static_cast<std::size_t>(std::count(table.hits.begin(), table.hits.end(), 0));
  std::vector<float> lengths;
  lengths.reserve(samples.size());
  for (const ColourSample& sample : samples) lengths.push_back(sample.slope.norm());
  if (!lengths.empty()) coverage.steepest_slope = quantile_of(lengths, 0.99);
  return coverage;
}

}  // namespace touchstone::sensors
