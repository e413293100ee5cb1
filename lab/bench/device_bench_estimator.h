#pragma once
// What a device's own estimator errs by on frames with everything on, against how its training frames were made: with
// an effect left out, on coarser meshes, with fewer paths, in other numbers; and what those frames cost.
//
// Estimators: the one of heights of coated gels (`touchstone calibrate gelsight`), the one of forces from beads
// (`calibrate vhs`). Both are calibrated by the functions that those commands call.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/progress.h"
#include "fem/elements/compliance.h"
#include "lab/bench/bench_scene.h"
#include "lab/studies/study_files.h"
#include "plots/line_plot.h"
#include "sim/scene/scene.h"

namespace touchstone::lab {

/// How many frames the device's own estimator is trained and tested on.
struct EstimatorSettings {
  bool on = true;      ///< measure it
  bool alone = false;  ///< and nothing else
  /// Of a row; even, at least 4; the curve goes from a quarter to twice as many. Absent: 12 of heights; 24 of forces,
  /// since each axis has up to 12 coefficients for 3 x 3 beads and as many frames fit the noise, too.
  std::optional<int> training_frames;
  int training_sets = 3;          ///< of other presses each: how far they differ is a row's own spread; at least 2
  int test_frames = 10;           ///< even, at least 2
  std::vector<std::string> rows;  ///< of these names alone, beside the plan's; empty: all
};

/// A way to make training frames, and what the estimator that was trained on them errs by.
struct EstimatorRow {
  std::string name;            ///< "without interreflection"
  std::string group;           ///< rows of one have one colour in the plot
  int frames = 0;              ///< that it was trained on
  std::vector<double> errors;  ///< one a training set, in EstimatorBench::unit; the same presses in all rows
  double once_s = kUnknown;    ///< seconds of a core: gel and camera
  double each_s = kUnknown;    ///< seconds of a core: a frame
  int left_out = 0;            ///< training frames of all sets that the estimator couldn't use
  std::string light;           ///< how its frames were lit
  std::string note;            ///< why there are no errors

  /// Of the training sets. @pre there are errors
  double mean() const;
  /// Least and most of them. @pre there are errors
  std::pair<double, double> range() const;
};

/// What the device's own estimator errs by on frames with everything on, against how its training frames were made.
struct EstimatorBench {
  std::string none;                  ///< why there is none; all else is then empty
  std::string quantity;              ///< "heights"
  std::string unit;                  ///< "um"
  double typical = 0.0;              ///< root mean square of what is estimated, in `unit`
  std::string training;              ///< in words: estimator and frames
  std::string test;                  ///< in words
  EstimatorRow reference;            ///< trained on frames as the plan has them
  std::vector<EstimatorRow> rows;    ///< one thing other than the reference, in each
  std::vector<EstimatorRow> counts;  ///< as planned, other numbers of frames, growing
  double seconds = 0.0;              ///< that all of it took, by the clock
};

/// Which device, what is pressed on it and how deep.
struct EstimatorDevice {
  const sim::DeviceSpec& device;
  const fem::Compliance& gel;  ///< on the device's own mesh
  double gel_seconds = 0.0;    ///< that it took
  sim::ObjectSpec object;      ///< of the test's frames; forces are trained on it, too, heights on a ball
  double depth_mm = 0.0;       ///< presses are half to twice as deep
  std::uint64_t seed = 1;
};

/// @throws Error that names the setting that is out of range
void check(const EstimatorSettings& settings);

/// @throws Error for settings out of range, or where the reference can't be had; what can't be had of a row is in its
///   note
EstimatorBench bench_estimator(const EstimatorDevice& of, const EstimatorSettings& settings,
                               const Progress& progress = {});

/// How much more a row errs than the reference, one a training set: differences on the same presses.
std::vector<double> more_errors(const EstimatorRow& row, const EstimatorRow& reference);

/// The part of bench.md, with the plots' files that it names.
std::string estimator_page(const EstimatorBench& bench, const std::string& device, std::vector<StudyFile>& files);

}  // namespace touchstone::lab
