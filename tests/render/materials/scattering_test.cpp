// Random walks in scattering media against the theory of radiative transfer.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "core/gauss_rule.h"
#include "core/random.h"
#include "core/units.h"
#include "render/materials/scattering.h"
#include "render/scene/ray_scene.h"
#include "tests/render/paths/light_scenes.h"

namespace touchstone::render {
namespace {

/// A direction down (-z) or up at the given |cosine|.
Eigen::Vector3d at_cosine(double cosine, bool up) {
  return {std::sqrt(1.0 - cosine * cosine), 0.0, up ? cosine : -cosine};
}

/// A medium with an extinction of 1 per mm.
Medium particles(double albedo, double g, double index = 1.0) {
  return Medium{index, grey(1.0 - albedo), grey(albedo), g};
}

/// Air above z = 0, the medium below it, down to z = -thickness (0: for ever) where air follows.
Scene slab(const Medium& medium, double thickness, double environment) {
  Scene scene = empty_scene(environment);
  scene.media = {Medium{}, medium};
  if (thickness > 0.0) {
    scene.faces = {{-thickness, 0, 1}, {0.0, 1, 0}};
  } else {
    scene.faces = {{0.0, 1, 0}};
  }
  return scene;
}

/// Chandrasekhar's H for isotropic scattering [Chandrasekhar1960, ch. V], from
/// 1 / H(mu) = sqrt(1 - albedo) + albedo / 2 int_0^1 x H(x) / (mu + x) dx.
class ChandrasekharH {
 public:
  explicit ChandrasekharH(double albedo) : albedo_(albedo), rule_(gauss_rule(64)), at_nodes_(64, 1.0) {
    for (int step = 0; step < 2000; ++step) {
      std::vector<double> next;
      for (double mu : rule_.nodes) next.push_back((*this)(mu));
      at_nodes_ = next;
    }
  }
  double operator()(double mu) const {
    double sum = std::sqrt(1.0 - albedo_);
    for (std::size_t i = 0; i < at_nodes_.size(); ++i) {
      sum += 0.5 * albedo_ * rule_.weights[i] * rule_.nodes[i] * at_nodes_[i] / (mu + rule_.nodes[i]);
    }
    return 1.0 / sum;
  }

 private:
  double albedo_;
  GaussRule rule_;
  std::vector<double> at_nodes_;
};

/// What a slab sends back and lets through of an even sky, at the nodes of `rule`: by doubling [Hulst1980, ch. 4] of a
/// layer so thin that it scatters once, from Henyey and Greenstein's phase function averaged over azimuth.
struct SlabOfSky {
  Eigen::VectorXd reflected, passed;
};
SlabOfSky double_up(const GaussRule& rule, double albedo, double g, double thickness) {
  const int n = static_cast<int>(rule.nodes.size());
  const auto phase = [&](double a, double b) {  // mean over azimuth, 4 pi p
    double sum = 0.0;
    double factor = 1.0;
    double a0 = 1.0, a1 = a, b0 = 1.0, b1 = b;
    for (int l = 0; l < 2 * n; ++l) {
      sum += (2.0 * l + 1.0) * factor * a0 * b0;
      factor *= g;
      const double a2 = ((2.0 * l + 3.0) * a * a1 - (l + 1.0) * a0) / (l + 2.0);
      const double b2 = ((2.0 * l + 3.0) * b * b1 - (l + 1.0) * b0) / (l + 2.0);
      a0 = a1, a1 = a2, b0 = b1, b1 = b2;
    }
    return sum;
  };
  constexpr int kDoublings = 24;
  const double thin = thickness / (1 << kDoublings);
  Eigen::MatrixXd back(n, n);
  Eigen::MatrixXd on(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double share = albedo * thin * rule.weights[j] / (2.0 * rule.nodes[i]);
      back(i, j) = share * phase(rule.nodes[i], -rule.nodes[j]);
      on(i, j) = share * phase(rule.nodes[i], rule.nodes[j]) + (i == j ? 1.0 - thin / rule.nodes[i] : 0.0);
    }
  }
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(n, n);
  for (int k = 0; k < kDoublings; ++k) {
    const Eigen::MatrixXd between = (one - back * back).inverse();
    const Eigen::MatrixXd new_back = back + on * back * between * on;
    on = on * between * on;
    back = new_back;
  }
  return {back.rowwise().sum(), on.rowwise().sum()};
}

TEST(HenyeyGreenstein, IsOneOverTheSphereAndHasItsMean) {
  for (double g : {-0.9, -0.3, 0.0, 1e-9, 0.5, 0.95}) {
    constexpr int kSteps = 400000;
    double total = 0.0;
    double mean = 0.0;
    for (int i = 0; i < kSteps; ++i) {
      const double cosine = 2.0 * (i + 0.5) / kSteps - 1.0;
      const double part = henyey_greenstein(cosine, g) * 4.0 * kPi / kSteps;
      total += part;
      mean += part * cosine;
    }
    EXPECT_NEAR(total, 1.0, 1e-6);
    EXPECT_NEAR(mean, g, 1e-6);
  }
}

TEST(Flight, BandsTogetherLoseNothingAndGainNothing) {
  const Bands<3> extinction(0.01, 1.0, 300.0);
  RandomStream stream(4, 0, Purpose::kTest);
  for (int i = 0; i < 2000; ++i) {
    const Bands<3> throughput(stream.uniform(), stream.uniform() * 1e-3, 1.0);
    const double u = stream.uniform();
    const Flight<3> flight = sample_flight<3>(extinction, throughput, u, stream.uniform());
    const Bands<3> scattered = throughput * weight_of_scattering<3>(extinction, extinction, flight);
    EXPECT_NEAR(scattered.sum(), throughput.sum(), 1e-9);
    const double free_path = flight.distance * stream.uniform();
    EXPECT_NEAR((throughput * weight_of_passing<3>(extinction, flight, free_path)).sum(), throughput.sum(), 1e-9);
  }
}

TEST(Flight, EndlessPathPassesOnlyTheClearBand) {
  const Flight<3> flight = sample_flight<3>({0.0, 1.0, 2.0}, {1.0, 1.0, 1.0}, 0.1, 0.5);
  ASSERT_TRUE(std::isinf(flight.distance));
  const Bands<3> weight = weight_of_passing<3>({0.0, 1.0, 2.0}, flight, flight.distance);
  EXPECT_NEAR(weight[0], 3.0, 1e-12);
  EXPECT_EQ(weight[1], 0.0);
  EXPECT_EQ(weight[2], 0.0);
}

// Without interreflection only what wasn't scattered arrives: Beer-Lambert with absorption + scattering.
TEST(ScatteringMedium, UnscatteredLightFollowsBeerLambert) {
  Scene scene = empty_scene(0.0);
  scene.media = {Medium{1.0, grey(0.2), grey(0.3), 0.4}};
  scene.interreflection = false;
  scene.balls.push_back({{0, 0, 4}, 1.0, Emitter{grey(1.0)}});
  const Estimate seen = view(scene, {0, 0, 0}, {0, 0, 1}, 2000);
  EXPECT_NEAR(seen.mean, std::exp(-1.5), 4.0 * seen.error);
  EXPECT_LT(seen.error, 0.003);
}

TEST(ScatteringMedium, ThatTakesNothingAwayIsAWhiteFurnace) {
  for (double index : {1.0, 1.41}) {
    for (double g : {-0.5, 0.0, 0.9}) {
      Scene scene = slab(particles(1.0, g, index), 3.0, 1.0);
      scene.balls.push_back({{0, 0, -1.5}, 0.5, Lambertian{grey(1.0)}});
      scene.balls.push_back({{1.5, 0, -1.5}, 0.5, Refractive{0, 1}});
      const Estimate seen = view(scene, {0.4, 0.2, 5}, {0.05, 0.02, -1}, 60);
      EXPECT_NEAR(seen.mean, 1.0, 4.0 * seen.error + 1e-9) << index << " " << g;
      EXPECT_LT(seen.error, 0.01);
    }
  }
}

TEST(ScatteringMedium, BallOfItIsAWhiteFurnace) {
  Scene scene = empty_scene(1.0);
  scene.media = {Medium{}, Medium{1.41, {}, grey(200.0), 0.7}};
  scene.balls.push_back({{0, 0, 0}, 2.0, Refractive{1, 0}});
  const Estimate seen = view(scene, {0.4, 0.2, 10}, {0, 0.02, -1}, 60);
  EXPECT_NEAR(seen.mean, 1.0, 4.0 * seen.error + 1e-6);
  EXPECT_LT(seen.error, 0.01);
}

// Under an even sky a half space shows 1 - H(mu) sqrt(1 - albedo).
TEST(ScatteringMedium, HalfSpaceUnderASkyFollowsChandrasekhar) {
  for (double albedo : {0.5, 0.9, 0.99}) {
    const ChandrasekharH h(albedo);
    for (double mu : {0.1, 0.5, 1.0}) {
      const Estimate seen = view(slab(particles(albedo, 0.0), 0.0, 1.0), {0, 0, 1}, at_cosine(mu, false), 2000);
      EXPECT_NEAR(seen.mean, 1.0 - h(mu) * std::sqrt(1.0 - albedo), 4.0 * seen.error) << albedo << " " << mu;
      EXPECT_LT(seen.error, 0.003);
    }
  }
}

// Under a far lamp it shows albedo / (4 pi) E mu0 / (mu + mu0) H(mu) H(mu0), E square to the light.
TEST(ScatteringMedium, HalfSpaceUnderALampFollowsChandrasekhar) {
  constexpr double kFar = 1e4;
  for (double albedo : {0.5, 0.95}) {
    const ChandrasekharH h(albedo);
    for (double mu0 : {0.3, 0.9}) {
      Scene scene = slab(particles(albedo, 0.0), 0.0, 0.0);
      const Eigen::Vector3d direction = at_cosine(mu0, true);
      scene.lamps.push_back(half_space_lamp(kFar * direction, -direction, kFar * kFar * 1e-6));  // E = 1
      for (double mu : {0.2, 1.0}) {
        const Estimate seen = view(scene, {0, 0, 1}, at_cosine(mu, false), 1500);
        const double expected = albedo / (4.0 * kPi) * mu0 / (mu + mu0) * h(mu) * h(mu0);
        EXPECT_NEAR(seen.mean / expected, 1.0, 4.0 * seen.error / expected + 1e-3) << albedo << " " << mu0 << " " << mu;
        EXPECT_LT(seen.error / expected, 0.01);
      }
    }
  }
}

TEST(ScatteringMedium, SlabUnderASkyFollowsDoubling) {
  const GaussRule rule = gauss_rule(24);
  struct Case {
    double albedo, g, thickness;
  };
  for (const Case& c : {Case{0.9, 0.0, 1.0}, Case{0.99, 0.7, 4.0}, Case{0.6, -0.4, 0.5}, Case{1.0, 0.5, 8.0}}) {
    const SlabOfSky expected = double_up(rule, c.albedo, c.g, c.thickness);
    // Sky above and a black floor below shows what is sent back; a luminous floor under a dark sky what passes.
    Scene lit_above = slab(particles(c.albedo, c.g), c.thickness, 1.0);
    lit_above.surfaces.push_back({square_sheet(1e4, -c.thickness - 0.01), Black{}});
    Scene lit_below = slab(particles(c.albedo, c.g), c.thickness, 0.0);
    lit_below.surfaces.push_back({square_sheet(1e4, -c.thickness - 0.01), Emitter{grey(1.0)}});
    for (int node : {4, 12, 23}) {
      const Eigen::Vector3d direction = at_cosine(rule.nodes[node], false);
      const Estimate back = view(lit_above, {0, 0, 0.01}, direction, 1000);
      const Estimate through = view(lit_below, {0, 0, 0.01}, direction, 1000);
      SCOPED_TRACE(testing::Message() << "albedo " << c.albedo << " g " << c.g << " mu " << rule.nodes[node]);
      EXPECT_NEAR(back.mean, expected.reflected[node], 4.0 * back.error + 3e-4);
      EXPECT_NEAR(through.mean, expected.passed[node], 4.0 * through.error + 3e-4);
      EXPECT_LT(std::max(back.error, through.error), 0.005);
      if (c.albedo == 1.0) {
        EXPECT_NEAR(back.mean + through.mean, 1.0, 4.0 * std::hypot(back.error, through.error));
      }
    }
  }
}

// The three bands' coefficients differ by 1e5; no path may carry more than the three skies it can bring.
TEST(ScatteringMedium, UnequalBandsGiveNoFireflies) {
  Scene scene;
  scene.environment = Spectrum::Constant(3, 1.0);
  Medium medium;
  medium.scattering = Bands<3>(0.001, 1.0, 100.0);
  scene.media = {Medium{}, medium};
  scene.faces = {{-2.0, 0, 1}, {0.0, 1, 0}};
  const Tracer tracer(scene);
  Spectrum sum = Spectrum::Zero(3);
  Spectrum squares = Spectrum::Zero(3);
  constexpr int kPaths = 4000;
  for (int i = 0; i < kPaths; ++i) {
    RenderSettings settings = samples(1);
    settings.seed = static_cast<std::uint64_t>(i);
    const Spectrum seen = tracer.radiance({0, 0, 1}, {0.3, 0, -1}, settings);
    EXPECT_LT(seen.sum(), 24.0);  // 3, times 2 at each doubling of the walk beyond kFreeScatterings
    sum += seen;
    squares += seen * seen;
  }
  for (int band = 0; band < 3; ++band) {
    const double mean = sum[band] / kPaths;
    EXPECT_NEAR(mean, 1.0, 4.0 * std::sqrt((squares[band] / kPaths - mean * mean) / kPaths) + 1e-9) << band;
  }
}

// 5000 mean free paths thick, indices that mirror, a lamp close by: the energy is the sky's, and no path or pixel
// stands out. One path's light of a lamp falls off like an exponential, so pixels of 16 paths are looked at.
TEST(ScatteringMedium, VeryThickMakesNoEnergyAndNoFireflies) {
  for (double thickness : {5.0, 0.0}) {
    Scene scene = slab(Medium{1.41, {}, grey(1000.0), 0.0}, thickness, 1.0);
    const Tracer under_sky(scene);
    double sum = 0.0;
    constexpr int kPaths = 2000;
    for (int i = 0; i < kPaths; ++i) {
      RenderSettings settings = samples(1);
      settings.seed = static_cast<std::uint64_t>(i);
      const double seen = under_sky.radiance({0, 0, 1}, {0.2, 0, -1}, settings)[0];
      EXPECT_LE(seen, 1.03) << "the sky once, over the chance of the roulette at the face";
      sum += seen;
    }
    EXPECT_NEAR(sum / kPaths, 1.0, 4.0 * 0.2 / std::sqrt(kPaths));

    scene.environment = grey(0.0);
    scene.lamps.push_back(half_space_lamp({0, 0, 2}, {0, 0, -1}, 1.0));
    const Tracer lit(scene);
    std::vector<double> pixels;
    constexpr int kPixels = 300;
    for (int i = 0; i < kPixels; ++i) {
      RenderSettings settings = samples(16);
      settings.seed = static_cast<std::uint64_t>(i);
      pixels.push_back(lit.radiance({0, 0, 1}, {0.2, 0, -1}, settings)[0]);
    }
    const auto seen = Eigen::Map<const Eigen::ArrayXd>(pixels.data(), kPixels);
    const double spread = std::sqrt((seen - seen.mean()).square().mean());
    EXPECT_GT(seen.minCoeff(), 0.0);
    EXPECT_LT((seen.maxCoeff() - seen.mean()) / spread, 6.0);
  }
}

// Between a luminous wall and a black one, many mean free paths apart, diffuse light falls as sinh(kappa (x + l0)), x
// from the black wall and l0 = 0.7104 transport mean free paths (Milne's problem); linearly without absorption.
TEST(DeepWalk, LightBetweenWallsFollowsTheDiffusionEquation) {
  constexpr double kWide = 200.0;  // between the walls, in transport mean free paths, which are 1 mm
  constexpr double kMilne = 0.7104;
  for (double g : {0.0, 0.7}) {
    for (double absorption : {0.0, 1e-4}) {
      Scene scene = empty_scene(0.0);
      scene.media = {Medium{1.0, grey(absorption), grey((1.0 - absorption) / (1.0 - g)), g}};
      scene.surfaces.push_back({square_sheet(1e5, kWide, false), Emitter{grey(1.0)}});
      scene.surfaces.push_back({square_sheet(1e5, 0.0), Black{}});
      for (double height : {40.0, 150.0}) {
        const double kappa = std::sqrt(3.0 * absorption);
        const double expected = absorption > 0.0
                                    ? std::sinh(kappa * (height + kMilne)) / std::sinh(kappa * (kWide + 2.0 * kMilne))
                                    : (height + kMilne) / (kWide + 2.0 * kMilne);
        const Estimate seen = view(scene, {0, 0, height}, {1, 0, 0}, 60);
        EXPECT_NEAR(seen.mean, expected, 4.0 * seen.error) << g << " " << absorption << " " << height;
        EXPECT_LT(seen.error, 0.02);
      }
    }
  }
}

// Half spaces of nearly no absorption: the same law as above for albedos at which walks jump.
TEST(DeepWalk, HalfSpaceUnderASkyFollowsChandrasekhar) {
  for (double albedo : {0.9992, 0.9999}) {
    const ChandrasekharH h(albedo);
    const Estimate seen = view(slab(particles(albedo, 0.0), 0.0, 1.0), {0, 0, 1}, at_cosine(0.5, false), 1500);
    EXPECT_NEAR(seen.mean, 1.0 - h(0.5) * std::sqrt(1.0 - albedo), 4.0 * seen.error) << albedo;
    EXPECT_LT(seen.error, 0.002);
  }
}

TEST(DeepWalk, ClearanceIsTheDistanceOfTheNearestThing) {
  RandomStream stream(12, 0, Purpose::kTest);
  const auto point = [&] {
    return Eigen::Vector3d(8.0 * stream.uniform() - 4.0, 8.0 * stream.uniform() - 4.0, 8.0 * stream.uniform() - 4.0);
  };
  Scene scene = empty_scene(0.0);
  TriangleMesh mesh;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d corner = point();
    mesh.vertices.insert(mesh.vertices.end(), {corner, corner + 0.3 * point(), corner + 0.3 * point()});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  scene.surfaces.push_back({mesh, Black{}});
  scene.balls.push_back({{1, 2, 3}, 0.5, Black{}});
  const RayScene rays(scene);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d from = point();
    double nearest = std::abs((from - Eigen::Vector3d(1, 2, 3)).norm() - 0.5);
    for (const auto& t : mesh.triangles) {  // by search over the triangle's points, coarse to fine
      const Eigen::Vector3d a = mesh.vertices[t[0]];
      const Eigen::Vector3d ab = mesh.vertices[t[1]] - a;
      const Eigen::Vector3d ac = mesh.vertices[t[2]] - a;
      constexpr int kSteps = 60;
      for (int u = 0; u <= kSteps; ++u) {
        for (int v = 0; u + v <= kSteps; ++v) {
          nearest = std::min(nearest, (from - a - ab * u / kSteps - ac * v / kSteps).norm());
        }
      }
    }
    const double found = rays.clearance(from, 100.0);
    EXPECT_LE(found, nearest + 1e-5);
    EXPECT_GT(found, nearest - 0.05);
    EXPECT_EQ(rays.clearance(from, 0.5 * found), 0.5 * found);
  }
}

TEST(ScatteringMedium, PreviewHasNoNoise) {
  Scene scene = slab(particles(0.9, 0.0), 1.0, 1.0);
  const PinholeCamera camera = small_camera(8, 6);
  const cv::Mat once = Tracer(scene).preview(camera, 1);
  scene.media[1] = Medium{1.0, grey(0.1)};
  const cv::Mat clear = Tracer(scene).preview(camera, 1);
  EXPECT_EQ(cv::norm(once, clear, cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace touchstone::render
