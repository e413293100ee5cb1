#include "fem/finite_strain/finite_tangent.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "fem/finite_strain/finite_contact.h"
#include "tests/fem/mesh/box_mesh.h"

namespace touchstone::fem {
namespace {

constexpr double kRadius = 5.0;

/// A pad with a sphere 0.2 mm in its undeformed surface, and the vertices of it that have a gap.
struct Touch {
  FiniteGel gel;
  FiniteSnapshot at;
  std::vector<int> vertices;
  std::vector<Eigen::Matrix3d> axes;

  Touch()
      : gel(fixtures::box_mesh({8, 8, 3}, 8, 8, 4), std::vector<ElasticMaterial>{{0.33, 0.49}}, {}, 3.0),
        at(untouched(gel, {{}})),
        axes(gel.rest.vertices.size(), Eigen::Matrix3d::Identity()) {
    const double depth = 0.2;
    RigidTransform& pose = at.bodies.front().pose;
    pose.translation.z() = kRadius - depth;
    const SphereShape ball{kRadius};
    const GapLines lines = gap_lines(gel.space, gel.outer, at.elastic.displacement, ball, pose, depth);
    at.gap = deformed_gap(gel.space, gel.outer, gel.rest.weight, lines, at.elastic.displacement, ball, pose, depth,
                          at.pressure);
    for (int v = 0; v < static_cast<int>(axes.size()); ++v) {
      if (std::isfinite(at.gap.weighted[v])) at.owner[v] = 0;
      if (at.owner[v] == 0 && gel.rest.vertices[v].head<2>().norm() < 2.5) vertices.push_back(v);
    }
  }
};

const Touch& touch() {
  static const Touch one;
  return one;
}

TEST(FiniteTangent, HasTheSameComplianceWithVerticesAddedToIt) {
  const Touch& t = touch();
  for (const int components : {1, 3}) {
    for (const std::vector<LedAxis>& led :
         {std::vector<LedAxis>{}, std::vector<LedAxis>{{0, 2, 1.0}}, std::vector<LedAxis>{{0, 0, 5.0}, {0, 4, 5.0}}}) {
      const FiniteTangent all = finite_tangent(t.gel, t.at, t.axes, t.vertices, components, led);
      std::vector<int> some, others;
      for (std::size_t k = 0; k < t.vertices.size(); ++k) (k % 3 == 1 ? others : some).push_back(t.vertices[k]);
      ASSERT_FALSE(others.empty());
      const FiniteTangent first = finite_tangent(t.gel, t.at, t.axes, some, components, led);
      const FiniteTangent wider = with_vertices(first, t.gel, t.at, t.axes, others);
      EXPECT_EQ(wider.block, all.block);
      EXPECT_EQ(wider.led, led);
      EXPECT_LT((wider.compliance - all.compliance).cwiseAbs().maxCoeff(), 1e-4 * all.compliance.cwiseAbs().maxCoeff());
      EXPECT_EQ(wider.compliance, Eigen::MatrixXd(wider.compliance.transpose()));
    }
  }
}

TEST(FiniteTangent, LeavesOutWhatHasNoGapAnyMore) {
  const Touch& t = touch();
  const FiniteTangent all = finite_tangent(t.gel, t.at, t.axes, t.vertices, 1, {});
  FiniteSnapshot at = t.at;
  at.gap.weighted[t.vertices[2]] = std::numeric_limits<double>::infinity();
  const FiniteTangent wider = with_vertices(all, t.gel, at, t.axes, {t.vertices[0]});
  EXPECT_EQ(wider.block.size() + 1, t.vertices.size());
  EXPECT_EQ(wider.compliance(2, 3), all.compliance(3, 4));
}

/// S = B T^-1 B^T becomes B (T + B_H^T k B_H)^-1 B^T; tractions that close the held gaps close them in both.
TEST(FiniteTangent, AHoldIsAStiffnessAndChangesNoAnswer) {
  constexpr int kUnknowns = 9;
  constexpr int kRows = 5;
  Eigen::MatrixXd own(kUnknowns, kUnknowns), rows(kRows, kUnknowns);
  for (int i = 0; i < kUnknowns; ++i) {
    for (int j = 0; j < kUnknowns; ++j) own(i, j) = std::sin(1.0 + 3.0 * std::min(i, j) + 7.0 * std::max(i, j));
    own(i, i) += i == 0 ? -4.0 : 6.0;  // indefinite: unstable under dead load
    for (int r = 0; r < kRows; ++r) rows(r, i) = std::cos(1.3 * r * r + i * (r + 1.0));
  }
  const std::vector<int> held = {0, 2, 3};
  const Eigen::Vector3d stiffness{500.0, 800.0, 300.0};
  ContactLaws laws{rows * own.inverse() * rows.transpose(), Eigen::VectorXd::LinSpaced(kRows, -1.0, 2.0)};
  const ContactLaws stiff = held_stiffly(laws, held, stiffness);
  const Eigen::MatrixXd taken = rows(held, Eigen::all);
  const Eigen::MatrixXd expected =
      rows * (own + taken.transpose() * stiffness.asDiagonal() * taken).inverse() * rows.transpose();
  EXPECT_LT((stiff.compliance - expected).norm(), 1e-9 * laws.compliance.norm());
  const Eigen::VectorXd z = laws.compliance(held, held).partialPivLu().solve(-laws.ahead(held));
  const Eigen::VectorXd closed = stiff.ahead + stiff.compliance(Eigen::all, held) * z;
  const Eigen::VectorXd wanted = laws.ahead + laws.compliance(Eigen::all, held) * z;
  EXPECT_LT((closed - wanted).norm(), 1e-9 * laws.ahead.norm());
  EXPECT_EQ(held_stiffly(laws, {}, Eigen::VectorXd()).compliance, laws.compliance);
}

}  // namespace
}  // namespace touchstone::fem
