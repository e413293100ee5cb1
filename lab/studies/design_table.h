#pragma once
// What came of the designs that a study tried: a figure a column, a design a row, and what can be read from that.

#include <Eigen/Core>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/progress.h"
#include "lab/studies/design_plan.h"
#include "lab/studies/study_files.h"
#include "lab/validation/validation.h"

namespace touchstone::lab {

/// A column.
struct DesignFigure {
  std::string name;               ///< "force_error_N", with its unit
  Better better = Better::lower;  ///< `near`: neither is
  std::string meaning;            ///< one sentence
};

/// Designs as rows, figures as columns.
struct DesignTable {
  DesignPlan plan;
  std::vector<DesignFigure> figures;
  std::vector<std::vector<double>> points;  ///< see design_points
  std::vector<std::vector<double>> values;  ///< a row a design; NaN: couldn't be had
  std::vector<std::string> faults;          ///< why a design can't be had, or what of it; else empty
  std::vector<double> base;                 ///< the figures of the device as its file has it; empty if unknown
};

/// The table of all designs of a plan and of the device as its file has it; `judge` gives a device's figures or throws.
/// `at_once`: several designs at a time, else each has all threads. The same for any number of threads.
/// @throws Error if the device itself can't be had
DesignTable try_designs(const DesignPlan& plan, const DesignBase& base, std::vector<DesignFigure> figures,
                        const std::function<std::vector<double>(const sim::DeviceSpec&)>& judge, bool at_once,
                        const Progress& progress);

/// @throws Error that names the nearest figure if there is none of this name
std::size_t figure_number(std::span<const DesignFigure> figures, const std::string& name, const SourceLocation& where);

/// The designs than which none is better in one of these figures and as good in the others, in their order. Designs
/// that have no value for one of the figures aren't among them.
std::vector<std::size_t> pareto_front(const DesignTable& table, std::span<const std::size_t> figures);

/// How a figure goes with the variables near all of the designs: log(figure) = c + sum of slope log(variable), by least
/// squares. 1 % more of a variable is `slope` % more of the figure. NaN where a variable or the figure isn't above 0
/// throughout, or the designs are too few or too alike.
struct Elasticity {
  Eigen::VectorXd slope;  ///< of each variable
  double r2 = 0.0;        ///< how much of the figure's variation this law explains
  int designs = 0;        ///< that it rests on
};
/// Of one figure (its column in the table).
Elasticity elasticity(const DesignTable& table, std::size_t figure);

/// What a study's files say beside its table.
struct DesignStory {
  std::string name;
  std::string title;                ///< one line, what was looked at
  std::string answer;               ///< paragraphs, Markdown
  std::vector<std::size_t> pareto;  ///< figures that the front is of
  std::vector<std::size_t> drawn;   ///< figures that get a plot
  std::vector<std::size_t> chosen;  ///< designs that the answer names, framed in plots
};

/// NAME.csv, all of it; NAME.md: answer, front, elasticities, what the columns mean, faults; a plot a drawn figure: a
/// heat map over two variables of a grid, else points over each variable.
StudyResult design_report(const DesignTable& table, const DesignStory& story);

}  // namespace touchstone::lab
