#include "render/direct/direct_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "render/direct/shadow_reach.h"
#include "render/scene/film_screen.h"
#include "render/scene/sheet_index.h"

namespace touchstone::render {
namespace {

constexpr int kBlocksAcross = 20;      // of the footprint
constexpr double kLampSpread = 0.5;    // of the films' distance: standard deviation of where lamps' light crosses them
constexpr float kWidestPitch = 0.06f;  // mm, of horizons: contacts cast shadows of some tenths of a millimetre
constexpr double kSharp = 4.0;         // pixels: a wider blur takes the mean of a dozen rays anyway

/// x and y of where a ray has the height z.
Eigen::Vector2d place_at_height(const LayerRay& ray, double z) {
  return (ray.origin + (z - ray.origin.z()) / ray.direction.z() * ray.direction).head<2>();
}

}  // namespace

DirectRenderer::Parts::Parts(const LightField& field, const Camera& camera_of, const Scene& rest,
                             const DirectSettings& settings_of)
    : fixture(field, settings_of.samples > 1),
      camera(make_ready(camera_of)),
      settings(settings_of),
      pixel_mm(find_pixel()),
      seen_box(find_seen_box()),
      horizon_settings(find_horizon_settings()),
      lone_sheet(is_lone_sheet(rest)),
      tree(lone_sheet ? still_things(rest) : rest),
      connected(!rest.surfaces.empty() && is_connected(rest.surfaces[0].mesh)),
      spreads(settings.samples == 1 && settings.blur) {
  if (lone_sheet) {
    for (std::size_t i = 1; i < rest.surfaces.size(); ++i) others.push_back(rest.surfaces[i].mesh);
  }
  ImageGrid grid = pixel_grid(camera);
  if (spreads) {
    find_footprint(rest);
    grid = footprint.grid;
  }
  set_up_films(rest);
  rays = trace_to_layer(field.fixture, camera, grid, field.layer, settings.samples, settings.seed);
  if (!spreads) return;
  radiance.resize(static_cast<std::size_t>(grid.columns) * grid.rows * rays.bands);
  refines = footprint.narrowest < kSharp && settings.edge_side > 1;
  if (refines && settings.shadows) seen.resize(static_cast<std::size_t>(grid.columns) * grid.rows);
  CameraRays pixels = trace_to_layer(field.fixture, camera, pixel_grid(camera), field.layer, 1, 0);
  keep_by_pixel(pixels, pixels.through, through);
  if (!pixels.veil.empty()) keep_by_pixel(pixels, pixels.veil, veil);
  rays.through.clear();
  rays.through.shrink_to_fit();
  rays.veil.clear();
  rays.veil.shrink_to_fit();
}

void DirectRenderer::Parts::set_up_films(const Scene& rest) {
  for (const Surface& surface : rest.surfaces) {
    if (is_film(surface)) films.push_back(surface);
  }
  if (films.empty()) return;
  const LightField& field = fixture.field;
  const double z = films.front().mesh.vertices.front().z();
  double radius = 0.0;
  if (spreads) {
    const auto at = [&](double u, double v) -> std::optional<Eigen::Vector2d> {
      const auto ray = ray_in_layer(field.fixture, camera, field.layer, 0.5 * width(), 0.5 * height(), u, v);
      if (!ray) return std::nullopt;
      return place_at_height(*ray, z);
    };
    const auto middle = at(0.5, 0.5);
    constexpr double kRim = 1.0 - 1e-6;
    for (const auto& [u, v] : {std::pair{0.0, 0.5}, {kRim, 0.5}, {0.5, 0.0}, {0.5, kRim}}) {
      const auto rim = at(u, v);
      if (middle && rim) radius = std::max(radius, (*rim - *middle).norm());
    }
  }
  const double height = field.reach.center().z() - z;
  fixture.films = FilmScreen(rest, field.index, radius, kLampSpread * std::abs(height));
}

void DirectRenderer::Parts::find_footprint(const Scene& rest) {
  const LightField& field = fixture.field;
  const int block = std::max(8, 8 * ((width() + 4 * kBlocksAcross) / (8 * kBlocksAcross)));
  const std::vector<Eigen::Vector2d> middles = footprint_blocks(camera, block);
  std::optional<SheetIndex> sheet;
  if (lone_sheet) {
    const Eigen::Vector2d endless = Eigen::Vector2d::Constant(std::numeric_limits<double>::max());
    sheet.emplace(rest.surfaces[0], Eigen::AlignedBox2d(Eigen::Vector2d(-endless), endless));
  }
  std::vector<double> surface_z;
  for (const Eigen::Vector2d& middle : middles) {
    surface_z.push_back(field.reach.center().z());
    const auto ray = ray_in_layer(field.fixture, camera, field.layer, middle.x(), middle.y(), 0.5, 0.5);
    if (!ray) continue;
    RayPacket packet{};
    for (int lane = 0; lane < kPacket; ++lane) packet.direction[2][lane] = 1.0f;
    for (int a = 0; a < 3; ++a) {
      packet.origin[a][0] = static_cast<float>(ray->origin[a]);
      packet.direction[a][0] = static_cast<float>(ray->direction[a]);
    }
    packet.far[0] = static_cast<float>(ray->far);
    packet.valid[0] = -1;
    PacketHits hits;
    tree.intersect(packet, hits);
    if (sheet) {
      const double far = hits.object[0] < 0 ? ray->far : double(hits.distance[0]);
      if (const auto hit = sheet->first(ray->origin, ray->direction, far)) {
        hits.object[0] = 0;
        hits.distance[0] = static_cast<float>(hit->distance);
      }
    }
    if (hits.object[0] < 0 || hits.object[0] >= static_cast<int>(rest.surfaces.size())) continue;
    surface_z.back() = ray->origin.z() + double(hits.distance[0]) * ray->direction.z();
  }
  footprint = make_footprint(field.fixture, camera, field.layer, surface_z, block, settings.rays_across_blur);
}

std::optional<HorizonSettings> DirectRenderer::Parts::find_horizon_settings() const {
  if (settings.samples != 1 || seen_box.isEmpty()) return std::nullopt;
  std::optional<HorizonSettings> found = flattest_light(fixture.field, seen_box);
  if (!found) return found;
  found->pitch = std::min(pixel_mm, kWidestPitch);
  found->seen = seen_box;
  return found;
}

Eigen::AlignedBox2d DirectRenderer::Parts::find_seen_box() const {
  constexpr int kAsked = 16;  // along a side
  const LightField& field = fixture.field;
  Eigen::AlignedBox2d box;
  for (int j = 0; j <= kAsked; ++j) {
    for (int i = 0; i <= kAsked; ++i) {
      const auto ray = ray_in_layer(field.fixture, camera, field.layer, double(width()) * i / kAsked,
                                    double(height()) * j / kAsked, 0.5, 0.5);
      if (!ray) continue;
      for (const double z : {field.reach.min().z(), field.reach.max().z()}) {
        box.extend(place_at_height(*ray, z));
      }
    }
  }
  if (box.isEmpty()) return box;
  const Eigen::Vector2d wider = Eigen::Vector2d::Constant(2.0 * box.sizes().maxCoeff() / kAsked);
  return {box.min() - wider, box.max() + wider};
}

float DirectRenderer::Parts::find_pixel() const {
  constexpr float kUnseen = 0.05f;
  const LightField& field = fixture.field;
  const auto place = [&](double x) -> std::optional<Eigen::Vector2d> {
    const auto ray = ray_in_layer(field.fixture, camera, field.layer, x, 0.5 * height(), 0.5, 0.5);
    if (!ray) return std::nullopt;
    return place_at_height(*ray, field.reach.center().z());
  };
  const auto one = place(0.5 * width());
  const auto next = place(0.5 * width() + 1.0);
  if (!one || !next) return kUnseen;
  const auto apart = static_cast<float>((*next - *one).norm());
  return std::isfinite(apart) && apart > 0.0f ? apart : kUnseen;
}

void DirectRenderer::Parts::keep_by_pixel(const CameraRays& pixels, const std::vector<float>& from,
                                          std::vector<float>& to) const {
  const std::size_t bands = pixels.bands;
  to.resize(static_cast<std::size_t>(width()) * height() * bands);
  for (int row = 0; row < height(); ++row) {
    for (int column = 0; column < width(); ++column) {
      const std::size_t tile =
          static_cast<std::size_t>(row / CameraRays::kSide) * pixels.tiles_across + column / CameraRays::kSide;
      const std::size_t lane = row % CameraRays::kSide * CameraRays::kSide + column % CameraRays::kSide;
      const float gain = footprint.gain[footprint.block_at(row, column)];
      for (std::size_t band = 0; band < bands; ++band) {
        to[(static_cast<std::size_t>(row) * width() + column) * bands + band] =
            gain * from[(tile * kPacket + lane) * bands + band];
      }
    }
  }
}

Scene DirectRenderer::Parts::still_things(const Scene& rest) {
  Scene still;
  still.environment = rest.environment;
  still.surfaces.reserve(rest.surfaces.size());
  still.surfaces.push_back({{}, rest.surfaces[0].material});
  still.surfaces.insert(still.surfaces.end(), rest.surfaces.begin() + 1, rest.surfaces.end());
  still.balls = rest.balls;
  return still;
}

bool DirectRenderer::Parts::stands_still(const Scene& scene) const {
  return scene.balls.empty() && scene.surfaces.size() == others.size() + 1 &&
         std::equal(others.begin(), others.end(), scene.surfaces.begin() + 1,
                    [](const TriangleMesh& one, const Surface& other) {
                      return one.vertices == other.mesh.vertices && one.triangles == other.mesh.triangles;
                    });
}

}  // namespace touchstone::render
