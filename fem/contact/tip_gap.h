#pragma once

#include "core/transform.h"
#include "fem/contact/contact_gap.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {

/// The gap between the undeformed surface and the body's corner that is lowest along the gel's z: a cone's tip, the
/// middle of a cylinder's face, the middle of a bar's end, a box's or a mesh's vertex. mm along the normal of the
/// triangle below it, negative where they overlap; infinity if it isn't over the gel, or the body has no corner. A tip
/// between the lines that gaps are looked up along (weighted_gap) may be seen by this alone.
double tip_gap(const ContactSurface& surface, const ContactShape& shape, const RigidTransform& gel_from_object);

}  // namespace touchstone::fem
