#pragma once

#include <Eigen/Core>
#include <vector>

#include "fem/contact/contact_gap.h"
#include "fem/contact/cut_hats.h"
#include "fem/elements/compliance.h"

namespace touchstone::fem {

/// What cutting hats changes in the compliance among `vertices`: the difference of a half-space's response to the cut
/// densities and to whole hats [Johnson1985, eqs. 3.19, 3.75], which is as the gel's own where they are near each
/// other; the finite elements keep all else. Added to `compliance`, 3 m x 3 m in the vertices' own axes (pressure and
/// two tangents, see ContactBlock), mm^3 per MPa; `normal_only`: to its normal rows and columns alone.
void add_cut_compliance(Eigen::MatrixXd& compliance, const CutHats& cuts, const ContactSurface& surface,
                        const Compliance& gel, const std::vector<int>& vertices,
                        const std::vector<Eigen::Matrix3d>& axes_of_all, bool normal_only);

}  // namespace touchstone::fem
