#include "datasets/exports/estimate_hdf5.h"

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/hdf5_file.h"
#include "core/whole_file.h"
#include "datasets/inspection/estimate_quantities.h"
#include "datasets/sets/run_identity.h"

namespace touchstone::datasets {
namespace {

/// HDF5 takes "/" for the end of a group's name, and "." for the group itself.
void check_name(const EstimateTable& table, const std::string& name) {
  if (name.empty() || name == "." || name.find('/') != std::string::npos || name.find('\0') != std::string::npos) {
    fail("{}: '{}' can't be a name in HDF5: it is '.', or has a '/' or a zero in it", table.file.string(), name);
  }
}

void write_column(const EstimateTable& table, const std::string& group, const EstimateColumn& column,
                  Hdf5Writer& writer) {
  check_name(table, column.name);
  Hdf5Description description;
  description.path = group + "/" + column.name;
  description.unit = unit_of_column(column.name);
  description.shape = "lines";
  description.meaning = fmt::format("column {} of {}", column.name, table.file.filename().string());
  if (column.distinct.empty()) {
    writer.write<double>(description, static_cast<std::int64_t>(table.lines), {}, column.numbers);
    return;
  }
  std::vector<std::string> texts;
  texts.reserve(table.lines);
  for (std::size_t line = 0; line < table.lines; ++line) texts.push_back(column.text(line));
  writer.write_texts(description, texts);
}

}  // namespace

void write_hdf5(std::span<const EstimateTable> tables, const std::filesystem::path& file) {
  std::set<std::string> names;
  for (const EstimateTable& table : tables) {
    const std::string name = table.file.stem().string();
    check_name(table, name);
    if (!names.insert(name).second) fail("{}: two tables are called '{}'", table.file.string(), name);
  }
  write_whole_file(file, [&](const std::filesystem::path& temporary) {
    Hdf5Writer writer(temporary);
    writer.set_attribute("program", program_name());
    for (const EstimateTable& table : tables) {
      const std::string group = "/" + table.file.stem().string();
      for (const EstimateColumn& column : table.columns) write_column(table, group, column, writer);
    }
    writer.close();
  });
}

}  // namespace touchstone::datasets
