#pragma once
// What a figure was measured on.

#include <string>

namespace touchstone::bench {

struct Machine {
  std::string host;
  std::string cpu;        ///< as /proc/cpuinfo names it
  int cpus = 0;           ///< those that this process may use
  std::string blas_core;  ///< see fem::blas_core_name(); "Prescott" on a recent processor: OpenBLAS guessed wrong
  double load_before =
      0.0;  ///< runnable tasks on the machine, mean of the last minute: above zero, others were at work
};

Machine this_machine();

/// One line for people.
std::string describe(const Machine& machine);

/// Largest memory that the process has held since start or the last call of forget_peak_memory, MB (10^6 bytes).
double peak_memory_mb();
/// Gives back what is free and sets the peak to what is held now; where the system doesn't allow that, the peak stays
/// that of the process.
void forget_peak_memory();

}  // namespace touchstone::bench
