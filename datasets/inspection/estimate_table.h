#pragma once
// A table of estimates, as the commands of `touchstone estimate` and others write them, read for a report.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace touchstone::datasets {

/// A column: a number or a word in each line, or neither.
struct EstimateColumn {
  std::string name;
  std::vector<double> numbers;      ///< a line's; NaN where its cell is empty or a word
  std::vector<std::int32_t> words;  ///< a line's, as an index in `distinct`; -1 where its cell is empty or a number
  std::vector<std::string> distinct = {};

  /// Numbers and empty cells alone, and one number at least.
  bool is_numeric() const;
  /// The cell's word; "" where it holds none.
  std::string word(std::size_t line) const;
  /// The cell as a text, number or word; "" where it's empty.
  std::string text(std::size_t line) const;
};

/// The lines of a table. Several may belong to one frame (a line for each marker).
struct EstimateTable {
  std::filesystem::path file;
  std::size_t lines = 0;
  std::vector<EstimateColumn> columns;

  /// Null if there's none of that name.
  const EstimateColumn* column(const std::string& name) const;
};

/// Consecutive lines of one frame.
struct EstimateFrame {
  std::size_t first = 0, count = 0;
  double at = 0.0;  ///< as EstimateSequence's axis says
};

/// The frames of one sequence, in their order in the table.
struct EstimateSequence {
  std::string name;             ///< "" where the table has no column `sequence`
  std::string axis = "second";  ///< what frames are placed by: "second" where all times are known, or "frame"
  std::vector<EstimateFrame> frames;
};

/// Reads a table with any columns: a line of names, then as many cells in each line.
/// @throws Error naming file and line for another number of cells, a name that is empty or stands twice, or a table
/// without lines
EstimateTable read_estimate_table(const std::filesystem::path& csv);

/// Which lines belong to which frame: those in a row with the same `sequence` and `frame`, or without it the same
/// `file`; with neither, each its own. Times are `t_us`, from the sequence's first frame on.
std::vector<EstimateSequence> sequences_of(const EstimateTable& table);

}  // namespace touchstone::datasets
