#include "render/cameras/camera_footprint.h"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "render/cameras/camera_diffraction.h"

namespace touchstone::render {
namespace {

// Places in the hole along each side of (u, v). Over a wide footprint so few would lie several pixels from each other.
constexpr int kHoleSide = 16;
constexpr int kWideHoleSide = 24;
constexpr double kWide = 8.0;  // pixels
constexpr int kLensSide = 6;   // the same of a lens where diffraction spreads each of them
constexpr int kFarCells = 3;   // far from the middle diffraction's cells are so many times as wide

/// Places in the picture whose central rays meet the surface where the rays through all of the hole do, relative to
/// the pixel, and what each weighs (in all 1).
struct Spread {
  std::vector<Eigen::Vector2d> offsets;
  std::vector<double> weights;
  double gain = 1.0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Vector2d variance = Eigen::Vector2d::Zero();
};

std::optional<Eigen::Vector2d> place_at(const std::optional<LayerRay>& ray, double z) {
  if (!ray || ray->direction.z() == 0.0) return std::nullopt;
  const Eigen::Vector3d at = ray->origin + (z - ray->origin.z()) / ray->direction.z() * ray->direction;
  return Eigen::Vector2d(at.x(), at.y());
}

/// The sensor about a point in cells: where they are from it (mm), and how large.
struct Cell {
  Eigen::Vector2d away;
  double area;
};

/// As fine as pixels and diffraction's rings ask for where most of the light is, coarser beyond.
/// A lens's cells are parts of pixels, which so average over themselves; behind a hole, whose blur is wide, a cell is a
/// pixel's middle: paths that are shared are drawn over the pixel.
std::vector<Cell> cells_of(const DiffractionSpread& spread, double pitch_mm, bool is_lens) {
  const double fine = std::min(is_lens ? pitch_mm / 3.0 : pitch_mm, spread.ring_mm() / 2.0);
  const double coarse = kFarCells * fine;
  const auto half = static_cast<int>(std::ceil(spread.reach_mm() / coarse));
  std::vector<Cell> cells;
  for (int j = -half; j <= half; ++j) {
    for (int i = -half; i <= half; ++i) {
      const Eigen::Vector2d middle(i * coarse, j * coarse);
      if (middle.norm() > spread.reach_mm()) continue;
      if (middle.norm() > spread.core_mm()) {
        cells.push_back({middle, coarse * coarse});
        continue;
      }
      for (int l = 0; l < kFarCells; ++l) {
        for (int k = 0; k < kFarCells; ++k) {
          const Eigen::Vector2d part(k + 0.5 - 0.5 * kFarCells, l + 0.5 - 0.5 * kFarCells);
          cells.push_back({middle + fine * part, fine * fine});
        }
      }
    }
  }
  return cells;
}

/// Diffraction in place of what a hole's places do, or beside what a lens's do. Variances stay the geometric ones.
void diffract(const ReadyCamera& camera, const DiffractionSpread& diffraction, const std::vector<Cell>& cells,
              std::optional<int> band, const Eigen::Vector2d& pixel, Spread& spread) {
  const Eigen::Vector2d at = from_axis_mm(camera, pixel);
  std::vector<Eigen::Vector2d> offsets;
  std::vector<double> weights;
  double whole = 0.0;
  for (const Cell& cell : cells) {
    double density = 0.0;
    for (int k = band.value_or(0); k < (band ? *band + 1 : diffraction.bands()); ++k) {
      density += diffraction.density(k, at, cell.away);
    }
    if (density == 0.0) continue;
    const Eigen::Vector2d from = image_point_at(camera, at + cell.away);
    offsets.emplace_back(from - pixel);
    weights.push_back(density * cell.area);
    whole += weights.back();
  }
  for (double& weight : weights) weight /= whole;
  if (std::holds_alternative<PreparedLens>(camera)) {
    std::vector<Eigen::Vector2d> all_offsets;
    std::vector<double> all_weights;
    for (std::size_t k = 0; k < spread.offsets.size(); ++k) {
      for (std::size_t c = 0; c < offsets.size(); ++c) {
        all_offsets.emplace_back(spread.offsets[k] + offsets[c]);
        all_weights.push_back(spread.weights[k] * weights[c]);
      }
    }
    offsets = std::move(all_offsets);
    weights = std::move(all_weights);
  } else {
    spread.mean.setZero();
  }
  spread.offsets = std::move(offsets);
  spread.weights = std::move(weights);
}

Spread spread_at(const Scene& fixture, const ReadyCamera& camera, int layer, const Eigen::Vector2d& pixel, double z,
                 int hole_side) {
  Spread spread;
  spread.offsets = {Eigen::Vector2d::Zero()};
  spread.weights = {1.0};
  const auto ray = [&](double dx, double dy, double u, double v) {
    return ray_in_layer(fixture, camera, layer, pixel.x() + dx, pixel.y() + dy, u, v);
  };
  const std::optional<LayerRay> central = ray(0, 0, 0.5, 0.5);
  const auto middle = place_at(central, z);
  const auto right = place_at(ray(0.5, 0, 0.5, 0.5), z);
  const auto left = place_at(ray(-0.5, 0, 0.5, 0.5), z);
  const auto below = place_at(ray(0, 0.5, 0.5, 0.5), z);
  const auto above = place_at(ray(0, -0.5, 0.5, 0.5), z);
  if (!middle || !right || !left || !below || !above) return spread;
  Eigen::Matrix2d place_per_pixel;
  place_per_pixel << *right - *left, *below - *above;
  if (!(std::abs(place_per_pixel.determinant()) > 1e-12)) return spread;
  const Eigen::Matrix2d pixel_per_place = place_per_pixel.inverse();
  Spread made;
  double whole = 0.0;
  for (int i = 0; i < hole_side; ++i) {
    for (int j = 0; j < hole_side; ++j) {
      const auto one = ray(0, 0, (i + 0.5) / hole_side, (j + 0.5) / hole_side);
      const auto at = place_at(one, z);
      if (!at) continue;
      made.offsets.emplace_back(pixel_per_place * (*at - *middle));
      made.weights.push_back(one->weight);
      whole += one->weight;
    }
  }
  if (!(whole > 0.0)) return spread;
  made.gain = whole / (hole_side * hole_side) / central->weight;
  for (std::size_t k = 0; k < made.offsets.size(); ++k) {
    made.weights[k] /= whole;
    made.mean += made.weights[k] * made.offsets[k];
  }
  for (std::size_t k = 0; k < made.offsets.size(); ++k) {
    made.variance += made.weights[k] * (made.offsets[k] - made.mean).cwiseAbs2();
  }
  return made;
}

/// Shares of a pixel that stands at `from` from the left edge of its own square (squares of `side` pixels).
template <typename Visit>
void shares(double from, int side, Visit visit) {
  const int first = static_cast<int>(std::floor((from - 0.5) / side));
  const int last = static_cast<int>(std::floor((from + 0.5) / side));
  for (int square = first; square <= last; ++square) {
    const double low = std::max(from - 0.5, static_cast<double>(square) * side);
    const double high = std::min(from + 0.5, static_cast<double>(square + 1) * side);
    if (high > low) visit(square, high - low);
  }
}

/// The variance about the pixel that rays at squares' middles give along one axis (0 is x), mean over the phases.
double variance_on_grid(const Spread& spread, int axis, double scale, int side) {
  double sum = 0.0;
  for (int phase = 0; phase < side; ++phase) {
    for (std::size_t k = 0; k < spread.offsets.size(); ++k) {
      const double offset = spread.mean[axis] + scale * (spread.offsets[k][axis] - spread.mean[axis]);
      shares(phase + 0.5 + offset, side, [&](int square, double share) {
        const double away = (square + 0.5) * side - (phase + 0.5) - spread.mean[axis];
        sum += spread.weights[k] * share * away * away;
      });
    }
  }
  return sum / side;
}

/// What offsets are to be scaled by, so that a grid's squares make the picture no softer than pixel and hole do.
double scale_to_keep_variance(const Spread& spread, int axis, int side) {
  const double own = spread.variance[axis];
  if (!(own > 1e-6)) return 1.0;
  const double wanted = own + 1.0 / 12.0;
  double scale = 1.0;
  for (int turn = 0; turn < 4; ++turn) {
    const double excess = variance_on_grid(spread, axis, scale, side) - scale * scale * own;
    scale = std::sqrt(std::clamp((wanted - excess) / own, 0.25, 2.0));
  }
  return scale;
}

/// `whole`: what an offset leads to belongs to one square, not in parts to those that the pixel overlaps there. Offsets
/// that are finer than pixels then soften the picture by a square and no more.
CameraFootprint::Kernel kernel_of(const Spread& spread, const Eigen::Vector2d& scale, int phase_x, int phase_y,
                                  int side, bool whole) {
  const auto offset_of = [&](std::size_t k) -> Eigen::Vector2d {
    return spread.mean + scale.cwiseProduct(spread.offsets[k] - spread.mean);
  };
  int reach = 0;  // squares
  for (std::size_t k = 0; k < spread.offsets.size(); ++k) {
    reach = std::max(reach, static_cast<int>(std::ceil(offset_of(k).cwiseAbs().maxCoeff() / side)) + 2);
  }
  Eigen::ArrayXXd found = Eigen::ArrayXXd::Zero(2 * reach + 1, 2 * reach + 1);  // by column, row
  for (std::size_t k = 0; k < spread.offsets.size(); ++k) {
    const Eigen::Vector2d offset = offset_of(k);
    if (whole) {
      const auto square = [&](int phase, double along) {
        return static_cast<int>(std::floor((phase + 0.5 + along) / side)) + reach;
      };
      found(square(phase_x, offset.x()), square(phase_y, offset.y())) += spread.weights[k];
      continue;
    }
    shares(phase_x + 0.5 + offset.x(), side, [&](int column, double across) {
      shares(phase_y + 0.5 + offset.y(), side,
             [&](int row, double down) { found(column + reach, row + reach) += spread.weights[k] * across * down; });
    });
  }
  CameraFootprint::Kernel kernel;
  for (int row = -reach; row <= reach; ++row) {
    for (int column = -reach; column <= reach; ++column) {
      const double weight = found(column + reach, row + reach);
      if (weight != 0.0) kernel.taps.push_back({column, row, static_cast<float>(weight)});
    }
  }
  return kernel;
}

}  // namespace

std::vector<Eigen::Vector2d> footprint_blocks(const ReadyCamera& camera, int block) {
  const Eigen::Vector2i size = size_of(camera);
  std::vector<Eigen::Vector2d> middles;
  for (int top = 0; top < size.y(); top += block) {
    for (int left = 0; left < size.x(); left += block) {
      middles.emplace_back(0.5 * (left + std::min(left + block, size.x())),
                           0.5 * (top + std::min(top + block, size.y())));
    }
  }
  return middles;
}

CameraFootprint make_footprint(const Scene& fixture, const ReadyCamera& camera, int layer,
                               const std::vector<double>& surface_z, int block, double rays_across, int most_spacing,
                               std::optional<int> band) {
  const std::vector<Eigen::Vector2d> middles = footprint_blocks(camera, block);
  const DiffractionSpread* diffraction = diffraction_of(camera);
  const bool is_lens = std::holds_alternative<PreparedLens>(camera);
  TS_ASSERT(surface_z.size() == middles.size());
  std::vector<Spread> spreads(middles.size());
  const auto spread_all = [&](int hole_side) {
    tbb::parallel_for(std::size_t{0}, middles.size(), [&](std::size_t k) {
      spreads[k] = spread_at(fixture, camera, layer, middles[k], surface_z[k], hole_side);
    });
  };
  // A disc of diameter D has the variance D^2 / 16 along each axis.
  const auto least_width = [&] {
    double least = INFINITY;
    for (const Spread& spread : spreads) least = std::min(least, 4.0 * std::sqrt(spread.variance.minCoeff()));
    return least;
  };
  spread_all(diffraction != nullptr && is_lens ? kLensSide : kHoleSide);
  if (least_width() > kWide) spread_all(kWideHoleSide);
  const double narrowest = least_width();
  // What diffraction makes of a hole's disc is narrower than that in its middle.
  if (diffraction != nullptr && !is_lens) most_spacing = 1;
  CameraFootprint made;
  made.block = block;
  made.narrowest = narrowest;
  while (made.spacing < most_spacing && block % (2 * made.spacing) == 0 &&
         narrowest >= rays_across * 2 * made.spacing) {
    made.spacing *= 2;
  }
  const Eigen::Vector2i size = size_of(camera);
  made.blocks_across = (size.x() + block - 1) / block;
  const int side = made.spacing;
  const int phases = side * side;
  if (diffraction != nullptr) {
    const double pitch_mm = std::visit([](const auto& one) { return 1e-3 * one.pixel_pitch_um; }, camera);
    const std::vector<Cell> cells = cells_of(*diffraction, pitch_mm, is_lens);
    tbb::parallel_for(std::size_t{0}, middles.size(),
                      [&](std::size_t k) { diffract(camera, *diffraction, cells, band, middles[k], spreads[k]); });
  }
  made.kernels.resize(spreads.size() * phases);
  tbb::parallel_for(std::size_t{0}, spreads.size(), [&](std::size_t k) {
    const Spread& spread = spreads[k];
    Eigen::Vector2d scale = Eigen::Vector2d::Ones();
    if (diffraction == nullptr) {
      scale = {scale_to_keep_variance(spread, 0, side), scale_to_keep_variance(spread, 1, side)};
    }
    for (int phase = 0; phase < phases; ++phase) {
      made.kernels[k * phases + phase] =
          kernel_of(spread, scale, phase % side, phase / side, side, diffraction != nullptr);
    }
  });
  for (const CameraFootprint::Kernel& kernel : made.kernels) {
    for (const CameraFootprint::Tap& tap : kernel.taps) {
      made.margin = std::max({made.margin, std::abs(tap.column), std::abs(tap.row)});
    }
  }
  for (const Spread& spread : spreads) made.gain.push_back(static_cast<float>(spread.gain));
  const double first = 0.5 * side - static_cast<double>(made.margin) * side;
  made.grid = {first, first, static_cast<double>(side), (size.x() + side - 1) / side + 2 * made.margin,
               (size.y() + side - 1) / side + 2 * made.margin};
  return made;
}

const CameraFootprint::Kernel& CameraFootprint::kernel_at(int row, int column) const {
  const int phases = spacing * spacing;
  return kernels[static_cast<std::size_t>(block_at(row, column)) * phases + row % spacing * spacing + column % spacing];
}

void CameraFootprint::widen(int points) {
  TS_ASSERT(points >= margin);
  const int more = points - margin;
  margin = points;
  grid.left -= more * grid.spacing;
  grid.top -= more * grid.spacing;
  grid.columns += 2 * more;
  grid.rows += 2 * more;
}

float CameraFootprint::sum_of_squares(int row, int column) const {
  float sum = 0.0f;
  for (const Tap& tap : kernel_at(row, column).taps) sum += tap.weight * tap.weight;
  return sum;
}

void CameraFootprint::spread(const float* picture, int row, int left, int count, float* out) const {
  const Kernel& kernel = kernel_at(row, left);
  const float* from =
      picture + static_cast<std::ptrdiff_t>(margin + row / spacing) * grid.columns + margin + left / spacing;
  const auto place = [&](const Tap& tap) {
    return from + static_cast<std::ptrdiff_t>(tap.row) * grid.columns + tap.column;
  };
  using Eight = Eigen::Array<float, 8, 1>;  // sums that stay in registers
  int k = 0;
  for (; k + 8 <= count; k += 8) {
    Eight sum = Eight::Zero();
    for (const Tap& tap : kernel.taps) sum += tap.weight * Eigen::Map<const Eight>(place(tap) + k);
    Eigen::Map<Eight>(out + k) = sum;
  }
  for (; k < count; ++k) {
    out[k] = 0.0f;
    for (const Tap& tap : kernel.taps) out[k] += tap.weight * place(tap)[k];
  }
}

}  // namespace touchstone::render
