// Files of events as HDF5. The library isn't ours: what ends it ends a process of its own (core/isolated_call.h), which
// is an Error.

#include "sensors/events/event_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scratch_file.h"

/// HDF5 1.10 forgets some memory when it gives up on a damaged file; LeakSanitizer asks here whose leaks aren't ours.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libhdf5\n";
}

namespace touchstone::fuzz {

bool reads(std::string_view bytes) {
  if (!bytes.starts_with("\x89HDF\r\n\x1a\n")) return false;
  const auto file = scratch_file(bytes, "events.h5");
  return gives_result([&] { sensors::read_events(file); });
}

}  // namespace touchstone::fuzz
