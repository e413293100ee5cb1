// The hard cases of light, 27 and 28: media, lamps and light of extreme size. What a good program does with each stands
// in script/hard_cases_page.py; the numbers of their pictures are radiances.

#include <gmock/gmock.h>

#include "core/units.h"
#include "light_laws.h"
#include "render/materials/scattering.h"
#include "render/sampling/choice_by_power.h"
#include "render/sampling/warps.h"

namespace touchstone::render {
namespace {

using ::testing::HasSubstr;

Medium milk(double scattering, double absorption) {
  return {1.41, grey(absorption), grey(scattering), 0.0};
}

/// A slab 5 mm thick under glass, nothing behind it.
Scene slab(const Medium& medium, double environment) {
  Scene scene = sensor_stack(environment);
  scene.media[2] = medium;
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 2}, {0.0, 2, 0}};
  return scene;
}

/// What glass and gel mirror at normal incidence.
double mirrored_by_the_faces() {
  const auto face = [](double a, double b) { return std::pow((a - b) / (a + b), 2); };
  return face(1.0, 1.52) + std::pow(1.0 - face(1.0, 1.52), 2) * face(1.52, 1.41);
}

/// A matt sheet under glass and gel, lit by nothing yet.
Scene sheet(double albedo = 0.7) {
  Scene scene = sensor_stack(0.0);
  scene.surfaces.push_back({square_sheet(12.0, 0.0, false), Lambertian{grey(albedo)}});
  return scene;
}

SpotLamp lamp_at(const Eigen::Vector3d& position, const Eigen::Vector3d& direction, double lens_radius,
                 double power_W) {
  SpotLamp lamp = half_space_lamp(position, direction, 1.0);
  lamp.lens_radius = lens_radius;
  lamp.power_W = grey(power_W);
  return lamp;
}

/// Two pictures are the same within their noise, of which single precision leaves 1e-4.
void expect_alike(const std::string& what, const Seen& a, const Seen& b) {
  const Eigen::ArrayXd allowed = 5.0 * (a.error.square() + b.error.square()).sqrt() + 1e-4 * a.most();
  Worst away{1.0};
  EXPECT_LT(away(((a.mean - b.mean).abs() / allowed).maxCoeff()), away.bar);
  did("{}: pixels differ by at most {} of 5 standard errors", what, away.text());
}

TEST(HardCase27Media, WhiteMilkOf5000MeanFreePathsReturnsTheSky) {
  // A walk takes a thousand steps here and may take millions; what ends the long ones must leave the mean alone and
  // make no fireflies.
  const Tracer tracer(slab(milk(1000.0, 0.0), 1.0));
  constexpr int kRuns = 40;
  Eigen::ArrayXd seen(kRuns);
  for (int run = 0; run < kRuns; ++run) {
    RenderSettings settings = samples(256, 10000);
    settings.seed = static_cast<std::uint64_t>(run);
    seen[run] = tracer.radiance({0, 0, -9}, {0.3, 0, 1}, settings)[0];
  }
  EXPECT_TRUE(seen.allFinite());
  EXPECT_GT(seen.minCoeff(), 0.0);
  Worst firefly{6.0};
  EXPECT_LT(firefly(farthest(seen, 1e-6)), firefly.bar);
  const double error = std::sqrt((seen - seen.mean()).square().sum() / (kRuns * (kRuns - 1.0)));
  EXPECT_NEAR(seen.mean(), 1.0, 4.0 * error + 1e-9);
  did("white milk 5000 mean free paths thick under a sky of 1: {:.4f} +- {:.4f}; the farthest of {} runs is {} off",
      seen.mean(), error, kRuns, firefly.text("standard deviations"));
}

TEST(HardCase27Media, WeightsOfLongWalksGrowAsWalksBecomeRareAndTheirMeanLengthIsFinite) {
  // A walk is still inside a half space of white milk after n scatterings with a chance of n^(-1/2), and inside a slab
  // of tau mean free paths for some tau^2 scatterings.
  constexpr double kThickest = 5000.0;
  double weight = 1.0;
  double before = HUGE_VAL;
  Worst share{1.0};
  Worst fall{0.8};
  for (std::int64_t n = 2; n < (std::int64_t{1} << 60); n *= 2) {
    if (roulette_is_due(n)) weight /= share_of_walks_kept(n);
    const auto length = static_cast<double>(n);
    const double rare = std::pow(length, -0.5);
    if (length < kThickest * kThickest) {
      // Of the walks of this length 1 / weight are left, each of that weight, so to the variance they add their chance
      // times it: no more than the first ones that the roulette meets.
      EXPECT_LE(share(rare * weight / (1.5 / std::sqrt(static_cast<double>(kFreeScatterings)) + rare)), share.bar) << n;
    } else if (length > 4096.0 * static_cast<double>(kFreeScatterings)) {
      const double steps = length * rare / weight;  // what they add to the mean length
      EXPECT_LT(fall(steps / before), fall.bar) << n;
      before = steps;
    }
  }
  did("what long walks in milk add to the variance: {} of what the first ones that may end do; what walks twice as "
      "long add to the mean length: {} of it",
      share.text(), fall.text());
}

TEST(HardCase27Media, GreyMilkOf5000MeanFreePathsReturnsLess) {
  double before = 1.0;
  std::string all;
  for (const double albedo : {0.999, 0.99, 0.5, 0.0}) {
    const Seen seen = render_checked(slab(milk(1000.0 * albedo, 1000.0 * (1.0 - albedo)), 1.0), few_pixels(), 64);
    EXPECT_LT(seen.most(), before) << albedo;
    before = seen.most();
    all += fmt::format("{}{:.4g} at an albedo of {}", all.empty() ? "" : ", ", before, albedo);
  }
  EXPECT_NEAR(before, mirrored_by_the_faces(), 0.01) << "nothing comes back out of the black one";
  did("grey milk as thick under a sky of 1: {} (the faces alone mirror {:.4g})", all, mirrored_by_the_faces());
}

TEST(HardCase27Media, MilkLitByALampGivesBackNoMoreThanItGets) {
  // A point lamp square over a half space of white milk without faces: the whole plane gives back at most what it got,
  // so seen from straight above, summed over rings, 2 pi times the integral of pi L r is at most 2 pi of the lamp's.
  Scene scene = empty_scene(0.0);
  scene.media = {Medium{}, Medium{1.0, {}, grey(20.0), 0.5}};
  scene.faces = {{0.0, 1, 0}};
  scene.lamps.push_back(half_space_lamp({0, 0, 4}, {0, 0, -1}, 1.0));
  const Tracer tracer(scene);
  double flux = 0.0;
  constexpr double kStep = 0.5;
  for (double r = 0.5 * kStep; r < 30.0; r += kStep) {
    const Eigen::Vector3d from(r, 0, 10);
    flux += 2.0 * kPi * r * kStep * kPi * 1e-6 * tracer.radiance(from, {0, 0, -1}, samples(64, 64))[0];
  }
  // Of the half space's 2 pi W this ring's plane catches 2 pi (1 - 4/hypot(4, 30)); not Lambert's law, but near it.
  const double caught = 2.0 * kPi * (1.0 - 4.0 / std::hypot(4.0, 30.0));
  EXPECT_LT(flux, 1.25 * caught);
  EXPECT_GT(flux, 0.6 * caught);
  did("white milk under a lamp gives back {:.3g} of what it gets, judged by its light straight up (allowed 0.6 to "
      "1.25, as it "
      "needn't be matt)",
      flux / caught);
}

TEST(HardCase27Media, GelSoDarkThatNothingReturnsShowsTheFacesOnly) {
  Worst away{0.01};
  Worst most{0.12};
  for (const double absorption : {1e2, 1e4, 1e300}) {
    Scene scene = slab(Medium{1.41, grey(absorption)}, 1.0);
    scene.surfaces.push_back({square_sheet(12.0, -1.0, false), Lambertian{grey(1.0)}});
    scene.lamps.push_back(lamp_at({8, 0, -20}, {-8, 0, 20}, 1.0, 1.0));
    const Seen seen = render_checked(scene, few_pixels(), 64);
    EXPECT_LT(away(std::abs(seen.least() - mirrored_by_the_faces())), away.bar) << absorption;
    EXPECT_LT(most(seen.most()), most.bar) << absorption;
  }
  did("gel that absorbs 100 to 1e300 a mm under a sky of 1: at most {}, and what the faces mirror to {}", most.text(),
      away.text());
}

TEST(HardCase27Media, MilkBehindAPlateThatLetsNothingThroughIsDark) {
  Worst plate{0.08};
  Worst behind{1e-3};
  // What arrives there carries exactly nothing, and must not turn into NaN where a share of it is asked for.
  for (const double scattering : {0.1, 10.0}) {
    for (const double absorption : {1e3, 1e4}) {
      Scene scene = slab(milk(scattering, 0.0), 1.0);
      scene.media[1].absorption = grey(absorption);
      scene.lamps.push_back(lamp_at({8, 0, -20}, {-8, 0, 20}, 1.0, 1.0));
      EXPECT_LT(plate(render_checked(scene, few_pixels(), 64).most()), plate.bar);
    }
    // A black film in the milk ends what passes it; what comes from before it is left.
    Scene film = slab(milk(scattering, 0.0), 0.0);
    film.surfaces.push_back({square_sheet(100.0, -2.5), ThinFilm{grey(0.0)}});
    film.balls.push_back({{0, 0, -1}, 0.5, Emitter{grey(1.0)}});
    EXPECT_LT(behind(render_checked(film, few_pixels(), 32).most()), behind.bar);
  }
  did("milk behind an opaque plate under a sky of 1: {}; a lamp of 1 behind a black film in milk: {}", plate.text(),
      behind.text());
}

TEST(HardCase27Media, BandsThatDieAtDifferentDepthsStayFinite) {
  Scene scene;
  scene.environment = flat_spectrum(3, 1.0);
  const Spectrum dies = Bands<3>(0.0, 30.0, 1e6);
  scene.media = {Medium{1.0}, Medium{1.5, dies}, Medium{1.41, dies, Bands<3>(5.0, 1e-6, 0.0), 0.9}};
  scene.faces = {{-7.0, 0, 1}, {-5.0, 1, 2}, {0.0, 2, 0}};
  const Seen seen = render_checked(scene, few_pixels(), 64);
  EXPECT_LT(seen.most(), 1.2);
  did("three bands that die after 0, 0.03 and 1e-6 mm under a sky of 1: {} (allowed up to 1.2)", seen.range());
}

TEST(HardCase27Lamps, ThousandsAreTheirSum) {
  // 4,000 lamps on a 1 mm disc against one lens of that size.
  Scene one = sheet();
  one.lamps.push_back(lamp_at({8, 0, -20}, {-8, 0, 20}, 0.5, 4.0));
  Scene many = sheet();
  for (int i = 0; i < 4000; ++i) {
    SpotLamp lamp = lamp_at({8, 0, -20}, {-8, 0, 20}, 0.0, 1e-3);
    const double turn = 2.399963 * i;  // the golden angle
    const double radius = 0.5 * std::sqrt((i + 0.5) / 4000.0);
    const NormalFrame frame(lamp.direction.normalized());
    lamp.position += radius * (std::cos(turn) * frame.x + std::sin(turn) * frame.y);
    many.lamps.push_back(lamp);
  }
  const Seen a = render_checked(one, few_pixels(), 64);
  const Seen b = render_checked(many, few_pixels(), 64);
  expect_alike("4000 point lamps on a lens of 1 mm against one lamp of that size", a, b);
}

TEST(HardCase27Lamps, OneWithLightAmongThousandsWithoutIsFound) {
  Scene one = sheet();
  one.lamps.push_back(lamp_at({8, 0, -20}, {-8, 0, 20}, 0.5, 1.0));
  Scene many = one;
  for (int i = 0; i < 5000; ++i) many.lamps.push_back(lamp_at({8, 0, -20}, {-8, 0, 20}, 0.5, 0.0));
  const Seen a = render_checked(one, few_pixels(), 64);
  const Seen b = render_checked(many, few_pixels(), 64);
  expect_alike("one lamp among 5000 without light against it alone", a, b);
}

TEST(HardCase27Lamps, TheChoiceAmongThousandsIsInProportionToPower) {
  ChoiceByPower choice;
  const std::vector<double> powers = {0.0, 1e-9, 0.0, 3.0, 0.0, 0.0, 1.0, 4.0, 0.0};
  for (const double power : powers) choice.add(power);
  std::vector<double> share(powers.size(), 0.0);
  constexpr int kNumbers = 80000;
  for (int i = 0; i < kNumbers; ++i) {
    const auto [lamp, probability] = choice.choose((i + 0.5) / kNumbers);
    ASSERT_GT(powers[lamp], 0.0);
    EXPECT_EQ(probability, choice.probability(lamp));
    share[lamp] += 1.0 / kNumbers;
  }
  Worst away{2.0 / kNumbers};
  for (std::size_t i = 0; i < powers.size(); ++i) {
    EXPECT_LT(away(std::abs(share[i] - powers[i] / 8.0)), away.bar) << i;
  }
  did("lamps of powers 0, 1e-9, 1, 3 and 4 are chosen in proportion to them, to {}; those of 0 never", away.text());
  EXPECT_EQ(choice.choose(0.0).first, 1);
  EXPECT_EQ(choice.choose(std::nextafter(1.0, 0.0)).first, 7);
}

TEST(HardCase27Lamps, ExactlyAtAFaceIsJustBelowIt) {
  Worst away{1e-3};
  for (const double z : {-7.0, -5.0}) {
    Scene at = sheet();
    Scene below = at;
    at.lamps.push_back(lamp_at({6, 0, z}, {-1, 0, 1}, 0.0, 1.0));
    below.lamps.push_back(lamp_at({6, 0, z - 1e-7}, {-1, 0, 1}, 0.0, 1.0));
    const Seen a = render_checked(at, few_pixels());
    const Seen b = render_checked(below, few_pixels());
    EXPECT_GT(a.most(), 0.0);
    EXPECT_LT(away(((a.mean - b.mean).abs() / b.most()).maxCoeff()), away.bar) << z;
  }
  did("a lamp exactly in a face against one 1e-7 mm below it: pixels differ by {} of the brightest", away.text());
}

TEST(HardCase27Lamps, OnTheMembraneItLightsItsOwnSideOnly) {
  // The lens lies in the membrane's plane. What it sends along that plane lights nothing; what it sends down comes
  // back from the glass alone.
  Worst most{0.0};
  for (const double sense : {-1.0, 1.0}) {
    Scene scene = sheet();
    scene.lamps.push_back(lamp_at({1, 0, 0}, {0, 0, sense}, 0.5, 1.0));
    scene.interreflection = false;
    EXPECT_EQ(most(render_checked(scene, few_pixels()).most()), 0.0) << sense;
  }
  did("a lamp in the membrane's own plane, facing either way: the membrane shows {}", most.seen);
}

TEST(HardCase27Lamps, CloseToTheMembraneItLightsAsItsIntegralSays) {
  // A lens of radius R at height h over a white sheet, an even intensity of I from all of it: under its middle
  // E = int I / (pi R^2) h / (h^2 + r^2)^(3/2) dA = 2 I / R^2 (1 - h / hypot(h, R)).
  constexpr double kRadius = 0.5;
  Worst away{0.02};
  for (const double height : {0.5, 0.05, 0.005}) {
    Scene scene = empty_scene(0.0);
    scene.surfaces.push_back({square_sheet(200.0, 0.0, false), Lambertian{grey(1.0)}});
    scene.lamps.push_back(lamp_at({0, 0, -height}, {0, 0, 1}, kRadius, 2.0 * kPi));
    const double irradiance = 2e6 / (kRadius * kRadius) * (1.0 - height / std::hypot(height, kRadius));
    const Tracer tracer(scene);
    const double seen = tracer.radiance({0, 0, -5}, {0, 0, 1}, samples(1 << 18))[0] * kPi;
    EXPECT_LT(away(std::abs(seen / irradiance - 1.0)), away.bar) << height;
    if (height >= 0.05) render_checked(scene, few_pixels(), 1024);
  }
  did("a lamp of 1 mm 0.5, 0.05 and 0.005 mm off a sheet: its light differs from the integral's by {}",
      away.text("relative"));
}

TEST(HardCase27Lamps, InsideABodyOrBehindTheMembraneLightsNothing) {
  Scene scene = sheet();
  scene.balls.push_back({{6, 0, -15}, 1.0, Lambertian{grey(1.0)}});
  scene.lamps.push_back(lamp_at({6, 0, -15}, {-6, 0, 15}, 0.2, 1.0));
  scene.lamps.push_back(lamp_at({0, 0, 5}, {0, 0, -1}, 0.2, 1.0));
  scene.interreflection = false;
  const double most = render_checked(scene, few_pixels()).most();
  EXPECT_EQ(most, 0.0);
  did("a lamp inside a ball and one behind the membrane: the membrane shows {}", most);
}

TEST(HardCase28Lamps, NoLightAtAllIsZero) {
  Scene scene = sheet();
  scene.lamps.push_back(lamp_at({8, 0, -20}, {-8, 0, 20}, 0.5, 0.0));
  const double most = render_checked(scene, few_pixels()).most();
  EXPECT_EQ(most, 0.0);
  did("a lamp of 0 W: the picture is {} everywhere", most);
}

TEST(HardCase27Lamps, SurroundingsAloneAreEnough) {
  Scene scene = sheet(1.0);
  scene.environment = grey(2.0);
  scene.surfaces[0].mesh = square_sheet(1000.0, 0.0, false);
  const Seen seen = render_checked(scene, few_pixels(), 64, 10000);
  EXPECT_TRUE(seen.is(2.0));
  did("no lamp, a sky of 2 over a white membrane: {}", seen.range());
}

TEST(HardCase28Lamps, LightBeyondSinglePrecisionIsRefusedByName) {
  const auto said = [](const Scene& blinding) {
    const std::string message = refusal_of(blinding);
    did("light of 1e300 is {}", refused(message));
    return message;
  };
  Scene scene = sheet();
  scene.environment = grey(1e300);
  EXPECT_THAT(said(scene), HasSubstr("environment"));
  scene = sheet();
  scene.lamps.push_back(lamp_at({8, 0, -20}, {-8, 0, 20}, 0.5, 1e300));
  EXPECT_THAT(said(scene), HasSubstr("lamp 0: power_W"));
  scene = sheet();
  scene.balls.push_back({{0, 0, -2}, 0.5, Emitter{grey(1e300)}});
  EXPECT_THAT(said(scene), HasSubstr("ball 0: radiance"));
}

TEST(HardCase28Lamps, TheBrightestThatIsTakenStaysFiniteAndTheFaintestCounts) {
  Worst away{1e-5};
  for (const double power : {1e-30, 1e12}) {
    Scene scene = sheet();
    scene.lamps.push_back(lamp_at({8, 0, -20}, {-8, 0, 20}, 0.5, power));
    Scene plain = sheet();
    plain.lamps.push_back(lamp_at({8, 0, -20}, {-8, 0, 20}, 0.5, 1.0));
    const Seen a = render_checked(scene, few_pixels(), 64);
    const Seen b = render_checked(plain, few_pixels(), 64);
    EXPECT_LT(away(((a.mean / power - b.mean).abs() / b.most()).maxCoeff()), away.bar) << power;
  }
  did("a lamp of 1e-30 W and one of 1e12 W: the picture of 1 W times as much, to {} of the brightest", away.text());
}

TEST(HardCase27Lamps, APencilOfLightKeepsItsPower) {
  // The narrowest lobe that is taken, 1e-4 rad: a spot of 2 um on the sheet, seen by one pixel among many.
  Scene scene = empty_scene(0.0);
  scene.surfaces.push_back({square_sheet(50.0, 0.0, false), Lambertian{grey(1.0)}});
  SpotLamp lamp = lamp_at({0, 0, -10}, {0, 0, 1}, 0.0, 1.0);
  lamp.half_angle = 1.1e-4;
  lamp.soft_angle = 0.0;
  scene.lamps.push_back(lamp);
  const double expected = 1e6 / (kPi * std::pow(10.0 * std::tan(1.1e-4), 2) * kPi);
  Worst away{1e-3};
  EXPECT_LT(away(std::abs(Tracer(scene).radiance({0, 0, -5}, {0, 0, 1}, samples(4))[0] / expected - 1.0)), away.bar);
  did("a pencil of light of 1e-4 rad: its spot is as bright as its power says, to {}", away.text("relative"));
}

}  // namespace
}  // namespace touchstone::render
