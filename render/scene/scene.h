#pragma once
// What the tracer sees: a stack of infinite flat faces (air | glass | gel), surfaces and balls, lamps, surroundings.
// All in the gel frame (core/transform.h), lengths in mm.

#include <Eigen/Core>
#include <optional>
#include <variant>
#include <vector>

#include "core/triangle_mesh.h"
#include "render/materials/diffuse_transmitter.h"
#include "render/materials/print.h"
#include "render/materials/rough_dielectric.h"
#include "render/materials/thin_film.h"
#include "render/scene/lamp.h"
#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// A homogeneous substance. `absorption` (Beer-Lambert) and `scattering` (scattering.h) are per mm, natural logarithm;
/// an empty spectrum is none. `anisotropy` is the mean cosine of a scattering, -0.999 to 0.999.
struct Medium {
  double index = 1.0;
  Spectrum absorption = {};
  Spectrum scattering = {};
  double anisotropy = 0.0;
};

/// Ideally matt: the reflected radiance is albedo / pi times the irradiance. Both sides reflect.
struct Lambertian {
  Spectrum albedo;
};

/// Metal: GGX microfacets of width `roughness` (the alpha of [Walter2007], 1e-3 to 1), Fresnel reflectance by Schlick's
/// formula [Schlick1994] from the `reflectance` at normal incidence. Light that a facet sends to another facet is
/// given back in the shape of the single reflection (ggx.h, GgxAlbedo), so that a white metal loses nothing.
struct RoughConductor {
  Spectrum reflectance;
  double roughness = 0.3;
};

/// Reflects nothing.
struct Black {};

/// A luminous body, a diffuser lit from behind: shows the same radiance from everywhere and reflects nothing.
/// `radiance` is that in air, W/m^2/sr in each band; in a medium of index n that wets it n^2 times as much, as
/// Fresnel's loss at the body's own face is left out. It is seen directly and by bounced light; without interreflection
/// it lights nothing.
struct Emitter {
  Spectrum radiance;
};

/// A smooth boundary of two media (indices into Scene::media); its outward normal points to `medium_outside`. Where the
/// two indices are equal nothing happens to a ray but the change of medium.
struct Refractive {
  int medium_inside = 0;
  int medium_outside = 0;
};

/// What a surface or a ball is made of.
using Material =
    std::variant<Lambertian, RoughConductor, Black, Emitter, Refractive, DiffuseTransmitter, ThinFilm, RoughRefractive>;

/// A triangle surface, open or closed. With `normals` (one a vertex, unit, on the side that the triangles' own are) it
/// is shaded as the curved surface that it stands for: normals are interpolated over a triangle, and what leaves it
/// starts where the tangent planes of its corners are, if that is over the triangle, so that facets that turn away from
/// a lamp a little earlier or later than the surface cast no shadows on it [Hanika2021]. What passes under the
/// triangles is stopped by them as ever. Without, each triangle is flat; but a Refractive surface always bends light by
/// interpolated normals, those of vertex_normals() if none are given. Only Refractive, Lambertian, RoughConductor and
/// DiffuseTransmitter surfaces look at them. A Lambertian or RoughConductor may be printed on.
struct Surface {
  TriangleMesh mesh;
  Material material;
  std::optional<Print> print = std::nullopt;
  std::vector<Eigen::Vector3d> normals = {};
};

/// A sphere, such as a bead in the gel: exact, without triangles.
struct Ball {
  Eigen::Vector3d centre;
  double radius = 0.0;
  Material material;
};

/// The infinite plane z = const where `medium_below` meets `medium_above`.
struct FlatFace {
  double z = 0.0;
  int medium_below = 0;
  int medium_above = 0;
};

/// A scene. The number of bands is the length of `environment`.
///
/// Faces are given from low z to high z; the medium above one is the medium below the next; coincident faces (a layer
/// of no thickness) are allowed. With no faces all space is media[0]. A ray's medium is the state of its path: it
/// changes at faces and Refractive surfaces, so a gel surface may have holes where an object is pressed on: a ray in
/// the gel then meets the object directly. A ray that slips through such a hole beside the object stays "in the gel"
/// until it meets the next boundary or leaves the scene.
struct Scene {
  std::vector<Medium> media = {Medium{}};
  std::vector<FlatFace> faces;
  std::vector<Surface> surfaces;
  std::vector<Ball> balls;
  std::vector<Lamp> lamps;
  Spectrum environment;         ///< radiance of the surroundings, in air, W/m^2/sr in each band
  bool interreflection = true;  ///< false: only lamp light on what the camera sees, and the surroundings seen directly
};

/// Throws Error if anything in the scene can't be rendered: it names the part, the value and what is allowed. Nothing
/// may be over 100 m from the origin, no radiance or power above 1e12.
void check_scene(const Scene& scene);

}  // namespace touchstone::render
