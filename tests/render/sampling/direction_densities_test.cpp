// Samplers of directions and distances against their own densities, by chi-squared.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "core/random.h"
#include "core/units.h"
#include "render/materials/deep_walk.h"
#include "render/materials/ggx.h"
#include "render/materials/rough_dielectric.h"
#include "render/materials/scattering.h"
#include "render/sampling/warps.h"
#include "tests/render/paths/light_scenes.h"
#include "tests/support/chi_squared.h"

namespace touchstone::render {
namespace {

using Point = std::pair<double, double>;

/// 0 to 1 round the z axis.
double turn_of(const Eigen::Vector3d& d) {
  return (std::atan2(d.y(), d.x()) + kPi) / (2.0 * kPi);
}

Eigen::Vector3d direction_at(double z, double turn) {
  const double sine = std::sqrt(std::max(0.0, 1.0 - z * z));
  const double azimuth = 2.0 * kPi * turn - kPi;
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), z};
}

Eigen::Vector3d tilted(double angle) {
  return {std::sin(angle), 0.0, std::cos(angle)};
}

/// Directions over the sphere from z_low to 1 in bins of equal solid angle, against a density in 1/sr.
SampledTest test_directions(const std::function<std::optional<Eigen::Vector3d>()>& draw,
                            const std::function<double(const Eigen::Vector3d&)>& density, double z_low) {
  const double range = 1.0 - z_low;
  return test_samples(
      [&]() -> std::optional<Point> {
        const auto d = draw();
        if (!d) return std::nullopt;
        EXPECT_NEAR(d->norm(), 1.0, 1e-9);
        EXPECT_GE(d->z(), z_low);
        return Point((d->z() - z_low) / range, turn_of(*d));
      },
      [&](double x, double y) { return 2.0 * kPi * range * density(direction_at(z_low + range * x, y)); }, {12, 12});
}

void expect_directions(const std::function<std::optional<Eigen::Vector3d>()>& draw,
                       const std::function<double(const Eigen::Vector3d&)>& density, double z_low,
                       double most_off_one = 1e-3) {
  const SampledTest result = test_directions(draw, density, z_low);
  EXPECT_GT(result.test.p_value, level_of_one_test())
      << "chi-squared " << result.test.statistic << " of " << result.test.freedom << " degrees of freedom";
  EXPECT_NEAR(result.integral, 1.0, most_off_one);
  EXPECT_EQ(result.drawn, 1.0);
}

TEST(ChiSquaredTest, HasTheTabulatedTail) {
  EXPECT_NEAR(Eigen::numext::igammac(0.5 * 1, 0.5 * 3.841459), 0.05, 1e-6);
  EXPECT_NEAR(Eigen::numext::igammac(0.5 * 10, 0.5 * 23.209251), 0.01, 1e-6);
  EXPECT_NEAR(Eigen::numext::igammac(0.5 * 100, 0.5 * 149.449253), 0.001, 1e-6);
  EXPECT_EQ(chi_squared({10.0, 1.0}, {11.0, 0.0}).p_value, 0.0) << "a count where there should be none";
}

// The level means what it says: of samplers that are right a share u has p-values below u.
TEST(ChiSquaredTest, PValuesOfATrueDensityAreEven) {
  constexpr int kRuns = 400;
  std::vector<double> counts(10, 0.0);
  for (int run = 0; run < kRuns; ++run) {
    RandomStream stream(50, static_cast<std::uint64_t>(run), Purpose::kTest);
    const SampledTest result = test_samples([&] { return Point(stream.uniform(), stream.uniform()); },
                                            [](double, double) { return 1.0; }, {5, 5}, 2000);
    counts[static_cast<std::size_t>(std::min(9.0, 10.0 * result.test.p_value))] += 1.0;
  }
  expect_counts(counts, std::vector<double>(10, kRuns / 10.0));
}

// Densities that are a little wrong, as a slip in a formula makes them, are refused.
TEST(ChiSquaredTest, RefusesWrongDensities) {
  RandomStream stream(51, 0, Purpose::kTest);
  const auto cosine = [&]() -> std::optional<Eigen::Vector3d> {
    const double u = stream.uniform();
    return square_to_cosine_hemisphere(u, stream.uniform());
  };
  const auto p_of = [&](const std::function<double(const Eigen::Vector3d&)>& density) {
    return test_directions(cosine, density, 0.0).test.p_value;
  };
  EXPECT_LT(p_of([](const Eigen::Vector3d&) { return 0.5 / kPi; }), 1e-12) << "uniform";
  EXPECT_LT(p_of([](const Eigen::Vector3d& d) { return std::pow(d.z(), 1.15) * 2.15 / (2.0 * kPi); }), 1e-6);
  EXPECT_LT(p_of([](const Eigen::Vector3d& d) { return d.z() / kPi * (1.0 + 0.15 * d.x()); }), 1e-6);
  const Eigen::Vector3d out = tilted(0.7);
  const auto facets = [&]() -> std::optional<Eigen::Vector3d> {
    const double u = stream.uniform();
    const Eigen::Vector3d facet = sample_visible_normal(out, 0.5, u, stream.uniform());
    return 2.0 * out.dot(facet) * facet - out;
  };
  EXPECT_LT(test_directions(
                facets, [&](const Eigen::Vector3d& in) { return visible_reflection_density(out, in, 0.55); }, -1.0)
                .test.p_value,
            1e-12)
      << "another width";
}

TEST(DirectionDensities, Disc) {
  RandomStream stream(1, 0, Purpose::kTest);
  expect_samples(
      [&]() -> std::optional<Point> {
        const double u = stream.uniform();
        const Eigen::Vector2d p = square_to_disc(u, stream.uniform());
        return Point(p.squaredNorm(), turn_of({p.x(), p.y(), 0.0}));
      },
      [](double, double) { return 1.0; });
}

TEST(DirectionDensities, CosineHemisphere) {
  RandomStream stream(2, 0, Purpose::kTest);
  expect_directions(
      [&]() -> std::optional<Eigen::Vector3d> {
        const double u = stream.uniform();
        return square_to_cosine_hemisphere(u, stream.uniform());
      },
      [](const Eigen::Vector3d& d) { return d.z() / kPi; }, 0.0);
}

TEST(DirectionDensities, Sphere) {
  RandomStream stream(3, 0, Purpose::kTest);
  expect_directions(
      [&]() -> std::optional<Eigen::Vector3d> {
        const double u = stream.uniform();
        return square_to_sphere(u, stream.uniform());
      },
      [](const Eigen::Vector3d&) { return 0.25 / kPi; }, -1.0);
}

// Bins in slopes, so that narrow distributions fill many of them: x = s / (1 + s), s = tan / alpha.
TEST(DirectionDensities, VisibleNormals) {
  std::uint64_t seed = 10;
  for (double alpha : {0.01, 0.3, 1.0}) {
    for (double tilt : {0.0, 0.7, 1.3, 1.55}) {
      SCOPED_TRACE(testing::Message() << "alpha " << alpha << " tilt " << tilt);
      const Eigen::Vector3d out = tilted(tilt);
      RandomStream stream(++seed, 0, Purpose::kTest);
      const double a2 = alpha * alpha;
      expect_samples(
          [&]() -> std::optional<Point> {
            const double u = stream.uniform();
            const Eigen::Vector3d m = sample_visible_normal(out, alpha, u, stream.uniform());
            const double slope = std::sqrt((1.0 / (m.z() * m.z()) - 1.0) / a2);
            return Point(slope / (1.0 + slope), turn_of(m));
          },
          [&](double x, double y) {
            const double slope = x / (1.0 - x);
            const double z = 1.0 / std::sqrt(1.0 + a2 * slope * slope);
            const double dz_dx = a2 * slope * z * z * z / ((1.0 - x) * (1.0 - x));
            const double density = ggx_masking(out.z(), alpha) * std::max(0.0, out.dot(direction_at(z, y))) *
                                   ggx_distribution(z, alpha) / out.z();
            return 2.0 * kPi * dz_dx * density;
          });
    }
  }
}

TEST(DirectionDensities, VisibleReflection) {
  std::uint64_t seed = 30;
  for (double alpha : {0.1, 0.25, 0.6, 1.0}) {
    for (double tilt : {0.0, 0.7, 1.3}) {
      SCOPED_TRACE(testing::Message() << "alpha " << alpha << " tilt " << tilt);
      const Eigen::Vector3d out = tilted(tilt);
      RandomStream stream(++seed, 0, Purpose::kTest);
      expect_directions(
          [&]() -> std::optional<Eigen::Vector3d> {
            const double u = stream.uniform();
            const Eigen::Vector3d facet = sample_visible_normal(out, alpha, u, stream.uniform());
            return 2.0 * out.dot(facet) * facet - out;
          },
          [&](const Eigen::Vector3d& in) { return visible_reflection_density(out, in, alpha); }, -1.0);
    }
  }
}

// Mirrored, refracted and many-facet light of both sides at once: samples weigh one, so the function is the density.
// Its integral is known as well as its table.
TEST(DirectionDensities, RoughBoundary) {
  std::uint64_t seed = 60;
  for (double index : {1.3, 1.6}) {
    for (double alpha : {0.15, 0.4, 1.0}) {
      const RoughBoundary boundary(alpha, 1.0, index);
      for (bool inside : {false, true}) {
        const double relative = inside ? 1.0 / index : index;
        for (double tilt : {0.2, 1.3}) {
          SCOPED_TRACE(testing::Message() << "index " << index << " alpha " << alpha << " tilt " << tilt
                                          << (inside ? " inside" : " outside"));
          const Eigen::Vector3d out = tilted(tilt);
          ++seed;
          std::uint64_t number = 0;
          expect_directions(
              [&] {
                SampleSequence numbers(seed, ++number, 0);
                return boundary.sample(out, inside, numbers);
              },
              [&](const Eigen::Vector3d& in) {
                return boundary(out, in, inside) * std::abs(in.z()) * (in.z() > 0.0 ? 1.0 : relative * relative);
              },
              -1.0, 0.01);
        }
      }
    }
  }
}

TEST(DirectionDensities, HenyeyGreenstein) {
  std::uint64_t seed = 150;
  for (double g : {-0.9, -0.4, 0.0, 1e-9, 0.3, 0.7, 0.95}) {
    SCOPED_TRACE(g);
    RandomStream stream(++seed, 0, Purpose::kTest);
    expect_samples(
        [&]() -> std::optional<Point> {
          const double cosine = sample_henyey_greenstein(g, stream.uniform());
          EXPECT_LE(std::abs(cosine), 1.0);
          return Point(0.5 * (1.0 + cosine), 0.5);
        },
        [&](double x, double) { return 4.0 * kPi * henyey_greenstein(2.0 * x - 1.0, g); }, {100, 1});
  }
}

// The density of a flight's length is that of all bands' choices together.
TEST(DistanceDensities, FlightsOfThreeBands) {
  std::uint64_t seed = 170;
  for (const Bands<3>& extinction : {Bands<3>(0.5, 0.5, 0.5), Bands<3>(0.1, 1.0, 30.0), Bands<3>(0.0, 2.0, 0.3)}) {
    for (const Bands<3>& throughput : {Bands<3>(1.0, 1.0, 1.0), Bands<3>(0.7, 0.0, 1e-3), Bands<3>(0.2, 3.0, 0.5)}) {
      SCOPED_TRACE(testing::Message() << extinction.transpose() << " carrying " << throughput.transpose());
      RandomStream stream(++seed, 0, Purpose::kTest);
      const Bands<3> chance = throughput / throughput.sum();
      // x = d / (1 + d), d in mean free paths of the band of middle extinction.
      expect_samples(
          [&]() -> std::optional<Point> {
            const double u = stream.uniform();
            const Flight<3> flight = sample_flight<3>(extinction, throughput, u, stream.uniform());
            EXPECT_LT((flight.chance - chance).abs().maxCoeff(), 1e-12);
            if (std::isinf(flight.distance)) return std::nullopt;
            return Point(flight.distance / (1.0 + flight.distance), 0.5);
          },
          [&](double x, double) {
            const double d = x / (1.0 - x);
            return (chance * extinction * (-extinction * d).exp()).sum() / ((1.0 - x) * (1.0 - x));
          },
          {60, 1});
    }
  }
}

/// Number of the luminous patch of a sphere that a path ends on, drawn through the whole tracer: the sphere's patches,
/// `rows` of equal height times `columns`, each show 1 + their number. Paths must weigh one.
class PatchedSky {
 public:
  PatchedSky(Scene scene, int rows, int columns) : rows_(rows), columns_(columns), scene_(std::move(scene)) {
    constexpr double kFar = 1e4;
    constexpr int kCut = 12;  // pieces a side, so that patches are nearly those of the sphere
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        TriangleMesh mesh;
        for (int i = 0; i <= kCut; ++i) {
          for (int j = 0; j <= kCut; ++j) {
            const double z = 2.0 * (row + static_cast<double>(i) / kCut) / rows - 1.0;
            mesh.vertices.push_back(kFar * direction_at(z, (column + static_cast<double>(j) / kCut) / columns));
          }
        }
        for (int i = 0; i < kCut; ++i) {
          for (int j = 0; j < kCut; ++j) {
            const int a = i * (kCut + 1) + j;
            const int b = a + kCut + 1;
            if (row > 0 || i > 0) mesh.triangles.push_back({a, a + 1, b + 1});  // at a pole it has no area
            if (row + 1 < rows || i + 1 < kCut) mesh.triangles.push_back({a, b + 1, b});
          }
        }
        scene_.surfaces.push_back({mesh, Emitter{grey(1.0 + row * columns + column)}});
      }
    }
  }

  void expect(const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
              const std::function<double(const Eigen::Vector3d&)>& density) const {
    constexpr int kPaths = 40000;
    const Tracer tracer(scene_);
    std::uint64_t seed = 0;
    const auto draw = [&]() -> std::optional<Point> {
      RenderSettings settings = samples(1);
      settings.seed = ++seed;
      const double seen = tracer.radiance(from, direction, settings)[0] - 1.0;
      EXPECT_NEAR(seen, std::round(seen), 1e-6) << "a path that doesn't weigh one";
      const auto patch = static_cast<int>(std::round(seen));
      return Point((patch / columns_ + 0.5) / rows_, (patch % columns_ + 0.5) / columns_);
    };
    const SampledTest result = test_samples(
        draw, [&](double x, double y) { return 4.0 * kPi * density(direction_at(2.0 * x - 1.0, y)); },
        {rows_, columns_}, kPaths);
    EXPECT_GT(result.test.p_value, level_of_one_test())
        << "chi-squared " << result.test.statistic << " of " << result.test.freedom << " degrees of freedom";
    EXPECT_NEAR(result.integral, 1.0, 1e-3);
  }

 private:
  int rows_, columns_;
  Scene scene_;
};

TEST(TracedDensities, MattSurface) {
  Scene scene = empty_scene(0.0);
  scene.surfaces.push_back({square_sheet(0.5, 0.0), Lambertian{grey(1.0)}});
  PatchedSky(scene, 10, 12).expect({0.3, 0, 1}, {-0.3, 0, -1}, [](const Eigen::Vector3d& d) {
    return std::max(0.0, d.z()) / kPi;
  });
}

TEST(TracedDensities, DiffuseTransmitter) {
  Scene scene = empty_scene(0.0);
  scene.surfaces.push_back({square_sheet(0.5, 0.0), DiffuseTransmitter{grey(0.3), grey(0.7)}});
  PatchedSky(scene, 10, 12).expect({0.3, 0, 1}, {-0.3, 0, -1}, [](const Eigen::Vector3d& d) {
    return d.z() > 0.0 ? 0.3 * d.z() / kPi : -0.7 * d.z() / kPi;
  });
}

// A metal's weights are the function times the cosine over the density.
TEST(Weights, OfAMetalAreFunctionOverDensity) {
  RandomStream stream(7, 0, Purpose::kTest);
  for (double alpha : {0.02, 0.3, 1.0}) {
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector3d out = direction_at(0.01 + 0.99 * stream.uniform(), stream.uniform());
      const double u = stream.uniform();
      const Eigen::Vector3d facet = sample_visible_normal(out, alpha, u, stream.uniform());
      const Eigen::Vector3d in = 2.0 * out.dot(facet) * facet - out;
      if (in.z() < 1e-3) continue;
      const double weight = ggx_masking_shadowing(in.z(), out.z(), alpha) / ggx_masking(out.z(), alpha);
      const double function = ggx_reflection(out, in, alpha);
      EXPECT_NEAR(function * in.z() / visible_reflection_density(out, in, alpha), weight, 1e-9);
      EXPECT_NEAR(function, ggx_reflection(in, out, alpha), 1e-9 * function) << "reciprocity";
      EXPECT_LE(weight, 1.0 + 1e-12);
    }
  }
}

}  // namespace
}  // namespace touchstone::render
