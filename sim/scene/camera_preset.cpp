#include "sim/scene/camera_preset.h"

#include "core/units.h"
#include "render/imager/imager_presets.h"
#include "sim/scene/device.h"

namespace touchstone::sim {
namespace {

/// A row of a preset's efficiencies, which are given at a few wavelengths from blue to red: between them a line.
Colour efficiency_of(const render::Imager& imager, Eigen::Index row) {
  const Eigen::VectorXd values = imager.quantum_efficiency.row(row).transpose();
  Colour colour;
  colour.curve = render::SpectralCurve{{imager.wavelengths_nm.begin(), imager.wavelengths_nm.end()},
                                       {values.begin(), values.end()},
                                       "the imager's preset"};
  colour.smooth = true;
  return colour;
}

}  // namespace

bool read_preset(YamlReader& in, CameraSpec& camera) {
  if (!in.has("preset")) return false;
  const auto known = render::imager_preset_names();
  const std::string name = in.required_name("preset", {known.begin(), known.end()});
  const render::ImagerPreset preset = render::imager_preset(name, 0.0);
  const render::Imager& imager = preset.imager;
  camera.width = preset.width;
  camera.height = preset.height;
  camera.frame_rate_Hz = preset.frame_rate_Hz;
  camera.pixel_pitch_um = preset.pixel_pitch_um;
  camera.active_area_um2 = imager.active_area_um2;
  camera.row_time_us = preset.line_time_s * kMicrosecondsPerSecond;
  camera.bits = imager.bits;
  camera.bayer = imager.bayer;
  const bool grey = imager.bayer == render::BayerPattern::none;
  camera.quantum_efficiency_green = efficiency_of(imager, grey ? 0 : 1);
  if (!grey) {
    camera.quantum_efficiency_red = efficiency_of(imager, 0);
    camera.quantum_efficiency_blue = efficiency_of(imager, 2);
  }
  camera.full_well_e = imager.full_well_e;
  camera.read_noise_e = imager.read_noise_e;
  camera.dark_current_e_per_s = imager.dark_current_e_per_s;
  camera.prnu = imager.prnu;
  camera.dsnu_e = imager.dsnu_e;
  camera.black_level_DN = imager.black_level_DN;
  return true;
}

}  // namespace touchstone::sim
