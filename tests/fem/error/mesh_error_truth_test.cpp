// Are the error estimates honest? Presses on a mesh against the same presses on one two and a half times as fine.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "core/random.h"
#include "fem/error/mesh_error.h"
#include "fem/error/press_error.h"

namespace touchstone::fem {
namespace {

using Eigen::Vector3d;

constexpr double kEdge = 0.5;

struct Gels {
  Compliance gel;
  Compliance fine;
  Eigen::SparseMatrix<double> transfer;  ///< fields on the fine surface to the coarse one's vertices
};

/// P1 on the flat surface of `from`, at the vertices of `to`.
Eigen::SparseMatrix<double> transfer(const Compliance& from, const Compliance& to) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t v = 0; v < to.vertices.size(); ++v) {
    double best = -std::numeric_limits<double>::infinity();
    std::array<int, 3> corners{};
    Vector3d weights;
    for (const auto& t : from.triangles) {
      const Vector3d& p = to.vertices[v];
      const Vector3d &a = from.vertices[t[0]], &b = from.vertices[t[1]], &c = from.vertices[t[2]];
      const double area = (b - a).cross(c - a).z();
      const Vector3d w((b - p).cross(c - p).z() / area, (c - p).cross(a - p).z() / area,
                       (a - p).cross(b - p).z() / area);
      if (w.minCoeff() > best) {
        best = w.minCoeff();
        corners = t;
        weights = w;
      }
    }
    for (int k = 0; k < 3; ++k) entries.emplace_back(static_cast<int>(v), corners[k], weights[k]);
  }
  Eigen::SparseMatrix<double> result(static_cast<Eigen::Index>(to.vertices.size()),
                                     static_cast<Eigen::Index>(from.vertices.size()));
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

const Gels& gels() {
  static const Gels gels = [] {
    const ElasticMaterial material{1.0, 0.49};
    const std::vector<Bead> beads = {{{0.3, 0.2, -0.6}, 0.2}, {{-0.7, 0.1, -0.6}, 0.2}};
    const SlabMesh slab{12.0, 12.0, 3.0, kEdge, 1.4, 2.8, 2.8, 0.9};
    const SlabMesh fine{12.0, 12.0, 3.0, 0.2, 0.8, 2.2, 2.2, 0.5};
    Gels made;
    made.gel = compute_compliance(mesh_slab(slab), material, beads, slab.thickness);
    made.gel.mesh_error = measure_mesh_error(made.gel, ladder_of(slab, material, beads));
    made.fine = compute_compliance(mesh_slab(fine), material, beads, fine.thickness);
    made.transfer = transfer(made.fine, made.gel);
    return made;
  }();
  return gels;
}

enum class Body { sphere, punch, box, sheared_sphere };

PressState press(const Compliance& gel, Body body, double radius, double x, double y, double turn) {
  const double depth = std::min(0.25 * radius, 0.3);
  PressTarget target;
  ContactShape shape;
  double z = -depth;
  if (body == Body::punch) {
    shape = RoundedCylinder{radius, 0.0, 5.0};
  } else if (body == Body::box) {
    shape = BoxShape{{2.0 * radius, 1.5 * radius, 4.0}};
    target.rotation = Eigen::AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix();
    z = 2.0 - depth;
  } else {
    const double sphere = radius * radius / depth;
    shape = SphereShape{sphere};
    z = sphere - depth;
  }
  Press one(gel, shape, body == Body::sheared_sphere ? 0.5 : 0.0);
  target.axis = {AxisControl::at(x), AxisControl::at(y), AxisControl::at(z)};
  one.step(target);
  if (body == Body::sheared_sphere) {
    target.axis[0] = AxisControl::at(x + 0.15 * depth);
    one.step(target);
  }
  return one.state();
}

/// True error over estimate, of each quantity, sorted, over random presses.
std::map<std::string, std::vector<double>> ratios(Body body) {
  const auto& [gel, fine, to_gel] = gels();
  const Eigen::VectorXd weight = gel.mass * Eigen::VectorXd::Ones(gel.mass.cols());
  RandomStream random(11, static_cast<std::uint64_t>(body), Purpose::kTest);
  std::map<std::string, std::vector<double>> result;
  for (int k = 0; k < 30; ++k) {
    const double radius = 1.2 * kEdge * std::pow(3.2, random.uniform());  // 1.2 to 3.8 edges
    const double x = 0.8 * random.uniform() - 0.4;
    const double y = 0.8 * random.uniform() - 0.4;
    const double turn = 3.0 * random.uniform();
    const PressState ours = press(gel, body, radius, x, y, turn);
    const PressState truth = press(fine, body, radius, x, y, turn);
    const PressError error = estimate_error(gel, ours);
    result["force"].push_back(std::abs(ours.wrench[2] - truth.wrench[2]) / error.force.z());
    if (body == Body::sheared_sphere) {
      result["shear"].push_back(std::abs(ours.wrench[0] - truth.wrench[0]) / error.force.x());
    }
    const Eigen::MatrixX3d moved = ours.surface_displacement - to_gel * truth.surface_displacement;
    const Eigen::MatrixX3d pulled = ours.traction - to_gel * truth.traction;
    double squares = 0.0;
    double near = 0.0;
    for (Eigen::Index v = 0; v < weight.size(); ++v) {
      if ((gel.vertices[static_cast<std::size_t>(v)] - Vector3d(x, y, 0.0)).norm() > 2.0 * radius) continue;
      squares += weight[v] * moved.row(v).squaredNorm();
      near += weight[v];
    }
    result["displacement"].push_back(std::sqrt(squares / near) / error.displacement);
    result["beads"].push_back((ours.bead_displacement - truth.bead_displacement).rowwise().norm().maxCoeff() /
                              error.beads);
    result["traction"].push_back(std::sqrt(weight.dot(pulled.rowwise().squaredNorm()) / ours.contact_area) /
                                 error.traction);
  }
  for (auto& [name, values] : result) std::sort(values.begin(), values.end());
  return result;
}

double root_mean_square(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

class HonestError : public ::testing::TestWithParam<Body> {};

TEST_P(HonestError, IsTheRootMeanSquareOfTheTrueOne) {
  for (const auto& [name, values] : ratios(GetParam())) {
    const double all = root_mean_square(values);
    std::printf("%-13s true over estimated: root mean square %.2f, median %.2f, largest %.2f\n", name.c_str(), all,
                values[values.size() / 2], values.back());
    EXPECT_GT(all, 0.3) << name;
    EXPECT_LT(all, 1.6) << name;
    EXPECT_LT(values.back(), 3.0) << name;
  }
}

std::string name_of(const ::testing::TestParamInfo<Body>& test) {
  constexpr std::array<const char*, 4> kNames = {"Sphere", "Punch", "Box", "ShearedSphere"};
  return kNames[static_cast<std::size_t>(test.param)];
}

INSTANTIATE_TEST_SUITE_P(Bodies, HonestError,
                         ::testing::Values(Body::sphere, Body::punch, Body::box, Body::sheared_sphere), name_of);

}  // namespace
}  // namespace touchstone::fem
