#pragma once

#include <string>

namespace touchstone::datasets {

/// The vector instructions that this processor has: "avx512", "avx2" or "baseline". Embree chooses its kernels by them.
std::string vector_instructions();

/// The processor that OpenBLAS takes this one for: "SkylakeX", "Haswell", "Prescott" ...
std::string blas_core();

/// Keeps OpenBLAS from threads of its own: results must not depend on their number.
void use_one_blas_thread();

/// Both in one text: results agree to the last digit between machines of one kind only.
std::string processor_kind();

}  // namespace touchstone::datasets
