#include "sim/scene/device_imager.h"

#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "sim/scene/device_lamps.h"

namespace touchstone::sim {

render::Imager imager(const DeviceSpec& device, const SceneBands& bands, bool with_noise) {
  const CameraSpec& camera = *device.camera;
  render::Imager out;
  out.bits = camera.bits;
  out.active_area_um2 = camera.active_area_um2;
  out.exposure_s = camera.exposure_us / kMicrosecondsPerSecond;
  out.wavelengths_nm = bands.centres_nm;
  const auto green = in_bands(camera.quantum_efficiency_green, bands, "camera.quantum_efficiency_green");
  if (camera.bayer == render::BayerPattern::none) {
    out.quantum_efficiency = green.matrix().transpose();
  } else {
    out.quantum_efficiency.resize(3, bands.count());
    out.quantum_efficiency.row(0) = in_bands(camera.quantum_efficiency_red, bands, "camera.quantum_efficiency_red");
    out.quantum_efficiency.row(1) = green;
    out.quantum_efficiency.row(2) = in_bands(camera.quantum_efficiency_blue, bands, "camera.quantum_efficiency_blue");
  }
  out.full_well_e = camera.full_well_e;
  out.read_noise_e = camera.read_noise_e;
  out.dark_current_e_per_s = camera.dark_current_e_per_s;
  out.prnu = camera.prnu;
  out.dsnu_e = camera.dsnu_e;
  out.bayer = camera.bayer;
  out.black_level_DN = camera.black_level_DN;
  out.hot_pixels = camera.hot_pixels;
  out.auto_exposure = camera.auto_exposure;
  out.auto_white_balance = camera.auto_white_balance;
  out.tone_curve = camera.tone_curve;
  out.jpeg = camera.jpeg;
  constexpr double kDecibelsPerDecade = 20.0;
  out.gain_DN_per_e = ((1 << camera.bits) - 1 - camera.black_level_DN) / camera.full_well_e *
                      std::pow(10.0, camera.gain_dB / kDecibelsPerDecade);
  out.ideal = !with_noise;
  if (camera.white_balance) {
    out.white_balance = *camera.white_balance;
  } else if (camera.bayer != render::BayerPattern::none) {
    render::Spectrum light = render::flat_spectrum(bands.count(), 0.0);
    for (const LampSpec& lamp : device.lamps) {
      for (const render::Lamp& one : lamps_of(lamp, bands, 1.0)) light += render::lamp_power(one);
    }
    if (light.sum() > 0.0) out.white_balance = render::grey_gains(out, light);
  }
  return out;
}

double least_noise_share(const CameraSpec& camera) {
  render::ImagerResponse response;
  response.full_well_e = camera.full_well_e;
  response.dark_e = camera.dark_current_e_per_s * camera.exposure_us / kMicrosecondsPerSecond;
  response.read_noise_e = camera.read_noise_e;
  response.quantisation_e = camera.full_well_e / ((1 << camera.bits) - 1 - camera.black_level_DN);
  // Of a binned picture's pixels green is two samples.
  const double samples = camera.bayer == render::BayerPattern::binned ? 2.0 : 1.0;
  return render::noise_e(response, camera.full_well_e) / (camera.full_well_e * std::sqrt(samples));
}

render::MotionChipSettings motion_chip(const DeviceSpec& device, const SceneBands& bands, bool with_noise) {
  if (!device.camera || !device.camera->motion_chip) {
    fail_at(device.where, "device {}: its camera has no motion_chip", device.name);
  }
  const MotionChipSpec& spec = *device.camera->motion_chip;
  render::MotionChipSettings chip;
  chip.imager = imager(device, bands, with_noise);
  chip.frame_rate_Hz = device.camera->frame_rate_Hz;
  chip.shutter = {spec.automatic_shutter, spec.darkest_maximum, spec.brightest_maximum};
  try {
    check(chip);
  } catch (const Error& error) {
    fail_at(spec.where, "camera.motion_chip: {}", error.what());
  }
  return chip;
}

}  // namespace touchstone::sim
