#pragma once
// The published and closed-form figures that this program is held against, as rows with stable names.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/progress.h"
#include "lab/statistics/statistics.h"

namespace touchstone::lab {

/// What is drawn below a row: how its error goes with what it costs or how finely it was made, or a text's figure.
struct ValidationSeries {
  std::string x_label;
  std::string y_label;
  std::vector<std::pair<double, double>> points;
  bool logarithmic = true;  ///< both axes
  bool joined = true;       ///< points by lines, in their order
};

/// One row. Either `published` (a figure of a text) or `reference` (a closed form) is given, as a rule.
struct ValidationRow {
  std::string id;     ///< "vhs.force.error_x_N"
  std::string title;  ///< one line for people
  std::string unit;   ///< "N"; "1" for pure numbers
  std::optional<double> published;
  std::optional<double> reference;
  double ours = 0.0;
  std::optional<std::pair<double, double>> ci95;  ///< 95 % interval of `ours` over seeds
  Better better = Better::lower;
  bool holds = false;                      ///< whether ours meets the row
  std::string denies;                      ///< set by deny(): the source's finding that ours doesn't share
  bool quick = false;                      ///< made by the quick form
  double seconds = 0.0;                    ///< wall time that the row took
  std::optional<ValidationSeries> series;  ///< drawn on the page (validation_page.h); not in the JSON
};

/// A figure on the good side of a source's may still say the opposite of what the source found. Such a row doesn't
/// hold, and says so beside its title. `finding`: what the source found, as a clause: "250 Hz are too few".
void deny(ValidationRow& row, const std::string& finding);

/// The title, and which finding the row denies.
std::string words_of(const ValidationRow& row);

/// Where the rows find their files, and whether they may take hours.
struct ValidateOptions {
  bool quick = false;             ///< minutes, not hours: coarser or fewer cases, as each row says
  std::filesystem::path cache;    ///< where set-up results are kept
  std::filesystem::path scenes;   ///< the folder scenes/ with devices and scenes
  std::filesystem::path scratch;  ///< a folder for files that a row makes while it runs; exists
  Progress progress;
};

/// Rows that are made together.
struct ValidationGroup {
  std::string name;  ///< "mechanics", "light", a sensor's, or a part of a sensor's: "gelsight.height"
  std::function<std::vector<ValidationRow>(const ValidateOptions&)> run;
};

/// The groups that this build has, in the order in which `all` runs them (validation_groups.cpp).
const std::vector<ValidationGroup>& validation_groups();

/// Runs the groups with these names, each once, in the order of `known`; "all" stands for every one, a
/// sensor's name for all its parts.
/// @throws Error for a name that isn't known, before anything runs
std::vector<ValidationRow> validate(const std::vector<std::string>& names, const std::vector<ValidationGroup>& known,
                                    const ValidateOptions& options);

/// A list of records {id, title, unit, published, reference, ours, ci95, better, holds, quick, seconds}; what isn't
/// given, or isn't finite, is null. The title is words_of().
std::string to_json(const std::vector<ValidationRow>& rows);

/// The rows for people: id, ours, the figure it is held against, and whether it holds.
std::string to_table(const std::vector<ValidationRow>& rows);

}  // namespace touchstone::lab
