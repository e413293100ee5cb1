#include "fem/elements/element.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "core/random.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

constexpr std::array kElements = {Element::taylor_hood, Element::quadratic_constant_pressure, Element::quadratic,
                                  Element::linear};
constexpr double kThickness = 1.0;

Compliance body(Element element, double poisson_ratio, int cells = 3) {
  const std::vector<ElasticMaterial> materials = {{0.33, poisson_ratio}};
  const std::vector<Bead> beads = {{{0.2, -0.1, -0.4}, 0.25}};
  return compute_compliance(fixtures::box_mesh({3, 2, kThickness}, 3 * cells / 2, cells, cells, 0.12), materials, beads,
                            kThickness, element);
}

/// int u.t dA, what a load works on the body.
double work(const Compliance& gel, const Eigen::VectorXd& traction) {
  return traction.dot(gel.surface.view() * traction);
}

/// With nu = 0 a bonded slab under pressure p is squeezed by p / E everywhere: a linear field, exact with any element.
TEST(Element, AnyOneHasUniformStressExactly) {
  for (const Element element : kElements) {
    SCOPED_TRACE(name_of(element));
    const Compliance gel = body(element, 0.0);
    Eigen::VectorXd traction = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(gel.vertices.size()));
    for (Eigen::Index k = 2; k < traction.size(); k += 3) traction[k] = -0.01;
    const Eigen::VectorXd moved = gel.surface.view() * traction;
    const double strain = -0.01 / 0.33;
    for (std::size_t i = 0; i < gel.vertices.size(); ++i) {
      const double weight = gel.mass.col(static_cast<Eigen::Index>(i)).sum();
      EXPECT_NEAR(moved[3 * static_cast<Eigen::Index>(i) + 2], weight * strain * kThickness, 1e-12);
      EXPECT_NEAR(moved[3 * static_cast<Eigen::Index>(i)], 0.0, 1e-12);
    }
    const Eigen::VectorXd bead = gel.beads.view() * traction;
    EXPECT_NEAR(bead[2], strain * (kThickness - 0.4), 1e-12);
  }
}

/// With nu = 0 nothing resists a change of volume but shear: a pressure has nothing to add.
TEST(Element, QuadraticOnesAreTheSameWithoutPressure) {
  const Compliance with = body(Element::taylor_hood, 0.0);
  for (const Element element : {Element::quadratic_constant_pressure, Element::quadratic}) {
    const Compliance without = body(element, 0.0);
    EXPECT_LT((with.surface.view() - without.surface.view()).norm(), 1e-11 * with.surface.view().norm());
    EXPECT_LT((with.beads.view() - without.beads.view()).norm(), 1e-11 * with.beads.view().norm());
  }
}

/// Least potential energy: the larger the space of displacements the more any load works; to count the mean of the
/// volume's change alone takes energy away.
TEST(Element, WorkGrowsWithTheSpace) {
  for (const double poisson_ratio : {0.0, 0.3, 0.49, 0.4999}) {
    SCOPED_TRACE(poisson_ratio);
    const Compliance linear = body(Element::linear, poisson_ratio);
    const Compliance quadratic = body(Element::quadratic, poisson_ratio);
    const Compliance constant = body(Element::quadratic_constant_pressure, poisson_ratio);
    RandomStream random(3, 1, Purpose::kTest);
    for (int load = 0; load < 20; ++load) {
      Eigen::VectorXd traction(3 * static_cast<Eigen::Index>(linear.vertices.size()));
      for (double& one : traction) one = random.normal();
      EXPECT_LT(work(linear, traction), work(quadratic, traction));
      EXPECT_LE(work(quadratic, traction), work(constant, traction) * (1.0 + 1e-10));
    }
  }
}

/// How much too stiff a mesh is under a smooth load, beside Taylor-Hood on the same mesh.
double stiffer(Element element, double poisson_ratio, int cells) {
  const Compliance gel = body(element, poisson_ratio, cells);
  const Compliance peer = body(Element::taylor_hood, poisson_ratio, cells);
  Eigen::VectorXd traction = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(gel.vertices.size()));
  for (std::size_t i = 0; i < gel.vertices.size(); ++i) {
    traction[3 * static_cast<Eigen::Index>(i) + 2] = -std::exp(-4.0 * gel.vertices[i].squaredNorm());
  }
  return work(peer, traction) / work(gel, traction) - 1.0;
}

TEST(Element, AllConvergeWhereTheGelIsCompressible) {
  for (const Element element : {Element::quadratic_constant_pressure, Element::quadratic, Element::linear}) {
    SCOPED_TRACE(name_of(element));
    EXPECT_LT(std::abs(stiffer(element, 0.3, 8)), 0.5 * std::abs(stiffer(element, 0.3, 4)));
  }
}

/// Twenty times as little volume may change: what has no pressure of its own gets stiffer by it, what has not.
TEST(Element, ElementsWithoutPressureLock) {
  const double linear = stiffer(Element::linear, 0.4999, 4);
  const double quadratic = stiffer(Element::quadratic, 0.4999, 4);
  EXPECT_GT(linear, 3.0 * stiffer(Element::linear, 0.3, 4));
  EXPECT_GT(quadratic, 3.0 * stiffer(Element::quadratic, 0.3, 4));
  EXPECT_GT(linear, 10.0 * quadratic);
  EXPECT_LT(std::abs(stiffer(Element::quadratic_constant_pressure, 0.4999, 4)), 0.5 * quadratic);
}

TEST(Element, HasFewerUnknownsWhereItIsSimpler) {
  const int taylor_hood = body(Element::taylor_hood, 0.49).report.unknowns;
  const int quadratic = body(Element::quadratic, 0.49).report.unknowns;
  const Compliance linear = body(Element::linear, 0.49);
  EXPECT_LT(quadratic, taylor_hood);
  EXPECT_LT(4 * linear.report.unknowns, quadratic);
  EXPECT_LT(10.0 * linear.report.operations, body(Element::quadratic, 0.49).report.operations);
}

}  // namespace
}  // namespace touchstone::fem
