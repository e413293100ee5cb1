#pragma once
// GetFEM beside us: runs bench/getfem_peer.py on a mesh of ours.

#include <filesystem>
#include <optional>
#include <string>

#include "fem/elements/elastic_material.h"
#include "fem/mesh/tet_mesh.h"

namespace touchstone::bench {

/// What the peer shall do; see getfem_peer.py.
struct PeerProblem {
  std::string element = "taylor_hood";  ///< or "p2", "p1"
  std::string load = "sphere";          ///< or "punch", "plate", "pressure"
  fem::ElasticMaterial material;
  double radius = 8.0;  ///< mm
  double depth = 0.3;   ///< mm
};

struct PeerResult {
  double force = 0.0;              ///< N
  double work = 0.0;               ///< N mm, of `pressure` only
  double peak_displacement = 0.0;  ///< mm
  int unknowns = 0;
  int newton_steps = 0;
  bool converged = false;
  double mesh_seconds = 0.0;       ///< its mesh and spaces, from arrays in memory
  double model_seconds = 0.0;      ///< gaps and coupling
  double assembly_seconds = 0.0;   ///< the first
  double newton_seconds = 0.0;     ///< with all later assemblies and factorisations
  double total_seconds = 0.0;      ///< of the four
  double factorise_seconds = 0.0;  ///< one factorisation and solve of its system, by itself
};

/// Why the peer can't be run here, or the empty string.
std::string why_no_peer();

/// Writes the mesh as getfem_peer.py reads it.
void write_peer_mesh(const fem::TetMesh& mesh, const std::filesystem::path& file);

/// Runs the peer in a process of its own, one BLAS thread. @throws Error if it fails, with what it said
PeerResult run_peer(const std::filesystem::path& mesh_file, const PeerProblem& problem);

}  // namespace touchstone::bench
