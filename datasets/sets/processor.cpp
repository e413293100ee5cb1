#include "datasets/sets/processor.h"

extern "C" {
char* openblas_get_corename(void);
void openblas_set_num_threads(int threads);
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

std::string processor_kind() {
  return vector_instructions() + ", BLAS for " + blas_core();
}

}  // namespace touchstone::datasets
