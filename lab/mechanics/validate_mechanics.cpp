// The gel and its contact against closed forms (contact_closed_forms.h) and against the theory of the element. Bounds
// are 1 % where formula and mesh are that good, else what the row's title says; a finer mesh does better at its cost.

#include <chrono>

#include "core/seconds_since.h"
#include "lab/validation/mechanics_rows.h"

namespace touchstone::lab {

namespace {
const std::string kPureNumber = "1";
}

std::vector<ValidationRow> validate_mechanics(const ValidateOptions& options) {
  std::vector<MechanicsCase> cases;
  for (const auto& part : {element_cases, half_space_cases, layer_cases}) {
    for (MechanicsCase& one : part(options.quick)) cases.push_back(std::move(one));
  }
  const MechanicsGels gels(options.cache);
  std::vector<ValidationRow> rows;
  for (const MechanicsCase& one : cases) {
    if (options.progress) options.progress("mechanics", std::ssize(rows), std::ssize(cases));
    const auto begun = std::chrono::steady_clock::now();
    MechanicsFinding finding = one.find(gels);
    ValidationRow row;
    row.id = one.id;
    row.title = one.title;
    row.unit = kPureNumber;
    row.reference = one.reference;
    row.ours = finding.ours;
    row.better = one.better;
    row.holds = one.better == Better::lower ? finding.ours <= one.bound : finding.ours >= one.bound;
    row.quick = options.quick;
    row.seconds = seconds_since(begun);
    row.series = std::move(finding.series);
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace touchstone::lab
