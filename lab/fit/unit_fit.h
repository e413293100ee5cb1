#pragma once
// Calibration to a real unit: the numbers of a device's file with which the simulation shows and feels what was
// recorded with it, how well they are known, and what can't be identified. docs/calibration.md describes the method.

#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "datasets/sets/run_identity.h"
#include "lab/fit/fit_folder.h"
#include "lab/fit/unit_comparison.h"
#include "lab/fit/unit_fit_spec.h"
#include "lab/fit/unit_simulation.h"

namespace touchstone::lab {

/// Reads a fit's pictures. @throws Error with the place in the fit's file
UnitRecording read_recording(const PreparedFit& fit);

/// One unknown as it was found.
struct FittedUnknown {
  std::string name;
  UnknownHow how = UnknownHow::times;
  double start = 0.0, value = 0.0;   ///< of the first number that it stands for, as the device's file has it
  bool identified = true;            ///< false: its interval is open
  double low95 = 0.0, high95 = 0.0;  ///< of the same number; -inf or 0, and inf where it isn't identified
  double deviation = 0.0;            ///< standard error: of the logarithm (times) or of the number (plus)
  double by_noise = 0.0, by_model = 0.0, by_light = 0.0, by_mesh = 0.0;  ///< what it's made of (fit_certainty.h)
  bool at_end = false;                                                   ///< at an end of its allowed range
};

/// A combination of unknowns that the data can't identify: all of them may move so at once, and nothing that was
/// recorded changes by what could be noticed.
struct UnidentifiableCombination {
  /// How far one unknown moves in the combination.
  struct Part {
    std::string name;
    UnknownHow how = UnknownHow::times;
    double move = 0.0;  ///< of the logarithm, or of the number
  };
  std::vector<Part> parts;
  std::string words;
};

/// How far what is simulated is from what was recorded, before the fit and after it.
struct FitMisfit {
  std::string what;                                  ///< the picture's file, or a press' force
  double before = 0.0, after = 0.0;                  ///< root mean square, in standard deviations of the noise
  double before_numbers = 0.0, after_numbers = 0.0;  ///< the same of 255 numbers; of a force N
};

/// Of a press: where it stood in the end.
struct FittedPress {
  double x_mm = 0.0, y_mm = 0.0, depth_mm = 0.0;
  double place_deviation_mm = 0.0, depth_deviation_mm = 0.0;  ///< 0 where they were given as known
  double force_N = 0.0;                                       ///< that the simulation has there
  bool place_at_end = false, depth_at_end = false;            ///< at an end of the range that their labels allow
};

/// The fitted numbers, how sure they are, and how well the recordings are met.
struct UnitFit {
  std::vector<FittedUnknown> unknowns;
  std::vector<UnidentifiableCombination> unidentified;
  std::vector<FittedPress> presses;
  std::vector<FitMisfit> misfits;
  double misfit_before = 0.0, misfit_after = 0.0;  ///< of all residuals, in standard deviations of their noise
  std::int64_t residuals = 0;
  int steps = 0;
  bool converged = false;
  int lamp_setups = 0;              ///< lamps' light that was set up
  std::vector<std::string> doubts;  ///< doubts_of it
  std::string device_text;          ///< the device's file with the fitted numbers
  std::vector<cv::Mat> shown;       ///< simulated in the end, CV_64F: background if there is one, then presses
};

/// How long a fit will take, as its first pictures have taken.
struct FitPlan {
  double step_s = 0.0;  ///< a step; 0 where all is a formula
  double last_s = 0.0;  ///< the pictures with other light, at the end
  int most_steps = 0;   ///< of each accuracy of the light field
};

/// What a fit says while it works, and what it goes on from. All may be empty.
struct FitCourse {
  std::function<void(const FitPlan& plan)> on_plan;  ///< once, after the first pictures
  /// After each step: its number from 1, the misfit (standard deviations of the noise) and the device's file.
  std::function<void(int step, double misfit, const std::string& device_text)> on_step;
  std::function<void(const FitSoFar& so_far)> keep;  ///< after all that took long
  std::optional<FitSoFar> from;                      ///< what `keep` was given of this very fit
};

/// The same fit gives the same numbers, whatever the threads, and wherever it was broken off and gone on with.
/// @throws Error if what is to be simulated can't be, or `from` is of another fit
UnitFit fit_unit(const PreparedFit& fit, const UnitRecording& recording, const std::filesystem::path& cache_folder,
                 const Progress& progress = {}, const FitCourse& course = {});

/// The same with a simulation that may have been used before, for several fits of one design. `simulation` is of a fit
/// that differs from this one in labels and pictures alone.
UnitFit fit_unit(const PreparedFit& fit, const UnitRecording& recording, UnitSimulation& simulation,
                 const FitCourse& course = {});

/// The report for people, Markdown.
std::string to_markdown(const PreparedFit& fit, const UnitFit& result);
/// The same for programs, with what it was made of.
std::string to_json(const PreparedFit& fit, const UnitFit& result, const datasets::RunIdentity& made_of);

/// Recorded, simulated and their difference (grey is none, tenfold) of each picture, side by side: CV_8UC3.
cv::Mat misfit_sheet(const UnitRecording& recording, const UnitFit& result);

/// What stands at an end of what was allowed, or else gives reason to doubt the fit: sentences for people.
std::vector<std::string> doubts_of(const PreparedFit& fit, const UnitFit& result);

/// What run_unit_fit did.
struct UnitFitRun {
  bool was_finished = false;        ///< the folder held this very fit, finished: nothing was done, `fit` is empty
  std::optional<int> gone_on_from;  ///< steps that an earlier run had made, which was broken off
  UnitFit fit;
};

/// Fits and puts NAME.md, NAME.json, NAME.yaml (the device) and NAME.png (misfit_sheet) into a folder, which is made.
/// While it works, NAME.so-far.yaml is the device of the last step, and FitFolder keeps what a run that is broken off
/// has found: the next one goes on from there, to the same bytes.
/// @throws Error for anything wrong with the fit's file, and as FitFolder
UnitFitRun run_unit_fit(const std::filesystem::path& file, const std::filesystem::path& folder,
                        const std::filesystem::path& cache_folder, const Progress& progress = {},
                        const std::function<void(const FitPlan& plan)>& on_plan = {});

}  // namespace touchstone::lab
