#include "fem/finite_strain/finite_system.h"

namespace touchstone::fem {
namespace {

using RowSparse = Eigen::SparseMatrix<double, Eigen::RowMajor>;

}  // namespace

double force_scale(const FiniteGel& gel) {
  const Scales& scales = gel.problem.scales();
  return scales.stress * scales.length * scales.length;
}

Eigen::VectorXd over_unknowns(const FiniteGel& gel, const Eigen::MatrixX3d& nodal) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(gel.space.unknowns);
  for (int node = 0; node < gel.space.nodes; ++node) {
    if (!gel.space.clamped[node]) {
      result.segment<3>(gel.space.displacement[node]) = nodal.row(node).transpose() / force_scale(gel);
    }
  }
  return result;
}

LawRows law_rows(const FiniteGel& gel, const DeformedGap& gap, const std::vector<Eigen::Matrix3d>& axes,
                 const std::vector<int>& block, int components, const std::vector<int>& forced) {
  const TaylorHoodSpace& space = gel.space;
  const auto c = static_cast<std::size_t>(components);
  LawRows laws;
  laws.inner = space.unknowns + static_cast<int>(forced.size());
  laws.rows.resize(c * block.size() + forced.size());
  for (std::size_t b = 0; b < forced.size(); ++b) {
    laws.rows[c * block.size() + b].emplace_back(space.unknowns + static_cast<int>(b), 1.0);
  }
  for (std::size_t j = 0; j < block.size(); ++j) {
    const int v = block[j];
    LawRow* row = &laws.rows[c * j];
    for (RowSparse::InnerIterator it(gap.gradient, v); it; ++it) {
      const int node = static_cast<int>(it.col() / 3);
      if (space.clamped[node]) continue;
      row[0].emplace_back(space.displacement[node] + static_cast<int>(it.col() % 3), it.value());
    }
    for (RowSparse::InnerIterator it(gel.coupling, v); components == 3 && it; ++it) {
      const int node = static_cast<int>(it.col());
      if (space.clamped[node]) continue;
      for (int t = 1; t < 3; ++t) {
        for (int a = 0; a < 3; ++a) row[t].emplace_back(space.displacement[node] + a, it.value() * axes[v](a, t));
      }
    }
    for (std::size_t b = 0; b < forced.size(); ++b) {
      const int shift = space.unknowns + static_cast<int>(b);
      const int a = forced[b];
      row[0].emplace_back(shift, -gap.direction(v, a));
      for (int t = 1; t < components; ++t) row[t].emplace_back(shift, -gel.rest.weight[v] * axes[v](a, t));
    }
  }
  return laws;
}

void add_square(const LawRow& row, double factor, SymmetricEntries& matrix) {
  for (const auto& [i, x] : row) {
    for (const auto& [j, y] : row) {
      if (j >= i) matrix.add(i, j, factor * x * y);
    }
  }
}

void add_contact_stiffness(const FiniteGel& gel, const DeformedGap& gap, const std::vector<int>& forced,
                           SymmetricEntries& matrix) {
  const TaylorHoodSpace& space = gel.space;
  const double unit = gel.problem.scales().length / force_scale(gel);
  const auto unknown = [&](Eigen::Index place) {
    const auto node = static_cast<int>(place / 3);
    return space.clamped[node] ? -1 : space.displacement[node] + static_cast<int>(place % 3);
  };
  for (Eigen::Index column = 0; column < gap.curvature.outerSize(); ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(gap.curvature, column); it; ++it) {
      const int i = unknown(it.row());
      const int j = unknown(it.col());
      const double value = unit * it.value();
      if (i >= 0 && j >= i) matrix.add(i, j, -value);
      for (int b = 0; b < static_cast<int>(forced.size()); ++b) {
        if (forced[b] != it.col() % 3) continue;
        if (i >= 0) matrix.add(i, space.unknowns + b, value);
        for (int a = 0; a <= b; ++a) {
          if (forced[a] == it.row() % 3) matrix.add(space.unknowns + a, space.unknowns + b, -value);
        }
      }
    }
  }
  for (const EdgeBulge& bulge : gap.bulges) {
    LawRow row;
    for (int i = 0; i < 9; ++i) {
      const int node = bulge.nodes[i / 3];
      if (!space.clamped[node]) row.emplace_back(space.displacement[node] + i % 3, bulge.gradient[i / 3][i % 3]);
    }
    for (std::size_t b = 0; b < forced.size(); ++b) {
      const int a = forced[b];
      row.emplace_back(space.unknowns + static_cast<int>(b),
                       -(bulge.gradient[0][a] + bulge.gradient[1][a] + bulge.gradient[2][a]));
    }
    add_square(row, unit * bulge.stiffness, matrix);
  }
}

}  // namespace touchstone::fem
