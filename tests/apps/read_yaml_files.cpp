// Reads files as touchstone does, many in one process, for file_schemas_test.py: each line of the input is a kind and a
// path, each line of the output "taken", or "refused" and why.
#include <fmt/format.h>

#include <functional>
#include <iostream>
#include <map>
#include <string>

#include "core/error.h"
#include "datasets/jobs/draw.h"
#include "datasets/jobs/job.h"
#include "lab/fit/unit_fit_spec.h"
#include "lab/studies/study.h"
#include "lab/vhs/palpation_spec.h"
#include "sim/scene/device.h"
#include "sim/scene/motion.h"
#include "sim/scene/object.h"
#include "sim/scene/scene.h"

namespace touchstone {
namespace {

void read_job_of_either_sort(const std::string& file) {
  if (datasets::is_draw_job_file(file)) {
    datasets::read_draw_job(file);
  } else {
    datasets::read_job(file);
  }
}

int read_all() {
  const std::map<std::string, std::function<void(const std::string&)>> readers = {
      {"device", [](const std::string& file) { sim::read_device(file); }},
      {"object", [](const std::string& file) { sim::read_object(file); }},
      {"motion", [](const std::string& file) { read_yaml<sim::MotionSpec>(file); }},
      {"scene", [](const std::string& file) { sim::read_scene(file); }},
      {"job", read_job_of_either_sort},
      {"study", [](const std::string& file) { lab::read_study(file); }},
      {"fit", [](const std::string& file) { read_yaml<lab::UnitFitSpec>(file); }},
      {"residual", [](const std::string& file) { sim::read_residual_map(file); }},
      {"palpation", [](const std::string& file) { lab::read_palpation(file); }},
  };
  std::string kind;
  std::string file;
  while (std::cin >> kind >> std::ws && std::getline(std::cin, file)) {
    try {
      readers.at(kind)(file);
      fmt::print("taken\n");
    } catch (const Error& error) {
      fmt::print("refused {}\n", error.what());
    }
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace touchstone

int main() {
  return touchstone::read_all();
}
