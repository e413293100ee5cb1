#pragma once

struct RTCDeviceTy;

namespace touchstone::render {

/// One Embree device for the process. Its `threads` option stays alone: it would limit oneTBB in the whole process.
/// @throws Error where Embree can't start
RTCDeviceTy* embree_device();

}  // namespace touchstone::render
