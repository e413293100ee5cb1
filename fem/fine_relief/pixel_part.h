#pragma once
// Contact that fills a small part of its grid, solved there.

#include <functional>
#include <memory>

#include "fem/fine_relief/pixel_box.h"
#include "fem/fine_relief/pixel_contact.h"

namespace touchstone::fem {

/// Of a grid of that many pixels and that pitch, wherever it stands.
using ResponseOf = std::function<std::shared_ptr<const LayerResponse>(const PixelGrid&)>;

/// What solve_pixel_contact says on the pixels of `whole`, to the same tolerance: pressure is looked for in `part` and
/// where contact spreads from there, and one more application gives the displacement everywhere. Where the body then
/// overlaps the surface elsewhere, the whole is solved. `contact` and `start` are by pixel of `whole`.
/// @throws Error as solve_pixel_contact
PixelContactAnswer solve_in_part(const ResponseOf& response, const PixelBox& whole, const PixelBox& part, double pitch,
                                 const PixelContact& contact, const PixelTolerance& tolerance,
                                 const std::vector<double>& start);

}  // namespace touchstone::fem
