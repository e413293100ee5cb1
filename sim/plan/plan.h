#pragma once

#include <string>
#include <vector>

#include "sim/files/colour.h"
#include "sim/plan/need.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// One effect of the table in docs/ARCHITECTURE.md: simulated or not, why, and what it costs.
struct Effect {
  std::string name;
  bool on = false;
  std::string why;
  std::string cost;
  std::optional<Change> change;  ///< by leaving it out, where that decided
};

/// What a scene calls for. No code runs for an effect that is off.
struct Plan {
  bool camera = false;
  bool finite_strain = false;
  bool friction = false;
  bool elastic_object = false;
  bool fine_relief = false;
  double relief_pixel_mm = 0.0;  ///< where fine relief is on: of its grid
  bool relaxation = false;
  bool inertia = false;
  bool refraction = false;
  bool interreflection = false;
  bool scattering = false;
  bool translucent_coating = false;  ///< objects are seen through the coating where they touch it
  bool object_print = false;         ///< what is printed on objects is seen
  bool skin_blanching = false;       ///< and depends on how they are pressed
  bool sensor_noise = false;
  bool vignetting = false;  ///< these six: of the camera's pipeline (render/imager/imager.h)
  bool hot_pixels = false;
  bool auto_exposure = false;
  bool auto_white_balance = false;
  bool tone_curve = false;
  bool jpeg = false;
  SceneBands bands;  ///< of the light; none without a picture
  bool motion_blur = false;
  bool rolling_shutter = false;
  bool events = false;
  bool diffraction = false;     ///< at the camera's hole or stop
  bool direct_light = false;    ///< to be tried; VirtualCamera measures whether it holds (sim/sensor/direct_light.h)
  bool shared_paths = false;    ///< behind a wide hole, where direct light isn't taken
  int states_a_frame = 1;       ///< pressed states that are kept from one frame to the next
  std::vector<Effect> effects;  ///< the same for people, with reasons
  std::vector<std::string> warnings;  ///< what is likely a mistake, for people (sim/plan/size_doubt.h)
};

/// Decides each effect from the scene's own content and from the outputs asked for. Where the scene or its device
/// states an accuracy, effects are on that change more than it lets out: by a closed form, or as `needs` has it
/// (sim/need/scene_needs.h); else by fixed shares.
/// @throws Error if an output can't be had (an image from a device without a camera), or effects that don't go together
Plan make_plan(const SceneSpec& scene, const SceneNeeds& needs = {});

/// Part of the force that a quasi-static press leaves out at this frequency, (f / f0)^2 with f0 the gel's lowest
/// eigenfrequency, taken as that of a wide layer: the order of it, from above for a body that rests on the gel.
double inertia_estimate(const GelSpec& gel, double frequency_Hz);

/// Part of the light leaving a bright disc of albedo `albedo` and radius `disc_radius_mm` on the outer surface that
/// comes back to it by reflection at the plate's lower face, the first term of the interreflection series. Light beyond
/// the critical angle returns whole but sideways by 2 sum h_i tan(theta_i), so a small disc doesn't meet it again.
double interreflection_estimate(const GelSpec& gel, const PlateSpec& plate, double albedo, double disc_radius_mm);

}  // namespace touchstone::sim
