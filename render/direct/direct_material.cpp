#include "render/direct/direct_material.h"

#include <variant>

namespace touchstone::render {

DirectMaterial direct_material(const Material& material, std::map<double, GgxAlbedo>& conductors) {
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

DirectPrint::DirectPrint(const Surface& surface)
    : material_mm(&surface.print->material_mm),
      triangles(&surface.mesh.triangles),
      index(surface.print->marks),
      picture(surface.print->picture.get()),
      ground(&surface.print->ground),
      inked(!surface.print->marks.empty() || surface.print->picture) {
  for (const Spectrum& ink : surface.print->inks) {
    auto& colour = ink_colours.emplace_back();
    for (Eigen::Index band = 0; band < ink.size(); ++band) colour[band] = static_cast<float>(ink[band]);
  }
  for (const PrintedMark& mark : surface.print->marks) mark_colours.push_back(ink_colours[mark.ink]);
}

const float* DirectPrint::colour_at(int triangle, float u, float v, const float* own) const {
  const int under = ground->empty() ? -1 : (*ground)[triangle];
  const float* const plain = under < 0 ? own : ink_colours[under].data();
  if (!inked) return plain;
  const auto& t = (*triangles)[triangle];
  const std::vector<Eigen::Vector2d>& at = *material_mm;
  const Eigen::Vector2d point = (1.0 - double(u) - double(v)) * at[t[0]] + double(u) * at[t[1]] + double(v) * at[t[2]];
  const int mark = index.mark_at(point);
  if (mark >= 0) return mark_colours[mark].data();
  const float* pixel = picture != nullptr ? picture->at(point) : nullptr;
  return pixel != nullptr ? pixel : plain;
}

}  // namespace touchstone::render
