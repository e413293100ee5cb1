#pragma once
// What accuracy costs on a device (`touchstone bench`, docs/accuracy-and-cost.md): error against seconds for everything
// that can be set, the cheapest setting for a wanted error, and what each effect buys.
//
// Errors are differences from a reference made on the spot: a mesh much finer where it is touched, light traced with
// many more paths and another seed. The references' own errors are given beside them. Errors of the model
// (linear elasticity, ray optics) aren't in them; the table of effects has finite strain's.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/device_bench_estimator.h"
#include "lab/studies/study_files.h"
#include "sim/scene/device.h"

namespace touchstone::lab {

/// What error is wanted, on which presses, and how fine the references may be.
struct BenchSettings {
  double force_error = 0.01;              ///< wanted: relative, root mean square over presses; above 0
  double pixel_error = 1.0;               ///< wanted: root mean square over pixels, of the imager's noise; above 0
  std::optional<sim::ObjectSpec> object;  ///< absent: a ball whose radius is the gel's thickness, with friction
  std::optional<double> depth_mm;         ///< of the presses; absent: a tenth of the gel's thickness
  int most_pixels = 160 * 120;            ///< pictures are compared on so many of their middle
  int most_tetrahedra = 45000;            ///< of the reference's mesh; so many take some 2 GB and a minute
  bool finite_strain = true;              ///< one press at finite strain, which takes up to minutes
  bool planned_alone = false;             ///< what plans hold as they are, without curves or a choice
  EstimatorSettings estimator;
  std::uint64_t seed = 1;
};

/// One setting tried.
struct BenchPoint {
  std::string setting;            ///< "fine_mm 0.5, coarse_mm 1.5"
  std::string series;             ///< of several in a curve: those of one are joined in its plot
  double value = 0.0;             ///< what was varied, as a number
  double once_s = kUnknown;       ///< seconds once: setting up the gel, the camera of a scene
  double each_s = kUnknown;       ///< seconds a state, a picture or a scene's events
  double work = kUnknown;         ///< what was counted, see BenchCurve::work
  double force_error = kUnknown;  ///< relative
  double beads_um = kUnknown;     ///< root mean square over beads
  double pixel_error = kUnknown;  ///< root mean square, of the imager's noise
  double pixel_worst = kUnknown;  ///< of all pixels but 1 %
  double event_error = kUnknown;  ///< part of the events that are missing, too many, or more than a millisecond off
  bool as_is = false;             ///< the device's own setting
  std::string note;
};

/// One thing varied, all else as the device has it.
struct BenchCurve {
  std::string name;              ///< "mesh"
  std::string what;              ///< a sentence: what is varied and what it's compared with
  std::string once, each, work;  ///< what the columns count
  std::vector<BenchPoint> points;
};

/// What is left to who makes scenes: a device's mesh and a scene's light.
struct BenchChoice {
  double edges = 1.0;  ///< the mesh's edges, times the device's own
  double fine_mm = 0.0, coarse_mm = 0.0;
  sim::LightSpec light;
  sim::EffectSwitches effects;
  std::string light_words;           ///< "paths to 0.8 of the imager's noise"
  double force_error = kUnknown;     ///< as measured while it was looked for
  double pixel_error = kUnknown;     ///< likewise
  double verified_force = kUnknown;  ///< on other presses
  double verified_pixel = kUnknown;  ///< on other presses, by other random numbers
  bool holds = false;                ///< both wanted errors, on the other presses
  // Of whole pictures: once for gel and camera, then a frame. The same of the device as it is.
  double once_s = kUnknown, frame_s = kUnknown;
  double as_is_once_s = kUnknown, as_is_frame_s = kUnknown;
  bool by_middle = false;  ///< those seconds: the middle's were taken times the pixels, as whole pictures take long
  double as_is_force = kUnknown, as_is_pixel = kUnknown;  ///< on the same other presses
  std::string remark;                                     ///< what couldn't be had, and why
  std::vector<std::string> remark_rounds;                 ///< choices before this one that didn't hold on other presses
};

/// An effect switched over, all else as the plan has it.
struct EffectShare {
  std::string name;
  bool planned = false;             ///< simulated without being asked for; then it was switched off, else on
  double force_change = kUnknown;   ///< relative, of the pressed and the dragged state
  double pixel_change = kUnknown;   ///< root mean square, of the imager's noise
  double number_change = kUnknown;  ///< root mean square, of the frames' numbers
  double seconds = kUnknown;        ///< a frame, with it less without it
  double once_s = kUnknown;         ///< once a scene, likewise
  std::string note;
};

/// Pictures as a plan has them.
struct PlannedWay {
  std::string name;                              ///< "by need"
  std::string effects;                           ///< those that are on, of what either plan may switch
  std::string light;                             ///< how pictures are made, as the camera says it
  double pixel_error = kUnknown;                 ///< root mean square, of the imager's noise
  double once_s = kUnknown, frame_s = kUnknown;  ///< of whole pictures
  std::string note;                              ///< why there is no error
};

/// The device as its file has it, planned by fixed shares and by need, on presses that nothing was chosen by.
struct PlannedBench {
  double force_error = kUnknown;  ///< of its mesh: relative
  std::vector<PlannedWay> ways;   ///< by fixed shares, by need
  bool finite_strain = false;     ///< by need; not in the errors, as references are linear
  bool by_middle = false;         ///< as BenchChoice
  std::string needs;              ///< in words: what leaving each effect out was measured to change
};

/// All that a device's bench found.
struct DeviceBench {
  std::string device;
  std::string presses;             ///< in words
  std::string reference;           ///< in words, with what it's off itself
  std::string pictures;            ///< in words: how large; or why there are none
  double least_pixel_error = 0.0;  ///< smaller ones can't be distinguished from zero, as the reference has noise itself
  std::vector<BenchCurve> curves;
  BenchChoice choice;
  std::vector<EffectShare> effects;
  PlannedBench planned;
  std::optional<EstimatorBench> estimator;  ///< nothing where it was left out
  BenchSettings settings;
};

/// @throws Error for a device that can't be pressed so, or settings out of range; what can't be had of pictures is said
///   in the result
DeviceBench bench_device(const sim::DeviceSpec& device, const BenchSettings& settings, const Progress& progress = {});

/// bench.md (the answer first, or the estimator's part alone), bench.csv (all points), a plot a curve, and DEVICE.yaml,
/// the device's file `text` with the mesh that was chosen, if it was and the file names its edges.
StudyResult report(const DeviceBench& bench, const std::string& text);

}  // namespace touchstone::lab
