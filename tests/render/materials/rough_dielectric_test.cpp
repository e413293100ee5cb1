// Rough boundaries of two media: function and sampler agree, no energy is made, the smooth limit is Fresnel's.

#include "render/materials/rough_dielectric.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "core/units.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

Eigen::Vector3d tilted(double cosine, double azimuth = 0.0) {
  const double sine = std::sqrt(1.0 - cosine * cosine);
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

// A path may go in either direction: f(out, in) n_in^2 = f(in, out) n_out^2 across, and the same without the squares
// above. With one facet and with all of them.
TEST(RoughDielectric, IsReciprocal) {
  RandomStream stream(1, 0, Purpose::kTest);
  const Eigen::Vector3d mirror(1, 1, -1);  // the other side's frame has +z on its own side
  const RoughBoundary boundary(0.4, 1.0, 1.5);
  int passed = 0;
  for (int i = 0; i < 2000; ++i) {
    const double azimuth = 2.0 * kPi * stream.uniform();
    const Eigen::Vector3d out = tilted(0.02 + 0.98 * stream.uniform());
    const double cosine = 0.02 + 0.98 * stream.uniform();
    const Eigen::Vector3d up = tilted(cosine, azimuth);
    const Eigen::Vector3d down = mirror.cwiseProduct(up);
    const double above = rough_dielectric(out, up, 0.4, 1.0, 1.5);
    EXPECT_NEAR(above, rough_dielectric(up, out, 0.4, 1.0, 1.5), 1e-9 * (1.0 + above));
    const double across = rough_dielectric(out, down, 0.4, 1.0, 1.5) * 1.5 * 1.5;
    EXPECT_NEAR(across, rough_dielectric(up, mirror.cwiseProduct(out), 0.4, 1.5, 1.0), 1e-9 * (1.0 + across));
    passed += across > 0.0;
    for (bool inside : {false, true}) {
      const double all_above = boundary(out, up, inside);
      EXPECT_GT(all_above, 0.0);
      EXPECT_NEAR(all_above, boundary(up, out, inside), 1e-9 * (1.0 + all_above));
      const double gain = inside ? 1.0 / (1.5 * 1.5) : 1.5 * 1.5;
      const double all_across = boundary(out, down, inside) * gain;
      EXPECT_NEAR(all_across, boundary(up, mirror.cwiseProduct(out), !inside), 1e-9 * (1.0 + all_across));
    }
  }
  EXPECT_GT(passed, 200);
}

// The table of what one facet doesn't explain against the mean of the sampler's weights.
TEST(RoughDielectric, TableOfWhatIsMissingIsRight) {
  constexpr std::uint32_t kCount = 1 << 14;
  for (double index : {1.3, 1.6}) {
    for (double alpha : {0.05, 0.3, 0.6}) {
      const RoughBoundary boundary(alpha, 1.0, index);
      for (bool inside : {false, true}) {
        for (double cosine : {0.1, 0.3, 0.6, 0.75, 1.0}) {
          double missing = 0.0;
          for (std::uint32_t i = 0; i < kCount; ++i) {
            SampleSequence numbers(3, 7, i);
            const auto [u, v] = numbers.next_pair();
            const double n_out = inside ? index : 1.0;
            const double n_in = inside ? 1.0 : index;
            const RoughSample sample =
                sample_rough_dielectric(tilted(cosine), alpha, n_out, n_in, u, v, numbers.next());
            missing += (1.0 - sample.weight) / kCount;
          }
          EXPECT_NEAR(boundary.missing(cosine, inside), missing, 7e-3) << index << " " << alpha << " " << cosine;
        }
      }
    }
  }
}

// Sampled weights give the function's integrals: total and first moments of each side, by quadrature over the sphere.
TEST(RoughDielectric, SamplerFollowsTheFunction) {
  constexpr int kHeights = 600;
  constexpr int kAzimuths = 200;
  constexpr int kCount = 200000;
  for (double alpha : {0.25, 0.7}) {
    for (bool into_dense : {true, false}) {
      const double n_out = into_dense ? 1.0 : 1.5;
      const double n_in = into_dense ? 1.5 : 1.0;
      for (double cosine : {0.95, 0.4}) {
        SCOPED_TRACE(testing::Message() << "alpha " << alpha << " into " << n_in << " cosine " << cosine);
        const Eigen::Vector3d out = tilted(cosine);
        Eigen::Array4d expected[2] = {Eigen::Array4d::Zero(), Eigen::Array4d::Zero()};
        for (int i = 0; i < kHeights; ++i) {
          for (int j = 0; j < kAzimuths; ++j) {
            const double z = 2.0 * (i + 0.5) / kHeights - 1.0;
            const Eigen::Vector3d in = tilted(z, 2.0 * kPi * (j + 0.5) / kAzimuths);
            const int side = z < 0.0 ? 1 : 0;
            const double basic = side == 1 ? n_in * n_in / (n_out * n_out) : 1.0;
            const double part = basic * rough_dielectric(out, in, alpha, n_out, n_in) * std::abs(z) * 4.0 * kPi /
                                (kHeights * kAzimuths);
            expected[side] += part * Eigen::Array4d(1.0, in.x(), in.z(), in.y() * in.y());
          }
        }
        Eigen::Array4d sum[2] = {Eigen::Array4d::Zero(), Eigen::Array4d::Zero()};
        RandomStream stream(2, 0, Purpose::kTest);
        for (int i = 0; i < kCount; ++i) {
          const double u = stream.uniform();
          const double v = stream.uniform();
          const RoughSample s = sample_rough_dielectric(out, alpha, n_out, n_in, u, v, stream.uniform());
          ASSERT_LE(s.weight, 1.0 + 1e-12);
          if (!(s.weight > 0.0)) continue;
          const int side = s.in.z() < 0.0 ? 1 : 0;
          sum[side] += s.weight * Eigen::Array4d(1.0, s.in.x(), s.in.z(), s.in.y() * s.in.y()) / kCount;
        }
        for (int side = 0; side < 2; ++side) {
          EXPECT_LT((sum[side] - expected[side]).abs().maxCoeff(), 5.0 * 0.5 / std::sqrt(kCount) + 1e-3)
              << sum[side].transpose() << " for " << expected[side].transpose();
        }
        EXPECT_LE(expected[0][0] + expected[1][0], 1.0 + 1e-3);
      }
    }
  }
}

// Bodies of all roughnesses and indices under an even sky look like the sky, seen from outside and from within, and so
// does a bubble: each path, not only the mean.
TEST(RoughDielectric, IsAWhiteFurnace) {
  const auto seen = [](double alpha, double index_of_ball, double index_around, const Eigen::Vector3d& from) {
    Scene scene = empty_scene(1.0);
    scene.media = {Medium{index_around}, Medium{index_of_ball}};
    scene.balls.push_back({{0, 0, 0}, 2.0, RoughRefractive{1, 0, alpha}});
    return view(scene, from, {0.01, 0.02, -1}, 20).mean;
  };
  for (double alpha : {0.01, 0.05, 0.1, 0.3, 0.6, 1.0}) {
    for (double index : {1.3, 1.41, 1.6}) {
      SCOPED_TRACE(testing::Message() << "alpha " << alpha << " index " << index);
      EXPECT_NEAR(seen(alpha, index, 1.0, {0.5, 0, 10}), 1.0, 1e-9) << "a ball";
      EXPECT_NEAR(seen(alpha, index, 1.0, {1.8, 0, 10}), 1.0, 1e-9) << "its rim";
      EXPECT_NEAR(seen(alpha, 1.0, index, {0.5, 0, 10}), 1.0, 1e-9) << "a bubble";
      EXPECT_NEAR(seen(alpha, 1.0, index, {0.5, 0.2, 0.1}), 1.0, 1e-9) << "from within";
    }
  }
}

// T = 1/2 sum (1-R)/(1+R) for a plate of index 1.5: 12/13.
TEST(RoughDielectric, AlmostSmoothPlateIsFresnels) {
  Scene scene = empty_scene(0.0);
  scene.media = {Medium{}, Medium{1.5}};
  scene.surfaces.push_back({square_sheet(100.0, 0.0), RoughRefractive{1, 0, 0.002}});
  scene.surfaces.push_back({square_sheet(100.0, -2.0, false), RoughRefractive{1, 0, 0.002}});
  scene.surfaces.push_back({square_sheet(100.0, -3.0), Emitter{grey(1.0)}});
  const Estimate seen = view(scene, {0, 0, 1}, {0, 0, -1}, 2000);
  EXPECT_NEAR(seen.mean, 12.0 / 13.0, 4.0 * seen.error);
  EXPECT_LT(seen.error, 0.003);
}

// A luminous ball beyond the boundary, met by bounced light, and a lamp of the same intensity, found by connections,
// light the boundary alike. A body wetted by index n shows n^2 times its radiance in air.
TEST(RoughDielectric, LampAndLuminousBallAgree) {
  for (bool lamp_above : {true, false}) {
    Scene scene = empty_scene(0.0);
    const double index_of_lamp = lamp_above ? 1.0 : 1.5;
    scene.media = {Medium{lamp_above ? 1.5 : 1.0}, Medium{index_of_lamp}};
    const RoughRefractive boundary{lamp_above ? 0 : 1, lamp_above ? 1 : 0, 0.6};
    scene.surfaces.push_back({square_sheet(1000.0, 0.0), boundary});
    const double sense = lamp_above ? 1.0 : -1.0;
    const Eigen::Vector3d from(0, 0, -sense);
    const Eigen::Vector3d position(1.0, 0, 8.0 * sense);
    Scene with_ball = scene;
    with_ball.balls.push_back({position, 0.3, Emitter{grey(1.0)}});  // small beside the lobe
    const Estimate ball = view(with_ball, from, -from, 6000);
    const double intensity = kPi * 0.09 * index_of_lamp * index_of_lamp * 1e-6;  // mm^2 W/m^2/sr to W/sr
    scene.lamps.push_back(half_space_lamp(position, -position, intensity));
    const Estimate lamp = view(scene, from, -from, 10);
    EXPECT_NEAR(lamp.mean / ball.mean, 1.0, 4.0 * ball.error / ball.mean + 0.01) << lamp_above;
    EXPECT_LT(ball.error / ball.mean, 0.06);
  }
}

}  // namespace
}  // namespace touchstone::render
