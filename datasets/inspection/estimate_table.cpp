#include "datasets/inspection/estimate_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>
#include <unordered_map>

#include "core/error.h"
#include "core/text_file.h"
#include "datasets/sets/csv_cells.h"

namespace touchstone::datasets {
namespace {

/// Adds cells to a column.
class ColumnFiller {
 public:
  /// Names of sequences and files are words, even where they look like numbers.
  explicit ColumnFiller(EstimateColumn& column)
      : column_(column), names_(column.name == "sequence" || column.name == "file") {}

  void add(const std::string& cell) {
    const auto value = names_ ? std::nullopt : number_of<double>(cell);
    const bool is_number = value && std::isfinite(*value);
    column_.numbers.push_back(is_number ? *value : std::numeric_limits<double>::quiet_NaN());
    column_.words.push_back(is_number || cell.empty() ? -1 : index_of(cell));
  }

 private:
  std::int32_t index_of(const std::string& word) {
    const auto [at, is_new] = known_.try_emplace(word, static_cast<std::int32_t>(column_.distinct.size()));
    if (is_new) column_.distinct.push_back(word);
    return at->second;
  }

  EstimateColumn& column_;
  bool names_;
  std::unordered_map<std::string, std::int32_t> known_;
};

/// Do two lines have the same cell in a column?
bool same_cell(const EstimateColumn& column, std::size_t a, std::size_t b) {
  return column.words[a] == column.words[b] &&
         (column.numbers[a] == column.numbers[b] || (std::isnan(column.numbers[a]) && std::isnan(column.numbers[b])));
}

/// Places a sequence's frames by their times, if all are known and in order; else by their numbers, or their order.
void place_frames(const EstimateTable& table, EstimateSequence& sequence) {
  const auto placed_by = [&](const char* name, double scale, bool from_first) {
    const EstimateColumn* column = table.column(name);
    if (column == nullptr || sequence.frames.empty()) return false;
    double before = -std::numeric_limits<double>::infinity();
    for (const EstimateFrame& frame : sequence.frames) {
      const double at = column->numbers[frame.first];
      if (!(at >= before)) return false;  // not known, or not in order
      before = at;
    }
    const double origin = from_first ? column->numbers[sequence.frames.front().first] : 0.0;
    for (EstimateFrame& frame : sequence.frames) frame.at = scale * (column->numbers[frame.first] - origin);
    return true;
  };
  if (placed_by("t_us", 1e-6, true)) return;
  sequence.axis = "frame";
  if (placed_by("frame", 1.0, false)) return;
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) sequence.frames[i].at = static_cast<double>(i);
}

}  // namespace

bool EstimateColumn::is_numeric() const {
  return distinct.empty() && std::ranges::any_of(numbers, [](double value) { return !std::isnan(value); });
}

std::string EstimateColumn::word(std::size_t line) const {
  return words[line] < 0 ? "" : distinct[static_cast<std::size_t>(words[line])];
}

std::string EstimateColumn::text(std::size_t line) const {
  return std::isnan(numbers[line]) ? word(line) : fmt::format("{:.15g}", numbers[line]);
}

const EstimateColumn* EstimateTable::column(const std::string& name) const {
  const auto found = std::ranges::find(columns, name, &EstimateColumn::name);
  return found == columns.end() ? nullptr : &*found;
}

EstimateTable read_estimate_table(const std::filesystem::path& csv) {
  std::istringstream lines(read_text_file(csv));
  EstimateTable table;
  table.file = csv;
  std::vector<ColumnFiller> fillers;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    const SourceLocation where{csv.string(), ++number};
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (number > 1 && line.empty()) continue;
    const std::vector<std::string> cells = cells_of(line, where);
    if (number == 1) {
      std::set<std::string> names;
      for (const std::string& name : cells) {
        if (name.empty()) fail_at(where, "a column has no name");
        if (!names.insert(name).second) fail_at(where, "two columns are called '{}'", name);
        table.columns.push_back({name, {}, {}});
      }
      for (EstimateColumn& column : table.columns) fillers.emplace_back(column);
      continue;
    }
    if (cells.size() != table.columns.size()) {
      fail_at(where, "has {} cells; the first line names {} columns", cells.size(), table.columns.size());
    }
    for (std::size_t i = 0; i < cells.size(); ++i) fillers[i].add(cells[i]);
    ++table.lines;
  }
  if (table.lines == 0) fail("{}: has no line of estimates", csv.string());
  return table;
}

std::vector<EstimateSequence> sequences_of(const EstimateTable& table) {
  const EstimateColumn* const sequence = table.column("sequence");
  const EstimateColumn* frame = table.column("frame");
  if (frame == nullptr) frame = table.column("file");
  std::vector<EstimateSequence> sequences;
  for (std::size_t line = 0; line < table.lines; ++line) {
    const bool starts = line == 0 || (sequence != nullptr && !same_cell(*sequence, line, line - 1));
    if (starts) {
      sequences.push_back({.name = sequence == nullptr ? "" : sequence->text(line)});
    }
    std::vector<EstimateFrame>& frames = sequences.back().frames;
    if (!frames.empty() && frame != nullptr && same_cell(*frame, line, line - 1)) {
      ++frames.back().count;
    } else {
      frames.push_back({line, 1, 0.0});
    }
  }
  for (EstimateSequence& one : sequences) place_frames(table, one);
  return sequences;
}

}  // namespace touchstone::datasets
