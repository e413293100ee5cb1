#include "render/membrane/coat_walks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "render/lamps/lamp_connection.h"
#include "render/lamps/prepared_scene.h"
#include "render/materials/fresnel.h"
#include "render/materials/scattering.h"
#include "render/sampling/warps.h"
#include "render/scene/flat_faces.h"

namespace touchstone::render {
namespace {

constexpr int kParts = 64;           // walks are shared out in parts, whatever the threads
constexpr double kStep = 0.25;       // of a cell: how finely a way is marked
constexpr double kLightWalk = 0.05;  // below it roulette decides
constexpr int kMostScatterings = 256;

/// The fixture's faces, clear, with its lamps in one band: their power.
Scene clear_fixture(const Scene& fixture) {
  Scene scene;
  scene.faces = fixture.faces;
  scene.environment = flat_spectrum(1, 0.0);
  scene.media.clear();
  for (const Medium& medium : fixture.media) scene.media.push_back(Medium{medium.index});
  for (Lamp lamp : fixture.lamps) {
    const double power = lamp_power(lamp).sum();
    std::visit([&](auto& one) { one.power_W = flat_spectrum(1, power); }, lamp);
    scene.lamps.push_back(lamp);
  }
  return scene;
}

/// The light of one side, to draw from.
struct SideLight {
  std::vector<Eigen::Vector3d> directions;
  std::vector<double> sums;  // of irradiances, running
  double total() const { return sums.empty() ? 0.0 : sums.back(); }
  const Eigen::Vector3d& draw(double number) const {
    const auto at = std::upper_bound(sums.begin(), sums.end(), number * sums.back());
    return directions[std::min<std::size_t>(static_cast<std::size_t>(at - sums.begin()), directions.size() - 1)];
  }
};

/// The camera's walk as far as it has come, heights counted from the back.
struct Trail {
  std::vector<Eigen::Vector3d> corners;
};

/// Walks of one side and part: calls `found(trail, out direction, weight)` for each way to a lamp.
template <typename Found>
void draw_walks(const CoatedSlab& slab, const CoatWalkSettings& settings, const SideLight& light, int side, int part,
                const Found& found) {
  RandomStream stream(settings.seed, static_cast<std::uint64_t>(side) * kParts + static_cast<std::uint64_t>(part),
                      Purpose::kMembraneWalk);
  const double extinction = slab.absorption_per_mm + slab.scattering_per_mm;
  const double albedo = slab.scattering_per_mm / extinction;
  const double top = settings.thickest * slab.thickness_mm;
  const double first_scattered = -std::expm1(-extinction * top);
  Trail trail;
  const int count = settings.drawn / kParts;
  for (int k = 0; k < count; ++k) {
    trail.corners.assign(1, Eigen::Vector3d::Zero());
    // Straight up, and scattered before the highest coat.
    const double height = -std::log1p(-first_scattered * ((k + stream.uniform()) / count)) / extinction;
    Eigen::Vector3d position(0, 0, height);
    Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
    double weight = first_scattered;
    for (int scatterings = 0; scatterings < kMostScatterings; ++scatterings) {
      trail.corners.push_back(position);
      weight *= albedo;
      const Eigen::Vector3d& out = light.draw(stream.uniform());
      const double way = position.z() / -out.z();
      const double share =
          weight * henyey_greenstein(direction.dot(out), slab.anisotropy) * std::exp(-extinction * way);
      found(trail, Eigen::Vector3d(position + way * out), share);
      if (weight < kLightWalk) {
        if (stream.uniform() < 0.5) break;
        weight *= 2.0;
      }
      const double cosine = sample_henyey_greenstein(slab.anisotropy, stream.uniform());
      const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
      const double angle = 2.0 * kPi * stream.uniform();
      direction =
          NormalFrame(direction).to_world({sine * std::cos(angle), sine * std::sin(angle), cosine}).normalized();
      double flight = -std::log1p(-stream.uniform()) / extinction;
      Eigen::Vector3d next = position + flight * direction;
      if (next.z() < 0.0) {
        // At the back: what isn't mirrored there is light that goes out, which the ways to lamps stand for.
        const double to_back = position.z() / -direction.z();
        if (!(stream.uniform() < fresnel(slab.index, slab.index_below, -direction.z()).mean_reflectance())) break;
        position += to_back * direction;
        position.z() = 0.0;
        trail.corners.push_back(position);
        direction.z() = -direction.z();
        flight -= to_back;
        next = position + flight * direction;
      }
      position = next;
      if (position.z() > top || position.head<2>().cwiseAbs().maxCoeff() > settings.reach_mm) break;
    }
  }
}

/// The squares of a way, from the highest to the lowest; nothing if it leaves the reach.
bool squares_of(const Trail& trail, const Eigen::Vector3d& end, const Eigen::Vector2d& start, double cell_mm, int reach,
                std::vector<float>& heights, std::vector<CoatCell>& cells) {
  const int side = 2 * reach + 1;
  heights.assign(static_cast<std::size_t>(side) * side, -1.0F);
  std::vector<int> touched;
  for (std::size_t k = 1; k <= trail.corners.size(); ++k) {
    const Eigen::Vector3d& from = trail.corners[k - 1];
    const Eigen::Vector3d& to = k < trail.corners.size() ? trail.corners[k] : end;
    const double across = (to - from).head<2>().norm();
    const int steps = std::max(1, static_cast<int>(std::ceil(across / (kStep * cell_mm))));
    for (int s = 0; s <= steps; ++s) {
      const Eigen::Vector3d at = from + (to - from) * (static_cast<double>(s) / steps);
      const int i = static_cast<int>(std::floor(at.x() / cell_mm + start.x())) + reach;
      const int j = static_cast<int>(std::floor(at.y() / cell_mm + start.y())) + reach;
      if (i < 0 || j < 0 || i >= side || j >= side) return false;
      float& height = heights[static_cast<std::size_t>(j) * side + i];
      if (height < 0.0F) touched.push_back(j * side + i);
      height = std::max(height, static_cast<float>(at.z()));
    }
  }
  cells.clear();
  for (int cell : touched) {
    cells.push_back({static_cast<std::int16_t>(cell % side - reach), static_cast<std::int16_t>(cell / side - reach),
                     heights[static_cast<std::size_t>(cell)]});
  }
  std::stable_sort(cells.begin(), cells.end(),
                   [](const CoatCell& a, const CoatCell& b) { return a.height_mm > b.height_mm; });
  return true;
}

void check(const CoatedSlab& slab, const CoatWalkSettings& settings) {
  const auto within = [](const char* name, double value, double low, double high) {
    if (!(value >= low && value <= high)) fail("coated slab: {} is {}; allowed is {} to {}", name, value, low, high);
  };
  within("thickness_mm", slab.thickness_mm, 1e-3, 1e3);
  within("absorption_per_mm", slab.absorption_per_mm, 0.0, 1e3);
  within("scattering_per_mm", slab.scattering_per_mm, 1e-4, 1e3);
  within("anisotropy", slab.anisotropy, -0.999, 0.999);
  within("index", slab.index, 1.0, 4.0);
  within("index_below", slab.index_below, 1.0, 4.0);
  within("drawn", settings.drawn, kParts, 1 << 26);
  within("kept", settings.kept, 1, 30000);
  within("cell_mm", settings.cell_mm, 1e-3, 1e3);
  within("reach_mm", settings.reach_mm, settings.cell_mm, 1000.0 * settings.cell_mm);
  within("thickest", settings.thickest, 1.0, 10.0);
  within("depths", settings.depths, 1, 255);
}

}  // namespace

std::vector<LampArrival> arrivals_at_back(const Scene& fixture, double z, const Eigen::Vector2d& size_mm, int columns,
                                          int rows) {
  const PreparedScene<1> scene(clear_fixture(fixture));
  std::vector<LampArrival> arrivals;
  // Just within the slab, so that directions are the slab's.
  const int layer = layer_of_height(fixture.faces, z) + 1;
  std::uint64_t uncounted = 0;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const Eigen::Vector2d place(((i + 0.5) / columns - 0.5) * size_mm.x(), ((j + 0.5) / rows - 0.5) * size_mm.y());
      for (const PreparedLamp<1>& lamp : scene.lamps) {
        const Receiver particle{
            {place.x(), place.y(), z}, Eigen::Vector3d::Zero(), layer, scene.medium_of_layer(layer)};
        Arrival<1> arrival;
        if (!connect_to_lamp(scene, lamp, lamp.position, particle, uncounted, arrival)) continue;
        if (!(arrival.direction.z() < 0.0) || !(arrival.irradiance[0] > 0.0)) continue;
        arrivals.push_back({place, arrival.direction, arrival.irradiance[0]});
      }
    }
  }
  if (arrivals.empty()) fail("coated slab: no lamp shines onto its back");
  return arrivals;
}

int side_of(const Eigen::Vector3d& direction) {
  const bool along_x = std::abs(direction.x()) >= std::abs(direction.y());
  return along_x ? (direction.x() >= 0.0 ? 0 : 2) : (direction.y() >= 0.0 ? 1 : 3);
}

CoatWalks walk_under_coat(const CoatedSlab& slab, const std::vector<LampArrival>& arrivals,
                          const CoatWalkSettings& settings) {
  check(slab, settings);
  std::array<SideLight, kLightSides> lights;
  for (const LampArrival& arrival : arrivals) {
    SideLight& light = lights[side_of(arrival.direction)];
    light.directions.push_back(arrival.direction);
    light.sums.push_back(light.total() + arrival.irradiance);
  }
  CoatWalks out;
  out.slab = slab;
  out.cell_mm = settings.cell_mm;
  out.reach = static_cast<int>(std::ceil(settings.reach_mm / settings.cell_mm)) + 1;
  const double top = settings.thickest * slab.thickness_mm;
  std::vector<double> depth_sum(settings.depths, 0.0);
  std::vector<int> depth_count(settings.depths, 0);
  for (int side = 0; side < kLightSides; ++side) {
    if (!(lights[side].total() > 0.0)) continue;
    std::vector<double> part_weight(kParts, 0.0);
    tbb::parallel_for(0, kParts, [&](int part) {
      draw_walks(slab, settings, lights[side], side, part,
                 [&](const Trail&, const Eigen::Vector3d&, double weight) { part_weight[part] += weight; });
    });
    double whole = 0.0;
    for (double weight : part_weight) whole += weight;
    const double step = whole / settings.kept;
    out.weight[side] = step / settings.drawn;
    struct Kept {
      std::vector<CoatWalk> walks;
      std::vector<CoatCell> cells;
      std::vector<double> first_mm;
    };
    std::vector<Kept> kept(kParts);
    std::vector<double> before(kParts, 0.0);
    for (int part = 1; part < kParts; ++part) before[part] = before[part - 1] + part_weight[part - 1];
    tbb::parallel_for(0, kParts, [&](int part) {
      RandomStream starts(settings.seed, static_cast<std::uint64_t>(kLightSides + side) * kParts + part,
                          Purpose::kMembraneWalk);
      double sum = before[part];
      std::vector<float> heights;
      std::vector<CoatCell> cells;
      draw_walks(slab, settings, lights[side], side, part,
                 [&](const Trail& trail, const Eigen::Vector3d& end, double weight) {
                   const double next = sum + weight;
                   const auto chosen = static_cast<long>(std::floor(next / step - 0.5) - std::floor(sum / step - 0.5));
                   sum = next;
                   for (long k = 0; k < chosen; ++k) {
                     const Eigen::Vector2d start(starts.uniform(), starts.uniform());
                     if (!squares_of(trail, end, start, settings.cell_mm, out.reach, heights, cells)) continue;
                     CoatWalk walk;
                     walk.first = static_cast<std::uint32_t>(kept[part].cells.size());
                     walk.count = static_cast<std::uint32_t>(cells.size());
                     walk.side = static_cast<std::uint8_t>(side);
                     const double first = trail.corners[1].z();
                     walk.depth = static_cast<std::uint8_t>(
                         std::min(settings.depths - 1, static_cast<int>(first / top * settings.depths)));
                     kept[part].walks.push_back(walk);
                     kept[part].first_mm.push_back(first);
                     kept[part].cells.insert(kept[part].cells.end(), cells.begin(), cells.end());
                   }
                 });
    });
    for (const Kept& one : kept) {
      const auto offset = static_cast<std::uint32_t>(out.cells.size());
      for (std::size_t k = 0; k < one.walks.size(); ++k) {
        CoatWalk walk = one.walks[k];
        walk.first += offset;
        depth_sum[walk.depth] += one.first_mm[k];
        ++depth_count[walk.depth];
        out.walks.push_back(walk);
      }
      out.cells.insert(out.cells.end(), one.cells.begin(), one.cells.end());
    }
  }
  if (out.walks.empty()) fail("coated slab: no light comes back from within {} mm", settings.reach_mm);
  for (int k = 0; k < settings.depths; ++k) {
    out.depth_mm.push_back(depth_count[k] > 0 ? depth_sum[k] / depth_count[k] : (k + 0.5) * top / settings.depths);
  }
  return out;
}

}  // namespace touchstone::render
