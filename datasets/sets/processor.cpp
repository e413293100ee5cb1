#include "datasets/sets/processor.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <cmath>
#include <vector>

#include "core/memory_left.h"

extern "C" {
char* openblas_get_corename(void);
void openblas_set_num_threads(int threads);
// A buffer goes back into a pool, which never gets smaller; those of threads that compute at once are different ones.
void* blas_memory_alloc(int kind);
void blas_memory_free(void* buffer);
}

namespace touchstone::datasets {

std::string vector_instructions() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  // Those that OpenBLAS's SkylakeX kernels use.
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl")) {
    return "avx512";
  }
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return "avx2";
#endif
  return "baseline";
}

std::string blas_core() {
  return openblas_get_corename();
}

void use_one_blas_thread() {
  openblas_set_num_threads(1);
}

void reserve_blas_buffers() {
  if (!std::isfinite(address_space_left())) return;
  constexpr double kBuffer = 135e6;  // of Debian's OpenBLAS; used by some per cent
  constexpr double kStack = 75e6;    // a thread's stack, and its first part of the heap
  const std::size_t threads = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  require_memory((kBuffer + kStack) * static_cast<double>(threads),
                 fmt::format("computing on {} threads (--threads 1 takes fewer)", threads));
  std::vector<void*> buffers(threads);
  for (void*& buffer : buffers) buffer = blas_memory_alloc(0);
  for (void* buffer : buffers) blas_memory_free(buffer);
}

std::string processor_kind() {
  return vector_instructions() + ", BLAS for " + blas_core();
}

}  // namespace touchstone::datasets
