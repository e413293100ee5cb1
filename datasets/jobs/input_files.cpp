#include "datasets/jobs/input_files.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>

#include "core/error.h"
#include "core/named_file.h"
#include "core/sha256.h"
#include "core/whole_file.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestName = 1024;  // longer texts are data (a glTF buffer inline), not names of files
constexpr int kDeepest = 64;                // a YAML alias may hold itself

/// JSON is YAML, so that a .gltf file's buffers are found like a scene's device.
bool can_name_others(const fs::path& file) {
  const std::string ending = file.extension().string();
  return ending == ".yaml" || ending == ".yml" || ending == ".gltf";
}

void collect_names(const YAML::Node& node, std::vector<std::string>& names, int depth = 0) {
  if (depth > kDeepest) return;
  if (node.IsScalar()) {
    if (!node.Scalar().empty() && node.Scalar().size() <= kLongestName) names.push_back(node.Scalar());
  } else if (node.IsSequence()) {
    for (const YAML::Node& item : node) collect_names(item, names, depth + 1);
  } else if (node.IsMap()) {
    for (const auto& entry : node) collect_names(entry.second, names, depth + 1);
  }
}

void visit(const fs::path& file, const fs::path& base, std::map<fs::path, InputFile>& found) {
  std::error_code error;
  const fs::path place = fs::canonical(file, error);
  if (error) fail("{}: can't be read", file.string());
  if (found.contains(place)) return;
  const std::string content = read_whole_file(file);
  found[place] = {place.lexically_relative(base).generic_string(), sha256_of(content)};
  if (!can_name_others(file)) return;
  std::vector<std::string> names;
  try {
    collect_names(YAML::Load(content), names);
  } catch (const YAML::Exception& problem) {
    throw Error({file.string(), problem.mark.is_null() ? 0 : problem.mark.line + 1}, "isn't YAML: " + problem.msg);
  }
  for (const std::string& name : names) {
    const fs::path named = file.parent_path() / name;
    if (fs::is_regular_file(named, error)) visit(named, base, found);
  }
}

}  // namespace

std::vector<InputFile> input_files(const fs::path& root) {
  std::error_code error;
  const fs::path place = fs::canonical(root, error);
  if (error) fail("{}: can't be read", root.string());
  std::map<fs::path, InputFile> found;
  visit(place, place.parent_path(), found);
  std::vector<InputFile> files;
  for (auto& [path, file] : found) files.push_back(std::move(file));
  std::sort(files.begin(), files.end(), [](const InputFile& a, const InputFile& b) { return a.name < b.name; });
  return files;
}

std::filesystem::path existing_file(YamlReader& in, const std::string& key) {
  std::string name;
  in.required(key, name);
  return in.describing() ? in.folder() / name : named_file(in, key, name);
}

}  // namespace touchstone::datasets
