// Files of events: text, EVT 3.0, AEDAT 4.0. Those of HDF5 are event_hdf5_target's, as each takes a process.

#include "sensors/events/event_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scratch_file.h"

namespace touchstone::fuzz {

bool reads(std::string_view bytes) {
  if (bytes.starts_with("\x89HDF")) return false;
  const auto file = scratch_file(bytes, "events.txt");  // the others are recognised by their first bytes
  const bool read = gives_result([&] { sensors::read_events(file); });
  return gives_result([&] { sensors::read_events(file, {.size = cv::Size(34, 26), .stream = 0}); }) || read;
}

}  // namespace touchstone::fuzz
