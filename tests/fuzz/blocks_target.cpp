// Files of data sets: truth.h5 of scenes and blocks of drawn sets, read for every column that the program asks for.

#include "core/hdf5_file.h"
#include "datasets/sets/block_file.h"
#include "datasets/sets/truth_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scratch_file.h"

/// HDF5 1.10 forgets some memory when it gives up on a damaged file; LeakSanitizer asks here whose leaks aren't ours.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libhdf5\n";
}

/// HDF5 asks malloc for as much as a damaged length says, gets nothing, and refuses the file. AddressSanitizer would
/// end the process there. What we ask for ourselves, by new, still does: that is a find.
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() {
  return "allocator_may_return_null=1:max_allocation_size_mb=1400";
}

namespace touchstone::fuzz {

bool reads(std::string_view bytes) {
  const datasets::DrawnBlock block{.number = 0, .unit = 0, .first_sample = 0, .samples = 2};
  const auto file = scratch_file(bytes, datasets::block_name(block));
  const auto out = file.parent_path().parent_path();
  datasets::state_of_block(out, "run", block);
  if (bytes.find("\x89HDF\r\n\x1a\n") == std::string_view::npos) return false;  // two processes for nothing
  const bool columns = gives_result([&] { datasets::read_block_columns(out, block); });
  const bool truth = gives_result([&] {
    const datasets::TruthTable table = datasets::read_truth_table(file);
    TS_ASSERT(table.wrench.size() == table.t_us.size());
    Hdf5Reader(file).read_rows<double>("/error/force_N", 0, 1);  // as pictures of a block are read, sample by sample
  });
  return columns || truth;
}

}  // namespace touchstone::fuzz
