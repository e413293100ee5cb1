// The gel and its contact against closed forms (contact_closed_forms.h) and against the theory of the element. Bounds
// are those of the issue that built it (Hertz 2 %, patch 1e-9), else about what the mesh of the row can give, as each
// row says; a finer mesh does better at its cost.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <utility>

#include "core/units.h"
#include "fem/compliance_cache.h"
#include "fem/press.h"
#include "fem/quadrature.h"
#include "fem/slab.h"
#include "fem/taylor_hood.h"
#include "lab/contact_closed_forms.h"
#include "lab/validation.h"

namespace touchstone::lab {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kModulus = 1.0;  // MPa

/// The gels that rows share; set up once, then read from the cache.
class Gels {
 public:
  explicit Gels(const ValidateOptions& options) : cache_(options.cache) {}

  /// 60 mm thick, 120 mm wide, fine in the middle: a half space to 1 % for contacts below 1.2 mm.
  fem::Compliance thick(double poisson_ratio) const {
    return square({120.0, 120.0, 60.0, 0.2, 14.0, 1.3, 1.3, 0.3}, poisson_ratio);
  }
  /// 5 mm thick, half-width 4 thicknesses.
  fem::Compliance layer(double poisson_ratio) const {
    return square({40.0, 40.0, 5.0, 0.4, 2.5, 2.4, 2.4, 0.6}, poisson_ratio);
  }
  /// 2 mm thick, half-width 6 thicknesses, evenly meshed: for loads all over its face.
  fem::Compliance even(double poisson_ratio) const {
    return square({24.0, 24.0, 2.0, 0.9, 0.9, 12.0, 12.0, 1.0}, poisson_ratio);
  }

 private:
  fem::Compliance square(const fem::SlabMesh& slab, double poisson_ratio) const {
    return fem::cached_compliance(slab, {kModulus, poisson_ratio}, {}, cache_);
  }

  std::filesystem::path cache_;
};

fem::PressTarget at(double x, double y, double z) {
  fem::PressTarget target;
  target.axis = {fem::AxisControl::at(x), fem::AxisControl::at(y), fem::AxisControl::at(z)};
  return target;
}

double relative(double value, double expected) {
  return std::abs(value / expected - 1.0);
}

double normal_force(const fem::Compliance& gel, const fem::ContactShape& shape, double z) {
  return fem::Press(gel, shape, 0.0).step(at(0.013, 0.021, z)).wrench[2];  // off the mesh's own symmetry
}

double hertz(const Gels& gels) {
  double worst = 0.0;
  for (double nu : {0.3, 0.4999}) {
    const fem::Compliance gel = gels.thick(nu);
    for (double depth : {0.05, 0.1, 0.15}) {
      worst = std::max(worst, relative(normal_force(gel, fem::SphereShape{8.0}, 8.0 - depth),
                                       hertz_force(kModulus, nu, 8.0, depth)));
    }
  }
  return worst;
}

double flat_punch(const Gels& gels) {
  double worst = 0.0;
  for (double nu : {0.3, 0.4999}) {
    worst = std::max(worst, relative(normal_force(gels.thick(nu), fem::RoundedCylinder{1.0, 0.0, 3.0}, -0.05),
                                     flat_punch_force(kModulus, nu, 1.0, 0.05)));
  }
  return worst;
}

/// The force of a sphere on a thick gel at nu = 0.4999 and 0.5 against the solution of integral equations there.
double locking(const Gels& gels) {
  double worst = 0.0;
  for (double nu : {0.4999, 0.5}) {
    const fem::Compliance gel = gels.thick(nu);
    worst = std::max(worst, relative(normal_force(gel, fem::SphereShape{8.0}, 8.0 - 0.15),
                                     sphere_on_layer(kModulus, nu, gel.thickness, 8.0, 0.15).force));
  }
  return worst;
}

double layer_sphere(const Gels& gels) {
  double worst = 0.0;
  for (double nu : {0.3, 0.49}) {
    const fem::Compliance gel = gels.layer(nu);
    for (double depth : {0.3, 0.5}) {
      worst = std::max(worst, relative(normal_force(gel, fem::SphereShape{8.0}, 8.0 - depth),
                                       sphere_on_layer(kModulus, nu, 5.0, 8.0, depth).force));
    }
  }
  return worst;
}

double layer_flat(const Gels& gels) {
  double worst = 0.0;
  for (double nu : {0.3, 0.49}) {
    worst = std::max(worst, relative(normal_force(gels.layer(nu), fem::RoundedCylinder{2.0, 0.0, 3.0}, -0.1),
                                     flat_punch_on_layer(kModulus, nu, 5.0, 2.0, 0.1).force));
  }
  const double hayes = 4.0 * kModulus / (2.0 * 1.3) * 2.0 * hayes_kappa(0.4) * 0.1 / (1.0 - 0.3);
  return std::max(worst, relative(normal_force(gels.layer(0.3), fem::RoundedCylinder{2.0, 0.0, 3.0}, -0.1), hayes));
}

/// Tangential displacement of a sphere at 30, 60 and 90 % of the shear that would slide it.
double cattaneo_mindlin(const Gels& gels) {
  constexpr double kFriction = 0.3;
  constexpr double kForce = 0.12;
  constexpr double kNu = 0.4999;  // normal and tangential loads don't couple, as the closed form assumes
  const fem::Compliance gel = gels.thick(kNu);
  fem::Press press(gel, fem::SphereShape{8.0}, kFriction);
  fem::PressTarget target = at(0, 0, 0);
  target.axis[2] = fem::AxisControl::with_force(kForce);
  const double a = hertz_contact_radius(8.0, 8.0 - press.step(target).gel_from_object.translation.z());
  double worst = 0.0;
  for (double share : {0.3, 0.6, 0.9}) {
    const double shear = share * kFriction * kForce;
    target.axis[0] = fem::AxisControl::with_force(-shear);
    worst = std::max(worst, relative(press.step(target).gel_from_object.translation.x(),
                                     mindlin_displacement(kModulus, kNu, a, shear, kFriction, kForce)));
  }
  return worst;
}

/// Surface displacements 0.7 to 1.2 mm from a force on one vertex; differences to those at the outer radius, so that
/// what the plate holds back below 60 mm falls out. Root mean square error over that of the closed form.
double point_force(const Gels& gels, int axis, const std::function<Vector3d(double, double)>& closed_form) {
  const fem::Compliance gel = gels.thick(0.3);
  const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(gel.mass.rows());
  const auto n = static_cast<Eigen::Index>(gel.vertices.size());
  Eigen::Index source = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (gel.vertices[i].norm() < gel.vertices[source].norm()) source = i;
  }
  Eigen::VectorXd traction = Eigen::VectorXd::Zero(3 * n);
  traction[3 * source + axis] = (axis == 2 ? -1.0 : 1.0) / weight[source];
  const Eigen::VectorXd response = gel.surface.view() * traction;
  Eigen::MatrixX3d difference(n, 3);
  Eigen::MatrixX3d expected(n, 3);
  int rows = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector3d from = gel.vertices[i] - gel.vertices[source];
    if (from.norm() < 0.7 || from.norm() > 1.2) continue;
    const Vector3d found = response.segment<3>(3 * i) / weight[i];
    expected.row(rows) = closed_form(from.x(), from.y()).transpose();
    difference.row(rows) = found.transpose() - expected.row(rows);
    ++rows;
  }
  const Eigen::RowVector3d held_back = difference.topRows(rows).colwise().mean();
  const auto error = difference.topRows(rows).rowwise() - held_back;
  return error.norm() / expected.topRows(rows).norm();
}

double boussinesq(const Gels& gels) {
  return point_force(gels, 2, [](double x, double y) { return boussinesq_displacement(kModulus, 0.3, 1.0, x, y); });
}

double cerruti(const Gels& gels) {
  return point_force(gels, 0, [](double x, double y) { return cerruti_displacement(kModulus, 0.3, 1.0, x, y); });
}

/// Displacement of the middle of the face under the tractions `load`: mean over the hats within 1 mm of the origin of
/// component `axis` over `shape`, least squares.
double response_in_the_middle(const fem::Compliance& gel, int axis,
                              const std::function<double(const Vector3d&)>& load) {
  const auto n = static_cast<Eigen::Index>(gel.vertices.size());
  const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(n);
  Eigen::VectorXd nodal(n);
  Eigen::VectorXd traction = Eigen::VectorXd::Zero(3 * n);
  for (Eigen::Index i = 0; i < n; ++i) traction[3 * i + axis] = nodal[i] = load(gel.vertices[i]);
  const Eigen::VectorXd response = gel.surface.view() * traction;
  const Eigen::VectorXd means = gel.mass * nodal;  // of the load, over the hats
  double product = 0.0;
  double square = 0.0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (gel.vertices[i].norm() > 2.0) continue;
    product += response[3 * i + axis] * means[i] / (weight[i] * weight[i]);
    square += means[i] * means[i] / (weight[i] * weight[i]);
  }
  return product / square;
}

/// A wide block under even pressure is confined, under even shear it shears.
double block(const Gels& gels) {
  double worst = 0.0;
  for (double nu : {0.0, 0.3}) {
    const fem::Compliance gel = gels.even(nu);
    const double shear_modulus = kModulus / (2.0 * (1.0 + nu));
    const double confined = 2.0 * shear_modulus * (1.0 - nu) / (1.0 - 2.0 * nu);
    const auto even = [](const Vector3d&) { return 1.0; };
    worst = std::max(worst, relative(response_in_the_middle(gel, 2, even), gel.thickness / confined));
    worst = std::max(worst, relative(response_in_the_middle(gel, 0, even), gel.thickness / shear_modulus));
  }
  return worst;
}

/// A pressure cos(kx) on the layer, at wave numbers 1 and 1.5 over the thickness.
double wavy(const Gels& gels) {
  double worst = 0.0;
  for (double nu : {0.3, 0.49}) {
    const fem::Compliance gel = gels.even(nu);
    for (double q : {1.0, 1.5}) {
      const double k = q / gel.thickness;
      const double wanted = 2.0 * (1.0 - nu * nu) / (kModulus * k) * bonded_layer_kernel(nu, q);
      const auto waves = [k](const Vector3d& x) { return std::cos(k * x.x()); };
      worst = std::max(worst, relative(response_in_the_middle(gel, 2, waves), wanted));
    }
  }
  return worst;
}

/// A cube of 2 mm below z = 0, bonded at its bottom, as cells^3 boxes of six tetrahedra each (Kuhn), inner vertices
/// pushed aside so that nothing is right by symmetry.
fem::TetMesh uneven_cube(int cells) {
  fem::TetMesh mesh;
  const auto index = [cells](int i, int j, int k) { return (k * (cells + 1) + j) * (cells + 1) + i; };
  for (int k = 0; k <= cells; ++k) {
    for (int j = 0; j <= cells; ++j) {
      for (int i = 0; i <= cells; ++i) {
        const std::array<int, 3> corner = {i, j, k};
        Vector3d x;
        for (int a = 0; a < 3; ++a) {
          const bool inner = corner[a] > 0 && corner[a] < cells;
          const double push = inner ? 0.1 * std::sin(7.0 * i + 3.0 * j + 5.0 * k + 2.0 * a) : 0.0;
          x[a] = 2.0 * (corner[a] + push) / cells - (a == 2 ? 2.0 : 1.0);
        }
        mesh.vertices.push_back(x);
      }
    }
  }
  constexpr std::array<std::array<int, 3>, 6> kOrders = {
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  for (int k = 0; k < cells; ++k) {
    for (int j = 0; j < cells; ++j) {
      for (int i = 0; i < cells; ++i) {
        for (const auto& order : kOrders) {
          std::array<int, 3> corner = {i, j, k};
          std::array<int, 4> tetrahedron = {index(i, j, k), 0, 0, 0};
          for (int step = 0; step < 3; ++step) {
            ++corner[order[step]];
            tetrahedron[step + 1] = index(corner[0], corner[1], corner[2]);
          }
          if (fem::volume(mesh, tetrahedron) < 0.0) std::swap(tetrahedron[2], tetrahedron[3]);
          mesh.tetrahedra.push_back(tetrahedron);
        }
      }
    }
  }
  for (const auto& face : fem::boundary_faces(mesh)) {
    const auto level = [&](double z) {
      return std::all_of(face.begin(), face.end(), [&](int v) { return std::abs(mesh.vertices[v].z() - z) < 1e-12; });
    };
    if (level(0.0)) mesh.outer.push_back(face);
    if (level(-2.0)) mesh.bonded.push_back(face);
  }
  return mesh;
}

/// A field without change of volume, u = (sin y e^z, cos z sin x, 0), with the pressure G sin(x + 2 y) cos z, at
/// nu = 0.5: what is left on a mesh in L2.
struct FieldErrors {
  double displacement = 0.0, pressure = 0.0;
};

FieldErrors manufactured(int cells) {
  const fem::ElasticMaterial material{kModulus, 0.5};
  const double shear = fem::shear_modulus(material);
  const auto displacement = [](const Vector3d& x) -> Vector3d {
    return {std::sin(x.y()) * std::exp(x.z()), std::cos(x.z()) * std::sin(x.x()), 0.0};
  };
  const auto pressure = [shear](const Vector3d& x) { return shear * std::sin(x.x() + 2.0 * x.y()) * std::cos(x.z()); };
  const fem::TetMesh mesh = uneven_cube(cells);
  const fem::TaylorHoodSpace space = fem::make_space(mesh);
  fem::ElasticLoads loads;
  loads.bonded_displacement = displacement;
  loads.body_force = [shear](const Vector3d& x) -> Vector3d {                    // -G laplace u + grad p
    const Vector3d laplace(0.0, -2.0 * std::cos(x.z()) * std::sin(x.x()), 0.0);  // sin y e^z is harmonic
    const double c = std::cos(x.x() + 2.0 * x.y());
    const double s = std::sin(x.x() + 2.0 * x.y());
    return -shear * laplace + shear * Vector3d(c * std::cos(x.z()), 2.0 * c * std::cos(x.z()), -s * std::sin(x.z()));
  };
  loads.traction = [&](const Vector3d& x, const Vector3d& normal) -> Vector3d {
    Matrix3d g = Matrix3d::Zero();
    g(0, 1) = std::cos(x.y()) * std::exp(x.z());
    g(0, 2) = std::sin(x.y()) * std::exp(x.z());
    g(1, 0) = std::cos(x.z()) * std::cos(x.x());
    g(1, 2) = -std::sin(x.z()) * std::sin(x.x());
    return shear * (g + g.transpose()) * normal - pressure(x) * normal;
  };
  const fem::ElasticSolution solution = fem::solve_elastic(space, material, loads);
  FieldErrors errors;
  for (int e = 0; e < static_cast<int>(mesh.tetrahedra.size()); ++e) {
    const double size = fem::volume(mesh, mesh.tetrahedra[e]);
    for (const auto& point : fem::tetrahedron_rule(6)) {
      Vector3d x = Vector3d::Zero();
      for (int k = 0; k < 4; ++k) x += point.barycentric[k] * mesh.vertices[mesh.tetrahedra[e][k]];
      errors.displacement +=
          point.weight * size *
          (fem::displacement_at(space, solution, e, point.barycentric) - displacement(x)).squaredNorm();
      errors.pressure +=
          point.weight * size * std::pow(fem::pressure_at(space, solution, e, point.barycentric) - pressure(x), 2);
    }
  }
  return {std::sqrt(errors.displacement), std::sqrt(errors.pressure)};
}

/// Largest nodal error of a linear field over its size, and of a rigid motion's stress over E: both must be nothing.
double patch(const Gels&) {
  const fem::TetMesh mesh = uneven_cube(3);
  const fem::TaylorHoodSpace space = fem::make_space(mesh);
  Matrix3d gradient;
  gradient << 0.010, -0.020, 0.005, 0.013, -0.004, 0.017, -0.008, 0.006, 0.011;
  double worst = 0.0;
  for (double nu : {0.0, 0.3, 0.49, 0.4999}) {
    const fem::ElasticMaterial material{kModulus, nu};
    const double shear = fem::shear_modulus(material);
    const Matrix3d stress = shear * (gradient + gradient.transpose()) +
                            shear * fem::lame_ratio(material) * gradient.trace() * Matrix3d::Identity();
    fem::ElasticLoads loads;
    loads.bonded_displacement = [&](const Vector3d& x) -> Vector3d { return gradient * x; };
    loads.traction = [&](const Vector3d&, const Vector3d& normal) -> Vector3d { return stress * normal; };
    const fem::ElasticSolution solution = fem::solve_elastic(space, material, loads);
    for (int node = 0; node < space.nodes; ++node) {
      const Vector3d error = solution.displacement.row(node).transpose() - gradient * space.position(node);
      worst = std::max(worst, error.cwiseAbs().maxCoeff() / gradient.norm());
    }
  }
  return worst;
}

double rigid_motion(const Gels&) {
  const fem::TetMesh mesh = uneven_cube(3);
  const fem::TaylorHoodSpace space = fem::make_space(mesh);
  double worst = 0.0;
  for (double nu : {0.0, 0.3, 0.5}) {
    const fem::ElasticMaterial material{kModulus, nu};
    const Vector3d spin(0.02, -0.03, 0.05);
    fem::ElasticLoads loads;
    loads.bonded_displacement = [&](const Vector3d& x) -> Vector3d { return Vector3d(1, 2, -1) + spin.cross(x); };
    const fem::ElasticSolution solution = fem::solve_elastic(space, material, loads);
    for (int e = 0; e < static_cast<int>(mesh.tetrahedra.size()); ++e) {
      const Matrix3d stress = fem::stress_at(space, material, solution, e, Eigen::Vector4d::Constant(0.25));
      worst = std::max(worst, stress.cwiseAbs().maxCoeff() / kModulus);
    }
  }
  return worst;
}

struct MechanicsCase {
  const char* id;
  const char* title;
  double bound;
  std::function<double(const Gels&)> error;
};

}  // namespace

std::vector<ValidationRow> validate_mechanics(const ValidateOptions& options) {
  const std::vector<MechanicsCase> cases = {
      {"mechanics.patch", "a linear field is exact, nu to 0.4999", 1e-9, patch},
      {"mechanics.rigid_motion", "a rigid motion's stress over E", 1e-11, rigid_motion},
      {"mechanics.hertz", "a sphere on a thick gel, nu 0.3 and 0.4999", 0.02, hertz},
      {"mechanics.locking", "a sphere at nu 0.4999 and 0.5 against integral equations", 0.02, locking},
      // A sharp edge's pressure is infinite: with five edges of the mesh a radius some percent are left.
      {"mechanics.flat_punch", "a sharp flat punch on a thick gel, five edges a radius", 0.035, flat_punch},
      {"mechanics.layer_sphere", "a sphere on a bonded layer against integral equations", 0.01, layer_sphere},
      {"mechanics.layer_flat", "a flat punch on a bonded layer: Hayes, integral equations", 0.02, layer_flat},
      {"mechanics.cattaneo_mindlin", "a sheared sphere's displacement to 90 % of sliding", 0.03, cattaneo_mindlin},
      // A force on one vertex is a cone of 0.4 mm, its response a mean over such a cone: (0.2/0.7)^2 / 4 of 1/r.
      {"mechanics.boussinesq", "a normal point force's surface displacement", 0.03, boussinesq},
      {"mechanics.cerruti", "a tangential point force's surface displacement", 0.03, cerruti},
      {"mechanics.block", "a wide block under even pressure and shear", 0.01, block},
      {"mechanics.wavy", "a wavy pressure on a bonded layer", 0.02, wavy},
  };
  const Gels gels(options);
  std::vector<ValidationRow> rows;
  const auto add = [&](const std::string& id, const std::string& title, double reference, double ours, Better better,
                       bool holds, double seconds) {
    static const std::string kPureNumber = "1";
    ValidationRow row;
    row.unit = kPureNumber;
    row.id = id;
    row.title = title;
    row.reference = reference;
    row.ours = ours;
    row.better = better;
    row.holds = holds;
    row.quick = options.quick;
    row.seconds = seconds;
    rows.push_back(row);
  };
  const auto since = [](std::chrono::steady_clock::time_point begun) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  };
  const std::int64_t steps = std::ssize(cases) + 1;
  for (const MechanicsCase& one : cases) {
    if (options.progress) options.progress("mechanics", std::ssize(rows), steps);
    const auto begun = std::chrono::steady_clock::now();
    const double error = one.error(gels);
    add(one.id, one.title, 0.0, error, Better::lower, error <= one.bound, since(begun));
  }
  if (options.progress) options.progress("mechanics", std::ssize(cases), steps);
  // Theory: third order in displacement, second in pressure (Boffi, Brezzi, Fortin, Mixed Finite Element Methods and
  // Applications, sec. 8.8).
  const auto begun = std::chrono::steady_clock::now();
  const int cells = options.quick ? 4 : 6;
  const FieldErrors coarse = manufactured(cells);
  const FieldErrors fine = manufactured(2 * cells);
  const double seconds = since(begun);
  const double displacement = std::log2(coarse.displacement / fine.displacement);
  const double pressure = std::log2(coarse.pressure / fine.pressure);
  add("mechanics.order_displacement", "order of the displacement's error in L2 at nu = 0.5", 3.0, displacement,
      Better::higher, displacement > 2.7, seconds);
  add("mechanics.order_pressure", "order of the pressure's error in L2 at nu = 0.5", 2.0, pressure, Better::higher,
      pressure > 1.8, seconds);
  return rows;
}

}  // namespace touchstone::lab
