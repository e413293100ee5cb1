#include "lab/studies/study.h"

#include "core/error.h"
#include "core/short_text.h"
#include "core/whole_file.h"
#include "datasets/jobs/job.h"

namespace touchstone::lab {
namespace {

enum class KindName { apparent_change, bead_force, colour_marker };

EnumNames<KindName> enum_names(KindName) {
  return {{"apparent_change", KindName::apparent_change},
          {"bead_force", KindName::bead_force},
          {"colour_marker", KindName::colour_marker}};
}

}  // namespace

void fields(YamlReader& in, StudySpec& study) {
  in.required("name", study.name);
  if (!datasets::is_folder_name(study.name)) {
    fail_at(in.where("name"), "name: '{}' can't name files; allowed are up to 100 letters, digits, - and _",
            short_text(study.name));
  }
  KindName kind = KindName::apparent_change;
  in.required("kind", kind);
  switch (kind) {
    case KindName::apparent_change:
      return fields(in, study.kind.emplace<ApparentChangeSpec>());
    case KindName::bead_force:
      return fields(in, study.kind.emplace<BeadDesignSpec>());
    case KindName::colour_marker:
      return fields(in, study.kind.emplace<ColourDesignSpec>());
  }
}

StudySpec read_study(const std::filesystem::path& file) {
  return read_yaml<StudySpec>(file);
}

StudyResult run_study(const StudySpec& study, const std::filesystem::path& cache, const Progress& progress) {
  if (const auto* spec = std::get_if<ApparentChangeSpec>(&study.kind)) {
    return report(study.name, *spec, run_apparent_change(*spec, cache, progress));
  }
  if (const auto* spec = std::get_if<ColourDesignSpec>(&study.kind)) {
    return report(study.name, *spec, run_colour_design(*spec, cache, progress));
  }
  const auto& spec = std::get<BeadDesignSpec>(study.kind);
  return report(study.name, spec, run_bead_design(spec, progress));
}

void make_study_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder)) {
    fail("{}: the folder can't be made: {}", folder.string(), error ? error.message() : "a file is in its place");
  }
}

void write_study(const StudyResult& result, const std::filesystem::path& folder) {
  for (const StudyFile& file : result.files) write_whole_file(folder / file.name, file.text);
}

}  // namespace touchstone::lab
