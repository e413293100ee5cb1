// Solids and gels as glTF 2.0, JSON or binary.

#include "sim/files/gltf_mesh.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scratch_file.h"

namespace touchstone::fuzz {

bool reads(std::string_view bytes) {
  const auto file = scratch_file(bytes, "solid.glb");
  const bool solid = gives_result([&] { sim::read_gltf_mesh(file, 1000.0); });
  return gives_result([&] { sim::read_gltf_gel(file, 1000.0); }) || solid;
}

}  // namespace touchstone::fuzz
