// The gel that the first sensor is made of, at its own size.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "fem/elements/compliance.h"
#include "fem/mesh/slab.h"
#include "tests/fem/elements/gaussian_work.h"
#include "tests/fem/fine_relief/layer_kernel.h"

namespace touchstone::fem {
namespace {

TEST(VhsGel, IsSoundAndNearTheInfiniteLayer) {
  const SlabMesh slab;  // 20 x 20 x 5 mm, 0.5 to 1.5 mm: the defaults are this gel's
  const ElasticMaterial material{0.33, 0.49};
  std::vector<Bead> beads;
  for (const int y : {-2, 0, 2}) {
    for (const int x : {-2, 0, 2}) {
      beads.push_back({{static_cast<double>(x), static_cast<double>(y), -0.75}, 0.25});
    }
  }
  const Compliance gel = compute_compliance(mesh_slab(slab), material, beads, slab.thickness);
  RecordProperty("unknowns", gel.report.unknowns);
  EXPECT_GE(gel.vertices.size(), 600u);
  EXPECT_LE(gel.vertices.size(), 1200u);
  EXPECT_GT(gel.report.smallest_dihedral_deg, 5.0);
  EXPECT_LT(gel.surface.bytes(), 500e6);
  EXPECT_EQ(Eigen::LLT<Eigen::MatrixXd>(gel.surface.view()).info(), Eigen::Success);
  // Pads of this width are 1 % softer than the infinite layer.
  const double ratio =
      fixtures::gaussian_work(gel, 1.0) / fixtures::gaussian_pressure_work(material, slab.thickness, 1.0);
  EXPECT_GT(ratio, 0.995);
  EXPECT_LT(ratio, 1.02);
}

}  // namespace
}  // namespace touchstone::fem
