#pragma once
// Where the golden images are, and how well they and what is held against them are rendered.

#include <filesystem>
#include <string>

#include "tests/golden/golden_scenes.h"
#include "tests/golden/image_statistics.h"

namespace touchstone::golden {

inline std::filesystem::path file_of(const std::string& name) {
  return std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "tests" / "golden" / "images" / (name + ".exr");
}

/// 2,048 paths a pixel.
inline ImageStatistics reference_rendering(const GoldenScene& golden) {
  return render_batches(golden.scene, golden.camera, 256, 8, 1000000);
}

/// 256 paths a pixel, none of them the reference's.
inline ImageStatistics test_rendering(const GoldenScene& golden, std::uint64_t first_seed = 1) {
  return render_batches(golden.scene, golden.camera, 32, 8, first_seed);
}

}  // namespace touchstone::golden
