#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "datasets/jobs/input_files.h"
#include "datasets/jobs/job.h"
#include "sim/plan/plan.h"

namespace touchstone::datasets {

/// One scene of a job with all that it names read, its overrides applied and its effects planned. Its samples are
/// `first_sample` ... `first_sample + samples - 1`, one a frame of its motion.
struct PreparedScene {
  JobScene entry;
  sim::SceneSpec spec;
  sim::Plan plan;
  std::int64_t first_sample = 0;
  std::int64_t samples = 0;
};

/// A job ready to run. Every mistake that can be seen without simulating has been looked for.
struct PreparedJob {
  Job job;
  std::filesystem::path file;
  std::string text;  ///< the job file as it is
  std::vector<InputFile> inputs;
  std::vector<PreparedScene> scenes;
  std::int64_t samples = 0;
};

/// Reads a job and all that it names. Plans go by fixed shares until plan_by_need() (scene_plan.h). All scenes get the
/// job's seed: they show one unit of the device, and samples differ by their index. A data set holds one device, so
/// that its arrays have one shape.
/// @throws Error with file and line
PreparedJob prepare_job(const std::filesystem::path& file);

}  // namespace touchstone::datasets
