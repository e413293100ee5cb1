// The light guide's mirror images against rays that are followed one by one.

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "lamp_scenes.h"
#include "render/materials/fresnel.h"
#include "render/sampling/warps.h"

namespace touchstone::render {
namespace {

/// Air, a plate from z = -8 to -5 of one index, gel above of another.
Scene plate_and_gel(double plate, double gel) {
  Scene scene = empty_scene(0.0);
  scene.media = {Medium{1.0, {}}, Medium{plate, {}}, Medium{gel, {}}};
  scene.faces = {{-8.0, 0, 1}, {-5.0, 1, 2}};
  return scene;
}

GuideLamp guide(double tilt, double half_power_angle) {
  GuideLamp lamp;
  lamp.centre = {-9, 0, -6};
  lamp.direction = {1, 0, 0};
  lamp.tilt = tilt;
  lamp.width = 12.0;
  lamp.half_power_angle = half_power_angle;
  lamp.power_W = grey(1.0);
  return lamp;
}

struct Patch {
  double x, y, half;
};

/// Share of the guide's power that lands on a patch of the plane z = 0 by the first exit from the plate, by following
/// photons, each of one polarisation, that are mirrored or let through by chance.
Estimate share_by_photons(const Scene& scene, const GuideLamp& lamp, const Patch& patch, int photons) {
  const double low = scene.faces[0].z;
  const double high = scene.faces[1].z;
  const double n_air = scene.media[0].index;
  const double n_plate = scene.media[1].index;
  const double n_gel = scene.media[2].index;
  const double m = lobe_exponent(lamp.half_power_angle);
  const NormalFrame frame(Eigen::Vector3d(std::cos(lamp.tilt), 0.0, std::sin(lamp.tilt)));
  RandomStream random(3, 0, Purpose::kTest);
  int landed = 0;
  for (int i = 0; i < photons; ++i) {
    Eigen::Vector3d at(lamp.centre.x(), lamp.width * (random.uniform() - 0.5), low + (high - low) * random.uniform());
    Eigen::Vector3d direction;
    do {
      const double cosine = std::pow(1.0 - random.uniform(), 1.0 / (m + 1.0));
      const double azimuth = 2.0 * kPi * random.uniform();
      const double sine = std::sqrt(1.0 - cosine * cosine);
      direction = frame.to_world({sine * std::cos(azimuth), sine * std::sin(azimuth), cosine});
    } while (direction.x() <= 0.0);
    const bool is_s = random.uniform() < 0.5;
    for (int bounce = 0; bounce < 10000; ++bounce) {
      const bool up = direction.z() > 0.0;
      at += ((up ? high : low) - at.z()) / direction.z() * direction;
      if (!(at.x() < 100.0)) break;
      const FresnelFace face = fresnel(n_plate, up ? n_gel : n_air, std::abs(direction.z()));
      if (random.uniform() < (is_s ? face.reflectance_s : face.reflectance_p)) {
        direction.z() = -direction.z();
        continue;
      }
      if (up) {
        const Eigen::Vector2d flat = direction.head<2>() * (n_plate / n_gel);
        const Eigen::Vector2d end = at.head<2>() - high * flat / std::sqrt(1.0 - flat.squaredNorm());
        if (std::abs(end.x() - patch.x) < patch.half && std::abs(end.y() - patch.y) < patch.half) ++landed;
      }
      break;
    }
  }
  const double share = static_cast<double>(landed) / photons;
  return {share, std::sqrt(share * (1.0 - share) / photons)};
}

/// The same as the path tracer's connections have it.
Estimate share_by_tracer(Scene scene, const Lamp& lamp, const Patch& patch, int runs) {
  scene.interreflection = false;
  scene.lamps = {lamp};
  scene.surfaces.push_back({square_sheet(100.0, 0.0, false), Lambertian{grey(1.0)}});
  const Tracer tracer(scene);
  const double n = scene.media[2].index;
  RandomStream random(5, 0, Purpose::kTest);
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < runs; ++i) {
    RenderSettings settings = samples(16);
    settings.seed = static_cast<std::uint64_t>(i);
    const double x = patch.x + patch.half * (2.0 * random.uniform() - 1.0);
    const double y = patch.y + patch.half * (2.0 * random.uniform() - 1.0);
    const double irradiance = kPi * n * n * tracer.radiance({x, y, -0.01}, {0, 0, 1}, settings)[0];
    const double share = irradiance * 4.0 * patch.half * patch.half * 1e-6;
    sum += share;
    squares += share * share;
  }
  const double mean = sum / runs;
  return {mean, std::sqrt((squares / runs - mean * mean) / (runs - 1))};
}

void expect_equal(const Estimate& a, const Estimate& b, double accuracy, const char* what) {
  EXPECT_GT(a.mean, 0.0) << what;
  EXPECT_LT(std::hypot(a.error, b.error), accuracy * a.mean) << what << ": the test is too coarse";
  EXPECT_LT(difference(a, b), 4.0) << what << ": " << a.mean << " +- " << a.error << " and " << b.mean << " +- "
                                   << b.error;
}

TEST(Guide, LightsTheMembraneAsPhotonsDo) {
  struct Case {
    const char* what;
    double plate, gel, tilt, half_power;
    Patch patch;
  };
  for (const Case& c : {Case{"a gel of higher index", 1.45, 1.5, 0.0, 0.25, {0, 0, 3}},
                        Case{"acrylic and silicone, a rising lobe", 1.49, 1.41, 0.4, 0.2, {2, 1, 3}},
                        Case{"a sinking lobe", 1.49, 1.41, -0.5, 0.3, {4, -2, 3}},
                        Case{"index-matched, a wide lobe, off the guide's width", 1.41, 1.41, 0.2, 1.0, {-3, 8, 3}}}) {
    const Scene scene = plate_and_gel(c.plate, c.gel);
    const GuideLamp lamp = guide(c.tilt, c.half_power);
    expect_equal(share_by_photons(scene, lamp, c.patch, 1000000), share_by_tracer(scene, lamp, c.patch, 4000), 0.02,
                 c.what);
  }
}

TEST(Guide, HasTheLightOfALuminousEndThatPathsRunInto) {
  Scene scene = plate_and_gel(1.49, 1.45);
  const GuideLamp lamp = guide(0.0, kLambertianHalfPower);
  AreaLamp end;
  end.centre = {-9, 0, -6.5};
  end.direction = {1, 0, 0};
  end.along = {0, 1, 0};
  end.width = 12.0;
  end.height = 3.0;
  end.power_W = grey(1.0);
  end.visible = true;
  // Small things that see the guide, or its light come by mirrors, and next to nothing of themselves.
  struct Place {
    const char* what;
    double z;
    bool up;
  };
  for (const Place& place :
       {Place{"in the gel, facing the plate", -2.0, false}, Place{"in the plate, facing up", -7.0, true},
        Place{"in the plate, facing down", -5.5, false}}) {
    Scene small = scene;
    small.surfaces.push_back({square_sheet(0.02, place.z, place.up), Lambertian{grey(0.5)}});
    small.surfaces.push_back({square_sheet(0.02, place.z + (place.up ? -0.01 : 0.01), place.up), Black{}});
    const Eigen::Vector3d eye(0, 0, place.z + (place.up ? 0.5 : -0.5));
    const Eigen::Vector3d viewing(0, 0, place.up ? -1 : 1);
    small.lamps = {lamp};
    const Estimate by_images = view(small, eye, viewing, 1000);
    small.lamps = {end};
    const Estimate by_paths = view(small, eye, viewing, 8000);
    expect_equal(by_images, by_paths, 0.02, place.what);
  }
}

TEST(Guide, SendsNothingIntoAGelThatMirrorsItAll) {
  const Scene scene = plate_and_gel(1.49, 1.41);
  // The critical angle leaves 18.9 degrees; the lobe at twelve half-power angles is 1e-30 or so.
  const Estimate none = share_by_tracer(scene, guide(0.0, 0.02), {0, 0, 3}, 50);
  EXPECT_LT(none.mean, 1e-20);
}

TEST(Guide, LightIsWeakenedByThePlatesAbsorption) {
  Scene scene = plate_and_gel(1.45, 1.5);
  const GuideLamp lamp = guide(0.0, 0.15);
  const Patch patch{6, 0, 0.5};
  const double clear = share_by_tracer(scene, lamp, patch, 400).mean;
  scene.media[1].absorption = grey(0.05);
  const double dim = share_by_tracer(scene, lamp, patch, 400).mean;
  // Some 15 mm in all, part of it in the gel.
  EXPECT_LT(dim, 0.99 * clear);
  EXPECT_GT(dim, std::exp(-0.05 * 16.5) * clear);
}

TEST(Guide, PreviewShowsItsLight) {
  Scene scene = plate_and_gel(1.45, 1.5);
  scene.interreflection = false;
  scene.lamps = {guide(0.0, 0.2)};
  scene.surfaces.push_back({square_sheet(10.0, 0.0, false), Lambertian{grey(0.8)}});
  const Tracer tracer(scene);
  PinholeCamera camera = small_camera(16, 16);
  const double traced = cv::mean(tracer.render(camera, samples(256)).irradiance)[0];
  const double preview = cv::mean(tracer.preview(camera, 1))[0];
  EXPECT_NEAR(preview / traced, 1.0, 0.15);
}

}  // namespace
}  // namespace touchstone::render
