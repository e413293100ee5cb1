#pragma once
// From a job to a data set in a folder. Every set has
//   OUT/dataset.json                 what it is and how it came to be (manifest.h); written last
// A job with `scenes` adds
//   OUT/frames/<scene>/000012.png    what the camera delivers (also ideal/ and radiance/, where asked for)
//   OUT/events/<scene>.h5            what event pixels send during a scene (sensors/events/event_file.h)
//   OUT/truth.h5                     what is true at each sample (truth_file.h)
// and a job with `draw`
//   OUT/blocks/000012.h5             samples (block_file.h)
//   OUT/README.md                    the data set's card (data_card.h)
// Sample i is a pure function of (job, i): the same job gives the same bytes with any number of threads and shards, and
// a run that was killed and started again gives the bytes of one that never was.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "datasets/sets/block_record.h"
#include "datasets/sets/sample_source.h"
#include "sim/cost/scene_cost.h"

namespace touchstone::datasets {

/// Part `number` of `count` of a drawn set's blocks, from 1 on.
struct Shard {
  int number = 1;
  int count = 1;
};
/// Reads "2/8". @throws Error
Shard shard_of(const std::string& text);

/// How a job is run.
struct GenerateOptions {
  SampleSource scenes;          ///< of a job with `scenes`
  SensorSource sensors;         ///< of a job with `draw`
  std::filesystem::path cache;  ///< where what effects change is kept; empty: nowhere
  int threads = 0;              ///< at most so many; 0: as many as the machine has
  Shard shard;                  ///< of a job with `draw`; 1 of 1: everything, and then what merge does
  /// Hears, before anything is made, what the run will take on this machine, so many samples being there already.
  /// Empty: nothing is predicted, which takes seconds itself.
  std::function<void(const sim::RunCost&)> predicted;
  bool timings =
      true;  ///< put wall times in a set of scenes' manifest; without them the folder is the same in every run
};

/// Samples from the simulator, with its set-up results kept in `cache_folder`.
GenerateOptions simulated(const std::filesystem::path& cache_folder);

/// What a run did.
struct GenerateReport {
  bool was_finished = false;  ///< the folder held the finished set; its checksums were verified and nothing else done
  std::int64_t samples = 0;   ///< of the job, or of the shard
  std::int64_t made = 0;      ///< samples that this run made
  std::int64_t kept = 0;      ///< samples that an earlier, unfinished run had made
  std::int64_t damaged_blocks = 0;  ///< of an earlier run, made again
  std::int64_t drawn_again = 0;     ///< touches that couldn't be pressed, among the samples made
  std::string warning;  ///< of a damaged cache, which was made anew, and of objects' sizes (sim::size_doubt)
  /// Adds a sentence to `warning`, once; an empty one is none.
  void warn(const std::string& sentence) {
    if (sentence.empty() || warning.find(sentence) != std::string::npos) return;
    warning += (warning.empty() ? "" : "; ") + sentence;
  }
  double set_up_s = 0.0, press_s = 0.0, write_s = 0.0;  ///< wall times of a drawn set's parts
};

/// Makes what is missing of a job's data set, or of one shard of it, in folder `out`.
/// @throws Error for a mistake in the job (then nothing is written); if `out` holds anything else than this job's own
///   data set, finished or not, made by this program on this kind of processor (then nothing is touched); if another
///   run works on a set of scenes there; if a finished set doesn't meet its checksums; if the disk is full (then the
///   same command goes on); for a shard of a job with `scenes`
GenerateReport generate(const std::filesystem::path& job_file, const std::filesystem::path& out,
                        const GenerateOptions& options, const Progress& progress = {});

/// Checks that all blocks of a drawn set are there and whole and writes card and manifest. The folder is then what a
/// single run of everything makes, byte for byte. On a finished set it verifies all checksums.
/// @throws Error that names the first blocks that are missing; as generate; for a job with `scenes`
GenerateReport merge(const std::filesystem::path& job_file, const std::filesystem::path& out,
                     const Progress& progress = {});

/// Of `count` shards the numbers of those that aren't all there yet, damaged files included; none of a finished set,
/// all where nothing was begun. Writes nothing. @throws Error as merge, for a count below 1
std::vector<int> missing_shards(const std::filesystem::path& job_file, const std::filesystem::path& out, int count);

}  // namespace touchstone::datasets
