#include "python/src/named_objects.h"

#include <algorithm>
#include <utility>
#include <variant>

namespace touchstone::python {
namespace {

/// What an object's own file names.
std::vector<std::filesystem::path> files_named_by(const sim::ObjectSpec& object) {
  std::vector<std::filesystem::path> files;
  if (!object.shape.file.empty()) files.push_back(object.shape.file);
  if (object.relief) {
    if (const auto* image = std::get_if<sim::ImageRelief>(&object.relief->kind)) files.push_back(image->file);
  }
  return files;
}

}  // namespace

std::optional<NamedObjects::FileState> NamedObjects::state_of(const std::filesystem::path& file) {
  std::error_code failed;
  const auto written = std::filesystem::last_write_time(file, failed);
  if (failed) return std::nullopt;
  const std::uintmax_t size = std::filesystem::file_size(file, failed);
  if (failed) return std::nullopt;
  return FileState{file, written, size};
}

SharedObject NamedObjects::of(const std::filesystem::path& file) {
  const std::filesystem::path place = std::filesystem::absolute(file);
  const auto known = std::ranges::find(known_, place, &Known::file);
  if (known != known_.end()) {
    if (std::ranges::all_of(known->files, [](const FileState& was) { return state_of(was.file) == was; })) {
      return known->object;
    }
    known_.erase(known);
  }
  // Looked at before it is read: what is written in between is then found changed the next time.
  const std::optional<FileState> own = state_of(place);
  auto object = std::make_shared<const sim::ObjectSpec>(sim::read_object(file));
  std::vector<FileState> files;
  if (own) files.push_back(*own);
  bool all = own.has_value();
  for (const std::filesystem::path& named : files_named_by(*object)) {
    const std::optional<FileState> state = state_of(named);
    all = all && state.has_value();
    if (state) files.push_back(*state);
  }
  if (!all) return object;
  if (known_.size() >= kObjectsKept) known_.erase(known_.begin());
  known_.push_back({place, std::move(files), object});
  return object;
}

}  // namespace touchstone::python
