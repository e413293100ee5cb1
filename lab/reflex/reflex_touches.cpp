#include "lab/reflex/reflex_touches.h"

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/device_gel.h"
#include "sim/scene/device_imager.h"
#include "sim/view/visible_scene.h"

namespace touchstone::lab {
namespace {

ReflexTruth truth_of(const sim::PathPoint& point, const fem::PressState& state) {
  ReflexTruth truth;
  truth.press_mm = -point.shift_mm.z();
  truth.lateral_mm = point.shift_mm.head<2>();
  truth.contact = truth.press_mm > 0.0;
  truth.normal_N = state.wrench[2];
  truth.shear_N = -state.wrench.head<2>();
  return truth;
}

/// Finer where the touch begins: there a contact is detected or missed, and the force grows with the square of the
/// depth.
void refine_beginning(sim::PressPath& path) {
  std::vector<sim::PathPoint> points;
  for (const double depth : {0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4}) points.push_back({depth, {0.0, 0.0, -depth}});
  for (const sim::PathPoint& point : path.points) {
    if (point.at > 0.45) points.push_back(point);
  }
  path.points = std::move(points);
}

ReflexTouchSpec shear(const std::string& name, double depth_mm, double towards_deg) {
  ReflexPress press;
  press.deepest_mm = depth_mm;
  press.step_mm = 0.5;
  return {name, press_and_shear(press, {.reach_mm = 1.5, .towards_deg = towards_deg, .shear_step_mm = 0.5})};
}

}  // namespace

std::vector<ReflexTouchSpec> reflex_row_touches(bool quick) {
  std::vector<ReflexTouchSpec> specs;
  ReflexPress press;
  press.step_mm = quick ? 0.5 : 0.25;
  specs.push_back({"plate", press_down(press)});
  if (quick) return specs;
  refine_beginning(specs.back().path);
  press.step_mm = 0.5;
  press.deepest_mm = 4.0;
  ReflexPress tilted = press;
  tilted.tilt_deg = 10.0;
  tilted.tilt_towards_deg = 30.0;
  specs.push_back({"tilt", press_down(tilted)});
  for (const ReflexObject object : {ReflexObject::ball, ReflexObject::cylinder}) {
    press.object = object;
    specs.push_back({name_of(object), press_down(press)});
  }
  specs.push_back(shear("shear-x-2", 2.0, 0.0));
  specs.push_back(shear("shear-x-4", 4.0, 0.0));
  specs.push_back(shear("shear-y-2", 2.0, 90.0));
  specs.push_back(shear("shear-y-4", 4.0, 90.0));
  specs.push_back(shear("shear-45-3", 3.0, 45.0));
  return specs;
}

ReflexTruth ReflexTouch::truth(double place) const {
  ReflexTruth here;
  if (!(place > 0.0)) {
    here.press_mm = place;
    return here;
  }
  if (place >= at.back()) return states.back();
  const auto above = static_cast<std::size_t>(std::upper_bound(at.begin(), at.end(), place) - at.begin());
  const ReflexTruth &from = states[above - 1], &to = states[above];
  const double part = (place - at[above - 1]) / (at[above] - at[above - 1]);
  here.contact = true;
  here.press_mm = from.press_mm + part * (to.press_mm - from.press_mm);
  here.lateral_mm = from.lateral_mm + part * (to.lateral_mm - from.lateral_mm);
  here.normal_N = from.normal_N + part * (to.normal_N - from.normal_N);
  here.shear_N = from.shear_N + part * (to.shear_N - from.shear_N);
  return here;
}

const ReflexTouch& ReflexSetup::touch(const std::string& name) const {
  const auto found = std::find_if(touches.begin(), touches.end(), [&](const auto& one) { return one.name == name; });
  TS_ASSERT(found != touches.end());
  return *found;
}

ReflexSetup set_up_reflex(const sim::DeviceSpec& device, const std::filesystem::path& cache_folder,
                          std::span<const ReflexTouchSpec> specs, const ReflexLightSettings& light,
                          const ReflexPathLightSettings& path_light, const Progress& progress) {
  if (specs.empty()) fail("the reflex setup needs a touch");
  ReflexSetup setup;
  setup.device = device;
  sim::PathPlayer player(device, cache_folder);
  std::vector<sim::PlayedPath> played;
  for (const ReflexTouchSpec& spec : specs) {
    if (spec.path.points.empty() || spec.path.points.front().at != 0.0) {
      fail("the touch {} doesn't begin at 0", spec.name);
    }
    played.push_back(player.play(spec.path, progress));
    if (!played.back().note.empty()) setup.notes.push_back(played.back().note);
    if (played.back().states.size() < 2) {
      fail("the touch {} has {} states, two are needed: {}", spec.name, played.back().states.size(),
           played.back().stopped);
    }
  }

  const auto gel = sim::set_up_finite_gel(device);
  const sim::VisibleGel skin = visible_skin(*gel, sim::gel_body(device));
  for (std::size_t i = 0; i < specs.size(); ++i) {
    if (progress) progress("light of touches", static_cast<std::int64_t>(i), static_cast<std::int64_t>(specs.size()));
    const fem::ContactShape shape = shape_of(specs[i].path);
    // The deepest first: the light's error is measured on it.
    std::vector<sim::GelSheet> reached;
    for (auto state = played[i].states.rbegin(); state != played[i].states.rend(); ++state) {
      reached.push_back(skin_sheet(skin, *state, shape));
    }
    const sim::GelSheet rest = reached.back();
    // A light field for each touch: that of all of them would be a much larger one.
    const ReflexLight optics(device, rest, reached, light);
    if (i == 0) {
      setup.light_error = optics.error();
      setup.chip = sim::motion_chip(device, optics.bands(), true);
    }
    const ReflexPathLight::Picture picture = [&](double place) {
      return optics.irradiance(skin_sheet(skin, played[i].state(place), shape));
    };
    ReflexTouch touch{specs[i].name,
                      played[i].at,
                      {},
                      ReflexPathLight(picture, played[i].at, setup.chip, path_light),
                      played[i].stopped};
    for (std::size_t k = 0; k < played[i].states.size(); ++k) {
      touch.states.push_back(truth_of(specs[i].path.points[k], played[i].states[k]));
    }
    setup.touches.push_back(std::move(touch));
  }
  return setup;
}

}  // namespace touchstone::lab
