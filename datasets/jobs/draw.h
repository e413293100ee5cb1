#pragma once
// A job that draws: each sample is one press, drawn at random. See docs/datasets.md.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/yaml_reader.h"
#include "datasets/jobs/split.h"
#include "datasets/jobs/spread.h"
#include "render/lamps/guide_beams.h"
#include "sim/scene/accuracy.h"
#include "sim/scene/scene.h"

namespace touchstone::datasets {

/// What becomes of the numbers at a path of a device's or an object's file.
enum class VariationKind : std::uint8_t { set, times, plus };

/// Numbers of a file that are drawn. Each place that the path leads to gets a draw of its own (core/edited_yaml.h);
/// numbers of one list get the same.
struct NumberVariation {
  std::string path;
  VariationKind how = VariationKind::set;
  Spread spread;
  SourceLocation where;
};

/// How many sensors of one design there are, and how they differ.
struct UnitsSpec {
  int count = 1;
  std::vector<NumberVariation> vary;
};

/// One of the objects that a job presses, with what varies from piece to piece.
struct DrawnObjectSpec {
  std::filesystem::path file;
  double weight = 1.0;                 ///< how often it's taken, relative to the others
  std::optional<std::int64_t> pieces;  ///< how many there are of it; none: with `vary` a new one each sample, else one
  std::vector<NumberVariation> vary;
  SourceLocation where;
};

/// Of the object's origin, gel frame.
struct PlaceSpec {
  Spread x, y;
};

/// What is drawn for each sample: unit, object, place, angles and how hard.
struct DrawSpec {
  std::filesystem::path device;
  UnitsSpec units;
  std::vector<DrawnObjectSpec> objects;
  PlaceSpec place_mm;
  Spread turn_deg = Spread::uniform(-180.0, 180.0);      ///< about z, before the tilt
  Spread tilt_deg;                                       ///< about a level axis
  Spread tilt_axis_deg = Spread::uniform(0.0, 360.0);    ///< that axis' direction, from x to y
  std::optional<Spread> force_N;                         ///< normal; either this
  std::optional<Spread> depth_mm;                        ///< or how far its lowest point goes in
  Spread drag_mm;                                        ///< along the surface, after the press
  Spread drag_toward_deg = Spread::uniform(0.0, 360.0);  ///< from x to y
  std::optional<double> deepest_mm;                      ///< that the gel may be pressed in; default: see deepest_of
};

/// What a sample may have beside its wrench and pose, each as sim::Touch has it.
struct DrawnOutputs {
  bool frame = false, height = false, contact = false;  ///< pictures of the frame's own size
  bool beads = false, markers = false;                  ///< their true displacement
  bool traction = false;                                ///< on the gel's surface vertices
  bool events = false;
  bool statistics = false;  ///< of a motion chip
  SourceLocation where;

  bool pictures() const { return frame || height || contact; }
  /// Does the sensor's camera have to be simulated?
  bool camera() const { return pictures() || events || statistics; }
};
/// What can be stored of a sample, by its name in the job file.
enum class DrawnOutput : std::uint8_t { frame, height, contact, beads, markers, traction, events, statistics };
EnumNames<DrawnOutput> enum_names(DrawnOutput);

/// The effects that a job that draws may switch by itself.
struct DrawnEffects {
  sim::Elasticity elasticity = sim::Elasticity::automatic;
  sim::Switch fine_relief = sim::Switch::automatic;
  sim::Switch interreflection = sim::Switch::automatic;
  sim::Switch diffraction = sim::Switch::automatic;
};

/// A job file of drawn samples, as read and checked.
struct DrawJob {
  std::string name;
  std::string licence;  ///< of the data set: an SPDX name or any text; empty: none stated
  std::uint64_t seed = 0;
  std::int64_t samples = 0;
  int samples_per_file = 100;
  double membrane_um = 40.0;                 ///< sim::VirtualSensorSettings::membrane_um
  double interreflection_tolerance = 0.005;  ///< sim::VirtualSensorSettings
  int edge_side = 4;                         ///< sim::VirtualSensorSettings
  render::GuideCut guides;                   ///< sim::VirtualSensorSettings
  /// Counts more than the device's. If neither states it, effects are as in every job that draws.
  std::optional<sim::AccuracySpec> accuracy;
  DrawnEffects effects;  ///< count more than what the accuracy calls for
  DrawSpec draw;
  DrawnOutputs outputs;
  SplitSpec splits;
  SourceLocation where;
};

void fields(YamlReader& in, NumberVariation& vary);
void fields(YamlReader& in, UnitsSpec& units);
void fields(YamlReader& in, DrawnObjectSpec& object);
void fields(YamlReader& in, PlaceSpec& place);
void fields(YamlReader& in, DrawSpec& draw);
void fields(YamlReader& in, DrawnEffects& effects);
void fields(YamlReader& in, DrawJob& job);

/// Reads and checks the job file, but not the device and the objects that it names. @throws Error with file and line
DrawJob read_draw_job(const std::filesystem::path& file);

/// True if the file is a job that draws: it has the key `draw`. @throws Error if it isn't YAML
bool is_draw_job_file(const std::filesystem::path& file);

}  // namespace touchstone::datasets
