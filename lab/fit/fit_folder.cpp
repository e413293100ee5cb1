#include "lab/fit/fit_folder.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "core/error.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "datasets/jobs/input_files.h"
#include "lab/gelsight/ball_press_table.h"
#include "lab/studies/study.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

KeptFit read_kept(const fs::path& file) {
  try {
    return kept_fit_in(read_whole_file(file), file.string());
  } catch (const Error& error) {
    fail("{}: can't be gone on with: {}; remove it to begin anew", file.string(), error.what());
  }
}

/// What a finished fit was made of, as far as its report says; nothing of a report that says nothing.
std::optional<datasets::RunIdentity> finished_identity(const fs::path& file, const datasets::RunIdentity& now) {
  const auto report = nlohmann::json::parse(read_whole_file(file), nullptr, false);
  if (!report.is_object() || !report.contains("made_of") || !report["made_of"].is_object()) return std::nullopt;
  datasets::RunIdentity before = now;
  for (const auto& [key, to] :
       {std::pair{"fit_sha256", &before.job_sha256}, std::pair{"inputs_sha256", &before.inputs_sha256},
        std::pair{"version", &before.version}}) {
    const auto found = report["made_of"].find(key);
    if (found == report["made_of"].end() || !found->is_string()) return std::nullopt;
    *to = found->get<std::string>();
  }
  return before;
}

}  // namespace

datasets::RunIdentity identity_of_fit(const fs::path& file, const std::optional<RecordingSpec>& recording) {
  std::vector<datasets::InputFile> inputs = datasets::input_files(file);
  if (recording) {
    const fs::path table = recording->folder / "presses.csv";
    std::vector<fs::path> files = {table};
    for (const std::string& name : recording->rest) files.push_back(recording->folder / name);
    datasets::TableFrames frames(recording->folder);
    for (const AnnotatedPress& press : read_ball_press_table(frames, table)) files.push_back(press.file);
    for (const fs::path& one : files) {
      inputs.push_back({one.lexically_relative(recording->folder).generic_string(), sha256_of_file(one)});
    }
  }
  return datasets::identity_of(read_whole_file(file), inputs);
}

FitFolder::FitFolder(fs::path folder, std::string name, datasets::RunIdentity identity)
    : folder_(std::move(folder)), name_(std::move(name)), identity_(std::move(identity)) {
  made_ = !fs::exists(folder_);
  make_study_folder(folder_);
  const fs::path report = file(".json");
  if (fs::is_regular_file(report) && !fs::exists(kept())) {
    if (const auto before = finished_identity(report, identity_)) {
      const std::string differs = datasets::difference(*before, identity_, "fit");
      if (differs.empty()) return;
      fail("{}: holds the finished fit {}, and since it was made {} has changed; give another folder, or remove {}",
           folder_.string(), name_, differs, report.string());
    }
  }
  std::error_code error;
  fs::create_directories(kept().parent_path(), error);
  if (error) fail("{}: can't be made ({})", kept().parent_path().string(), error.message());
  lock_ = std::make_unique<datasets::FolderLock>(kept().parent_path() / "lock");
  if (!fs::exists(kept())) return;
  const std::string differs = datasets::difference(read_kept(kept()).identity, identity_, "fit");
  if (differs.empty()) return;
  fail(
      "{}: holds the unfinished fit {}, and since it was begun {} has changed; finish it as it was begun, give another "
      "folder, or remove {}",
      folder_.string(), name_, differs, kept().string());
}

FitFolder::~FitFolder() {
  if (!lock_) return;
  std::error_code ignored;
  fs::remove(kept().parent_path() / "lock", ignored);
  fs::remove(kept().parent_path(), ignored);  // while nothing is kept in it
  if (made_) fs::remove(folder_, ignored);    // likewise
}

std::optional<FitSoFar> FitFolder::so_far() const {
  if (!fs::exists(kept())) return std::nullopt;
  return read_kept(kept()).so_far;
}

void FitFolder::keep(const FitSoFar& so_far) const {
  write_whole_file(kept(), kept_fit({so_far, identity_}));
}

void FitFolder::finish() {
  std::error_code ignored;
  fs::remove(kept(), ignored);
}

}  // namespace touchstone::lab
