#pragma once
// Nearly incompressible neo-Hookean rubber as a saddle point in displacement and pressure.
//
//   W(F, p) = G/2 (F:F - 3) - G ln J - p (J - 1) - p^2 / (2 lambda),   J = det F
//
// Eliminating p (p = -lambda (J - 1)) gives the compressible neo-Hookean solid with the volume term lambda/2 (J - 1)^2
// ([Bonet2008, sec. 6.4.3], whose volume term is lambda/2 (ln J)^2). At small strain it is the linear elasticity of
// fem/elements/taylor_hood.h with the same G, lambda and the same pressure, so the tangent at rest is the linear system
// itself; lambda may be infinite (nu = 0.5).
//
// Without units: stresses over Scales::stress, and p = stress * pressure_scale * q, as there.

#include <Eigen/Core>

#include "fem/elements/taylor_hood.h"

namespace touchstone::fem {

/// A region's material without units.
using NeoHookean = Scales::Region;

/// First derivatives of W at a deformation gradient F and a pressure unknown q. J must be above zero.
struct NeoHookeanStress {
  Eigen::Matrix3d stress;  ///< dW/dF: first Piola-Kirchhoff, shear (F - F^-T) - pressure_scale q J F^-T
  double volume = 0.0;     ///< dW/dq: -pressure_scale (J - 1) - compressibility q
};

/// W. Infinite where J <= 0.
double energy(const NeoHookean& material, const Eigen::Matrix3d& gradient, double q);

/// Its derivatives by F and by the pressure unknown. Only where J > 0.
NeoHookeanStress stress(const NeoHookean& material, const Eigen::Matrix3d& gradient, double q);

/// The change of stress() with F and q: its derivative at (F, q) applied to (dF, dq).
NeoHookeanStress stress_change(const NeoHookean& material, const Eigen::Matrix3d& gradient, double q,
                               const Eigen::Matrix3d& gradient_change, double q_change);

}  // namespace touchstone::fem
