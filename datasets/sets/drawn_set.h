#pragma once
// The data set of a job with `draw`. generate.h is the way in. Blocks come into being by renaming: runs on one folder,
// of one shard too, can't mix, and what one has made the others leave alone.

#include "datasets/jobs/drawn_touch.h"
#include "datasets/sets/generate.h"

namespace touchstone::datasets {

/// generate() of a job with `draw`.
GenerateReport generate_draw(PreparedDraw prepared, const std::filesystem::path& out, const GenerateOptions& options,
                             const Progress& progress);

/// merge() of a job with `draw`.
GenerateReport merge_draw(const PreparedDraw& prepared, const std::filesystem::path& out, const Progress& progress);

/// missing_shards() of a job with `draw`.
std::vector<int> missing_shards_of_draw(const PreparedDraw& prepared, const std::filesystem::path& out, int count);

}  // namespace touchstone::datasets
