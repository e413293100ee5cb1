#pragma once
// What the parts of a device's bench share. For lab/bench/device_bench*.cpp alone.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/progress.h"
#include "fem/elements/compliance.h"
#include "fem/elements/element.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/device_bench.h"
#include "render/imager/imager.h"
#include "sim/need/switched_effect.h"

namespace touchstone::lab {

inline constexpr double kMostSeconds = 40.0;  ///< for one setting of a curve

/// Pictures of one press by the reference's light, twice without common random numbers.
struct TruePictures {
  sim::PressSpec spec;
  TwoRuns runs;
  render::Imager imager;
};

/// The device, its reference gel and what was pressed on it.
struct BenchParts {
  BenchSettings settings;
  sim::DeviceSpec whole_device;  ///< as it is
  sim::DeviceSpec device;        ///< with the middle of its pictures
  BenchPresses presses;
  double depth_mm = 0.0;
  fem::Compliance own_gel;
  sim::DeviceSpec finest_device;
  double finest_edges = 0.0;  ///< times the device's
  fem::Compliance finest_gel;
  double finest_seconds = 0.0;
  PressForces finest_forces;              ///< of `presses`
  sim::EffectSwitches exact;              ///< of the reference's pictures
  std::string exact_words;                ///< ", with interreflection": what of it the plan leaves out; empty: nothing
  int reference_paths = 0;                ///< a pixel, of true pictures
  double least_pixel_error = 0.0;         ///< see DeviceBench
  std::optional<TruePictures> truth;      ///< of the first press on the finest gel; nothing where there are no pictures
  std::optional<TruePictures> own_truth;  ///< likewise on the device's own gel
};

/// The rigid ball, with friction, that presses where no object is given.
sim::ObjectSpec bench_ball(double radius_mm);

/// The same device with all edge lengths of its gel's mesh multiplied.
sim::DeviceSpec with_edges(sim::DeviceSpec device, double factor);

/// Set up anew, whatever a cache has.
struct MadeGel {
  fem::Compliance gel;
  double seconds = 0.0;
};
/// Makes the gel without its cache, since the time counts.
MadeGel make_gel(const sim::DeviceSpec& device, fem::Element element = fem::Element::taylor_hood);

/// The device with other edges, in forces and, where there is a truth, in pictures. What can't be had is in its note.
BenchPoint mesh_point(const BenchParts& parts, double edges);

/// Paths, the same number in each pixel, with what the plan leaves out.
sim::SceneSpec reference_scene(const BenchParts& parts, const sim::DeviceSpec& device, const sim::PressSpec& spec,
                               std::uint64_t seed);
/// The pictures of a press twice, with other random numbers the second time.
TruePictures true_pictures(const BenchParts& parts, const sim::DeviceSpec& device, const fem::Compliance& gel,
                           const sim::PressSpec& spec, std::uint64_t seed);

/// Makes parts.truth and parts.own_truth, or leaves them empty; in words, which or why.
std::string prepare_pictures(BenchParts& parts);

/// What a mesh gets wrong of pictures, free of the paths' noise.
/// @pre parts.truth
double mesh_pixel_error(const BenchParts& parts, const sim::DeviceSpec& device, const fem::Compliance& gel);

/// A way to make a scene's pictures.
struct LightSetting {
  std::string words;
  sim::LightSpec light;
  sim::EffectSwitches effects;
  std::optional<sim::AccuracySpec> accuracy = {};
  bool adaptive_paths = false;  ///< light.noise_fraction may be chosen between those tried
  double pixel_error = kUnknown;
  double once_s = kUnknown, each_s = kUnknown;
};

/// "paths to 0.5 of the imager's noise", for a row's label.
std::string paths_in_words(double noise_fraction);

/// Shows a press's scene that way, and fills in what it took and how far it is from the truth; `point` gets the same.
/// What can't be had is in the point's note.
LightSetting try_light(const BenchParts& parts, const TruePictures& truth, const sim::DeviceSpec& device,
                       const fem::Compliance& gel, LightSetting one, std::uint64_t seed, BenchPoint& point);

/// The curves of light, samples, bands, the fine contact's pixels and events, as far as the device has them. `tries`
/// gets the settings of light that were tried.
std::vector<BenchCurve> light_curves(const BenchParts& parts, std::vector<LightSetting>& tries,
                                     const Progress& progress);

/// The curve of light.event_step. @pre the device has event pixels
BenchCurve events_curve(const BenchParts& parts, const Progress& progress);

/// The coarsest mesh from which on all finer ones that could be had hold both errors, and the next coarser one, which
/// doesn't. Either may be null.
struct HoldingMesh {
  const BenchPoint* holds = nullptr;
  const BenchPoint* coarser = nullptr;
};
/// Compares a curve's meshes from the finest one on.
HoldingMesh coarsest_holding(const BenchCurve& mesh, double force_error, double pixel_error);

/// `mesh` gets finer meshes where none of its own holds the wanted errors.
BenchChoice cheapest_choice(const BenchParts& parts, BenchCurve& mesh, const std::vector<LightSetting>& tries,
                            const Progress& progress);

/// The same parts with other presses, as many, and the finest gel's forces of them; pictures stay the first ones'.
BenchParts with_other_presses(const BenchParts& parts, std::uint64_t seed);

/// What whole pictures take.
struct WholeSeconds {
  double once = 0.0, frame = 0.0;
  bool by_middle = false;  ///< see BenchChoice
};
/// With the mesh's edges times `edges`; from the middle, whose seconds `light` has, where they would take too long.
WholeSeconds whole_seconds(const BenchParts& parts, double edges, const LightSetting& light);

/// Both plans, by fixed shares and by need. @pre prepare_pictures() has been called
PlannedBench planned_bench(const BenchParts& parts, const Progress& progress);
/// Its section of the page.
std::string planned_page(const DeviceBench& bench);

/// The effects that scenes can switch, by the names that pages show.
std::span<const sim::SwitchedEffect> switched_effects();

/// What each effect that the plan may leave out contributes on the device's presses, and what it costs.
std::vector<EffectShare> effect_shares(const BenchParts& parts, const Progress& progress);

}  // namespace touchstone::lab
