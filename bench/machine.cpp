#include "bench/machine.h"

#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "fem/elements/schur_solver.h"

namespace touchstone::bench {

Machine this_machine() {
  Machine machine;
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) == 0) machine.host = name.data();
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.rfind("model name", 0) != 0) continue;
    machine.cpu = line.substr(line.find(':') + 2);
    break;
  }
  machine.cpus = static_cast<int>(std::thread::hardware_concurrency());
  machine.blas_core = fem::blas_core_name();
  std::ifstream("/proc/loadavg") >> machine.load_before;
  return machine;
}

std::string describe(const Machine& machine) {
  return fmt::format("{} ({}, {} processors), BLAS kernels for {}, load before the run {:.1f}", machine.host,
                     machine.cpu, machine.cpus, machine.blas_core, machine.load_before);
}

double peak_memory_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmHWM:", 0) == 0) return std::strtod(line.c_str() + 6, nullptr) * 1024.0 / 1e6;
  }
  return 0.0;
}

void forget_peak_memory() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
}

}  // namespace touchstone::bench
