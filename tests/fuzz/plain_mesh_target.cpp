// Solids as STL, OBJ or PLY, told apart by how they begin.

#include "sim/files/plain_mesh.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scratch_file.h"

namespace touchstone::fuzz {

bool reads(std::string_view bytes) {
  using sim::PlainMeshFormat;
  const bool stl = bytes.starts_with("solid") || bytes.find('\0') < 84;
  const auto format = bytes.starts_with("ply") ? PlainMeshFormat::ply
                      : stl                    ? PlainMeshFormat::stl
                                               : PlainMeshFormat::obj;
  return gives_result([&] { sim::read_plain_mesh(scratch_file(bytes, "solid"), format, 1.0); });
}

}  // namespace touchstone::fuzz
