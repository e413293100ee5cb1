#pragma once

#include <string>

namespace touchstone::lab {

/// The vector instructions that this processor has: "avx512", "avx2" or "baseline". Embree chooses its kernels by them.
std::string vector_instructions();

/// The processor that OpenBLAS takes this one for: "SkylakeX", "Haswell", "Prescott" ...
std::string blas_core();

/// Both in one text: results agree to the last digit between machines of one kind only.
std::string processor_kind();

}  // namespace touchstone::lab
