#include "render/direct/direct_renderer.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "core/error.h"
#include "render/cameras/edge_rays.h"
#include "render/direct/direct_fitness.h"
#include "render/direct/direct_parts.h"
#include "render/direct/grid_batches.h"
#include "render/direct/shadow_reach.h"
#include "render/sampling/sample_sequence.h"
#include "render/scene/film_screen.h"
#include "render/scene/sheet_index.h"

namespace touchstone::render {
namespace {

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

void count_up(const std::vector<DirectCounts>& task_counts, DirectImage& image) {
  for (const DirectCounts& counts : task_counts) {
    image.primary += counts.primary;
    image.shadow_rays += counts.shadow_rays;
    image.shadow_spared += counts.spared;
  }
}

}  // namespace

void DirectRenderer::Parts::cast(const DirectFrame& frame, const SamplePart& part, DirectImage& image) {
  const int bands = rays.bands;
  const int samples = settings.samples;
  const int columns = rays.grid.columns;
  const std::size_t points = static_cast<std::size_t>(columns) * rays.grid.rows;
  if (samples == 1) sheet_triangles.assign(points, -1);
  const std::array<float, kMaxBands> whole = [] {
    std::array<float, kMaxBands> ones;
    ones.fill(1.0f);
    return ones;
  }();
  const auto counted = for_batches(rays, frame, [&](DirectBatch& batch, int first, int packets, DirectCounts& counts) {
    for (int sample = part.first; sample < samples; sample += part.step) {
      const std::size_t number = static_cast<std::size_t>(sample) * rays.tiles + first;
      batch.intersect({rays.packets.data() + number, static_cast<std::size_t>(packets)}, counts);
      const auto for_lanes = [&](const auto& work) { for_lanes_on_grid(rays, first, packets, work); };
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
        if (samples == 1) sheet_triangles[point] = batch.sheet_triangle(lane);
        float memory[kMaxBands];
        const float* ambient = bounced_at(batch, lane, point, memory);
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
  });
  count_up(counted, image);
}

const float* DirectRenderer::Parts::bounced_at(const DirectBatch& batch, int lane, std::size_t point,
                                               float* memory) const {
  if (bounced.empty()) return nullptr;
  const auto bands = static_cast<std::size_t>(rays.bands);
  const float* const at_rest = bounced.data() + point * bands;
  if (rest_normals.empty()) return at_rest;
  const float* const before = rest_normals.data() + 3 * point;
  const auto met = batch.sheet_place(lane);
  if (!met || (before[0] == 0.0f && before[1] == 0.0f && before[2] == 0.0f)) return at_rest;
  const float* const now = met->normal;
  const float cosine = std::min(before[0] * now[0] + before[1] * now[1] + before[2] * now[2], 1.0f);
  const float sheet = 0.5f * (1.0f - cosine);
  for (std::size_t band = 0; band < bands; ++band) {
    memory[band] = (1.0f - sheet) * at_rest[band] + sheet * rest_sends[point * bands + band];
  }
  return memory;
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
  for_batches(rays, frame, [&](DirectBatch& batch, int first, int packets, DirectCounts& counts) {
    batch.intersect({rays.packets.data() + first, static_cast<std::size_t>(packets)}, counts);
    if (frame.shadow_reach != nullptr) batch.cast_shadows(counts);
    for_lanes_on_grid(rays, first, packets, [&](int lane, int row, int column) {
      const std::size_t point = static_cast<std::size_t>(row) * rays.grid.columns + column;
      float memory[kMaxBands];
      const float* ambient = bounced_at(batch, lane, point, memory);
      const auto met = batch.sheet_place(lane);
      if (!met) {
        std::array<float, kMaxBands> other{};
        batch.add(lane, whole.data(), ambient, other.data());
        for (int band = 0; band < bands; ++band) out.others[band * count + point] = other[band];
        return;
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
      const RayPacket& packet = rays.packets[first + lane / kPacket];
      for (int axis = 0; axis < 3; ++axis) {
        out.places[3 * point + axis] = met->place[axis];
        out.directions[3 * point + axis] = packet.direction[axis][lane % kPacket];
      }
    });
  });
  return out;
}

std::vector<std::int32_t> DirectRenderer::Parts::triangles_by_pixel() const {
  if (settings.samples != 1 || rays.grid.spacing != 1.0) return {};
  const auto first = [](double at) { return static_cast<int>(std::lround(0.5 - at)); };
  std::vector<std::int32_t> by_pixel;
  by_pixel.reserve(static_cast<std::size_t>(width()) * height());
  for (int row = 0; row < height(); ++row) {
    const auto from = sheet_triangles.begin() +
                      static_cast<std::ptrdiff_t>(first(rays.grid.top) + row) * rays.grid.columns +
                      first(rays.grid.left);
    by_pixel.insert(by_pixel.end(), from, from + width());
  }
  return by_pixel;
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
        for (int ray = 0; ray < rays_a_point; ++ray) {
          batch.take_as_known(k * rays_a_point + ray, known);
        }
      }
      batch.cast_shadows(task_counts[task]);
    }
    for (int k = 0; k < count; ++k) {
      const std::size_t point = edges[first + k];
      float out[kMaxBands] = {};
      for (int ray = 0; ray < rays_a_point; ++ray) {
        const int lane = k * rays_a_point + ray;
        float memory[kMaxBands];
        batch.add(lane, share.data(), bounced_at(batch, lane, point, memory), out);
      }
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
  parts.rest_normals.clear();
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
  const ShadowReach* reach = made->shadow_reach ? &*made->shadow_reach : nullptr;
  made->frame.emplace(DirectFrame{fixture, made->other ? *made->other : tree, made->sheet ? &*made->sheet : nullptr,
                                  reach, made->horizons ? &*made->horizons : nullptr, made->materials});
  return made;
}

void DirectRenderer::set_bounced_light(const cv::Mat& irradiance, const Scene& rest) {
  set_bounced_light(irradiance);
  Parts& parts = *parts_;
  // Of one ray a point; those of several go all over a pixel, and films dim what a sheet sends itself.
  if (irradiance.empty() || parts.settings.samples > 1 || !parts.films.empty()) return;
  const auto prepared = parts.prepare(rest);
  const auto bands = static_cast<std::size_t>(parts.rays.bands);
  const std::size_t points = static_cast<std::size_t>(parts.rays.grid.columns) * parts.rays.grid.rows;
  std::vector<float> normals(3 * points, 0.0f);
  parts.rest_sends.assign(bands * points, 0.0f);
  for_batches(parts.rays, *prepared->frame, [&](DirectBatch& batch, int first, int packets, DirectCounts& counts) {
    batch.intersect({parts.rays.packets.data() + first, static_cast<std::size_t>(packets)}, counts);
    if (prepared->frame->shadow_reach != nullptr) batch.cast_shadows(counts);
    for_lanes_on_grid(parts.rays, first, packets, [&](int lane, int row, int column) {
      const auto met = batch.sheet_place(lane);
      if (!met) return;
      const std::size_t point = static_cast<std::size_t>(row) * parts.rays.grid.columns + column;
      std::copy_n(met->normal, 3, normals.begin() + static_cast<std::ptrdiff_t>(3 * point));
      batch.sent_back(lane, parts.bounced.data() + point * bands, parts.rest_sends.data() + point * bands);
    });
  });
  parts.rest_normals = std::move(normals);
}

DirectImage DirectRenderer::render(const Scene& scene, const SamplePart& part) {
  Parts& parts = *parts_;
  const int samples = parts.settings.samples;
  TS_ASSERT(part.step >= 1 && part.first >= 0 && part.first < samples);
  const auto prepared = parts.prepare(scene);
  DirectImage image;
  image.irradiance = cv::Mat::zeros(parts.height(), parts.width(), CV_32FC(parts.rays.bands));
  parts.cast(*prepared->frame, part, image);
  const int drawn = (samples - part.first + part.step - 1) / part.step;
  if (drawn < samples) image.irradiance *= static_cast<double>(samples) / drawn;  // each ray brings its share of all
  image.sheet_triangle = parts.triangles_by_pixel();
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
