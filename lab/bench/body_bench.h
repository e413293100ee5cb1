#pragma once
// Drawn bodies pressed on a gel and on the same gel with 0.35 of its edges: how far forces and depths are off, and
// whether the error bars say so.
//
// Both meshes are pressed to the same depth, by the same contact: what is measured is the mesh's error, not that of
// linear elasticity. The force is compared at that depth; the depth at the force that the reference had there. An
// error counts as within two bars if it's at most twice the root of the sum of the squares of the gel's own bar and the
// reference's: their errors are independent (see fem/error/mesh_error.h), and of a body that is small beside the
// reference's edges the reference says little.
//
// The reference has one advantage more. Where a pattern stands out from its plate so far that the gel can't reach the
// plate, the reference presses it under a plate that is 2 mm farther away: the same problem, without what a near plate
// might do to the reference's own contact.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "lab/bench/body_draw.h"

namespace touchstone::lab {

/// Sets up trial_gels() and their references, with the tables of mesh errors of both; from the cache what is there. In
/// the quick form the reference takes its gel's own table: it goes by the contact's radius over the edge, as which it
/// differs little between two meshes of one gel.
/// @throws Error as sim::set_up_gel
std::vector<TrialGel> set_up_trials(bool quick, const std::filesystem::path& cache, const Progress& progress = {});

/// How far one figure is off. All relative to the reference's figure.
struct TrialError {
  double off = 0.0;            ///< above zero: too large
  double bar = 0.0;            ///< one standard error, as the gel's press says
  double reference_bar = 0.0;  ///< as the reference's press says

  double bars() const;  ///< |off| in bars of both
};

/// What one trial gave. Nothing of what couldn't be pressed.
struct TrialOutcome {
  std::optional<TrialError> force;  ///< the normal force at the trial's depth; above zero: too stiff
  std::optional<TrialError> depth;  ///< at the reference's force; above zero: too soft
  std::optional<TrialError> shear;  ///< the force along the surface, dragged by part of the depth; with friction only
  double reference_N = 0.0;         ///< the reference's force at that depth
  bool plate_lifted = false;        ///< the reference was pressed under a plate that is farther away
  int contact_vertices = 0;         ///< of the gel's own mesh
  double contact_area = 0.0;        ///< mm^2
  double largest_strain = 0.0;      ///< see fem::PressState
  std::string failure;              ///< of the gel's own press: the first error's message, and of what
  std::string reference_failure;    ///< of the reference's
  double seconds = 0.0;             ///< of the gel's own presses
  double reference_seconds = 0.0;
};

/// Presses one trial on both meshes. Doesn't throw what the press throws.
TrialOutcome run_trial(const BodyTrial& trial, const TrialGel& gel);

/// One kind of figure over some trials.
struct TrialSummary {
  int count = 0;              ///< that have the figure
  double median = 0.0;        ///< of |off|
  double percentile95 = 0.0;  ///< of |off|
  double middle = 0.0;        ///< the median of off with its sign
  double within = 0.0;        ///< the share within two bars
  double within_own = 0.0;    ///< the share within two of its own bars, as if the reference had none
};

/// Over those outcomes that have the figure; zeros if none has.
TrialSummary summarise(const std::vector<TrialOutcome>& outcomes, std::optional<TrialError> TrialOutcome::*figure);

}  // namespace touchstone::lab
