#include "apps/blas_kind.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>

#include "datasets/sets/processor.h"

namespace touchstone::apps {
namespace {

constexpr const char* kCoreType = "OPENBLAS_CORETYPE";
constexpr const char* kRestarted = "TOUCHSTONE_BLAS_RESTARTED";

/// OpenBLAS's names of x86 processors without AVX2: what it says of one that it doesn't know.
bool is_old(const std::string& core) {
  static constexpr std::array kOld = {"Generic",   "Katmai", "Coppermine", "Northwood",  "Prescott",
                                      "Banias",    "Core2",  "Penryn",     "Dunnington", "Atom",
                                      "Nehalem",   "Athlon", "Opteron",    "Nano",       "Opteron_SSE3",
                                      "Barcelona", "Bobcat", "Unknown",    "Sandybridge"};
  return std::find(kOld.begin(), kOld.end(), core) != kOld.end();
}

}  // namespace

void choose_blas_kind(char** argv) {
  datasets::use_one_blas_thread();
  if (std::getenv(kCoreType) != nullptr || std::getenv(kRestarted) != nullptr) return;
  const std::string instructions = datasets::vector_instructions();
  if (instructions == "baseline" || !is_old(datasets::blas_core())) return;
  setenv(kCoreType, instructions == "avx512" ? "SkylakeX" : "Haswell", 1);
  setenv(kRestarted, "1", 1);
  execv("/proc/self/exe", argv);
  spdlog::warn("OpenBLAS takes this processor for '{}' and will be slow; set {}={}", datasets::blas_core(), kCoreType,
               std::getenv(kCoreType));
}

}  // namespace touchstone::apps
