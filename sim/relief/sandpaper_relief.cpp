#include "sim/relief/sandpaper_relief.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/units.h"
#include "sim/relief/relief_cells.h"
#include "sim/relief/relief_tile.h"

namespace touchstone::sim {
namespace {

constexpr double kMicrometre = 1e-3;
constexpr double kBackingLength = 1.5;  // mm, correlation of the paper's waviness
enum Part : std::uint64_t { kPlaces, kGrains, kBacking };

constexpr std::array<std::pair<int, double>, 12> kGrades{{{40, 425.0},
                                                          {60, 269.0},
                                                          {80, 201.0},
                                                          {100, 162.0},
                                                          {120, 125.0},
                                                          {150, 100.0},
                                                          {180, 82.0},
                                                          {220, 68.0},
                                                          {240, 58.5},
                                                          {280, 52.2},
                                                          {320, 46.2},
                                                          {400, 35.0}}};

/// The part of a crushed grain that stands out: a top and flanks broken along random planes.
class Grain {
 public:
  Grain(double size, double protrusion, RandomStream& random) : top_(protrusion) {
    const double lean = 2.0 * kPi * random.uniform();
    const double slope = 0.35 * random.uniform();
    tilt_ = slope * Eigen::Vector2d(std::cos(lean), std::sin(lean));
    double azimuth = 2.0 * kPi * random.uniform();
    for (Face& face : faces_) {
      azimuth += 2.0 * kPi / kFaces * (0.5 + random.uniform());
      const double steepness = std::tan((35.0 + 40.0 * random.uniform()) * kRadiansPerDegree);
      face = {Eigen::Vector2d(std::cos(azimuth), std::sin(azimuth)), size * (0.2 + 0.3 * random.uniform()), steepness};
    }
  }

  double at(const Eigen::Vector2d& offset) const {
    double height = top_ + tilt_.dot(offset);
    for (const Face& face : faces_) {
      height = std::min(height, top_ - face.steepness * (face.outward.dot(offset) - face.edge));
    }
    return height;
  }

 private:
  static constexpr int kFaces = 6;
  struct Face {
    Eigen::Vector2d outward;
    double edge;  // mm from the grain's middle, where the face meets the top's height
    double steepness;
  };
  double top_;
  Eigen::Vector2d tilt_;
  std::array<Face, kFaces> faces_;
};

}  // namespace

double grain_size_mm(int grit) {
  std::vector<int> known;
  for (const auto& [grade, micrometres] : kGrades) {
    if (grade == grit) return micrometres * kMicrometre;
    known.push_back(grade);
  }
  fail("there's no grit P{}; known are P{}", grit, fmt::join(known, ", P"));
}

double grains_per_mm2(const SandpaperRelief& relief) {
  const double size = grain_size_mm(relief.grit);
  return relief.coat / (0.25 * kPi * size * size);
}

void fields(YamlReader& in, SandpaperRelief& relief) {
  in.required("grit", relief.grit, Allowed::any());
  in.optional("coat", relief.coat, Allowed::within(0.05, 1.0));
  in.optional("size_spread", relief.size_spread, Allowed::within(0.0, 0.4));
  in.optional("protrusion", relief.protrusion, Allowed::within(0.1, 0.9));
  in.optional("protrusion_spread", relief.protrusion_spread, Allowed::within(0.0, 0.4));
  in.optional("backing_um", relief.backing_um, Allowed::within(0.0, 100.0));
  in.optional("size_mm", relief.size_mm, Allowed::within(4.0, 60.0));
  in.optional("seed", relief.seed);
  try {
    grain_size_mm(relief.grit);
  } catch (const Error& error) {
    fail_at(in.where("grit"), "{}", error.what());
  }
}

fem::ReliefMap relief_map(const SandpaperRelief& relief) {
  constexpr double kCloseness = 0.6;  // grains may lean on each other, not lie in one another
  const double mean_size = grain_size_mm(relief.grit);
  ReliefTile tile(Eigen::Vector2d::Constant(relief.size_mm), 0.0F);
  RandomStream places = relief_stream(relief.seed, kPlaces);
  RandomStream random = relief_stream(relief.seed, kGrains);
  for (const Eigen::Vector2d& place : scatter(tile.size(), grains_per_mm2(relief), kCloseness, places)) {
    const double size = mean_size * std::max(0.4, 1.0 + relief.size_spread * random.normal());
    const double share = std::max(0.05, relief.protrusion + relief.protrusion_spread * random.normal());
    const Grain grain(size, share * size, random);
    tile.raise(place, 1.2 * size, [&](const Eigen::Vector2d& offset) { return grain.at(offset); });
  }
  // The size coat runs into the corners between the grains.
  constexpr double kMeniscus = 0.8;
  const std::vector<float> level = blurred(tile, 0.25 * mean_size);
  for (std::size_t k = 0; k < level.size(); ++k) {
    tile.heights[k] = std::max(tile.heights[k], static_cast<float>(kMeniscus * level[k]));
  }
  RandomStream backing = relief_stream(relief.seed, kBacking);
  roughen(tile, relief.backing_um * kMicrometre, kBackingLength, backing);
  return tile.map();
}

double finest_detail(const SandpaperRelief&) {
  return kTileDetail;
}

}  // namespace touchstone::sim
