#include "sim/scene/scattered_print.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "sim/scene/device_gel.h"

namespace touchstone::sim {
namespace {

constexpr std::uint64_t kPlaces = 0;  // indices of the random streams
constexpr std::uint64_t kSizes = 1;
constexpr int kThrowsADot = 100000;  // more than are ever needed below the filling of kScatterDistance

}  // namespace

std::vector<render::PrintedMark> scattered_marks(const PrintSpec& print) {
  TS_ASSERT(print.pattern == PrintPattern::scattered);
  const double spacing = print.spacing_mm.x();
  const double nearest = kScatterDistance * spacing;
  const double radius = print.radius_mm;
  const auto wanted = static_cast<std::size_t>(std::llround(kPi * radius * radius / (spacing * spacing)));
  RandomStream places(print.seed, kPlaces, Purpose::kPlacement);
  RandomStream sizes(print.seed, kSizes, Purpose::kPlacement);
  // Cells of such a size hold one centre at most.
  const double cell = nearest / std::sqrt(2.0);
  const int side = 2 * static_cast<int>(std::ceil(radius / cell)) + 5;  // with two empty cells beyond each edge
  std::vector<int> in_cell(static_cast<std::size_t>(side) * side, -1);
  const auto cell_of = [&](double place) { return static_cast<int>(std::floor(place / cell)) + side / 2; };
  std::vector<render::PrintedMark> marks;
  for (int misses = 0; marks.size() < wanted && misses < kThrowsADot; ++misses) {
    const double distance = radius * std::sqrt(places.uniform());
    const double angle = 2.0 * kPi * places.uniform();
    const Eigen::Vector2d centre = distance * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const int column = cell_of(centre.x());
    const int row = cell_of(centre.y());
    bool free = true;
    for (int r = row - 2; r <= row + 2; ++r) {
      for (int c = column - 2; c <= column + 2; ++c) {
        const int other = in_cell[static_cast<std::size_t>(r) * side + c];
        free = free && (other < 0 || (marks[other].centre - centre).norm() >= nearest);
      }
    }
    if (!free) continue;
    in_cell[static_cast<std::size_t>(row) * side + column] = static_cast<int>(marks.size());
    const double size = print.width_mm * (1.0 + print.diameter_spread * (2.0 * sizes.uniform() - 1.0));
    marks.push_back({centre, size / 2, 0, render::MarkShape::round});
    misses = -1;
  }
  return marks;
}

Eigen::Vector2d along_surface(const GelSpec& gel, const Eigen::Vector3d& point) {
  const std::optional<RoundFace> face = round_face(gel);
  if (!face) return point.head<2>();
  // Archimedes: on a sphere and on the cylinder round it equal heights have equal areas.
  const double outwards = std::sqrt(2.0 * face->sphere_radius_mm * std::max(0.0, -point.z()));
  const double across = point.head<2>().norm();
  return across > 0.0 ? Eigen::Vector2d(outwards / across * point.head<2>()) : Eigen::Vector2d(0.0, 0.0);
}

}  // namespace touchstone::sim
