#include "datasets/sources/opened_video_module.h"

#include "core/own_module.h"

namespace touchstone::datasets {

const TouchstoneVideoModule& video_module() {
  static const TouchstoneVideoModule& module =
      own_module_table<TouchstoneVideoModule>({.name = TOUCHSTONE_VIDEO_MODULE_NAME,
                                               .built = TOUCHSTONE_VIDEO_MODULE_BUILT,
                                               .purpose = "videos and cameras",
                                               .symbol = kTouchstoneVideoModuleSymbol},
                                              kTouchstoneVideoModuleVersion);
  return module;
}

}  // namespace touchstone::datasets
