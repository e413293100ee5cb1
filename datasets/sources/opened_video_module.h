#pragma once
// Internal to datasets.

#include "datasets/sources/video_module.h"

namespace touchstone::datasets {

/// The video module, opened at the first call. @throws Error if it can't be
const TouchstoneVideoModule& video_module();

}  // namespace touchstone::datasets
