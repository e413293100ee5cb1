#pragma once
// A study: a device's figures are varied and what comes of it is tabled. One file describes it (docs/file-formats.md);
// `kind` says what is looked at, and each kind is a plain struct of its own with a function that runs it.

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "core/progress.h"
#include "core/yaml_reader.h"
#include "lab/studies/apparent_change_study.h"
#include "lab/studies/bead_design_study.h"
#include "lab/studies/colour_design_study.h"
#include "lab/studies/study_files.h"

namespace touchstone::lab {

/// One alternative a kind; the names in files are in study.cpp.
using StudyKind = std::variant<ApparentChangeSpec, BeadDesignSpec, ColourDesignSpec>;

/// All of a study's file, checked.
struct StudySpec {
  std::string name;  ///< also of its files; letters, digits, - and _
  StudyKind kind;
};
void fields(YamlReader& in, StudySpec& study);

/// Reads and checks a study and all files that it names. @throws Error with file and line
StudySpec read_study(const std::filesystem::path& file);

/// The same study gives the same bytes. @throws Error if a gel can't be had
StudyResult run_study(const StudySpec& study, const std::filesystem::path& cache, const Progress& progress = {});

/// Files of one kind of study.
StudyResult report(const std::string& name, const ApparentChangeSpec& spec, const ApparentChangeResult& result);

/// Makes the folder for a study's files, if it isn't there. @throws Error if it can't be made
void make_study_folder(const std::filesystem::path& folder);

/// Puts the files into a folder; files of these names are replaced, each whole. @throws Error if they can't be written
void write_study(const StudyResult& result, const std::filesystem::path& folder);

}  // namespace touchstone::lab
