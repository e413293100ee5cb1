#include "fem/error/mesh_goal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "core/error.h"
#include "fem/error/compliance_cache.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::fem {
namespace {

using ::testing::HasSubstr;

const SlabMesh kSlab{7.0, 7.0, 2.5, 99.0, 99.0, 2.0, 2.0, 0.6};  // no edges of its own
const ElasticMaterial kMaterial{0.33, 0.49};

double error_of(const Compliance& gel, const ErrorGoal& goal) {
  const BodyErrors& body = goal.sharp_bodies ? gel.mesh_error.sharp : gel.mesh_error.smooth;
  return errors_at(body, goal.contact_radius / gel.report.fine_edge)[ErrorOf::normal_force];
}

std::string refusal(const ErrorGoal& goal) {
  try {
    cached_compliance(SlabGel{kSlab, {}}, goal, std::span(&kMaterial, 1), {}, {});
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(MeshGoal, IsMetAndNotByAMuchFinerMesh) {
  double before = std::numeric_limits<double>::infinity();
  for (const double wanted : {0.05, 0.01}) {
    const ErrorGoal goal{wanted, 1.4, false};
    const Compliance gel = cached_compliance(SlabGel{kSlab, {}}, goal, std::span(&kMaterial, 1), {}, {});
    EXPECT_LE(error_of(gel, goal), wanted);
    EXPECT_GT(error_of(gel, goal), 0.15 * wanted);
    EXPECT_LT(gel.report.fine_edge, before);
    before = gel.report.fine_edge;
  }
}

TEST(MeshGoal, SharpBodiesTakeFinerMeshes) {
  const ErrorGoal smooth{0.06, 1.4, false};
  const ErrorGoal sharp{0.06, 1.4, true};
  const Compliance for_smooth = cached_compliance(SlabGel{kSlab, {}}, smooth, std::span(&kMaterial, 1), {}, {});
  const Compliance for_sharp = cached_compliance(SlabGel{kSlab, {}}, sharp, std::span(&kMaterial, 1), {}, {});
  EXPECT_LT(for_sharp.report.fine_edge, for_smooth.report.fine_edge);
  EXPECT_LE(error_of(for_sharp, sharp), sharp.force_error);
}

TEST(MeshGoal, IsSearchedOnceAndTheSameEachTime) {
  const ErrorGoal goal{0.04, 1.4, false};
  const test::TemporaryFolder folder;
  int made = 0;
  const auto get = [&](const std::filesystem::path& cache) {
    return cached_compliance(SlabGel{kSlab, {}}, goal, std::span(&kMaterial, 1), {}, cache,
                             [&](const std::string& stage, std::int64_t done, std::int64_t total) {
                               made += stage == "elasticity" && done == total;
                             });
  };
  const Compliance first = get(folder.path());
  const int searched = made;
  EXPECT_GE(searched, 1);
  const Compliance second = get(folder.path());
  EXPECT_EQ(made, searched);
  EXPECT_EQ(second.report.fine_edge, first.report.fine_edge);
  const Compliance again = get({});
  EXPECT_EQ(again.report.fine_edge, first.report.fine_edge);
  EXPECT_TRUE(again.surface.view() == first.surface.view());
}

TEST(MeshGoal, WhatNoMeshCanDoIsRefusedAndSaysWhatCanBeHad) {
  const std::string message = refusal({1e-4, 0.3, true});
  EXPECT_THAT(message, HasSubstr("a force error of 0.0001 for sharp bodies of contact radius 0.3 mm needs edges of"));
  EXPECT_THAT(message, HasSubstr("tetrahedra; at most"));
  EXPECT_THAT(message, HasSubstr("the error is about"));
}

TEST(MeshGoal, BadGoalsAreRefused) {
  EXPECT_THAT(refusal({0.0, 1.0, false}), HasSubstr("the wanted force error is 0"));
  EXPECT_THAT(refusal({std::numeric_limits<double>::quiet_NaN(), 1.0, false}), HasSubstr("the wanted force error is"));
  EXPECT_THAT(refusal({0.01, -1.0, false}), HasSubstr("the contact radius is -1 mm"));
  EXPECT_THAT(refusal({0.01, 2.5, false}), HasSubstr("within the finely meshed part"));
}

TEST(MeshGoal, EachGoalHasItsOwnKey) {
  std::set<std::string> keys;
  for (const ErrorGoal& goal :
       {ErrorGoal{0.01, 1.0, false}, {0.02, 1.0, false}, {0.01, 1.1, false}, {0.01, 1.0, true}}) {
    keys.insert(compliance_key(SlabGel{kSlab, {}}, goal, std::span(&kMaterial, 1), {}));
  }
  EXPECT_EQ(keys.size(), 4u);
  SlabMesh other = kSlab;
  other.fine = 0.3;  // is found, so it's no part of the key
  EXPECT_EQ(keys.count(compliance_key(SlabGel{other, {}}, {0.01, 1.0, false}, std::span(&kMaterial, 1), {})), 1u);
}

}  // namespace
}  // namespace touchstone::fem
