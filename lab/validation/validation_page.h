#pragma once
// The validation rows as a page for people: HTML in one file that needs nothing else, and Markdown.

#include <string>
#include <vector>

#include "lab/validation/validation.h"

namespace touchstone::lab {

/// What stands over the rows. All of it is given, so that the same rows make the same page.
struct PageHeader {
  std::string version;    ///< of the program
  std::string processor;  ///< see processor_kind()
  std::string date;       ///< as the user wrote it; empty: none is shown
};

/// A table a group (the part of the id before the first dot), in the order of the rows: id, what it is, ours with its
/// 95 % interval, the figure it is held against and where that comes from, the error, whether it holds, seconds. A row
/// with a series is drawn below its table.
std::string to_html(const std::vector<ValidationRow>& rows, const PageHeader& header);

/// The same tables in Markdown; series as lists of points.
std::string to_markdown(const std::vector<ValidationRow>& rows, const PageHeader& header);

}  // namespace touchstone::lab
