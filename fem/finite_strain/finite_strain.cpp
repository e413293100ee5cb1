#include "fem/finite_strain/finite_strain.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "fem/elements/elimination_order.h"
#include "fem/elements/quadrature.h"

namespace touchstone::fem {
namespace {

constexpr int kPoints = 14;
constexpr double kConverged = 1e-10;
constexpr int kMostNewton = 25;
constexpr int kMostBacktracks = 6;
constexpr double kSmallestPart = 1.0 / 512.0;  // of the load
constexpr double kLeastShrink = 0.1;           // of the least J in one Newton step

/// Gradients (over the length scale) of the shape functions at the points of symmetric_tetrahedron_rule.
using ElementGradients = std::array<Eigen::Matrix<double, 3, 10>, kPoints>;

}  // namespace

/// What one element's blocks need at each point.
struct FiniteStrain::ElementState {
  NeoHookean material;
  ElementGradients gradients;                        // over the undeformed mesh
  std::array<Eigen::Matrix3d, kPoints> to_deformed;  // F^-T
  std::array<double, kPoints> volume_ratio{};        // J
  std::array<double, kPoints> q{};                   // pressure unknown
  std::array<double, kPoints> weight{};
  std::array<Eigen::Matrix3d, kPoints> deformation;  // F
};

FiniteStrain::FiniteStrain(const TaylorHoodSpace& space, std::span<const ElasticMaterial> materials)
    : space_(space), scales_(make_scales(*space.mesh, materials)) {
  TS_ASSERT(symmetric_tetrahedron_rule().size() == kPoints);
}

FiniteStrain::FiniteStrain(const TaylorHoodSpace& space, const ElasticMaterial& material)
    : FiniteStrain(space, std::vector<ElasticMaterial>(region_count(*space.mesh), material)) {}

ElasticSolution FiniteStrain::at_rest() const {
  return {Eigen::MatrixX3d::Zero(space_.nodes, 3),
          Eigen::VectorXd::Zero(static_cast<Eigen::Index>(space_.pressure.size()))};
}

FiniteStrain::ElementState FiniteStrain::element_state(const ElasticSolution& state, int element) const {
  const TetMesh& mesh = *space_.mesh;
  const auto& rule = symmetric_tetrahedron_rule();
  ElementState result;
  const std::array<int, 10>& nodes = space_.elements[element];
  result.material = scales_.regions[mesh.region_of(element)];
  std::array<Eigen::Vector3d, 4> corners;
  for (int k = 0; k < 4; ++k) {
    corners[k] = mesh.vertices[mesh.tetrahedra[element][k]];
  }
  Eigen::Matrix<double, 3, 10> displacement;
  Eigen::Vector4d q;
  for (int k = 0; k < 10; ++k) {
    displacement.col(k) = state.displacement.row(nodes[k]).transpose() / scales_.length;
  }
  // The scale is zero where there's no pressure at all (nu = 0).
  const double per_unknown = scales_.stress * result.material.pressure_scale;
  for (int k = 0; k < 4; ++k) {
    q[k] = per_unknown > 0.0 ? state.pressure[space_.element_pressures[element][k]] / per_unknown : 0.0;
  }
  const double size = volume(mesh, mesh.tetrahedra[element]) / std::pow(scales_.length, 3);
  for (int i = 0; i < kPoints; ++i) {
    result.gradients[i] = scales_.length * quadratic_gradients(corners, rule[i].barycentric);
    result.deformation[i] = Eigen::Matrix3d::Identity() + displacement * result.gradients[i].transpose();
    result.volume_ratio[i] = result.deformation[i].determinant();
    result.to_deformed[i] = result.deformation[i].inverse().transpose();
    result.q[i] = q.dot(rule[i].barycentric);
    result.weight[i] = rule[i].weight * size;
  }
  return result;
}

/// Coupling of one of an element's nodes (rows: displacement 0..2, pressure 3) with the wanted ones of all ten
/// (columns). With G a shape
/// function's gradient and g = F^-T G: shear (G_i . G_j) I + (shear + s q J) g_j g_i^T - s q J g_i g_j^T, and -s J N g.
ElementRow FiniteStrain::element_row(const ElementState& state, int node, const std::array<bool, 10>& wanted) const {
  const NeoHookean& material = state.material;
  const auto& rule = symmetric_tetrahedron_rule();
  ElementRow row;
  row.fill(Eigen::Matrix4d::Zero());
  for (int point = 0; point < kPoints; ++point) {
    const double weight = state.weight[point];
    const double scale = weight * material.pressure_scale * state.volume_ratio[point];
    const double pressure = scale * state.q[point];
    const Eigen::Matrix<double, 3, 10> deformed = state.to_deformed[point] * state.gradients[point];
    const Eigen::Vector3d own = deformed.col(node);
    const Eigen::Vector3d own_flat = (weight * material.shear) * state.gradients[point].col(node);
    const Eigen::Vector4d& linear = rule[point].barycentric;
    for (int j = 0; j < 10; ++j) {
      if (!wanted[j]) {
        continue;
      }
      const Eigen::Vector3d other = deformed.col(j);
      Eigen::Matrix4d& block = row[j];
      block.topLeftCorner<3, 3>().noalias() += other * ((weight * material.shear + pressure) * own.transpose());
      block.topLeftCorner<3, 3>().noalias() -= own * (pressure * other.transpose());
      block.diagonal().head<3>().array() += own_flat.dot(state.gradients[point].col(j));
      if (node < 4) {
        block.bottomLeftCorner<1, 3>() -= (scale * linear[node]) * other.transpose();
      }
      if (j < 4) {
        block.topRightCorner<3, 1>() -= (scale * linear[j]) * own;
      }
      if (node < 4 && j < 4) {
        block(3, 3) -= weight * material.compressibility * linear[node] * linear[j];
      }
    }
  }
  return row;
}

double FiniteStrain::stored_energy(const ElasticSolution& state) const {
  std::vector<double> parts(space_.elements.size());
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t e) {
    const ElementState element = element_state(state, static_cast<int>(e));
    for (int i = 0; i < kPoints; ++i) {
      parts[e] += element.weight[i] * energy(element.material, element.deformation[i], element.q[i]);
    }
  });
  double sum = 0.0;
  for (const double part : parts) {
    sum += part;
  }
  return sum * scales_.stress * std::pow(scales_.length, 3);
}

double FiniteStrain::smallest_volume_ratio(const ElasticSolution& state) const {
  std::vector<double> least(space_.elements.size());
  tbb::parallel_for(std::size_t{0}, least.size(), [&](std::size_t e) {
    const ElementState element = element_state(state, static_cast<int>(e));
    least[e] = *std::min_element(element.volume_ratio.begin(), element.volume_ratio.end());
  });
  double smallest = std::numeric_limits<double>::infinity();
  for (const double value : least) {
    smallest = std::isfinite(value) ? std::min(smallest, value) : -std::numeric_limits<double>::infinity();
  }
  return smallest;
}

FiniteStrain::Residual FiniteStrain::residual(const ElasticSolution& state) const {
  const auto& rule = symmetric_tetrahedron_rule();
  std::vector<Eigen::Matrix<double, 4, 10>> forces(space_.elements.size());
  tbb::parallel_for(std::size_t{0}, forces.size(), [&](std::size_t e) {
    const ElementState element = element_state(state, static_cast<int>(e));
    forces[e].setZero();
    for (int i = 0; i < kPoints; ++i) {
      const NeoHookeanStress at = stress(element.material, element.deformation[i], element.q[i]);
      forces[e].topRows<3>() += element.weight[i] * at.stress * element.gradients[i];
      forces[e].bottomLeftCorner<1, 4>() += (element.weight[i] * at.volume) * rule[i].barycentric.transpose();
    }
  });
  Residual result;
  result.values = Eigen::VectorXd::Zero(space_.unknowns);
  double square = 0.0;
  for (std::size_t e = 0; e < forces.size(); ++e) {
    square += forces[e].squaredNorm();
    for (int k = 0; k < 10; ++k) {
      const int node = space_.elements[e][k];
      if (!space_.clamped[node]) {
        result.values.segment<3>(space_.displacement[node]) += forces[e].col(k).head<3>();
      }
      if (k < 4) {
        result.values[space_.pressure[space_.element_pressures[e][k]]] += forces[e](3, k);
      }
    }
  }
  result.scale = std::sqrt(square);
  return result;
}

SymmetricEntries FiniteStrain::tangent(const ElasticSolution& state) const {
  std::vector<ElementState> elements(space_.elements.size());
  tbb::parallel_for(std::size_t{0}, elements.size(),
                    [&](std::size_t e) { elements[e] = element_state(state, static_cast<int>(e)); });
  return assemble_rows(space_, [&](int element, int node, const std::array<bool, 10>& wanted) {
    return element_row(elements[element], node, wanted);
  });
}

Eigen::VectorXd FiniteStrain::clamped_pull(const ElasticSolution& state, const Eigen::MatrixX3d& change) const {
  Eigen::VectorXd pull = Eigen::VectorXd::Zero(space_.unknowns);
  for (std::size_t e = 0; e < space_.elements.size(); ++e) {
    const auto& nodes = space_.elements[e];
    if (std::none_of(nodes.begin(), nodes.end(), [&](int node) { return space_.clamped[node] != 0; })) {
      continue;
    }
    const ElementState element = element_state(state, static_cast<int>(e));
    std::array<bool, 10> wanted{};
    std::transform(nodes.begin(), nodes.end(), wanted.begin(), [&](int node) { return space_.clamped[node] != 0; });
    for (int j = 0; j < 10; ++j) {
      const ElementRow row = element_row(element, j, wanted);
      Eigen::Vector4d sum = Eigen::Vector4d::Zero();
      for (int k = 0; k < 10; ++k) {
        if (space_.clamped[nodes[k]]) {
          sum += row[k].leftCols<3>() * change.row(nodes[k]).transpose() / scales_.length;
        }
      }
      if (!space_.clamped[nodes[j]]) {
        pull.segment<3>(space_.displacement[nodes[j]]) += sum.head<3>();
      }
      if (j < 4) {
        pull[space_.pressure[space_.element_pressures[e][j]]] += sum[3];
      }
    }
  }
  return pull;
}

ElasticSolution FiniteStrain::moved(const ElasticSolution& state, const Eigen::VectorXd& change, double factor) const {
  ElasticSolution result = state;
  for (int node = 0; node < space_.nodes; ++node) {
    if (!space_.clamped[node]) {
      result.displacement.row(node) +=
          factor * scales_.length * change.segment<3>(space_.displacement[node]).transpose();
    }
  }
  // A pressure's scale is that of its region.
  for (std::size_t e = 0; e < space_.elements.size(); ++e) {
    const double unit = scales_.stress * scales_.regions[space_.mesh->region_of(e)].pressure_scale;
    for (const int pressure : space_.element_pressures[e]) {
      result.pressure[pressure] = state.pressure[pressure] + factor * unit * change[space_.pressure[pressure]];
    }
  }
  return result;
}

namespace {

/// Newton's method towards fixed loads.
class NewtonPath {
 public:
  NewtonPath(const TaylorHoodSpace& space, std::span<const ElasticMaterial> materials, const ElasticLoads& loads)
      : problem_(space, materials),
        order_(elimination_order(space)),
        load_(load_vector(space, problem_.scales(), loads)),
        given_(Eigen::MatrixX3d::Zero(space.nodes, 3)) {
    for (int node = 0; loads.bonded_displacement && node < space.nodes; ++node) {
      if (space.clamped[node]) {
        given_.row(node) = loads.bonded_displacement(space.position(node)).transpose();
      }
    }
  }

  const FiniteStrain& problem() const { return problem_; }
  const std::string& why_not() const { return why_not_; }

  /// True if `state` has become the solution at `share` of the loads.
  bool solve(double share, ElasticSolution& state, FiniteStrainEffort& effort) {
    effort.residuals.clear();
    FiniteStrain::Residual now = against(share, state);
    double least = problem_.smallest_volume_ratio(state);
    for (int iteration = 0; iteration <= kMostNewton; ++iteration) {
      const double size = now.values.norm();
      effort.residuals.push_back(now.scale > 0.0 ? size / now.scale : size);
      const Eigen::MatrixX3d missing = clamped_missing(share, state);
      const bool arrived = missing.isZero(0.0);
      if (arrived && size <= kConverged * std::max(now.scale, load_.norm() * share)) {
        return true;
      }
      if (iteration == kMostNewton) {
        break;
      }
      Eigen::VectorXd right = -now.values;
      if (!arrived) {
        right -= problem_.clamped_pull(state, missing);
      }
      Eigen::VectorXd change;
      ++effort.iterations;
      try {
        change = solve_symmetric(problem_.tangent(state), order_, right);
      } catch (const Error& error) {
        why_not_ = error.what();
        return false;
      }
      double factor = 1.0;
      int tries = 0;
      for (;; factor *= 0.5, ++tries) {
        if (tries > kMostBacktracks) {
          return false;
        }
        ElasticSolution next = problem_.moved(state, change, factor);
        next.displacement += factor * missing;
        if (factor == 1.0 && !arrived) {
          place_clamped(share, next);
        }
        const double ratio = problem_.smallest_volume_ratio(next);
        if (!(ratio > kLeastShrink * least)) {
          why_not_ = fmt::format("a tetrahedron turns inside out (its volume falls to {:.2g} of what it was)", ratio);
          continue;
        }
        const FiniteStrain::Residual then = against(share, next);
        if (arrived && !(then.values.norm() < size)) {
          why_not_ = fmt::format("Newton's method stalls at a residual of {:.2g} of the elements' forces",
                                 size / std::max(now.scale, 1e-300));
          if (size <= 1e3 * kConverged * now.scale) {
            return true;  // rounding is all that's left
          }
          continue;
        }
        state = std::move(next);
        now = then;
        least = ratio;
        break;
      }
    }
    why_not_ = fmt::format("Newton's method isn't there after {} steps", kMostNewton);
    return false;
  }

 private:
  FiniteStrain::Residual against(double share, const ElasticSolution& state) const {
    FiniteStrain::Residual result = problem_.residual(state);
    result.values -= share * load_;
    return result;
  }

  Eigen::MatrixX3d clamped_missing(double share, const ElasticSolution& state) const {
    Eigen::MatrixX3d missing = Eigen::MatrixX3d::Zero(given_.rows(), 3);
    for (int node = 0; node < problem_.space().nodes; ++node) {
      if (problem_.space().clamped[node]) {
        missing.row(node) = share * given_.row(node) - state.displacement.row(node);
      }
    }
    return missing;
  }

  void place_clamped(double share, ElasticSolution& state) const {
    for (int node = 0; node < problem_.space().nodes; ++node) {
      if (problem_.space().clamped[node]) {
        state.displacement.row(node) = share * given_.row(node);
      }
    }
  }

  FiniteStrain problem_;
  std::vector<int> order_;
  Eigen::VectorXd load_;
  Eigen::MatrixX3d given_;
  std::string why_not_;
};

}  // namespace

ElasticSolution solve_finite_strain(const TaylorHoodSpace& space, const ElasticMaterial& material,
                                    const ElasticLoads& loads, FiniteStrainEffort* effort) {
  return solve_finite_strain(space, std::vector<ElasticMaterial>(region_count(*space.mesh), material), loads, effort);
}

ElasticSolution solve_finite_strain(const TaylorHoodSpace& space, std::span<const ElasticMaterial> materials,
                                    const ElasticLoads& loads, FiniteStrainEffort* effort) {
  NewtonPath path(space, materials, loads);
  FiniteStrainEffort took;
  ElasticSolution state = path.problem().at_rest();
  double done = 0.0;
  double part = 1.0;
  while (done < 1.0) {
    const double target = done + part >= 1.0 ? 1.0 : done + part;
    ElasticSolution next = state;
    if (path.solve(target, next, took)) {
      state = std::move(next);
      done = target;
      part *= 2.0;
      ++took.steps;
    } else {
      part *= 0.5;
      if (part < kSmallestPart) {
        fail("the finite-strain solution ends at {:.3g} of the load: {}", done, path.why_not());
      }
    }
  }
  if (effort != nullptr) {
    *effort = std::move(took);
  }
  return state;
}

}  // namespace touchstone::fem
