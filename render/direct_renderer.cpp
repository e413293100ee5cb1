#include "render/direct_renderer.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "core/error.h"
#include "render/camera_rays.h"
#include "render/direct_packet.h"
#include "render/ggx.h"
#include "render/packet_scene.h"
#include "render/sample_sequence.h"
#include "render/shadow_reach.h"

namespace touchstone::render {
namespace {

constexpr int kTilesATask = 32;

bool same(const Spectrum& a, const Spectrum& b) {
  return a.size() == b.size() && (a == b).all();
}

bool same_fixture(const Scene& a, const Scene& b) {
  return std::equal(
             a.media.begin(), a.media.end(), b.media.begin(), b.media.end(),
             [](const Medium& m, const Medium& n) { return m.index == n.index && same(m.absorption, n.absorption); }) &&
         std::equal(a.faces.begin(), a.faces.end(), b.faces.begin(), b.faces.end(),
                    [](const FlatFace& f, const FlatFace& g) {
                      return f.z == g.z && f.medium_below == g.medium_below && f.medium_above == g.medium_above;
                    }) &&
         std::equal(a.lamps.begin(), a.lamps.end(), b.lamps.begin(), b.lamps.end(), same_lamp) &&
         same(a.environment, b.environment);
}

bool renders(const Material& material) {
  return std::holds_alternative<Lambertian>(material) || std::holds_alternative<RoughConductor>(material) ||
         std::holds_alternative<Black>(material) || std::holds_alternative<Emitter>(material);
}

bool is_lit(const Material& material) {
  return std::holds_alternative<Lambertian>(material) || std::holds_alternative<RoughConductor>(material);
}

/// Single precision, and a vertex that was laid onto a face.
constexpr double kSlack = 1e-4;  // mm

std::string out_of_place(const LightField& field, const Eigen::AlignedBox3d& box, const Material& material,
                         const std::string& what) {
  if (box.isEmpty()) return {};
  const std::vector<FlatFace>& faces = field.fixture.faces;
  const double low = field.layer > 0 ? faces[field.layer - 1].z : -INFINITY;
  const double high = field.layer < static_cast<int>(faces.size()) ? faces[field.layer].z : INFINITY;
  if (box.min().z() < low - kSlack || box.max().z() > high + kSlack) {
    return fmt::format("{} reaches from z {} to {}; the light field's layer is from {} to {}", what, box.min().z(),
                       box.max().z(), low, high);
  }
  const Eigen::AlignedBox3d reach(field.reach.min().array() - kSlack, field.reach.max().array() + kSlack);
  if (is_lit(material) && !reach.contains(box)) {
    return fmt::format(
        "{} reaches from ({}, {}, {}) to ({}, {}, {}); the light field's box is from ({}, {}, {}) to ({}, {}, {})",
        what, box.min().x(), box.min().y(), box.min().z(), box.max().x(), box.max().y(), box.max().z(),
        field.reach.min().x(), field.reach.min().y(), field.reach.min().z(), field.reach.max().x(),
        field.reach.max().y(), field.reach.max().z());
  }
  return {};
}

void check_settings(const DirectSettings& settings) {
  if (settings.samples < 1 || settings.samples > 64) {
    fail("direct renderer: samples is {}; it must be from 1 to 64", settings.samples);
  }
}

}  // namespace

std::string unfit_for_direct(const LightField& field, const Scene& scene) {
  if (scene.interreflection) return "the scene asks for interreflection";
  if (!same_fixture(field.fixture, scene)) {
    return "the scene's media, faces, lamps or surroundings aren't those that the light field was made for";
  }
  for (std::size_t i = 0; i < scene.surfaces.size(); ++i) {
    const std::string what = fmt::format("surface {}", i);
    const Surface& surface = scene.surfaces[i];
    if (!renders(surface.material)) return what + " is neither Lambertian, RoughConductor, Black nor Emitter";
    Eigen::AlignedBox3d box;
    for (const auto& vertex : surface.mesh.vertices) box.extend(vertex);
    if (const std::string fault = out_of_place(field, box, surface.material, what); !fault.empty()) return fault;
  }
  for (std::size_t i = 0; i < scene.balls.size(); ++i) {
    const std::string what = fmt::format("ball {}", i);
    const Ball& ball = scene.balls[i];
    if (!renders(ball.material)) return what + " is neither Lambertian, RoughConductor, Black nor Emitter";
    const Eigen::AlignedBox3d box(ball.centre.array() - ball.radius, ball.centre.array() + ball.radius);
    if (const std::string fault = out_of_place(field, box, ball.material, what); !fault.empty()) return fault;
  }
  return {};
}

struct DirectRenderer::Parts {
  DirectFixture fixture;
  PinholeCamera camera;
  DirectSettings settings;
  CameraRays rays;
  PacketScene tree;
  bool connected;                          // the first surface
  std::map<double, GgxAlbedo> conductors;  // by roughness

  Parts(const LightField& field, const PinholeCamera& camera_of, const Scene& rest, const DirectSettings& settings_of)
      : fixture(field),
        camera(camera_of),
        settings(settings_of),
        rays(trace_to_layer(field.fixture, camera, field.layer, settings.samples, settings.seed)),
        tree(rest),
        connected(!rest.surfaces.empty() && is_connected(rest.surfaces[0].mesh)) {}

  DirectMaterial prepare(const Material& material) {
    DirectMaterial made;
    const auto take = [&](const Spectrum& from) {
      for (Eigen::Index band = 0; band < from.size(); ++band) made.colour[band] = static_cast<float>(from[band]);
    };
    if (const auto* lambertian = std::get_if<Lambertian>(&material)) {
      made.kind = DirectKind::kMatt;
      take(lambertian->albedo);
    } else if (const auto* conductor = std::get_if<RoughConductor>(&material)) {
      made.kind = DirectKind::kMetal;
      take(conductor->reflectance);
      made.roughness = conductor->roughness;
      made.albedo = &conductors.try_emplace(made.roughness, made.roughness).first->second;
    } else if (const auto* emitter = std::get_if<Emitter>(&material)) {
      made.kind = DirectKind::kLuminous;
      take(emitter->radiance);
    }
    return made;
  }
};

DirectRenderer::DirectRenderer(const LightField& field, const PinholeCamera& camera, const Scene& rest,
                               const DirectSettings& settings) {
  check_camera(camera);
  check_settings(settings);
  check_scene(rest);
  if (field.lamp_count() > kMostDirectLamps) {
    fail("direct renderer: {} lamps; at most {} are allowed", field.lamp_count(), kMostDirectLamps);
  }
  if (const std::string fault = unfit_for_direct(field, rest); !fault.empty()) fail("direct renderer: {}", fault);
  parts_ = std::make_unique<Parts>(field, camera, rest, settings);
}

DirectRenderer::~DirectRenderer() = default;
DirectRenderer::DirectRenderer(DirectRenderer&&) noexcept = default;

DirectImage DirectRenderer::render(const Scene& scene) {
  Parts& parts = *parts_;
  const LightField& field = parts.fixture.field;
  check_scene(scene);
  if (const std::string fault = unfit_for_direct(field, scene); !fault.empty()) fail("direct renderer: {}", fault);
  std::optional<PacketScene> other;
  if (!parts.tree.move_to(scene)) other.emplace(scene);
  const PacketScene& tree = other ? *other : parts.tree;

  std::vector<DirectMaterial> materials;
  for (const Surface& surface : scene.surfaces) materials.push_back(parts.prepare(surface.material));
  for (const Ball& ball : scene.balls) materials.push_back(parts.prepare(ball.material));
  const ShadowReach shadow_reach(
      scene, other ? !scene.surfaces.empty() && is_connected(scene.surfaces[0].mesh) : parts.connected);

  const DirectFrame frame{parts.fixture, tree, shadow_reach, materials};
  const int bands = parts.rays.bands;
  const int samples = parts.settings.samples;
  DirectImage image;
  image.irradiance = cv::Mat::zeros(parts.camera.height, parts.camera.width, CV_32FC(bands));
  const int tiles = parts.rays.tiles;
  const int tasks = (tiles + kTilesATask - 1) / kTilesATask;
  std::vector<DirectCounts> task_counts(tasks);
  tbb::parallel_for(0, tasks, [&](int task) {
    DirectPacket packet(frame);
    DirectCounts& counts = task_counts[task];
    for (int tile = task * kTilesATask; tile < std::min(tiles, (task + 1) * kTilesATask); ++tile) {
      const int left = tile % parts.rays.tiles_across * CameraRays::kSide;
      const int top = tile / parts.rays.tiles_across * CameraRays::kSide;
      for (int sample = 0; sample < samples; ++sample) {
        const std::size_t number = static_cast<std::size_t>(sample) * tiles + tile;
        packet.look(parts.rays.packets[number], counts);
        for (int lane = 0; lane < kPacket && samples > 1 && parts.settings.shadows; ++lane) {
          const int row = top + lane / CameraRays::kSide;
          const int column = left + lane % CameraRays::kSide;
          SampleSequence numbers(
              parts.settings.seed,
              static_cast<std::uint64_t>(row) * std::uint64_t(parts.camera.width) + std::uint64_t(column),
              static_cast<std::uint32_t>(sample));
          for (int drawn = 0; drawn < 3; ++drawn) numbers.next_pair();  // as a path's: pixel, hole, lamp
          const auto [u, v] = numbers.next_pair();
          packet.choose_lens_points(lane, u, v);
        }
        if (parts.settings.shadows) packet.cast_shadows(counts);
        for (int lane = 0; lane < kPacket; ++lane) {
          const int row = top + lane / CameraRays::kSide;
          const int column = left + lane % CameraRays::kSide;
          if (column >= parts.camera.width || row >= parts.camera.height) continue;
          float* out = image.irradiance.ptr<float>(row) + bands * column;
          const std::size_t slot = (number * kPacket + lane) * bands;
          if (!parts.rays.veil.empty()) {
            for (int band = 0; band < bands; ++band) out[band] += parts.rays.veil[slot + band];
          }
          packet.add(lane, parts.rays.through.data() + slot, out);
        }
      }
    }
  });
  for (const DirectCounts& counts : task_counts) {
    image.primary += counts.primary;
    image.shadow_rays += counts.shadow_rays;
    image.shadow_spared += counts.spared;
  }
  return image;
}

}  // namespace touchstone::render
