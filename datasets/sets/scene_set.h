#pragma once
// The data set of a job with `scenes`. generate.h is the way in.

#include "datasets/jobs/prepared_job.h"
#include "datasets/sets/generate.h"

namespace touchstone::datasets {

/// generate() of a job with `scenes`. All of the mechanics is computed before the first picture, and computed again
/// when a run goes on: it is cheap beside the pictures.
GenerateReport generate_scenes(const PreparedJob& job, const std::filesystem::path& out, const GenerateOptions& options,
                               const Progress& progress);

}  // namespace touchstone::datasets
