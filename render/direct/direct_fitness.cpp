#include "render/direct/direct_fitness.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include "core/error.h"
#include "render/scene/film_screen.h"

namespace touchstone::render {
namespace {

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

bool in_layer(const LightField& field, double z) {
  const std::vector<FlatFace>& faces = field.fixture.faces;
  return (field.layer == 0 || z >= faces[field.layer - 1].z) &&
         (field.layer == static_cast<int>(faces.size()) || z <= faces[field.layer].z);
}

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

}  // namespace

std::string unfit_for_direct(const LightField& field, const Scene& scene, bool bounces_are_carried) {
  if (scene.interreflection && !bounces_are_carried) return "the scene asks for interreflection";
  if (!same_fixture(field.fixture, scene)) {
    return "the scene's media, faces, lamps or surroundings aren't those that the light field was made for";
  }
  for (std::size_t i = 0; i < scene.media.size(); ++i) {
    const Spectrum& scattering = scene.media[i].scattering;
    if (scattering.size() > 0 && (scattering > 0.0).any()) return fmt::format("medium {} scatters", i);
  }
  if (std::string fault = unfit_for_screen(scene); !fault.empty()) return fault;
  const bool has_films = std::ranges::any_of(scene.surfaces, is_film);
  if (has_films) {
    const Surface& film = *std::ranges::find_if(scene.surfaces, is_film);
    if (!in_layer(field, film.mesh.vertices.front().z())) return "films lie outside of the light field's layer";
    if (std::get<ThinFilm>(film.material).index < field.index) return "films mirror, as their index is the lower one";
  }
  if (has_films && !field.pass.empty()) return "a medium before films absorbs";
  if (has_films && !scene.balls.empty()) return "balls stand behind films";
  for (std::size_t i = 0; i < scene.surfaces.size(); ++i) {
    const std::string what = fmt::format("surface {}", i);
    const Surface& surface = scene.surfaces[i];
    if (is_film(surface)) continue;
    if (has_films && std::holds_alternative<RoughConductor>(surface.material)) return what + " is metal behind films";
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

}  // namespace touchstone::render
