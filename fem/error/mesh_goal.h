#pragma once
// A mesh found by the error that it may make.

#include <functional>

#include "core/progress.h"
#include "fem/elements/compliance.h"
#include "fem/error/mesh_error.h"

namespace touchstone::fem {

/// How far the force of one press may be off.
struct ErrorGoal {
  double force_error = 0.01;    ///< relative, one standard error (see fem/error/mesh_error.h)
  double contact_radius = 1.0;  ///< mm: of contacts of this radius or larger
  bool sharp_bodies = false;    ///< of bodies with sharp edges, too; they take far finer meshes
};

/// A gel whose edges are still to be chosen.
struct GelOfEdge {
  double coarsest = 0.0;                        ///< mm: edges to begin with
  std::function<void(double edge)> check;       ///< cheap; @throws Error if the gel can't be had with such edges
  std::function<Compliance(double edge)> make;  ///< without mesh_error; @throws Error
  std::function<LadderGel(double edge)> ladder;
};

/// The gel with the coarsest edges whose measured error is within the goal, with its mesh_error, and report.fine_edge
/// telling the edge. Edges are tried from the coarsest on, each 2^(1/4) finer than the last or as much finer as the
/// observed order asks for, so that most time goes into the gel that is returned. The same input gives the same gel.
/// @throws Error if the goal isn't allowed, or if no mesh within the limits meets it: it says what can be had
Compliance gel_within(const ErrorGoal& goal, const GelOfEdge& gel, const Progress& progress = {});

/// @throws Error if the goal's numbers aren't finite and above zero, or the error not below 1
void check(const ErrorGoal& goal);

}  // namespace touchstone::fem
