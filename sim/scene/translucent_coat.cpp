#include "sim/scene/translucent_coat.h"

#include <algorithm>

#include "core/error.h"
#include "render/materials/diffuse_transmitter.h"
#include "render/materials/fresnel.h"

namespace touchstone::sim {

TranslucentCoat translucent_coat(const SceneSpec& scene, const SceneBands& bands) {
  const CoatingSpec& coating = *scene.device.coating;
  const render::DiffuseTransmitter sheet{in_bands(coating.albedo, bands, "coating.albedo"),
                                         in_bands(coating.transmittance, bands, "coating.transmittance")};
  constexpr double kRounding = 1e-9;
  if (const double most = (sheet.reflectance + sheet.transmittance).maxCoeff(); most > 1.0 + kRounding) {
    fail_at(coating.transmittance.where,
            "coating.transmittance: with albedo it is {:.3g}; together they may be 1 at most in each band", most);
  }
  const double face = render::diffuse_reflectance_within(scene.device.gel.refractive_index);
  TranslucentCoat coat;
  coat.free = render::reflectance_over(sheet, render::Spectrum::Constant(sheet.reflectance.size(), face));
  for (const MovedObject& moved : moved_objects(scene)) {
    if (scene.effects.translucent_coating == Switch::off) {
      coat.touched.push_back(coat.free);
      continue;
    }
    if (moved.object.radiance) {
      fail_at(moved.object.radiance->where,
              "radiance: a luminous object isn't simulated behind a coating that lets light through "
              "(coating.transmittance); effects.translucent_coating: off leaves it out");
    }
    coat.touched.push_back(render::reflectance_over(sheet, in_bands(moved.object.albedo, bands, "albedo")));
  }
  return coat;
}

double largest_change(const TranslucentCoat& coat) {
  double largest = 0.0;
  for (const render::Spectrum& touched : coat.touched) {
    largest = std::max(largest, ((touched - coat.free).abs() / coat.free.max(1e-9)).maxCoeff());
  }
  return largest;
}

}  // namespace touchstone::sim
