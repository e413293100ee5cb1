#include "sim/plan/scene_bands.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/scene/device_faces.h"

namespace touchstone::sim {
namespace {

constexpr double kStepNm = 1.0;  // of the lamps' common light

/// A colour of a scene with its name, for messages.
struct NamedColour {
  Colour colour;
  const char* name;
};

/// All that reflect.
std::vector<NamedColour> reflecting(const SceneSpec& scene) {
  const DeviceSpec& device = scene.device;
  std::vector<NamedColour> all = {{device.gel.frame_albedo, "gel.frame_albedo"}};
  if (device.beads) all.push_back({device.beads->reflectance, "beads.reflectance"});
  if (device.coating) {
    all.push_back(
        {device.coating->albedo, device.coating->type == CoatingType::matt ? "coating.albedo" : "coating.reflectance"});
    all.push_back({device.coating->transmittance, "coating.transmittance"});
    if (device.coating->print) all.push_back({device.coating->print->colour, "coating.print.colour"});
  }
  if (device.pins) all.push_back({device.pins->colour, "pins.colour"});
  if (device.coating && device.coating->transmittance.largest() == 0.0) return all;  // it hides the objects
  for (const MovedObject& moved : moved_objects(scene)) {
    all.push_back({moved.object.albedo, "albedo"});
    if (!device.coating) {
      for (Colour& ink : inks_of(moved.object.print)) all.push_back({std::move(ink), "print"});
    }
  }
  return all;
}

std::vector<NamedColour> efficiencies(const CameraSpec& camera) {
  std::vector<NamedColour> all = {{camera.quantum_efficiency_green, "camera.quantum_efficiency_green"}};
  if (camera.bayer != render::BayerPattern::none) {
    all.push_back({camera.quantum_efficiency_red, "camera.quantum_efficiency_red"});
    all.push_back({camera.quantum_efficiency_blue, "camera.quantum_efficiency_blue"});
  }
  return all;
}

/// A colour as a curve over the range; numbers for single bands, which have no wavelengths of their own, as their mean.
render::SpectralCurve as_curve(const Colour& colour, const BandsSpec& bands) {
  if (colour.curve) return *colour.curve;
  double mean = 0.0;
  for (const double value : colour.numbers) mean += value / static_cast<double>(colour.numbers.size());
  return {{bands.from_nm, bands.to_nm}, {mean, mean}, ""};
}

/// A lamp's light per nm; without a spectrum it is even.
render::SpectralCurve emission_of(const LampSpec& lamp, const BandsSpec& bands) {
  if (!lamp.spectrum) return as_curve(lamp.power_W, bands);
  render::SpectralCurve curve = *lamp.spectrum;
  const double all = curve.integral(curve.wavelengths_nm.front(), curve.wavelengths_nm.back());
  for (double& value : curve.values) value *= lamp.power_W.numbers[0] / all;
  return curve;
}

/// The light of all lamps together; none where none shines.
std::optional<render::SpectralCurve> light_of(const std::vector<render::SpectralCurve>& lamps, const BandsSpec& bands) {
  render::SpectralCurve sum;
  const int steps = static_cast<int>(std::ceil((bands.to_nm - bands.from_nm) / kStepNm));
  for (int k = 0; k <= steps; ++k) {
    const double at = bands.from_nm + (bands.to_nm - bands.from_nm) * k / steps;
    double light = 0.0;
    for (const render::SpectralCurve& lamp : lamps) {
      light += render::emitted_at(lamp, at);
    }
    sum.wavelengths_nm.push_back(at);
    sum.values.push_back(light);
  }
  if (*std::max_element(sum.values.begin(), sum.values.end()) > 0.0) return sum;
  return std::nullopt;
}

bool same(const render::SpectralCurve& a, const render::SpectralCurve& b) {
  return a.wavelengths_nm == b.wavelengths_nm && a.values == b.values;
}

/// Each of them once.
std::vector<render::SpectralCurve> distinct(const std::vector<render::SpectralCurve>& curves) {
  std::vector<render::SpectralCurve> out;
  for (const render::SpectralCurve& curve : curves) {
    if (std::ranges::none_of(out, [&](const render::SpectralCurve& known) { return same(known, curve); })) {
      out.push_back(curve);
    }
  }
  return out;
}

/// The light and its paths.
struct LightPaths {
  std::vector<render::SpectralPath> paths;
  std::optional<render::SpectralCurve> light;
};

LightPaths light_paths(const SceneSpec& scene) {
  const DeviceSpec& device = scene.device;
  const BandsSpec& bands = *device.bands;
  std::vector<render::SpectralCurve> lamps;
  for (const LampSpec& lamp : device.lamps) lamps.push_back(emission_of(lamp, bands));
  LightPaths out;
  out.light = light_of(lamps, bands);
  std::vector<render::SpectralCurve> reflectors;
  for (const NamedColour& named : reflecting(scene)) {
    if (named.colour.largest() > 0.0) reflectors.push_back(as_curve(named.colour, bands));
  }
  std::vector<render::SpectralCurve> channels;
  for (const NamedColour& named : efficiencies(*device.camera)) channels.push_back(as_curve(named.colour, bands));
  for (const render::SpectralCurve& lamp : distinct(lamps)) {
    for (const render::SpectralCurve& reflector : distinct(reflectors)) {
      for (const render::SpectralCurve& channel : distinct(channels)) {
        out.paths.push_back({lamp, {reflector, channel}});
        if (!device.films) continue;
        const render::SpectralCurve film = as_curve(device.films->transmittance, bands);
        out.paths.push_back({lamp, {film, reflector, film, channel}});
      }
    }
  }
  return out;
}

}  // namespace

SceneBands choose_bands(const SceneSpec& scene, std::optional<double> tolerance) {
  const DeviceSpec& device = scene.device;
  SceneBands out;
  if (!device.bands) {
    const std::vector<double>& centres = device.band_wavelengths_nm;
    out.centres_nm = Eigen::Map<const Eigen::ArrayXd>(centres.data(), static_cast<Eigen::Index>(centres.size()));
    return out;
  }
  const BandsSpec& wanted = *device.bands;
  const LightPaths light = light_paths(scene);
  out.ranges = wanted.count
                   ? render::adapted_bands(light.paths, light.light, wanted.from_nm, wanted.to_nm, *wanted.count)
                   : render::bands_within(light.paths, light.light, wanted.from_nm, wanted.to_nm,
                                          tolerance.value_or(wanted.tolerance), render::kBandCounts);
  out.centres_nm = out.ranges->centres_nm();
  return out;
}

double band_error(const SceneSpec& scene, const SceneBands& bands) {
  if (!bands.ranges) return 0.0;
  double worst = 0.0;
  for (const render::SpectralPath& path : light_paths(scene).paths) {
    worst = std::max(worst, render::band_error(path, *bands.ranges));
  }
  return worst;
}

void check_light(const SceneSpec& scene, const SceneBands& bands) {
  const DeviceSpec& device = scene.device;
  for (const NamedColour& named : reflecting(scene)) in_bands(named.colour, bands, named.name);
  for (const NamedColour& named : efficiencies(*device.camera)) in_bands(named.colour, bands, named.name);
  in_bands(device.gel.absorption_per_mm, bands, "gel.absorption_per_mm");
  in_bands(device.gel.scattering_per_mm, bands, "gel.scattering_per_mm");
  in_bands(device.room_radiance, bands, "room_radiance");
  if (device.room_radiance_behind) in_bands(*device.room_radiance_behind, bands, "room_radiance_behind");
  if (device.films) in_bands(device.films->transmittance, bands, "films.transmittance");
  for (const LampSpec& lamp : device.lamps) {
    for (const render::Lamp& one : lamps_of(lamp, bands, 1.0)) {
      try {
        render::check_lamp(one, bands.count(), flat_faces(device), "lamps");
      } catch (const Error& error) {
        fail_at(lamp.where, "{}", error.what());
      }
    }
  }
  for (const MovedObject& moved : moved_objects(scene)) {
    if (moved.object.radiance) in_bands(*moved.object.radiance, bands, "radiance");
    if (moved.object.screen) in_bands(moved.object.screen->radiance, bands, "screen.radiance");
  }
}

}  // namespace touchstone::sim
