#include "datasets/sets/run_folder.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>
#include <set>
#include <string>

#include "core/error.h"
#include "core/sha256.h"
#include "core/whole_file.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;

fs::path topmost_missing(const fs::path& folder) {
  fs::path missing;
  for (fs::path at = fs::absolute(folder); !at.empty() && !fs::exists(at); at = at.parent_path()) {
    missing = at;
    if (at == at.parent_path()) break;
  }
  return missing;
}

void refuse_unless_equal(const fs::path& out, const RunIdentity& identity) {
  const fs::path file = out / kUnfinished / "run.json";
  const std::string differs = difference(run_identity_from_json(read_whole_file(file), file.string()), identity);
  if (!differs.empty()) {
    fail(
        "{}: holds an unfinished data set, and since it was begun {} has changed; "
        "finish it as it was begun, or give another folder",
        out.string(), differs);
  }
}

}  // namespace

bool is_temporary_file(const fs::path& file) {
  constexpr std::size_t kDigits = 16;
  const std::string name = file.filename().string();
  const std::size_t part = name.rfind(".part");
  if (part == std::string::npos || part < kDigits + 2) return false;  // .name.digits
  if (part + 5 != name.size() && name[part + 5] != '.') return false;
  const std::size_t digits = part - kDigits;
  return name.starts_with('.') && name[digits - 1] == '.' && digits > 1 &&
         name.find_first_not_of("0123456789abcdef", digits) == part;
}

FolderState state_of_folder(const fs::path& out, const RunIdentity& identity) {
  if (!fs::exists(out)) return FolderState::absent;
  if (!fs::is_directory(out)) fail("{}: isn't a folder", out.string());
  const bool is_unfinished = fs::is_directory(out / kUnfinished);
  if (fs::exists(out / "dataset.json")) {
    const Manifest manifest = read_manifest(out);
    RunIdentity before = identity;
    before.job_sha256 = manifest.run.job_sha256;
    before.inputs_sha256 = manifest.run.inputs_sha256;
    before.version = manifest.run.version;
    const std::string differs = difference(before, identity);
    if (!differs.empty()) {
      fail("{}: holds a finished data set, and since it was made {} has changed; give another folder", out.string(),
           differs);
    }
    return FolderState::finished;
  }
  if (is_unfinished && fs::exists(out / kUnfinished / "run.json")) {
    refuse_unless_equal(out, identity);
    return FolderState::unfinished;
  }
  for (const auto& entry : fs::directory_iterator(out)) {
    if (entry.path().filename() == kUnfinished && entry.is_directory()) continue;  // killed before its first record
    fail("{}: isn't empty ('{}' is in it) and isn't a data set of this job; give another folder", out.string(),
         entry.path().filename().string());
  }
  return FolderState::absent;
}

void begin_shared(const fs::path& out, const RunIdentity& identity) {
  std::error_code error;
  fs::create_directories(out / kUnfinished, error);
  if (error) fail("{}: can't be made ({})", (out / kUnfinished).string(), error.message());
  // Before all else, as it says whose the folder is.
  write_lasting_file(out / kUnfinished / "run.json", to_json(identity));
  state_of_folder(out, identity);  // another job's run may have begun here at the same time: the last record counts
}

void write_manifest(const fs::path& out, const std::string& text, std::span<const WrittenFile> files) {
  std::set<fs::path> folders;
  for (const WrittenFile& file : files) folders.insert((out / file.name).parent_path());
  tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) { wait_for_disk(out / files[i].name); });
  for (const fs::path& folder : folders) wait_for_disk(folder);
  write_lasting_file(out / "dataset.json", text);
}

void finish_folder(const fs::path& out) {
  try {
    std::vector<fs::path> temporary;
    for (const auto& entry : fs::recursive_directory_iterator(out)) {
      if (entry.is_regular_file() && is_temporary_file(entry.path())) temporary.push_back(entry.path());
    }
    for (const fs::path& file : temporary) fs::remove(file);
    fs::remove_all(out / kUnfinished);
  } catch (const fs::filesystem_error& error) {
    fail("{}: can't be cleared up ({})", out.string(), error.code().message());
  }
}

RunFolder::RunFolder(const fs::path& out, const RunIdentity& identity) : out_(out) {
  const FolderState state = state_of_folder(out, identity);
  remove_if_useless_ = topmost_missing(out);
  if (remove_if_useless_.empty() && state == FolderState::absent) remove_if_useless_ = out / kUnfinished;
  std::error_code error;
  fs::create_directories(out / kUnfinished, error);
  if (error) fail("{}: can't be made ({})", out.string(), error.message());
  lock_ = std::make_unique<FolderLock>(out / kUnfinished / "lock");
  // Another run may have begun or ended here in the meantime.
  if (state_of_folder(out, identity) == FolderState::absent) {
    write_lasting_file(out / kUnfinished / "run.json", to_json(identity));
  } else {
    keep_ = true;
  }
}

RunFolder::~RunFolder() {
  std::error_code ignored;
  if (!keep_ && !remove_if_useless_.empty()) fs::remove_all(remove_if_useless_, ignored);
}

std::vector<FrameRecord> RunFolder::whole_records() const {
  const std::vector<FrameRecord> all = read_journal(journal());
  std::vector<char> whole(all.size(), 0);
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) {
    whole[i] = std::all_of(all[i].files.begin(), all[i].files.end(), [&](const WrittenFile& file) {
      return fs::is_regular_file(out_ / file.name) && sha256_of_file(out_ / file.name) == file.sha256;
    });
  });
  std::vector<FrameRecord> kept;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (whole[i] != 0) kept.push_back(all[i]);
  }
  std::stable_sort(kept.begin(), kept.end(),
                   [](const FrameRecord& a, const FrameRecord& b) { return a.sample < b.sample; });
  // A frame may be recorded twice, where its first file was lost and made again.
  kept.erase(std::unique(kept.begin(), kept.end(),
                         [](const FrameRecord& a, const FrameRecord& b) { return a.sample == b.sample; }),
             kept.end());
  return kept;
}

fs::path RunFolder::journal() const {
  return out_ / kUnfinished / "frames.log";
}

void RunFolder::keep() {
  keep_ = true;
}

void RunFolder::finish() {
  keep_ = true;
  finish_folder(out_);
}

}  // namespace touchstone::datasets
