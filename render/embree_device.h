#pragma once

#include <embree3/rtcore.h>

namespace touchstone::render {

/// One Embree device for the process. Its `threads` option stays alone: it would limit oneTBB in the whole process.
/// @throws Error where Embree can't start
RTCDevice embree_device();

}  // namespace touchstone::render
