#pragma once

namespace touchstone::apps {

/// Debian's OpenBLAS takes processors that are newer than itself for an old one (Prescott) and then runs at a fifth of
/// their speed; only OPENBLAS_CORETYPE, read when the library is loaded, sets it. If that has happened here,
/// sets the variable and starts this program anew with the same arguments, once; otherwise returns. Also sets OpenBLAS
/// to one thread: we have threads of our own, and sums must not depend on their number.
void choose_blas_kind(char** argv);

}  // namespace touchstone::apps
