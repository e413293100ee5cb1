#pragma once
// Unilateral contact with Coulomb friction on a small block of surface vertices, as algebra.
//
// Unknown per vertex: z = (p, t1, t2): pressure and the tangential traction on the gel in the vertex's own axes (MPa).
// With c components a vertex (1 without friction, 3 with it), m vertices and k rigid shifts s of the object (mm):
//   normal:      g = gap + (A z + B s)_n >= 0,  p >= 0,  p g = 0
//   tangential:  d = (A z + B s)_t - drag,  |t| <= mu p,  d = 0 where |t| < mu p,  t = -mu p d/|d| where it slips
//   rigid:       B^T z - hold s = force
// ([Wriggers2006, sec. 5]; the friction law as a projection: [Alart1991].)

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "fem/elements/dense_factor.h"

namespace touchstone::fem {

/// What a surface vertex does: no contact; in contact and carried along by the object; in contact and sliding on it
/// (without friction every vertex in contact slides).
enum class NodeState : std::uint8_t { open = 0, stick = 1, slip = 2 };

/// One contact problem. `compliance`, kept by others, is A: symmetric positive definite, (c m) x (c m), mm^3 per MPa.
struct ContactProblem {
  std::optional<Eigen::Ref<const Eigen::MatrixXd>> compliance;
  int components = 1;        ///< c: 1 or 3
  Eigen::VectorXd gap;       ///< m, mm^3; infinity: can't touch
  Eigen::VectorXd drag;      ///< 2 m, mm^3; with friction only
  Eigen::VectorXd friction;  ///< m, mu, with friction only; infinity: what touches sticks
  Eigen::MatrixXd border;    ///< (c m) x k
  Eigen::VectorXd force;     ///< k, N
  Eigen::VectorXd hold;      ///< k, >= 0: stiffness that holds a shift back, N per mm; empty: none
};

/// How a slipping vertex may change its traction: along the slip only as Coulomb's law says.
struct SlipFrame {
  Eigen::Vector2d along = Eigen::Vector2d::Zero();  ///< direction of the friction
  double turn = 0.0;  ///< in 0..1: how far the traction follows when the slip turns (mu p over the predicted traction)
};

/// The last factorised system, which serves again while the same vertices are in contact in the same way. It belongs to
/// one compliance matrix and border: forget it when they change.
struct ContactMemory {
  std::vector<NodeState> state;  ///< empty: nothing is remembered
  DenseCholesky cholesky;        ///< frictionless: of the active rows and columns
  SinglePrecisionLu lu;          ///< with friction: of the Jacobian, the slipping vertices' directions eliminated
  Eigen::MatrixXd jacobian;      ///< its storage, kept
  std::vector<SlipFrame> slip;   ///< with friction: per vertex, what the Jacobian was made with
  void forget() { state.clear(); }
};

/// What the solver found: tractions and shifts, and how well they obey the laws.
struct ContactAnswer {
  Eigen::VectorXd z;             ///< c m, MPa
  Eigen::VectorXd shift;         ///< k, mm
  Eigen::VectorXd response;      ///< A z, mm^3
  std::vector<NodeState> state;  ///< m
  int iterations = 0;            ///< systems solved
  int factorisations = 0;
  int sweeps = 0;         ///< of block Gauss-Seidel, where Newton stalled
  double residual = 0.0;  ///< largest change of a traction by the laws' projection, relative to the largest pressure;
                          ///< infinity: there is no answer, `compliance` isn't positive definite
  bool converged = false;
};

/// Frictionless (components == 1): block principal pivoting [Judice1994], which is the primal-dual active set where
/// that converges and ends also where that would cycle. `start` gives the first active set (p > 0); it may be empty. A
/// border column that pushes in one direction (all its entries of one sign) must have a `force` above zero.
ContactAnswer solve_frictionless(const ContactProblem& problem, const Eigen::VectorXd& start, ContactMemory& memory);

/// With friction (components == 3): semismooth Newton on the projection equations, the factorised Jacobian kept while
/// the sets of open, sticking and slipping vertices stay and it converges fast; block Gauss-Seidel sweeps with
/// projection on the disc where it stalls. It begins with the remembered sets, as if all went on sticking, sliding the
/// same direction or staying apart, or, without memory, with sweeps. `start` is z to begin with, or empty. Ends when
/// `residual` <= tolerance.
ContactAnswer solve_frictional(const ContactProblem& problem, const Eigen::VectorXd& start, double tolerance,
                               ContactMemory& memory);

}  // namespace touchstone::fem
