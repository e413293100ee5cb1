// Pictures of all kinds that OpenImageIO knows, as frames, as linear light and for what is written beside the pixels.

#include "sim/files/image_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scratch_file.h"

/// OpenImageIO keeps what it said last of a file in each thread; LeakSanitizer asks here whose leaks aren't ours.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libOpenImageIO\n";
}

namespace touchstone::fuzz {

bool reads(std::string_view bytes) {
  const auto file = scratch_file(bytes, "picture.png");  // others are recognised by their first bytes
  const bool frame = gives_result([&] { TS_ASSERT(!sim::read_image(file).empty()); });
  const bool light = gives_result([&] { TS_ASSERT(!sim::read_exr(file).image.empty()); });
  gives_result([&] { sim::image_metadata(file, "touchstone"); });
  return frame || light;
}

}  // namespace touchstone::fuzz
