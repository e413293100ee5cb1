#pragma once
// What the programs that measure in sweeps share: their options, the lines that say where it was measured, and a page
// of tables.
//
//   int main(int argc, char** argv) {
//     CLI::App app("The renderers' speed and error");
//     return report_main("light", app, argc, argv, [](Report& report) { report.take(some_table(report.quick())); });
//   }

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bench/result_table.h"

namespace touchstone::bench {

/// A page in the making.
class Report {
 public:
  /// Makes `folder` and prints where it is measured.
  Report(std::string name, std::filesystem::path folder, bool quick, const std::string& date);

  bool quick() const { return quick_; }
  /// Prints the table, adds it to the page and writes its files.
  void take(const ResultTable& table);
  /// Writes its files alone.
  void keep(const ResultTable& table) const;
  /// Writes <folder>/<name>.md.
  void finish() const;

 private:
  std::string name_;
  std::filesystem::path folder_;
  bool quick_;
  std::vector<std::string> where_;
  std::string page_;
};

/// Adds -o, --quick and --date to the program's own options, reads them and makes the page `name`.md. The exit code: 1
/// after an error, which is printed.
int report_main(const std::string& name, CLI::App& app, int argc, char** argv,
                const std::function<void(Report&)>& measure);

}  // namespace touchstone::bench
