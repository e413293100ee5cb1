#pragma once

#include <string>
#include <vector>

namespace touchstone::lab {

/// What a study leaves behind: files by name, their text, and what is to be printed beside.
struct StudyFile {
  std::string name;
  std::string text;
};
/// What a study writes into its folder.
struct StudyResult {
  std::vector<StudyFile> files;    ///< a table as CSV and one in Markdown, plots as SVG
  std::vector<std::string> notes;  ///< presses that couldn't be had, and why
};

}  // namespace touchstone::lab
