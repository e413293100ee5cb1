#include "datasets/sets/generate.h"

#include <tbb/global_control.h>

#include <charconv>
#include <optional>

#include "core/error.h"
#include "datasets/jobs/draw.h"
#include "datasets/sets/drawn_set.h"
#include "datasets/sets/scene_set.h"

namespace touchstone::datasets {
namespace {

/// @throws Error for a job whose samples are the frames of scenes
PreparedDraw prepare_shards(const std::filesystem::path& job_file) {
  if (!is_draw_job_file(job_file)) {
    fail("{}: isn't a job with `draw`; only those have shards", job_file.string());
  }
  return prepare_draw(job_file);
}

}  // namespace

Shard shard_of(const std::string& text) {
  Shard shard;
  const std::size_t slash = text.find('/');
  const auto read = [&](std::size_t from, std::size_t to, int& value) {
    const auto result = std::from_chars(text.data() + from, text.data() + to, value);
    return from < to && result.ec == std::errc() && result.ptr == text.data() + to;
  };
  if (slash == std::string::npos || !read(0, slash, shard.number) || !read(slash + 1, text.size(), shard.count) ||
      shard.count < 1 || shard.number < 1 || shard.number > shard.count) {
    fail("--shard: '{}' isn't a shard; allowed is I/N, the I-th of N parts, I from 1 to N", text);
  }
  return shard;
}

GenerateOptions simulated(const std::filesystem::path& cache_folder) {
  GenerateOptions options;
  options.scenes = simulator(cache_folder);
  options.sensors = virtual_sensors(cache_folder);
  options.cache = cache_folder;
  return options;
}

GenerateReport generate(const std::filesystem::path& job_file, const std::filesystem::path& out,
                        const GenerateOptions& options, const Progress& progress) {
  std::optional<tbb::global_control> limit;
  if (options.threads > 0) {
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.threads));
  }
  const bool drawn = options.shard.count > 1 || is_draw_job_file(job_file);
  return drawn ? generate_draw(prepare_shards(job_file), out, options, progress)
               : generate_scenes(prepare_job(job_file), out, options, progress);
}

GenerateReport merge(const std::filesystem::path& job_file, const std::filesystem::path& out,
                     const Progress& progress) {
  return merge_draw(prepare_shards(job_file), out, progress);
}

std::vector<int> missing_shards(const std::filesystem::path& job_file, const std::filesystem::path& out, int count) {
  if (count < 1) fail("--missing: {} is not allowed; allowed is at least 1", count);
  return missing_shards_of_draw(prepare_shards(job_file), out, count);
}

}  // namespace touchstone::datasets
