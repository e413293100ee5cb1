#include "fem/contact/cut_compliance.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace touchstone::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kNear = 1.6;  // edges between triangles' middles: nearer ones go cell by cell
// Mean of 1/r within a disc of area A: 16 / (3 pi radius).
const double kSelf = 16.0 / (3.0 * std::sqrt(std::numbers::pi));
// Variance of a triangle's points along an axis, of its area (equilateral).
constexpr double kSpread = 0.0962;

constexpr double kThin = 4.0;   // edges: the base under a gel thinner than this begins to be felt among the hats
constexpr double kFades = 0.4;  // of the thickness: how far a load is felt on a thin layer

/// A half-space's displacement by a traction on a cell, in the axes (into the body, first, second tangent). On a gel
/// that is thin beside its edges it fades as exp(-r / 0.4 thickness): a load is felt about as far on a bonded layer,
/// for the transform of exp(-r / l) / r, 1 / sqrt(k^2 + 1 / l^2), goes as the layer's kernel over k. It stays positive
/// definite, being the product of two that are. It sets in gradually from four edges to three: the edge is the mean of
/// those in contact, and a force mustn't jump as that grows.
struct HalfSpace {
  HalfSpace(const ElasticMaterial& material, double thickness, double edge)
      : scale(1.0 / (2.0 * std::numbers::pi * shear_modulus(material))),
        nu(material.poisson_ratio),
        fade(std::clamp(kThin - thickness / edge, 0.0, 1.0) / (kFades * thickness)) {}

  double faded(double r) const { return fade > 0.0 ? std::exp(-fade * r) : 1.0; }

  /// Mean of 1/r between two cells, mm^-1.
  static double inverse_distance(double r2, double area_a, double area_b) {
    const double largest = kSelf / std::sqrt(std::max(area_a, area_b));
    if (r2 <= 0.0) return largest;
    const double near = 1.0 / std::sqrt(r2);
    return std::min(largest, near + 0.5 * kSpread * (area_a + area_b) * near / r2);
  }

  /// mm^3/MPa per mm^2 of each density; x, y: from the source to where it is seen.
  Matrix3d between(double x, double y, double r2, double area_a, double area_b) const {
    const double k = inverse_distance(r2, area_a, area_b);
    Matrix3d u;
    const double flat2 = x * x + y * y;
    const double shear = flat2 > 0.0 ? 0.5 * (1.0 - 2.0 * nu) * std::min(1.0, flat2 * k * k) / flat2 : 0.0;
    const double along = flat2 > 0.0 ? nu * k / flat2 : 0.0;
    u << (1.0 - nu) * k, shear * x, shear * y,                                                     //
        -shear * x, (1.0 - nu) * k + (flat2 > 0.0 ? along * x * x : 0.5 * nu * k), along * x * y,  //
        -shear * y, along * x * y, (1.0 - nu) * k + (flat2 > 0.0 ? along * y * y : 0.5 * nu * k);
    return scale * faded(std::sqrt(r2)) * u;
  }

  double scale;
  double nu;
  double fade;  ///< 1/mm; 0: it doesn't
};

/// Cells side by side, so that loops over them run on several numbers at once.
struct Cells {
  explicit Cells(const std::vector<DensityCell>& list = {}) {
    const auto n = static_cast<Eigen::Index>(list.size());
    at.resize(n, 3);
    area.resize(n);
    density.resize(n, 3);
    for (Eigen::Index k = 0; k < n; ++k) {
      const DensityCell& cell = list[static_cast<std::size_t>(k)];
      at.row(k) = cell.at;
      area[k] = cell.area;
      density.row(k) = cell.density;
    }
    largest = kSelf / area.sqrt();
  }

  Eigen::Index size() const { return area.size(); }

  Eigen::ArrayX3d at;        ///< mm
  Eigen::ArrayXd area;       ///< mm^2
  Eigen::ArrayXd largest;    ///< mm^-1: mean of 1/r within each
  Eigen::MatrixX3d density;  ///< mm^2
};

/// One triangle among the block's.
struct Part {
  Vector3d middle;
  std::array<int, 3> place;  ///< of its corners in the block, -1: not in it
  Vector3d first, second;    ///< tangents
  bool cut = false;
  Cells now;  ///< cut where it is
  Cells whole;
  std::array<Vector3d, 3> centre_now, centre_whole;  ///< of each corner's density
  Vector3d mass_now, mass_whole;
};

void sum_up(const std::vector<DensityCell>& cells, std::array<Vector3d, 3>& centre, Vector3d& mass) {
  mass.setZero();
  for (Vector3d& c : centre) c.setZero();
  for (const DensityCell& cell : cells) {
    mass += cell.density;
    for (int a = 0; a < 3; ++a) centre[a] += cell.density[a] * cell.at;
  }
  for (int a = 0; a < 3; ++a) {
    if (mass[a] > 0.0) centre[a] /= mass[a];
  }
}

class Adder {
 public:
  /// A response is added to `out`, a row for each vertex if `normal_only`, else three.
  Adder(Eigen::MatrixXd& out, const HalfSpace& half_space, bool normal_only)
      : out_(out), half_space_(half_space), normal_only_(normal_only) {}

  void pair(const Part& a, const Part& b, bool same, bool near, bool whole) {
    if (near) {
      cells(a, whole ? a.whole : a.now, b, whole ? b.whole : b.now, same);
    } else if (whole) {
      far(a, a.centre_whole, a.mass_whole, b, b.centre_whole, b.mass_whole);
    } else {
      far(a, a.centre_now, a.mass_now, b, b.centre_now, b.mass_now);
    }
  }

 private:
  void add(const Part& a, int i, const Part& b, int j, const Matrix3d& block, bool same) {
    const int row = a.place[i];
    const int column = b.place[j];
    if (row < 0 || column < 0) return;
    out_.block<3, 3>(3 * row, 3 * column) += block;
    if (!same) out_.block<3, 3>(3 * column, 3 * row) += block.transpose();
  }

  /// Means of 1/r between a cell and all of others, and where it is from them.
  void see(const Cells& in_a, Eigen::Index k, const Cells& in_b) {
    for (int axis = 0; axis < 3; ++axis) from_[axis] = in_a.at(k, axis) - in_b.at.col(axis);
    r2_ = from_[0].square() + from_[1].square() + from_[2].square();
    near_ = r2_.sqrt().inverse();  // of a cell and itself: infinity
    inverse_ =
        (near_ + (0.5 * kSpread) * (in_a.area[k] + in_b.area) * near_.cube()).min(in_b.largest).min(in_a.largest[k]);
  }

  /// What a cell sees of each density.
  static Eigen::RowVector3d seen(const Eigen::ArrayXd& term, const Cells& in_b) {
    Eigen::RowVector3d result;
    for (int j = 0; j < 3; ++j) result[j] = term.matrix().dot(in_b.density.col(j));
    return result;
  }

  void cells(const Part& a, const Cells& in_a, const Part& b, const Cells& in_b, bool same) {
    if (normal_only_) {
      Matrix3d sum = Matrix3d::Zero();
      for (Eigen::Index k = 0; k < in_a.size(); ++k) {
        see(in_a, k, in_b);
        if (half_space_.fade > 0.0) inverse_ *= (-half_space_.fade * r2_.sqrt()).exp();
        sum += in_a.density.row(k).transpose() * seen(inverse_, in_b);
      }
      sum *= half_space_.scale * (1.0 - half_space_.nu);
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) add_normal(a.place[i], b.place[j], sum(i, j), same);
      }
      return;
    }
    std::array<Matrix3d, kTerms> sum;
    sum.fill(Matrix3d::Zero());
    for (Eigen::Index k = 0; k < in_a.size(); ++k) {
      see(in_a, k, in_b);
      see_terms(a, same ? k : -1);
      for (int term = 0; term < kTerms; ++term) {
        sum[term] += in_a.density.row(k).transpose() * seen(terms_[term], in_b);
      }
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        std::array<double, kTerms> u;
        for (int term = 0; term < kTerms; ++term) u[term] = half_space_.scale * sum[term](i, j);
        Matrix3d block;
        block << u[0], u[1], u[2], -u[1], u[0] + u[3], u[4], -u[2], u[4], u[0] + u[5];
        add(a, i, b, j, block, same);
      }
    }
  }

  /// What `HalfSpace::between` is made of: of a normal traction by a normal one, along either tangent by a normal one,
  /// and what tangential ones have beyond the first. `self`: the cell that is the seeing one itself.
  void see_terms(const Part& a, Eigen::Index self) {
    const double nu = half_space_.nu;
    x_ = a.first[0] * from_[0] + a.first[1] * from_[1] + a.first[2] * from_[2];
    y_ = a.second[0] * from_[0] + a.second[1] * from_[1] + a.second[2] * from_[2];
    flat2_ = x_.square() + y_.square();
    over_flat2_ = flat2_.max(1e-100).inverse();
    shear_ = (0.5 - nu) * (flat2_ * inverse_.square()).min(1.0) * over_flat2_;
    along_ = nu * inverse_ * over_flat2_;
    terms_[0] = (1.0 - nu) * inverse_;
    terms_[1] = shear_ * x_;
    terms_[2] = shear_ * y_;
    terms_[3] = along_ * x_.square();
    terms_[4] = along_ * x_ * y_;
    terms_[5] = along_ * y_.square();
    if (self >= 0) terms_[3][self] = terms_[5][self] = 0.5 * nu * inverse_[self];
    if (half_space_.fade > 0.0) {
      for (Eigen::ArrayXd& term : terms_) term *= (-half_space_.fade * r2_.sqrt()).exp();
    }
  }

  void add_normal(int row, int column, double u, bool same) {
    if (row < 0 || column < 0) return;
    out_(row, column) += u;
    if (!same) out_(column, row) += u;
  }

  void far(const Part& a, const std::array<Vector3d, 3>& centre_a, const Vector3d& mass_a, const Part& b,
           const std::array<Vector3d, 3>& centre_b, const Vector3d& mass_b) {
    for (int i = 0; i < 3; ++i) {
      if (a.place[i] < 0 || !(mass_a[i] > 0.0)) continue;
      for (int j = 0; j < 3; ++j) {
        if (b.place[j] < 0 || !(mass_b[j] > 0.0)) continue;
        const Vector3d from = centre_a[i] - centre_b[j];
        const double mass = mass_a[i] * mass_b[j];
        if (normal_only_) {
          const double u =
              mass * half_space_.scale * (1.0 - half_space_.nu) * half_space_.faded(from.norm()) / from.norm();
          add_normal(a.place[i], b.place[j], u, false);
        } else {
          add(a, i, b, j,
              mass * half_space_.between(a.first.dot(from), a.second.dot(from), from.squaredNorm(), 0.0, 0.0), false);
        }
      }
    }
  }

  static constexpr int kTerms = 6;

  Eigen::MatrixXd& out_;
  const HalfSpace& half_space_;
  bool normal_only_;
  // For each cell that is seen.
  std::array<Eigen::ArrayXd, 3> from_;
  Eigen::ArrayXd r2_, near_, inverse_, x_, y_, flat2_, over_flat2_, shear_, along_;
  std::array<Eigen::ArrayXd, kTerms> terms_;
};

/// What a gel's response is beyond a half-space's near one of its vertices: smooth, since it comes from the gel's other
/// faces. Finite elements add an error of a few per cent to a vertex's response to its own hat and to the next ones',
/// which would let two densities that lie nearly on each other answer as if work could be had from them.
class SmoothRest {
 public:
  SmoothRest(const Compliance& gel, const ContactSurface& surface, const HalfSpace& half_space,
             const std::vector<Matrix3d>& axes_of_all)
      : gel_(gel), surface_(surface), half_space_(half_space), axes_(axes_of_all) {}

  /// Fits around a vertex; false where too few others are near, or none on one side: where the gel ends its response
  /// isn't smooth, and a fit to one side says nothing of the other.
  bool fit(int vertex) {
    vertex_ = vertex;
    edge_ = edge_at(vertex);
    std::vector<int> ring;
    for (int v = 0; v < static_cast<int>(surface_.vertices.size()); ++v) {
      const double distance = (surface_.vertices[v] - surface_.vertices[vertex]).norm();
      if (distance > kRingFrom * edge_ && distance < kRingTo * edge_) ring.push_back(v);
    }
    if (static_cast<int>(ring.size()) < kLeastRing) return false;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const int v : ring) middle += along(v) / static_cast<double>(ring.size());
    if (middle.norm() > kOneSided * edge_) return false;
    Eigen::MatrixXd basis(static_cast<Eigen::Index>(ring.size()), 6);
    Eigen::MatrixXd rest(basis.rows(), 9);
    const Eigen::MatrixXd compliance = gel_.surface.block(ring, std::array{vertex});
    for (Eigen::Index k = 0; k < basis.rows(); ++k) {
      const int v = ring[static_cast<std::size_t>(k)];
      basis.row(k) = terms(v);
      const Matrix3d own = axes_[v].transpose() * (compliance.middleRows<3>(3 * k) * axes_[vertex]);
      const Matrix3d difference = own / (surface_.weight[v] * surface_.weight[vertex]) - half_space_at(v);
      rest.row(k) = Eigen::Map<const Eigen::Matrix<double, 1, 9>>(difference.data());
    }
    coefficients_ = basis.colPivHouseholderQr().solve(rest);
    return true;
  }

  double edge() const { return edge_; }

  /// mm/MPa/mm^2: displacement at a vertex by a unit traction's hat on the fitted one, over both weights.
  Matrix3d at(int v) const {
    const Eigen::Matrix<double, 1, 9> row = terms(v) * coefficients_;
    return Eigen::Map<const Matrix3d>(row.data());
  }

 private:
  static constexpr double kRingFrom = 1.6;  // edges
  static constexpr double kRingTo = 3.3;
  static constexpr int kLeastRing = 12;
  static constexpr double kOneSided = 0.5;  // edges: a ring's middle that is farther away than that isn't all round

  double edge_at(int vertex) const {
    double sum = 0.0;
    for (const int u : surface_.around[vertex]) sum += (surface_.vertices[u] - surface_.vertices[vertex]).norm();
    return sum / static_cast<double>(surface_.around[vertex].size());
  }

  Eigen::Vector2d along(int v) const {
    const Vector3d from = surface_.vertices[v] - surface_.vertices[vertex_];
    return {axes_[vertex_].col(1).dot(from), axes_[vertex_].col(2).dot(from)};
  }

  Eigen::Matrix<double, 1, 6> terms(int v) const {
    const Eigen::Vector2d d = along(v) / edge_;
    Eigen::Matrix<double, 1, 6> t;
    t << 1.0, d.x(), d.y(), d.x() * d.x(), d.y() * d.y(), d.x() * d.y();
    return t;
  }

  /// A half-space's, hats taken as points with their spread: variance e^2 5/48 along each axis, for regular triangles.
  Matrix3d half_space_at(int v) const {
    constexpr double kHatSpread = 5.0 / 48.0;
    const double e = edge_at(v);
    const double spread = 0.5 * kHatSpread * (e * e + edge_ * edge_);
    const Eigen::Vector2d d = along(v);
    const double r2 = (surface_.vertices[v] - surface_.vertices[vertex_]).squaredNorm();
    const double r3 = r2 * std::sqrt(r2);
    Matrix3d u = half_space_.between(d.x(), d.y(), r2, 0.0, 0.0);
    Matrix3d more = Matrix3d::Identity() * (1.0 - half_space_.nu) / r3;
    const Eigen::Matrix2d tangent = (2.0 * Eigen::Matrix2d::Identity() - 3.0 * d * d.transpose() / r2) / r3;
    // The Laplacians of x x / r^3 and x y / r^3; of x / r^2 there is none.
    more(1, 1) += half_space_.nu * tangent(0, 0);
    more(2, 2) += half_space_.nu * tangent(1, 1);
    more(1, 2) += half_space_.nu * (tangent(0, 1));
    more(2, 1) += half_space_.nu * (tangent(1, 0));
    return u + half_space_.scale * half_space_.faded(std::sqrt(r2)) * spread * more;
  }

  const Compliance& gel_;
  const ContactSurface& surface_;
  const HalfSpace& half_space_;
  const std::vector<Matrix3d>& axes_;
  int vertex_ = 0;
  double edge_ = 1.0;
  Eigen::Matrix<double, 6, 9> coefficients_;
};

constexpr double kSliver = 0.02;  // share of a hat at which what bears is held off by as much as it gives way
constexpr double kStiffest = 1e8;
constexpr double kOwnPart = 0.01;   // of a cut hat's response: so much at least is what no others can do
constexpr double kCutInFull = 0.1;  // of a hat: it counts as cut in full from where so much of it has another density
constexpr double kCovered = 1e-6;   // of a triangle: what may be missing, from where it is covered
constexpr double kReplaced = 1.3;   // edges: among cut hats that are nearer, the elements' response is replaced

/// How much each vertex of `cuts` is cut, 0 to 1: nearly 0 where a hat only begins to be, so that nothing changes at
/// once.
Eigen::VectorXd how_cut(const CutHats& cuts, const ContactSurface& surface) {
  Eigen::VectorXd same = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(cuts.vertices.size()));
  for (const CutTriangle& triangle : cuts.triangles) {
    for (int a = 0; a < 3; ++a) {
      const Eigen::Index k = place_in(cuts, surface.triangles[triangle.triangle][a]);
      for (const DensityCell& cell : triangle.cells) {
        if (k >= 0) same[k] += std::min(cell.density[a], cell.area * cell.corners[a]);
      }
    }
  }
  for (Eigen::Index k = 0; k < same.size(); ++k) {
    same[k] =
        std::clamp((1.0 - same[k] / surface.weight[cuts.vertices[static_cast<std::size_t>(k)]]) / kCutInFull, 0.0, 1.0);
  }
  return same;
}

/// A triangle's cells where no hat is cut: the same, if they cover it, so that what isn't cut makes no difference.
std::vector<DensityCell> uncut(const ContactSurface& surface, const CutTriangle& triangle) {
  std::vector<DensityCell> cells = triangle.cells;
  double area = 0.0;
  for (DensityCell& cell : cells) {
    cell.density = cell.area * cell.corners;
    area += cell.area;
  }
  const double missing = std::abs(surface.triangle_area[triangle.triangle] - area);
  return missing < kCovered * surface.triangle_area[triangle.triangle] ? cells
                                                                       : whole_cells(surface, triangle.triangle);
}

double share_of(const CutHats& cuts, int vertex) {
  return cuts.share[place_in(cuts, vertex)];
}

/// What must be added to the diagonal so that each pivot of a Cholesky factor is at least this: nothing where one would
/// have to be more than doubled, for then the factor's numbers grow from pivot to pivot without bound.
std::optional<Eigen::VectorXd> softened_one_by_one(Eigen::MatrixXd left, const Eigen::VectorXd& least) {
  const Eigen::Index n = left.rows();
  Eigen::VectorXd more(n);
  // The factor takes the place of the lower half, column by column.
  for (Eigen::Index j = 0; j < n; ++j) {
    left.col(j).tail(n - j).noalias() -= left.bottomLeftCorner(n - j, j) * left.row(j).head(j).transpose();
    more[j] = std::max(0.0, least[j] - left(j, j));
    if (!(more[j] < least[j] / kOwnPart)) return std::nullopt;
    left(j, j) += more[j];
    left.col(j).tail(n - j) /= std::sqrt(left(j, j));
  }
  return more;
}

/// What must be added so that no eigenvalue is smaller than this, rows and columns being scaled by its root.
Eigen::MatrixXd softened_together(const Eigen::MatrixXd& left, const Eigen::VectorXd& least) {
  const Eigen::VectorXd scale = least.cwiseSqrt();
  const Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * left * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(scaled);
  const Eigen::MatrixXd vectors = scale.asDiagonal() * modes.eigenvectors();
  return vectors * (1.0 - modes.eigenvalues().array()).max(0.0).matrix().asDiagonal() * vectors.transpose();
}

/// Softens cut hats that are all but the same as what others can do together, the smallest last, so that the compliance
/// of them and of the whole hats beside them stays positive definite; rows of the compliance. A half-space isn't what
/// elements answer as, where a mesh is coarse and irregular or the gel ends, and work could then be had from the
/// difference of two densities that lie nearly on each other.
void keep_definite(Eigen::MatrixXd& compliance, const std::vector<Eigen::Index>& whole,
                   const std::vector<Eigen::Index>& cut) {
  Eigen::MatrixXd left = compliance(cut, cut);
  if (!whole.empty()) {
    const Eigen::LLT<Eigen::MatrixXd> factor(compliance(whole, whole));
    if (factor.info() != Eigen::Success) return;  // not by what cuts changed
    const Eigen::MatrixXd through = factor.matrixL().solve(Eigen::MatrixXd(compliance(whole, cut)));
    left.noalias() -= through.transpose() * through;
  }
  Eigen::VectorXd least(left.rows());
  for (Eigen::Index j = 0; j < least.size(); ++j) {
    const Eigen::Index row = cut[static_cast<std::size_t>(j)];
    least[j] = kOwnPart * std::abs(compliance(row, row));
  }
  if (const std::optional<Eigen::VectorXd> more = softened_one_by_one(left, least)) {
    for (Eigen::Index j = 0; j < least.size(); ++j) {
      compliance(cut[static_cast<std::size_t>(j)], cut[static_cast<std::size_t>(j)]) += (*more)[j];
    }
  } else {
    compliance(cut, cut) += softened_together(left, least);
  }
}

}  // namespace

void add_cut_compliance(Eigen::MatrixXd& compliance, const CutHats& cuts, const ContactSurface& surface,
                        const Compliance& gel, const std::vector<int>& vertices,
                        const std::vector<Matrix3d>& axes_of_all, bool normal_only) {
  std::vector<int> place(surface.vertices.size(), -1);
  for (std::size_t k = 0; k < vertices.size(); ++k) place[vertices[k]] = static_cast<int>(k);
  std::vector<Part> parts;
  double mean_area = 0.0;
  auto next_cut = cuts.triangles.begin();
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    while (next_cut != cuts.triangles.end() && next_cut->triangle < t) ++next_cut;
    const auto& index = surface.triangles[t];
    Part part;
    int own = -1;
    for (int k = 0; k < 3; ++k) {
      part.place[k] = place[index[k]];
      if (part.place[k] >= 0) own = index[k];
    }
    if (own < 0) continue;
    part.middle = (surface.vertices[index[0]] + surface.vertices[index[1]] + surface.vertices[index[2]]) / 3.0;
    part.first = axes_of_all[own].col(1);
    part.second = axes_of_all[own].col(2);
    part.cut = next_cut != cuts.triangles.end() && next_cut->triangle == t;
    const std::vector<DensityCell> whole = part.cut ? uncut(surface, *next_cut) : whole_cells(surface, t);
    const std::vector<DensityCell>& now = part.cut ? next_cut->cells : whole;
    part.whole = Cells(whole);
    part.now = Cells(now);
    sum_up(now, part.centre_now, part.mass_now);
    sum_up(whole, part.centre_whole, part.mass_whole);
    mean_area += surface.triangle_area[t];
    parts.push_back(std::move(part));
  }
  if (parts.empty()) return;
  mean_area /= static_cast<double>(parts.size());
  const double edge = std::sqrt(mean_area * 4.0 / std::sqrt(3.0));
  const double near = kNear * edge;
  const HalfSpace half_space(gel.material, gel.thickness, edge);
  const Eigen::Index each = normal_only ? 1 : 3;  // rows of a vertex in the responses
  const Eigen::Index rows = each * static_cast<Eigen::Index>(vertices.size());
  Eigen::MatrixXd cut_response = Eigen::MatrixXd::Zero(rows, rows);
  Eigen::MatrixXd whole_response = cut_response;
  Adder add_cut(cut_response, half_space, normal_only);
  Adder add_whole(whole_response, half_space, normal_only);
  for (std::size_t a = 0; a < parts.size(); ++a) {
    for (std::size_t b = a; b < parts.size(); ++b) {
      if (!parts[a].cut && !parts[b].cut) continue;
      const bool is_near = (parts[a].middle - parts[b].middle).norm() < near;
      add_cut.pair(parts[a], parts[b], a == b, is_near, false);
      add_whole.pair(parts[a], parts[b], a == b, is_near, true);
    }
  }
  // Among cut hats near each other: the half-space's response to their densities, and a smooth rest.
  std::vector<int> cut;
  for (const int v : cuts.vertices) {
    if (place[v] >= 0) cut.push_back(v);
  }
  const Eigen::VectorXd how = how_cut(cuts, surface);
  const auto how_of = [&](int v) { return how[place_in(cuts, v)]; };
  SmoothRest rest(gel, surface, half_space, axes_of_all);
  for (const int i : cut) {
    if (how_of(i) <= 0.0 || !rest.fit(i)) continue;
    std::vector<int> near_ones;
    Matrix3d level = Matrix3d::Zero();
    double weights = 0.0;
    const Eigen::Index column = each * place[i];
    const auto elements = [&](int j) -> Matrix3d {
      Matrix3d block = compliance.block<3, 3>(3 * place[j], 3 * place[i]);
      block.topLeftCorner(each, each) -= whole_response.block(each * place[j], column, each, each);
      return block / (surface.weight[i] * surface.weight[j]);
    };
    for (const int j : cut) {
      if ((surface.vertices[i] - surface.vertices[j]).norm() > kReplaced * rest.edge()) continue;
      near_ones.push_back(j);
      level += how_of(j) * surface.weight[j] * (elements(j) - rest.at(j));
      weights += how_of(j) * surface.weight[j];
    }
    level /= weights;
    for (const int j : near_ones) {
      // Half from either end, so that it's symmetric.
      const Eigen::Index row = each * place[j];
      const Matrix3d change =
          0.5 * how_of(i) * how_of(j) * surface.weight[i] * surface.weight[j] * (rest.at(j) + level - elements(j));
      const auto part = change.topLeftCorner(each, each);
      cut_response.block(row, column, each, each) += part;
      cut_response.block(column, row, each, each) += part.transpose();
    }
  }
  // A sliver's traction goes to nothing as the body leaves its hat, so that no vertex switches on or off by its share.
  for (std::size_t k = 0; k < cuts.vertices.size(); ++k) {
    const int row = place[cuts.vertices[k]];
    const double share = cuts.share[static_cast<Eigen::Index>(k)];
    if (row < 0) continue;
    if (share <= 0.0) {  // what bears nothing stays as it is
      cut_response.middleRows(each * row, each) = whole_response.middleRows(each * row, each);
      cut_response.middleCols(each * row, each) = whole_response.middleCols(each * row, each);
      continue;
    }
    const double more = std::min(kStiffest, std::pow(kSliver / share, 2));
    for (Eigen::Index a = 0; a < each; ++a) {
      cut_response(each * row + a, each * row + a) += more * compliance(3 * row + a, 3 * row + a);
    }
  }
  const auto changed = Eigen::seqN(Eigen::fix<0>, rows, 3 / each);
  compliance(changed, changed) += cut_response - whole_response;
  // What bears nothing asks for nothing.
  std::erase_if(cut, [&](int v) { return share_of(cuts, v) <= 0.0; });
  std::stable_sort(cut.begin(), cut.end(), [&](int a, int b) { return share_of(cuts, a) > share_of(cuts, b); });
  std::vector<int> beside;
  for (const CutTriangle& triangle : cuts.triangles) {
    for (const int v : surface.triangles[triangle.triangle]) {
      if (place[v] >= 0 && place_in(cuts, v) < 0) beside.push_back(v);
    }
  }
  std::sort(beside.begin(), beside.end());
  beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
  const auto rows_of = [&](const std::vector<int>& list) {
    std::vector<Eigen::Index> of_list;
    for (const int v : list) {
      for (Eigen::Index a = 0; a < each; ++a) of_list.push_back(3 * place[v] + a);
    }
    return of_list;
  };
  keep_definite(compliance, rows_of(beside), rows_of(cut));
}

}  // namespace touchstone::fem
