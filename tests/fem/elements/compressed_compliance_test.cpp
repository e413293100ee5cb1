// A surface compliance whose far parts are compressed, against the same one whole.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <filesystem>
#include <numeric>
#include <string>
#include <vector>

#include "fem/contact/press.h"
#include "fem/elements/compliance_file.h"
#include "fem/elements/element.h"
#include "fem/mesh/slab.h"

namespace touchstone::fem {
namespace {

const ElasticMaterial kSoft{0.1, 0.49};

const TetMesh& mesh() {
  static const TetMesh made = [] {
    SlabMesh slab;
    slab.fine = 0.9;
    slab.fine_half_x = slab.fine_half_y = 10.0;
    slab.fine_depth = 0.9;
    return mesh_slab(slab);
  }();
  return made;
}
const std::vector<Bead>& beads() {
  static const std::vector<Bead> two{{{1.0, 2.0, -2.0}, 0.5}, {{-3.0, 0.0, -2.5}, 0.5}};
  return two;
}
Compliance made(int most_whole) {
  return compute_compliance(mesh(), std::vector{kSoft}, beads(), 5.0, Element::taylor_hood, {}, most_whole);
}
const Compliance& whole() {
  static const Compliance gel = made(kMostWholeVertices);
  return gel;
}
const Compliance& compressed() {
  static const Compliance gel = made(100);
  return gel;
}

std::vector<int> all_vertices() {
  std::vector<int> all(whole().vertices.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

TEST(CompressedCompliance, IsTheWholeOneWithinTheErrorThatItStates) {
  ASSERT_NE(whole().surface.whole(), nullptr);
  EXPECT_EQ(whole().report.compression_error, 0.0);
  ASSERT_NE(compressed().surface.compressed(), nullptr);
  const Eigen::MatrixXd exact = whole().surface.view();
  const Eigen::MatrixXd found = compressed().surface.block(all_vertices(), all_vertices());
  const double mean = exact.diagonal().mean();
  const double off = (found - exact).norm() / mean;
  EXPECT_GT(off, 1e-6);
  EXPECT_LT(off, 1e-3);
  // Of 28 pairs of random vectors: a chi-square's root, within a third.
  EXPECT_NEAR(compressed().report.compression_error, off, 0.4 * off);
  EXPECT_LT((found - exact).cwiseAbs().maxCoeff(), 1e-4 * mean);
  EXPECT_LT((compressed().beads.view() - whole().beads.view()).norm(), 1e-5 * whole().beads.view().norm());
}

TEST(CompressedCompliance, PressesMeetAndDragTheSame) {
  for (const double friction : {0.0, 0.6}) {
    for (const double y : {0.0, 7.5}) {
      const auto answer = [&](const Compliance& gel) {
        Press press(gel, SphereShape{3.0}, friction);
        PressTarget target;
        target.axis = {AxisControl::at(0.4), AxisControl::at(y), AxisControl::at(2.4)};
        press.step(target);
        target.axis[0].value += 0.1;
        return press.step(target);
      };
      const PressState exact = answer(whole());
      const PressState found = answer(compressed());
      EXPECT_EQ(found.contact_vertices, exact.contact_vertices);
      EXPECT_LT((found.wrench - exact.wrench).norm(), 1e-4 * exact.wrench.norm());
      EXPECT_LT((found.surface_displacement - exact.surface_displacement).norm(),
                1e-4 * exact.surface_displacement.norm());
      EXPECT_LT((found.bead_displacement - exact.bead_displacement).norm(), 1e-4 * exact.bead_displacement.norm());
    }
  }
}

TEST(CompressedCompliance, ComesBackFromItsFileBitForBit) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "compressed.compliance";
  const std::string key(64, 'a');
  write_compliance(file, key, with_modulus(compressed(), 0.3));
  const Compliance found = read_compliance(file, key);
  std::filesystem::remove(file);
  ASSERT_NE(found.surface.compressed(), nullptr);
  EXPECT_EQ(found.report.compression_error, compressed().report.compression_error);
  const std::vector<int> some{0, 5, 33, 200};
  EXPECT_EQ(found.surface.block(some, all_vertices()),
            with_modulus(compressed(), 0.3).surface.block(some, all_vertices()));
  EXPECT_LT((3.0 * found.surface.block(some, some) - compressed().surface.block(some, some)).norm(),
            1e-13 * compressed().surface.block(some, some).norm());
}

TEST(CompressedCompliance, HasTheSameBytesOnAnyNumberOfThreads) {
  const Eigen::MatrixXd first = compressed().surface.block(all_vertices(), all_vertices());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(made(100).surface.block(all_vertices(), all_vertices()), first);
}

}  // namespace
}  // namespace touchstone::fem
