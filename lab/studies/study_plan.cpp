#include "lab/studies/study_plan.h"

#include <algorithm>

#include "core/error.h"
#include "lab/chroma/chroma_marker_experiment.h"
#include "sim/sensor/virtual_sensor.h"

namespace touchstone::lab {
namespace {

constexpr std::uint64_t kUnit = 1;

/// From the gel's height straight in: the plan doesn't ask from where.
sim::MotionSpec straight_press(double force_N) {
  sim::MotionSpec motion;
  motion.start_mm.setZero();
  sim::MotionKey press;
  press.z = sim::AxisKey{std::nullopt, force_N};
  motion.keys = {press};
  return motion;
}

sim::SceneSpec unseen(const sim::DeviceSpec& device, const sim::ObjectSpec& object, const sim::MotionSpec& motion) {
  sim::SceneSpec scene;
  scene.device = device;
  scene.object = object;
  scene.motion = motion;
  scene.outputs.frames = false;
  scene.where = device.where;
  return scene;
}

StudyScene pictured(std::string what, sim::SceneSpec scene) {
  scene.where = scene.device.where;
  return {std::move(what), std::move(scene)};
}

/// Presses by fem::Press or fem::FinitePress alone (pressed_marker.h): rigid objects, no relaxation.
std::vector<StudyScene> scenes_of(const ApparentChangeSpec& spec) {
  std::vector<StudyScene> scenes;
  for (const ApparentSource source : spec.by) {
    if (source == ApparentSource::formula) continue;
    for (const sim::ObjectSpec& object : spec.objects) {
      StudyScene one;
      one.what = fmt::format("{} pressed with up to {:.4g} N, {}", object.name, spec.force_N.back(), name_of(source));
      one.scene = unseen(spec.device, object, straight_press(spec.force_N.back()));
      one.scene.object.friction = spec.friction.value_or(object.friction);
      sim::EffectSwitches& effects = one.scene.effects;
      if (source == ApparentSource::finite) effects.elasticity = sim::Elasticity::neo_hookean;
      effects.friction = one.scene.object.friction > 0.0 ? sim::Switch::on : sim::Switch::off;
      effects.elastic_object = effects.fine_relief = effects.relaxation = effects.inertia = sim::Switch::off;
      scenes.push_back(std::move(one));
    }
  }
  return scenes;
}

std::vector<StudyScene> scenes_of(const BeadDesignSpec& spec) {
  const sim::DeviceSpec& device = spec.base.device;
  return {pictured(fmt::format("{} pressed with up to {:.4g} N, pictured and tracked", spec.object.name, spec.load_N),
                   sim::touch_scene(device, {}, spec.object, straight_press(spec.load_N))),
          {"the training's load cycle, without pictures", unseen(device, spec.object, spec.training)},
          {"the verification, without pictures", unseen(device, spec.object, spec.verification)}};
}

std::vector<StudyScene> scenes_of(const ColourDesignSpec& spec) {
  const MarkerTest test{spec.place_mm, spec.friction};
  const sim::MotionSpec motion =
      shear_motion(test, spec.shear_depths_mm.back(), {spec.shear_mm, spec.shear_mm}, spec.shear_steps);
  return {pictured(
      fmt::format("a ball pressed {:.4g} mm deep on a marker and dragged, pictured", spec.shear_depths_mm.back()),
      sim::touch_scene(spec.base.device, chroma_sensor_settings(kUnit), marker_ball(test), motion))};
}

std::size_t designs_of(const ApparentChangeSpec& spec) {
  return spec.vary.values.size();
}
std::size_t designs_of(const BeadDesignSpec& spec) {
  return design_points(spec.plan).size();
}
std::size_t designs_of(const ColourDesignSpec& spec) {
  return design_points(spec.plan).size();
}

}  // namespace

std::vector<StudyScene> study_scenes(const StudySpec& study) {
  return std::visit([](const auto& spec) { return scenes_of(spec); }, study.kind);
}

std::size_t design_count(const StudySpec& study) {
  return std::visit([](const auto& spec) { return designs_of(spec); }, study.kind);
}

}  // namespace touchstone::lab
