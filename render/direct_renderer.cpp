#include "render/direct_renderer.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "core/error.h"
#include "render/camera_rays.h"
#include "render/ggx.h"
#include "render/packet_scene.h"
#include "render/prepared_scene.h"
#include "render/sample_sequence.h"
#include "render/shadow_reach.h"
#include "render/warps.h"

namespace touchstone::render {
namespace {

constexpr int kMostLamps = 64;
constexpr int kTilesATask = 32;

struct DirectMaterial {
  SurfaceKind kind = SurfaceKind::kBlack;
  std::array<float, kMaxBands> colour{};
  double roughness = 0.0;
  const GgxAlbedo* albedo = nullptr;  ///< of a conductor
};

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
         std::equal(a.lamps.begin(), a.lamps.end(), b.lamps.begin(), b.lamps.end(),
                    [](const SpotLamp& l, const SpotLamp& m) {
                      return l.position == m.position && l.direction == m.direction && l.lens_radius == m.lens_radius &&
                             l.half_angle == m.half_angle && l.soft_angle == m.soft_angle && same(l.power_W, m.power_W);
                    }) &&
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
  LightField field;
  PinholeCamera camera;
  DirectSettings settings;
  CameraRays rays;
  PacketScene tree;
  bool connected;                          // the first surface
  std::map<double, GgxAlbedo> conductors;  // by roughness
  std::vector<NormalFrame> lens_frames;
  std::vector<double> lamp_index;  // refractive index of the medium that a lamp stands in
  std::vector<bool> lamp_in_layer;
  double low, high;  // of the field's layer
  std::array<float, kMaxBands> absorption{};
  bool absorbs = false;

  Parts(const LightField& field_of, const PinholeCamera& camera_of, const Scene& rest,
        const DirectSettings& settings_of)
      : field(field_of),
        camera(camera_of),
        settings(settings_of),
        rays(trace_to_layer(field.fixture, camera, field.layer, settings.samples, settings.seed)),
        tree(rest),
        connected(!rest.surfaces.empty() && is_connected(rest.surfaces[0].mesh)) {
    const std::vector<FlatFace>& faces = field.fixture.faces;
    low = field.layer > 0 ? faces[field.layer - 1].z : -INFINITY;
    high = field.layer < static_cast<int>(faces.size()) ? faces[field.layer].z : INFINITY;
    const auto medium_of = [&](int layer) {
      if (faces.empty()) return 0;
      return layer == 0 ? faces.front().medium_below : faces[layer - 1].medium_above;
    };
    const Medium& medium = field.fixture.media[medium_of(field.layer)];
    for (Eigen::Index band = 0; band < medium.absorption.size(); ++band) {
      absorption[band] = static_cast<float>(medium.absorption[band]);
      absorbs = absorbs || medium.absorption[band] > 0.0;
    }
    for (const SpotLamp& lamp : field.fixture.lamps) {
      lens_frames.emplace_back(lamp.direction.normalized());
      int layer = 0;
      while (layer < static_cast<int>(faces.size()) && faces[layer].z < lamp.position.z()) ++layer;
      lamp_index.push_back(field.fixture.media[medium_of(layer)].index);
      lamp_in_layer.push_back(layer == field.layer);
    }
  }

  DirectMaterial prepare(const Material& material) {
    DirectMaterial made;
    const auto take = [&](const Spectrum& from) {
      for (Eigen::Index band = 0; band < from.size(); ++band) made.colour[band] = static_cast<float>(from[band]);
    };
    if (const auto* lambertian = std::get_if<Lambertian>(&material)) {
      made.kind = SurfaceKind::kLambertian;
      take(lambertian->albedo);
    } else if (const auto* conductor = std::get_if<RoughConductor>(&material)) {
      made.kind = SurfaceKind::kConductor;
      take(conductor->reflectance);
      made.roughness = conductor->roughness;
      made.albedo = &conductors.try_emplace(made.roughness, made.roughness).first->second;
    } else if (const auto* emitter = std::get_if<Emitter>(&material)) {
      made.kind = SurfaceKind::kEmitter;
      take(emitter->radiance);
    }
    return made;
  }
};

namespace {

/// What a packet's lanes met.
struct Met {
  float place[3][kPacket];
  float normal[3][kPacket];        // unit, facing the camera ray
  float safe_steepness2[kPacket];  // see ShadowReach; squared
  const DirectMaterial* material[kPacket];
};

/// Light of one lamp at the lanes: cosine times irradiance of unit intensity, and the direction that it comes from.
struct LampLight {
  float amount[kPacket];
  float towards[3][kPacket];  // not of unit length
};

struct Counts {
  std::uint64_t primary = 0, shadow_rays = 0, spared = 0;
};

}  // namespace

DirectRenderer::DirectRenderer(const LightField& field, const PinholeCamera& camera, const Scene& rest,
                               const DirectSettings& settings) {
  check_camera(camera);
  check_settings(settings);
  check_scene(rest);
  if (field.lamp_count() > kMostLamps) {
    fail("direct renderer: {} lamps; at most {} are allowed", field.lamp_count(), kMostLamps);
  }
  if (const std::string fault = unfit_for_direct(field, rest); !fault.empty()) fail("direct renderer: {}", fault);
  parts_ = std::make_unique<Parts>(field, camera, rest, settings);
}

DirectRenderer::~DirectRenderer() = default;
DirectRenderer::DirectRenderer(DirectRenderer&&) noexcept = default;

DirectImage DirectRenderer::render(const Scene& scene) {
  Parts& parts = *parts_;
  const LightField& field = parts.field;
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

  const int bands = parts.rays.bands;
  const int lamps = field.lamp_count();
  const auto per_index2 = static_cast<float>(1.0 / (field.index * field.index));
  DirectImage image;
  image.irradiance = cv::Mat::zeros(parts.camera.height, parts.camera.width, CV_32FC(bands));
  const int tiles = parts.rays.tiles;
  const int tasks = (tiles + kTilesATask - 1) / kTilesATask;
  std::vector<Counts> task_counts(tasks);

  // F and its length of a lamp at a place, as if the lens were a point set off from its middle by `lens`: the same as
  // for the middle seen from a place set off the other way, since layers look alike from everywhere; a rise of the
  // source is a shift along its own ray.
  const auto shifted_flow = [&](int lamp, const float* place, const Eigen::Vector2d& lens, float* flow) {
    const float* there = flow + 4 * lamp;
    const double length = there[3];
    const Eigen::Vector3d offset = lens.x() * parts.lens_frames[lamp].x + lens.y() * parts.lens_frames[lamp].y;
    const double bend = field.index / parts.lamp_index[lamp] / length;
    const Eigen::Vector2d across(there[0] * bend, there[1] * bend);
    const double up2 = 1.0 - across.squaredNorm();
    if (up2 < 1e-3) return;
    const Eigen::Vector2d shift = offset.head<2>() - across * (offset.z() / std::copysign(std::sqrt(up2), there[2]));
    float all[4 * kMostLamps];
    look_up_flow(
        field,
        find_cell(field, place[0] - static_cast<float>(shift.x()), place[1] - static_cast<float>(shift.y()), place[2]),
        all);
    const float* turned = all + 4 * lamp;
    const double other_length = std::hypot(double(turned[0]), double(turned[1]), double(turned[2]));
    if (!(other_length > 0.0)) return;
    // Only the direction: how much comes is the mean over the lens.
    for (int a = 0; a < 3; ++a) flow[4 * lamp + a] = static_cast<float>(turned[a] / other_length * length);
  };

  tbb::parallel_for(0, tasks, [&](int task) {
    Counts counts;
    PacketHits hits;
    Met met;
    RayPacket shadow;
    std::vector<LampLight> light(lamps);
    std::vector<float> pass(field.pass.empty() ? 0 : static_cast<std::size_t>(kPacket) * lamps * bands);
    for (int tile = task * kTilesATask; tile < std::min(tiles, (task + 1) * kTilesATask); ++tile) {
      const int left = tile % parts.rays.tiles_across * CameraRays::kSide;
      const int top = tile / parts.rays.tiles_across * CameraRays::kSide;
      for (int sample = 0; sample < parts.settings.samples; ++sample) {
        const std::size_t number = static_cast<std::size_t>(sample) * tiles + tile;
        const RayPacket& rays = parts.rays.packets[number];
        tree.intersect(rays, hits);
        for (LampLight& one : light) std::fill_n(one.amount, kPacket, 0.0f);

        for (int lane = 0; lane < kPacket; ++lane) {
          met.material[lane] = nullptr;
          if (rays.valid[lane] == 0) continue;
          ++counts.primary;
          if (hits.object[lane] < 0) continue;
          const DirectMaterial& material = materials[hits.object[lane]];
          met.material[lane] = &material;
          if (material.kind != SurfaceKind::kLambertian && material.kind != SurfaceKind::kConductor) continue;
          float along = 0.0f;
          float length2 = 0.0f;
          float place[3];
          for (int a = 0; a < 3; ++a) {
            place[a] = rays.origin[a][lane] + hits.distance[lane] * rays.direction[a][lane];
            met.place[a][lane] = place[a];
            along += hits.normal[a][lane] * rays.direction[a][lane];
            length2 += hits.normal[a][lane] * hits.normal[a][lane];
          }
          const float scale = (along < 0.0f ? 1.0f : -1.0f) / std::sqrt(std::max(length2, 1e-30f));
          float normal[3];
          for (int a = 0; a < 3; ++a) met.normal[a][lane] = normal[a] = scale * hits.normal[a][lane];
          const float steepness = shadow_reach.safe_steepness(place[0], place[1], hits.object[lane]);
          met.safe_steepness2[lane] = steepness * steepness;
          const FieldCell cell = find_cell(field, place[0], place[1], place[2]);
          float flow[4 * kMostLamps];
          look_up_flow(field, cell, flow);
          for (int lamp = 0; lamp < lamps; ++lamp) {
            const float* f = flow + 4 * lamp;
            const float amount = -(normal[0] * f[0] + normal[1] * f[1] + normal[2] * f[2]);
            if (!(amount > 0.0f)) continue;
            light[lamp].amount[lane] = amount;
            for (int a = 0; a < 3; ++a) light[lamp].towards[a][lane] = -f[a];
          }
          if (!pass.empty()) {
            for (int k = 0; k < lamps * bands; ++k) {
              float sum = 0.0f;
              for (int corner = 0; corner < 8; ++corner) {
                sum +=
                    cell.weight[corner] * field.pass[static_cast<std::size_t>(cell.node[corner]) * lamps * bands + k];
              }
              pass[static_cast<std::size_t>(lane) * lamps * bands + k] = sum;
            }
          }
          if (parts.settings.samples > 1 && parts.settings.shadows) {
            const std::uint64_t pixel =
                static_cast<std::uint64_t>(top + lane / CameraRays::kSide) * std::uint64_t(parts.camera.width) +
                std::uint64_t(left + lane % CameraRays::kSide);
            SampleSequence numbers(parts.settings.seed, pixel, static_cast<std::uint32_t>(sample));
            for (int skipped = 0; skipped < 3; ++skipped) numbers.next_pair();  // as the path tracer's draws
            const auto [u, v] = numbers.next_pair();
            for (int lamp = 0; lamp < lamps; ++lamp) {
              const double radius = field.fixture.lamps[lamp].lens_radius;
              if (light[lamp].amount[lane] == 0.0f || radius == 0.0) continue;
              shifted_flow(lamp, place, radius * square_to_disc(u, v), flow);
              for (int a = 0; a < 3; ++a) light[lamp].towards[a][lane] = -flow[4 * lamp + a];
            }
          }
        }

        for (int lamp = 0; lamp < lamps && parts.settings.shadows; ++lamp) {
          LampLight& one = light[lamp];
          bool may_meet[kPacket];
          bool any = false;
          for (int lane = 0; lane < kPacket; ++lane) {
            may_meet[lane] = false;
            if (one.amount[lane] == 0.0f) continue;
            const float x = one.towards[0][lane];
            const float y = one.towards[1][lane];
            const float z = one.towards[2][lane];
            may_meet[lane] = !(z * z >= met.safe_steepness2[lane] * (x * x + y * y));
            any = any || may_meet[lane];
            counts.spared += may_meet[lane] ? 0 : 1;
          }
          if (!any) continue;
          any = false;
          for (int lane = 0; lane < kPacket; ++lane) {
            shadow.valid[lane] = 0;
            if (!may_meet[lane]) {
              for (int a = 0; a < 3; ++a) {
                shadow.origin[a][lane] = 0.0f;
                shadow.direction[a][lane] = a == 2 ? 1.0f : 0.0f;
              }
              shadow.far[lane] = 0.0f;
              continue;
            }
            const Eigen::Vector3f towards =
                Eigen::Vector3f(one.towards[0][lane], one.towards[1][lane], one.towards[2][lane]).normalized();
            float most = 0.0f;
            for (int a = 0; a < 3; ++a) most = std::max(most, std::abs(met.place[a][lane]));
            const float leave = 8e-6f * (1.0f + most);
            for (int a = 0; a < 3; ++a) {
              shadow.origin[a][lane] = met.place[a][lane] + leave * met.normal[a][lane];
              shadow.direction[a][lane] = towards[a];
            }
            const double rise = towards.z();
            double far = 1e6;
            const double limit = rise > 0.0 ? parts.high : parts.low;
            if (std::isfinite(limit) && rise != 0.0) far = std::max(0.0, (limit - met.place[2][lane]) / rise);
            if (parts.lamp_in_layer[lamp]) {
              const Eigen::Vector3d place(met.place[0][lane], met.place[1][lane], met.place[2][lane]);
              far = std::min(far, (field.fixture.lamps[lamp].position - place).norm());
            }
            const float reach = shadow_reach.length(
                shadow.origin[0][lane], shadow.origin[1][lane], shadow.origin[2][lane], shadow.direction[0][lane],
                shadow.direction[1][lane], shadow.direction[2][lane], static_cast<float>(far), hits.object[lane]);
            shadow.far[lane] = reach;
            if (reach > 0.0f) {
              shadow.valid[lane] = -1;
              any = true;
              ++counts.shadow_rays;
            } else {
              ++counts.spared;
            }
          }
          if (!any) continue;
          alignas(64) int free[kPacket];
          tree.occluded(shadow, free);
          for (int lane = 0; lane < kPacket; ++lane) {
            if (shadow.valid[lane] != 0 && free[lane] == 0) one.amount[lane] = 0.0f;
          }
        }

        for (int lane = 0; lane < kPacket; ++lane) {
          const int column = left + lane % CameraRays::kSide;
          const int row = top + lane / CameraRays::kSide;
          if (column >= parts.camera.width || row >= parts.camera.height) continue;
          float* out = image.irradiance.ptr<float>(row) + bands * column;
          const std::size_t slot = (number * kPacket + lane) * bands;
          const float* through = parts.rays.through.data() + slot;
          if (!parts.rays.veil.empty()) {
            for (int band = 0; band < bands; ++band) out[band] += parts.rays.veil[slot + band];
          }
          if (rays.valid[lane] == 0) continue;
          const DirectMaterial* material = met.material[lane];
          if (material == nullptr) {
            for (int band = 0; band < bands; ++band) {
              out[band] += through[band] * static_cast<float>(field.fixture.environment[band]);
            }
            continue;
          }
          if (material->kind == SurfaceKind::kBlack) continue;
          float dimmed[kMaxBands];
          for (int band = 0; band < bands; ++band) {
            dimmed[band] = through[band];
            if (parts.absorbs) dimmed[band] *= std::exp(-parts.absorption[band] * hits.distance[lane]);
          }
          if (material->kind == SurfaceKind::kEmitter) {
            for (int band = 0; band < bands; ++band) out[band] += dimmed[band] * material->colour[band];
            continue;
          }
          float sum[kMaxBands] = {};
          for (int lamp = 0; lamp < lamps; ++lamp) {
            const float amount = light[lamp].amount[lane];
            if (amount == 0.0f) continue;
            float share[kMaxBands];
            if (material->kind == SurfaceKind::kLambertian) {
              for (int band = 0; band < bands; ++band) {
                share[band] = material->colour[band] * static_cast<float>(1.0 / kPi);
              }
            } else {
              const NormalFrame frame(
                  Eigen::Vector3d(met.normal[0][lane], met.normal[1][lane], met.normal[2][lane]).normalized());
              const Eigen::Vector3d leaving = frame.to_local(
                  -Eigen::Vector3d(rays.direction[0][lane], rays.direction[1][lane], rays.direction[2][lane]));
              const Eigen::Vector3d coming =
                  frame.to_local(Eigen::Vector3d(light[lamp].towards[0][lane], light[lamp].towards[1][lane],
                                                 light[lamp].towards[2][lane])
                                     .normalized());
              const double schlick = schlick_weight((leaving + coming).normalized().dot(leaving));
              const double lobe = ggx_reflection(leaving, coming, material->roughness);
              const double missing = material->albedo->missing_ratio(leaving.z());
              for (int band = 0; band < bands; ++band) {
                const double r = material->colour[band];
                share[band] = static_cast<float>((r + (1.0 - r) * schlick) * (1.0 + r * missing) * lobe);
              }
            }
            for (int band = 0; band < bands; ++band) {
              const float passed =
                  pass.empty() ? 1.0f : pass[(static_cast<std::size_t>(lane) * lamps + lamp) * bands + band];
              sum[band] += amount * share[band] * passed * static_cast<float>(field.intensity[lamp][band]);
            }
          }
          for (int band = 0; band < bands; ++band) out[band] += dimmed[band] * sum[band] * per_index2;
        }
      }
    }
    task_counts[task] = counts;
  });
  for (const Counts& counts : task_counts) {
    image.primary += counts.primary;
    image.shadow_rays += counts.shadow_rays;
    image.shadow_spared += counts.spared;
  }
  return image;
}

}  // namespace touchstone::render
