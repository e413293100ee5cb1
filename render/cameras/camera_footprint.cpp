#include "render/cameras/camera_footprint.h"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"

namespace touchstone::render {
namespace {

// Places in the hole along each side of (u, v). Over a wide footprint so few would lie several pixels from each other.
constexpr int kHoleSide = 16;
constexpr int kWideHoleSide = 24;
constexpr double kWide = 8.0;  // pixels

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

CameraFootprint::Kernel kernel_of(const Spread& spread, const Eigen::Vector2d& scale, int phase_x, int phase_y,
                                  int side) {
  std::vector<std::array<double, 3>> found;  // row, column, weight
  for (std::size_t k = 0; k < spread.offsets.size(); ++k) {
    const Eigen::Vector2d offset = spread.mean + scale.cwiseProduct(spread.offsets[k] - spread.mean);
    shares(phase_x + 0.5 + offset.x(), side, [&](int column, double across) {
      shares(phase_y + 0.5 + offset.y(), side, [&](int row, double down) {
        found.push_back({static_cast<double>(row), static_cast<double>(column), spread.weights[k] * across * down});
      });
    });
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a[0] != b[0] ? a[0] < b[0] : a[1] < b[1]; });
  CameraFootprint::Kernel kernel;
  double weight = 0.0;
  for (std::size_t k = 0; k < found.size(); ++k) {
    weight += found[k][2];
    if (k + 1 < found.size() && found[k + 1][0] == found[k][0] && found[k + 1][1] == found[k][1]) continue;
    kernel.taps.push_back({static_cast<int>(found[k][1]), static_cast<int>(found[k][0]), static_cast<float>(weight)});
    weight = 0.0;
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
                               const std::vector<double>& surface_z, int block, double rays_across, int most_spacing) {
  const std::vector<Eigen::Vector2d> middles = footprint_blocks(camera, block);
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
  spread_all(kHoleSide);
  if (least_width() > kWide) spread_all(kWideHoleSide);
  const double narrowest = least_width();
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
  made.kernels.resize(spreads.size() * phases);
  tbb::parallel_for(std::size_t{0}, spreads.size(), [&](std::size_t k) {
    const Spread& spread = spreads[k];
    const Eigen::Vector2d scale(scale_to_keep_variance(spread, 0, side), scale_to_keep_variance(spread, 1, side));
    for (int phase = 0; phase < phases; ++phase) {
      made.kernels[k * phases + phase] = kernel_of(spread, scale, phase % side, phase / side, side);
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
