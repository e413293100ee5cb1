#pragma once
// One step of a multifrontal elimination: the dense part of it, which is nearly all its work.

namespace touchstone::fem {

/// Eliminates the first unknowns of a dense symmetric matrix (lower half, by columns, `size` x `size`), of which the
/// first `positive` make a positive definite block and the next `negative`, once those are gone, a negative definite
/// one, as in a symmetric quasi-definite matrix (it has an L D L^T in any order [Vanderbei1995]). What is left in the
/// last rows and columns is their Schur complement; the columns before are L of L D L^T, D being 1 for positive pivots
/// and -1 for negative ones. Blocked Cholesky by OpenBLAS on one thread; large fronts are cut
/// into tiles that oneTBB's threads share. The tiles and the order of sums within each don't depend on the number of
/// threads. False if a pivot's sign is wrong. @pre OpenBLAS is set to one thread
bool eliminate_front(double* front, int size, int positive, int negative);
/// In single precision.
bool eliminate_front(float* front, int size, int positive, int negative);

/// The same in single precision by Gauss's elimination of the pivots' block with partial pivoting in it, whatever its
/// signs: three times the work. The columns before are left as the block's inverse (whole) and, below it, the rows
/// times that. False if the block is singular. @pre OpenBLAS is set to one thread
bool eliminate_indefinite_front(float* front, int size, int pivots);

}  // namespace touchstone::fem
