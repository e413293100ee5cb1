#include "fem/contact/press_fields.h"

#include <utility>

#include "core/error.h"
#include "fem/contact/press_report.h"

namespace touchstone::fem {

struct PressFields::Parts {
  explicit Parts(const Compliance& gel_of) : gel(gel_of), surface(gel_of) {
    mass.compute(gel.mass);
    if (mass.info() != Eigen::Success) fail("the gel's surface mass matrix isn't positive definite");
  }

  const Compliance& gel;
  ContactSurface surface;
  SurfaceMassFactor mass;
};

PressFields::PressFields(const Compliance& gel) : parts_(std::make_unique<const Parts>(gel)) {}
PressFields::~PressFields() = default;
PressFields::PressFields(PressFields&&) noexcept = default;
PressFields& PressFields::operator=(PressFields&&) noexcept = default;

PressState PressFields::with_fields(PressState state) const {
  const auto n = static_cast<Eigen::Index>(parts_->gel.vertices.size());
  TS_ASSERT(state.traction.rows() == n && state.node_state.size() == static_cast<std::size_t>(n));
  if (state.contact_vertices == 0) {
    state.surface_displacement = Eigen::MatrixX3d::Zero(n, 3);
    return state;
  }
  Eigen::VectorXd bearing = Eigen::VectorXd::Zero(3 * n);
  for (Eigen::Index v = 0; v < n; ++v) {
    if (state.node_state[static_cast<std::size_t>(v)] != NodeState::open) {
      bearing.segment<3>(3 * v) = state.traction.row(v).transpose();
    }
  }
  add_displacement(parts_->gel, parts_->surface, parts_->mass, parts_->gel.surface.times(bearing), state);
  return state;
}

}  // namespace touchstone::fem
