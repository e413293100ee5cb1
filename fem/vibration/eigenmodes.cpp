#include "fem/vibration/eigenmodes.h"

#include <Spectra/SymGEigsShiftSolver.h>

#include <cmath>
#include <optional>
#include <vector>

#include "core/error.h"
#include "fem/elements/elimination_order.h"
#include "fem/elements/quadrature.h"
#include "fem/elements/schur_solver.h"
#include "fem/elements/surface_coupling.h"

namespace touchstone::fem {
namespace {

constexpr double kTolerance = 1e-11;  // of an eigenvalue, relative
constexpr int kMostRestarts = 300;
constexpr int kTries = 3;           // each with twice the Lanczos vectors
constexpr double kOneValue = 1e-6;  // eigenvalues closer than this are taken as one multiple value

/// The eigenproblem without units: stiffness as make_scales, mass over rho length^3.
struct Problem {
  SymmetricEntries stiffness;        // mixed, with the rows of what is held last
  std::vector<int> order;            // of elimination
  std::vector<int> unknowns;         // per free displacement: its place in the mixed system
  Eigen::SparseMatrix<double> mass;  // over the free displacements
};

Problem make_problem(const TaylorHoodSpace& space, const Scales& scales, std::span<const int> held) {
  Problem problem;
  problem.stiffness = assemble(space, scales);
  problem.order = elimination_order(space);
  if (!held.empty()) {
    const OuterSurface surface = outer_surface(*space.mesh);
    const Eigen::SparseMatrix<double, Eigen::RowMajor> coupling = surface_coupling(space, surface);
    const double edge = 1.0 / std::sqrt(static_cast<double>(space.mesh->outer.size()));
    const double scale = 1.0 / (scales.length * scales.length * edge);
    int next = space.unknowns;
    for (const int vertex : held) {
      TS_ASSERT(vertex >= 0 && vertex < coupling.rows());
      if (space.clamped[surface.mesh_vertex[vertex]]) continue;  // on the bonded rim: its hat may reach no free node
      for (int a = 0; a < 3; ++a, ++next) {
        for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(coupling, vertex); entry; ++entry) {
          const int node = static_cast<int>(entry.col());
          if (!space.clamped[node]) {
            problem.stiffness.add(space.displacement[node] + a, next, scale * entry.value());
          }
        }
        problem.order.push_back(next);
      }
    }
    problem.stiffness.size = next;
  }
  std::vector<int> place(space.nodes, -1);  // of a node's first free displacement
  for (int node = 0; node < space.nodes; ++node) {
    if (space.clamped[node]) continue;
    place[node] = static_cast<int>(problem.unknowns.size());
    for (int a = 0; a < 3; ++a) problem.unknowns.push_back(space.displacement[node] + a);
  }
  const Eigen::SparseMatrix<double> nodal = volume_mass(space);
  std::vector<Eigen::Triplet<double>> entries;
  for (int node = 0; node < space.nodes; ++node) {
    if (place[node] < 0) continue;
    for (Eigen::SparseMatrix<double>::InnerIterator entry(nodal, node); entry; ++entry) {
      const int other = place[entry.row()];
      for (int a = 0; other >= 0 && a < 3; ++a) {
        entries.emplace_back(other + a, place[node] + a, entry.value() / std::pow(scales.length, 3));
      }
    }
  }
  const auto size = static_cast<Eigen::Index>(problem.unknowns.size());
  problem.mass.resize(size, size);
  problem.mass.setFromTriplets(entries.begin(), entries.end());
  return problem;
}

/// What Spectra calls A^-1: the displacement part of the mixed system's answer to a load on displacements.
class InverseStiffness {
 public:
  using Scalar = double;
  InverseStiffness(const SymmetricFactor& factor, const std::vector<int>& unknowns)
      : factor_(factor), unknowns_(unknowns) {}

  Eigen::Index rows() const { return static_cast<Eigen::Index>(unknowns_.size()); }
  Eigen::Index cols() const { return rows(); }
  void set_shift(double shift) { TS_ASSERT(shift == 0.0); }
  void perform_op(const double* in, double* out) const {
    Eigen::VectorXd load = Eigen::VectorXd::Zero(factor_.size());
    for (std::size_t k = 0; k < unknowns_.size(); ++k) load[unknowns_[k]] = in[k];
    const Eigen::VectorXd answer = factor_.solve(std::move(load));
    for (std::size_t k = 0; k < unknowns_.size(); ++k) out[k] = answer[unknowns_[k]];
    ++solves_;
  }
  int solves() const { return solves_; }

 private:
  const SymmetricFactor& factor_;
  const std::vector<int>& unknowns_;
  mutable int solves_ = 0;
};

class MassProduct {
 public:
  using Scalar = double;
  explicit MassProduct(const Eigen::SparseMatrix<double>& mass) : mass_(mass) {}
  Eigen::Index rows() const { return mass_.rows(); }
  Eigen::Index cols() const { return mass_.cols(); }
  void perform_op(const double* in, double* out) const {
    Eigen::Map<Eigen::VectorXd>(out, rows()).noalias() = mass_ * Eigen::Map<const Eigen::VectorXd>(in, rows());
  }

 private:
  const Eigen::SparseMatrix<double>& mass_;
};

/// Negative pivots of the mixed system K - shift M: those of the constraints and one for each mode below the shift.
int negative_pivots(const Problem& problem, double shift) {
  SymmetricEntries matrix = problem.stiffness;
  for (int column = 0; column < problem.mass.outerSize(); ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator entry(problem.mass, column); entry; ++entry) {
      const int row = static_cast<int>(entry.row());
      if (row <= column) matrix.add(problem.unknowns[row], problem.unknowns[column], -shift * entry.value());
    }
  }
  FactorReport report;
  const SymmetricFactor factor(matrix, problem.order, &report);
  return report.negative_pivots;
}

struct Found {
  Eigen::VectorXd values;  // rising
  Eigen::MatrixXd vectors;
};

}  // namespace

Eigen::SparseMatrix<double> volume_mass(const TaylorHoodSpace& space) {
  Eigen::Matrix<double, 10, 10> unit = Eigen::Matrix<double, 10, 10>::Zero();
  for (const auto& point : tetrahedron_rule(4)) {
    const auto shape = quadratic_shape(point.barycentric);
    unit += point.weight * shape * shape.transpose();
  }
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(100 * space.elements.size());
  for (std::size_t e = 0; e < space.elements.size(); ++e) {
    const double size = volume(*space.mesh, space.mesh->tetrahedra[e]);
    for (int i = 0; i < 10; ++i) {
      for (int j = 0; j < 10; ++j) entries.emplace_back(space.elements[e][i], space.elements[e][j], size * unit(i, j));
    }
  }
  Eigen::SparseMatrix<double> mass(space.nodes, space.nodes);
  mass.setFromTriplets(entries.begin(), entries.end());
  return mass;
}

Eigenmodes lowest_eigenmodes(const TaylorHoodSpace& space, const ElasticMaterial& material, double density, int count,
                             std::span<const int> held) {
  const std::vector<ElasticMaterial> materials(static_cast<std::size_t>(region_count(*space.mesh)), material);
  return lowest_eigenmodes(space, materials, density, count, held);
}

Eigenmodes lowest_eigenmodes(const TaylorHoodSpace& space, std::span<const ElasticMaterial> materials, double density,
                             int count, std::span<const int> held) {
  for (const ElasticMaterial& material : materials) check(material);
  if (!std::isfinite(density) || density <= 0.0) {
    fail("the gel's density is {} tonne/mm^3; it must be finite and above zero", density);
  }
  const Scales scales = make_scales(*space.mesh, materials);
  const Problem problem = make_problem(space, scales, held);
  const auto size = static_cast<Eigen::Index>(problem.unknowns.size());
  if (count < 1 || 5 * static_cast<Eigen::Index>(count) > size) {
    fail("{} eigenmodes are wanted; a mesh with {} unknown displacements allows from 1 to {}", count, size, size / 5);
  }
  Eigenmodes modes;
  std::optional<Found> found;
  int constraints = 0;
  // A few more than wanted, so that a gap between two values can be found above the last one.
  const Eigen::Index wanted = std::min<Eigen::Index>(count + 4, size - 1);
  for (int attempt = 0; attempt < kTries && !found; ++attempt) {
    Found next;
    {
      FactorReport report;
      const SymmetricFactor factor(problem.stiffness, problem.order, &report);
      constraints = report.negative_pivots;
      InverseStiffness inverse(factor, problem.unknowns);
      MassProduct mass(problem.mass);
      const Eigen::Index basis = std::min<Eigen::Index>(size, (2 * wanted + 20) << attempt);
      Spectra::SymGEigsShiftSolver<InverseStiffness, MassProduct, Spectra::GEigsMode::ShiftInvert> solver(
          inverse, mass, wanted, basis, 0.0);
      solver.init();
      solver.compute(Spectra::SortRule::LargestMagn, kMostRestarts, kTolerance, Spectra::SortRule::SmallestAlge);
      modes.solves += inverse.solves();
      if (solver.info() != Spectra::CompInfo::Successful) continue;
      next.values = solver.eigenvalues();
      next.vectors = solver.eigenvectors();
    }
    // Between two values of which the lower one is at least the last that is wanted.
    Eigen::Index below = count;
    while (below < wanted && next.values[below] - next.values[below - 1] < kOneValue * next.values[below]) ++below;
    if (below == wanted) continue;
    const double shift = 0.5 * (next.values[below - 1] + next.values[below]);
    if (negative_pivots(problem, shift) - constraints == below) found = std::move(next);
  }
  if (!found) fail("the gel's {} lowest eigenmodes couldn't be found: Lanczos' iteration missed some", count);

  const double unit = scales.stress / (density * scales.length * scales.length);
  modes.angular_frequency = (found->values.head(count) * unit).cwiseSqrt();
  modes.displacement = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(space.nodes), count);
  Eigen::Index row = 0;
  for (int node = 0; node < space.nodes; ++node) {
    if (space.clamped[node]) continue;
    modes.displacement.middleRows<3>(3 * node) = found->vectors.block(row, 0, 3, count);
    row += 3;
  }
  for (int k = 0; k < count; ++k) {
    const Eigen::VectorXd u = found->vectors.col(k);
    modes.displacement.col(k) /= std::sqrt(u.dot(problem.mass * u) * density * std::pow(scales.length, 3));
  }
  return modes;
}

}  // namespace touchstone::fem
