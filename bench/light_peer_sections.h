#pragma once
// What bench_light_peer measures, a table each.

#include <filesystem>

#include "bench/result_table.h"

namespace touchstone::bench {

struct LightPeerOptions {
  bool quick = false;             ///< under half a minute
  std::filesystem::path scratch;  ///< an empty folder for scenes and pictures
};

/// Do both programs draw the same picture?
ResultTable equal_pictures_table(const LightPeerOptions& options);
/// Noise against seconds of both.
ResultTable equal_noise_table(const LightPeerOptions& options);

}  // namespace touchstone::bench
