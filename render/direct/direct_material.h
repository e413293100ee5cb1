#pragma once
// What surfaces and balls are made of, as direct light takes it.

#include <Eigen/Core>
#include <array>
#include <map>
#include <vector>

#include "render/materials/ggx.h"
#include "render/materials/print.h"
#include "render/scene/scene.h"
#include "render/spectra/spectrum.h"

namespace touchstone::render {

/// The materials that direct light knows: a Lambertian, a RoughConductor, an Emitter, a Black.
enum class DirectKind { kMatt, kMetal, kLuminous, kBlack };

/// Does light from lamps come back from it?
inline bool is_lit(DirectKind kind) {
  return kind == DirectKind::kMatt || kind == DirectKind::kMetal;
}

/// What is printed on a surface (print.h), as long as its scene lives.
struct DirectPrint {
  const std::vector<Eigen::Vector2d>* material_mm = nullptr;
  const std::vector<std::array<int, 3>>* triangles = nullptr;
  PrintIndex index;
  std::vector<std::array<float, kMaxBands>> mark_colours;
  const PrintedPicture* picture = nullptr;
  const std::vector<int>* ground = nullptr;
  std::vector<std::array<float, kMaxBands>> ink_colours;  ///< of the ground
  bool inked = false;                                     ///< is there anything over the ground?

  /// @pre the surface has a print
  explicit DirectPrint(const Surface& surface);

  /// The ink at a place of a triangle, or `own` where there is none.
  const float* colour_at(int triangle, float u, float v, const float* own) const;
};

/// One surface's or ball's material, in single precision.
struct DirectMaterial {
  DirectKind kind = DirectKind::kBlack;
  std::array<float, kMaxBands> colour{};  ///< albedo, reflectance at normal incidence, or radiance
  double roughness = 0.0;
  const GgxAlbedo* albedo = nullptr;   ///< of a metal
  const DirectPrint* print = nullptr;  ///< of a matt surface or a metal
};

/// Without its print. The tables of metals are kept in `conductors`, by roughness; materials that direct light doesn't
/// know are black.
DirectMaterial direct_material(const Material& material, std::map<double, GgxAlbedo>& conductors);

}  // namespace touchstone::render
