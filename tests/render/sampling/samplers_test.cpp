#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>
#include <vector>

#include "core/random.h"
#include "core/units.h"
#include "render/cameras/pinhole_camera.h"
#include "render/materials/ggx.h"
#include "render/sampling/sample_sequence.h"
#include "render/sampling/warps.h"
#include "render/scene/spot_light.h"

namespace touchstone::render {
namespace {

TEST(Samplers, FacetAreasProjectToOne) {
  for (double alpha : {0.1, 0.3, 1.0}) {
    double sum = 0.0;
    constexpr int kSteps = 200000;
    for (int i = 0; i < kSteps; ++i) {  // int D cos d omega, over cos
      const double z = (i + 0.5) / kSteps;
      sum += ggx_distribution(z, alpha) * z * 2.0 * kPi / kSteps;
    }
    EXPECT_NEAR(sum, 1.0, 1e-4);
  }
}

TEST(Samplers, FoldedSphereOfFramesIsOrthonormal) {
  RandomStream stream(3, 0, Purpose::kTest);
  for (int i = 0; i < 1000; ++i) {
    Eigen::Vector3d n(stream.normal(), stream.normal(), stream.normal());
    if (i == 0) n = -Eigen::Vector3d::UnitZ();
    if (i == 1) n = Eigen::Vector3d(1, 0, 0);
    n.normalize();
    const NormalFrame frame(n);
    Eigen::Matrix3d m;
    m << frame.x, frame.y, frame.z;
    EXPECT_TRUE((m.transpose() * m).isIdentity(1e-12));
    EXPECT_NEAR(m.determinant(), 1.0, 1e-12);
  }
}

// The mark of a (0,2)-sequence: each aligned block of 2^k points has one point in each box of area 2^-k.
TEST(SampleSequences, EachElementaryBoxHoldsOnePoint) {
  for (std::uint64_t pixel : {0ull, 5ull, 123456ull}) {
    for (int dimension = 0; dimension < 6; ++dimension) {
      for (int bits_x = 0; bits_x <= 6; ++bits_x) {
        for (std::uint32_t block : {0u, 3u}) {
          std::set<int> boxes;
          for (std::uint32_t i = 0; i < 64; ++i) {
            SampleSequence numbers(9, pixel, block * 64 + i);
            for (int skip = 0; skip < dimension; ++skip) numbers.next_pair();
            const auto [x, y] = numbers.next_pair();
            const int column = static_cast<int>(x * (1 << bits_x));
            const int row = static_cast<int>(y * (64 >> bits_x));
            boxes.insert(row * (1 << bits_x) + column);
          }
          EXPECT_EQ(boxes.size(), 64u) << "pixel " << pixel << " dimension " << dimension << " split " << bits_x;
        }
      }
    }
  }
}

TEST(SampleSequences, DimensionsAndPixelsDoNotFollowEachOther) {
  constexpr int kCount = 4096;
  const auto correlation = [](const std::function<std::pair<double, double>(int)>& draw) {
    double sum = 0.0;
    for (int i = 0; i < kCount; ++i) {
      const auto [a, b] = draw(i);
      sum += (a - 0.5) * (b - 0.5) * 12.0;
    }
    return sum / kCount;
  };
  EXPECT_LT(std::abs(correlation([](int i) {
              SampleSequence numbers(1, 2, static_cast<std::uint32_t>(i));
              const double a = numbers.next();
              return std::make_pair(a, numbers.next());
            })),
            0.06);
  EXPECT_LT(std::abs(correlation([](int i) {
              SampleSequence a(1, static_cast<std::uint64_t>(i), 0);
              SampleSequence b(1, static_cast<std::uint64_t>(i) + 1, 0);
              return std::make_pair(a.next(), b.next());
            })),
            0.08);
}

TEST(Lamp, LobeAndPowerAgree) {
  SpotLamp lamp;
  lamp.half_angle = 0.4;
  lamp.soft_angle = 0.3;
  lamp.power_W = Spectrum::Constant(1, 1.0);
  double sum = 0.0;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double angle = 0.8 * (i + 0.5) / kSteps;
    sum += spot_profile(lamp, std::cos(angle)) * 2.0 * kPi * std::sin(angle) * 0.8 / kSteps;
  }
  EXPECT_NEAR(spot_solid_angle(lamp), sum, 1e-8);
  EXPECT_EQ(spot_profile(lamp, std::cos(0.39)), 1.0);
  EXPECT_EQ(spot_profile(lamp, std::cos(0.71)), 0.0);
  EXPECT_NEAR(spot_profile(lamp, std::cos(0.55)), 0.5, 1e-9);
}

// Whatever the place of the sensor point, the mean weight is the area that both rims leave open times the geometry.
TEST(Pinhole, OpenAreaOfTwoRimsIsSampledExactly) {
  PinholeCamera camera;
  camera.pixel_pitch_um = 4.0;
  camera.distance_mm = 2.0;
  camera.foil_thickness_um = 60.0;
  for (double x : {320.0, 400.0, 520.0, 640.0}) {
    constexpr int kSide = 200;
    double sampled = 0.0;
    for (int i = 0; i < kSide; ++i) {
      for (int j = 0; j < kSide; ++j) {
        const auto ray = pinhole_ray(camera, x, 300.0, (i + 0.5) / kSide, (j + 0.5) / kSide);
        ASSERT_TRUE(ray);
        sampled += ray->weight / (kSide * kSide);
        // The ray passes both rims.
        for (double z : {-0.03, 0.03}) {
          const Eigen::Vector3d at = ray->origin + z / ray->direction.z() * ray->direction;
          ASSERT_LE(at.head<2>().norm(), 0.05 + 1e-9);
        }
      }
    }
    // By brute force: all places of the middle plane, those kept that pass both rims.
    const Eigen::Vector3d sensor(-(x - 320.0) * 0.004, -(300.0 - 240.0) * 0.004, -2.0);
    constexpr int kGrid = 800;
    const double step = 0.12 / kGrid;
    double expected = 0.0;
    for (int i = 0; i < kGrid; ++i) {
      for (int j = 0; j < kGrid; ++j) {
        const Eigen::Vector3d place(-0.06 + (i + 0.5) * step, -0.06 + (j + 0.5) * step, 0.0);
        const Eigen::Vector3d offset = place - sensor;
        bool open = true;
        for (double z : {-0.03, 0.03}) open = open && (place + offset * (z / offset.z())).head<2>().norm() <= 0.05;
        if (open) expected += step * step * offset.z() * offset.z() / std::pow(offset.squaredNorm(), 2);
      }
    }
    EXPECT_NEAR(sampled / expected, 1.0, 2e-3) << "x " << x;
  }
}

}  // namespace
}  // namespace touchstone::render
