#include "lab/validation/row_list.h"

#include <utility>

#include "core/error.h"
#include "core/seconds_since.h"

namespace touchstone::lab {

RowList::RowList(std::string prefix, const ValidateOptions& options, Since since)
    : prefix_(std::move(prefix)), quick_(options.quick), since_(since) {}

ValidationRow& RowList::add(const std::string& id, const std::string& title, const std::string& unit, double ours,
                            Better better, bool holds) {
  ValidationRow& row = rows_.emplace_back();
  row.id = prefix_ + id;
  row.title = title;
  row.unit = unit;
  row.ours = ours;
  row.better = better;
  row.holds = holds;
  row.quick = quick_;
  row.seconds = seconds_since(begun_);
  if (since_ == Since::last_row) begin();
  return row;
}

void RowList::add_bounded(const std::string& id, const std::string& title, const std::string& unit, Better better,
                          double bound, bool published, double ours) {
  TS_ASSERT(better != Better::near);
  ValidationRow& row = add(id, title, unit, ours, better, better == Better::higher ? ours >= bound : ours <= bound);
  (published ? row.published : row.reference) = bound;
}

}  // namespace touchstone::lab
