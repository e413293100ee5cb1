#include "fem/finite_strain/finite_tangent.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "fem/finite_strain/finite_system.h"

namespace touchstone::fem {
namespace {

constexpr double kHold = 1000.0;  // over the surface's own stiffness
/// Of the gel's own: what an object led by force has as stiffness of its own, so that the tangent isn't singular before
/// its laws are added. It is taken away again where contact holds the object, by dense algebra: with little of it in
/// the factor the pose would be as uncertain as single precision over it, with much of it left each step would fall
/// short.
constexpr double kShiftStiffness = 0.1;
constexpr double kShiftLeft = 1e-4;  // for axes along which all slips

/// The gel's tree with the led axes above it.
EliminationTree with_led_axes(EliminationTree tree, int first, int end) {
  if (first == end) return tree;
  const int top = static_cast<int>(tree.parent.size());
  for (int& parent : tree.parent) {
    if (parent < 0) parent = top;
  }
  for (int i = first; i < end; ++i) tree.order.push_back(i);
  tree.end.push_back(static_cast<int>(tree.order.size()));
  tree.parent.push_back(-1);
  return tree;
}

}  // namespace

FiniteTangent finite_tangent(const FiniteGel& gel, const FiniteSnapshot& at, const std::vector<Eigen::Matrix3d>& axes,
                             std::vector<int> block, int components, std::vector<LedAxis> led) {
  const Scales& scales = gel.problem.scales();
  const LawRows laws = law_rows(gel, at, axes, block, components, led);
  SymmetricEntries matrix = gel.problem.tangent(at.elastic);
  add_contact_stiffness(gel, at, led, matrix);
  for (int i = gel.space.unknowns; i < laws.inner; ++i) matrix.add(i, i, kShiftStiffness);
  // The border is scaled to be of the order of one beside the elements' blocks, as in compute_compliance.
  const double border = std::sqrt(static_cast<double>(gel.mesh.outer.size())) / (scales.length * scales.length);
  for (std::size_t r = 0; r < laws.rows.size(); ++r) {
    for (const auto& [i, x] : laws.rows[r]) matrix.add(i, laws.inner + static_cast<int>(r), border * x);
  }
  const auto last = static_cast<int>(laws.rows.size());
  matrix.size = laws.inner + last;
  std::optional<FrontalFactor> factor =
      FrontalFactor::make(matrix, last, with_led_axes(gel.tree, gel.space.unknowns, laws.inner));
  if (!factor) fail("the gel's tangent is singular");
  Eigen::MatrixXd compliance = factor->complement() * (-scales.length / force_scale(gel) / (border * border));
  return {std::move(block), std::move(led), components, std::move(compliance),
          std::make_shared<const FrontalFactor>(std::move(*factor))};
}

FiniteTangent with_vertices(const FiniteTangent& tangent, const FiniteGel& gel, const FiniteSnapshot& at,
                            const std::vector<Eigen::Matrix3d>& axes, const std::vector<int>& more) {
  const int c = tangent.components;
  FiniteTangent wider{{}, tangent.led, c, {}, tangent.factor};
  std::vector<int> rows_before;  // of the block, and where they are in the wider one
  std::vector<int> rows_kept;
  for (std::size_t j = 0; j < tangent.block.size(); ++j) {
    if (!std::isfinite(at.gap.weighted[tangent.block[j]])) continue;
    wider.block.push_back(tangent.block[j]);
    for (int t = 0; t < c; ++t) rows_before.push_back(c * static_cast<int>(j) + t);
  }
  const auto shifts = static_cast<int>(tangent.led.size());
  for (int b = 0; b < shifts; ++b) rows_before.push_back(c * static_cast<int>(tangent.block.size()) + b);
  wider.block.insert(wider.block.end(), more.begin(), more.end());
  std::sort(wider.block.begin(), wider.block.end());
  wider.block.erase(std::unique(wider.block.begin(), wider.block.end()), wider.block.end());
  std::vector<int> rows_new;
  for (std::size_t j = 0; j < wider.block.size(); ++j) {
    const bool known = std::binary_search(tangent.block.begin(), tangent.block.end(), wider.block[j]);
    for (int t = 0; t < c; ++t) (known ? rows_kept : rows_new).push_back(c * static_cast<int>(j) + t);
  }
  for (int b = 0; b < shifts; ++b) rows_kept.push_back(c * static_cast<int>(wider.block.size()) + b);
  const LawRows laws = law_rows(gel, at, axes, wider.block, c, tangent.led);
  Eigen::MatrixXd loads = Eigen::MatrixXd::Zero(laws.inner, std::ssize(rows_new));
  for (std::size_t k = 0; k < rows_new.size(); ++k) {
    for (const auto& [i, x] : laws.rows[static_cast<std::size_t>(rows_new[k])]) {
      loads(i, static_cast<Eigen::Index>(k)) += x;
    }
  }
  const Eigen::MatrixXd moved = tangent.factor->solve(loads) * (gel.problem.scales().length / force_scale(gel));
  wider.compliance = Eigen::MatrixXd::Zero(std::ssize(laws.rows), std::ssize(laws.rows));
  wider.compliance(rows_kept, rows_kept) = tangent.compliance(rows_before, rows_before);
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(std::ssize(laws.rows), std::ssize(rows_new));
  for (std::size_t r = 0; r < laws.rows.size(); ++r) {
    for (const auto& [i, x] : laws.rows[r]) columns.row(static_cast<Eigen::Index>(r)) += x * moved.row(i);
  }
  const Eigen::MatrixXd corner = columns(rows_new, Eigen::all);
  columns(rows_new, Eigen::all) = 0.5 * (corner + corner.transpose());
  wider.compliance(Eigen::all, rows_new) = columns;
  wider.compliance(rows_new, Eigen::all) = columns.transpose();
  return wider;
}

double hold_stiffness(const FiniteGel& gel, int vertex) {
  return kHold * gel.problem.scales().stress / std::pow(gel.rest.weight[vertex], 1.5);
}

double shift_release(const FiniteGel& gel) {
  return -(kShiftStiffness - kShiftLeft) * force_scale(gel) / gel.problem.scales().length;
}

ContactLaws held_stiffly(const ContactLaws& laws, const std::vector<int>& held, const Eigen::VectorXd& stiffness) {
  if (held.empty()) return laws;
  // The compliance S of T becomes that of T + B^T k B, B being the held rows: S - S_H (1/k + S_HH)^-1 S_H^T.
  const Eigen::MatrixXd columns = laws.compliance(Eigen::all, held);
  Eigen::MatrixXd inner = columns(held, Eigen::all);
  inner.diagonal() += stiffness.cwiseInverse();
  const Eigen::PartialPivLU<Eigen::MatrixXd> factor(inner);
  const Eigen::MatrixXd taken = factor.solve(columns.transpose());
  ContactLaws stiff{laws.compliance - columns * taken, laws.ahead - taken.transpose() * laws.ahead(held)};
  stiff.compliance = 0.5 * (stiff.compliance + stiff.compliance.transpose()).eval();
  return stiff;
}

}  // namespace touchstone::fem
