#pragma once
// A scene file: a device, the objects that touch it, their motions, and the outputs asked for. See
// docs/file-formats.md.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/yaml_reader.h"
#include "sim/scene/accuracy.h"
#include "sim/scene/device.h"
#include "sim/scene/motion.h"
#include "sim/scene/object.h"

namespace touchstone::sim {

/// What a scene's owner wants to have. Truth (forces, beads, surface) is always there.
struct OutputSpec {
  bool frames = true;     ///< what the camera delivers: PNG
  bool ideal = false;     ///< frames without noise beside them: PNG
  bool radiance = false;  ///< linear irradiance on the sensor: EXR, W/m^2 a band
  bool height = false;    ///< the membrane's height: EXR, mm
  // Truth of each pixel, layers of one EXR (sim/view/pixel_truth.h).
  bool depth = false;
  bool normals = false;
  bool ids = false;
  bool contact = false;
  bool flow = false;
  bool error = false;   ///< the achieved standard error of the light
  bool events = false;  ///< what event pixels record from the first frame to the last; by itself it asks for no picture
  SourceLocation where = {};

  /// Is light to be traced?
  bool light() const { return frames || ideal || radiance || error; }
  /// Is anything asked for that comes from a pixel's first hit?
  bool first_hits() const { return depth || normals || ids || contact || flow; }
  bool pixel_truth() const { return first_hits() || error; }
  /// Is a camera needed?
  bool camera() const { return light() || first_hits() || events; }
};

/// How exact the light has to be. What is left open here says sim/scene/light_limits.h.
struct LightSpec {
  std::optional<double> noise_fraction;
  std::optional<int> min_samples, max_samples;
  std::optional<double> direct_tolerance;
  double interreflection_tolerance = 0.05;  ///< part of a surface's light that may be left out
  double motion_tolerance_px =
      0.3;  ///< image motion that needn't show as rolling shutter or, times the camera's own blur, as motion blur
  double change_tolerance = 0.25;  ///< a pixel that changed by less than this part of the noise keeps its old light
  double event_step = 0.5;         ///< of the smallest threshold: what event pixels may change by between two pictures
  /// How far something may move in an event camera's picture until it is drawn in full again
  /// (sim/sensor/light_between.h); 0: each picture is.
  double event_reach_px = 1.0;
};

/// Pixels of the fine contact and of the height map: square, the map centred on the gel's origin.
struct MembraneSpec {
  double pixel_um = 20.0;  ///< a third of the finest detail, or finer
  /// Of the height map; without it, the part of the surface that the device meshes finely.
  std::optional<Eigen::Vector2d> height_size_mm;
  SourceLocation where;
};

/// On or off by the user's wish, or as the plan finds it to matter.
enum class Switch { automatic, on, off };
EnumNames<Switch> enum_names(Switch);

/// How the gel answers to large strain.
enum class Elasticity {
  automatic,   ///< finite strain where the plan finds that it matters, else linear
  linear,      ///< fast, and good while PressState::largest_strain is small
  neo_hookean  ///< at finite strain (fem/finite_strain/finite_press.h): seconds a frame
};
EnumNames<Elasticity> enum_names(Elasticity);

/// A scene may force an effect on or off; `automatic` leaves it to the plan.
struct EffectSwitches {
  Elasticity elasticity = Elasticity::automatic;
  Switch friction = Switch::automatic;
  Switch elastic_object = Switch::automatic;
  Switch fine_relief = Switch::automatic;
  Switch relaxation = Switch::automatic;
  Switch inertia = Switch::automatic;
  Switch interreflection = Switch::automatic;
  Switch translucent_coating = Switch::automatic;
  Switch diffraction = Switch::automatic;
  Switch direct_light = Switch::automatic;
  Switch shared_paths = Switch::automatic;
  Switch motion_blur = Switch::automatic;
  Switch rolling_shutter = Switch::automatic;
  Switch sensor_noise = Switch::automatic;
};

/// An object beside the scene's first one, moved at the same time.
struct AddedObject {
  ObjectSpec object;
  MotionSpec motion;  ///< of as many frames at the same rate as the first object's
  SourceLocation where;
};

/// All of a scene file with the files that it names, checked.
struct SceneSpec {
  DeviceSpec device;
  ObjectSpec object;
  MotionSpec motion;
  std::vector<AddedObject> more_objects;
  OutputSpec outputs;
  LightSpec light;
  EffectSwitches effects;
  MembraneSpec membrane;
  /// How exact it has to be; counts more than the device's. If neither states it, the plan goes by fixed shares.
  std::optional<AccuracySpec> accuracy;
  double lamp_level = 1.0;  ///< the device's lamps are dimmed to this part of their power
  std::uint64_t seed = 0;
  SourceLocation where;
};

/// One object of a scene with its motion; they belong to the scene.
struct MovedObject {
  const ObjectSpec& object;
  const MotionSpec& motion;
};

/// All objects, the first one first.
std::vector<MovedObject> moved_objects(const SceneSpec& scene);

void fields(YamlReader& in, AddedObject& added);
void fields(YamlReader& in, OutputSpec& outputs);
void fields(YamlReader& in, LightSpec& light);
void fields(YamlReader& in, EffectSwitches& effects);
void fields(YamlReader& in, MembraneSpec& membrane);
void fields(YamlReader& in, SceneSpec& scene);

/// Reads a scene and the device and object files that it names. @throws Error with file and line
SceneSpec read_scene(const std::filesystem::path& file);

}  // namespace touchstone::sim
