// The hard cases of light, 28 and 29: cameras, imagers and event pixels at their limits. What a good program does with
// each stands in script/hard_cases_page.py.

#include <gmock/gmock.h>

#include "core/units.h"
#include "light_laws.h"
#include "render/events/event_pixels.h"
#include "render/imager/imager.h"

namespace touchstone::render {
namespace {

using ::testing::HasSubstr;

Scene sky_and_sheet() {
  Scene scene = sensor_stack(1.0);
  scene.surfaces.push_back({square_sheet(12.0, 0.0, false), Lambertian{grey(0.7)}});
  return scene;
}

LensCamera one_lens() {
  LensCamera lens;
  lens.width = 6;
  lens.height = 4;
  lens.pixel_pitch_um = 333.0;
  lens.matrix = {9.0, 9.0, 2.5, 1.5};
  lens.aperture_mm = 0.5;
  lens.focus_distance_mm = 27.0;
  lens.gel_from_camera = few_pixels().gel_from_camera;
  return lens;
}

double mean_irradiance(const Scene& scene, const Camera& camera, int count = 4096) {
  const cv::Mat image = Tracer(scene).render(camera, samples(count)).irradiance;
  EXPECT_TRUE(cv::checkRange(image, true, nullptr, 0.0, std::numeric_limits<double>::max()));
  return cv::mean(image)[0];
}

TEST(HardCase28Camera, OnePixelIsTheMeanOfMany) {
  PinholeCamera one = few_pixels();
  one.width = one.height = 1;
  one.pixel_pitch_um = 1200.0;
  PinholeCamera many = one;
  many.width = many.height = 12;
  many.pixel_pitch_um = 100.0;
  const double a = mean_irradiance(sky_and_sheet(), one, 1 << 15);
  const double b = mean_irradiance(sky_and_sheet(), many, 1 << 8);
  Worst away{5e-3};
  EXPECT_LT(away(std::abs(a / b - 1.0)), away.bar);
  did("a sensor of one pixel against 144 on the same area: light differs by {}", away.text("relative"));
  render_checked(sky_and_sheet(), one);
  EXPECT_EQ(Tracer(sky_and_sheet()).preview(one, 100).size(), cv::Size(1, 1));
}

TEST(HardCase28Camera, AHoleOfNoSizeIsRefusedByName) {
  const Tracer tracer(sky_and_sheet());
  for (const double diameter : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), HUGE_VAL}) {
    PinholeCamera camera = few_pixels();
    camera.hole_diameter_um = diameter;
    const std::string of_hole = refusal([&] { tracer.render(camera, samples(1)); });
    EXPECT_THAT(of_hole, HasSubstr("hole_diameter_um")) << diameter;
    LensCamera lens = one_lens();
    lens.aperture_mm = diameter;
    const std::string of_lens = refusal([&] { tracer.render(lens, samples(1)); });
    EXPECT_THAT(of_lens, HasSubstr("aperture_mm")) << diameter;
    if (diameter == 0.0) did("a hole of no size is {}\na lens of none is {}", refused(of_hole), refused(of_lens));
  }
}

TEST(HardCase28Camera, AMinuteHolePassesItsArea) {
  PinholeCamera camera = few_pixels();
  camera.foil_thickness_um = 0.0;
  const double wide = mean_irradiance(empty_scene(1.0), camera);
  camera.hole_diameter_um = 1e-6;
  Worst away{1e-3};
  const double area = std::pow(camera.hole_diameter_um / few_pixels().hole_diameter_um, 2);
  EXPECT_LT(away(std::abs(mean_irradiance(empty_scene(1.0), camera) / wide / area - 1.0)), away.bar);
  did("a hole of 1e-6 um passes light in proportion to its area, to {}", away.text("relative"));
}

TEST(HardCase28Camera, AHoleAsWideAsItsDistanceIsTheDiscsFormFactorAndWiderOnesAreRefused) {
  PinholeCamera camera = few_pixels();
  camera.width = camera.height = 1;
  camera.pixel_pitch_um = 1.0;
  camera.foil_thickness_um = 0.0;
  Worst away{2e-3};
  // A disc of radius R at distance d: E = pi L sin^2, sin = R / hypot(R, d).
  for (const double diameter_mm : {3.0, 12.0}) {
    camera.hole_diameter_um = 1e3 * diameter_mm;
    const double r = 0.5 * diameter_mm;
    const double expected = kPi * r * r / (r * r + 9.0);
    EXPECT_LT(away(std::abs(mean_irradiance(empty_scene(1.0), camera, 1 << 16) / expected - 1.0)), away.bar)
        << diameter_mm;
    render_checked(empty_scene(1.0), camera);
  }
  did("a hole as wide as its distance and four times that: light differs from the disc's form factor by {}",
      away.text("relative"));
  const Tracer tracer(sky_and_sheet());
  for (const double diameter_um : {1e6, 1e9, 1e300}) {
    camera.hole_diameter_um = diameter_um;
    const std::string message = refusal([&] { tracer.render(camera, samples(1)); });
    EXPECT_THAT(message, HasSubstr("hole_diameter_um")) << diameter_um;
    if (diameter_um == 1e6) did("a hole of a metre is {}", refused(message));
    LensCamera lens = one_lens();
    lens.aperture_mm = 1e-3 * diameter_um;
    EXPECT_THAT(refusal([&] { tracer.render(lens, samples(1)); }), HasSubstr("aperture_mm")) << diameter_um;
  }
}

TEST(HardCase28Camera, AFoilThatHidesAllGivesADarkPicture) {
  PinholeCamera camera = few_pixels();
  camera.hole_diameter_um = 1.0;
  camera.foil_thickness_um = 2900.0;
  const cv::Mat image = Tracer(sky_and_sheet()).render(camera, samples(64)).irradiance;
  EXPECT_TRUE(cv::checkRange(image, true, nullptr, 0.0, 1e9));
  EXPECT_EQ(image.at<float>(0, 0), 0.0F);
  did("a hole of 1 um through 2.9 mm of foil: the corner's pixel gets {}", image.at<float>(0, 0));
}

TEST(HardCase28Camera, ALensFocusedAtAHairsBreadthKeepsTheSky) {
  LensCamera lens = one_lens();
  lens.focus_distance_mm = 1e-3;
  const Seen seen = render_checked(empty_scene(2.0), lens, 64);
  EXPECT_TRUE(seen.is(2.0));
  did("a lens focused at 0.001 mm under a sky of 2: {}", seen.range());
}

Imager grey_sensor() {
  Imager imager;
  imager.bits = 12;
  imager.active_area_um2 = 10.0;
  imager.exposure_s = 1e-3;
  imager.quantum_efficiency = QuantumEfficiency::Constant(1, 1, 0.5);
  imager.wavelengths_nm = grey(550.0);
  imager.full_well_e = 1e4;
  imager.read_noise_e = 3.0;
  imager.gain_DN_per_e = 0.4;
  imager.black_level_DN = 20.0;
  return imager;
}

cv::Mat light(double irradiance) {
  return cv::Mat(16, 16, CV_32FC1, cv::Scalar(irradiance));
}

TEST(HardCase28Imager, NoLightAndNoTimeGiveTheBlackLevel) {
  Imager imager = grey_sensor();
  imager.read_noise_e = 0.0;
  const cv::Mat black(16, 16, CV_16U, cv::Scalar(20));
  const double without_light = cv::norm(expose(light(0.0), imager, 1, 1), black, cv::NORM_INF);
  EXPECT_EQ(without_light, 0.0);
  imager.exposure_s = 0.0;
  imager.dark_current_e_per_s = 1e9;
  const double without_time = cv::norm(expose(light(1e30), imager, 1, 1), black, cv::NORM_INF);
  EXPECT_EQ(without_time, 0.0);
  did("no light: pixels {} DN from the black level; no exposure under light of 1e30: {} DN from it", without_light,
      without_time);
}

TEST(HardCase28Imager, MoreLightThanTheWellHoldsIsTheWell) {
  Imager imager = grey_sensor();
  imager.read_noise_e = 0.0;
  Worst away{0.0};
  for (const double irradiance : {1e3, 1e10, 3e38}) {
    const cv::Mat raw = expose(light(irradiance), imager, 1, 1);
    EXPECT_EQ(away(cv::norm(raw, cv::Mat(16, 16, CV_16U, cv::Scalar(20 + 4000)), cv::NORM_INF)), 0.0) << irradiance;
  }
  did("light of 1e3 to 3e38 W/m^2: pixels {} DN from a full well", away.seen);
  EXPECT_GT(noise_e(response_of(imager), 1e4), 0.0);
}

TEST(HardCase28Imager, OnePixelAndOneBit) {
  Imager imager = grey_sensor();
  const cv::Mat one(1, 1, CV_32FC1, cv::Scalar(0.1));
  EXPECT_EQ(expose(one, imager, 1, 1).size(), cv::Size(1, 1));
  imager.bits = 1;
  imager.black_level_DN = 0.0;
  imager.gain_DN_per_e = 1e-4;
  const cv::Mat raw = expose(one, imager, 1, 1);
  EXPECT_LE(raw.at<unsigned char>(0, 0), 1);
  did("an imager of one pixel and one bit gives {} DN", raw.at<unsigned char>(0, 0));
}

EventPixelSettings quiet(double threshold) {
  EventPixelSettings settings;
  settings.on_threshold = settings.off_threshold = threshold;
  settings.dark_intensity = 1.0;
  return settings;
}

cv::Mat one_pixel(double intensity) {
  return cv::Mat(1, 1, CV_32FC1, cv::Scalar(intensity));
}

// Tested in depth in tests/render/events/event_pixels_test.cpp; here the four cases of the list.
TEST(HardCase29, ZeroLightIsSilentAndAStepOfAMillionAndBackIsCounted) {
  for (const double threshold : {0.2, kLeastEventThreshold}) {
    EventPixels pixels(quiet(threshold), {1, 1}, 1, 1);
    std::vector<Event> events;
    for (int t = 0; t < 10; ++t) pixels.advance(one_pixel(0.0), t, events);
    EXPECT_TRUE(events.empty());
    const std::size_t in_the_dark = events.size();
    const double step = std::log(1e6);
    pixels.advance(one_pixel(1e6 - 1.0), 20, events);
    EXPECT_NEAR(static_cast<double>(events.size()), step / threshold, 1.0);
    for (const Event& event : events) EXPECT_TRUE(event.on);
    const std::size_t up = events.size();
    pixels.advance(one_pixel(0.0), 21, events);  // within one microsecond
    EXPECT_NEAR(static_cast<double>(events.size() - up), step / threshold, 1.0);
    EXPECT_TRUE(std::all_of(events.begin() + static_cast<std::ptrdiff_t>(up), events.end(),
                            [](const Event& event) { return !event.on && event.t_us == 21; }));
    did("threshold {}: {} events in the dark, {} up a step of 1e6 to 1, {} down it within a microsecond (theory "
        "{:.1f})",
        threshold, in_the_dark, up, events.size() - up, step / threshold);
  }
}

TEST(HardCase29, ThresholdsNearZeroAreRefusedByName) {
  for (const double threshold : {0.0, -0.1, 1e-9, std::numeric_limits<double>::quiet_NaN()}) {
    EventPixelSettings settings = quiet(threshold);
    const std::string message = refusal([&] { check(settings); });
    EXPECT_THAT(message, HasSubstr("on_threshold")) << threshold;
    if (threshold == 1e-9) did("a threshold of 1e-9 is {}", refused(message));
  }
  EventPixelSettings blind = quiet(0.2);
  blind.dark_intensity = 0.0;
  const std::string message = refusal([&] { check(blind); });
  EXPECT_THAT(message, HasSubstr("dark_intensity"));
  did("a pixel whose photocurrent may be 0 is {}", refused(message));
}

TEST(HardCase29, ASlowPixelInTheDarkNeitherHangsNorRings) {
  EventPixelSettings settings = quiet(0.2);
  settings.bandwidth_hz = 3000.0;
  settings.reference_intensity = 1e6;
  EventPixels pixels(settings, {1, 1}, 1, 1);
  std::vector<Event> events;
  pixels.advance(one_pixel(1e6), 0, events);
  pixels.advance(one_pixel(0.0), 1, events);
  pixels.advance(one_pixel(0.0), 1000000000000, events);  // eleven days
  EXPECT_NEAR(static_cast<double>(events.size()), std::log(1e6 + 1.0) / 0.2, 1.0);
  for (const Event& event : events) EXPECT_FALSE(event.on);
  did("a slow pixel in the dark for eleven days after light of 1e6: {} events (theory {:.1f}), all of them down",
      events.size(), std::log(1e6 + 1.0) / 0.2);
}

}  // namespace
}  // namespace touchstone::render
