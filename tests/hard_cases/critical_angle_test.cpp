// The hard case of light at the critical angle, 46: where Fresnel's reflectance reaches one with an infinite slope, and
// refracted light runs along the face. Exactly there, and units in the last place beside it.

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/random.h"
#include "core/units.h"
#include "light_laws.h"
#include "render/direct/light_field.h"
#include "render/lamps/guide_connection.h"
#include "render/materials/fresnel.h"
#include "render/materials/layer_connection.h"
#include "render/materials/rough_dielectric.h"
#include "render/sampling/warps.h"

namespace touchstone::render {
namespace {

/// The double that is `steps` units in the last place from `value`.
double beside(double value, int steps) {
  for (; steps > 0; --steps) value = std::nextafter(value, HUGE_VAL);
  for (; steps < 0; ++steps) value = std::nextafter(value, -HUGE_VAL);
  return value;
}

/// Indices from dense to thin: glass, acrylic and gel to gel and air, nearly equal ones, and diamond.
constexpr std::pair<double, double> kPairs[] = {{1.52, 1.0},   {1.49, 1.41},      {1.41, 1.0},
                                                {1.5, 1.4999}, {1.0 + 1e-9, 1.0}, {2.4, 1.0}};

double critical_cosine(double dense, double thin) {
  return std::sqrt((dense - thin) * (dense + thin)) / dense;
}

/// Reflectances of both polarisations, in long double.
std::pair<double, double> reflectances(double dense, double thin, double cosine) {
  const long double n1 = dense, n2 = thin, c1 = cosine;
  const long double square = 1.0L - n1 / n2 * (n1 / n2) * (1.0L - c1 * c1);
  if (square <= 0.0L) return {1.0, 1.0};
  const long double c2 = std::sqrt(square);
  const long double s = (n1 * c1 - n2 * c2) / (n1 * c1 + n2 * c2);
  const long double p = (n2 * c1 - n1 * c2) / (n2 * c1 + n1 * c2);
  return {static_cast<double>(s * s), static_cast<double>(p * p)};
}

TEST(HardCase46, FresnelsReflectanceReachesOneThere) {
  // Rounding of some 1e-15 in the square of the refracted cosine is 4e-8 in that cosine, and 4 n of it is what the
  // reflectance is short of one by. 50 last digits are 1e-7 of it.
  Worst away{2e-6};
  Worst rise{5e-6};
  int places = 0;
  for (const auto& [dense, thin] : kPairs) {
    const double there = critical_cosine(dense, thin);
    // Nearly equal indices make all of it steeper: what a cosine is short of counts by 1 over it.
    const double steepness = 1.0 / there;
    const auto check = [&](double cosine) {
      const FresnelFace face = fresnel(dense, thin, cosine);
      ASSERT_TRUE(std::isfinite(face.reflectance_s) && std::isfinite(face.reflectance_p)) << cosine;
      EXPECT_TRUE(face.reflectance_s >= 0.0 && face.reflectance_s <= 1.0) << cosine;
      EXPECT_TRUE(face.reflectance_p >= 0.0 && face.reflectance_p <= 1.0) << cosine;
      EXPECT_TRUE(face.cos_refracted >= 0.0 && face.cos_refracted <= 1.0) << cosine;
      const auto [s, p] = reflectances(dense, thin, cosine);
      EXPECT_LT(away(std::max(std::abs(face.reflectance_s - s), std::abs(face.reflectance_p - p)) / steepness),
                away.bar)
          << dense << " to " << thin << " at " << cosine;
      ++places;
    };
    for (int steps = -50; steps <= 50; ++steps) {
      check(beside(there, steps));
      EXPECT_LT(rise((1.0 - fresnel(dense, thin, beside(there, steps)).mean_reflectance()) / steepness), rise.bar);
    }
    double before = 1.0;
    for (double part = 1e-15; part < 0.5; part *= 1.7) {
      check(std::min(1.0, there * (1.0 + part)));
      check(there * (1.0 - part));
      const double beyond = there * (1.0 - std::max(part, 1e-10));
      if (dense > (1.0 + 1e-6) * thin) {
        EXPECT_EQ(fresnel(dense, thin, beyond).mean_reflectance(), 1.0);
      }
      const double s = fresnel(dense, thin, std::min(1.0, there * (1.0 + part))).reflectance_s;
      EXPECT_LE(s, before + away.bar * steepness) << "it falls from one on";
      before = s;
    }
  }
  did("Fresnel's reflectances at {} places round the critical angles of six pairs of indices: 0 to 1, those of long "
      "double "
      "to {}; at the angle and 50 last digits to either side short of one by {}",
      places, away.text(), rise.text());
}

/// Glass below z = 0 with a black floor at z = -4, air and a sky of one above.
Scene over_black(double index) {
  Scene scene = empty_scene(1.0);
  scene.media = {Medium{index, {}}, Medium{1.0, {}}};
  scene.faces = {{0.0, 0, 1}};
  scene.surfaces.push_back({square_sheet(5000.0, -4.0), Black{}});
  return scene;
}

TEST(HardCase46, APathThroughTheFaceCarriesWhatFresnelLeaves) {
  constexpr double kIndex = 1.52;
  const Tracer tracer(over_black(kIndex));
  Scene white = empty_scene(1.0);
  white.media = {Medium{kIndex, {}}, Medium{1.0, {}}};
  white.faces = {{0.0, 0, 1}};
  const Tracer furnace(white);
  const double there = critical_cosine(kIndex, 1.0);
  // A branch of under a percent is followed now and then: six times the noise of 4096 paths.
  Worst away{5e-4};
  Worst energy{5e-4};
  std::vector<double> cosines;
  for (int steps = -8; steps <= 8; ++steps) cosines.push_back(beside(there, steps));
  for (double part = 1e-14; part < 0.1; part *= 10.0) {
    cosines.push_back(there * (1.0 + part));
    cosines.push_back(there * (1.0 - part));
  }
  for (const double cosine : cosines) {
    const Eigen::Vector3d direction(std::sqrt(1.0 - cosine * cosine), 0.0, cosine);
    const double seen = tracer.radiance({0, 0, -1}, direction, samples(4096))[0];
    const auto [s, p] = reflectances(kIndex, 1.0, cosine);
    const double wanted = 1.0 - 0.5 * (s + p);  // a tracer's radiance is that over the index's square
    ASSERT_TRUE(std::isfinite(seen)) << cosine;
    EXPECT_GE(seen, 0.0);
    EXPECT_LT(away(std::abs(seen - wanted)), away.bar) << cosine - there;
    const double all = furnace.radiance({0, 0, -1}, direction, samples(4096))[0];
    EXPECT_LT(energy(std::abs(all - 1.0)), energy.bar) << cosine - there;
  }
  did("rays in glass under a sky of 1 at {} angles round the critical one, exactly there and last digits beside it: "
      "they "
      "see what Fresnel lets through, to {}; without a black floor 1, to {}",
      cosines.size(), away.text(), energy.text("relative"));
}

// A point in the glass, depth h below the face, and a place t above it: with the angle in the glass the lateral
// distance is r = h tan + t tan', and what a ring of it gets is what leaves the point between two angles,
//   E_level r dr = I (1 - R) sin d(angle).
TEST(HardCase46, ALampUnderTheFaceLightsWhatLiesAlongIt) {
  constexpr double kIndex = 1.52, kDepth = 2.0;
  const double there = std::asin(1.0 / kIndex);
  Worst away{1e-6};
  Worst nearest{1e-2};  // within 1e-8 rad: of what is let through, 1e-4 and less, rounding of one takes its share
  int places = 0;
  for (const double above : {1.0, 1e-3, 1e-6, 1e-9}) {
    for (double short_of = 0.3; short_of > 1e-13; short_of *= 0.1) {
      const double angle = there - short_of;
      const double sine = kIndex * std::sin(angle);
      const double refracted = std::sqrt((1.0 - sine) * (1.0 + sine));
      const double r = kDepth * std::tan(angle) + above * sine / refracted;
      if (!(r < 1e5)) continue;
      const Layer layers[] = {{kDepth, kIndex}, {above, 1.0}};
      const auto path = solve_layer_path(layers, r);
      ASSERT_TRUE(path) << above << " " << short_of;
      ASSERT_TRUE(std::isfinite(path->jacobian) && path->jacobian >= 0.0);
      EXPECT_TRUE(path->transmittance >= 0.0 && path->transmittance <= 1.0);
      // Of the path that was found: at the face the distance says little of the angle, and its rounding decides.
      const double c1 = path->cosine[0], c2 = path->cosine[1];
      const double t1 = path->tangent[0], t2 = path->tangent[1];
      EXPECT_LT(away(std::abs((kDepth * t1 + above * t2) / r - 1.0)), away.bar);
      EXPECT_LT(away(std::abs(kIndex * t1 * c1 - t2 * c2)), away.bar) << "Snell's law";
      const double slope = kDepth / (c1 * c1) + above * kIndex * c1 / (c2 * c2 * c2);  // dr / d(angle)
      const double level = path->jacobian * path->transmittance * c2;
      const double both = 2.0 * kIndex * c1 * c2;
      const double passed = both / std::pow(kIndex * c1 + c2, 2) + both / std::pow(c1 + kIndex * c2, 2);
      Worst& bar = short_of > 1e-8 ? away : nearest;
      EXPECT_LT(bar(std::abs(level * r * slope / (passed * t1 * c1) - 1.0)), bar.bar) << above << " " << short_of;
      ++places;
    }
    // Far beyond the critical circle: nothing but light along the face gets there.
    for (const double r : {1.4, 2.0, 50.0, 1e4, 1e8, 1e300}) {
      const Layer layers[] = {{kDepth, kIndex}, {above, 1.0}};
      const auto path = solve_layer_path(layers, r);
      if (!path) continue;
      EXPECT_TRUE(std::isfinite(path->jacobian) && path->jacobian >= 0.0) << r;
      EXPECT_TRUE(std::isfinite(path->transmittance) && path->transmittance <= 1.0) << r;
      for (int k = 0; k < 2; ++k) EXPECT_TRUE(path->cosine[k] >= 0.0 && path->cosine[k] <= 1.0) << r;
    }
  }
  // In the face itself: up to the critical circle as in air right above, from there on dark.
  const double circle = kDepth * std::tan(there);
  for (int steps = -5; steps <= 5; ++steps) {
    const Layer layers[] = {{kDepth, kIndex}, {0.0, 1.0}};
    const auto path = solve_layer_path(layers, beside(circle, steps));
    if (!path) continue;
    EXPECT_TRUE(std::isfinite(path->jacobian * path->transmittance)) << steps;
    EXPECT_LT(path->jacobian * path->transmittance * path->cosine[1], 1e-6) << steps;
  }
  const Layer in_the_face[] = {{kDepth, kIndex}, {0.0, 1.0}};
  EXPECT_FALSE(solve_layer_path(in_the_face, 1.001 * circle)) << "no light gets there";
  did("a lamp 2 mm under glass, {} places from 1 to 1e-9 mm over it that its light reaches from 0.3 down to 1e-13 rad "
      "of "
      "the critical angle: Snell's law, the distance and the light's energy to {}, within 1e-8 rad to {}",
      places, away.text("relative"), nearest.text());
}

TEST(HardCase46, ARoughFaceThereIsFinite) {
  constexpr double kIndex = 1.52;
  const double there = critical_cosine(kIndex, 1.0);
  Worst energy{1.0 + 1e-9};
  for (const double alpha : {1e-3, 0.1, 1.0}) {
    for (int steps = -5; steps <= 5; ++steps) {
      const double cosine = beside(there, steps);
      const Eigen::Vector3d out(std::sqrt(1.0 - cosine * cosine), 0.0, cosine);
      // Light along the face on the other side, which the middle facet would send there.
      for (const double rise : {0.0, 1e-300, 1e-16, 1e-8, 0.1}) {
        const Eigen::Vector3d in(-std::sqrt(1.0 - rise * rise), 0.0, -rise);
        const double value = rough_dielectric(out, in, alpha, kIndex, 1.0);
        EXPECT_TRUE(std::isfinite(value) && value >= 0.0) << alpha << " " << rise;
      }
      for (const double w : {0.0, 0.5, 1.0 - 1e-16}) {
        for (const double u : {0.0, 0.37, 1.0 - 1e-16}) {
          const RoughSample sample = sample_rough_dielectric(out, alpha, kIndex, 1.0, u, 0.0, w);
          EXPECT_TRUE(sample.in.allFinite() && std::isfinite(sample.weight));
          EXPECT_LT(energy(sample.weight), energy.bar);
          EXPECT_NEAR(sample.in.norm(), 1.0, 1e-9);
        }
      }
    }
  }
  did("a rough face seen from glass at the critical angle and last digits beside it: values finite, weights up to {}",
      energy.text());
}

/// Air, acrylic from z = -8 to -5, gel above; a guide in the acrylic whose axis rises by `tilt`.
Scene guide_scene(double tilt, double half_power_angle) {
  Scene scene = empty_scene(0.0);
  scene.interreflection = false;
  scene.media = {Medium{1.0, {}}, Medium{1.49, {}}, Medium{1.41, {}}};
  scene.faces = {{-8.0, 0, 1}, {-5.0, 1, 2}};
  GuideLamp lamp;
  lamp.centre = {-9, 0, -6};
  lamp.direction = {1, 0, 0};
  lamp.tilt = tilt;
  lamp.width = 12.0;
  lamp.half_power_angle = half_power_angle;
  lamp.power_W = grey(1.0);
  scene.lamps = {lamp};
  return scene;
}

const double kGuideCritical = std::acos(1.41 / 1.49);  // steepness in the plate from which the gel gets light

/// Share of the guide's power that lands on |x| < 30, |y| < 30 of the plane z = 0 through the gel, by photons.
Estimate share_by_photons(const Scene& scene, int photons) {
  const auto& lamp = std::get<GuideLamp>(scene.lamps[0]);
  const double m = lobe_exponent(lamp.half_power_angle);
  const NormalFrame frame(Eigen::Vector3d(std::cos(lamp.tilt), 0.0, std::sin(lamp.tilt)));
  RandomStream random(46, 0, Purpose::kTest);
  int landed = 0;
  for (int i = 0; i < photons; ++i) {
    Eigen::Vector3d at(lamp.centre.x(), lamp.width * (random.uniform() - 0.5), -8.0 + 3.0 * random.uniform());
    const double cosine = std::pow(1.0 - random.uniform(), 1.0 / (m + 1.0));
    const double azimuth = 2.0 * kPi * random.uniform();
    const double sine = std::sqrt(1.0 - cosine * cosine);
    Eigen::Vector3d direction = frame.to_world({sine * std::cos(azimuth), sine * std::sin(azimuth), cosine});
    if (direction.x() <= 0.0) continue;  // a narrow lobe hardly has any
    const bool is_s = random.uniform() < 0.5;
    for (int bounce = 0; bounce < 10000 && at.x() < 100.0; ++bounce) {
      const bool up = direction.z() > 0.0;
      at += ((up ? -5.0 : -8.0) - at.z()) / direction.z() * direction;
      const FresnelFace face = fresnel(1.49, up ? 1.41 : 1.0, std::abs(direction.z()));
      if (random.uniform() < (is_s ? face.reflectance_s : face.reflectance_p)) {
        direction.z() = -direction.z();
        continue;
      }
      if (up) {
        const Eigen::Vector2d flat = direction.head<2>() * (1.49 / 1.41);
        const Eigen::Vector2d end = at.head<2>() + 5.0 * flat / std::sqrt(1.0 - flat.squaredNorm());
        if (std::abs(end.x()) < 30.0 && std::abs(end.y()) < 30.0) ++landed;
      }
      break;
    }
  }
  const double share = static_cast<double>(landed) / photons;
  return {share, std::sqrt(share * (1.0 - share) / photons)};
}

/// The same by connections, at random places.
Estimate share_by_connections(const Scene& scene, int places) {
  const PreparedScene<1> prepared(scene);
  RandomStream random(47, 0, Purpose::kTest);
  double sum = 0.0, squares = 0.0;
  std::uint64_t uncounted = 0;
  for (int i = 0; i < places; ++i) {
    const Eigen::Vector3d place(60.0 * random.uniform() - 30.0, 60.0 * random.uniform() - 30.0, 0.0);
    const Receiver receiver{place, Eigen::Vector3d(0, 0, -1), 2, 2};
    Arrival<1> arrival;
    double share = 0.0;
    if (connect_to_guide(prepared, prepared.lamps[0], {random.uniform(), random.uniform()}, receiver, uncounted,
                         arrival)) {
      share = arrival.irradiance[0] * -arrival.direction.z() * 3600e-6;
      EXPECT_TRUE(std::isfinite(share) && share >= 0.0);
    }
    sum += share;
    squares += share * share;
  }
  const double mean = sum / places;
  return {mean, std::sqrt((squares / places - mean * mean) / (places - 1))};
}

TEST(HardCase46, AGuideAimedThereGivesTheGelItsShare) {
  Worst away{4.0};
  std::string shares;
  for (const double half_power : {0.02, 0.2}) {
    const Scene scene = guide_scene(kGuideCritical, half_power);
    const Estimate photons = share_by_photons(scene, 200000);
    const Estimate connected = share_by_connections(scene, 200000);
    EXPECT_LT(std::hypot(photons.error, connected.error), 0.03 * photons.mean) << "the test is too coarse";
    EXPECT_LT(away(std::abs(photons.mean - connected.mean) / std::hypot(photons.error, connected.error)), away.bar)
        << photons.mean << " and " << connected.mean;
    EXPECT_LE(connected.mean, 1.0 + 5.0 * connected.error);
    shares += fmt::format("{}{:.4f} of {:.4f}", shares.empty() ? "" : ", ", connected.mean, photons.mean);
    // A last digit of the tilt is one of the light.
    const Estimate beside_it = share_by_connections(guide_scene(beside(kGuideCritical, 1), half_power), 3000);
    const Estimate there = share_by_connections(scene, 3000);
    EXPECT_NEAR(beside_it.mean, there.mean, 1e-9 * there.mean);
  }
  did("a guide in acrylic whose axis meets silicone at the critical angle, with a lobe of 0.02 and of 0.2 rad: on 60 x "
      "60 "
      "mm lands {} of its power by photons, {} standard errors apart",
      shares, away.text());
}

// A narrow lobe aimed there: the light of a light field is that of connections, at places that see the exit face there.
TEST(HardCase46, TheFastLightOfAGuideAimedThereIsThatOfItsConnections) {
  const Scene scene = guide_scene(kGuideCritical, 0.1);
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-6, -3, -1), Eigen::Vector3d(6, 3, 0));
  LightFieldSettings rough;
  rough.accuracy = 0.5;
  const LightField field = make_light_field(scene, box, rough);
  for (const float value : field.flow) ASSERT_TRUE(std::isfinite(value));
  LightFieldSettings fine;
  fine.guide_points = 12;
  Scene unit = scene;
  std::get<GuideLamp>(unit.lamps[0]).power_W = grey(emission_integral(scene.lamps[0]));
  const PreparedScene<1> prepared(unit);
  Worst away{0.01};
  for (const Eigen::Vector3d& place : {Eigen::Vector3d(0, 0, 0), {5, 2, -0.5}, {-5, -2, 0}}) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    constexpr int kSide = 200;
    std::uint64_t uncounted = 0;
    for (int i = 0; i < kSide * kSide; ++i) {
      Arrival<1> arrival;
      const Receiver receiver{place, Eigen::Vector3d::Zero(), 2, 2};
      if (connect_to_guide(prepared, prepared.lamps[0], {(i % kSide + 0.5) / kSide, (i / kSide + 0.5) / kSide},
                           receiver, uncounted, arrival)) {
        sum -= arrival.irradiance[0] * arrival.direction / (kSide * kSide);
      }
    }
    const Eigen::Vector3d found = exact_flow(field, 0, place, fine).head<3>();
    ASSERT_GT(sum.norm(), 0.0);
    EXPECT_LT(away((found - sum).norm() / sum.norm()), away.bar) << place.transpose();
  }
  did("a light field of that guide, {} numbers: all finite; its light at three places is that of connections, to {}",
      field.flow.size(), away.text("relative"));
}

TEST(HardCase46, LightExactlyThereAndBesideItInAGuideIsFinite) {
  const Scene scene = guide_scene(kGuideCritical, 0.2);
  const PreparedScene<1> prepared(scene);
  const PreparedLamp<1>& lamp = prepared.lamps[0];
  Worst jump{1e-3};
  int finite = 0;
  for (const double height : {0.0, -4.999, -5.0 + 1e-9, -5.0}) {
    const Receiver receiver{{4, 0, height}, Eigen::Vector3d::Zero(), 2, 2};
    const LayersBeyondPlate beyond = layers_beyond_plate(prepared, lamp.layer, receiver);
    const BeforeGuide before = before_guide(lamp, receiver.position);
    const GuideBearing bearing = guide_bearing(lamp, before.forward, 0.0);
    std::uint64_t uncounted = 0;
    const auto light = [&](double steepness) {
      Arrival<1> arrival;
      if (!guide_light_along(prepared, lamp, beyond, bearing, steepness, true, receiver, uncounted, arrival))
        return 0.0;
      EXPECT_TRUE(arrival.direction.allFinite());
      EXPECT_NEAR(arrival.direction.norm(), 1.0, 1e-9);
      // What lies flat gets per area of its own, so that what runs along the face brings little.
      return arrival.irradiance[0] * std::abs(arrival.direction.z());
    };
    for (int steps = -50; steps <= 50; ++steps) {
      const double value = light(beside(kGuideCritical, steps));
      EXPECT_TRUE(std::isfinite(value) && value >= 0.0) << height << " " << steps;
      // Beside the light at steeper angles.
      EXPECT_LT(jump(value / light(kGuideCritical + 0.2)), jump.bar) << height << " " << steps;
      ++finite;
    }
  }
  did("light of a guide at {} angles in the last digits round the critical one, at places in the gel and in its face: "
      "finite, and per area of the face at most {} of that 0.2 rad steeper",
      finite, jump.text());
}

}  // namespace
}  // namespace touchstone::render
