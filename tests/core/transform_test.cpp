#include "core/transform.h"

#include <gtest/gtest.h>

#include "core/units.h"

namespace touchstone {
namespace {

using Eigen::Vector3d;

const RigidTransform kA = {rotation_from_xyz({0.3, -1.1, 2.0}), {1.0, 2.0, -3.0}};
const RigidTransform kB = {rotation_from_xyz({-0.7, 0.2, 0.9}), {-4.0, 0.5, 6.0}};

TEST(RigidTransform, InverseUndoesIt) {
  const Vector3d p(0.1, -7.0, 2.5);
  EXPECT_TRUE((kA.inverse() * (kA * p)).isApprox(p, 1e-14));
  EXPECT_TRUE((kA * (kA.inverse() * p)).isApprox(p, 1e-14));
}

TEST(RigidTransform, ProductIsOneAfterTheOther) {
  const Vector3d p(0.1, -7.0, 2.5);
  EXPECT_TRUE(((kA * kB) * p).isApprox(kA * (kB * p), 1e-14));
}

TEST(RigidTransform, KeepsLengthsAndTurnsVectorsWithoutTheTranslation) {
  const Vector3d p(0.1, -7.0, 2.5);
  const Vector3d q(3.0, 1.0, 1.0);
  EXPECT_NEAR((kA * p - kA * q).norm(), (p - q).norm(), 1e-14);
  EXPECT_TRUE(kA.turn(p - q).isApprox(kA * p - kA * q, 1e-14));
}

TEST(RotationFromXyz, TurnsAboutXFirstAndZLast) {
  const double quarter = kPi / 2.0;
  EXPECT_TRUE((rotation_from_xyz({quarter, 0, 0}) * Vector3d::UnitY()).isApprox(Vector3d::UnitZ(), 1e-15));
  EXPECT_TRUE((rotation_from_xyz({0, quarter, 0}) * Vector3d::UnitZ()).isApprox(Vector3d::UnitX(), 1e-15));
  EXPECT_TRUE((rotation_from_xyz({0, 0, quarter}) * Vector3d::UnitX()).isApprox(Vector3d::UnitY(), 1e-15));
  // y goes to z by the turn about x; the turn about z leaves it there. In the other order it would go to -x.
  EXPECT_TRUE((rotation_from_xyz({quarter, 0, quarter}) * Vector3d::UnitY()).isApprox(Vector3d::UnitZ(), 1e-15));
}

TEST(LookAt, SeesTheTargetAheadAndDownBelow) {
  const Vector3d eye(1.0, 2.0, -30.0);
  const Vector3d target(0.0, 0.0, 0.0);
  const RigidTransform gel_from_camera = look_at(eye, target, {0.2, 1.0, 0.1});
  const RigidTransform camera_from_gel = gel_from_camera.inverse();
  EXPECT_TRUE((camera_from_gel * target).isApprox(Vector3d(0, 0, eye.norm()), 1e-13));
  EXPECT_LT((camera_from_gel * eye).norm(), 1e-13);
  const Vector3d down = camera_from_gel.turn({0.2, 1.0, 0.1});
  EXPECT_NEAR(down.x(), 0.0, 1e-14);
  EXPECT_GT(down.y(), 0.0);
  EXPECT_NEAR(gel_from_camera.rotation.determinant(), 1.0, 1e-14);
}

TEST(LookAt, NoViewOrDownAlongItIsABug) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(look_at({0, 0, 0}, {0, 0, 0}, {0, 1, 0}), "distance > 0");
  EXPECT_DEATH(look_at({0, 0, 0}, {1, 2, 3}, {-2, -4, -6}), "across");
}

}  // namespace
}  // namespace touchstone
