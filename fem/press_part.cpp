#include "fem/press_part.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/error.h"

namespace touchstone::fem {
namespace {

constexpr int kMostUpdates = 60;
constexpr int kStrictUpdates = 8;        // after these the lookup may be a hundred times further off
constexpr int kPlainUpdates = 5;         // after these the fixed point is relaxed
constexpr double kSurelyTouching = 0.3;  // of the deepest overlap: vertices that overlap by more start in the block
constexpr std::size_t kFirstCandidates = 12;
// The gel bulges beside a contact by less than this part of the depth; vertices further from a body than that, and a
// little, aren't looked at. It is checked at the answer, and widened where it doesn't hold.
constexpr double kBulge = 0.5;
constexpr double kLeastReach = 0.02;    // of the thickness
constexpr double kSharpestCurve = 0.3;  // of a triangle: radius down to which a gap counts as smooth
constexpr double kSlopeStep = 3e-4;     // of a triangle
constexpr double kHoldFades = 0.25;     // an update, after the first few
constexpr int kHeldUpdates = 2;
constexpr double kLargestTurn = 0.1;  // radians an update, under torque control
constexpr double kMostTurn = 0.8;     // radians in all

/// Turns an answer without friction into one with three components a vertex.
void widen(ContactAnswer& answer, const Eigen::MatrixXd& compliance) {
  const Eigen::VectorXd p = answer.z;
  answer.z = Eigen::VectorXd::Zero(3 * p.size());
  answer.response = Eigen::VectorXd::Zero(3 * p.size());
  for (Eigen::Index j = 0; j < p.size(); ++j) {
    answer.z[3 * j] = p[j];
    if (p[j] != 0.0) answer.response += p[j] * compliance.col(3 * j);
  }
}

Eigen::Matrix3d turned_by(const Eigen::Vector3d& turn) {
  const double angle = turn.norm();
  if (angle == 0.0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
}

}  // namespace

/// Where a gap was looked up, so that it serves again nearby: exactly after a motion along the normal of a flat
/// surface, to second order after a small one across it.
struct PartSolver::Looked {
  bool valid = false;
  RigidTransform pose;
  PatchMotion lookup;
  WeightedGap gap;
  bool has_slopes = false;
  Eigen::MatrixX2d plain_slope;  ///< n x 2: change of gap.plain per mm that the gel goes along x, y
  Eigen::MatrixX2d edge_slope;
};

/// What changes for one body while a part is solved.
struct PartSolver::Body {
  RigidTransform pose;
  Eigen::Vector3d turn;
  PatchMotion lookup;       ///< how the gel under it is carried along
  PatchMotion next_lookup;  ///< of the next update
  std::array<double, 3> last_residual{};
  bool has_residual = false;
  double relaxation = 1.0;
  double patch_radius = 1.0;  ///< mm
  bool touching = false;
  WeightedGap gap;  ///< after the last shift
};

struct PartSolver::Iterate {
  std::vector<Body> bodies;
  double lookup_error = 0.0;
  double reach = 0.0;          ///< mm
  std::vector<int> owner;      ///< per vertex: the body with the least gap there, -1: far from all
  std::vector<char> active;    ///< vertices in contact
  std::vector<char> required;  ///< vertices that turned out to be needed in the block
  Eigen::VectorXd traction;    ///< to begin the next solution with
  Eigen::VectorXd weighted;    ///< 3 m, of the gel at the block's vertices, gel frame
  bool warm = false;
  bool grew = false;  ///< `required` was added to, or the pose isn't an answer yet
  int updates = 0;
  int at_the_bottom = 0;     ///< updates that wanted to go deeper than the gel
  double edge_change = 0.0;  ///< mm: what the shift does to the gaps beyond moving them
  double deepest = 0.0;

  double gap(int v) const {
    return owner[v] < 0 ? std::numeric_limits<double>::infinity() : bodies[owner[v]].gap.weighted[v];
  }
};

bool PressSnapshot::touching() const {
  return std::any_of(bodies.begin(), bodies.end(), [](const BodySnapshot& body) { return body.touching; });
}

void PressSnapshot::forget(int body) {
  bool any = false;
  for (std::size_t v = 0; v < state.size(); ++v) {
    if (owner[v] != body) continue;
    any = true;
    state[v] = NodeState::open;
    owner[v] = -1;
    traction.segment<3>(static_cast<Eigen::Index>(3 * v)).setZero();
  }
  // An elastic gel is at once what the other bodies make of it; a relaxing one still has its dent.
  if (any && history.empty()) known.assign(known.size(), 0);
  bodies[body].force.setZero();
  bodies[body].moment.setZero();
  bodies[body].touching = bodies[body].overlapping = false;
}

PressSnapshot untouched(std::vector<BodySnapshot> bodies, int n) {
  PressSnapshot s;
  s.bodies = std::move(bodies);
  for (BodySnapshot& body : s.bodies) {
    body.force.setZero();
    body.moment.setZero();
    body.touching = body.overlapping = false;
  }
  s.traction = Eigen::VectorXd::Zero(3 * n);
  s.weighted = Eigen::VectorXd::Zero(3 * n);
  s.relative = Eigen::VectorXd::Zero(3 * n);
  s.known.assign(n, 1);
  s.state.assign(n, NodeState::open);
  s.owner.assign(n, -1);
  return s;
}

PartSolver::PartSolver(const Compliance& gel, std::vector<PressBody> bodies, double lookup_mm, double traction,
                       PronySeries relaxation)
    : gel_(gel),
      bodies_(std::move(bodies)),
      lookup_mm_(lookup_mm),
      traction_(traction),
      relaxation_(std::move(relaxation)),
      mu_(bodies_.size(), 0.0),
      surface_(gel),
      block_(gel, surface_),
      remembered_axes_(bodies_.size()),
      looked_(bodies_.size()) {
  size_ = std::accumulate(surface_.triangle_size.begin(), surface_.triangle_size.end(), 0.0) /
          static_cast<double>(surface_.triangle_size.size());
  for (const PressBody& body : bodies_) {
    soft_.push_back(body.elastic ? std::make_unique<ElasticBody>(*body.elastic) : nullptr);
    elastic_ = elastic_ || body.elastic;
  }
}

PartSolver::~PartSolver() = default;

void PartSolver::set_friction(const std::vector<double>& friction) {
  if (friction != mu_) memory_.forget();
  mu_ = friction;
  friction_ = std::any_of(mu_.begin(), mu_.end(), [](double mu) { return mu > 0.0; });
}

void PartSolver::refuse_too_deep(double deepest) const {
  if (-deepest > gel_.thickness) {
    fail("the object reaches {:.4g} mm into a gel of {:.4g} mm", -deepest, gel_.thickness);
  }
}

Eigen::Vector3d PartSolver::weighted_at(const PressSnapshot& snapshot, int vertex) const {
  if (snapshot.known[vertex]) return snapshot.weighted.segment<3>(3 * vertex);
  const auto rows = gel_.surface.view().middleCols<3>(3 * vertex);  // symmetric
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t v = 0; v < snapshot.state.size(); ++v) {
    if (snapshot.state[v] == NodeState::open) continue;
    const auto at = static_cast<Eigen::Index>(3 * v);
    sum += rows.middleRows<3>(at).transpose() * snapshot.traction.segment<3>(at);
  }
  return sum;
}

/// Of the gel relative to the body that touches it; an open vertex has no history against a body.
Eigen::Vector3d PartSolver::relative_at(const PressSnapshot& snapshot, int vertex) const {
  return snapshot.known[vertex] ? Eigen::Vector3d(snapshot.relative.segment<3>(3 * vertex))
                                : weighted_at(snapshot, vertex);
}

/// The gap of one body at its pose, looked up or carried over from a place nearby.
WeightedGap PartSolver::gap_of(std::size_t b, const Iterate& now, PartEffort& effort) {
  const Body& body = now.bodies[b];
  Looked& looked = looked_[b];
  const ContactShape& shape = bodies_[b].shape;
  // Some more than what is asked for, so that it serves the next, deeper place, too.
  const GapReach reach = surface_.flat ? GapReach{now.reach + kLeastReach * gel_.thickness, 1.5 * kBulge} : GapReach{};
  const auto look = [&] {
    looked.gap = weighted_gap(surface_, shape, body.pose, body.lookup, reach);
    looked.pose = body.pose;
    looked.lookup = body.lookup;
    looked.valid = surface_.flat && surface_.normals.front() == Eigen::Vector3d::UnitZ();
    looked.has_slopes = false;
    ++effort.geometry_updates;
    return looked.gap;
  };
  if (!looked.valid || looked.pose.rotation != body.pose.rotation) return look();
  const Eigen::Vector3d motion = body.pose.translation - looked.pose.translation;
  const auto n = static_cast<Eigen::Index>(gel_.vertices.size());
  Eigen::MatrixX2d slid = Eigen::MatrixX2d::Zero(n, 2);  // of the gel under the body
  for (Eigen::Index v = 0; v < n; ++v) {
    if (!std::isfinite(looked.gap.weighted[v])) continue;
    const Eigen::Vector3d& x = gel_.vertices[static_cast<std::size_t>(v)];
    slid.row(v) = (body.lookup.displacement(x) - looked.lookup.displacement(x) - motion).head<2>().transpose();
  }
  const double farthest = std::sqrt(slid.rowwise().squaredNorm().maxCoeff());
  if (farthest > std::sqrt(lookup_mm_ * kSharpestCurve * size_)) return look();
  WeightedGap gap = looked.gap;
  if (farthest > 0.0) {
    if (!looked.has_slopes) {
      looked.plain_slope = looked.edge_slope = Eigen::MatrixX2d::Zero(n, 2);
      const double step = kSlopeStep * size_;
      for (int axis = 0; axis < 2; ++axis) {
        RigidTransform beside = looked.pose;
        beside.translation[axis] -= step;
        const WeightedGap there = weighted_gap(surface_, shape, beside, looked.lookup, reach);
        ++effort.geometry_updates;
        for (Eigen::Index v = 0; v < n; ++v) {
          if (!std::isfinite(gap.weighted[v]) || !std::isfinite(there.weighted[v])) continue;
          looked.plain_slope(v, axis) = (there.plain[v] - gap.plain[v]) / step;
          looked.edge_slope(v, axis) = (there.edge[v] - gap.edge[v]) / step;
        }
      }
      looked.has_slopes = true;
    }
    for (Eigen::Index v = 0; v < n; ++v) {
      if (!std::isfinite(gap.weighted[v])) continue;
      gap.plain[v] += looked.plain_slope.row(v).dot(slid.row(v));
      gap.edge[v] = std::max(0.0, gap.edge[v] + looked.edge_slope.row(v).dot(slid.row(v)));
    }
  }
  gap.move_along_normals(surface_.weight, motion.z());
  const double depth = std::max(0.0, -gap.deepest);
  if (gap.reach < std::max(0.0, gap.deepest) + now.reach + kBulge * depth) return look();
  return gap;
}

/// The gaps of all bodies, and which body each vertex faces.
void PartSolver::look_up(Iterate& now, const std::vector<PartTarget>& targets, PartEffort& effort) {
  const int n = static_cast<int>(gel_.vertices.size());
  now.owner.assign(n, -1);
  now.deepest = std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < now.bodies.size(); ++b) {
    Body& body = now.bodies[b];
    body.gap = gap_of(b, now, effort);
    if (!targets[b].forced[2]) {
      refuse_too_deep(body.gap.deepest);
    } else if (!std::isfinite(body.gap.deepest)) {
      fail("the object isn't over the gel: a force of {:.4g} N can't be reached", targets[b].force[2]);
    }
    now.deepest = std::min(now.deepest, body.gap.deepest);
    for (int v = 0; v < n; ++v) {
      if (body.gap.weighted[v] < now.gap(v)) now.owner[v] = static_cast<int>(b);
    }
  }
}

/// Vertices that surely or probably touch, with a ring around them.
std::vector<int> PartSolver::candidates(const Iterate& now, bool z_forced) const {
  const int n = static_cast<int>(gel_.vertices.size());
  std::vector<std::pair<double, int>> near;
  std::size_t touching = 0;
  for (int v = 0; v < n; ++v) {
    touching += now.active[v] != 0;
    if (now.owner[v] >= 0) near.emplace_back(now.gap(v) / surface_.weight[v], v);
  }
  std::sort(near.begin(), near.end());
  std::size_t count = 0;
  while (count < near.size()) {
    const double depth = std::max(0.0, -now.bodies[now.owner[near[count].second]].gap.deepest);
    if (near[count].first >= -kSurelyTouching * depth) break;
    ++count;
  }
  // While the depth is itself being sought it may be far off; the block grows by a factor at a time.
  if (z_forced) count = std::min(count, 4 * touching + kFirstCandidates);
  count = std::max(count, std::min(near.size(), kFirstCandidates));
  std::vector<char> chosen(now.active);
  for (int v = 0; v < n; ++v) chosen[v] = chosen[v] || now.required[v];
  for (std::size_t k = 0; k < count; ++k) chosen[near[k].second] = 1;
  std::vector<int> result;
  for (int v = 0; v < n; ++v) {
    if (now.owner[v] < 0) continue;
    const bool beside = std::any_of(surface_.around[v].begin(), surface_.around[v].end(),
                                    [&](int neighbour) { return chosen[neighbour] != 0; });
    if (chosen[v] || beside) result.push_back(v);
  }
  return result;
}

/// Weighted tangential displacement, in the vertices' own axes, that the gel would have at the block's vertices if it
/// had gone along with the body since `from`.
Eigen::VectorXd PartSolver::drag(const PressSnapshot& from, const Iterate& now) const {
  const auto& vertices = block_.vertices();
  std::vector<RigidTransform> motion;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    motion.push_back(now.bodies[b].pose * from.bodies[b].pose.inverse());
  }
  Eigen::VectorXd result(2 * static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const int v = vertices[k];
    const int b = now.owner[v];
    Eigen::Vector3d weighted = relative_at(from, v);
    if (b >= 0 && now.bodies[b].pose.rotation == from.bodies[b].pose.rotation) {
      weighted += surface_.weight[v] * (now.bodies[b].pose.translation - from.bodies[b].pose.translation);
    } else if (b >= 0) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(gel_.mass, v); it; ++it) {
        const int u = static_cast<int>(it.row());
        const Eigen::Vector3d at = gel_.vertices[u] + weighted_at(from, u) / surface_.weight[u];
        weighted += it.value() * (motion[b] * at - at);
      }
    }
    result.segment<2>(2 * static_cast<Eigen::Index>(k)) = block_.axes(v).rightCols<2>().transpose() * weighted;
  }
  return result;
}

PatchMotion PartSolver::motion_of(const std::vector<int>& vertices, const std::vector<Eigen::Vector3d>& displacements,
                                  const std::vector<double>& pressures) const {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> normals;
  for (const int v : vertices) {
    points.push_back(gel_.vertices[v]);
    normals.push_back(surface_.normals[v]);
  }
  return mean_patch_motion(points, normals, displacements, pressures);
}

/// Begins with the state of `from`; the lookup goes on with a body if most of its contact stuck.
void PartSolver::begin(const PressSnapshot& from, const std::vector<PartTarget>& targets, Iterate& now) const {
  const int n = static_cast<int>(gel_.vertices.size());
  now.active.assign(n, 0);
  now.required.assign(n, 0);
  now.reach = kLeastReach * gel_.thickness;
  now.bodies.resize(bodies_.size());
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    Body& body = now.bodies[b];
    body.pose = targets[b].pose;
    body.turn = from.bodies[b].turn;
    std::vector<int> vertices;
    std::vector<Eigen::Vector3d> displacements;
    std::vector<double> pressures;
    int stuck = 0;
    for (int v = 0; v < n; ++v) {
      if (from.owner[v] != static_cast<int>(b)) continue;
      now.active[v] = 1;
      vertices.push_back(v);
      displacements.push_back(weighted_at(from, v) / surface_.weight[v]);
      pressures.push_back(-surface_.weight[v] * surface_.normals[v].dot(from.traction.segment<3>(3 * v)));
      stuck += from.state[v] == NodeState::stick;
    }
    if (2 * stuck > static_cast<int>(vertices.size())) {
      const RigidTransform motion = body.pose * from.bodies[b].pose.inverse();
      for (std::size_t k = 0; k < vertices.size(); ++k) {
        const Eigen::Vector3d at = gel_.vertices[vertices[k]] + displacements[k];
        displacements[k] += motion * at - at;
      }
    }
    body.lookup = motion_of(vertices, displacements, pressures);
  }
  now.traction = from.traction;
  now.warm = from.touching();
}

ContactProblem PartSolver::problem(const PressSnapshot& from, const std::vector<PartTarget>& targets,
                                   const Iterate& now) {
  const int c = friction_ ? 3 : 1;
  const auto& vertices = block_.vertices();
  const auto m = static_cast<Eigen::Index>(vertices.size());
  ContactProblem result;
  result.components = c;
  if (elastic_) {
    combined_ = block_.compliance();
    std::vector<Eigen::Matrix3d> axes;
    for (const int v : vertices) axes.push_back(block_.axes(v));
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      if (!soft_[b]) continue;
      std::vector<char> mine;
      for (const int v : vertices) mine.push_back(now.owner[v] == static_cast<int>(b));
      soft_[b]->add_to(combined_, relaxation_.stiffness(), surface_, vertices, mine, axes, now.bodies[b].pose,
                       now.bodies[b].lookup);
    }
    const auto normals = Eigen::seqN(Eigen::fix<0>, m, Eigen::fix<3>);
    combined_normal_ = combined_(normals, normals);
    memory_.forget();
  }
  for (const PartTarget& target : targets) {
    if (target.turned[0] || target.turned[1] || target.turned[2]) memory_.forget();  // its border changes
  }
  result.compliance = c == 3 ? &compliance() : elastic_ ? &combined_normal_ : &block_.normal_compliance();
  result.gap.resize(m);
  for (Eigen::Index j = 0; j < m; ++j) result.gap[j] = now.gap(vertices[j]);
  if (c == 3) {
    result.friction.resize(m);
    for (Eigen::Index j = 0; j < m; ++j) {
      const int b = now.owner[vertices[j]];
      result.friction[j] = b < 0 ? 0.0 : mu_[b];
    }
    result.drag = drag(from, now);
  }

  Eigen::Index columns = 0;
  for (const PartTarget& target : targets) {
    for (int a = 0; a < 3; ++a) columns += target.forced[a] + target.turned[a];
  }
  result.border = Eigen::MatrixXd::Zero(c * m, columns);
  result.force.resize(columns);
  result.hold = Eigen::VectorXd::Zero(columns);
  Eigen::Index column = 0;
  for (std::size_t b = 0; b < targets.size(); ++b) {
    const PartTarget& target = targets[b];
    for (int a = 0; a < 6; ++a) {
      const bool rotation = a >= 3;
      if (!(rotation ? target.turned[a - 3] : target.forced[a])) continue;
      result.force[column] = rotation ? target.torque[a - 3] : target.force[a];
      if (rotation) {
        // A turn is held back at first, when the contact may be a point or a line that doesn't resist it.
        const double radius = std::max(now.bodies[b].patch_radius, size_);
        result.hold[column] = 8.0 * shear_modulus(gel_.material) * std::pow(radius, 3) *
                              std::pow(kHoldFades, std::max(0, now.updates - kHeldUpdates));
      }
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(a % 3);
      for (Eigen::Index j = 0; j < m; ++j) {
        const int v = vertices[j];
        if (now.owner[v] != static_cast<int>(b)) continue;
        // int phi (the body's motion) dA.
        Eigen::Vector3d moved = surface_.weight[v] * axis;
        if (rotation) {
          Eigen::Vector3d arm = -surface_.weight[v] * now.bodies[b].pose.translation;
          for (Eigen::SparseMatrix<double>::InnerIterator it(gel_.mass, v); it; ++it) {
            arm += it.value() * gel_.vertices[static_cast<std::size_t>(it.row())];
          }
          if (now.weighted.size() == 3 * m) arm += now.weighted.segment<3>(3 * j);
          moved = axis.cross(arm);
        }
        result.border.block(c * j, column, c, 1) = -block_.axes(v).leftCols(c).transpose() * moved;
      }
      ++column;
    }
  }
  return result;
}

/// Moves the poses by what forces and torques ask for, no faster than the block can follow. False if a body slides away
/// or turns over.
bool PartSolver::take_shift(const ContactAnswer& answer, const std::vector<PartTarget>& targets, Iterate& now) {
  Eigen::Index next = 0;
  now.edge_change = 0.0;
  const auto& vertices = block_.vertices();
  for (std::size_t b = 0; b < targets.size(); ++b) {
    Body& body = now.bodies[b];
    const PartTarget& target = targets[b];
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    for (int a = 0; a < 3; ++a) {
      if (target.forced[a]) shift[a] = answer.shift[next++];
    }
    for (int a = 0; a < 3; ++a) {
      if (target.turned[a]) turn[a] = answer.shift[next++];
    }
    if (!shift.allFinite() || !turn.allFinite() || shift.head<2>().norm() > 4.0 * gel_.thickness) {
      why_not_ = fmt::format("the object slides away by more than {:.3g} mm", 4.0 * gel_.thickness);
      return false;
    }
    const double depth = std::max(0.0, -body.gap.deepest);
    const double limit = std::min(0.98 * gel_.thickness, std::max(4.0 * depth, 0.02 * gel_.thickness));
    if (shift.z() < 0.0 && depth - shift.z() > limit) {
      if (depth > 0.97 * gel_.thickness && ++now.at_the_bottom > 20) {
        fail("the wanted force of {:.4g} N needs the object deeper than the gel's {:.4g} mm", target.force[2],
             gel_.thickness);
      }
      shift.z() = std::min(0.0, depth - limit);
      now.grew = true;  // not an answer yet
    }
    if (turn.squaredNorm() > 0.0) {
      if (turn.norm() > kLargestTurn) {
        turn *= kLargestTurn / turn.norm();
        now.grew = true;
      }
      body.turn += turn;
      if (body.turn.norm() > kMostTurn) {
        why_not_ = fmt::format("the object turns over: torque control has turned it by more than {} rad", kMostTurn);
        return false;
      }
      body.pose.rotation = turned_by(turn) * body.pose.rotation;
      now.edge_change = std::max(now.edge_change, turn.norm() * body.patch_radius);
    }
    body.pose.translation += shift;
    if (shift.squaredNorm() == 0.0) continue;
    if (!surface_.flat) now.edge_change = std::max(now.edge_change, shift.norm());
    for (std::size_t j = 0; j < vertices.size(); ++j) {
      const int v = vertices[j];
      if (now.owner[v] != static_cast<int>(b) || answer.state[j] == NodeState::open) continue;
      now.edge_change =
          std::max(now.edge_change, body.gap.edge[v] / surface_.weight[v] * std::abs(surface_.normals[v].dot(shift)));
    }
    // What the answer was found for: gaps moved along the normals, but not the edges' part.
    for (Eigen::Index v = 0; v < body.gap.weighted.size(); ++v) {
      if (!std::isfinite(body.gap.weighted[v])) continue;
      body.gap.weighted[v] += surface_.weight[v] * surface_.normals[static_cast<std::size_t>(v)].dot(shift);
    }
    if (surface_.flat) {
      body.gap.deepest += surface_.normals.front().dot(shift);
      body.gap.reach += surface_.normals.front().dot(shift);
    }
    // What sticks goes along.
    const Eigen::Vector3d& normal = body.lookup.normal;
    body.lookup.translation += shift - normal.dot(shift) * normal;
  }
  return true;
}

/// How far the lookups are from the contact patches' mean motions: `lookup_error`, and the residuals for the next ones.
void PartSolver::follow_patches(const ContactAnswer& answer, Iterate& now) const {
  const auto& vertices = block_.vertices();
  const auto m = static_cast<Eigen::Index>(vertices.size());
  std::fill(now.active.begin(), now.active.end(), 0);
  now.traction.setZero();
  // The gel's own response; `answer` holds that of gel and elastic bodies together.
  Eigen::VectorXd own = answer.response;
  if (elastic_) {
    own.setZero();
    for (Eigen::Index j = 0; j < answer.z.size(); ++j) {
      if (answer.z[j] != 0.0) own += answer.z[j] * block_.compliance().col(j);
    }
    for (Eigen::Index j = 0; j < m; ++j) {
      own.segment<3>(3 * j) -= block_.axes(vertices[j]).transpose() * relaxation_.carried(vertices[j]);
    }
    own /= relaxation_.stiffness();
  }
  now.weighted.resize(3 * m);
  for (Eigen::Index j = 0; j < m; ++j) {
    const int v = vertices[j];
    now.active[v] = answer.state[j] != NodeState::open;
    now.traction.segment<3>(3 * v) = block_.axes(v) * answer.z.segment<3>(3 * j);
    now.weighted.segment<3>(3 * j) = block_.axes(v) * own.segment<3>(3 * j);
  }
  now.warm = true;
  now.lookup_error = 0.0;
  for (std::size_t b = 0; b < now.bodies.size(); ++b) {
    Body& body = now.bodies[b];
    std::vector<int> mine;
    std::vector<Eigen::Vector3d> displacements;
    std::vector<double> pressures;
    for (Eigen::Index j = 0; j < m; ++j) {
      const int v = vertices[j];
      if (!now.active[v] || now.owner[v] != static_cast<int>(b)) continue;
      mine.push_back(v);
      displacements.push_back(now.weighted.segment<3>(3 * j) / surface_.weight[v]);
      pressures.push_back(std::max(0.0, answer.z[3 * j]) * surface_.weight[v]);
    }
    body.touching = !mine.empty();
    if (mine.empty()) continue;
    const PatchMotion patch = motion_of(mine, displacements, pressures);
    body.patch_radius = 0.0;
    for (const int v : mine) body.patch_radius = std::max(body.patch_radius, (gel_.vertices[v] - patch.centre).norm());
    // Both motions about the patch's centre: its translation's two components along the surface, and the spin.
    const Eigen::Vector3d at_centre = body.lookup.displacement(patch.centre);
    const Eigen::Vector3d first = block_.axes(mine.front()).col(1);
    const Eigen::Vector3d second = block_.axes(mine.front()).col(2);
    const Eigen::Vector3d missing = patch.translation - at_centre;
    const std::array<double, 3> residual = {first.dot(missing), second.dot(missing), patch.spin - body.lookup.spin};
    now.lookup_error =
        std::max(now.lookup_error, std::hypot(residual[0], residual[1]) + std::abs(residual[2]) * body.patch_radius);
    const std::array<double, 3> scale = {1.0, 1.0, body.patch_radius};
    // Aitken's rule for vectors (Irons and Tuck 1969) where the plain fixed point is slow.
    if (now.updates > kPlainUpdates && body.has_residual) {
      double cross = 0.0;
      double square = 0.0;
      for (int k = 0; k < 3; ++k) {
        const double difference = scale[k] * (residual[k] - body.last_residual[k]);
        cross += scale[k] * body.last_residual[k] * difference;
        square += difference * difference;
      }
      if (square > 0.0) body.relaxation = std::clamp(-body.relaxation * cross / square, 0.1, 1.0);
    }
    body.last_residual = residual;
    body.has_residual = true;
    PatchMotion next = patch;
    next.translation = at_centre + body.relaxation * (residual[0] * first + residual[1] * second);
    next.translation -= next.normal.dot(next.translation) * next.normal;
    next.spin = body.lookup.spin + body.relaxation * residual[2];
    body.next_lookup = next;
  }
}

/// The answer as a snapshot; nothing if a vertex outside the block may penetrate, which is then required, or if the gel
/// rises higher than was looked.
std::optional<PressSnapshot> PartSolver::accept(const ContactAnswer& answer, const PressSnapshot& from, Iterate& now,
                                                PartEffort& effort) {
  const int n = static_cast<int>(gel_.vertices.size());
  const auto& vertices = block_.vertices();
  std::vector<BodySnapshot> bodies(now.bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    bodies[b].pose = now.bodies[b].pose;
    bodies[b].turn = now.bodies[b].turn;
  }
  PressSnapshot next = untouched(std::move(bodies), n);
  next.known.assign(n, 0);
  for (std::size_t b = 0; b < now.bodies.size(); ++b) {
    next.bodies[b].overlapping = now.bodies[b].gap.deepest < 0.0;
    refuse_too_deep(now.bodies[b].gap.deepest);
  }
  double deepest = 0.0;
  double highest = 0.0;
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const auto j = static_cast<Eigen::Index>(k);
    const int v = vertices[k];
    next.known[v] = 1;
    next.weighted.segment<3>(3 * v) = now.weighted.segment<3>(3 * j);
    next.relative.segment<3>(3 * v) = block_.axes(v) * answer.response.segment<3>(3 * j);
    const double g = now.gap(v) + answer.response[3 * j];
    if (std::isfinite(g)) deepest = std::max(deepest, -g / surface_.weight[v]);
    highest = std::max(highest, surface_.normals[v].dot(now.weighted.segment<3>(3 * j)) / surface_.weight[v]);
    if (answer.state[k] == NodeState::open) continue;
    BodySnapshot& body = next.bodies[now.owner[v]];
    next.state[v] = answer.state[k];
    next.owner[v] = now.owner[v];
    const Eigen::Vector3d traction = now.traction.segment<3>(3 * v);
    next.traction.segment<3>(3 * v) = traction;
    body.force -= surface_.weight[v] * traction;
    // int phi (x + u) dA, exactly.
    Eigen::Vector3d arm = now.weighted.segment<3>(3 * j);
    for (Eigen::SparseMatrix<double>::InnerIterator it(gel_.mass, v); it; ++it) {
      arm += it.value() * gel_.vertices[static_cast<std::size_t>(it.row())];
    }
    body.moment -= arm.cross(traction);
    body.touching = true;
  }
  remember(from, next);
  for (const Body& body : now.bodies) {
    const double looked = body.gap.reach - std::max(0.0, body.gap.deepest);
    if (highest > looked) {
      now.reach = 2.0 * highest;
      now.grew = true;
    }
  }
  // Vertices beside the block that a body nearly reaches.
  for (int v = 0; v < n; ++v) {
    if (now.owner[v] < 0 || block_.place(v) >= 0) continue;
    const double gap = now.gap(v) / surface_.weight[v];
    if (gap > highest) continue;
    const double g = gap - surface_.normals[v].dot(weighted_at(next, v)) / surface_.weight[v];
    if (-g > lookup_mm_) {
      now.required[v] = 1;
      now.grew = true;
    }
    deepest = std::max(deepest, -g);
  }
  if (now.grew) return std::nullopt;
  if (relaxation_.on()) {  // the face isn't flat: a body may hang in the dent of an earlier press
    for (BodySnapshot& body : next.bodies) body.overlapping = false;
    for (int v = 0; v < n; ++v) {
      if (now.owner[v] < 0) continue;
      const double risen = surface_.normals[v].dot(next.weighted.segment<3>(3 * v)) / surface_.weight[v];
      if (now.bodies[now.owner[v]].gap.lowest[v] < risen) next.bodies[now.owner[v]].overlapping = true;
    }
  }
  next.penetration = deepest;
  next.lookup_error = now.lookup_error;
  next.residual = answer.residual;
  effort.candidates = std::max(effort.candidates, static_cast<int>(vertices.size()));
  return next;
}

/// With relaxation: what the gel remembers, and its displacement all over, by the one pass over the whole compliance.
void PartSolver::remember(const PressSnapshot& from, PressSnapshot& next) const {
  if (!relaxation_.on() || (from.history.empty() && !next.touching())) return;
  const auto n = static_cast<Eigen::Index>(gel_.vertices.size());
  Eigen::VectorXd elastic = Eigen::VectorXd::Zero(3 * n);
  for (Eigen::Index v = 0; v < n; ++v) {
    if (next.state[static_cast<std::size_t>(v)] == NodeState::open) continue;
    elastic.noalias() += gel_.surface.view().middleCols<3>(3 * v) * next.traction.segment<3>(3 * v);
  }
  next.history = relaxation_.after(from.history, next.traction, elastic);
  next.weighted = next.history.elastic.tail(3 * n);
  for (Eigen::Index v = 0; v < n; ++v) {
    char& known = next.known[static_cast<std::size_t>(v)];
    if (!known) next.relative.segment<3>(3 * v) = next.weighted.segment<3>(3 * v);
    known = 1;
  }
}

PressSnapshot PartSolver::apart(const PressSnapshot& from, std::vector<BodySnapshot> bodies, double seconds) {
  const int n = static_cast<int>(gel_.vertices.size());
  PressSnapshot next = untouched(std::move(bodies), n);
  relaxation_.begin(from.history, seconds, n);
  remember(from, next);
  next.relative = next.weighted;
  return next;
}

/// Whether the gel, not yet recovered from an earlier press, would stand out into a body if nothing touched it.
bool PartSolver::bulges_into(const Iterate& now) const {
  if (!relaxation_.on()) return false;
  for (int v = 0; v < static_cast<int>(gel_.vertices.size()); ++v) {
    const double out = -surface_.normals[v].dot(relaxation_.carried(v)) / relaxation_.stiffness();
    if (now.gap(v) < out) return true;
  }
  return false;
}

std::optional<PressSnapshot> PartSolver::solve(const PressSnapshot& from, const std::vector<PartTarget>& targets,
                                               double seconds, PartEffort& effort) {
  const int n = static_cast<int>(gel_.vertices.size());
  TS_ASSERT(targets.size() == bodies_.size() && from.bodies.size() == bodies_.size());
  bool z_forced = false;
  for (std::size_t b = 0; b < targets.size(); ++b) {
    std::array<bool, 6> axes{};
    std::copy(targets[b].forced.begin(), targets[b].forced.end(), axes.begin());
    std::copy(targets[b].turned.begin(), targets[b].turned.end(), axes.begin() + 3);
    if (axes != remembered_axes_[b]) memory_.forget();
    remembered_axes_[b] = axes;
    z_forced = z_forced || targets[b].forced[2];
  }
  Iterate now;
  begin(from, targets, now);
  relaxation_.begin(from.history, seconds, n);
  const auto out_of_contact = [&] {
    std::vector<BodySnapshot> bodies(now.bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      bodies[b].pose = now.bodies[b].pose;
      bodies[b].turn = now.bodies[b].turn;
    }
    return apart(from, std::move(bodies), seconds);
  };
  for (now.updates = 0; now.updates < kMostUpdates; ++now.updates) {
    look_up(now, targets, effort);
    const bool alone = std::none_of(now.active.begin(), now.active.end(), [](char x) { return x != 0; });
    if (!z_forced && alone && now.deepest >= 0.0 && !bulges_into(now)) return out_of_contact();
    for (int v = 0; v < n; ++v) {
      if (now.owner[v] < 0) now.active[v] = now.required[v] = 0;
    }
    if (block_.hold(candidates(now, z_forced))) {
      memory_.forget();
      now.weighted.resize(0);
    }
    const auto& vertices = block_.vertices();
    if (vertices.empty()) return out_of_contact();

    ContactProblem contact = problem(from, targets, now);
    relaxation_.prepare(contact, block_);
    const int c = contact.components;
    Eigen::VectorXd start(now.warm ? c * contact.gap.size() : 0);
    for (Eigen::Index j = 0; now.warm && j < contact.gap.size(); ++j) {
      const int v = vertices[j];
      start.segment(c * j, c) = block_.axes(v).leftCols(c).transpose() * now.traction.segment<3>(3 * v);
    }
    ContactAnswer answer =
        c == 1 ? solve_frictionless(contact, start, memory_) : solve_frictional(contact, start, traction_, memory_);
    effort.solves += answer.iterations;
    effort.factorisations += answer.factorisations;
    effort.sweeps += answer.sweeps;
    if (!answer.converged) {
      why_not_ = fmt::format("the contact laws are met to {:.2g} of the largest pressure only, with {} candidates",
                             answer.residual, vertices.size());
      return std::nullopt;
    }
    if (c == 1) widen(answer, compliance());
    relaxation_.finish(answer, block_);

    now.grew = false;
    if (!take_shift(answer, targets, now)) return std::nullopt;
    follow_patches(answer, now);
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      if (answer.state[k] == NodeState::open) continue;
      for (const int u : surface_.around[vertices[k]]) {
        if (block_.place(u) < 0 && now.owner[u] >= 0) {
          now.required[u] = 1;
          now.grew = true;
        }
      }
    }
    const double allowed = now.updates < kStrictUpdates ? lookup_mm_ : 100.0 * lookup_mm_;
    if (!now.grew && std::max(now.lookup_error, now.edge_change) <= allowed) {
      if (auto next = accept(answer, from, now, effort)) return next;
    }
    for (Body& body : now.bodies) {
      if (body.touching) body.lookup = body.next_lookup;
    }
  }
  why_not_ = fmt::format("the contact patch still moves by {:.2g} mm after {} updates of the geometry",
                         std::max(now.lookup_error, now.edge_change), kMostUpdates);
  return std::nullopt;
}

}  // namespace touchstone::fem
