// The hard cases of what the gel is pressed with: 35 (a socket that fits it) and 36 (tips and edges far narrower than
// the mesh). What a good program does with each stands in script/hard_cases_page.py.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "closed_forms/contact_closed_forms.h"
#include "core/units.h"
#include "fem/contact/press.h"
#include "fem/mesh/gel_body.h"
#include "tests/hard_cases/hard_case.h"
#include "tests/support/press_steps.h"

namespace touchstone::fem {
namespace {

using test::did;
using test::target_at;
using test::Worst;

// A dome of 12 mm radius, and a socket like a watch glass laid over it.
constexpr double kDome = 12.0;

Compliance dome_gel(double fine) {
  DomeGel dome;
  dome.sphere_radius = kDome;
  dome.base_radius = 4.0;
  dome.thickness = 3.0;
  dome.fine = fine;
  dome.coarse = 2.0 * fine;
  dome.fine_radius = 3.4;
  dome.fine_depth = 0.8;
  return compute_compliance(mesh_gel(dome), ElasticMaterial{1.0, 0.48}, {}, thickness_of(dome));
}

/// Its hollow has this radius in the middle.
ShellShape socket_of(double radius) {
  return {{6.0, 6.0}, 1.0, Eigen::Vector2d::Constant(-1.0 / radius)};
}

/// A dome's triangles lie up to edge^2 / (6 radius) under its sphere, here a tenth of the depth on the coarsest mesh,
/// which is most of the difference of two meshes.
TEST(HardCase35, ASocketThatFitsTheGelConvergesToNoClearance) {
  constexpr double kDepth = 0.15;
  constexpr double kClearances[] = {0.5, 0.2, 0.05, 0.01, 0.001, 0.0};
  constexpr double kEdges[] = {0.9, 0.63, 0.44};
  std::array<std::array<double, 6>, 3> force{};
  std::array<double, 6> area{};
  Worst penetration{1e-5};
  Worst cone{1e-8};
  for (std::size_t m = 0; m < 3; ++m) {
    const Compliance gel = dome_gel(kEdges[m]);
    for (std::size_t c = 0; c < 6; ++c) {
      for (const double friction : {0.5, 0.0}) {
        if (friction > 0.0 && m == 2) continue;
        Press press(gel, socket_of(kDome * (1.0 + kClearances[c])), friction);
        const PressState& state = press.step(target_at(0.02, 0.03, -kDepth));
        EXPECT_TRUE(state.traction.allFinite());
        EXPECT_LT(penetration(state.largest_penetration), penetration.bar);
        EXPECT_LT(state.largest_tension, 1e-10);
        EXPECT_LT(cone(state.cone_violation), cone.bar);
        force[m][c] = state.wrench[2];
        area[c] = state.contact_area;
      }
    }
  }
  Worst first{0.1};  // both chosen after they had been seen
  Worst last{0.06};
  for (std::size_t c = 0; c < 6; ++c) {
    EXPECT_LT(first(std::abs(force[1][c] / force[0][c] - 1.0)), first.bar) << kClearances[c];
    EXPECT_LT(last(std::abs(force[2][c] / force[1][c] - 1.0)), last.bar) << kClearances[c];
    if (c > 0) {
      EXPECT_GT(force[2][c], force[2][c - 1]) << kClearances[c];
    }
    did("a socket {} larger in radius than the dome, {} mm deep: {:.4g} N on {:.3g} mm^2", kClearances[c], kDepth,
        force[2][c], area[c]);
  }
  EXPECT_LT(force[2][5] / force[2][4] - 1.0, 0.01);  // a thousandth more than none is as good as none
  did("edges of 0.9, 0.63 and 0.44 mm: from mesh to mesh force changes by at most {} and {}, relative; penetration {}, "
      "friction cone {}",
      first.text(), last.text(), penetration.text("mm"), cone.text());
}

constexpr double kThickness = 2.0;
constexpr double kNu = 0.45;

Compliance slab_gel(double fine) {
  const SlabMesh slab{9.0, 9.0, kThickness, fine, 1.2, 1.0, 1.0, 0.6};
  return compute_compliance(mesh_slab(slab), {1.0, kNu}, {}, kThickness);
}

/// Eight places spread over a mesh's triangles.
Eigen::Vector2d place(int k, double edge) {
  return edge * Eigen::Vector2d(0.618 * k - std::floor(0.618 * k) - 0.5, 0.755 * k - std::floor(0.755 * k) - 0.5);
}

constexpr int kPlaces = 8;

TEST(HardCase36, AConeMeetsTheLayersTheoryAsTheMeshGetsFiner) {
  constexpr double kDepth = 0.4;
  const double half_angle = 60.0 * kRadiansPerDegree;
  const auto slope = [&](double) { return 1.0 / std::tan(half_angle); };
  const closed_forms::LayerContact wanted = closed_forms::profile_on_layer(1.0, kNu, kThickness, slope, kDepth, 3.0);
  // The theory on a half space: F = 2 E* d^2 tan(angle to the axis) / pi [Sneddon1965], a = 2 d tan / pi.
  const closed_forms::LayerContact deep = closed_forms::profile_on_layer(1.0, kNu, 400.0, slope, kDepth, 3.0);
  const double love = 2.0 / kPi / (1.0 - kNu * kNu) * kDepth * kDepth * std::tan(half_angle);
  EXPECT_NEAR(deep.force / love, 1.0, 5e-3);
  EXPECT_NEAR(deep.contact_radius / (2.0 / kPi * kDepth * std::tan(half_angle)), 1.0, 5e-3);
  double before = 1.0;
  for (const double edge : {0.5, 0.28}) {
    const Compliance gel = slab_gel(edge);
    double square = 0.0;
    int marked = 0;
    for (int k = 0; k < kPlaces; ++k) {
      Press press(gel, ConeShape{half_angle, 2.0, 0.0}, 0.0);
      const Eigen::Vector2d at = place(k, edge);
      const PressState& state = press.step(target_at(at.x(), at.y(), -kDepth));
      EXPECT_TRUE(state.traction.allFinite());
      square += std::pow(state.wrench[2] / wanted.force - 1.0, 2) / kPlaces;
      marked += state.under_resolved;
    }
    EXPECT_LT(std::sqrt(square), before) << edge;
    before = std::sqrt(square);
    did("a cone of 60 degrees to its axis, contact {:.2g} edges in radius: force {:.2g} from the theory's, relative; "
        "{} "
        "of {} presses are marked as under-resolved",
        wanted.contact_radius / edge, before, marked, kPlaces);
  }
  EXPECT_LT(before, 0.05);
}

/// Contact far narrower than an edge: an answer that is finite and says that it's coarse. A needle is loaded wherever
/// it stands; a sharp tip may get no force between the lines along which gaps are looked up, and is marked even then.
TEST(HardCase36, NeedlesAndSteepConesAreMarked) {
  const Compliance gel = slab_gel(0.5);
  const ContactShape needle = RoundedCylinder{0.02, 0.0, 4.0};
  const ContactShape cone = ConeShape{10.0 * kRadiansPerDegree, 4.0, 0.0};
  const ContactShape quill = ConeShape{5.0 * kRadiansPerDegree, 4.0, 0.01};
  for (const auto& [what, shape] : {std::pair{"a needle of 0.02 mm radius", needle},
                                    {"a cone of 10 degrees", cone},
                                    {"a quill of 5 degrees", quill}}) {
    int loaded = 0;
    int presses = 0;
    double least = 1e9;
    double most = 0.0;
    for (int k = 0; k < kPlaces; ++k) {
      for (const double tilt : {0.0, 0.2}) {
        Press press(gel, shape, 0.0);
        const Eigen::Vector2d at = place(k, 0.5);
        double before = 0.0;
        for (const double depth : {0.02, 0.1, 0.2}) {
          PressTarget target = target_at(at.x(), at.y(), -depth);
          target.rotation = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()).toRotationMatrix();
          const PressState& state = press.step(target);
          EXPECT_TRUE(state.traction.allFinite());
          EXPECT_TRUE(state.under_resolved) << what << ' ' << k << ' ' << tilt << ' ' << depth;
          EXPECT_GE(state.wrench[2], before) << what << ' ' << k << ' ' << tilt << ' ' << depth;
          before = state.wrench[2];
          ++presses;
          loaded += state.wrench[2] > 0.0;
        }
        if (tilt == 0.0) {
          least = std::min(least, before);
          most = std::max(most, before);
        }
      }
    }
    if (std::holds_alternative<RoundedCylinder>(shape)) {
      EXPECT_EQ(loaded, presses);
    }
    did("{} at {} places, upright and tilted by 0.2 rad: all {} presses are marked as under-resolved, {} have a force; "
        "upright and 0.2 mm deep {:.2g} to {:.2g} N",
        what, kPlaces, presses, loaded, least, most);
  }
  did("theory: {:.2g} N under the needle, {:.2g} N under the cone",
      closed_forms::flat_punch_on_layer(1.0, kNu, kThickness, 0.02, 0.2).force,
      2.0 / kPi / (1.0 - kNu * kNu) * 0.04 * std::tan(10.0 * kRadiansPerDegree));
}

/// Force per length of an endless wedge on the layer, by what the layer's kernel says of plane strain: pressures of
/// strips [Johnson1985, sec. 5.2 for the half space] whose gaps close by Gauss and Seidel's iteration.
struct PlaneContact {
  double force = 0.0;       // N/mm
  double half_width = 0.0;  // mm
};

PlaneContact wedge_on_layer(double nu, double thickness, double slope, double depth) {
  constexpr double kStrip = 0.01;
  constexpr int kStrips = 101;  // odd
  const double modulus = 1.0 / (1.0 - nu * nu);
  std::array<double, kStrips> response{};  // at a distance, by unit pressure on a strip
  const double step = 0.1 / thickness;
  for (double k = 0.5 * step; k < 100.0 / kStrip; k += step) {
    const double half = 0.5 * k * kStrip;
    const double weight =
        step / kPi * 2.0 / (modulus * k) * closed_forms::bonded_layer_kernel(nu, k * thickness) * std::sin(half) / half;
    for (int d = 0; d < kStrips; ++d)
      response[static_cast<std::size_t>(d)] += weight * kStrip * std::cos(k * d * kStrip);
  }
  std::array<double, kStrips> pressure{};
  for (int sweep = 0; sweep < 3000; ++sweep) {
    for (int i = 0; i < kStrips; ++i) {
      double gap = slope * std::abs(i - kStrips / 2) * kStrip - depth;
      for (int j = 0; j < kStrips; ++j) {
        gap += response[static_cast<std::size_t>(std::abs(i - j))] * pressure[static_cast<std::size_t>(j)];
      }
      double& p = pressure[static_cast<std::size_t>(i)];
      p = std::max(0.0, p - gap / response[0]);
    }
  }
  PlaneContact result;
  for (const double p : pressure) {
    result.force += p * kStrip;
    result.half_width += p > 0.0 ? 0.5 * kStrip : 0.0;
  }
  return result;
}

TEST(HardCase36, AKnifesEdgeMeetsThePlaneTheoryAsTheMeshGetsFiner) {
  constexpr double kDepth = 0.25;
  const PlaneContact wanted = wedge_on_layer(kNu, kThickness, 1.0, kDepth);
  // On a half space a wedge's force per length is E* a cot(angle to its plane of symmetry) [Johnson1985, sec. 5.2]; the
  // layer is ten times as thick as the contact is wide, or nearly.
  EXPECT_NEAR(wanted.force / (wanted.half_width / (1.0 - kNu * kNu)), 1.0, 0.1);
  double before = 1.0;
  constexpr int kPlaces = 4;
  for (const double edge : {0.4, 0.22}) {
    const SlabMesh slab{7.0, 11.0, kThickness, edge, 1.2, 0.7, 1.6, 0.6};
    const Compliance gel = compute_compliance(mesh_slab(slab), {1.0, kNu}, {}, kThickness);
    double square = 0.0;
    int marked = 0;
    for (int k = 0; k < kPlaces; ++k) {
      Press press(gel, BoxShape{{1.5, 10.0, 1.5}}, 0.0);
      PressTarget target = target_at(place(k, edge).x(), 0.0, 0.75 * std::sqrt(2.0) - kDepth);
      target.rotation = Eigen::AngleAxisd(0.25 * kPi, Eigen::Vector3d::UnitY()).toRotationMatrix();
      const PressState& state = press.step(target);
      EXPECT_TRUE(state.traction.allFinite());
      // Per length in the middle, as a mean of triangular weight.
      const Eigen::VectorXd load = gel.mass * state.traction.col(2);
      double force = 0.0;
      for (std::size_t v = 0; v < gel.vertices.size(); ++v) {
        force -= load[static_cast<Eigen::Index>(v)] * std::max(0.0, 1.0 - std::abs(gel.vertices[v].y()));
      }
      square += std::pow(force / wanted.force - 1.0, 2) / kPlaces;
      marked += state.under_resolved;
    }
    EXPECT_LT(std::sqrt(square), before) << edge;
    before = std::sqrt(square);
    EXPECT_EQ(marked, kPlaces);  // never wider than an edge or two
    const double edges = wanted.half_width / edge;
    did("a knife's edge of 90 degrees, contact {:.2g} edges in half width: force per length {:.2g} from the plane "
        "theory's, relative; {} of {} presses are marked as under-resolved",
        edges, before, marked, kPlaces);
  }
  EXPECT_LT(before, 0.05);
}

}  // namespace
}  // namespace touchstone::fem
