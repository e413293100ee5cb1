#pragma once

namespace touchstone::render {

/// No coordinate of a scene is beyond: single precision, in which Embree traces, steps by more than 8 um there. mm
inline constexpr double kFarthest = 1e5;

/// W/m^2/sr and W: the sun shows 2e7. What can come of it must fit into the single precision of a picture.
inline constexpr double kBrightest = 1e12;

}  // namespace touchstone::render
