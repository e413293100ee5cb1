#pragma once
// The rows of a validation group as it makes them, each with the time that it took.

#include <chrono>
#include <string>
#include <vector>

#include "lab/validation/validation.h"

namespace touchstone::lab {

/// Rows in the order in which they were added.
class RowList {
 public:
  /// What the seconds of a row are counted from.
  enum class Since { last_row, begin };

  /// `prefix` is put before each row's id.
  RowList(std::string prefix, const ValidateOptions& options, Since since);

  /// A row to which its published or reference figure may be added, until the next one is.
  ValidationRow& add(const std::string& id, const std::string& title, const std::string& unit, double ours,
                     Better better, bool holds);
  /// A row that holds if `ours` is on the good side of `bound`, a text's figure or one of ours. @pre better isn't near
  void add_bounded(const std::string& id, const std::string& title, const std::string& unit, Better better,
                   double bound, bool published, double ours);
  /// The row that was added last. @pre there is one
  ValidationRow& last() { return rows_.back(); }
  /// What follows is another part: its time starts here.
  void begin() { begun_ = std::chrono::steady_clock::now(); }

  const std::vector<ValidationRow>& rows() const { return rows_; }

 private:
  std::string prefix_;
  bool quick_;
  Since since_;
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  std::vector<ValidationRow> rows_;
};

}  // namespace touchstone::lab
