#include "render/direct/direct_renderer.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/error.h"
#include "render/cameras/camera_footprint.h"
#include "render/cameras/camera_rays.h"
#include "render/cameras/edge_rays.h"
#include "render/direct/direct_batch.h"
#include "render/direct/direct_fitness.h"
#include "render/direct/shadow_reach.h"
#include "render/direct/sheet_horizons.h"
#include "render/materials/ggx.h"
#include "render/sampling/sample_sequence.h"
#include "render/scene/film_screen.h"
#include "render/scene/packet_scene.h"

namespace touchstone::render {
namespace {

constexpr int kTilesATask = 2 * DirectBatch::kMostPackets;
constexpr int kBlocksAcross = 20;      // of the footprint
constexpr double kLampSpread = 0.5;    // of the films' distance: standard deviation of where lamps' light crosses them
constexpr float kWidestPitch = 0.06f;  // mm, of horizons: contacts cast shadows of some tenths of a millimetre
constexpr double kSharp = 4.0;         // pixels: a wider blur takes the mean of a dozen rays anyway

void check_settings(const DirectSettings& settings) {
  if (settings.samples < 1 || settings.samples > 64) {
    fail("direct renderer: samples is {}; it must be from 1 to 64", settings.samples);
  }
  if (settings.edge_side != 1 && settings.edge_side != 2 && settings.edge_side != 4) {
    fail("direct renderer: edge_side is {}; it must be 1, 2 or 4", settings.edge_side);
  }
  if (!(settings.edge_contrast >= 0.0) || !std::isfinite(settings.edge_contrast)) {
    fail("direct renderer: edge_contrast is {}; it must be 0 or more", settings.edge_contrast);
  }
  if (!(settings.rays_across_blur >= 1.0 && settings.rays_across_blur <= 64.0)) {
    fail("direct renderer: rays_across_blur is {}; it must be from 1 to 64", settings.rays_across_blur);
  }
}

/// x and y of where a ray has the height z.
Eigen::Vector2d place_at_height(const LayerRay& ray, double z) {
  return (ray.origin + (z - ray.origin.z()) / ray.direction.z() * ray.direction).head<2>();
}

/// The scene with nothing of its first surface.
Scene without_first(const Scene& scene) {
  Scene rest;
  rest.environment = scene.environment;
  rest.surfaces.reserve(scene.surfaces.size());
  rest.surfaces.push_back({{}, scene.surfaces[0].material});
  rest.surfaces.insert(rest.surfaces.end(), scene.surfaces.begin() + 1, scene.surfaces.end());
  rest.balls = scene.balls;
  return rest;
}

}  // namespace

struct DirectRenderer::Parts {
  DirectFixture fixture;
  ReadyCamera camera;
  DirectSettings settings;
  float pixel_mm;                // between the rays of pixels beside each other, in the middle of the field's box
  Eigen::AlignedBox2d seen_box;  // x and y of all that rays to the field's layer pass between its lowest and highest
  std::optional<HorizonSettings> horizon_settings;  // where one sample is taken and light comes from one side
  bool lone_sheet;  // the first surface alone casts shadows: asked for by SheetIndex and SheetHorizons, not in `tree`
  std::vector<TriangleMesh> others;  // of a lone sheet: all but the first surface, at rest
  PacketScene tree;
  std::vector<Surface> films;
  bool connected;        // the first surface
  bool spreads;          // central rays, then the footprint
  bool refines = false;  // more rays at edges
  CameraFootprint footprint;
  CameraRays rays;
  // By pixel and band, where central rays are spread; see CameraRays.
  std::vector<float> through, veil;
  std::vector<float> radiance;                // [band][grid point], memory for a frame
  std::vector<DirectBatch::Visibility> seen;  // by grid point, where edges get more rays
  std::vector<float> bounced;                 // [grid point][band], irradiance; empty for none
  std::map<double, GgxAlbedo> conductors;     // by roughness

  Parts(const LightField& field, const Camera& camera_of, const Scene& rest, const DirectSettings& settings_of)
      : fixture(field, settings_of.samples > 1),
        camera(make_ready(camera_of)),
        settings(settings_of),
        pixel_mm(find_pixel()),
        seen_box(find_seen_box()),
        horizon_settings(find_horizon_settings()),
        lone_sheet(is_lone_sheet(rest)),
        tree(lone_sheet ? without_first(rest) : rest),
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

  int width() const { return size_of_grid(pixel_grid(camera)).x(); }
  int height() const { return size_of_grid(pixel_grid(camera)).y(); }

  bool is_lone_sheet(const Scene& scene) const {
    return horizon_settings.has_value() && is_sheet_alone(fixture.bearings, scene);
  }
  /// Does all but the first surface stand where it stood at rest?
  bool stands_still(const Scene& scene) const {
    return scene.balls.empty() && scene.surfaces.size() == others.size() + 1 &&
           std::equal(others.begin(), others.end(), scene.surfaces.begin() + 1,
                      [](const TriangleMesh& one, const Surface& other) {
                        return one.vertices == other.mesh.vertices && one.triangles == other.mesh.triangles;
                      });
  }

  /// Casts the rays and shades what they meet: into `radiance`, or into the picture where nothing is spread.
  void cast(const DirectFrame& frame, DirectImage& image);
  /// Casts more rays where `radiance` has edges.
  void refine(const DirectFrame& frame, DirectImage& image);
  /// From `radiance` to the picture.
  void spread(DirectImage& image) const;
  DirectImage dark() const {
    DirectImage image;
    image.irradiance = cv::Mat::zeros(height(), width(), CV_32FC(rays.bands));
    return image;
  }

  struct Prepared;
  /// Looks a scene over and gets all ready that its rays will ask for. @throws Error as render
  std::unique_ptr<Prepared> prepare(const Scene& scene);
  /// What the rays of one picture meet of the sheet, its first surface.
  SheetPoints points_of(const DirectFrame& frame, const Surface& sheet) const;

 private:
  DirectBatch::Visibility known_round(int point) const;

  static Eigen::Vector2i size_of_grid(const ImageGrid& grid) { return {grid.columns, grid.rows}; }

  /// What the hole or lens sees of a point at rest it sees through a disc of the films' plane; lamps' light rises to
  /// the membrane so flat that it comes from about as far aside as films are below.
  void set_up_films(const Scene& rest) {
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

  /// The footprint on what the scene shows at rest, by block; in the middle of the field's box where it shows nothing.
  void find_footprint(const Scene& rest) {
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

  std::optional<HorizonSettings> find_horizon_settings() const {
    if (settings.samples != 1 || seen_box.isEmpty()) return std::nullopt;
    std::optional<HorizonSettings> found = flattest_light(fixture.field, seen_box);
    if (!found) return found;
    found->pitch = std::min(pixel_mm, kWidestPitch);
    found->seen = seen_box;
    return found;
  }

  /// Of a coarse grid of pixels, with what lies beside the outermost by half its spacing and by the blur.
  Eigen::AlignedBox2d find_seen_box() const {
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

  float find_pixel() const {
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

  void keep_by_pixel(const CameraRays& pixels, const std::vector<float>& from, std::vector<float>& to) const {
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
};

namespace {

void count_up(const std::vector<DirectCounts>& task_counts, DirectImage& image) {
  for (const DirectCounts& counts : task_counts) {
    image.primary += counts.primary;
    image.shadow_rays += counts.shadow_rays;
    image.shadow_spared += counts.spared;
  }
}

}  // namespace

void DirectRenderer::Parts::cast(const DirectFrame& frame, DirectImage& image) {
  const int bands = rays.bands;
  const int samples = settings.samples;
  const int columns = rays.grid.columns;
  const int tasks = (rays.tiles + kTilesATask - 1) / kTilesATask;
  const std::size_t points = static_cast<std::size_t>(columns) * rays.grid.rows;
  const std::array<float, kMaxBands> whole = [] {
    std::array<float, kMaxBands> ones;
    ones.fill(1.0f);
    return ones;
  }();
  std::vector<DirectCounts> task_counts(tasks);
  tbb::parallel_for(0, tasks, [&](int task) {
    DirectBatch batch(frame);
    DirectCounts& counts = task_counts[task];
    const int task_end = std::min(rays.tiles, (task + 1) * kTilesATask);
    for (int first = task * kTilesATask; first < task_end; first += DirectBatch::kMostPackets) {
      const int packets = std::min(DirectBatch::kMostPackets, task_end - first);
      for (int sample = 0; sample < samples; ++sample) {
        const std::size_t number = static_cast<std::size_t>(sample) * rays.tiles + first;
        batch.intersect({rays.packets.data() + number, static_cast<std::size_t>(packets)}, counts);
        const auto for_lanes = [&](auto&& work) {  // work(lane, row, column) of those on the grid
          for (int lane = 0; lane < packets * kPacket; ++lane) {
            const int tile = first + lane / kPacket;
            const int row = tile / rays.tiles_across * CameraRays::kSide + lane % kPacket / CameraRays::kSide;
            const int column = tile % rays.tiles_across * CameraRays::kSide + lane % CameraRays::kSide;
            if (column < columns && row < rays.grid.rows) work(lane, row, column);
          }
        };
        if (frame.shadow_reach != nullptr && samples > 1) {
          for_lanes([&](int lane, int row, int column) {
            SampleSequence numbers(settings.seed,
                                   static_cast<std::uint64_t>(row) * std::uint64_t(columns) + std::uint64_t(column),
                                   static_cast<std::uint32_t>(sample));
            for (int drawn = 0; drawn < 3; ++drawn) numbers.next_pair();  // as a path's: pixel, hole, lamp
            const auto [u, v] = numbers.next_pair();
            batch.choose_lens_points(lane, u, v);
          });
        }
        if (frame.shadow_reach != nullptr) batch.cast_shadows(counts);
        for_lanes([&](int lane, int row, int column) {
          const std::size_t point = static_cast<std::size_t>(row) * columns + column;
          const float* ambient = bounced.empty() ? nullptr : bounced.data() + point * bands;
          if (spreads) {
            float out[kMaxBands] = {};
            batch.add(lane, whole.data(), ambient, out);
            for (int band = 0; band < bands; ++band) radiance[band * points + point] = out[band];
            if (!seen.empty() && frame.shadow_reach != nullptr) seen[point] = batch.visibility(lane);
            return;
          }
          float* out = image.irradiance.ptr<float>(row) + bands * column;
          const std::size_t slot = (number * kPacket + lane) * bands;
          if (!rays.veil.empty()) {
            for (int band = 0; band < bands; ++band) out[band] += rays.veil[slot + band];
          }
          batch.add(lane, rays.through.data() + slot, ambient, out);
        });
      }
    }
  });
  count_up(task_counts, image);
}

SheetPoints DirectRenderer::Parts::points_of(const DirectFrame& frame, const Surface& sheet) const {
  const int bands = rays.bands;
  const std::vector<Eigen::Vector2d>& material = sheet.print->material_mm;
  SheetPoints out;
  out.grid = rays.grid;
  out.bands = bands;
  const std::size_t count = out.count();
  const int stride = out.stride();
  out.values.assign(count * stride, 0.0f);
  out.places.assign(count * 3, 0.0f);
  out.directions.assign(count * 3, 0.0f);
  out.on_sheet.assign(count, 0);
  out.others.assign(count * bands, 0.0f);
  const std::vector<float> whole(bands, 1.0f);
  const int tasks = (rays.tiles + kTilesATask - 1) / kTilesATask;
  tbb::parallel_for(0, tasks, [&](int task) {
    DirectBatch batch(frame);
    DirectCounts counts;
    const int task_end = std::min(rays.tiles, (task + 1) * kTilesATask);
    for (int first = task * kTilesATask; first < task_end; first += DirectBatch::kMostPackets) {
      const int packets = std::min(DirectBatch::kMostPackets, task_end - first);
      batch.intersect({rays.packets.data() + first, static_cast<std::size_t>(packets)}, counts);
      if (frame.shadow_reach != nullptr) batch.cast_shadows(counts);
      for (int lane = 0; lane < packets * kPacket; ++lane) {
        const int tile = first + lane / kPacket;
        const int row = tile / rays.tiles_across * CameraRays::kSide + lane % kPacket / CameraRays::kSide;
        const int column = tile % rays.tiles_across * CameraRays::kSide + lane % CameraRays::kSide;
        if (column >= rays.grid.columns || row >= rays.grid.rows) continue;
        const std::size_t point = static_cast<std::size_t>(row) * rays.grid.columns + column;
        const float* ambient = bounced.empty() ? nullptr : bounced.data() + point * bands;
        const auto met = batch.sheet_place(lane);
        if (!met) {
          std::array<float, kMaxBands> other{};
          batch.add(lane, whole.data(), ambient, other.data());
          for (int band = 0; band < bands; ++band) out.others[band * count + point] = other[band];
          continue;
        }
        out.on_sheet[point] = 1;
        const auto& corners = sheet.mesh.triangles[met->triangle];
        const double u = met->u;
        const double v = met->v;
        const Eigen::Vector2d at =
            (1.0 - u - v) * material[corners[0]] + u * material[corners[1]] + v * material[corners[2]];
        float* values = out.values.data() + point * stride;
        values[0] = static_cast<float>(at.x());
        values[1] = static_cast<float>(at.y());
        const float down = std::max(-met->normal[2], 1e-6f);
        values[2] = met->normal[0] / down;
        values[3] = met->normal[1] / down;
        batch.white_light(lane, ambient, values + SheetPoints::kGeometry);
        const RayPacket& packet = rays.packets[tile];
        for (int axis = 0; axis < 3; ++axis) {
          out.places[3 * point + axis] = met->place[axis];
          out.directions[3 * point + axis] = packet.direction[axis][lane % kPacket];
        }
      }
    }
  });
  return out;
}

/// A lamp that is seen, or hidden, from a point and all eight next ones is taken to be so from all between them.
DirectBatch::Visibility DirectRenderer::Parts::known_round(int point) const {
  const int columns = rays.grid.columns;
  const int row = point / columns;
  const int column = point % columns;
  DirectBatch::Visibility known{~std::uint64_t{0}, ~std::uint64_t{0}};
  for (int j = std::max(row - 1, 0); j <= std::min(row + 1, rays.grid.rows - 1); ++j) {
    for (int i = std::max(column - 1, 0); i <= std::min(column + 1, columns - 1); ++i) {
      const DirectBatch::Visibility& one = seen[static_cast<std::size_t>(j) * columns + i];
      known.open &= one.open;
      known.hidden &= one.hidden;
    }
  }
  return known;
}

void DirectRenderer::Parts::refine(const DirectFrame& frame, DirectImage& image) {
  const std::vector<int> edges = edge_points(radiance, rays.grid, rays.bands, settings.edge_contrast);
  image.edge_pixels = edges.size();
  const int bands = rays.bands;
  const std::size_t points = static_cast<std::size_t>(rays.grid.columns) * rays.grid.rows;
  const int rays_a_point = settings.edge_side * settings.edge_side;
  const int points_a_packet = kPacket / rays_a_point;
  const int points_a_task = DirectBatch::kMostPackets * points_a_packet;
  const auto tasks = static_cast<int>((edges.size() + points_a_task - 1) / points_a_task);
  std::array<float, kMaxBands> share;
  share.fill(1.0f / static_cast<float>(rays_a_point));
  std::vector<DirectCounts> task_counts(tasks);
  tbb::parallel_for(0, tasks, [&](int task) {
    const int first = task * points_a_task;
    const int count = std::min(points_a_task, static_cast<int>(edges.size()) - first);
    std::vector<RayPacket> packets((count + points_a_packet - 1) / points_a_packet);
    for (RayPacket& packet : packets) {
      packet = RayPacket{};
      std::fill_n(packet.direction[2], kPacket, 1.0f);
    }
    for (int k = 0; k < count; ++k) {
      put_edge_rays(rays, edges[first + k], settings.edge_side, packets[k / points_a_packet],
                    k % points_a_packet * rays_a_point);
    }
    DirectBatch batch(frame);
    batch.intersect(packets, task_counts[task]);
    if (frame.shadow_reach != nullptr) {
      for (int k = 0; k < count; ++k) {
        const DirectBatch::Visibility known = known_round(edges[first + k]);
        for (int ray = 0; ray < rays_a_point; ++ray) batch.take_as_known(k * rays_a_point + ray, known);
      }
      batch.cast_shadows(task_counts[task]);
    }
    for (int k = 0; k < count; ++k) {
      const std::size_t point = edges[first + k];
      const float* ambient = bounced.empty() ? nullptr : bounced.data() + point * bands;
      float out[kMaxBands] = {};
      for (int ray = 0; ray < rays_a_point; ++ray) batch.add(k * rays_a_point + ray, share.data(), ambient, out);
      for (int band = 0; band < bands; ++band) radiance[band * points + point] = out[band];
    }
  });
  count_up(task_counts, image);
}

void DirectRenderer::Parts::spread(DirectImage& image) const {
  const int bands = rays.bands;
  const int side = footprint.spacing;
  const std::size_t points = static_cast<std::size_t>(rays.grid.columns) * rays.grid.rows;
  const int columns = width();
  tbb::parallel_for(0, height(), [&](int row) {
    std::vector<float> line(footprint.block);
    float* out = image.irradiance.ptr<float>(row);
    const std::size_t first = static_cast<std::size_t>(row) * columns;
    for (int left = 0; left < columns; left += footprint.block) {
      const int right = std::min(columns, left + footprint.block);
      for (int phase = left; phase < std::min(left + side, right); ++phase) {
        const int count = (right - phase + side - 1) / side;
        for (int band = 0; band < bands; ++band) {
          footprint.spread(radiance.data() + band * points, row, phase, count, line.data());
          for (int k = 0; k < count; ++k) {
            const std::size_t slot = (first + phase + static_cast<std::size_t>(k) * side) * bands + band;
            out[slot - first * bands] = through[slot] * line[k] + (veil.empty() ? 0.0f : veil[slot]);
          }
        }
      }
    }
  });
}

DirectRenderer::DirectRenderer(const LightField& field, const Camera& camera, const Scene& rest,
                               const DirectSettings& settings) {
  check_settings(settings);
  check_scene(rest);
  if (field.beam_count() > kMostDirectLamps) {
    fail("direct renderer: {} beams of {} lamps; at most {} are allowed", field.beam_count(),
         field.fixture.lamps.size(), kMostDirectLamps);
  }
  if (const std::string fault = unfit_for_direct(field, rest); !fault.empty()) fail("direct renderer: {}", fault);
  parts_ = std::make_unique<Parts>(field, camera, rest, settings);
}

DirectRenderer::~DirectRenderer() = default;
DirectRenderer::DirectRenderer(DirectRenderer&&) noexcept = default;

void DirectRenderer::set_bounced_light(const cv::Mat& irradiance) {
  Parts& parts = *parts_;
  const int bands = parts.rays.bands;
  parts.bounced.clear();
  if (irradiance.empty()) return;
  if (irradiance.type() != CV_32FC(bands) || irradiance.cols != parts.width() || irradiance.rows != parts.height()) {
    fail("direct renderer: bounced light has {} x {} pixels of {} channels; {} x {} of {} are needed (32-bit floats)",
         irradiance.cols, irradiance.rows, irradiance.channels(), parts.width(), parts.height(), bands);
  }
  if (!cv::checkRange(irradiance)) fail("direct renderer: bounced light isn't finite everywhere");
  const ImageGrid& grid = parts.rays.grid;
  for (int row = 0; row < grid.rows; ++row) {
    const int y = std::clamp(static_cast<int>(std::floor(grid.top + grid.spacing * row)), 0, parts.height() - 1);
    for (int column = 0; column < grid.columns; ++column) {
      const int x = std::clamp(static_cast<int>(std::floor(grid.left + grid.spacing * column)), 0, parts.width() - 1);
      const float* from = irradiance.ptr<float>(y) + bands * x;
      parts.bounced.insert(parts.bounced.end(), from, from + bands);
    }
  }
}

/// All that a frame's drawing needs, in one place that stays.
struct DirectRenderer::Parts::Prepared {
  std::optional<SheetIndex> sheet;
  std::optional<SheetHorizons> horizons;
  std::optional<PacketScene> other;
  std::vector<DirectMaterial> materials;
  std::vector<std::unique_ptr<const DirectPrint>> prints;
  std::optional<ShadowReach> shadow_reach;
  std::optional<DirectFrame> frame;
};

std::unique_ptr<DirectRenderer::Parts::Prepared> DirectRenderer::Parts::prepare(const Scene& scene) {
  check_scene(scene);
  const std::string fault = unfit_for_direct(fixture.field, scene, !bounced.empty());
  if (!fault.empty()) fail("direct renderer: {}", fault);
  std::vector<Surface> scene_films;
  std::ranges::copy_if(scene.surfaces, std::back_inserter(scene_films), is_film);
  if (!std::ranges::equal(scene_films, films, same_film)) {
    fail("direct renderer: the scene's films aren't those that it was made for");
  }
  auto made = std::make_unique<Prepared>();
  if (lone_sheet && stands_still(scene)) {
    const Surface& first = scene.surfaces[0];
    if (settings.shadows) made->horizons = SheetHorizons::find(first.mesh, *horizon_settings);
    if (made->horizons || !settings.shadows) made->sheet.emplace(first, seen_box);
  }
  if (!made->sheet && (lone_sheet || !tree.move_to(scene))) made->other.emplace(scene);

  for (const Surface& surface : scene.surfaces) {
    made->materials.push_back(direct_material(surface.material, conductors));
    if (surface.print) made->materials.back().print = made->prints.emplace_back(new DirectPrint(surface)).get();
  }
  for (const Ball& ball : scene.balls) made->materials.push_back(direct_material(ball.material, conductors));
  if (settings.shadows && !made->horizons) {
    made->shadow_reach.emplace(
        fixture.bearings, scene,
        made->other ? !scene.surfaces.empty() && is_connected(scene.surfaces[0].mesh) : connected);
  }
  made->frame.emplace(DirectFrame{fixture, made->other ? *made->other : tree, made->sheet ? &*made->sheet : nullptr,
                                  made->shadow_reach ? &*made->shadow_reach : nullptr,
                                  made->horizons ? &*made->horizons : nullptr, made->materials});
  return made;
}

DirectImage DirectRenderer::render(const Scene& scene) {
  Parts& parts = *parts_;
  const auto prepared = parts.prepare(scene);
  DirectImage image = parts.dark();
  parts.cast(*prepared->frame, image);
  if (parts.spreads) {
    if (parts.refines) parts.refine(*prepared->frame, image);
    parts.spread(image);
  }
  return image;
}

std::optional<SheetPoints> DirectRenderer::sheet_points(const Scene& scene) {
  Parts& parts = *parts_;
  if (!parts.spreads || !parts.films.empty() || scene.surfaces.empty() || !scene.surfaces[0].print) return std::nullopt;
  if (!std::holds_alternative<Lambertian>(scene.surfaces[0].material)) return std::nullopt;
  const auto prepared = parts.prepare(scene);
  return parts.points_of(*prepared->frame, scene.surfaces[0]);
}

void DirectRenderer::picture_of(std::vector<float>& radiance, cv::Mat& irradiance) {
  Parts& parts = *parts_;
  TS_ASSERT(parts.spreads && radiance.size() == parts.radiance.size());
  std::swap(parts.radiance, radiance);
  irradiance.create(parts.height(), parts.width(), CV_32FC(parts.rays.bands));
  DirectImage image;
  image.irradiance = irradiance;
  parts.spread(image);
}

}  // namespace touchstone::render
