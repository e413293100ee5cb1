#include "lab/fit/fit_folder.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/error.h"
#include "core/matrix_file.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "datasets/jobs/input_files.h"
#include "lab/gelsight/ball_press_table.h"
#include "lab/studies/study.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMark = "TSFIT001";
constexpr int kMostSteps = 1'000'000;

/// Of all such files: whose one is stands in it, so that what differs can be named.
const std::string& file_key() {
  static const std::string key = sha256_of("touchstone fit, so far");
  return key;
}

/// A matrix file: scalars, poses, where the fit begins, and the search; after these whose it is.
struct Kept {
  FitSoFar so_far;
  datasets::RunIdentity identity;
};

int whole_number(double stored, int most) {
  if (!(stored >= 0.0 && stored <= most) || stored != std::floor(stored)) {
    fail("it has {} where a whole number from 0 to {} should be", stored, most);
  }
  return static_cast<int>(stored);
}

Kept kept_in(const std::string& content, const std::string& name) {
  MatrixFile matrices(content, kMark, "what was kept of a fit", file_key(), "program");
  const Eigen::MatrixXd scalars = matrices.take();
  const Eigen::MatrixXd poses = matrices.take();
  Kept kept;
  LeastSquaresState& search = kept.so_far.search;
  for (Eigen::VectorXd* column : {&kept.so_far.before, &search.x, &search.residuals}) {
    const Eigen::MatrixXd taken = matrices.take();
    if (taken.cols() > 1) fail("its columns are wider than one");
    *column = taken.reshaped();
  }
  search.jacobian = matrices.take();
  if (scalars.size() != 6 || (poses.size() > 0 && poses.rows() != 3)) fail("its matrices have other shapes");
  search.damping = scalars.data()[0];
  search.growth = scalars.data()[1];
  search.steps = whole_number(scalars.data()[2], kMostSteps);
  kept.so_far.level = static_cast<std::size_t>(whole_number(scalars.data()[3], kMostSteps));
  kept.so_far.steps_before = whole_number(scalars.data()[4], kMostSteps);
  search.arrived = whole_number(scalars.data()[5], 1) == 1;
  for (Eigen::Index i = 0; i < poses.cols(); ++i) {
    kept.so_far.labelled.push_back({{poses(0, i), poses(1, i)}, poses(2, i)});
  }
  const bool finite = scalars.allFinite() && poses.allFinite() && kept.so_far.before.allFinite() &&
                      search.x.allFinite() && search.residuals.allFinite() && search.jacobian.allFinite();
  if (!finite || !(search.growth >= 2.0)) fail("it has numbers that can't be");
  kept.identity = datasets::run_identity_from_json(std::string(matrices.rest()), name);
  return kept;
}

Kept read_kept(const fs::path& file) {
  try {
    return kept_in(read_whole_file(file), file.string());
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
    for (const AnnotatedPress& press : read_ball_press_table(recording->folder, table)) files.push_back(press.file);
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
  const LeastSquaresState& search = so_far.search;
  Eigen::MatrixXd scalars(6, 1);
  scalars << search.damping, search.growth, search.steps, static_cast<double>(so_far.level), so_far.steps_before,
      search.arrived ? 1.0 : 0.0;
  Eigen::MatrixXd poses(3, static_cast<Eigen::Index>(so_far.labelled.size()));
  for (Eigen::Index i = 0; i < poses.cols(); ++i) {
    const PressPose& pose = so_far.labelled[static_cast<std::size_t>(i)];
    poses.col(i) << pose.place_mm, pose.depth_mm;
  }
  write_whole_file(kept(), matrix_file(kMark, file_key(),
                                       {scalars, poses, so_far.before, search.x, search.residuals, search.jacobian},
                                       datasets::to_json(identity_)));
}

void FitFolder::finish() {
  std::error_code ignored;
  fs::remove(kept(), ignored);
}

}  // namespace touchstone::lab
