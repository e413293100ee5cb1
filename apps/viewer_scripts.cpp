// The scripts are put into the program when it's built: a page then doesn't depend on what its maker has installed.

#include "apps/viewer_scripts.h"

namespace touchstone::apps {

#ifdef TOUCHSTONE_THREE_FOLDER

// NAME_begin to NAME_end: the bytes of a file.
#define TOUCHSTONE_FILE(name, file)                                                              \
  __asm__(".section .rodata\n.global touchstone_" #name "_begin\ntouchstone_" #name              \
          "_begin:\n.incbin \"" TOUCHSTONE_THREE_FOLDER "/" file "\"\n.global touchstone_" #name \
          "_end\ntouchstone_" #name "_end:\n.byte 0\n.previous\n");                              \
  extern "C" const char touchstone_##name##_begin[];                                             \
  extern "C" const char touchstone_##name##_end[];

TOUCHSTONE_FILE(three, "three.min.js")
TOUCHSTONE_FILE(gltf_loader, "examples/js/loaders/GLTFLoader.js")
TOUCHSTONE_FILE(orbit_controls, "examples/js/controls/OrbitControls.js")

std::optional<datasets::ViewerScripts> viewer_scripts() {
  return datasets::ViewerScripts{{touchstone_three_begin, touchstone_three_end},
                                 {touchstone_gltf_loader_begin, touchstone_gltf_loader_end},
                                 {touchstone_orbit_controls_begin, touchstone_orbit_controls_end}};
}

#else

std::optional<datasets::ViewerScripts> viewer_scripts() {
  return std::nullopt;
}

#endif

}  // namespace touchstone::apps
