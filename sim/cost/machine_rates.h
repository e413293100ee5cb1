#pragma once
// How fast this machine works: measured once, in some seconds, and kept.

#include <filesystem>
#include <string>

#include "core/progress.h"

namespace touchstone::sim {

/// Seconds for what is counted, with so many threads.
struct MachineRates {
  int threads = 1;
  double elimination_s = 0.0;   ///< an operation of eliminating a gel's inside
  double unknown_s = 0.0;       ///< an unknown of a gel that is set up: its mesh and its matrix
  double flat_press_s = 0.0;    ///< a radius on a flat gel on which a mesh's error is measured (fem::SetupCount)
  double curved_press_s = 0.0;  ///< and on a curved one, where bodies are looked up on bent triangles
  double newton_s = 0.0;        ///< an operation of a factorisation at finite strain
  double speed_up = 1.0;        ///< so many times one thread's work at a time, of work that is cut into frames
};

/// Measures them, with `threads` threads (0: as many as the machine has): some ten seconds.
MachineRates measure_rates(int threads);

/// What the rates depend on: the processor, BLAS's kernels, threads, and how they are measured.
std::string rates_key(int threads);

/// The rates from the cache; where they aren't there, or the file is damaged or another machine's, they are measured
/// and kept. An empty `cache` keeps nothing, nor does one that can't be written to.
MachineRates machine_rates(int threads, const std::filesystem::path& cache, const Progress& progress = {});

/// Where they are kept.
std::filesystem::path rates_file(int threads, const std::filesystem::path& cache);

}  // namespace touchstone::sim
