#pragma once
// A job file: many scenes, numbered sample after sample, that make one data set. See docs/file-formats.md.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/yaml_reader.h"
#include "datasets/jobs/split.h"
#include "sim/scene/scene.h"

namespace touchstone::datasets {

/// One scene of a job: a scene file, and what differs from it here.
struct JobScene {
  std::string name;             ///< letters, digits, - and _; unique in the job; names the folder of its frames
  std::filesystem::path scene;  ///< the scene file; in the job file relative to the job file's folder
  Split split = Split::train;
  std::optional<Eigen::Vector3d> start_mm;  ///< instead of the motion's own start
  SourceLocation where;
};

/// A job file of scenes, as read and checked.
struct Job {
  std::string name;
  std::string licence;  ///< of the data set: an SPDX name or any text; empty: none stated
  std::uint64_t seed = 0;
  std::vector<JobScene> scenes;
  std::optional<sim::OutputSpec> outputs;     ///< instead of every scene's own outputs, as a whole
  std::optional<sim::AccuracySpec> accuracy;  ///< counts more than the scenes' own
  SourceLocation where;
};

void fields(YamlReader& in, JobScene& scene);
void fields(YamlReader& in, Job& job);

/// Reads and checks a job file, but none of the scenes that it names. @throws Error with file and line
Job read_job(const std::filesystem::path& file);

/// May it name a folder or a file? Up to 100 letters, digits, - and _.
bool is_folder_name(const std::string& name);

/// True if the file is a job and not a scene: it has the key `scenes`. @throws Error if it isn't YAML
bool is_job_file(const std::filesystem::path& file);

}  // namespace touchstone::datasets
