#pragma once

#include <memory>

#include "fem/elements/compliance.h"
#include "fem/shapes/contact_shape.h"

namespace touchstone::fem {

/// A body that touches the gel.
struct PressBody {
  ContactShape shape;
  double friction = 0.0;                      ///< Coulomb's mu against the gel; infinity: what touches sticks
  std::shared_ptr<const Compliance> elastic;  ///< its own compliance in the object frame; none: it is rigid
};

}  // namespace touchstone::fem
