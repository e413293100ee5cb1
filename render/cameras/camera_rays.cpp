#include "render/cameras/camera_rays.h"
#include "render/cameras/camera_diffraction.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "render/materials/layer_connection.h"
#include "render/sampling/sample_sequence.h"
#include "render/scene/flat_faces.h"

namespace touchstone::render {
namespace {

constexpr float kFarAway = 1e6f;  // mm

/// A face on the path, and the layer before it.
struct Passed {
  double reflectance_s, reflectance_p;
  double distance;  // in the layer before the face
  const Medium* before;
};

struct Followed {
  bool arrives = false;
  Eigen::Vector3d origin, direction;
  double far = kFarAway;
  Spectrum transmittance;  // of basic radiance
  Spectrum reflectance;
};

/// Reflectance and transmittance of several faces for one polarisation, all reflections between them summed: a face of
/// reflectance r before a stack (R, T) with the share a surviving a pass of the layer between gives
/// r + (1-r)^2 a^2 R / (1 - r a^2 R) and (1-r) a T / (1 - r a^2 R).
void add_stack(const std::array<Passed, kMaxLayers>& passed, int count, int band, bool s_polarised, double& reflected,
               double& through) {
  reflected = 0.0;
  through = 1.0;
  for (int k = count - 1; k >= 0; --k) {
    // The stack behind face k begins with a layer that is crossed on the path to face k + 1.
    double pass = 1.0;
    if (k + 1 < count && passed[k + 1].before->absorption.size() > 0) {
      pass = std::exp(-passed[k + 1].before->absorption[band] * passed[k + 1].distance);
    }
    const double r = s_polarised ? passed[k].reflectance_s : passed[k].reflectance_p;
    const double inner = pass * pass * reflected;
    const double rounds = 1.0 - r * inner;
    const double t = rounds > 0.0 ? (1.0 - r) / rounds : 0.0;
    through = t * pass * through;
    reflected = r + (1.0 - r) * t * inner;
  }
  if (count > 0 && passed[0].before->absorption.size() > 0) {
    const double pass = std::exp(-passed[0].before->absorption[band] * passed[0].distance);
    through *= pass;
    reflected *= pass * pass;
  }
}

Followed follow(const Scene& scene, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, int layer) {
  const auto bands = static_cast<int>(scene.environment.size());
  Followed result;
  result.transmittance = flat_spectrum(bands, 1.0);
  result.reflectance = flat_spectrum(bands, 0.0);
  RayInLayer ray{origin, direction, layer_of_height(scene.faces, origin.z())};
  std::array<Passed, kMaxLayers> passed;
  int count = 0;
  bool total = false;
  while (ray.layer != layer) {
    if (ray.direction.z() == 0.0 || ray.up() != (layer > ray.layer)) return result;  // leads away
    const Medium& before = medium_of_layer(scene, ray.layer);
    const double distance = distance_to_face(scene, ray);
    const FresnelFace face = cross_face(scene, distance, ray);
    passed[count++] = {face.reflectance_s, face.reflectance_p, distance, &before};
    total = face.cos_refracted <= 0.0;
    if (total) break;
  }
  for (int band = 0; band < bands; ++band) {
    double r[2];
    double t[2];
    for (int p = 0; p < 2; ++p) add_stack(passed, count, band, p == 0, r[p], t[p]);
    result.reflectance[band] = 0.5 * (r[0] + r[1]);
    result.transmittance[band] = total ? 0.0 : 0.5 * (t[0] + t[1]);
  }
  if (total) return result;
  result.arrives = true;
  result.origin = ray.origin;
  result.direction = ray.direction;
  result.far = std::min(distance_to_face(scene, ray), double(kFarAway));
  return result;
}

std::optional<CameraRay> ray_of(const ReadyCamera& camera, double x, double y, double u, double v) {
  return std::visit([&](const auto& one) { return camera_ray(one, x, y, u, v); }, camera);
}

/// Of the picture's inside or, a little beside it, as far as light and the lens's distortion go.
std::optional<CameraRay> ray_near(const ReadyCamera& camera, double x, double y, double u, double v) {
  const Eigen::Vector2i size = size_of(camera);
  const double inside_x = std::clamp(x, 0.0, double(size.x()));
  const double inside_y = std::clamp(y, 0.0, double(size.y()));
  const auto* lens = std::get_if<PreparedLens>(&camera);
  const bool beside = x != inside_x || y != inside_y;
  if (beside && lens != nullptr && !view_direction(*lens, x, y)) return ray_of(camera, inside_x, inside_y, u, v);
  const std::optional<CameraRay> ray = ray_of(camera, x, y, u, v);
  return ray || !beside ? ray : ray_of(camera, inside_x, inside_y, u, v);
}

double index_at(const Scene& fixture, const RigidTransform& place) {
  return medium_of_layer(fixture, layer_of_height(fixture.faces, place.translation.z())).index;
}

}  // namespace

ImageGrid pixel_grid(const ReadyCamera& camera) {
  const Eigen::Vector2i size = size_of(camera);
  return {0.5, 0.5, 1.0, size.x(), size.y()};
}

std::optional<LayerRay> ray_in_layer(const Scene& fixture, const ReadyCamera& camera, int layer, double x, double y,
                                     double u, double v) {
  const std::optional<CameraRay> ray = ray_near(camera, x, y, u, v);
  if (!ray) return std::nullopt;
  const RigidTransform& place = pose_of(camera);
  const Followed end = follow(fixture, place * ray->origin, place.turn(ray->direction), layer);
  if (!end.arrives) return std::nullopt;
  const double index = index_at(fixture, place);
  return LayerRay{end.origin, end.direction, end.far, ray->weight * index * index * end.transmittance.mean()};
}

CameraRays trace_to_layer(const Scene& fixture, const ReadyCamera& camera, const ImageGrid& grid, int layer,
                          int samples, std::uint64_t seed) {
  CameraRays rays;
  rays.grid = grid;
  rays.bands = static_cast<int>(fixture.environment.size());
  rays.tiles_across = (grid.columns + CameraRays::kSide - 1) / CameraRays::kSide;
  rays.tiles = rays.tiles_across * ((grid.rows + CameraRays::kSide - 1) / CameraRays::kSide);
  const auto packet_count = static_cast<std::size_t>(rays.tiles) * samples;
  const std::size_t bands = rays.bands;
  rays.packets.resize(packet_count);
  rays.through.assign(packet_count * kPacket * bands, 0.0f);
  const bool dark = (fixture.environment == 0.0).all();
  if (!dark) rays.veil.assign(packet_count * kPacket * bands, 0.0f);
  const RigidTransform& camera_place = pose_of(camera);
  const double camera_index = index_at(fixture, camera_place);
  const DiffractionSpread* diffraction = diffraction_of(camera);
  const bool is_lens = std::holds_alternative<PreparedLens>(camera);

  tbb::parallel_for(0, rays.tiles, [&](int tile) {
    const int left = tile % rays.tiles_across * CameraRays::kSide;
    const int top = tile / rays.tiles_across * CameraRays::kSide;
    for (int sample = 0; sample < samples; ++sample) {
      const std::size_t number = static_cast<std::size_t>(sample) * rays.tiles + tile;
      RayPacket& packet = rays.packets[number];
      for (int lane = 0; lane < kPacket; ++lane) {
        packet.valid[lane] = 0;
        packet.far[lane] = 0.0f;
        for (int a = 0; a < 3; ++a) {
          packet.origin[a][lane] = 0.0f;
          packet.direction[a][lane] = a == 2 ? 1.0f : 0.0f;
        }
        const int column = left + lane % CameraRays::kSide;
        const int row = top + lane / CameraRays::kSide;
        if (column >= grid.columns || row >= grid.rows) continue;
        const std::uint64_t pixel =
            static_cast<std::uint64_t>(row) * static_cast<std::uint64_t>(grid.columns) + std::uint64_t(column);
        SampleSequence numbers = samples == 1 ? SampleSequence::centre() : SampleSequence(seed, pixel, sample);
        const auto [px, py] = numbers.next_pair();
        auto [hu, hv] = numbers.next_pair();
        Eigen::Vector2d from(grid.left + grid.spacing * column + (px - 0.5),
                             grid.top + grid.spacing * row + (py - 0.5));
        Spectrum spread = flat_spectrum(rays.bands, 1.0);
        if (samples > 1 && diffraction != nullptr) {
          // A hole's light all comes through its centre then.
          const auto [u, v] = is_lens ? numbers.next_pair() : std::array<double, 2>{hu, hv};
          if (!is_lens) hu = hv = 0.5;
          const DiffractionSpread::Draw draw = diffraction->draw(u, v);
          const Eigen::Vector2d at = from_axis_mm(camera, from);
          for (int band = 0; band < rays.bands && !is_lens; ++band) {
            spread[band] = diffraction->density(band, at, draw.away) / draw.density;
          }
          from = image_point_at(camera, at + draw.away);
        }
        const auto ray = ray_near(camera, from.x(), from.y(), hu, hv);
        if (!ray) continue;
        const Followed end = follow(fixture, camera_place * ray->origin, camera_place.turn(ray->direction), layer);
        const double weight = ray->weight * camera_index * camera_index / samples;
        const std::size_t slot = (number * kPacket + lane) * bands;
        for (std::size_t band = 0; band < bands; ++band) {
          const double beyond = end.arrives ? 0.0 : end.transmittance[band];
          if (!dark) {
            rays.veil[slot + band] = static_cast<float>(weight * spread[band] * fixture.environment[band] *
                                                        (end.reflectance[band] + beyond));
          }
          rays.through[slot + band] = static_cast<float>(weight * spread[band] * end.transmittance[band]);
        }
        if (!end.arrives) continue;
        packet.valid[lane] = -1;
        packet.far[lane] = static_cast<float>(end.far);
        for (int a = 0; a < 3; ++a) {
          packet.origin[a][lane] = static_cast<float>(end.origin[a]);
          packet.direction[a][lane] = static_cast<float>(end.direction[a]);
        }
      }
    }
  });
  return rays;
}

}  // namespace touchstone::render
