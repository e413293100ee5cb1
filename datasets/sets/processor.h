#pragma once

#include <string>

namespace touchstone::datasets {

/// The vector instructions that this processor has: "avx512", "avx2" or "baseline". Embree chooses its kernels by them.
std::string vector_instructions();

/// The processor that OpenBLAS takes this one for: "SkylakeX", "Haswell", "Prescott" ...
std::string blas_core();

/// Keeps OpenBLAS from threads of its own: results must not depend on their number.
void use_one_blas_thread();

/// Where address space is limited (RLIMIT_AS), takes what OpenBLAS will need of it for this process' threads: it waits
/// for ever where it can't have a buffer. @throws Error with needed and left bytes if that's too much
void reserve_blas_buffers();

/// Both in one text: results agree to the last digit between machines of one kind only.
std::string processor_kind();

}  // namespace touchstone::datasets
