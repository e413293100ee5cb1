#include "sim/scene/scene.h"

#include <algorithm>

#include "core/named_file.h"
#include "sim/scene/light_limits.h"

namespace touchstone::sim {
namespace {

/// Reads the file that a scene names under `key`, relative to the scene's own folder.
template <typename T>
void read_named_file(YamlReader& in, const std::string& key, T& value) {
  std::string name;
  in.required(key, name);
  if (in.describing()) return;
  value = read_yaml<T>(named_file(in, key, name));
}

}  // namespace

std::vector<MovedObject> moved_objects(const SceneSpec& scene) {
  std::vector<MovedObject> all = {{scene.object, scene.motion}};
  for (const AddedObject& added : scene.more_objects) all.push_back({added.object, added.motion});
  return all;
}

EnumNames<Switch> enum_names(Switch) {
  return {{"auto", Switch::automatic}, {"on", Switch::on}, {"off", Switch::off}};
}

void fields(YamlReader& in, AddedObject& added) {
  added.where = in.where();
  read_named_file(in, "object", added.object);
  read_named_file(in, "motion", added.motion);
  in.optional("start_mm", added.motion.start_mm);
}

EnumNames<Elasticity> enum_names(Elasticity) {
  return {{"auto", Elasticity::automatic}, {"linear", Elasticity::linear}, {"neo_hookean", Elasticity::neo_hookean}};
}

void fields(YamlReader& in, OutputSpec& outputs) {
  outputs.where = in.where();
  in.optional("frames", outputs.frames);
  in.optional("ideal", outputs.ideal);
  in.optional("radiance", outputs.radiance);
  in.optional("height", outputs.height);
  in.optional("depth", outputs.depth);
  in.optional("normals", outputs.normals);
  in.optional("ids", outputs.ids);
  in.optional("contact", outputs.contact);
  in.optional("flow", outputs.flow);
  in.optional("error", outputs.error);
  in.optional("events", outputs.events);
}

void fields(YamlReader& in, LightSpec& light) {
  in.optional("noise_fraction", light.noise_fraction, Allowed::above(0.0));
  in.optional("max_samples", light.max_samples, Allowed::within(1, 1 << 20));
  in.optional("min_samples", light.min_samples, Allowed::within(1, light.max_samples.value_or(kUsualMaxSamples)));
  in.optional("interreflection_tolerance", light.interreflection_tolerance, Allowed::within(0.0, 1.0));
  in.optional("motion_tolerance_px", light.motion_tolerance_px, Allowed::at_least(0.0));
  in.optional("change_tolerance", light.change_tolerance, Allowed::at_least(0.0));
  in.optional("direct_tolerance", light.direct_tolerance, Allowed::above_up_to(0.0, 1.0));
  in.optional("event_step", light.event_step, Allowed::above_up_to(0.0, 10.0));
  in.optional("event_reach_px", light.event_reach_px, Allowed::within(0.0, 100.0));
}

void fields(YamlReader& in, EffectSwitches& effects) {
  in.optional("elasticity", effects.elasticity);
  in.optional("friction", effects.friction);
  in.optional("elastic_object", effects.elastic_object);
  in.optional("fine_relief", effects.fine_relief);
  in.optional("relaxation", effects.relaxation);
  in.optional("inertia", effects.inertia);
  in.optional("interreflection", effects.interreflection);
  in.optional("translucent_coating", effects.translucent_coating);
  in.optional("diffraction", effects.diffraction);
  in.optional("direct_light", effects.direct_light);
  in.optional("shared_paths", effects.shared_paths);
  in.optional("motion_blur", effects.motion_blur);
  in.optional("rolling_shutter", effects.rolling_shutter);
  in.optional("sensor_noise", effects.sensor_noise);
}

void fields(YamlReader& in, MembraneSpec& membrane) {
  membrane.where = in.where();
  in.optional("pixel_um", membrane.pixel_um, Allowed::within(1.0, 1000.0));
  in.optional("height_size_mm", membrane.height_size_mm, Allowed::above_up_to(0.0, 1000.0));
}

void fields(YamlReader& in, SceneSpec& scene) {
  scene.where = scene.membrane.where = in.where();
  read_named_file(in, "device", scene.device);
  read_named_file(in, "object", scene.object);
  read_named_file(in, "motion", scene.motion);
  in.optional("start_mm", scene.motion.start_mm);
  in.optional("more_objects", scene.more_objects);
  for (const AddedObject& added : scene.more_objects) {
    const int frames = scene.motion.frame_count();
    if (added.motion.frame_count() != frames) {
      fail_at(added.where, "more_objects: the motion has {} frames, that of the first object {}; all must have as many",
              added.motion.frame_count(), frames);
    }
    if (added.motion.frame_rate_Hz != scene.motion.frame_rate_Hz) {
      fail_at(added.where,
              "more_objects: the motion has {} frames a second, that of the first object {}; all must have the same",
              added.motion.frame_rate_Hz, scene.motion.frame_rate_Hz);
    }
  }
  in.optional("outputs", scene.outputs);
  in.optional("light", scene.light);
  in.optional("effects", scene.effects);
  in.optional("membrane", scene.membrane);
  in.optional("accuracy", scene.accuracy);
  in.optional("lamp_level", scene.lamp_level, Allowed::within(0.0, 1.0));
  in.optional("seed", scene.seed);
}

SceneSpec read_scene(const std::filesystem::path& file) {
  return read_yaml<SceneSpec>(file);
}

}  // namespace touchstone::sim
