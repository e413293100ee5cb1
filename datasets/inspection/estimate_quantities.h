#pragma once
// Which columns of a table of estimates belong together: components of one quantity, their true values and standard
// errors. Read from their names, which end in a unit (docs/file-formats.md). Internal to datasets.

#include <string>
#include <vector>

#include "datasets/inspection/estimate_table.h"

namespace touchstone::datasets {

/// One column of measured values, with what is known of it.
struct EstimatedComponent {
  std::string name;  ///< "x", or the quantity's where it has but one
  const EstimateColumn* value = nullptr;
  const EstimateColumn* truth = nullptr;  ///< `true_force_x_N` or `true_x_N` of `force_x_N`; null: none
  const EstimateColumn* sigma = nullptr;  ///< `sigma_force_x_N`; null: none
};

/// Columns with one axis: `force_x_N`, `force_y_N`, `force_z_N`.
struct EstimatedQuantity {
  std::string name;  ///< "force"
  std::string unit;  ///< as it's printed: "N", "mm²"; "" if the name has none
  std::vector<EstimatedComponent> components;
};

/// What the columns of a table are.
struct EstimateParts {
  std::vector<EstimatedQuantity> quantities;
  std::vector<const EstimateColumn*> flags;    ///< 0 or 1, without a unit: `touched`, `trusted`
  std::vector<const EstimateColumn*> states;   ///< of few short words: `slip`
  std::vector<const EstimateColumn*> remarks;  ///< longer texts: `fault`
};

/// The unit that a column's name ends in, in ASCII: "mm^2" of `contact_mm2`; "1" where there is none.
std::string unit_of_column(std::string name);

/// Sorts a table's columns, those that name lines (`sequence`, `frame`, `file`, `t_us`, `marker`) left out.
EstimateParts parts_of(const EstimateTable& table);

}  // namespace touchstone::datasets
