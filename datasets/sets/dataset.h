#pragma once
// From a job to a data set in a folder:
//   OUT/frames/SCENE/000012.png   what the camera delivers (also ideal/ and radiance/, where asked for)
//   OUT/events/SCENE.h5           what event pixels give of a scene, where asked for (sensors/events/event_file.h)
//   OUT/truth.h5                   what is true at each sample (truth_file.h)
//   OUT/dataset.json               what it is and how it came to be (manifest.h); written last
// Sample i is a pure function of (job, i): the same job gives the same bytes with any number of threads, and a run
// that was killed and started again gives the bytes of one that never was.

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/progress.h"
#include "datasets/sets/sample_source.h"

namespace touchstone::datasets {

/// How a job of scenes is run; none of it changes a sample.
struct GenerateOptions {
  SampleSource source;
  int threads = 0;      ///< at most so many; 0: as many as the machine has
  bool timings = true;  ///< put wall times in the manifest; without them the whole folder is the same in every run
};

/// What a run did.
struct GenerateReport {
  bool was_finished = false;  ///< the folder held the finished set; its checksums were verified and nothing else done
  std::int64_t samples = 0;
  std::int64_t rendered = 0;  ///< samples whose pictures were made by this run
  std::int64_t kept = 0;      ///< samples whose pictures an earlier, unfinished run had made
  std::string warning;        ///< what was wrong with the cache of set-up results; it was made anew
};

/// Generates the data set of a job file in folder `out`, or goes on with one that was broken off. All of the mechanics
/// is computed before the first picture, and computed again when a run goes on: it is cheap beside the pictures.
/// @throws Error for a mistake in the job (then nothing is written); if `out` holds anything else than this job's own
///   data set, finished or not, made by this program on this kind of processor (then nothing is touched); if another
///   run works there; if a finished set doesn't meet its checksums; if the disk is full (then the same command goes on)
GenerateReport generate(const std::filesystem::path& job_file, const std::filesystem::path& out,
                        const GenerateOptions& options, const Progress& progress = {});

}  // namespace touchstone::datasets
