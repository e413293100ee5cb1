#include "datasets/jobs/job.h"

#include <algorithm>
#include <cctype>
#include <set>

#include "core/named_file.h"
#include "core/short_text.h"

namespace touchstone::datasets {
bool is_folder_name(const std::string& name) {
  return !name.empty() && name.size() <= 100 && std::all_of(name.begin(), name.end(), [](unsigned char letter) {
    return (std::isalnum(letter) != 0 && letter < 128) || letter == '-' || letter == '_';
  });
}

void fields(YamlReader& in, JobScene& scene) {
  scene.where = in.where();
  in.required("name", scene.name);
  if (!is_folder_name(scene.name)) {
    fail_at(in.where("name"), "name: '{}' can't name a folder; allowed are up to 100 letters, digits, - and _",
            short_text(scene.name));
  }
  std::string file;
  in.required("scene", file);
  in.required("split", scene.split);
  in.optional("start_mm", scene.start_mm);
  scene.scene = named_file(in, "scene", file);
}

void fields(YamlReader& in, Job& job) {
  job.where = in.where();
  in.required("name", job.name);
  in.required("seed", job.seed);
  in.optional("licence", job.licence);
  in.required("scenes", job.scenes);
  in.optional("outputs", job.outputs);
  in.optional("accuracy", job.accuracy);
  if (job.scenes.empty()) fail_at(in.where("scenes"), "scenes: has no scene; at least one is needed");
  std::set<std::string> names;
  for (const JobScene& scene : job.scenes) {
    if (!names.insert(scene.name).second) {
      fail_at(scene.where, "scenes: the name '{}' stands here a second time", scene.name);
    }
  }
}

Job read_job(const std::filesystem::path& file) {
  return read_yaml<Job>(file);
}

bool is_job_file(const std::filesystem::path& file) {
  return YamlReader::open(file).has("scenes");
}

}  // namespace touchstone::datasets
