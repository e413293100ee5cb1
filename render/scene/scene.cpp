#include "render/scene/scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"
#include "core/overloaded.h"
#include "render/materials/layer_connection.h"
#include "render/scene/flat_faces.h"
#include "render/scene/scene_limits.h"

namespace touchstone::render {
namespace {

void check_position(const Eigen::Vector3d& position, const std::string& what) {
  if (!position.allFinite()) fail("{} isn't finite", what);
  if (position.cwiseAbs().maxCoeff() > kFarthest) fail("{} is over 100 m from the origin", what);
}

void check_medium_index(int medium, const Scene& scene, const std::string& what) {
  if (medium < 0 || medium >= static_cast<int>(scene.media.size())) {
    fail("{} is medium {}; the scene has media 0 to {}", what, medium, scene.media.size() - 1);
  }
}

void check_index(double index, const std::string& what) {
  if (!(index >= 1.0 && index <= 5.0)) fail("{}: index is {}; it must be from 1 to 5", what, index);
}

void check_roughness(double roughness, const std::string& what) {
  if (!(roughness >= 1e-3 && roughness <= 1.0)) {
    fail("{}: roughness is {}; it must be from 0.001 to 1", what, roughness);
  }
}

void check_material(const Material& material, const Scene& scene, const std::string& what) {
  const Eigen::Index bands = scene.environment.size();
  std::visit(Overloaded{[&](const Lambertian& m) { check_spectrum(m.albedo, bands, 1.0, what + ": albedo"); },
                        [&](const RoughConductor& m) {
                          check_spectrum(m.reflectance, bands, 1.0, what + ": reflectance");
                          check_roughness(m.roughness, what);
                        },
                        [](const Black&) {},
                        [&](const Emitter& m) { check_spectrum(m.radiance, bands, kBrightest, what + ": radiance"); },
                        [&](const Refractive& m) {
                          check_medium_index(m.medium_inside, scene, what + ": medium_inside");
                          check_medium_index(m.medium_outside, scene, what + ": medium_outside");
                        },
                        [&](const RoughRefractive& m) {
                          check_medium_index(m.medium_inside, scene, what + ": medium_inside");
                          check_medium_index(m.medium_outside, scene, what + ": medium_outside");
                          check_roughness(m.roughness, what);
                        },
                        [&](const DiffuseTransmitter& m) {
                          check_spectrum(m.reflectance, bands, 1.0, what + ": reflectance");
                          check_spectrum(m.transmittance, bands, 1.0, what + ": transmittance");
                          for (Eigen::Index i = 0; i < bands; ++i) {
                            // Decimal fractions that add up to one may miss it by a rounding.
                            if (m.reflectance[i] + m.transmittance[i] > 1.0 + 1e-12) {
                              fail("{}: reflectance {} and transmittance {} in band {}; their sum must be at most 1",
                                   what, m.reflectance[i], m.transmittance[i], i);
                            }
                          }
                        },
                        [&](const ThinFilm& m) {
                          check_spectrum(m.transmittance, bands, 1.0, what + ": transmittance");
                          check_index(m.index, what);
                        }},
             material);
}

void check_picture(const PrintedPicture& picture, Eigen::Index bands, const std::string& what) {
  if (picture.columns < 1 || picture.rows < 1) {
    fail("{}: {} x {} pixels; there must be at least one", what, picture.columns, picture.rows);
  }
  if (picture.bands != bands) fail("{}: has {} bands, the scene has {}", what, picture.bands, bands);
  if (!picture.low.allFinite() || picture.low.cwiseAbs().maxCoeff() > 1e5) {
    fail("{}: its corner isn't within 100 m", what);
  }
  if (!((picture.pixel_mm.array() > 0.0).all() && (picture.pixel_mm.array() < 1e5).all())) {
    fail("{}: pixels of {} x {} mm; they must be above 0", what, picture.pixel_mm.x(), picture.pixel_mm.y());
  }
  const std::size_t count = static_cast<std::size_t>(picture.columns) * static_cast<std::size_t>(picture.rows) *
                            static_cast<std::size_t>(picture.bands);
  if (picture.values.size() != count) fail("{}: {} values; {} are needed", what, picture.values.size(), count);
  for (const float value : picture.values) {
    if (!(value >= 0.0f && value <= 1.0f)) fail("{}: a value is {}; allowed is from 0 to 1", what, value);
  }
}

void check_print(const Print& print, const Surface& surface, Eigen::Index bands, const std::string& what) {
  if (!std::holds_alternative<Lambertian>(surface.material) &&
      !std::holds_alternative<RoughConductor>(surface.material)) {
    fail("{}: only a Lambertian or RoughConductor can be printed on", what);
  }
  if (print.material_mm.size() != surface.mesh.vertices.size()) {
    fail("{}: {} material points; the mesh has {} vertices", what, print.material_mm.size(),
         surface.mesh.vertices.size());
  }
  for (std::size_t i = 0; i < print.material_mm.size(); ++i) {
    if (!print.material_mm[i].allFinite()) fail("{}: material point {} isn't finite", what, i);
  }
  for (std::size_t i = 0; i < print.inks.size(); ++i) {
    check_spectrum(print.inks[i], bands, 1.0, fmt::format("{}: ink {}", what, i));
  }
  for (std::size_t i = 0; i < print.marks.size(); ++i) {
    const PrintedMark& mark = print.marks[i];
    if (!mark.centre.allFinite() || mark.centre.cwiseAbs().maxCoeff() > 1e5)
      fail("{}: the centre of mark {} isn't within 100 m", what, i);
    if (!(mark.half_width > 0.0 && mark.half_width < 1e5)) {
      fail("{}: the half width of mark {} is {} mm; it must be above 0", what, i, mark.half_width);
    }
    if (mark.shape == MarkShape::rectangle && !(mark.half_height > 0.0 && mark.half_height < 1e5)) {
      fail("{}: the half height of mark {} is {} mm; it must be above 0", what, i, mark.half_height);
    }
    if (mark.ink < 0 || mark.ink >= static_cast<int>(print.inks.size())) {
      fail("{}: mark {} has ink {}; there are {}", what, i, mark.ink, print.inks.size());
    }
  }
  if (!print.ground.empty() && print.ground.size() != surface.mesh.triangles.size()) {
    fail("{}: a ground of {} triangles; the mesh has {}", what, print.ground.size(), surface.mesh.triangles.size());
  }
  for (std::size_t i = 0; i < print.ground.size(); ++i) {
    if (print.ground[i] < -1 || print.ground[i] >= static_cast<int>(print.inks.size())) {
      fail("{}: the ground of triangle {} has ink {}; there are {}", what, i, print.ground[i], print.inks.size());
    }
  }
  if (print.picture) check_picture(*print.picture, bands, what + ": picture");
}

void check_normals(const Surface& surface, const std::string& what) {
  if (surface.normals.size() != surface.mesh.vertices.size()) {
    fail("{}: {} normals; the mesh has {} vertices", what, surface.normals.size(), surface.mesh.vertices.size());
  }
  for (std::size_t i = 0; i < surface.mesh.triangles.size(); ++i) {
    for (const int corner : surface.mesh.triangles[i]) {
      const double length = surface.normals[corner].norm();
      if (!(std::abs(length - 1.0) < 1e-6)) {
        fail("{}: the normal of vertex {} is {} long; it must be a unit vector", what, corner, length);
      }
    }
  }
}

void check_mesh(const TriangleMesh& mesh, const std::string& what) {
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d& vertex = mesh.vertices[i];
    if (!(vertex.cwiseAbs().maxCoeff() <= kFarthest && vertex.allFinite())) {
      check_position(vertex, fmt::format("{}: vertex {}", what, i));
    }
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& triangle = mesh.triangles[i];
    for (int corner : triangle) {
      if (corner < 0 || corner >= static_cast<int>(mesh.vertices.size())) {
        fail("{}: triangle {} names vertex {}; there are {}", what, i, corner, mesh.vertices.size());
      }
    }
    const Eigen::Vector3d ab = mesh.vertices[triangle[1]] - mesh.vertices[triangle[0]];
    const Eigen::Vector3d ac = mesh.vertices[triangle[2]] - mesh.vertices[triangle[0]];
    const double longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
    // Below this the normal is noise.
    if (!(ab.cross(ac).norm() > 1e-12 * longest)) fail("{}: triangle {} has no area", what, i);
  }
}

}  // namespace

void check_faces(const Scene& scene) {
  if (scene.media.empty()) fail("scene: no medium; media[0] fills the space");
  if (scene.faces.size() > kMaxLayers - 3) {
    fail("scene: {} flat faces; {} are allowed", scene.faces.size(), kMaxLayers - 3);
  }
  // Words are only put together where they are needed: points are projected by the million.
  const auto check_medium = [&](int medium, std::size_t face, const char* side) {
    const auto count = static_cast<int>(scene.media.size());
    if (medium < 0 || medium >= count) {
      fail("face {}: {} is medium {}; the scene has media 0 to {}", face, side, medium, count - 1);
    }
  };
  for (std::size_t i = 0; i < scene.faces.size(); ++i) {
    const FlatFace& face = scene.faces[i];
    if (!(std::abs(face.z) <= kFarthest)) {
      fail("face {}: z is {} mm; it must be within 100 m of the origin", i, face.z);
    }
    check_medium(face.medium_below, i, "medium_below");
    check_medium(face.medium_above, i, "medium_above");
    if (i == 0) continue;
    const FlatFace& below = scene.faces[i - 1];
    if (face.z < below.z) {
      fail("face {}: z is {}; faces run from low to high and the one before is at {}", i, face.z, below.z);
    }
    if (face.medium_below != below.medium_above) {
      fail("face {}: medium_below is {}; the face below it ends in medium {}", i, face.medium_below,
           below.medium_above);
    }
  }
}

void check_scene(const Scene& scene) {
  const Eigen::Index bands = scene.environment.size();
  if (bands < 1) fail("scene: the environment has no band; give a radiance (0 for darkness) for each band");
  check_spectrum(scene.environment, bands, kBrightest, "environment");

  if (scene.media.empty()) fail("scene: no medium; media[0] fills the space");
  for (std::size_t i = 0; i < scene.media.size(); ++i) {
    const Medium& medium = scene.media[i];
    check_index(medium.index, fmt::format("medium {}", i));
    if (medium.absorption.size() > 0) {
      check_spectrum(medium.absorption, bands, INFINITY, fmt::format("medium {}: absorption", i));
    }
    if (medium.scattering.size() > 0) {
      // A mean free path of less than a micrometre is a white surface, and no more than the rays' own rounding.
      check_spectrum(medium.scattering, bands, 1000.0, fmt::format("medium {}: scattering", i));
    }
    if (!(std::abs(medium.anisotropy) <= 0.999)) {
      fail("medium {}: anisotropy is {}; it must be from -0.999 to 0.999", i, medium.anisotropy);
    }
  }

  check_faces(scene);

  for (std::size_t i = 0; i < scene.surfaces.size(); ++i) {
    const std::string what = fmt::format("surface {}", i);
    check_mesh(scene.surfaces[i].mesh, what);
    check_material(scene.surfaces[i].material, scene, what);
    if (!scene.surfaces[i].normals.empty()) check_normals(scene.surfaces[i], what);
    if (scene.surfaces[i].print) check_print(*scene.surfaces[i].print, scene.surfaces[i], bands, what + ": print");
  }
  for (std::size_t i = 0; i < scene.balls.size(); ++i) {
    const Ball& ball = scene.balls[i];
    const std::string what = fmt::format("ball {}", i);
    check_position(ball.centre, what + ": its centre");
    if (!(ball.radius > 0.0 && ball.radius < 1e5)) fail("{}: radius is {} mm; it must be above 0", what, ball.radius);
    check_material(ball.material, scene, what);
  }
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    check_lamp(scene.lamps[i], bands, scene.faces, fmt::format("lamp {}", i));
  }
}

}  // namespace touchstone::render
