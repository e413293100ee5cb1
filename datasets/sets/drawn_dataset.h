#pragma once
// From a job that draws to a data set in a folder:
//   OUT/blocks/000012.h5   samples (block_file.h)
//   OUT/README.md          the data set's card (data_card.h)
//   OUT/dataset.json       what it is and how it came to be; written last
// Sample i is a pure function of (job, i), so the bytes don't depend on threads, on shards, or on how often a run was
// killed. Blocks come into being by renaming: runs on one folder, of one shard too, can't mix, and what one has made
// the others leave alone.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "datasets/sets/block_record.h"

namespace touchstone::datasets {

/// Part `number` of `count` of a job's blocks, from 1 on.
struct Shard {
  int number = 1;
  int count = 1;
};
/// Reads "2/8". @throws Error
Shard shard_of(const std::string& text);

/// How a job that draws is run; none of it changes a sample.
struct DrawnOptions {
  SensorSource source;
  int threads = 0;  ///< at most so many; 0: as many as the machine has
  Shard shard;      ///< 1 of 1: everything, and then what merge_drawn does
};

/// What a run did.
struct DrawnReport {
  bool was_finished = false;        ///< the folder held the finished set; its checksums hold, nothing else was done
  std::int64_t samples = 0;         ///< of the shard
  std::int64_t made = 0, kept = 0;  ///< samples
  std::int64_t damaged_blocks = 0;  ///< of an earlier run, made again
  std::int64_t drawn_again = 0;     ///< touches that couldn't be pressed, among the samples made
  double set_up_s = 0.0, press_s = 0.0, write_s = 0.0;  ///< wall times
};

/// Makes what is missing of a shard's blocks, or of all.
/// @throws Error for a mistake in the job (then nothing is written); if `out` holds something else than this job's own
///   data set, made by this program on this kind of processor (then nothing is touched); if it can't be written
DrawnReport generate_drawn(const std::filesystem::path& job_file, const std::filesystem::path& out,
                           const DrawnOptions& options, const Progress& progress = {});

/// Checks that all blocks are there and whole and writes card and manifest. The folder is then what a single run of
/// everything makes, byte for byte. On a finished set it verifies all checksums.
/// @throws Error that names the first missing blocks; as generate_drawn
DrawnReport merge_drawn(const std::filesystem::path& job_file, const std::filesystem::path& out,
                        const Progress& progress = {});

/// Of `count` shards the numbers of those that aren't all there yet, damaged files included; none of a finished set,
/// all where nothing was begun. Writes nothing. @throws Error as merge_drawn, for a count below 1
std::vector<int> missing_shards(const std::filesystem::path& job_file, const std::filesystem::path& out, int count);

}  // namespace touchstone::datasets
